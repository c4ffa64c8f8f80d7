//! Functions that an operator record declares for its operators and constructors (Modelica 3.6, section 14.2).

use hyd_source::Reported;
use hyd_syntax::tree::{ClassKind, Direction, Expr, Ident, Name};

use crate::classes::class::{ClassId, nested_classes};
use crate::instantiation::instance::LocalClass;
use crate::instantiation::scopes::Scopes;

impl Scopes<'_> {
    /// The functions of an operator (`'+'`, `'constructor'`) of a record, in the order of the text; none where it declares none.
    pub fn overloads(&mut self, record: ClassId, operator: &str) -> Vec<LocalClass> {
        let Some(class) = self.table.member_class(record, &Name::from(operator)) else { return Vec::new() };
        let def = self.table.class(class).def.clone();
        match def.kind {
            ClassKind::Function => vec![LocalClass::plain(class)],
            ClassKind::Operator => {
                let names: Vec<Name> = nested_classes(&def).map(|nested| nested.class.name.name.clone()).collect();
                let functions = names.iter().filter_map(|name| self.table.member_class(class, name));
                functions.map(LocalClass::plain).collect()
            }
            _ => Vec::new(),
        }
    }

    /// True for a record that declares its own constructors.
    pub(crate) fn has_constructors(&mut self, record: ClassId) -> bool {
        !self.overloads(record, "'constructor'").is_empty()
    }

    /// How many inputs of a function have no default.
    pub fn required_inputs(&mut self, function: &LocalClass) -> Result<usize, Reported> {
        let shape = self.table.shape(function.class)?;
        let inputs = self.components_of(&shape);
        let required = |(_, c): &&(u32, hyd_syntax::tree::Component)| {
            c.direction == Some(Direction::Input) && c.modification.binding.is_none()
        };
        Ok(inputs.iter().filter(required).count())
    }

    /// The constructor of a record that takes so many arguments by these names; `None` where it declares none.
    pub(crate) fn constructor_for(
        &mut self,
        record: &LocalClass,
        positional: &[Expr],
        named: &[(Ident, Expr)],
    ) -> Result<Option<LocalClass>, Reported> {
        let given = positional.len() + named.len();
        for function in self.overloads(record.class, "'constructor'") {
            let shape = self.table.shape(function.class)?;
            let inputs: Vec<Name> = self
                .components_of(&shape)
                .into_iter()
                .filter(|(_, c)| c.direction == Some(Direction::Input))
                .map(|(_, c)| c.name.name)
                .collect();
            let known = named.iter().all(|(name, _)| inputs.contains(&name.name));
            if known && given <= inputs.len() && self.required_inputs(&function)? <= given {
                return Ok(Some(function));
            }
        }
        Ok(None)
    }
}
