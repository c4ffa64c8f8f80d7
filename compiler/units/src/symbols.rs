//! The table of unit symbols and prefixes.
//!
//! Base and derived units with special names, and the non-SI units accepted for use with them: BIPM, "The International
//! System of Units", 9th edition (2019), tables 2, 4, 7 and 8; spelling of Modelica language specification 3.6, chapter
//! 19 (`Ohm`, `degC`, prefix `u` for micro).  Logarithmic units count as numbers of factor one.

use crate::unit::{Dimension, Unit};

/// A named unit.
pub(crate) struct Symbol {
    /// As written.
    pub text: &'static str,
    /// Exponents of kg, m, s, A, K, mol, cd.
    pub exponents: [i32; 7],
    /// SI value of one unit.
    pub factor: f64,
    /// SI value of zero units.
    pub offset: f64,
    /// Takes prefixes.
    pub prefixes: bool,
}

impl Symbol {
    /// The unit it names.
    pub(crate) fn unit(&self) -> Unit {
        Unit { dimension: Dimension::whole(self.exponents), factor: self.factor, offset: self.offset }
    }
}

const fn si(text: &'static str, exponents: [i32; 7]) -> Symbol {
    Symbol { text, exponents, factor: 1.0, offset: 0.0, prefixes: true }
}

const fn scaled(text: &'static str, exponents: [i32; 7], factor: f64, prefixes: bool) -> Symbol {
    Symbol { text, exponents, factor, offset: 0.0, prefixes }
}

const NUMBER: [i32; 7] = [0; 7];
const MASS: [i32; 7] = [1, 0, 0, 0, 0, 0, 0];
const VOLUME: [i32; 7] = [0, 3, 0, 0, 0, 0, 0];
const TIME: [i32; 7] = [0, 0, 1, 0, 0, 0, 0];
const RATE: [i32; 7] = [0, 0, -1, 0, 0, 0, 0];
const ENERGY: [i32; 7] = [1, 2, -2, 0, 0, 0, 0];
const TEMPERATURE: [i32; 7] = [0, 0, 0, 0, 1, 0, 0];
const TURN: f64 = std::f64::consts::TAU;

/// All symbols.
pub(crate) const SYMBOLS: &[Symbol] = &[
    si("m", [0, 1, 0, 0, 0, 0, 0]),
    scaled("g", MASS, 1e-3, true),
    si("s", TIME),
    si("A", [0, 0, 0, 1, 0, 0, 0]),
    si("K", TEMPERATURE),
    si("mol", [0, 0, 0, 0, 0, 1, 0]),
    si("cd", [0, 0, 0, 0, 0, 0, 1]),
    si("rad", NUMBER),
    si("sr", NUMBER),
    si("Hz", RATE),
    si("N", [1, 1, -2, 0, 0, 0, 0]),
    si("Pa", [1, -1, -2, 0, 0, 0, 0]),
    si("J", ENERGY),
    si("W", [1, 2, -3, 0, 0, 0, 0]),
    si("C", [0, 0, 1, 1, 0, 0, 0]),
    si("V", [1, 2, -3, -1, 0, 0, 0]),
    si("F", [-1, -2, 4, 2, 0, 0, 0]),
    si("Ohm", [1, 2, -3, -2, 0, 0, 0]),
    si("S", [-1, -2, 3, 2, 0, 0, 0]),
    si("Wb", [1, 2, -2, -1, 0, 0, 0]),
    si("T", [1, 0, -2, -1, 0, 0, 0]),
    si("H", [1, 2, -2, -2, 0, 0, 0]),
    si("lm", [0, 0, 0, 0, 0, 0, 1]),
    si("lx", [0, -2, 0, 0, 0, 0, 1]),
    si("Bq", RATE),
    si("Gy", [0, 2, -2, 0, 0, 0, 0]),
    si("Sv", [0, 2, -2, 0, 0, 0, 0]),
    si("kat", [0, 0, -1, 0, 0, 1, 0]),
    si("var", [1, 2, -3, 0, 0, 0, 0]),
    Symbol { text: "degC", exponents: TEMPERATURE, factor: 1.0, offset: 273.15, prefixes: false },
    Symbol { text: "degF", exponents: TEMPERATURE, factor: 5.0 / 9.0, offset: 459.67 * 5.0 / 9.0, prefixes: false },
    scaled("degRk", TEMPERATURE, 5.0 / 9.0, false),
    scaled("min", TIME, 60.0, false),
    scaled("h", TIME, 3600.0, false),
    scaled("d", TIME, 86_400.0, false),
    scaled("deg", NUMBER, TURN / 360.0, false),
    scaled("rev", NUMBER, TURN, false),
    scaled("rpm", RATE, TURN / 60.0, false),
    scaled("%", NUMBER, 1e-2, false),
    scaled("ppm", NUMBER, 1e-6, false),
    scaled("l", VOLUME, 1e-3, true),
    scaled("L", VOLUME, 1e-3, true),
    scaled("t", MASS, 1e3, true),
    scaled("bar", [1, -1, -2, 0, 0, 0, 0], 1e5, true),
    scaled("ha", [0, 2, 0, 0, 0, 0, 0], 1e4, false),
    scaled("eV", ENERGY, 1.602_176_634e-19, true),
    scaled("u", MASS, 1.660_539_068_92e-27, false),
    scaled("B", NUMBER, 1.0, false),
    scaled("dB", NUMBER, 1.0, false),
    scaled("Np", NUMBER, 1.0, false),
];

/// Prefixes with their powers of ten.
pub(crate) const PREFIXES: &[(&str, i32)] = &[
    ("Q", 30),
    ("R", 27),
    ("Y", 24),
    ("Z", 21),
    ("E", 18),
    ("P", 15),
    ("T", 12),
    ("G", 9),
    ("M", 6),
    ("k", 3),
    ("h", 2),
    ("da", 1),
    ("d", -1),
    ("c", -2),
    ("m", -3),
    ("u", -6),
    ("n", -9),
    ("p", -12),
    ("f", -15),
    ("a", -18),
    ("z", -21),
    ("y", -24),
    ("r", -27),
    ("q", -30),
];

/// Names in words and units outside the SI, in lower case, with what to say instead.
pub(crate) const NAMES: &[(&str, &str)] = &[
    ("pascal", "did you mean `Pa`?"),
    ("newton", "did you mean `N`?"),
    ("meter", "did you mean `m`?"),
    ("metre", "did you mean `m`?"),
    ("sec", "did you mean `s`?"),
    ("second", "did you mean `s`?"),
    ("minute", "did you mean `min`?"),
    ("hour", "did you mean `h`?"),
    ("hr", "did you mean `h`?"),
    ("day", "did you mean `d`?"),
    ("kilogram", "did you mean `kg`?"),
    ("kgs", "did you mean `kg`?"),
    ("gram", "did you mean `g`?"),
    ("ampere", "did you mean `A`?"),
    ("amp", "did you mean `A`?"),
    ("kelvin", "did you mean `K`?"),
    ("mole", "did you mean `mol`?"),
    ("candela", "did you mean `cd`?"),
    ("joule", "did you mean `J`?"),
    ("watt", "did you mean `W`?"),
    ("volt", "did you mean `V`?"),
    ("ohm", "did you mean `Ohm`?"),
    ("\u{3a9}", "did you mean `Ohm`?"),
    ("\u{2126}", "did you mean `Ohm`?"),
    ("farad", "did you mean `F`?"),
    ("henry", "did you mean `H`?"),
    ("weber", "did you mean `Wb`?"),
    ("tesla", "did you mean `T`?"),
    ("siemens", "did you mean `S`?"),
    ("hertz", "did you mean `Hz`?"),
    ("coulomb", "did you mean `C`?"),
    ("liter", "did you mean `l`?"),
    ("litre", "did you mean `l`?"),
    ("ton", "did you mean `t`?"),
    ("tonne", "did you mean `t`?"),
    ("radian", "did you mean `rad`?"),
    ("degree", "did you mean `deg`?"),
    ("\u{b0}", "did you mean `deg`?"),
    ("\u{b0}c", "did you mean `degC`?"),
    ("percent", "did you mean `%`?"),
    ("va", "the volt-ampere is written `V.A`"),
    ("wh", "the watt-hour is written `W.h`"),
    ("ah", "the ampere-hour is written `A.h`"),
    ("psi", "outside the SI: 1 psi = 6894.757 Pa"),
    ("atm", "outside the SI: 1 atm = 101325 Pa"),
    ("torr", "outside the SI: 1 Torr = 133.3224 Pa"),
    ("mmhg", "outside the SI: 1 mmHg = 133.3224 Pa"),
    ("in", "outside the SI: 1 in = 0.0254 m"),
    ("inch", "outside the SI: 1 in = 0.0254 m"),
    ("lb", "outside the SI: 1 lb = 0.45359237 kg"),
    ("lbf", "outside the SI: 1 lbf = 4.448222 N"),
    ("kgf", "outside the SI: 1 kgf = 9.80665 N"),
    ("kp", "outside the SI: 1 kp = 9.80665 N"),
    ("cal", "outside the SI: 1 cal = 4.184 J"),
    ("st", "outside the SI: 1 St = 1e-4 m2/s"),
    ("cst", "outside the SI: 1 cSt = 1e-6 m2/s"),
    ("cp", "outside the SI: 1 cP = 1e-3 Pa.s"),
];
