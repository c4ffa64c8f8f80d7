//! What a picture shows: panels over one time axis, each with the curves of one unit.

use std::sync::Arc;

use crate::drawing::Drawing;
use crate::layout::lay_out;

/// One variable of one run.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Full name of the variable.
    pub name: String,
    /// Position of the run in [`Figure::runs`] (0 if there is only one).
    pub run: usize,
    /// Ascending times in s; an event stands twice.
    pub times: Arc<[f64]>,
    /// As many values, in the panel's unit; what is not finite leaves a gap.
    pub values: Vec<f64>,
}

/// Curves that share a value axis.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Unit as the models write it (`Pa`, `m3/s`); `""` if unknown.
    pub unit: String,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// A picture to be made.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Line above the picture.
    pub title: Option<String>,
    /// Labels of the runs; shown if there are several.
    pub runs: Vec<String>,
    /// The runs are members of one family: colour tells their order, and the legend names a few of them.
    pub family: bool,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
    /// Width of the picture in pixels of 1/96 inch.
    pub width: f64,
    /// Height of one panel's axes; `None`: by the number of panels.
    pub panel_height: Option<f64>,
}

impl Figure {
    /// Width of a picture over a page's text width (170 mm), in pixels of 1/96 inch.
    pub const PAGE_WIDTH: f64 = 642.0;

    /// One panel per unit in the order of first occurrence; where the unit is unknown (`""`), one per variable.
    pub fn by_unit(runs: Vec<String>, curves: impl IntoIterator<Item = (String, Curve)>) -> Self {
        let mut panels: Vec<Panel> = Vec::new();
        for (unit, curve) in curves {
            let home = panels
                .iter_mut()
                .find(|panel| panel.unit == unit && (!unit.is_empty() || panel.curves[0].name == curve.name));
            match home {
                Some(panel) => panel.curves.push(curve),
                None => panels.push(Panel { unit, curves: vec![curve] }),
            }
        }
        Self { title: None, runs, family: false, panels, width: Self::PAGE_WIDTH, panel_height: None }
    }

    /// The runs of a family: one panel per variable.
    pub fn of_family(runs: Vec<String>, curves: impl IntoIterator<Item = (String, Curve)>) -> Self {
        let mut panels: Vec<Panel> = Vec::new();
        for (unit, curve) in curves {
            match panels.iter_mut().find(|panel| panel.curves[0].name == curve.name) {
                Some(panel) => panel.curves.push(curve),
                None => panels.push(Panel { unit, curves: vec![curve] }),
            }
        }
        Self { title: None, runs, family: true, panels, width: Self::PAGE_WIDTH, panel_height: None }
    }

    /// Lays the picture out.
    pub fn draw(&self) -> Drawing {
        lay_out(self)
    }
}

impl Panel {
    /// Names of the variables, each once, in order.
    pub(crate) fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for curve in &self.curves {
            if !names.contains(&curve.name.as_str()) {
                names.push(&curve.name);
            }
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_are_units_and_unknown_units_stay_apart() {
        let curve = |name: &str, run| Curve { name: name.into(), run, times: Arc::new([]), values: Vec::new() };
        let curves = [("Pa", "p", 0), ("", "a", 0), ("m", "x", 0), ("", "b", 0), ("Pa", "p_0", 0), ("", "a", 1)];
        let figure = Figure::by_unit(Vec::new(), curves.map(|(unit, name, run)| (unit.to_string(), curve(name, run))));
        let seen: Vec<(&str, Vec<&str>, usize)> =
            figure.panels.iter().map(|p| (p.unit.as_str(), p.names(), p.curves.len())).collect();
        let expected = [("Pa", vec!["p", "p_0"], 2), ("", vec!["a"], 2), ("m", vec!["x"], 1), ("", vec!["b"], 1)];
        assert_eq!(seen, expected);
    }
}
