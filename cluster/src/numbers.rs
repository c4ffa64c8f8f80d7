//! Numbers of tasks as the engines write them: `0-3,7`.

/// The ranges of ascending numbers.
pub(crate) fn ranges(numbers: &[usize]) -> String {
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => ranges.push((number, number)),
        }
    }
    let text = |&(first, last): &(usize, usize)| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    };
    ranges.iter().map(text).collect::<Vec<_>>().join(",")
}

/// The numbers of a list of ranges; none where it is not one.
pub(crate) fn numbers(ranges: &str) -> Option<Vec<usize>> {
    let mut list = Vec::new();
    for range in ranges.split(',').map(str::trim).filter(|range| !range.is_empty()) {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        list.extend(first.parse::<usize>().ok()?..=last.parse::<usize>().ok()?);
    }
    Some(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_a_range() {
        let list = [0, 1, 2, 3, 7, 9, 10];
        assert_eq!(ranges(&list), "0-3,7,9-10");
        assert_eq!(numbers("0-3, 7,9-10"), Some(list.to_vec()));
        assert_eq!((ranges(&[]), numbers("")), (String::new(), Some(Vec::new())));
        assert_eq!(numbers("1:2"), None);
    }
}
