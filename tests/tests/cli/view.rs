//! `hyd view`: what a page holds, whom the server answers, runs with other parameters, and mistakes.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use hyd_tests::models::root;
use serde_json::{Value, json};

use crate::foreign_units::{MASS, build};
use crate::process::{Scratch, command, run, wait};

const DECAY: &str = "model Decay \"fades\"\n  parameter Real k(unit = \"1/s\", min = 0, max = 5) = 1 \"rate\";\n  parameter Integer n = 2;\n  \
                     Real x(start = 1, fixed = true, unit = \"m\") \"what fades\";\n  Real y[n];\nequation\n  der(x) = -k*x;\n  for i in 1:n loop\n    \
                     y[i] = i*x;\n  end for;\n  annotation(experiment(StopTime = 1));\nend Decay;\n";

/// Placed by annotations: a resistor whose icon is inherited, a part that is left out, and one that no annotation places.
const CIRCUIT: &str = "package P\n  connector Pin\n    Real v(unit = \"V\");\n    flow Real i(unit = \"A\");\n    annotation(Icon(graphics = {Rectangle(extent = {{-100, -100}, {100, 100}}, \
                       fillColor = {0, 0, 255}, fillPattern = FillPattern.Solid)}));\n  end Pin;\n  partial model TwoPin\n    Pin p annotation(Placement(transformation(extent = {{-110, -10}, {-90, 10}})));\n    \
                       Pin n annotation(Placement(transformation(extent = {{90, -10}, {110, 10}})));\n    annotation(Icon(graphics = {Line(points = {{-90, 0}, {90, 0}}, color = {255, 0, 0}), \
                       Text(extent = {{-100, 60}, {100, 100}}, textString = \"%name: %R\")}));\n  end TwoPin;\n  model Resistor\n    extends TwoPin;\n    parameter Real R(unit = \"Ohm\") = 10;\n  equation\n    \
                       p.v - n.v = R*p.i;\n    p.i + n.i = 0;\n  end Resistor;\n  model Source\n    Pin p;\n    Pin n;\n  equation\n    p.v - n.v = 12;\n    p.i + n.i = 0;\n  end Source;\n  model Ground\n    Pin p;\n  equation\n    \
                       p.v = 0;\n  end Ground;\n  model Circuit\n    parameter Boolean more = false;\n    Resistor r(R = 6) \"R <of> Ohm\" annotation(Placement(transformation(origin = {10, 20}, extent = {{-10, -10}, {10, 10}}, rotation = 270)));\n    \
                       Resistor other if more annotation(Placement(transformation(extent = {{40, 0}, {60, 20}})));\n    Source s annotation(Placement(transformation(extent = {{-60, 0}, {-40, 20}})));\n    Ground g;\n  equation\n    \
                       connect(s.p, r.p) annotation(Line(points = {{-40, 14}, {10, 14}, {10, 31}}, color = {0, 128, 0}));\n    connect(r.n, s.n);\n    connect(s.n, g.p);\n    connect(other.p, r.p);\n    \
                       annotation(Documentation(figures = {Figure(title = \"Law\", plots = {Plot(title = \"Ohm\", curves = {Curve(x = time, y = r.p.i, legend = \"current\")})})}));\n  end Circuit;\nend P;\n";

/// The data of a page.
#[track_caller]
pub(crate) fn data(page: &str) -> Value {
    let (_, rest) = page.split_once(">const DATA = ").expect("data");
    let (text, _) = rest.split_once(";</script>").expect("the end of the data");
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// Writes a page of these files; gives it with its data.
#[track_caller]
fn written(folder: &Path, files: &[&str]) -> (String, Value) {
    let outcome = run(folder, &[&["view"], files, &["--output", "page.html"]].concat());
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stdout);
    let page = std::fs::read_to_string(folder.join("page.html")).unwrap();
    let data = data(&page);
    (page, data)
}

fn variable<'a>(data: &'a Value, name: &str) -> &'a Value {
    let all = data["variables"].as_array().unwrap();
    all.iter().find(|own| own["n"] == name).unwrap_or_else(|| panic!("no variable {name}"))
}

#[test]
fn the_page_of_a_drive_is_one_file_that_needs_nothing() {
    let folder = Scratch::new();
    let drive = root().join("models/single_acting_drive/drive.hyd").display().to_string();
    let (page, data) = written(folder.path(), &[&drive]);
    assert!(page.len() < 1_500_000, "{} bytes", page.len());
    assert!(page.contains("default-src 'none'"), "a policy forbids all requests");
    for word in ["<link", "src=\"http", "@import", "/*STYLE*/", "/*SCRIPT*/", "<!--TITLE-->"] {
        assert!(!page.contains(word), "{word}");
    }
    let diagram = &data["model"]["diagrams"][0];
    let parts: Vec<&str> =
        diagram["parts"].as_array().unwrap().iter().map(|part| part["name"].as_str().unwrap()).collect();
    assert!(parts.contains(&"hy") && parts.contains(&"sensor_p_0"), "{parts:?}");
    assert_eq!((diagram["drawn"].as_bool(), diagram["wires"].as_array().unwrap().len()), (Some(false), 16));
    assert_eq!(diagram["wires"][0]["ends"], json!(["ro.flange", "hy.flange"]));
    let inner: Vec<&str> =
        data["model"]["diagrams"].as_array().unwrap().iter().filter_map(|own| own["path"].as_str()).collect();
    assert!(inner.contains(&"hy") && inner.contains(&"ro"), "{inner:?}");
    let p0 = variable(&data, "p0");
    assert_eq!((&p0["u"], &p0["d"], &p0["s"]), (&json!("Pa"), &json!("supply pressure"), &json!(1)));
    assert!(variable(&data, "u_C")["o"].is_array() && data["runs"].as_array().unwrap().len() == 1);
    let hy = &data["model"]["classes"]["SingleActingDrive.HY"];
    assert!(
        hy["text"].as_str().unwrap().starts_with("model HY ") && hy["file"].as_str().unwrap().ends_with("hy.hyd"),
        "{hy}"
    );
    assert!(data["model"]["equations"]["hy.qo"].as_array().is_some_and(|own| !own.is_empty()));
}

#[test]
fn annotations_place_and_draw() {
    let folder = Scratch::new();
    folder.write("p.hyd", CIRCUIT);
    let (_, data) = written(folder.path(), &["p.hyd"]);
    let diagram = &data["model"]["diagrams"][0];
    assert_eq!(diagram["drawn"], true);
    let parts: Vec<&str> =
        diagram["parts"].as_array().unwrap().iter().map(|part| part["path"].as_str().unwrap()).collect();
    assert_eq!(parts, ["r", "s", "g"], "what a condition leaves out is not drawn");
    let svg = diagram["svg"].as_str().unwrap();
    // A quarter turn: the icon's right end stands below its middle, in coordinates of SVG downwards.
    assert!(svg.contains("transform=\"matrix(0 0.1 0.1 0 10 -20)\""), "{svg}");
    assert!(svg.contains(">r: 6</text>"), "the text of the base class with name and value: {svg}");
    assert!(svg.contains("stroke=\"#ff0000\"") && svg.contains("fill=\"#0000ff\""), "{svg}");
    assert!(svg.contains("d=\"M-40 -14L10 -14L10 -31\"") && svg.contains("stroke=\"#008000\""), "{svg}");
    assert!(svg.contains("R &lt;of&gt; Ohm") && !svg.contains("<of>"), "{svg}");
    assert_eq!(diagram["wires"].as_array().unwrap().len(), 3);
    let values: Vec<&str> =
        diagram["wires"][0]["values"].as_array().unwrap().iter().map(|own| own.as_str().unwrap()).collect();
    assert_eq!(values, ["s.p.v", "s.p.i"]);
    let curves = json!([{"x": "time", "y": "r.p.i", "legend": "current"}]);
    assert_eq!(data["model"]["figures"], json!([{"title": "Law", "plots": [{"title": "Ohm", "curves": curves}]}]));
}

#[test]
fn results_are_shown_alone_and_beside_a_model() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    folder.write("old.csv", "time,x [m],other\n0,1,2\n1,nan,3\n");
    for format in ["csv", "mat", "parquet"] {
        let outcome = run(folder.path(), &["simulate", "decay.hyd", "--result", &format!("run.{format}")]);
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    }
    let (_, data) = written(folder.path(), &["run.csv", "run.mat", "run.parquet", "old.csv"]);
    assert_eq!((data["model"].is_null(), data["runs"].as_array().unwrap().len()), (true, 4));
    assert!(data["files"].as_array().unwrap().iter().all(|file| file["columns"]["x"].is_u64()), "{}", data["files"]);
    assert_eq!(variable(&data, "x")["u"], "m");
    let (_, data) = written(folder.path(), &["decay.hyd", "old.csv"]);
    assert_eq!(data["runs"].as_array().unwrap().len(), 2);
    assert!(variable(&data, "x")["o"].is_array() && variable(&data, "other")["o"].is_null());
    // Limits, and what decides sizes and so is no slider.
    let k = variable(&data, "k");
    assert_eq!((&k["lo"], &k["hi"], &k["s"]), (&json!(0.0), &json!(5.0), &json!(1)));
    assert_eq!(variable(&data, "n")["s"], 0);
}

#[test]
fn a_component_is_drawn_although_it_cannot_be_run() {
    let folder = Scratch::new();
    let part = root().join("models/single_acting_drive/hy.hyd").display().to_string();
    let (_, data) = written(folder.path(), &[&part]);
    assert_eq!(data["model"]["runs"], false);
    assert!(
        data["model"]["openEnds"].as_array().unwrap().iter().any(|end| end == "port_0"),
        "{}",
        data["model"]["openEnds"]
    );
    assert_eq!(data["runs"], json!([]));
}

#[test]
fn mistakes_end_in_words() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    folder.write("wrong.hyd", "model Wrong\n  Real x;\nequation\n  der(x) = y;\nend Wrong;\n");
    folder.write("run.csv", "time,x\n0,1\n");
    folder.write("text.csv", "time,x\n0,one\n");
    folder.write("empty.csv", "time,x\n");
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let cases: [(&[&str], u8, &str); 13] = [
        (&["none.hyd"], 1, "there is no file `none.hyd`"),
        (&["none.csv"], 1, "there is no file `none.csv`"),
        (&["wrong.hyd"], 1, "unknown name `y`"),
        (&["text.csv"], 1, "`one` is not a number"),
        (&["empty.csv"], 1, "holds no rows"),
        (&["run.csv", "decay.hyd"], 2, "only the first file may be a model"),
        (&["unit.fmu"], 1, "`unit.fmu`: the file cannot be read"),
        (&["decay.hyd", "unit.fmu"], 2, "a unit of another tool comes first"),
        (&["notes.txt"], 2, "models end in .hyd or .mo"),
        (&["decay.hyd", "--set", "kk=2", "--output", "p.html"], 1, "did you mean `k`?"),
        (&["decay.hyd", "--stop", "-1", "--output", "p.html"], 2, "--stop -1: a run begins at 0 s"),
        (&["run.csv", "--output", "run.csv"], 2, "which this command reads"),
        (&["run.csv", "--port", &port], 1, "is taken by another program"),
    ];
    for (arguments, code, words) in cases {
        let outcome = run(folder.path(), &[&["view"], arguments].concat());
        assert!(outcome.stderr.contains(words), "{arguments:?}: {}", outcome.stderr);
        assert_eq!(outcome.code, Some(code.into()), "{arguments:?}: {}", outcome.stderr);
    }
    assert_eq!(folder.names(), ["decay.hyd", "empty.csv", "run.csv", "text.csv", "wrong.hyd"], "nothing is written");
}

/// A server and where it is.
pub(crate) struct Viewer {
    child: Child,
    port: u16,
    token: String,
}

impl Viewer {
    pub(crate) fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut child = command(folder, &[&["view"], arguments].concat()).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let (_, address) = line.trim().split_once("http://127.0.0.1:").unwrap_or_else(|| panic!("no address: {line}"));
        let (port, token) = address.split_once("/?token=").unwrap();
        Self { port: port.parse().unwrap(), token: token.to_string(), child }
    }

    /// Status and body of an answer.
    fn ask(&self, head: &str, body: &str) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let length = body.len();
        write!(stream, "{head}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
        let status = String::from_utf8_lossy(&answer[9..12]).parse().unwrap();
        (status, answer[end + 4..].to_vec())
    }

    fn page(&self) -> String {
        self.page_at("/")
    }

    pub(crate) fn page_at(&self, path: &str) -> String {
        let head = format!("GET {path}?token={} HTTP/1.1\r\nHost: 127.0.0.1:{}", self.token, self.port);
        let (status, body) = self.ask(&head, "");
        assert_eq!(status, 200, "{path}");
        String::from_utf8(body).unwrap()
    }

    /// The header of a run and its columns.
    fn run(&self, body: &Value) -> (Value, Vec<Vec<f32>>) {
        self.numbers("/run", body)
    }

    pub(crate) fn numbers(&self, path: &str, body: &Value) -> (Value, Vec<Vec<f32>>) {
        let head = format!("POST {path} HTTP/1.1\r\nHost: localhost:{}\r\nX-Hyd-Token: {}", self.port, self.token);
        let (status, bytes) = self.ask(&head, &body.to_string());
        assert_eq!(status, 200);
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        let (rows, parameters) =
            (header["rows"].as_u64().unwrap() as usize, header["parameters"].as_u64().unwrap() as usize);
        let begin = 4 + length + 8 * (rows + parameters);
        let floats: Vec<f32> =
            bytes[begin..].chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
        (header, floats.chunks(rows.max(1)).map(<[f32]>::to_vec).collect())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn only_its_own_page_is_answered() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    let viewer = Viewer::start(folder.path(), &["decay.hyd"]);
    let (port, token) = (viewer.port, &viewer.token);
    let page = viewer.page();
    assert!(page.contains("<script nonce=") && !page.contains("Content-Security-Policy"), "the policy is a header");
    let status = |head: &str| viewer.ask(head, "{}").0;
    assert_eq!(status(&format!("GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}")), 403, "without the token");
    assert_eq!(status(&format!("GET /?token={token}0 HTTP/1.1\r\nHost: 127.0.0.1:{port}")), 403);
    assert_eq!(status(&format!("GET /?token={token} HTTP/1.1\r\nHost: evil.example:{port}")), 403, "rebound");
    assert_eq!(status(&format!("GET /?token={token} HTTP/1.1\r\nHost: localhost:{port}\r\nHost: evil.example")), 403);
    let post = format!("POST /run HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n");
    assert_eq!(status(&format!("{post}X-Hyd-Token: {token}\r\nOrigin: http://127.0.0.1:{port}")), 200);
    assert_eq!(status(&format!("{post}X-Hyd-Token: {token}\r\nOrigin: http://evil.example")), 403);
    assert_eq!(status(&format!("{post}X-Hyd-Token: {token}\r\nSec-Fetch-Site: cross-site")), 403);
    assert_eq!(
        status(&format!("POST /run?token={token} HTTP/1.1\r\nHost: 127.0.0.1:{port}")),
        403,
        "a form of another page"
    );
    assert_eq!(status(&format!("GET /etc/passwd?token={token} HTTP/1.1\r\nHost: 127.0.0.1:{port}")), 404);
    assert_eq!(folder.names(), ["decay.hyd"], "nothing is written");
}

#[test]
fn parameters_change_the_run() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    let viewer = Viewer::start(folder.path(), &["decay.hyd"]);
    let data = data(&viewer.page());
    let column = variable(&data, "x")["o"][0].as_u64().unwrap();
    let last = |set: Value| {
        let (header, columns) = viewer.run(&json!({"reading": data["reading"], "set": set, "columns": [column]}));
        assert_eq!((&header["status"], &header["columns"]), (&json!("done"), &json!([column])), "{header}");
        columns[0].last().copied().unwrap()
    };
    for (set, k) in [(json!({}), 1.0_f32), (json!({"k": "3"}), 3.0), (json!({"k": "0.5"}), 0.5)] {
        assert!((last(set) - (-k).exp()).abs() < 1e-5, "k = {k}");
    }
    let refused = |body: Value| viewer.run(&body).0;
    let wrong = refused(json!({"reading": 1, "set": {"kk": "3"}, "columns": []}));
    assert_eq!(wrong["status"], "refused");
    assert!(wrong["message"].as_str().unwrap().contains("did you mean `k`?"), "{wrong}");
    let outside = refused(json!({"reading": 1, "set": {"k": "7"}, "columns": []}));
    assert!(outside["status"] == "refused" && outside["message"].as_str().unwrap().contains("5"), "{outside}");
    assert_eq!(refused(json!({"reading": 9, "set": {}}))["status"], "refused", "of another reading");
}

/// A unit of another tool is run with what its sliders say: its parameters, and what it is given.
#[test]
fn a_unit_is_looked_at_like_a_model() {
    for version in ["2.0", "3.0"] {
        let folder = Scratch::new();
        build(&folder, MASS, version);
        let viewer = Viewer::start(folder.path(), &["case.fmu"]);
        let data = data(&viewer.page());
        assert_eq!((&data["model"]["unit"], &data["model"]["runs"]), (&json!(true), &json!(true)));
        assert_eq!([&variable(&data, "m")["s"], &variable(&data, "f")["s"]], [&json!(1), &json!(1)], "sliders");
        let columns: Vec<u64> = ["x", "v"].iter().map(|name| variable(&data, name)["o"][0].as_u64().unwrap()).collect();
        let set = json!({"f": "3", "m": "0.5"});
        let (header, values) = viewer.run(&json!({"reading": data["reading"], "set": set, "columns": columns}));
        assert_eq!(header["status"], "done", "{header}");
        // m v' = f - v/2 from rest over 2 s.
        let decayed = (-2.0_f32).exp();
        let [x, v] = [0, 1].map(|k| values[k].last().copied().unwrap());
        assert!((x - 6.0 * (1.0 + decayed)).abs() < 1e-4 && (v - 6.0 * (1.0 - decayed)).abs() < 1e-4, "{x} {v}");
    }
    // What is not a real number is a parameter of the unit; names may meet.
    let folder = Scratch::new();
    let text = MASS.replace(
        "  input Real f(start = 1);\n",
        "  input Real f(start = 1);\n  Real f_given = 2*f;\n  input Boolean brake(start = false);\n",
    );
    build(&folder, &text.replace("- 0.5*v", "- (if brake then 5 else 0.5)*v"), "3.0");
    let outcome = run(folder.path(), &["view", "case.fmu", "--output", "page.html"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let data = self::data(&folder.read("page.html"));
    for name in ["brake", "f_given", "'f_given'"] {
        assert!(variable(&data, name).is_object(), "{name}");
    }
}

#[test]
fn the_report_of_a_search_is_served_as_it_is() {
    let folder = Scratch::new();
    std::fs::create_dir(folder.path().join("leak")).unwrap();
    folder.write("leak/report.html", "<!DOCTYPE html><title>What the model lacks</title>");
    let viewer = Viewer::start(folder.path(), &["leak"]);
    assert_eq!(viewer.page(), folder.read("leak/report.html"));
    let outcome = run(folder.path(), &["view", "leak", "--output", "other.html"]);
    assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("is a page in one file already"), "{}", outcome.stderr);
    let outcome = run(folder.path(), &["view", "."]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("is a folder"), "{}", outcome.stderr);
}

#[test]
fn the_map_of_the_next_shot_stands_beside_the_finding() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    std::fs::create_dir(folder.path().join("leak")).unwrap();
    let report = json!({"model": "Decay", "set": "B", "status": "ambiguous", "sentence": "ambiguous", "effects": [], "location": []});
    folder.write("leak/report.json", report.to_string());
    let (_, data) = written(folder.path(), &["decay.hyd", "leak"]);
    assert!(data["next"].is_null(), "nobody has asked for the next shot");
    let next = json!({"set": "B", "status": "ambiguous", "aim": "tell apart", "models": ["a", "b"],
        "vary": [{"condition": "level", "low": 0.5, "high": 2}], "points": [{"values": [1], "worth": 3}],
        "shots": [{"settings": ["level = 2"], "conditions": {"level": 2}, "cost": 1, "like": 1, "evidence": []}]});
    folder.write("leak/next.json", next.to_string());
    let (page, data) = written(folder.path(), &["decay.hyd", "leak"]);
    assert_eq!(data["next"], next);
    assert!(page.contains("<h2 id=\"next-title\">"), "the page has a place for it");
    // That of another search would mislead.
    folder.write("leak/next.json", next.to_string().replace("\"B\"", "\"C\""));
    let outcome = run(folder.path(), &["view", "decay.hyd", "leak", "--output", "page.html"]);
    assert!(outcome.code == Some(0) && outcome.stderr.contains("is of the set `C`"), "{}", outcome.stderr);
    assert!(self::data(&folder.read("page.html"))["next"].is_null());
    folder.write("leak/next.json", "{}");
    let outcome = run(folder.path(), &["view", "decay.hyd", "leak", "--output", "page.html"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("is not what `hyd next` writes"), "{}", outcome.stderr);
}

/// Windows of one record begin at levels of their own, which the translation takes.
#[test]
fn windows_of_a_record_begin_where_they_do() {
    let folder = Scratch::new();
    let tanks = root().join("tests/real/tanks").display().to_string();
    let (study, set) = (format!("{tanks}/bench.toml"), format!("{tanks}/set.json"));
    let arguments = [&*study, "--bench", &set, "--library", &tanks];
    let outcome = run(folder.path(), &[&["view"], &arguments[..], &["--output", "page.html"]].concat());
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let shots = data(&folder.read("page.html"))["shots"]["all"].as_array().unwrap().clone();
    assert_eq!(shots.len(), 4);
    for shot in &shots {
        let start =
            shot["set"].as_array().unwrap().iter().find(|own| own[0] == "h_2.start").expect("a level at the start");
        let (measured, now) = (&shot["traces"][0]["measured"][0], &shot["traces"][0]["now"][0]);
        assert!(shot["deviations"][0].is_number(), "{}", shot["message"]);
        let (start, now): (f64, f64) = (start[1].as_str().unwrap().parse().unwrap(), now.as_f64().unwrap());
        assert!(
            (now - start).abs() < 1e-6 && (now - measured.as_f64().unwrap()).abs() < 0.5,
            "{start} {now} {measured}"
        );
    }
    // Where a record begins may be off, and a run begins where it is moved to: in its shot, and in no other.
    let viewer = Viewer::start(folder.path(), &arguments);
    let page = data(&viewer.page());
    let begin =
        page["shots"]["slack"].as_array().unwrap().iter().find(|own| own["name"] == "h_2 at the beginning (shot 2)");
    let begin = begin.expect("a level that may be off");
    let expected = begin["expected"].as_f64().unwrap();
    assert_eq!((&begin["shot"], &begin["parameters"][0][0]), (&json!(1), &json!("h_2.start")));
    let first = |shot: usize, off: &Value| {
        let (header, columns) = viewer.numbers("/shots", &json!({"reading": 1, "shot": shot, "set": {}, "off": off}));
        assert_eq!(header["status"], "done", "{header}");
        f64::from(columns[0][0])
    };
    let (still, off) = (json!({}), json!({"h_2 at the beginning (shot 2)": expected + 0.4}));
    assert!((first(1, &still) - expected).abs() < 1e-6 && (first(1, &off) - expected - 0.4).abs() < 1e-6);
    assert_eq!(first(0, &still), first(0, &off));
}

#[test]
fn a_page_that_is_loaded_again_shows_the_text_as_it_is() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    let mut viewer = Viewer::start(folder.path(), &["decay.hyd"]);
    assert_eq!(data(&viewer.page())["reading"], 1);
    folder.write("decay.hyd", DECAY.replace("-k*x", "-k*z"));
    let failed = data(&viewer.page());
    assert!(failed["failed"].as_str().unwrap().contains("unknown name `z`"), "{failed}");
    folder.write("decay.hyd", DECAY.replace("fades", "fades again"));
    let mended = data(&viewer.page());
    assert_eq!(mended["model"]["classes"]["Decay"]["description"], "fades again");
    assert!(Command::new("kill").args(["-INT", &viewer.child.id().to_string()]).status().unwrap().success());
    assert_eq!(wait(&mut viewer.child, &["view"]).code(), Some(0));
}
