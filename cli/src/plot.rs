//! `hyd plot F.csv ...`: results of one or several runs as a picture.
//!
//! Units come from `--unit NAME=UNIT`, from the model (`--model-file`), from a Parquet file, or from a header such as `p [Pa]`.
//! Variables without unit get a panel each.  The rows of a sweep are drawn as a family: a panel per variable, a curve per member.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use hyd_compiler::{Compilation, Goal};
use hyd_report::{Curve, Figure};
use hyd_results::Table;

use crate::arguments::{MessageFormat, ModelArguments, Plot};
use crate::translate::translate;
use crate::{Failure, output};
use hyd_run::{MOST_CURVES, Selection};
use hyd_verbs::picture::{check_picture, write_picture};
use hyd_verbs::result_table::{self, Runs};

/// Panels that are drawn when nobody says which variables.
const FEW: usize = 12;
/// Panels of a family likewise.
const FEW_OF_FAMILY: usize = 4;
/// Members of a family that are drawn.
const MOST_MEMBERS: usize = 100;
/// Curves of a family that one picture holds.
const MOST_OF_FAMILY: usize = 1000;

/// Runs the verb.
pub(crate) fn plot(arguments: &Plot) -> Result<(), Failure> {
    let path = arguments.output.clone().unwrap_or_else(|| arguments.files[0].with_extension("svg"));
    check_picture("--output", &path)?;
    let selection = Selection::new(arguments.variables.as_deref())?;
    let read = |file: &PathBuf| {
        // Of a file with a hundred thousand columns only those are read that are drawn.
        let left = Cell::new(if selection.is_explicit() { usize::MAX } else { FEW });
        result_table::read_runs(file, &|name| {
            let wanted = left.get() > 0 && selection.matches(name);
            left.set(left.get() - usize::from(wanted));
            wanted
        })
    };
    let files = arguments.files.iter().map(read).collect::<Result<Vec<Runs>, Failure>>()?;
    // Only now is it known which files are read.
    check_picture("--output", &path)?;
    let mut known = BTreeMap::new();
    let (mut names, mut tables, mut family) = (Vec::new(), Vec::new(), false);
    for (file, label) in files.into_iter().zip(labels(&arguments.files)) {
        known.extend(file.units);
        for (member, table) in file.runs {
            family |= member.is_some();
            names.push(match member {
                Some(member) if arguments.files.len() > 1 => format!("{label}: {member}"),
                Some(member) => member,
                None => label.clone(),
            });
            tables.push(table);
        }
    }
    if family && tables.len() > MOST_MEMBERS {
        let all = tables.len();
        (names, tables) = thinned(names, tables);
        output::message(&format!("note: {MOST_MEMBERS} of {all} runs are drawn\n"));
    }
    known.extend(units(arguments)?);
    let curves = curves(&tables, &selection, &known, family)?;
    let figure = if family { Figure::of_family(names, curves) } else { Figure::by_unit(names, curves) };
    let figure = Figure { title: arguments.title.clone(), ..figure };
    write_picture(&path, &figure)?;
    output::print(&format!("picture in {}\n", path.display()))
}

/// As many runs as are drawn, at equal distances from the first to the last.
fn thinned(names: Vec<String>, tables: Vec<Table>) -> (Vec<String>, Vec<Table>) {
    let all = tables.len();
    let kept: Vec<usize> = (0..MOST_MEMBERS).map(|k| k * (all - 1) / (MOST_MEMBERS - 1)).collect();
    let runs = names.into_iter().zip(tables).enumerate();
    runs.filter(|(k, _)| kept.binary_search(k).is_ok()).map(|(_, run)| run).unzip()
}

/// Labels of the runs: file names without extension, or whole paths where these are alike.
fn labels(files: &[PathBuf]) -> Vec<String> {
    let stems: Vec<String> =
        files.iter().map(|file| file.file_stem().unwrap_or_default().to_string_lossy().into_owned()).collect();
    let alike = (1..stems.len()).any(|k| stems[..k].contains(&stems[k]));
    if alike { files.iter().map(|file| file.display().to_string()).collect() } else { stems }
}

/// Units by full name.
fn units(arguments: &Plot) -> Result<BTreeMap<String, String>, Failure> {
    let mut units = BTreeMap::new();
    if let Some(file) = &arguments.model_file {
        let model = ModelArguments {
            file: file.clone(),
            model: arguments.model.clone(),
            parameters: None,
            set: Vec::new(),
            libraries: arguments.libraries.clone(),
            strict_units: false,
            message_format: MessageFormat::Text,
        };
        units = model_units(&translate(&model, Goal::Flat)?);
    }
    units.extend(arguments.unit.iter().cloned());
    Ok(units)
}

fn model_units(compilation: &Compilation) -> BTreeMap<String, String> {
    let mut units = BTreeMap::new();
    for block in compilation.flat.iter().flat_map(|flat| &flat.variables.raw) {
        if let Some(unit) = &block.unit {
            units.extend((0..block.count as usize).map(|k| (block.name.element(k), unit.to_string())));
        }
    }
    units
}

/// The chosen columns of all runs, each with its unit; a variable's runs stand together.
fn curves(
    tables: &[Table],
    selection: &Selection,
    units: &BTreeMap<String, String>,
    family: bool,
) -> Result<Vec<(String, Curve)>, Failure> {
    let mut names: Vec<&String> = Vec::new();
    for name in tables.iter().flat_map(|table| &table.names) {
        if selection.matches(name) && !names.contains(&name) {
            names.push(name);
        }
    }
    if names.is_empty() {
        return Err(Failure::Usage("no variable of these files matches".to_string()));
    }
    if !selection.is_explicit() {
        names.truncate(if family { FEW_OF_FAMILY } else { FEW });
    } else if !family && names.len() > MOST_CURVES {
        let count = names.len();
        return Err(Failure::Usage(format!("{count} variables match, and a picture holds {MOST_CURVES} curves")));
    } else if family && names.len() * tables.len() > MOST_OF_FAMILY {
        let (count, runs) = (names.len(), tables.len());
        let most = format!("a picture holds {MOST_OF_FAMILY} curves of a family");
        return Err(Failure::Usage(format!("{count} variables of {runs} runs match, and {most}")));
    }
    let times: Vec<Arc<[f64]>> = tables.iter().map(|table| Arc::from(table.times.as_slice())).collect();
    let mut curves = Vec::new();
    for column in names {
        let (name, stated) = split_unit(column);
        let unit = units.get(name).map_or(stated, String::as_str);
        for (run, table) in tables.iter().enumerate() {
            if let Some(values) = table.column(column) {
                let curve = Curve { name: name.to_string(), run, times: times[run].clone(), values: values.to_vec() };
                curves.push((unit.to_string(), curve));
            }
        }
    }
    Ok(curves)
}

/// `p [Pa]` into name and unit; a subscript is not a unit, for no space stands before it.
fn split_unit(header: &str) -> (&str, &str) {
    match header.strip_suffix(']').and_then(|rest| rest.rsplit_once(" [")) {
        Some((name, unit)) => (name.trim_end(), unit),
        None => (header, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_may_carry_units() {
        assert_eq!(split_unit("p [Pa]"), ("p", "Pa"));
        assert_eq!(split_unit("a[2].b[1,3]"), ("a[2].b[1,3]", ""));
    }

    #[test]
    fn runs_of_one_name_are_told_apart_by_their_paths() {
        let labels = |files: [&str; 2]| labels(&files.map(PathBuf::from));
        assert_eq!(labels(["a/x.csv", "a/y.csv"]), ["x", "y"]);
        assert_eq!(labels(["a/x.csv", "b/x.csv"]), ["a/x.csv", "b/x.csv"]);
    }
}
