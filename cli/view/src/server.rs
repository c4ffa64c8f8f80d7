//! The server of a page: the page itself, runs with other parameters, columns of results.
//!
//! Runs are made one after the other.  A newer question ends an older run, so that whoever drags a slider waits for its last place only.

use std::net::{Ipv4Addr, TcpListener};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use hyd_results::Trajectory;
use hyd_run::interrupt;
use serde_json::{Value, json};

use crate::encode::{Numbers, bytes};
use crate::guard::{Asked, Guard, random};
use crate::http::{self, Answer, Request};
use crate::page::{Shown, html};
use crate::reading::{Read, Reading, failed};

/// Time between two looks at Ctrl-C.
const PERIOD: Duration = Duration::from_millis(50);
/// What a page may load: its own script and style, known by a word, and answers of this server.
const ALWAYS: &str = "default-src 'none'; img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What is served.
pub(crate) enum Served {
    /// A page made of a session.
    Session(Reading),
    /// A report, whole as it is.
    Report(String),
}

/// Takes a port of the loopback, any free one for 0.
///
/// # Errors
/// The port is taken or not allowed.
pub(crate) fn listen(port: u16) -> Result<(TcpListener, u16), String> {
    let taken = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).and_then(|listener| {
        let port = listener.local_addr()?.port();
        Ok((listener, port))
    });
    taken.map_err(|error| match error.kind() {
        std::io::ErrorKind::AddrInUse => {
            format!("port {port} is taken by another program: without `--port` a free one is found")
        }
        _ => format!("port {port} cannot be served: {error}"),
    })
}

/// Serves until Ctrl-C.
///
/// # Errors
/// No thread can be started.
pub(crate) fn serve(listener: TcpListener, guard: Guard, served: Served) -> Result<(), String> {
    interrupt::listen();
    let server = Server { guard, served, newest: AtomicU64::new(0), last: Mutex::new(None) };
    http::serve(listener, move |request| server.answer(request))
        .map_err(|error| format!("no thread can be started: {error}"))?;
    while !interrupt::requested() {
        thread::sleep(PERIOD);
    }
    Ok(())
}

/// The run before: its parameters, its summary, its rows.
struct Last {
    reading: u64,
    set: Value,
    header: Value,
    rows: Trajectory,
}

struct Server {
    guard: Guard,
    served: Served,
    /// Number of the newest question for a run.
    newest: AtomicU64,
    last: Mutex<Option<Last>>,
}

impl Server {
    fn answer(&self, request: &Request) -> Answer {
        // Only the page itself is asked for by an address; all else states the token in a header, which no form of another page can.
        let from_query = request.query.split('&').find_map(|own| own.strip_prefix("token="));
        let is_page = request.method == "GET";
        let asked = Asked {
            host: request.header("Host"),
            origin: request.header("Origin"),
            site: request.header("Sec-Fetch-Site"),
            token: if is_page { from_query } else { request.header("X-Hyd-Token") },
        };
        if let Err(reason) = self.guard.admit(&asked) {
            return Answer::words(403, &format!("refused: {reason}"));
        }
        match (request.method.as_str(), request.path.as_str(), &self.served) {
            ("GET", "/", Served::Session(reading)) => {
                let nonce = match random() {
                    Ok(nonce) => nonce,
                    Err(reason) => return Answer::words(500, &reason),
                };
                let shown = |number| Shown::Served { token: self.guard.token(), nonce: &nonce, number };
                // What decides sizes or structure is set by the address of the page: the model is translated with it.
                let set = request.asked("set");
                let set = set.filter_map(|own| own.split_once('=').map(|(name, value)| (name.into(), value.into())));
                let page = match reading.again(set.collect()) {
                    Ok(read) => html(&read.session, &read.data, &shown(read.number)),
                    Err(words) => {
                        let before = reading.newest();
                        html(&before.session, &failed(&before.session.title, &words), &shown(before.number))
                    }
                };
                page_of(page, format!("'nonce-{nonce}'"))
            }
            ("GET", "/", Served::Report(page)) => page_of(page.clone(), "'unsafe-inline'".to_string()),
            ("POST", "/run", Served::Session(reading)) => match serde_json::from_slice::<Value>(&request.body) {
                Ok(body) => {
                    let kind = "application/octet-stream";
                    Answer { status: 200, kind, policy: None, body: bytes(&self.numbers(&reading.newest(), &body)) }
                }
                Err(_) => Answer::words(400, "the question is no JSON"),
            },
            _ => Answer::words(404, "there is nothing here"),
        }
    }

    /// The answer to `{"reading": n, "set": {...}, "columns": [...]}` or `{"reading": n, "file": k, "columns": [...]}`.
    fn numbers(&self, read: &Read, body: &Value) -> Numbers {
        let session = &read.session;
        if body["reading"] != read.number {
            return refused("another page has reloaded the files: reload this one");
        }
        let wanted = body["columns"].as_array().into_iter().flatten().filter_map(Value::as_u64);
        let wanted: Vec<usize> = wanted.map(|k| k as usize).collect();
        if let Some(run) = body["file"].as_u64() {
            let of_file = session.of_file(run as usize, &|column| wanted.contains(&column));
            return of_file.unwrap_or_else(|| refused("there is no such run"));
        }
        let Some(model) = session.model.as_ref().filter(|model| model.compilation.model.is_some()) else {
            return refused("there is no model that can be run");
        };
        let number = self.newest.fetch_add(1, Ordering::Relaxed) + 1;
        let stopped = || self.newest.load(Ordering::Relaxed) != number || interrupt::requested();
        // A run that panicked has left nothing half done: the rows before it still count.
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let set = &body["set"];
        if last.as_ref().is_none_or(|own| own.reading != read.number || own.set != *set) {
            let changed = set.as_object().into_iter().flatten();
            let changed: Vec<(String, String)> =
                changed.filter_map(|(name, value)| Some((name.clone(), value.as_str()?.to_string()))).collect();
            let interrupted =
                || Numbers { header: json!({"status": "interrupted", "message": ""}), ..Numbers::default() };
            if stopped() {
                return interrupted();
            }
            let (header, rows) = model.run(&changed, &stopped);
            if header["status"] == "interrupted" {
                return interrupted();
            }
            *last = Some(Last { reading: read.number, set: set.clone(), header, rows });
        }
        match &*last {
            Some(own) => model.numbers(own.header.clone(), &own.rows, &wanted),
            None => refused("there was no run"),
        }
    }
}

fn page_of(page: String, own: String) -> Answer {
    let policy = Some(format!("{ALWAYS}; script-src {own}; style-src {own}"));
    Answer { status: 200, kind: "text/html; charset=utf-8", policy, body: page.into_bytes() }
}

fn refused(words: &str) -> Numbers {
    Numbers { header: json!({"status": "refused", "message": words}), ..Numbers::default() }
}
