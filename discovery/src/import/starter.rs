//! A first study for a set that was imported: its channels, its conditions, and what a person has to fill in.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::carry::Channel;
use super::plan::{Plan, key, quoted};

/// The text of the study; `jitter` is the standard deviation of an edge between two samples (s).
pub(super) fn study(plan: &Plan, channels: &[Channel], jitter: Option<f64>) -> String {
    let mut text = String::from(
        "# A first study of imported shots: fill in the model, its class, and the variable behind each channel.\n",
    );
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "title = {}\nfile = \"model.hyd\"    # the model's file, beside this one\n\n[models]\ndefault = \"Model\"    # its class\n\n\
         # By the column of the tables: the expression of the model that it shows. `scale` is in units of the table per unit of the model.\n\
         # Channels without noise, such as triggers, are left out.\n[channels]\n",
        quoted(&plan.name)
    );
    for channel in channels {
        let mark = if channel.is_silent() { "# " } else { "" };
        let _ = writeln!(
            text,
            "{mark}{} = {{ variable = {}, unit = {}, words = {} }}    # {:e} to {:e}",
            key(&channel.name),
            quoted(&channel.name),
            quoted(&channel.unit),
            quoted(&channel.heading),
            channel.range.0,
            channel.range.1
        );
    }
    text.push_str("\n# Parameter of the model = formula of what a shot records (`conditions` in import.toml, then in the set).\n[conditions]\n");
    let conditions: BTreeSet<&String> = plan.shot.iter().flat_map(|shot| shot.conditions.keys()).collect();
    for name in &conditions {
        let _ = writeln!(text, "# {} = {}", key(name), quoted(name));
    }
    if conditions.is_empty() {
        text.push_str("# p0 = \"p0_Pa\"\n");
    }
    text.push_str(
        "\n# What may be off, with its standard deviation.\n[nuisances]\n# k = { parameter = \"spring.k\", relative = 0.1 }\n\n\
         [shots]\ntime = \"time_s\"\n",
    );
    let _ = match jitter {
        Some(jitter) => writeln!(
            text,
            "trigger_jitter = {jitter:e}    # s, shot by shot: the edge lies anywhere between two samples"
        ),
        None => writeln!(text, "# trigger_jitter = 20e-6    # s, shot by shot"),
    };
    text.push_str("# trigger_moves = [\"t_on\"]    # conditions that move with it\n");
    if let Some(first) = channels.first() {
        let _ = writeln!(text, "# phases_of = {}", quoted(&first.name));
    }
    text
}
