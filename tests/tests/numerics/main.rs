//! What models compute, against closed forms, published values, other ways of computing and differences.
//!
//! `reference_problems`, `networks`, `roots`, `echo` and `constraints` hold values of solutions; `derivatives`, `sensitivities`,
//! `sensitivity_differences`, `delay_sensitivities`, `linearize` and `model_functions` derivatives; `inputs` and `injection` what comes
//! from outside; `sizes` what a tolerance means; `backends`, `c_text` and `reuse` one model computed in several ways.  `yardsticks` checks what the others compare with.

mod backends;
mod c_text;
mod constraints;
mod corrector;
mod delay_sensitivities;
mod derivatives;
mod echo;
mod excerpts;
mod injection;
mod inputs;
mod linearize;
mod model_functions;
mod networks;
mod reference_problems;
mod reuse;
mod roots;
mod sensitivities;
mod sensitivity_differences;
mod sizes;
mod yardsticks;
