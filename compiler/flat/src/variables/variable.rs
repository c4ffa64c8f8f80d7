//! Variables of instances: blocks with names and attributes, bindings and start values as equations.

use std::sync::Arc;

use hyd_index::TypedIndex;
use hyd_instance::instance::full_dims;
use hyd_instance::modifier::Applied;
use hyd_instance::{InstId, ScalarType, Value, sizes_text};
use hyd_source::{Code, Diagnostic, Edit, Origin, Reported, Span};
use hyd_syntax::tree::{ClassBody, Direction, Variability as Declared};
use hyd_system::{NamePattern, Settable, ValueKind, Variability};
use hyd_typed::Expr;

use crate::model::{BlockId, DeclaredType, Operand, PerElement, Section, StateSelect, VarId, VariableBlock};
use crate::state::context::{Context, Fail};
use crate::state::flattener::{Flattener, scale};
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::made::in_stream_block;

/// Most scalar variables of one model.
const MAX_VARIABLES: usize = Operand::LIMIT;

impl VariableBlock {
    /// The `stateSelect` attribute of one of its scalars.
    pub fn state_select_of(&self, v: VarId) -> StateSelect {
        self.state_select.get((v.0 - self.first.0) as usize)
    }
}

impl Flattener<'_, '_> {
    /// Makes the variables of an instance and all below it.
    pub(crate) fn declare(&mut self, inst: InstId) {
        if self.scopes.instances[inst].absent {
            return;
        }
        if self.scopes.instances[inst].primitive.is_some() {
            self.declare_variable(inst);
            return;
        }
        for child in self.scopes.instances[inst].children.clone() {
            self.declare(child);
        }
    }

    pub(crate) fn declare_variable(&mut self, inst: InstId) {
        let instance = &self.scopes.instances[inst];
        let Some(primitive) = &instance.primitive else { return };
        let kind = match &primitive.scalar {
            ScalarType::Real => ValueKind::Real,
            ScalarType::Integer => ValueKind::Integer,
            ScalarType::Boolean | ScalarType::Clock => ValueKind::Boolean,
            ScalarType::Enumeration(e) => ValueKind::Enumeration(e.literals.clone().into()),
            ScalarType::Text | ScalarType::Object => return,
        };
        let variability = match self.scopes.variability(inst) {
            Declared::Constant => Variability::Constant,
            Declared::Parameter => Variability::Parameter,
            Declared::Discrete => Variability::Discrete,
            Declared::Continuous => Variability::Continuous,
        };
        let name = self.name_pattern(inst);
        let count = name.count();
        let span = instance.span;
        if self.model.scalars as usize + count > MAX_VARIABLES {
            let _ = self.error(Code::Limit, span, format!("the model has more than {MAX_VARIABLES} variables"));
            return;
        }
        let known = variability <= Variability::Parameter;
        let is_clock = primitive.scalar == ScalarType::Clock;
        let variability = if is_clock { Variability::Discrete } else { variability };
        let block = VariableBlock {
            name,
            first: VarId(self.model.scalars),
            count: count as u32,
            kind,
            declared: None,
            variability,
            unit: None,
            element_units: Vec::new(),
            display_unit: None,
            description: instance.description.clone(),
            settable: Settable::No,
            protected: instance.protected,
            made: None,
            has_start: false,
            fixed: PerElement::All(known),
            min: PerElement::All(f64::NEG_INFINITY),
            max: PerElement::All(f64::INFINITY),
            limit_spans: [None, None],
            at_any_time: false,
            nominal: PerElement::All(None),
            state_select: PerElement::All(StateSelect::Default),
            origin: Origin { path: "".into(), span },
        };
        let (parent, stream) = (instance.parent, instance.stream && !known);
        let id = self.model.variables.push(block);
        if let Some(parent) = parent {
            self.model.variables[id].origin.path = self.path(parent);
        }
        self.model.scalars += count as u32;
        self.blocks.insert(inst, id);
        if is_clock {
            let (first, origin) = (self.model.variables[id].first, self.model.variables[id].origin.clone());
            self.note_clock(first, count as u32, origin);
        }
        if stream {
            let first = VarId(self.model.scalars);
            self.in_streams.insert(inst, first);
            let block = in_stream_block(&self.model.variables[id], first);
            self.model.variables.push(block);
            self.model.scalars += count as u32;
        }
    }

    pub(crate) fn name_pattern(&self, inst: InstId) -> NamePattern {
        let mut parts: Vec<(Arc<str>, Vec<u32>)> = Vec::new();
        let mut text = String::new();
        for id in hyd_instance::instance::chain(&self.scopes.instances, inst) {
            let instance = &self.scopes.instances[id];
            if instance.name.is_empty() {
                continue;
            }
            if !text.is_empty() || !parts.is_empty() {
                text.push('.');
            }
            text.push_str(&instance.name);
            if !instance.dims.is_empty() {
                parts.push((std::mem::take(&mut text).into(), instance.dims.iter().map(|&d| d as u32).collect()));
            }
        }
        if !text.is_empty() || parts.is_empty() {
            parts.push((text.into(), Vec::new()));
        }
        NamePattern { parts, derivative: false }
    }

    pub(crate) fn attribute(&self, inst: InstId, name: &str) -> Option<Applied> {
        let primitive = self.scopes.instances[inst].primitive.as_ref()?;
        primitive.attributes.iter().find(|(n, _)| n.as_ref() == name).map(|(_, a)| a.clone())
    }

    pub(crate) fn attributes(&mut self, inst: InstId) {
        let block = self.blocks[&inst];
        self.model.variables[block].unit = self.text_attribute(inst, "unit");
        self.model.variables[block].element_units = self.element_units(inst);
        self.model.variables[block].display_unit = self.text_attribute(inst, "displayUnit");
        self.model.variables[block].declared = self.declared_type(inst).map(Arc::new);
        self.check_attributes(inst);
        if let Some(values) = self.element_values(inst, "fixed") {
            let flags = |v: &Value| matches!(v, Value::Boolean(true));
            self.model.variables[block].fixed = per_element(&values, flags);
        }
        if let Some(values) = self.element_values(inst, "min") {
            self.model.variables[block].min = per_element(&values, |v| v.as_stored().unwrap_or(f64::NEG_INFINITY));
        }
        if let Some(values) = self.element_values(inst, "max") {
            self.model.variables[block].max = per_element(&values, |v| v.as_stored().unwrap_or(f64::INFINITY));
        }
        for (k, name) in ["min", "max"].into_iter().enumerate() {
            let stated = self.attribute(inst, name).and_then(|applied| applied.tree.span);
            self.model.variables[block].limit_spans[k] = stated;
        }
        if let Some(values) = self.element_values(inst, "nominal") {
            let positive = |v: &Value| v.as_real().map(f64::abs).filter(|x| *x > 0.0 && x.is_finite());
            self.model.variables[block].nominal = per_element(&values, positive);
        }
        if let Some(values) = self.element_values(inst, "stateSelect") {
            self.model.variables[block].state_select = per_element(&values, |value| match value {
                Value::Enumeration(_, 1) => StateSelect::Never,
                Value::Enumeration(_, 2) => StateSelect::Avoid,
                Value::Enumeration(_, 4) => StateSelect::Prefer,
                Value::Enumeration(_, 5) => StateSelect::Always,
                _ => StateSelect::Default,
            });
        }
    }

    /// `fixed` is a truth value, limits and `nominal` are numbers, `nominal` is positive, `min` is not above `max`.
    fn check_attributes(&mut self, inst: InstId) {
        let mut numbers = [None, None];
        for name in ["fixed", "min", "max", "nominal"] {
            let Some(applied) = self.attribute(inst, name) else { continue };
            let Ok(value) = self.attribute_value(name, &applied) else { continue };
            let span = applied.tree.binding.as_ref().map_or(self.scopes.instances[inst].span, |e| e.span);
            let mut warned = false;
            for element in value.flatten() {
                let number = element.as_real();
                let limit = name == "min" || name == "max";
                let fits = match name {
                    "fixed" => matches!(element, Value::Boolean(_)),
                    _ => number.is_some() || limit && matches!(element, Value::Enumeration(..)),
                };
                if !fits {
                    let wanted = if name == "fixed" { "a Boolean" } else { "a number" };
                    let message = format!("`{name}` must be {wanted}, not {}", element.type_name());
                    let _ = self.error(Code::TypeMismatch, span, message);
                    return;
                }
                if let ("nominal", Some(nominal)) = (name, number.filter(|x| *x <= 0.0)) {
                    let used = match nominal < 0.0 {
                        true => format!("{} is used", -nominal),
                        false => "it is not used".to_string(),
                    };
                    let message = format!("`nominal` is {nominal}, but says how large the variable is: {used}");
                    if !warned {
                        self.report(
                            Diagnostic::warning(Code::Value, message).at(span, "a positive number is meant here"),
                        );
                    }
                    warned = true;
                }
            }
            if value.shape().is_empty() && (name == "min" || name == "max") {
                numbers[usize::from(name == "max")] = value.as_real();
            }
            if let ("max", [Some(low), Some(high)]) = (name, numbers)
                && low > high
            {
                let path = self.path(inst);
                let _ = self.error(Code::Value, span, format!("`{path}` has `min` {low} above `max` {high}"));
            }
        }
    }

    /// The units of the elements where they differ.
    fn element_units(&mut self, inst: InstId) -> Vec<Arc<str>> {
        if self.model.variables[self.blocks[&inst]].unit.is_none() {
            return Vec::new();
        }
        let Some(values) = self.element_values(inst, "unit") else { return Vec::new() };
        let texts = values.iter().filter_map(|value| match value {
            Value::Text(text) => Some(text.clone()),
            _ => None,
        });
        let texts: Vec<Arc<str>> = texts.collect();
        if texts.iter().all(|text| Some(text) == texts.first()) { Vec::new() } else { texts }
    }

    pub(crate) fn text_attribute(&mut self, inst: InstId, name: &str) -> Option<Arc<str>> {
        let applied = self.attribute(inst, name)?;
        match self.scopes.evaluate_applied(&applied).ok()? {
            Value::Array(items) => match items.first().map(Value::flatten)?.first()? {
                Value::Text(text) => Some(text.clone()),
                _ => None,
            },
            Value::Text(text) => Some(text),
            other => {
                let span = applied.tree.span.unwrap_or(self.scopes.instances[inst].span);
                let _ = self.error(
                    Code::TypeMismatch,
                    span,
                    format!("`{name}` must be a String, not {}", other.type_name()),
                );
                None
            }
        }
    }

    fn declared_type(&mut self, inst: InstId) -> Option<DeclaredType> {
        let quantity = self.text_attribute(inst, "quantity").filter(|quantity| !quantity.is_empty());
        let instance = &self.scopes.instances[inst];
        let (class, literals) = match &instance.primitive.as_ref()?.scalar {
            ScalarType::Enumeration(of) => {
                let descriptions = of.descriptions.iter().map(|text| text.as_deref().unwrap_or_default().into());
                (Some((*of.name).into()), descriptions.collect())
            }
            _ => (instance.class.map(|class| self.scopes.table.full_name(class).into()), Vec::new()),
        };
        (class.is_some() || quantity.is_some()).then_some(DeclaredType { class, quantity, literals })
    }

    /// Value of an attribute at translation. A `nominal` value fixes no parameter that it is computed from.
    fn attribute_value(&mut self, name: &str, applied: &Applied) -> Result<Value, Reported> {
        if name == "nominal" { self.scopes.guess_applied(applied) } else { self.scopes.evaluate_applied(applied) }
    }

    /// Values of an attribute known at translation, one per element of the whole block (one alone if the same for all).
    pub(crate) fn element_values(&mut self, inst: InstId, name: &str) -> Option<Vec<Value>> {
        let applied = self.attribute(inst, name)?;
        let value = self.attribute_value(name, &applied).ok()?;
        if value.shape().is_empty() {
            return Some(vec![value]);
        }
        let count = self.model.variables[self.blocks[&inst]].count as usize;
        let flat: Vec<Value> = value.flatten().into_iter().cloned().collect();
        if flat.len() == count {
            return Some(flat);
        }
        // Spread over the inner arrays only: repeat for the outer ones.
        if !flat.is_empty() && count.is_multiple_of(flat.len()) {
            return Some(flat.iter().cycle().take(count).cloned().collect());
        }
        let span = applied.tree.span.unwrap_or(self.scopes.instances[inst].span);
        let _ = self.error(Code::ArrayShape, span, format!("`{name}` has {} values for {count} elements", flat.len()));
        None
    }

    /// Bindings and start values become equations.
    pub(crate) fn bind(&mut self, inst: InstId) {
        let block = self.blocks[&inst];
        if let Some(applied) = self.start_of(inst) {
            self.model.variables[block].has_start = true;
            let Some(expr) = self.typed_value(&applied) else { return };
            if !self.known_value(inst, &expr, "start value") {
                return;
            }
            if self.is_open_start(inst, &expr) {
                self.open_start(inst, &applied, &expr);
            } else {
                self.applied_equation(inst, &applied, &expr, Section::Start, Kind::Start, false);
            }
        }
        let Some(primitive) = &self.scopes.instances[inst].primitive else { return };
        let binding = primitive.binding.clone();
        let variability = self.model.variables[block].variability;
        // Its value comes at the end, with those that will only be asked for on the way.
        if self.is_given(inst) {
            return;
        }
        if binding.is_none() && variability == Variability::Parameter {
            self.value_without_binding(inst);
        }
        if let Some(applied) = binding {
            let Some(expr) = self.typed_value(&applied) else { return };
            if variability <= Variability::Parameter && !self.known_value(inst, &expr, "value") {
                return;
            }
            let section = match variability {
                Variability::Constant | Variability::Parameter => Section::Binding,
                Variability::Discrete => Section::Discrete,
                Variability::Continuous => Section::Continuous,
            };
            self.applied_equation(inst, &applied, &expr, section, Kind::Var, true);
        }
    }

    /// The value that a modification gives.
    fn typed_value(&mut self, applied: &Applied) -> Option<Expr> {
        let expr = applied.tree.binding.clone()?;
        self.typed_in(&expr, applied.scope).ok()
    }

    /// The value of a parameter and every start value must be known before the run.
    fn known_value(&mut self, inst: InstId, expr: &Expr, what: &str) -> bool {
        if self.made_of_parameters(expr) {
            return true;
        }
        let name = self.path(inst);
        let declared = self.scopes.instances[inst].span;
        let constant = self.scopes.variability(inst) <= Declared::Parameter;
        let kind = if constant { "the parameter " } else { "" };
        let message = format!("the {what} of {kind}`{name}` changes during the run");
        let mut diagnostic =
            Diagnostic::error(Code::NotStructural, message).at(expr.span, "").with(declared, "declared here");
        if constant && what == "value" {
            diagnostic = diagnostic
                .help(format!("declare `{name}` without `parameter`: what follows from variables is a variable"));
            if let Some(word) = self.word_before(declared, "parameter") {
                diagnostic = diagnostic
                    .propose(format!("make `{name}` a variable"), vec![Edit { span: word, text: String::new() }]);
            }
        }
        self.report(diagnostic);
        false
    }

    /// A word in front of the name of a declaration, with the blank behind it.
    fn word_before(&self, declared: Span, word: &str) -> Option<Span> {
        let text = self.scopes.table.files.text(declared.file);
        let before = text.get(..declared.start as usize)?;
        let begin = before.rfind([';', '\n']).map_or(0, |at| at + 1);
        let at = begin + before[begin..].find(word)?;
        let end = at + word.len();
        let blank = text[end..].len() - text[end..].trim_start_matches(' ').len();
        (blank > 0).then(|| Span::new(declared.file, at, end + blank))
    }

    /// Whether the class that declares something has an initial equation that names it.
    fn is_set_initially(&self, inst: InstId) -> bool {
        let instances = &self.scopes.instances;
        let name = &instances[inst].name;
        let parent = instances[inst].parent.unwrap_or(self.tree.root);
        let Some(shape) = &instances[parent].shape else { return false };
        shape.frames.iter().any(|frame| match &self.scopes.table.class(frame.class).def.body {
            ClassBody::Long { equations, .. } => equations.iter().filter(|section| section.initial).any(|section| {
                section.equations.iter().any(|equation| {
                    let text = self.scopes.table.files.snippet(equation.span);
                    text.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| *word == **name)
                })
            }),
            _ => false,
        })
    }

    /// A parameter without a binding takes its start value (Modelica 3.6, section 8.6.1); one that nothing gives a value, not even
    /// the command line, is likely forgotten.
    fn value_without_binding(&mut self, inst: InstId) {
        let name = self.path(inst);
        let set = |path: &str| path.split('[').next().is_some_and(|bare| *bare == *name);
        if self.model.variables[self.blocks[&inst]].fixed == PerElement::All(false) {
            return;
        }
        if let Some(start) = self.attribute(inst, "start") {
            if let Some(expr) = self.typed_value(&start) {
                self.applied_equation(inst, &start, &expr, Section::Binding, Kind::Var, false);
            }
            return;
        }
        let has_elements = !full_dims(&self.scopes.instances, inst).contains(&0);
        if !has_elements || self.scopes.overrides.iter().any(|o| set(&o.path)) {
            return;
        }
        let span = self.scopes.instances[inst].span;
        let taken = match self.model.variables[self.blocks[&inst]].kind {
            ValueKind::Boolean => "false",
            ValueKind::Enumeration(_) => "the first literal",
            ValueKind::Real | ValueKind::Integer => "0",
        };
        let (code, what) = match self.scopes.instances[inst].direction {
            Some(Direction::Input) => (Code::OpenInput, format!("nothing gives the input `{name}` a value")),
            _ => (Code::NoValue, format!("the parameter `{name}` has no value")),
        };
        let message = Diagnostic::warning(code, format!("{what}; {taken} is taken"));
        let (above, own) = name.rsplit_once('.').unwrap_or(("", &name));
        if code == Code::NoValue && self.is_set_initially(inst) {
            let message = message
                .at(span, "declared here")
                .help(format!("an initial equation gives it its value only if it is declared with `fixed = false`: `{own}(fixed = false)`"));
            let text = self.scopes.table.files.text(span.file).clone();
            let end = span.end as usize;
            let edit = match text.get(end..).is_some_and(|rest| rest.trim_start().starts_with('(')) {
                true => {
                    let open = end + text[end..].find('(').unwrap_or(0) + 1;
                    Edit { span: Span::new(span.file, open, open), text: "fixed = false, ".to_string() }
                }
                false => Edit { span: Span::new(span.file, end, end), text: "(fixed = false)".to_string() },
            };
            self.report(message.propose(format!("let the start find `{own}`"), vec![edit]));
            return;
        }
        self.report(match self.scopes.users_line(inst) {
            Some(component) => {
                let message = message.at(component, "of this component").with(span, "declared here");
                message.help(format!("give it a value: `{above}({own} = ...)`"))
            }
            None => message.at(span, "declared here"),
        });
    }

    /// `variable = expression` of a modification, for all elements.
    pub(crate) fn applied_equation(
        &mut self,
        inst: InstId,
        applied: &Applied,
        expr: &Expr,
        section: Section,
        kind: Kind,
        binding: bool,
    ) {
        self.equation_of_block(self.blocks[&inst], (inst, applied), expr, (section, kind), binding);
    }

    /// The same for a block of variables that has the sizes of the instance.
    pub(crate) fn equation_of_block(
        &mut self,
        block: BlockId,
        (inst, applied): (InstId, &Applied),
        expr: &Expr,
        (section, kind): (Section, Kind),
        binding: bool,
    ) {
        let block = &self.model.variables[block];
        let (first, origin) = (block.first, block.origin.clone());
        let origin = Origin { span: expr.span, ..origin };
        let scalar = self.scopes.instances[inst].primitive.as_ref().map(|p| p.scalar.clone());
        self.with_loops(Context::new(applied.scope), &mut |flat, cx| {
            let mut offset = Affine::constant(0);
            let (mut index, mut parts) = (Vec::new(), Vec::new());
            for id in hyd_instance::instance::chain(&flat.scopes.instances, inst) {
                let dims = flat.scopes.instances[id].dims.clone();
                let own: Vec<Affine> = dims.iter().map(|&d| cx.counter(d)).collect();
                for (affine, &size) in own.iter().zip(&dims) {
                    offset = scale(&offset, size).add_scaled(affine, 1).ok_or(Fail::NeedsExpansion)?;
                }
                if applied.spread.contains(&id) || (binding && id == inst) {
                    index.extend(own.iter().cloned());
                }
                let part = flat.scopes.instances[id].part_of.as_ref();
                if let Some((_, at)) = part.filter(|_| applied.spread.contains(&id)) {
                    parts.push((index.len(), id));
                    index.extend(at.iter().map(|&k| Affine::constant(k as i64)));
                }
                if !dims.is_empty() {
                    cx.implicit.push((id, own));
                }
            }
            let shape = flat.shape(expr, cx)?;
            if shape.is_empty() && !binding {
                index.clear();
            }
            // `r[3](c(each w = {1, 2}))`: the value of `w` for all, also for the arrays outside.
            if applied.tree.each && shape.len() < index.len() {
                index.drain(..index.len() - shape.len());
            }
            flat.check_parts(expr, &shape, inst, &parts)?;
            flat.check_rank(expr, &shape, &index, &cx.counts, inst)?;
            cx.may_add_variables = section == Section::Continuous;
            let value = flat.lower(expr, cx, &index)?;
            if let Some(scalar) = &scalar {
                flat.check_assignable(scalar, &value, expr.span, section, inst)?;
            }
            let slot = flat.slots.slot(SlotKey::Variable(kind, first, offset));
            let left = flat.model.templates.arena.slot(slot);
            flat.emit(section, left, value.node, &cx.loop_counts(), &origin);
            if section == Section::Discrete {
                flat.note_discrete();
            }
            Ok(())
        });
    }

    pub(crate) fn check_rank(
        &mut self,
        expr: &Expr,
        shape: &[usize],
        index: &[Affine],
        counts: &[usize],
        inst: InstId,
    ) -> Result<(), Fail> {
        let sizes: Vec<usize> = index.iter().map(|a| a.terms.first().map_or(1, |(id, _)| counts[id.index()])).collect();
        let fits = shape.len() == index.len()
            && shape.iter().zip(index).zip(&sizes).all(|((s, a), n)| a.terms.is_empty() || s == n);
        if fits {
            return Ok(());
        }
        let name = self.path(inst);
        let message = format!(
            "the value of `{name}` has the wrong size: {} instead of {}",
            sizes_text(shape),
            sizes_text(&sizes)
        );
        let in_array = self.scopes.instances[inst].dims.len() < sizes.len();
        let help = (shape.is_empty() && in_array).then(|| "`each` gives the same value to all elements".to_string());
        let span = self.scopes.instances[inst].span;
        self.report(
            Diagnostic::error(Code::ArrayShape, message).at(expr.span, "").with(span, "declared here").maybe_help(help),
        );
        Err(Fail::Reported)
    }

    /// A value for all elements of an array made in parts has the sizes of the array; said for the first of them.
    fn check_parts(
        &mut self,
        expr: &Expr,
        shape: &[usize],
        inst: InstId,
        parts: &[(usize, InstId)],
    ) -> Result<(), Fail> {
        for &(position, part) in parts {
            let Some((array, at)) = self.scopes.instances[part].part_of.clone() else { continue };
            let dims = self.scopes.instances[array].dims.clone();
            if shape.get(position..position + dims.len()) == Some(&dims[..]) {
                continue;
            }
            if at.iter().all(|&k| k == 0) && !self.scopes.has_failed(inst) {
                let (name, found) = (self.scopes.path_of_arrays(inst), &shape[position.min(shape.len())..]);
                let (found, wanted) = (sizes_text(found), sizes_text(&dims));
                let message = format!("the value of `{name}` has the wrong size: {found} instead of {wanted}");
                let help = shape.is_empty().then(|| "`each` gives the same value to all elements".to_string());
                let declared = self.scopes.instances[inst].span;
                let diagnostic = Diagnostic::error(Code::ArrayShape, message).at(expr.span, "");
                self.report(diagnostic.with(declared, "declared here").maybe_help(help));
            }
            return Err(Fail::Reported);
        }
        Ok(())
    }

    /// Parameters asked for at translation and those with `annotation(Evaluate = true)` are structural; the others can be set, unless
    /// final.
    pub(crate) fn settle(&mut self) {
        let list: Vec<(InstId, BlockId)> = self.blocks.iter().map(|(&i, &b)| (i, b)).collect();
        for (inst, block) in list {
            let instance = &self.scopes.instances[inst];
            let is_final = instance.final_record || instance.primitive.as_ref().is_some_and(|p| p.is_final);
            let unknown = self.model.variables[block].fixed == PerElement::All(false);
            if self.model.variables[block].variability == Variability::Parameter && !is_final && !unknown {
                let is_used = self.scopes.has_value(inst) || self.is_evaluated(inst);
                self.model.variables[block].settable = if is_used { Settable::Structural } else { Settable::Yes };
            }
        }
    }

    /// True for a parameter with `annotation(Evaluate = true)`, its own or that of a record around it (Modelica 3.6, section 18.3).
    pub(crate) fn is_evaluated(&self, inst: InstId) -> bool {
        let around = hyd_instance::instance::chain(&self.scopes.instances, inst);
        around
            .into_iter()
            .any(|id| self.scopes.instances[id].evaluate && self.scopes.variability(id) == Declared::Parameter)
            && !self.scopes.is_set_by_element(inst)
    }
}

pub(crate) fn per_element<T>(values: &[Value], read: impl Fn(&Value) -> T) -> PerElement<T> {
    match values {
        [only] => PerElement::All(read(only)),
        all => PerElement::Each(all.iter().map(read).collect()),
    }
}
