//! A slip of the pen that a message names is mended by a change.

use serde_json::{Value, json};

use super::client::address;
use super::desk::Desk;

const TEXT: &str = "package Lib
  type Mode = enumeration(slow, fast);
  function twice
    input Real u;
    output Real y = 2*u;
  end twice;
  package Inner
    constant Real gravity = 9.81;
    model Part
      parameter Real size = 1;
    end Part;
  end Inner;
  model M
    HERE
  end M;
end Lib;
";

#[test]
fn what_is_meant_can_be_written() {
    let mut desk = Desk::open("slips", TEXT);
    for (line, wrong, right) in [
        ("Real x = twixe(time);", "twixe", "twice"),
        ("Real x = Inner.gravitty;", "gravitty", "gravity"),
        ("parameter Mode mode = Mode.fasst;", "fasst", "fast"),
        ("Real x(each strat = 1) = 2;", "strat", "start"),
        ("Inner.Part p(final sizze = 1);", "sizze", "size"),
        ("Iner.Part p;", "Iner", "Inner"),
        ("import Lib.Inner.{gravitti}; Real x = 1;", "gravitti", "gravity"),
        ("Real x(unit = \"Nm\") = 1;", "Nm", "N.m"),
        ("Real x(displayUnit = \"kg.metre/s\", unit = \"kg.m/s\") = 1;", "kg.metre/s", "kg.m/s"),
        ("equation Connections.brnch(time, time);", "brnch", "branch"),
    ] {
        desk.write(&TEXT.replace("HERE", line));
        let range = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } });
        let document = json!({ "uri": address(&desk.file) });
        let params =
            json!({ "textDocument": document, "range": range, "context": { "diagnostics": [], "only": ["quickfix"] } });
        let actions = desk.client.ask("textDocument/codeAction", params).expect("an answer");
        let title = format!("Write `{right}` for `{wrong}`");
        let found = actions.as_array().and_then(|all| all.iter().find(|action| action["title"] == json!(title)));
        let action = found.unwrap_or_else(|| panic!("{line}: {title} in {actions}"));
        let edits = action["edit"]["changes"].as_object().and_then(|all| all.values().next()).unwrap_or(&Value::Null);
        assert_eq!(desk.piece(&edits[0]["range"]), wrong, "{line}");
        assert_eq!(edits[0]["newText"], json!(right), "{line}");
    }
}

/// A message leads to the page on its code.
#[test]
fn codes_lead_to_pages() {
    let mut desk = Desk::open("pages", &TEXT.replace("HERE", "Real x = twixe(time);"));
    let range = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } });
    let document = json!({ "uri": address(&desk.file) });
    let params = json!({ "textDocument": document, "range": range, "context": { "diagnostics": [] } });
    let actions = desk.client.ask("textDocument/codeAction", params).expect("an answer");
    let said = &actions[0]["diagnostics"][0];
    let code = said["code"].as_str().expect("a code");
    let href = said["codeDescription"]["href"].as_str().expect("an address");
    assert!(href.ends_with(&format!("/built-in/codes/{code}.md")), "{href}");
    let page =
        std::fs::read_to_string(desk.file.with_file_name("built-in").join(format!("codes/{code}.md"))).expect("a page");
    assert!(page.starts_with(&format!("# {code}: ")) && page.lines().count() == 3, "{page}");
}
