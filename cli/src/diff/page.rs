//! Changes as a page in one file: a section for each class, a row for each change, what was said beside what is said.

use std::fmt::Write as _;

use hyd_doc::html::escape;

use super::Change;

const STYLE: &str = include_str!("page.css");

/// The page; `names`: what was compared with what.
pub(super) fn page(changes: &[Change], names: [&str; 2]) -> String {
    let [first, second] = names.map(escape);
    let title = format!("{first} → {second}");
    let count = match changes.len() {
        0 => "The models are the same.".to_string(),
        1 => "One change in the models.".to_string(),
        many => format!("{many} changes in the models."),
    };
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
         <style>{STYLE}</style></head><body>\n<header><h1>Changes of models</h1><p>{title}</p><p>{count} \
         Layout, comments, order and graphics do not count.</p></header>\n<main>\n"
    );
    for class in changes.chunk_by(|one, other| one.class == other.class) {
        let name = class.first().map_or("", |change| change.class.as_str());
        let _ = writeln!(
            page,
            "<section><h2>{}</h2><table><thead><tr><th scope=\"col\">what</th><th scope=\"col\">before</th><th scope=\"col\">after</th></tr></thead><tbody>",
            escape(name)
        );
        for change in class {
            let side = |tag: &str, says: &Option<String>| {
                says.as_ref().map_or_else(String::new, |says| format!("<{tag}><code>{}</code></{tag}>", escape(says)))
            };
            let named = match change.name.is_empty() {
                true => String::new(),
                false => format!("<small>{}</small>", escape(&change.name)),
            };
            let (before, after) = (side("del", &change.before), side("ins", &change.after));
            let word = change.kind.word();
            let _ = writeln!(page, "<tr><th scope=\"row\">{word}{named}</th><td>{before}</td><td>{after}</td></tr>");
        }
        page.push_str("</tbody></table></section>\n");
    }
    page.push_str("</main></body></html>\n");
    page
}
