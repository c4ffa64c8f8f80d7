//! Mistakes in units as messages in the user's names.
//!
//! A message names both operands with their units, marks their places in the equation where these are certain, points at the
//! declarations that gave the units, and says the factor where only a factor is missing.

use hyd_flat::{FlatModel, Operand, Section, Target, VarId};
use hyd_source::{Code, Diagnostic, Files, Span};
use hyd_symbolic::{Function, Node, NodeId, slots};

use crate::check::block_of;
use crate::class::{Classes, Declared};
use crate::form::{Fit, Product};
use crate::infer::{Row, Rule};
use crate::place;
use crate::print::number;
use crate::solve::Solution;

/// Longest operand shown as text.
const LONGEST: usize = 60;
/// Most declarations pointed at.
const MOST_DECLARATIONS: usize = 4;

/// What messages are made from.
pub(crate) struct Reporter<'a> {
    /// The model.
    pub flat: &'a FlatModel,
    /// Its texts.
    pub files: &'a Files,
    /// Declared units.
    pub declared: &'a Declared,
    /// Unknown units.
    pub classes: &'a Classes,
    /// Units found.
    pub solution: &'a Solution,
    /// All rows.
    pub rows: &'a [Row],
    /// Equation block and position of the first equation of each case.
    pub first: &'a [(u32, u32)],
}

/// One operand of a mistake.
struct Side {
    text: String,
    unit: String,
    place: Option<Span>,
    operands: Vec<Operand>,
}

impl Reporter<'_> {
    /// The units of both sides as text.
    pub(crate) fn texts(&self, row: &Row) -> (String, String) {
        (self.unit_text(&row.left), self.unit_text(&row.right))
    }

    fn unit_text(&self, product: &Product) -> String {
        let Some(product) = self.solution.substitute(product) else { return "of some unit".into() };
        let known = self.declared.names.text(&product.unit());
        if product.is_known() {
            return known;
        }
        let unknown = product.unknowns.iter().map(|(id, exponent)| {
            let name = self.flat.var_name(self.classes.unknowns[*id as usize]);
            match exponent.parts() {
                (1, 1) => format!("[{name}]"),
                (n, 1) => format!("[{name}]{n}"),
                (n, d) => format!("[{name}]({n}/{d})"),
            }
        });
        let known = (!product.dimension.is_none()).then_some(known);
        unknown.chain(known).collect::<Vec<_>>().join(".")
    }

    /// The message for a row at fault, in equation `k` of a block.
    pub(crate) fn diagnostic(&self, equation: usize, k: usize, row: &Row, fit: Fit) -> Diagnostic {
        let block = block_of(self.flat, equation);
        let arity = self.flat.templates.get(block.template).arity as usize;
        let operands = block.operands_of(k, arity);
        let connection = self.flat.is_connection(block);
        let mut left = self.side(equation, operands, row.nodes.0, &row.left, row.nodes.1);
        let mut right = row.nodes.1.map(|b| self.side(equation, operands, b, &row.right, Some(row.nodes.0)));
        if let (false, Some(right)) = (connection, &mut right)
            && left.place.is_some()
            && left.place == right.place
        {
            (left.place, right.place) = (None, None);
        }
        let claim = equation.checked_sub(self.flat.equations.len()).map(|k| &self.flat.claims[k]);
        if let (Some(claim), Some(right)) = (claim, &mut right) {
            right.place = None;
            let message =
                format!("units do not fit: {} is {}, but `{}` is {}", claim.what, claim.unit, left.text, left.unit);
            let mut diagnostic = Diagnostic::error(Code::UnitMismatch, message);
            diagnostic = mark(diagnostic, block.origin.span, &left, None);
            diagnostic = diagnostic.with(claim.declared, format!("declared in {} here", claim.unit));
            diagnostic = diagnostic.maybe_help(conversion(&left, Some(right), fit));
            return self.declarations(diagnostic, &left.operands, row);
        }
        let message = match &right {
            Some(right) => two_sided(&left, right, row.rule, connection),
            None => one_sided(&left, row.rule),
        };
        let mut diagnostic = Diagnostic::error(Code::UnitMismatch, message);
        diagnostic = mark(diagnostic, block.origin.span, &left, right.as_ref());
        if let Some(help) = conversion(&left, right.as_ref(), fit) {
            diagnostic = diagnostic.help(help);
        }
        if !block.origin.path.is_empty() {
            diagnostic = diagnostic.help(format!("in the component `{}`", block.origin.path));
        }
        let sides: Vec<Operand> = left.operands.iter().chain(right.iter().flat_map(|r| &r.operands)).copied().collect();
        self.declarations(diagnostic, &sides, row)
    }

    fn side(&self, equation: usize, operands: &[Operand], node: NodeId, unit: &Product, other: Option<NodeId>) -> Side {
        let block = block_of(self.flat, equation);
        let path = &block.origin.path;
        let local = |text: String| -> String {
            match text.strip_prefix(path.as_ref()).and_then(|t| t.strip_prefix('.')) {
                Some(rest) if !path.is_empty() => rest.to_string(),
                _ => text,
            }
        };
        let name = |slot: hyd_symbolic::SlotId| {
            let operand = operands[slot.0 as usize];
            match operand.target() {
                Target::Var(v) => local(self.flat.var_name(v)),
                Target::Der(v) => format!("der({})", local(self.flat.var_name(v))),
                Target::Pre(v) => format!("pre({})", local(self.flat.var_name(v))),
                Target::Start(v) => format!("{}.start", local(self.flat.var_name(v))),
                _ => self.flat.target_name(operand),
            }
        };
        let negated = |slot: hyd_symbolic::SlotId| operands[slot.0 as usize].negated();
        let arena = &self.flat.templates.arena;
        let mut text = hyd_symbolic::print_signed(arena, node, &name, &negated, false);
        // The sign of a lone operand is not part of its unit.
        if let Some(inner) =
            text.strip_prefix('-').filter(|inner| inner.chars().all(|c| c.is_alphanumeric() || "._[](),".contains(c)))
        {
            text = inner.to_string();
        }
        if text.chars().count() > LONGEST {
            text = text.chars().take(LONGEST - 3).chain("...".chars()).collect();
        }
        let names = |node: NodeId| -> Vec<String> {
            let list = slots(arena, &[node]).into_iter().filter_map(|slot| self.variable(operands[slot.0 as usize]));
            let mut names: Vec<String> =
                list.map(|v| place::without_subscripts(&local(self.flat.var_name(v)))).collect();
            names.sort_unstable();
            names.dedup();
            names
        };
        let mut mine: Vec<Operand> = slots(arena, &[node]).into_iter().map(|slot| operands[slot.0 as usize]).collect();
        mine.retain(|o| self.variable(*o).is_some());
        let span = block.origin.span;
        // The left side of a binding is the declaration itself.
        let bound = matches!(block.section, Section::Binding | Section::Start);
        let others = other.map(names).unwrap_or_default();
        let place = place::operand(
            (self.files.snippet(span), span),
            self.flat.is_connection(block),
            &names(node),
            if bound { &[] } else { &others },
        );
        let unit = match (arena.node(node), mine.as_slice()) {
            (Node::Slot(_), [operand]) => self.own_text(*operand).unwrap_or_else(|| self.unit_text(unit)),
            _ => self.unit_text(unit),
        };
        Side { text, unit, place, operands: mine }
    }

    fn variable(&self, operand: Operand) -> Option<VarId> {
        match operand.target() {
            Target::Var(v) | Target::Der(v) | Target::Pre(v) | Target::Start(v) => Some(v),
            Target::Delayed(site) | Target::DelayedRate(site) => {
                self.flat.delay(site).map(|(delay, k)| VarId(delay.source.0 + k))
            }
            Target::Input(k) | Target::InputRate(k) => self.flat.driven_variable(k),
            Target::Const(_) | Target::Held(_) | Target::Chosen(_) => None,
        }
    }

    /// The unit as its declaration says it.
    fn own_text(&self, operand: Operand) -> Option<String> {
        match operand.target() {
            Target::Var(v) | Target::Pre(v) | Target::Start(v) => {
                let (block, k) = self.flat.locate(v);
                let block = &self.flat.variables[block];
                let text = block.element_units.get(k).or(block.unit.as_ref())?;
                (!text.is_empty()).then(|| text.to_string())
            }
            Target::Const(c) => self.flat.quantity(c).map(|quantity| quantity.unit.to_string()),
            _ => None,
        }
    }

    /// Points at what gave the units.
    fn declarations(&self, mut diagnostic: Diagnostic, operands: &[Operand], row: &Row) -> Diagnostic {
        let mut seen: Vec<Span> = Vec::new();
        for v in operands.iter().filter_map(|o| self.variable(*o)) {
            let block = &self.flat.variables[self.flat.locate(v).0];
            if seen.len() >= MOST_DECLARATIONS || seen.contains(&block.origin.span) {
                continue;
            }
            let name = place::without_subscripts(&self.flat.var_name(v));
            // The name of a delayed value is an expression.
            let plain = !name.contains('(');
            let last = if plain { name.rsplit('.').next().unwrap_or(&name) } else { &name }.to_string();
            seen.push(block.origin.span);
            match (&block.unit, self.classes.unknown_of(v)) {
                (Some(text), _) if !text.is_empty() => {
                    diagnostic = diagnostic.with(block.origin.span, format!("`{last}` is declared in {text}"));
                }
                (_, Some(id)) => diagnostic = self.origin_of_unit(diagnostic, &last, id, row),
                _ => {}
            }
        }
        diagnostic
    }

    /// Points at the equation from which an undeclared unit follows.
    fn origin_of_unit(&self, diagnostic: Diagnostic, name: &str, id: u32, row: &Row) -> Diagnostic {
        let (Some(unit), Some(source)) = (&self.solution.units[id as usize], self.solution.source[id as usize]) else {
            return diagnostic.help(format!("`{name}` declares no unit"));
        };
        let unit = self.declared.names.text(&unit.unit());
        let source = self.rows[source as usize].case;
        let note = format!("`{name}` declares no unit; it gets {unit} from another equation");
        if source == row.case {
            return diagnostic.help(format!("`{name}` declares no unit; it gets {unit} from this equation"));
        }
        let span = block_of(self.flat, self.first[source as usize].0 as usize).origin.span;
        diagnostic.with(span, format!("from here `{name}` gets {unit}")).help(note)
    }
}

fn two_sided(left: &Side, right: &Side, rule: Rule, connection: bool) -> String {
    let (a, b) = (format!("`{}` is {}", left.text, left.unit), format!("`{}` is {}", right.text, right.unit));
    match rule {
        _ if connection => format!("units do not fit in this connection: {a}, but {b}"),
        Rule::Branches => format!("units of the branches do not fit: {a}, but {b}"),
        Rule::Relation => format!("units of a relation do not fit: {a}, but {b}"),
        Rule::Arguments(function) => format!("units of the arguments of `{}` do not fit: {a}, but {b}", word(function)),
        _ => format!("units do not fit: {a}, but {b}"),
    }
}

fn one_sided(side: &Side, rule: Rule) -> String {
    let what = match rule {
        Rule::Number(function) => format!("`{}` needs a number without unit", word(function)),
        Rule::Base => "a power with a variable exponent needs a base without unit".to_string(),
        _ => "an exponent must have no unit".to_string(),
    };
    format!("{what}, but `{}` is {}", side.text, side.unit)
}

fn word(function: Function) -> &'static str {
    function.name()
}

/// Marks the operands where their places are known, else the equation.
fn mark(diagnostic: Diagnostic, whole: Span, left: &Side, right: Option<&Side>) -> Diagnostic {
    let says = |side: &Side| format!("this is {}", side.unit);
    match right {
        Some(right) => match (left.place, right.place) {
            (Some(a), Some(b)) => diagnostic.at(b, says(right)).with(a, says(left)),
            (Some(a), None) => diagnostic.at(a, says(left)),
            (None, Some(b)) => diagnostic.at(b, says(right)),
            (None, None) => diagnostic.at(whole, ""),
        },
        None => match left.place {
            Some(a) => diagnostic.at(a, says(left)),
            None => diagnostic.at(whole, ""),
        },
    }
}

/// What to write where a factor or a zero point is all that is missing.
fn conversion(left: &Side, right: Option<&Side>, fit: Fit) -> Option<String> {
    let target = right.map_or("1", |r| r.unit.as_str());
    match fit {
        Fit::Factor(factor) => Some(format!(
            "a value in {} times {} is one in {target}: the dimension is the same",
            left.unit,
            number(factor)
        )),
        Fit::Offset(offset) => Some(format!("a value in {} plus {} is one in {target}", left.unit, number(offset))),
        Fit::Same | Fit::Dimension => None,
    }
}
