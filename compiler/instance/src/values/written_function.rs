//! External functions whose meaning is written as a function of the library `Hyd`.
//!
//! A call of one of them is the assignment `(what it sets) := .Hyd.Package.function(what it takes)`, at translation and during the run
//! alike: the text is the only place that says what it does.

use hyd_source::Span;
use hyd_syntax::tree::{
    Arguments, Component, ComponentRef, ExprKind, External, Ident, Name, RefPart, Statement, StatementKind,
};

use crate::instantiation::scopes::Scopes;

/// A function of another language and the one that is written.
struct Written {
    /// Its name in its own language.
    name: &'static str,
    /// Dimensions of the first argument that it sets, where functions differ by them.
    rank: Option<usize>,
    /// Its own value is the first output.
    has_value: bool,
    /// The packages below `Hyd` and the function.
    path: &'static [&'static str],
    /// Places of the arguments that the written function takes.
    takes: &'static [usize],
    /// Places of the arguments that are its outputs, in their order.
    sets: &'static [usize],
}

/// Generators of random numbers take the state, the next state and the number; `dgesv` of LAPACK n, nrhs, A, lda, ipiv, B, ldb, info; the
/// transform of Fourier values, their number, working memory, its size, amplitudes and phases.
const WRITTEN: [Written; 6] = [
    random("ModelicaRandom_xorshift64star", &["Random", "xorshift64star"]),
    random("ModelicaRandom_xorshift128plus", &["Random", "xorshift128plus"]),
    random("ModelicaRandom_xorshift1024star", &["Random", "xorshift1024star"]),
    system(2, &["LinearAlgebra", "solve"]),
    system(1, &["LinearAlgebra", "solveVector"]),
    Written {
        name: "ModelicaFFT_kiss_fftr",
        rank: None,
        has_value: true,
        path: &["Signals", "Functions", "spectrum"],
        takes: &[0],
        sets: &[4, 5],
    },
];

const fn random(name: &'static str, path: &'static [&'static str]) -> Written {
    Written { name, rank: None, has_value: false, path, takes: &[0], sets: &[2, 1] }
}

const fn system(rank: usize, path: &'static [&'static str]) -> Written {
    Written { name: "dgesv", rank: Some(rank), has_value: false, path, takes: &[2, 5], sets: &[5, 7] }
}

impl Scopes<'_> {
    /// The assignment that an external clause is, where what it calls is written in the library; `components` are the variables of
    /// the function around.
    pub fn written_call<'c>(
        &mut self,
        external: &External,
        components: impl Iterator<Item = &'c Component> + Clone,
    ) -> Option<Statement> {
        let call = external.call.as_ref()?;
        let variable = |place: usize| match call.arguments.get(place).map(|argument| &argument.kind) {
            Some(ExprKind::Ref(reference)) if reference.parts.len() == 1 => Some(reference.clone()),
            _ => None,
        };
        let rank = |reference: &ComponentRef| {
            let declared = components.clone().find(|c| c.name.name == reference.parts[0].name.name);
            declared.map_or(0, |component| component.dims.len())
        };
        let written = WRITTEN.iter().find(|written| {
            let fits = |rank_of: usize| variable(written.sets[0]).is_some_and(|target| rank(&target) == rank_of);
            *written.name == *call.name.name
                && written.has_value == call.output.is_some()
                && written.rank.is_none_or(fits)
        })?;
        let function = library_function(written.path, external.span);
        let names: Vec<Ident> = function.parts.iter().map(|part| part.name.clone()).collect();
        self.table.absolute(&names)?;
        let positional =
            written.takes.iter().map(|&place| call.arguments.get(place).cloned()).collect::<Option<_>>()?;
        // A constant in the place of an output is not set.
        let value = written.has_value.then(|| call.output.clone());
        let targets = value.into_iter().chain(written.sets.iter().map(|&place| variable(place))).collect();
        let arguments = Arguments::List { positional, named: Vec::new() };
        Some(Statement { kind: StatementKind::AssignTuple(targets, function, arguments), span: external.span })
    }
}

/// `.Hyd.Package.function`
fn library_function(path: &[&str], span: Span) -> ComponentRef {
    let part = |name: &str| RefPart { name: Ident { name: Name::from(name), span }, subscripts: Vec::new() };
    let parts = std::iter::once("Hyd").chain(path.iter().copied()).map(part).collect();
    ComponentRef { global: true, parts, span }
}
