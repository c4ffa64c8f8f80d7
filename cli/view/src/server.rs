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

/// What a page of an earlier reading is told.
const RELOADED: &str = "another page has reloaded the files: reload this one";
/// Time between two looks at Ctrl-C.
const PERIOD: Duration = Duration::from_millis(50);
/// What a page may load: its own script and style, known by a word, and answers of this server.
const ALWAYS: &str = "default-src 'none'; img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What is served.
pub(crate) struct Served {
    /// The report comes first, else the page of the session.
    pub(crate) is_report: bool,
    /// A page made of a session.
    pub(crate) reading: Option<Reading>,
    /// A report, whole as it is.
    pub(crate) report: Option<String>,
    /// The shots to make next.
    pub(crate) next: Option<String>,
}

/// A page.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Page {
    Session,
    Report,
    Next,
}

impl Page {
    const ALL: [Self; 3] = [Self::Report, Self::Session, Self::Next];

    /// Its address and what a link to it says.
    fn known_as(self) -> (&'static str, &'static str) {
        match self {
            Self::Session => ("/model", "model and shots"),
            Self::Report => ("/report", "report"),
            Self::Next => ("/next", "next shot"),
        }
    }
}

impl Served {
    fn has(&self, page: Page) -> bool {
        match page {
            Page::Session => self.reading.is_some(),
            Page::Report => self.report.is_some(),
            Page::Next => self.next.is_some(),
        }
    }

    /// The page of an address.
    fn page_at(&self, path: &str) -> Option<Page> {
        let first = if self.is_report { Page::Report } else { Page::Session };
        let page = if path == "/" { Some(first) } else { Page::ALL.into_iter().find(|page| page.known_as().0 == path) };
        page.filter(|page| self.has(*page))
    }

    /// The links to the other pages, as HTML; nothing where there is none.
    fn links(&self, here: Page, token: &str) -> String {
        let all = || Page::ALL.into_iter().filter(|page| self.has(*page));
        if all().count() < 2 {
            return String::new();
        }
        let link = |page: Page| {
            let (path, words) = page.known_as();
            if page == here {
                format!("<b aria-current=\"page\">{words}</b>")
            } else {
                format!("<a href=\"{path}?token={token}\">{words}</a>")
            }
        };
        let links: Vec<String> = all().map(link).collect();
        format!("<nav class=\"pages\" aria-label=\"Pages of this report\">{}</nav>", links.join(" "))
    }
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
    let server =
        Server { guard, served, newest: AtomicU64::new(0), newest_shots: AtomicU64::new(0), last: Mutex::new(None) };
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
    shot: Option<u64>,
    off: Value,
    header: Value,
    rows: Trajectory,
}

struct Server {
    guard: Guard,
    served: Served,
    /// Number of the newest question for a run.
    newest: AtomicU64,
    /// Number of the newest question for all shots.
    newest_shots: AtomicU64,
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
        match (request.method.as_str(), request.path.as_str(), &self.served.reading) {
            ("GET", path, _) => match self.served.page_at(path) {
                Some(page) => self.page(page, request),
                None => Answer::words(404, "there is nothing here"),
            },
            ("POST", "/run" | "/shots", Some(reading)) => match serde_json::from_slice::<Value>(&request.body) {
                Ok(body) => {
                    let (kind, read) = ("application/octet-stream", reading.newest());
                    let numbers =
                        if request.path == "/run" { self.numbers(&read, &body) } else { self.shots(&read, &body) };
                    Answer { status: 200, kind, policy: None, body: bytes(&numbers) }
                }
                Err(_) => Answer::words(400, "the question is not JSON"),
            },
            _ => Answer::words(404, "there is nothing here"),
        }
    }

    fn page(&self, page: Page, request: &Request) -> Answer {
        let links = self.served.links(page, self.guard.token());
        // A report that was written without links to pages of a server gets them before all else.
        let linked = |page: &str| {
            let style = "<style>nav.pages { padding: 6px 20px; display: flex; gap: 14px; font: 14px/1.5 system-ui, sans-serif; }</style>";
            page_of(page.replacen("<body>", &format!("<body>{style}{links}"), 1), "'unsafe-inline'".to_string())
        };
        match (page, &self.served) {
            (Page::Report, Served { report: Some(page), .. }) | (Page::Next, Served { next: Some(page), .. }) => {
                linked(page)
            }
            (_, Served { reading: Some(reading), .. }) => {
                let nonce = match random() {
                    Ok(nonce) => nonce,
                    Err(reason) => return Answer::words(500, &reason),
                };
                let token = self.guard.token();
                let shown = |number| Shown::Served { token, nonce: &nonce, number, links: &links };
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
            _ => Answer::words(404, "there is nothing here"),
        }
    }

    /// The answer to `{"reading": n, "set": {...}, "off": {...}, "shot": k}`: how far all shots are from what was measured, and the curves of one of them.
    fn shots(&self, read: &Read, body: &Value) -> Numbers {
        let Some(beside) = &read.session.beside else { return refused("there are no shots") };
        if body["reading"] != read.number {
            return refused(RELOADED);
        }
        let Some(model) = &read.session.model else { return refused("there is no model that can be run") };
        let number = self.newest_shots.fetch_add(1, Ordering::Relaxed) + 1;
        let stopped = || self.newest_shots.load(Ordering::Relaxed) != number || interrupt::requested();
        let changed = changed(body);
        let others = model.set.iter().filter(|(name, _)| changed.iter().all(|(other, _)| other != name)).cloned();
        let set: Vec<(String, String)> = others.chain(changed.iter().cloned()).collect();
        if let Err(words) = model.within_limits(&set) {
            return refused(&words);
        }
        let off = off(body);
        if let Err(words) = beside.shots.refuse(&off) {
            return refused(&words);
        }
        beside.answer((&model.set, &changed, &off), body["shot"].as_u64().unwrap_or(0) as usize, &stopped)
    }

    /// The answer to `{"reading": n, "set": {...}, "columns": [...]}`, with `"shot": k` under the conditions of a shot and `"off": {...}` with what is off in it, or `{"reading": n, "file": k, "columns": [...]}`.
    fn numbers(&self, read: &Read, body: &Value) -> Numbers {
        let session = &read.session;
        if body["reading"] != read.number {
            return refused(RELOADED);
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
        let (set, chosen, moved) = (&body["set"], body["shot"].as_u64(), &body["off"]);
        let is_asked =
            |own: &Last| own.reading == read.number && own.set == *set && own.shot == chosen && own.off == *moved;
        if !last.as_ref().is_some_and(is_asked) {
            let changed = changed(body);
            let interrupted =
                || Numbers { header: json!({"status": "interrupted", "message": ""}), ..Numbers::default() };
            if stopped() {
                return interrupted();
            }
            let shots = session.beside.as_ref().map(|beside| &beside.shots);
            let shot = chosen.and_then(|shot| shots?.all.get(shot as usize));
            let off = off(body);
            if let Some(Err(words)) = shots.map(|shots| shots.refuse(&off)) {
                return refused(&words);
            }
            let conditions = match (shots, chosen) {
                (Some(shots), Some(number)) if shot.is_some() => shots.conditions(number as usize, &off),
                _ => Vec::new(),
            };
            if shot.is_none() && !model.driven.is_empty() {
                return refused("its inputs were recorded in the shots: choose a shot");
            }
            let (header, rows) = model.run(&changed, shot.map(|shot| (shot, &conditions[..])), &stopped);
            if header["status"] == "interrupted" {
                return interrupted();
            }
            let (set, off) = (set.clone(), moved.clone());
            *last = Some(Last { reading: read.number, set, shot: chosen, off, header, rows });
        }
        match &*last {
            Some(own) => model.numbers(own.header.clone(), &own.rows, &wanted),
            None => refused("there was no run"),
        }
    }
}

/// The parameters that a question sets.
fn changed(body: &Value) -> Vec<(String, String)> {
    let set = body["set"].as_object().into_iter().flatten();
    set.filter_map(|(name, value)| Some((name.clone(), value.as_str()?.to_string()))).collect()
}

/// What a question says to be off.
fn off(body: &Value) -> Vec<(String, f64)> {
    let off = body["off"].as_object().into_iter().flatten();
    off.filter_map(|(name, value)| Some((name.clone(), value.as_f64()?))).collect()
}

fn page_of(page: String, own: String) -> Answer {
    let policy = Some(format!("{ALWAYS}; script-src {own}; style-src {own}"));
    Answer { status: 200, kind: "text/html; charset=utf-8", policy, body: page.into_bytes() }
}

fn refused(words: &str) -> Numbers {
    Numbers { header: json!({"status": "refused", "message": words}), ..Numbers::default() }
}
