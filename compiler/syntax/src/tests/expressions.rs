//! Expressions: precedence against the table of the Modelica 3.6 specification (section 3.2), written here as fully
//! parenthesised text by hand, and printing: what is printed is read as the same tree.

use hyd_source::FileId;

use crate::tree::{Arguments, BinaryOp, ClassBody, EquationKind, Expr, ExprKind, UnaryOp};
use crate::{parse, print_expr, print_reference};

fn read(text: &str) -> Expr {
    let model = format!("model M\nequation\n  x[1] = {text};\nend M;\n");
    let outcome = parse(FileId(0), &model);
    assert!(outcome.diagnostics.is_empty(), "{text}: {:?}", outcome.diagnostics);
    let ClassBody::Long { equations, .. } = &outcome.value.classes[0].body else { panic!("a long class") };
    match &equations[0].equations[0].kind {
        EquationKind::Equal(_, right) => right.clone(),
        other => panic!("an equation with two sides, found {other:?}"),
    }
}

/// The tree with every operation in parentheses; independent of the printer.
fn shape(expr: &Expr) -> String {
    let list = |values: &[Expr]| values.iter().map(shape).collect::<Vec<_>>().join(" ");
    match &expr.kind {
        ExprKind::Integer(value) => value.to_string(),
        ExprKind::Real(value) => format!("{value:?}"),
        ExprKind::Text(text) => format!("{text:?}"),
        ExprKind::Boolean(value) => value.to_string(),
        ExprKind::Ref(reference) => print_reference(reference),
        ExprKind::Call(function, Arguments::List { positional, named }) => {
            let named: String = named.iter().map(|(name, value)| format!(" {}={}", name.name, shape(value))).collect();
            format!("{}<{}{named}>", print_reference(function), list(positional))
        }
        ExprKind::Call(function, Arguments::Reduction(value, _)) => {
            format!("{}<{} for>", print_reference(function), shape(value))
        }
        ExprKind::Partial(function, given) => {
            let given: Vec<String> =
                given.iter().map(|(name, value)| format!("{}={}", name.name, shape(value))).collect();
            format!("function {}<{}>", print_reference(function), given.join(" "))
        }
        ExprKind::Unary(op, value) => format!("({op:?} {})", shape(value)),
        ExprKind::Binary(op, left, right) => format!("({} {op:?} {})", shape(left), shape(right)),
        ExprKind::If(branches, otherwise) => {
            let branches: String = branches.iter().map(|(c, v)| format!("{} ? {} : ", shape(c), shape(v))).collect();
            format!("({branches}{})", shape(otherwise))
        }
        ExprKind::Range(start, step, stop) => {
            format!("({} to {} by {})", shape(start), shape(stop), step.as_ref().map_or("1".into(), |s| shape(s)))
        }
        ExprKind::Array(values) => format!("{{{}}}", list(values)),
        ExprKind::ArrayFor(value, iterators) => format!("{{{} for {}}}", shape(value), iterators.len()),
        ExprKind::Matrix(rows) => format!("[{}]", rows.iter().map(|row| list(row)).collect::<Vec<_>>().join("; ")),
        ExprKind::Tuple(slots) => {
            let slots: Vec<String> = slots.iter().map(|s| s.as_ref().map_or("_".into(), shape)).collect();
            format!("tuple({})", slots.join(","))
        }
        ExprKind::Field(value, name) => format!("{}.{}", shape(value), name.name),
        ExprKind::Colon => ":".into(),
        ExprKind::End => "end".into(),
    }
}

#[test]
fn precedence_is_that_of_the_specification() {
    let table = [
        ("a + b*c", "(a Add (b Mul c))"),
        ("a*b + c", "((a Mul b) Add c)"),
        ("a - b - c", "((a Sub b) Sub c)"),
        ("a/b*c", "((a Div b) Mul c)"),
        ("-a^2", "(Minus (a Pow 2))"),
        ("-a*b", "(Minus (a Mul b))"),
        ("-a + b", "((Minus a) Add b)"),
        ("2*a^b", "(2 Mul (a Pow b))"),
        ("(a^b)^c", "((a Pow b) Pow c)"),
        ("a^(-b)", "(a Pow (Minus b))"),
        ("a .* b .^ c ./ d", "((a ElementMul (b ElementPow c)) ElementDiv d)"),
        ("a .+ b .- c", "((a ElementAdd b) ElementSub c)"),
        ("a < b + c", "(a Less (b Add c))"),
        ("a <= -b", "(a LessEqual (Minus b))"),
        ("not a < b", "(Not (a Less b))"),
        ("not a and b", "((Not a) And b)"),
        ("a or b and not c", "(a Or (b And (Not c)))"),
        ("a and b or c and d", "((a And b) Or (c And d))"),
        ("a == b or a <> c", "((a Equal b) Or (a NotEqual c))"),
        ("1:n - 1", "(1 to (n Sub 1) by 1)"),
        ("a:b*2:c + 1", "(a to (c Add 1) by (b Mul 2))"),
        ("if a > 0 then b else c + 1", "((a Greater 0) ? b : (c Add 1))"),
        ("if a then 1 elseif b then 2 else 3", "(a ? 1 : b ? 2 : 3)"),
        ("(if a then 1 else 2)*3", "((a ? 1 : 2) Mul 3)"),
        ("f(a, b + 1, c = d)", "f<a (b Add 1) c=d>"),
        ("sum(y[i] for i in 1:3)", "sum<y[i] for>"),
        ("{i*j for i in 1:3, j}", "{(i Mul j) for 2}"),
        ("[1, 2; 3, -4]", "[1 2; 3 (Minus 4)]"),
        ("a.b[1, end].c[:]", "a.b[1, end].c[:]"),
        ("der(x) >= initial()", "(der<x> GreaterEqual initial<>)"),
        ("(a, , b)", "tuple(a,_,b)"),
        ("'a b'.c + .Top.d", "('a b'.c Add .Top.d)"),
    ];
    for (text, expected) in table {
        assert_eq!(shape(&read(text)), expected, "{text}");
    }
}

#[test]
fn literals_have_their_values() {
    let table = [
        ("1e-3", "0.001"),
        ("1.", "1.0"),
        ("1.5E+2", "150.0"),
        ("42", "42"),
        ("9223372036854775807", "9223372036854775807"),
        (r#""a\"b\\c\n""#, r#""a\"b\\c\n""#),
        ("true", "true"),
    ];
    for (text, expected) in table {
        assert_eq!(shape(&read(text)), expected, "{text}");
    }
}

#[test]
fn printing_uses_as_few_parentheses_as_possible() {
    let table = [
        ("((a)+((b*c)))", "a + b*c"),
        ("(a+b)*c", "(a + b)*c"),
        ("a-(b-c)", "a - (b - c)"),
        ("(a-b)-c", "a - b - c"),
        ("(-a)*b", "(-a)*b"),
        ("-(a*b)", "-a*b"),
        ("(-a)^2", "(-a)^2"),
        ("-(a^2)", "-a^2"),
        ("(a^b)^c", "(a^b)^c"),
        ("not (a and b)", "not (a and b)"),
        ("(not a) and b", "not a and b"),
        ("(1:2)+3", "(1:2) + 3"),
        ("2 .* x", "2 .* x"),
        ("1+(if a then b else c)", "1 + (if a then b else c)"),
        ("if a then (if b then c else d) else e", "if a then if b then c else d else e"),
        ("{ i for i in (1:2) }", "{i for i in 1:2}"),
        (r#"f(a,"x\ty",b=1e-9)"#, r#"f(a, "x\ty", b = 1e-9)"#),
        ("f(function .A.g(a=1,b = x), u)", "f(function .A.g(a = 1, b = x), u)"),
        ("f(h = function g())", "f(h = function g())"),
    ];
    for (text, expected) in table {
        assert_eq!(print_expr(&read(text)), expected, "{text}");
    }
}

/// Random trees from a linear congruential generator (constants of Knuth, MMIX).
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    fn expr(&mut self, depth: u32) -> Expr {
        let span = read("1").span;
        let part = |random: &mut Self| Box::new(random.expr(depth - 1));
        let kind = match if depth == 0 { self.below(3) } else { self.below(12) } {
            0 => ExprKind::Integer(self.below(1000) as i64),
            1 => ExprKind::Real(self.below(1000) as f64 * 1e-7),
            2 => ExprKind::Boolean(self.below(2) == 0),
            3 => ExprKind::Unary([UnaryOp::Minus, UnaryOp::Plus, UnaryOp::Not][self.below(3) as usize], part(self)),
            4 => ExprKind::If(vec![(*part(self), *part(self))], part(self)),
            5 => ExprKind::Range(part(self), None, part(self)),
            6 => ExprKind::Array(vec![*part(self), *part(self)]),
            7 => ExprKind::Tuple(vec![Some(*part(self)), None]),
            _ => {
                const ALL: [BinaryOp; 12] = [
                    BinaryOp::Add,
                    BinaryOp::Sub,
                    BinaryOp::Mul,
                    BinaryOp::Div,
                    BinaryOp::Pow,
                    BinaryOp::ElementMul,
                    BinaryOp::ElementPow,
                    BinaryOp::ElementSub,
                    BinaryOp::Less,
                    BinaryOp::Equal,
                    BinaryOp::And,
                    BinaryOp::Or,
                ];
                ExprKind::Binary(ALL[self.below(12) as usize], part(self), part(self))
            }
        };
        Expr { kind, span }
    }
}

#[test]
fn printed_trees_are_read_as_the_same_trees() {
    let mut random = Random(1);
    for _ in 0..2000 {
        let tree = random.expr(5);
        let text = print_expr(&tree);
        assert_eq!(shape(&read(&text)), shape(&tree), "{text}");
    }
}
