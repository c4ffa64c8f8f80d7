//! Declarations: functions, record classes, classes of components, the model.

use super::{Form, Printer, number};
use crate::model::{
    ComponentId, Expr, Function, Id, Kind, LITERALS, Local, Role, Shape, Start, Statement, Type, Variable,
};
use crate::random::Random;

fn word(kind: Kind) -> &'static str {
    match kind {
        Kind::Real => "Real",
        Kind::Integer => "Integer",
        Kind::Boolean => "Boolean",
        Kind::Mode => "Mode",
    }
}

fn literal(kind: Kind, value: f64) -> String {
    match kind {
        Kind::Boolean => (value != 0.0).to_string(),
        Kind::Mode => format!("Mode.{}", LITERALS[(value as usize).clamp(1, LITERALS.len()) - 1]),
        _ => number(value),
    }
}

fn fields_text(fields: &[(String, f64)], defaults: bool) -> String {
    let value = |v: &f64| if defaults { format!(" = {}", number(*v)) } else { String::new() };
    fields.iter().map(|(n, v)| format!("  Real {n}{};\n", value(v))).collect()
}

impl Printer<'_> {
    /// The whole file.
    pub fn file(&self, random: &mut Random) -> String {
        let model = self.model;
        let mut text = String::new();
        let modes = model.variables.iter().any(|v| v.kind == Kind::Mode)
            || crate::visit::any(model, &|e| matches!(e, Expr::Literal(_)))
            || model.functions.iter().any(|f| f.inputs.iter().any(|i| i.kind == Type::Of(Kind::Mode)));
        if modes {
            text += &format!("type Mode = enumeration({});\n", LITERALS.join(", "));
        }
        for record in &model.records {
            let (name, mut fields) = (&record.name, record.fields.clone());
            if let (Some(other), Some(first)) = (record.derived, fields.first().cloned()) {
                fields[0].1 = other;
                text += &format!("record {name}Base\n{}end {name}Base;\n", fields_text(&fields, true));
                let modified = format!("{} = {}", first.0, number(first.1));
                text += &format!("record {name}\n  extends {name}Base({modified});\n");
            } else {
                text += &format!("record {name}\n{}", fields_text(&fields, record.defaults));
            }
            text += &format!("end {};\n", record.name);
        }
        model.functions.iter().for_each(|f| text += &self.function(f));
        for id in 0..model.components.len() {
            if model.components[id].shape == Shape::Model && !model.components[id].dropped && !self.is_flat(id) {
                text += &self.class(id, random);
            }
        }
        for statement in &model.statements {
            if let Statement::Network(network) = statement {
                text += &network.classes;
            }
        }
        text + &self.main(random)
    }

    fn local(&self, prefix: &str, local: &Local) -> String {
        let kind = match &local.kind {
            Type::Of(kind) => word(*kind).to_string(),
            Type::Record(name) => name.clone(),
        };
        let size = |n: &Option<usize>| n.map_or_else(|| ":".to_string(), |n| n.to_string());
        let sizes = match local.sizes.as_slice() {
            [] => String::new(),
            list => format!("[{}]", list.iter().map(size).collect::<Vec<_>>().join(", ")),
        };
        let value = local.value.as_ref().map_or_else(String::new, |e| format!(" = {}", self.expr(e)));
        format!("  {prefix}{kind} {}{sizes}{value};\n", local.name)
    }

    fn function(&self, function: &Function) -> String {
        let mut text = format!("function {}\n", function.name);
        function.inputs.iter().for_each(|local| text += &self.local("input ", local));
        function.outputs.iter().for_each(|local| text += &self.local("output ", local));
        if !function.locals.is_empty() {
            text += "protected\n";
            function.locals.iter().for_each(|local| text += &self.local("", local));
        }
        text += "algorithm\n";
        self.steps(&function.body, 1, &mut text);
        text + &format!("end {};\n", function.name)
    }

    fn owned(&self, component: ComponentId) -> Vec<(Id, &Variable)> {
        let all = self.model.variables.iter().enumerate();
        all.filter(|(_, v)| v.owner == Some(component) && !v.dropped).collect()
    }

    /// Variables of the model that the statements of a component read.
    fn outer(&self, component: ComponentId) -> Vec<Id> {
        let mut read = Vec::new();
        for statement in &self.model.statements {
            if matches!(statement, Statement::Each(owner, _) if *owner == component) {
                crate::visit::of_statement(statement, &mut |e| crate::visit::reads(e, self.model, &mut read));
            }
        }
        read.retain(|id| self.model.variables[*id].owner.is_none());
        read.sort_unstable();
        read.dedup();
        read
    }

    fn class(&self, id: ComponentId, random: &mut Random) -> String {
        let component = &self.model.components[id];
        let inside = Printer { inside: Some(id), values: Vec::new(), ..*self };
        let leading = usize::from(component.count.is_some());
        let (mut base, mut own) = (Vec::new(), Vec::new());
        for (k, variable) in self.owned(id) {
            let is_parameter = matches!(variable.role, Role::Parameter | Role::Constant);
            let value = is_parameter.then(|| "1".to_string());
            let line = inside.declaration(k, &variable.name, &variable.sizes[leading..], value);
            if is_parameter && component.inherits { base.push(line) } else { own.push(line) }
        }
        let mut equations = Vec::new();
        for statement in &self.model.statements {
            if let Statement::Each(owner, body) = statement
                && *owner == id
            {
                equations.extend(body.iter().map(|s| {
                    let mut text = String::new();
                    inside.statement(s, 1, &mut text);
                    text
                }));
            }
        }
        if component.uneven {
            own.push("  parameter Integer fillers = 1;\n  Real filler[fillers] = fill(1.0, fillers);\n".to_string());
        }
        for outer in self.outer(id) {
            let variable = &self.model.variables[outer];
            let prefix = if variable.role == Role::Parameter { "parameter " } else { "" };
            own.push(format!("  outer {prefix}{} {};\n", word(variable.kind), variable.name));
        }
        random.shuffle(&mut own);
        random.shuffle(&mut equations);
        let class = &component.class;
        let mut text = String::new();
        if component.inherits {
            text += &format!("partial model {class}Base\n{}end {class}Base;\n", base.concat());
            own.insert(0, format!("  extends {class}Base;\n"));
        }
        text + &format!("model {class}\n{}equation\n{}end {class};\n", own.concat(), equations.concat())
    }

    /// A declaration; `value`: what stands behind `=`.
    fn declaration(&self, id: Id, name: &str, sizes: &[usize], value: Option<String>) -> String {
        let variable = &self.model.variables[id];
        let prefix = match variable.role {
            Role::Constant => "constant ",
            Role::Parameter if self.form == (Form { constant: true, ..self.form }) => "constant ",
            Role::Parameter | Role::Structural | Role::Free => "parameter ",
            Role::Discrete if variable.kind == Kind::Real => "discrete ",
            _ => "",
        };
        let each = if sizes.is_empty() { "" } else { "each " };
        let mut attributes = Vec::new();
        let start = match &variable.start_by {
            Some(e) => self.expr(e),
            None => literal(variable.kind, variable.start),
        };
        if variable.fixed != Start::None {
            attributes.push(format!("{each}start = {start}"));
        }
        if variable.fixed == Start::Fixed {
            attributes.push(format!("{each}fixed = true"));
        } else if variable.role == Role::Free {
            attributes.push(format!("{each}fixed = false"));
        }
        if let Some(select) = variable.select {
            attributes.push(format!("{each}stateSelect = StateSelect.{select}"));
        }
        let attributes = if attributes.is_empty() { String::new() } else { format!("({})", attributes.join(", ")) };
        let size = |(k, n): (usize, &usize)| match variable.size_by.filter(|_| k == 0) {
            Some(by) if !self.form.unrolled => self.model.variables[by].name.clone(),
            _ => n.to_string(),
        };
        let sizes = match sizes {
            [] => String::new(),
            list => format!("[{}]", list.iter().enumerate().map(size).collect::<Vec<_>>().join(", ")),
        };
        let value = value.map_or_else(String::new, |value| format!(" = {value}"));
        format!("  {prefix}{} {name}{sizes}{attributes}{value};\n", word(variable.kind))
    }

    fn declared(&self, id: Id) -> Option<&Expr> {
        let declares = |s: &&Statement| matches!(s, Statement::Declare(of, _) if *of == id);
        match self.model.statements.iter().find(declares) {
            Some(Statement::Declare(_, e)) => Some(e),
            _ => self.model.variables[id].value.as_ref(),
        }
    }

    fn component(&self, id: ComponentId) -> String {
        let component = &self.model.components[id];
        let count = component.count.map_or_else(String::new, |n| format!("[{n}]"));
        let prefix = if component.parameter { "parameter " } else { "" };
        if let Some(e) = &component.value {
            return format!("  {prefix}{} {} = {};\n", component.class, component.name, self.expr(e));
        }
        let values = self.owned(id);
        let values = values.iter().filter_map(|(k, v)| Some(format!("{} = {}", v.name, self.expr(self.declared(*k)?))));
        let mut values: Vec<String> = values.collect();
        if let (true, Some(n)) = (component.uneven, component.count) {
            let sizes: Vec<String> = (1..=n).map(|k| k.to_string()).collect();
            values.push(format!("fillers = {{{}}}", sizes.join(", ")));
        }
        let values = if values.is_empty() { String::new() } else { format!("({})", values.join(", ")) };
        format!("  {prefix}{} {}{count}{values};\n", component.class, component.name)
    }

    fn main(&self, random: &mut Random) -> String {
        let model = self.model;
        let mut declarations = Vec::new();
        let parts = (0..model.components.len()).filter(|id| !model.components[*id].dropped && !self.is_flat(*id));
        let inner: Vec<Id> = parts.flat_map(|id| self.outer(id)).collect();
        for (id, variable) in model.variables.iter().enumerate().filter(|(_, v)| !v.dropped) {
            let name = match variable.owner {
                None => variable.name.clone(),
                Some(owner) if self.is_flat(owner) => format!("{}_{}", model.components[owner].name, variable.name),
                Some(_) => continue,
            };
            let value = self.declared(id).map(|e| self.expr(e));
            let text = self.declaration(id, &name, &variable.sizes, value);
            match inner.contains(&id) {
                true => declarations.push(format!("  inner {}", text.trim_start())),
                false => declarations.push(text),
            }
        }
        for (id, component) in model.components.iter().enumerate().filter(|(_, c)| !c.dropped) {
            if component.shape == Shape::Record || component.shape == Shape::Model && !self.is_flat(id) {
                declarations.push(self.component(id));
            }
        }
        let (mut equations, mut algorithms) = (Vec::new(), Vec::new());
        for statement in &model.statements {
            let mut text = String::new();
            match statement {
                Statement::Algorithm(steps) => {
                    text += "algorithm\n";
                    self.steps(steps, 1, &mut text);
                    algorithms.push(text);
                    continue;
                }
                Statement::Acts(branches) => {
                    text += "algorithm\n";
                    self.acts(branches, &mut text);
                    algorithms.push(text);
                    continue;
                }
                Statement::Network(network) => {
                    declarations.push(network.declarations.clone());
                    equations.extend(network.connections.iter().cloned());
                    network.equations.iter().for_each(|s| self.statement(s, 1, &mut text));
                }
                Statement::Implicit(_, list) => {
                    for equation in list {
                        let mut text = String::new();
                        self.equation(equation, 1, &mut text);
                        equations.push(text);
                    }
                }
                _ => self.statement(statement, 1, &mut text),
            }
            equations.push(text);
        }
        random.shuffle(&mut declarations);
        random.shuffle(&mut equations);
        let mut text = format!("model M\n{}", declarations.concat());
        if !model.initial.is_empty() {
            text += "initial equation\n";
            for (a, b) in &model.initial {
                text += &format!("  {} = {};\n", self.expr(a), self.expr(b));
            }
        }
        text + "equation\n" + &equations.concat() + &algorithms.concat() + "end M;\n"
    }
}
