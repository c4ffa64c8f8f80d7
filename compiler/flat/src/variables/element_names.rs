//! Names of chosen elements of an instance in arrays, as short as subscripts can say them: `tank[1:3].port[2]`.

use hyd_instance::instance::chain;
use hyd_instance::{InstId, Instances};

/// The names of the chosen elements; `chosen` counts all sizes around the instance and its own, the last one fastest.  One name
/// where ranges of subscripts say it, else one for each run of neighbours.
pub(crate) fn element_names(instances: &Instances, inst: InstId, chosen: &[bool]) -> Vec<String> {
    let chain = chain(instances, inst);
    let dims: Vec<usize> = chain.iter().flat_map(|&id| instances[id].dims.iter().copied()).collect();
    let name = |ranges: &[(usize, usize)]| {
        let mut rest = ranges.iter();
        let parts = chain.iter().filter(|&&id| !instances[id].name.is_empty()).map(|&id| {
            let own = rest.by_ref().take(instances[id].dims.len());
            let subscripts: Vec<String> = own.map(|&(first, last)| range_text(first, last)).collect();
            let name = &instances[id].name;
            if subscripts.is_empty() { name.to_string() } else { format!("{name}[{}]", subscripts.join(",")) }
        });
        parts.collect::<Vec<_>>().join(".")
    };
    if let Some(ranges) = as_block(&dims, chosen) {
        return vec![name(&ranges)];
    }
    let row = dims.last().copied().unwrap_or(1).max(1);
    let mut names = Vec::new();
    for (number, elements) in chosen.chunks(row).enumerate() {
        let mut outer = subscripts_of(&dims[..dims.len().saturating_sub(1)], number);
        let mut k = 0;
        while k < elements.len() {
            let length = elements[k..].iter().take_while(|&&one| one).count();
            if length > 0 {
                outer.push((k, k + length - 1));
                names.push(name(&outer));
                outer.pop();
            }
            k += length.max(1);
        }
    }
    names
}

/// The ranges of subscripts whose combinations are just the chosen elements.
fn as_block(dims: &[usize], chosen: &[bool]) -> Option<Vec<(usize, usize)>> {
    let mut ranges: Option<Vec<(usize, usize)>> = None;
    let mut count = 0;
    for k in (0..chosen.len()).filter(|&k| chosen[k]) {
        count += 1;
        let at = subscripts_of(dims, k);
        match &mut ranges {
            None => ranges = Some(at),
            Some(ranges) => {
                for (range, (own, _)) in ranges.iter_mut().zip(at) {
                    *range = (range.0.min(own), range.1.max(own));
                }
            }
        }
    }
    ranges.filter(|ranges| ranges.iter().map(|(first, last)| last - first + 1).product::<usize>() == count)
}

/// The subscripts of an element, from 0, each as a range of one.
fn subscripts_of(dims: &[usize], mut k: usize) -> Vec<(usize, usize)> {
    let mut at = vec![(0, 0); dims.len()];
    for (place, &size) in at.iter_mut().zip(dims).rev() {
        *place = (k % size, k % size);
        k /= size;
    }
    at
}

fn range_text(first: usize, last: usize) -> String {
    if first == last { (first + 1).to_string() } else { format!("{}:{}", first + 1, last + 1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_where_ranges_say_all() {
        let of = |dims: &[usize], chosen: &[usize]| {
            let flags: Vec<bool> = (0..dims.iter().product()).map(|k| chosen.contains(&k)).collect();
            as_block(dims, &flags)
        };
        assert_eq!(of(&[], &[0]), Some(vec![]));
        assert_eq!(of(&[4], &[1, 2]), Some(vec![(1, 2)]));
        assert_eq!(of(&[4], &[0, 2]), None);
        // Rows 1 and 2 of a matrix of three rows, the last of two columns.
        assert_eq!(of(&[3, 2], &[1, 3]), Some(vec![(0, 1), (1, 1)]));
        assert_eq!(of(&[3, 2], &[1, 2]), None);
        assert_eq!(of(&[3, 2], &[]), None);
    }
}
