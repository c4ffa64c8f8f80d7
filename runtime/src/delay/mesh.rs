//! Steps on a mesh that a delay maps onto itself.
//!
//! A past of polynomials has kinks where its pieces meet.  A step over one sees them as errors and grows shorter, the next piece is shorter,
//! too, and its kinks come back once more: after some hundred passes through a line without friction steps are a fraction of what
//! the solution asks for.  Steps that end where the pieces end which they read have no kink within, and the polynomial that they read is
//! the one that was written: nothing is rough.  Such constrained meshes: Bellen, "One-step collocation for delay differential
//! equations", J. Comput. Appl. Math. 10 (1984) 275; Bellen, Zennaro 2003, section 4.2.

/// A step is shortened to at most this part of the wanted one.
const SHORTEST: f64 = 0.4;

/// Where a step of about `h` and at most `most` (s) from `from` (s) should end: on the last of the instants `mesh`, ascending, that it
/// reaches, or evenly between two of them; none if none is near.
pub(crate) fn end_on(mesh: impl Iterator<Item = f64>, from: f64, (h, most): (f64, f64)) -> Option<f64> {
    let mut last = from;
    let mut beyond = None;
    for t in mesh {
        if t > from + most {
            beyond = Some(t - from);
            break;
        }
        last = last.max(t);
    }
    let evenly = beyond.filter(|rest| *rest < 2.0 * h).map(|rest| from + 0.5 * rest);
    if last > from + SHORTEST * h { Some(last) } else { evenly }
}

#[cfg(test)]
mod tests {
    use super::end_on;

    #[test]
    fn a_step_ends_on_the_mesh_or_divides_what_lies_between() {
        let end = |mesh: &[f64], h: f64| end_on(mesh.iter().copied(), 1.0, (h, 1.01 * h));
        // Several in reach: the last.  One a little too far: half of the way.  One much too far: it does not matter.
        assert_eq!(end(&[0.5, 1.25, 1.5, 2.0, 3.0], 1.0), Some(2.0));
        assert_eq!(end(&[1.005, 2.0, 3.0], 0.75), Some(1.5));
        assert_eq!(end(&[3.0], 0.75), None);
        // One that would make the step very short is gone over.
        assert_eq!(end(&[1.25], 1.0), None);
        assert_eq!(end(&[1.25, 2.5], 1.0), Some(1.75));
        assert_eq!(end(&[], 1.0), None);
    }
}
