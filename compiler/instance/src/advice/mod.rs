//! Warnings about names of the main text: what is declared and never used, and what hides another name.
//!
//! Both look at the text of classes alone, without instances, so that they also cover classes that no model uses.  Where the
//! text cannot tell (elements of unknown classes, inherited names, `import A.*`) nothing is said: a warning that is wrong
//! costs more than one that is missing.  Libraries are not looked at.

mod hidden;
mod mentions;
mod unused;

use crate::classes::class::{ClassId, ClassTable};

impl ClassTable<'_> {
    /// Adds the warnings about the classes of the main text.
    pub fn advise(&mut self, classes: &[ClassId]) {
        let texts: Vec<_> = classes.iter().map(|&class| self.class(class).def.clone()).collect();
        let mut found = unused::unused(&texts);
        found.extend(hidden::hidden(&texts));
        found.sort_by_key(|diagnostic| diagnostic.labels.first().map(|label| label.span.start));
        for diagnostic in found {
            self.report(diagnostic);
        }
    }
}
