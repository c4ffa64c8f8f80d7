//! Where terms can be injected into a model, as plain data, and why not elsewhere.
//!
//! A site is an equation written as `left = right` that holds at all times and that index reduction left as it stands (a
//! differentiated equation would need the derivatives of the term).  The unit of an equation is found by adding a constant
//! term to each and inferring the unit of its amplitude, so it is known exactly where the units of the model decide it.
//! With all these terms at once the index is reduced again: a site that would have to be differentiated then is refused.

use std::sync::Arc;

use hyd_equations::EquationSystem;
use hyd_flat::{EquationBlock, FlatModel, Injection, Operand, Target, TermShape};
use hyd_instance::Sources;
use hyd_source::{Code, Diagnostic, Files};
use hyd_system::Variability;

use crate::balance::{Factor, factors};
use crate::compilation::{Compilation, Goal, Options};
use crate::pipeline::compile_with;

/// An equation of the model by its place in the text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct InjectionSite {
    /// Instance path of the component, `""` for the model itself.
    pub path: Arc<str>,
    /// File name.
    pub file: Arc<str>,
    /// First line of the equation, from 1.
    pub line: u32,
    /// The equation as text on one line, without comments.
    pub text: String,
    /// SI unit of its two sides, if the model decides it.
    pub unit: Option<String>,
    /// What may multiply that which comes in, where the equation is solved for a rate or for one variable.
    pub factors: Vec<Factor>,
    /// Variables that occur in it (of the first equation, if the text gives several), `der(x)` for derivatives.
    pub variables: Vec<String>,
    /// How many equations the text gives: in a loop, between arrays, in an array of components.
    pub count: usize,
    /// The variables that occur in each of them, for the first [`MOST_ELEMENTS`].
    pub elements: Vec<Vec<String>>,
    /// Why no term can be added; none if one can.
    pub refused: Option<&'static str>,
}

/// Most equations of one text whose variables are listed.
pub const MOST_ELEMENTS: usize = 32;

const DIFFERENTIATED: &str = "it has to be differentiated to solve the system";

/// All equations of a model that are written as `left = right`, in the order of the text; empty if the model is at fault,
/// which the compilation that comes along tells.
pub fn injection_sites(
    sources: &mut dyn Sources,
    name: &str,
    text: &str,
    options: &Options,
) -> (Vec<InjectionSite>, Compilation) {
    let options = Options { goal: Goal::Check, ..options.clone() };
    let plain = compile_with(sources, name, text, &options, &[]);
    let (Some(flat), Some(reduced)) = (&plain.flat, &plain.reduced) else { return (Vec::new(), plain) };
    let mut sites: Vec<InjectionSite> = Vec::new();
    for &block in &flat.injectable {
        let site = site(flat, &plain.files, block, differentiated(reduced, block));
        let known = sites.iter_mut().find(|s| (&s.path, &s.file, s.line) == (&site.path, &site.file, site.line));
        match known {
            // One text may give several blocks; one refused refuses all.
            Some(known) => {
                known.refused = known.refused.or(site.refused);
                known.count += site.count;
                let left = MOST_ELEMENTS.saturating_sub(known.elements.len());
                known.elements.extend(site.elements.into_iter().take(left));
            }
            None => sites.push(site),
        }
    }
    let terms: Vec<Injection> = sites.iter().enumerate().map(|(k, site)| probe(site, k)).collect();
    let probed = compile_with(sources, name, text, &options, &terms);
    for (k, unit) in probed_units(&probed) {
        sites[k].unit = Some(unit);
    }
    // An equation that only renames is a constraint once it has a term.
    if let Some(reduced) = &probed.reduced {
        for (site, term) in sites.iter_mut().zip(&terms) {
            if refusal(reduced, term).is_some() {
                site.refused = Some(DIFFERENTIATED);
            }
        }
    }
    let can = |site: &&mut InjectionSite| site.refused.is_none();
    sites.iter_mut().filter(can).for_each(|site| site.factors = factors(&site.text));
    let parts: Vec<(usize, usize)> =
        sites.iter().enumerate().flat_map(|(k, site)| (0..site.factors.len()).map(move |part| (k, part))).collect();
    if !parts.is_empty() {
        let shaped = |(number, &(k, part)): (usize, &(usize, usize))| {
            let shape = TermShape::Expression(sites[k].factors[part].text.clone());
            Injection { shape, ..probe(&sites[k], number) }
        };
        let terms: Vec<Injection> = parts.iter().enumerate().map(shaped).collect();
        for (number, unit) in probed_units(&compile_with(sources, name, text, &options, &terms)) {
            let (k, part) = parts[number];
            sites[k].factors[part].unit = Some(unit);
        }
    }
    (sites, plain)
}

/// The units of the amplitudes of probes, by their numbers.
fn probed_units(probed: &Compilation) -> Vec<(usize, String)> {
    let Some(flat) = &probed.flat else { return Vec::new() };
    let units = hyd_units::check_units(flat, &probed.files);
    let number = |name: &str| name.strip_prefix(PROBE).and_then(|number| number.parse::<usize>().ok());
    units.inferred.into_iter().filter_map(|found| Some((number(&found.name)?, found.unit))).collect()
}

/// Name of the parameters that probe units; no name of a model begins like this.
const PROBE: &str = "$unit";

fn probe(site: &InjectionSite, k: usize) -> Injection {
    Injection {
        path: site.path.to_string(),
        file: Some(site.file.to_string()),
        line: site.line,
        name: format!("{PROBE}{k}"),
        shape: TermShape::Constant,
    }
}

fn site(flat: &FlatModel, files: &Files, block: u32, refused: bool) -> InjectionSite {
    let equation = &flat.equations[block as usize];
    let span = equation.origin.span;
    InjectionSite {
        path: equation.origin.path.clone(),
        file: files.name(span.file).clone(),
        line: files.location(span).line,
        text: hyd_syntax::one_line(files.snippet(span)),
        unit: None,
        factors: Vec::new(),
        variables: variables(flat, equation, 0),
        count: equation.count as usize,
        elements: (0..(equation.count as usize).min(MOST_ELEMENTS)).map(|k| variables(flat, equation, k)).collect(),
        refused: refused.then_some(DIFFERENTIATED),
    }
}

/// What changes during the run among the operands of equation `k` of a block.
fn variables(flat: &FlatModel, equation: &EquationBlock, k: usize) -> Vec<String> {
    let arity = flat.templates.get(equation.template).arity as usize;
    let mut names = Vec::new();
    for operand in equation.operands_of(k, arity) {
        let v = match operand.target() {
            Target::Var(v) | Target::Der(v) | Target::Pre(v) => v,
            _ => continue,
        };
        if flat.variables[flat.locate(v).0].variability < Variability::Discrete {
            continue;
        }
        let name = flat.target_name(Operand::new(operand.target()));
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn differentiated(reduced: &EquationSystem, block: u32) -> bool {
    reduced.equations.iter().any(|equation| equation.block == block && equation.order > 0)
}

/// Messages about terms at equations that index reduction differentiates.
pub(crate) fn refusals(reduced: &EquationSystem, terms: &[Injection]) -> Vec<Diagnostic> {
    let message = |term: &Injection| {
        let equation = refusal(reduced, term)?;
        let message = format!("the term `{}` cannot be added to this equation: {DIFFERENTIATED}", term.name);
        let help = "add it to an equation of the motion or of a balance instead";
        Some(Diagnostic::error(Code::Injection, message).at(equation.origin.span, "").help(help))
    };
    terms.iter().filter_map(message).collect()
}

/// The equation with this term, if it is differentiated.
fn refusal<'a>(reduced: &'a EquationSystem, term: &Injection) -> Option<&'a EquationBlock> {
    let flat = &reduced.flat;
    let amplitude = flat.variables.iter().find(|block| block.name.parts[0].0.as_ref() == term.name)?;
    let own = amplitude.first.0..amplitude.first.0 + amplitude.count;
    let of_term = |operand: &Operand| matches!(operand.target(), Target::Var(v) if own.contains(&v.0));
    let blocks = (0u32..).zip(&flat.equations);
    let mut with_term = blocks.filter(|(_, equation)| equation.operands.iter().any(of_term));
    with_term.find(|&(block, _)| differentiated(reduced, block)).map(|(_, equation)| equation)
}
