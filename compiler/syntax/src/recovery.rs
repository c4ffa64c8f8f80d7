//! Messages about what the grammar could not read.
//!
//! A fragment that only the last-choice rules accepted is parsed again with the rule that its first word asks for; where that
//! rule fails, and what it would have accepted there, becomes the message.  Frequent slips get a hint.  A missing `;` is
//! found without a second parse: the item is complete and a word follows.

use hyd_source::{Diagnostic, Edit, Span, did_you_mean};

use crate::build::Builder;
use crate::build_code::BlockKind;
use crate::grammar::{self, Failure, Node, Rule, expected_words};
use crate::scan::number_end;
use crate::tree::Modification;

/// Where a fragment stands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Place {
    /// Among the declarations.
    Element,
    /// Among declarations that follow an equation section.
    AfterCode,
    Equation,
    Statement,
}

impl Place {
    /// How an item is named.
    pub(crate) fn item(self) -> &'static str {
        match self {
            Place::Element | Place::AfterCode => "this declaration",
            Place::Equation => "this equation",
            Place::Statement => "this statement",
        }
    }
}

/// What a broken fragment seems to have opened, so that its `end` is no surprise.
#[derive(Default)]
pub(crate) struct Opened<'t> {
    /// A block in a section.
    pub(crate) block: Option<BlockKind>,
    /// A class of this name.
    pub(crate) class: Option<&'t str>,
}

const KEYWORDS: [&str; 59] = [
    "algorithm",
    "and",
    "annotation",
    "block",
    "break",
    "class",
    "connect",
    "connector",
    "constant",
    "constrainedby",
    "der",
    "discrete",
    "each",
    "else",
    "elseif",
    "elsewhen",
    "encapsulated",
    "end",
    "enumeration",
    "equation",
    "expandable",
    "extends",
    "external",
    "false",
    "final",
    "flow",
    "for",
    "function",
    "if",
    "import",
    "impure",
    "in",
    "initial",
    "inner",
    "input",
    "loop",
    "model",
    "not",
    "operator",
    "or",
    "outer",
    "output",
    "package",
    "parameter",
    "partial",
    "protected",
    "public",
    "pure",
    "record",
    "redeclare",
    "replaceable",
    "return",
    "stream",
    "then",
    "true",
    "type",
    "when",
    "while",
    "within",
];

const CLASS_WORDS: [&str; 14] = [
    "class",
    "model",
    "block",
    "connector",
    "record",
    "type",
    "package",
    "function",
    "encapsulated",
    "partial",
    "expandable",
    "pure",
    "impure",
    "operator",
];

const PREFIX_WORDS: [&str; 12] = [
    "redeclare",
    "final",
    "inner",
    "outer",
    "replaceable",
    "flow",
    "stream",
    "discrete",
    "parameter",
    "constant",
    "input",
    "output",
];

/// Whether a word is a keyword of Modelica 3.6.
pub fn is_keyword(word: &str) -> bool {
    KEYWORDS.contains(&word)
}

impl<'t> Builder<'t> {
    /// Reports a missing `;` after an item; true if it is missing.
    pub(crate) fn check_terminator(&mut self, node: &Node<'t>, what: &str) -> bool {
        let Some(missing) = node.clone().into_inner().rfind(|n| n.as_rule() == Rule::missing_semi) else {
            return false;
        };
        let at = missing.as_span().start();
        let end = self.text[..at].trim_end().len();
        let found = self.token(at);
        if found.is_empty() && self.truncated {
            return true;
        }
        let span = Span::new(self.file, end, end);
        let same_line = !self.text[end..at].contains('\n');
        let after_number = self.text[..end].ends_with(|c: char| c.is_ascii_digit() || c == ')');
        let message = format!("expected `;` after {what}, found {}", quoted(found));
        let next = Span::new(self.file, at, at + found.len());
        let mut diagnostic = Diagnostic::error(hyd_source::Code::Syntax, message).at(span, "a `;` is missing here");
        if !found.is_empty() {
            diagnostic = diagnostic.with(next, "this begins something new");
        }
        let is_product = same_line && after_number && !found.is_empty() && !is_keyword(found);
        if is_product {
            diagnostic = diagnostic.help("multiplication is written with `*`");
        }
        // `parametr Real k` reads as a type, a name, and something new.
        let first = self.token(node.as_span().start());
        let words = PREFIX_WORDS.into_iter().chain(CLASS_WORDS).chain(["extends", "import", "equation", "algorithm"]);
        let misspelt = did_you_mean(first, words).filter(|_| same_line && !is_keyword(first));
        if !is_product && misspelt.is_none() {
            let edit = Edit { span, text: ";".to_string() };
            diagnostic = diagnostic.propose(format!("write `;` after {what}"), vec![edit]);
        }
        diagnostic = diagnostic.maybe_help(misspelt);
        self.report(diagnostic);
        self.recovered = same_line || found.is_empty();
        true
    }

    /// Whether an item lacks its `;`, without a message.
    pub(crate) fn is_unfinished(&self, node: &Node<'t>) -> bool {
        node.clone().into_inner().any(|n| n.as_rule() == Rule::missing_semi)
    }

    /// A `;` that ends nothing.
    pub(crate) fn stray_semi(&mut self, node: &Node<'t>) {
        if std::mem::take(&mut self.recovered) {
            return;
        }
        let span = self.span(node);
        let line = self.text[..span.start as usize].trim_end().rsplit('\n').next().unwrap_or("");
        let after_head = line.split_whitespace().any(|word| CLASS_WORDS.contains(&word));
        let diagnostic = self.error(span, "this `;` ends nothing");
        if after_head {
            diagnostic.notes.push("the first line of a class has no `;`: `model Name`".into());
        }
    }

    /// A `class_annotation` node with its span.
    pub(crate) fn class_annotation(&mut self, node: Node<'t>) -> Option<(Span, Modification)> {
        self.recovered = false;
        self.check_terminator(&node, "the annotation");
        let span = self.trimmed_span(&node);
        let annotation = node.into_inner().find(|n| n.as_rule() == Rule::annotation)?;
        Some((span, self.annotation(annotation)))
    }

    /// An expression that stands where an equation or assignment is expected.
    pub(crate) fn no_equals(&mut self, left: Span, unfinished: bool, sign: &str) {
        let at = left.end as usize;
        let at = at + (self.text[at..].len() - self.text[at..].trim_start().len());
        let found = self.token(at);
        let span = Span::new(self.file, at, at + found.len());
        let message = format!("expected `{sign}`, found {}", quoted(found));
        let diagnostic = self.error(span, message);
        if unfinished && sign == "=" {
            diagnostic.notes.push("declarations such as `Real x;` stand before `equation`".into());
        }
        self.recovered = unfinished;
    }

    /// The span of the operator inside a gap between two operands.
    pub(crate) fn operator_span(&self, gap: Span) -> Span {
        let text = self.text.get(gap.start as usize..gap.end as usize).unwrap_or("");
        let start = gap.start as usize + text.find(['=', '<', '>']).unwrap_or(0);
        Span::new(self.file, start, start + 2)
    }

    /// Whether a fragment begins with the words of a class.
    pub(crate) fn begins_class(&self, node: &Node<'t>) -> bool {
        self.leading_words(node).iter().find(|w| !PREFIX_WORDS.contains(w)).is_some_and(|w| CLASS_WORDS.contains(w))
    }

    /// The first tokens of a fragment, at most eight.
    pub(crate) fn leading_words(&self, node: &Node<'t>) -> Vec<&'t str> {
        let mut words = Vec::new();
        let mut at = node.as_span().start();
        let end = node.as_span().end();
        while words.len() < 8 && at < end {
            let token = self.token(at);
            words.push(token);
            at += token.len().max(1);
            at += self.text[at.min(end)..end].len() - self.text[at.min(end)..end].trim_start().len();
        }
        words
    }

    /// Reports a `bad_element` or `bad_code` node.
    pub(crate) fn bad_fragment(&mut self, node: &Node<'t>, place: Place) -> Opened<'t> {
        let words = self.leading_words(node);
        let opened = self.opened(&words, place);
        if matches!(place, Place::Equation | Place::Statement) && self.misspelt_head(node) {
            return opened;
        }
        if std::mem::take(&mut self.recovered) && opened.block.is_none() && opened.class.is_none() {
            return opened;
        }
        let fragment = node.as_str();
        let start = node.as_span().start();
        let rule = rule_for(&words, place);
        match grammar::run(rule, fragment) {
            Err(failure) if !failure.gave_up => self.explain(&failure, fragment, start, place),
            _ => {
                let first = words.first().copied().unwrap_or("");
                let span = Span::new(self.file, start, start + first.len());
                self.error(span, format!("unexpected {}", quoted(first)));
            }
        }
        opened
    }

    fn opened(&self, words: &[&'t str], place: Place) -> Opened<'t> {
        if matches!(place, Place::Equation | Place::Statement) {
            let block = words.first().and_then(|word| BlockKind::of(word));
            return Opened { block, class: None };
        }
        let mut rest = words.iter().copied().skip_while(|word| PREFIX_WORDS.contains(word)).peekable();
        if !rest.peek().is_some_and(|word| CLASS_WORDS.contains(word)) {
            return Opened::default();
        }
        let mut last_word = "";
        let mut rest = rest.skip_while(|word| {
            let again = CLASS_WORDS.contains(word);
            if again {
                last_word = word;
            }
            again
        });
        let (name, next) = (rest.next(), rest.next());
        if next == Some("=") {
            return Opened::default();
        }
        let name = match name {
            Some(name) if self.ends.contains_key(name) => name,
            _ => last_word,
        };
        let class = self.ends.contains_key(name).then_some(name);
        Opened { block: None, class }
    }

    fn explain(&mut self, failure: &Failure, fragment: &'t str, start: usize, place: Place) {
        let at = start + failure.at;
        let found = self.token(at);
        let span = Span::new(self.file, at, at + found.len());
        if let Some((message, help)) = self.other_place(fragment, place) {
            let first = Span::new(self.file, start, start + self.token(start).len());
            self.error(first, message).notes.push(help.into());
            return;
        }
        if found.starts_with(|c: char| c.is_ascii_digit()) && self.text[..at].ends_with('.') {
            let span = Span::new(self.file, at - 1, at + found.len());
            self.error(span, "a number cannot begin with `.`").notes.push(format!("write `0.{found}`"));
            return;
        }
        let words = expected_words(&failure.expected);
        let wants_name = words.contains(&"a name") || words.contains(&"an expression");
        if words.iter().all(|w| *w == "a name" || *w == "an expression" || w.contains("string"))
            && wants_name
            && words.contains(&"a name")
            && is_keyword(found)
        {
            self.error(span, format!("`{found}` is a keyword and cannot be a name"))
                .notes
                .push(format!("choose another name, such as `{found}_`, or quote it: `'{found}'`"));
            return;
        }
        let message = match expected_list(&words) {
            Some(list) => format!("expected {list}, found {}", quoted(found)),
            None => format!("unexpected {}", quoted(found)),
        };
        let mut diagnostic = Diagnostic::error(hyd_source::Code::Syntax, message).at(span, "");
        if let Some(open) = unclosed(fragment, failure.at).filter(|_| matches!(found, ";" | "") || is_keyword(found)) {
            let open = start + open;
            diagnostic = diagnostic.with(Span::new(self.file, open, open + 1), "this bracket is still open");
        }
        let condition = words.contains(&"`then`") || words.contains(&"`loop`");
        self.report(diagnostic.maybe_help(self.hint(found, at, start, condition).map(str::to_string)));
    }

    /// Whether the fragment would be right in another part of the class.
    fn other_place(&self, fragment: &str, place: Place) -> Option<(&'static str, &'static str)> {
        let length = fragment.trim_end().len();
        let parses = |rule| {
            grammar::run(rule, fragment)
                .is_ok_and(|mut n| n.next().is_some_and(|n| n.as_str().trim_end().len() == length))
        };
        let begins = |rule| grammar::run(rule, fragment).is_ok();
        match place {
            Place::Element
                if parses(Rule::connect_item) || parses(Rule::simple_code) && fragment.contains(['=', '(']) =>
            {
                Some(("an equation cannot stand among the declarations", "equations follow the word `equation`"))
            }
            Place::Element if [Rule::if_head, Rule::for_head, Rule::when_head].into_iter().any(begins) => {
                Some(("an equation cannot stand among the declarations", "equations follow the word `equation`"))
            }
            Place::Equation | Place::Statement if parses(Rule::element) => Some((
                "a declaration cannot stand among equations or statements",
                "declarations stand before `equation` and `algorithm`",
            )),
            _ => None,
        }
    }

    fn hint(&self, found: &str, at: usize, start: usize, condition: bool) -> Option<&'static str> {
        let before = self.text[..at].trim_end();
        match found {
            "*" if before.ends_with('*') => Some("powers are written with `^`"),
            "=" if before.ends_with(['+', '-', '*', '/']) => Some("write `x = x + 1` in full"),
            "=" if condition => Some("values are compared with `==`"),
            "=" if self.text[start..at].contains('\n') => Some("a `;` may be missing at the end of a line before"),
            "if" => Some("an `if` expression inside an expression needs parentheses: `(if c then a else b)`"),
            _ if found.starts_with(|c: char| c.is_ascii_digit())
                && before.strip_suffix(',').is_some_and(|b| b.ends_with(|c: char| c.is_ascii_digit())) =>
            {
                Some("decimals are written with a point: `1.5`")
            }
            _ if found.starts_with(|c: char| c.is_ascii_digit())
                && found.ends_with(|c: char| c.is_ascii_alphabetic()) =>
            {
                Some("names begin with a letter or `_`")
            }
            _ => None,
        }
    }

    /// The token that begins at a byte offset; empty at the end of the text.
    pub(crate) fn token(&self, at: usize) -> &'t str {
        let rest = self.text.get(at..).unwrap_or("");
        let bytes = rest.as_bytes();
        let length = match bytes.first() {
            None => 0,
            Some(b'a'..=b'z' | b'A'..=b'Z' | b'_') => {
                bytes.iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count()
            }
            Some(b'0'..=b'9') => {
                let end = number_end(bytes, 0);
                end + bytes[end..].iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count()
            }
            Some(b'"') => rest[1..].find('"').map_or(1, |end| end + 2),
            Some(_)
                if ["==", "<>", "<=", ">=", ":=", ".+", ".-", ".*", "./", ".^"]
                    .iter()
                    .any(|op| rest.starts_with(op)) =>
            {
                2
            }
            Some(_) => rest.chars().next().map_or(0, char::len_utf8),
        };
        &rest[..length]
    }
}

fn rule_for(words: &[&str], place: Place) -> Rule {
    let first = words.first().copied().unwrap_or("");
    let second = words.get(1).copied().unwrap_or("");
    match first {
        "import" => Rule::import,
        "extends" => Rule::extends,
        "within" => Rule::within,
        "annotation" => Rule::class_annotation,
        "end" if BlockKind::of(second).is_some() => Rule::block_end,
        "end" => Rule::class_end,
        _ if matches!(place, Place::Element | Place::AfterCode) => Rule::element,
        "if" => Rule::if_head,
        "elseif" => Rule::elseif_head,
        "when" => Rule::when_head,
        "elsewhen" => Rule::elsewhen_head,
        "for" => Rule::for_head,
        "while" => Rule::while_head,
        "connect" => Rule::connect_item,
        "break" | "return" => Rule::jump,
        _ => Rule::simple_code,
    }
}

/// `a, b or c`.
pub(crate) fn expected_list(words: &[&str]) -> Option<String> {
    match words {
        [] => None,
        [one] => Some((*one).to_string()),
        [first @ .., last] => Some(format!("{} or {last}", first.join(", "))),
    }
}

/// A token in backquotes, or the words for the end of the text; long strings are cut.
pub(crate) fn quoted(token: &str) -> String {
    if token.is_empty() {
        return "the end of the file".to_string();
    }
    let first = token.lines().next().unwrap_or("");
    if first.chars().count() > 30 || first.len() < token.len() {
        let cut: String = first.chars().take(25).collect();
        return format!("`{cut}...`");
    }
    format!("`{token}`")
}

/// The innermost bracket of `text[..end]` that is open at `end`.
fn unclosed(text: &str, end: usize) -> Option<usize> {
    let mut open = Vec::new();
    let mut in_string = false;
    let mut escaped = false;
    for (at, byte) in text.bytes().enumerate().take(end) {
        if in_string {
            in_string = escaped || byte != b'"';
            escaped = !escaped && byte == b'\\';
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b'(' | b'[' | b'{' => open.push(at),
            b')' | b']' | b'}' => drop(open.pop()),
            _ => {}
        }
    }
    open.pop()
}
