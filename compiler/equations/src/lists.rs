//! Lists of different lengths, stored end to end.

/// Lists of `T`, one per row, stored end to end.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Lists<T> {
    /// Row `r` holds `items[starts[r]..starts[r + 1]]`; one longer than rows.
    pub starts: Vec<u32>,
    /// The items, row by row.
    pub items: Vec<T>,
}

impl<T> Default for Lists<T> {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl<T> Lists<T> {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The items of a row.
    pub fn row(&self, row: usize) -> &[T] {
        &self.items[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Appends a row.
    pub fn push_row(&mut self, items: impl IntoIterator<Item = T>) {
        self.items.extend(items);
        self.starts.push(self.items.len() as u32);
    }
}
