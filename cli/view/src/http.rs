//! A server of HTTP/1.1 on the loopback: requests in, answers out, one thread for each connection.
//!
//! Heads of requests are read by `httparse`; what is beyond needs of a page that we wrote (bodies in pieces, upgrades, ranges) is refused.  An answer
//! is written at once and without waiting for more (`TCP_NODELAY`): a page that runs a model while a slider moves would wait for 40 ms otherwise.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// Bytes of a head, number of its lines, bytes of a body.
const LONGEST_HEAD: usize = 32 << 10;
const MOST_HEADERS: usize = 100;
const LONGEST_BODY: usize = 4 << 20;
/// Connections at the same time; a browser opens six.
const MOST_CONNECTIONS: usize = 32;
/// How long a connection may say nothing.
const SILENCE: Duration = Duration::from_secs(60);
/// Stack of a thread: a model may be translated once more there, with whole loops.
const STACK: usize = 32 << 20;

/// What is asked.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Request {
    pub(crate) method: String,
    /// Without what stands behind `?`.
    pub(crate) path: String,
    pub(crate) query: String,
    headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
}

/// A value of a query without its percent signs; what is no Unicode text is shown as such.
fn plain(value: &str) -> String {
    let bytes = value.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let hex = value.get(at + 1..at + 3).filter(|_| byte == b'%');
        match hex.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                at += 3;
            }
            None => {
                out.push(if byte == b'+' { b' ' } else { byte });
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// What is answered.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    /// Media type.
    pub(crate) kind: &'static str,
    /// What the page may load (Content-Security-Policy); none: nothing.
    pub(crate) policy: Option<String>,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    /// A sentence.
    pub(crate) fn words(status: u16, words: &str) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", policy: None, body: format!("{words}\n").into_bytes() }
    }
}

impl Request {
    /// A header; none if it stands there twice, for nobody knows which one counts.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(own, _)| own.eq_ignore_ascii_case(name));
        let first = found.next()?;
        found.next().is_none().then_some(&*first.1)
    }

    /// The values that the query gives a name, as they were before they were made fit for an address.
    pub(crate) fn asked<'a>(&'a self, name: &'a str) -> impl Iterator<Item = String> + 'a {
        let pairs = self.query.split('&').filter_map(|own| own.split_once('='));
        pairs.filter(move |(own, _)| *own == name).map(|(_, value)| plain(value))
    }

    fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|(own, _)| own.eq_ignore_ascii_case(name))
    }
}

/// Answers whoever connects, on threads of its own, as long as the process lives.
///
/// # Errors
/// No thread can be started.
pub(crate) fn serve(
    listener: TcpListener,
    answer: impl Fn(&Request) -> Answer + Send + Sync + 'static,
) -> io::Result<()> {
    let answer = Arc::new(answer);
    let open = Arc::new(AtomicUsize::new(0));
    thread::Builder::new().name("accept".into()).spawn(move || {
        for stream in listener.incoming().flatten() {
            // Who comes when all are busy is sent away, and may come again.
            if open.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
                open.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (answer, count) = (answer.clone(), open.clone());
            let started = thread::Builder::new().name("answer".into()).stack_size(STACK).spawn(move || {
                // A connection that breaks is the matter of its client.
                let _ = converse(&stream, &*answer);
                count.fetch_sub(1, Ordering::Relaxed);
            });
            if started.is_err() {
                open.fetch_sub(1, Ordering::Relaxed);
            }
        }
    })?;
    Ok(())
}

/// Reads requests and answers them until the client has no more.
fn converse(stream: &TcpStream, answer: &dyn Fn(&Request) -> Answer) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(SILENCE))?;
    stream.set_write_timeout(Some(SILENCE))?;
    let mut held = Vec::new();
    loop {
        match next(&mut &*stream, &mut held)? {
            Next::End => return Ok(()),
            Next::Wrong(wrong) => return (&mut &*stream).write_all(&written(&wrong, false)),
            Next::Request(request) => {
                let is_last = request.header("Connection").is_some_and(|own| own.eq_ignore_ascii_case("close"));
                (&mut &*stream).write_all(&written(&answer(&request), !is_last))?;
                if is_last {
                    return Ok(());
                }
            }
        }
    }
}

#[derive(Debug)]
enum Next {
    Request(Request),
    Wrong(Answer),
    End,
}

/// The next request of a stream; `held`: bytes that were read already.
fn next(stream: &mut dyn Read, held: &mut Vec<u8>) -> io::Result<Next> {
    let (length, mut request) = loop {
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut head = httparse::Request::new(&mut headers);
        match head.parse(held) {
            Ok(httparse::Status::Complete(length)) => break (length, read(&head)),
            Ok(httparse::Status::Partial) if held.len() > LONGEST_HEAD => {
                return Ok(Next::Wrong(Answer::words(431, "the head of the request is too long")));
            }
            Ok(httparse::Status::Partial) => {
                if !more(stream, held)? {
                    return Ok(Next::End);
                }
            }
            Err(_) => return Ok(Next::Wrong(Answer::words(400, "this is no request of HTTP/1.1"))),
        }
    };
    if request.has("Transfer-Encoding") {
        return Ok(Next::Wrong(Answer::words(501, "the body must come with its length")));
    }
    let size = match (request.has("Content-Length"), request.header("Content-Length").map(str::parse)) {
        (false, _) => 0,
        (true, Some(Ok(size))) => size,
        (true, _) => return Ok(Next::Wrong(Answer::words(400, "the length of the body is not a number"))),
    };
    if size > LONGEST_BODY {
        return Ok(Next::Wrong(Answer::words(413, "the body is too long")));
    }
    while held.len() < length + size {
        if !more(stream, held)? {
            return Ok(Next::End);
        }
    }
    request.body = held[length..length + size].to_vec();
    held.drain(..length + size);
    Ok(Next::Request(request))
}

/// Reads more bytes; false where there are none.
fn more(stream: &mut dyn Read, held: &mut Vec<u8>) -> io::Result<bool> {
    let mut piece = [0; 16 << 10];
    let count = stream.read(&mut piece)?;
    held.extend_from_slice(&piece[..count]);
    Ok(count > 0)
}

fn read(head: &httparse::Request<'_, '_>) -> Request {
    let target = head.path.unwrap_or_default();
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_string();
    Request {
        method: head.method.unwrap_or_default().to_string(),
        path: path.to_string(),
        query: query.to_string(),
        headers: head.headers.iter().map(|own| (own.name.to_string(), text(own.value))).collect(),
        body: Vec::new(),
    }
}

/// Headers of every answer: nothing is kept, shown in a frame of others, or guessed.
const HEADERS: &str = "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
                       Cross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\n";

fn written(answer: &Answer, goes_on: bool) -> Vec<u8> {
    let reason = match answer.status {
        200 => "OK",
        403 => "Forbidden",
        404 => "Not Found",
        _ => "Refused",
    };
    let policy = answer.policy.as_deref().unwrap_or("default-src 'none'; frame-ancestors 'none'");
    let end = if goes_on { "keep-alive" } else { "close" };
    let head = format!(
        "HTTP/1.1 {} {reason}\r\nContent-Type: {}\r\nContent-Length: {}\r\nContent-Security-Policy: {policy}\r\n{HEADERS}Connection: {end}\r\n\r\n",
        answer.status,
        answer.kind,
        answer.body.len()
    );
    [head.as_bytes(), &answer.body].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<Result<Request, u16>> {
        let (mut stream, mut held, mut found) = (text.as_bytes(), Vec::new(), Vec::new());
        loop {
            match next(&mut stream, &mut held) {
                Ok(Next::Request(request)) => found.push(Ok(request)),
                Ok(Next::Wrong(answer)) => {
                    found.push(Err(answer.status));
                    return found;
                }
                Ok(Next::End) | Err(_) => return found,
            }
        }
    }

    #[test]
    fn requests_of_one_connection_are_read_one_by_one() {
        let text = "POST /run?a=b HTTP/1.1\r\nHost: x\r\nContent-Length: 3\r\n\r\nabcGET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\nGET /cut";
        let found = all(text);
        let [Ok(first), Ok(second)] = found.as_slice() else { panic!("{found:?}") };
        assert_eq!((first.method.as_str(), first.path.as_str(), first.query.as_str()), ("POST", "/run", "a=b"));
        assert_eq!((first.body.as_slice(), first.header("host")), (&b"abc"[..], Some("x")));
        assert_eq!((second.body.len(), second.header("Host")), (0, None), "which host counts?");
    }

    #[test]
    fn a_query_gives_a_name_its_values() {
        let request =
            Request { query: "token=ab&set=n%3D2+%2B%201&set=%E2%82%ac%zz&sets=3&set".into(), ..Request::default() };
        assert_eq!(request.asked("set").collect::<Vec<_>>(), ["n=2 + 1", "€%zz"]);
        assert_eq!(request.asked("token").next().as_deref(), Some("ab"));
    }

    #[test]
    fn what_a_page_never_sends_is_refused() {
        let refused = |text: &str| match all(text).pop() {
            Some(Err(status)) => status,
            other => panic!("{other:?}"),
        };
        assert_eq!(refused("no request at all\r\n\r\n"), 400);
        assert_eq!(refused("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"), 501);
        assert_eq!(refused("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"), 400);
        assert_eq!(refused("POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nab"), 400);
        assert_eq!(refused("POST / HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n"), 413);
        assert_eq!(refused(&format!("GET / HTTP/1.1\r\nX: {}", "a".repeat(LONGEST_HEAD + 1))), 431);
    }

    #[test]
    fn an_answer_is_one_piece_with_its_length() {
        let text = String::from_utf8(written(&Answer::words(403, "no"), true)).unwrap_or_default();
        assert!(text.starts_with("HTTP/1.1 403 Forbidden\r\n") && text.ends_with("\r\n\r\nno\n"), "{text}");
        assert!(text.contains("Content-Length: 3\r\n") && text.contains("default-src 'none'"), "{text}");
    }
}
