//! Records: parameters, variables, arguments and results of functions.

use super::Builder;
use crate::model::{
    Component, Expr, Function, Id, Local, RecordClass, Role, Shape, Statement, Step, Target, Type, Variable,
};

impl Builder {
    fn record_class(&mut self) -> String {
        let known = self.model.records.iter().find(|r| !r.defaults);
        if let Some(class) = known.filter(|_| !self.serial.is_multiple_of(3)) {
            return class.name.clone();
        }
        let name = self.fresh("R");
        let fields = ["a", "b", "c"].into_iter().take(self.random.between(2, 3) as usize);
        let fields = fields.map(|f| (f.to_string(), 0.5)).collect();
        self.model.records.push(RecordClass { name: name.clone(), fields, defaults: false, derived: None });
        name
    }

    fn fields(&self, class: &str) -> Vec<String> {
        let class = self.model.records.iter().find(|r| r.name == class);
        class.map(|class| class.fields.iter().map(|(n, _)| n.clone()).collect()).unwrap_or_default()
    }

    fn record(&mut self, class: &str, parameter: bool, value: Option<Expr>) -> (usize, Vec<Id>) {
        let name = self.fresh("r");
        let component = Component {
            name,
            class: class.to_string(),
            count: None,
            shape: Shape::Record,
            parameter,
            value,
            inherits: false,
            uneven: false,
            dropped: false,
        };
        self.model.components.push(component);
        let owner = self.model.components.len() - 1;
        let role = if parameter { Role::Parameter } else { Role::Algebraic };
        let ids = self.fields(class).into_iter().map(|f| Variable { owner: Some(owner), ..Variable::new(f, role) });
        let ids: Vec<Variable> = ids.collect();
        (owner, ids.into_iter().map(|v| self.model.add(v)).collect())
    }

    fn construct(&mut self, class: &str, make: &mut dyn FnMut(&mut Self) -> Expr) -> Expr {
        let fields = self.fields(class).into_iter().map(|f| (f, make(self))).collect();
        let named = self.random.once_in(2);
        Expr::Construct(class.to_string(), fields, named)
    }
}

/// Records of parameters, modified or constructed.
pub(super) fn parameters(b: &mut Builder) {
    let class = b.record_class();
    if b.random.once_in(2) {
        let value = b.construct(&class, &mut |b| Expr::Number(b.random.number(0.2, 1.5)));
        let (_, ids) = b.record(&class, true, Some(value));
        b.readable.extend(ids.into_iter().map(Expr::name));
    } else {
        let (_, ids) = b.record(&class, true, None);
        for id in ids {
            b.model.variables[id].value = Some(Expr::Number(b.random.number(0.2, 1.5)));
            b.readable.push(Expr::name(id));
        }
    }
}

/// Records of parameters whose class has defaults, perhaps modified ones of a base class; not all fields are given.
pub(super) fn defaults(b: &mut Builder) {
    let name = b.fresh("R");
    let fields = ["a", "b", "c"].map(|f| (f.to_string(), b.random.number(0.2, 1.5))).to_vec();
    let derived = b.random.once_in(2).then(|| b.random.number(0.2, 1.5));
    b.model.records.push(RecordClass { name: name.clone(), fields: fields.clone(), defaults: true, derived });
    if b.random.once_in(2) {
        let given = b.random.between(0, 3) as usize;
        let values = fields.iter().take(given).map(|(f, _)| (f.clone(), Expr::Number(b.random.number(0.2, 1.5))));
        let values: Vec<(String, Expr)> = values.collect();
        let named = b.random.once_in(2);
        let (_, ids) = b.record(&name, true, Some(Expr::Construct(name.clone(), values, named)));
        b.readable.extend(ids.into_iter().map(Expr::name));
    } else {
        let local = Local { name: "r".into(), kind: Type::Record(name), sizes: Vec::new(), value: None };
        let field = |f: &str| Expr::Field(Box::new(Expr::local("r")), f.to_string());
        let e = field("a") * Expr::local("u") + Expr::call("sin", vec![field("b")]) - field("c");
        let body = vec![super::functions::set("y", e)];
        let (u, y) = (super::functions::real("u"), super::functions::real("y"));
        let function = b.function(vec![u], vec![y], vec![local], body);
        let argument = b.bounded(1);
        b.define(Expr::Call(function, vec![argument]));
    }
}

/// Records that functions take and give.
pub(super) fn results(b: &mut Builder) {
    let class = b.record_class();
    let fields = b.fields(&class);
    let local =
        |name: &str| Local { name: name.into(), kind: Type::Record(class.clone()), sizes: Vec::new(), value: None };
    let field = |record: &str, name: &str| Expr::Field(Box::new(Expr::local(record)), name.to_string());
    let body = fields.iter().enumerate().map(|(k, name)| {
        let other = &fields[(k + 1) % fields.len()];
        let e = Expr::Number(b.random.number(0.5, 1.5)) * field("r", other);
        let e = if k == 0 { e } else { e + field("q", &fields[0]) };
        Step::Assign(Target::Field("q".into(), name.clone()), e)
    });
    let body: Vec<Step> = body.collect();
    let name = b.fresh("g");
    let (inputs, outputs) = (vec![local("r")], vec![local("q")]);
    b.model.functions.push(Function { name: name.clone(), inputs, outputs, locals: Vec::new(), body });
    let argument = b.construct(&class, &mut |b| b.bounded(1));
    let (first, ids) = b.record(&class, false, None);
    b.push(Statement::DefineRecord(first, argument));
    let (second, results) = b.record(&class, false, None);
    b.push(Statement::DefineRecord(second, Expr::Call(name, vec![Expr::Record(first)])));
    b.readable.extend(ids.into_iter().chain(results).map(Expr::name));
}
