//! Rows of results that wait until the sensitivities have passed their time.
//!
//! Steps of the sensitivities must not end at each row, so a row waits with its values, takes its derivatives from the
//! step that passes it, and is then written, in the order in which the rows came.  Rows that were written leave their
//! memory to later ones.

/// A row on its way.
#[derive(Debug, Default)]
pub(crate) struct WaitingRow {
    /// Time (s).
    pub(crate) t: f64,
    /// Values and rates of the unknowns.
    pub(crate) y: Vec<f64>,
    pub(crate) yp: Vec<f64>,
    /// Their derivatives, in blocks.
    pub(super) s: Vec<f64>,
    pub(super) sp: Vec<f64>,
}

/// The rows that wait, oldest first.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    rows: Vec<WaitingRow>,
    /// Rows in use, and those of them that have their derivatives.
    count: usize,
    ready: usize,
    taken: usize,
}

impl Waiting {
    /// Forgets all rows.
    pub(super) fn clear(&mut self) {
        (self.count, self.ready, self.taken) = (0, 0, 0);
    }

    /// Time of the oldest row (s).
    pub(super) fn oldest(&self) -> Option<f64> {
        self.rows[self.taken.min(self.count)..self.count].first().map(|row| row.t)
    }

    /// Takes a row; `length` is that of its blocks.
    pub(super) fn push(&mut self, t: f64, y: &[f64], yp: &[f64], length: usize) {
        if self.count == self.rows.len() {
            self.rows.push(WaitingRow::default());
        }
        let row = &mut self.rows[self.count];
        row.t = t;
        row.y.clear();
        row.y.extend_from_slice(y);
        row.yp.clear();
        row.yp.extend_from_slice(yp);
        row.s.resize(length, 0.0);
        row.sp.resize(length, 0.0);
        self.count += 1;
    }

    /// The next row up to `t` (s) that has no derivatives yet; it counts as ready from then on.
    pub(super) fn next_up_to(&mut self, t: f64) -> Option<&mut WaitingRow> {
        let row = self.rows[..self.count].get_mut(self.ready).filter(|row| row.t <= t)?;
        self.ready += 1;
        Some(row)
    }

    /// Lends the next row that is ready.
    pub(super) fn take(&mut self) -> Option<WaitingRow> {
        if self.taken == self.ready {
            if self.taken == self.count {
                self.clear();
            }
            return None;
        }
        self.taken += 1;
        Some(std::mem::take(&mut self.rows[self.taken - 1]))
    }

    /// Takes the memory of a lent row back.
    pub(super) fn give_back(&mut self, row: WaitingRow) {
        if let Some(place) = self.taken.checked_sub(1) {
            self.rows[place] = row;
        }
        if self.taken == self.ready && self.ready > 0 {
            self.rows[..self.count].rotate_left(self.ready);
            self.count -= self.ready;
            (self.ready, self.taken) = (0, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_leave_in_order_once_they_are_passed() {
        let mut waiting = Waiting::default();
        for t in [1.0, 2.0, 3.0] {
            waiting.push(t, &[t], &[0.0], 1);
        }
        let mut taken = Vec::new();
        for reached in [0.5, 2.0, 2.5, 3.0] {
            while waiting.next_up_to(reached).is_some() {}
            while let Some(row) = waiting.take() {
                taken.push((reached, row.t));
                waiting.give_back(row);
            }
        }
        assert_eq!(taken, [(2.0, 1.0), (2.0, 2.0), (3.0, 3.0)]);
        waiting.push(4.0, &[4.0], &[0.0], 1);
        assert!(waiting.take().is_none() && waiting.next_up_to(4.0).is_some());
        assert_eq!(waiting.take().map(|row| row.y), Some(vec![4.0]));
    }
}
