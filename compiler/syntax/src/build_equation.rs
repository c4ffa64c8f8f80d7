//! What the items of a section mean in equation and in algorithm sections.
//!
//! `left = right` is an equation and `left := right` a statement; the wrong one of the two, and constructs of the other kind
//! of section, are reported with a hint and read as meant where that is clear.

use hyd_source::{Edit, Proposal, Span};

use crate::build::Builder;
use crate::build_code::{Block, BlockKind, Code, Simple};
use crate::recovery::Place;
use crate::tree::{
    Arguments, BinaryOp, ComponentRef, Equation, EquationKind, Expr, ExprKind, Name, Statement, StatementKind,
};

impl Code for Equation {
    const PLACE: Place = Place::Equation;

    fn simple(builder: &mut Builder<'_>, simple: Simple, description: Option<Name>, span: Span) -> Option<Self> {
        let kind = match (simple.right, simple.left.kind) {
            (Some((sign, at, right)), left) => {
                if sign == ":=" {
                    let said = builder.error(at, "`:=` cannot stand in an equation");
                    said.notes.push(
                        "equations are written with `=`; assignments with `:=` belong into an `algorithm` section"
                            .into(),
                    );
                    said.proposals.push(Proposal {
                        message: "write `=` for `:=`".into(),
                        edits: vec![Edit { span: at, text: "=".into() }],
                    });
                }
                EquationKind::Equal(Expr { kind: left, span: simple.left.span }, right)
            }
            (None, ExprKind::Call(function, arguments)) => EquationKind::Call(function, arguments),
            (None, ExprKind::Binary(BinaryOp::Equal, left, right)) => {
                let at = Span { start: left.span.end, end: right.span.start, ..span };
                let at = builder.operator_span(at);
                builder
                    .error(at, "`==` compares two values; an equation is written with `=`")
                    .notes
                    .push("write `a = b`".into());
                EquationKind::Equal(*left, *right)
            }
            (None, _) => {
                if !simple.silent {
                    builder.no_equals(simple.left.span, simple.unfinished, "=");
                }
                return None;
            }
        };
        Some(Equation { kind, description, span })
    }

    fn connect(_: &mut Builder<'_>, [a, b]: [ComponentRef; 2], description: Option<Name>, span: Span) -> Option<Self> {
        Some(Equation { kind: EquationKind::Connect(a, b), description, span })
    }

    fn jump(builder: &mut Builder<'_>, word: &str, span: Span) -> Option<Self> {
        builder.error(span, format!("`{word}` can stand only in an `algorithm` section"));
        None
    }

    fn block(builder: &mut Builder<'_>, block: Block<Self>, description: Option<Name>, span: Span) -> Option<Self> {
        let kind = match block.kind {
            BlockKind::If => EquationKind::If(block.branches),
            BlockKind::When => EquationKind::When(conditions(block.branches)),
            BlockKind::For => EquationKind::For(block.iterators, body(block.branches)),
            BlockKind::While => {
                builder.error(block.head, "`while` can stand only in an `algorithm` section");
                return None;
            }
        };
        Some(Equation { kind, description, span })
    }
}

impl Code for Statement {
    const PLACE: Place = Place::Statement;

    fn simple(builder: &mut Builder<'_>, simple: Simple, _: Option<Name>, span: Span) -> Option<Self> {
        let kind = match (simple.right, simple.left.kind) {
            (Some((sign, at, right)), left) => {
                if sign == "=" {
                    let said = builder.error(at, "`=` cannot stand in an algorithm");
                    said.notes
                        .push("assignments are written with `:=`; equations belong into an `equation` section".into());
                    said.proposals.push(Proposal {
                        message: "write `:=` for `=`".into(),
                        edits: vec![Edit { span: at, text: ":=".into() }],
                    });
                }
                assignment(builder, left, simple.left.span, right)?
            }
            (None, ExprKind::Call(function, arguments)) => StatementKind::Call(function, arguments),
            (None, ExprKind::Binary(BinaryOp::Equal, left, right)) => {
                let at = builder.operator_span(Span { start: left.span.end, end: right.span.start, ..span });
                builder
                    .error(at, "`==` compares two values; an assignment is written with `:=`")
                    .notes
                    .push("write `a := b`".into());
                assignment(builder, left.kind, left.span, *right)?
            }
            (None, _) => {
                if !simple.silent {
                    builder.no_equals(simple.left.span, simple.unfinished, ":=");
                }
                return None;
            }
        };
        Some(Statement { kind, span })
    }

    fn connect(builder: &mut Builder<'_>, _: [ComponentRef; 2], _: Option<Name>, span: Span) -> Option<Self> {
        builder.error(span, "`connect` can stand only in an `equation` section");
        None
    }

    fn jump(_: &mut Builder<'_>, word: &str, span: Span) -> Option<Self> {
        let kind = if word == "break" { StatementKind::Break } else { StatementKind::Return };
        Some(Statement { kind, span })
    }

    fn block(_: &mut Builder<'_>, block: Block<Self>, _: Option<Name>, span: Span) -> Option<Self> {
        let kind = match block.kind {
            BlockKind::If => StatementKind::If(block.branches),
            BlockKind::When => StatementKind::When(conditions(block.branches)),
            BlockKind::For => StatementKind::For(block.iterators, body(block.branches)),
            BlockKind::While => {
                let (condition, body) = block.branches.into_iter().next()?;
                StatementKind::While(condition?, body)
            }
        };
        Some(Statement { kind, span })
    }
}

fn conditions<T>(branches: Vec<(Option<Expr>, Vec<T>)>) -> Vec<(Expr, Vec<T>)> {
    branches.into_iter().filter_map(|(condition, body)| Some((condition?, body))).collect()
}

fn body<T>(branches: Vec<(Option<Expr>, Vec<T>)>) -> Vec<T> {
    branches.into_iter().next().map(|(_, body)| body).unwrap_or_default()
}

/// `left := right` for a reference or a list of references on the left.
fn assignment(builder: &mut Builder<'_>, left: ExprKind, at: Span, right: Expr) -> Option<StatementKind> {
    match left {
        ExprKind::Ref(target) => Some(StatementKind::Assign(target, right)),
        ExprKind::Tuple(slots) => {
            let mut targets = Vec::with_capacity(slots.len());
            for slot in slots {
                match slot.map(|value| (value.kind, value.span)) {
                    None => targets.push(None),
                    Some((ExprKind::Ref(target), _)) => targets.push(Some(target)),
                    Some((_, span)) => {
                        builder.error(span, "only names can stand in the list of results before `:=`");
                        return None;
                    }
                }
            }
            let ExprKind::Call(function, arguments @ Arguments::List { .. }) = right.kind else {
                builder.error(right.span, "a list of results can only be assigned from a function call");
                return None;
            };
            Some(StatementKind::AssignTuple(targets, function, arguments))
        }
        _ => {
            builder.error(at, "only a name, such as `x` or `a.b[1]`, can be assigned to");
            None
        }
    }
}
