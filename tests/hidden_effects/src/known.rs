//! Sets that others simulated and whose answers are known, against the drive written here: with what was drawn put in, what is
//! left must be their noise.  With the other inner forms of the effects, what is left says how far those forms are away.

use crate::draft::{CHANNELS, NOISE, STEP};
use crate::drive::Shot;
use crate::machine::{Air, Friction, Inductance, Line, Machine};
use crate::shot;
use serde_json::Value;
use std::path::Path;

/// RMS of recorded minus simulated in standard deviations, channels as in `CHANNELS`; `None` where a set lacks a channel.
pub type Left = [Option<f64>; 6];

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or(f64::NAN)
}

/// Puts an effect of the answers into the machine; fails on effects that no set so far has.
fn put_in(machine: &mut Machine, delay: &mut f64, effect: &Value) -> Result<(), String> {
    let p = &effect["parameters"];
    let hidden = &mut machine.hidden;
    match effect["name"].as_str().unwrap_or("") {
        "supply_line" => {
            hidden.line = Some(Line {
                length: number(p, "L"),
                diameter: number(p, "d"),
                wave: number(p, "a"),
                gas: number(p, "V_g"),
                exponent: number(p, "n_g"),
                inlet: number(p, "V_in"),
                nu: number(p, "nu"),
                friction: number(p, "f"),
                grid: 2.5e-6,
            });
        }
        "chamber_leakage" => hidden.leakage = Some(number(p, "k_leak")),
        "piston_friction" => {
            hidden.friction = Some(Friction {
                sliding: number(p, "F_c"),
                sticking: number(p, "F_s"),
                v_s: number(p, "v_s"),
                v_r: 5e-3,
            });
        }
        "eddy_currents" => hidden.eddy = Some(1.0 / number(p, "R_e")),
        "trigger_delay" => *delay = number(p, "delay"),
        "entrained_air" => hidden.air = Some(Air { part: number(p, "alpha"), exponent: number(p, "n") }),
        "variable_inductance" => {}
        "drain_back_pressure" => hidden.back_pressure = Some(number(p, "k_d")),
        other => return Err(format!("no place for `{other}`")),
    }
    Ok(())
}

/// What is left of set `name` in `folder`, given its answer; `forms` chooses the other inner forms, `bare` leaves the effects out
/// and takes nominal parameters and the lab's model.
pub fn left(folder: &Path, name: &str, answer: &Value, forms: bool, bare: bool) -> Result<Left, String> {
    let read = |file: &str| {
        std::fs::read_to_string(folder.join(file)).map_err(|error| format!("{}: {error}", folder.join(file).display()))
    };
    let set: Value = serde_json::from_str(&read(&format!("{name}.json"))?).map_err(|error| error.to_string())?;
    let factor = |key: &str| if bare { 1.0 } else { answer["parameter_multipliers"][key].as_f64().unwrap_or(1.0) };
    let mut machine = Machine::nominal();
    for (key, value) in answer["parameter_multipliers"].as_object().into_iter().flatten() {
        if let (Some(parameter), Some(factor), false) = (machine.parameter(key), value.as_f64(), bare) {
            *parameter *= factor;
        }
    }
    let mut delay = 0.0;
    machine.hidden.other_forms = forms;
    if bare {
        machine.hidden.inductance = match set["base_model"].as_str() {
            Some("constant_inductance") => Inductance::Constant,
            Some("no_motional_emf") => Inductance::Motionless,
            _ => Inductance::Moving,
        };
    } else {
        for effect in answer["effects"].as_array().into_iter().flatten() {
            put_in(&mut machine, &mut delay, effect)?;
        }
    }
    let supply = if bare { 1.0 } else { answer["p0_multiplier"].as_f64().unwrap_or(1.0) };
    let mut sums = [(0.0, 0usize); 6];
    for experiment in set["experiments"].as_array().into_iter().flatten() {
        let stated = number(experiment, "p0_Pa");
        let conditions = Shot {
            p_0: if stated <= 1e5 { stated } else { stated * supply },
            u_0: number(experiment, "U0_V") * factor("U0"),
            capacity: number(experiment, "C_F") * factor("C"),
            pulse: number(experiment, "pulse_s"),
            trigger: delay,
        };
        let table = read(experiment["file"].as_str().unwrap_or(""))?;
        compare(&machine, &conditions, &table, answer, bare, &mut sums)?;
    }
    Ok(sums.map(|(sum, count)| (count > 0).then(|| (sum / count as f64).sqrt())))
}

fn compare(
    machine: &Machine,
    conditions: &Shot,
    table: &str,
    answer: &Value,
    bare: bool,
    sums: &mut [(f64, usize); 6],
) -> Result<(), String> {
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|field| field.parse().unwrap_or(f64::NAN)).collect()).collect();
    let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let ideal = shot::run(machine, conditions, &times, shot::TOLERANCE).map_err(|failure| format!("{failure:?}"))?;
    for (column, name) in header.iter().enumerate().skip(1) {
        let Some(channel) = CHANNELS.iter().position(|channel| channel == name) else { continue };
        let offset = if bare { 0.0 } else { answer["sensor_offset"][name].as_f64().unwrap_or(0.0) };
        let gain = if bare { 1.0 } else { answer["sensor_gain"][name].as_f64().unwrap_or(1.0) };
        let variance = NOISE[channel].powi(2) + STEP[channel].powi(2) / 12.0;
        for (row, signal) in rows.iter().zip(&ideal) {
            let left = row[column] - gain * signal[channel] - offset;
            sums[channel].0 += left * left / variance;
            sums[channel].1 += 1;
        }
    }
    Ok(())
}
