//! The server: what comes from the client, and the threads that work for it.
//!
//! One thread reads, one runs tools, and this one stands between them and never waits for either: it answers what concerns the server at once, lets
//! calls of tools wait for their turn, and ends them when they are taken back, when Ctrl-C is pressed or when nobody reads answers any more.

use std::collections::VecDeque;
use std::io::BufRead;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use hyd_run::interrupt;
use hyd_source::did_you_mean;
use serde_json::{Value, json};

use crate::answer::Answer;
use crate::arguments;
use crate::calls::{Handle, Job, Workplace, work};
use crate::lines::{self, Line};
use crate::progress::Progress;
use crate::protocol::{self, Code, Fault, HANDSHAKE, Message, Outgoing, Request, STATELESS};
use crate::tools::{TOOLS, Tool};

/// Stack of the thread that translates: expressions may be nested as deep as the language's limits allow.
const STACK: usize = 32 << 20;
/// Time between two looks at what comes from elsewhere than the client.
const PERIOD: Duration = Duration::from_millis(50);
/// After the end of the input what was asked for may take so long.
const REMAINING: Duration = Duration::from_secs(30);
/// How long a call that is to end may take; one that translates cannot be broken off.
const FAREWELL: Duration = Duration::from_secs(2);
/// Calls that wait at the same time.
const MOST_WAITING: usize = 1000;
/// How long a client may keep the list of tools (ms): it does not change while the server runs.
const FRESH: u64 = 3_600_000;

/// What the server says of itself.
const INSTRUCTIONS: &str = "hyd compiles and simulates equation-based models of physical systems (a Modelica-style language, files *.hyd), and compares \
them with measured benches. Names of files are relative to the folder that is served and lead nowhere else. Begin with `check`, look classes of the \
library up with `documentation`, read error codes with `explain`, then `simulate`. `sweep`, `fit` and `discover` may take minutes: ask for \
progress, and cancel what is not wanted. Calls of tools run one after the other. Files are written only where a call names them, and never over what was \
there before.";

/// What happens.
pub(crate) enum Event {
    Line(Vec<u8>),
    TooLong,
    End,
    /// A call has ended.
    Done,
}

/// Serves until the input has ended and all is answered.  `input` and `workplace` are made by the threads that use them.
pub(crate) fn serve<R: BufRead>(
    input: impl FnOnce() -> R + Send + 'static,
    outgoing: Arc<Outgoing>,
    workplace: impl FnOnce() -> Workplace + Send + 'static,
) -> Result<(), String> {
    interrupt::listen();
    let (events, received) = channel::<Event>();
    let (jobs, waiting) = channel::<Job>();
    let failed = |error: std::io::Error| format!("no thread can be started: {error}");
    let reader = events.clone();
    thread::Builder::new().name("read".into()).spawn(move || read(input(), &reader)).map_err(failed)?;
    let out = outgoing.clone();
    let worker = thread::Builder::new().name("work".into()).stack_size(STACK);
    worker.spawn(move || work(&workplace(), &waiting, &out, &events)).map_err(failed)?;
    let mut server = Server { outgoing, jobs, queue: VecDeque::new(), running: None };
    let mut ended: Option<Instant> = None;
    loop {
        match received.recv_timeout(PERIOD) {
            Ok(Event::Line(line)) => server.line(&line),
            Ok(Event::TooLong) => {
                let sentence = format!("the line is longer than {} MB", lines::LONGEST >> 20);
                server.outgoing.send(&protocol::error(&Value::Null, &Fault::new(Code::Request, sentence)));
            }
            Ok(Event::End) => ended = Some(Instant::now()),
            Ok(Event::Done) => {
                server.running = None;
                server.next();
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err("the thread that runs tools is gone".to_string()),
        }
        if let Some(running) = &server.running {
            running.progress.beat();
        }
        let is_late = ended.is_some_and(|since| since.elapsed() > REMAINING);
        if interrupt::requested() || is_late || server.outgoing.is_closed() {
            server.end(&received);
            return Ok(());
        }
        if ended.is_some() && server.running.is_none() {
            return Ok(());
        }
    }
}

/// Reads lines until there are no more.
fn read(mut input: impl BufRead, events: &Sender<Event>) {
    loop {
        let event = match lines::next(&mut input) {
            Line::Whole(line) if line.iter().all(u8::is_ascii_whitespace) => continue,
            Line::Whole(line) => Event::Line(line),
            Line::TooLong => Event::TooLong,
            Line::End => Event::End,
        };
        let is_end = matches!(event, Event::End);
        if events.send(event).is_err() || is_end {
            return;
        }
    }
}

struct Server {
    outgoing: Arc<Outgoing>,
    jobs: Sender<Job>,
    queue: VecDeque<Job>,
    running: Option<Handle>,
}

impl Server {
    fn line(&mut self, line: &[u8]) {
        match protocol::read(line) {
            Message::Request(request) => self.request(request),
            Message::Notification(method, params) if method == "notifications/cancelled" => {
                self.cancel(params.get("requestId").unwrap_or(&Value::Null));
            }
            Message::Notification(..) | Message::Answer => {}
            Message::Wrong(id, fault) => self.outgoing.send(&protocol::error(&id, &fault)),
        }
    }

    fn request(&mut self, request: Request) {
        let result = match unknown_version(&request) {
            Some(fault) => Err(fault),
            None => match request.method.as_str() {
                "initialize" => Ok(initialize(&request)),
                "server/discover" => Ok(discover()),
                "ping" => Ok(json!({})),
                "tools/list" => Ok(list(&request)),
                "tools/call" => return self.call(request),
                method => {
                    let known = ["initialize", "server/discover", "ping", "tools/list", "tools/call"];
                    let hint = did_you_mean(method, known).map_or_else(String::new, |hint| format!("; {hint}"));
                    Err(Fault::new(Code::Method, format!("there is no method `{method}`{hint}")))
                }
            },
        };
        self.outgoing.send(&request.answer(result));
    }

    /// Lets a call wait for its turn, if it makes sense.
    fn call(&mut self, request: Request) {
        let tool = match tool(&request) {
            Ok(tool) => tool,
            Err(fault) => return self.outgoing.send(&request.answer(Err(fault))),
        };
        // Arguments that make no sense are an answer of the tool, which agents read.
        let given = match arguments::read(tool.name, tool.arguments, request.params.get("arguments")) {
            Ok(given) => given,
            Err(sentence) => return self.outgoing.send(&request.answer(Ok(Answer::refused(sentence).result()))),
        };
        if self.queue.len() >= MOST_WAITING {
            let fault = Fault::new(Code::Internal, format!("{MOST_WAITING} calls wait already"));
            return self.outgoing.send(&request.answer(Err(fault)));
        }
        let handle = Handle {
            id: request.id.clone(),
            stop: Arc::new(AtomicBool::new(false)),
            taken_back: Arc::new(AtomicBool::new(false)),
            progress: Arc::new(Progress::new(request.progress_token(), self.outgoing.clone())),
        };
        self.queue.push_back(Job { request, tool, given, handle });
        self.next();
    }

    /// Begins the next call, if none runs.
    fn next(&mut self) {
        if self.running.is_none()
            && let Some(job) = self.queue.pop_front()
        {
            self.running = Some(job.handle.clone());
            // The thread that runs tools ends after this one only.
            let _ = self.jobs.send(job);
        }
    }

    fn cancel(&mut self, id: &Value) {
        self.queue.retain(|job| job.handle.id != *id);
        if let Some(running) = self.running.as_ref().filter(|running| running.id == *id) {
            running.take_back();
        }
    }

    /// Ends what runs, and waits a little for its answer.
    fn end(&mut self, events: &std::sync::mpsc::Receiver<Event>) {
        self.queue.clear();
        let Some(running) = self.running.take() else { return };
        running.stop.store(true, Ordering::Relaxed);
        let begin = Instant::now();
        while let Some(left) = FAREWELL.checked_sub(begin.elapsed()) {
            if let Ok(Event::Done) = events.recv_timeout(left) {
                return;
            }
        }
    }
}

/// The tool that a request names.
fn tool(request: &Request) -> Result<&'static Tool, Fault> {
    let name = request.params.get("name").and_then(Value::as_str);
    let name = name.ok_or_else(|| Fault::new(Code::Params, "`name` must be the name of a tool"))?;
    TOOLS.iter().copied().find(|tool| tool.name == name).ok_or_else(|| {
        let names = || TOOLS.iter().map(|tool| tool.name);
        let hint = did_you_mean(name, names()).map_or_else(String::new, |hint| format!("; {hint}"));
        let all = names().collect::<Vec<_>>().join(", ");
        Fault::new(Code::Params, format!("there is no tool `{name}`{hint}; the tools are {all}"))
    })
}

/// Refuses a request of a version that is not spoken.
fn unknown_version(request: &Request) -> Option<Fault> {
    let version = request.version().filter(|version| *version != STATELESS)?;
    let data = json!({"supported": versions(), "requested": version});
    Some(Fault {
        code: Code::Version,
        message: format!("requests of version `{version}` are not answered"),
        data: Some(data),
    })
}

fn versions() -> Vec<&'static str> {
    HANDSHAKE.iter().copied().chain([STATELESS]).collect()
}

fn capabilities() -> Value {
    json!({"tools": {}})
}

fn initialize(request: &Request) -> Value {
    let wanted = request.params.get("protocolVersion").and_then(Value::as_str).unwrap_or_default();
    let newest = HANDSHAKE[HANDSHAKE.len() - 1];
    let version = HANDSHAKE.iter().find(|version| **version == wanted).unwrap_or(&newest);
    json!({"protocolVersion": version, "capabilities": capabilities(), "serverInfo": protocol::server_info(), "instructions": INSTRUCTIONS})
}

fn discover() -> Value {
    json!({"resultType": "complete", "supportedVersions": versions(), "capabilities": capabilities(), "serverInfo": protocol::server_info(),
        "instructions": INSTRUCTIONS, "ttlMs": FRESH, "cacheScope": "public"})
}

fn list(request: &Request) -> Value {
    let tools: Vec<Value> = TOOLS.iter().map(|tool| tool.described()).collect();
    match request.version() {
        None => json!({"tools": tools}),
        Some(_) => json!({"tools": tools, "ttlMs": FRESH, "cacheScope": "public"}),
    }
}
