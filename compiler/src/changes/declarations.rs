//! Changes of declarations: start values, what is fixed, numbers exchanged, modifiers that were not wanted.

use std::collections::BTreeMap;

use hyd_source::Span;
use hyd_syntax::tree::{Argument, Component, ElementModification, Expr, ExprKind, Modification, Variability};
use hyd_system::significant;

use super::expressions::BOUNDS;
use super::{Found, Rank, number};

/// By what a guess is multiplied: the other roots of laws of technology lie mostly within a decade, or on the other side of zero.
const GUESSES: [f64; 5] = [0.2, 5.0, -1.0, 0.03, 30.0];

/// Of more parameters than these no two are exchanged.
const MOST_PAIRED: usize = 30;
/// Guesses of an unknown that has none.
const FIRST_GUESSES: [&str; 4] = ["1", "0.1", "10", "-1"];

impl Found<'_> {
    /// Changes of the components of one class; gives the start values that it says, as text.
    pub(super) fn components(&mut self, components: &[&Component]) -> BTreeMap<String, String> {
        let mut starts = BTreeMap::new();
        for component in components {
            let name = component.name.name.to_string();
            for argument in &component.modification.arguments {
                if let Argument::Modify(own) = argument
                    && let ([only], Some(binding)) = (&own.target.parts[..], &own.modification.binding)
                    && &*only.name == "start"
                {
                    starts.insert(name.clone(), self.snippet(binding.span).to_string());
                }
            }
            if !starts.contains_key(&name) {
                self.first_guess(component);
            }
            self.found_at_the_start(component);
            self.first_index(component);
            self.modification(&component.modification, &name, component.dims.is_empty());
            let is_limit = component.variability <= Variability::Parameter && self.asserted.has(&name);
            if let Some(binding) = component.modification.binding.as_ref().filter(|_| !is_limit) {
                match component.variability {
                    Variability::Continuous | Variability::Discrete => self.value(binding),
                    Variability::Parameter | Variability::Constant => self.expression(binding),
                }
            }
        }
        if self.trouble.run || self.trouble.start {
            self.exchanged(components);
        }
        starts
    }

    /// A parameter that has a start value and no other may be meant to be found by the initial equations.
    fn found_at_the_start(&mut self, component: &Component) {
        let own = &component.modification;
        // Where fixed starts contradict each other, a number that is to be given is not what is meant.
        let is_asked = self.trouble.start && self.initial_surplus;
        if component.variability != Variability::Parameter || own.binding.is_some() || !is_asked {
            return;
        }
        let named = |name: &str| {
            own.arguments.iter().find_map(|argument| match argument {
                Argument::Modify(own) if matches!(&own.target.parts[..], [only] if &*only.name == name) => Some(own),
                _ => None,
            })
        };
        if let (Some(start), None) = (named("start"), named("fixed")) {
            let edit = self.edit(start.span.end, start.span.end, ", fixed = false");
            let name = &component.name.name;
            self.push(
                Rank::Determined,
                format!("let the initial equations determine the parameter `{name}`: `fixed = false`"),
                vec![edit],
            );
        }
    }

    /// A subscript without a start value begins at 0, where no array has an element.
    fn first_index(&mut self, component: &Component) {
        let (name, own) = (component.name.name.to_string(), &component.modification);
        let is_index = self.snippet(component.class.span) == "Integer"
            && component.variability > Variability::Parameter
            && component.dims.is_empty()
            && own.binding.is_none()
            && own.arguments.is_empty()
            && self.text.contains(&format!("[{name}]"));
        if is_index && self.trouble.start {
            let edit = self.edit(component.name.span.end, component.name.span.end, "(start = 1, fixed = true)");
            let words = format!("`{name}` has no start value and begins at 0: `{name}(start = 1, fixed = true)`");
            self.push(Rank::Moment, words, vec![edit]);
        }
    }

    /// A guess of an unknown that has none and that an assertion reads.
    fn first_guess(&mut self, component: &Component) {
        let name = component.name.name.to_string();
        let is_unknown = component.variability == Variability::Continuous
            && component.dims.is_empty()
            && component.modification.binding.is_none()
            && (self.trouble.judged && self.asserted.has(&name) || self.is_undefined(&name));
        let is_missing = self.without_start.contains(&name)
            && component.variability == Variability::Continuous
            && component.modification.binding.is_none();
        if is_missing && self.trouble.start {
            let guess = "start = 1, fixed = true";
            let edit = match component.modification.arguments.first() {
                Some(Argument::Modify(first)) => self.edit(first.span.start, first.span.start, format!("{guess}, ")),
                Some(_) => return,
                None => self.edit(component.name.span.end, component.name.span.end, format!("({guess})")),
            };
            self.push(
                Rank::FirstStart,
                format!("give `{name}`, which has no start value and begins at 0, another one: `{name}({guess})`"),
                vec![edit],
            );
        }
        if !is_unknown || !self.trouble.start {
            return;
        }
        for guess in FIRST_GUESSES {
            let edit = match component.modification.arguments.first() {
                Some(Argument::Modify(first)) => {
                    self.edit(first.span.start, first.span.start, format!("start = {guess}, "))
                }
                Some(_) => return,
                None => self.edit(component.name.span.end, component.name.span.end, format!("(start = {guess})")),
            };
            self.push(Rank::Guess, format!("look for another solution: `{name}(start = {guess})`"), vec![edit]);
        }
    }

    /// A value at the start is not defined because this variable was found where the search from 0 led.
    fn is_undefined(&self, name: &str) -> bool {
        let is_it = |own: &str| {
            own.split(" = ")
                .next()
                .is_some_and(|own| own == name || own.strip_suffix(name).is_some_and(|rest| rest.ends_with('.')))
        };
        self.trouble.undefined && self.undefined.iter().flat_map(|own| own.split(", ")).any(is_it)
    }

    /// Two parameters of the same type, or unit, with their numbers exchanged.
    fn exchanged(&mut self, components: &[&Component]) {
        let given: Vec<(&Component, &Expr)> = components
            .iter()
            .filter(|own| own.variability == Variability::Parameter)
            .filter_map(|own| own.modification.binding.as_ref().map(|binding| (*own, binding)))
            .filter(|(_, binding)| number(binding).is_some())
            .collect();
        if given.len() > MOST_PAIRED {
            return;
        }
        for (k, (a, x)) in given.iter().enumerate() {
            for (b, y) in &given[k + 1..] {
                let is_same = self.snippet(a.class.span) == self.snippet(b.class.span);
                let is_meant = |own: &Component| self.asserted.has(&own.name.name);
                // Integers are sizes: with thousands for three a model is another one.  Numbers without a unit have nothing in common.
                let is_size = self.snippet(a.class.span) == "Integer";
                let is_plain = self.snippet(a.class.span) == "Real" && (unit(a).is_none() || unit(a) != unit(b));
                if !is_same
                    || is_size
                    || is_plain
                    || is_meant(a)
                    || is_meant(b)
                    || number(x) == number(y)
                    || a.modification.arguments.len() != b.modification.arguments.len()
                {
                    continue;
                }
                let (one, other) = (self.snippet(x.span).to_string(), self.snippet(y.span).to_string());
                let edits = vec![self.replaced(x.span, other), self.replaced(y.span, one)];
                self.push(
                    Rank::Numbers,
                    format!("exchange the values of `{}` and `{}`", a.name.name, b.name.name),
                    edits,
                );
            }
        }
    }

    /// Changes of the arguments of a modification of `owner`.
    fn modification(&mut self, modification: &Modification, owner: &str, is_scalar: bool) {
        let arguments = &modification.arguments;
        for (k, argument) in arguments.iter().enumerate() {
            let Argument::Modify(own) = argument else { continue };
            let path: Vec<&str> = own.target.parts.iter().map(|part| &*part.name).collect();
            if self.trouble.text && self.is_marked(own.span) {
                self.superfluous(arguments, k, own, &path.join("."));
                if !own.each && !is_scalar {
                    let edit = self.edit(own.span.start, own.span.start, "each ");
                    self.same_for_all.push((path.join("."), edit.clone()));
                    self.push(
                        Rank::Marked,
                        format!("`{}` is the same for all elements: `each`", path.join(".")),
                        vec![edit],
                    );
                }
            }
            if let Some(binding) = &own.modification.binding {
                if let (Some(last), true) = (path.last(), self.trouble.run) {
                    self.delay_bound(last, owner, binding);
                }
                match path.last() {
                    Some(&"fixed") => self.fixed(binding, owner),
                    Some(&"start") => self.start(arguments, binding, owner),
                    _ if self.asserted.has(&format!("{owner}.{}", path.join("."))) => {}
                    _ if (self.trouble.grows || self.trouble.judged)
                        && number(binding).is_some_and(|own| own.abs() == 1.0) =>
                    {
                        let text = if number(binding) == Some(1.0) { "-1" } else { "1" };
                        let words = format!("turn the sign round: `{owner}({} = {text})`", path.join("."));
                        let edit = self.replaced(binding.span, text);
                        self.push(Rank::Convention, words, vec![edit]);
                    }
                    _ => self.expression(binding),
                }
            }
            self.modification(&own.modification, &format!("{owner}.{}", path.join(".")), is_scalar);
        }
    }

    /// Several modifiers that are the same for all elements of an array, at once.
    pub(super) fn all_the_same(&mut self) {
        let found = std::mem::take(&mut self.same_for_all);
        if found.len() > 1 {
            let (names, edits): (Vec<String>, Vec<_>) =
                found.into_iter().map(|(name, edit)| (format!("`{name}`"), edit)).unzip();
            self.push(Rank::Marked, format!("{} are the same for all elements: `each`", names.join(", ")), edits);
        }
    }

    /// A modifier that messages name is left out.
    fn superfluous(&mut self, arguments: &[Argument], k: usize, own: &ElementModification, name: &str) {
        if !self.names.contains(name) || arguments.len() < 2 {
            return;
        }
        let span = match arguments.get(k + 1) {
            Some(Argument::Modify(next)) => Span { end: next.span.start, ..own.span },
            _ => {
                let Some(Argument::Modify(last)) = k.checked_sub(1).and_then(|k| arguments.get(k)) else { return };
                Span { start: last.span.end, ..own.span }
            }
        };
        let edit = self.replaced(span, "");
        self.push(Rank::Marked, format!("remove `{name}`"), vec![edit]);
    }

    fn fixed(&mut self, binding: &Expr, owner: &str) {
        let (from, to, words) = match binding.kind {
            ExprKind::Boolean(true) if self.trouble.start => {
                ("true", "false", format!("do not fix the start of `{owner}`: `fixed = false`"))
            }
            ExprKind::Boolean(false) if self.trouble.start => {
                ("false", "true", format!("fix the start of `{owner}`: `fixed = true`"))
            }
            _ => return,
        };
        if self.snippet(binding.span) == from {
            let edit = self.replaced(binding.span, to);
            let rank = if to == "false" && self.rates_given.contains(owner) { Rank::Twice } else { Rank::Start };
            self.push(rank, words, vec![edit]);
        }
    }

    /// The signs of gains that components have by their declarations turned round, where something grows or an assertion fails.
    pub(super) fn conventions(&mut self, components: &[&Component]) {
        if !self.trouble.grows && !self.trouble.judged {
            return;
        }
        for (component, gain, value) in self.gains.clone() {
            let Some(own) = components.iter().find(|own| *own.name.name == *component) else { continue };
            let text = format!("{gain} = {}", -value);
            let edit = match own.modification.arguments.first() {
                Some(Argument::Modify(first)) => self.edit(first.span.start, first.span.start, format!("{text}, ")),
                Some(_) => continue,
                None => self.edit(own.name.span.end, own.name.span.end, format!("({text})")),
            };
            self.push(Rank::Convention, format!("turn the sign round: `{component}({text})`"), vec![edit]);
        }
    }

    /// The bound of a delay in a component, as it is set here, made longer.
    fn delay_bound(&mut self, name: &str, owner: &str, binding: &Expr) {
        let Some((bound, value)) = &self.longest_delay else { return };
        // The message states the bound with a few digits.
        if name != bound || number(binding).is_none_or(|own| significant(own) != significant(*value)) {
            return;
        }
        let value = *value;
        for factor in BOUNDS {
            let text = significant(factor * value);
            let words = format!("allow longer delays: `{owner}({name} = {text})`");
            let edit = self.replaced(binding.span, text);
            self.push(Rank::Unit, words, vec![edit]);
        }
    }

    fn start(&mut self, arguments: &[Argument], binding: &Expr, owner: &str) {
        if !self.trouble.start && !self.trouble.run {
            return;
        }
        if let ExprKind::Boolean(value) = binding.kind {
            let edit = self.replaced(binding.span, (!value).to_string());
            self.push(Rank::Moment, format!("begin with `{owner}` = {}", !value), vec![edit]);
        }
        let Some(value) = number(binding) else { return };
        let is_fixed = |own: &Argument| matches!(own, Argument::Modify(own) if own.target.parts.last().is_some_and(|part| &*part.name == "fixed"));
        if arguments.iter().any(is_fixed) {
            return;
        }
        let edit = self.edit(binding.span.end, binding.span.end, ", fixed = true");
        self.push(Rank::Start, format!("fix the start of `{owner}`: `fixed = true`"), vec![edit]);
        let is_guess = value != 0.0 && self.trouble.start;
        let was_found_from_zero = value == 0.0 && self.is_undefined(owner);
        for text in FIRST_GUESSES.iter().filter(|_| was_found_from_zero) {
            let edit = self.replaced(binding.span, *text);
            self.push(Rank::Guess, format!("look for another solution: `{owner}(start = {text})`"), vec![edit]);
        }
        for factor in GUESSES.iter().filter(|_| is_guess) {
            let text = significant(value * factor);
            let edit = self.replaced(binding.span, text.clone());
            self.push(Rank::Guess, format!("look for another solution: `{owner}(start = {text})`"), vec![edit]);
        }
    }
}

/// The unit that a declaration states.
fn unit(component: &Component) -> Option<&str> {
    component.modification.arguments.iter().find_map(|argument| match argument {
        Argument::Modify(own) if matches!(&own.target.parts[..], [only] if &*only.name == "unit") => {
            own.modification.binding.as_ref().and_then(Expr::text).map(|text| &**text)
        }
        _ => None,
    })
}
