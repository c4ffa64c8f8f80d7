//! The further drives against something that does not come from the compiler.
//!
//! Four against right-hand sides written by hand and integrated by the pair of Dormand and Prince (`hyd_tests::other_drives`); the
//! power stage against the closed form of its holding period; two drives on a rail against one on half a rail, which symmetry
//! demands; the head against the balance of its oil and the firing order.

use hyd_tests::other_drives::{Solution, double_acting, pipe, seat_brake, servo};
use hyd_tests::reference::verdict;
use hyd_tests::runs::{Run, on_grid, run};

const TOLERANCE: f64 = 1e-8;
const SINGLE: &str = "models/single_acting_drive";

/// Compares columns of a run with states of a solution: name, state, limit.
fn compare<const N: usize>(run: &Run, (times, states): &Solution<N>, columns: &[(&str, usize, f64)]) {
    assert_eq!(run.rows.len(), times.len());
    let mut report = String::new();
    for &(name, state, limit) in columns {
        let expected: Vec<f64> = states.iter().map(|row| row[state]).collect();
        report += &verdict(name, times, &run.values(name), &expected, limit);
    }
    assert!(report.is_empty(), "{}:\n{report}", run.rows.tables().model);
}

#[test]
fn drive_with_pipe_against_hand_written_equations() {
    let run = run(&format!("{SINGLE}/with_pipe/pipedrive.hyd"), &[], &on_grid(0.03, 600, TOLERANCE));
    let solution = pipe(0.03, 600, 1e-10);
    let columns = [("u_C", 0, 1e-5), ("x", 2, 2e-8), ("y", 4, 1e-7), ("w", 5, 1e-3), ("q_A", 8, 1e-8)];
    compare(&run, &solution, &columns);
}

#[test]
fn seat_brake_against_hand_written_equations() {
    let columns = [("y", 0, 1e-7), ("w", 1, 1e-3), ("p_c", 2, 1e4), ("p_l", 3, 1e4)];
    let mut landing = Vec::new();
    for (file, clearance) in [("drive.hyd", 60e-6), ("withoutbrake.hyd", 1.5e-3)] {
        let run = run(&format!("models/seat_brake_drive/{file}"), &[], &on_grid(0.04, 800, TOLERANCE));
        compare(&run, &seat_brake(0.04, 800, 1e-10, clearance), &columns);
        let first = run.values("y").iter().enumerate().position(|(k, &y)| k > 300 && y < 20e-6).expect("it closes");
        landing.push(-run.values("w")[first - 1]);
    }
    assert!(landing[0] < 0.25 * landing[1], "landing speeds with and without brake: {landing:?} m/s");
}

#[test]
fn double_acting_drive_against_hand_written_equations() {
    let run = run("models/double_acting_drive/drive.hyd", &[], &on_grid(0.03, 600, TOLERANCE));
    let columns = [("y", 0, 1e-7), ("w", 1, 1e-3), ("p_a", 2, 1e4), ("p_b", 3, 1e4)];
    compare(&run, &double_acting(0.03, 600, 1e-10), &columns);
}

#[test]
fn servo_drive_against_hand_written_equations() {
    let run = run("models/servo_drive/drive.hyd", &[], &on_grid(0.1, 500, TOLERANCE));
    let columns = [("y", 0, 1e-7), ("w", 1, 1e-5), ("p_a", 2, 1e3), ("p_b", 3, 1e3), ("x", 4, 1e-9)];
    compare(&run, &servo(0.1, 500, 1e-10), &columns);
    // The loop ends at the wanted lift: PI control of an integrator leaves nothing over.
    assert!((run.value("y", 0.1) - 4e-3).abs() < 0.1e-3);
}

/// While the spool lies on its stop the coil is a constant inductance: fall and rise between the edges of the band are logarithms.
#[test]
fn holding_current_has_the_period_of_its_closed_form() {
    let run = run(&format!("{SINGLE}/peak_and_hold/peakholddrive.hyd"), &[], &on_grid(0.014, 14_000, TOLERANCE));
    let (i, x, t) = (run.values("i"), run.values("x"), run.rows.times());
    let peak = i.iter().copied().fold(0.0, f64::max);
    assert!((peak - 5.0).abs() < 0.02, "the boost ends at {peak} A");
    let turns: Vec<usize> =
        (1..i.len() - 1).filter(|&k| t[k] > 7e-3 && t[k] < 11.95e-3 && i[k] < i[k - 1] && i[k] < i[k + 1]).collect();
    assert!(turns.len() >= 3, "{} lower turns", turns.len());
    let inductance = 4.91e-6 / (0.39e-3 + 0.035e-3 + 0.45e-3 - x[turns[0]]) + 4.46e-3;
    let tau = inductance / 1.9;
    let fall = tau * ((2.7 + 0.8 / 1.9) / (2.3 + 0.8 / 1.9_f64)).ln();
    let rise = tau * ((24.0 / 1.9 - 2.3) / (24.0 / 1.9 - 2.7_f64)).ln();
    for pair in turns.windows(2) {
        let period = t[pair[1]] - t[pair[0]];
        assert!((period / (fall + rise) - 1.0).abs() < 5e-3, "{period} s instead of {} s", fall + rise);
    }
}

/// Two equal drives that act together share the rail evenly: each sees half of its volume and of its feed.
#[test]
fn two_drives_on_a_rail_act_as_one_on_half_of_it() {
    let options = on_grid(0.04, 800, TOLERANCE);
    let together = run(&format!("{SINGLE}/rail/twoonarail.hyd"), &[("t_on[2]", "0")], &options);
    let half = run(&format!("{SINGLE}/rail/oneonarail.hyd"), &[], &options);
    for (two, one, limit) in [("y[1]", "y", 1e-7), ("y[2]", "y", 1e-7), ("p_rail", "p_rail", 1e4)] {
        let text = verdict(two, half.rows.times(), &together.values(two), &half.values(one), limit);
        assert!(text.is_empty(), "{text}");
    }
    // One after the other they disturb each other: the second one opens into a lower rail.
    let apart = run(&format!("{SINGLE}/rail/twoonarail.hyd"), &[], &options);
    let reach = |name: &str, start: f64| {
        let y = apart.values(name);
        let k = y.iter().position(|&y| y > 7.9e-3).expect("the valve opens");
        apart.rows.times()[k] - start
    };
    assert!((reach("y[1]", 0.0) - reach("y[2]", 4e-3)).abs() > 5e-5, "the drives do not see each other");
    let lowest = apart.values("p_rail").into_iter().fold(f64::MAX, f64::min);
    assert!(lowest < 9.5e6, "the rail stays at {lowest} Pa");
}

#[test]
fn head_of_eight_keeps_its_oil_and_its_order() {
    let run = run(&format!("{SINGLE}/rail/fourcylinderhead.hyd"), &[], &on_grid(0.1, 1000, 1e-6));
    let (gas, taken, pumped) = (run.values("rail.V_g"), run.values("V_taken"), run.values("V_pumped"));
    for k in 0..gas.len() {
        let open = gas[k] - 0.1e-3 - taken[k] + pumped[k];
        assert!(open.abs() < 1e-11, "row {k}: {open} m3 of oil are missing");
    }
    // Eight strokes of a piston of 16 mm by 8 mm, and what fills chambers and gaps beside.
    let strokes = 8.0 * std::f64::consts::PI * 64e-6 * 8e-3;
    let end = taken[taken.len() - 1];
    assert!((1.0..1.6).contains(&(end / strokes)), "{end} m3 for strokes of {strokes} m3");
    let opens = |name: &str| {
        let y = run.values(name);
        run.rows.times()[y.iter().position(|&y| y > 4e-3).unwrap_or_else(|| panic!("{name} stays shut"))]
    };
    for (kind, angle) in [("y_in", 340.0), ("y_out", 125.0)] {
        let mut delays = Vec::new();
        for (cylinder, fires) in [(1, 0.0), (2, 540.0), (3, 180.0), (4, 360.0)] {
            let pulse = (fires + angle) % 720.0 / 9000.0;
            delays.push(opens(&format!("{kind}[{cylinder}]")) - pulse);
        }
        // The single drive passes 4 mm about 4 ms after its pulse; the rail sways by a few per cent.
        assert!(delays.iter().all(|d| (3.2e-3..4.6e-3).contains(d)), "{kind}: {delays:?}");
    }
}
