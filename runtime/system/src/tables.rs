//! What a system says about itself: names, units, places in the text.  Plain data, no references into a compiler.

use std::borrow::Cow;
use std::sync::Arc;

/// A variable name over an array: text parts, each followed by the sizes of its subscripts.
///
/// `a[2].b[1,3]` of arrays `a[4]`, `b[2,3]` is element 2*... of the parts `("a", [4])`, `(".b", [2, 3])`; elements count
/// row-major with the last subscript fastest.  A scalar has one part without sizes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NamePattern {
    /// Text and subscript sizes.
    pub parts: Vec<(Arc<str>, Vec<u32>)>,
    /// Wraps the name: `der(...)` when true.
    pub derivative: bool,
}

impl NamePattern {
    /// A scalar's name.
    pub fn scalar(name: impl Into<Arc<str>>) -> Self {
        Self { parts: vec![(name.into(), Vec::new())], derivative: false }
    }

    /// Number of elements.
    pub fn count(&self) -> usize {
        self.parts.iter().flat_map(|(_, dims)| dims).map(|&d| d as usize).product()
    }

    /// The full name of element `k`, as Modelica writes it.
    pub fn element(&self, k: usize) -> String {
        self.name(k).into_owned()
    }

    /// The same, without a copy where no indices have to be written: for those who read many names and keep few.
    pub fn name(&self, mut k: usize) -> Cow<'_, str> {
        if let [(name, dims)] = &self.parts[..]
            && dims.is_empty()
            && !self.derivative
        {
            return Cow::Borrowed(name);
        }
        let mut text = String::new();
        if self.derivative {
            text.push_str("der(");
        }
        let mut rest = self.count();
        for (part, dims) in &self.parts {
            text.push_str(part);
            for (position, &size) in dims.iter().enumerate() {
                rest /= (size as usize).max(1);
                text.push(if position == 0 { '[' } else { ',' });
                text.push_str(&(k / rest.max(1) + 1).to_string());
                k %= rest.max(1);
            }
            if !dims.is_empty() {
                text.push(']');
            }
        }
        if self.derivative {
            text.push(')');
        }
        Cow::Owned(text)
    }
}

/// Where a value of a run is found.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Place {
    /// Position in the row that `DaeSystem::outputs` fills.
    Output(u32),
    /// Position in `DaeSystem::parameters`.
    Parameter(u32),
    /// A fixed number.
    Constant(f64),
}

/// A place and a sign (aliases may be the negative of another variable).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Source {
    /// The place.
    pub place: Place,
    /// The value is the negative of what stands there.
    pub negated: bool,
}

/// How values of a variable are to be read; all values are stored as `f64`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ValueKind {
    /// A real number.
    Real,
    /// An integer.
    Integer,
    /// 0 or 1.
    Boolean,
    /// A literal of an enumeration, counted from 1.
    Enumeration(Arc<[Arc<str>]>),
}

/// When a variable may change.
#[derive(Clone, Copy, PartialEq, Eq, Debug, PartialOrd, Ord)]
pub enum Variability {
    /// Never.
    Constant,
    /// Not during a run.
    Parameter,
    /// At events.
    Discrete,
    /// Always.
    Continuous,
}

/// Whether a parameter can be set on a translated model.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Settable {
    /// Not a parameter, or final.
    No,
    /// Yes, as run-time data.
    Yes,
    /// No: it decides sizes or structure and must be set before translation.
    Structural,
}

/// How a variable of a connector behaves where connectors are joined.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MemberKind {
    /// An input or output.
    Signal,
    /// Equal in all that are joined.
    Potential,
    /// Adds up to zero; positive into the component or unit.
    Flow,
    /// Carried by the flow.
    Stream,
}

/// A variable, or an array of them.
#[derive(Clone, PartialEq, Debug)]
pub struct VariableInfo {
    /// Name with subscripts.
    pub name: NamePattern,
    /// SI unit, `""` if unknown, `"1"` if dimensionless.
    pub unit: Arc<str>,
    /// Unit for display, `""` if none.
    pub display_unit: Arc<str>,
    /// Description string.
    pub description: Arc<str>,
    /// How to read values.
    pub kind: ValueKind,
    /// When it changes.
    pub variability: Variability,
    /// Can it be set?
    pub settable: Settable,
    /// Declared in a protected section.
    pub protected: bool,
    /// One source per element.
    pub sources: Vec<Source>,
}

/// An equation of the user's, or an array of them.
#[derive(Clone, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
pub struct EquationInfo {
    /// Instance path of the component, `""` at the top.
    pub component: Arc<str>,
    /// The equation as text.
    pub text: Arc<str>,
    /// File name.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
}

/// A relation whose change of truth is an event.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RootInfo {
    /// The relation as text, such as `h <= 0`.
    pub text: Arc<str>,
    /// File name.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
}

/// A set of variables that only together follow from as many equations.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LoopInfo {
    /// Those of them that are unknowns `y[k]`.
    pub unknowns: Vec<u32>,
    /// All of them: index into [`Tables::variables`] and element.
    pub variables: Vec<(u32, u32)>,
    /// User equations: indices into [`Tables::equations`].
    pub equations: Vec<u32>,
}

/// Everything a system says about itself.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Tables {
    /// Name of the model.
    pub model: Arc<str>,
    /// All variables, parameters and constants in the order of the text.
    pub variables: Vec<VariableInfo>,
    /// Name of each unknown `y[k]`: index into `variables` and element.
    pub unknowns: Vec<(u32, u32)>,
    /// User equation of each residual row: index into `equations`.
    pub rows: Vec<u32>,
    /// Loops: sets of variables that only together follow from as many equations.
    pub loops: Vec<LoopInfo>,
    /// User equations.
    pub equations: Vec<EquationInfo>,
    /// Relations behind the root functions.
    pub roots: Vec<RootInfo>,
    /// Name of each unknown of the initial system, in the user's words (`x`, `der(v)`).
    pub initial_unknowns: Vec<Arc<str>>,
    /// User equation of each row of the initial system: index into `equations`.
    pub initial_rows: Vec<u32>,
}

impl Tables {
    /// Name of unknown `y[k]`.
    pub fn unknown_name(&self, k: usize) -> String {
        match self.unknowns.get(k) {
            Some(&(variable, element)) => self.variables[variable as usize].name.element(element as usize),
            None => format!("unknown {}", k + 1),
        }
    }

    /// Name of what stands at a place.  Linear in the number of variables.
    pub fn name_at(&self, place: Place) -> Option<String> {
        self.variables.iter().find_map(|variable| {
            let element = variable.sources.iter().position(|source| source.place == place)?;
            Some(variable.name.element(element))
        })
    }

    /// The user's equation behind residual row `k`.
    pub fn row_equation(&self, k: usize) -> Option<&EquationInfo> {
        self.rows.get(k).and_then(|&e| self.equations.get(e as usize))
    }

    /// The loop that unknown `y[k]` belongs to; none if it follows from its equation alone.  Linear in the number of loops.
    pub fn loop_of(&self, k: usize) -> Option<&LoopInfo> {
        self.loops.iter().find(|found| found.unknowns.contains(&(k as u32)))
    }

    /// The variable and element with this full name, such as `a[2].b` or `der(x)`.  Linear in the number of variables.
    pub fn find(&self, name: &str) -> Option<(&VariableInfo, usize)> {
        self.variables.iter().find_map(|variable| {
            // A derivative is one by its pattern, or a variable with such a name.
            let first = &variable.name.parts[0].0;
            if !name.trim_start_matches("der(").starts_with(first.trim_start_matches("der(")) {
                return None;
            }
            (0..variable.name.count()).find(|&k| variable.name.element(k) == name).map(|k| (variable, k))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_named_row_major() {
        let name = NamePattern { parts: vec![("a".into(), vec![4]), (".b".into(), vec![2, 3])], derivative: false };
        assert_eq!(name.count(), 24);
        assert_eq!(name.element(0), "a[1].b[1,1]");
        assert_eq!(name.element(23), "a[4].b[2,3]");
        assert_eq!(name.element(8), "a[2].b[1,3]");
        let rate = NamePattern { derivative: true, ..NamePattern::scalar("x") };
        assert_eq!((rate.count(), rate.element(0)), (1, "der(x)".to_string()));
    }
}
