//! `hyd simulate --profile-page`: where the time of a run went, by part, component, variable, equation and relation, as one page.
//!
//! The page is put together as the report of a search is: data in front of a script that draws.  What the run counted comes
//! from its profile; what the equations cost is counted in operations of their text, and their share of the time that evaluations took is
//! divided by that.

use hyd_compiler::{Files, FlatModel};
use hyd_run::RunSummary;
use serde_json::{Value, json};

use crate::page::framed;

const STYLE: &str = include_str!("profile_page/page.css");
const SCRIPT: &str = include_str!("profile_page/page.js");
/// Blocks of equations that the page lists by themselves.
const MOST_BLOCKS: usize = 400;

/// The page as HTML; none if the run was not to be counted.
pub fn page(summary: &RunSummary, files: &Files, flat: Option<&FlatModel>) -> Option<String> {
    let profile = summary.profile.as_ref()?;
    let counters = serde_json::to_value(summary.counters).unwrap_or_default();
    let data = json!({
        "model": summary.model,
        "solver": summary.solver,
        "status": summary.status,
        "message": summary.message,
        "start": summary.start,
        "time": summary.time,
        "tolerance": summary.tolerance,
        "states": summary.states,
        "unknowns": summary.unknowns,
        "counters": counters,
        "profile": profile,
        "code": flat.map_or_else(|| json!([]), |flat| code(files, flat)),
    });
    Some(framed("Profile of a run", STYLE, SCRIPT, &data))
}

/// What the equations cost, the dearest first, the rest added up.
fn code(files: &Files, flat: &FlatModel) -> Value {
    let costs = hyd_compiler::costs(flat);
    let mut listed: Vec<Value> = costs.iter().take(MOST_BLOCKS).map(|cost| {
        let place = format!("{}:{}", files.name(cost.span.file), files.location(cost.span).line);
        json!({"text": cost.text, "component": cost.component, "place": place, "equations": cost.equations, "operations": cost.operations})
    }).collect();
    let rest = costs.get(MOST_BLOCKS..).unwrap_or_default();
    if !rest.is_empty() {
        let sum = |of: fn(&hyd_compiler::Cost) -> u64| rest.iter().map(of).sum::<u64>();
        let text = format!("{} more places of the text", rest.len());
        listed.push(json!({"text": text, "component": null, "place": "", "equations": sum(|own| own.equations),
            "operations": sum(|own| own.operations)}));
    }
    listed.into()
}
