//! How the parts of a model are written that the solver and the reports read: structure, tables, places, names.

use hyd_system::{
    CheckKind, DelaySite, EquationInfo, InitialStructure, InputSite, LearnedSize, LoopInfo, NamePattern, Pattern,
    Place as ValuePlace, RootInfo, Settable, Source, Structure, Tables, TextFormat, ValueKind, Variability,
    VariableInfo,
};

use crate::accumulation::{Accumulation, PartialRows, Term};
use crate::codec::{choices, stored};
use crate::model::{Check, Checked, Experiment, Identity, InitialTransfer, Limit, MessagePiece, OutputRow, Parameters};
use crate::names::{Name, RowNames, Wrap};
use crate::program::{Area, Place};
use crate::routines::SitePlaces;
use crate::routines::{DataArea, EventRoutines, Given, JacobianForm, PlanRoutines, Routines, TimedRelation};
use crate::selection::CandidateSet;

stored! {
    Pattern { rows, column_starts, row_indices }
    Structure { unknowns, differential, sizes, state_pattern, rate_pattern, roots, outputs, initial, delays, inputs }
    LearnedSize { unknown, group }
    InitialStructure { unknowns, pattern }
    DelaySite { varying }
    InputSite { name, differentiated }
    NamePattern { parts, derivative }
    Source { place, negated }
    VariableInfo { name, unit, display_unit, description, kind, variability, settable, protected, sources }
    EquationInfo { component, text, file, line }
    RootInfo { text, file, line }
    LoopInfo { unknowns, variables, equations }
    Tables { model, variables, unknowns, rows, loops, equations, roots, initial_unknowns, initial_rows }
    TextFormat { significant_digits, minimum_length, left_justified, format }
    Identity { compiler, sources, description, templates }
    Experiment { start, stop, tolerance, interval }
    OutputRow { assigned, unknowns, states, discrete }
    Parameters { kinds, unbound, preset, limits }
    Limit { variable, element, min, max }
    Check { message, pieces, values, error, kind, file, line }
    InitialTransfer { guess, states, rates, values, decided, late_reals, checked, homotopy }
    Checked { equation, text, start_of, others }
    Name { pattern, element, wrap }
    RowNames { equations, targets }
    Place { area, index }
    Given { flag, value }
    DataArea {
        length, parameters, given, parameter_names, discrete, discrete_starts, pre, pre_continuous, held, chosen, delayed,
        delayed_rates, inputs, input_rates, preset, starts,
    }
    Routines { bind, late_starts, simulation, initial, events }
    PlanRoutines { assign, residual, closing, closing_rows, assigned_nominals, jacobian, extra, state_pattern, rate_pattern }
    EventRoutines {
        truths, instants, timed, late, steering, rooted, by_time, time_roots, discrete, reinits, reinit_unknowns,
        reads_solution, checks, pivots,
    }
    TimedRelation { relation, rises, right_after }
    Accumulation { terms, first, state, rate, length }
    Term { to, a, b }
    PartialRows { rows }
    CandidateSet { size, entries, pivots, open, candidates, first, unknowns }
    SitePlaces { source, initial_source, time, most, varying }
}

choices!(ValuePlace { 0 => Output(k), 1 => Parameter(k), 2 => Constant(value) });
choices!(ValueKind { 0 => Real, 1 => Integer, 2 => Boolean, 3 => Enumeration(literals) });
choices!(Variability { 0 => Constant, 1 => Parameter, 2 => Discrete, 3 => Continuous });
choices!(CheckKind { 0 => Assert, 1 => AssertOnce, 2 => Terminate });
choices!(Settable { 0 => No, 1 => Yes, 2 => Structural });
choices!(Wrap { 0 => Value, 1 => Rate, 2 => Before, 3 => Start });
choices!(Area { 0 => Data, 1 => Unknown, 2 => Rate, 3 => Work, 4 => Out, 5 => Out2 });
choices!(JacobianForm { 0 => Entries(routine), 1 => Partials(routine, list, rows) });
choices!(MessagePiece { 0 => Text(text), 1 => Value(format, kind) });
