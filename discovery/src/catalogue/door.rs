//! How an effect comes into a model: as a component that is redeclared, or as what a law gives.
//!
//! Doors are found by [`crate::catalogue::places`] and written by [`crate::variant`].

use std::sync::Arc;

use hyd_compiler::Opening;

/// How an effect comes into a model.
#[derive(Clone, PartialEq, Debug)]
pub enum Door {
    /// The component at the place is redeclared.
    Component,
    /// A term is added to an equation of the model's file.
    Equation {
        /// Where the text is opened; its `name` is the variable that is added.
        opening: Opening,
        /// Instance path of the component whose equation it is.
        path: Arc<str>,
        /// What the effect gives is taken away.
        is_reversed: bool,
        /// The law's own inputs and outputs.
        law: Law,
    },
    /// An adapter is connected.
    Connector {
        /// Path of the connector of the model.
        connector: String,
        /// Class of the adapter, whose input `term` is what the effect gives.
        adapter: &'static str,
        /// Connector of the adapter.
        socket: &'static str,
        /// The law's own inputs and outputs.
        law: Law,
    },
    /// The expression of a channel goes through it.
    Channel {
        /// The expression.
        expression: String,
        /// That of another channel, of which it also hears: cross-talk.
        heard: Option<String>,
    },
    /// Parameters of the model that move with the trigger are that much later: variable that a modification gives another value, and
    /// what it is without the effect.
    Moved(Vec<(String, String)>),
    /// What a variable of the model is given in time goes through it.
    Command {
        /// Variable that a modification gives another value.
        variable: String,
        /// What it is given.
        expression: String,
        /// Where the text is opened, if the variable is given its value by an equation.
        opening: Option<Opening>,
    },
}

/// What the law of an effect is given and gives.
#[derive(Clone, PartialEq, Debug)]
pub struct Law {
    /// Input, and the expression of the model that it is; none is the integral of the second one.
    pub inputs: Vec<(&'static str, Option<String>)>,
    /// Output.
    pub output: &'static str,
}
