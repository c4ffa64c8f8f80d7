//! Which rates and algebraic unknowns depend on which states, from the pattern of the equations.
//!
//! `F(t, (x, z), x') = 0` with rates and algebraic unknowns to be found: a matching gives each of them an equation that determines it; it
//! depends on what its equation reads, and on what that depends on.  Structural: a dependency may vanish by its value, none is
//! missing.  Method: augmenting paths (Duff 1981, "On algorithms for obtaining a maximum transversal").

use hyd_payload::Model;

/// What determines each unknown.
pub(crate) struct Dependencies {
    /// For each unknown that is found, or state whose rate is, the row that determines it.
    row_of: Vec<usize>,
    /// What rows read of what is to be found, and of states.
    found: Vec<Vec<usize>>,
    given: Vec<Vec<usize>>,
    /// The place of each unknown among the states; none for algebraic ones.
    position: Vec<Option<usize>>,
    states: Vec<usize>,
}

impl Dependencies {
    /// For each state the states that its rate depends on, ascending.
    pub(crate) fn of_rates(&self) -> Vec<Vec<usize>> {
        self.states.iter().map(|&state| self.of_found(state)).collect()
    }

    /// For each unknown the residual that determines it, or its rate.
    pub(crate) fn rows(&self) -> &[usize] {
        &self.row_of
    }

    /// The unknowns that are states, in order.
    pub(crate) fn states(&self) -> &[usize] {
        &self.states
    }

    /// The place of an unknown among the states, if it is one.
    pub(crate) fn state(&self, unknown: usize) -> Option<usize> {
        self.position.get(unknown).copied().flatten()
    }

    /// The states that an algebraic unknown, or the rate of a state, depends on, ascending.
    pub(crate) fn of_found(&self, unknown: usize) -> Vec<usize> {
        let mut reached = vec![false; self.states.len()];
        let mut seen = vec![false; self.row_of.len()];
        let mut open = vec![unknown];
        seen[unknown] = true;
        while let Some(unknown) = open.pop() {
            let row = self.row_of[unknown];
            self.given[row].iter().filter_map(|&state| self.position[state]).for_each(|k| reached[k] = true);
            for &next in &self.found[row] {
                if !std::mem::replace(&mut seen[next], true) {
                    open.push(next);
                }
            }
        }
        (0..self.states.len()).filter(|&k| reached[k]).collect()
    }
}

/// What determines each unknown; none where the equations do not say, because the choice of states varies or no matching was found.
pub(crate) fn dependencies(model: &Model) -> Option<Dependencies> {
    if !model.candidates.is_empty() {
        return None;
    }
    let structure = &model.structure;
    let n = structure.unknowns;
    // What each row reads: unknowns to be found, and states.
    let (mut found, mut given) = (vec![Vec::new(); n], vec![Vec::new(); n]);
    for column in 0..n {
        for entry in structure.state_pattern.column(column) {
            let row = structure.state_pattern.row_indices[entry] as usize;
            if structure.differential[column] { given[row].push(column) } else { found[row].push(column) }
        }
        for entry in structure.rate_pattern.column(column) {
            found[structure.rate_pattern.row_indices[entry] as usize].push(column);
        }
    }
    let row_of = matching(&found)?;
    let mut position = vec![None; n];
    let states: Vec<usize> = (0..n).filter(|&k| structure.differential[k]).collect();
    states.iter().enumerate().for_each(|(k, &state)| position[state] = Some(k));
    Some(Dependencies { row_of, found, given, position, states })
}

/// A row for each column.
fn matching(rows: &[Vec<usize>]) -> Option<Vec<usize>> {
    let n = rows.len();
    let mut row_of: Vec<Option<usize>> = vec![None; n];
    let mut visited = vec![usize::MAX; n];
    for start in 0..n {
        // A path of rows, each with the position among its columns that is tried.
        let mut path: Vec<(usize, usize)> = vec![(start, 0)];
        while let Some(&(row, k)) = path.last() {
            let Some(&column) = rows[row].get(k) else {
                path.pop();
                if let Some(last) = path.last_mut() {
                    last.1 += 1;
                }
                continue;
            };
            if visited[column] == start {
                path.last_mut()?.1 += 1;
                continue;
            }
            visited[column] = start;
            match row_of[column] {
                Some(owner) => path.push((owner, 0)),
                None => {
                    for &(row, k) in &path {
                        row_of[rows[row][k]] = Some(row);
                    }
                    break;
                }
            }
        }
        if path.is_empty() {
            return None;
        }
    }
    row_of.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::matching;

    #[test]
    fn rows_that_want_the_same_column_give_way() {
        let found = matching(&[vec![0, 1], vec![0], vec![1, 2]]).expect("there is one");
        assert_eq!(found, vec![1, 0, 2]);
        assert_eq!(matching(&[vec![0], vec![0]]), None);
    }
}
