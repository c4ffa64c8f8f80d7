//! Models at random.
//!
//! A model begins with parameters and states; then come pieces, each of which exercises a part of the language and reads
//! what the pieces before it define; at last the states get their derivatives.  Everything is kept well conditioned: states
//! decay, algebraic loops are diagonally dominant, time events fall on multiples of 1/32 s.

mod arrays;
mod components;
mod continuous;
mod discrete;
mod events;
mod functions;
mod grids;
mod loops;
mod network;
mod records;
mod start;
mod terms;

use crate::model::{Expr, Form, Id, Kind, Model, Role, Statement, Target, Variable};
use crate::random::Random;

/// A model in the making.
struct Builder {
    random: Random,
    model: Model,
    /// Real scalars that may be read by whatever comes now, smooth between events.
    readable: Vec<Expr>,
    /// Parameters among them.
    parameters: Vec<Expr>,
    /// States that have a derivative coming.
    open: Vec<Id>,
    /// Scalar states that `reinit` may set.
    states: Vec<Id>,
    /// Boolean expressions that change at events only.
    truths: Vec<Expr>,
    /// Integer expressions that change at events only.
    wholes: Vec<Expr>,
    /// The parameter that decides sizes, and its value.
    size: Option<(Id, usize)>,
    /// What makes names different.
    serial: usize,
}

type Piece = fn(&mut Builder);

/// The pieces; a model takes some of them.
const PIECES: [Piece; 48] = [
    continuous::scalars,
    continuous::scalars,
    continuous::constraint,
    continuous::derivative,
    continuous::oscillator,
    continuous::past,
    continuous::branches,
    continuous::section,
    continuous::observers,
    arrays::looped,
    arrays::strided,
    arrays::matrix,
    arrays::comprehension,
    arrays::reduction,
    arrays::algebra,
    arrays::slices,
    arrays::states,
    grids::elementwise,
    grids::parts,
    grids::plate,
    grids::branches,
    grids::truths,
    grids::jumps,
    loops::pair,
    loops::chain,
    loops::mixed,
    functions::formula,
    functions::accumulation,
    functions::iteration,
    functions::recursion,
    functions::several,
    functions::vectors,
    discrete::whole_numbers,
    discrete::before,
    discrete::acts,
    records::parameters,
    records::defaults,
    records::results,
    events::counter,
    events::switch,
    events::bounce,
    events::modes,
    events::rounding,
    events::memories,
    events::alternatives,
    components::array,
    components::single,
    network::network,
];

/// The model of a seed.
pub fn model(seed: u64) -> Model {
    let mut random = Random::new(seed);
    let order = random.bits();
    let mut builder = Builder {
        random,
        model: Model { order, stop: 1.0, ..Model::default() },
        readable: vec![Expr::Time],
        parameters: Vec::new(),
        open: Vec::new(),
        states: Vec::new(),
        truths: Vec::new(),
        wholes: Vec::new(),
        size: None,
        serial: 0,
    };
    builder.model.stop = *builder.random.pick(&[1.0, 1.5, 2.0]);
    builder.begin();
    let mut pieces = PIECES.to_vec();
    builder.random.shuffle(&mut pieces);
    let count = builder.random.between(2, 8) as usize;
    pieces.iter().take(count).for_each(|piece| piece(&mut builder));
    builder.end();
    builder.model
}

impl Builder {
    fn fresh(&mut self, letter: &str) -> String {
        self.serial += 1;
        format!("{letter}{}", self.serial)
    }

    /// A new Real scalar that statements determine.
    fn algebraic(&mut self) -> Id {
        let name = self.fresh("y");
        self.model.add(Variable::new(name, Role::Algebraic))
    }

    fn form(&mut self) -> Form {
        *self.random.pick(&[Form::Plain, Form::Plain, Form::Turned, Form::Difference, Form::Doubled, Form::Both])
    }

    fn push(&mut self, statement: Statement) {
        self.model.statements.push(statement);
    }

    /// Defines a new scalar, in an equation or in its declaration, and lets others read it.
    fn define(&mut self, e: Expr) -> Id {
        let id = self.algebraic();
        if self.random.once_in(3) {
            self.push(Statement::Declare(id, e));
        } else {
            let form = self.form();
            self.push(Statement::Define(Target::Name(id, Vec::new()), e, form));
        }
        self.readable.push(Expr::name(id));
        id
    }

    /// A time on the grid of time events, inside of the run.
    fn instant(&mut self) -> f64 {
        let last = (self.model.stop * 32.0) as i64 - 1;
        self.random.between(1, last) as f64 / 32.0
    }

    fn begin(&mut self) {
        for _ in 0..self.random.between(1, 3) {
            let name = self.fresh("p");
            let value = match self.parameters.first().cloned().filter(|_| self.random.once_in(3)) {
                Some(other) => Expr::Number(self.random.number(0.5, 1.5)) * other + Expr::Number(0.25),
                None => Expr::Number(self.random.number(0.2, 1.8)),
            };
            let id = self.model.add(Variable::new(name, Role::Parameter).valued(value));
            self.parameters.push(Expr::name(id));
            self.readable.push(Expr::name(id));
        }
        if self.random.once_in(2) {
            let n = self.random.between(2, 6) as usize;
            let name = self.fresh("n");
            let variable = Variable::new(name, Role::Structural).of(Kind::Integer).valued(Expr::Number(n as f64));
            self.size = Some((self.model.add(variable), n));
        }
        for _ in 0..self.random.between(1, 3) {
            self.state();
        }
    }

    /// A new state; its derivative comes at the end.
    fn state(&mut self) -> Id {
        let name = self.fresh("x");
        let start = self.random.number(-1.5, 1.5);
        let mut variable = Variable::new(name, Role::State).starting(start);
        if self.random.once_in(4) {
            let by = self.random.pick(&self.parameters).clone();
            variable.start_by = Some(Expr::Number(self.random.number(-0.9, 0.9)) * by);
        }
        if self.random.once_in(5) {
            variable.select = Some(*self.random.pick(&["always", "prefer", "default"]));
        }
        let id = self.model.add(variable);
        self.readable.push(Expr::name(id));
        self.open.push(id);
        self.states.push(id);
        id
    }

    fn end(&mut self) {
        for id in std::mem::take(&mut self.open) {
            let term = self.bounded(2);
            let rate = Expr::Number(self.random.number(0.3, 4.0));
            let gain = Expr::Number(self.random.number(0.2, 3.0));
            let form = self.form();
            let e = Expr::Minus(Box::new(rate * Expr::name(id))) + gain * term;
            self.push(Statement::Derive(Target::Name(id, Vec::new()), e, form));
        }
        self.starts();
    }
}
