//! Small known problems with diffsol: known (bdf|esdirk34|tr_bdf2)
//! (robertson|hires|akzo_nobel|ring_modulator|squeezing_mechanism) TOLERANCE.
//!
//! Prints CPU seconds (best of several), steps, and the values at the end.  Equations, ends and nominal values are those of
//! `../../../tests/numerics`, the Jacobian is that of `../sundials/known.c`, differences for the mechanism; absolute tolerances are the relative one of the nominal values.

use std::f64::consts::PI;

use diffsol::{NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod, Vector};

const MOST: usize = 15;
type Matrix = [[f64; MOST]; MOST];

fn cpu() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut t) };
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

struct Problem {
    stop: f64,
    start: &'static [f64],
    nominal: &'static [f64],
    rates: fn(f64, &[f64], &mut [f64]),
    /// None: by differences.
    jacobian: Option<fn(f64, &[f64], &mut Matrix)>,
}

fn robertson(_t: f64, y: &[f64], f: &mut [f64]) {
    f[0] = -0.04 * y[0] + 1e4 * y[1] * y[2];
    f[2] = 3e7 * y[1] * y[1];
    f[1] = -f[0] - f[2];
}

fn robertson_jacobian(_t: f64, y: &[f64], j: &mut Matrix) {
    (j[0][0], j[0][1], j[0][2]) = (-0.04, 1e4 * y[2], 1e4 * y[1]);
    j[2][1] = 6e7 * y[1];
    (j[1][0], j[1][1], j[1][2]) = (0.04, -j[0][1] - j[2][1], -j[0][2]);
}

fn hires(_t: f64, y: &[f64], f: &mut [f64]) {
    let (bind, release) = (280.0 * y[5] * y[7], 1.81 * y[6]);
    f[0] = -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007;
    f[1] = 1.71 * y[0] - 8.75 * y[1];
    f[2] = -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4];
    f[3] = 8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3];
    f[4] = -1.745 * y[4] + 0.43 * (y[5] + y[6]);
    f[5] = -bind + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6];
    f[6] = bind - release;
    f[7] = release - bind;
}

fn hires_jacobian(_t: f64, y: &[f64], j: &mut Matrix) {
    let (a, b) = (280.0 * y[7], 280.0 * y[5]);
    (j[0][0], j[0][1], j[0][2]) = (-1.71, 0.43, 8.32);
    (j[1][0], j[1][1]) = (1.71, -8.75);
    (j[2][2], j[2][3], j[2][4]) = (-10.03, 0.43, 0.035);
    (j[3][1], j[3][2], j[3][3]) = (8.32, 1.71, -1.12);
    (j[4][4], j[4][5], j[4][6]) = (-1.745, 0.43, 0.43);
    (j[5][3], j[5][4], j[5][5], j[5][6], j[5][7]) = (0.69, 1.71, -0.43 - a, 0.69, -b);
    (j[6][5], j[6][6], j[6][7]) = (a, -1.81, b);
    (j[7][5], j[7][6], j[7][7]) = (-a, 1.81, -b);
}

/// The equilibrium `y[5] = 115.83 y[0] y[3]` put in.
fn akzo_nobel(_t: f64, y: &[f64], f: &mut [f64]) {
    let (root, e) = (y[1].sqrt(), 115.83 * y[0] * y[3]);
    let (r1, r2, r3) = (18.7 * y[0].powi(4) * root, 0.58 * y[2] * y[3], 0.58 / 34.4 * y[0] * y[4]);
    let (r4, r5, into) = (0.09 * y[0] * y[3] * y[3], 0.42 * e * e * root, 3.3 * (0.9 / 737.0 - y[1]));
    f[0] = -2.0 * r1 + r2 - r3 - r4;
    f[1] = into - 0.5 * (r1 + r5) - r4;
    f[2] = r1 - r2 + r3;
    f[3] = r3 - r2 - 2.0 * r4;
    f[4] = r2 - r3 + r5;
}

fn akzo_nobel_jacobian(_t: f64, y: &[f64], j: &mut Matrix) {
    let (root, e, cube) = (y[1].sqrt(), 115.83 * y[0] * y[3], y[0].powi(3));
    let r1 = [4.0 * 18.7 * cube * root, 0.5 * 18.7 * cube * y[0] / root, 0.0, 0.0, 0.0];
    let r2 = [0.0, 0.0, 0.58 * y[3], 0.58 * y[2], 0.0];
    let r3 = [0.58 / 34.4 * y[4], 0.0, 0.0, 0.0, 0.58 / 34.4 * y[0]];
    let r4 = [0.09 * y[3] * y[3], 0.0, 0.0, 0.18 * y[0] * y[3], 0.0];
    let by_e = 0.84 * e * 115.83 * root;
    let r5 = [by_e * y[3], 0.21 * e * e / root, 0.0, by_e * y[0], 0.0];
    for k in 0..5 {
        j[0][k] = -2.0 * r1[k] + r2[k] - r3[k] - r4[k];
        j[1][k] = if k == 1 { -3.3 } else { 0.0 } - 0.5 * (r1[k] + r5[k]) - r4[k];
        j[2][k] = r1[k] - r2[k] + r3[k];
        j[3][k] = r3[k] - r2[k] - 2.0 * r4[k];
        j[4][k] = r2[k] - r3[k] + r5[k];
    }
}

const C: f64 = 1.6e-8;
const CS: f64 = 2e-12;
const CP: f64 = 1e-8;
const LH: f64 = 4.45;
const LS1: f64 = 2e-3;
const LS2: f64 = 5e-4;
/// Of the voltages 2 to 6 across each diode, and of the carrier.
const ACROSS: [[f64; 5]; 4] =
    [[1.0, 0.0, -1.0, 0.0, -1.0], [0.0, -1.0, 0.0, 1.0, -1.0], [0.0, 1.0, 1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, -1.0, 1.0]];
const CARRIER: [f64; 4] = [-1.0, -1.0, 1.0, 1.0];
/// Of the diodes' currents in the equations 2 to 6.
const INTO: [[f64; 4]; 5] = [
    [-1.0, 0.0, 0.0, 1.0],
    [0.0, 1.0, -1.0, 0.0],
    [1.0, 0.0, -1.0, 0.0],
    [0.0, -1.0, 0.0, 1.0],
    [1.0, 1.0, -1.0, -1.0],
];

/// Currents and slopes of the diodes.
fn diodes(t: f64, y: &[f64]) -> ([f64; 4], [f64; 4]) {
    let carrier = 2.0 * (2e4 * PI * t).sin();
    let power: [f64; 4] = std::array::from_fn(|k| {
        let sum: f64 = ACROSS[k].iter().zip(&y[2..7]).map(|(a, u)| a * u).sum();
        40.67286402e-9 * (17.7493332 * (sum + CARRIER[k] * carrier)).exp()
    });
    (power.map(|e| e - 40.67286402e-9), power.map(|e| 17.7493332 * e))
}

fn ring_modulator(t: f64, y: &[f64], f: &mut [f64]) {
    let (d, signal) = (diodes(t, y).0, 0.5 * (2e3 * PI * t).sin());
    let (u, i) = y.split_at(7);
    f[0] = (i[0] - 0.5 * i[2] + 0.5 * i[3] + i[6] - u[0] / 25e3) / C;
    f[1] = (i[1] - 0.5 * i[4] + 0.5 * i[5] + i[7] - u[1] / 25e3) / C;
    f[2] = (i[2] - d[0] + d[3]) / CS;
    f[3] = (-i[3] + d[1] - d[2]) / CS;
    f[4] = (i[4] + d[0] - d[2]) / CS;
    f[5] = (-i[5] - d[1] + d[3]) / CS;
    f[6] = (d[0] + d[1] - d[2] - d[3] - u[6] / 50.0) / CP;
    f[7] = -u[0] / LH;
    f[8] = -u[1] / LH;
    f[9] = (0.5 * u[0] - u[2] - 17.3 * i[2]) / LS2;
    f[10] = (u[3] - 0.5 * u[0] - 17.3 * i[3]) / LS2;
    f[11] = (0.5 * u[1] - u[4] - 17.3 * i[4]) / LS2;
    f[12] = (u[5] - 0.5 * u[1] - 17.3 * i[5]) / LS2;
    f[13] = (signal - u[0] - 86.3 * i[6]) / LS1;
    f[14] = (-u[1] - 636.3 * i[7]) / LS1;
}

fn ring_modulator_jacobian(t: f64, y: &[f64], j: &mut Matrix) {
    let slope = diodes(t, y).1;
    for row in 0..5 {
        for column in 0..5 {
            let sum: f64 = (0..4).map(|k| INTO[row][k] * slope[k] * ACROSS[k][column]).sum();
            j[row + 2][column + 2] = sum / if row == 4 { CP } else { CS };
        }
    }
    j[6][6] -= 1.0 / (50.0 * CP);
    for (row, column, value) in [
        (0, 0, -1.0 / (25e3 * C)),
        (1, 1, -1.0 / (25e3 * C)),
        (0, 7, 1.0 / C),
        (1, 8, 1.0 / C),
        (0, 13, 1.0 / C),
        (1, 14, 1.0 / C),
        (0, 9, -0.5 / C),
        (1, 11, -0.5 / C),
        (0, 10, 0.5 / C),
        (1, 12, 0.5 / C),
        (2, 9, 1.0 / CS),
        (4, 11, 1.0 / CS),
        (3, 10, -1.0 / CS),
        (5, 12, -1.0 / CS),
        (7, 0, -1.0 / LH),
        (8, 1, -1.0 / LH),
        (9, 0, 0.5 / LS2),
        (11, 1, 0.5 / LS2),
        (10, 0, -0.5 / LS2),
        (12, 1, -0.5 / LS2),
        (9, 2, -1.0 / LS2),
        (11, 4, -1.0 / LS2),
        (10, 3, 1.0 / LS2),
        (12, 5, 1.0 / LS2),
        (9, 9, -17.3 / LS2),
        (10, 10, -17.3 / LS2),
        (11, 11, -17.3 / LS2),
        (12, 12, -17.3 / LS2),
        (13, 0, -1.0 / LS1),
        (14, 1, -1.0 / LS1),
        (13, 13, -86.3 / LS1),
        (14, 14, -636.3 / LS1),
    ] {
        j[row][column] = value;
    }
}

const MASS: [f64; 7] = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498];
const INERTIA: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];

/// 13 linear equations, the right-hand sides in the last column, which becomes the solution.
fn solve(a: &mut [[f64; 14]; 13]) {
    for k in 0..13 {
        let pivot = (k..13).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        let own = a[k];
        for row in &mut a[k + 1..] {
            let factor = row[k] / own[k];
            if factor != 0.0 {
                for c in k + 1..14 {
                    row[c] -= factor * own[c];
                }
            }
        }
    }
    for k in (0..13).rev() {
        let sum: f64 = (k + 1..13).map(|c| a[k][c] * a[c][13]).sum();
        a[k][13] = (a[k][13] - sum) / a[k][k];
    }
}

/// Andrews' mechanism as an ordinary system, as in `../sundials/known.c`.
fn squeezing_mechanism(_t: f64, z: &[f64], f: &mut [f64]) {
    let (xb, yb, xc, yc, d, da, e, rr, ra) = (-0.03635, 0.03273, 0.014, 0.072, 0.028, 0.0115, 0.02, 0.007, 0.00092);
    let (ss, sa, sb, sc, sd, ta, tb, u, ua) = (0.035, 0.01874, 0.01043, 0.018, 0.02, 0.02308, 0.00916, 0.04, 0.01228);
    let (ub, zf, zt, c0, l0, torque, e4, e6) =
        (0.00449, 0.02, 0.04, 4530.0, 0.07785, 0.033, 0.02 - 0.01421, 0.02 - 0.01421);
    let (m, j, w) = (&MASS, &INERTIA, &z[7..]);
    let ((sbe, cbe), (sbt, cbt), (sth, cth)) = (z[0].sin_cos(), (z[0] + z[1]).sin_cos(), z[1].sin_cos());
    let ((sga, cga), (sph, cph), (sde, cde)) = (z[2].sin_cos(), z[3].sin_cos(), z[4].sin_cos());
    let ((spd, cpd), (som, com), (sep, cep)) = ((z[3] + z[4]).sin_cos(), z[5].sin_cos(), z[6].sin_cos());
    let (soe, coe) = (z[5] + z[6]).sin_cos();
    let (dx, dy): (f64, f64) = (sd * cga + sc * sga + xb - xc, sd * sga - sc * cga + yb - yc);
    let pull = c0 * (l0 / (dx * dx + dy * dy).sqrt() - 1.0);
    let (w12, w45, w67) = (w[0] + w[1], w[3] + w[4], w[5] + w[6]);
    let mut a = [[0.0; 14]; 13];
    a[0][0] = m[0] * ra * ra + m[1] * (rr * rr - 2.0 * da * rr * cth + da * da) + j[0] + j[1];
    a[0][1] = m[1] * (da * da - da * rr * cth) + j[1];
    a[1][1] = m[1] * da * da + j[1];
    a[2][2] = m[2] * (sa * sa + sb * sb) + j[2];
    a[3][3] = m[3] * e4 * e4 + j[3];
    a[3][4] = m[3] * (e4 * e4 + zt * e4 * sph) + j[3];
    a[4][4] = m[3] * (zt * zt + 2.0 * zt * e4 * sph + e4 * e4) + m[4] * (ta * ta + tb * tb) + j[3] + j[4];
    a[5][5] = m[5] * e6 * e6 + j[5];
    a[5][6] = m[5] * (e6 * e6 - u * e6 * som) + j[5];
    a[6][6] = m[5] * (e6 * e6 - 2.0 * u * e6 * som + u * u) + m[6] * (ua * ua + ub * ub) + j[5] + j[6];
    (a[1][0], a[4][3], a[6][5]) = (a[0][1], a[3][4], a[5][6]);
    let forces = [
        torque - m[1] * da * rr * w[1] * (w[1] + 2.0 * w[0]) * sth,
        m[1] * da * rr * w[0] * w[0] * sth,
        pull * (dx * (sc * cga - sd * sga) + dy * (sd * cga + sc * sga)),
        m[3] * zt * e4 * w[4] * w[4] * cph,
        -m[3] * zt * e4 * w[3] * (w[3] + 2.0 * w[4]) * cph,
        -m[5] * u * e6 * w[6] * w[6] * com,
        m[5] * u * e6 * w[5] * (w[5] + 2.0 * w[6]) * com,
    ];
    let (bend_x, bend_y) =
        (-rr * cbe * w[0] * w[0] + d * cbt * w12 * w12, -rr * sbe * w[0] * w[0] + d * sbt * w12 * w12);
    let rows: [(f64, &[(usize, f64)]); 6] = [
        (-bend_x - ss * sga * w[2] * w[2], &[(2, -ss * cga)]),
        (-bend_y + ss * cga * w[2] * w[2], &[(2, -ss * sga)]),
        (-bend_x - e * spd * w45 * w45 - zt * cde * w[4] * w[4], &[(3, -e * cpd), (4, -e * cpd + zt * sde)]),
        (-bend_y + e * cpd * w45 * w45 - zt * sde * w[4] * w[4], &[(3, -e * spd), (4, -e * spd - zt * cde)]),
        (-bend_x - zf * coe * w67 * w67 - u * sep * w[6] * w[6], &[(5, zf * soe), (6, zf * soe - u * cep)]),
        (-bend_y - zf * soe * w67 * w67 + u * cep * w[6] * w[6], &[(5, -zf * coe), (6, -zf * coe - u * sep)]),
    ];
    for (k, (right, entries)) in rows.into_iter().enumerate() {
        let crank = if k % 2 == 0 {
            [(0, -rr * sbe + d * sbt), (1, d * sbt)]
        } else {
            [(0, rr * cbe - d * cbt), (1, -d * cbt)]
        };
        for (c, value) in crank.iter().chain(entries) {
            (a[7 + k][*c], a[*c][7 + k]) = (*value, *value);
        }
        a[7 + k][13] = right;
    }
    for (row, force) in a.iter_mut().zip(forces) {
        row[13] = force;
    }
    solve(&mut a);
    for k in 0..7 {
        (f[k], f[7 + k]) = (w[k], a[k][13]);
    }
}

/// Directional derivative by central differences.
fn difference(rates: fn(f64, &[f64], &mut [f64]), t: f64, y: &[f64], v: &[f64], f: &mut [f64]) {
    let size = v.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    if size == 0.0 {
        return f.fill(0.0);
    }
    let scale = y.iter().zip(v).filter(|(_, v)| **v != 0.0).fold(1e-3f64, |most, (y, _)| most.max(y.abs()));
    let h = 1e-7 * scale / size;
    let (mut low, mut high) = ([0.0; MOST], [0.0; MOST]);
    let moved = |sign: f64| y.iter().zip(v).map(|(y, v)| y + sign * h * v).collect::<Vec<f64>>();
    rates(t, &moved(-1.0), &mut low);
    rates(t, &moved(1.0), &mut high);
    for (f, (low, high)) in f.iter_mut().zip(low.iter().zip(&high)) {
        *f = (high - low) / (2.0 * h);
    }
}

fn problem(name: &str) -> Problem {
    match name {
        "robertson" => Problem {
            stop: 1e11,
            start: &[1.0, 0.0, 0.0],
            nominal: &[1e-7, 1e-13, 1.0],
            rates: robertson,
            jacobian: Some(robertson_jacobian),
        },
        "hires" => Problem {
            stop: 321.8122,
            start: &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057],
            nominal: &[1e-3; 8],
            rates: hires,
            jacobian: Some(hires_jacobian),
        },
        "akzo_nobel" => Problem {
            stop: 180.0,
            start: &[0.444, 0.00123, 0.0, 0.007, 0.0],
            nominal: &[0.1, 1e-3, 0.1, 1e-3, 1e-2],
            rates: akzo_nobel,
            jacobian: Some(akzo_nobel_jacobian),
        },
        "ring_modulator" => Problem {
            stop: 1e-3,
            start: &[0.0; 15],
            nominal: &[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3],
            rates: ring_modulator,
            jacobian: Some(ring_modulator_jacobian),
        },
        "squeezing_mechanism" => Problem {
            stop: 0.03,
            start: &[
                -0.0617138900142764496,
                0.0,
                0.455279819163070380,
                0.222668390165885885,
                0.487364979543842550,
                -0.222668390165885885,
                1.23054744454982119,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ],
            nominal: &[1.0; 14],
            rates: squeezing_mechanism,
            jacobian: None,
        },
        other => panic!("no problem {other}"),
    }
}

/// Runs one method several times; a macro because the solver types differ.
macro_rules! measure {
    ($problem:expr, $method:ident, $stop:expr) => {{
        let (mut best, mut spent, mut runs, mut steps, mut end) = (f64::MAX, 0.0, 0, 0, Vec::new());
        while runs == 0 || (spent < 1.0 && runs < 50) {
            let begin = cpu();
            let mut solver = $problem.$method::<NalgebraLU<f64>>().expect("solver");
            while solver.state().t < $stop {
                solver.step().expect("step");
            }
            end = solver.interpolate($stop).expect("interpolation").clone_as_vec();
            let seconds = cpu() - begin;
            steps = solver.get_statistics().number_of_steps;
            best = best.min(seconds);
            spent += seconds;
            runs += 1;
        }
        let values: Vec<String> = end.iter().map(|value| format!("{value:.17e}")).collect();
        println!("{best:.9} {steps} {}", values.join(" "));
    }};
}

fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (own, tolerance) = (problem(&a[2]), a[3].parse::<f64>().expect("tolerance"));
    let (rates, jacobian, start, stop) = (own.rates, own.jacobian, own.start, own.stop);
    let slope = move |t: f64, y: &[f64], v: &[f64], f: &mut [f64]| {
        let Some(jacobian) = jacobian else { return difference(rates, t, y, v, f) };
        let mut j = [[0.0; MOST]; MOST];
        jacobian(t, y, &mut j);
        for (f, row) in f.iter_mut().zip(&j) {
            *f = row.iter().zip(v).map(|(j, v)| j * v).sum();
        }
    };
    let built = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(tolerance)
        .atol(own.nominal.iter().map(|nominal| tolerance * nominal).collect::<Vec<_>>())
        .rhs_implicit(move |y, _p, t, f| rates(t, y, f), move |y, _p, t, v, f| slope(t, y, v, f))
        .init(move |_p, _t, y| y.copy_from_slice(start), start.len())
        .build()
        .expect("problem");
    match a[1].as_str() {
        "bdf" => measure!(built, bdf, stop),
        "esdirk34" => measure!(built, esdirk34, stop),
        "tr_bdf2" => measure!(built, tr_bdf2, stop),
        other => panic!("no method {other}"),
    }
}
