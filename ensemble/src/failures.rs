//! Why members failed: their messages, those that differ in numbers only counted together.
//!
//! A thousand members outside the same limit give a thousand messages, each with its own value; who reads them wants one with its
//! number.  Counts do not depend on the order in which members end.

use std::collections::BTreeMap;

/// Members that failed for the same reason.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Failure {
    /// How many.
    pub count: usize,
    /// The first of them.
    pub member: usize,
    /// What it said.
    pub message: String,
}

/// The reasons of an ensemble, collected.
#[derive(Default, Debug)]
pub(crate) struct Failures {
    by_words: BTreeMap<String, Failure>,
}

impl Failures {
    pub(crate) fn add(&mut self, member: usize, message: &str) {
        let new = || Failure { count: 0, member, message: message.to_string() };
        let known = self.by_words.entry(words(message)).or_insert_with(new);
        known.count += 1;
        if member < known.member {
            (known.member, known.message) = (member, message.to_string());
        }
    }

    /// The commonest first.
    pub(crate) fn ranked(self) -> Vec<Failure> {
        let mut list: Vec<Failure> = self.by_words.into_values().collect();
        list.sort_by_key(|failure| (std::cmp::Reverse(failure.count), failure.member));
        list
    }
}

/// A message with a `#` for each number; digits of names stay.
fn words(message: &str) -> String {
    let mut text = String::with_capacity(message.len());
    let mut rest = message.chars().peekable();
    let mut last = ' ';
    while let Some(c) = rest.next() {
        if !c.is_ascii_digit() || last.is_alphanumeric() || last == '_' {
            text.push(c);
            last = c;
            continue;
        }
        let mut end = c;
        while let Some(&next) = rest.peek() {
            let sign_of_exponent = matches!(next, '+' | '-') && matches!(end, 'e' | 'E');
            if !(next.is_ascii_digit() || matches!(next, '.' | 'e' | 'E') || sign_of_exponent) {
                break;
            }
            end = next;
            rest.next();
        }
        if text.ends_with('-') {
            text.pop();
        }
        text.push('#');
        last = '#';
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_that_differ_in_numbers_count_together() {
        let mut failures = Failures::default();
        let below = |name: &str, value: &str| format!("`{name}` is {value}, below its `min` 0");
        let said = [(4, "k", "-1.5e-3"), (2, "k", "-7"), (9, "k", "-0.25"), (1, "k2", "-1"), (3, "k1", "-1")];
        said.iter().for_each(|&(member, name, value)| failures.add(member, &below(name, value)));
        let ranked = failures.ranked();
        let seen: Vec<(usize, usize)> = ranked.iter().map(|failure| (failure.count, failure.member)).collect();
        assert_eq!(seen, [(3, 2), (1, 1), (1, 3)]);
        assert_eq!(ranked[0].message, below("k", "-7"));
    }
}
