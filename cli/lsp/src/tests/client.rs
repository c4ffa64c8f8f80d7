//! A client: what an editor sends, and what comes back.

use std::path::Path;
use std::thread::JoinHandle;
use std::time::Duration;

use lsp_server::{Connection, Message, Notification, Request, RequestId, Response};
use serde_json::{Value, json};

use crate::documents::uri_of;
use crate::{Options, serve};

/// Longer than any answer takes on a machine that has other work.
const PATIENCE: Duration = Duration::from_secs(60);

pub(super) struct Client {
    connection: Connection,
    server: Option<JoinHandle<Result<bool, String>>>,
    count: i32,
    /// What was published last: address, version, messages.
    published: Vec<(String, i64, Value)>,
}

impl Client {
    /// A server over a folder.
    pub(super) fn start(folder: &Path) -> Self {
        let (connection, other) = Connection::memory();
        let options = Options { built_in: Some(folder.join("built-in")), ..Options::default() };
        let server = std::thread::spawn(move || serve(&other, &options));
        let mut client = Self { connection, server: Some(server), count: 0, published: Vec::new() };
        let folders = json!([{ "uri": address(folder), "name": "all" }]);
        client.ask("initialize", json!({ "capabilities": {}, "workspaceFolders": folders })).expect("a good beginning");
        client.tell("initialized", json!({}));
        client
    }

    pub(super) fn tell(&self, method: &str, params: Value) {
        let message = Notification { method: method.to_string(), params };
        self.connection.sender.send(message.into()).expect("the server listens");
    }

    /// The answer to a request, or what it was refused with.
    pub(super) fn ask(&mut self, method: &str, params: Value) -> Result<Value, String> {
        self.count += 1;
        let id = RequestId::from(self.count);
        let request = Request { id: id.clone(), method: method.to_string(), params };
        self.connection.sender.send(request.into()).expect("the server listens");
        loop {
            if let Message::Response(response) = self.next()
                && response.id == id
            {
                return result(response);
            }
        }
    }

    fn next(&mut self) -> Message {
        let message = self.connection.receiver.recv_timeout(PATIENCE).expect("the server answers");
        if let Message::Notification(Notification { method, params }) = &message {
            assert_ne!(method, "window/logMessage", "{params}");
            if method == "textDocument/publishDiagnostics" {
                let uri = params["uri"].as_str().unwrap_or_default().to_string();
                self.published.retain(|(known, ..)| *known != uri);
                let version = params["version"].as_i64().unwrap_or(-1);
                self.published.push((uri, version, params["diagnostics"].clone()));
            }
        }
        message
    }

    pub(super) fn open(&self, file: &Path, text: &str) {
        let document = json!({ "uri": address(file), "languageId": "hyd", "version": 0, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    /// The messages of a state of a document.
    pub(super) fn messages(&mut self, file: &Path, version: i64) -> Value {
        let uri = address(file);
        loop {
            let known = self.published.iter().find(|(known, at, _)| *known == uri && *at == version);
            if let Some((.., messages)) = known {
                return messages.clone();
            }
            self.next();
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        self.ask("shutdown", Value::Null).expect("an end");
        // What the client was asked before may be answered only now.
        let late = Response::new_ok(RequestId::from("hints".to_string()), Value::Null);
        self.connection.sender.send(late.into()).expect("the server listens");
        self.tell("exit", Value::Null);
        let ended = self.server.take().expect("started once").join();
        assert!(ended.expect("no fault").is_ok());
    }
}

fn result(response: Response) -> Result<Value, String> {
    let response = serde_json::to_value(response).expect("plain data");
    match response.get("error") {
        Some(error) => Err(error.to_string()),
        None => Ok(response["result"].clone()),
    }
}

pub(super) fn address(path: &Path) -> String {
    uri_of(path).expect("an absolute path").as_str().to_string()
}
