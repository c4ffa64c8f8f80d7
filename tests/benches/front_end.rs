//! Lines per minute of the front end on generated libraries: prints a table of `docs/performance.md`.
//!
//! Run with `cargo bench -p hyd-tests --bench front_end`.  A library is a package of packages; each holds a connector, a type,
//! a record, a function, a partial class, three components that extend it, a chain of them with modifications, and a test.
//! The model that is translated has a component of every chain, so every class of the library is parsed and instantiated.
//! Times are CPU seconds of the process, the least of five runs.

use std::fmt::Write;

use hyd::LibraryPath;
use hyd::clock::cpu_seconds;
use hyd_compiler::{Compilation, Goal, Options, compile};

fn main() {
    println!("\n## Front end on a generated library\n");
    println!("| lines | variables | equations | parse s | instantiate s | both, lines a minute | flatten s |");
    println!("|---:|---:|---:|---:|---:|---:|---:|");
    for packages in [50, 150, 500, 1500] {
        let text = library(packages);
        let lines = text.lines().count();
        let runs: Vec<Compilation> = (0..5).map(|_| translate(&text)).collect();
        let least = |stage: &str| {
            let seconds =
                runs.iter().map(|run| run.times.iter().filter(|t| t.name == stage).map(|t| t.seconds).sum::<f64>());
            seconds.fold(f64::INFINITY, f64::min)
        };
        let flat = runs[0].flat.as_ref().expect("the library is right");
        let equations: usize = flat.equations.iter().map(|block| block.count as usize).sum();
        let (parse, instantiate) = (least("parse"), least("instantiate"));
        println!(
            "| {lines} | {} | {equations} | {parse:.3} | {instantiate:.3} | {:.2e} | {:.3} |",
            flat.scalars,
            60.0 * lines as f64 / (parse + instantiate),
            least("flatten"),
        );
    }
}

fn translate(text: &str) -> Compilation {
    let mut library = LibraryPath::new();
    let options = Options { model: None, set: Vec::new(), goal: Goal::Flat, clock: cpu_seconds };
    compile(&mut library, "generated.hyd", text, &options)
}

fn library(packages: usize) -> String {
    let mut text = String::from("package Generated \"a library made for measuring\"\n");
    for k in 0..packages {
        write_package(&mut text, k);
    }
    text.push_str("  model All \"one of each\"\n");
    for k in 0..packages {
        writeln!(text, "    P{k}.Chain chain{k}(r0 = {}.5);", k + 1).expect("invariant: writing to a string");
    }
    text.push_str("  end All;\nend Generated;\n");
    text
}

/// About 66 lines.
fn write_package(text: &mut String, k: usize) {
    let body = PACKAGE.replace("@K", &k.to_string());
    text.push_str(&body);
}

const PACKAGE: &str = r#"  package P@K "domain @K"
    type Pressure = Real(unit = "Pa", displayUnit = "bar", nominal = 1e5, min = 0);
    type Flow = Real(unit = "m3/s", nominal = 1e-4);

    connector Port "pressure and flow"
      Pressure p "pressure";
      flow Flow q "flow into the component";
    end Port;

    record Fluid "what the components share"
      parameter Real rho(unit = "kg/m3") = 850 "density";
      parameter Pressure bulk = 1.4e9 "bulk modulus";
    end Fluid;

    function conductance "of a laminar resistance"
      input Real r(unit = "Pa.s/m3");
      output Real g(unit = "m3/(Pa.s)");
    algorithm
      g := 1/r;
    end conductance;

    partial model TwoPorts "flow through without storage"
      Port a "inlet";
      Port b "outlet";
      Pressure dp "pressure difference";
      Flow q "flow from a to b";
    equation
      dp = a.p - b.p;
      a.q = q;
      a.q + b.q = 0;
    end TwoPorts;

    model Resistance "laminar resistance"
      extends TwoPorts;
      parameter Real r(unit = "Pa.s/m3", min = 0) = 1e9 "resistance";
    equation
      q = conductance(r)*dp; // linear
    end Resistance;

    model Volume "compressible volume"
      Port a "connection";
      parameter Real V(unit = "m3") = 1e-4 "volume";
      parameter Fluid fluid;
      Pressure p(start = 1e5, fixed = true) "pressure";
    equation
      a.p = p;
      der(p) = fluid.bulk/V*a.q;
    end Volume;

    model Source "constant pressure"
      Port a "connection";
      parameter Pressure p0 = 1e6 "pressure";
    equation
      a.p = p0;
    end Source;

    model Chain "source, resistance, volume"
      parameter Real r0 = 1 "resistance in GPa.s/m3";
      Source source(p0 = 2e6);
      Resistance resistance(r = 1e9*r0, q(nominal = 1e-3));
      Volume volume(V = 2e-4, fluid(rho = 870));
    equation
      connect(source.a, resistance.a);
      connect(resistance.b, volume.a);
    end Chain;
  end P@K;

"#;
