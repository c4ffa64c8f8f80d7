//! A page that shows the structure of a translated model, in one file that needs nothing else.
//!
//! The numbers of the sorted system become JSON in front of `page.html`, which draws them: the incidence matrix before and after
//! sorting, blocks, states, what index reduction did, aliases, each with the line of text it comes from; the texts are
//! embedded.  Of very large systems only the first blocks are drawn, and the page says so.

use hyd_equations::{EquationSystem, Matrix, Resolution, Role, SortedSystem, equation_text, matrix};
use hyd_flat::{Operand, Target, VarId};
use hyd_source::{Files, Origin};

use crate::json::quote;

/// The page without its data.
const PAGE: &str = include_str!("page.html");

/// Rows of the matrix that are shown.
const MOST_ROWS: usize = 4000;
/// Aliases that are listed.
const MOST_ALIASES: usize = 4000;

/// The page as HTML.
pub(crate) fn page(model: &str, sorted: &SortedSystem, files: &Files) -> String {
    let mut data = Data { sorted, system: &sorted.system, files, used: Vec::new() };
    let json = data.json(model);
    PAGE.replacen("/*DATA*/null", &json, 1).replacen("<!--MODEL-->", &escape_html(model), 1)
}

struct Data<'a> {
    sorted: &'a SortedSystem,
    system: &'a EquationSystem,
    files: &'a Files,
    /// Files that something refers to, in the order met.
    used: Vec<hyd_source::FileId>,
}

impl Data<'_> {
    fn json(&mut self, model: &str) -> String {
        let matrix = matrix(self.sorted);
        let shown = shown_rows(&matrix);
        let rows = self.rows(&matrix, shown);
        let entries: Vec<String> = matrix.entries[..shown]
            .iter()
            .map(|row| list(row.iter().filter(|&&c| (c as usize) < shown).map(u32::to_string)))
            .collect();
        let aliases = self.aliases();
        let states = self.with_role(|system, v| system.roles[v] == Role::State);
        let candidates = self.with_role(|system, v| system.roles[v] == Role::Candidate);
        let demoted = self.variables(&self.system.never_states());
        let dummies = self.variables(&self.system.dummies());
        let constraints = self.constraints();
        let mut blocks = Vec::new();
        let mut count = 0;
        for &size in matrix.blocks.iter().take_while(|&&size| {
            count += size as usize;
            count <= shown
        }) {
            blocks.push(size.to_string());
        }
        let (row_order, column_order) = text_order(&matrix, shown);
        let texts = list(self.used.iter().map(|&file| {
            format!("{{\"name\":{},\"text\":{}}}", quote(self.files.name(file)), quote(self.files.text(file)))
        }));
        format!(
            "{{\"model\":{},\"total\":{},\"rows\":{rows},\"entries\":{},\"blocks\":{},\"rowOrder\":{},\"columnOrder\":{},\
             \"states\":{states},\"candidates\":{candidates},\"demoted\":{demoted},\"dummies\":{dummies},\"constraints\":{constraints},\
             \"aliases\":{aliases},\"files\":{texts}}}",
            quote(model),
            matrix.equations.len(),
            list(entries),
            list(blocks),
            list(row_order.iter().map(usize::to_string)),
            list(column_order.iter().map(usize::to_string)),
        )
    }

    /// One object per row: the unknown it determines, its equation, and their places.
    fn rows(&mut self, matrix: &Matrix, shown: usize) -> String {
        let mut rows = Vec::with_capacity(shown);
        for k in 0..shown {
            let eq = matrix.equations[k];
            let equation = self.system.equations[eq];
            let origin = self.system.flat.equations[equation.block as usize].origin.clone();
            rows.push(format!(
                "{{\"u\":{},\"d\":{},\"e\":{},\"o\":{},\"x\":{},\"p\":{},\"at\":{}}}",
                quote(&self.system.flat.operand_name(Operand::new(matrix.unknowns[k]))),
                variable(matrix.unknowns[k]).map_or("null".to_string(), |v| self.declaration(v)),
                quote(&equation_text(self.system, eq)),
                equation.order,
                matrix.explicit[k],
                quote(&origin.path),
                self.place(&origin),
            ));
        }
        list(rows)
    }

    /// File and line as `[file, line]`.
    fn place(&mut self, origin: &Origin) -> String {
        let file = origin.span.file;
        let position = self.used.iter().position(|&known| known == file).unwrap_or_else(|| {
            self.used.push(file);
            self.used.len() - 1
        });
        format!("[{position},{}]", self.files.location(origin.span).line)
    }

    fn declaration(&mut self, v: VarId) -> String {
        let origin = self.system.flat.variables[self.system.flat.locate(v).0].origin.clone();
        self.place(&origin)
    }

    fn variables(&mut self, variables: &[VarId]) -> String {
        let mut items = Vec::with_capacity(variables.len());
        for &v in variables.iter().take(MOST_ALIASES) {
            items.push(format!("[{},{}]", quote(&self.system.flat.var_name(v)), self.declaration(v)));
        }
        list(items)
    }

    fn with_role(&mut self, wanted: impl Fn(&EquationSystem, VarId) -> bool) -> String {
        let system = self.system;
        let all: Vec<VarId> = system.roles.indices().filter(|&v| system.is_own(v) && wanted(system, v)).collect();
        self.variables(&all)
    }

    /// The equations that index reduction differentiated.
    fn constraints(&mut self) -> String {
        let system = self.system;
        let derived: Vec<_> = system.equations.indices().filter(|&eq| system.equations[eq].order > 0).collect();
        let mut items = Vec::new();
        for eq in derived.into_iter().take(MOST_ALIASES) {
            let equation = system.equations[eq];
            let origin = system.flat.equations[equation.block as usize].origin.clone();
            items.push(format!("[{},{},{}]", quote(&equation_text(system, eq)), self.place(&origin), equation.order));
        }
        list(items)
    }

    fn aliases(&mut self) -> String {
        let system = self.system;
        let name = |v| system.flat.var_name(v);
        let mut items = Vec::new();
        for v in system.roles.indices().filter(|&v| !system.is_own(v)).take(MOST_ALIASES) {
            let value = match system.resolution[v] {
                Resolution::Alias { of, negated } => format!("{}{}", if negated { "-" } else { "" }, name(of)),
                Resolution::Value(c) => hyd_symbolic::format_number(system.flat.constants[c]),
                Resolution::Own => continue,
            };
            items.push(format!("[{},{},{}]", quote(&name(v)), self.declaration(v), quote(&value)));
        }
        list(items)
    }
}

/// Rows of whole blocks up to the limit; the first block is always shown.
fn shown_rows(matrix: &Matrix) -> usize {
    let mut shown = 0;
    for &size in &matrix.blocks {
        if shown > 0 && shown + size as usize > MOST_ROWS {
            break;
        }
        shown += size as usize;
    }
    shown
}

/// For each row and column its place in the order of the text.
fn text_order(matrix: &Matrix, shown: usize) -> (Vec<usize>, Vec<usize>) {
    let key = |target: Target| (variable(target).map(|v| v.0), matches!(target, Target::Der(_)));
    let mut rows: Vec<usize> = (0..shown).collect();
    rows.sort_by_key(|&k| matrix.equations[k]);
    let mut columns: Vec<usize> = (0..shown).collect();
    columns.sort_by_key(|&k| key(matrix.unknowns[k]));
    let inverse = |order: &[usize]| {
        let mut places = vec![0; order.len()];
        for (place, &k) in order.iter().enumerate() {
            places[k] = place;
        }
        places
    };
    (inverse(&rows), inverse(&columns))
}

fn variable(target: Target) -> Option<VarId> {
    match target {
        Target::Var(v) | Target::Der(v) | Target::Pre(v) | Target::Start(v) => Some(v),
        _ => None,
    }
}

fn list(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(","))
}

fn escape_html(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
