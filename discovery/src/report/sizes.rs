//! Numbers of effects: value, standard error, and a 95 % interval that also knows that laws are idealised.
//!
//! A standard error tells how far noise and what else may be off let a number move while the law holds.  No law of a library is nature's,
//! though (a lag has a second stage, friction another curve at low speed), and with a good record the noise is soon the smaller part.
//! So the interval takes up, beside the noise, that the number may be off by a share of itself (`form` of the effect, one standard
//! deviation).  Both parts are independent: their squares add up, end by end, as the interval of the noise need not be symmetrical.

use hyd_system::as_known;
use serde_json::{Value, json};

use super::number;
use crate::catalogue::Effect;
use crate::fit::Fit;
use crate::problem::Problem;

/// Standard deviations to either side that hold 95 % of a normal distribution.
const DEVIATIONS_95: f64 = 1.96;

/// A number of an effect in its unit.
pub(super) struct Size {
    value: f64,
    /// Standard error; not finite where the record does not tell it.
    error: f64,
    /// Ends of the 95 % interval.
    interval: [f64; 2],
    /// Unit of the parameter; empty where it has none.
    unit: String,
    /// Share of itself by which the number may be off for the form of the law.
    form: f64,
}

impl Size {
    /// Unknown `k` of a fit, which is a number of `effect`.
    pub(super) fn of(problem: &Problem<'_>, fit: &Fit, k: usize, effect: &Effect) -> Self {
        let (unknown, xi) = (&problem.unknowns[k], fit.xi[k]);
        let of_xi = fit.standard_error(k).unwrap_or(f64::NAN);
        let value = unknown.value(xi);
        let form = DEVIATIONS_95 * effect.form * value;
        let end = |sign: f64| {
            let noise = unknown.value(xi + sign * DEVIATIONS_95 * of_xi) - value;
            value + sign * (noise * noise + form * form).sqrt()
        };
        let place = unknown.places().first().map(|&place| problem.machine.unit(&problem.places[place]).to_string());
        Self {
            value,
            error: of_xi * unknown.slope(xi).abs(),
            interval: [end(-1.0), end(1.0)],
            unit: place.filter(|unit| unit != "1").unwrap_or_default(),
            form: effect.form,
        }
    }

    pub(super) fn json(&self) -> Value {
        let [low, high] = self.interval.map(number);
        json!({"value": number(self.value), "stderr": number(self.error), "form": self.form, "interval": [low, high], "unit": self.unit})
    }
}

/// `1.19 +- 0.03 m (95 %: 1.06 to 1.32)`, as far as the numbers are known.
pub(super) fn words(size: &Value) -> String {
    let figure = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let (value, error) = (figure(&size["value"]), figure(&size["stderr"]));
    let unit =
        size["unit"].as_str().filter(|unit| !unit.is_empty()).map_or_else(String::new, |unit| format!(" {unit}"));
    let [low, high] = [0, 1].map(|k| figure(&size["interval"][k]));
    let interval = match low.is_finite() && high.is_finite() {
        true => {
            let [low, high] = [low, high].map(|end| as_known(end, (high - low) / 4.0));
            format!(" (95 %: {low} to {high})")
        }
        false => String::new(),
    };
    let spread = if error.is_finite() { as_known(error, error) } else { "unknown".to_string() };
    format!("{} +- {spread}{unit}{interval}", as_known(value, error))
}

#[cfg(test)]
mod tests {
    use super::words;
    use serde_json::json;

    #[test]
    fn a_size_has_the_digits_that_are_known() {
        let size = json!({"value": 1.19132, "stderr": 0.0313, "interval": [1.0589, 1.3237], "unit": "m"});
        assert_eq!(words(&size), "1.191 +- 0.031 m (95 %: 1.059 to 1.324)");
        let size =
            json!({"value": 1.209e-11, "stderr": 1.4e-13, "interval": [1.087e-11, 1.331e-11], "unit": "m3/(s.Pa)"});
        assert_eq!(words(&size), "1.209e-11 +- 1.4e-13 m3/(s.Pa) (95 %: 1.087e-11 to 1.331e-11)");
        assert_eq!(words(&json!({"value": 2.5, "stderr": null, "interval": [null, null]})), "2.5 +- unknown");
    }
}
