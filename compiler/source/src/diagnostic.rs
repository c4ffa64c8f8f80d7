//! Diagnostics as data: what is wrong, where, and what may help.

use crate::{Code, Span};

/// How serious a diagnostic is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing, nothing to do.
    Note,
    /// Probably not meant.
    Warning,
    /// The stage could not give a usable result.
    Error,
}

/// A marked stretch of text with a remark.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Label {
    /// The text marked.
    pub span: Span,
    /// What to say under it; may be empty.
    pub message: String,
    /// The place at fault (true) or a place that explains (false).
    pub primary: bool,
}

/// A stretch of text and what stands there instead; an empty stretch is a place where something is put in.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Edit {
    /// What is replaced.
    pub span: Span,
    /// By what.
    pub text: String,
}

/// A change of the text that heals what a message is about.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Proposal {
    /// What it does, as an order: "write `v`".
    pub message: String,
    /// All that has to be changed together.
    pub edits: Vec<Edit>,
}

/// One message to the user.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Diagnostic {
    /// Error code, explained by `hyd explain`.
    pub code: Code,
    /// Error, warning or note.
    pub severity: Severity,
    /// One sentence in the user's names.
    pub message: String,
    /// Marked places; the first primary one is the place of the message.
    pub labels: Vec<Label>,
    /// Sentences below the text: reasons and suggestions.
    pub notes: Vec<String>,
    /// Changes that heal it, the best first.
    pub proposals: Vec<Proposal>,
}

impl Diagnostic {
    /// An error.
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        let (severity, message) = (Severity::Error, message.into());
        Self { code, severity, message, labels: Vec::new(), notes: Vec::new(), proposals: Vec::new() }
    }

    /// A warning.
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, message) }
    }

    /// A note.
    pub fn note(code: Code, message: impl Into<String>) -> Self {
        Self { severity: Severity::Note, ..Self::error(code, message) }
    }

    /// Marks the place at fault.
    pub fn at(mut self, span: Span, message: impl Into<String>) -> Self {
        self.labels.push(Label { span, message: message.into(), primary: true });
        self
    }

    /// Marks a place that explains.
    pub fn with(mut self, span: Span, message: impl Into<String>) -> Self {
        self.labels.push(Label { span, message: message.into(), primary: false });
        self
    }

    /// Adds a sentence below the text.
    pub fn help(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Adds a change that heals it.
    pub fn propose(mut self, message: impl Into<String>, edits: Vec<Edit>) -> Self {
        self.proposals.push(Proposal { message: message.into(), edits });
        self
    }

    /// Adds `did you mean ...?` for a name that stands at a place, and the change to it, if a candidate is close enough.
    pub fn meant<'a>(self, span: Span, wrong: &str, candidates: impl IntoIterator<Item = &'a str>) -> Self {
        let Some(name) = closest(wrong, candidates) else { return self };
        let said = self.help(format!("did you mean `{name}`?"));
        // Some places are more than the name: what is around it must stay.
        match (span.end - span.start) as usize == wrong.len() {
            true => said.propose(format!("write `{name}` for `{wrong}`"), vec![Edit { span, text: name.to_string() }]),
            false => said,
        }
    }

    /// Adds a sentence below the text, if there is one.
    pub fn maybe_help(mut self, note: Option<String>) -> Self {
        self.notes.extend(note);
        self
    }
}

/// The error of a step whose message has been given already.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reported;

/// What a stage returns: what it could build, and what it has to say.
#[derive(Clone, Debug)]
pub struct Outcome<T> {
    /// The result, as far as it could be built.
    pub value: T,
    /// Messages in the order they were found.
    pub diagnostics: Vec<Diagnostic>,
}

impl<T> Outcome<T> {
    /// True when a message is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error)
    }
}

/// `did you mean ...?` for a misspelt name, if there is a [`closest`] candidate.
pub fn did_you_mean<'a>(wrong: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    closest(wrong, candidates).map(|name| format!("did you mean `{name}`?"))
}

/// The closest candidate to a misspelt name by edit distance with transpositions (Damerau 1964), if it is close enough to be a slip
/// of the pen.
pub fn closest<'a>(wrong: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = wrong.chars().count().div_ceil(3).max(1);
    // Letters that are large or small and underscores are what slips most.
    let plain = |name: &str| name.replace('_', "").to_lowercase();
    let same = plain(wrong);
    candidates
        .into_iter()
        .map(|c| (plain(c) != same, edit_distance(wrong, c), c))
        // Any other letter is close to a name of one letter.
        .filter(|(differs, distance, c)| {
            !differs || *distance <= limit && *distance < wrong.chars().count().max(c.chars().count())
        })
        .min()
        .map(|(_, _, c)| c)
}

/// How many slips make one word of the other: a character too many, too few, a wrong one, or two neighbours exchanged (Damerau 1964).
pub fn edit_distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().collect();
    let b: Vec<char> = b.chars().collect();
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let substitution = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = substitution.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}
