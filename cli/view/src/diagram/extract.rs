//! From the instances of a model to its diagrams.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use hyd_doc::html;
use hyd_instance::connection_rules::VENDOR;
use hyd_instance::instance::path;
use hyd_instance::{Env, InstId, Scope, Scopes, Value};
use hyd_results::format_number;
use hyd_source::Span;
use hyd_syntax::tree::{
    ClassBody, ClassDef, ClassKind, ComponentRef, Direction, Equation, EquationKind, Expr, ExprKind, Modification,
};

use super::annotation::{Reader, annotation_behind, argument, declared_annotation, inherited};
use super::graphic::{Form, Graphic, Icon};
use super::text::filled;
use super::{Diagram, End, Part, Port, Wire};

/// Diagrams of one model.
const MOST_DIAGRAMS: usize = 120;
/// Parts of one diagram.
const MOST_PARTS: usize = 400;
/// Characters of a parameter's value in an icon.
const LONGEST_VALUE: usize = 30;

/// A class that a part of a diagram has.
#[derive(Debug, Clone)]
pub(crate) struct ClassInfo {
    pub(crate) kind: &'static str,
    pub(crate) description: String,
    pub(crate) file: String,
    pub(crate) line: u32,
    /// Its definition as it is written.
    pub(crate) text: String,
    /// Its documentation, as markup that is safe to show.
    pub(crate) info: String,
}

/// A figure of a `Documentation` annotation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FigureInfo {
    pub(crate) title: String,
    pub(crate) plots: Vec<PlotInfo>,
}

/// A plot of a figure.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlotInfo {
    pub(crate) title: String,
    /// What is drawn: over what (`time` where nothing is said), the variable, the legend.
    pub(crate) curves: Vec<(String, String, String)>,
}

/// What a model shows of itself.
#[derive(Debug, Default)]
pub(crate) struct Extracted {
    /// The model itself first.
    pub(crate) diagrams: Vec<Diagram>,
    pub(crate) classes: BTreeMap<String, ClassInfo>,
    pub(crate) figures: Vec<FigureInfo>,
    /// Variables that the model's own annotation lists to be drawn.
    pub(crate) plot: Vec<String>,
    /// Some diagrams or parts were too many.
    pub(crate) is_cut: bool,
}

/// The diagrams of a model and of its parts, with the classes of these.
pub(crate) fn extract(scopes: &mut Scopes<'_>) -> Extracted {
    let mut found = Extracted { figures: figures(scopes), plot: plotted(scopes), ..Extracted::default() };
    let mut open = VecDeque::from([scopes.instances.tree().root]);
    while let Some(inst) = open.pop_front() {
        let parts = parts_of(scopes, inst);
        if parts.iter().all(|&part| scopes.instances[part].kind == ClassKind::Connector)
            && inst != scopes.instances.tree().root
        {
            continue;
        }
        if found.diagrams.len() >= MOST_DIAGRAMS {
            found.is_cut = true;
            break;
        }
        found.is_cut |= parts.len() > MOST_PARTS;
        let parts = &parts[..parts.len().min(MOST_PARTS)];
        open.extend(parts.iter().filter(|&&part| scopes.instances[part].kind != ClassKind::Connector));
        let diagram = diagram(scopes, inst, parts);
        for class in std::iter::once(inst).chain(parts.iter().copied()) {
            describe(scopes, class, &mut found.classes);
        }
        found.diagrams.push(diagram);
    }
    found
}

/// Components that a diagram shows: models, blocks and connectors that exist; of an array in parts its first element.
fn parts_of(scopes: &Scopes<'_>, inst: InstId) -> Vec<InstId> {
    let mut arrays = BTreeSet::new();
    let is_part = |&child: &InstId| {
        let own = &scopes.instances[child];
        let kind = match own.kind {
            ClassKind::Model | ClassKind::Block | ClassKind::Class => own.primitive.is_none(),
            ClassKind::Connector => true,
            _ => false,
        };
        kind && !own.absent && own.dims.iter().all(|&size| size > 0) && own.class.is_some()
    };
    let children = scopes.instances[inst].children.iter().copied().filter(is_part);
    children
        .filter(|&child| scopes.instances[child].part_of.as_ref().is_none_or(|(array, _)| arrays.insert(array.0)))
        .collect()
}

fn diagram(scopes: &mut Scopes<'_>, inst: InstId, parts: &[InstId]) -> Diagram {
    let (extent, graphics) = inherited(scopes, inst, "Diagram");
    let class = class_name(scopes, inst);
    let name = scopes.instances[inst].name.to_string();
    let graphics = with_texts(scopes, inst, graphics, &name, &class);
    let made: Vec<(Part, Vec<InstId>)> = parts.iter().map(|&part| part_of(scopes, part)).collect();
    let ports: Vec<Vec<InstId>> = made.iter().map(|(_, ports)| ports.clone()).collect();
    let wires = wires(scopes, inst, parts, &ports);
    let parts = made.into_iter().map(|(part, _)| part).collect();
    Diagram { path: path(&scopes.instances, inst), class, parts, wires, extent, graphics }
}

fn class_name(scopes: &Scopes<'_>, inst: InstId) -> String {
    scopes.instances[inst].class.map_or_else(String::new, |class| scopes.table.full_name(class))
}

/// A part, and the instances of its ports.
fn part_of(scopes: &mut Scopes<'_>, inst: InstId) -> (Part, Vec<InstId>) {
    let (extent, graphics) = inherited(scopes, inst, "Icon");
    let class = class_name(scopes, inst);
    let own = &scopes.instances[inst];
    let sizes = match &own.part_of {
        Some((array, _)) => &scopes.instances[*array].dims,
        None => &own.dims,
    };
    let sizes: Vec<String> = sizes.iter().map(ToString::to_string).collect();
    let plain = scopes.declared_name(inst).to_string();
    let name = if sizes.is_empty() { plain } else { format!("{plain}[{}]", sizes.join(",")) };
    let description = own.description.as_deref().unwrap_or_default().to_string();
    let (is_connector, span) = (own.kind == ClassKind::Connector, own.span);
    let graphics = with_texts(scopes, inst, graphics, &name, &class);
    let placed = declared_annotation(scopes, inst);
    let placement = placed
        .and_then(|(annotation, scope)| Reader { scopes, scope }.placement(Some(&annotation), false).ok().flatten());
    let mut ports = Vec::new();
    let mut instances = Vec::new();
    if !is_connector {
        for port in parts_of(scopes, inst) {
            if scopes.instances[port].kind == ClassKind::Connector {
                ports.push(port_of(scopes, port));
                instances.push(port);
            }
        }
    }
    let part = Part {
        path: path(&scopes.instances, inst),
        name,
        class,
        description,
        declared: declaration(scopes, span),
        is_connector,
        placement,
        icon: Icon { extent, graphics },
        ports,
    };
    (part, instances)
}

fn port_of(scopes: &mut Scopes<'_>, inst: InstId) -> Port {
    let (extent, graphics) = inherited(scopes, inst, "Icon");
    let name = scopes.declared_name(inst).to_string();
    let class = class_name(scopes, inst);
    let graphics = with_texts(scopes, inst, graphics, &name, &class);
    let placed = declared_annotation(scopes, inst);
    let placed =
        placed.map_or(Ok(None), |(annotation, scope)| Reader { scopes, scope }.placement(Some(&annotation), true));
    Port {
        name,
        placement: placed.unwrap_or_default(),
        is_hidden: placed.is_err() || scopes.is_declared_protected(inst),
        is_output: scopes.instances[inst].direction == Some(Direction::Output),
        icon: Icon { extent, graphics },
    }
}

/// Graphics whose texts say what they stand for.
fn with_texts(scopes: &mut Scopes<'_>, inst: InstId, graphics: Vec<Graphic>, name: &str, class: &str) -> Vec<Graphic> {
    let fill = |mut own: Graphic| {
        if let Form::Text { text, .. } = &mut own.form
            && text.contains('%')
        {
            *text = filled(text, name, class, |parameter| value_text(scopes, inst, parameter));
        }
        own
    };
    graphics.into_iter().map(fill).collect()
}

/// The value of a parameter in an icon, if it is known at translation.
fn value_text(scopes: &mut Scopes<'_>, inst: InstId, name: &str) -> Option<String> {
    let mut found = inst;
    for part in name.split('.') {
        found = *scopes.instances[found].by_name.get(part)?;
    }
    let span = scopes.instances[found].span;
    let text = match scopes.quietly(|scopes| scopes.value_of(found, span)).ok()? {
        Value::Real(value) => {
            let mut text = String::new();
            format_number(value, &mut text);
            text
        }
        Value::Integer(value) => value.to_string(),
        Value::Boolean(value) => value.to_string(),
        Value::Text(text) => text.to_string(),
        Value::Enumeration(of, k) => of.literals.get(k as usize - 1)?.to_string(),
        _ => return None,
    };
    Some(text.chars().take(LONGEST_VALUE).collect())
}

/// File, line and text of the declaration around a name.
fn declaration(scopes: &Scopes<'_>, span: Span) -> (String, u32, String) {
    let files = &scopes.table.files;
    let text = files.text(span.file);
    let line_start = text[..span.start as usize].rfind('\n').map_or(0, |at| at + 1);
    let end = text[span.end as usize..].find(';').map_or(text.len(), |at| span.end as usize + at + 1);
    let written = text[line_start..end].split_whitespace().collect::<Vec<_>>().join(" ");
    (files.name(span.file).to_string(), files.location(span).line, written.chars().take(400).collect())
}

fn describe(scopes: &Scopes<'_>, inst: InstId, classes: &mut BTreeMap<String, ClassInfo>) {
    let Some(class) = scopes.instances[inst].class else { return };
    let name = scopes.table.full_name(class);
    if classes.contains_key(&name) {
        return;
    }
    let def = scopes.table.class(class).def.clone();
    let files = &scopes.table.files;
    let info = def.annotation.as_ref().and_then(|own| text_argument(argument(own, "Documentation")?, "info"));
    let own = ClassInfo {
        kind: def.kind.keyword(),
        description: def.description.as_deref().unwrap_or_default().to_string(),
        file: files.name(def.span.file).to_string(),
        line: files.location(def.span).line,
        text: files.snippet(def.span).to_string(),
        info: info.map(|info| html::documentation(&info)).unwrap_or_default(),
    };
    classes.insert(name, own);
}

fn text_argument(annotation: &Modification, name: &str) -> Option<String> {
    match &argument(annotation, name)?.binding.as_ref()?.kind {
        ExprKind::Text(text) => Some(text.to_string()),
        _ => None,
    }
}

/// Reads the connections of an instance.
struct Connections<'r, 's> {
    scopes: &'r mut Scopes<'s>,
    inst: InstId,
    parts: &'r [InstId],
    ports: &'r [Vec<InstId>],
    found: Vec<Wire>,
    known: BTreeSet<(End, End)>,
}

fn wires(scopes: &mut Scopes<'_>, inst: InstId, parts: &[InstId], ports: &[Vec<InstId>]) -> Vec<Wire> {
    let Some(shape) = scopes.instances[inst].shape.clone() else { return Vec::new() };
    let mut connections = Connections { scopes, inst, parts, ports, found: Vec::new(), known: BTreeSet::new() };
    for (k, frame) in shape.frames.iter().enumerate() {
        let def: std::sync::Arc<ClassDef> = connections.scopes.table.class(frame.class).def.clone();
        if let ClassBody::Long { equations, .. } = &def.body {
            let all: Vec<&Equation> = equations.iter().flat_map(|section| &section.equations).collect();
            connections.read(&all, k as u32);
        }
    }
    connections.found
}

impl Connections<'_, '_> {
    fn read(&mut self, equations: &[&Equation], frame: u32) {
        for equation in equations {
            match &equation.kind {
                EquationKind::Connect(a, b) => self.connect(equation, a, b, frame),
                EquationKind::For(_, inner) => self.read(&inner.iter().collect::<Vec<_>>(), frame),
                EquationKind::If(branches) => {
                    for (condition, inner) in branches {
                        let holds = condition.as_ref().map_or(Some(true), |condition| self.truth(condition, frame));
                        if holds != Some(false) {
                            self.read(&inner.iter().collect::<Vec<_>>(), frame);
                        }
                        if holds == Some(true) {
                            break;
                        }
                    }
                }
                _ => {}
            }
        }
    }

    fn truth(&mut self, condition: &Expr, frame: u32) -> Option<bool> {
        let scope = Scope { inst: self.inst, frame };
        match self.scopes.quietly(|scopes| scopes.evaluate(condition, scope, &Env::default())) {
            Ok(Value::Boolean(value)) => Some(value),
            _ => None,
        }
    }

    fn connect(&mut self, equation: &Equation, a: &ComponentRef, b: &ComponentRef, frame: u32) {
        let (Some((from, first)), Some((to, second))) = (self.end(a), self.end(b)) else { return };
        // Loops and arrays connect the same two places many times.
        if from == to || !self.known.insert((from, to)) {
            return;
        }
        let annotation = annotation_behind(&self.scopes.table.files, equation);
        let scope = Scope { inst: self.inst, frame };
        let line = annotation.and_then(|own| Reader { scopes: self.scopes, scope }.line(&own));
        let (points, color) = line.map_or((None, None), |(points, color)| (Some(points), color));
        let mut values = variables(self.scopes, first);
        if values.is_empty() {
            values = variables(self.scopes, second);
        }
        // A signal goes from what gives it to what takes it; a connector of the diagram's own model the other way round.
        let gives = |end: End, inst: InstId| match (end.port, self.scopes.instances[inst].direction) {
            (Some(_), Some(direction)) => Some(direction == Direction::Output),
            (None, Some(direction)) => Some(direction == Direction::Input),
            _ => None,
        };
        let is_turned = gives(from, first) == Some(false) || gives(to, second) == Some(true);
        let written = [a, b].map(hyd_syntax::print_reference);
        let wire = if is_turned {
            let [a, b] = written;
            let points = points.map(|points| points.into_iter().rev().collect());
            Wire { from: to, to: from, written: [b, a], points, color, values }
        } else {
            Wire { from, to, written, points, color, values }
        };
        self.found.push(wire);
    }

    /// The place that a reference means, and the connector there.
    fn end(&self, reference: &ComponentRef) -> Option<(End, InstId)> {
        let at = |inst: InstId, name: &str| {
            let found = *self.scopes.instances[inst].by_name.get(name)?;
            // Of an array in parts the first stands for all.
            Some(self.scopes.instances[found].parts.first().copied().unwrap_or(found))
        };
        let [first, rest @ ..] = reference.parts.as_slice() else { return None };
        let outer = at(self.inst, &first.name.name)?;
        let part = self.parts.iter().position(|&part| part == outer)?;
        let mut inner = outer;
        let mut port = None;
        for (depth, name) in rest.iter().enumerate() {
            match at(inner, &name.name.name) {
                Some(next) => inner = next,
                None => break,
            }
            if depth == 0 {
                port = self.ports[part].iter().position(|&own| own == inner);
            }
        }
        let is_connector = self.scopes.instances[outer].kind == ClassKind::Connector;
        (is_connector || port.is_some()).then_some((End { part, port }, inner))
    }
}

/// Scalars of a connector by full name, those that are made equal first.
fn variables(scopes: &Scopes<'_>, connector: InstId) -> Vec<String> {
    let is_scalar = |inst: InstId| hyd_instance::instance::full_dims(&scopes.instances, inst).is_empty();
    if !is_scalar(connector) {
        return Vec::new();
    }
    if scopes.instances[connector].primitive.is_some() {
        return vec![path(&scopes.instances, connector)];
    }
    let children = scopes.instances[connector].children.iter().copied();
    let mut own: Vec<InstId> =
        children.filter(|&child| scopes.instances[child].primitive.is_some() && is_scalar(child)).collect();
    own.sort_by_key(|&child| scopes.instances[child].flow);
    own.into_iter().map(|child| path(&scopes.instances, child)).collect()
}

/// The figures that the documentation of a model asks for (Modelica 3.6, section 18.2).
fn figures(scopes: &Scopes<'_>) -> Vec<FigureInfo> {
    let Some(class) = scopes.instances[scopes.instances.tree().root].class else { return Vec::new() };
    let def = scopes.table.class(class).def.clone();
    let listed =
        def.annotation.as_ref().and_then(|own| argument(argument(own, "Documentation")?, "figures")?.binding.as_ref());
    let Some(ExprKind::Array(figures)) = listed.map(|expr| &expr.kind) else { return Vec::new() };
    figures.iter().filter_map(figure).collect()
}

/// Variables that `__hyd(plot = {...})` lists.
fn plotted(scopes: &Scopes<'_>) -> Vec<String> {
    let Some(class) = scopes.instances[scopes.instances.tree().root].class else { return Vec::new() };
    let def = scopes.table.class(class).def.clone();
    let listed = def.annotation.as_ref().and_then(|own| argument(argument(own, VENDOR)?, "plot")?.binding.as_ref());
    list(listed).iter().map(|expr| text(Some(expr))).filter(|name| !name.is_empty()).collect()
}

fn figure(expr: &Expr) -> Option<FigureInfo> {
    let plots: Vec<PlotInfo> = list(field(expr, "Figure", "plots")).iter().filter_map(plot).collect();
    let title = text(field(expr, "Figure", "title"));
    (!plots.is_empty()).then_some(FigureInfo { title, plots })
}

fn plot(expr: &Expr) -> Option<PlotInfo> {
    let curve = |expr: &Expr| {
        let name = |field: Option<&Expr>| field.map(hyd_syntax::print_expr);
        let x = name(field(expr, "Curve", "x")).unwrap_or_else(|| "time".to_string());
        Some((x, name(field(expr, "Curve", "y"))?, text(field(expr, "Curve", "legend"))))
    };
    let curves: Vec<_> = list(field(expr, "Plot", "curves")).iter().filter_map(curve).collect();
    (!curves.is_empty()).then(|| PlotInfo { title: text(field(expr, "Plot", "title")), curves })
}

/// A named argument of a call of this name.
fn field<'a>(expr: &'a Expr, called: &str, name: &str) -> Option<&'a Expr> {
    use hyd_syntax::tree::Arguments;
    match &expr.kind {
        ExprKind::Call(own, Arguments::List { named, .. })
            if own.parts.last().is_some_and(|own| *own.name.name == *called) =>
        {
            named.iter().find(|(own, _)| *own.name == *name).map(|(_, expr)| expr)
        }
        _ => None,
    }
}

fn list(expr: Option<&Expr>) -> &[Expr] {
    match expr.map(|expr| &expr.kind) {
        Some(ExprKind::Array(items)) => items,
        _ => &[],
    }
}

fn text(expr: Option<&Expr>) -> String {
    match expr.map(|expr| &expr.kind) {
        Some(ExprKind::Text(text)) => text.to_string(),
        _ => String::new(),
    }
}
