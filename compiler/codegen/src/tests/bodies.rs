//! Random functions with loops, branches, computed subscripts and calls: the same bits natively and interpreted, and
//! derivatives equal to central differences.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use hyd_symbolic::{
    Arena, Body, BodyId, BodyOutput, Function, Machine, Node, NodeId, Relation, SlotId, Step, eval, partial,
};

use crate::memory::Memory;
use crate::native::{self, NativeCode};
use crate::program::{Address, Area, HOMOTOPY, Kernel, Program, Routine, RoutineId, Store};
use crate::vm::Vm;

const INPUTS: u32 = 3;
/// Registers: inputs, numbers, an array, counters of loops.
const NUMBERS: std::ops::Range<u32> = 3..7;
const ARRAY: std::ops::Range<u32> = 7..12;
const COUNTERS: u32 = 12;
const REGISTERS: u32 = 24;

/// A linear congruential generator (Knuth, MMIX).
struct Random(u64);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) % u64::from(n)) as u32
    }

    fn real(&mut self) -> f64 {
        f64::from(self.below(2001)) / 500.0 - 2.0
    }
}

struct Maker<'a> {
    arena: &'a mut Arena,
    random: Random,
    callees: Vec<BodyId>,
    counters: u32,
}

impl Maker<'_> {
    fn slot(&mut self, r: u32) -> NodeId {
        self.arena.slot(SlotId(r))
    }

    /// A smooth expression of registers.
    fn expression(&mut self, depth: u32) -> NodeId {
        if depth == 0 || self.random.below(5) == 0 {
            return match self.random.below(3) {
                0 => {
                    let value = self.random.real();
                    self.arena.constant(value)
                }
                1 => {
                    let r = self.random.below(INPUTS);
                    self.slot(r)
                }
                _ => {
                    let r = NUMBERS.start + self.random.below(NUMBERS.len() as u32);
                    self.slot(r)
                }
            };
        }
        let (a, b) = (self.expression(depth - 1), self.expression(depth - 1));
        match self.random.below(7) {
            0 => self.arena.add(a, b),
            1 => self.arena.sub(a, b),
            2 => {
                let bounded = self.arena.call1(Function::Sin, b);
                self.arena.mul(a, bounded)
            }
            3 => self.arena.call1(Function::Tanh, a),
            4 => self.arena.call1(Function::Atan, a),
            5 => self.arena.call1(Function::Cos, a),
            _ => {
                let test = self.arena.compare(Relation::Less, a, b);
                let (x, y) = (self.expression(depth - 1), self.expression(depth - 1));
                self.arena.select(test, x, y)
            }
        }
    }

    /// A place in the array from a smooth value, now and then outside of it.
    fn place(&mut self) -> NodeId {
        let value = self.expression(1);
        let wave = self.arena.call1(Function::Sin, value);
        let reach = if self.random.below(30) == 0 { 9.0 } else { 2.4 };
        let (width, middle) = (self.arena.constant(reach), self.arena.constant(2.45));
        let wide = self.arena.mul(width, wave);
        let moved = self.arena.add(wide, middle);
        self.arena.call1(Function::Floor, moved)
    }

    fn steps(&mut self, depth: u32, in_loop: bool) -> Vec<Step> {
        let count = 1 + self.random.below(5);
        let mut steps = Vec::new();
        for _ in 0..count {
            self.step(depth, in_loop, &mut steps);
        }
        steps
    }

    fn step(&mut self, depth: u32, in_loop: bool, steps: &mut Vec<Step>) {
        let number = NUMBERS.start + self.random.below(NUMBERS.len() as u32);
        let (first, count) = (ARRAY.start, ARRAY.len() as u32);
        match self.random.below(10) {
            0..=2 => steps.push(Step::Set(number, self.expression(3))),
            3 => {
                let (index, value) = (self.place(), self.expression(2));
                steps.push(Step::Store { first, count, index, value });
            }
            4 => steps.push(Step::Load { to: number, first, count, index: self.place() }),
            5 if depth > 0 => {
                let (a, b) = (self.expression(2), self.expression(2));
                let test = self.arena.compare(Relation::Less, a, b);
                let (yes, no) = (self.steps(depth - 1, in_loop), self.steps(depth - 1, in_loop));
                steps.push(Step::If(test, yes, no));
            }
            6 | 7 if depth > 0 && self.counters < REGISTERS => self.counted(depth, steps),
            8 if !self.callees.is_empty() => {
                let body = self.callees[self.random.below(self.callees.len() as u32) as usize];
                let arguments = (0..INPUTS).map(|_| self.expression(2)).collect();
                let results = vec![number, ARRAY.start + self.random.below(count)];
                steps.push(Step::Call { body, arguments, results });
            }
            9 => {
                let (a, b) = (self.expression(2), self.expression(2));
                let test = self.arena.compare(Relation::Greater, a, b);
                let leave = if in_loop { Step::Break } else { Step::Return };
                steps.push(Step::If(test, vec![leave], Vec::new()));
            }
            _ => steps.push(Step::Set(number, self.expression(2))),
        }
    }

    /// A loop of a few turns.
    fn counted(&mut self, depth: u32, steps: &mut Vec<Step>) {
        let counter = self.counters;
        self.counters += 1;
        let (zero, one) = (self.arena.constant(0.0), self.arena.constant(1.0));
        let turns = self.random.below(5);
        let turns = self.arena.constant(f64::from(turns));
        let at = self.slot(counter);
        let more = self.arena.compare(Relation::Less, at, turns);
        let next = self.arena.add(at, one);
        let mut inner = vec![Step::If(more, Vec::new(), vec![Step::Break]), Step::Set(counter, next)];
        inner.extend(self.steps(depth - 1, true));
        steps.push(Step::Set(counter, zero));
        steps.push(Step::Loop(inner));
    }
}

/// A random body with three real arguments and two outputs.
fn body(arena: &mut Arena, seed: u64, callees: &[BodyId]) -> BodyId {
    let id = arena.reserve_body(format!("f{seed}").into(), vec![true; INPUTS as usize]);
    let mut maker = Maker { arena, random: Random(seed), callees: callees.to_vec(), counters: COUNTERS };
    let mut steps: Vec<Step> = NUMBERS.chain(ARRAY).map(|r| Step::Set(r, maker.expression(1))).collect();
    steps.extend(maker.steps(3, false));
    let output = |name: &str, register| BodyOutput { name: name.into(), register, zero: false };
    let outputs = vec![output("y", NUMBERS.start), output("z", NUMBERS.start + 1)];
    let body = Body {
        name: format!("f{seed}").into(),
        inputs: INPUTS,
        real_inputs: vec![true; INPUTS as usize],
        registers: REGISTERS,
        steps,
        outputs,
        derivatives: Vec::new(),
    };
    arena.set_body(id, body);
    id
}

/// Outputs and derivatives of a function of slots 0, 1, 2.
fn values(arena: &mut Arena, body: BodyId) -> Vec<NodeId> {
    let arguments: Vec<NodeId> = (0..INPUTS).map(|k| arena.slot(SlotId(k))).collect();
    let list = arena.argument_list(&arguments);
    let outputs: Vec<NodeId> = (0..2).map(|k| arena.intern(Node::Apply(body, k, list))).collect();
    let mut all = outputs.clone();
    for output in outputs {
        all.extend((0..INPUTS).map(|k| partial(arena, output, SlotId(k))));
    }
    // A second derivative: a body derived twice.
    let twice = partial(arena, all[2], SlotId(1));
    all.push(twice);
    all
}

fn run(values: &[NodeId], arena: &Arena, point: [f64; 3], interpret: bool) -> Vec<u64> {
    let slots = (0..INPUTS).map(|index| Address::Fixed { area: Area::Unknown, index, negated: false }).collect();
    let store = |(k, &value): (usize, &NodeId)| Store {
        value,
        to: Address::Fixed { area: Area::Out, index: k as u32, negated: false },
    };
    let stores: Vec<Store> = values.iter().enumerate().map(store).collect();
    let mut program = Program { arena: arena.clone(), ..Program::default() };
    program.routines.push(Routine { name: "test", kernels: vec![Kernel { count: 1, slots, stores }] });
    let (mut data, mut work, mut out, mut out2) = ([0.0; HOMOTOPY as usize + 1], [], vec![0.0; values.len()], []);
    let mut memory =
        Memory { data: &mut data, unknown: &point, rate: &[], work: &mut work, out: &mut out, out2: &mut out2 };
    if interpret {
        let vm = Vm::new(&program).unwrap();
        vm.call(RoutineId(0), &mut memory, &mut vm.registers());
    } else {
        let code = NativeCode::map(Arc::new(native::compile(&program).unwrap())).unwrap();
        code.call(RoutineId(0), &mut memory);
    }
    out.iter().map(|v| if v.is_nan() { f64::NAN.to_bits() } else { v.to_bits() }).collect()
}

#[test]
fn native_and_interpreted_bodies_agree_to_the_last_bit() {
    let mut finite = 0;
    for seed in 0..60u64 {
        let mut arena = Arena::new();
        let first = body(&mut arena, 1000 + seed, &[]);
        let second = body(&mut arena, 2000 + seed, &[first]);
        let values = values(&mut arena, second);
        let mut random = Random(seed);
        for _ in 0..3 {
            let point = [random.real(), random.real(), random.real()];
            let (one, two) = (run(&values, &arena, point, false), run(&values, &arena, point, true));
            assert_eq!(one, two, "seed {seed} at {point:?}");
            finite += usize::from(f64::from_bits(one[0]).is_finite());
        }
    }
    assert!(finite > 100, "{finite} of 180 points have values");
}

#[test]
fn derivatives_of_bodies_agree_with_differences() {
    let mut compared = 0;
    for seed in 0..80u64 {
        let mut arena = Arena::new();
        let first = body(&mut arena, 3000 + seed, &[]);
        let second = body(&mut arena, 4000 + seed, &[first]);
        let values = values(&mut arena, second);
        let mut random = Random(seed);
        for _ in 0..4 {
            let point = [random.real(), random.real(), random.real()];
            for (output, slot) in [(0usize, 0usize), (0, 2), (1, 1)] {
                let at = |shift: f64| {
                    let mut moved = point;
                    moved[slot] += shift;
                    eval(&arena, values[output], |s| moved[s.0 as usize], 0.0, false)
                };
                let difference = |h: f64| (at(h) - at(-h)) / (2.0 * h);
                let (coarse, fine) = (difference(2e-5), difference(1e-5));
                let scale = coarse.abs().max(1.0);
                // Passed over: no value, or a jump or kink near by.
                if !fine.is_finite() || (coarse - fine).abs() > 1e-6 * scale {
                    continue;
                }
                let derivative = values[2 + 3 * output + slot];
                let exact = eval(&arena, derivative, |s| point[s.0 as usize], 0.0, false);
                assert!((exact - fine).abs() <= 1e-5 * scale, "seed {seed}: {exact} instead of {fine}");
                compared += 1;
            }
        }
    }
    assert!(compared > 500, "{compared} derivatives compared");
}

/// `f(x) = if x < 1 then 1 else x*f(x - 1)`
fn factorial(arena: &mut Arena) -> BodyId {
    let id = arena.reserve_body("factorial".into(), vec![true]);
    let (x, one) = (arena.slot(SlotId(0)), arena.constant(1.0));
    let (test, less) = (arena.compare(Relation::Less, x, one), arena.sub(x, one));
    let result = arena.slot(SlotId(1));
    let product = arena.mul(x, result);
    let call = Step::Call { body: id, arguments: vec![less], results: vec![1] };
    let steps = vec![Step::If(test, vec![Step::Set(2, one)], vec![call, Step::Set(2, product)])];
    let outputs = vec![BodyOutput { name: "y".into(), register: 2, zero: false }];
    let body = Body {
        name: "factorial".into(),
        inputs: 1,
        real_inputs: vec![true],
        registers: 3,
        steps,
        outputs,
        derivatives: Vec::new(),
    };
    arena.set_body(id, body);
    id
}

#[test]
fn recursion_has_values_derivatives_and_an_end() {
    let mut arena = Arena::new();
    let id = factorial(&mut arena);
    let x = arena.slot(SlotId(0));
    let value = arena.apply(id, 0, x);
    let slope = partial(&mut arena, value, SlotId(0));
    // 5.5*4.5*3.5*2.5*1.5 and its logarithmic derivative.
    let product = 5.5 * 4.5 * 3.5 * 2.5 * 1.5;
    let logarithmic: f64 = [5.5f64, 4.5, 3.5, 2.5, 1.5].iter().map(|f| 1.0 / f).sum();
    let found: Vec<f64> =
        run(&[value, slope], &arena, [5.5, 0.0, 0.0], false).into_iter().map(f64::from_bits).collect();
    assert!((found[0] - product).abs() < 1e-10 && (found[1] - product * logarithmic).abs() < 1e-9, "{found:?}");
    // Too deep: no number, natively and interpreted, and a reason.
    for interpret in [false, true] {
        assert!(f64::from_bits(run(&[value], &arena, [1e6, 0.0, 0.0], interpret)[0]).is_nan());
    }
    let reason = Machine::new(&arena, &[id]).call(id, &[1e6]).unwrap_err();
    assert_eq!(reason, "the function `factorial` calls itself too deeply");
}
