//! Which neighbouring tokens have a blank between them.
//!
//! Blanks stand around `=`, sums, relations and words, after commas, and around comments; none around products, powers and
//! ranges, inside brackets, and before those of calls and subscripts.  Operators that work element by element have blanks,
//! because `2.*x` reads as `2.` times `x`.

use hyd_syntax::is_keyword;
use hyd_syntax::tokens::{Kind, Token, is_long_symbol};

/// Keywords that end an operand or are written like one: a sign after them is an operation, and a bracket belongs to them.
const OPERANDS: [&str; 13] = [
    "annotation",
    "break",
    "connect",
    "der",
    "end",
    "enumeration",
    "false",
    "initial",
    "protected",
    "public",
    "pure",
    "true",
    "within",
];

/// True if the token ends an operand.
pub(crate) fn is_operand(token: &Token<'_>) -> bool {
    match token.kind {
        Kind::Word => !is_keyword(token.text) || OPERANDS.contains(&token.text),
        Kind::Number | Kind::Text => true,
        Kind::Symbol => token.closes(),
        Kind::LineComment | Kind::BlockComment => false,
    }
}

/// For each token of an item: it is a sign, not an operation between two operands.
pub(crate) fn signs(tokens: &[Token<'_>]) -> Vec<bool> {
    let mut before: Option<&Token<'_>> = None;
    let mut signs = Vec::with_capacity(tokens.len());
    for token in tokens {
        signs.push(token.is_one_of(&["+", "-", ".+", ".-"]) && !before.is_some_and(is_operand));
        if !token.is_comment() {
            before = Some(token);
        }
    }
    signs
}

/// True if there is a blank between two neighbours; `sign`: the first is a sign; `import`: they belong to an import clause.
pub(crate) fn blank_between(before: &Token<'_>, token: &Token<'_>, sign: bool, import: bool) -> bool {
    const TIGHT: [&str; 4] = ["*", "/", "^", ":"];
    if before.is_comment() || token.is_comment() {
        return true;
    }
    // Two tokens stay two where the language lets them stand side by side, as in what follows `external`.
    if before.kind == Kind::Symbol && token.kind == Kind::Symbol && is_long_symbol(before.text, token.text) {
        return true;
    }
    if sign || before.opens() || before.is(".") || token.closes() || token.is_one_of(&[",", ";"]) {
        return false;
    }
    if before.is_one_of(&[",", ";"]) {
        return true;
    }
    if before.is_one_of(&TIGHT) || token.is_one_of(&TIGHT) || import && token.is(".*") {
        return false;
    }
    !(token.is_one_of(&[".", "(", "["]) && is_operand(before))
}
