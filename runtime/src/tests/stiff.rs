//! Stiff reference problems against published end values, with bounds on the work.
#![allow(clippy::unwrap_used)]

use hyd_results::Trajectory;

use super::systems::stiff::{Hires, Robertson, VanDerPol};
use super::systems::{Hand, Model};
use crate::{Options, Statistics, simulate};

fn end(model: impl Model, stop: f64, tolerance: f64) -> (Vec<f64>, Statistics) {
    let mut trajectory = Trajectory::new();
    let options = Options { intervals: 1, max_step: Some(stop), ..Options::new(0.0, stop).with_tolerance(tolerance) };
    let mut system = Hand::new(model);
    let summary = simulate(&mut system, &options, &mut trajectory, &|| false).unwrap();
    let statistics = summary.statistics;
    println!("tolerance {tolerance:e}\n{statistics}");
    (trajectory.row(trajectory.len() - 1).to_vec(), statistics)
}

fn close(value: f64, reference: f64, relative: f64) {
    let error = (value / reference - 1.0).abs();
    println!("{value:.12e} against {reference:.12e}: {error:.1e}");
    assert!(error < relative, "{value} against {reference}: {error:e}");
}

#[test]
fn robertson() {
    // Values with four digits: Robertson's problem at t = 40 (Hairer, Wanner 1996 and the examples of Hindmarsh et al. 2005).
    let (y, statistics) = end(Robertson { nominals: [1.0, 1e-5, 1.0] }, 40.0, 1e-6);
    close(y[0], 0.7158, 1e-4);
    close(y[1], 9.1855e-6, 1e-4);
    close(y[2], 0.28416, 2e-4);
    assert!(statistics.steps < 250 && statistics.residuals < 500);
    // t = 1e11 is the end point of Hairer, Wanner 1996, section IV.10.
    let (y, statistics) = end(Robertson { nominals: [1e-6, 1e-10, 1.0] }, 1e11, 1e-7);
    close(y[0], 0.2083340149701255e-7, 1e-3);
    close(y[1], 0.8333360770334713e-13, 1e-3);
    assert!(statistics.steps < 2500);
}

#[test]
fn van_der_pol() {
    for (tolerance, relative, steps) in [(1e-6, 1e-3, 1500), (1e-8, 1e-5, 3500)] {
        let (y, statistics) = end(VanDerPol, 2.0, tolerance);
        close(y[0], 1.706_167_732_170_483, relative);
        close(y[1], -0.892_809_701_024_797_5, relative);
        assert!(statistics.steps < steps);
    }
}

#[test]
fn hires() {
    let reference = [
        0.737_131_257_332_567e-3,
        0.144_248_572_631_618e-3,
        0.588_872_974_096_754e-4,
        0.117_565_134_328_313e-2,
        0.238_635_619_898_88e-2,
        0.623_896_825_274_266e-2,
        0.284_999_839_518_505e-2,
        0.285_000_160_481_495e-2,
    ];
    for (tolerance, relative, steps) in [(1e-6, 1e-3, 500), (1e-9, 1e-6, 1500)] {
        let (y, statistics) = end(Hires, 321.8122, tolerance);
        for (value, reference) in y.iter().zip(reference) {
            close(*value, reference, relative);
        }
        assert!(statistics.steps < steps);
    }
}
