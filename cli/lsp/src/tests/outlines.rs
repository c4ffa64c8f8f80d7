//! What can be folded, and names of the workspace.

use serde_json::{Value, json};

use super::desk::Desk;

const TEXT: &str = "package Lib
  model Sub
    Real x;
  initial equation
    x = 1;

  equation
    // falls
    der(x) = -x;
    when initial() then
      reinit(x, 2);
    end when;
  end Sub;
  function f
    input Real u;
    output Real y;
  protected
    Real z;
  algorithm
    z := u;
    y := z;
  end f;
end Lib;
";

#[test]
fn sections_are_folded() {
    let mut desk = Desk::open("folding", TEXT);
    let folds = desk.ask_all("foldingRange");
    let lines = |fold: &Value| (fold["startLine"].as_u64().expect("a line"), fold["endLine"].as_u64().expect("a line"));
    let folds: Vec<_> = folds.as_array().expect("a list").iter().map(lines).collect();
    assert_eq!(folds, [(0, 21), (1, 11), (3, 5), (6, 11), (9, 10), (13, 20), (18, 20)]);
}

#[test]
fn a_whole_name_finds_its_class() {
    let mut desk = Desk::open("symbols", TEXT);
    let mut found = |query: &str| {
        let found = desk.client.ask("workspace/symbol", json!({ "query": query })).expect("an answer");
        let names = found.as_array().expect("a list").iter().map(|one| one["name"].as_str().unwrap_or_default());
        names.map(str::to_string).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(found("Lib.Sub"), "Sub x");
    assert_eq!(found("lib.sub.x"), "x");
    assert_eq!(found("sub"), "Sub");
    assert_eq!(found("Other.Sub"), "");
}
