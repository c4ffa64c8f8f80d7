//! Translation of models of N equal parts: prints the table of `docs/performance.md` with the fitted exponent of N.
//!
//! Run with `cargo bench -p hyd-tests --bench scale` (`-- 1000000` adds a million parts).  Times are CPU seconds of the process from
//! text to code, one run each; the exponent is the slope of log(time) over log(N) between the smallest and the largest N.

use hyd::clock::cpu_seconds;
use hyd_tests::scale::{MODELS, translate};

fn main() {
    let mut sizes = vec![1_000, 10_000, 100_000];
    sizes.extend(std::env::args().filter_map(|argument| argument.parse::<usize>().ok()));
    println!("\n## Translation of N equal parts\n");
    println!(
        "| model | N | unknowns | templates | bytes of code | translation s | exponent |\n|---|---:|---:|---:|---:|---:|---:|"
    );
    for model in MODELS {
        let mut first = None;
        for &parts in sizes.iter().filter(|&&parts| model != "Chain" || parts <= 10_000) {
            let start = cpu_seconds();
            let compilation = translate(model, parts);
            let seconds = cpu_seconds() - start;
            let (least, fastest) = *first.get_or_insert((parts, seconds));
            let exponent = match parts > least {
                true => format!("{:.2}", (seconds / fastest).ln() / (parts as f64 / least as f64).ln()),
                false => String::new(),
            };
            let statistics = compilation.model.as_ref().expect("translated").statistics();
            let unknowns = compilation.sorted.as_ref().map_or(0, |sorted| sorted.simulation.unknowns.len());
            println!(
                "| {model} | {parts} | {unknowns} | {} | {} | {seconds:.3} | {exponent} |",
                statistics.templates, statistics.code_bytes
            );
            if std::env::args().any(|argument| argument == "--stages") {
                for stage in &compilation.times {
                    println!("    {} {:.3}", stage.name, stage.seconds);
                }
            }
        }
    }
}
