//! One expression by itself, as it is given beside a model.

use hyd_source::{Code, Diagnostic, FileId, Outcome, Span};

use crate::build::Builder;
use crate::build_file::merge;
use crate::grammar::{self, Rule, expected_words};
use crate::recovery::{expected_list, quoted};
use crate::scan;
use crate::tree::Expr;

/// A part of a text on one line: single blanks, no comments.
pub fn one_line(text: &str) -> String {
    let file = hyd_source::Files::new().add("part", "");
    scan::scan(file, text).text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Parses a text that is one expression; none, with messages, if it is not.  Never panics.
pub fn parse_expression(file: FileId, text: &str) -> Outcome<Option<Expr>> {
    let mut scan = scan::scan(file, text);
    if scan.fatal {
        return Outcome { value: None, diagnostics: scan.diagnostics };
    }
    let clean = std::mem::take(&mut scan.text);
    let mut builder = Builder::new(file, &clean);
    let value = match grammar::run(Rule::lone_expression, &clean) {
        Ok(nodes) => {
            let whole = nodes.flat_map(grammar::Node::into_inner).next();
            whole.map(|expression| builder.expression(expression))
        }
        Err(failure) => {
            let found = builder.token(failure.at);
            let at = Span::new(file, failure.at, failure.at + found.len());
            let diagnostic = match expected_list(&expected_words(&failure.expected)) {
                _ if failure.gave_up => {
                    Diagnostic::error(Code::Limit, "the expression is too large or too deeply nested")
                }
                Some(list) => Diagnostic::error(Code::Syntax, format!("expected {list}, found {}", quoted(found))),
                None => Diagnostic::error(Code::Syntax, format!("unexpected {}", quoted(found))),
            };
            builder.diagnostics.push(diagnostic.at(at, ""));
            None
        }
    };
    let diagnostics = merge(scan, &clean, builder.diagnostics);
    Outcome { value: value.filter(|_| diagnostics.is_empty()), diagnostics }
}
