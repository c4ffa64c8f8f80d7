//! Random programs give the same bits natively and interpreted, and the interpreter the same as symbolic evaluation.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use hyd_symbolic::{Arena, Function, Node, NodeId, Relation, SlotId, eval};
use proptest::prelude::*;

use crate::memory::Memory;
use crate::native::{self, NativeCode};
use crate::program::{Address, Area, Kernel, Program, Routine, RoutineId, Store, TABLE_SIGN};
use crate::vm::Vm;

const SLOTS: u32 = 6;
/// Loops have at most this many instances.
const SIZE: u32 = 12;
/// Positions per area: loops may begin at later ones, so that pairs are aligned and not.
const ROOM: u32 = SIZE + 4;
/// Functions that become instructions, also of vectors.
const INLINE: [Function; 10] = [
    Function::Sqrt,
    Function::Abs,
    Function::Sign,
    Function::Floor,
    Function::Ceil,
    Function::Min,
    Function::Max,
    Function::Div,
    Function::Mod,
    Function::Rem,
];

/// Choices from which a program is grown.
#[derive(Clone, Debug)]
struct Recipe {
    operations: Vec<(u8, u16, u16, u16)>,
    kernels: Vec<KernelRecipe>,
    values: Vec<f64>,
}

#[derive(Clone, Debug)]
struct KernelRecipe {
    count: u32,
    slots: Vec<(u8, u32, bool)>,
    stores: Vec<u16>,
    seed: u32,
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -4.0..4.0f64,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 2.5, 1e300, -1e-300, f64::INFINITY, f64::NAN]),
    ]
}

fn recipe() -> impl Strategy<Value = Recipe> {
    let kernel = (
        prop_oneof![Just(1u32), 2..=SIZE],
        prop::collection::vec((any::<u8>(), 0..SIZE, any::<bool>()), SLOTS as usize),
        prop::collection::vec(any::<u16>(), 1..5),
        any::<u32>(),
    )
        .prop_map(|(count, slots, stores, seed)| KernelRecipe { count, slots, stores, seed });
    (
        prop::collection::vec((any::<u8>(), any::<u16>(), any::<u16>(), any::<u16>()), 1..60),
        prop::collection::vec(kernel, 1..5),
        prop::collection::vec(number(), 4 * ROOM as usize),
    )
        .prop_map(|(operations, kernels, values)| Recipe { operations, kernels, values })
}

fn grow(arena: &mut Arena, operations: &[(u8, u16, u16, u16)]) -> Vec<NodeId> {
    let mut nodes: Vec<NodeId> = (0..SLOTS).map(|k| arena.slot(SlotId(k))).collect();
    nodes.push(arena.intern(Node::Time));
    nodes.push(arena.intern(Node::Initial));
    nodes.extend([-1.5, 0.0, 1.0, 2.0, 1e10].map(|value| arena.constant(value)));
    let relations = [
        Relation::Less,
        Relation::LessEqual,
        Relation::Greater,
        Relation::GreaterEqual,
        Relation::Equal,
        Relation::NotEqual,
    ];
    for &(kind, a, b, c) in operations {
        let at = |k: u16| nodes[k as usize % nodes.len()];
        let (a, b, c, raw) = (at(a), at(b), at(c), c as usize);
        let call = |function: Function| {
            if function.arity() == 1 { Node::Call1(function, a) } else { Node::Call2(function, a, b) }
        };
        let node = match kind % 20 {
            0 => Node::Add(a, b),
            1 => Node::Sub(a, b),
            2 => Node::Mul(a, b),
            3 => Node::Div(a, b),
            4 => Node::Neg(a),
            5 => Node::Not(a),
            6 => Node::And(a, b),
            7 => Node::Or(a, b),
            8 | 9 => Node::Compare(relations[raw % 6], a, b),
            10 => Node::If(a, b, c),
            11..=16 => call(INLINE[raw % INLINE.len()]),
            17 => Node::Call1(Function::Sin, a),
            18 => Node::Call1(Function::Cos, a),
            _ => call(Function::ALL[raw % Function::ALL.len()]),
        };
        nodes.push(arena.intern(node));
    }
    nodes
}

fn address(program: &mut Program, area: Area, count: u32, k: u32, choice: u8, negated: bool, seed: u32) -> Address {
    match choice % 4 {
        0 => Address::Affine { area, base: seed % 5, stride: 1, negated },
        1 => Address::Affine { area, base: count - 1 + seed % 5, stride: -1, negated },
        2 => {
            // A permutation of the positions with signs.
            let start = program.tables.len() as u32;
            for i in 0..count {
                let sign = if negated && i % 2 == 0 { TABLE_SIGN } else { 0 };
                program.tables.push(((i + seed) % count) | sign);
            }
            Address::Table { area, start, signed: negated }
        }
        _ => Address::Fixed { area, index: k, negated },
    }
}

fn program(recipe: &Recipe) -> Program {
    let mut program = Program::default();
    let nodes = grow(&mut program.arena, &recipe.operations);
    let mut kernels = Vec::new();
    for kernel in &recipe.kernels {
        // Straight-line kernels may read what they write, loops not.
        let sources: &[Area] = if kernel.count == 1 {
            &[Area::Data, Area::Unknown, Area::Rate, Area::Work]
        } else {
            &[Area::Data, Area::Unknown, Area::Rate]
        };
        let slots = kernel
            .slots
            .iter()
            .map(|&(choice, k, negated)| {
                let area = sources[choice as usize / 4 % sources.len()];
                address(&mut program, area, kernel.count, k, choice, negated, kernel.seed % 97)
            })
            .collect();
        let stores = kernel.stores.iter().enumerate().map(|(j, &k)| {
            let area = [Area::Work, Area::Out, Area::Out2][j % 3];
            let form = if kernel.count == 1 { 3 } else { (kernel.seed >> j) as u8 % 3 };
            let to = address(&mut program, area, kernel.count, kernel.seed % SIZE, form, false, kernel.seed % 89);
            Store { value: nodes[nodes.len() - 1 - k as usize % nodes.len().min(8)], to }
        });
        // One store per area, so that instances do not overwrite each other.
        let stores = stores.take(3).collect();
        kernels.push(Kernel { count: kernel.count, slots, stores });
    }
    program.routines.push(Routine { name: "test", kernels });
    program
}

struct Areas {
    data: Vec<f64>,
    unknown: Vec<f64>,
    rate: Vec<f64>,
    work: Vec<f64>,
    out: Vec<f64>,
    out2: Vec<f64>,
}

impl Areas {
    fn new(values: &[f64]) -> Self {
        let part = |k: usize| values[k * ROOM as usize..(k + 1) * ROOM as usize].to_vec();
        let zeros = vec![0.0; ROOM as usize];
        Self { data: part(0), unknown: part(1), rate: part(2), work: part(3), out: zeros.clone(), out2: zeros }
    }

    fn memory(&mut self) -> Memory<'_> {
        Memory {
            data: &mut self.data,
            unknown: &self.unknown,
            rate: &self.rate,
            work: &mut self.work,
            out: &mut self.out,
            out2: &mut self.out2,
        }
    }

    /// All writable values; NaN has one form.
    fn bits(&self) -> Vec<u64> {
        let bits = |v: &f64| if v.is_nan() { f64::NAN.to_bits() } else { v.to_bits() };
        self.work.iter().chain(&self.out).chain(&self.out2).map(bits).collect()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn native_code_and_interpreter_agree_to_the_last_bit(recipe in recipe()) {
        let program = program(&recipe);
        let code = NativeCode::map(Arc::new(native::compile(&program).unwrap())).unwrap();
        let vm = Vm::new(&program).unwrap();
        let (mut one, mut two) = (Areas::new(&recipe.values), Areas::new(&recipe.values));
        code.call(RoutineId(0), &mut one.memory());
        vm.call(RoutineId(0), &mut two.memory(), &mut vm.registers());
        prop_assert_eq!(one.bits(), two.bits());
    }

    #[test]
    fn interpreter_agrees_with_symbolic_evaluation(recipe in recipe()) {
        let mut program = Program::default();
        let nodes = grow(&mut program.arena, &recipe.operations);
        let value = *nodes.last().unwrap();
        let slots = (0..SLOTS).map(|index| Address::Fixed { area: Area::Unknown, index, negated: false }).collect();
        let stores = vec![Store { value, to: Address::Fixed { area: Area::Out, index: 0, negated: false } }];
        program.routines.push(Routine { name: "test", kernels: vec![Kernel { count: 1, slots, stores }] });
        let mut areas = Areas::new(&recipe.values);
        areas.data[1] = 1.0;
        let vm = Vm::new(&program).unwrap();
        vm.call(RoutineId(0), &mut areas.memory(), &mut vm.registers());
        let expected = eval(&program.arena, value, |s| areas.unknown[s.0 as usize], areas.data[0], true);
        prop_assert!(areas.out[0] == expected || areas.out[0].is_nan() == expected.is_nan());
    }
}

#[test]
fn a_long_kernel_is_cut_and_still_right() {
    let mut program = Program::default();
    let x = program.arena.slot(SlotId(0));
    let mut stores = Vec::new();
    let mut sum = x;
    for k in 0..6000u32 {
        let term = program.arena.constant(f64::from(k));
        let product = program.arena.intern(Node::Mul(term, x));
        sum = program.arena.intern(Node::Add(sum, product));
        if k % 1000 == 999 {
            let index = k / 1000;
            stores.push(Store { value: sum, to: Address::Fixed { area: Area::Out, index, negated: false } });
        }
    }
    let slots = vec![Address::Fixed { area: Area::Unknown, index: 0, negated: true }];
    program.routines.push(Routine { name: "sums", kernels: vec![Kernel { count: 1, slots, stores }] });
    let payload = native::compile(&program).unwrap();
    assert!(payload.entries(RoutineId(0)).len() > 1, "one function of 18000 nodes");
    let code = NativeCode::map(Arc::new(payload)).unwrap();
    let mut areas = Areas::new(&[-2.0; 4 * ROOM as usize]);
    code.call(RoutineId(0), &mut areas.memory());
    // 2*(1 + sum of 0..n-1) with n = 1000, ..., 6000.
    let expected: Vec<f64> =
        (1..=6).map(|j| f64::from(j) * 1000.0).map(|n| 2.0 * (1.0 + n * (n - 1.0) / 2.0)).collect();
    assert_eq!(areas.out[..6], expected);
}

#[test]
fn programs_that_write_unknowns_or_leave_their_tables_are_refused() {
    let mut program = Program::default();
    let value = program.arena.constant(1.0);
    let to = Address::Fixed { area: Area::Unknown, index: 0, negated: false };
    let kernel = Kernel { count: 1, slots: Vec::new(), stores: vec![Store { value, to }] };
    program.routines.push(Routine { name: "test", kernels: vec![kernel] });
    assert!(native::compile(&program).is_err());
    let to = Address::Table { area: Area::Out, start: 0, signed: false };
    program.routines.raw[0].kernels[0].stores[0].to = to;
    assert!(Vm::new(&program).is_err());
}

#[test]
fn code_of_a_loop_does_not_grow_with_the_count() {
    let bytes = |count: u32| {
        let mut program = Program::default();
        let (a, b) = (program.arena.slot(SlotId(0)), program.arena.slot(SlotId(1)));
        let value = program.arena.intern(Node::Mul(a, b));
        let slot = |base| Address::Affine { area: Area::Unknown, base, stride: 1, negated: false };
        let to = Address::Affine { area: Area::Out, base: 0, stride: 1, negated: false };
        let kernel = Kernel { count, slots: vec![slot(0), slot(1)], stores: vec![Store { value, to }] };
        program.routines.push(Routine { name: "test", kernels: vec![kernel] });
        native::compile(&program).unwrap().bytes().len()
    };
    assert_eq!(bytes(1_000), bytes(1_000_000));
}

/// Sines of sums of sines, with the same angles more than once, alone and in a loop: as if each were computed by itself.
#[test]
fn sines_of_several_ranks_are_those_of_single_calls() {
    for count in [1, 5] {
        let mut program = Program::default();
        let arena = &mut program.arena;
        let mut ranks: Vec<Vec<NodeId>> = vec![(0..SLOTS).map(|k| arena.slot(SlotId(k))).collect()];
        let mut all = ranks[0].clone();
        for _ in 0..4 {
            let below = ranks.last().unwrap().clone();
            let mut rank = Vec::new();
            for (k, &angle) in below.iter().enumerate() {
                let function = [Function::Sin, Function::Cos][k % 2];
                rank.push(arena.intern(Node::Call1(function, angle)));
                // Angles of which both are wanted, and sums over ranks.
                let other = arena.intern(Node::Call1(Function::Sin, angle));
                rank.push(arena.intern(Node::Add(other, all[k % all.len()])));
            }
            rank.truncate(7);
            all.extend(&rank);
            ranks.push(rank);
        }
        let sum = all.iter().copied().reduce(|a, b| arena.intern(Node::Add(a, b))).unwrap();
        let affine = |area| move |base| Address::Affine { area, base, stride: 1, negated: false };
        let slots = (0..SLOTS).map(affine(Area::Unknown)).collect();
        let stores = vec![Store { value: sum, to: affine(Area::Out)(0) }];
        program.routines.push(Routine { name: "test", kernels: vec![Kernel { count, slots, stores }] });
        let mut values: Vec<f64> = (0..4 * ROOM).map(|k| f64::from(k * k % 17) * 0.7 - 5.0).collect();
        values[ROOM as usize + 2] = 1e9;
        let code = NativeCode::map(Arc::new(native::compile(&program).unwrap())).unwrap();
        let vm = Vm::new(&program).unwrap();
        let (mut one, mut two) = (Areas::new(&values), Areas::new(&values));
        code.call(RoutineId(0), &mut one.memory());
        vm.call(RoutineId(0), &mut two.memory(), &mut vm.registers());
        assert!(two.out[count as usize - 1] != 0.0);
        assert_eq!(one.bits(), two.bits(), "{count} instances");
    }
}

/// A value that is read for a comparison alone, at aligned places and others.
#[test]
fn compared_pairs_need_no_alignment() {
    for base in 0..3 {
        let mut program = Program::default();
        let (x, limit) = (program.arena.slot(SlotId(0)), program.arena.constant(0.5));
        let (high, low) = (program.arena.constant(2.0), program.arena.constant(3.0));
        let is_above = program.arena.intern(Node::Compare(Relation::Less, limit, x));
        let value = program.arena.intern(Node::If(is_above, high, low));
        let slots = vec![Address::Affine { area: Area::Unknown, base, stride: 1, negated: false }];
        let stores = vec![Store { value, to: Address::Affine { area: Area::Out, base, stride: 1, negated: false } }];
        program.routines.push(Routine { name: "test", kernels: vec![Kernel { count: 9, slots, stores }] });
        let values: Vec<f64> = (0..4 * ROOM).map(|k| f64::from(k % 3) * 0.4).collect();
        let mut areas = Areas::new(&values);
        let code = NativeCode::map(Arc::new(native::compile(&program).unwrap())).unwrap();
        code.call(RoutineId(0), &mut areas.memory());
        for k in base as usize..base as usize + 9 {
            assert_eq!(areas.out[k], if areas.unknown[k] > 0.5 { 2.0 } else { 3.0 }, "place {k} of a loop from {base}");
        }
    }
}
