//! The same work for several numbers, on several threads.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// `work(0), work(1), ...` up to `count`, in this order, made by at most `threads` threads.
pub(crate) fn each<T: Send>(threads: usize, count: usize, work: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    if threads < 2 || count < 2 {
        return (0..count).map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let made: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(count));
    std::thread::scope(|scope| {
        for _ in 0..threads.min(count) {
            scope.spawn(|| {
                while let Some(k) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&k| k < count) {
                    let value = work(k);
                    made.lock().unwrap_or_else(PoisonError::into_inner).push((k, value));
                }
            });
        }
    });
    let mut made = made.into_inner().unwrap_or_else(PoisonError::into_inner);
    made.sort_unstable_by_key(|&(k, _)| k);
    made.into_iter().map(|(_, value)| value).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_order_is_that_of_the_numbers() {
        let squares: Vec<usize> = (0..100).map(|k| k * k).collect();
        assert_eq!(super::each(3, 100, &|k| k * k), squares);
        assert_eq!(super::each(3, 0, &|k| k), Vec::<usize>::new());
    }
}
