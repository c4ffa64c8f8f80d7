//! A model as C: residual, Jacobian and events in one self-contained, readable text, for review and for other solvers.
//!
//! The text is made from the same [`crate::program::Program`] as machine code, one function per routine, so it computes
//! the same operations in the same order; elementary functions are those of the C library.  Every place of memory that
//! is read gets a local variable with its name in the model, every result a comment that says what it is.  [`names`]
//! knows what stands where, [`expression`] writes expressions, [`body`] functions with loops.  Solving is left to
//! whoever takes the text: C99, no state of its own.

mod body;
mod expression;
mod names;

use std::fmt::Write as _;

use hyd_payload::{JacobianForm, PlanRoutines};
use hyd_symbolic::{BodyId, NodeId, post_order};

use crate::model::CompiledModel;
use crate::program::{Address, Area, HOMOTOPY, Kernel, RoutineId, Store, TABLE_SIGN};
use crate::shared::Shared;
use expression::Writer;
use names::{Labels, Plan, identifier};

/// Functions that every text begins with.
const PRELUDE: &str = include_str!("prelude.h");

/// Names of the areas in the text.
fn area_name(area: Area) -> &'static str {
    match area {
        Area::Data => "d",
        Area::Unknown => "y",
        Area::Rate => "yp",
        Area::Work => "w",
        Area::Out => "out",
        Area::Out2 => "out2",
    }
}

/// What the results of a routine are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Results {
    /// Residuals of a plan.
    Residuals,
    /// Entries of its Jacobian.
    Jacobian,
    /// Relations behind the root functions.
    Roots,
    /// Numbered.
    Plain,
}

/// What a routine is, for its comment.
struct Part<'a> {
    routine: RoutineId,
    name: &'a str,
    says: &'a str,
    plan: Plan,
    results: Results,
}

impl CompiledModel {
    /// The model as C.
    pub fn c_text(&self) -> String {
        let shared = &*self.shared;
        let printer =
            Printer { shared, labels: Labels::new(shared), prefix: identifier(&shared.loaded.model.tables.model) };
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = printer.all(&mut text);
        text
    }
}

struct Printer<'a> {
    shared: &'a Shared,
    labels: Labels<'a>,
    /// Begins all names of the text.
    prefix: String,
}

impl Printer<'_> {
    fn all(&self, out: &mut String) -> std::fmt::Result {
        self.head(out)?;
        out.push_str(PRELUDE);
        let mut functions = String::new();
        self.functions(&mut functions)?;
        // What nothing reads would only be a warning.
        self.tables(out, functions.contains(&format!("{}_slots[", self.prefix)))?;
        out.push_str(&functions);
        Ok(())
    }

    fn functions(&self, out: &mut String) -> std::fmt::Result {
        self.bodies(out)?;
        self.start(out)?;
        let routines = &self.shared.lowered.routines;
        let events = &routines.events;
        self.function(
            out,
            &Part {
                routine: routines.bind,
                name: "bind",
                says: "parameters and start values, into d",
                plan: Plan::None,
                results: Results::Plain,
            },
        )?;
        self.plan(out, &routines.initial, "initial_", Plan::Initial)?;
        self.plan(out, &routines.simulation, "", Plan::Simulation)?;
        let parts = [
            (events.truths, "truths", "truth of every relation, 1 or 0; those between events stand in d"),
            (events.instants, "instants", "times at which relations of time alone change"),
            (events.discrete, "discrete", "discrete equations, into d"),
            (events.reinits, "reinits", "new values of states that reinit sets"),
            (
                events.checks,
                "checks",
                "conditions of assert (1: holds), of assert in a when (1: fails) and terminate (1: fires)",
            ),
            (events.pivots, "pivots", "coefficients that decide which candidates are states"),
        ];
        for (routine, name, says) in parts {
            if !self.shared.lowered.program.routines[routine].kernels.is_empty() {
                self.function(out, &Part { routine, name, says, plan: Plan::Simulation, results: Results::Plain })?;
            }
        }
        Ok(())
    }

    /// What the text is, sizes, and the meaning of the arrays.
    fn head(&self, out: &mut String) -> std::fmt::Result {
        let model = &self.shared.loaded.model;
        let (tables, p) = (&model.tables, &self.prefix);
        writeln!(
            out,
            "/* Model {}, made by hyd {}; texts {:016x}.",
            tables.model, model.identity.compiler, model.identity.sources
        )?;
        writeln!(
            out,
            "   F(t, y, y') = 0 with n = {} unknowns y, of which a derivative y' occurs for the states.",
            model.structure.unknowns
        )?;
        writeln!(
            out,
            "   d[0] is the time in s, d[1] is 1 during initialisation, d[2] the share of homotopy() that is actual."
        )?;
        writeln!(out, "   Call {p}_start, {p}_bind, then the others; w holds assigned variables ({p}_assign).")?;
        for (k, _) in tables.unknowns.iter().enumerate() {
            let state = if model.structure.differential[k] { ", state" } else { "" };
            writeln!(out, "   y[{k}]: {}{state}", self.labels.text(Area::Unknown, k as u32, Plan::Simulation))?;
        }
        writeln!(out, "*/")?;
        let work = model.rows.iter().map(|rows| rows.equations.len()).max().unwrap_or(0).max(1);
        let sizes = [
            ("UNKNOWNS", model.structure.unknowns),
            ("INITIAL_UNKNOWNS", model.structure.initial.unknowns),
            ("DATA", model.area.length as usize),
            ("WORK", work),
            ("ROOTS", self.shared.lowered.routines.events.rooted.len()),
            ("RELATIONS", model.area.held.len()),
            ("HELD", model.area.held.start as usize),
            ("STATE_ENTRIES", model.structure.state_pattern.entries()),
            ("RATE_ENTRIES", model.structure.rate_pattern.entries()),
        ];
        for (name, size) in sizes {
            writeln!(out, "#define {p}_{name} {size}")?;
        }
        writeln!(out)
    }

    fn tables(&self, out: &mut String, slots: bool) -> std::fmt::Result {
        let p = &self.prefix;
        let structure = &self.shared.loaded.model.structure;
        let lists = [
            ("state_rows", &structure.state_pattern.row_indices),
            ("state_starts", &structure.state_pattern.column_starts),
            ("rate_rows", &structure.rate_pattern.row_indices),
            ("rate_starts", &structure.rate_pattern.column_starts),
        ];
        writeln!(out, "\n/* Patterns of dF/dy and dF/dy': rows of the entries, and where each column begins. */")?;
        for (name, list) in lists {
            self.list(out, &format!("const unsigned {p}_{name}"), list)?;
        }
        if slots {
            writeln!(out, "\n/* Positions that loops read; the highest bit negates. */")?;
            self.list(out, &format!("static const unsigned {p}_slots"), &self.shared.lowered.program.tables)?;
        }
        Ok(())
    }

    fn list(&self, out: &mut String, what: &str, list: &[u32]) -> std::fmt::Result {
        // An array needs an element.
        let numbers: Vec<String> =
            list.iter().chain([&0].into_iter().take(usize::from(list.is_empty()))).map(|n| format!("{n}u")).collect();
        writeln!(out, "{what}[{}] = {{", numbers.len())?;
        for line in numbers.chunks(16) {
            writeln!(out, "    {},", line.join(", "))?;
        }
        writeln!(out, "}};")
    }

    /// Functions of the model that loops, branches or recursion decide.
    fn bodies(&self, out: &mut String) -> std::fmt::Result {
        let program = &self.shared.lowered.program;
        let stores = program.routines.iter().flat_map(|r| &r.kernels).flat_map(|kernel| &kernel.stores);
        let roots: Vec<NodeId> = stores.map(|store| store.value).collect();
        let called: Vec<BodyId> = post_order(&program.arena, &roots)
            .into_iter()
            .filter_map(|id| match program.arena.node(id) {
                hyd_symbolic::Node::Apply(body, ..) => Some(body),
                _ => None,
            })
            .collect();
        body::write(out, &program.arena, &program.arena.reachable(&called), &self.prefix)
    }

    /// Values of the data area before anything is computed.
    fn start(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "\n/* Numbers of the text and default start values, into d. */")?;
        writeln!(out, "void {}_start(double *d)\n{{", self.prefix)?;
        writeln!(out, "    for (int k = 0; k < {}_DATA; k++)\n        d[k] = 0;", self.prefix)?;
        for &(index, value) in &self.shared.loaded.model.area.preset {
            let label = if index == HOMOTOPY {
                "homotopy".to_string()
            } else {
                self.labels.text(Area::Data, index, Plan::None)
            };
            writeln!(out, "    d[{index}] = {}; /* {label} */", expression::number(value))?;
        }
        writeln!(out, "}}")
    }

    fn plan(&self, out: &mut String, routines: &PlanRoutines, prefix: &str, plan: Plan) -> std::fmt::Result {
        let part = |routine, name: &str, says| (routine, format!("{prefix}{name}"), says);
        let (residual, extra) = match plan {
            Plan::Initial => (
                "residuals of the initial system",
                "truths of the relations, then both sides of conditions that follow",
            ),
            _ => ("residuals F(t, y, y')", "root functions: above 0 where the relation holds"),
        };
        let list = [
            part(routines.assign, "assign", "assigned variables, into w"),
            part(routines.residual, "residual", residual),
            part(routines.extra, if plan == Plan::Initial { "truths" } else { "roots" }, extra),
        ];
        let roots = if plan == Plan::Initial { Results::Plain } else { Results::Roots };
        for ((routine, name, says), results) in list.iter().zip([Results::Plain, Results::Residuals, roots]) {
            self.function(out, &Part { routine: *routine, name, says, plan, results })?;
        }
        let name = format!("{prefix}jacobian");
        match &routines.jacobian {
            JacobianForm::Entries(routine) => {
                let says = "entries of dF/dy into out, of dF/dy' into out2";
                self.function(out, &Part { routine: *routine, name: &name, says, plan, results: Results::Jacobian })
            }
            JacobianForm::Partials(routine, accumulation, _) => {
                let partials = format!("{prefix}partials");
                let says = "partial derivatives of each row by what it reads";
                self.function(out, &Part { routine: *routine, name: &partials, says, plan, results: Results::Plain })?;
                let p = &self.prefix;
                let terms: Vec<u32> = accumulation.terms.iter().flat_map(|t| [t.to, t.a, t.b]).collect();
                self.list(out, &format!("static const unsigned {p}_{prefix}terms"), &terms)?;
                writeln!(
                    out,
                    "\n/* The chain rule over the partial derivatives; s: {} numbers of work space. */",
                    accumulation.length
                )?;
                writeln!(
                    out,
                    "void {p}_{name}(double *d, const double *y, const double *yp, double *w, double *s, double *out, double *out2)\n{{"
                )?;
                writeln!(
                    out,
                    "    s[0] = 1;\n    for (int k = {}; k < {}; k++)\n        s[k] = 0;",
                    accumulation.first, accumulation.length
                )?;
                writeln!(out, "    {p}_{partials}(d, y, yp, w, s, 0);")?;
                writeln!(out, "    for (int k = 0; k < {}; k++) {{", accumulation.terms.len())?;
                writeln!(out, "        const unsigned *term = {p}_{prefix}terms + 3 * k;")?;
                writeln!(out, "        double factor = s[term[1] & 0x7fffffffu];")?;
                writeln!(out, "        s[term[0]] += (term[1] >> 31 ? -factor : factor) * s[term[2]];\n    }}")?;
                writeln!(
                    out,
                    "    for (int k = {}; k < {}; k++)\n        out[k - {}] = s[k];",
                    accumulation.state, accumulation.rate, accumulation.state
                )?;
                writeln!(
                    out,
                    "    for (int k = {}; k < {}; k++)\n        out2[k - {}] = s[k];",
                    accumulation.rate, accumulation.length, accumulation.rate
                )?;
                writeln!(out, "}}")
            }
        }
    }

    fn function(&self, out: &mut String, part: &Part<'_>) -> std::fmt::Result {
        let kernels = &self.shared.lowered.program.routines[part.routine].kernels;
        writeln!(out, "\n/* {} */", part.says)?;
        writeln!(
            out,
            "void {}_{}(double *d, const double *y, const double *yp, double *w, double *out, double *out2)\n{{",
            self.prefix, part.name
        )?;
        writeln!(out, "    (void)d, (void)y, (void)yp, (void)w, (void)out, (void)out2;")?;
        for kernel in kernels.iter().filter(|kernel| kernel.count > 0 && !kernel.stores.is_empty()) {
            self.kernel(out, kernel, part)?;
        }
        writeln!(out, "}}")
    }

    fn kernel(&self, out: &mut String, kernel: &Kernel, part: &Part<'_>) -> std::fmt::Result {
        let arena = &self.shared.lowered.program.arena;
        let roots: Vec<NodeId> = kernel.stores.iter().map(|store| store.value).collect();
        let order = post_order(arena, &roots);
        let repeated = kernel.count > 1;
        writeln!(
            out,
            "{}",
            if repeated { format!("    for (int k = 0; k < {}; k++) {{", kernel.count) } else { "    {".to_string() }
        )?;
        let mut writer = Writer::new(arena, &order, &roots, &self.prefix, "    ".repeat(2));
        for &id in &order {
            if let hyd_symbolic::Node::Slot(slot) = arena.node(id) {
                let address = &kernel.slots[slot.0 as usize];
                if let Some(number) = self.constant(address) {
                    writer.define(id, number, true);
                    continue;
                }
                let label = self.label(address, kernel.count, part);
                let name = writer.local(&identifier(&label));
                writeln!(out, "        const double {name} = {}; /* {label} */", self.place(address))?;
                writer.define(id, name, false);
            }
        }
        let values = writer.write(out)?;
        for (Store { to, .. }, value) in kernel.stores.iter().zip(values) {
            writeln!(out, "        {} = {value}; /* {} */", self.place(to), self.label(to, kernel.count, part))?;
        }
        writeln!(out, "    }}")
    }

    /// The number that always stands at a place.
    fn constant(&self, address: &Address) -> Option<String> {
        let Address::Fixed { area: Area::Data, index, negated } = *address else { return None };
        let value = self.labels.constant(index)?;
        Some(expression::number(if negated { -value } else { value }))
    }

    /// The name of what is read or written, of the first instance.
    fn label(&self, address: &Address, count: u32, part: &Part<'_>) -> String {
        let text = |area, index| self.meaning(area, index, part).replace("*/", "* /");
        match *address {
            Address::Fixed { area, index, .. } => text(area, index),
            Address::Affine { area, base, stride, .. } => {
                let last = i64::from(base) + i64::from(stride) * (i64::from(count) - 1);
                let (first, last) = (text(area, base), text(area, last as u32));
                if first == last { first } else { format!("{first} .. {last}") }
            }
            Address::Table { area, start, signed } => {
                let entry = self.shared.lowered.program.tables[start as usize];
                let index = if signed { entry & !TABLE_SIGN } else { entry };
                format!("{}, ...", text(area, index))
            }
        }
    }

    /// What stands at a place, results included.
    fn meaning(&self, area: Area, index: u32, part: &Part<'_>) -> String {
        let plan = part.plan;
        let model = &self.shared.loaded.model;
        let (rows, routines) = match plan {
            Plan::Initial => (&model.rows[1], &model.routines.initial),
            _ => (&model.rows[0], &model.routines.simulation),
        };
        let results = matches!(area, Area::Out | Area::Out2);
        match part.results {
            Results::Residuals if results => {
                let row = rows.equations.len() - routines.state_pattern.rows + index as usize;
                let equation = rows.equations.get(row).and_then(|&e| model.tables.equations.get(e as usize));
                equation.map_or_else(
                    || index.to_string(),
                    |e| match e.component.is_empty() {
                        true => e.text.to_string(),
                        false => format!("in {}: {}", e.component, e.text),
                    },
                )
            }
            Results::Jacobian if results => {
                let rate = area == Area::Out2;
                let pattern = if rate { &routines.rate_pattern } else { &routines.state_pattern };
                let column = pattern.column_starts.partition_point(|start| *start <= index) - 1;
                let by = self.labels.text(if rate { Area::Rate } else { Area::Unknown }, column as u32, plan);
                let row = pattern.row_indices.get(index as usize).copied().unwrap_or(0);
                format!("residual {row} by {by}")
            }
            Results::Roots if results => {
                model.tables.roots.get(index as usize).map_or_else(|| index.to_string(), |root| root.text.to_string())
            }
            _ => self.labels.text(area, index, plan),
        }
    }

    /// The place as C.
    fn place(&self, address: &Address) -> String {
        let sign = |negated: bool| if negated { "-" } else { "" };
        match *address {
            Address::Fixed { area, index, negated } => format!("{}{}[{index}]", sign(negated), area_name(area)),
            Address::Affine { area, base, stride, negated } => {
                format!("{}{}[{base} + {stride} * k]", sign(negated), area_name(area))
            }
            Address::Table { area, start, signed } => {
                let (slots, area) = (format!("{}_slots[{start} + k]", self.prefix), area_name(area));
                match signed {
                    true => format!("({slots} >> 31 ? -{area}[{slots} & 0x7fffffffu] : {area}[{slots} & 0x7fffffffu])"),
                    false => format!("{area}[{slots}]"),
                }
            }
        }
    }
}
