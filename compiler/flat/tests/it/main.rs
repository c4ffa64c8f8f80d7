//! Texts to flat models: what is printed of them, by subject.

mod drafts;

use std::sync::Arc;

use hyd_flat::{FlatModel, Injection};
use hyd_instance::{ClassTable, SourceText, Sources};
use hyd_source::Outcome;

/// No libraries.
struct NoLibraries;

impl Sources for NoLibraries {
    fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        Ok(None)
    }
}

/// The flat model of the last class of a text with terms added, and the messages.
fn flat_with(text: &str, terms: &[Injection]) -> (FlatModel, Vec<String>) {
    let mut sources = NoLibraries;
    let mut table = ClassTable::new(&mut sources);
    let classes = table.add_main("m.hyd", text);
    let class = *classes.last().expect("the text has a class");
    let (tree, mut scopes) = match hyd_instance::instantiate(table, class, Vec::new()) {
        Ok(instantiated) => instantiated,
        Err(table) => panic!("{:?}", table.messages),
    };
    let Outcome { value: flat, diagnostics } = hyd_flat::flatten(&tree, &mut scopes, terms, &[]);
    assert_eq!(hyd_flat::verify(&flat), Ok(()));
    (flat, scopes.table.messages.into_given().into_iter().chain(diagnostics).map(|said| said.message).collect())
}

/// The printed flat model of `model M` with this body and terms; there must be no messages.
fn check_flat(body: &str, terms: &[Injection]) -> String {
    let (flat, said) = flat_with(&format!("model M\n{body}\nend M;\n"), terms);
    assert_eq!(said, Vec::<String>::new());
    flat.to_string()
}
