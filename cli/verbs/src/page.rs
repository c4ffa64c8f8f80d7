//! Pages that work without a network: a frame with style, script and data inside.

use serde_json::Value;

const FRAME: &str = include_str!("page/frame.html");
/// The style of pages.
pub const STYLE: &str = include_str!("page/page.css");

/// A page with this title; its script finds `data` as `DATA`, writes the headline into `#sentence`, a line below it into `#about` and the
/// rest into `#main`.
pub fn framed(title: &str, style: &str, script: &str, data: &Value) -> String {
    // In a script nothing may look like the end of the script.
    let data = data.to_string().replace("</", "<\\/").replace("<!--", "<\\!--");
    // The data may hold anything and come last, so that nothing in them is taken for a mark.
    let page = FRAME.replacen("/*TITLE*/", title, 1).replacen("/*STYLE*/", style, 1).replacen("/*SCRIPT*/", script, 1);
    page.replacen("/*DATA*/null", &data, 1)
}
