//! `explain`: the paragraph behind an error code.

use hyd_compiler::{Code, did_you_mean};
use serde_json::{Value, json};

use super::Tool;
use crate::answer::Answer;
use crate::arguments::{Kind, required};
use crate::calls::Call;

pub(super) const TOOL: Tool = Tool {
    name: "explain",
    title: "Explain an error code",
    says: "Explains a code of a message, such as E0401: what is wrong, why it matters, how it is healed. `all` lists all codes with their titles.",
    arguments: &[required("code", Kind::Text, "the code, such as E0401, or all")],
    is_reading: true,
    run: explain,
};

fn explain(call: &Call<'_>) -> Result<Answer, String> {
    let wanted = call.given.needed("code").trim();
    if wanted.eq_ignore_ascii_case("all") {
        let text = Code::ALL.iter().map(|code| format!("{code}  {}\n", code.title())).collect();
        let codes: Vec<Value> = Code::ALL.iter().map(|code| json!(format!("{code}: {}", code.title()))).collect();
        return Ok(Answer::done(text, json!({"codes": codes})));
    }
    let Some(code) = Code::ALL.iter().find(|code| code.number().eq_ignore_ascii_case(wanted)) else {
        let hint = did_you_mean(&wanted.to_uppercase(), Code::ALL.iter().map(|code| code.number()));
        let hint = hint.unwrap_or_else(|| "`all` lists the codes".to_string());
        return Err(format!("`code`: there is no code `{wanted}`; {hint}"));
    };
    let text = format!("{code}: {}\n\n{}\n", code.title(), code.explanation());
    Ok(Answer::done(text, json!({"code": code.number(), "title": code.title(), "explanation": code.explanation()})))
}
