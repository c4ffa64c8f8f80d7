//! Semantic tokens: what each name means, with keywords, comments, strings and numbers between them.

use std::collections::HashMap;

use hyd_instance::meaning::Meaning;
use hyd_syntax::is_keyword;
use hyd_syntax::names::{Place, Purpose};
use hyd_syntax::tokens::{Kind, tokens as text_tokens};
use hyd_syntax::tree::{ClassKind, Variability};
use lsp_types::{Range, SemanticToken, SemanticTokenModifier, SemanticTokenType, SemanticTokensLegend};

use crate::documents::Document;
use crate::session::{Question, Session};

/// The kinds of tokens in the order of the legend.
const TYPES: [SemanticTokenType; 14] = [
    SemanticTokenType::NAMESPACE,
    SemanticTokenType::CLASS,
    SemanticTokenType::INTERFACE,
    SemanticTokenType::STRUCT,
    SemanticTokenType::TYPE,
    SemanticTokenType::FUNCTION,
    SemanticTokenType::ENUM_MEMBER,
    SemanticTokenType::PARAMETER,
    SemanticTokenType::VARIABLE,
    SemanticTokenType::PROPERTY,
    SemanticTokenType::KEYWORD,
    SemanticTokenType::COMMENT,
    SemanticTokenType::STRING,
    SemanticTokenType::NUMBER,
];
const KEYWORD: u32 = 10;
const COMMENT: u32 = 11;
const STRING: u32 = 12;
const NUMBER: u32 = 13;
/// The bits of the modifiers in the order of the legend.
const DECLARATION: u32 = 1;
const READONLY: u32 = 2;
const LIBRARY: u32 = 4;

/// What the numbers in the answer mean.
pub(crate) fn legend() -> SemanticTokensLegend {
    let modifiers =
        [SemanticTokenModifier::DECLARATION, SemanticTokenModifier::READONLY, SemanticTokenModifier::DEFAULT_LIBRARY];
    SemanticTokensLegend { token_types: TYPES.to_vec(), token_modifiers: modifiers.to_vec() }
}

/// The tokens of a document, or of a range of it.
pub(crate) fn semantic_tokens(session: &mut Session, document: &Document, range: Option<Range>) -> Vec<SemanticToken> {
    let encoding = session.settings.encoding;
    let text = document.text.clone();
    let bytes = range.map_or(0..text.len(), |range| document.lines.bytes(&text, range, encoding));
    let names = session.ask_document(document, |question| {
        let places = std::mem::take(&mut question.names.places);
        let inside = |place: &&Place| {
            (place.ident.span.end as usize) >= bytes.start && (place.ident.span.start as usize) <= bytes.end
        };
        let mut known = HashMap::new();
        let all = places.iter().filter(inside);
        let found = all.filter_map(|place| Some((place.ident.span.start as usize, kind(question, place, &mut known)?)));
        found.collect::<HashMap<usize, (u32, u32)>>()
    });
    let mut encoder = Encoder { last: (0, 0), out: Vec::new() };
    for token in text_tokens(&text) {
        let end = token.at + token.text.len();
        if end < bytes.start {
            continue;
        }
        if token.at > bytes.end {
            break;
        }
        let shown = match token.kind {
            Kind::Word if is_keyword(token.text) => Some((KEYWORD, 0)),
            Kind::Word => names.get(&token.at).copied(),
            Kind::LineComment | Kind::BlockComment => Some((COMMENT, 0)),
            Kind::Text => Some((STRING, 0)),
            Kind::Number => Some((NUMBER, 0)),
            Kind::Symbol => None,
        };
        let Some((kind, modifiers)) = shown else { continue };
        // Clients need not know tokens of several lines.
        let mut at = token.at;
        for line in token.text.split_inclusive('\n') {
            let piece = line.trim_end_matches(['\n', '\r']);
            let position = document.lines.position(&text, at, encoding);
            encoder.push((position.line, position.character), encoding.width(piece), kind, modifiers);
            at += line.len();
        }
    }
    encoder.out
}

struct Encoder {
    last: (u32, u32),
    out: Vec<SemanticToken>,
}

impl Encoder {
    fn push(&mut self, (line, start): (u32, u32), length: u32, token_type: u32, token_modifiers_bitset: u32) {
        if length == 0 || (line, start) < self.last {
            return;
        }
        let delta_line = line - self.last.0;
        let delta_start = if delta_line == 0 { start - self.last.1 } else { start };
        self.out.push(SemanticToken { delta_line, delta_start, length, token_type, token_modifiers_bitset });
        self.last = (line, start);
    }
}

/// The kind of a name; names that mean the same are looked up once.
type Known = HashMap<(Option<usize>, String), Option<(u32, u32)>>;

fn kind(question: &mut Question<'_>, place: &Place, known: &mut Known) -> Option<(u32, u32)> {
    let declares = matches!(
        place.purpose,
        Purpose::DeclaresClass | Purpose::DeclaresComponent(_) | Purpose::DeclaresLiteral | Purpose::DeclaresIterator
    );
    let names = |parts: &[hyd_syntax::tree::Ident]| parts.iter().map(|part| &*part.name).collect::<Vec<_>>().join(".");
    let key = match &place.purpose {
        Purpose::Class(part) => Some(format!("c{}{} {}", part.base, part.import, names(&part.path.parts[..=part.at]))),
        Purpose::Reference(part) if part.iterator.is_none() => Some(format!("r {}", names(&part.parts[..=part.at]))),
        // What is redeclared beside it decides, too.
        Purpose::Modifier(modifier) => Some(format!("m {:p} {}", modifier.within, names(&modifier.chain))),
        _ => None,
    };
    let key = key.map(|key| (place.class, key));
    if let Some(found) = key.as_ref().and_then(|key| known.get(key)) {
        return *found;
    }
    let ids = std::mem::take(&mut question.ids);
    let meaning = question.table.meaning(place, &ids);
    question.ids = ids;
    let found = meaning.map(|meaning| {
        let (kind, modifiers) = of_meaning(question, &meaning);
        (kind, modifiers | if declares { DECLARATION } else { 0 })
    });
    if let Some(key) = key {
        known.insert(key, found);
    }
    found
}

fn of_meaning(question: &Question<'_>, meaning: &Meaning) -> (u32, u32) {
    match meaning {
        Meaning::Class(class) => match question.table.class(*class).def.kind {
            ClassKind::Package => (0, 0),
            ClassKind::Class | ClassKind::Model | ClassKind::Block => (1, 0),
            ClassKind::Connector => (2, 0),
            ClassKind::Record => (3, 0),
            ClassKind::Type => (4, 0),
            ClassKind::Function | ClassKind::Operator => (5, 0),
        },
        Meaning::Component(member) => match member.component.variability {
            Variability::Constant => (7, READONLY),
            Variability::Parameter => (7, 0),
            Variability::Discrete | Variability::Continuous => (8, 0),
        },
        Meaning::Literal { .. } => (6, READONLY),
        Meaning::Iterator(_) => (8, READONLY),
        Meaning::Type(_) => (4, LIBRARY),
        Meaning::Attribute { .. } => (9, LIBRARY),
        Meaning::Builtin(_) => (5, LIBRARY),
        Meaning::Time => (8, READONLY | LIBRARY),
    }
}
