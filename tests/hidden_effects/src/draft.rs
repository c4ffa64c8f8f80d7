//! A bench before it is measured: machine, shots, channels, and the truth of what deviates.  Parameters are drawn around nominal
//! values by the tolerances that a lab states, one draw a set; supply pressure and voltage likewise; some numbers that no lab
//! frees scatter from shot to shot; the trigger jitters; noise may be correlated.  Names, columns and tolerances are those of the
//! sets beside the product's tests.

use crate::drive::Shot;
use crate::effects::{CATALOGUE, Effect, Kind, OUTSIDE};
use crate::machine::{Hidden, Inductance, Machine};
use crate::random::Stream;

/// Columns of the tables.
pub const CHANNELS: [&str; 6] = ["u_C_V", "i_A", "x_m", "y_m", "pR_Pa", "p0_Pa"];
/// Standard deviations of white noise, by channel.
pub const NOISE: [f64; 6] = [0.04, 0.02, 3e-6, 1.5e-5, 4e4, 3e4];
/// Steps of the recorders.
pub const STEP: [f64; 6] = [0.02, 0.005, 5e-7, 4e-6, 1e4, 1e4];
/// Standard deviations of the offsets.
pub const OFFSET: [f64; 6] = [0.05, 0.02, 3e-6, 2e-5, 4e4, 4e4];
/// Standard deviation of all gains.
pub const GAIN: f64 = 0.002;
/// Relative standard deviations of what a lab knows roughly.
pub const TOLERANCES: [(&str, f64); 27] = [
    ("R", 0.02),
    ("R_w", 0.05),
    ("R_fw", 0.05),
    ("V_fw", 0.05),
    ("C", 0.03),
    ("A_e", 0.015),
    ("L_0", 0.015),
    ("F_x0", 0.03),
    ("k_x", 0.03),
    ("m_x", 0.02),
    ("b_x", 0.1),
    ("A_s0", 0.05),
    ("A_sR", 0.05),
    ("mu_0", 0.03),
    ("mu_z", 0.03),
    ("K", 0.04),
    ("V_0", 0.03),
    ("m_y", 0.02),
    ("k_y", 0.02),
    ("F_y0", 0.03),
    ("b_y", 0.08),
    ("k_stop", 0.04),
    ("chi_stop", 0.1),
    ("chi_seat", 0.1),
    ("y_max", 0.003),
    ("U0", 0.003),
    ("p_0", 0.004),
];
/// Pressure of a shot with the pump off, Pa.
pub const PUMP_OFF: f64 = 1e5;

/// What a trial is to be.
#[derive(Clone, Debug)]
pub struct Request {
    /// Name of the trial and of its set; with the seed it decides every draw.
    pub name: String,
    /// Seed.
    pub seed: u64,
    /// Effects with sizes in units of typical; none for a null.
    pub effects: Vec<(String, f64)>,
    /// What disturbs the bench, by the words of [`crate::disturb::KINDS`].
    pub disturbances: Vec<String>,
    /// Shots instead of those that are drawn.
    pub points: Points,
}

/// Which shots are made.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// How many of those that are drawn; all where it is not said.
    pub first: Option<usize>,
    /// Further ones.
    pub more: Vec<Stated>,
}

/// Conditions as the lab states them.
#[derive(Clone, Debug)]
pub struct Stated {
    /// Pa.
    pub p_0: f64,
    /// V.
    pub u_0: f64,
    /// F.
    pub capacity: f64,
    /// s.
    pub pulse: f64,
}

/// A shot and what is special about it.
#[derive(Clone, Debug)]
pub struct DraftShot {
    /// Conditions on paper.
    pub stated: Stated,
    /// Lateness of the switch that changes from shot to shot, s.
    pub jitter: f64,
    /// Lateness of the switch beyond that, s.
    pub delay: f64,
    /// Temperature of the coil above that of the first shot, K.
    pub warming: f64,
    /// Factor on viscous damping.
    pub thinning: f64,
    /// Factors on contact damping of spool, seat and stop, on the spool's clearance and on the drain's pressure.
    pub scatter: [f64; 5],
}

/// What an effect drew.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Name.
    pub id: String,
    /// In units of typical.
    pub size: f64,
    /// Numbers by name.
    pub numbers: Vec<(&'static str, f64)>,
}

/// A bench ready to be measured.
#[derive(Clone, Debug)]
pub struct Draft {
    /// The request it came from.
    pub request: Request,
    /// The true machine, with what is hidden.
    pub machine: Machine,
    /// The flux law that the lab's model believes in.
    pub believed: Inductance,
    /// Places of the recorded channels in `CHANNELS`.
    pub channels: Vec<usize>,
    /// Shots.
    pub shots: Vec<DraftShot>,
    /// Factors on the parameters of `TOLERANCES`, same order.
    pub factors: Vec<f64>,
    /// Offsets of the sensors.
    pub offset: [f64; 6],
    /// Hidden constant errors beyond the offsets.
    pub extra_offset: [f64; 6],
    /// Gains.
    pub gain: [f64; 6],
    /// Correlation of neighbouring samples' noise.
    pub correlation: f64,
    /// Factor on `NOISE`.
    pub noise: f64,
    /// What is hidden.
    pub truth: Vec<Truth>,
}

impl Draft {
    /// Draws a bench; fails on unknown effects and on two that need different beliefs.
    pub fn draw(request: &Request) -> Result<Draft, String> {
        Draft::draw_all_but(request, None)
    }

    /// The same bench as [`Draft::draw`] makes, number by number, on which the effect of this place in the request is
    /// not there: the lab believes what it does, and here it is right about that effect.
    pub fn draw_without(request: &Request, effect: usize) -> Result<Draft, String> {
        let whole = Draft::draw(request)?;
        let mut draft = Draft::draw_all_but(request, Some(effect))?;
        if draft.believed != whole.believed {
            draft.machine.hidden.inductance = whole.believed;
            draft.believed = whole.believed;
        }
        Ok(draft)
    }

    fn draw_all_but(request: &Request, left_out: Option<usize>) -> Result<Draft, String> {
        let effects: Vec<(&Effect, f64)> = request
            .effects
            .iter()
            .map(|(id, size)| Effect::find(id).map(|effect| (effect, *size)).ok_or(format!("no effect `{id}`")))
            .collect::<Result<_, _>>()?;
        let mut stream = Stream::new(request.seed, &request.name);
        let mut draft = Draft {
            request: request.clone(),
            machine: Machine::nominal(),
            believed: Inductance::Moving,
            channels: channels(&mut stream),
            shots: Vec::new(),
            factors: Vec::new(),
            offset: [0.0; 6],
            extra_offset: [0.0; 6],
            gain: [1.0; 6],
            correlation: if stream.chance(0.5) { 0.0 } else { stream.uniform(0.1, 0.5) },
            noise: *stream.pick(&[0.7, 1.0, 1.0, 1.4]),
            truth: Vec::new(),
        };
        draft.draw_parameters(&mut stream);
        draft.draw_shots(&mut stream, &effects);
        draft.shots.truncate(request.points.first.unwrap_or(usize::MAX));
        draft.add_shots(&request.points.more);
        draft.machine.hidden.other_forms = true;
        for (place, (effect, size)) in effects.into_iter().enumerate() {
            if left_out == Some(place) {
                // What it draws is drawn, so that those behind it draw what they did.
                effect.hide(size, &mut draft.clone(), &mut stream);
                continue;
            }
            let numbers = effect.hide(size, &mut draft, &mut stream);
            draft.truth.push(Truth { id: effect.id.into(), size, numbers });
        }
        Ok(draft)
    }

    fn draw_parameters(&mut self, stream: &mut Stream) {
        for (name, tolerance) in TOLERANCES {
            let factor = 1.0 + tolerance * stream.normal_within(2.5);
            self.factors.push(factor);
            if let Some(value) = self.machine.parameter(name) {
                *value *= factor;
            }
        }
        for (channel, offset) in OFFSET.into_iter().enumerate() {
            self.offset[channel] = offset * stream.normal_within(3.0);
            self.gain[channel] = 1.0 + GAIN * stream.normal_within(3.0);
        }
    }

    fn draw_shots(&mut self, stream: &mut Stream, effects: &[(&Effect, f64)]) {
        let electric = effects.iter().any(|(effect, _)| {
            ["eddy_currents", "magnetic_saturation", "coil_heating", "motional_emf"].contains(&effect.id)
        });
        let brief = effects.iter().any(|(effect, _)| effect.id == "cavitation");
        let scattered = stream.chance(0.5);
        for stated in operating_points(stream, electric, brief) {
            let sizes = [0.002, 0.05, 0.03, 0.02, 0.02];
            let scatter = sizes.map(|size| 1.0 + if scattered { size * stream.normal_within(2.5) } else { 0.0 });
            let jitter = 1e-5 * stream.normal_within(2.5);
            self.shots.push(DraftShot { stated, jitter, delay: 0.0, warming: 0.0, thinning: 1.0, scatter });
        }
    }

    /// Further shots, each with lateness and scatter of its own; what was drawn for the bench stays.
    fn add_shots(&mut self, more: &[Stated]) {
        let is_scattered = self.shots.iter().any(|shot| shot.scatter != [1.0; 5]);
        for (k, stated) in more.iter().enumerate() {
            let mut stream = Stream::new(self.request.seed, &format!("{} further shot {k}", self.request.name));
            let sizes = [0.002, 0.05, 0.03, 0.02, 0.02];
            let scatter = sizes.map(|size| 1.0 + if is_scattered { size * stream.normal_within(2.5) } else { 0.0 });
            let jitter = 1e-5 * stream.normal_within(2.5);
            let stated = stated.clone();
            self.shots.push(DraftShot { stated, jitter, delay: 0.0, warming: 0.0, thinning: 1.0, scatter });
        }
    }

    /// The factor drawn for a parameter of `TOLERANCES`; 1 for unknown names.
    pub fn factor(&self, name: &str) -> f64 {
        let place = TOLERANCES.iter().position(|(found, _)| *found == name);
        place.and_then(|place| self.factors.get(place)).copied().unwrap_or(1.0)
    }

    /// Machine and conditions of a shot as they truly are, with what is hidden.
    pub fn actual(&self, place: usize) -> (Machine, Shot) {
        let shot = &self.shots[place];
        let (mut machine, mut actual) = self.believed_true(place);
        machine.hidden = self.machine.hidden.clone();
        machine.circuit.r *= 1.0 + 0.0039 * shot.warming;
        machine.valve.damping *= shot.thinning;
        machine.spool.damping *= shot.thinning;
        let [chi_x, chi_seat, chi_stop, clearance, drain] = shot.scatter;
        machine.spool.chi *= chi_x;
        machine.valve.chi_seat *= chi_seat;
        machine.valve.chi_stop *= chi_stop;
        machine.gaps.clearance *= clearance;
        machine.chamber.p_z *= drain;
        if shot.stated.p_0 <= PUMP_OFF {
            actual.p_0 = machine.chamber.p_z;
        }
        actual.trigger = shot.jitter + shot.delay;
        crate::disturb::scatter(self, place, &mut machine);
        (machine, actual)
    }

    /// The same machine and shot, laws, scatter and all, without the hidden effects.
    pub fn without_effects(&self, place: usize) -> (Machine, Shot) {
        let (mut machine, mut shot) = self.actual(place);
        let draft = &self.shots[place];
        machine.hidden =
            Hidden { inductance: self.believed, other_forms: self.machine.hidden.other_forms, ..Hidden::nothing() };
        machine.circuit.r /= 1.0 + 0.0039 * draft.warming;
        machine.valve.damping /= draft.thinning;
        machine.spool.damping /= draft.thinning;
        shot.trigger -= draft.delay;
        (machine, shot)
    }

    /// The same without anything hidden and without scatter: what a complete fit of the lab's model could reach.
    pub fn believed_true(&self, place: usize) -> (Machine, Shot) {
        let stated = &self.shots[place].stated;
        let mut machine = self.machine.clone();
        machine.hidden = Hidden { inductance: self.believed, ..Hidden::nothing() };
        let off = stated.p_0 <= PUMP_OFF;
        let shot = Shot {
            p_0: if off { stated.p_0 } else { stated.p_0 * self.factor("p_0") },
            u_0: stated.u_0 * self.factor("U0"),
            capacity: stated.capacity * self.factor("C"),
            pulse: stated.pulse,
            trigger: self.shots[place].jitter,
        };
        (machine, shot)
    }

    /// `null`, `effect`, `outside`, `pair` or `triple`.
    pub fn kind(&self) -> &'static str {
        let outside = self.truth.iter().any(|truth| OUTSIDE.iter().any(|effect| effect.id == truth.id));
        match self.truth.len() {
            0 => "null",
            1 if outside => "outside",
            1 => "effect",
            2 => "pair",
            _ => "triple",
        }
    }

    /// The word of a set for the model that the lab believes in.
    pub fn base_model(&self) -> &'static str {
        match self.believed {
            Inductance::Moving => "nominal",
            Inductance::Constant => "constant_inductance",
            Inductance::Motionless => "no_motional_emf",
        }
    }
}

/// Effects of a catalogue that can stand together in one bench: two different ones of different parts of the drive.
pub fn compatible(first: &Effect, second: &Effect) -> bool {
    let beliefs = ["motional_emf", "variable_inductance"];
    let both_beliefs = beliefs.contains(&first.id) && beliefs.contains(&second.id);
    let same_place = first.kind != Kind::Sensor && first.places.iter().any(|place| second.places.contains(place));
    first.id != second.id && !both_beliefs && !same_place
}

/// Draws `count` effects of the catalogue that can stand together.
pub fn draw_together(stream: &mut Stream, count: usize) -> Vec<&'static Effect> {
    let mut drawn: Vec<&'static Effect> = Vec::new();
    while drawn.len() < count {
        let next = stream.pick(&CATALOGUE);
        if next.id != "cavitation" && drawn.iter().all(|other| compatible(other, next)) {
            drawn.push(next);
        }
    }
    drawn
}

fn channels(stream: &mut Stream) -> Vec<usize> {
    let sets: [&[usize]; 6] = [
        &[0, 1, 2, 3, 4, 5],
        &[0, 1, 2, 3, 4, 5],
        &[0, 1, 2, 3, 4, 5],
        &[0, 1, 3, 4, 5],
        &[0, 1, 2, 3, 4],
        &[0, 1, 2, 3],
    ];
    stream.pick(&sets).to_vec()
}

fn operating_points(stream: &mut Stream, electric: bool, brief: bool) -> Vec<Stated> {
    let points: Vec<[f64; 4]> = match stream.unit() {
        _ if brief => {
            let mut points = vec![[10.0, 24.0, 1.0, 10.0]];
            points
                .extend((0..4).map(|place| {
                    [8.0 + 2.0 * place as f64, 24.0, 1.0, (2.0 * stream.uniform(3.0, 4.5)).round() / 2.0]
                }));
            points
        }
        draw if draw < 0.3 => vec![
            [10.0, 24.0, 1.0, 10.0],
            [15.0, 24.0, 1.0, 10.0],
            [10.0, 24.0, 1.0, 6.0],
            [8.0, 30.0, 1.0, 8.0],
            [12.0, 24.0, 2.2, 14.0],
        ],
        draw if draw < 0.55 => {
            vec![[10.0, 24.0, 1.0, 10.0], [15.0, 24.0, 1.0, 10.0], [6.0, 24.0, 1.0, 8.0], [12.0, 28.0, 1.5, 12.0]]
        }
        draw if draw < 0.65 => vec![[10.0, 24.0, 1.0, 10.0], [14.0, 24.0, 1.0, 10.0], [7.0, 26.0, 1.0, 7.0]],
        draw if draw < if electric { 0.85 } else { 0.7 } => vec![
            [0.1, 24.0, 1.0, 10.0],
            [0.1, 30.0, 1.0, 6.0],
            [0.1, 24.0, 2.2, 14.0],
            [10.0, 24.0, 1.0, 10.0],
            [12.0, 28.0, 1.5, 9.0],
        ],
        _ => drawn_points(stream),
    };
    let stated = |[p_0, u_0, capacity, pulse]: [f64; 4]| Stated {
        p_0: p_0 * 1e6,
        u_0,
        capacity: capacity * 1e-3,
        pulse: pulse * 1e-3,
    };
    points.into_iter().map(stated).collect()
}

/// Points of a lab of its own: pressures spread over the range, one shot in some sets with the pump off.
fn drawn_points(stream: &mut Stream) -> Vec<[f64; 4]> {
    let count = 3 + (stream.unit() * 3.0) as usize;
    let mut points: Vec<[f64; 4]> = (0..count)
        .map(|place| {
            let pressure = 6.0 + 9.0 * (place as f64 + stream.unit()) / count as f64;
            let voltage = *stream.pick(&[24.0, 24.0, 26.0, 28.0, 30.0]);
            let capacity = *stream.pick(&[1.0, 1.0, 1.5, 2.2]);
            let pulse = *stream.pick(&[6.0, 8.0, 10.0, 12.0, 14.0]);
            [(2.0 * pressure).round() / 2.0, voltage, capacity, pulse]
        })
        .collect();
    if count > 3 && stream.chance(0.4) {
        points[1][0] = 0.1;
    }
    points
}
