//! The server: what comes from the editor, and the two threads that work for it.
//!
//! This thread reads messages, keeps the documents and hands copies of them on; it never waits for the compiler.  One thread checks
//! documents (`checker`), another one answers requests (`requests`), each with syntax trees of its own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::RecvTimeoutError;
use hyd_source::did_you_mean;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{self, Notification as _};
use lsp_types::request::{self, Request as _};
use lsp_types::{
    ClientCapabilities, DidChangeTextDocumentParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
    InitializeParams, LogMessageParams, MessageType, NumberOrString, PositionEncodingKind, PublishDiagnosticsParams,
    ResourceOperationKind, ShowDocumentParams, ShowMessageParams, Uri,
};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::capabilities::capabilities;
use crate::check::Checked;
use crate::checker::{Checker, Listener, Results, locked};
use crate::documents::{Document, Documents, path_of};
use crate::lines::Encoding;
use crate::requests::{Answer, Client, Job, Pending, Requests};
use crate::session::Settings;

/// Stack of a thread that translates: expressions may be nested as deep as the language's limits allow.
const STACK: usize = 32 << 20;

/// What an editor can set: the last three are of the extension.
const SETTINGS: [&str; 6] = ["library", "allowOutside", "strictUnits", "commands", "path", "trace"];

type Outgoing = crossbeam_channel::Sender<Message>;

/// How long the threads may take to end what they are doing; one that translates cannot be broken off.
const FAREWELL: Duration = Duration::from_millis(500);

/// How long a client may take to say `exit` after `shutdown`.
const LAST_WORD: Duration = Duration::from_secs(30);

/// Serves a connection until the client ends it; false where a thread is still at work then.  `settings`: what the command line says.
///
/// # Errors
/// What is wrong with the connection.
pub(crate) fn serve(connection: &Connection, settings: Settings) -> Result<bool, String> {
    let said = |error: lsp_server::ProtocolError| error.to_string();
    let (id, params) = connection.initialize_start().map_err(said)?;
    let params: InitializeParams = match serde_json::from_value(params) {
        Ok(params) => params,
        Err(error) => {
            let response = Response::new_err(id, ErrorCode::InvalidParams as i32, error.to_string());
            let _ = connection.sender.send(response.into());
            return Err(error.to_string());
        }
    };
    let (settings, client) = agreed(settings, &params);
    let answer = json!({
        "capabilities": capabilities(settings.encoding),
        "serverInfo": { "name": "hyd", "version": env!("CARGO_PKG_VERSION") },
    });
    connection.initialize_finish(id, answer).map_err(said)?;
    let server = Server::start(connection.sender.clone(), settings, client)?;
    server.run(connection)
}

/// What client and command line say together.
fn agreed(mut settings: Settings, params: &InitializeParams) -> (Settings, Client) {
    let ClientCapabilities { general, workspace, window, .. } = &params.capabilities;
    let encodings = general.as_ref().and_then(|general| general.position_encodings.as_deref()).unwrap_or_default();
    if encodings.contains(&PositionEncodingKind::UTF8) {
        settings.encoding = Encoding::Utf8;
    }
    let folders = params.workspace_folders.iter().flatten().map(|folder| path_of(&folder.uri));
    settings.folders.extend(folders);
    // Older clients name one folder only.
    #[allow(deprecated)]
    if let (true, Some(root)) = (settings.folders.is_empty(), &params.root_uri) {
        settings.folders.push(path_of(root));
    }
    let options = params.initialization_options.clone().unwrap_or_default();
    settings.take(&options);
    let commands = options.get("commands").and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let own = options.get("hyd").unwrap_or(&options).as_object();
    let names = own.into_iter().flat_map(|own| own.keys());
    let edit = workspace.as_ref().and_then(|workspace| workspace.workspace_edit.as_ref());
    let operations = edit.and_then(|edit| edit.resource_operations.as_deref()).unwrap_or_default();
    let workspace = workspace.as_ref();
    let hints = workspace.and_then(|workspace| workspace.inlay_hint.as_ref());
    let watched = workspace.and_then(|workspace| workspace.did_change_watched_files.as_ref());
    let client = Client {
        unknown_settings: names.filter(|name| !SETTINGS.contains(&name.as_str())).cloned().collect(),
        commands: commands.iter().filter_map(|command| command.as_str().map(str::to_string)).collect(),
        renames_files: operations.contains(&ResourceOperationKind::Rename),
        shows_files: window.as_ref().and_then(|window| window.show_document.as_ref()).is_some_and(|own| own.support),
        refreshes_hints: hints.and_then(|hints| hints.refresh_support).unwrap_or_default(),
        watches_files: watched.and_then(|watched| watched.dynamic_registration).unwrap_or_default(),
    };
    (settings, client)
}

impl Settings {
    /// Takes over what an editor is set to; what it does not say stays.
    fn take(&mut self, options: &Value) {
        let options = options.get("hyd").unwrap_or(options);
        if let Some(folders) = options.get("library").and_then(Value::as_array) {
            let root = self.folders.first().cloned().unwrap_or_default();
            let folder = |folder: &Value| folder.as_str().map(|folder| root.join(folder));
            for folder in folders.iter().filter_map(folder) {
                if !self.libraries.contains(&folder) {
                    self.libraries.push(folder);
                }
            }
        }
        let flag = |name: &str| options.get(name).and_then(Value::as_bool);
        self.allow_outside = flag("allowOutside").unwrap_or(self.allow_outside);
        self.strict_units = flag("strictUnits").unwrap_or(self.strict_units);
    }
}

struct Server {
    outgoing: Outgoing,
    documents: Documents,
    settings: Arc<Settings>,
    checker: Checker,
    jobs: Option<Sender<Job>>,
    pending: Pending,
    results: Results,
    threads: Vec<thread::JoinHandle<()>>,
    client: Client,
}

impl Server {
    fn start(outgoing: Outgoing, settings: Settings, client: Client) -> Result<Self, String> {
        let results: Results = Arc::new(Mutex::new(BTreeMap::new()));
        let pending = Pending::default();
        let checker = Checker::default();
        let (jobs, received) = channel::<Job>();
        let failed = |error: std::io::Error| format!("no thread can be started: {error}");
        let builder = |name: &str| thread::Builder::new().name(name.to_string()).stack_size(STACK);
        let speaker = Speaker { outgoing: outgoing.clone(), refreshes_hints: client.refreshes_hints };
        let (own, known) = (checker.clone(), results.clone());
        let checking = builder("check").spawn(move || own.run(&known, &speaker)).map_err(failed)?;
        let mut requests = Requests::new(results.clone(), pending.clone(), client.clone());
        let (answers, shows_files) = (outgoing.clone(), client.shows_files);
        let answering = builder("answer").spawn(move || {
            for job in received {
                send_answer(&answers, requests.answer(job), shows_files);
            }
        });
        let threads = vec![checking, answering.map_err(failed)?];
        let (settings, jobs) = (Arc::new(settings), Some(jobs));
        let documents = Documents::default();
        let server = Self { outgoing, documents, settings, checker, jobs, pending, results, threads, client };
        server.complain_of_settings();
        server.complain_of_libraries();
        if server.client.watches_files {
            server.watch_files();
        }
        Ok(server)
    }

    fn run(mut self, connection: &Connection) -> Result<bool, String> {
        let mut ended = Ok(());
        for message in &connection.receiver {
            match message {
                Message::Request(request) if request.method == request::Shutdown::METHOD => {
                    ended = farewell(connection, request.id);
                    break;
                }
                Message::Request(request) => self.request(request),
                Message::Notification(notification) => self.notification(notification),
                Message::Response(_) => {}
            }
        }
        self.checker.end();
        self.jobs = None;
        let begin = Instant::now();
        while begin.elapsed() < FAREWELL && !self.threads.iter().all(thread::JoinHandle::is_finished) {
            thread::sleep(Duration::from_millis(1));
        }
        ended.map(|()| self.threads.iter().all(thread::JoinHandle::is_finished))
    }

    fn request(&self, request: Request) {
        locked(&self.pending).insert(request.id.clone(), false);
        let job = Job { request, documents: self.documents.clone(), settings: self.settings.clone() };
        let Some(jobs) = &self.jobs else { return };
        if let Err(lost) = jobs.send(job) {
            let response = Response::new_err(
                lost.0.request.id,
                ErrorCode::InternalError as i32,
                "the server has lost the thread that answers".into(),
            );
            let _ = self.outgoing.send(response.into());
        }
    }

    fn notification(&mut self, notification: Notification) {
        match notification.method.as_str() {
            notification::DidOpenTextDocument::METHOD => {
                let Some(params) = params::<DidOpenTextDocumentParams>(notification) else { return };
                let item = params.text_document;
                let document = Document::new(item.uri, item.version, item.text);
                let path = document.path.clone();
                self.documents.put(document);
                self.checker.changed(&self.documents, &self.settings, path, None);
            }
            notification::DidChangeTextDocument::METHOD => {
                let Some(params) = params::<DidChangeTextDocumentParams>(notification) else { return };
                self.change(&params);
            }
            notification::DidCloseTextDocument::METHOD => {
                let Some(params) = params::<DidCloseTextDocumentParams>(notification) else { return };
                let uri = params.text_document.uri;
                self.documents.close(&uri);
                locked(&self.results).remove(&path_of(&uri));
                self.checker.all(&self.documents, &self.settings);
                publish(&self.outgoing, uri, None, Vec::new());
            }
            notification::DidSaveTextDocument::METHOD | notification::DidChangeWatchedFiles::METHOD => {
                self.checker.all(&self.documents, &self.settings);
            }
            notification::DidChangeConfiguration::METHOD => {
                let mut settings = Settings::clone(&self.settings);
                settings.take(notification.params.get("settings").unwrap_or(&Value::Null));
                self.settings = Arc::new(settings);
                self.complain_of_libraries();
                self.checker.all(&self.documents, &self.settings);
            }
            notification::Cancel::METHOD => {
                let id = notification.params.get("id").cloned();
                if let Some(id) = id.and_then(|id| serde_json::from_value::<NumberOrString>(id).ok()) {
                    let id = match id {
                        NumberOrString::Number(id) => RequestId::from(id),
                        NumberOrString::String(id) => RequestId::from(id),
                    };
                    // One that has its answer needs no more.
                    locked(&self.pending).entry(id).and_modify(|taken_back| *taken_back = true);
                }
            }
            _ => {}
        }
    }

    fn change(&mut self, params: &DidChangeTextDocumentParams) {
        let identifier = &params.text_document;
        let Some(document) = self.documents.get(&identifier.uri) else { return };
        let encoding = self.settings.encoding;
        let after = document.changed(identifier.version, &params.content_changes, encoding);
        let last = params.content_changes.last().and_then(|change| change.range);
        let byte = last.map(|range| after.lines.byte(&after.text, range.start, encoding));
        let path = after.path.clone();
        self.documents.put(after);
        self.checker.changed(&self.documents, &self.settings, path, byte);
    }

    /// Says which settings are not known.
    fn complain_of_settings(&self) {
        for name in &self.client.unknown_settings {
            let hint = did_you_mean(name, SETTINGS).map_or_else(String::new, |hint| format!("; {hint}"));
            let message = format!("the setting `{name}` is not known{hint}");
            notify::<notification::ShowMessage>(
                &self.outgoing,
                ShowMessageParams { typ: MessageType::WARNING, message },
            );
        }
    }

    /// Says which folders of libraries cannot be used.
    fn complain_of_libraries(&self) {
        for folder in self.settings.libraries.iter().filter(|folder| !folder.is_dir()) {
            let message = format!("there is no library folder `{}`", folder.display());
            let params = ShowMessageParams { typ: MessageType::WARNING, message };
            notify::<notification::ShowMessage>(&self.outgoing, params);
        }
    }

    /// Asks to be told of model files that change outside of the editor.
    fn watch_files(&self) {
        let watchers = json!([{ "globPattern": "**/*.{hyd,mo}" }]);
        let registration = json!({
            "id": "hyd-files",
            "method": "workspace/didChangeWatchedFiles",
            "registerOptions": { "watchers": watchers },
        });
        let params = json!({ "registrations": [registration] });
        let id = RequestId::from("hyd-files".to_string());
        let request = Request::new(id, request::RegisterCapability::METHOD.into(), params);
        let _ = self.outgoing.send(request.into());
    }
}

/// Agrees to the end and waits for it.  Answers of the client to what it was asked before, as to ask for hints again, may still come in
/// between, and notifications that crossed with its request.
fn farewell(connection: &Connection, id: RequestId) -> Result<(), String> {
    let _ = connection.sender.send(Response::new_ok(id, Value::Null).into());
    let until = Instant::now() + LAST_WORD;
    loop {
        match connection.receiver.recv_deadline(until) {
            Ok(Message::Notification(notification)) if notification.method == notification::Exit::METHOD => {
                return Ok(());
            }
            Ok(Message::Request(request)) => {
                let refusal = "the server has been shut down".into();
                let response = Response::new_err(request.id, ErrorCode::InvalidRequest as i32, refusal);
                let _ = connection.sender.send(response.into());
            }
            Ok(Message::Notification(_) | Message::Response(_)) => {}
            Err(RecvTimeoutError::Timeout) => return Err("the client did not say `exit` after `shutdown`".into()),
            // A client that has gone has ended.
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
}

/// Tells the editor what checks find.
struct Speaker {
    outgoing: Outgoing,
    refreshes_hints: bool,
}

impl Listener for Speaker {
    fn checked(&self, checked: &Arc<Checked>, whole: bool) {
        let diagnostics = checked.items.iter().map(|item| item.diagnostic.clone()).collect();
        // What is still to come belongs to this state of the document, too: only the whole names it.
        publish(&self.outgoing, checked.uri.clone(), whole.then_some(checked.version), diagnostics);
        if whole && self.refreshes_hints {
            let id = RequestId::from(format!("hints {} {}", checked.path.display(), checked.version));
            let request = Request::new(id, request::InlayHintRefreshRequest::METHOD.into(), Value::Null);
            let _ = self.outgoing.send(request.into());
        }
    }

    fn fault(&self, sentence: String) {
        log(&self.outgoing, sentence);
    }
}

fn send_answer(outgoing: &Outgoing, answer: Answer, shows_files: bool) {
    if let Some(sentence) = answer.fault {
        log(outgoing, sentence);
    }
    let shown = answer.shown.filter(|_| shows_files);
    // A client that has gone needs no answer.
    let _ = outgoing.send(answer.response.into());
    if let Some(uri) = shown {
        let id = RequestId::from(format!("show {}", uri.as_str()));
        let params = ShowDocumentParams { uri, external: None, take_focus: Some(true), selection: None };
        let _ = outgoing.send(Request::new(id, request::ShowDocument::METHOD.into(), params).into());
    }
}

fn publish(outgoing: &Outgoing, uri: Uri, version: Option<i32>, diagnostics: Vec<lsp_types::Diagnostic>) {
    let params = PublishDiagnosticsParams { uri, diagnostics, version };
    notify::<notification::PublishDiagnostics>(outgoing, params);
}

fn log(outgoing: &Outgoing, message: String) {
    notify::<notification::LogMessage>(outgoing, LogMessageParams { typ: MessageType::ERROR, message });
}

fn notify<N: notification::Notification>(outgoing: &Outgoing, params: N::Params) {
    // A client that has gone needs no message.
    let _ = outgoing.send(Notification::new(N::METHOD.to_string(), params).into());
}

/// What a notification says; one that cannot be understood is passed over, as there is nobody to answer.
fn params<P: DeserializeOwned>(notification: Notification) -> Option<P> {
    serde_json::from_value(notification.params).ok()
}

/// Where texts of the built-in library are laid down: beside other caches of the user.
pub(crate) fn built_in_folder() -> PathBuf {
    let set = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = set("XDG_CACHE_HOME").or_else(|| set("LOCALAPPDATA"));
    let cache = cache.or_else(|| set("HOME").map(|home| home.join(".cache"))).unwrap_or_else(std::env::temp_dir);
    cache.join("hyd").join(Path::new(concat!("library-", env!("CARGO_PKG_VERSION"))))
}

#[cfg(test)]
mod tests {
    use lsp_types::InitializeParams;
    use serde_json::json;

    use super::agreed;
    use crate::session::Settings;

    /// A setting that is misspelt is told, with or without the name of the server around it.
    #[test]
    fn settings_that_are_not_known_are_found() {
        let unknown = |options: serde_json::Value| {
            let params = InitializeParams { initialization_options: Some(options), ..InitializeParams::default() };
            let (settings, client) = agreed(Settings::default(), &params);
            (settings.strict_units, client.unknown_settings)
        };
        let own = json!({ "librarys": ["a"], "strictUnits": true, "commands": [] });
        assert_eq!(unknown(own.clone()), (true, vec!["librarys".to_string()]));
        assert_eq!(unknown(json!({ "hyd": own, "editor": {} })), (true, vec!["librarys".to_string()]));
        assert_eq!(unknown(json!({ "library": [], "allowOutside": false })), (false, Vec::new()));
    }
}
