//! Simulators that are used again: a run after others gives the bits of a run alone, as the answers of fits and sweeps on several
//! threads must not depend on who did which run.

use hyd_results::Trajectory;
use hyd_runtime::Simulator;
use hyd_system::DaeSystem;
use hyd_tests::runs::{instance, on_grid, translated};

#[test]
fn a_run_does_not_depend_on_the_runs_before() {
    let (drive, line) = ("models/single_acting_drive/drive.hyd", "models/hydraulic_line/line.hyd");
    for (file, other, tolerance) in
        [(drive, ("p0", "15e6"), 1e-5), (drive, ("U0", "150"), 1e-7), (line, ("d", "0.02"), 1e-5)]
    {
        let compilation = translated(file, &[]);
        let options = on_grid(0.02, 20, tolerance);
        let bits = |simulator: &mut Simulator, set: &[(&str, &str)]| {
            let mut system = instance(&compilation, set);
            let mut rows = Trajectory::new();
            simulator
                .run(&mut system, &options, &mut rows, &|| false)
                .unwrap_or_else(|error| panic!("{file}: {error}"));
            (0..rows.len())
                .flat_map(|k| rows.row(k).iter().map(|v| v.to_bits()).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let structure = instance(&compilation, &[]).structure().clone();
        let alone = bits(&mut Simulator::new(&structure), &[]);
        let mut used = Simulator::new(&structure);
        assert!(bits(&mut used, &[other]) != alone, "{file}: {other:?} changes nothing");
        assert!(bits(&mut used, &[]) == alone, "{file}: a run after one with {other:?} differs");
    }
}
