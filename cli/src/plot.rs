//! `hyd plot F.csv ...`: results of one or several runs as a picture.
//!
//! Result files carry no units; they come from `--unit NAME=UNIT`, from the model (`--model-file`), or from a header such as
//! `p [Pa]`.  Variables without unit get a panel each.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use hyd_compiler::{Compilation, Goal};
use hyd_report::{Curve, Figure};
use hyd_results::Table;

use crate::arguments::{MessageFormat, ModelArguments, Plot};
use crate::picture::{check_picture, write_picture};
use crate::translate::translate;
use crate::{Failure, output, result_table};
use hyd_run::{MOST_CURVES, Selection};

/// Panels that are drawn when nobody says which variables.
const FEW: usize = 12;

/// Runs the verb.
pub(crate) fn plot(arguments: &Plot) -> Result<(), Failure> {
    let path = arguments.output.clone().unwrap_or_else(|| arguments.files[0].with_extension("svg"));
    check_picture("--output", &path)?;
    let selection = Selection::new(arguments.variables.as_deref())?;
    let tables =
        arguments.files.iter().map(|file| result_table::read(file)).collect::<Result<Vec<Table>, Failure>>()?;
    // Only now is it known which files are read.
    check_picture("--output", &path)?;
    let units = units(arguments)?;
    let curves = curves(&tables, &selection, &units)?;
    let figure = Figure { title: arguments.title.clone(), ..Figure::by_unit(labels(&arguments.files), curves) };
    write_picture(&path, &figure)?;
    output::print(&format!("picture in {}\n", path.display()))
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
        names.truncate(FEW);
    } else if names.len() > MOST_CURVES {
        let count = names.len();
        return Err(Failure::Usage(format!("{count} variables match, and a picture holds {MOST_CURVES} curves")));
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
