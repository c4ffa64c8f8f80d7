//! Terms that an equation may lack: shapes of the variables around it, each with one coefficient.
//!
//! Equations that only define or connect (`der(y) = v`, `a.u = b.y`) lack nothing: their terms would mean nothing.
//! Balances may lack a term, laws may be wrong, and measuring chains are equations like others.  The same shape holds
//! in all shots, which is what tells a force from a pressure: a free function of time could imitate one by the other
//! (Wang 2026; Brynjarsdottir, O'Hagan 2014).  Ranges of the variables decide the widths of shapes; they come from runs
//! of the model as it is.

use std::collections::BTreeMap;
use std::sync::Arc;

use hyd_compiler::InjectionSite;
use hyd_system::{Tables, ValueKind, Variability};

use crate::terms::unit_quotient::quotient;
use crate::variant::translated::ChannelNames;

/// Most variables of the neighbourhood that are tried in one equation.
const MOST_VARIABLES: usize = 6;
/// Most variables of which products are tried.
const MOST_FACTORS: usize = 4;
/// Width of the transition of a saturating shape, and of the shapes near an end, by the range of the variable.
const NARROW: f64 = 0.03;
/// A variable that changes by less than this part of its size is a constant.
const STILL: f64 = 1e-9;

/// A term: a coefficient times a shape, added to the right side of an equation.
#[derive(Clone, Debug)]
pub struct Term {
    /// Instance path of the component whose equation it is.
    pub component: Arc<str>,
    /// File of the equation.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
    /// The equation as text.
    pub equation: String,
    /// The shape with the names of the component.
    pub shape: String,
    /// Unit of the coefficient, if the model decides it.
    pub unit: Option<String>,
    /// Unit of the equation, likewise.
    pub of_equation: Option<String>,
}

impl Term {
    /// True if it belongs to this equation.
    pub(crate) fn is_at(&self, site: &InjectionSite) -> bool {
        self.component == site.path && self.file == site.file && self.line == site.line && self.equation == site.text
    }
}

/// An equation that may lack a term, with what can be seen from it.
pub(crate) struct Place {
    /// The equation.
    pub site: InjectionSite,
    /// Variables by the names of the component, and in full.
    pub variables: Vec<(String, String)>,
}

impl Place {
    /// A constant at the equation.
    pub(crate) fn term(&self) -> Term {
        let site = &self.site;
        Term {
            component: site.path.clone(),
            file: site.file.clone(),
            line: site.line,
            equation: site.text.clone(),
            shape: "1".to_string(),
            unit: site.unit.clone(),
            of_equation: site.unit.clone(),
        }
    }
}

/// Equations that may lack a term.
pub(crate) fn places(
    sites: Vec<InjectionSite>,
    (tables, channels): (&Tables, &ChannelNames),
    exchangeable: &[&str],
) -> Vec<Place> {
    let eligible = sites.into_iter().filter(|site| {
        let defines = !exchangeable.contains(&&*site.path) && only_sums(site);
        site.refused.is_none() && !only_connects(site) && !defines
    });
    let place = |site: InjectionSite| {
        let variables = around(&site, tables, channels);
        Place { site, variables }
    };
    eligible.map(place).filter(|place| !place.variables.is_empty()).collect()
}

/// `der(x) = v`, `a.u = b.y`, `flange.f = -F`: names on both sides, of which one is a derivative or belongs to a part.
fn only_connects(site: &InjectionSite) -> bool {
    let Some((left, right)) = site.text.split_once('=') else { return true };
    let name = |text: &str| {
        let text = text.trim().trim_end_matches(';').trim();
        let text = text.strip_prefix('-').map_or(text, str::trim);
        let inner = text.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')'));
        let plain = inner.unwrap_or(text);
        let allowed = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let is_name = plain.chars().all(allowed) && plain.starts_with(|c: char| c.is_alphabetic() || c == '_');
        is_name.then_some((inner.is_some(), plain.contains('.')))
    };
    match (name(left), name(right)) {
        (Some((derived, part)), Some((other_derived, other_part))) if site.variables.len() > 1 => {
            derived || other_derived || part || other_part
        }
        _ => false,
    }
}

/// `dp = a.p - b.p`, `a.q + b.q = 0`: sums of variables and their rates, without a parameter or a law.
fn only_sums(site: &InjectionSite) -> bool {
    let mut rest = site.text.as_str();
    let prefix = if site.path.is_empty() { String::new() } else { format!("{}.", site.path) };
    while let Some(begin) = rest.find(|c: char| c.is_alphanumeric() || c == '_') {
        if !rest[..begin].chars().all(|c| " ()+-=;".contains(c)) {
            return false;
        }
        let name = &rest[begin..];
        let end = name.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')).unwrap_or(name.len());
        let (name, after) = name.split_at(end);
        let variable = site.variables.iter().any(|own| {
            let own = own.strip_prefix("der(").and_then(|own| own.strip_suffix(')')).unwrap_or(own);
            own.strip_prefix(&prefix) == Some(name)
        });
        if !(variable || name == "der" || name == "0") {
            return false;
        }
        rest = after;
    }
    rest.chars().all(|c| " ()+-=;".contains(c))
}

/// Variables of the equation, then those of its component and its connectors.
fn around(site: &InjectionSite, tables: &Tables, channels: &ChannelNames) -> Vec<(String, String)> {
    let prefix = if site.path.is_empty() { String::new() } else { format!("{}.", site.path) };
    let mut found: Vec<(String, String)> = Vec::new();
    let own = site.variables.iter().map(String::as_str);
    let component = tables.variables.iter().filter(|v| v.name.count() == 1).map(|v| v.name.element(0));
    let component: Vec<String> = component
        .filter(|name| name.strip_prefix(&prefix).is_some_and(|rest| rest.matches('.').count() <= 1))
        .collect();
    for full in own.chain(component.iter().map(String::as_str)) {
        let Some(short) = full.strip_prefix(&prefix) else { continue };
        // The variables of channels are made for the comparison, not the model's.
        if channels.has(full) {
            continue;
        }
        let usable = tables.find(full).is_some_and(|(variable, _)| {
            variable.variability == Variability::Continuous
                && variable.kind == ValueKind::Real
                && !variable.protected
                && !variable.name.derivative
        });
        if usable && found.len() < MOST_VARIABLES && !found.iter().any(|(known, _)| known == short) {
            found.push((short.to_string(), full.to_string()));
        }
    }
    found
}

/// What a variable shows in runs of the model.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Shown {
    /// Smallest and largest value.
    pub ends: (f64, f64),
    /// Values below which a quarter, a half and three quarters of all lie.
    pub quarters: [f64; 3],
}

impl Shown {
    /// From values in any order; none from nothing, or from what is not a number.
    pub(crate) fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let (&low, &high) = (values.first()?, values.last()?);
        let at = |share: usize| values[share * (values.len() - 1) / 4];
        (low.is_finite() && high.is_finite()).then(|| Self { ends: (low, high), quarters: [at(1), at(2), at(3)] })
    }

    /// Range and largest absolute value of what is not a constant.
    fn moving(&self) -> Option<(f64, f64)> {
        let (low, high) = self.ends;
        let (reach, width) = (low.abs().max(high.abs()), high - low);
        (width > STILL * reach && width > 0.0 && reach.is_finite()).then_some((width, reach))
    }
}

/// The terms of a place, given what variables show by their full names.  `is_rich`: no effect was made for the model's places, so that
/// there are cubes, hinges, absolute values and products of two variables, too.
pub(crate) fn terms(place: &Place, shown: &BTreeMap<String, Shown>, tables: &Tables, is_rich: bool) -> Vec<Term> {
    let mut terms = Vec::new();
    let mut add = |shape: String, unit: Option<String>| {
        let site = &place.site;
        terms.push(Term {
            component: site.path.clone(),
            file: site.file.clone(),
            line: site.line,
            equation: site.text.clone(),
            shape,
            unit,
            of_equation: site.unit.clone(),
        });
    };
    let own = place.site.unit.as_deref();
    add("1".to_string(), own.map(str::to_string));
    for (name, full) in &place.variables {
        let Some(own_shown) = shown.get(full) else { continue };
        let Some((width, reach)) = own_shown.moving() else { continue };
        let (low, high) = own_shown.ends;
        let unit = tables.find(full).map_or("", |(variable, _)| &*variable.unit);
        let per = |power: (i32, i32)| own.and_then(|own| quotient(own, unit, power));
        let both_ways = low < -NARROW * reach && high > NARROW * reach;
        add(name.clone(), per((1, 1)));
        add(format!("{name}*abs({name})"), per((2, 1)));
        if both_ways {
            add(format!("tanh({name}/{:e})", NARROW * reach), own.map(str::to_string));
        }
        if unit == "Pa" {
            add(format!("{name}/sqrt(abs({name}) + {:e})", 1e-4 * reach), per((1, 2)));
        }
        if unit == "m" || unit == "rad" {
            add(format!("exp(({low:e} - {name})/{:e})", NARROW * width), own.map(str::to_string));
            add(format!("exp(({name} - {high:e})/{:e})", NARROW * width), own.map(str::to_string));
        }
        if is_rich {
            add(format!("{name}*{name}*{name}"), per((3, 1)));
            if both_ways {
                add(format!("abs({name})"), per((1, 1)));
            }
            for bend in own_shown.quarters {
                // At an end it is the variable itself, or nothing.
                if bend > low + NARROW * width && bend < high - NARROW * width {
                    add(format!("noEvent(max({name} - ({bend:e}), 0))"), per((1, 1)));
                }
            }
        }
    }
    if is_rich {
        let moves = |full: &String| shown.get(full).is_some_and(|shown| shown.moving().is_some());
        let moving: Vec<&String> =
            place.variables.iter().filter(|(_, full)| moves(full)).map(|(name, _)| name).take(MOST_FACTORS).collect();
        for (k, one) in moving.iter().enumerate() {
            for other in &moving[k + 1..] {
                add(format!("{one}*{other}"), None);
            }
        }
    }
    terms
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use hyd_compiler::InjectionSite;
    use hyd_system::Tables;

    use super::{Place, Shown, terms};

    #[test]
    fn shapes_bend_where_the_variable_is() {
        let site = InjectionSite {
            path: "".into(),
            file: "m.mo".into(),
            line: 7,
            text: "m*der(v) = -k*x".into(),
            unit: None,
            factors: Vec::new(),
            variables: Vec::new(),
            count: 1,
            elements: Vec::new(),
            refused: None,
        };
        let variables = ["x", "v", "c"].map(|name| (name.to_string(), name.to_string())).to_vec();
        let place = Place { site, variables };
        let shown: BTreeMap<String, Shown> = [
            ("x", (0..=100).rev().map(f64::from).collect()),
            ("v", (-4..=4).map(f64::from).collect()),
            ("c", vec![3.0; 5]),
        ]
        .into_iter()
        .filter_map(|(name, values): (&str, Vec<f64>)| Some((name.to_string(), Shown::of(values)?)))
        .collect();
        let shapes = |is_rich| -> Vec<String> {
            terms(&place, &shown, &Tables::default(), is_rich).into_iter().map(|term| term.shape).collect()
        };
        let rich = shapes(true);
        for wanted in ["x*x*x", "abs(v)", "x*v", "noEvent(max(x - (2.5e1), 0))", "noEvent(max(v - (-2e0), 0))"] {
            assert!(rich.iter().any(|own| own == wanted), "{wanted}: {rich:?}");
        }
        // What has one sign is its own absolute value, and what does not move is a constant.
        assert!(!rich.iter().any(|own| own == "abs(x)" || own.contains('c') && own.contains('*')), "{rich:?}");
        assert_eq!(shapes(false), ["1", "x", "x*abs(x)", "v", "v*abs(v)", "tanh(v/1.2e-1)"]);
        assert_eq!(Shown::of(vec![1.0, f64::NAN]), None);
    }
}
