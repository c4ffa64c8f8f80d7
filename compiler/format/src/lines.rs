//! An item to lines: the cheapest choice among the places where a line may end.
//!
//! Cost: first how far lines stick out, then the number of lines, then the costs of the places; among equals the one whose
//! lines are full from the top.  Found by dynamic programming from the end, as Knuth and Plass break paragraphs ("Breaking
//! paragraphs into lines", Software: Practice and Experience 11, 1981).  All lines but the first of an item are indented alike.

use crate::breaks::{Break, Piece, pieces};
use crate::items::Item;
use crate::{STEP, WIDTH};
use hyd_syntax::tokens::Token;

/// Cost of a line, above that of any place.
const LINE: u64 = 1_000;
/// Cost of a character beyond the width.
const EXCESS: u64 = 10_000;

/// Appends an item.
pub(crate) fn write_item(out: &mut String, tokens: &[Token<'_>], item: &Item, line_end: &str) {
    let indent = STEP * item.depth;
    let further = indent + if item.head { 2 * STEP } else { STEP };
    // All lines of an item that is only comments are alike.
    let further = if tokens.iter().all(Token::is_comment) { indent } else { further };
    let pieces = pieces(tokens, WIDTH.saturating_sub(further), item.code && !item.head);
    let starts = starts(&pieces, indent, further);
    let mut next = starts.iter().peekable();
    for (k, piece) in pieces.iter().enumerate() {
        if next.next_if(|start| **start == k).is_some() {
            if k > 0 {
                out.push_str(line_end);
            }
            out.extend(std::iter::repeat_n(' ', if k == 0 { indent } else { further }));
        } else if piece.blank {
            out.push(' ');
        }
        out.push_str(piece.text);
    }
    out.push_str(line_end);
}

/// The pieces at which lines start, the first among them.
fn starts(pieces: &[Piece<'_>], indent: usize, further: usize) -> Vec<usize> {
    let n = pieces.len();
    // Cost of the lines from a piece to the end, and where the line after that piece's starts.
    let mut best: Vec<(u64, usize)> = vec![(0, n); n + 1];
    for start in (0..n).rev() {
        if start == 0 || pieces[start].before != Break::Never {
            best[start] = line(pieces, start, if start == 0 { indent } else { further }, &best);
        }
    }
    let mut starts = Vec::new();
    let mut at = 0;
    while at < n {
        starts.push(at);
        at = best[at].1;
    }
    starts
}

/// The cheapest line from `start`: the cost from here to the end, and where the next line starts.
fn line(pieces: &[Piece<'_>], start: usize, indent: usize, best: &[(u64, usize)]) -> (u64, usize) {
    let mut cheapest = (u64::MAX, pieces.len());
    let mut column = indent;
    let mut excess = 0u64;
    for (end, piece) in pieces.iter().enumerate().skip(start) {
        if end > start {
            let place = match piece.before {
                Break::Never => None,
                Break::May(cost) => Some(u64::from(cost)),
                Break::Always => Some(0),
            };
            if let Some(cost) = place {
                let total = best[end].0 + LINE + cost + excess * EXCESS;
                if total <= cheapest.0 {
                    cheapest = (total, end);
                }
            }
            if piece.before == Break::Always || excess * EXCESS > cheapest.0 {
                return cheapest;
            }
            column += usize::from(piece.blank);
        }
        let before = column.max(WIDTH);
        column = match piece.text.rsplit_once('\n') {
            Some((_, last)) => last.chars().count(),
            None => column + piece.text.chars().count(),
        };
        if !piece.free {
            excess += column.saturating_sub(before) as u64;
        }
    }
    if excess * EXCESS <= cheapest.0 { (excess * EXCESS, pieces.len()) } else { cheapest }
}
