//! Bounds on what is computed at translation.
//!
//! Functions, loops and arrays of known values are computed as they are written, so that a mistake, or one line like
//! `sum(i*j for i in 1:n, j in 1:n)`, could take for ever or all memory.  Work is counted in pieces that take about the same time;
//! it ends in a message where it comes to that of twenty million statements, some seconds.

use hyd_source::{Code, Diagnostic, Reported, Span};

use crate::classes::shape::{Shape, ShapeElement};
use crate::instantiation::instance::InstId;
use crate::instantiation::scopes::Scopes;
use crate::values::value::Value;

/// Largest array that is computed at translation.
pub(crate) const MAX_VALUES: usize = 1 << 24;

/// Most statements that all that is computed at translation may take together.
const MAX_STATEMENTS: u64 = 20_000_000;

/// Work of a statement of a function.
pub(crate) const STATEMENT: u64 = 16;

/// Work of computing an expression once more with other loop variables.
pub(crate) const TURN: u64 = 8;

/// Work of making or going through one element of an array.
pub(crate) const ELEMENT: u64 = 2;

/// Most components and variables that declarations may make, an array counted once: classes that hold two of the class before
/// double it with every line.
const MAX_COMPONENTS: usize = 1 << 21;

/// Largest number of elements of one array of components or variables.
pub(crate) const MAX_ELEMENTS: usize = 1 << 27;

impl Scopes<'_> {
    /// Stops where there are too many components.
    ///
    /// # Errors
    /// When there are; reported once.
    pub(crate) fn limit_components(
        &mut self,
        parent: InstId,
        shape: &Shape,
        element: &ShapeElement,
    ) -> Result<(), Reported> {
        if self.too_many {
            return Err(Reported);
        }
        if self.instances.len() < MAX_COMPONENTS {
            return Ok(());
        }
        self.too_many = true;
        let Some(declaration) = self.declared(shape, element) else { return Err(Reported) };
        let message = format!("the model has more than {MAX_COMPONENTS} components and variables");
        let mut diagnostic = Diagnostic::error(Code::Limit, message).at(declaration.name.span, "reached here");
        // Where the user may look for the cause: the outermost component around it.
        let above = std::iter::successors(Some(parent), |&inst| self.instances[inst].parent);
        if let Some(outermost) =
            above.filter(|&inst| self.instances[inst].parent == Some(self.instances.tree().root)).last()
        {
            diagnostic = diagnostic.with(self.instances[outermost].span, "in this component");
        }
        self.table.report(diagnostic);
        Err(Reported)
    }

    /// Counts work before it is done.
    ///
    /// # Errors
    /// When all there may be is done; reported once.
    pub(crate) fn spend(&mut self, work: u64, span: Span) -> Result<(), Reported> {
        const MOST: u64 = MAX_STATEMENTS * STATEMENT;
        let before = self.work;
        self.work = before.saturating_add(work);
        if self.work < MOST {
            return Ok(());
        }
        if before < MOST {
            let message = format!(
                "functions, loops and arrays computed before the run take longer than {MAX_STATEMENTS} statements"
            );
            self.table.report(Diagnostic::error(Code::Limit, message).at(span, "still running here"));
        }
        Err(Reported)
    }

    /// Counts the elements of an array that was computed.
    pub(crate) fn spend_on(&mut self, value: &Value, span: Span) -> Result<(), Reported> {
        let Some(count) = volume(&value.shape()) else {
            let message = format!("an array computed before the run has more than {MAX_VALUES} elements");
            return Err(self.error(Code::Limit, span, message));
        };
        if value.shape().is_empty() { Ok(()) } else { self.spend(ELEMENT * count as u64, span) }
    }
}

/// The number of elements of an array of these sizes, if it may have so many, and each of its rows, too.
pub(crate) fn volume(sizes: &[usize]) -> Option<usize> {
    let allowed = |count: &usize| *count <= MAX_VALUES;
    sizes
        .iter()
        .try_fold(1usize, |count, &size| count.checked_mul(size).filter(allowed))
        .filter(|_| sizes.iter().all(allowed))
}
