//! The folder of the report of a fit: `fit.html`, `fit.svg`, `fit.csv`, `fit.json` and `fit.toml`.
//!
//! The page is put together as that of a search is.  All files are made before one of them gets its name, and none takes the place of a
//! file that was read; a search may have its report in the same folder.

use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use hyd_discovery::{FittedReport, Setup, ShotCurves};
use hyd_report::{Curve, Figure, Panel};
use hyd_results::{WholeFile, refuse_read};
use hyd_system::math::square;
use serde_json::{Value, json};

use crate::Failure;
use crate::discover::unwritable;
use crate::discovery_page::with_curves;
use crate::discovery_picture::masked;

const SCRIPT: &str = include_str!("fit_page/page.js");
/// The files of a report.
const FILES: [&str; 5] = ["fit.html", "fit.svg", "fit.csv", "fit.json", "fit.toml"];
/// Panels of a picture; of more, those with the largest gap are shown.
const MOST_PANELS: usize = 40;

/// Makes the folder of a report, in which no file is one that was read.
///
/// # Errors
/// It cannot be made, or a file of the report would replace one that was read.
pub(crate) fn check(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::Fault(format!("the folder `{}` cannot be made: {error}", folder.display())))?;
    for name in FILES {
        let path = folder.join(name);
        refuse_read(&path).map_err(|error| unwritable(&path, &error))?;
    }
    Ok(())
}

/// Writes a report; returns what is said of it.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(
    folder: &Path,
    setup: &Setup,
    report: &FittedReport,
    (fit, parameters): (&Value, &str),
) -> Result<String, Failure> {
    let (figure, left_out) = picture(setup, report);
    let mut whole = fit.clone();
    // What the page needs beside what `--json` prints.
    whole["report"] = report.json.clone();
    let page = with_curves("A fit", SCRIPT, &report.curves, json!({"fit": fit, "report": report.json}));
    let texts = [
        page,
        figure.draw().svg(),
        ShotCurves::table(&report.curves, ["stated", "fitted"]),
        format!("{whole:#}\n"),
        parameters.to_string(),
    ];
    let mut files = Vec::new();
    for (name, text) in FILES.iter().zip(texts) {
        let path = folder.join(name);
        let file = WholeFile::create(&path).map_err(|error| unwritable(&path, &error))?;
        let written = file.writer().and_then(|mut writer| writer.write_all(text.as_bytes()));
        written.map_err(|error| unwritable(&path, &error))?;
        files.push((path, file));
    }
    for (path, file) in files {
        file.finish().map_err(|error| unwritable(&path, &error))?;
    }
    let most = match left_out {
        0 => String::new(),
        left_out => format!(" (fit.svg shows the {MOST_PANELS} with the largest gap, {left_out} are left out)"),
    };
    Ok(format!("\nmeasured, as stated and as fitted, by shot and channel: {}{most}\n", folder.join(FILES[0]).display()))
}

/// A panel for each channel of each shot, and how many are left out.
fn picture(setup: &Setup, report: &FittedReport) -> (Figure, usize) {
    let pairs = report.curves.iter().flat_map(|shot| shot.channels.iter().map(move |channel| (shot, channel)));
    let channels = &setup.data.channels;
    let mut panels: Vec<(f64, Panel)> = Vec::new();
    for (shot, channel) in pairs {
        let Some(own) = channels.iter().find(|own| own.name == channel.name) else { continue };
        let sigma = own.noise.sigma * own.scale.abs();
        let square = |k: usize| square((channel.measured[k] - channel.extended[k]) / sigma);
        let gap: f64 = (0..channel.used.len()).filter(|&k| channel.used[k]).map(square).sum();
        let times: Arc<[f64]> = shot.times.clone().into();
        let name = format!("{}, shot {}", channel.name, shot.number);
        let curve = |run: usize, values: Vec<f64>| Curve { name: name.clone(), run, times: times.clone(), values };
        let curves = vec![
            curve(0, masked(channel, |k| channel.measured[k])),
            curve(1, channel.base.clone()),
            curve(2, channel.extended.clone()),
        ];
        panels.push((gap, Panel { unit: own.unit.clone(), curves }));
    }
    let left_out = panels.len().saturating_sub(MOST_PANELS);
    if left_out > 0 {
        let mut gaps: Vec<f64> = panels.iter().map(|own| own.0).collect();
        gaps.sort_unstable_by(|a, b| b.total_cmp(a));
        let least = gaps[MOST_PANELS - 1];
        panels.retain(|own| own.0 >= least);
        panels.truncate(MOST_PANELS);
    }
    let held_out: Vec<String> =
        report.curves.iter().filter(|shot| shot.held_out).map(|shot| shot.number.to_string()).collect();
    let held_out = (!held_out.is_empty()).then(|| format!("held out: shot {}", held_out.join(", ")));
    let title = [Some(setup.study.title.clone()).filter(|title| !title.is_empty()), held_out];
    let title = title.into_iter().flatten().collect::<Vec<String>>().join("; ");
    let figure = Figure {
        title: Some(title).filter(|title| !title.is_empty()),
        runs: ["measured", "as stated", "as fitted"].map(String::from).to_vec(),
        family: false,
        panels: panels.into_iter().map(|own| own.1).collect(),
        width: Figure::PAGE_WIDTH,
        panel_height: None,
    };
    (figure, left_out)
}
