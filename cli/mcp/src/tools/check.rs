//! `check`: what is wrong with a model, or how many equations and unknowns it has.

use hyd_compiler::Goal;
use hyd_verbs::Listener;
use hyd_verbs::check::{counts, own_equations};
use serde_json::{Map, Value, json};

use super::{CLASS, FILE, LIBRARIES, Tool, model_file, translated};
use crate::answer::Answer;
use crate::arguments::{Argument, Kind, optional};
use crate::calls::Call;

const PARAMETERS: Argument = optional(
    "parameters",
    Kind::Values,
    "parameters by full name with values in the units of the model, such as {\"m\": 2}",
);

pub(super) const TOOL: Tool = Tool {
    name: "check",
    title: "Check a model",
    says: "Checks a model: syntax, names, types, units, balance of equations and unknowns, structure. Gives messages with code, file, line, column, \
           marked places, notes and proposals (edits that heal), and the counts of variables and equations. Nothing is run and nothing is written.",
    arguments: &[FILE, CLASS, PARAMETERS, LIBRARIES],
    is_reading: true,
    run: check,
};

fn check(call: &Call<'_>) -> Result<Answer, String> {
    let file = model_file(call.workplace, &call.given)?;
    let set = call.given.values("parameters");
    let mut compilation = match translated(call, &file, (call.given.text("class"), &set), (Goal::Check, &[]))? {
        Ok(compilation) => compilation,
        Err(answer) => return Ok(answer),
    };
    let ends = compilation.forgive_open_ends();
    call.kept.diagnostics(&compilation.files, &compilation.diagnostics);
    let (messages, count) = call.kept.messages();
    let is_clean = !compilation.has_errors();
    let mut data = json!({"status": if is_clean { "done" } else { "rejected" }, "model": compilation.model_name.as_deref(),
        "messages": messages, "messages_in_all": count});
    let mut text = call.kept.text();
    if is_clean {
        let counts = counts(&compilation);
        text.push_str(&format!("{}\n", compilation.model_name.as_deref().unwrap_or("(no model)")));
        counts.iter().for_each(|(what, count)| text.push_str(&format!("  {what:<28}{count:>9}\n")));
        let named = counts.into_iter().map(|(what, count)| (what.replace(' ', "_"), count.into()));
        data["counts"] = Value::Object(named.collect::<Map<_, _>>());
    }
    if !ends.is_empty() {
        let own = own_equations(&compilation);
        let names = ends.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        text.push_str(&format!(
            "  balanced as a component: its own equations are {own}, and {names} are to be connected where it is used\n"
        ));
        data["component"] =
            json!({"own_equations": own, "open": ends.iter().map(|name| &**name).collect::<Vec<&str>>()});
    }
    Ok(Answer::done(text, data))
}
