//! What is asked everywhere of instances, of the classes that they are of, and of values at translation.

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ClassKind, Component, Element, Expr, ExprKind, Name, Variability};
use rustc_hash::FxHashMap;

use crate::classes::class::{ClassId, ClassTable, elements};
use crate::classes::modifier::{Applied, Mods};
use crate::classes::shape::{Shape, ShapeElement};
use crate::instantiation::instance::{InstId, Instance, LocalClass, Scope, chain, path};
use crate::instantiation::missing_inner::AddedInner;
use crate::instantiation::rebased::VariantKey;
use crate::instantiation::tree::Instances;
use crate::values::constructor::Input;
use crate::values::value::{EnumType, Value};

/// A value set from outside by instance path.
#[derive(Clone, Debug)]
pub struct Override {
    /// Instance path.
    pub path: String,
    /// The value as it was written; its type says what it means.
    pub text: String,
    /// It was needed at translation.
    pub used: bool,
}

/// Where an overdetermined record stands in the tree of connections.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Rooting {
    /// Its component determines it.
    pub is_root: bool,
    /// It is nearer to the root than the other one of its branch.
    pub rooted: bool,
}

/// What the connections and equations of a model tell of its components: not in the tree, which stays as it was made.
#[derive(Debug, Default)]
pub struct Found {
    /// How often the elements of each connector are connected, once that is known.
    pub connected: Option<FxHashMap<InstId, Vec<u32>>>,
    /// Where the elements of overdetermined records stand in the tree of connections, once that is known.
    pub rooting: Option<FxHashMap<InstId, Vec<Rooting>>>,
    /// Variables that vary otherwise than declared: inputs that nothing outside gives a value, variables set at events only.
    pub variability: FxHashMap<InstId, Variability>,
    /// The state that a function run at translation has given the generator of random numbers with hidden state.
    pub hidden_state: Option<Value>,
}

/// State of a value that was asked for at translation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Known {
    /// Being computed (to see circles).
    Open,
    /// Computed: sizes of `spread` arrays of the binding first, own sizes after.
    Yes(Value),
    /// Could not be computed; a message has been given.
    Failed,
}

/// Makes component `k` of the shape of an instance, with the modifications from outside of that.
pub(crate) type MakeElement<'s> = fn(&mut Scopes<'s>, InstId, usize, &Mods) -> Result<(), Reported>;

/// Redeclares a local class of an instance; lookup knows no more of it.
pub(crate) type RedeclareClass<'s> = fn(&mut Scopes<'s>, InstId, &Rc<Shape>, usize, &Mods);

/// What names mean and which values they have: classes, components, constants of packages, values computed so far.
///
/// Instances are made through it, as a size may name any constant and any parameter.  When they are made it answers questions about the
/// texts of their classes, and goes on to read classes, to make constants and to compute values as these are named.
pub struct Scopes<'s> {
    /// Classes, texts and messages.
    pub table: ClassTable<'s>,
    /// All instances.
    pub instances: Instances,
    /// Values set from outside.
    pub overrides: Vec<Override>,
    /// What has been found out of components since they were made.
    pub found: Found,
    /// Values of parameters and constants that were asked for.
    pub(crate) known: FxHashMap<InstId, Known>,
    pub(crate) packages: FxHashMap<(ClassId, Option<InstId>), InstId>,
    pub(crate) enumerations: FxHashMap<ClassId, Option<Arc<EnumType>>>,
    /// Arguments of the constructors of records.
    pub(crate) constructors: FxHashMap<(ClassId, Option<InstId>), Rc<[Input]>>,
    /// Names of functions of the language that were looked for around a class and its text.
    pub(crate) declared_names: FxHashMap<(ClassId, ClassId, Name), bool>,
    /// Makes a component of an instance's shape when it is named before its turn; instantiation, which lookup does not know.
    pub(crate) make_element: MakeElement<'s>,
    /// Redeclares a local class when it is named before its turn; the same holds for it.
    pub(crate) redeclare: RedeclareClass<'s>,
    pub(crate) depth: usize,
    /// Values being computed, with the places that ask for them.
    pub(crate) open_values: Vec<(InstId, Span)>,
    /// Expressions being evaluated, one within the other.
    pub(crate) evaluating: usize,
    /// Parameters that were asked for only as a guess, while a guess is computed.
    pub(crate) guessed: Option<Vec<InstId>>,
    /// Work of computing values so far.
    pub(crate) work: u64,
    /// Modifications from outside of the instances whose components are being made.
    pub(crate) pending: FxHashMap<InstId, Mods>,
    /// Instances whose local classes are being redeclared: what is said of them, and for which elements that is done.
    pub(crate) redeclaring: FxHashMap<InstId, (Rc<Mods>, Vec<bool>)>,
    /// `inner` elements that no text declares.
    pub(crate) added_inner: Vec<AddedInner>,
    /// Local classes of instances whose bases are being looked for.
    pub(crate) adapting: Vec<(InstId, usize)>,
    /// Local classes of instances whose bases differ there from what the text alone says.
    pub(crate) variants: FxHashMap<VariantKey, ClassId>,
    /// Instances that bases of such classes are elements of, where they are not those around the classes.
    pub(crate) contexts_of_bases: FxHashMap<ClassId, Vec<InstId>>,
    /// There are more components than there may be, and that has been said.
    pub(crate) too_many: bool,
    /// Arrays of components, by path, that are made element by element, and those that would have to be.
    pub(crate) apart: BTreeSet<String>,
    pub(crate) differing: BTreeSet<String>,
    /// Values of modifications of such arrays, by the place of their texts, which are kept with them.
    pub(crate) values_for_parts: FxHashMap<(usize, Scope), (Arc<Expr>, Value)>,
}

/// What a redeclaration does not say of these prefixes stays as it was declared first (Modelica 3.6, section 7.3).
pub(crate) fn variability_of(new: &Component, first: &Component) -> Variability {
    if new.variability == Variability::Continuous { first.variability } else { new.variability }
}

impl Scopes<'_> {
    /// The answer to a question whose messages are not meant for anybody.
    pub fn quietly<T>(&mut self, question: impl FnOnce(&mut Self) -> T) -> T {
        self.table.messages.begin();
        let answer = question(self);
        self.table.messages.end();
        answer
    }

    /// True if a message has been given for the value or for the component itself.
    pub fn has_failed(&self, inst: InstId) -> bool {
        self.instances[inst].broken || matches!(self.known.get(&inst), Some(Known::Failed))
    }

    /// True for a parameter or constant whose value was needed at translation.
    pub fn has_value(&self, inst: InstId) -> bool {
        matches!(self.known.get(&inst), Some(Known::Yes(_)))
    }

    /// The variability of a component, as it was found to be or as it is declared.
    pub fn variability(&self, inst: InstId) -> Variability {
        self.found.variability.get(&inst).copied().unwrap_or(self.instances[inst].variability)
    }

    /// The instance that holds the constants of a package, of a function or of a type: the scope of its text.
    ///
    /// # Errors
    /// When the class has no shape; reported.
    pub fn package_of(&mut self, local: &LocalClass) -> Result<InstId, Reported> {
        let LocalClass { class, context, .. } = *local;
        if let Some(&known) = self.packages.get(&(class, context)) {
            return Ok(known);
        }
        let shape = self.table.shape(class)?;
        let def = self.table.class(class).def.clone();
        let inst = self.instances.add(Instance::new(self.table.full_name(class).into(), None, def.name.span));
        self.instances.edit(inst).class = Some(class);
        self.instances.edit(inst).context = context;
        self.instances.edit(inst).shape = Some(shape);
        self.instances.edit(inst).kind = ClassKind::Package;
        let shape = self.table.shape(class)?;
        if shape.builtin.is_none() {
            self.check_targets(inst, &shape, &Mods::new(), 0);
        }
        self.packages.insert((class, context), inst);
        Ok(inst)
    }

    pub(crate) fn declared(&self, shape: &Shape, element: &ShapeElement) -> Option<Component> {
        let class = shape.frames[element.frame as usize].class;
        let Element::Component(component) = &elements(&self.table.class(class).def)[element.position as usize] else {
            return None;
        };
        let mut component = component.clone();
        if let Some((frame, position)) = element.replaced
            && let class = shape.frames[frame as usize].class
            && let Some(Element::Component(first)) = elements(&self.table.class(class).def).get(position as usize)
        {
            component.variability = variability_of(&component, first);
            component.flow |= first.flow;
            component.stream |= first.stream;
            component.direction = component.direction.or(first.direction);
        }
        Some(component)
    }

    /// True for a component that is a record, also one that is a connector: `connector C = input R`.
    pub fn is_record(&self, inst: InstId) -> bool {
        let instance = &self.instances[inst];
        let of_record = |shape: &Rc<Shape>| {
            shape.frames.iter().any(|frame| self.table.class(frame.class).def.kind == ClassKind::Record)
        };
        match instance.kind {
            ClassKind::Record => true,
            ClassKind::Connector => instance.shape.as_ref().is_some_and(of_record),
            _ => false,
        }
    }

    /// True where the class that has a component declares it protected, whatever is around that.
    pub fn is_declared_protected(&self, inst: InstId) -> bool {
        let instance = &self.instances[inst];
        let shape = instance.parent.and_then(|parent| self.instances[parent].shape.as_ref());
        let Some((shape, &k)) = shape.and_then(|shape| Some((shape, shape.by_name.get(&instance.name)?))) else {
            return false;
        };
        let element = &shape.elements[k as usize];
        let frame = &shape.frames[element.frame as usize];
        let declared = &elements(&self.table.class(frame.class).def)[element.position as usize];
        frame.protected || matches!(declared, Element::Component(component) if component.prefixes.protected)
    }

    pub(crate) fn final_modified(&mut self, name: &str, at: Option<Span>, declared: Option<Span>) {
        let message = format!("`{name}` is final and cannot be modified");
        let mut diagnostic = Diagnostic::error(Code::FinalModified, message);
        if let Some(span) = at {
            diagnostic = diagnostic.at(span, "modified here");
        }
        if let Some(span) = declared {
            diagnostic = diagnostic.with(span, "declared final here");
        }
        let diagnostic = diagnostic.help(format!(
            "leave `{name}` out: its declaration decides its value, so set what that reads, if anything"
        ));
        self.table.report(diagnostic);
    }

    /// Reports an error at a place.
    pub fn error(&mut self, code: Code, span: Span, message: impl Into<String>) -> Reported {
        self.table.report(Diagnostic::error(code, message).at(span, ""));
        Reported
    }

    pub(crate) fn not_structural(&mut self, span: Span, message: String) -> Reported {
        self.table.report(Diagnostic::error(Code::NotStructural, message).at(span, "needed before the run"));
        Reported
    }

    pub(crate) fn no_meaning(&mut self, span: Span, message: impl Into<String>) -> Reported {
        self.error(Code::TypeMismatch, span, message)
    }

    /// Notes that a component could not be made, so that its uses give no further messages.
    pub(crate) fn broken(&mut self, parent: InstId, name: &Name, span: Span) {
        let inst = match self.instances[parent].by_name.get(name) {
            Some(&made) => made,
            None => {
                let made = self.instances.add(Instance::new(name.clone(), Some(parent), span));
                self.instances.edit(parent).by_name.insert(name.clone(), made);
                made
            }
        };
        self.instances.edit(inst).broken = true;
    }

    /// True if a message has been given for the component or one it is in.
    pub fn is_broken(&self, inst: InstId) -> bool {
        self.instances[inst].primitive.is_none() && self.has_failed(inst)
    }

    /// A component whose sizes are asked for must be known by now.
    pub(crate) fn want_made(&mut self, inst: InstId, span: Span) -> Result<(), Reported> {
        let instance = &self.instances[inst];
        if instance.primitive.is_some() || instance.shape.is_some() || instance.absent {
            return Ok(());
        }
        if !self.has_failed(inst) {
            let (name, declared) = (path(&self.instances, inst), instance.span);
            let message = format!("the size of `{name}` depends on itself");
            self.table.report(
                Diagnostic::error(Code::CircularParameters, message)
                    .at(span, "the cycle closes here")
                    .with(declared, "declared here"),
            );
        }
        Err(Reported)
    }

    /// Puts the components of an instance back into the order of the text.
    pub(crate) fn order_children(&mut self, inst: InstId) {
        let Some(shape) = self.instances[inst].shape.clone() else { return };
        let mut children = std::mem::take(&mut self.instances.edit(inst).children);
        children.sort_by_key(|&child| shape.by_name.get(self.declared_name(child)).copied());
        self.instances.edit(inst).children = children;
    }

    /// Paths of arrays of components whose elements were found to differ where they must not: to be instantiated in parts.
    pub fn differing(&self) -> &BTreeSet<String> {
        &self.differing
    }

    /// The name that the component was declared with.
    pub fn declared_name(&self, inst: InstId) -> &Name {
        let declared = self.instances[inst].part_of.as_ref().map_or(inst, |(array, _)| *array);
        &self.instances[declared].name
    }

    /// The element of an array made in parts that literal subscripts name; none for other subscripts.
    pub fn part_at(&self, array: InstId, subscripts: &[Expr]) -> Option<InstId> {
        let instance = &self.instances[array];
        if instance.parts.is_empty() || subscripts.len() != instance.dims.len() {
            return None;
        }
        let mut position = 0;
        for (subscript, &size) in subscripts.iter().zip(&instance.dims) {
            let ExprKind::Integer(k) = subscript.kind else { return None };
            let k = usize::try_from(k - 1).ok().filter(|&k| k < size)?;
            position = position * size + k;
        }
        instance.parts.get(position).copied()
    }

    /// A reference into an array made in parts whose subscripts name none of them.
    pub(crate) fn no_such_part(&mut self, array: InstId, subscripts: &[Expr], span: Span) -> Reported {
        let instance = &self.instances[array];
        let (name, dims) = (instance.name.clone(), instance.dims.clone());
        let outside = subscripts.iter().zip(&dims).find_map(|(subscript, &size)| match subscript.kind {
            ExprKind::Integer(k) if k < 1 || k as usize > size => Some((k, size)),
            _ => None,
        });
        let diagnostic = match outside {
            Some((k, size)) => {
                Diagnostic::error(Code::ArrayShape, format!("subscript {k} of `{name}` is outside 1..{size}"))
            }
            None => {
                let message =
                    format!("the elements of `{name}` differ in structure: its subscripts must be known here");
                Diagnostic::error(Code::NotStructural, message)
            }
        };
        self.table.report(diagnostic.at(span, ""));
        Reported
    }

    /// True if a modification speaks of all elements of an array made in parts.
    pub(crate) fn is_for_parts(&self, applied: &Applied) -> bool {
        !self.apart.is_empty() && applied.spread.iter().any(|&inst| self.instances[inst].part_of.is_some())
    }

    /// Position of the value set from outside for a parameter, the last one said; one for an array made in parts is for all of them.
    pub fn override_of(&self, inst: InstId) -> Option<usize> {
        let instance = &self.instances[inst];
        let settable = self.variability(inst) == Variability::Parameter
            && !instance.final_record
            && instance.primitive.as_ref().is_some_and(|primitive| !primitive.is_final);
        if self.overrides.is_empty() || !settable {
            return None;
        }
        let own = path(&self.instances, inst);
        let whole = self.path_of_arrays(inst);
        self.overrides.iter().rposition(|o| o.path == own || o.path == whole)
    }

    /// The path without the subscripts of parts.
    pub fn path_of_arrays(&self, inst: InstId) -> String {
        let names = chain(&self.instances, inst).into_iter().map(|id| self.declared_name(id).as_ref());
        names.filter(|name| !name.is_empty()).collect::<Vec<_>>().join(".")
    }

    /// Sizes of the arrays around an instance and its own, those made in parts among them.
    pub(crate) fn sizes_as_written(&self, inst: InstId) -> Vec<usize> {
        let sizes = |id: InstId| match &self.instances[id].part_of {
            Some((array, _)) => self.instances[*array].dims.clone(),
            None => self.instances[id].dims.clone(),
        };
        chain(&self.instances, inst).into_iter().flat_map(sizes).collect()
    }

    /// True if elements of the arrays around a parameter are set from outside one by one.
    pub fn is_set_by_element(&self, inst: InstId) -> bool {
        if self.overrides.is_empty() {
            return false;
        }
        let whole = self.path_of_arrays(inst);
        let subscripted = |path: &str| path.rsplit_once('.').is_some_and(|(around, _)| around.contains('['));
        self.overrides.iter().any(|o| subscripted(&o.path) && without_subscripts(&o.path) == whole)
            && chain(&self.instances, inst).into_iter().any(|id| id != inst && !self.instances[id].dims.is_empty())
    }

    /// Values set from outside that differ between the elements of the arrays around a parameter.
    pub(crate) fn set_by_element(&mut self, inst: InstId, span: Span) -> Reported {
        let around = chain(&self.instances, inst).into_iter().filter(|&id| id != inst);
        let arrays: Vec<String> =
            around.filter(|&id| !self.instances[id].dims.is_empty()).map(|id| path(&self.instances, id)).collect();
        self.differing.extend(arrays);
        let name = path(&self.instances, inst);
        self.not_structural(span, format!("the values set for `{name}` differ between the elements of an array"))
    }

    /// True for an element that no text declares.
    pub fn is_added_inner(&self, inst: InstId) -> bool {
        self.added_inner.iter().any(|added| added.inst == inst)
    }

    /// Where the text of the model declares the component that holds an instance of another file, such as a library's; none
    /// where the instance stands in the model's own text.
    pub fn users_line(&self, inst: InstId) -> Option<Span> {
        let root = self.instances.tree().root;
        let own = self.table.class(self.instances[root].class?).def.name.span.file;
        let is_own = |inst: InstId| self.instances[inst].span.file == own;
        if is_own(inst) {
            return None;
        }
        let above = std::iter::successors(Some(inst), |&inst| self.instances[inst].parent);
        let above = above.take_while(|&inst| inst != root);
        above.skip(1).find(|&inst| is_own(inst)).map(|inst| self.instances[inst].span)
    }

    /// Says that a value that is needed at translation is found by the start.
    pub(crate) fn found_at_start(&mut self, inst: InstId, span: Span) -> Reported {
        let (name, declared) = (path(&self.instances, inst), self.instances[inst].span);
        let message =
            format!("the value of `{name}` is found at the start (`fixed = false`), but decides sizes or structure");
        let diagnostic = Diagnostic::error(Code::NotStructural, message).at(span, "needed before the run");
        self.table.report(diagnostic.with(declared, "declared here"));
        Reported
    }
}

/// The path of a name without what stands in brackets.
fn without_subscripts(path: &str) -> String {
    let mut depth = 0;
    path.chars()
        .filter(|&c| {
            depth += i32::from(c == '[');
            let outside = depth == 0;
            depth -= i32::from(c == ']');
            outside
        })
        .collect()
}
