//! Pieces of HTML: escaped texts, links, and the markup that descriptions of classes may hold.

use crate::entities::decoded;

/// Text in which nothing is markup.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            // What XML knows no place for.
            c if c.is_control() && !matches!(c, '\n' | '\t' | '\r') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Tags that are kept; all others are shown as text.
const TAGS: [&str; 26] = [
    "p",
    "b",
    "i",
    "em",
    "strong",
    "code",
    "pre",
    "ul",
    "ol",
    "li",
    "sub",
    "sup",
    "h1",
    "h2",
    "h3",
    "h4",
    "h5",
    "h6",
    "table",
    "thead",
    "tbody",
    "tr",
    "td",
    "th",
    "blockquote",
    "br",
];

/// The markup of a `Documentation` annotation: known tags without attributes, balanced; everything else as text.
pub fn documentation(info: &str) -> String {
    let mut out = String::new();
    let mut open: Vec<String> = Vec::new();
    let mut rest = info;
    while let Some(at) = rest.find('<') {
        out.push_str(&text(&rest[..at]));
        let Some((name, closing, length)) = tag(&rest[at..]) else {
            out.push_str("&lt;");
            rest = &rest[at + 1..];
            continue;
        };
        rest = &rest[at + length..];
        if name == "br" {
            out.push_str("<br/>");
        } else if !closing && TAGS.contains(&name.as_str()) {
            out.push_str(&format!("<{name}>"));
            open.push(name);
        } else if closing && let Some(depth) = open.iter().rposition(|other| *other == name) {
            open.drain(depth..).rev().for_each(|name| out.push_str(&format!("</{name}>")));
        }
    }
    out.push_str(&text(rest));
    open.iter().rev().for_each(|name| out.push_str(&format!("</{name}>")));
    out
}

/// Text between tags, in which `&lt;` and its like stand for characters.
fn text(text: &str) -> String {
    escape(&decoded(text))
}

/// Name of the tag at the start, whether it closes, and its length; none if it is not a tag.
fn tag(text: &str) -> Option<(String, bool, usize)> {
    let end = text.find('>')?;
    let inner = &text[1..end];
    let (inner, closing) = inner.strip_prefix('/').map_or((inner, false), |rest| (rest, true));
    let name: String = inner.chars().take_while(char::is_ascii_alphanumeric).collect();
    let known = inner.chars().next().is_some_and(|c| c.is_ascii_alphabetic());
    known.then(|| (name.to_lowercase(), closing, end + 1))
}
