//! Which rates depend on which states, from the pattern of the equations.
//!
//! `F(t, (x, z), x') = 0` with rates and algebraic unknowns to be found: a matching gives each of them an equation that determines it; it
//! depends on what its equation reads, and on what that depends on.  Structural: a dependency may vanish by its value, none is
//! missing.  Method: augmenting paths (Duff 1981, "On algorithms for obtaining a maximum transversal").

use hyd_payload::Model;

/// For each state the states that its rate depends on, ascending; none where the equations do not say, because the choice of
/// states varies or no matching was found.
pub(crate) fn of_rates(model: &Model) -> Option<Vec<Vec<usize>>> {
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
    let mut position = vec![usize::MAX; n];
    let states: Vec<usize> = (0..n).filter(|&k| structure.differential[k]).collect();
    states.iter().enumerate().for_each(|(k, &state)| position[state] = k);
    let mut seen = vec![usize::MAX; n];
    let of = |(k, &state): (usize, &usize)| {
        let mut reached = vec![false; states.len()];
        let mut open = vec![state];
        seen[state] = k;
        while let Some(unknown) = open.pop() {
            let row = row_of[unknown];
            given[row].iter().for_each(|&state| reached[position[state]] = true);
            for &next in &found[row] {
                if seen[next] != k {
                    seen[next] = k;
                    open.push(next);
                }
            }
        }
        (0..states.len()).filter(|&j| reached[j]).collect()
    };
    Some(states.iter().enumerate().map(of).collect())
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
