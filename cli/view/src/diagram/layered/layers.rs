//! The layer of each box: circles are cut, then the longest way to it counts.

use super::graph::Graph;

/// For each edge whether it leads forward: turned where it would close a circle.
pub(super) fn without_circles(graph: &Graph) -> Vec<bool> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Done,
    }
    let count = graph.boxes.len();
    let mut out: Vec<Vec<(usize, usize)>> = vec![Vec::new(); count];
    let mut coming = vec![0_usize; count];
    for (k, (a, b)) in graph.edges.iter().enumerate() {
        if a.part != b.part {
            out[a.part].push((k, b.part));
            coming[b.part] += 1;
        }
    }
    let mut forward = vec![true; graph.edges.len()];
    let mut state = vec![State::New; count];
    // Those that nothing leads to come first, so that as few edges as possible are turned.
    let mut starts: Vec<usize> = (0..count).collect();
    starts.sort_by_key(|&own| coming[own] > 0);
    for start in starts {
        if state[start] != State::New {
            continue;
        }
        state[start] = State::Open;
        let mut stack = vec![(start, 0)];
        while let Some((own, next)) = stack.pop() {
            let Some(&(edge, to)) = out[own].get(next) else {
                state[own] = State::Done;
                continue;
            };
            stack.push((own, next + 1));
            match state[to] {
                State::Open => forward[edge] = false,
                State::Done => {}
                State::New => {
                    state[to] = State::Open;
                    stack.push((to, 0));
                }
            }
        }
    }
    forward
}

/// The layer of each box: behind all that lead to it, and no further before what it leads to than needed.
pub(super) fn layers(graph: &Graph, forward: &[bool], is_connected: &[bool]) -> Vec<usize> {
    let count = graph.boxes.len();
    let mut after: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut coming = vec![0_usize; count];
    for (k, (a, b)) in graph.edges.iter().enumerate().filter(|(_, (a, b))| a.part != b.part) {
        let (from, to) = if forward[k] { (a.part, b.part) } else { (b.part, a.part) };
        after[from].push(to);
        coming[to] += 1;
    }
    let mut layer = vec![0_usize; count];
    let mut open: Vec<usize> = (0..count).filter(|&own| coming[own] == 0).collect();
    let mut order = Vec::new();
    let mut left = coming.clone();
    while let Some(own) = open.pop() {
        order.push(own);
        for &next in &after[own] {
            layer[next] = layer[next].max(layer[own] + 1);
            left[next] -= 1;
            if left[next] == 0 {
                open.push(next);
            }
        }
    }
    for &own in order.iter().rev().filter(|&&own| coming[own] == 0 && is_connected[own]) {
        if let Some(&nearest) = after[own].iter().min_by_key(|&&next| layer[next]) {
            layer[own] = layer[nearest].saturating_sub(1);
        }
    }
    layer
}
