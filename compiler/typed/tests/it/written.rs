//! Typed expressions say what is written: the text of each is that of its syntax.

use std::path::{Path, PathBuf};

use hyd_syntax::print_expr;
use hyd_syntax::tree::{self as text, ClassBody};
use hyd_typed::{Equation, EquationKind, Expr};

use crate::{equations, with_tree};

/// Files of language cases below a folder.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "hyd" || e == "mo") {
            found.push(path);
        }
    }
}

/// Compares an expression with its syntax; 1, or 0 where an argument is given by name, which stands in its place when it is typed.
fn same(typed: &Expr, text: &text::Expr) -> usize {
    let text = print_expr(text);
    // `array(...)` is another way to write braces, and is printed as these.
    if ["homotopy(actual", "solverMethod = ", "array("].iter().any(|other| text.contains(other)) {
        return 0;
    }
    assert_eq!(print_expr(&typed.written()), text);
    1
}

/// Compares equations with their syntax; how many expressions were compared.
fn compare(typed: &[Equation], texts: &[text::Equation]) -> usize {
    let mut count = 0;
    assert_eq!(typed.len(), texts.len());
    for (typed, text) in typed.iter().zip(texts) {
        match (&typed.kind, &text.kind) {
            (EquationKind::Equal(a, b), text::EquationKind::Equal(left, right)) => {
                for (typed, text) in [(a, left), (b, right)] {
                    count += same(typed, text);
                }
            }
            (EquationKind::For(_, inner), text::EquationKind::For(_, texts)) => count += compare(inner, texts),
            (EquationKind::If(branches), text::EquationKind::If(texts)) => {
                for ((_, inner), (_, texts)) in branches.iter().zip(texts) {
                    count += compare(inner, texts);
                }
            }
            (EquationKind::When(branches), text::EquationKind::When(texts)) => {
                for ((condition, inner), (text, texts)) in branches.iter().zip(texts) {
                    count += same(condition, text) + compare(inner, texts);
                }
            }
            _ => {}
        }
    }
    count
}

/// All equations of all language cases that stand in one file.
#[test]
fn the_text_of_a_typed_expression_is_the_one_it_was_made_from() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/language");
    let mut all = Vec::new();
    files(&root, &mut all);
    all.sort();
    let (mut models, mut count) = (0, 0);
    for path in &all {
        let Ok(text) = std::fs::read_to_string(path) else { continue };
        let compared = with_tree(&text, |scopes| {
            // References into arrays made in parts are written as what they mean.
            let shape = scopes.instances[scopes.instances.tree().root].shape.clone().filter(|_| !scopes.has_parts())?;
            let mut texts = Vec::new();
            for frame in 0..shape.frames.len() as u32 {
                let def = shape.def(&scopes.table, frame).clone();
                if let ClassBody::Long { equations, .. } = &def.body {
                    texts.extend(equations.iter().flat_map(|section| &section.equations).cloned());
                }
            }
            Some(compare(&equations(scopes), &texts))
        });
        if let Some(Some(compared)) = compared {
            models += 1;
            count += compared;
        }
    }
    assert!(models > 400 && count > 1500, "only {count} expressions in {models} models");
}
