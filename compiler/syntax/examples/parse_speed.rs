//! Parses the files named on the command line and prints their messages; without arguments, measures the speed on about
//! one megabyte of generated model text (run it with `--release`).

use std::fmt::Write;
use std::time::Instant;

use hyd_source::Files;

fn main() {
    let names: Vec<String> = std::env::args().skip(1).collect();
    if names.is_empty() {
        return measure();
    }
    let mut files = Files::new();
    for name in names {
        match std::fs::read_to_string(&name) {
            Ok(text) => check(&mut files, &name, &text),
            Err(error) => eprintln!("{name}: {error}"),
        }
    }
}

fn check(files: &mut Files, name: &str, text: &str) {
    let id = files.add(name, text);
    let outcome = hyd_syntax::parse(id, text);
    println!("{name}: {} classes, {} messages", outcome.value.classes.len(), outcome.diagnostics.len());
    for diagnostic in outcome.diagnostics {
        let place = diagnostic.labels.iter().find(|l| l.primary).map(|l| files.location(l.span));
        let place = place.map_or_else(String::new, |at| format!("{}:{}", at.line, at.column));
        println!("  {} {place}: {}", diagnostic.code, diagnostic.message);
        diagnostic.notes.iter().for_each(|note| println!("    {note}"));
    }
}

fn measure() {
    let mut text = String::from("model Large \"generated\"\n");
    for k in 0..8000 {
        let _ = writeln!(
            text,
            "  parameter Real p{k}(unit = \"m/s2\", min = 0) = {k}.5e-3 \"a parameter\";\n  Real x{k}(start = 1, fixed = true);"
        );
    }
    text.push_str("equation\n");
    for k in 0..8000 {
        let _ =
            writeln!(text, "  der(x{k}) = -p{k}*(x{k} - 2*a.b[{k}].c)^2 + sin(time/3) + (if x{k} > 1 then 1 else 0);");
    }
    text.push_str("end Large;\n");
    let mut files = Files::new();
    let id = files.add("large.hyd", text.as_str());
    for _ in 0..3 {
        let start = Instant::now();
        let outcome = hyd_syntax::parse(id, &text);
        let seconds = start.elapsed().as_secs_f64();
        let megabytes = text.len() as f64 / 1e6;
        println!(
            "{megabytes:.2} MB in {seconds:.3} s, {:.1} MB/s, {} messages",
            megabytes / seconds,
            outcome.diagnostics.len()
        );
    }
}
