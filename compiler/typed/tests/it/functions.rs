//! Calls of functions and constructors, and the functions themselves.

use hyd_instance::{Resolved, Scope};
use hyd_typed::{Elaborator, StatementKind, Typing};

use crate::{check_text, with_tree};

/// An argument with one dimension more than the input asks for one call per element (Modelica 3.6, section 12.4.6).
#[test]
fn a_call_per_element() {
    let text = "model M
  function f
    input Real a;
    input Real v[:];
    output Real y;
    output Integer n;
  algorithm
    y := a*sum(v);
    n := size(v, 1);
  end f;
  Real x[2], s, m[2, 3];
  Integer k;
equation
  s = f(1, {1, 2});
  x = f({1, 2}, {1, 2});
  x = f(a = 1, v = m);
  (s, k) = f(2, x);
end M;";
    insta::assert_snapshot!(check_text(text), @r"
    s: Real = M.f(1: Integer, {1: Integer, 2: Integer}: Integer[:]): Real
    x: Real[:] = M.f({1: Integer, 2: Integer}: Integer[:], {1: Integer, 2: Integer}: Integer[:]): Real[:]
    x: Real[:] = M.f(a = 1: Integer, v = m: Real[:, :]): Real[:]
    (s: Real, k: Integer) = M.f(2: Integer, x: Real[:]): Real
    ");
}

#[test]
fn constructors_have_the_type_of_their_record() {
    let text = "model M
  record R
    Real a;
    Integer n[2] = {1, 2};
  end R;
  function f
    input R r;
    output Real y;
  algorithm
    y := r.a + r.n[1];
  end f;
  Real y;
equation
  y = f(R(1)) + f(R(a = 2, n = {3, 4}));
end M;";
    insta::assert_snapshot!(check_text(text), @r"
    y: Real = (M.f(M.R(1: Integer): record M.R): Real + M.f(M.R(2: Integer, {3: Integer, 4: Integer}: Integer[:]): record M.R): Real): Real
    ");
}

/// A name that nothing declares in a function stays with the statement it stands in.
#[test]
fn statements_of_a_function_are_typed_one_by_one() {
    let text = "model M
  function f
    input Real a;
    output Real y;
  protected
    Integer n;
  algorithm
    n := 2;
    if a > 0 then
      y := b;
    end if;
    y := a^n;
  end f;
end M;";
    let seen = with_tree(text, |scopes| {
        let root = Scope { inst: scopes.instances.tree().root, frame: 0 };
        let name =
            hyd_syntax::tree::Ident { name: "f".into(), span: scopes.instances[scopes.instances.tree().root].span };
        let span = name.span;
        let part = hyd_syntax::tree::RefPart { name, subscripts: Vec::new() };
        let reference = hyd_syntax::tree::ComponentRef { global: false, parts: vec![part], span };
        let Ok(Resolved::Class(local)) = scopes.resolve(root, &reference) else { panic!("the function is there") };
        let mut typing = Typing::default();
        let function = Elaborator::new(scopes, &mut typing, root, Vec::new()).function(&local).expect("it has types");
        let again = Elaborator::new(scopes, &mut typing, root, Vec::new()).function(&local).expect("it has types");
        assert!(std::rc::Rc::ptr_eq(&function, &again), "it is typed once");
        let types: Vec<String> = function.variables.iter().map(|v| format!("{}: {}", v.name.name, v.ty)).collect();
        let statements = &function.algorithms[0].1;
        let StatementKind::If(branches) = &statements[1].kind else { panic!("an if") };
        let StatementKind::Failed(said) = &branches[0].1[0].kind else { panic!("`b` has no meaning") };
        let StatementKind::Assign(target, value) = &statements[2].kind else { panic!("an assignment") };
        let last = format!("{} := {}", target.describe(scopes), value.describe(scopes));
        assert_eq!(scopes.table.messages.count(), 0, "nothing is said before it is reached");
        format!("{}\n{}\n{last}", types.join(", "), said[0].message)
    });
    insta::assert_snapshot!(seen.expect("it is instantiated"), @r"
    a: Real, y: Real, n: Integer
    unknown name `b` in `M.f`
    local y: Real := (local a: Real ^ local n: Integer): Real
    ");
}

/// `type Vec = Real[3]` brings dimensions with it, and so does a short definition of one.
#[test]
fn short_definitions_have_dimensions() {
    let text = "model M
  type Vec = Real[3];
  type Rows = Vec[2];
  function f
    input Vec v;
    output Rows y;
  algorithm
    y := {v, v};
  end f;
  Rows x;
equation
  x = f({1, 2, 3});
end M;";
    insta::assert_snapshot!(check_text(text), @r"
    x: Real[:, :] = M.f({1: Integer, 2: Integer, 3: Integer}: Integer[:]): Real[:, :]
    ");
}
