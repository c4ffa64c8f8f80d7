//! `hyd mcp` as a client speaks with it: handshake, tools, names that lead out, mistakes, calls that are taken back, and the guide's conversation.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use hyd_tests::models::root;
use serde_json::{Value, json};

use crate::process::{Scratch, command, run, wait};

/// No answer of these tests takes a tenth of this, also on a slow machine.
const LONGEST: Duration = Duration::from_secs(120);
const DECAY: &str = "model Decay \"fades\"\n  parameter Real k(unit = \"1/s\") = 1;\n  Real x(start = 1, fixed = true);\nequation\n  \
                     der(x) = -k*x;\n  annotation(experiment(StopTime = 1));\nend Decay;\n";
/// Takes as long as one likes.
const ENDLESS: &str = "model Endless\n  Real x(start = 1, fixed = true);\n  Real y(start = 0, fixed = true);\n\
                       equation\n  der(x) = 1e3*cos(1e3*time);\n  der(y) = -1e3*sin(1e3*time);\n  annotation(experiment(StopTime = 1e9));\nend Endless;\n";
const TOOLS: [&str; 8] = ["check", "explain", "documentation", "equations", "simulate", "sweep", "fit", "discover"];

/// A server and its client.
struct Agent {
    child: Child,
    stdin: Option<ChildStdin>,
    lines: Receiver<Value>,
    count: u64,
}

impl Agent {
    fn start(folder: &Path) -> Self {
        Self::with(folder, &["mcp", "."])
    }

    fn with(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = command(folder, arguments);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let stdout = child.stdout.take().unwrap();
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines() {
                // Nothing but the protocol may come this way.
                let message: Value = serde_json::from_str(&line.unwrap()).unwrap();
                if sender.send(message).is_err() {
                    return;
                }
            }
        });
        let stdin = child.stdin.take();
        Self { child, stdin, lines, count: 0 }
    }

    fn write(&mut self, line: &str) {
        let stdin = self.stdin.as_mut().unwrap();
        stdin.write_all(format!("{line}\n").as_bytes()).unwrap();
        stdin.flush().unwrap();
    }

    fn next(&mut self) -> Value {
        self.lines.recv_timeout(LONGEST).expect("an answer")
    }

    /// Sends a request; gives its number.
    fn request(&mut self, method: &str, params: &Value) -> u64 {
        self.count += 1;
        let request = json!({"jsonrpc": "2.0", "id": self.count, "method": method, "params": params});
        self.write(&request.to_string());
        self.count
    }

    fn ask(&mut self, method: &str, params: &Value) -> Value {
        let id = self.request(method, params);
        let answer = self.next();
        assert_eq!(answer["id"], id, "{answer}");
        answer
    }

    /// The result of a tool.
    fn call(&mut self, tool: &str, arguments: &Value) -> Value {
        let answer = self.ask("tools/call", &json!({"name": tool, "arguments": arguments}));
        assert!(answer["error"].is_null(), "{answer}");
        answer["result"].clone()
    }

    /// The data of a tool that succeeds.
    #[track_caller]
    fn done(&mut self, tool: &str, arguments: &Value) -> Value {
        let result = self.call(tool, arguments);
        assert_eq!(result["isError"], false, "{result}");
        assert!(result["content"][0]["text"].as_str().is_some_and(|text| !text.is_empty()), "{result}");
        result["structuredContent"].clone()
    }

    /// What a tool that refuses its arguments says.
    #[track_caller]
    fn refused(&mut self, tool: &str, arguments: &Value) -> String {
        let result = self.call(tool, arguments);
        assert_eq!(result["isError"], true, "{result}");
        result["content"][0]["text"].as_str().unwrap().to_string()
    }

    /// Ends the input; gives the exit code.
    fn end(mut self) -> Option<i32> {
        self.stdin = None;
        wait(&mut self.child, &["mcp"]).code()
    }
}

impl Drop for Agent {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn decay() -> Scratch {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    folder
}

#[test]
fn versions_are_agreed_on() {
    let folder = decay();
    let mut agent = Agent::start(folder.path());
    for (wanted, given) in [("2024-11-05", "2024-11-05"), ("2025-06-18", "2025-06-18"), ("1999-01-01", "2025-11-25")] {
        let params =
            json!({"protocolVersion": wanted, "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}});
        let answer = agent.ask("initialize", &params);
        assert_eq!(answer["result"]["protocolVersion"], given);
        assert_eq!(answer["result"]["serverInfo"]["name"], "hyd");
        agent.write(r#"{"jsonrpc": "2.0", "method": "notifications/initialized"}"#);
    }
    assert_eq!(agent.ask("ping", &json!({}))["result"], json!({}));
    let listed = agent.ask("tools/list", &json!({}))["result"].clone();
    let names: Vec<&str> =
        listed["tools"].as_array().unwrap().iter().map(|tool| tool["name"].as_str().unwrap()).collect();
    assert_eq!(names, TOOLS);
    assert!(listed["resultType"].is_null(), "{listed}");
    for tool in listed["tools"].as_array().unwrap() {
        let schema = &tool["inputSchema"];
        assert_eq!((&schema["type"], &schema["additionalProperties"]), (&json!("object"), &json!(false)));
        for (name, property) in schema["properties"].as_object().unwrap() {
            assert!(property["description"].as_str().is_some_and(|says| says.len() > 10), "{name}: {property}");
        }
    }
    // The version without a handshake: each request says which it is.
    let meta = |version: &str| json!({"_meta": {"io.modelcontextprotocol/protocolVersion": version, "io.modelcontextprotocol/clientCapabilities": {}}});
    let found = agent.ask("server/discover", &meta("2026-07-28"))["result"].clone();
    assert_eq!(found["resultType"], "complete");
    assert!(found["supportedVersions"].as_array().unwrap().contains(&json!("2026-07-28")), "{found}");
    let listed = agent.ask("tools/list", &meta("2026-07-28"))["result"].clone();
    assert_eq!((&listed["resultType"], &listed["cacheScope"]), (&json!("complete"), &json!("public")));
    let unknown = agent.ask("tools/list", &meta("2031-01-01"));
    assert_eq!(unknown["error"]["code"], -32022, "{unknown}");
    assert_eq!(unknown["error"]["data"]["requested"], "2031-01-01");
    assert_eq!(agent.end(), Some(0));
}

#[test]
fn models_are_checked_explained_and_shown() {
    let folder = decay();
    folder.write("wrong.hyd", "model Wrong\n  Real x = 2*lenght;\n  Real length = 1;\nend Wrong;\n");
    let mut agent = Agent::start(folder.path());
    let clean = agent.done("check", &json!({"file": "decay.hyd"}));
    assert_eq!((&clean["status"], &clean["model"]), (&json!("done"), &json!("Decay")));
    assert_eq!((&clean["counts"]["continuous_equations"], &clean["counts"]["states"]), (&json!(1), &json!(1)));
    let wrong = agent.done("check", &json!({"file": "wrong.hyd"}));
    assert_eq!(wrong["status"], "rejected");
    let message = &wrong["messages"][0];
    let label = &message["labels"][0];
    assert_eq!((&label["file"], &label["line"], &label["column"]), (&json!("wrong.hyd"), &json!(2), &json!(14)));
    assert_eq!(message["proposals"][0]["edits"][0]["text"], "length", "{message}");
    let code = message["code"].as_str().unwrap().to_string();
    let explained = agent.done("explain", &json!({"code": code}));
    assert!(explained["explanation"].as_str().is_some_and(|text| text.len() > 50), "{explained}");
    assert!(agent.done("explain", &json!({"code": "all"}))["codes"].as_array().unwrap().len() > 20);

    let shown = agent.done("equations", &json!({"file": "decay.hyd", "stage": "flat", "lines": 2}));
    assert_eq!((&shown["lines"], shown["text"].as_str().unwrap().lines().count()), (&json!(2), 2));
    assert!(shown["note"].as_str().unwrap().ends_with("the next are from_line 3"), "{shown}");
    assert!(agent.done("equations", &json!({"file": "decay.hyd"}))["text"].as_str().unwrap().contains("der(x)"));

    let package = agent.done("documentation", &json!({}));
    assert!(package["classes"].as_array().unwrap().iter().any(|own| own["name"] == "Hyd"), "{package}");
    let class = agent.done("documentation", &json!({"name": "Hyd.Translational.Components.Spring"}));
    let parameter = &class["parameters"][0];
    assert!(parameter["unit"].is_string() && parameter["type"].is_string(), "{class}");
    assert!(class["connectors"].as_array().is_some_and(|own| !own.is_empty()), "{class}");
    let found = agent.done("documentation", &json!({"name": "orifice"}));
    assert!(found["found"].as_array().unwrap().len() > 1, "{found}");
    assert!(
        agent
            .refused("documentation", &json!({"name": "Hyd.Units.Lenght"}))
            .contains("did you mean `Hyd.Units.Length`?")
    );
}

#[test]
fn runs_are_told_and_written() {
    let folder = decay();
    let mut agent = Agent::start(folder.path());
    let run =
        agent.done("simulate", &json!({"file": "decay.hyd", "parameters": {"k": 2}, "stop": 0.5, "result": "r.csv"}));
    assert_eq!((&run["status"], &run["result"]), (&json!("done"), &json!("r.csv")));
    assert!(run["counters"]["steps"].as_u64().unwrap() > 5);
    let x = &run["variables"].as_array().unwrap().iter().find(|own| own["name"] == "x").unwrap().clone();
    assert_eq!(x["max"], 1.0);
    assert!((x["final"].as_f64().unwrap() - (-1.0f64).exp()).abs() < 1e-5, "{x}");
    assert_eq!(x["min"], x["final"]);
    assert!(folder.read("r.csv").lines().count() > 400);
    // Its own file may be written again.
    agent.done("simulate", &json!({"file": "decay.hyd", "result": "r.csv"}));

    let swept = agent.done(
        "sweep",
        &json!({"file": "decay.hyd", "vary": {"k": "1:3:3"}, "measure": ["final(x)"], "result": "runs"}),
    );
    assert_eq!(
        (&swept["members"], &swept["failed"], &swept["files"]),
        (&json!(3), &json!(0), &json!(["runs/members.parquet"]))
    );
    let again = agent.done(
        "sweep",
        &json!({"file": "decay.hyd", "vary": {"k": "1:3:3"}, "measure": ["final(x)"], "result": "runs"}),
    );
    assert_eq!((&again["before"], &again["now"]), (&json!(3), &json!(0)));
    folder.write("plan.toml", "model = \"decay.hyd\"\n\n[[vary]]\nparameter = \"k\"\nvalues = \"1, 2\"\n");
    assert_eq!(agent.done("sweep", &json!({"file": "plan.toml", "result": "planned"}))["members"], 2);
    assert_eq!(agent.end(), Some(0));
    assert_eq!(folder.names(), ["decay.hyd", "plan.toml", "planned", "r.csv", "runs"]);
}

#[test]
fn a_run_that_fails_says_where() {
    let folder = Scratch::new();
    folder.write("e.hyd", "model Escape\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = x^2;\nend Escape;\n");
    let mut agent = Agent::start(folder.path());
    let result = agent.call("simulate", &json!({"file": "e.hyd", "stop": 2, "result": "r.csv"}));
    let data = &result["structuredContent"];
    assert_eq!(
        (&result["isError"], &data["status"], &data["result"]),
        (&json!(true), &json!("failed"), &json!("r.partial.csv"))
    );
    assert!(data["messages"][0]["labels"][0]["line"].is_u64(), "{data}");
    assert!(data["time"].as_f64().unwrap() > 0.9);
}

/// The folder of a new project, whose shots the tools make.
#[test]
fn studies_are_fitted_and_searched() {
    let folder = Scratch::new();
    assert_eq!(run(folder.path(), &["new", "drv"]).code, Some(0));
    let mut agent = Agent::start(folder.path());
    for (p0, table) in [(10e6, "drv/bench/shot1.csv"), (14e6, "drv/bench/shot2.csv")] {
        let shot = json!({"file": "drv/drive.hyd", "parameters": {"p0": p0, "spring.k": 27e3}, "variables": "^(y|p)$", "result": table});
        agent.done("simulate", &shot);
    }
    let study = json!({"study": "drv/bench.toml", "bench": "drv/bench/set.json", "write_parameters": "fitted.toml"});
    let fitted = agent.done("fit", &study);
    assert_eq!((&fitted["converged"], &fitted["files"]), (&json!(true), &json!(["fitted.toml"])));
    let k = fitted["unknowns"].as_array().unwrap().iter().find(|own| own["name"] == "k").unwrap();
    assert!((k["value"].as_f64().unwrap() / 1.08 - 1.0).abs() < 0.02, "{k}");
    assert!(folder.read("fitted.toml").contains("spring.k"));

    let search = json!({"name": "discover", "arguments": {"study": "drv/bench.toml", "bench": "drv/bench/set.json", "report": "report"},
        "_meta": {"progressToken": "p"}});
    let id = agent.request("tools/call", &search);
    let mut last = 0.0;
    let answer = loop {
        let message = agent.next();
        if message["id"] == id {
            break message;
        }
        assert_eq!(
            (&message["method"], &message["params"]["progressToken"]),
            (&json!("notifications/progress"), &json!("p"))
        );
        let progress = message["params"]["progress"].as_f64().unwrap();
        assert!(progress > last && message["params"]["message"].is_string(), "{message}");
        last = progress;
    };
    assert!(last > 0.0, "a search tells its progress");
    let found = &answer["result"]["structuredContent"];
    assert_eq!(answer["result"]["isError"], false, "{answer}");
    assert!(found["status"].is_string() && found["gap"].is_object(), "{found}");
    assert!(found["files"].as_array().unwrap().contains(&json!("report/report.html")), "{}", found["files"]);
}

#[test]
fn no_name_leads_out_of_the_folder() {
    let outer = Scratch::new();
    outer.write("secret.hyd", DECAY);
    outer.write("Secret.hyd", "within A;\nmodel Secret\n  Real hidden = 1;\nend Secret;\n");
    let inner = outer.path().join("inner");
    fs::create_dir_all(inner.join("A")).unwrap();
    fs::write(inner.join("decay.hyd"), DECAY).unwrap();
    // The packages of a text lie above its folder, as far as they lie in the folder that is served.
    fs::write(inner.join("within.hyd"), "within A.B;\nmodel W\n  extends A.Secret;\nend W;\n").unwrap();
    fs::write(inner.join("data.hyd"), "model D\n  parameter Real x = 1;\n  Real y = x;\nend D;\n").unwrap();
    fs::write(inner.join("plan.toml"), "model = \"../secret.hyd\"\n\n[[vary]]\nparameter = \"k\"\nvalues = \"1, 2\"\n")
        .unwrap();
    let mut names = vec!["../secret.hyd".to_string(), "A/../../secret.hyd".to_string(), "/etc/passwd".to_string()];
    names.push(outer.path().join("secret.hyd").display().to_string());
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.hyd", inner.join("link.hyd")).unwrap();
        std::os::unix::fs::symlink("..", inner.join("up")).unwrap();
        std::os::unix::fs::symlink("../../Secret.hyd", inner.join("A").join("Linked.hyd")).unwrap();
        fs::write(inner.join("A").join("package.hyd"), "package A\nend A;\n").unwrap();
        fs::write(inner.join("A").join("use.hyd"), "within A;\nmodel Use\n  extends A.Linked;\nend Use;\n").unwrap();
        names.extend(["link.hyd".to_string(), "up/secret.hyd".to_string()]);
    }
    let mut agent = Agent::start(&inner);
    for name in &names {
        for tool in ["check", "equations", "simulate"] {
            let said = agent.refused(tool, &json!({"file": name}));
            assert!(said.contains("lies outside of the folder that is served"), "{tool} {name}: {said}");
        }
        let said = agent.refused("fit", &json!({"study": name, "bench": "decay.hyd"}));
        assert!(said.contains("`study`") && said.contains("lies outside"), "{said}");
        let said = agent.refused("check", &json!({"file": "decay.hyd", "libraries": [name]}));
        assert!(said.contains("`libraries`") && said.contains("lies outside"), "{said}");
    }
    let mut places = vec!["../r.csv".to_string(), outer.path().join("r.csv").display().to_string()];
    if cfg!(unix) {
        places.push("up/r.csv".to_string());
    }
    for place in &places {
        let said = agent.refused("simulate", &json!({"file": "decay.hyd", "result": place}));
        assert!(said.contains("`result`") && said.contains("lies outside"), "{said}");
        let folder = place.trim_end_matches(".csv");
        let said = agent.refused("sweep", &json!({"file": "decay.hyd", "vary": {"k": "1,2"}, "result": folder}));
        assert!(said.contains("`result`") && said.contains("lies outside"), "{said}");
        let said = agent.refused("discover", &json!({"study": "decay.hyd", "bench": "decay.hyd", "report": folder}));
        assert!(said.contains("`report`") && said.contains("lies outside"), "{said}");
    }
    let said = agent.refused("sweep", &json!({"file": "plan.toml", "result": "runs"}));
    assert!(said.contains("lies outside"), "{said}");
    for (file, word) in [("within.hyd", "Secret"), ("A/use.hyd", "Linked")] {
        if inner.join(file).exists() {
            let result = agent.call("check", &json!({"file": file}));
            assert_eq!(result["structuredContent"]["status"], "rejected", "{file}: {result}");
            assert!(result.to_string().contains(word) && !result.to_string().contains("hidden"), "{result}");
        }
    }
    assert_eq!(outer.names(), ["Secret.hyd", "inner", "secret.hyd"]);
    // What lies inside may be named by its whole path.
    let whole = inner.join("decay.hyd").canonicalize().unwrap().display().to_string();
    agent.done("check", &json!({"file": whole}));
}

#[test]
fn nothing_that_is_there_is_written_over() {
    let folder = decay();
    folder.write("table.csv", "time,x\n0,1\n");
    fs::create_dir(folder.path().join("notes")).unwrap();
    folder.write("notes/a.md", "mine\n");
    folder.write("set.json", "{}");
    let mut agent = Agent::start(folder.path());
    for (place, said) in
        [("table.csv", "is there already"), ("decay.hyd", "must end in"), ("notes", "must end in"), ("", "no file")]
    {
        let answer = agent.refused("simulate", &json!({"file": "decay.hyd", "result": place}));
        assert!(answer.contains("`result`") && answer.contains(said), "{place}: {answer}");
    }
    for place in ["notes", "table.csv", "."] {
        agent.refused("sweep", &json!({"file": "decay.hyd", "vary": {"k": "1,2"}, "result": place}));
        agent.refused("discover", &json!({"study": "decay.hyd", "bench": "set.json", "report": place}));
    }
    folder.write("study.toml", "");
    let said =
        agent.refused("fit", &json!({"study": "study.toml", "bench": "set.json", "write_parameters": "study.toml"}));
    assert!(said.contains("`write_parameters`") && said.contains("is there already"), "{said}");
    assert_eq!(agent.end(), Some(0));
    assert_eq!(folder.read("table.csv"), "time,x\n0,1\n");
    assert_eq!(folder.names(), ["decay.hyd", "notes", "set.json", "study.toml", "table.csv"]);
}

#[test]
fn mistakes_are_answered_and_the_server_goes_on() {
    let folder = decay();
    let mut agent = Agent::start(folder.path());
    for (line, code) in [
        ("{\"jsonrpc\": \"2.0\", \"id\": 1, ", -32700),
        ("not JSON", -32700),
        ("[]", -32600),
        ("{\"id\": 1, \"method\": \"ping\"}", -32600),
        ("{\"jsonrpc\": \"2.0\", \"id\": 1, \"method\": \"ping\", \"params\": 3}", -32602),
    ] {
        agent.write(line);
        let answer = agent.next();
        assert_eq!(answer["error"]["code"], code, "{line}: {answer}");
    }
    agent.write("");
    agent.stdin.as_mut().unwrap().write_all(b"\xff\xfe\n").unwrap();
    assert_eq!(agent.next()["error"]["code"], -32700);
    let unknown = agent.ask("tools/cal", &json!({}));
    assert_eq!(unknown["error"]["code"], -32601);
    assert!(unknown["error"]["message"].as_str().unwrap().contains("did you mean `tools/call`?"));
    let unknown = agent.ask("tools/call", &json!({"name": "simulat", "arguments": {}}));
    assert_eq!(unknown["error"]["code"], -32602);
    assert!(unknown["error"]["message"].as_str().unwrap().contains("did you mean `simulate`?"));
    for (tool, arguments, said) in [
        ("check", json!({}), "`check` needs `file`"),
        ("check", json!({"file": "decya.hyd"}), "did you mean `decay.hyd`?"),
        ("check", json!({"flie": "decay.hyd"}), "did you mean `file`?"),
        ("simulate", json!({"file": "decay.hyd", "stop": "1"}), "`stop` must be a number"),
        ("simulate", json!({"file": "decay.hyd", "variables": "("}), "variables: "),
        (
            "simulate",
            json!({"file": "decay.hyd", "variables": "nothing"}),
            "no variable of the model matches `nothing`",
        ),
        ("simulate", json!({"file": "decay.hyd", "stop": -1}), "stop"),
        ("simulate", json!({"file": "decay.hyd", "parameters": {"kk": 1}}), "no parameter `kk`"),
        ("simulate", json!({"file": "decay.hyd", "class": "Deacy"}), "did you mean `Decay`?"),
        ("simulate", json!({"file": "decay.hyd", "result": "r.xls"}), "must end in .csv or .mat or .parquet"),
        ("equations", json!({"file": "decay.hyd", "stage": "sortd"}), "did you mean `sorted`?"),
        ("explain", json!({"code": "E9999"}), "there is no code `E9999`"),
        ("sweep", json!({"file": "decay.hyd", "vary": {"k": "1:2"}, "result": "runs"}), "k"),
    ] {
        let answer = agent.refused(tool, &arguments);
        assert!(answer.contains(said), "{tool} {arguments}: {answer}");
    }
    assert_eq!(agent.done("check", &json!({"file": "decay.hyd"}))["status"], "done");
    assert_eq!(agent.end(), Some(0));
    assert_eq!(folder.names(), ["decay.hyd"]);
}

#[test]
fn a_folder_that_is_none_is_wrong_usage() {
    let folder = decay();
    for place in ["none", "decay.hyd"] {
        let outcome = run(folder.path(), &["mcp", place]);
        assert!(outcome.code == Some(2) && outcome.stderr.contains(place), "{outcome:?}");
    }
}

#[test]
fn a_call_that_is_taken_back_ends_and_the_next_is_answered() {
    let folder = decay();
    folder.write("endless.hyd", ENDLESS);
    let mut agent = Agent::start(folder.path());
    let first = agent
        .request("tools/call", &json!({"name": "simulate", "arguments": {"file": "endless.hyd", "result": "r.csv"}}));
    let second = agent.request("tools/call", &json!({"name": "check", "arguments": {"file": "decay.hyd"}}));
    let third = agent.request("tools/call", &json!({"name": "simulate", "arguments": {"file": "endless.hyd"}}));
    // What concerns the server is answered meanwhile.
    assert_eq!(agent.ask("ping", &json!({}))["result"], json!({}));
    for id in [third, first] {
        agent.write(
            &json!({"jsonrpc": "2.0", "method": "notifications/cancelled", "params": {"requestId": id}}).to_string(),
        );
    }
    let answer = agent.next();
    assert_eq!((&answer["id"], &answer["result"]["isError"]), (&json!(second), &json!(false)));
    assert_eq!(agent.end(), Some(0));
    assert!(!folder.path().join("r.csv").exists());
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_run_with_an_answer() {
    let folder = Scratch::new();
    folder.write("endless.hyd", ENDLESS);
    let mut agent = Agent::start(folder.path());
    let arguments = json!({"name": "simulate", "arguments": {"file": "endless.hyd"}, "_meta": {"progressToken": 7}});
    let id = agent.request("tools/call", &arguments);
    // The run has begun when it gives a sign of life.
    let sign = agent.next();
    assert_eq!((&sign["method"], &sign["params"]["progressToken"]), (&json!("notifications/progress"), &json!(7)));
    assert!(Command::new("kill").args(["-INT", &agent.child.id().to_string()]).status().unwrap().success());
    let answer = loop {
        let message = agent.next();
        if message["id"] == id {
            break message;
        }
    };
    assert_eq!(answer["result"]["structuredContent"]["status"], "interrupted", "{answer}");
    let begin = Instant::now();
    assert_eq!(wait(&mut agent.child, &["mcp"]).code(), Some(0));
    assert!(begin.elapsed() < Duration::from_secs(10));
}

/// Blocks of messages are sent, one a line; what the block of text behind them says must stand in the answers.
#[test]
fn the_guide_is_true() {
    let folder = Scratch::new();
    assert_eq!(run(folder.path(), &["new", "drive"]).code, Some(0));
    let guide = fs::read_to_string(root().join("docs/guides/agent.md")).unwrap();
    let mut agent = Agent::with(folder.path(), &["mcp", "drive"]);
    let (mut shown, mut block, mut blocks) = (String::new(), None::<(&str, Vec<&str>)>, 0);
    for line in guide.lines() {
        match (&mut block, line.strip_prefix("```")) {
            (None, Some(kind)) => block = Some((kind, Vec::new())),
            (None, None) => {}
            (Some((_, lines)), None) => lines.push(line),
            (Some((kind, lines)), Some(_)) => {
                match *kind {
                    "jsonl" => {
                        shown.clear();
                        for line in lines {
                            agent.write(line);
                            let answer = agent.next();
                            shown += answer["result"]["content"][0]["text"].as_str().unwrap_or_default();
                            shown += &answer.to_string();
                        }
                        blocks += 1;
                    }
                    "text" => {
                        let missing: Vec<_> = lines.iter().filter(|line| !shown.contains(line.trim())).collect();
                        assert!(missing.is_empty(), "{missing:?} is not in\n{shown}");
                    }
                    _ => {}
                }
                block = None;
            }
        }
    }
    assert!(blocks >= 4, "{blocks} blocks of messages");
}
