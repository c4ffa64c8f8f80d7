//! The supply line by the method of characteristics: along dz = +-a dt the quantities p +- Z q (Z = rho a/A) change by friction
//! alone (Wylie, Streeter, Fluid Transients in Systems, 1993, ch. 3).  A grid of cells a dt long carries both families; the ends
//! are the accumulator and the volume at the distributor, whose states the integrator advances between two grid times with the
//! arriving waves interpolated linearly.  Friction acts in every cell.

use crate::machine::Line;

/// Density and the line's numbers as the waves need them.
#[derive(Clone, Debug)]
pub struct Waves {
    /// Wave impedance, Pa s/m3.
    pub impedance: f64,
    /// Time between two grid times, s.
    pub step: f64,
    /// Last grid time, s.
    pub time: f64,
    laminar: f64,
    turbulent: f64,
    pressure: Vec<f64>,
    flow: Vec<f64>,
    /// Arriving at the distributor (p + Z q) at the last and at the next grid time, Pa.
    pub plus: [f64; 2],
    /// Arriving at the accumulator (p - Z q), Pa.
    pub minus: [f64; 2],
}

impl Waves {
    /// The line at rest at `pressure` from `time` on, in oil of density `rho`.
    pub fn at_rest(line: &Line, rho: f64, time: f64, pressure: f64) -> Waves {
        let area = std::f64::consts::PI * line.diameter * line.diameter / 4.0;
        let cells = (line.length / (line.wave * line.grid)).ceil().max(4.0);
        let cell = line.length / cells;
        Waves {
            impedance: rho * line.wave / area,
            step: cell / line.wave,
            time,
            laminar: 128.0 * rho * line.nu / (std::f64::consts::PI * line.diameter.powi(4)) * cell,
            turbulent: line.friction * rho / (2.0 * line.diameter * area * area) * cell,
            pressure: vec![pressure; cells as usize + 1],
            flow: vec![0.0; cells as usize + 1],
            plus: [pressure; 2],
            minus: [pressure; 2],
        }
    }

    /// The waves arriving at both ends at time `t` between the last and the next grid time.
    pub fn arriving(&self, t: f64) -> (f64, f64) {
        let part = (t - self.time) / self.step;
        (self.plus[0] + part * (self.plus[1] - self.plus[0]), self.minus[0] + part * (self.minus[1] - self.minus[0]))
    }

    fn loss(&self, flow: f64) -> f64 {
        (self.laminar + self.turbulent * flow.abs()) * flow
    }

    /// Advances the grid to the next grid time; the ends' pressures there are given (accumulator, distributor).
    pub fn advance(&mut self, accumulator: f64, distributor: f64) {
        let z = self.impedance;
        let last = self.pressure.len() - 1;
        let arrived: Vec<(f64, f64)> = (0..=last)
            .map(|node| {
                let left = node.saturating_sub(1);
                let right = (node + 1).min(last);
                (
                    self.pressure[left] + z * self.flow[left] - self.loss(self.flow[left]),
                    self.pressure[right] - z * self.flow[right] + self.loss(self.flow[right]),
                )
            })
            .collect();
        for (node, &(plus, minus)) in arrived.iter().enumerate().take(last).skip(1) {
            self.pressure[node] = 0.5 * (plus + minus);
            self.flow[node] = 0.5 * (plus - minus) / z;
        }
        self.pressure[0] = accumulator;
        self.flow[0] = (accumulator - self.minus[1]) / z;
        self.pressure[last] = distributor;
        self.flow[last] = (self.plus[1] - distributor) / z;
        self.time += self.step;
        self.plus = [self.plus[1], self.pressure[last - 1] + z * self.flow[last - 1] - self.loss(self.flow[last - 1])];
        self.minus = [self.minus[1], self.pressure[1] - z * self.flow[1] + self.loss(self.flow[1])];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dead end and a pressure step: Joukowsky's doubling after L/a, back to the step after 3 L/a.
    #[test]
    fn a_step_doubles_at_a_dead_end() {
        let line = Line {
            length: 1.25,
            diameter: 0.012,
            wave: 1250.0,
            gas: 1.0,
            exponent: 1.3,
            inlet: 3e-6,
            nu: 0.0,
            friction: 0.0,
            grid: 1e-5,
        };
        let mut waves = Waves::at_rest(&line, 860.0, 0.0, 1e6);
        let mut end = Vec::new();
        for _ in 0..400 {
            let closed = waves.plus[1];
            waves.advance(2e6, closed);
            end.push(closed);
        }
        assert_eq!(end[50], 1e6);
        assert!((end[150] - 3e6).abs() < 1.0 && (end[350] - 1e6).abs() < 1.0, "{} {}", end[150], end[350]);
    }
}
