//! Reduced system to sorted system: everything put into the order in which it is computed.
//!
//! Relations are taken out, what is known before the run is separated, the continuous equations become the simulation
//! plan, the discrete ones follow their dependence, and the initial system is sorted with its own unknowns.  Passes are
//! functions of their own; here they only meet.

use hyd_flat::{Section, Target};
use hyd_index::IndexVec;
use hyd_source::{Code, Diagnostic, Outcome};

use crate::algebra::{Algebra, Known};
use crate::balance::{add_candidate, simulation_equations};
use crate::explain::faults::explain_parts;
use crate::explain::floating::with_floating;
use crate::incidence::{Unknowns, pattern};
use crate::initial::homotopy::{restore_simplified, take_actual};
use crate::initial::initial_plan;
use crate::plan::bindings::{Bindings, sort_bindings};
use crate::plan::dependent::judge_blocks;
use crate::plan::discrete::{checks, reinits, sort_discrete, starts};
use crate::plan::wishes::wishes;
use crate::plan::{Kind, Loops, Mismatch, Request, build_plan};
use crate::real_equality::real_equalities;
use crate::relations::{extract_relations, find_time_events};
use crate::sorted::{Plan, Residual, SortedSystem};
use crate::start_point::StartPoint;
use crate::system::{Combination, EqId, EquationSystem, Role};
use crate::unseen_events::unseen_events;

/// Sorts a system of index 1 or less; equations that depend on each other are handed back as a sum that may stand for one of them.
pub fn sort_system(system: EquationSystem, loops: Loops) -> Outcome<Result<SortedSystem, Option<Combination>>> {
    let mut diagnostics = Vec::new();
    let value = sort_parts(system, loops, &mut diagnostics).map_err(|fault| {
        diagnostics.push(*fault.diagnostic);
        fault.combination
    });
    Outcome { value, diagnostics }
}

/// Why a system cannot be sorted.
struct Fault {
    diagnostic: Box<Diagnostic>,
    combination: Option<Combination>,
}

impl From<Box<Diagnostic>> for Fault {
    fn from(diagnostic: Box<Diagnostic>) -> Self {
        Self { diagnostic, combination: None }
    }
}

impl From<Diagnostic> for Fault {
    fn from(diagnostic: Diagnostic) -> Self {
        Self { diagnostic: Box::new(diagnostic), combination: None }
    }
}

fn sort_parts(system: EquationSystem, loops: Loops, notes: &mut Vec<Diagnostic>) -> Result<SortedSystem, Fault> {
    let equalities = real_equalities(&system);
    let (mut system, mut relations) = extract_relations(system);
    let simplified = take_actual(&mut system);
    let mut algebra = Algebra::default();
    let bindings = sort_bindings(&mut system, &mut algebra)?;
    find_time_events(&mut system, &mut relations, &bindings.known);
    let values = StartPoint::of_parameters(&system, &bindings.assignments);
    let simulation = simulation_plan(&mut system, &mut algebra, &bindings, &values, loops);
    let simulation = simulation.map_err(|fault| floating_first(&system, *fault, notes))?;
    let judged = judge_blocks(&mut system, &mut algebra, &bindings, &values, &simulation);
    let judged = judged.map_err(|dependent| {
        let (fault, combination) = *dependent;
        Fault { diagnostic: floating_first(&system, fault, notes), combination }
    })?;
    notes.extend(judged);
    notes.extend(equalities);
    notes.extend(unseen_events(&system, &relations, &simulation, &bindings.known));
    let discrete = sort_discrete(&mut system, &mut algebra, &bindings.known)?;
    let (starts, late_starts) = starts(&mut system, &mut algebra, &bindings.known);
    restore_simplified(&mut system, simplified);
    let (initial, redundant) =
        initial_plan(&mut system, &mut algebra, (&bindings, loops), (&values, &late_starts), notes)?;
    let reinits = reinits(&mut system)?;
    let checks = checks(&system);
    let bindings = bindings.assignments;
    let selections = system.reduction.selections.clone();
    let pivots = pivots(&system);
    let sorted = SortedSystem {
        system,
        bindings,
        starts,
        late_starts,
        simulation,
        initial,
        discrete,
        reinits,
        checks,
        relations,
        selections,
        pivots,
        redundant,
    };
    debug_assert_eq!(crate::verify::verify(&sorted), Ok(()));
    Ok(sorted)
}

/// What floats in place of the singular equations that it makes; all messages but the last are notes.
fn floating_first(system: &EquationSystem, fault: Diagnostic, notes: &mut Vec<Diagnostic>) -> Box<Diagnostic> {
    let mut messages = with_floating(system, fault.clone());
    let last = messages.pop().unwrap_or(fault);
    notes.extend(messages);
    Box::new(last)
}

/// The coefficients by which the choice of states is judged, in order.
fn pivots(system: &EquationSystem) -> Vec<Residual> {
    let residual = |eq: EqId| {
        let equation = system.equations[eq];
        let value = system.flat.templates.get(equation.template).left;
        Residual { value, operands: equation.operands, equation: eq }
    };
    system.equations_in(Section::Pivot).into_iter().map(residual).collect()
}

/// The plan for the integration: derivatives are read from `y'`.
fn simulation_plan(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    bindings: &Bindings,
    values: &StartPoint,
    loops: Loops,
) -> Result<Plan, Box<Diagnostic>> {
    let mut unknowns = Unknowns::new(system.roles.len());
    let mut kinds = IndexVec::new();
    for v in system.roles.indices().filter(|&v| system.is_continuous(v) && !bindings.known.bound[v]) {
        match system.roles[v] {
            Role::State => {
                unknowns.add(Target::Der(v));
                kinds.push(Kind::Rate);
            }
            Role::Candidate => {
                add_candidate(&mut unknowns, v);
                kinds.push(Kind::Selected);
            }
            _ => {
                unknowns.add(Target::Var(v));
                kinds.push(Kind::Plain);
            }
        }
    }
    let rows = simulation_equations(system).into_iter().filter(|&eq| !bindings.used[eq]).collect();
    let mut known = Known { bound: bindings.known.bound.clone() };
    for &v in &bindings.late {
        known.bound[v] = true;
    }
    let wishes = wishes(system, &unknowns);
    let pattern = pattern(system, algebra, rows, &unknowns);
    let request = Request { pattern, unknowns: &unknowns, kinds, wishes, known: &known, values, loops };
    build_plan(system, algebra, request).map_err(|mismatch| {
        let Mismatch { pattern, matching } = *mismatch;
        let diagnostic = Diagnostic::error(Code::Singular, "the continuous equations are structurally singular");
        Box::new(explain_parts(diagnostic, system, &pattern, &unknowns, &matching))
    })
}
