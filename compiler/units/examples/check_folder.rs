//! Checks the units of every complete model in the folders given; prints messages, units found and what stays unknown.
//!
//! `cargo run -p hyd-units --example check_folder -- models/single_acting_drive stdlib/Hyd/Hydraulic/Components`

#[path = "../src/tests/support.rs"]
mod support;

fn main() {
    for folder in std::env::args().skip(1) {
        let mut files: Vec<_> = std::fs::read_dir(&folder)
            .map(|list| list.filter_map(|f| f.ok().map(|f| f.path())).collect())
            .unwrap_or_default();
        files.sort();
        for file in files.iter().filter(|f| f.extension().is_some_and(|e| e == "hyd")) {
            let text = std::fs::read_to_string(file).unwrap_or_default();
            let name = file.display().to_string();
            let compiled = support::flatten(&name, &text);
            let Some(flat) = &compiled.flat else {
                let first = compiled.diagnostics.first().map_or("", |d| d.message.as_str());
                println!("{name}: no model ({first})");
                continue;
            };
            let report = hyd_units::check_units(flat, &compiled.files);
            println!(
                "{name}: {} scalars, {} mistakes, {} units found, {} unknown",
                flat.scalars,
                report.diagnostics.len(),
                report.inferred.len(),
                report.undecided_scalars()
            );
            for diagnostic in &report.diagnostics {
                let place = diagnostic.labels.first().map_or(String::new(), |label| {
                    let line = compiled.files.location(label.span).line;
                    format!("{}:{line}: ", compiled.files.name(label.span.file))
                });
                println!("  {place}{}", diagnostic.message);
            }
            for unknown in &report.undecided {
                println!("  unknown: {} ({})", unknown.name, unknown.count);
            }
        }
    }
}
