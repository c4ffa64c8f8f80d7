//! Runs of hand-written systems against closed forms and published values.

mod events;
mod failures;
mod initial;
mod methods;
mod smooth;
mod stiff;
mod systems;
