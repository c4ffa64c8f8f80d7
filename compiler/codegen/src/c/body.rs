//! Functions with loops, branches and computed subscripts as C: registers are an array, failures give NaN.
//!
//! Limits of turns and of stack are counted as machine code counts them, so that a call that fails here fails there.

use std::fmt::Write as _;

use hyd_symbolic::{Arena, Body, BodyId, NodeId, Step, post_order};

use super::expression::Writer;

/// Writes the functions, declared first because they may call each other.
pub(super) fn write(out: &mut String, arena: &Arena, bodies: &[BodyId], prefix: &str) -> std::fmt::Result {
    if bodies.is_empty() {
        return Ok(());
    }
    writeln!(out, "\n/* Functions: arguments a, results o. */")?;
    for id in bodies {
        writeln!(out, "static void {prefix}_f{}(const double *a, double *o, hyd_account *account);", id.0)?;
    }
    for &id in bodies {
        let body = arena.body(id);
        writeln!(out, "\n/* {} */", body.name)?;
        writeln!(out, "static void {prefix}_f{}(const double *a, double *o, hyd_account *account)\n{{", id.0)?;
        Steps { arena, prefix, body }.all(out)?;
        writeln!(out, "}}")?;
    }
    Ok(())
}

struct Steps<'a> {
    arena: &'a Arena,
    prefix: &'a str,
    body: &'a Body,
}

impl Steps<'_> {
    fn all(&self, out: &mut String) -> std::fmt::Result {
        let Body { inputs, registers, outputs, .. } = self.body;
        let frame = self.body.frame();
        writeln!(out, "    double r[{}] = {{0}};", (*registers).max(1))?;
        writeln!(out, "    if (account->turns == 0 || account->stack < {frame})\n        goto full;")?;
        writeln!(out, "    account->turns--, account->stack -= {frame};")?;
        writeln!(out, "    for (int i = 0; i < {inputs}; i++)\n        r[i] = a[i];")?;
        self.list(out, &self.body.steps, 1)?;
        writeln!(out, "    goto done;\ndone:\n    account->stack += {frame};")?;
        for (k, output) in outputs.iter().enumerate() {
            writeln!(out, "    o[{k}] = r[{}]; /* {} */", output.register, output.name)?;
        }
        writeln!(out, "    return;\n    goto fail;\nfail:\n    account->stack += {frame};\nfull:")?;
        writeln!(out, "    for (int i = 0; i < {}; i++)\n        o[i] = NAN;", outputs.len())
    }

    fn list(&self, out: &mut String, steps: &[Step], depth: usize) -> std::fmt::Result {
        steps.iter().try_for_each(|step| self.step(out, step, depth))
    }

    /// The values of expressions, their local variables being written.
    fn values(&self, out: &mut String, roots: &[NodeId], depth: usize) -> Result<Vec<String>, std::fmt::Error> {
        let order = post_order(self.arena, roots);
        Writer::new(self.arena, &order, roots, self.prefix, "    ".repeat(depth)).within("account").write(out)
    }

    fn step(&self, out: &mut String, step: &Step, depth: usize) -> std::fmt::Result {
        let outer = "    ".repeat(depth);
        let indent = "    ".repeat(depth + 1);
        writeln!(out, "{outer}{{")?;
        match step {
            Step::Set(to, node) => {
                let values = self.values(out, &[*node], depth + 1)?;
                writeln!(out, "{indent}r[{to}] = {};", values[0])?;
            }
            Step::Load { to, first, count, index } => {
                let values = self.values(out, &[*index], depth + 1)?;
                writeln!(out, "{indent}const double i = {};", values[0])?;
                writeln!(out, "{indent}if (!(i >= 0 && i < {count}))\n{indent}    goto fail;")?;
                writeln!(out, "{indent}r[{to}] = r[{first} + (int)i];")?;
            }
            Step::Store { first, count, index, value } => {
                let values = self.values(out, &[*index, *value], depth + 1)?;
                writeln!(out, "{indent}const double i = {};", values[0])?;
                writeln!(out, "{indent}if (!(i >= 0 && i < {count}))\n{indent}    goto fail;")?;
                writeln!(out, "{indent}r[{first} + (int)i] = {};", values[1])?;
            }
            Step::Call { body, arguments, results } => {
                let values = self.values(out, arguments, depth + 1)?;
                let values = if values.is_empty() { vec!["0".to_string()] } else { values };
                let count = self.arena.body(*body).outputs.len().max(1);
                writeln!(out, "{indent}const double given[] = {{{}}};", values.join(", "))?;
                writeln!(out, "{indent}double found[{count}];")?;
                writeln!(out, "{indent}{}_f{}(given, found, account);", self.prefix, body.0)?;
                for (k, to) in results.iter().enumerate() {
                    writeln!(out, "{indent}r[{to}] = found[{k}];")?;
                }
            }
            Step::If(condition, yes, no) => {
                let values = self.values(out, &[*condition], depth + 1)?;
                writeln!(out, "{indent}if (({}) != 0) {{", values[0])?;
                self.list(out, yes, depth + 2)?;
                writeln!(out, "{indent}}} else {{")?;
                self.list(out, no, depth + 2)?;
                writeln!(out, "{indent}}}")?;
            }
            Step::Loop(steps) => {
                writeln!(out, "{indent}for (;;) {{")?;
                writeln!(
                    out,
                    "{indent}    if (account->turns == 0)\n{indent}        goto fail;\n{indent}    account->turns--;"
                )?;
                self.list(out, steps, depth + 2)?;
                writeln!(out, "{indent}}}")?;
            }
            Step::Break => writeln!(out, "{indent}break;")?,
            Step::Return => writeln!(out, "{indent}goto done;")?,
            Step::Check(condition, text) => {
                let values = self.values(out, &[*condition], depth + 1)?;
                writeln!(
                    out,
                    "{indent}if (!({})) /* {} */\n{indent}    goto fail;",
                    values[0],
                    text.replace("*/", "* /")
                )?;
            }
        }
        writeln!(out, "{outer}}}")
    }
}
