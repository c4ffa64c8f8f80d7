//! Where something is declared: the declaration itself, the class of a component, the bases of a class.

use hyd_instance::meaning::{KindClass, Meaning};
use hyd_source::{Files, Span};
use lsp_types::{Location, Position};

use crate::documents::Document;
use crate::session::{Question, Session};

/// Which declaration is wanted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Wanted {
    /// Of what the name means; of a redeclared element that of the element that it takes the place of.
    Itself,
    /// Of the class of a component; of the class itself.
    Class,
    /// Of the bases of the class, or of the class of the component.
    Bases,
}

/// The declarations for a place.
pub(crate) fn definition(
    session: &mut Session,
    document: &Document,
    position: Position,
    wanted: Wanted,
) -> Vec<Location> {
    let byte = session.byte(document, position);
    let (spans, files): (Vec<Span>, Files) = session.ask_document(document, |question| {
        let spans = spans(question, byte, wanted).unwrap_or_default();
        (spans, question.table.files.clone())
    });
    spans.iter().filter_map(|span| session.location(&files, *span)).collect()
}

fn spans(question: &mut Question<'_>, byte: usize, wanted: Wanted) -> Option<Vec<Span>> {
    let place = question.place(byte)?;
    let ids = question.ids.clone();
    let meaning = question.table.meaning(&place, &ids)?;
    if wanted == Wanted::Itself {
        return question.table.declared(&meaning).map(|span| vec![span]);
    }
    let class = match &meaning {
        Meaning::Class(class) | Meaning::Literal { class, .. } => *class,
        Meaning::Component(member) => match question.table.kind_of(member)?.class {
            KindClass::Class(class) => class,
            KindClass::Builtin(_) => return None,
        },
        _ => return None,
    };
    if wanted == Wanted::Class {
        return question.table.declared(&Meaning::Class(class)).map(|span| vec![span]);
    }
    let shape = question.table.quietly(|table| table.shape(class)).ok()?;
    let bases = shape.frames.iter().skip(1);
    Some(bases.filter_map(|frame| question.table.declared(&Meaning::Class(frame.class))).collect())
}
