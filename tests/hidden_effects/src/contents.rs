//! What a chamber holds: pressure from the amount of oil in a volume.  The state is the amount `M`, the volume that the oil would
//! take at reference pressure, and `M/V` decides everything: without a floor p = p_z + K ln(M/V), which is dp/dt = K/V (Q - dV/dt)
//! integrated; with a floor (vapour, or air let in) the pressure stays there while M < V; with air in the oil the mixture's
//! specific volume exp(-p/K) + part (p_a/p)^(1/n) is solved for p.  No pressure is a state, unlike in the usual statement.

use crate::machine::{Air, Machine};

/// Pressure at which the part of air is stated, Pa.
const ATMOSPHERE: f64 = 1e5;
/// Rounding of the floor's corner, in units of the relative volume.
const CORNER: f64 = 2e-5;
/// Vapour pressure where a pipe needs one and none is hidden, Pa.
const VAPOUR: f64 = 2e3;

/// The law of a chamber's contents.
#[derive(Clone, Debug)]
pub struct Contents {
    bulk: f64,
    reference: f64,
    floor: Option<f64>,
    corner: f64,
    air: Option<Air>,
    filled: f64,
}

impl Contents {
    /// The law in this machine.
    pub fn of(machine: &Machine) -> Contents {
        let hidden = &machine.hidden;
        let floor = match (hidden.filling, hidden.vapour, &hidden.pipe) {
            (Some(_), ..) => Some(ATMOSPHERE),
            (None, Some(pressure), _) => Some(pressure),
            (None, None, Some(_)) => Some(VAPOUR),
            (None, None, None) => None,
        };
        Contents {
            bulk: machine.chamber.bulk,
            reference: floor.unwrap_or(machine.chamber.p_z),
            floor,
            corner: if hidden.other_forms { CORNER } else { 0.0 },
            air: hidden.air.clone(),
            filled: hidden.filling.unwrap_or(1.0),
        }
    }

    /// Pressure (Pa) where the amount is `ratio` times the volume.
    pub fn pressure(&self, ratio: f64) -> f64 {
        if let Some(air) = &self.air {
            return self.mixture(air, 1.0 / ratio);
        }
        let strain = ratio.ln();
        match self.floor {
            Some(floor) => floor + self.bulk * 0.5 * (strain + (strain * strain + self.corner * self.corner).sqrt()),
            None => self.reference + self.bulk * strain,
        }
    }

    /// How much the amount grows per volume that flows in.
    pub fn intake(&self, ratio: f64) -> f64 {
        if self.floor.is_some() && self.air.is_none() { ratio.max(1.0) } else { ratio }
    }

    /// Amount over volume at rest at this pressure, Pa.
    pub fn at_rest(&self, pressure: f64) -> f64 {
        if let Some(air) = &self.air {
            return self.filled / self.specific(air, (pressure / ATMOSPHERE).ln());
        }
        let strain = (pressure - self.reference) / self.bulk;
        let bent = if self.floor.is_some() && strain > 0.0 { self.corner * self.corner / (4.0 * strain) } else { 0.0 };
        self.filled * (strain - bent).exp()
    }

    /// Whether the floor is left, for the location of the kink.
    pub fn compressed(&self, ratio: f64) -> bool {
        self.floor.is_some() && self.corner == 0.0 && ratio > 1.0
    }

    fn specific(&self, air: &Air, log_pressure: f64) -> f64 {
        (-ATMOSPHERE * log_pressure.exp() / self.bulk).exp() + air.part * (-log_pressure / air.exponent).exp()
    }

    /// Solves the mixture's law by Newton's method on ln(p/p_a), kept within a shrinking bracket.
    fn mixture(&self, air: &Air, volume: f64) -> f64 {
        let (mut low, mut high) = (-14.0, 9.0);
        let mut u: f64 = if volume > 1.0 { -air.exponent * ((volume - 1.0) / air.part).ln() } else { 4.0 };
        for _ in 0..60 {
            u = if u > low && u < high { u } else { 0.5 * (low + high) };
            let excess = self.specific(air, u) - volume;
            if excess > 0.0 {
                low = u;
            } else {
                high = u;
            }
            let pressure = ATMOSPHERE * u.exp();
            let slope = -pressure / self.bulk * (-pressure / self.bulk).exp()
                - air.part / air.exponent * (-u / air.exponent).exp();
            let change = excess / slope;
            u -= change;
            if change.abs() < 1e-13 {
                break;
            }
        }
        ATMOSPHERE * u.exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressures_come_back() {
        let mut machine = Machine::nominal();
        for pressure in [2.5e4, 1e5, 4e5, 1e7] {
            machine.hidden.air = None;
            let plain = Contents::of(&machine);
            assert!((plain.pressure(plain.at_rest(pressure)) - pressure).abs() < 1e-3);
            machine.hidden.air = Some(Air { part: 0.04, exponent: 1.3 });
            let mixed = Contents::of(&machine);
            assert!((mixed.pressure(mixed.at_rest(pressure)) / pressure - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn air_makes_the_bulk_modulus_that_is_usually_stated() {
        let mut machine = Machine::nominal();
        machine.hidden.air = Some(Air { part: 0.03, exponent: 1.2 });
        let contents = Contents::of(&machine);
        for pressure in [2e5, 1e6, 5e6] {
            let (a, b) = (contents.at_rest(pressure * 0.999), contents.at_rest(pressure * 1.001));
            let bulk = 0.002 * pressure / (b / a).ln();
            let r = 0.03 * (1e5f64 / pressure).powf(1.0 / 1.2);
            let stated = (1.0 + r) / (1.0 / 1.4e9 + r / (1.2 * pressure));
            assert!((bulk / stated - 1.0).abs() < 5e-3, "{bulk} {stated}");
        }
    }
}
