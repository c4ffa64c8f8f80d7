//! Equation and algorithm sections: a flat list of heads, items and ends to nested equations or statements.
//!
//! Open blocks stand on a stack.  A block that is not closed, or closed by the wrong `end`, costs one message and is closed
//! where the text shows that it must have ended.  The grammar reads equations and statements alike; what belongs into the
//! other kind of section (`:=`, `=`, `connect`, `while`) is reported here with a hint.

use hyd_source::Span;

use crate::build::Builder;
use crate::grammar::{Node, Rule};
use crate::recovery::Place;
use crate::tree::{BinaryOp, ComponentRef, Expr, ExprKind, Iterator, Modification, Name};

/// Kind of an open block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum BlockKind {
    If,
    For,
    When,
    While,
}

impl BlockKind {
    pub(crate) fn word(self) -> &'static str {
        match self {
            BlockKind::If => "if",
            BlockKind::For => "for",
            BlockKind::When => "when",
            BlockKind::While => "while",
        }
    }

    /// The block that a word opens or, after `end`, closes.
    pub(crate) fn of(word: &str) -> Option<Self> {
        [BlockKind::If, BlockKind::For, BlockKind::When, BlockKind::While].into_iter().find(|kind| kind.word() == word)
    }
}

/// A block whose `end` has not come yet.
pub(crate) struct Block<T> {
    pub(crate) kind: BlockKind,
    pub(crate) head: Span,
    /// The head could not be read; the block is dropped with all it holds.
    broken: bool,
    /// Conditions with their bodies; one for loops.
    pub(crate) branches: Vec<(Option<Expr>, Vec<T>)>,
    pub(crate) iterators: Vec<Iterator>,
    /// An `else if` in two words stands inside.
    else_if: bool,
}

/// What one simple item says, before it is known to be an equation or a statement.
pub(crate) struct Simple {
    pub(crate) left: Expr,
    /// `=` or `:=` with its span, and the right side.
    pub(crate) right: Option<(&'static str, Span, Expr)>,
    /// Nothing but a word follows: a `;` is missing, or more.
    pub(crate) unfinished: bool,
    /// The item may be the rest of a broken one: no message.
    pub(crate) silent: bool,
}

/// What differs between equations and statements.
pub(crate) trait Code: Sized {
    /// For messages and recovery.
    const PLACE: Place;
    fn simple(builder: &mut Builder<'_>, simple: Simple, description: Option<Name>, span: Span) -> Option<Self>;
    fn connect(
        builder: &mut Builder<'_>,
        ends: [ComponentRef; 2],
        description: Option<Name>,
        span: Span,
    ) -> Option<Self>;
    fn jump(builder: &mut Builder<'_>, word: &str, span: Span) -> Option<Self>;
    fn block(builder: &mut Builder<'_>, block: Block<Self>, description: Option<Name>, span: Span) -> Option<Self>;
}

/// The items of one section while it is being read.
struct Section<T> {
    items: Vec<T>,
    open: Vec<Block<T>>,
}

impl<T> Section<T> {
    fn push(&mut self, item: T) {
        match self.open.last_mut().and_then(|block| block.branches.last_mut()) {
            Some((_, body)) => body.push(item),
            None => self.items.push(item),
        }
    }
}

impl<'t> Builder<'t> {
    /// The items of a `code_section` node after its head, and the class annotations among them.
    pub(crate) fn code<T: Code>(
        &mut self,
        nodes: impl std::iter::Iterator<Item = Node<'t>>,
    ) -> (Vec<T>, Vec<(Span, Modification)>) {
        let mut section = Section { items: Vec::new(), open: Vec::new() };
        let mut annotations = Vec::new();
        let mut end = self.text.len();
        for node in nodes {
            end = node.as_span().end();
            if self.gave_up {
                break;
            }
            let place = T::PLACE;
            match node.as_rule() {
                Rule::class_annotation => annotations.extend(self.class_annotation(node)),
                Rule::bad_code => {
                    if let Some(kind) = self.bad_fragment(&node, place).block {
                        let head = self.span(&node);
                        section.open.push(Block {
                            kind,
                            head,
                            broken: true,
                            branches: vec![(None, Vec::new())],
                            iterators: Vec::new(),
                            else_if: false,
                        });
                    }
                }
                Rule::stray_semi => self.stray_semi(&node),
                Rule::block_end => self.block_end(node, &mut section),
                Rule::elseif_head | Rule::else_head | Rule::elsewhen_head => self.branch(node, &mut section),
                Rule::if_head | Rule::for_head | Rule::when_head | Rule::while_head => {
                    self.recovered = false;
                    let block = self.block_head(node);
                    self.check_depth(section.open.len(), block.head);
                    if block.kind == BlockKind::If
                        && let Some(outer) = section.open.last_mut()
                    {
                        outer.else_if |= self.text[..block.head.start as usize].trim_end().ends_with("else");
                    }
                    section.open.push(block);
                }
                _ => {
                    if let Some(item) = self.code_item(node) {
                        section.push(item);
                    }
                }
            }
        }
        while let Some(block) = section.open.pop() {
            let silent = block.broken || self.gave_up || self.lost;
            if !silent && !self.bare_end(end, block.kind, block.head) {
                self.not_closed(&block);
            }
            self.finish(block, None, None, &mut section);
        }
        (section.items, annotations)
    }

    fn block_head<T>(&mut self, node: Node<'t>) -> Block<T> {
        let head = self.span(&node);
        let kind = match node.as_rule() {
            Rule::if_head => BlockKind::If,
            Rule::for_head => BlockKind::For,
            Rule::when_head => BlockKind::When,
            _ => BlockKind::While,
        };
        let mut condition = None;
        let mut iterators = Vec::new();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::expression => condition = Some(self.expression(part)),
                Rule::for_clause => iterators = self.iterators(part),
                _ => {}
            }
        }
        Block { kind, head, broken: false, branches: vec![(condition, Vec::new())], iterators, else_if: false }
    }

    /// `elseif`, `else` or `elsewhen`.
    fn branch<T>(&mut self, node: Node<'t>, section: &mut Section<T>) {
        let span = self.span(&node);
        let rule = node.as_rule();
        let (word, kind) = match rule {
            Rule::elseif_head => ("elseif", BlockKind::If),
            Rule::else_head => ("else", BlockKind::If),
            _ => ("elsewhen", BlockKind::When),
        };
        let condition = self.expressions(node).pop();
        match section.open.last_mut() {
            Some(block) if block.kind == kind => {
                let after_else = kind == BlockKind::If
                    && block.branches.len() > 1
                    && block.branches.last().is_some_and(|(c, _)| c.is_none());
                let (head, broken) = (block.head, block.broken);
                block.branches.push((condition, Vec::new()));
                if after_else && !broken {
                    let diagnostic = self.error(span, format!("`{word}` cannot follow `else`"));
                    *diagnostic = diagnostic.clone().with(head, "in this `if`");
                }
            }
            Some(block) if block.broken => {}
            Some(block) => {
                let (head, other) = (block.head, block.kind.word());
                let message =
                    format!("`{word}` does not belong to `{other}`; an `end {other};` may be missing before it");
                let diagnostic = self.error(span, message);
                *diagnostic = diagnostic.clone().with(head, format!("this `{other}` is still open"));
            }
            None => {
                self.error(span, format!("`{word}` without `{}` before it", kind.word()));
            }
        }
    }

    fn block_end<T: Code>(&mut self, node: Node<'t>, section: &mut Section<T>) {
        self.recovered = false;
        self.check_terminator(&node, "`end`");
        let span = self.trimmed_span(&node);
        let mut kind = None;
        let mut description = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::block_word => kind = BlockKind::of(part.as_str()),
                Rule::description => description = self.description(part),
                _ => {}
            }
        }
        let Some(kind) = kind else { return };
        let Some(position) = section.open.iter().rposition(|block| block.kind == kind) else {
            return self.stray_end(kind, span, section);
        };
        while section.open.len() > position + 1 {
            let Some(inner) = section.open.pop() else { break };
            if !inner.broken {
                self.not_closed(&inner);
            }
            self.finish(inner, None, None, section);
        }
        if let Some(block) = section.open.pop() {
            self.finish(block, description, Some(span), section);
        }
    }

    /// `end if` where no `if` is open: closes what is open instead.
    fn stray_end<T: Code>(&mut self, kind: BlockKind, span: Span, section: &mut Section<T>) {
        match section.open.pop() {
            Some(block) => {
                let word = block.kind.word();
                if !block.broken {
                    let message = format!("expected `end {word}`, found `end {}`", kind.word());
                    let diagnostic = self.error(span, message);
                    *diagnostic = diagnostic.clone().with(block.head, format!("this `{word}` is open"));
                }
                self.finish(block, None, Some(span), section);
            }
            None => {
                self.error(span, format!("`end {0}` closes nothing: no `{0}` is open here", kind.word()));
            }
        }
    }

    fn not_closed<T>(&mut self, block: &Block<T>) {
        let word = block.kind.word();
        let diagnostic = self.error(block.head, format!("this `{word}` is not closed: `end {word};` is missing"));
        if block.else_if {
            diagnostic
                .notes
                .push("`else if` begins a new `if` with an `end if;` of its own; write `elseif` as one word".into());
        }
    }

    fn finish<T: Code>(
        &mut self,
        block: Block<T>,
        description: Option<Name>,
        end: Option<Span>,
        section: &mut Section<T>,
    ) {
        if block.broken {
            return;
        }
        let span = end.map_or(block.head, |end| block.head.to(end));
        if let Some(item) = T::block(self, block, description, span) {
            section.push(item);
        }
    }

    fn code_item<T: Code>(&mut self, node: Node<'t>) -> Option<T> {
        let span = self.trimmed_span(&node);
        let rule = node.as_rule();
        let silent = std::mem::take(&mut self.recovered);
        let whole = node.clone();
        let mut expressions: Vec<Expr> = Vec::new();
        let mut sign = None;
        let mut description = None;
        let mut ends = Vec::new();
        let mut word = "";
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::expression => expressions.push(self.expression(part)),
                Rule::equals => sign = Some(("=", self.span(&part))),
                Rule::assign => sign = Some((":=", self.span(&part))),
                Rule::description => description = self.description(part),
                Rule::annotation => drop(self.annotation(part)),
                Rule::jump_word => word = part.as_str(),
                Rule::connect => {
                    let references = part.into_inner().filter(|n| n.as_rule() == Rule::reference);
                    ends = references.map(|n| self.reference(n)).collect();
                }
                _ => {}
            }
        }
        let complete = rule != Rule::simple_code || expressions.len() != 1 || says_something(&expressions[0].kind);
        let unfinished =
            if complete { self.check_terminator(&whole, T::PLACE.item()) } else { self.is_unfinished(&whole) };
        match rule {
            Rule::connect_item => T::connect(self, ends.try_into().ok()?, description, span),
            Rule::jump => T::jump(self, word, span),
            _ => {
                let mut expressions = expressions.into_iter();
                let left = expressions.next()?;
                let right = sign.zip(expressions.next()).map(|((word, at), value)| (word, at, value));
                T::simple(self, Simple { left, right, unfinished, silent }, description, span)
            }
        }
    }
}

/// Whether an expression alone is a complete item, rightly (a call) or by a clear mistake (`a == b`).
fn says_something(kind: &ExprKind) -> bool {
    matches!(kind, ExprKind::Call(..) | ExprKind::Binary(BinaryOp::Equal, ..))
}
