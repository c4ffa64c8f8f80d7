//! Code lenses above complete models: simulate, plot, equations; and the commands of the server behind them.

use std::path::PathBuf;

use hyd_compiler::Stage;
use hyd_source::{Code, Severity};
use hyd_syntax::tree::ClassKind;
use lsp_types::{CodeLens, Command, Uri};
use serde_json::{Value, json};

use crate::documents::{Document, uri_of};
use crate::session::Session;

/// Prints the equations of a model: its arguments are the address of the document and the name of the class.
pub(crate) const EQUATIONS: &str = "hyd.server.equations";
/// Explains a code: its argument is the code.
pub(crate) const EXPLAIN: &str = "hyd.server.explain";

/// Commands that an editor may have for a model.
const OF_EDITORS: [(&str, &str); 3] =
    [("hyd.simulate", "simulate"), ("hyd.plot", "plot"), ("hyd.equations", "equations")];

/// The lenses of a document; `known`: the commands that the editor says it has.
pub(crate) fn lenses(session: &mut Session, document: &Document, known: &[String]) -> Vec<CodeLens> {
    let names = session.parsed(&document.path, &document.text);
    let mut found = Vec::new();
    for (at, class) in names.classes.iter().enumerate() {
        let is_model = matches!(class.def.kind, ClassKind::Model | ClassKind::Class | ClassKind::Block);
        let in_package = |parent: usize| names.classes[parent].def.kind == ClassKind::Package;
        if !is_model || class.def.partial || !class.parent.is_none_or(in_package) {
            continue;
        }
        let range = session.range(document, class.def.name.span);
        let arguments = Some(vec![json!(document.uri.as_str()), json!(names.path_of(at).join("."))]);
        let mut push = |title: &str, command: &str| {
            let command = Command { title: title.into(), command: command.into(), arguments: arguments.clone() };
            found.push(CodeLens { range, command: Some(command), data: None });
        };
        for (command, title) in OF_EDITORS {
            if known.iter().any(|known| known == command) {
                push(title, command);
            } else if command == "hyd.equations" {
                push(title, EQUATIONS);
            }
        }
    }
    found
}

/// What a command of the server gives: its answer, and a file that the editor may show.
pub(crate) fn execute(
    session: &mut Session,
    command: &str,
    arguments: &[Value],
) -> Result<(Value, Option<Uri>), String> {
    let text = |at: usize| arguments.get(at).and_then(Value::as_str);
    match command {
        EXPLAIN => {
            let wanted = text(0).ok_or("a code is wanted")?;
            let code = Code::ALL.iter().find(|code| code.number().eq_ignore_ascii_case(wanted));
            let code = code.ok_or_else(|| format!("there is no code `{wanted}`"))?;
            Ok((json!(format!("{code}: {}\n\n{}", code.title(), code.explanation())), None))
        }
        EQUATIONS => {
            let (Some(uri), Some(class)) = (text(0), text(1)) else {
                return Err("a document and a class are wanted".into());
            };
            let uri: Uri = uri.parse().map_err(|_| format!("`{uri}` is no address"))?;
            let path = crate::documents::path_of(&uri);
            let source = session.text(&path).ok_or_else(|| format!("`{}` cannot be read", path.display()))?;
            let compilation = session.compile(&path, &source, class);
            match compilation.print(Stage::Sorted) {
                Some(printed) => {
                    let shown = laid_down(class, &printed);
                    Ok((json!(printed), shown))
                }
                None => {
                    let error = compilation.diagnostics.iter().find(|own| own.severity == Severity::Error);
                    Err(error.map_or_else(|| "there are no equations".into(), |error| error.message.clone()))
                }
            }
        }
        other => Err(format!("there is no command `{other}`")),
    }
}

/// The text as a file that an editor can open.
fn laid_down(class: &str, text: &str) -> Option<Uri> {
    let folder: PathBuf = std::env::temp_dir().join(format!("hyd-equations-{}", std::process::id()));
    std::fs::create_dir_all(&folder).ok()?;
    let name: String = class.chars().map(|c| if c.is_alphanumeric() || c == '.' { c } else { '_' }).collect();
    let file = folder.join(format!("{name}.txt"));
    std::fs::write(&file, text).ok()?;
    uri_of(&file)
}
