//! The numbers of the drive: capacitor, coil, spool, gaps, chamber, valve, and what may be hidden in it beyond the nominal model.
//! SI units throughout.  Nominal values: Szydlowski, Smoczynski, Archives of Automotive Engineering 62(4), 2013, where they
//! are printed there; the others are the values that the product's model of this drive documents.

/// Discharge path and free-wheel path of the coil.
#[derive(Clone, Debug)]
pub struct Circuit {
    /// Coil, Ohm.
    pub r: f64,
    /// Leads and switch, Ohm.
    pub r_w: f64,
    /// Quenching resistor, Ohm.
    pub r_fw: f64,
    /// Diode drop, V.
    pub v_fw: f64,
    /// Width of the diode's knee, A.
    pub i_sm: f64,
}

/// Inductance `a_e/(b_e + gap) + l_0`.
#[derive(Clone, Debug)]
pub struct Coil {
    /// H m.
    pub a_e: f64,
    /// Iron path as a length of gap, m.
    pub b_e: f64,
    /// H.
    pub l_0: f64,
    /// Gap left when open, m.
    pub x_0: f64,
    /// Travel, m.
    pub travel: f64,
}

/// Spool with armature.
#[derive(Clone, Debug)]
pub struct Spool {
    /// kg.
    pub mass: f64,
    /// Preload, N.
    pub preload: f64,
    /// N/m.
    pub spring: f64,
    /// N s/m.
    pub damping: f64,
    /// Area under supply pressure, closing, m2.
    pub a_s0: f64,
    /// Area under chamber pressure, opening, m2.
    pub a_sr: f64,
    /// Contact stiffness, N/m.
    pub contact: f64,
    /// Contact damping, s/m.
    pub chi: f64,
}

/// Gaps and the oil that flows through them.
#[derive(Clone, Debug)]
pub struct Gaps {
    /// Seat diameter, m.
    pub d_s: f64,
    /// Half angle of the cone, rad.
    pub alpha: f64,
    /// Diameter of the drain edge, m.
    pub d_z: f64,
    /// Where the drain edge closes, m.
    pub x_z: f64,
    /// Radial clearance, m.
    pub clearance: f64,
    /// Flow coefficients.
    pub mu_0: f64,
    /// Flow coefficient of the drain.
    pub mu_z: f64,
    /// kg/m3.
    pub rho: f64,
    /// Pressure difference below which flow is laminar, Pa.
    pub dp_tr: f64,
}

/// Working chamber.
#[derive(Clone, Debug)]
pub struct Chamber {
    /// Bulk modulus, Pa.
    pub bulk: f64,
    /// Volume at the seat, m3.
    pub v_0: f64,
    /// Drain pressure, Pa.
    pub p_z: f64,
}

/// Piston, engine valve, spring, seat and stop.
#[derive(Clone, Debug)]
pub struct Valve {
    /// Piston area, m2.
    pub area: f64,
    /// kg.
    pub mass: f64,
    /// Preload, N.
    pub preload: f64,
    /// N/m.
    pub spring: f64,
    /// N s/m.
    pub damping: f64,
    /// Lift at the stop, m.
    pub y_max: f64,
    /// Seat stiffness, N/m.
    pub k_seat: f64,
    /// s/m.
    pub chi_seat: f64,
    /// Stop stiffness, N/m.
    pub k_stop: f64,
    /// s/m.
    pub chi_stop: f64,
}

/// A drive.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Electric circuit.
    pub circuit: Circuit,
    /// Coil.
    pub coil: Coil,
    /// Spool.
    pub spool: Spool,
    /// Gaps.
    pub gaps: Gaps,
    /// Chamber.
    pub chamber: Chamber,
    /// Valve.
    pub valve: Valve,
    /// What is hidden.
    pub hidden: Hidden,
}

/// How the coil's flux depends on the spool's place in what a lab believes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inductance {
    /// Flux L(x) i.
    Moving,
    /// Flux L(0) i, force as ever.
    Constant,
    /// L(x) di/dt without the voltage of motion.
    Motionless,
}

/// Dry friction with a static excess.
#[derive(Clone, Debug)]
pub struct Friction {
    /// Sliding, N.
    pub sliding: f64,
    /// Static, N.
    pub sticking: f64,
    /// Speed over which the excess is lost, m/s.
    pub v_s: f64,
    /// Width of the change of sign, m/s.
    pub v_r: f64,
}

/// Oil with air: part of the volume at 0.1 MPa, polytropic exponent.
#[derive(Clone, Debug)]
pub struct Air {
    /// Part.
    pub part: f64,
    /// Exponent.
    pub exponent: f64,
}

/// Pipe between working chamber and actuator.
#[derive(Clone, Debug)]
pub struct Pipe {
    /// m.
    pub length: f64,
    /// m.
    pub diameter: f64,
    /// Volume at the distributor's end, m3; the rest of the chamber is at the actuator.
    pub near: f64,
}

/// Accumulator and line before the distributor.
#[derive(Clone, Debug)]
pub struct Line {
    /// m.
    pub length: f64,
    /// m.
    pub diameter: f64,
    /// Speed of waves, m/s.
    pub wave: f64,
    /// Gas of the accumulator, m3.
    pub gas: f64,
    /// Its polytropic exponent.
    pub exponent: f64,
    /// Volume at the distributor, m3.
    pub inlet: f64,
    /// Viscosity, m2/s.
    pub nu: f64,
    /// Turbulent friction factor.
    pub friction: f64,
    /// Time step of the characteristics, s.
    pub grid: f64,
}

/// What remembers: laws with states of their own.
#[derive(Clone, Debug)]
pub enum Memory {
    /// Coils of the valve's spring that swing along: kg, rad/s, damping ratio.
    Surge([f64; 3]),
    /// Gas behind a throttle at the chamber: m3/Pa, s.
    Pocket([f64; 2]),
    /// The coil warms during the shot: rise of its resistance by A2 s, as a part.
    Warming(f64),
    /// A film at the armature that yields: N s/m, s.
    Film([f64; 2]),
    /// A seal that is dragged along before it slides: N, m.
    Seal([f64; 2]),
}

/// Everything beyond the nominal model; nothing by default.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// Laws as they are usually stated, or other inner forms of the same effects and contacts.
    pub other_forms: bool,
    /// Flux law.
    pub inductance: Inductance,
    /// Shunt conductance of eddy currents, 1/Ohm.
    pub eddy: Option<f64>,
    /// i_s, lambda_s, n.
    pub saturation: Option<[f64; 3]>,
    /// Friction of the spool.
    pub stiction: Option<Friction>,
    /// Part and angle (rad) of the flow force.
    pub flow_force: Option<[f64; 2]>,
    /// m3/(s Pa).
    pub leakage: Option<f64>,
    /// Part filled at the start.
    pub filling: Option<f64>,
    /// Vapour pressure, Pa.
    pub vapour: Option<f64>,
    /// Air.
    pub air: Option<Air>,
    /// Pipe behind the chamber.
    pub pipe: Option<Pipe>,
    /// Line before the inlet.
    pub line: Option<Line>,
    /// Friction of the piston.
    pub friction: Option<Friction>,
    /// N s/m and m.
    pub cushion: Option<[f64; 2]>,
    /// Second spring of the stop, N/m.
    pub stop_spring: Option<f64>,
    /// Lagged channel (place in the list of all channels) and its time, s.
    pub lag: Option<(usize, f64)>,
    /// Drag of the valve, N s2/m2.
    pub drag: Option<f64>,
    /// Leakage past the spool, m3/(s Pa).
    pub spool_leak: Option<f64>,
    /// Adhesion at the seat, N and m.
    pub adhesion: Option<[f64; 2]>,
    /// Back pressure of the drain, Pa s2/m6.
    pub back_pressure: Option<f64>,
    /// Hardening of the valve spring, N/m3.
    pub hardening: Option<f64>,
    /// Flow coefficient of the inlet rises by this part over the travel.
    pub coefficient_slope: Option<f64>,
    /// What has states of its own.
    pub memory: Option<Memory>,
}

impl Hidden {
    /// Nothing hidden, laws as usually stated.
    pub fn nothing() -> Hidden {
        Hidden {
            other_forms: false,
            inductance: Inductance::Moving,
            eddy: None,
            saturation: None,
            stiction: None,
            flow_force: None,
            leakage: None,
            filling: None,
            vapour: None,
            air: None,
            pipe: None,
            line: None,
            friction: None,
            cushion: None,
            stop_spring: None,
            lag: None,
            drag: None,
            spool_leak: None,
            adhesion: None,
            back_pressure: None,
            hardening: None,
            coefficient_slope: None,
            memory: None,
        }
    }
}

impl Machine {
    /// The nominal drive.
    pub fn nominal() -> Machine {
        Machine {
            circuit: Circuit { r: 1.9, r_w: 0.6, r_fw: 4.0, v_fw: 0.8, i_sm: 0.01 },
            coil: Coil { a_e: 4.91e-6, b_e: 0.39e-3, l_0: 4.46e-3, x_0: 0.035e-3, travel: 0.45e-3 },
            spool: Spool {
                mass: 0.02,
                preload: 22.0,
                spring: 20e3,
                damping: 4.0,
                a_s0: 0.6e-6,
                a_sr: 0.5e-6,
                contact: 1e8,
                chi: 1.2,
            },
            gaps: Gaps {
                d_s: 8e-3,
                alpha: std::f64::consts::FRAC_PI_4,
                d_z: 9e-3,
                x_z: 0.40e-3,
                clearance: 3e-6,
                mu_0: 0.65,
                mu_z: 0.65,
                rho: 860.0,
                dp_tr: 2e4,
            },
            chamber: Chamber { bulk: 1.4e9, v_0: 3e-6, p_z: 1e5 },
            valve: Valve {
                area: std::f64::consts::PI * 0.016 * 0.016 / 4.0,
                mass: 0.35,
                preload: 250.0,
                spring: 25e3,
                damping: 60.0,
                y_max: 8e-3,
                k_seat: 5e7,
                chi_seat: 1.6,
                k_stop: 8e6,
                chi_stop: 0.4,
            },
            hidden: Hidden::nothing(),
        }
    }

    /// The parameter that a lab lists under this name; `None` for conditions (`C`, `U0`, `p_0`) and unknown names.
    pub fn parameter(&mut self, name: &str) -> Option<&mut f64> {
        Some(match name {
            "R" => &mut self.circuit.r,
            "R_w" => &mut self.circuit.r_w,
            "R_fw" => &mut self.circuit.r_fw,
            "V_fw" => &mut self.circuit.v_fw,
            "A_e" => &mut self.coil.a_e,
            "L_0" => &mut self.coil.l_0,
            "F_x0" => &mut self.spool.preload,
            "k_x" => &mut self.spool.spring,
            "m_x" => &mut self.spool.mass,
            "b_x" => &mut self.spool.damping,
            "A_s0" => &mut self.spool.a_s0,
            "A_sR" => &mut self.spool.a_sr,
            "mu_0" => &mut self.gaps.mu_0,
            "mu_z" => &mut self.gaps.mu_z,
            "K" => &mut self.chamber.bulk,
            "V_0" => &mut self.chamber.v_0,
            "m_y" => &mut self.valve.mass,
            "k_y" => &mut self.valve.spring,
            "F_y0" => &mut self.valve.preload,
            "b_y" => &mut self.valve.damping,
            "k_stop" => &mut self.valve.k_stop,
            "chi_stop" => &mut self.valve.chi_stop,
            "chi_seat" => &mut self.valve.chi_seat,
            "y_max" => &mut self.valve.y_max,
            _ => return None,
        })
    }
}
