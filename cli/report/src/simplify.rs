//! Thinning of curves to what a picture can show.
//!
//! Within each column of pixels the first, lowest, highest and last point are kept, in their order; the drawn line then
//! covers the same pixels as the full one (Jugel et al., "M4: a visualization-oriented time series data aggregation",
//! VLDB 2014).  Points that are not finite end a piece.

/// Pieces of the curve through `points`, at most about `4 * columns` points over `x` in `left..right`.
/// x ascends; short curves stay as they are.
pub fn simplify(points: &[(f64, f64)], left: f64, right: f64, columns: usize) -> Vec<Vec<(f64, f64)>> {
    let thin = points.len() > 4 * columns;
    let column = |x: f64| ((x - left) / (right - left) * columns as f64).floor() as i64;
    points
        .split(|(x, y)| !x.is_finite() || !y.is_finite())
        .filter(|piece| !piece.is_empty())
        .map(|piece| if thin { thin_piece(piece, column) } else { piece.to_vec() })
        .collect()
}

fn thin_piece(piece: &[(f64, f64)], column: impl Fn(f64) -> i64) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    for group in piece.chunk_by(|a, b| column(a.0) == column(b.0)) {
        let mut extremes = [0, 0, 0, group.len() - 1];
        for (k, point) in group.iter().enumerate() {
            if point.1 < group[extremes[1]].1 {
                extremes[1] = k;
            }
            if point.1 > group[extremes[2]].1 {
                extremes[2] = k;
            }
        }
        extremes.sort_unstable();
        let mut last = None;
        for k in extremes {
            if last != Some(k) {
                kept.push(group[k]);
            }
            last = Some(k);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_of_each_column_survive() {
        let points: Vec<(f64, f64)> = (0..100_000)
            .map(|k| {
                let x = f64::from(k) / 1000.0;
                // A spike of a single sample must stay visible.
                (x, if k == 54_321 { 9.0 } else { (7.0 * x).sin() })
            })
            .collect();
        let kept = simplify(&points, 0.0, 100.0, 200).concat();
        assert!(kept.len() <= 800, "{}", kept.len());
        for column in 0..200 {
            let inside = |p: &&(f64, f64)| (p.0 / 100.0 * 200.0).floor() as i64 == column;
            let range = |all: &[(f64, f64)]| {
                let ys = || all.iter().filter(inside).map(|p| p.1);
                (ys().fold(f64::MAX, f64::min), ys().fold(f64::MIN, f64::max))
            };
            assert_eq!(range(&kept), range(&points));
        }
        assert!(kept.windows(2).all(|w| w[0].0 <= w[1].0));
    }

    #[test]
    fn gaps_split_and_short_curves_stay() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (2.0, 4.0), (3.0, f64::INFINITY)];
        assert_eq!(simplify(&points, 0.0, 3.0, 500), [vec![(0.0, 1.0)], vec![(2.0, 3.0), (2.0, 4.0)]]);
        assert!(simplify(&[(0.0, f64::NAN)], 0.0, 1.0, 10).is_empty());
    }
}
