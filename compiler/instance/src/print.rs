//! The instance tree as text, one component a line, and its invariants.

use std::fmt;

use crate::instantiation::instance::InstId;
use crate::instantiation::scopes::Scopes;

impl fmt::Display for Scopes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.print(f, self.instances.tree().root, 0)
    }
}

impl Scopes<'_> {
    fn print(&self, f: &mut fmt::Formatter<'_>, inst: InstId, depth: usize) -> fmt::Result {
        let instance = &self.instances[inst];
        let what = match (&instance.primitive, instance.class) {
            (Some(primitive), _) => primitive.scalar.name().to_string(),
            (None, Some(class)) => format!("{} {}", instance.kind.keyword(), self.table.full_name(class)),
            (None, None) => "?".to_string(),
        };
        let sizes = if instance.dims.is_empty() { String::new() } else { format!("{:?}", instance.dims) };
        let absent = if instance.absent { " (absent)" } else { "" };
        let name = if instance.name.is_empty() { "." } else { &instance.name };
        writeln!(f, "{:indent$}{name}{sizes}: {what}{absent}", "", indent = 2 * depth)?;
        instance.children.iter().try_for_each(|&child| self.print(f, child, depth + 1))
    }

    /// A sentence about the first invariant that does not hold: children know their parent, names lead to components of
    /// that name, a component is a variable or has a class.
    pub fn verify(&self) -> Result<(), String> {
        for id in self.instances.indices() {
            let instance = &self.instances[id];
            let path = || crate::instantiation::instance::path(&self.instances, id);
            for &child in &instance.children {
                if self.instances[child].parent != Some(id) {
                    return Err(format!("a component of `{}` has another parent", path()));
                }
            }
            for (name, &child) in &instance.by_name {
                if self.instances[child].name != *name {
                    return Err(format!("`{name}` of `{}` leads to `{}`", path(), self.instances[child].name));
                }
            }
            if instance.primitive.is_some() && !instance.children.is_empty() {
                return Err(format!("the variable `{}` has components", path()));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crate::{ClassTable, SourceText, Sources, instantiate};

    struct Nothing;

    impl Sources for Nothing {
        fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
            Ok(None)
        }
    }

    #[test]
    fn a_tree_prints_its_components_with_sizes() {
        let text = "package P
  model Cell
    parameter Real k = 1;
    Real x[2];
  end Cell;
  model Top
    parameter Integer n = 3;
    Cell c[n];
    Cell none if n > 5;
  end Top;
end P;";
        let mut nothing = Nothing;
        let mut table = ClassTable::new(&mut nothing);
        let package = table.add_main("p.hyd", text)[0];
        let top = table.child(package, &"Top".into()).expect("written above");
        let Ok((_, scopes)) = instantiate(table, top, Vec::new()) else { panic!("the text is right") };
        assert_eq!(scopes.verify(), Ok(()));
        let lines = [
            ".: model P.Top",
            "  n: Integer",
            "  c[3]: model P.Cell",
            "    k: Real",
            "    x[2]: Real",
            "  none: ? (absent)",
        ];
        assert_eq!(scopes.to_string(), lines.join("\n") + "\n");
    }
}
