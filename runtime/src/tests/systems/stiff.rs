//! Stiff reference problems with published end values.
//!
//! Robertson and Van der Pol: Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), section IV.10.  HIRES and the
//! end values of both: Mazzia, Magherini, "Test Set for Initial Value Problem Solvers", release 2.4 (2008).

use super::{Model, numbered};

/// Three reactions; the third equation is the conservation of mass, so the third unknown is algebraic.
pub(crate) struct Robertson {
    pub nominals: [f64; 3],
}

impl Model for Robertson {
    fn names(&self) -> Vec<String> {
        numbered("y", 3)
    }
    fn start(&self) -> Vec<f64> {
        vec![1.0, 0.0, 0.0]
    }
    fn differential(&self) -> Vec<bool> {
        vec![true, true, false]
    }
    fn nominals(&self) -> Vec<f64> {
        self.nominals.to_vec()
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] + 0.04 * y[0] - 1e4 * y[1] * y[2];
        out[1] = yp[1] - 0.04 * y[0] + 1e4 * y[1] * y[2] + 3e7 * y[1] * y[1];
        out[2] = y[0] + y[1] + y[2] - 1.0;
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state.copy_from_slice(&[
            0.04,
            -0.04,
            1.0,
            -1e4 * y[2],
            1e4 * y[2] + 6e7 * y[1],
            1.0,
            -1e4 * y[1],
            1e4 * y[1],
            1.0,
        ]);
        rate[0] = 1.0;
        rate[4] = 1.0;
    }
}

/// Van der Pol's oscillator with eps = 1e-6.
pub(crate) struct VanDerPol;

impl Model for VanDerPol {
    fn names(&self) -> Vec<String> {
        numbered("y", 2)
    }
    fn start(&self) -> Vec<f64> {
        vec![2.0, 0.0]
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        out[0] = yp[0] - y[1];
        out[1] = yp[1] - ((1.0 - y[0] * y[0]) * y[1] - y[0]) * 1e6;
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        state.copy_from_slice(&[0.0, (2.0 * y[0] * y[1] + 1.0) * 1e6, -1.0, -(1.0 - y[0] * y[0]) * 1e6]);
        rate.copy_from_slice(&[1.0, 0.0, 0.0, 1.0]);
    }
}

/// High irradiance responses of photomorphogenesis: eight reactions.
pub(crate) struct Hires;

impl Model for Hires {
    fn names(&self) -> Vec<String> {
        numbered("y", 8)
    }
    fn start(&self) -> Vec<f64> {
        vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057]
    }
    fn nominals(&self) -> Vec<f64> {
        vec![1e-3; 8]
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let f = [
            -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007,
            1.71 * y[0] - 8.75 * y[1],
            -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4],
            8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3],
            -1.745 * y[4] + 0.43 * y[5] + 0.43 * y[6],
            -280.0 * y[5] * y[7] + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6],
            280.0 * y[5] * y[7] - 1.81 * y[6],
            -280.0 * y[5] * y[7] + 1.81 * y[6],
        ];
        for k in 0..8 {
            out[k] = yp[k] - f[k];
        }
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        let mut set = |row: usize, column: usize, value: f64| state[column * 8 + row] = -value;
        for (row, column, value) in [
            (0, 0, -1.71),
            (0, 1, 0.43),
            (0, 2, 8.32),
            (1, 0, 1.71),
            (1, 1, -8.75),
            (2, 2, -10.03),
            (2, 3, 0.43),
            (2, 4, 0.035),
            (3, 1, 8.32),
            (3, 2, 1.71),
            (3, 3, -1.12),
            (4, 4, -1.745),
            (4, 5, 0.43),
            (4, 6, 0.43),
            (5, 3, 0.69),
            (5, 4, 1.71),
            (5, 5, -280.0 * y[7] - 0.43),
            (5, 6, 0.69),
            (5, 7, -280.0 * y[5]),
            (6, 5, 280.0 * y[7]),
            (6, 6, -1.81),
            (6, 7, 280.0 * y[5]),
            (7, 5, -280.0 * y[7]),
            (7, 6, 1.81),
            (7, 7, -280.0 * y[5]),
        ] {
            set(row, column, value);
        }
        for k in 0..8 {
            rate[k * 9] = 1.0;
        }
    }
}
