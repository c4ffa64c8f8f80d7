//! The command line as its users meet it: the real program, its messages, exit codes and files.
//!
//! `bad_input` holds the messages for wrong models, as data; `files` the texts that cannot be read; `outputs` results that
//! cannot be written, closed pipes and Ctrl-C; `overwriting` files that must stay; `components` what is checked by itself; `doctor` whether causes are found, `fixes` what heals them; `command` whole outputs; `inputs` tables of recorded inputs; `settings` what `--set` takes; `sweeps` many runs; `studies` fits and searches, `written_models` what they write, `study_initial` and `study_inputs` those with states and inputs of their own, `study_names` and `magnitudes` names
//! and numbers that they may meet; `bench_import` files of laboratories; `bounded_memory` large files; `formatting`, `new_folder` and `library_page` the verbs for texts.  `agent` speaks with the server for agents, `view` with that of pages, `guides` types the guides of `docs/guides`, `executables` runs what `hyd build` makes, `units` calls its units for other tools, and `foreign_units` runs units of others.  What the models compute is tested elsewhere.

#![allow(clippy::unwrap_used)]

mod agent;
mod bad_input;
mod bench_import;
mod bounded_memory;
mod command;
mod components;
mod doctor;
mod executables;
#[cfg(unix)]
mod faults;
mod files;
mod fixes;
#[cfg(unix)]
mod foreign_units;
mod formatting;
mod frames;
mod guides;
mod hard_equations;
mod inputs;
mod library_page;
mod library_page_parts;
mod magnitudes;
mod model_differences;
mod new_folder;
mod outputs;
mod overwriting;
mod process;
mod run_parts;
mod settings;
mod stored_results;
mod studies;
mod study_initial;
mod study_inputs;
mod study_names;
#[cfg(unix)]
mod study_units;
mod sweeps;
mod unit_client;
mod unit_derivatives;
mod unit_saved;
mod unit_texts;
mod unit_values;
mod unit_warnings;
mod units;
mod view;
mod written_models;
