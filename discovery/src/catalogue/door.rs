//! How an effect comes into a model: as a component that is redeclared, or as what a law gives.
//!
//! Doors are found by [`crate::catalogue::places`] and written by [`crate::variant`].

use std::sync::Arc;

use hyd_compiler::Opening;

use crate::elements::At;

/// How an effect comes into a model.
#[derive(Clone, PartialEq, Debug)]
pub enum Door {
    /// The component at the place is redeclared.
    Component,
    /// What a law gives comes into a balance.
    Balance {
        /// The balance.
        end: End,
        /// The law's own inputs and outputs.
        law: Law,
    },
    /// What a law gives comes into one balance and is taken from another one: a leak, a bridge of heat.
    Exchange {
        /// The balance that it comes into, and the one that it is taken from.
        ends: Box<[End; 2]>,
        /// What these store, by the paths of the model.
        stored: [String; 2],
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

/// How something is added to a balance of the model.
#[derive(Clone, PartialEq, Debug)]
pub enum End {
    /// By a term of an equation of the model's file.
    Equation {
        /// Where the text is opened; its `name` is the variable that is added.
        opening: Opening,
        /// Instance path of the component whose equation it is.
        path: Arc<str>,
        /// What comes in is taken away in the equation.
        is_reversed: bool,
        /// Which of the equations that the text gives.
        element: At,
    },
    /// By an adapter that is connected.
    Connector {
        /// Path of the connector of the model.
        connector: String,
        /// Class of the adapter, whose input `term` is what comes in.
        adapter: &'static str,
        /// Connector of the adapter.
        socket: &'static str,
    },
}

impl Door {
    /// The balances that a law acts on.
    pub fn ends(&self) -> &[End] {
        match self {
            Self::Balance { end, .. } => std::slice::from_ref(end),
            Self::Exchange { ends, .. } => ends.as_slice(),
            Self::Component | Self::Channel { .. } | Self::Moved(_) | Self::Command { .. } => &[],
        }
    }

    /// Where the text of the model's file is opened.
    pub fn openings(&self) -> impl Iterator<Item = &Opening> {
        let of_ends = self.ends().iter().filter_map(|end| match end {
            End::Equation { opening, .. } => Some(opening),
            End::Connector { .. } => None,
        });
        let of_command = match self {
            Self::Command { opening, .. } => opening.as_ref(),
            _ => None,
        };
        of_ends.chain(of_command)
    }
}

/// What the law of an effect is given and gives.
#[derive(Clone, PartialEq, Debug)]
pub struct Law {
    /// Input, and the expression of the model that it is; none is the integral of the second one.
    pub inputs: Vec<(&'static str, Option<String>)>,
    /// Output.
    pub output: &'static str,
}
