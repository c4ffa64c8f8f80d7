//! Forms with memory: what an equation may lack that has states of its own.
//!
//! A term follows what its variables are now.  A spring whose coils surge, a bubble that breathes, a film that is squeezed, a coil that
//! warms during a shot follow what they were.  The forms are the usual ones of one or two states: a relaxation (Maxwell 1867), a mass on a
//! spring (the vibration absorber of Den Hartog, "Mechanical Vibrations", section 3.2), hysteresis after Bouc and Wen with an exponent of
//! one (Dahl 1968; Wen, Journal of the Engineering Mechanics Division 102 (1976) 249), and warming by a square.  Each is said twice: as
//! its course along a variable's, for the screening, and as text.

use std::fmt::Write;

use hyd_compiler::print_string;

use crate::machine::span::Span;
use crate::terms::unit_quotient::quotient;

/// Longest step of the integration by the fastest rate of a form.
const STEP: f64 = 0.2;
/// Damping ratios of resonances that are tried.
const DAMPING: [f64; 2] = [0.04, 0.25];
/// Factors between numbers that are tried: times, frequencies, travels.
const FACTORS: (f64, f64, f64) = (1.5, 1.12, 2.0);
/// Shortest travel of hysteresis that is tried, by that of the record.
const SHORTEST: f64 = 0.003;
/// Longest time by the length of the record; with more it is an integral.
const LONGEST: f64 = 3.0;

/// How the state follows the variable `u`, and what the term is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Form {
    /// `T*der(z) = u - z`; the term is `z`.
    Lag,
    /// The same; the term is `u - z`.
    Relaxation,
    /// `der(z) = r`, `der(r) = w*w*(u - z) - 2*D*w*r`; the term is `z`.
    Resonance,
    /// The same; the term is `u - z`.
    Absorber,
    /// `L*der(z) = u - abs(u)*z`; the term is `z`.
    Hysteresis,
    /// `T*der(z) = u*u - z`; the term is `z*u`.
    Warming,
}

/// A term with states of its own.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Dynamics {
    /// The form.
    pub form: Form,
    /// The variable that it follows, by its name in the component.
    pub driver: String,
    /// Unit of that variable; empty if unknown.
    pub unit: String,
    /// Time constant (s); angular frequency (1/s) and damping ratio; or the integral of the variable over which hysteresis turns.
    pub numbers: Vec<f64>,
}

/// What states and numbers are called in a text.
#[derive(Clone, Debug)]
pub(crate) struct Names {
    /// The state, and its rate of change.
    pub states: [String; 2],
    /// The numbers.
    pub numbers: Vec<String>,
}

/// A number of a form: how it is called, its unit for a variable of this unit, and what it is.
struct Number {
    letter: &'static str,
    unit: Option<String>,
    words: &'static str,
}

impl Form {
    /// All of them.
    pub(crate) const ALL: [Form; 6] =
        [Form::Lag, Form::Relaxation, Form::Resonance, Form::Absorber, Form::Hysteresis, Form::Warming];

    /// Sets of numbers to be tried, for a record of this length (s) seen with this resolution (s), in which the variable travels so far
    /// (unit times s).
    pub(crate) fn grid(self, length: f64, resolution: f64, travel: f64) -> Vec<Vec<f64>> {
        let steps = |from: f64, to: f64, factor: f64| {
            std::iter::successors(Some(from), move |value| Some(value * factor)).take_while(move |value| *value <= to)
        };
        match self {
            Form::Lag | Form::Relaxation => {
                steps(resolution, LONGEST * length, FACTORS.0).map(|time| vec![time]).collect()
            }
            Form::Warming => steps(0.1 * length, LONGEST * length, FACTORS.2).map(|time| vec![time]).collect(),
            Form::Resonance | Form::Absorber => {
                let slowest = std::f64::consts::TAU / length;
                let fastest = 0.25 * std::f64::consts::TAU / resolution;
                let of = |frequency: f64| DAMPING.iter().map(move |&damping| vec![frequency, damping]);
                steps(slowest, fastest, FACTORS.1).flat_map(of).collect()
            }
            Form::Hysteresis if travel > 0.0 && travel.is_finite() => {
                steps(SHORTEST * travel, travel, FACTORS.2).map(|own| vec![own]).collect()
            }
            Form::Hysteresis => Vec::new(),
        }
    }

    fn numbers(self, unit: &str) -> Vec<Number> {
        let seconds = || Some("s".to_string());
        match self {
            Form::Lag | Form::Relaxation | Form::Warming => {
                vec![Number { letter: "T", unit: seconds(), words: "time constant" }]
            }
            Form::Resonance | Form::Absorber => vec![
                Number { letter: "w", unit: Some("rad/s".to_string()), words: "natural angular frequency" },
                Number { letter: "D", unit: Some("1".to_string()), words: "damping ratio" },
            ],
            Form::Hysteresis => {
                let unit = quotient(unit, "s", (-1, 1)).filter(|_| !unit.is_empty());
                vec![Number { letter: "L", unit, words: "travel over which the hysteresis turns" }]
            }
        }
    }

    fn has_rate(self) -> bool {
        matches!(self, Form::Resonance | Form::Absorber)
    }

    /// True for forms that begin in equilibrium with their variable, not at zero.
    fn begins_at_rest(self) -> bool {
        !matches!(self, Form::Hysteresis | Form::Warming)
    }
}

impl Dynamics {
    /// What the term is along a course of the variable, on output points.
    pub(crate) fn course(&self, span: &Span, variable: &[f64]) -> Vec<f64> {
        let Some(&first) = variable.first() else { return Vec::new() };
        let mut state = [if self.form.begins_at_rest() { first } else { 0.0 }, 0.0];
        let mut course = vec![self.term(state[0], first)];
        for pair in variable.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let rate = match (self.form, &self.numbers[..]) {
                (Form::Hysteresis, &[travel]) => from.abs().max(to.abs()) / travel,
                (Form::Resonance | Form::Absorber, &[frequency, ..]) => frequency,
                (_, numbers) => numbers.first().map_or(0.0, |time| 1.0 / time),
            };
            let count = (rate * span.step() / STEP).ceil().clamp(1.0, 1e4) as usize;
            let step = span.step() / count as f64;
            let at = |share: f64| from + share * (to - from);
            for k in 0..count {
                let share = |part: f64| (k as f64 + part) / count as f64;
                let (begin, middle, end) = (at(share(0.0)), at(share(0.5)), at(share(1.0)));
                let moved = |by: [f64; 2], step: f64| [state[0] + step * by[0], state[1] + step * by[1]];
                // The classical method of Runge and Kutta.
                let a = self.rates(state, begin);
                let b = self.rates(moved(a, 0.5 * step), middle);
                let c = self.rates(moved(b, 0.5 * step), middle);
                let d = self.rates(moved(c, step), end);
                let mean = |k: usize| (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]) / 6.0;
                state = moved([mean(0), mean(1)], step);
            }
            course.push(self.term(state[0], to));
        }
        course
    }

    /// Rates of change of the states.
    fn rates(&self, [z, r]: [f64; 2], u: f64) -> [f64; 2] {
        match (self.form, &self.numbers[..]) {
            (Form::Lag | Form::Relaxation, &[time]) => [(u - z) / time, 0.0],
            (Form::Warming, &[time]) => [(u * u - z) / time, 0.0],
            (Form::Resonance | Form::Absorber, &[frequency, damping]) => {
                [r, frequency * frequency * (u - z) - 2.0 * damping * frequency * r]
            }
            (Form::Hysteresis, &[travel]) => [(u - u.abs() * z) / travel, 0.0],
            _ => [0.0, 0.0],
        }
    }

    fn term(&self, z: f64, u: f64) -> f64 {
        match self.form {
            Form::Lag | Form::Resonance | Form::Hysteresis => z,
            Form::Relaxation | Form::Absorber => u - z,
            Form::Warming => z * u,
        }
    }

    /// The term as text.
    pub(crate) fn shape(&self, names: &Names) -> String {
        let (state, driver) = (&names.states[0], &self.driver);
        match self.form {
            Form::Lag | Form::Resonance | Form::Hysteresis => state.clone(),
            Form::Relaxation | Form::Absorber => format!("({driver} - {state})"),
            Form::Warming => format!("{state}*{driver}"),
        }
    }

    /// Unit of the coefficient in an equation of this unit.
    pub(crate) fn unit_of_coefficient(&self, own: &str) -> Option<String> {
        match self.form {
            Form::Hysteresis => Some(own.to_string()),
            Form::Warming => quotient(own, &self.unit, (3, 1)),
            _ => quotient(own, &self.unit, (1, 1)),
        }
    }

    /// Names of its states and numbers with this ending.
    pub(crate) fn names(&self, ending: &str) -> Names {
        let numbers = self.form.numbers(&self.unit).iter().map(|own| format!("{}{ending}", own.letter)).collect();
        Names { states: [format!("z{ending}"), format!("r{ending}")], numbers }
    }

    /// Names, units and words of the numbers.
    pub(crate) fn numbers(&self, names: &Names) -> Vec<(String, Option<String>, &'static str)> {
        let own = self.form.numbers(&self.unit);
        names.numbers.iter().zip(own).map(|(name, own)| (name.clone(), own.unit, own.words)).collect()
    }

    /// Declarations of the states, lines of a class.
    pub(crate) fn states(&self, names: &Names) -> String {
        let [state, rate] = &names.states;
        let unit_of_state = match self.form {
            Form::Hysteresis => Some("1".to_string()),
            Form::Warming => quotient("1", &self.unit, (-2, 1)),
            _ => Some(self.unit.clone()).filter(|unit| !unit.is_empty()),
        };
        let with =
            |unit: Option<String>| unit.map_or(String::new(), |unit| format!("(unit = {})", print_string(&unit)));
        let words = print_string(&self.words_of_state());
        let mut text = format!("Real {state}{} {words};\n", with(unit_of_state));
        if self.form.has_rate() {
            let unit = Some(&self.unit).filter(|unit| !unit.is_empty()).and_then(|unit| quotient(unit, "s", (1, 1)));
            // Writing to a String cannot fail.
            let _ = writeln!(text, "Real {rate}{} \"rate of change of {state}\";", with(unit));
        }
        text
    }

    fn words_of_state(&self) -> String {
        let driver = &self.driver;
        match self.form {
            Form::Lag | Form::Relaxation => format!("{driver}, lagging"),
            Form::Resonance | Form::Absorber => format!("what hangs at {driver} by a spring"),
            Form::Hysteresis => format!("hysteresis along {driver}, from -1 to 1"),
            Form::Warming => format!("square of {driver}, lagging"),
        }
    }

    /// Initial equations and equations, lines of a class; `variable` is what the text calls the variable.
    pub(crate) fn equations(&self, names: &Names, variable: &str) -> (String, String) {
        let [state, rate] = &names.states;
        let number = |k: usize| names.numbers.get(k).map_or("", String::as_str);
        let (first, second) = (number(0), number(1));
        let begin = if self.form.begins_at_rest() { variable } else { "0" };
        let (mut initial, equations) = (
            format!("{state} = {begin};\n"),
            match self.form {
                Form::Lag | Form::Relaxation => format!("{first}*der({state}) = {variable} - {state};\n"),
                Form::Warming => format!("{first}*der({state}) = {variable}*{variable} - {state};\n"),
                Form::Resonance | Form::Absorber => format!(
                    "der({state}) = {rate};\nder({rate}) = {first}*{first}*({variable} - {state}) - 2*{second}*{first}*{rate};\n"
                ),
                Form::Hysteresis => {
                    format!("{first}*der({state}) = {variable} - noEvent(abs({variable}))*{state};\n")
                }
            },
        );
        if self.form.has_rate() {
            let _ = writeln!(initial, "{rate} = 0;");
        }
        (initial, equations)
    }

    /// The term in words, for messages.
    pub(crate) fn words(&self) -> String {
        let (driver, unit) = (&self.driver, &self.unit);
        let number = |k: usize| self.numbers.get(k).copied().unwrap_or(f64::NAN);
        let milliseconds = 1e3 * number(0);
        match self.form {
            Form::Lag => format!("{driver} lagged by {milliseconds:.3} ms"),
            Form::Relaxation => format!("{driver} relaxing within {milliseconds:.3} ms"),
            Form::Resonance | Form::Absorber => {
                let hertz = number(0) / std::f64::consts::TAU;
                let how = if self.form == Form::Resonance { "behind" } else { "with" };
                format!("{driver} {how} a resonance of {hertz:.4} Hz")
            }
            Form::Hysteresis => format!("hysteresis along {driver} within {:.3e} {unit}.s", number(0)),
            Form::Warming => format!("{driver} times its square lagged by {milliseconds:.3} ms"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Dynamics, Form, Names};
    use crate::machine::span::Span;

    fn of(form: Form, numbers: &[f64]) -> Dynamics {
        Dynamics { form, driver: "v".into(), unit: "m/s".into(), numbers: numbers.to_vec() }
    }

    #[test]
    fn courses_are_those_of_the_differential_equations() {
        let span = Span { start: 0.0, stop: 2.0, intervals: 400 };
        let times: Vec<f64> = (0..=400).map(|k| 5e-3 * f64::from(k)).collect();
        let ramp: Vec<f64> = times.iter().map(|t| 1.0 + 3.0 * t).collect();
        let check = |own: &Dynamics, variable: &[f64], truth: &dyn Fn(f64) -> f64| {
            for (t, value) in times.iter().zip(own.course(&span, variable)) {
                assert!((value - truth(*t)).abs() < 1e-6, "{own:?} at {t}: {value} instead of {}", truth(*t));
            }
        };
        // A ramp is followed at a distance that settles.
        let late = |t: f64, time: f64| 3.0 * time * (1.0 - (-t / time).exp());
        check(&of(Form::Lag, &[0.3]), &ramp, &|t| 1.0 + 3.0 * t - late(t, 0.3));
        check(&of(Form::Relaxation, &[1e-3]), &ramp, &|t| late(t, 1e-3));
        // A mass on a spring behind a ramp swings about the distance 2 D s/w.
        let (w, d) = (20.0_f64, 0.25_f64);
        let swing = |t: f64| {
            let damped = w * (1.0 - d * d).sqrt();
            let (b, c) = (-2.0 * d * 3.0 / w, (3.0 - 2.0 * d * d * 3.0) / damped);
            -b + (-d * w * t).exp() * (b * (damped * t).cos() + c * (damped * t).sin())
        };
        let near = of(Form::Absorber, &[w, d]).course(&span, &ramp);
        let worst = times.iter().zip(near).map(|(t, own)| (own - swing(*t)).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-4, "{worst}");
        // At constant speed hysteresis closes within its travel.
        check(&of(Form::Hysteresis, &[0.5]), &vec![-2.0; 401], &|t| -1.0 + (-4.0 * t).exp());
        check(&of(Form::Warming, &[0.7]), &vec![2.0; 401], &|t| 8.0 * (1.0 - (-t / 0.7).exp()));
    }

    #[test]
    fn grids_cover_what_a_record_can_tell() {
        for form in Form::ALL {
            let grid = form.grid(0.05, 2.5e-4, 0.01);
            assert!((5..200).contains(&grid.len()), "{form:?}: {}", grid.len());
            assert!(grid.iter().flatten().all(|number| *number > 0.0));
        }
        assert!(Form::Hysteresis.grid(0.05, 2.5e-4, 0.0).is_empty());
    }

    #[test]
    fn texts_carry_units() {
        let own = of(Form::Absorber, &[300.0, 0.1]);
        let names: Names = own.names("_1");
        assert_eq!(own.shape(&names), "(v - z_1)");
        assert_eq!(own.unit_of_coefficient("N").as_deref(), Some("N.s/m"));
        assert!(own.states(&names).contains("Real r_1(unit = \"m/s2\")"), "{}", own.states(&names));
        let (initial, equations) = own.equations(&names, "u1");
        assert_eq!(initial, "z_1 = u1;\nr_1 = 0;\n");
        assert_eq!(equations, "der(z_1) = r_1;\nder(r_1) = w_1*w_1*(u1 - z_1) - 2*D_1*w_1*r_1;\n");
        let own = of(Form::Hysteresis, &[1e-4]);
        assert_eq!(
            own.numbers(&own.names("_1")),
            [("L_1".into(), Some("m".into()), "travel over which the hysteresis turns")]
        );
        assert_eq!(own.unit_of_coefficient("N").as_deref(), Some("N"));
        assert_eq!(of(Form::Warming, &[1.0]).unit_of_coefficient("V").as_deref(), Some("V.s3/m3"));
    }
}
