//! Which component of a library fixes a potential: the ground of a circuit, the wall of a mechanism, the tank of a hydraulic line.
//!
//! Known are the packages of the built-in library alone: a compiler knows no names of other people's libraries, and there the message says
//! what is missing without a class.

/// A component that fixes a potential.
pub(crate) struct Reference {
    /// Its full name.
    pub class: &'static str,
    /// What it may be called.
    pub name: &'static str,
    /// Its connector.
    pub connector: &'static str,
}

/// Packages of connectors, and what fixes their potentials.
static REFERENCES: [(&str, Reference); 5] = [
    ("Hyd.Electrical.", Reference { class: "Hyd.Electrical.Components.Ground", name: "ground", connector: "p" }),
    ("Hyd.Magnetic.", Reference { class: "Hyd.Magnetic.Components.Ground", name: "ground", connector: "port" }),
    (
        "Hyd.Translational.",
        Reference { class: "Hyd.Translational.Components.Fixed", name: "fixed", connector: "flange" },
    ),
    ("Hyd.Hydraulic.", Reference { class: "Hyd.Hydraulic.Sources.FixedPressure", name: "tank", connector: "port" }),
    (
        "Hyd.Thermal.",
        Reference { class: "Hyd.Thermal.Sources.FixedTemperature", name: "surroundings", connector: "port" },
    ),
];

/// What fixes the potential of a connector, by the full name of its class.
pub(crate) fn reference_for(connector: &str) -> Option<&'static Reference> {
    REFERENCES.iter().find(|(package, _)| connector.starts_with(package)).map(|(_, reference)| reference)
}

/// What is fixed, in the plural, by the unit of the potential.
pub(crate) fn words_for(unit: &str) -> &'static str {
    match unit {
        "m" => "positions",
        "rad" => "angles",
        "m/s" => "speeds",
        "rad/s" => "angular speeds",
        "Pa" => "pressures",
        "K" => "temperatures",
        _ => "potentials",
    }
}
