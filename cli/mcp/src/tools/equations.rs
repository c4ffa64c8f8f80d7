//! `equations`: a stage of the translation as text, a piece at a time.

use hyd_compiler::{Goal, Stage};
use hyd_run::Failure;
use hyd_verbs::Listener;
use serde_json::json;

use super::{CLASS, FILE, LIBRARIES, Tool, model_file, translated, with_messages};
use crate::answer::Answer;
use crate::arguments::{Kind, optional};
use crate::calls::Call;

/// Lines of an answer if nobody says otherwise.
const LINES: usize = 300;
/// Bytes of an answer.
const LONGEST: usize = 20_000;
const STAGES: [&str; 5] = ["flat", "system", "reduced", "sorted", "jacobian"];

pub(super) const TOOL: Tool = Tool {
    name: "equations",
    title: "Show equations",
    says: "Shows what became of a model's equations, as text: `flat` without components, `system` after elimination of aliases, `reduced` after index \
           reduction, `sorted` in the order of computation with its loops, `jacobian` the pattern of derivatives. Long texts come in pieces: the answer \
           says how many lines there are and where the next piece begins.",
    arguments: &[
        FILE,
        CLASS,
        optional("stage", Kind::Word(&STAGES), "which stage of the translation [default: sorted]"),
        optional("from_line", Kind::Count, "first line that is shown [default: 1]"),
        optional("lines", Kind::Count, "most lines that are shown [default: 300]"),
        LIBRARIES,
    ],
    is_reading: true,
    run: equations,
};

fn equations(call: &Call<'_>) -> Result<Answer, String> {
    let file = model_file(call.workplace, &call.given)?;
    let word = call.given.text("stage").unwrap_or("sorted");
    let (stage, goal) = match word {
        "flat" => (Stage::Flat, Goal::Flat),
        "system" => (Stage::System, Goal::Check),
        "reduced" => (Stage::Reduced, Goal::Check),
        "jacobian" => (Stage::Jacobian, Goal::Check),
        _ => (Stage::Sorted, Goal::Check),
    };
    let compilation = match translated(call, &file, (call.given.text("class"), &[]), (goal, &[]))? {
        Ok(compilation) => compilation,
        Err(answer) => return Ok(answer),
    };
    call.kept.diagnostics(&compilation.files, &compilation.diagnostics);
    if compilation.has_errors() {
        return Ok(Answer::failed(&Failure::Reported, &call.kept));
    }
    let Some(whole) = compilation.print(stage) else {
        let failure = Failure::Fault("the translation did not come to this stage".to_string());
        return Ok(Answer::failed(&failure, &call.kept));
    };
    let (first, most) = (call.given.count("from_line").unwrap_or(1), call.given.count("lines").unwrap_or(LINES));
    let piece = Piece::of(&whole, first, most);
    let text = piece.text.clone() + &piece.note.as_ref().map(|note| format!("({note})\n")).unwrap_or_default();
    let data = json!({"model": compilation.model_name.as_deref(), "stage": word, "text": piece.text, "from_line": first, "lines": piece.lines,
        "lines_in_all": piece.all, "note": piece.note});
    Ok(Answer::done(text, with_messages(call, data)))
}

/// Some lines of a text.
struct Piece {
    text: String,
    lines: usize,
    all: usize,
    /// What was left out.
    note: Option<String>,
}

impl Piece {
    /// Lines from the `first`, counted from 1, as many as fit.
    fn of(whole: &str, first: usize, most: usize) -> Self {
        let all = whole.lines().count();
        let mut piece = Self { text: String::new(), lines: 0, all, note: None };
        for line in whole.lines().skip(first - 1).take(most) {
            if piece.text.len() + line.len() >= LONGEST {
                // A line that is too long for any answer is cut; otherwise the next answer begins with it.
                if piece.lines == 0 {
                    piece.text = format!("{} ...\n", &line[..line.floor_char_boundary(LONGEST)]);
                    piece.lines = 1;
                }
                break;
            }
            piece.text.push_str(line);
            piece.text.push('\n');
            piece.lines += 1;
        }
        let next = first + piece.lines;
        if first > all {
            piece.note = Some(format!("the text has {all} lines"));
        } else if next <= all {
            piece.note = Some(format!("{} of {all} lines are shown; the next are from_line {next}", piece.lines));
        } else if first > 1 {
            piece.note = Some(format!("these are the last of {all} lines"));
        }
        piece
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_say_where_the_next_begins() {
        let whole = "a\nb\nc\n";
        let piece = Piece::of(whole, 1, 2);
        assert_eq!((piece.text.as_str(), piece.lines, piece.all), ("a\nb\n", 2, 3));
        assert_eq!(piece.note.as_deref(), Some("2 of 3 lines are shown; the next are from_line 3"));
        assert_eq!(Piece::of(whole, 3, 2).note.as_deref(), Some("these are the last of 3 lines"));
        assert_eq!(Piece::of(whole, 9, 2).note.as_deref(), Some("the text has 3 lines"));
        assert_eq!(Piece::of(whole, 1, 9).note, None);
        let long = "é".repeat(LONGEST);
        let piece = Piece::of(&long, 1, 9);
        assert!(piece.lines == 1 && piece.text.len() <= LONGEST + 5 && piece.note.is_none());
    }
}
