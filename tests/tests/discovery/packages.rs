//! Models that are a class of a package in a folder, or made of components of somebody's library: places are in these texts, too.

use std::fs;
use std::path::Path;

use crate::folder;
use crate::plain::{Bench, SWING, check_names, found_in, write};

/// Puts files where the study looks for its model; `study` says which file and class that is.
fn put(folder: &Path, (file, class): (&str, &str), texts: &[(&str, &str)]) {
    for (name, text) in texts {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, text).expect("written");
    }
    let study = fs::read_to_string(folder.join("study.toml")).expect("written");
    let study = study.replace("plain.mo", file).replace("default = \"Swing\"", &format!("default = \"{class}\""));
    fs::write(folder.join("study.toml"), study).expect("written");
    fs::remove_file(folder.join("plain.mo")).expect("there");
}

#[test]
fn a_class_of_a_package_is_searched() {
    let bench = Bench {
        name: "package",
        rates: |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 1.5 * (x[1] / 1e-3).tanh()) / 2.0],
        ..SWING
    };
    let folder = folder("package");
    write(&folder, &bench);
    let swing = format!("within Rig.Parts;\n{}", SWING.model.replace("m*der(v)", "Rig.one*m*der(v)"));
    put(
        &folder,
        ("Rig/Parts/Swing.mo", "Rig.Parts.Swing"),
        &[
            ("Rig/package.mo", "package Rig\n  constant Real one = 1;\nend Rig;\n"),
            ("Rig/Parts/package.mo", "within Rig;\npackage Parts\nend Parts;\n"),
            ("Rig/Parts/Swing.mo", &swing),
        ],
    );
    let report = found_in(&folder, &[]);
    check_names(&report, ("package", "named", "coulomb_friction", "v"), &[("F_c", 1.5)]);
    // What was opened is in the report alone.
    assert_eq!(fs::read_to_string(folder.join("Rig/Parts/Swing.mo")).expect("there"), swing);
    let written = fs::read_to_string(folder.join("report/discovered.hyd")).expect("written");
    assert!(written.contains("further_force") && written.contains("package Parts"), "{written}");
    let _ = fs::remove_dir_all(&folder);
}

/// A connector of other variables than those of the built-in library's flange takes no adapter: the library's equation is opened in what is written.
#[test]
fn components_of_a_library_are_searched() {
    let library: [(&str, &str); 5] = [
        ("lib/Turn/package.mo", "package Turn\nend Turn;\n"),
        ("lib/Turn/Flange.mo", "within Turn;\nconnector Flange\n  Real phi;\n  flow Real f;\nend Flange;\n"),
        (
            "lib/Turn/Rotor.mo",
            "within Turn;\nmodel Rotor \"a body that turns\"\n  parameter Real J(unit = \"kg.m2\") = 2;\n  Flange a;\n  Real phi(unit = \"rad\");\n  \
             Real w(unit = \"rad/s\");\n  Real z(unit = \"rad/s2\");\nequation\n  phi = a.phi;\n  w = der(phi);\n  z = der(w);\n  J*z = a.f;\nend Rotor;\n",
        ),
        (
            "lib/Turn/Spring.mo",
            "within Turn;\nmodel Spring\n  parameter Real c = 80;\n  parameter Real d = 0.6;\n  Flange a;\nequation\n  a.f = c*a.phi + d*der(a.phi);\n\
             end Spring;\n",
        ),
        (
            "rig.mo",
            "model Swing\n  parameter Real x0 = 0.5;\n  parameter Real m = 2;\n  parameter Real k = 80;\n  parameter Real d = 0.6;\n  \
             Turn.Rotor rotor(J = m, phi(start = x0, fixed = true), w(start = 0, fixed = true));\n  Turn.Spring spring(c = k, d = d);\n\
             equation\n  connect(rotor.a, spring.a);\nend Swing;\n",
        ),
    ];
    let bench = Bench {
        name: "library",
        channels: &[("x_m", "rotor.phi", 1e-3), ("v_ms", "rotor.w", 5e-3)],
        rates: |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 1.5 * (x[1] / 1e-3).tanh()) / 2.0],
        ..SWING
    };
    let folder = folder("library");
    write(&folder, &bench);
    put(&folder, ("rig.mo", "Swing"), &library);
    let report = found_in(&folder, &["--library", "lib"]);
    check_names(&report, ("library", "named", "coulomb_friction", "rotor.w"), &[("F_c", 1.5)]);
    let _ = fs::remove_dir_all(&folder);
}

/// What a source of a library gives is a command; two sources of one class share what is opened in its text.
#[test]
fn a_source_of_a_library_is_a_command() {
    let bench = Bench {
        name: "source",
        model: "",
        class: "Swing",
        channels: &[("T_K", "T", 0.05)],
        conditions: &["T_0", "P"],
        nuisances: &["C", "G"],
        shots: &[&[300.0, 50.0], &[305.0, 80.0], &[300.0, 120.0], &[310.0, 60.0], &[300.0, 100.0]],
        // The heater follows by 20 s; the last state is the time.
        rates: |x, shot| {
            let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
            let told = if at(2) < 30.0 { 0.0 } else { shot[1] };
            let fan = if at(2) < 150.0 { 0.0 } else { 15.0 };
            vec![(at(1) - fan - 2.0 * (x[0] - 300.0)) / 200.0, (told - at(1)) / 20.0, 1.0]
        },
        stop: 300.0,
        ..SWING
    };
    let folder = folder("source");
    write(&folder, &bench);
    put(
        &folder,
        ("rig.mo", "Swing"),
        &[
            ("lib/Sources/package.mo", "package Sources\nend Sources;\n"),
            (
                "lib/Sources/Step.mo",
                "within Sources;\nblock Step\n  parameter Real height = 1;\n  parameter Real begin = 0;\n  output Real y;\nequation\n  \
                 y = height*(if time < begin then 0 else 1);\nend Step;\n",
            ),
            (
                "rig.mo",
                "model Swing\n  parameter Real T_0 = 300;\n  parameter Real P = 50;\n  parameter Real C = 200;\n  parameter Real G = 2;\n  \
                 Sources.Step heater(height = P, begin = 30);\n  Sources.Step fan(height = 15, begin = 150);\n  Real T(start = T_0, fixed = true);\nequation\n  \
                 C*der(T) = heater.y - fan.y - G*(T - 300);\nend Swing;\n",
            ),
        ],
    );
    let report = found_in(&folder, &["--library", "lib"]);
    check_names(&report, ("source", "named", "actuator_lag", "heater.y"), &[("tau", 20.0)]);
    let _ = fs::remove_dir_all(&folder);
}

/// One that counts its periods, and whose width follows from its parameters.
#[test]
fn a_source_of_pulses_is_a_command() {
    let bench = Bench {
        name: "pulses",
        model: "",
        class: "Swing",
        channels: &[("T_K", "T", 0.05)],
        conditions: &["T_0", "P"],
        nuisances: &["C", "G"],
        shots: &[&[300.0, 50.0], &[305.0, 80.0], &[300.0, 120.0], &[310.0, 60.0], &[300.0, 100.0]],
        // The heater follows by 10 s; the last state is the time.
        rates: |x, shot| {
            let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
            let told = if at(2) >= 30.0 && (at(2) - 30.0) % 80.0 < 32.0 { shot[1] } else { 0.0 };
            vec![(at(1) - 2.0 * (x[0] - 300.0)) / 200.0, (told - at(1)) / 10.0, 1.0]
        },
        stop: 300.0,
        ..SWING
    };
    let folder = folder("pulses");
    write(&folder, &bench);
    put(
        &folder,
        ("rig.mo", "Swing"),
        &[
            ("lib/Sources/package.mo", "package Sources\nend Sources;\n"),
            (
                "lib/Sources/Pulse.mo",
                "within Sources;\nblock Pulse\n  parameter Real height = 1;\n  parameter Real width = 50;\n  parameter Real period = 1;\n  \
                 parameter Real begin = 0;\n  output Real y;\nprotected\n  Real t_width = period*width/100;\n  Real t_start(start = begin, fixed = true);\n  \
                 Integer count(start = 0, fixed = true);\nequation\n  when time >= (pre(count) + 1)*period + begin then\n    count = pre(count) + 1;\n    \
                 t_start = time;\n  end when;\n  y = if time < begin then 0 else if time < t_start + t_width then height else 0;\nend Pulse;\n",
            ),
            (
                "rig.mo",
                "model Swing\n  parameter Real T_0 = 300;\n  parameter Real P = 50;\n  parameter Real C = 200;\n  parameter Real G = 2;\n  \
                 Sources.Pulse heater(height = P, period = 80, width = 40, begin = 30);\n  Real T(start = T_0, fixed = true);\nequation\n  \
                 C*der(T) = heater.y - G*(T - 300);\nend Swing;\n",
            ),
        ],
    );
    let report = found_in(&folder, &["--library", "lib"]);
    check_names(&report, ("pulses", "named", "actuator_lag", "heater.y"), &[("tau", 10.0)]);
    let _ = fs::remove_dir_all(&folder);
}
