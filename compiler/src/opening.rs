//! Openings of a text: variables that let something in where an equation of the text decides alone.
//!
//! A term is added to the right side of an equation, or a variable takes the place of that side; both are declared in the class, so that
//! a model that extends it can give them a value.  No line moves, so that messages point where they did.  [`commands`] finds the variables
//! that a text gives courses in time, which are what is replaced.

use std::ops::Range;
use std::sync::Arc;

use hyd_source::{Files, Span};
use hyd_syntax::names::names;
use hyd_syntax::one_line;
use hyd_syntax::tree::{
    Argument, ClassBody, Component, ComponentRef, Direction, Element, ElementModification, Equation, EquationKind,
    Expr, ExprKind, Variability,
};

use crate::balance::{rate_of, sides, walk, written};
use crate::stand_in;

/// A place in a text where a further term is let in.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Opening {
    /// Name of the file that it is a place in.
    pub file: Arc<str>,
    /// Line of the equation, from 1; of the declaration, where something stands in for an input.
    pub line: u32,
    /// The equation as in [`crate::InjectionSite::text`], or the name of the input.
    pub equation: String,
    /// Name of the variable.
    pub name: String,
    /// What the variable is, in words.
    pub words: String,
    /// What multiplies it there, in names of the class; nothing if empty.
    pub factor: String,
    /// What becomes of the equation.
    pub act: Act,
    /// Where one text gives equations for the elements of an array: a variable for each.
    pub elements: Option<Elements>,
}

impl Opening {
    /// Name of the variable that is what the right side was, where another one takes its place: whatever stands there, also what nobody sees from
    /// outside, can be asked for by this name.
    pub fn source(&self) -> String {
        // The name itself stands nowhere in the text, so this one does not.
        format!("{}_source", self.name)
    }
}

/// What an opening does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Act {
    /// The variable is added to the right side of the equation: 0 until a modification says otherwise.
    Adds,
    /// It takes the place of that side, which it is equal to until then; a variable beside it ([`Opening::source`]) is that side.
    Replaces,
    /// It is read wherever the class reads one of its inputs, which it is equal to until then.
    StandsIn,
}

/// The array whose elements the equations of one text are for.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Elements {
    /// Its name in the class.
    pub array: String,
    /// Number of its dimensions.
    pub dimensions: usize,
    /// Subscripts as they are written, with brackets: `[i]`; empty in an equation between arrays.
    pub subscripts: String,
}

/// A variable that follows a course in time: it is given by an expression of time, inputs of the model and parameters alone.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Command {
    /// Name of the variable, of a component with its path; whether that one is a number its class says.
    pub name: String,
    /// The expression.
    pub expression: String,
    /// Line, from 1.
    pub line: u32,
    /// The equation, blanks as in [`crate::InjectionSite::text`]; none where the declaration gives the expression.
    pub equation: Option<String>,
    /// Bytes of the expression.
    pub(crate) range: Range<usize>,
}

/// The variables of a class that follow courses in time.  Only what stands in the class itself is looked at, not what it inherits.
pub fn commands(text: &str, class: &str) -> Vec<Command> {
    let mut files = Files::new();
    let file = files.add("model", text);
    let parsed = hyd_syntax::parse(file, text);
    let mut names = hyd_source::dotted(class);
    let first = names.next().and_then(|name| parsed.value.classes.iter().find(|class| &*class.name.name == name));
    let inside = |class: &std::sync::Arc<hyd_syntax::tree::ClassDef>, name: &str| {
        hyd_instance::class::nested_classes(class)
            .find(|own| &*own.class.name.name == name)
            .map(|own| own.class.clone())
    };
    let found = names.fold(first.cloned(), |class, name| inside(&class?, name));
    let Some(ClassBody::Long { elements, equations, .. }) = found.as_ref().map(|class| &class.body) else {
        return Vec::new();
    };
    let declared = || {
        elements.iter().filter_map(|element| match element {
            Element::Component(component) => Some(component),
            _ => None,
        })
    };
    let is_fixed = |name: &str| {
        name == "time"
            || declared()
                .any(|own| &*own.name.name == name && own.variability <= Variability::Parameter && own.dims.is_empty())
    };
    // What it is over time is recorded, or stays as it is.
    let is_input = |name: &str| {
        declared().any(|own| {
            &*own.name.name == name && own.direction == Some(Direction::Input) && own.modification.binding.is_none()
        })
    };
    let is_course = |expression: &Expr| {
        let (mut of_time, mut is_free) = (false, true);
        walk(expression, &mut |part| match &part.kind {
            ExprKind::Ref(name) => {
                let name = written(text, name.span);
                let is_recorded = is_input(name);
                of_time |= name == "time" || is_recorded;
                is_free &= is_fixed(name) || is_recorded;
            }
            // What a call does with its past or with random numbers is not known.
            ExprKind::Call(function, _) => is_free &= function.parts.len() == 1 && rate_of(part).is_none(),
            _ => {}
        });
        of_time && is_free
    };
    let one_line = |expression: &Expr| one_line(written(text, expression.span));
    let range = |expression: &Expr| bytes(expression.span);
    // What a variable of a component is, its class says.
    let is_number = |name: &ComponentRef| {
        let of = |own: &&Component| name.parts.first().is_some_and(|part| own.name.name == part.name.name);
        let class = declared().find(of).and_then(|own| own.class.parts.last());
        class.is_some_and(|class| name.parts.len() > 1 || &*class.name != "Boolean" && &*class.name != "Integer")
            && name.parts.iter().all(|part| part.subscripts.is_empty())
    };
    let mut found = Vec::new();
    for own in declared() {
        let is_real = own.class.parts.last().is_some_and(|part| &*part.name != "Boolean" && &*part.name != "Integer");
        if let Some(expression) = own.modification.binding.as_ref().filter(|binding| is_course(binding))
            && is_real
            && own.variability == Variability::Continuous
            && own.dims.is_empty()
        {
            let (name, line) = (own.name.name.to_string(), files.location(own.span).line);
            let range = range(expression);
            found.push(Command { name, expression: one_line(expression), line, equation: None, range });
        }
        // `Valve valve(u = if time < 1 then 0 else 5)`
        let of_parts = own.modification.arguments.iter().filter(|_| own.dims.is_empty());
        for argument in of_parts {
            if let Argument::Modify(ElementModification { is_final: false, target, modification, span, .. }) = argument
                && let Some(expression) = modification.binding.as_ref().filter(|binding| is_course(binding))
            {
                let name = format!("{}.{}", own.name.name, written(text, target.span));
                let (range, line) = (range(expression), files.location(*span).line);
                found.push(Command { name, expression: one_line(expression), line, equation: None, range });
            }
        }
    }
    for equation in equations.iter().filter(|section| !section.initial).flat_map(|section| &section.equations) {
        if let EquationKind::Equal(left, right) = &equation.kind
            && let ExprKind::Ref(name) = &left.kind
            && is_number(name)
            && is_course(right)
        {
            let whole = hyd_syntax::one_line(files.snippet(equation.span));
            let (name, line) = (written(text, name.span).to_string(), files.location(equation.span).line);
            let range = range(right);
            found.push(Command { name, expression: one_line(right), line, equation: Some(whole), range });
        }
    }
    found
}

/// An equation that gives a variable a course in time.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Course {
    /// Name of the variable.
    pub name: String,
    /// The expression.
    pub expression: String,
    /// Names in it but `time`, as bytes of it from and to.
    pub names: Vec<(usize, usize)>,
}

/// Operators that ask for more than values of now, or for events of their own.
const OF_THE_PAST: [&str; 8] = ["der", "pre", "edge", "change", "delay", "sample", "initial", "spatialDistribution"];

/// What an equation `y = ...` of time says; none of any other.  Whether the names in it are fixed is not looked at.
pub fn course(equation: &str) -> Option<Course> {
    let (left, right, text) = sides(equation)?;
    let ExprKind::Ref(name) = &left.kind else { return None };
    let (mut of_time, mut is_free, mut names) = (false, true, Vec::new());
    let begin = right.span.start as usize;
    walk(&right, &mut |part| match &part.kind {
        ExprKind::Ref(name) if written(&text, name.span) == "time" => of_time = true,
        ExprKind::Ref(name) => names.push((name.span.start as usize - begin, name.span.end as usize - begin)),
        ExprKind::Call(function, _) => {
            is_free &= function.parts.len() > 1 || !OF_THE_PAST.contains(&&*function.parts[0].name.name);
        }
        _ => {}
    });
    (of_time && is_free).then(|| Course {
        name: written(&text, name.span).to_string(),
        expression: written(&text, right.span).to_string(),
        names,
    })
}

fn bytes(span: Span) -> Range<usize> {
    span.start as usize..span.end as usize
}

/// The text with variables declared in its classes that equations read ([`Act`]); no line moves.  None if one of the equations is not found, or not once.
pub fn opened(text: &str, openings: &[Opening]) -> Option<String> {
    let mut files = Files::new();
    let file = files.add("model", text);
    let parsed = hyd_syntax::parse(file, text);
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for opening in openings {
        if opening.act == Act::StandsIn {
            let all = names(&parsed.value, text);
            let (name, own) = stand_in::edits(&all, text, &files, (opening.line, &opening.equation), &opening.name)?;
            let head = behind_description(text, name)?;
            edits.push((head..head, declaration(opening, "", &opening.equation)));
            for (range, instead) in own {
                let lines = text[range.clone()].matches('\n').count();
                edits.push((range, format!("{instead}{}", "\n".repeat(lines))));
            }
            continue;
        }
        let mut places = Vec::new();
        for class in &parsed.value.classes {
            places_in(class, text, &files, opening, &mut places);
        }
        let [(head, right)] = &places[..] else { return None };
        let range = bytes(right.span);
        let replaces = opening.act == Act::Replaces;
        let first = if replaces { one_line(&text[range.clone()]) } else { "0".to_string() };
        let (sizes, first) = match &opening.elements {
            None => (String::new(), first),
            Some(Elements { array, dimensions, .. }) => {
                let sizes: Vec<String> = (1..=*dimensions).map(|k| format!("size({array}, {k})")).collect();
                let sizes = sizes.join(", ");
                (format!("[{sizes}]"), format!("fill({first}, {sizes})"))
            }
        };
        let declared = match replaces {
            true => {
                let source = opening.source();
                let told = Opening { name: source.clone(), ..opening.clone() };
                declaration(&told, &sizes, &first) + &declaration(opening, &sizes, &source)
            }
            false => declaration(opening, &sizes, &first),
        };
        edits.push((*head..*head, declared));
        if replaces {
            let lines = text[range.clone()].matches('\n').count();
            edits.push((range, format!("{}{}", opening.name, "\n".repeat(lines))));
            continue;
        }
        // A condition would take the term into its last branch.
        let is_one = !matches!(right.kind, ExprKind::If(..));
        if !is_one {
            edits.push((range.start..range.start, "(".to_string()));
        }
        let close = if is_one { "" } else { ")" };
        let times = if opening.factor.is_empty() { String::new() } else { format!("{}*", opening.factor) };
        let subscripts = opening.elements.as_ref().map_or("", |own| &*own.subscripts);
        edits.push((range.end..range.end, format!("{close} + {times}{}{subscripts}", opening.name)));
    }
    // From behind; of two at one place the later one first.
    let mut order: Vec<usize> = (0..edits.len()).collect();
    order.sort_by_key(|&k| (edits[k].0.start, k));
    let mut text = text.to_string();
    for &k in order.iter().rev() {
        text.replace_range(edits[k].0.clone(), &edits[k].1);
    }
    Some(text)
}

/// The declaration of the variable with what it is until a modification says otherwise.
fn declaration(opening: &Opening, sizes: &str, first: &str) -> String {
    format!(" Real {}{sizes} = {first} {};", opening.name, crate::print_string(&opening.words))
}

/// Where declarations of the class may stand, and the right side of the equation.
fn places_in(
    class: &hyd_syntax::tree::ClassDef,
    text: &str,
    files: &Files,
    opening: &Opening,
    found: &mut Vec<(usize, Expr)>,
) {
    for nested in hyd_instance::class::nested_classes(class) {
        places_in(&nested.class, text, files, opening, found);
    }
    let ClassBody::Long { equations, .. } = &class.body else { return };
    let is_meant = |equation: &Equation| {
        files.location(equation.span).line == opening.line && one_line(files.snippet(equation.span)) == opening.equation
    };
    for equation in equations.iter().filter(|section| !section.initial).flat_map(|section| in_loops(&section.equations))
    {
        if let EquationKind::Equal(_, right) = &equation.kind
            && is_meant(equation)
            && let Some(head) = behind_description(text, class.name.span.end as usize)
        {
            found.push((head, right.clone()));
        }
    }
}

/// Equations, and those in loops over them.
fn in_loops(equations: &[Equation]) -> Vec<&Equation> {
    let mut found = Vec::new();
    for equation in equations {
        match &equation.kind {
            EquationKind::For(_, body) => found.extend(in_loops(body)),
            _ => found.push(equation),
        }
    }
    found
}

/// The byte behind the description strings that may follow the name of a class.
pub(crate) fn behind_description(text: &str, name: usize) -> Option<usize> {
    let (mut end, mut at) = (name, name);
    loop {
        let rest = text.get(at..)?;
        let blanks = rest.len() - rest.trim_start().len();
        if blanks > 0 {
            at += blanks;
        } else if rest.starts_with("//") {
            at += rest.find('\n')?;
        } else if rest.starts_with("/*") {
            at += rest.find("*/")? + 2;
        } else if rest.starts_with('+') {
            at += 1;
        } else if let Some(inside) = rest.strip_prefix('"') {
            let mut escaped = false;
            let close = inside.find(|c: char| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            })?;
            at += close + 2;
            end = at;
        } else {
            return Some(end);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Act, Opening, commands, course, opened};
    use crate::{Balance, Goal, Options, SourceText, Sources, balances, compile, injection_sites};

    struct Nothing;

    impl Sources for Nothing {
        fn find(&mut self, _: &[std::sync::Arc<str>]) -> Result<Option<SourceText>, String> {
            Ok(None)
        }
    }

    fn options() -> Options {
        Options { model: None, set: Vec::new(), goal: Goal::Check, clock: || 0.0 }
    }

    fn of(text: &str) -> Vec<Balance> {
        let (sites, compilation) = injection_sites(&mut Nothing, "model.mo", text, &options());
        assert!(!compilation.has_errors(), "{:?}", compilation.diagnostics);
        balances(&sites)
    }

    #[test]
    fn an_opened_equation_takes_a_term_and_no_line_moves() {
        for (equation, expected) in [
            ("2*der(x) = 3*(5 - 1);", "2*der(x) = 3*(5 - 1) + further;"),
            ("2*der(x) = (if time < 9 then 4 else 2);", "2*der(x) = ((if time < 9 then 4 else 2)) + further;"),
            ("2*der(x) = if time < 9 then 4 else 2;", "2*der(x) = (if time < 9 then 4 else 2) + further;"),
            ("der(x)*2\n    = 1\n + 1 \"sum\";", "der(x)*2\n    = 1\n + 1 + further \"sum\";"),
            ("der(x)*2 // stored\n    = 1 /* first */ + 1;", "der(x)*2 // stored\n    = 1 /* first */ + 1 + further;"),
        ] {
            let text = format!(
                "model M /* M */ \"the \\\"one\\\"\" + // two\n \"model\"\n  Real x(start = 0, fixed = true);\nequation // equation\n  {equation}\nend M;\n"
            );
            let found = of(&text);
            let [one] = &found[..] else { panic!("{text}{found:?}") };
            let opening = |name: &str| Opening {
                file: "model.mo".into(),
                line: one.site.line,
                equation: one.site.text.clone(),
                name: name.into(),
                words: "let in".into(),
                factor: String::new(),
                act: Act::Adds,
                elements: None,
            };
            let whole = opened(&text, &[opening("further")]).unwrap();
            let heading = "\"model\" Real further = 0 \"let in\";\n";
            assert!(whole.contains(expected) && whole.contains(heading), "{whole}");
            assert_eq!(whole.lines().count(), text.lines().count(), "{whole}");
            let with = format!("{whole}model N\n  extends M(further = 1);\nend N;\n");
            let compilation = compile(&mut Nothing, "model.mo", &with, &options());
            assert!(!compilation.has_errors(), "{with}{:?}", compilation.diagnostics);
            assert_eq!(opened(&text, &[Opening { line: 1, ..opening("further") }]), None);
            let times = opened(&text, &[Opening { factor: "3/x".into(), ..opening("further") }]).unwrap();
            assert_eq!(times, whole.replace("+ further", "+ 3/x*further"));
        }
    }

    #[test]
    fn equations_of_time() {
        let found = course("y = offset + (if time < t_0 then 0 else 2*a.h);").unwrap();
        let names: Vec<&str> = found.names.iter().map(|&(from, to)| &found.expression[from..to]).collect();
        assert_eq!((found.name.as_str(), names), ("y", vec!["offset", "t_0", "a.h"]));
        for equation in ["y = offset", "y + time = 0", "y = pre(y) + time", "der(y) = time", "y = delay(time, 1)"] {
            assert_eq!(course(equation), None, "{equation}");
        }
    }

    #[test]
    fn courses_in_time_are_commands() {
        let text = "package P\nmodel M\n  parameter Real T = 2;\n  Real u = if time < T then 0 else 5;\n  Real w = 3;\n  Real x(start = 0);\n  \
            Real y;\n  Real z;\n  Boolean b = time > 1;\n  Boolean c;\n  input Real e;\n  Valve v(k = T, w = 3*e);\nequation\n  y = sin(\n    time);\n  z = x*time;\n  v.u = 2*e; // volts\n  \
            c = e > 1;\n  der(x) = u + y;\nend M;\nend P;\n";
        let found = commands(text, "P.M");
        let said: Vec<_> = found.iter().map(|own| (own.name.as_str(), own.expression.as_str(), own.line)).collect();
        let expected =
            [("u", "if time < T then 0 else 5", 4), ("v.w", "3*e", 12), ("y", "sin( time)", 14), ("v.u", "2*e", 17)];
        assert_eq!(said, expected);
        assert!(commands(text, "P.N").is_empty() && found[0].equation.is_none());
        let (name, words, line) = ("given".to_string(), "command".to_string(), found[2].line);
        let equation = found[2].equation.clone().unwrap();
        let factor = String::new();
        let file = "model.mo".into();
        let opening = Opening { file, line, equation, name, words, factor, act: Act::Replaces, elements: None };
        let whole = opened(text, &[opening]).unwrap();
        assert!(
            whole.contains(
                "model M Real given_source = sin( time) \"command\"; Real given = given_source \"command\";\n"
            ),
            "{whole}"
        );
        assert!(whole.contains("  y = given\n;\n") && whole.lines().count() == text.lines().count(), "{whole}");
    }
}
