//! Small changes of a text, one of which may heal a model that fails: each undoes a slip of the pen that is common.
//!
//! Nothing here knows whether a change heals; whoever asks tries them, one after the other in the order of their ranks, and proposes those
//! after which the model translates and runs.  That a program is repaired by trying small changes is an old thought (Debroy and Wong, Using
//! mutation to automatically suggest fixes for faulty programs, 2010); which changes are worth trying is taken from `tests/doctor`.
//! Assertions and what they compare with are never changed: they say what is meant.

mod asserted;
mod balances;
mod copied;
mod declarations;
mod defaults;
mod equations;
mod expressions;
mod numbers;
mod quantities;

use std::collections::BTreeSet;

use asserted::Asserted;
use defaults::Classes;
use hyd_flat::FlatModel;
use hyd_source::{Code, Diagnostic, Edit, FileId, Files, Proposal, Severity, Span};
use hyd_syntax::tree::{ClassBody, ClassDef, Component, Element, EquationKind, EquationSection, ExprKind, Variability};

/// What has failed; several may be true at once.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Trouble {
    /// Names, types, sizes, units, or what may stand where.
    pub text: bool,
    /// More equations than unknowns.
    pub too_many: bool,
    /// Unknowns that no equation determines.
    pub too_few: bool,
    /// No initial values.
    pub start: bool,
    /// The run.
    pub run: bool,
    /// An assertion: the equations have a solution, but none that is meant.
    pub judged: bool,
    /// Events whose intervals shrink: many a change makes a bounce stop that has nothing to do with it.
    pub accumulates: bool,
    /// A variable grows without bound.
    pub grows: bool,
    /// An equation has lost its solution, or a value at the start is not defined: another sign gives another law, and brings many a run through.
    pub undefined: bool,
    /// Events that follow each other while time stands still: other numbers or signs bring a run past them that nobody means.
    pub chatters: bool,
}

impl Trouble {
    /// What the messages of a translation are about.
    pub fn of(diagnostics: &[Diagnostic]) -> Self {
        let mut trouble = Trouble::default();
        for own in diagnostics.iter().filter(|own| own.severity == Severity::Error) {
            match own.code {
                Code::Unbalanced | Code::Singular => {
                    trouble.too_many = true;
                    trouble.too_few = true;
                }
                Code::ConnectorMismatch | Code::ConnectionRule => trouble.too_few = true,
                Code::InitialUnbalanced => trouble.start = true,
                Code::Run => {}
                _ => trouble.text = true,
            }
        }
        trouble
    }

    /// True where anything is.
    pub fn any(self) -> bool {
        self != Trouble::default()
    }
}

/// How likely a change is what was meant, the likeliest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Rank {
    /// A number far from the usual that is usual in another unit.
    Unit,
    /// A parameter that has nothing but a start value is found by the initial equations.
    Determined,
    /// A number far from the default of its class that is near it in another unit, or converted by another factor.
    FarFromDefault,
    /// The same with the point elsewhere.
    Point,
    /// A slip at a place that messages mark.
    Marked,
    /// A connection with an end that is called almost the same, and has the number of the other end.
    Twins,
    /// A connection with an end that is called almost the same.
    Ends,
    /// A connection with an end to which nothing is connected.
    Open,
    /// What flows in at one connector of a component flows out at the other.
    Balance,
    /// A range of a loop.
    Loop,
    /// The start of a variable is fixed whose derivative at the start is given, too.
    Twice,
    /// What holds at the start.
    Start,
    /// When something is done.
    Moment,
    /// A motion that bounces comes to rest.
    Rest,
    /// The same where something may set it in motion again.
    RestForNow,
    /// A law ends where what it takes from is used up, with all that stands beside it.
    UsedUp,
    /// Something is done at the start, too, whatever its condition says.
    AtOnce,
    /// Two arguments or two sockets of a component exchanged.
    Exchanged,
    /// Another guess of an unknown.
    Guess,
    /// A start value that nobody has given.
    FirstStart,
    /// Another variable, power or operator with which the units of an equation fit.
    Quantity,
    /// A sign that is written as a number, such as that of an input of a sum, where something grows without bound.
    Convention,
    /// A number that may be of another unit by its size.
    OtherUnit,
    /// The same of a number without a unit, by what its equations make of it.
    InferredUnit,
    /// Two parameters of one kind with their numbers exchanged.
    Numbers,
    /// A connection that is missing, with an output that nothing reads.
    Unread,
    /// A connection that is missing.
    Joined,
    /// The sign of a term.
    Sign,
    /// A number that lacks a prefix.
    Prefix,
    /// A connection with any other end that messages name.
    OtherEnds,
    /// An equation or a connection is left out.
    LeftOut,
}

impl Rank {
    /// True where the first of several changes that heal is as good as the others, or better: what is fixed at the start by one of two
    /// components, a guess.  Of many equations any one can be left out, and many a sign can be turned round: there only what is alone is meant.
    pub fn first_is_best(self) -> bool {
        matches!(
            self,
            Rank::Unit
                | Rank::Determined
                | Rank::Marked
                | Rank::FarFromDefault
                | Rank::Point
                | Rank::Loop
                | Rank::Twice
                | Rank::Start
                | Rank::Moment
                | Rank::Rest
                | Rank::RestForNow
                | Rank::UsedUp
                | Rank::Guess
        )
    }
}

/// A change worth trying.
#[derive(Clone, PartialEq, Debug)]
pub struct Change {
    /// How likely it is.
    pub rank: Rank,
    /// It touches a line that a message marks.
    pub marked: bool,
    /// It changes the sign of an equation that relates two variables (`T = port.T`, `der(x) = v`), or of a number: where that heals, any other sign is
    /// less certain, and it is hardly meant itself.
    pub is_definition: bool,
    /// What it does.
    pub proposal: Proposal,
}

/// The changes of a file of a model that has failed with these messages, the likeliest first.
pub fn changes(
    files: &Files,
    file: FileId,
    trouble: Trouble,
    messages: &[Diagnostic],
    model: Option<(&FlatModel, &[(hyd_flat::VarId, String)])>,
) -> Vec<Change> {
    let text = files.text(file);
    let stored = hyd_syntax::parse(file, text).value;
    // What joins both ends of a component is seen in the connections themselves.
    let told = || messages.iter().filter(|own| own.code != Code::ShortCircuit);
    let labels = told().flat_map(|own| &own.labels).filter(|own| own.span.file == file);
    let begins: Vec<u32> = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at as u32 + 1)).collect();
    let line = |byte: u32| begins.partition_point(|&begin| begin <= byte);
    let marked = labels.flat_map(|own| line(own.span.start)..=line(own.span.end)).collect::<BTreeSet<usize>>();
    let misfits = messages.iter().filter(|own| own.code == Code::UnitMismatch && own.severity == Severity::Error);
    let misfits = misfits.filter_map(|own| own.labels.first()).filter(|own| own.span.file == file);
    let units = misfits.map(|own| line(own.span.start)).collect();
    let said = told().flat_map(|own| std::iter::once(&own.message).chain(&own.notes));
    let names = said.flat_map(|own| own.split('`').skip(1).step_by(2)).map(str::to_string).collect();
    let unconnected = messages.iter().filter(|own| own.message.starts_with("nothing is connected to"));
    let open = unconnected.flat_map(|own| own.message.split('`').skip(1).step_by(2)).map(str::to_string).collect();
    let asserted = Asserted::of(&stored.classes);
    let surplus = told().find_map(|own| own.message.split_once(" too many in `")?.1.split_once("` beside"));
    let surplus = surplus.map(|(class, _)| class.to_string());
    let begins_at_zero =
        told().flat_map(|own| &own.notes).filter_map(|own| own.split_once("` has no start value and begins at 0"));
    let without_start = begins_at_zero.map(|(name, _)| name.trim_start_matches('`').to_string()).collect();
    let mut found = Found {
        text,
        file,
        trouble,
        begins,
        marked,
        names,
        open,
        asserted,
        has_bases: surplus.as_deref().is_some_and(|own| extends(&stored.classes, own)),
        surplus,
        initial_surplus: told().any(|own| own.message.contains("the initial equation `")),
        without_start,
        units,
        undefined: told()
            .flat_map(|own| &own.notes)
            .filter_map(|own| own.strip_prefix("there "))
            .map(str::to_string)
            .collect(),
        cycle: told().any(|own| own.code == Code::DiscreteLoop),
        gains: model.map_or_else(Vec::new, |(flat, _)| gains(flat, file)),
        quantities: Vec::new(),
        longest_delay: told().find_map(|own| longest_delay(&own.message)),
        classes: Classes::of(&stored.classes),
        same_for_all: Vec::new(),
        signals: BTreeSet::new(),
        rates_given: BTreeSet::new(),
        begin_of_sections: None,
        is_definition: false,
        changes: Vec::new(),
    };
    for class in &stored.classes {
        found.class(class);
    }
    found.all_the_same();
    if let Some((flat, inferred)) = model.filter(|_| trouble.start || trouble.run) {
        found.numbers(flat, inferred);
    }
    let mut changes = found.changes;
    changes.retain(|own| {
        let is_of_rest = matches!(own.rank, Rank::Rest | Rank::RestForNow | Rank::Marked | Rank::Unit);
        let is_of_chance = matches!(own.rank, Rank::Numbers | Rank::Sign);
        (!trouble.accumulates || is_of_rest) && !((trouble.chatters || trouble.undefined) && is_of_chance)
    });
    let mut known = BTreeSet::new();
    changes.retain(|own| {
        let edits = own.proposal.edits.iter().map(|edit| (edit.span.start, edit.span.end, edit.text.clone()));
        known.insert(edits.collect::<Vec<_>>())
    });
    changes.sort_by_key(|own| (own.rank, !own.marked, own.is_definition));
    changes
}

/// What is being collected for one file.
struct Found<'a> {
    text: &'a str,
    file: FileId,
    trouble: Trouble,
    /// First bytes of the lines.
    begins: Vec<u32>,
    /// Lines, from 1, that messages mark.
    marked: BTreeSet<usize>,
    /// Words in backquotes of the messages.
    names: BTreeSet<String>,
    /// Connectors to which nothing is connected.
    open: Vec<String>,
    asserted: Asserted,
    /// The class that has equations too many, if messages say which.
    surplus: Option<String>,
    /// That class extends others.
    has_bases: bool,
    /// Messages say that an initial equation contradicts the other conditions.
    initial_surplus: bool,
    /// Where further declarations of the class at hand may stand: the first byte of the line that begins its sections.
    begin_of_sections: Option<u32>,
    /// Variables that begin at 0 because they have no start value.
    without_start: BTreeSet<String>,
    /// Lines with units that do not fit.
    units: BTreeSet<usize>,
    /// What messages say of the values that an undefined one is computed from.
    undefined: Vec<String>,
    /// Discrete variables depend on each other.
    cycle: bool,
    /// Signs that library components have by their declarations: component, parameter, 1 or -1.
    gains: Vec<(String, String, f64)>,
    /// Scalars of the class at hand.
    quantities: Vec<String>,
    /// The bound of a `delay` that its time exceeds, as it is written, and its value.
    longest_delay: Option<(String, f64)>,
    classes: Classes,
    /// Modifiers that may be the same for all elements of an array, and the change that says so.
    same_for_all: Vec<(String, Edit)>,
    /// Inputs and outputs of the components of the class at hand.
    signals: BTreeSet<String>,
    /// Variables of the class at hand whose derivatives the initial equations state.
    rates_given: BTreeSet<String>,
    /// The equation at hand says how two variables belong together.
    is_definition: bool,
    changes: Vec<Change>,
}

impl Found<'_> {
    fn class(&mut self, class: &ClassDef) {
        for nested in hyd_instance::class::nested_classes(class) {
            self.class(&nested.class);
        }
        let ClassBody::Long { elements, equations, .. } = &class.body else { return };
        let components: Vec<_> = elements
            .iter()
            .filter_map(|element| match element {
                Element::Component(component) => Some(component),
                _ => None,
            })
            .collect();
        self.rates_given = self.rates_given(equations);
        self.signals = self.signals(&components);
        let scalars = components.iter().filter(|own| own.dims.is_empty());
        self.quantities = scalars.map(|own| own.name.name.to_string()).collect();
        let starts = self.components(&components);
        self.begin_of_sections = components.last().and_then(|last| self.begin_of_sections(last.name.span.end));
        let settings = components.iter().filter(|own| own.variability <= Variability::Parameter);
        let settings: BTreeSet<&str> = settings.map(|own| &*own.name.name).collect();
        // What a class extends belongs to it.
        let is_balanced = self.surplus.as_ref().is_some_and(|own| **own != *class.name.name && !self.has_bases);
        let too_many = self.trouble.too_many;
        self.trouble.too_many = too_many && !is_balanced;
        for section in equations {
            self.section(section, &starts, &settings);
        }
        self.trouble.too_many = too_many;
        self.copied(equations, &components);
        self.balances(class, equations);
        self.conventions(&components);
        self.sockets(equations);
        self.missing(equations, &components);
    }

    /// The first line behind a declaration that begins a section of equations or of an algorithm: what is declared stands before it.
    fn begin_of_sections(&self, from: u32) -> Option<u32> {
        let is_section = |line: &str| {
            let line = line.trim_start();
            let line = line.strip_prefix("initial ").map_or(line, str::trim_start);
            let word: &str = line.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default();
            matches!(word, "equation" | "algorithm")
        };
        let rest = self.begins.iter().skip(self.line(from)).copied();
        rest.into_iter().find(|&begin| is_section(self.text[begin as usize..].lines().next().unwrap_or_default()))
    }

    /// What components of a class are given and give, as `name.input`.
    fn signals(&self, components: &[&Component]) -> BTreeSet<String> {
        let of = |component: &&Component| {
            let class = self.classes.named(&component.class)?;
            let own = self.classes.components(class).into_iter().filter(|own| own.direction.is_some());
            Some(own.map(|own| format!("{}.{}", component.name.name, own.name.name)).collect::<Vec<_>>())
        };
        components.iter().filter_map(of).flatten().collect()
    }

    /// Variables whose derivatives initial equations state.
    fn rates_given(&self, sections: &[EquationSection]) -> BTreeSet<String> {
        let initial = sections.iter().filter(|own| own.initial).flat_map(|own| &own.equations);
        let rates = initial.filter_map(|own| match &own.kind {
            EquationKind::Equal(left, _) => Some(self.snippet(left.span).strip_prefix("der(")?.strip_suffix(')')?),
            _ => None,
        });
        rates.map(|name| name.trim().to_string()).collect()
    }

    fn is_marked(&self, span: Span) -> bool {
        (self.line(span.start)..=self.line(span.end)).any(|own| self.marked.contains(&own))
    }

    /// The line of a byte, from 1.
    fn line(&self, byte: u32) -> usize {
        self.begins.partition_point(|&begin| begin <= byte)
    }

    fn snippet(&self, span: Span) -> &str {
        &self.text[span.start as usize..span.end as usize]
    }

    /// A stretch of text in one line.
    fn said(&self, span: Span) -> String {
        self.snippet(span).split_whitespace().collect::<Vec<_>>().join(" ")
    }

    fn edit(&self, from: u32, to: u32, text: impl Into<String>) -> Edit {
        Edit { span: Span { file: self.file, start: from, end: to }, text: text.into() }
    }

    fn replaced(&self, span: Span, text: impl Into<String>) -> Edit {
        self.edit(span.start, span.end, text)
    }

    fn push(&mut self, rank: Rank, message: impl Into<String>, edits: Vec<Edit>) {
        let marked = edits.iter().any(|own| self.is_marked(own.span));
        let is_definition = self.is_definition;
        let proposal = Proposal { message: message.into(), edits };
        self.changes.push(Change { rank, marked, is_definition, proposal });
    }

    /// A change of one stretch that is short enough to be said as it stands.
    fn write(&mut self, rank: Rank, span: Span, text: &str) {
        let old = self.said(span);
        let comments = |text: &str| text.matches("//").count() + text.matches("/*").count();
        if comments(text) < comments(self.snippet(span)) {
            return;
        }
        let edit = self.replaced(span, text);
        self.push(rank, format!("write `{text}` for `{old}`"), vec![edit]);
    }

    /// The equation with its semicolon.
    fn with_semicolon(&self, span: Span) -> Span {
        let rest = &self.text[span.end as usize..];
        let blank = rest.len() - rest.trim_start().len();
        match rest.trim_start().starts_with(';') {
            true => Span { end: span.end + blank as u32 + 1, ..span },
            false => span,
        }
    }
}

/// Gains of 1 and -1 that components have by a declaration that stands in another file.
fn gains(flat: &FlatModel, file: FileId) -> Vec<(String, String, f64)> {
    use hyd_flat::{Section, Target};
    let mut found = Vec::new();
    let bindings = flat.equations.iter().filter(|block| block.section == Section::Binding);
    for block in bindings.filter(|block| block.origin.span.file != file) {
        let Some(value) = flat.templates.arena.as_constant(flat.templates.get(block.template).right) else { continue };
        let Some(Target::Var(v)) = block.operands.first().map(|own| own.target()) else { continue };
        let (of, k) = flat.locate(v);
        let of = &flat.variables[of];
        if value.abs() != 1.0 || of.count != 1 || of.settable != hyd_system::Settable::Yes {
            continue;
        }
        let name = of.name.element(k);
        if let Some((component, gain)) = name.split_once('.')
            && gain.strip_prefix('k').is_some_and(|rest| rest.chars().all(|c| c.is_ascii_digit()))
        {
            found.push((component.to_string(), gain.to_string(), value));
        }
    }
    found
}

/// The bound that the time of a `delay` exceeds, of the message that says so: as it is written, and its value.
fn longest_delay(message: &str) -> Option<(String, f64)> {
    let call = message.split_once("the delay time of `delay(")?.1;
    let (arguments, rest) = call.split_once(")`")?;
    let bound = rest.split_once("its upper bound of ")?.1.split_once(' ')?.0;
    Some((arguments.rsplit(',').next()?.trim().to_string(), bound.parse().ok()?))
}

/// True if a class of this name, or one with the same name within another, extends something.
fn extends(classes: &[std::sync::Arc<ClassDef>], name: &str) -> bool {
    classes.iter().any(|class| {
        let ClassBody::Long { elements, .. } = &class.body else { return *class.name.name == *name };
        let own = *class.name.name == *name && elements.iter().any(|own| matches!(own, Element::Extends(..)));
        own || hyd_instance::class::nested_classes(class)
            .into_iter()
            .any(|nested| extends(std::slice::from_ref(&nested.class), name))
    })
}

/// True for a reference of one part with this name.
fn is_named(reference: &hyd_syntax::tree::ComponentRef, name: &str) -> bool {
    matches!(&reference.parts[..], [only] if &*only.name.name == name)
}

/// The value of a number that stands in the text.
fn number(expr: &hyd_syntax::tree::Expr) -> Option<f64> {
    use hyd_syntax::tree::UnaryOp;
    match &expr.kind {
        ExprKind::Integer(value) => Some(*value as f64),
        ExprKind::Real(value) => Some(*value),
        ExprKind::Unary(UnaryOp::Minus, of) => number(of).map(|value| -value),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use hyd_source::{Code, Diagnostic, Files, Span};

    use super::{Rank, Trouble, changes};

    /// The texts that come of a text, with their ranks; the message marks the line with these words.
    fn texts(text: &str, trouble: Trouble, marked: &str) -> Vec<(Rank, String)> {
        told(text, trouble, marked, "it fails")
    }

    /// The same where the message says this.
    fn told(text: &str, trouble: Trouble, marked: &str, message: &str) -> Vec<(Rank, String)> {
        let mut files = Files::new();
        let file = files.add("m.mo", text);
        let at = text.find(marked).expect("it is there");
        let message = Diagnostic::error(Code::Run, message).at(Span::new(file, at, at + marked.len()), "");
        let found = changes(&files, file, trouble, &[message], None);
        let made = found.into_iter().map(|change| {
            let mut text = text.to_string();
            let mut edits = change.proposal.edits.clone();
            edits.sort_by_key(|own| own.span.start);
            for edit in edits.iter().rev() {
                text.replace_range(edit.span.start as usize..edit.span.end as usize, &edit.text);
            }
            (change.rank, text)
        });
        made.collect()
    }

    #[test]
    fn each_slip_is_undone() {
        let run = Trouble { run: true, ..Trouble::default() };
        let start = Trouble { start: true, ..run };
        let text = Trouble { text: true, ..Trouble::default() };
        let too_many = Trouble { too_many: true, ..Trouble::default() };
        for (trouble, rank, before, after) in [
            (run, Rank::Sign, "m*der(v) = k*s - d*v", "m*der(v) = -k*s - d*v"),
            (run, Rank::Sign, "m*der(v) = k*s - d*v", "m*der(v) = k*s + d*v"),
            (run, Rank::Sign, "q = -g*(p - 1)", "q = g*(p - 1)"),
            (run, Rank::Marked, "q = sqrt(p - 1)", "q = sign(p - 1)*sqrt(abs(p - 1))"),
            (run, Rank::Marked, "q = (p - 1)^1.25", "q = sign(p - 1)*abs(p - 1)^1.25"),
            (run, Rank::AtOnce, "when h > 1 then n = 2*h; end when", "when {initial(), h > 1} then n = 2*h; end when"),
            (run, Rank::Moment, "when h > 1 then n = 2*h; end when", "n = if h > 1 then 2*h else 0"),
            (text, Rank::Loop, "for i in 0:n - 1 loop x[i] = 1; end for", "for i in 1:n loop x[i] = 1; end for"),
            (text, Rank::Loop, "for i in 1:n - 2 loop x[i] = 1; end for", "for i in 1:n - 1 loop x[i] = 1; end for"),
            (text, Rank::Exchanged, "q = f(a + 1, b)", "q = f(b, a + 1)"),
            (too_many, Rank::LeftOut, "x = 1", ""),
            (run, Rank::Marked, "der(h) = -k*sqrt(2*h)", "der(h) = if 2*h > 0 then -k*sqrt(max(2*h, 0)) else 0"),
        ] {
            let whole = |own: &str| match own {
                "" => "model M\nequation\n  \nend M;\n".to_string(),
                own => format!("model M\nequation\n  {own};\nend M;\n"),
            };
            let found = texts(&whole(before), trouble, before);
            assert!(found.contains(&(rank, whole(after))), "{before}: {found:#?}");
        }
        // What holds at the start is a value that does not change.
        let with = |own: &str| format!("model M\n  parameter Real a = 2;\n  Real x;\nequation\n  {own}\nend M;\n");
        let moved = |own: &str| {
            let found = texts(&with(own), too_many, own);
            found.iter().any(|(rank, text)| *rank == Rank::Start && text.contains("initial equation"))
        };
        assert!(moved("x = 2*a;") && moved("x = -1;"));
        assert!(!moved("x = 2*time;") && !moved("x = der(y);") && !moved("x = y;") && !moved("2*x = a;"));
        // A parameter that only has a start may be meant to be found, where the conditions are one too many.
        let found = "model M\n  parameter Real u(start = 10);\nend M;\n";
        let meant = found.replace("10", "10, fixed = false");
        let surplus = "the initial equation `x = 1` contradicts the other conditions of `x`";
        assert!(told(found, start, "parameter", surplus).contains(&(Rank::Determined, meant)));
        assert!(texts(found, start, "parameter").iter().all(|(rank, _)| *rank != Rank::Determined));
        let fixed = "model M\n  Real x(start = 1, fixed = true);\nend M;\n";
        assert!(texts(fixed, start, "Real x").contains(&(Rank::Start, fixed.replace("true", "false"))));
    }

    #[test]
    fn chance_does_not_end_chattering() {
        let text = "model M\n  parameter Real a(unit = \"K\") = 1;\n  parameter Real b(unit = \"K\") = 2;\nequation\n  der(x) = a - b;\nend M;\n";
        let run = Trouble { run: true, ..Trouble::default() };
        let ranks = |trouble: Trouble| -> Vec<Rank> {
            let found = ["parameter", "der(x)"].iter().flat_map(|part| texts(text, trouble, part));
            found.map(|(rank, _)| rank).filter(|rank| matches!(rank, Rank::Numbers | Rank::Sign)).collect()
        };
        assert!(!ranks(run).is_empty());
        assert_eq!(ranks(Trouble { chatters: true, ..run }), []);
    }

    #[test]
    fn what_an_assertion_says_stays() {
        let text = "model M\nequation\n  assert(x - 1 < 2 + y, \"no\");\nend M;\n";
        let all = Trouble {
            text: true,
            too_many: true,
            too_few: true,
            start: true,
            run: true,
            judged: true,
            accumulates: false,
            chatters: false,
            grows: true,
            undefined: false,
        };
        assert_eq!(texts(text, all, "assert"), []);
        // What it compares with, in whatever words, in algorithms, too.
        for limits in [
            "parameter Real limit = 2;\n  parameter Real other = 5;\n  Real h;\nequation\n  assert(h < limit, \"no\");",
            "parameter Real limit = 2;\n  parameter Real other = 5;\n  Real h;\nalgorithm\n  assert(h < limit, \"no\");",
            "parameter Real limit = 2;\n  parameter Real other = 5;\n  Real h;\n  Boolean high = h > limit;\nequation\n  assert(not high, \"no\");",
            "parameter Real limit = 2;\n  parameter Real other = 5;\n  Real h;\n  Boolean high;\nequation\n  high = h > limit;\n  assert(not high, \"no\");",
            "parameter Real limits[3] = {1, 5, 3};\n  Real h;\nequation\n  assert(h < limits[3], \"no\");",
        ] {
            let text = format!("model M\n  {limits}\nend M;\n");
            let found = texts(&text, all, "assert");
            let is_exchange = |rank: Rank| matches!(rank, Rank::Exchanged | Rank::Numbers);
            assert!(!found.iter().any(|(rank, _)| is_exchange(*rank)), "{text}: {found:#?}");
        }
        // Two numbers of one unit of which no assertion knows are exchanged; sizes and numbers of different units are not.
        let free = "model M\n  parameter Real a(unit = \"m\") = 2;\n  parameter Real b(unit = \"m\") = 5;\n  parameter Real c = 7;\n  \
                    parameter Real d(unit = \"s\") = 9;\n  parameter Integer n = 3;\n  parameter Integer seed = 4000;\nend M;\n";
        let found = texts(free, all, "Real a").into_iter().filter(|own| own.0 == Rank::Numbers);
        let found: Vec<String> = found.map(|own| own.1).collect();
        assert_eq!(
            found,
            [free.replace(") = 2", ") = 5").replacen(") = 5;\n  parameter Real c", ") = 2;\n  parameter Real c", 1)]
        );
    }
}
