//! Additive terms at equations of the model: `left = right` becomes `left = right + amplitude*shape`.
//!
//! An equation is found by the instance path of its component and a line of its text; all equations that one text gives
//! (in a loop, in an array of components) get the term.  The amplitude is a parameter of the flat model with the value 0, so the
//! model is the same until it is set; its unit follows from the equation.  The shape is 1, any expression in the scope of the
//! component, or a piecewise linear function of time whose values at nodes are the parameters.  Terms are added while the
//! text is lowered, before anything is eliminated or differentiated.  Knows nothing of what terms are good for.

use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::{Function, Node, NodeId};
use hyd_syntax::tree::Expr;
use hyd_system::{Settable, ValueKind, Variability};

use crate::model::VarId;
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::made::Made;

/// A term to be added.
#[derive(Clone, PartialEq, Debug)]
pub struct Injection {
    /// Instance path of the component without subscripts, `""` for the model itself.
    pub path: String,
    /// Name of the file, or its end after a `/`; any file if not stated.
    pub file: Option<String>,
    /// A line of the equation's text, from 1.
    pub line: u32,
    /// Name of the parameter that is made: the amplitude, or the array of values at nodes.
    pub name: String,
    /// What the amplitude is multiplied with.
    pub shape: TermShape,
}

/// The shape of a term.
#[derive(Clone, PartialEq, Debug)]
pub enum TermShape {
    /// 1.
    Constant,
    /// An expression in the scope of the component, as text.
    Expression(String),
    /// Linear in time between nodes at these times (s, ascending), falling to 0 outside over the width of the outermost
    /// interval; the parameter is the array of values at the nodes.
    PiecewiseLinear(Vec<f64>),
}

/// A term, and its expression as a tree.
pub(crate) struct Pending {
    term: Injection,
    expression: Option<Expr>,
}

impl Flattener<'_, '_> {
    /// Reads the terms; faults in their texts are reported.
    pub(crate) fn prepare_injections(&mut self, terms: &[Injection]) {
        for term in terms {
            let expression = match &term.shape {
                TermShape::Expression(text) => match self.read_expression(&term.name, text) {
                    Some(expression) => Some(expression),
                    None => continue,
                },
                TermShape::PiecewiseLinear(times) if !ascending(times) => {
                    let message = format!("the nodes of the term `{}` are not at least two ascending times", term.name);
                    self.report(Diagnostic::error(Code::Injection, message));
                    continue;
                }
                _ => None,
            };
            self.injections.push(Pending { term: term.clone(), expression });
        }
    }

    fn read_expression(&mut self, name: &str, text: &str) -> Option<Expr> {
        let file = self.scopes.table.files.add(format!("term {name}"), text);
        let parsed = hyd_syntax::parse_expression(file, text);
        parsed.diagnostics.into_iter().for_each(|diagnostic| self.report(diagnostic));
        parsed.value
    }

    /// The right side of an equation with its terms; `index`: subscripts of the element, if it is an array equation.
    pub(crate) fn injected(
        &mut self,
        right: NodeId,
        origin: &Origin,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<NodeId, Fail> {
        let mut sum = right;
        for k in 0..self.injections.len() {
            if !self.is_meant(k, origin) {
                continue;
            }
            if self.injected_into(k).is_some_and(|span| span != origin.span) {
                let name = self.injections[k].term.name.clone();
                let message =
                    format!("the term `{name}` has two equations on its line to go to; give each a line of its own");
                return Err(self.error(Code::Injection, origin.span, message));
            }
            self.tables().notes.injected.push((k, origin.span));
            let term = self.term(k, origin, cx, index)?;
            sum = self.model.templates.arena.add(sum, term);
        }
        Ok(sum)
    }

    fn is_meant(&self, k: usize, origin: &Origin) -> bool {
        let term = &self.injections[k].term;
        let files = &self.scopes.table.files;
        let file = || {
            let name = files.name(origin.span.file);
            let ends =
                |wanted: &str| name.strip_suffix(wanted).is_some_and(|rest| rest.is_empty() || rest.ends_with('/'));
            term.file.as_deref().is_none_or(ends)
        };
        let lines = || {
            let last = Span { start: origin.span.end.max(origin.span.start + 1) - 1, ..origin.span };
            files.location(origin.span).line..=files.location(last).line
        };
        term.path == *origin.path && file() && lines().contains(&term.line)
    }

    /// `amplitude*shape`
    fn term(&mut self, k: usize, origin: &Origin, cx: &mut Context, index: &[Affine]) -> Result<NodeId, Fail> {
        let known = self.all_notes().flat_map(|notes| &notes.amplitudes).find(|(term, _)| *term == k);
        let variable = match known {
            Some(&(_, variable)) => variable,
            None => self.amplitude(k, origin),
        };
        if let TermShape::PiecewiseLinear(times) = self.injections[k].term.shape.clone() {
            return Ok(self.piecewise_linear(variable, &times));
        }
        let amplitude = self.amplitude_slot(variable, 0);
        let Some(text) = self.injections[k].expression.clone() else { return Ok(amplitude) };
        let expression = self.elaborator(cx.scope, Some(cx)).expr(&text)?;
        let shape = self.shape(&expression, cx)?;
        let at = if shape.is_empty() { &[] } else { index };
        if shape.len() != at.len() {
            return Err(self.error(
                Code::ArrayShape,
                expression.span,
                "the term and its equation have different sizes",
            ));
        }
        let value = self.lower(&expression, cx, at)?;
        if !value.is_number() {
            let message = format!("a term is a number, but this is {}", value.scalar.name());
            return Err(self.error(Code::TypeMismatch, expression.span, message));
        }
        Ok(self.model.templates.arena.mul(amplitude, value.node))
    }

    /// Declares the parameter of a term.
    fn amplitude(&mut self, k: usize, origin: &Origin) -> VarId {
        let term = &self.injections[k].term;
        let (name, sizes) = match &term.shape {
            TermShape::PiecewiseLinear(times) => (term.name.clone(), vec![times.len()]),
            _ => (term.name.clone(), Vec::new()),
        };
        let shape = (ValueKind::Real, Variability::Parameter);
        let first = self.make(Made::Event, name, &sizes, shape, origin.clone());
        if let Some(variable) = self.newest() {
            variable.settable = Settable::Yes;
            variable.description = Some("amplitude of an injected term".into());
            variable.made = None;
            variable.protected = false;
        }
        self.tables().notes.amplitudes.push((k, first));
        first
    }

    fn amplitude_slot(&mut self, variable: VarId, element: i64) -> NodeId {
        let slot = self.slots.slot(SlotKey::Variable(Kind::Var, variable, Affine::constant(element)));
        self.model.templates.arena.slot(slot)
    }

    /// `sum_k value_k hat_k(time)`, the hat function `max(0, min(rise, fall))`.
    fn piecewise_linear(&mut self, values: VarId, times: &[f64]) -> NodeId {
        let mut sum = self.model.templates.arena.constant(0.0);
        for (k, &node) in times.iter().enumerate() {
            let value = self.amplitude_slot(values, k as i64);
            let arena = &mut self.model.templates.arena;
            let time = arena.intern(Node::Time);
            let before = if k > 0 { node - times[k - 1] } else { times[1] - node };
            let after = times.get(k + 1).map_or(before, |next| next - node);
            let mut line = |zero: f64, width: f64| {
                let (zero, width) = (arena.constant(zero), arena.constant(width));
                let distance = arena.sub(time, zero);
                arena.div(distance, width)
            };
            let (rise, fall) = (line(node - before, before), line(node + after, -after));
            let least = arena.call2(Function::Min, rise, fall);
            let zero = arena.constant(0.0);
            let hat = arena.call2(Function::Max, zero, least);
            let product = arena.mul(value, hat);
            sum = arena.add(sum, product);
        }
        sum
    }

    /// The text of the equation that a term was added to.
    fn injected_into(&self, k: usize) -> Option<Span> {
        self.all_notes().flat_map(|notes| &notes.injected).find(|(term, _)| *term == k).map(|&(_, span)| span)
    }

    /// Reports terms that found no equation.
    pub(crate) fn check_injections(&mut self) {
        for (k, pending) in std::mem::take(&mut self.injections).into_iter().enumerate() {
            let term = pending.term;
            if self.injected_into(k).is_some() {
                continue;
            }
            let place = if term.path.is_empty() { "the model".to_string() } else { format!("`{}`", term.path) };
            let message = format!("the term `{}` has no equation: {place} has none on line {}", term.name, term.line);
            let lines = self.injectable_lines(&term.path);
            let help = match lines.as_slice() {
                [] => "no component of this path has equations a term can be added to".to_string(),
                lines => format!("its equations are on the lines {}", lines.join(", ")),
            };
            self.report(Diagnostic::error(Code::Injection, message).help(help));
        }
    }

    fn injectable_lines(&self, path: &str) -> Vec<String> {
        let files = &self.scopes.table.files;
        let blocks = self.notes.injectable.iter().map(|&block| &self.model.equations[block].origin);
        let mut lines: Vec<u32> = blocks.filter(|o| *o.path == *path).map(|o| files.location(o.span).line).collect();
        lines.sort_unstable();
        lines.dedup();
        lines.iter().map(u32::to_string).collect()
    }
}

fn ascending(times: &[f64]) -> bool {
    times.len() >= 2 && times.iter().all(|t| t.is_finite()) && times.windows(2).all(|pair| pair[0] < pair[1])
}
