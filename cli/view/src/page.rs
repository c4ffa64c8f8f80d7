//! The page: data of a session in front of the scripts that show it.
//!
//! Page, style and scripts (`page/*`) are files of their own; they are put together here.  The page that is served asks for runs; the one that is
//! written holds its runs and asks for nothing, which a policy in its head enforces.

use std::collections::{BTreeMap, BTreeSet};

use hyd_source::Files;
use hyd_system::{Place, Tables};
use serde_json::{Value, json};

use crate::diagram::arrange::arrange;
use crate::diagram::svg::draw;
use crate::encode::{base64, bytes};
use crate::session::{Model, Session};
use crate::variables;

const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPTS: [&str; 9] = [
    include_str!("page/numbers.js"),
    include_str!("page/runs.js"),
    include_str!("page/plot.js"),
    include_str!("page/diagram.js"),
    include_str!("page/lists.js"),
    include_str!("page/shots.js"),
    include_str!("page/slack.js"),
    include_str!("page/next.js"),
    include_str!("page/page.js"),
];
/// Characters of all diagrams of a page.
const MOST_DRAWN: usize = 6_000_000;
/// Equations that a page lists.
const MOST_EQUATIONS: usize = 5000;
/// Characters of an equation.
const LONGEST_EQUATION: usize = 2000;
/// Numbers that a written page holds of one run: twelve megabytes.
const MOST_NUMBERS: usize = 3_000_000;

/// Who shows the page.
pub(crate) enum Shown<'a> {
    /// A server that knows these words: the token of requests, the one by which scripts are known; the number of the reading; links to its
    /// other pages, as HTML.
    Served { token: &'a str, nonce: &'a str, number: u64, links: &'a str },
    /// A file, with the numbers of its runs.
    Written,
}

/// What of a page does not depend on who shows it.
pub(crate) fn data(session: &Session) -> Value {
    let mut data = json!({"title": session.title, "files": session.of_files()});
    let mut listed = Vec::new();
    let mut left_out = 0;
    if let Some(model) = &session.model {
        if let Some(code) = &model.compilation.model {
            (listed, left_out) = variables::of_model(&model.compilation, code.tables());
        }
        data["model"] = of_model(model);
    }
    if let Some(finding) = &session.finding {
        data["finding"] = finding.clone();
    }
    if let Some(next) = &session.next {
        data["next"] = next.clone();
    }
    if let Some(beside) = &session.beside {
        data["shots"] = beside.data();
    }
    let units = |name: &str| session.units.get(name).map_or("", String::as_str);
    let names = session.runs.iter().flat_map(|run| {
        let constants = run.table.constants.iter().map(|(name, _)| name);
        run.table.names.iter().chain(constants).map(|name| (name.as_str(), units(name)))
    });
    left_out += variables::of_files(names, &mut listed);
    data["variables"] = listed.into();
    data["leftOut"] = left_out.into();
    data
}

fn of_model(model: &Model) -> Value {
    let extracted = &model.extracted;
    let mut drawn = 0;
    let mut diagrams = Vec::new();
    let mut is_cut = extracted.is_cut;
    let states = model.states();
    for diagram in &extracted.diagrams {
        let arranged = arrange(diagram);
        let picture = draw(diagram, &arranged, &states);
        drawn += picture.svg.len();
        if drawn > MOST_DRAWN && !diagrams.is_empty() {
            is_cut = true;
            break;
        }
        let parts = diagram.parts.iter().map(|part| {
            let (file, line, text) = &part.declared;
            json!({"path": part.path, "name": part.name, "class": part.class, "description": part.description,
                "connector": part.is_connector, "file": file, "line": line, "text": text})
        });
        let wires = diagram.wires.iter().map(|wire| json!({"ends": wire.written, "values": wire.values}));
        diagrams.push(
            json!({"path": diagram.path, "class": diagram.class, "svg": picture.svg, "width": picture.width.round(),
            "drawn": arranged.is_drawn, "parts": parts.collect::<Vec<_>>(), "wires": wires.collect::<Vec<_>>()}),
        );
    }
    let classes: BTreeMap<&String, Value> = extracted
        .classes
        .iter()
        .map(|(name, own)| {
            let told = json!({"kind": own.kind, "description": own.description, "file": own.file, "line": own.line,
                "text": own.text, "info": own.info});
            (name, told)
        })
        .collect();
    let figures = extracted.figures.iter().map(|figure| {
        let plots = figure.plots.iter().map(|plot| {
            let curves = plot.curves.iter().map(|(x, y, legend)| json!({"x": x, "y": y, "legend": legend}));
            json!({"title": plot.title, "curves": curves.collect::<Vec<_>>()})
        });
        json!({"title": figure.title, "plots": plots.collect::<Vec<_>>()})
    });
    let tables = model.compilation.model.as_ref().map(|code| code.tables().clone());
    json!({
        "name": model.compilation.model_name.as_deref().unwrap_or_default(),
        "file": model.file.display().to_string(),
        "diagrams": diagrams,
        "classes": classes,
        "figures": figures.collect::<Vec<_>>(),
        "equations": tables.as_deref().map_or_else(|| json!({}), |tables| equations(tables, &model.compilation.files)),
        "states": states,
        "drawn": model.first_drawn(),
        "parameters": model.parameters().unwrap_or_default(),
        "runs": model.compilation.model.is_some(),
        "length": model.length(),
        "openEnds": model.open_ends,
        "driven": model.driven,
        "unit": model.is_unit,
        "cut": is_cut,
    })
}

/// Equations by the path of the component that has them; of a value in a declaration the line of the declaration.
fn equations(tables: &Tables, files: &Files) -> Value {
    let texts: BTreeMap<&str, Vec<&str>> =
        files.ids().map(|file| (&**files.name(file), files.text(file).lines().collect())).collect();
    let mut by_component: BTreeMap<&str, Vec<Value>> = BTreeMap::new();
    for equation in tables.equations.iter().take(MOST_EQUATIONS) {
        let line = texts.get(&*equation.file).and_then(|lines| lines.get((equation.line as usize).saturating_sub(1)));
        let declaration = line.filter(|line| is_value(line, &equation.text));
        let text = declaration.map_or(&*equation.text, |line| line.trim());
        let text: String = text.chars().take(LONGEST_EQUATION).collect();
        by_component.entry(&equation.component).or_default().push(json!([text, &*equation.file, equation.line]));
    }
    json!(by_component)
}

/// True if a text is not an equation but the value that a declaration in this line gives.
fn is_value(line: &str, text: &str) -> bool {
    line.match_indices(text).any(|(at, _)| {
        let before = line[..at].trim_end();
        before.ends_with('=') && !before.ends_with("==")
    })
}

/// The page as HTML.
pub(crate) fn html(session: &Session, data: &Value, shown: &Shown<'_>) -> String {
    let mut data = data.clone();
    let (mark, policy, links) = match shown {
        Shown::Served { token, nonce, number, links } => {
            data["token"] = (*token).into();
            data["reading"] = (*number).into();
            (format!(" nonce=\"{nonce}\""), String::new(), *links)
        }
        Shown::Written => {
            data["runs"] = written_runs(session);
            let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";
            (String::new(), format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">"), "")
        }
    };
    // In a script nothing may look like the end of the script.
    let data = data.to_string().replace("</", "<\\/").replace("<!--", "<\\!--");
    let title = hyd_doc::html::escape(&session.title);
    let page = PAGE.replace("<!--TITLE-->", &title).replacen("<!--POLICY-->", &policy, 1).replace(" data-mark", &mark);
    let page = page.replacen("<!--PAGES-->", links, 1);
    let page = page.replacen("/*STYLE*/", STYLE, 1).replacen("/*SCRIPT*/", &SCRIPTS.join("\n"), 1);
    page.replacen("/*DATA*/null", &data, 1)
}

/// All runs as text, the model's own first.
fn written_runs(session: &Session) -> Value {
    let mut runs = Vec::new();
    if let Some(model) = session.model.as_ref().filter(|model| model.compilation.model.is_some()) {
        // Where inputs were recorded, a run is that of the first shot.
        let shots = session.beside.iter().flat_map(|beside| &beside.shots.all);
        let shot = shots.into_iter().next().filter(|_| !model.driven.is_empty());
        let under = shot.map(|shot| (shot, &shot.set[..]));
        let (header, rows) = model.run(&[], under, &hyd_run::interrupt::requested);
        let width = if rows.is_empty() { 0 } else { rows.row(0).len() };
        let wanted = wanted_first(model, width, MOST_NUMBERS / rows.len().max(1));
        runs.push(base64(&bytes(&model.numbers(header, &rows, &wanted))));
    }
    for (k, run) in session.runs.iter().enumerate() {
        let most = MOST_NUMBERS / run.table.times.len().max(1);
        runs.extend(session.of_file(k, &|column| column < most).map(|numbers| base64(&bytes(&numbers))));
    }
    runs.into()
}

/// So many columns of a run: those that diagrams and plots show come first.
fn wanted_first(model: &Model, width: usize, most: usize) -> Vec<usize> {
    if width <= most {
        return (0..width).collect();
    }
    let Some(code) = &model.compilation.model else { return Vec::new() };
    let mut wanted = BTreeSet::new();
    let mut take = |name: &str| {
        let place = code.tables().find(name).and_then(|(variable, element)| variable.sources.get(element));
        if let Some(Place::Output(k)) = place.map(|source| source.place)
            && wanted.len() < most
        {
            wanted.insert(k as usize);
        }
    };
    model.first_drawn().iter().for_each(|name| take(name));
    let figures = model.extracted.figures.iter().flat_map(|figure| &figure.plots).flat_map(|plot| &plot.curves);
    figures.for_each(|(x, y, _)| [x, y].into_iter().for_each(|name| take(name)));
    let wires = model.extracted.diagrams.iter().flat_map(|diagram| &diagram.wires);
    wires.flat_map(|wire| &wire.values).for_each(|name| take(name));
    model.states().iter().for_each(|name| take(name));
    let rest = (0..width).filter(|k| !wanted.contains(k)).take(most.saturating_sub(wanted.len())).collect::<Vec<_>>();
    wanted.into_iter().chain(rest).collect()
}

#[cfg(test)]
mod tests {
    use super::is_value;

    #[test]
    fn values_of_declarations_are_told_from_equations() {
        assert!(is_value("  parameter Units.AbsolutePressure p0 = 10e6 \"supply pressure\";", "10e6"));
        assert!(is_value("  Real i = ro.i;", "ro.i"));
        assert!(!is_value("  der(x) = v;", "der(x) = v"));
        assert!(!is_value("  connect(a, b);", "connect(a, b)"));
        assert!(!is_value("  on = x == y;", "on = x == y"));
    }
}
