//! An equation that stands twice, because a line was copied and its names were not changed.

use std::collections::BTreeSet;

use hyd_source::Span;
use hyd_syntax::tree::{Component, Equation, EquationKind, EquationSection, Expr, ExprKind, Variability};
use hyd_syntax::visit::{Visitor, walk_expr};

use super::{Found, Rank};

impl Found<'_> {
    /// The later one of two equal equations with the names of other variables: `w2 = der(phi2)` for the second `w1 = der(phi1)`.
    pub(super) fn copied(&mut self, sections: &[EquationSection], components: &[&Component]) {
        if !self.trouble.too_many {
            return;
        }
        let equations = sections.iter().filter(|own| !own.initial).flat_map(|own| &own.equations);
        let sides = |own: &Equation| match &own.kind {
            EquationKind::Equal(left, right) => Some((self.said(left.span), self.said(right.span))),
            _ => None,
        };
        let (mut known, mut twice) = (BTreeSet::new(), Vec::new());
        for equation in equations {
            if let Some(sides) = sides(equation)
                && self.is_marked(equation.span)
                && !known.insert(sides)
            {
                twice.push(equation);
            }
        }
        let unknowns = components.iter().filter(|own| own.variability > Variability::Parameter);
        let names: BTreeSet<&str> = unknowns.map(|own| &*own.name.name).collect();
        for equation in twice {
            let EquationKind::Equal(left, right) = &equation.kind else { continue };
            let mut read = reads(&[left, right]);
            read.retain(|own| names.contains(&*own.name));
            for text in self.renamed(equation.span, read, &names) {
                self.write(Rank::Marked, equation.span, &text);
            }
        }
    }

    /// The text with an ending, a beginning or a subscript of its names replaced by that of other variables, wherever such a variable is declared; those
    /// with the most names replaced come first.
    fn renamed(&self, whole: Span, read: Vec<Read>, names: &BTreeSet<&str>) -> Vec<String> {
        let mut slips: BTreeSet<(Slip, &str, &str)> = BTreeSet::new();
        for (own, other) in read.iter().flat_map(|own| names.iter().map(move |&other| (&*own.name, other))) {
            let [head, tail] = [common(own.chars(), other.chars()), common(own.chars().rev(), other.chars().rev())];
            let has_letter = own[own.len() - tail..].contains(char::is_alphabetic);
            match (own == other, head, has_letter) {
                (false, 1.., _) => slips.insert((Slip::End, &own[head..], &other[head..])),
                (false, 0, true) => slips.insert((Slip::Begin, &own[..own.len() - tail], &other[..other.len() - tail])),
                _ => false,
            };
        }
        let mut edits: Vec<Vec<(Span, String)>> = Vec::new();
        for (slip, old, new) in slips {
            let renamed = read.iter().filter_map(|own| {
                let name = match slip {
                    Slip::End => format!("{}{new}", own.name.strip_suffix(old)?),
                    Slip::Begin => format!("{new}{}", own.name.strip_prefix(old)?),
                };
                names.contains(&*name).then_some((own.span, name))
            });
            edits.push(renamed.collect());
        }
        let numbers: BTreeSet<u32> = read.iter().flat_map(|own| own.subscripts.iter().map(|at| at.1)).collect();
        for old in numbers {
            for new in [old + 1, old.saturating_sub(1)].into_iter().filter(|&new| new > 0) {
                let at = read.iter().flat_map(|own| &own.subscripts).filter(|at| at.1 == old);
                edits.push(at.map(|at| (at.0, new.to_string())).collect());
            }
        }
        edits.sort_by_key(|own| std::cmp::Reverse(own.len()));
        let with = |edits: Vec<(Span, String)>| {
            let mut text = self.snippet(whole).to_string();
            for (span, new) in edits.into_iter().rev() {
                text.replace_range((span.start - whole.start) as usize..(span.end - whole.start) as usize, &new);
            }
            text
        };
        edits.into_iter().map(with).collect()
    }
}

/// Where a name was left as it was copied.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Slip {
    End,
    Begin,
}

/// A variable that is read, by the first part of its name, with numbers that are subscripts.
struct Read {
    name: String,
    span: Span,
    subscripts: Vec<(Span, u32)>,
}

/// The variables that expressions read, in the order of the text.
fn reads(sides: &[&Expr]) -> Vec<Read> {
    struct Reads(Vec<Read>);
    impl Visitor for Reads {
        fn expr(&mut self, expr: &Expr) {
            if let ExprKind::Ref(of) = &expr.kind {
                let first = &of.parts[0];
                let subscripts = of.parts.iter().flat_map(|part| &part.subscripts).filter_map(|own| match own.kind {
                    ExprKind::Integer(value) => Some((own.span, u32::try_from(value).ok()?)),
                    _ => None,
                });
                let (name, span) = (first.name.name.to_string(), first.name.span);
                self.0.push(Read { name, span, subscripts: subscripts.collect() });
            }
            walk_expr(self, expr);
        }
    }
    let mut reads = Reads(Vec::new());
    sides.iter().for_each(|side| reads.expr(side));
    reads.0
}

/// How many bytes the letters take in which two names agree.
fn common(one: impl Iterator<Item = char>, other: impl Iterator<Item = char>) -> usize {
    one.zip(other).take_while(|(a, b)| a == b).map(|(a, _)| a.len_utf8()).sum()
}
