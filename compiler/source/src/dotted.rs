//! The parts of a full name.

/// Parts between dots; a dot within a quoted identifier (`'a.b'`) belongs to it.
///
/// ```
/// let parts: Vec<&str> = hyd_source::dotted("P.'a.b'.C").collect();
/// assert_eq!(parts, ["P", "'a.b'", "C"]);
/// ```
pub fn dotted(name: &str) -> impl Iterator<Item = &str> {
    let (mut within, mut escaped) = (false, false);
    name.split(move |c| {
        let is_dot = c == '.' && !within;
        within ^= c == '\'' && !escaped;
        escaped = c == '\\' && !escaped;
        is_dot
    })
}
