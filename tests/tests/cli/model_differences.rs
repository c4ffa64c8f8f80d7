//! `hyd diff`: what changed in a model, and nothing where only its text did.

use crate::process::{Scratch, run};

const BEFORE: &str = "within Shop;
model Cart \"rolls\"
  import Hyd.Translational.Components.*;
  parameter Real m(unit = \"kg\") = 2;
  Mass body(m = m, s(start = 0.1));
  HousingSpring spring(k = 100);
  HousingDamper damper(d = 1);
equation
  connect(body.flange, spring.flange);
  connect(damper.flange, body.flange);
  annotation(experiment(StopTime = 1));
end Cart;
";

/// The same model, written otherwise.
const WRITTEN_OTHERWISE: &str = "within Shop;
// a remark
model Cart
  \"rolls\"
  import Hyd.Translational.Components.*;
  HousingSpring spring( k=100 ) annotation(Placement(transformation(extent = {{0, 0}, {1, 1}})));
  HousingDamper damper(d = 1); Mass body(m=m, s(start=0.1));
  parameter Real m(unit = \"kg\") = 2;
equation
  connect(body.flange, damper.flange);
  connect(spring.flange, body.flange) annotation(Line(points = {{0, 0}, {1, 1}}));
  annotation(Icon(coordinateSystem(extent = {{0, 0}, {1, 1}})), experiment(StopTime = 1));
end Cart;
";

#[test]
fn layout_order_and_graphics_do_not_count() {
    let folder = Scratch::new();
    folder.write("a.mo", BEFORE);
    folder.write("b.mo", WRITTEN_OTHERWISE);
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), "the models are the same\n"), "{}", outcome.stderr);
}

/// The page shows the changes that the text lists, with what a browser could take for tags written out, and is never written over a model.
#[test]
fn a_page_shows_both_sides() {
    let folder = Scratch::new();
    folder.write("a.mo", "model M\n  Real x = if time < 1 then 2 else 3;\nend M;\n");
    folder.write("b.mo", "model M\n  Real x = if time < 1 then 2 else 4;\n  Real y = 5;\nend M;\n");
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo", "--html", "page.html"]);
    assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    for shown in [
        "a.mo → b.mo",
        "3 changes in the models.",
        "<h2>M</h2>",
        "<tr><th scope=\"row\">value<small>x</small></th><td><del><code>if time &lt; 1 then 2 else 3</code></del></td>",
        "<ins><code>if time &lt; 1 then 2 else 4</code></ins>",
        "<tr><th scope=\"row\">component<small>y</small></th><td></td><td><ins><code>Real</code></ins></td></tr>",
    ] {
        assert!(page.contains(shown), "{shown} is not in {page}");
    }
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo", "--html", "a.mo"]);
    assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
    let outcome = run(folder.path(), &["diff", "a.mo", "a.mo", "--html", "same.html"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), "the models are the same\n"));
    assert!(std::fs::read_to_string(folder.path().join("same.html")).unwrap().contains("The models are the same."));
}

#[test]
fn what_changed_is_named() {
    let folder = Scratch::new();
    folder.write("a.mo", BEFORE);
    let after = BEFORE
        .replace("k = 100", "k = 120")
        .replace("  HousingDamper damper(d = 1);\n", "  parameter Real c = 3;\n")
        .replace("connect(damper.flange, body.flange)", "c*body.v = 0")
        .replace("StopTime = 1", "StopTime = 2")
        .replace("parameter Real m", "constant Real m");
    folder.write("b.mo", &after);
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo"]);
    assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
    let expected = "Shop.Cart
  + parameter Real c
  - HousingDamper damper
  ~ m: parameter Real -> constant Real
  + c = 3
  - damper.d = 1
  ~ spring.k: 100 -> 120
  + c*body.v = 0
  - connect(body.flange, damper.flange)
  ~ annotation experiment.StopTime: 1 -> 2
";
    assert_eq!(outcome.stdout, expected);
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let spring = json["changes"].as_array().unwrap().iter().find(|own| own["name"] == "spring.k").unwrap();
    assert_eq!((&spring["kind"], &spring["before"], &spring["after"]), (&"value".into(), &"100".into(), &"120".into()));
}

/// What stands inside of a redeclaration, or of the class that constrains one, counts like all else.
#[test]
fn redeclarations_are_looked_into() {
    let folder = Scratch::new();
    let text = "model A\n  replaceable Box box constrainedby Base(size = 1);\n  Rack rack(redeclare model Item = Thing(mass = 2));\nend A;\n";
    folder.write("a.mo", text);
    folder.write("b.mo", text.replace("size = 1", "size = 3").replace("mass = 2", "mass = 4"));
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo"]);
    let expected = "A\n  ~ box (constrainedby).size: 1 -> 3\n  ~ rack.Item: redeclare model Item = Thing(mass = 2) -> redeclare model Item = Thing(mass = 4)\n";
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(1), expected), "{}", outcome.stderr);
}

/// A variant is compared with what it was made from.
#[test]
fn another_name_is_one_change() {
    let folder = Scratch::new();
    folder.write("cart.mo", BEFORE);
    folder.write("wagon.mo", BEFORE.replace("Cart", "Wagon").replace("d = 1", "d = 2"));
    let outcome = run(folder.path(), &["diff", "cart.mo", "wagon.mo"]);
    assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
    assert_eq!(outcome.stdout, "Shop.Cart\n  ~ name: Shop.Cart -> Shop.Wagon\n  ~ damper.d: 1 -> 2\n");
}

/// `1` and `1.0` are one number; the digits of large integers all count.
#[test]
fn numbers_are_what_they_are() {
    let folder = Scratch::new();
    let text = "model A\n  Real x(start = 1) = 2*time;\nequation\n  der(y) = -1e5*x;\nend A;\n";
    folder.write("a.mo", text);
    folder.write("b.mo", text.replace("= 1)", "= 1.0)").replace("2*", "2.0*").replace("1e5", "100000"));
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), "the models are the same\n"), "{}", outcome.stderr);
    // What changed is shown as it is written.
    folder.write("b.mo", text.replace("1e5", "20e6"));
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo"]);
    assert_eq!(outcome.stdout, "A\n  - der(y) = - 1e5*x\n  + der(y) = - 20e6*x\n");
    folder.write("b.mo", text.replace("2*", "9007199254740993*"));
    folder.write("c.mo", text.replace("2*", "9007199254740992*"));
    assert_eq!(run(folder.path(), &["diff", "b.mo", "c.mo"]).code, Some(1));
}

/// What a class that is new says, as of the one that a search has written.
const NEW: &str = "cart.mo
Shop.Cart
  + model
  + description: rolls
  + import Hyd.Translational.Components: *
  + Mass body
  + HousingDamper damper
  + parameter Real m
  + HousingSpring spring
  + body.m = m
  + body.s.start = 0.1
  + damper.d = 1
  + m = 3
  + m.unit = \"kg\"
  + spring.k = 100
  + connect(body.flange, spring.flange)
  + connect(body.flange, damper.flange)
  + annotation experiment.StopTime: 1
";

#[test]
fn git_and_broken_texts() {
    let folder = Scratch::new();
    folder.write("a.mo", BEFORE);
    folder.write("b.mo", BEFORE.replace("= 2;", "= 3;"));
    // As git calls an external difference; a file that is new has nothing before it.
    let outcome = run(folder.path(), &["diff", "cart.mo", "a.mo", "1234567", "100644", "b.mo", "89abcde", "100644"]);
    assert_eq!(
        (outcome.code, outcome.stdout.as_str()),
        (Some(0), "cart.mo\nShop.Cart\n  ~ m: 2 -> 3\n"),
        "{}",
        outcome.stderr
    );
    let outcome = run(folder.path(), &["diff", "cart.mo", "/dev/null", ".", ".", "b.mo", "89abcde", "100644"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), NEW), "{}", outcome.stderr);
    // A file that was renamed: then come its new path and what git says of that.
    let said = "similarity index 98%\nrename from cart.mo\nrename to wagon.mo\n";
    let call = ["diff", "cart.mo", "a.mo", "1234567", "100644", "b.mo", "89abcde", "100644", "wagon.mo", said];
    let outcome = run(folder.path(), &call);
    let expected = (Some(0), "wagon.mo\nShop.Cart\n  ~ m: 2 -> 3\n");
    assert_eq!((outcome.code, outcome.stdout.as_str()), expected, "{}", outcome.stderr);
    folder.write("c.mo", "model C\n  Real x\nend C;\n");
    let outcome = run(folder.path(), &["diff", "a.mo", "c.mo"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("`c.mo`, line"), "{}", outcome.stderr);
    // Git goes on with other files.
    let outcome = run(folder.path(), &["diff", "cart.mo", "a.mo", "1234567", "100644", "c.mo", "89abcde", "100644"]);
    assert!(
        outcome.code == Some(0) && outcome.stdout.starts_with("cart.mo\n  not compared: `c.mo`, line"),
        "{}",
        outcome.stdout
    );
    let outcome = run(folder.path(), &["diff", "a.mo", "b.mo", "b.mo"]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("two files are compared"), "{}", outcome.stderr);
}
