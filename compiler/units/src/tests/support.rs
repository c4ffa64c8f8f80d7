//! Model texts to flat models, with the libraries of this workspace.
#![allow(dead_code)]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_flat::FlatModel;
use hyd_instance::class::nested_classes;
use hyd_instance::{ClassId, ClassTable, SourceText, Sources};
use hyd_source::{Diagnostic, Files, Severity};
use hyd_syntax::tree::ClassKind;
use hyd_units::{UnitReport, check_units};

/// Folders of libraries.
pub(crate) struct Folders(pub Vec<PathBuf>);

impl Folders {
    /// `stdlib` and `models` of this workspace.
    pub(crate) fn workspace() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        Self(vec![root.join("stdlib"), root.join("models")])
    }
}

impl Sources for Folders {
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        let words: Vec<String> = path.iter().map(|p| p.to_string()).collect();
        let snake = |word: &str| match word {
            "SingleActingDrive" => "single_acting_drive".to_string(),
            "HydraulicLine" => "hydraulic_line".to_string(),
            other => other.to_string(),
        };
        let mut stems = vec![words.join("/")];
        let mut folder = vec![snake(&words[0])];
        folder.extend(words[1..].iter().map(|w| w.to_lowercase()));
        stems.push(folder.join("/"));
        for root in &self.0 {
            for stem in &stems {
                for file in [root.join(format!("{stem}/package.hyd")), root.join(format!("{stem}.hyd"))] {
                    if let Ok(text) = std::fs::read_to_string(&file) {
                        return Ok(Some(SourceText { name: file.display().to_string().into(), text: text.into() }));
                    }
                }
            }
        }
        Ok(None)
    }
}

/// What the front end gives.
pub(crate) struct Front {
    /// The texts.
    pub files: Files,
    /// Messages.
    pub diagnostics: Vec<Diagnostic>,
    /// The flat model of the last complete model.
    pub flat: Option<FlatModel>,
}

/// Text to flat model.
pub(crate) fn flatten(name: &str, text: &str) -> Front {
    let mut sources = Folders::workspace();
    let mut table = ClassTable::new(&mut sources);
    let classes = table.add_main(name, text);
    let Some(class) = classes.iter().rev().find_map(|&class| last_model(&mut table, class)) else {
        return Front { files: table.files, diagnostics: table.messages.into_given(), flat: None };
    };
    match hyd_instance::instantiate(table, class, Vec::new()) {
        Err(table) => Front { files: table.files, diagnostics: table.messages.into_given(), flat: None },
        Ok((tree, mut scopes)) => {
            let flat = hyd_flat::flatten(&tree, &mut scopes, &[], &[]);
            scopes.table.messages.report_all(flat.diagnostics);
            let diagnostics = scopes.table.messages.into_given();
            Front { files: scopes.table.files, diagnostics, flat: Some(flat.value) }
        }
    }
}

fn last_model(table: &mut ClassTable<'_>, class: ClassId) -> Option<ClassId> {
    let def = table.class(class).def.clone();
    let model = matches!(def.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class);
    if model && !def.partial {
        return Some(class);
    }
    if def.kind != ClassKind::Package {
        return None;
    }
    let names: Vec<_> = nested_classes(&def).map(|n| n.class.name.name.clone()).collect();
    names.iter().rev().find_map(|name| {
        let child = table.child(class, name)?;
        last_model(table, child)
    })
}

/// A checked model.
pub(crate) struct Checked {
    /// The texts.
    pub files: Files,
    /// The model.
    pub flat: FlatModel,
    /// What the check says.
    pub report: UnitReport,
}

/// Compiles and checks `model M` with this body.
pub(crate) fn check(body: &str) -> Checked {
    check_text(&format!("model M\n{body}\nend M;\n"))
}

/// Compiles and checks a text.
pub(crate) fn check_text(text: &str) -> Checked {
    let front = flatten("m.hyd", text);
    let errors: Vec<&Diagnostic> = front.diagnostics.iter().filter(|d| d.severity == Severity::Error).collect();
    assert!(errors.is_empty(), "{text}\n{errors:?}");
    let flat = front.flat.expect("flat");
    let report = check_units(&flat, &front.files);
    Checked { files: front.files, flat, report }
}

impl Checked {
    /// All messages.
    pub(crate) fn messages(&self) -> Vec<&str> {
        self.report.diagnostics.iter().map(|d| d.message.as_str()).collect()
    }

    /// The unit found for a variable.
    pub(crate) fn inferred(&self, name: &str) -> Option<&str> {
        self.report.inferred.iter().find(|i| i.name == name).map(|i| i.unit.as_str())
    }

    /// Texts of the labels of the first message.
    pub(crate) fn labels(&self) -> Vec<(&str, &str)> {
        let labels = &self.report.diagnostics[0].labels;
        labels.iter().map(|l| (self.files.snippet(l.span), l.message.as_str())).collect()
    }
}
