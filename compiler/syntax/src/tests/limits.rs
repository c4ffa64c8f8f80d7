//! Texts that try to exhaust the stack or the time end in a message.  Test threads have 2 MB of stack, the smallest of all
//! users of the parser.

use hyd_source::{Code, FileId};

use crate::parse;

fn codes(text: &str) -> Vec<Code> {
    parse(FileId(0), text).diagnostics.iter().map(|d| d.code).collect()
}

fn model(expression: &str) -> String {
    format!("model M\n  Real x = {expression};\nend M;\n")
}

#[test]
fn a_hundred_thousand_brackets_give_a_message() {
    for (open, close) in [("(", ")"), ("[", "]"), ("{", "}"), ("f(", ")"), ("a[", "]"), ("(-", ")"), ("f(x=", ")")] {
        let text = model(&format!("{}1{}", open.repeat(100_000), close.repeat(100_000)));
        assert_eq!(codes(&text), [Code::Limit], "{open}");
        assert_eq!(codes(&model(&open.repeat(100_000))), [Code::Limit], "{open} unclosed");
    }
}

#[test]
fn nesting_up_to_the_limit_is_read() {
    for (open, close) in [("(", ")"), ("{", "}"), ("f(", ")"), ("a[", "]"), ("[", "]"), ("f(x=", ")"), ("(1+", ")")] {
        let text = model(&format!("{}1{}", open.repeat(190), close.repeat(190)));
        assert_eq!(codes(&text), [], "{open}");
    }
    let ifs = format!("{}1{}", "if a then ".repeat(190), " else 2".repeat(190));
    assert_eq!(codes(&model(&ifs)), []);
    for chain in [" + 1", " - 1", " * 1", " and b", " .* 1", " - a*b*c", " / 2", " + a^2/3"] {
        assert_eq!(codes(&model(&format!("1{}", chain.repeat(20_000)))), [], "{chain}");
    }
}

#[test]
fn long_chains_and_deep_ifs_give_a_message() {
    assert_eq!(codes(&model(&format!("1{}", " + 1".repeat(100_001)))), [Code::Limit]);
    assert_eq!(codes(&model(&format!("{}1", "not ".repeat(100_000)))), [Code::Limit]);
    assert_eq!(codes(&model(&format!("{}1", "if a then 1 else ".repeat(100_000)))), [Code::Limit]);
    let nested = format!("{}1{}", "(1 + ".repeat(150), " + 1)".repeat(150));
    assert_eq!(codes(&model(&nested)), []);
}

#[test]
fn deep_classes_and_blocks_do_not_use_the_stack() {
    let depth = 20_000;
    let blocks =
        format!("model M\nequation\n{}x = 1;\n{}end M;", "for i in 1:2 loop ".repeat(3), "end for; ".repeat(3));
    assert_eq!(codes(&blocks), []);
    let classes = "model M ".repeat(depth);
    assert!(codes(&classes).contains(&Code::Limit));
    let loops = format!("model M equation {}", "for i loop ".repeat(depth));
    assert!(codes(&loops).contains(&Code::Limit));
}

#[test]
fn broken_text_of_every_kind_ends() {
    for piece in [
        "[;",
        "[);",
        "end ",
        "end x; ",
        "model ",
        "equation if x then ",
        "\u{fc}",
        "a = [1;2; ",
        "\"",
        "(;",
        "x = ",
        "'",
        "/*",
        "@",
    ] {
        let outcome = parse(FileId(0), &piece.repeat(5_000));
        assert!(!outcome.diagnostics.is_empty(), "{piece}");
    }
}

/// Every prefix of a file, as an editor sees it while the file is typed.
#[test]
fn prefixes_of_a_file_never_panic() {
    let text = include_str!("data/all_constructs.mo");
    for end in (0..text.len()).step_by(7) {
        let outcome = parse(FileId(0), &text[..end]);
        for label in outcome.diagnostics.iter().flat_map(|d| &d.labels) {
            assert!(label.span.end as usize <= end, "span beyond the text");
        }
    }
}
