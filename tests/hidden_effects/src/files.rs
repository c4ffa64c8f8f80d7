//! Sets as files: `SET.json` says what the lab knows, `SET_expK.csv` are its shots, `ANSWERS.json` beside them what was hidden.
//! The form is that of the sets beside the product's tests; the answers are never shown to what is judged.

use crate::draft::{CHANNELS, Draft, GAIN, NOISE, OFFSET, STEP, TOLERANCES};
use crate::effects::Effect;
use crate::measure::{BEFORE, RATE};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::Path;

const DECIMALS: [usize; 6] = [2, 3, 7, 6, 0, 0];

fn by_channel(draft: &Draft, value: impl Fn(usize) -> f64) -> Value {
    draft
        .channels
        .iter()
        .map(|&channel| (CHANNELS[channel].to_string(), json!(value(channel))))
        .collect::<Map<_, _>>()
        .into()
}

/// What the lab knows.
pub fn set(draft: &Draft) -> Value {
    let name = &draft.request.name;
    let tolerances: Map<String, Value> =
        TOLERANCES.iter().map(|(name, tolerance)| (name.to_string(), json!(tolerance))).collect();
    let experiments: Vec<Value> = draft
        .shots
        .iter()
        .enumerate()
        .map(|(place, shot)| {
            json!({"file": format!("{name}_exp{}.csv", place + 1), "shot": place + 1, "p0_Pa": shot.stated.p_0,
                "U0_V": shot.stated.u_0, "C_F": shot.stated.capacity, "pulse_s": shot.stated.pulse, "trigger_time_s": 0.0,
                "minutes_since_first_shot": 8.0 * place as f64})
        })
        .collect();
    json!({"set": name, "base_model": draft.base_model(), "sampling_Hz": RATE, "pre_trigger_s": BEFORE,
        "channels": draft.channels.iter().map(|&channel| CHANNELS[channel]).collect::<Vec<_>>(),
        "noise_std": by_channel(draft, |channel| NOISE[channel] * draft.noise),
        "quantisation": by_channel(draft, |channel| STEP[channel]),
        "sensor_offset_1sigma": by_channel(draft, |channel| OFFSET[channel]), "sensor_gain_1sigma": GAIN,
        "parameter_tolerance_1sigma": tolerances, "experiments": experiments})
}

/// What was drawn and hidden.
pub fn answers(draft: &Draft, signature: &[f64; 6]) -> Value {
    let factors: Map<String, Value> =
        TOLERANCES.iter().zip(&draft.factors).map(|((name, _), factor)| (name.to_string(), json!(factor))).collect();
    let shots: Vec<Value> = draft
        .shots
        .iter()
        .map(|shot| {
            json!({"jitter": shot.jitter, "delay": shot.delay, "warming": shot.warming, "thinning": shot.thinning, "scatter": shot.scatter})
        })
        .collect();
    json!({"kind": draft.kind(), "effects": truths(draft), "base_model": draft.base_model(), "seed": draft.request.seed,
        "parameter_multipliers": factors, "sensor_offset": by_channel(draft, |channel| draft.offset[channel]),
        "sensor_gain": by_channel(draft, |channel| draft.gain[channel]), "per_experiment_hidden": shots,
        "noise_correlation": draft.correlation, "disturbances": draft.request.disturbances, "signature": by_channel(draft, |channel| signature[channel])})
}

/// The hidden effects with their numbers.
pub fn truths(draft: &Draft) -> Vec<Value> {
    let one = |truth: &crate::draft::Truth| {
        let effect = Effect::find(&truth.id);
        let numbers: Map<String, Value> =
            truth.numbers.iter().map(|(name, value)| (name.to_string(), json!(value))).collect();
        json!({"name": truth.id, "kind": effect.map_or("", |effect| effect.kind.word()),
            "places": places(draft, &truth.id), "size": truth.size,
            "size_name": effect.map_or("", |effect| effect.size_name), "parameters": numbers})
    };
    draft.truth.iter().map(one).collect()
}

/// Parts of component paths at which an effect may be said to be; a sensor's are of its own channel.
fn places(draft: &Draft, id: &str) -> Vec<String> {
    let truth = draft.truth.iter().find(|truth| truth.id == id);
    let number = truth.and_then(|truth| truth.numbers.iter().find(|(name, _)| *name == "channel"));
    if let Some((_, channel)) = number {
        let sensors = ["sensor_u_C", "sensor_i", "sensor_x", "sensor_y", "sensor_p_R", "sensor_p_0"];
        return vec![sensors[*channel as usize].into()];
    }
    Effect::find(id).map_or(Vec::new(), |effect| effect.places.iter().map(|place| place.to_string()).collect())
}

/// The table of a shot.
pub fn table(draft: &Draft, times: &[f64], rows: &[[f64; 6]]) -> String {
    let mut text = String::from("time_s");
    for &channel in &draft.channels {
        text.push(',');
        text.push_str(CHANNELS[channel]);
    }
    text.push('\n');
    for (time, row) in times.iter().zip(rows) {
        let _ = write!(text, "{time:.6}");
        for &channel in &draft.channels {
            let _ = match row[channel].is_nan() {
                true => write!(text, ","),
                false => write!(text, ",{:.*}", DECIMALS[channel], row[channel]),
            };
        }
        text.push('\n');
    }
    text
}

/// Writes a measured draft into `folder`, which is made.
pub fn write(
    draft: &Draft,
    times: &[f64],
    recorded: &[Vec<[f64; 6]>],
    signature: &[f64; 6],
    folder: &Path,
) -> Result<(), String> {
    let name = &draft.request.name;
    let put = |file: String, text: String| {
        let path = folder.join(file);
        std::fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))
    };
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for (place, rows) in recorded.iter().enumerate() {
        put(format!("{name}_exp{}.csv", place + 1), table(draft, times, rows))?;
    }
    put(format!("{name}.json"), format!("{:#}\n", set(draft)))?;
    let mut all = Map::new();
    all.insert(name.clone(), answers(draft, signature));
    put("ANSWERS.json".into(), format!("{:#}\n", Value::Object(all)))
}
