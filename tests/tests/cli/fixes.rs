//! `hyd check --fix`: what is proposed is shown and written, and nothing else is touched.  `hyd simulate --profile`: who limits the steps.

use crate::process::{Scratch, run};

const SLIP: &str = "model Fall\n  Real h(start = 1, fixed = true);\n  Real speed(start = 0, fixed = true);\nequation\n  \
                    der(h) = sped;\n  der(speed) = -9.81;\nend Fall;\n";

#[test]
fn a_slip_is_shown_and_corrected() {
    let folder = Scratch::new();
    folder.write("fall.hyd", SLIP);
    let outcome = run(folder.path(), &["check", "fall.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let shown =
        "write `speed` for `sped`\n  fall.hyd:5\n  - der(h) = sped;\n  + der(h) = speed;\nfall.hyd: 1 change made\n";
    assert!(outcome.stdout.starts_with(shown), "{}", outcome.stdout);
    assert_eq!(folder.read("fall.hyd"), SLIP.replace("sped;", "speed;"));
    assert_eq!(folder.names(), ["fall.hyd"]);
}

#[test]
fn a_ground_is_put_in() {
    let folder = Scratch::new();
    let text = "model Lamp\n  Hyd.Electrical.Sources.ConstantVoltage source(V = 12);\n  Hyd.Electrical.Components.Resistor lamp(R = 6);\n\
                equation\n  connect(source.p, lamp.p);\n  connect(source.n, lamp.n);\nend Lamp;\n";
    folder.write("lamp.hyd", text);
    let outcome = run(folder.path(), &["check", "lamp.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let declared = "model Lamp\n  Hyd.Electrical.Components.Ground ground;\n  Hyd.Electrical.Sources";
    let healed = text.replace("model Lamp\n  Hyd.Electrical.Sources", declared);
    let healed = healed.replace("equation\n", "equation\n  connect(ground.p, source.n);\n");
    assert_eq!(folder.read("lamp.hyd"), healed);
    // Ohm's law.
    let lamp = run(folder.path(), &["simulate", "lamp.hyd", "--variables", "^lamp.i$", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&lamp.stdout).unwrap();
    assert!((summary["final"]["lamp.i"].as_f64().unwrap() - 2.0).abs() < 1e-9, "{}", lamp.stdout);
}

/// Modifiers of an array that all lack `each` are healed together, though one end of the array is open, which no one could say before.
#[test]
fn each_is_put_in_for_several() {
    let folder = Scratch::new();
    let text = "model Section\n  parameter Hyd.Units.Resistance R = 1;\n  parameter Hyd.Units.Capacitance C = 1;\n  Hyd.Electrical.Interfaces.Pin p;\n  \
                Hyd.Electrical.Interfaces.Pin n;\n  Hyd.Units.Voltage u(start = 0, fixed = true);\nequation\n  p.v - n.v = R*p.i;\n  u = n.v;\n  \
                C*der(u) = p.i + n.i;\nend Section;\nmodel Line\n  Section part[3](R = 2, C = 0.1);\n  Hyd.Electrical.Sources.ConstantVoltage source(V = 5);\n  \
                Hyd.Electrical.Components.Ground ground;\nequation\n  connect(source.n, ground.p);\n  connect(source.p, part[1].p);\n  \
                connect(part[1].n, part[2].p);\n  connect(part[2].n, part[3].p);\nend Line;\n";
    folder.write("line.hyd", text);
    let outcome = run(folder.path(), &["check", "line.hyd", "--model", "Line", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert_eq!(folder.read("line.hyd"), text.replace("(R = 2, C", "(each R = 2, each C"), "{}", outcome.stdout);
    assert!(outcome.stderr.contains("W0301"), "{}", outcome.stderr);
}

/// The only two open ends of a kind are connected, once; of three nobody knows which.
#[test]
fn a_forgotten_connection_is_put_in() {
    let folder = Scratch::new();
    let text = "model Lamps\n  Hyd.Electrical.Sources.ConstantVoltage source(V = 12);\n  Hyd.Electrical.Components.Resistor one(R = 2);\n  \
                Hyd.Electrical.Components.Resistor two(R = 4);\n  Hyd.Electrical.Components.Ground ground;\nequation\n  \
                connect(source.p, one.p);\n  connect(two.n, source.n);\n  connect(source.n, ground.p);\nend Lamps;\n";
    folder.write("lamps.hyd", text);
    let outcome = run(folder.path(), &["check", "lamps.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert_eq!(folder.read("lamps.hyd"), text.replace("equation\n", "equation\n  connect(one.n, two.p);\n"));
    // Ohm's law.
    let lamp = run(folder.path(), &["simulate", "lamps.hyd", "--variables", "^two.i$", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&lamp.stdout).unwrap();
    assert!((summary["final"]["two.i"].as_f64().unwrap() - 2.0).abs() < 1e-9, "{}", lamp.stdout);
    let third = "  Hyd.Electrical.Components.Resistor three(R = 4);\n  Hyd.Electrical.Components.Ground ground;\n";
    let text = text.replace("  Hyd.Electrical.Components.Ground ground;\n", third);
    let text = text.replace("  connect(two.n", "  connect(three.n, source.n);\n  connect(two.n");
    folder.write("lamps.hyd", &text);
    let outcome = run(folder.path(), &["check", "lamps.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert_eq!(folder.read("lamps.hyd"), text);
}

/// What is meant may differ between instances of a class: both are proposed.
#[test]
fn names_are_proposed_for_each_instance() {
    let folder = Scratch::new();
    let text = "model S1\n  Real foo = 1;\nend S1;\nmodel S2\n  Real fob = 1;\nend S2;\nmodel W\n  replaceable model T = S1;\n  T t;\n  \
                Real y = t.fo;\nend W;\nmodel A\n  W w1;\n  W w2(redeclare model T = S2);\nend A;\n";
    folder.write("a.hyd", text);
    let outcome = run(folder.path(), &["check", "a.hyd"]);
    for meant in ["did you mean `foo`", "did you mean `fob`"] {
        assert!(outcome.stderr.contains(meant), "{}", outcome.stderr);
    }
}

/// Ends that do not fit, equal ends of two loads, and one that the model hands on are not joined.
#[test]
fn ends_that_are_not_meant_for_each_other_stay_open() {
    let folder = Scratch::new();
    let pins = "connector P1\n  Real v;\n  flow Real i;\nend P1;\nconnector P2\n  Real v[2];\n  flow Real i[2];\nend P2;\n\
                connector P3\n  Real v(unit = \"m/s\");\n  flow Real i(unit = \"N\");\nend P3;\n\
                model M1\n  P1 p;\nequation\n  p.v = 3 - p.i;\nend M1;\nmodel M2\n  P2 p;\nequation\n  p.v = 2*p.i;\nend M2;\n\
                model M3\n  P3 p;\nequation\n  p.v = 2*p.i;\nend M3;\n";
    let loads = "  Hyd.Electrical.Sources.ConstantVoltage source(V = 12);\n  Hyd.Electrical.Components.Resistor one(R = 2);\n  \
                 Hyd.Electrical.Components.Resistor two(R = 4);\n  Hyd.Electrical.Components.Ground ground;\n  Real x = time;\nequation\n  \
                 connect(source.p, one.p);\n  connect(source.p, two.p);\n  connect(source.n, ground.p);\n";
    let plain = |parts: &str| format!("{pins}model Open\n{parts}  Real x;\nequation\n  x = time;\nend Open;\n");
    for text in [
        plain("  M1 a;\n  M2 b;\n"),
        plain("  M1 a;\n  M3 b;\n"),
        plain("  M1 a;\n  M1 b[1];\n"),
        plain("  P1 p;\n  M1 a;\n  M1 b;\n"),
        plain("  parameter Boolean h = false;\n  M1 a;\n  M1 b if h;\n  M1 c;\n"),
        format!("model Open\n{loads}end Open;\n"),
    ] {
        folder.write("open.hyd", &text);
        let outcome = run(folder.path(), &["check", "open.hyd", "--fix"]);
        assert!(outcome.stderr.contains("W0301"), "{text}{}", outcome.stderr);
        assert_eq!(folder.read("open.hyd"), text);
    }
}

/// Where an operator or a keyword may be meant, nothing is written.
#[test]
fn a_missing_semicolon_is_written() {
    let folder = Scratch::new();
    let text = "model Swing\n  Real x(start = 1, fixed = true)\n  Real v(start = 0, fixed = true); // rate\nequation\n  der(x) = v // here\n  der(v) = -x;\nend Swing;\n";
    folder.write("swing.hyd", text);
    let outcome = run(folder.path(), &["check", "swing.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let healed = text.replace("true)\n", "true);\n").replace("= v // here", "= v; // here");
    assert_eq!(folder.read("swing.hyd"), healed);
    for text in ["model M\n  Real x = 2 time;\nend M;\n", "model M\n  parametr Real k = 2;\nend M;\n"] {
        folder.write("open.hyd", text);
        assert_eq!(run(folder.path(), &["check", "open.hyd", "--fix"]).code, Some(1), "{text}");
        assert_eq!(folder.read("open.hyd"), text);
    }
}

#[test]
fn where_nothing_is_proposed_nothing_is_written() {
    let folder = Scratch::new();
    for text in [
        "model Open\n  Real x;\n  Real y;\nequation\n  x + y = 1;\nend Open;\n",
        // No model of the library has this name and this element: a package, a partial model, another connector.
        "model Open\n  Real x;\nequation\n  x = constants.g;\nend Open;\n",
        "model Open\n  Hyd.Electrical.Components.Resistor r(R = 1);\nequation\n  connect(r.p, onePort.p);\nend Open;\n",
        "model Open\n  Hyd.Electrical.Components.Resistor r(R = 1);\nequation\n  connect(r.p, ground.port_a);\nend Open;\n",
        // An `inner` of another name may be meant for somebody else.
        "model Part\n  outer Real level;\n  Real y = level;\nend Part;\nmodel Open\n  inner Real height = 1;\n  Part part;\nend Open;\n",
    ] {
        folder.write("open.hyd", text);
        let outcome = run(folder.path(), &["check", "open.hyd", "--fix"]);
        assert_eq!(outcome.code, Some(1), "{text}");
        assert!(outcome.stdout.contains("no message proposes a change"), "{}", outcome.stdout);
        assert_eq!(folder.read("open.hyd"), text);
    }
}

/// Nothing that the translation says is wrong: only the run and the model's own assertion tell.
#[test]
fn changes_are_tried_where_only_the_run_fails() {
    let folder = Scratch::new();
    let text = "model Boiler\n  parameter Real m(unit = \"kg\") = 50;\n  \
                parameter Real c(unit = \"J/(kg.K)\", nominal = 1e3) = 4.18;\n  parameter Real P(unit = \"W\") = 2000;\n  \
                Real T(unit = \"K\", start = 288, fixed = true);\nequation\n  m*c*der(T) = P;\n  \
                assert(T < 373, \"it boils\");\n  annotation(experiment(StopTime = 3600));\nend Boiler;\n";
    folder.write("boiler.hyd", text);
    let said = run(folder.path(), &["simulate", "boiler.hyd", "--message-format", "json"]);
    let message: serde_json::Value = serde_json::from_str(said.stderr.lines().next().unwrap()).unwrap();
    let at = text.find("4.18").unwrap();
    let edit = &message["proposals"][0]["edits"][0];
    assert_eq!((edit["start"].as_u64(), edit["text"].as_str()), (Some(at as u64), Some("4180")), "{message}");
    assert!(message["message"].as_str().unwrap().contains("it runs after this change"), "{message}");
    let outcome = run(folder.path(), &["check", "boiler.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert_eq!(folder.read("boiler.hyd"), text.replace("4.18", "4180"));
    // A shorter run does not come to the assertion, so there is nothing to heal.
    folder.write("boiler.hyd", text);
    let short = run(folder.path(), &["check", "boiler.hyd", "--fix", "--stop", "1"]);
    assert!(short.code == Some(0) && folder.read("boiler.hyd") == text, "{}", short.stdout);
    assert_eq!(run(folder.path(), &["check", "boiler.hyd", "--stop", "1"]).code, Some(2));
}

/// Of two wires that short a source either can be cut: both are shown, none is cut.
/// A limit of a component has another name inside it than in the whole model; a model that is ended where it begins has not run.
#[test]
fn no_limit_is_moved_and_no_end_brought_forward() {
    let folder = Scratch::new();
    for text in [
        "model Winding\n  parameter Real T_max(unit = \"K\") = 350;\n  parameter Real C(unit = \"J/K\") = 10;\n  \
         Real T(unit = \"K\", start = 300, fixed = true);\nequation\n  C*der(T) = 20 - 0.1*(T - 293.15);\n  \
         assert(T < T_max, \"the winding is too hot\");\nend Winding;\nmodel M\n  Winding w;\n  annotation(experiment(StopTime = 100));\nend M;\n",
        "model M\n  Real x(start = 2, fixed = true);\n  Boolean hot(start = false);\nequation\n  der(x) = 1;\n  hot = x > 3;\n  \
         when hot then\n    terminate(\"it is hot\");\n  end when;\n  assert(x < 2.5, \"too hot\");\n  annotation(experiment(StopTime = 10));\nend M;\n",
        // That a sign brings the run through says nothing.
        "model M\n  parameter Real a = 2;\n  Real q;\n  Real y;\n  Real x(start = 1, fixed = true);\nequation\n  q = 3*time;\n  \
         y = log(a - q);\n  der(x) = y;\nend M;\n",
    ] {
        folder.write("m.hyd", text);
        run(folder.path(), &["check", "m.hyd", "--fix"]);
        assert_eq!(folder.read("m.hyd"), text);
    }
}

/// Changes after which a model runs and that need not be meant are shown, and the text stays.
#[test]
fn what_may_not_be_meant_is_shown_and_not_written() {
    let folder = Scratch::new();
    for (text, shown) in [
        // An inflow would be shut off with the outflow.
        (
            "model M\n  Real h(start = 1, fixed = true);\nequation\n  der(h) = 0.3*sin(time) - 0.5*sqrt(h);\nend M;\n",
            "if h > 0 then",
        ),
        // What the ball rests on moves away later.
        (
            "model M\n  Real h(start = 1, fixed = true);\n  Real v(start = 0, fixed = true);\n  Real plate = if time < 4 then 0 else 4 - time;\n\
             equation\n  der(h) = v;\n  der(v) = -9.81;\n  when h < plate then\n    reinit(v, -0.6*pre(v));\n  end when;\nend M;\n",
            "let `v` come to rest",
        ),
        // One fixed start is too many; the number is to be given.
        (
            "model M\n  parameter Real m(start = 1) \"to be given\";\n  Real a(start = 2, fixed = true);\n  Real b(start = 5, fixed = true);\n\
             equation\n  der(a) = -a;\n  b = m*a;\nend M;\n",
            "",
        ),
        // Another sign lets the temperature run away.
        (
            "model M\n  parameter Real G(unit = \"W/K\") = 6;\n  parameter Real C(unit = \"J/K\") = 1e3;\n  \
             Real T(unit = \"K\", start = 300, fixed = true);\nequation\n  C*der(T) = -G*(T - 200);\n  assert(T > 290, \"too cold\");\n\
             annotation(experiment(StopTime = 100));\nend M;\n",
            "change the sign of `-G*(T - 200)`",
        ),
        // A guard would let the level fall below zero: the pump goes on.
        (
            "model M\n  Real h(start = 1, fixed = true);\n  Real v;\nequation\n  v = sqrt(2*9.81*h);\n  0.5*der(h) = -0.001*v - 0.01;\n\
             annotation(experiment(StopTime = 100));\nend M;\n",
            "(`h` then falls below zero)",
        ),
        // A root that is negative from the start says that a number is wrong: 80 for 80e5.
        (
            "model M\n  parameter Real p0 = 80;\n  parameter Real p_tank = 1e5;\n  Real q = 1e-6*sqrt(p - p_tank);\n  \
             Real p(start = p0, fixed = true);\nequation\n  der(p) = -1e6*q;\nend M;\n",
            "sign(p - p_tank)*sqrt(abs(p - p_tank))",
        ),
        // More is taken out than comes in: no level stays.
        (
            "model M\n  parameter Real crest = 1.2;\n  Real h(start = 1.4);\n  Real over;\ninitial equation\n  der(h) = 0;\n\
             equation\n  over = if h > crest then (h - crest)^1.5 else 0;\n  120*der(h) = 0.05 - over - 0.08;\nend M;\n",
            "write `h = 1.4` for `der(h) = 0` (there may be no steady state)",
        ),
    ] {
        folder.write("m.hyd", text);
        let outcome = run(folder.path(), &["check", "m.hyd", "--fix", "--stop", "100"]);
        let changed = folder.read("m.hyd");
        assert!(outcome.stdout.contains(shown), "{shown}: {}{}", outcome.stdout, outcome.stderr);
        assert!(!changed.contains("m(start = 1, fixed = false)"), "{changed}");
        assert!(shown.is_empty() || changed == text, "{shown}: {changed}");
    }
}

/// Of a model without equations to begin with nothing could be said on its start; a note on that does not keep it from being healed.
#[test]
fn a_copied_line_is_written_for_the_variables_that_lack_one() {
    let folder = Scratch::new();
    let text = "model M\n  Real s_left(start = 1, fixed = true);\n  Real s_right(start = 2, fixed = true);\n  Real v_left(start = 0, fixed = true);\n  \
                Real v_right;\nequation\n  der(s_left) = v_left;\n  der(s_left) = v_left;\n  der(v_left) = s_right - s_left;\n  \
                der(v_right) = s_left - s_right;\nend M;\n";
    folder.write("m.hyd", text);
    let outcome = run(folder.path(), &["check", "m.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}{}", outcome.stdout, outcome.stderr);
    assert_eq!(
        folder.read("m.hyd"),
        text.replacen("  der(s_left) = v_left;\n  der(s_left)", "  der(s_left) = v_left;\n  der(s_right)", 1).replacen(
            "der(s_right) = v_left",
            "der(s_right) = v_right",
            1
        )
    );
    let at = "  x[1] = time;\n  x[1] = time;\n";
    let text = format!("model M\n  Real x[2];\nequation\n{at}end M;\n");
    folder.write("m.hyd", &text);
    let outcome = run(folder.path(), &["check", "m.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}{}", outcome.stdout, outcome.stderr);
    assert_eq!(folder.read("m.hyd"), text.replace(at, "  x[1] = time;\n  x[2] = time;\n"));
}

/// A recipe finds its places whatever words stand in comments, and before an initial equation.
#[test]
fn a_bounce_comes_to_rest_whatever_stands_around_it() {
    let folder = Scratch::new();
    let text = "model M\n  Real h;\n  Real v(start = 0, fixed = true);\ninitial equation\n  h = 1;\nequation\n  \
                // the equation of motion\n  der(h) = v;\n  der(v) = -9.81;\n  when h <= 0 then\n    reinit(v, -0.6*pre(v));\n  end when;\nend M;\n";
    folder.write("m.hyd", text);
    let outcome = run(folder.path(), &["check", "m.hyd", "--fix", "--stop", "10"]);
    assert_eq!(outcome.code, Some(0), "{}{}", outcome.stdout, outcome.stderr);
    let changed = folder.read("m.hyd");
    assert!(changed.contains("Boolean rests(start = false, fixed = true);\ninitial equation"), "{changed}");
    assert!(changed.contains("// the equation of motion"), "{changed}");
    let ran = run(folder.path(), &["simulate", "m.hyd", "--stop", "10", "--json"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
}

/// An equation too many in a base class is found in it.
#[test]
fn what_a_class_extends_belongs_to_it() {
    let folder = Scratch::new();
    let text = "model Base\n  Hyd.Electrical.Components.Resistor r(R = 5);\n  Hyd.Electrical.Sources.ConstantVoltage b(V = 5);\n  \
                Hyd.Electrical.Components.Ground g;\nequation\n  connect(b.p, r.p);\n  connect(r.n, b.n);\n  connect(b.n, g.p);\n  \
                r.n.v = 0;\nend Base;\nmodel Derived\n  extends Base(b(V = 4));\nend Derived;\n";
    folder.write("m.hyd", text);
    let outcome = run(folder.path(), &["check", "m.hyd", "--model", "Derived", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}{}", outcome.stdout, outcome.stderr);
    assert_eq!(folder.read("m.hyd"), text.replace("  r.n.v = 0;\n", ""));
}

/// A `when` that holds from the start is named where an assertion fails; not one that acts at the start, nor one that asks what changes at events.
#[test]
fn conditions_that_hold_from_the_start_are_named() {
    let folder = Scratch::new();
    for (when, is_named) in [
        ("when h > 0.8 then\n    n = pre(n) + 1;\n  end when;", true),
        ("when {initial(), h > 0.8} then\n    n = pre(n) + 1;\n  end when;", false),
        (
            "when time > 0.1 then\n    k = pre(k) + 1;\n  end when;\n  when k <> pre(k) then\n    n = pre(n) + 1;\n  end when;",
            false,
        ),
        ("when h < 0.95 then\n    n = pre(n) + 1;\n  end when;", false),
    ] {
        let k = if when.contains("pre(k)") { "  Integer k(start = 0, fixed = true);\n" } else { "" };
        let text = format!(
            "model M\n  Real h(start = 0.9, fixed = true);\n  Integer n(start = 0, fixed = true);\n{k}equation\n  der(h) = 0.1;\n  {when}\n  \
             assert(h < 1, \"over\");\nend M;\n"
        );
        folder.write("m.hyd", text);
        let outcome = run(folder.path(), &["simulate", "m.hyd", "--stop", "2"]);
        assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
        assert_eq!(outcome.stderr.contains("holds from the start"), is_named, "{when}: {}", outcome.stderr);
    }
}

/// The mark of UTF-8 and the ends of lines of other systems stay.
#[test]
fn a_file_of_windows_stays_one() {
    let folder = Scratch::new();
    let text = format!("\u{feff}{}", SLIP.replace('\n', "\r\n"));
    folder.write("fall.hyd", &text);
    let outcome = run(folder.path(), &["check", "fall.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert_eq!(folder.read("fall.hyd"), text.replace("sped;", "speed;"));
}

#[test]
fn where_several_changes_heal_none_is_made() {
    let folder = Scratch::new();
    let text = "model Short\n  Hyd.Electrical.Sources.ConstantVoltage supply(V = 12);\n  \
                Hyd.Electrical.Components.Resistor lamp(R = 6);\n  Hyd.Electrical.Components.Ground ground;\nequation\n  \
                connect(supply.p, lamp.p);\n  connect(lamp.n, supply.n);\n  connect(supply.n, ground.p);\n  \
                connect(supply.p, ground.p);\nend Short;\n";
    folder.write("short.hyd", text);
    let outcome = run(folder.path(), &["check", "short.hyd", "--fix"]);
    assert_eq!(outcome.code, Some(1), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("several of the") && folder.read("short.hyd") == text, "{}", outcome.stdout);
    assert!(outcome.stdout.contains("remove `connect(supply.p, ground.p)`"), "{}", outcome.stdout);
}

#[test]
fn a_run_that_ends_before_anything_happens_says_so() {
    let folder = Scratch::new();
    let text = |end: &str| {
        format!(
            "model Late\n  Real x(start = 0, fixed = true);\nequation\n  der(x) = if time < 5 then 0 else 1;\n{end}end Late;\n"
        )
    };
    folder.write("late.hyd", text(""));
    let outcome = run(folder.path(), &["simulate", "late.hyd"]);
    assert!(outcome.stderr.contains("the first event is at 5 s"), "{}{}", outcome.stdout, outcome.stderr);
    assert_eq!(run(folder.path(), &["simulate", "late.hyd", "--stop", "1"]).stderr, "");
    folder.write("late.hyd", text("  annotation(experiment(StopTime = 2));\n"));
    assert_eq!(run(folder.path(), &["simulate", "late.hyd"]).stderr, "");
}

#[test]
fn proposals_are_told_to_programs() {
    let folder = Scratch::new();
    folder.write("fall.hyd", SLIP);
    let outcome = run(folder.path(), &["check", "fall.hyd", "--message-format", "json"]);
    let message: serde_json::Value = serde_json::from_str(outcome.stderr.lines().next().unwrap()).unwrap();
    let edit = &message["proposals"][0]["edits"][0];
    let at = SLIP.find("sped;").unwrap();
    assert_eq!((edit["start"].as_u64(), edit["end"].as_u64()), (Some(at as u64), Some(at as u64 + 4)));
    assert_eq!((edit["text"].as_str(), edit["line"].as_u64()), (Some("speed"), Some(5)));
}

/// What `--variables` leaves out is not evaluated at every row: the same numbers, and what fails there is found later.
#[test]
fn runs_with_few_variables_write_the_same_numbers() {
    let folder = Scratch::new();
    let text = "model Many\n  Real x(start = 0, fixed = true);\n  Real v(start = 1, fixed = true);\n  Real y = -2*x;\n  Real w = y;\n  Real u = exp(x) + v;\n  \
                Real f[60];\n  Real root = if noEvent(time < 0.5 or time > 0.501) then 1 else log(-1 - x*x);\n  Integer n = integer(3*x);\nequation\n  der(x) = v;\n  \
                der(v) = -40*x;\n  for i in 1:60 loop\n    f[i] = sin(x*i) + u;\n  end for;\nend Many;\n";
    let whole = text.replace("if noEvent(time < 0.5 or time > 0.501) then 1 else log(-1 - x*x)", "1 + x");
    let columns = |name: &str, wanted: &[&str]| -> Vec<Vec<String>> {
        let table = folder.read(name);
        let mut rows = table.lines().map(|row| row.split(',').map(str::to_string).collect::<Vec<_>>());
        let head = rows.next().unwrap();
        let places: Vec<usize> =
            wanted.iter().map(|name| head.iter().position(|own| own.trim_matches('"') == *name).unwrap()).collect();
        rows.map(|row| places.iter().map(|&k| row[k].clone()).collect()).collect()
    };
    let names = ["time", "x", "w", "der(v)", "f[7]", "n"];
    for more in [&[][..], &["--backend", "vm"], &["--sensitivity", "x"]] {
        folder.write("many.hyd", &whole);
        let simulate = |variables: &str, result: &str| {
            let mut arguments =
                vec!["simulate", "many.hyd", "--intervals", "4000", "--variables", variables, "--result", result];
            arguments.extend(more);
            let outcome = run(folder.path(), &arguments);
            assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        };
        let mut wanted = names.to_vec();
        if more.contains(&"--sensitivity") {
            wanted.extend(["d(w)/d(x)", "d(f[7])/d(x)"]);
        }
        simulate(".*", "all.csv");
        simulate(r"^(x|w|der\(v\)|f\[7\]|n|d\((w|f\[7\])\)/d\(x\))$", "few.csv");
        assert_eq!(columns("all.csv", &wanted), columns("few.csv", &wanted));
    }
    folder.write("many.hyd", text);
    let fails = |variables: &str| {
        run(folder.path(), &["simulate", "many.hyd", "--intervals", "4000", "--variables", variables]).code
    };
    assert_eq!((fails("^(x|root)$"), fails("^(x|w)$")), (Some(3), Some(0)));
}

/// A fast and a slow decay: once the fast one is over, the slow one limits the steps; the switch is one event.
#[test]
fn the_profile_names_who_limits_the_steps() {
    let folder = Scratch::new();
    let text = "model Two\n  Real slow(start = 1, fixed = true);\n  Real clock(start = 0, fixed = true);\nequation\n  \
                der(slow) = if clock > 0.5 then slow else -slow;\n  der(clock) = 1;\nend Two;\n";
    folder.write("two.hyd", text);
    let outcome = run(folder.path(), &["simulate", "two.hyd", "--profile", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let profile = &summary["profile"];
    // The clock is a straight line, which every formula follows without error.
    assert_eq!(profile["limited_by"][0]["name"], "slow");
    // A tenth of the largest value, which is that at the start.
    assert_eq!((&profile["limited_by"][0]["size"], profile["limited_by"][0].get("size_unit")), (&0.1.into(), None));
    let counted =
        |name: &str| profile[name].as_array().unwrap().iter().map(|own| own["count"].as_u64().unwrap()).sum::<u64>();
    assert_eq!(counted("limited_by"), summary["counters"]["steps"].as_u64().unwrap());
    assert_eq!(profile["events_by"][0]["name"], "clock > 0.5");
    assert_eq!(counted("events_by"), 1);
    let text = run(folder.path(), &["simulate", "two.hyd", "--profile"]).stdout;
    assert!(text.contains("steps limited by the error of") && text.contains("two.hyd:5"), "{text}");
    assert!(!run(folder.path(), &["simulate", "two.hyd"]).stdout.contains("profile"));
    // As a page; its data stand in front of the script that draws them.
    let page = run(folder.path(), &["simulate", "two.hyd", "--profile-page", "p.html"]);
    assert_eq!(page.code, Some(0), "{}", page.stderr);
    let page = folder.read("p.html");
    let data = page.split_once("const DATA = ").and_then(|(_, rest)| rest.split_once(";</script>")).unwrap().0;
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["profile"]["limited_by"][0]["name"], "slow");
    assert!(data["code"].as_array().unwrap().iter().any(|own| own["place"] == "two.hyd:5"), "{}", data["code"]);
    // It takes the place of nothing else that the run writes.
    let both = run(folder.path(), &["simulate", "two.hyd", "--result", "r.csv", "--profile-page", "r.csv"]);
    assert_eq!((both.code, folder.path().join("r.csv").exists()), (Some(2), false), "{}", both.stderr);
}
