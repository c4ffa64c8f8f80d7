//! The catalogue: twenty effects that a bench of the drive may show beyond its nominal model, and some that no catalogue lists.
//! Each has a typical size; a trial multiplies it (one over it where more is less) and draws the other numbers from the range
//! that a plausible bench has.  What was drawn is the truth of the trial, under the names in which the laws are usually stated.

use crate::draft::Draft;
use crate::machine::{Air, Friction, Inductance, Line, Memory, Pipe};
use crate::random::Stream;

/// What an effect belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The machine.
    Physics,
    /// A measuring chain.
    Sensor,
    /// The machine, but in no catalogue.
    Outside,
}

impl Kind {
    /// The word for rows and reports.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Physics => "physics",
            Kind::Sensor => "sensor",
            Kind::Outside => "outside",
        }
    }
}

type Numbers = Vec<(&'static str, f64)>;

/// An effect.
pub struct Effect {
    /// Name in the catalogue.
    pub id: &'static str,
    /// What it belongs to.
    pub kind: Kind,
    /// Parts of the drive where it may be said to be: one of these is a part of the path of the component.
    pub places: &'static [&'static str],
    /// The number that carries its size; empty where an effect has none.
    pub size_name: &'static str,
    /// Hides it in a draft; returns its numbers.
    hide: fn(f64, &mut Draft, &mut Stream) -> Numbers,
}

impl Effect {
    /// Hides the effect at `size` times typical and returns its numbers.
    pub fn hide(&self, size: f64, draft: &mut Draft, stream: &mut Stream) -> Numbers {
        (self.hide)(size, draft, stream)
    }

    /// The effect of this name, in the catalogue or outside.
    pub fn find(id: &str) -> Option<&'static Effect> {
        CATALOGUE.iter().chain(&OUTSIDE).find(|effect| effect.id == id)
    }
}

const fn physics(
    id: &'static str,
    places: &'static [&'static str],
    size_name: &'static str,
    hide: fn(f64, &mut Draft, &mut Stream) -> Numbers,
) -> Effect {
    Effect { id, kind: Kind::Physics, places, size_name, hide }
}

/// The effects that a library may be expected to know.
pub static CATALOGUE: [Effect; 20] = [
    physics("supply_line", &["supply"], "L", |size, draft, stream| {
        let line = Line {
            length: 1.2 * size,
            diameter: stream.uniform(10e-3, 18e-3),
            wave: stream.uniform(1100.0, 1350.0),
            gas: stream.log_uniform(1e-4, 1e-3),
            exponent: stream.uniform(1.2, 1.4),
            inlet: 3e-6,
            nu: stream.log_uniform(4e-5, 4e-4),
            friction: 0.03,
            grid: 2.5e-6,
        };
        let numbers = vec![
            ("L", line.length),
            ("d", line.diameter),
            ("a", line.wave),
            ("V_g", line.gas),
            ("n_g", line.exponent),
            ("V_in", line.inlet),
            ("nu", line.nu),
            ("f", line.friction),
        ];
        draft.machine.hidden.line = Some(line);
        numbers
    }),
    physics("chamber_leakage", &["leakage", "ra"], "k_leak", |size, draft, _| {
        draft.machine.hidden.leakage = Some(1.2e-11 * size);
        vec![("k_leak", 1.2e-11 * size)]
    }),
    physics("incomplete_filling", &["ra"], "wyp", |size, draft, _| {
        draft.machine.hidden.filling = Some(1.0 - 0.08 * size);
        vec![("wyp", 1.0 - 0.08 * size)]
    }),
    physics("entrained_air", &["ra"], "alpha", |size, draft, stream| {
        let air = Air { part: 0.04 * size, exponent: stream.uniform(1.0, 1.4) };
        draft.machine.hidden.air = Some(air.clone());
        vec![("alpha", air.part), ("n", air.exponent)]
    }),
    physics("cavitation", &["ra"], "p_v", |size, draft, _| {
        draft.machine.hidden.vapour = Some(2e3 * size);
        vec![("p_v", 2e3 * size)]
    }),
    physics("piston_friction", &["sh"], "F_c", |size, draft, stream| {
        let sliding = 60.0 * size;
        let friction = Friction {
            sliding,
            sticking: sliding * stream.uniform(1.0, 2.0),
            v_s: stream.log_uniform(0.02, 0.1),
            v_r: 5e-3,
        };
        draft.machine.hidden.friction = Some(friction.clone());
        vec![("F_c", sliding), ("F_s", friction.sticking), ("v_s", friction.v_s)]
    }),
    physics("spool_stiction", &["su"], "F_c", |size, draft, stream| {
        let sliding = 2.5 * size;
        let friction = Friction {
            sliding,
            sticking: sliding * stream.uniform(1.5, 3.0),
            v_s: stream.log_uniform(0.01, 0.05),
            v_r: 1e-3,
        };
        draft.machine.hidden.stiction = Some(friction.clone());
        vec![("F_c", sliding), ("F_s", friction.sticking), ("v_s", friction.v_s)]
    }),
    physics("seat_cushion", &["sh"], "b_sq", |size, draft, stream| {
        let depth = stream.log_uniform(0.2e-3, 1e-3);
        draft.machine.hidden.cushion = Some([700.0 * size, depth]);
        vec![("b_sq", 700.0 * size), ("h_sq", depth)]
    }),
    physics("eddy_currents", &["lc", "em", "magnetics"], "R_e", |size, draft, _| {
        draft.machine.hidden.eddy = Some(size / 18.0);
        vec![("R_e", 18.0 / size)]
    }),
    // Iron that saturates and eddies stand between the same two nodes as the solenoid, each at a place of its own.
    physics("magnetic_saturation", &["lc", "em", "magnetics", "iron"], "i_s", |size, draft, stream| {
        let (flux, power) = (stream.uniform(0.04, 0.06), stream.uniform(5.0, 9.0));
        draft.machine.hidden.saturation = Some([0.6 * size, flux, power]);
        vec![("i_s", 0.6 * size), ("lambda_s", flux), ("n", power)]
    }),
    physics("coil_heating", &["rlc"], "dT", |size, draft, _| {
        let last = draft.shots.len().saturating_sub(1).max(1) as f64;
        for (place, shot) in draft.shots.iter_mut().enumerate() {
            let part = (1.0 - (-(place as f64) / 2.0).exp()) / (1.0 - (-last / 2.0).exp());
            shot.warming = 40.0 * size * part;
        }
        vec![("dT", 40.0 * size)]
    }),
    physics("motional_emf", &["lc", "em"], "", |_, draft, _| {
        draft.believed = Inductance::Motionless;
        Vec::new()
    }),
    physics("variable_inductance", &["lc"], "", |_, draft, _| {
        draft.believed = Inductance::Constant;
        Vec::new()
    }),
    physics("spool_flow_force", &["su", "flow_force"], "k_ff", |size, draft, stream| {
        let angle = stream.uniform(30.0, 70.0);
        draft.machine.hidden.flow_force = Some([0.5 * size, angle.to_radians()]);
        vec![("k_ff", 0.5 * size), ("theta", angle.to_radians())]
    }),
    physics("connecting_pipe", &["passage"], "l", |size, draft, stream| {
        let pipe = Pipe {
            length: 0.3 * size,
            diameter: stream.uniform(6e-3, 14e-3),
            near: draft.machine.chamber.v_0 * stream.uniform(0.4, 0.6),
        };
        let numbers = vec![("l", pipe.length), ("d", pipe.diameter), ("V_R", pipe.near)];
        draft.machine.hidden.pipe = Some(pipe);
        numbers
    }),
    physics("oil_temperature", &["sh", "su"], "dT", |size, draft, stream| {
        let beta = stream.uniform(0.02, 0.04);
        let last = draft.shots.len().saturating_sub(1).max(1) as f64;
        for (place, shot) in draft.shots.iter_mut().enumerate() {
            let temperature = 40.0 + 30.0 * size * (1.5 * place as f64 / last - 0.5);
            // Vogel's law through (40 C, 1) with slope -beta there instead of the exponential that is usually stated.
            let reach = 160.0;
            let b = beta * reach * reach;
            shot.thinning = (b / (temperature - 40.0 + reach) - b / reach).exp();
        }
        vec![("dT", 30.0 * size), ("beta", beta)]
    }),
    physics("stop_elasticity", &["sh"], "k_2", |size, draft, _| {
        draft.machine.hidden.stop_spring = Some(8e6 / size);
        vec![("k_2", 8e6 / size)]
    }),
    Effect {
        id: "sensor_lag",
        kind: Kind::Sensor,
        places: &["sensor"],
        size_name: "tau",
        hide: |size, draft, stream| {
            let moving: Vec<usize> = draft.channels.iter().copied().filter(|&channel| channel != 5).collect();
            let channel = *stream.pick(&moving);
            draft.machine.hidden.lag = Some((channel, 3e-4 * size));
            vec![("tau", 3e-4 * size), ("channel", channel as f64)]
        },
    },
    Effect {
        id: "sensor_offset",
        kind: Kind::Sensor,
        places: &["sensor"],
        size_name: "offset",
        hide: |size, draft, stream| {
            let channel = *stream.pick(&draft.channels);
            let sign = if stream.chance(0.5) { 1.0 } else { -1.0 };
            let offset = sign * 10.0 * size * crate::draft::OFFSET[channel];
            draft.extra_offset[channel] = offset;
            vec![("offset", offset), ("channel", channel as f64)]
        },
    },
    Effect {
        id: "trigger_delay",
        kind: Kind::Sensor,
        places: &["trigger"],
        size_name: "delay",
        hide: |size, draft, _| {
            for shot in &mut draft.shots {
                shot.delay += 3.5e-4 * size;
            }
            vec![("delay", 3.5e-4 * size)]
        },
    },
];

const fn outside(
    id: &'static str,
    places: &'static [&'static str],
    size_name: &'static str,
    hide: fn(f64, &mut Draft, &mut Stream) -> Numbers,
) -> Effect {
    Effect { id, kind: Kind::Outside, places, size_name, hide }
}

/// Effects that no catalogue lists.
pub static OUTSIDE: [Effect; 11] = [
    outside("valve_drag", &["sh"], "c", |size, draft, _| {
        draft.machine.hidden.drag = Some(10.0 * size);
        vec![("c", 10.0 * size)]
    }),
    outside("spool_leakage", &["qo", "so", "ra"], "k", |size, draft, _| {
        draft.machine.hidden.spool_leak = Some(6e-12 * size);
        vec![("k", 6e-12 * size)]
    }),
    outside("seat_adhesion", &["sh"], "F_a", |size, draft, stream| {
        let depth = stream.log_uniform(3e-5, 2e-4);
        draft.machine.hidden.adhesion = Some([300.0 * size, depth]);
        vec![("F_a", 300.0 * size), ("h", depth)]
    }),
    outside("drain_back_pressure", &["qz", "sz", "drain"], "k_d", |size, draft, _| {
        draft.machine.hidden.back_pressure = Some(5.5e12 * size);
        vec![("k_d", 5.5e12 * size)]
    }),
    outside("spring_hardening", &["sh"], "k_3", |size, draft, _| {
        draft.machine.hidden.hardening = Some(1.2e8 * size);
        vec![("k_3", 1.2e8 * size)]
    }),
    outside("coefficient_slope", &["qo", "so"], "slope", |size, draft, _| {
        draft.machine.hidden.coefficient_slope = Some(0.25 * size);
        vec![("slope", 0.25 * size)]
    }),
    // Those that remember.
    outside("spring_surge", &["sh"], "m_s", |size, draft, stream| {
        let (mass, frequency) = (0.03 * size, std::f64::consts::TAU * stream.uniform(250.0, 500.0));
        let damping = stream.log_uniform(0.03, 0.15);
        draft.machine.hidden.memory = Some(Memory::Surge([mass, frequency, damping]));
        vec![("m_s", mass), ("w", frequency), ("D", damping)]
    }),
    outside("gas_pocket", &["ra"], "C_p", |size, draft, stream| {
        let (compliance, time) = (6e-15 * size, stream.log_uniform(5e-4, 4e-3));
        draft.machine.hidden.memory = Some(Memory::Pocket([compliance, time]));
        vec![("C_p", compliance), ("T", time)]
    }),
    outside("coil_warming", &["rlc"], "part", |size, draft, _| {
        draft.machine.hidden.memory = Some(Memory::Warming(0.4 * size));
        vec![("part", 0.4 * size)]
    }),
    outside("armature_film", &["su"], "c", |size, draft, stream| {
        let (damping, time) = (8.0 * size, stream.log_uniform(3e-4, 3e-3));
        draft.machine.hidden.memory = Some(Memory::Film([damping, time]));
        vec![("c", damping), ("T", time)]
    }),
    outside("seal_hysteresis", &["sh"], "F_s", |size, draft, stream| {
        let (force, travel) = (50.0 * size, stream.log_uniform(2e-4, 2e-3));
        draft.machine.hidden.memory = Some(Memory::Seal([force, travel]));
        vec![("F_s", force), ("L", travel)]
    }),
];
