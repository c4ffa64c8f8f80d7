//! Small changes of a model's text, tried one after the other until some heal it.
//!
//! A model that fails is translated and run with each of the changes that [`hyd_compiler::changes`] gives, the likeliest first; those after
//! which it translates without a further warning and runs to its end are what can be proposed.  How many are tried depends on the size of the
//! model alone, so the answer is the same on every machine.

use std::cell::Cell;
use std::path::Path;

use hyd_compiler::{Code, Compilation, Diagnostic, Edit, Extras, Goal, Proposal, Rank, Severity, Trouble, changes};
use hyd_flat::Target;
use hyd_results::{Discard, Sink, Trajectory};
use hyd_run::{RunArguments, options};
use hyd_runtime::{Simulator, SolveError, Summary};
use hyd_system::DaeSystem;

use crate::translate::{Libraries, Request, compile_text};

/// Scalars of a model times changes that are tried of it: some seconds of work.
const MOST_WORK: usize = 30_000;
/// Changes that are tried of a model, at most.
const MOST_TRIALS: usize = 400;
/// Scalars that a model counts for whose equations could not be made.
const UNKNOWN_SIZE: usize = 100;
/// Steps of a run that is only tried, and of all of them together.
const MOST_STEPS: u64 = 20_000;
const ALL_STEPS: u64 = 200_000;
/// What is said of a start that takes start values which nobody fixed.
const UNDETERMINED: &str = "the start is not fully determined";
/// Part of its size below zero from which on a variable is negative.
const NEGATIVE: f64 = 1e-2;
/// Changes that are shown.
const MOST_SHOWN: usize = 3;

/// The model whose changes are tried.
pub struct Trials<'a> {
    /// The file of its text.
    pub file: &'a Path,
    /// Where other classes come from.
    pub libraries: &'a Libraries,
    /// The class, and parameters that are set.
    pub request: &'a Request,
    /// Units of all variables are demanded.
    pub strict_units: bool,
    /// The run that has to succeed.
    pub run: &'a RunArguments,
}

/// What trying has brought.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Healing {
    /// How many changes were tried.
    pub tried: usize,
    /// Those that heal, the likeliest first.
    pub proposals: Vec<Proposal>,
    /// One of them is likelier than anything else that heals.
    pub is_clear: bool,
    /// Little can be told from them: a sign turned round or an equation left out heals much that has another cause.
    pub is_vague: bool,
    /// Nothing but that it runs speaks for it.
    pub is_a_guess: bool,
}

impl Trials<'_> {
    /// The changes after which the model translates and runs.  `messages`: all that was said of it, those of the run among them.
    pub fn healing(&self, compilation: &Compilation, messages: &[Diagnostic], failure: Option<&SolveError>) -> Healing {
        let name = self.file.display().to_string();
        let Some(file) = compilation.files.ids().find(|&id| compilation.files.name(id).as_ref() == name.as_str())
        else {
            return Healing::default();
        };
        let mut trouble = Trouble::of(&compilation.diagnostics);
        if let Some(failure) = failure.filter(|own| is_of_the_model(own)) {
            trouble.run = true;
            trouble.start = failure.time().is_some_and(|time| time <= self.start(compilation));
            // The bound of a delay is not a judgement of the model.
            let is_delay = |message: &str| message.starts_with("the delay time of `");
            trouble.judged = matches!(failure, SolveError::Assertion { report, .. } if !is_delay(&report.message));
            trouble.grows = failure.grows();
            trouble.undefined = failure.is_undefined()
                || trouble.start && matches!(failure, SolveError::NotFinite(_) | SolveError::Evaluation { .. });
            trouble.accumulates = matches!(failure, SolveError::Chattering { accumulating: true, .. });
            trouble.chatters = matches!(failure, SolveError::Chattering { accumulating: false, .. });
        }
        let most = self.most(compilation);
        if !trouble.any() || most == 0 {
            return Healing::default();
        }
        let text = compilation.files.text(file);
        let model = compilation.flat.as_deref().map(|flat| (flat, &compilation.inferred_units[..]));
        let tried = changes(&compilation.files, file, trouble, messages, model);
        let mut healing = Healing::default();
        let mut found: Option<(Rank, bool)> = None;
        let mut definitions = Vec::new();
        let mut overdrawn = false;
        let steps = Cell::new(0);
        // What was not tried might heal as well.
        let mut is_cut = false;
        for (k, change) in tried.into_iter().enumerate() {
            let kind = (change.rank, change.marked);
            let is_other = |own: (Rank, bool)| if own.0.first_is_best() { own != kind } else { own.0 != kind.0 };
            if found.is_some_and(is_other) || healing.proposals.len() == MOST_SHOWN {
                break;
            }
            is_cut = k == most || steps.get() > ALL_STEPS;
            if is_cut {
                break;
            }
            if hyd_run::interrupt::requested() {
                return Healing::default();
            }
            let edits: Vec<&Edit> = change.proposal.edits.iter().collect();
            let Some(first) = edits.first() else { continue };
            healing.tried += 1;
            // Of changes at one place the first that heals is as good as the others.
            let is_place = first.span.start < first.span.end || change.rank == Rank::Guess;
            let is_replaced = |own: &Edit| is_place && own.span == first.span;
            let is_known = healing.proposals.iter().flat_map(|own| &own.edits).any(is_replaced);
            let changed = edited(text, &edits);
            if !is_known && self.is_healed(compilation, &name, &changed, (trouble, &steps)) {
                found = Some(kind);
                definitions.push(change.is_definition);
                let mut proposal = change.proposal;
                if let Some(empty) = self.goes_below_zero(&name, &changed, text, &proposal.edits) {
                    proposal.message.push_str(&format!(" (`{empty}` then falls below zero)"));
                    overdrawn |= healing.proposals.is_empty();
                }
                // A steady state that is found from nowhere may not be there, whatever the start is then.
                let replaced =
                    proposal.edits.first().and_then(|own| text.get(own.span.start as usize..own.span.end as usize));
                if kind.0 == Rank::Start
                    && replaced.is_some_and(|own| own.trim_start().starts_with("der("))
                    && failure.is_some_and(|own| own.other_starts() > 1)
                {
                    proposal.message.push_str(" (there may be no steady state)");
                    overdrawn |= healing.proposals.is_empty();
                }
                // What is negative from the start on is seldom meant to be so, whatever law would hold then.
                overdrawn |= trouble.start && proposal.edits.iter().any(|own| own.text.contains("abs("));
                healing.proposals.push(proposal);
            }
        }
        let is_alone = definitions == [false];
        // Signs of definitions are not shown beside others.
        if definitions.contains(&false) {
            let mut is_definition = definitions.into_iter();
            healing.proposals.retain(|_| !is_definition.next().unwrap_or(false));
        }
        let grows = failure.is_some_and(SolveError::grows);
        let any_would_do = |rank: Rank| match rank {
            Rank::OtherEnds | Rank::Joined | Rank::LeftOut => true,
            Rank::Sign => !failure.is_some_and(SolveError::runs_away),
            _ => false,
        };
        healing.is_vague = found.is_some_and(|(rank, _)| any_would_do(rank));
        // Of signs that bring a run through many a one would, among them those that are not tried; an assertion says what is meant, and growth
        // without bound that a sign is wrong.
        healing.is_a_guess = found.is_some_and(|(rank, _)| match rank {
            // Other sources would do as well.
            Rank::Joined
            | Rank::Point
            | Rank::InferredUnit
            | Rank::AtOnce
            | Rank::FirstStart
            | Rank::RestForNow
            | Rank::UsedUp
            | Rank::Prefix => true,
            Rank::Sign => !trouble.judged && !grows,
            _ => overdrawn,
        });
        let is_best = found.is_some_and(|(rank, _)| rank.first_is_best());
        // That a run comes through with exchanged numbers says little.
        let is_told = found.is_some_and(|(rank, _)| rank != Rank::Numbers);
        healing.is_clear = is_told && (is_best || is_alone && !is_cut);
        healing
    }

    /// Runs a model that was translated for runs; none where there is no code or the run is longer than trying allows.
    pub fn failure(&self, compilation: &Compilation) -> Option<SolveError> {
        match self.ran(compilation, None)? {
            Err(SolveError::TooManySteps { .. }) | Ok(_) => None,
            Err(error) => is_of_the_model(&error).then_some(error),
        }
    }

    /// Translates without anything new to say and runs; where the start has failed, the start must be said whole.
    /// Counts the steps of the run, which shows nothing where the model ends it at once.
    fn is_healed(&self, before: &Compilation, name: &str, text: &str, (trouble, steps): (Trouble, &Cell<u64>)) -> bool {
        let Ok(mut sources) = self.libraries.path(self.file, text) else { return false };
        let request = Request { goal: Goal::Run, ..self.request.clone() };
        let extras = Extras { strict_units: self.strict_units, ..Extras::default() };
        let after = compile_text(&mut sources, name, text, &request, &extras);
        // Of the start nothing could be said where there were no equations to begin with.
        let had_no_start = trouble.text || trouble.too_many || trouble.too_few;
        let is_new = |own: &Diagnostic| match own.severity {
            Severity::Note if trouble.start => true,
            Severity::Note if had_no_start && own.message.starts_with(UNDETERMINED) => false,
            // What is connected is not looked at in a text with mistakes.
            Severity::Warning if trouble.text && own.code == Code::OpenConnector => false,
            _ => before.diagnostics.iter().all(|known| known.message != own.message),
        };
        !after.has_errors()
            && !after.diagnostics.iter().any(is_new)
            && matches!(self.ran(&after, Some(steps)), Some(Ok(end)) if end.terminated.is_none() || end.time > self.start(&after))
    }

    /// A guard that keeps a root or a power within its domain may let what is stored be drawn down below nothing: the variable in the text replaced
    /// that was not negative at the start and is in the end.
    fn goes_below_zero(&self, name: &str, after: &str, before: &str, edits: &[Edit]) -> Option<String> {
        let [edit] = edits else { return None };
        if !edit.text.contains("max(") && !edit.text.contains("abs(") {
            return None;
        }
        // What a difference drives may change its direction.
        let replaced =
            before.get(edit.span.start as usize..edit.span.end as usize).filter(|own| !own.contains(['+', '-']))?;
        let mut sources = self.libraries.path(self.file, after).ok()?;
        let request = Request { goal: Goal::Run, ..self.request.clone() };
        let compilation = compile_text(&mut sources, name, after, &request, &Extras::default());
        let mut rows = Trajectory::new();
        self.recorded(&compilation, &mut rows)?;
        let last = rows.len().checked_sub(1)?;
        let words = replaced.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.'));
        let words: Vec<&str> = words.filter(|word| word.starts_with(|c: char| c.is_alphabetic())).collect();
        let flat = compilation.flat.as_deref()?;
        let operands = flat.equations.iter().flat_map(|block| &block.operands);
        let mut states = operands.filter_map(|operand| match operand.target() {
            Target::Der(v) => Some(flat.var_name(v)),
            _ => None,
        });
        states.find(|state| {
            let is_meant =
                |word: &&str| state == *word || state.strip_suffix(*word).is_some_and(|rest| rest.ends_with('.'));
            let falls = |first: f64, end: f64| first >= 0.0 && end < -NEGATIVE * first.max(end.abs());
            words.iter().any(is_meant) && rows.series(state).is_some_and(|own| falls(own.at(0), own.at(last)))
        })
    }

    /// A run without results; one that finds its start elsewhere than where it was told to look fails.
    /// `steps`: of a change that is tried; it has to lead to a start at once, and its steps are counted.
    fn ran(&self, compilation: &Compilation, steps: Option<&Cell<u64>>) -> Option<Result<Summary, SolveError>> {
        self.ran_into(compilation, steps, &mut Discard)
    }

    /// Runs a model again and keeps its rows; none where it cannot be run.
    pub(crate) fn recorded(&self, compilation: &Compilation, rows: &mut Trajectory) -> Option<()> {
        self.ran_into(compilation, None, rows).map(|_| ())
    }

    fn ran_into(
        &self,
        compilation: &Compilation,
        steps: Option<&Cell<u64>>,
        rows: &mut dyn Sink,
    ) -> Option<Result<Summary, SolveError>> {
        let model = compilation.model.as_ref()?;
        let mut options = options(self.run, &model.payload().experiment).ok()?;
        options.max_steps = options.max_steps.min(MOST_STEPS);
        options.sensitivity = Vec::new();
        options.rescue = steps.is_none();
        let mut system = model.on(hyd_payload::Backend::Native).ok()?.instantiate();
        hyd_run::parameters::apply(&mut system, &self.request.set, &compilation.set_at_translation).ok()?;
        let mut simulator = Simulator::new(system.structure());
        let ran = simulator.run(&mut system, &options, rows, &hyd_run::interrupt::requested);
        if let Some(steps) = steps {
            steps.set(steps.get() + simulator.statistics().steps);
        }
        simulator.rescue().is_none().then_some(ran)
    }

    fn start(&self, compilation: &Compilation) -> f64 {
        let experiment = compilation.model.as_ref().map(|model| model.payload().experiment);
        self.run.start.or(experiment.and_then(|own| own.start)).unwrap_or(0.0)
    }

    fn most(&self, compilation: &Compilation) -> usize {
        let scalars = compilation
            .flat
            .as_deref()
            .map_or(UNKNOWN_SIZE, |flat| flat.variables.iter().map(|block| block.count as usize).sum::<usize>().max(1));
        (MOST_WORK / scalars).min(MOST_TRIALS)
    }
}

/// The text with changes made that do not meet.
pub fn edited(text: &str, edits: &[&Edit]) -> String {
    let mut edits = edits.to_vec();
    edits.sort_by_key(|edit| (edit.span.start, edit.span.end));
    let ends_lines_as_windows_does = text.contains("\r\n");
    let mut text = text.to_string();
    let all: Vec<(usize, usize)> =
        edits.iter().map(|edit| (edit.span.start as usize, edit.span.end as usize)).collect();
    for (k, edit) in edits.iter().enumerate().rev() {
        let (mut from, mut to) = all[k];
        // A line of which nothing is left goes, too, where nothing else is put into it.
        let begin = text[..from].rfind('\n').map_or(0, |at| at + 1);
        let end = text[to..].find('\n').map(|at| to + at + 1);
        if let (Some(end), true) = (end, edit.text.is_empty())
            && text[begin..from].trim().is_empty()
            && text[to..end].trim().is_empty()
            && all.iter().enumerate().all(|(other, own)| other == k || own.1 < begin || own.0 >= end)
        {
            (from, to) = (begin, end);
        }
        let new = match ends_lines_as_windows_does {
            true => edit.text.replace("\r\n", "\n").replace('\n', "\r\n"),
            false => edit.text.clone(),
        };
        text.replace_range(from..to, &new);
    }
    text
}

/// True for failures that a change of the text may heal.
fn is_of_the_model(error: &SolveError) -> bool {
    !matches!(error, SolveError::Option(_) | SolveError::Interrupted { .. } | SolveError::Sink { .. })
}

#[cfg(test)]
mod tests {
    use hyd_compiler::{Edit, Files};
    use hyd_source::Span;

    use super::edited;

    #[test]
    fn a_line_of_which_nothing_is_left_goes() {
        let text = "model M\n  x = 1;\n  y = 2; z = 3;\nend M;\n";
        let file = Files::new().add("m.mo", text);
        let edit = |old: &str, new: &str| {
            let at = text.find(old).unwrap_or_default();
            Edit { span: Span::new(file, at, at + old.len()), text: new.to_string() }
        };
        let with = |edits: &[Edit]| edited(text, &edits.iter().collect::<Vec<_>>());
        assert_eq!(with(&[edit("x = 1;", "")]), "model M\n  y = 2; z = 3;\nend M;\n");
        assert_eq!(with(&[edit("y = 2;", "")]), "model M\n  x = 1;\n   z = 3;\nend M;\n");
        // What is put in where something goes stays where it was meant to stand.
        let put_in =
            Edit { span: Span { end: edit("x", "").span.start, ..edit("x", "").span }, text: "initial ".into() };
        assert_eq!(with(&[put_in, edit("x = 1;", "")]), "model M\n  initial \n  y = 2; z = 3;\nend M;\n");
        let both = [edit("y = 2;", ""), edit(" z = 3;", "")];
        assert_eq!(with(&both), "model M\n  x = 1;\n  \nend M;\n");
    }
}
