//! The parser that pest generates from `grammar.pest`, the only place that names the generated types.
//!
//! pest implements parsing expression grammars (Ford 2004): ordered choice, no memoisation.  The grammar is written so
//! that no rule tries the same long prefix twice.  Also here: the limit on rule calls and the words in which a rule is
//! named to the user.

use std::sync::Once;

use pest::Parser;
use pest::error::{Error, ErrorVariant, InputLocation};
use pest::iterators::Pairs;

/// The generated parser.
#[derive(pest_derive::Parser)]
#[grammar = "grammar.pest"]
pub(crate) struct Grammar;

/// One node of pest's result.
pub(crate) type Node<'t> = pest::iterators::Pair<'t, Rule>;

/// Rule calls per parse.  Ordinary text needs fewer than 60 per byte (measured), so that the largest file fits.
const CALL_LIMIT: usize = 2_000_000_000;

static SET_LIMIT: Once = Once::new();

/// Where a rule failed and which tokens would have been accepted there.
pub(crate) struct Failure {
    /// Byte offset in the text that was parsed.
    pub(crate) at: usize,
    /// Rules that were tried at this place.
    pub(crate) expected: Vec<Rule>,
    /// The parse was given up because it took too long.
    pub(crate) gave_up: bool,
}

/// Parses `text` from its beginning with `rule`.
pub(crate) fn run(rule: Rule, text: &str) -> Result<Pairs<'_, Rule>, Failure> {
    SET_LIMIT.call_once(|| pest::set_call_limit(std::num::NonZeroUsize::new(CALL_LIMIT)));
    Grammar::parse(rule, text).map_err(|error| failure(&error))
}

fn failure(error: &Error<Rule>) -> Failure {
    let at = match error.location {
        InputLocation::Pos(at) => at,
        InputLocation::Span((at, _)) => at,
    };
    match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => Failure { at, expected: positives.clone(), gave_up: false },
        ErrorVariant::CustomError { .. } => Failure { at, expected: Vec::new(), gave_up: true },
    }
}

/// The words for what the rules would have accepted, in a fixed order and without repetition.
pub(crate) fn expected_words(rules: &[Rule]) -> Vec<&'static str> {
    let expression = rules.iter().any(|r| matches!(r, Rule::number | Rule::paren | Rule::expression));
    let mut words: Vec<(u8, &'static str)> = rules.iter().filter_map(|&rule| word(rule, expression)).collect();
    words.sort_unstable();
    words.dedup();
    let operator = words.iter().any(|(_, word)| *word == "an operator");
    let several = words.len() > 1;
    words.retain(|(_, word)| !(operator && *word == "`(`" || several && *word == "a description string"));
    words.into_iter().map(|(_, word)| word).collect()
}

/// How a rule is named, with its rank in lists; `None` for what is implied by another entry.
fn word(rule: Rule, expression: bool) -> Option<(u8, &'static str)> {
    Some(match rule {
        Rule::semi | Rule::missing_semi | Rule::stray_semi => (0, "`;`"),
        Rule::equals => (1, "`=`"),
        Rule::comma => (2, "`,`"),
        Rule::rpar => (3, "`)`"),
        Rule::rbrack => (3, "`]`"),
        Rule::rbrace => (3, "`}`"),
        Rule::kw_then => (4, "`then`"),
        Rule::kw_else => (4, "`else`"),
        Rule::kw_loop => (4, "`loop`"),
        Rule::kw_in => (4, "`in`"),
        Rule::lpar | Rule::class_modification if !expression => (5, "`(`"),
        Rule::number | Rule::paren | Rule::expression => (6, "an expression"),
        Rule::ident | Rule::path | Rule::reference | Rule::declaration | Rule::short_base if !expression => {
            (7, "a name")
        }
        Rule::component_clause if !expression => (7, "a name"),
        Rule::description | Rule::string if !expression => (9, "a description string"),
        Rule::infix => (8, "an operator"),
        _ => return None,
    })
}
