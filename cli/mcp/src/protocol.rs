//! Messages of the protocol: JSON-RPC 2.0, one message a line, in the versions with a handshake (2024-11-05 to 2025-11-25) and in that without
//! (2026-07-28), where every request says which version it is of.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use serde_json::{Map, Value, json};

/// Versions that begin with `initialize`, the newest last.
pub(crate) const HANDSHAKE: [&str; 4] = ["2024-11-05", "2025-03-26", "2025-06-18", "2025-11-25"];
/// The version whose requests stand for themselves.
pub(crate) const STATELESS: &str = "2026-07-28";
/// Where a request says its version.
const VERSION: &str = "io.modelcontextprotocol/protocolVersion";
/// Where an answer says whose it is.
const SERVER: &str = "io.modelcontextprotocol/serverInfo";

/// Numbers of errors.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Code {
    Parse = -32700,
    Request = -32600,
    Method = -32601,
    Params = -32602,
    Internal = -32603,
    Version = -32022,
}

/// An error of the protocol.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Fault {
    pub(crate) code: Code,
    pub(crate) message: String,
    pub(crate) data: Option<Value>,
}

impl Fault {
    pub(crate) fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), data: None }
    }
}

/// What a message is.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Message {
    /// Wants an answer.
    Request(Request),
    /// Wants none.
    Notification(String, Value),
    /// An answer to a question that was never put.
    Answer,
    /// No message of the protocol: what its sender is told, by the number it gave, if any.
    Wrong(Value, Fault),
}

/// What wants an answer.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Request {
    pub(crate) id: Value,
    pub(crate) method: String,
    pub(crate) params: Map<String, Value>,
}

impl Request {
    /// The version that the request says it is of; none in versions with a handshake.
    pub(crate) fn version(&self) -> Option<&str> {
        self.params.get("_meta")?.get(VERSION)?.as_str()
    }

    /// By which the client wants to hear how far the work has come.
    pub(crate) fn progress_token(&self) -> Option<Value> {
        let token = self.params.get("_meta")?.get("progressToken")?;
        (token.is_string() || token.is_number()).then(|| token.clone())
    }

    /// The line of an answer.
    pub(crate) fn answer(&self, result: Result<Value, Fault>) -> Value {
        match result {
            Ok(mut result) => {
                if self.version().is_some()
                    && let Value::Object(own) = &mut result
                {
                    own.insert("resultType".into(), "complete".into());
                    own.insert("_meta".into(), json!({ SERVER: server_info() }));
                }
                json!({"jsonrpc": "2.0", "id": self.id, "result": result})
            }
            Err(fault) => error(&self.id, &fault),
        }
    }
}

/// Who answers.
pub(crate) fn server_info() -> Value {
    json!({"name": "hyd", "title": "hyd: models of physical systems", "version": env!("CARGO_PKG_VERSION")})
}

/// The line of an error.
pub(crate) fn error(id: &Value, fault: &Fault) -> Value {
    let mut own = json!({"code": fault.code as i32, "message": fault.message});
    if let Some(data) = &fault.data {
        own["data"] = data.clone();
    }
    json!({"jsonrpc": "2.0", "id": id, "error": own})
}

/// Reads a line.
pub(crate) fn read(line: &[u8]) -> Message {
    let wrong = |id: Value, code: Code, message: String| Message::Wrong(id, Fault::new(code, message));
    let message: Value = match serde_json::from_slice(line) {
        Ok(message) => message,
        Err(error) => return wrong(Value::Null, Code::Parse, format!("the line is not JSON: {error}")),
    };
    let Value::Object(mut message) = message else {
        let sentence = "a message is one JSON object; batches are not taken";
        return wrong(Value::Null, Code::Request, sentence.into());
    };
    let id = message.remove("id");
    let is_id = id.as_ref().is_none_or(|id| id.is_string() || id.is_i64() || id.is_u64());
    let known = id.clone().filter(|_| is_id).unwrap_or_default();
    if message.get("jsonrpc").and_then(Value::as_str) != Some("2.0") {
        return wrong(known, Code::Request, "`jsonrpc` must be \"2.0\"".into());
    }
    let Some(method) = message.remove("method") else {
        let is_answer = message.contains_key("result") || message.contains_key("error");
        return match is_answer {
            true => Message::Answer,
            false => wrong(known, Code::Request, "a request needs a `method`".into()),
        };
    };
    let Value::String(method) = method else {
        return wrong(known, Code::Request, "`method` must be a string".into());
    };
    let params = message.remove("params");
    match (id, params) {
        (None, params) => Message::Notification(method, params.unwrap_or_default()),
        (Some(_), _) if !is_id => wrong(Value::Null, Code::Request, "`id` must be a string or an integer".into()),
        (Some(id), None) => Message::Request(Request { id, method, params: Map::new() }),
        (Some(id), Some(Value::Object(params))) => Message::Request(Request { id, method, params }),
        (Some(id), Some(_)) => wrong(id, Code::Params, "`params` must be an object".into()),
    }
}

/// The way out, which several threads use; one message a line.
pub(crate) struct Outgoing {
    writer: Mutex<Box<dyn Write + Send>>,
    closed: AtomicBool,
}

impl Outgoing {
    pub(crate) fn new(writer: impl Write + Send + 'static) -> Self {
        Self { writer: Mutex::new(Box::new(writer)), closed: AtomicBool::new(false) }
    }

    /// Writes a message; one that nobody reads any more is dropped.
    pub(crate) fn send(&self, message: &Value) {
        let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        if self.is_closed() {
            return;
        }
        if writer.write_all(format!("{message}\n").as_bytes()).and_then(|()| writer.flush()).is_err() {
            self.closed.store(true, Ordering::Relaxed);
        }
    }

    /// True when nobody reads any more.
    pub(crate) fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(line: &str) -> Option<Code> {
        match read(line.as_bytes()) {
            Message::Wrong(_, fault) => Some(fault.code),
            _ => None,
        }
    }

    #[test]
    fn what_is_no_message_is_told_so() {
        assert_eq!(code("{"), Some(Code::Parse));
        assert_eq!(code(&"[".repeat(1000)), Some(Code::Parse));
        assert_eq!(code("[]"), Some(Code::Request));
        assert_eq!(code("7"), Some(Code::Request));
        assert_eq!(code(r#"{"id": 1, "method": "ping"}"#), Some(Code::Request));
        assert_eq!(code(r#"{"jsonrpc": "2.0", "id": 1}"#), Some(Code::Request));
        assert_eq!(code(r#"{"jsonrpc": "2.0", "id": 1, "method": 3}"#), Some(Code::Request));
        assert_eq!(code(r#"{"jsonrpc": "2.0", "id": [1], "method": "ping"}"#), Some(Code::Request));
        assert_eq!(code(r#"{"jsonrpc": "2.0", "id": null, "method": "ping"}"#), Some(Code::Request));
        assert_eq!(code(r#"{"jsonrpc": "2.0", "id": 1, "method": "ping", "params": [1]}"#), Some(Code::Params));
        assert_eq!(code(r#"{"jsonrpc": "2.0", "id": 1, "method": "ping"}"#), None);
        assert_eq!(read(br#"{"jsonrpc": "2.0", "id": 1, "result": {}}"#), Message::Answer);
    }

    #[test]
    fn answers_say_what_their_version_wants() {
        let request = |params: Value| Request {
            id: json!("a"),
            method: "tools/list".into(),
            params: params.as_object().cloned().unwrap_or_default(),
        };
        let old = request(json!({})).answer(Ok(json!({"tools": []})));
        assert_eq!(old, json!({"jsonrpc": "2.0", "id": "a", "result": {"tools": []}}));
        let new = request(json!({"_meta": {VERSION: STATELESS}})).answer(Ok(json!({"tools": []})));
        assert_eq!(new["result"]["resultType"], "complete");
        assert_eq!(new["result"]["_meta"][SERVER]["name"], "hyd");
    }
}
