//! Where a line of an item may end, and what that costs.
//!
//! A place inside more brackets costs more; the cheapest places are those between the parts of a declaration (declaration,
//! description, annotation), then commas, then operators, a line beginning with its operator.  Comments keep the line ends that
//! the author gave them.  A table, a matrix of several rows or an array of arrays, has each row on a line of its own if
//! the author broke it or it is long.

use crate::spacing::{blank_between, is_operand, signs};
use hyd_syntax::tokens::{Kind, Token};

/// Whether a line may end before a token.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Break {
    Never,
    /// At this cost.
    May(u32),
    Always,
}

/// A token in its line.
#[derive(Debug)]
pub(crate) struct Piece<'t> {
    pub(crate) text: &'t str,
    /// A blank stands before it.
    pub(crate) blank: bool,
    /// The line may end before it.
    pub(crate) before: Break,
    /// No line end can make room for it: how far it sticks out does not count.
    pub(crate) free: bool,
}

/// Cost of an opening bracket at the end of a line, above that of one more line.
const BRACKET: u32 = 1_500;
/// Cost of a name without its value at the end of a line.
const VALUE: u32 = 3_000;
/// Longer tables stand row by row.
const TABLE_WIDTH: usize = 60;

/// An open bracket.
#[derive(Clone, Copy, Debug)]
struct Bracket {
    /// It holds subscripts or dimensions.
    subscripts: bool,
    /// Each row stands on its line.
    rows: bool,
    /// It is an array of arrays, or a matrix.
    table: bool,
    matrix: bool,
}

/// The pieces of an item; `room`: columns for a line that continues it; `code`: it is an equation or a statement.
pub(crate) fn pieces<'t>(tokens: &[Token<'t>], room: usize, code: bool) -> Vec<Piece<'t>> {
    let signs = signs(tokens);
    let rows = long_tables(tokens);
    let import = tokens.iter().find(|token| !token.is_comment()).is_some_and(|token| token.is("import"));
    let constrained = tokens.iter().any(|token| token.is("constrainedby"));
    let long = tokens.iter().map(|token| token.text.len() + 1).sum::<usize>() > room;
    let mut brackets: Vec<Bracket> = Vec::new();
    let mut pieces: Vec<Piece<'t>> = Vec::with_capacity(tokens.len());
    for (k, token) in tokens.iter().enumerate() {
        let place = Place { tokens, k, signs: &signs, code, constrained };
        let (blank, before) = match k.checked_sub(1) {
            None => (false, Break::Never),
            Some(last) => (blank_between(&tokens[last], token, signs[last], import), place.before(&brackets, import)),
        };
        let text = is_long_text(tokens, k, room, !brackets.is_empty());
        let free = text
            || token.is_comment()
            || (token.closes() || token.is(";")) && pieces.last().is_some_and(|last| last.free);
        pieces.push(Piece { text: token.text, blank, before, free });
        if token.opens() {
            let table = is_table(tokens, k);
            let subscripts = token.is("[") && k > 0 && is_operand(&tokens[k - 1]);
            brackets.push(Bracket { subscripts, rows: table && rows[k], table, matrix: token.is("[") });
        } else if token.closes() {
            brackets.pop();
        }
    }
    if code && long {
        break_cases(tokens, &mut pieces);
    }
    pieces
}

/// A place between two tokens.
struct Place<'a, 't> {
    tokens: &'a [Token<'t>],
    k: usize,
    signs: &'a [bool],
    code: bool,
    constrained: bool,
}

impl Place<'_, '_> {
    fn before(&self, brackets: &[Bracket], import: bool) -> Break {
        let (last, token) = (&self.tokens[self.k - 1], &self.tokens[self.k]);
        if last.is_comment() || token.is_comment() {
            return if token.breaks > 0 { Break::Always } else { Break::Never };
        }
        if let Some(bracket) = brackets.last() {
            let separator = last.is(if bracket.matrix { ";" } else { "," });
            // Only what closes a table at once can follow its opening bracket or a separator without being a row.
            if bracket.table && (separator || last.opens()) && !token.closes() {
                return if bracket.rows { Break::Always } else { Break::Never };
            }
            if bracket.subscripts {
                return Break::Never;
            }
        }
        if token.is_one_of(&[",", ";", ")", "]", "}", "."]) || last.is(".") || self.signs[self.k - 1] || import {
            return Break::Never;
        }
        if token.is("Documentation") && last.is(",") {
            return Break::Always;
        }
        let depth = brackets.len() as u32;
        self.cost(last, token, depth).map_or(Break::Never, |cost| Break::May(cost + 25 * depth))
    }

    fn cost(&self, last: &Token<'_>, token: &Token<'_>, depth: u32) -> Option<u32> {
        let operand = is_operand(last);
        let outside = depth == 0;
        Some(match token.text {
            _ if last.is(",") => 20,
            _ if last.opens() => BRACKET,
            _ if token.kind == Kind::Text && operand => {
                if self.constrained {
                    10
                } else {
                    15
                }
            }
            _ if last.is_one_of(&["=", ":="]) && !(outside && self.code) => {
                if outside {
                    60
                } else {
                    VALUE
                }
            }
            "annotation" => {
                if self.constrained {
                    15
                } else {
                    10
                }
            }
            "constrainedby" => 20,
            "else" | "elseif" => 25,
            "and" | "or" => 30,
            "for" if !outside => 35,
            "if" if operand => 40,
            "=" | ":=" if outside && self.code => 60,
            "+" | "-" | ".+" | ".-" if operand => 40,
            "<" | "<=" | ">" | ">=" | "==" | "<>" => 70,
            "then" => 90,
            "*" | "/" | ".*" | "./" => 160,
            _ => return None,
        })
    }
}

/// The bracket at `k` opens an array of arrays, or a matrix that is not a list of subscripts.
fn is_table(tokens: &[Token<'_>], k: usize) -> bool {
    let inner = tokens.get(k + 1);
    match tokens[k].text {
        "{" => inner.is_some_and(|token| token.is("{")),
        "[" => k == 0 || !is_operand(&tokens[k - 1]),
        _ => false,
    }
}

/// For each opening bracket of a table: its rows stand on lines of their own.
fn long_tables(tokens: &[Token<'_>]) -> Vec<bool> {
    let mut rows = vec![false; tokens.len()];
    // Place of the bracket, column at it, a row was broken, there are several rows.
    let mut open: Vec<(usize, usize, bool, bool)> = Vec::new();
    let mut column = 0;
    for (k, token) in tokens.iter().enumerate() {
        if let Some((bracket, _, broken, several)) = open.last_mut() {
            let separator = if tokens[*bracket].is("[") { ";" } else { "," };
            let begins = k > 0 && (tokens[k - 1].is(separator) || k - 1 == *bracket);
            *broken |= begins && token.breaks > 0;
            *several |= token.is(separator);
        }
        if token.opens() {
            open.push((k, column, false, false));
        } else if token.closes()
            && let Some((bracket, start, broken, several)) = open.pop()
        {
            rows[bracket] = is_table(tokens, bracket) && (broken || several && column - start > TABLE_WIDTH);
        }
        column += token.text.len() + 1;
    }
    rows
}

/// A string for which no line has room, or one that goes over several lines.
fn is_long_text(tokens: &[Token<'_>], k: usize, room: usize, inside: bool) -> bool {
    let token = &tokens[k];
    let documentation = k > 1 && tokens[k - 1].is("=") && tokens[k - 2].is("info");
    let length = || token.text.chars().count() + 6;
    token.kind == Kind::Text && (token.text.contains('\n') || inside && (documentation || length() > room))
}

/// A choice of several cases that does not fit on a line has each case on its own.
fn break_cases(tokens: &[Token<'_>], pieces: &mut [Piece<'_>]) {
    let mut depth = 0usize;
    let mut cases = Vec::new();
    for (k, token) in tokens.iter().enumerate() {
        if token.opens() {
            depth += 1;
        } else if token.closes() {
            depth = depth.saturating_sub(1);
        } else if depth == 0 && token.is_one_of(&["else", "elseif"]) && matches!(pieces[k].before, Break::May(_)) {
            cases.push(k);
        }
    }
    if cases.len() > 1 {
        cases.into_iter().for_each(|k| pieces[k].before = Break::Always);
    }
}
