//! What equations that depend on each other leave open: which variables, and from when to when.
//!
//! Some are moved before others (ranks of [`crate::linear`]).  What relations watch is moved only where nothing else makes up for it: the torque of
//! a brake that holds what a motor could hold as well stays where it starts, and does not slip for it.  What stands at a limit stays there
//! as long as others can take what changes.  Of two locked brakes that share a load one comes to its limit first; if it went on
//! to take its share, it would slip and be held again, time and again, until the other one is at its limit, too.

use std::collections::BTreeMap;
use std::fmt;

/// Most variables that are named.
const MOST_NAMES: usize = 4;

/// Variables that the equations do not determine, alone or together, over the same time.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct Undetermined {
    /// Their names.
    pub variables: Vec<String>,
    /// First and last time at which that was so (s).
    pub time: f64,
    /// See `time`.
    pub until: f64,
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (named, rest) = self.variables.split_at(self.variables.len().min(MOST_NAMES));
        for (k, name) in named.iter().enumerate() {
            let between = match k {
                0 => "",
                _ if k + 1 == named.len() && rest.is_empty() => " and ",
                _ => ", ",
            };
            write!(f, "{between}`{name}`")?;
        }
        match rest.len() {
            0 => {}
            more => write!(f, " and {more} more")?,
        }
        let (verb, them) = if self.variables.len() == 1 { ("is", "it") } else { ("are", "them") };
        write!(f, " {verb} not determined ")?;
        match self.time == self.until {
            true => write!(f, "at t = {} s", self.time)?,
            false => write!(f, "from t = {} s to {} s", self.time, self.until)?,
        }
        write!(
            f,
            ": the equations hold for any of many values of {them}, and those nearest to the ones before are taken"
        )
    }
}

/// The unknowns that were left open in a run.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct OpenUnknowns {
    names: BTreeMap<(usize, bool), String>,
    /// By name: from when to when (s).
    times: BTreeMap<String, (f64, f64)>,
    /// Which unknowns are moved before others; empty where all are alike.
    ranks: Vec<u8>,
}

impl OpenUnknowns {
    /// True if nothing has been left open.
    pub(crate) fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Which unknowns are moved before others; empty where all are alike.
    pub(crate) fn ranks(&self) -> &[u8] {
        &self.ranks
    }

    /// Sets what [`Self::ranks`] gives.
    pub(crate) fn set_ranks(&mut self, ranks: Vec<u8>) {
        self.ranks = ranks;
    }

    /// Notes that an unknown, or its rate, is left open at a time (s).
    pub(crate) fn note(&mut self, t: f64, unknown: (usize, bool), name: impl FnOnce((usize, bool)) -> String) {
        let name = self.names.entry(unknown).or_insert_with(|| name(unknown));
        match self.times.get_mut(name.as_str()) {
            Some((_, until)) => *until = t,
            None => {
                self.times.insert(name.clone(), (t, t));
            }
        }
    }

    /// The same for one that has this name.
    pub(crate) fn note_name(&mut self, t: f64, name: String) {
        self.times.entry(name).or_insert((t, t)).1 = t;
    }

    /// Those that were open over the same time together, the first ones first.
    pub(crate) fn together(&self) -> Vec<Undetermined> {
        let mut found: Vec<Undetermined> = Vec::new();
        for (name, &(time, until)) in &self.times {
            match found.iter_mut().find(|other| (other.time, other.until) == (time, until)) {
                Some(other) => other.variables.push(name.clone()),
                None => found.push(Undetermined { variables: vec![name.clone()], time, until }),
            }
        }
        found.sort_by(|a, b| a.time.total_cmp(&b.time));
        found
    }
}
