//! Lines of a stream, each a message: cut at a length that no message needs, whatever bytes they hold.

use std::io::{self, BufRead, Read};

/// Bytes of the longest line that is taken.
pub(crate) const LONGEST: u64 = 16 << 20;

/// What a stream has next.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Line {
    /// A line without its end.
    Whole(Vec<u8>),
    /// One that was too long and is skipped.
    TooLong,
    /// Nothing more.
    End,
}

/// The next line.  A stream that cannot be read has ended.
pub(crate) fn next(stream: &mut impl BufRead) -> Line {
    let mut line = Vec::new();
    match stream.by_ref().take(LONGEST).read_until(b'\n', &mut line) {
        Ok(0) | Err(_) => return Line::End,
        Ok(_) => {}
    }
    if line.last() == Some(&b'\n') {
        line.pop();
        return Line::Whole(line);
    }
    if (line.len() as u64) < LONGEST {
        // The last line of a stream may lack its end.
        return Line::Whole(line);
    }
    if skip(stream).is_ok() { Line::TooLong } else { Line::End }
}

/// Passes over the rest of a line.
fn skip(stream: &mut impl BufRead) -> io::Result<()> {
    loop {
        let rest = stream.fill_buf()?;
        let (length, is_end) = match rest.iter().position(|byte| *byte == b'\n') {
            Some(at) => (at + 1, true),
            None => (rest.len(), rest.is_empty()),
        };
        stream.consume(length);
        if is_end {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_where_they_end() {
        let mut stream: &[u8] = b"one\n\n\xff\nlast";
        let lines: Vec<Line> =
            std::iter::from_fn(|| Some(next(&mut stream)).filter(|line| *line != Line::End)).collect();
        assert_eq!(lines, [&b"one"[..], b"", b"\xff", b"last"].map(|line| Line::Whole(line.to_vec())));
    }

    #[test]
    fn a_line_without_end_is_passed_over() {
        let mut text = vec![b'x'; LONGEST as usize + 7];
        text.extend(b"\nnext\n");
        let mut stream = text.as_slice();
        assert_eq!(next(&mut stream), Line::TooLong);
        assert_eq!(next(&mut stream), Line::Whole(b"next".to_vec()));
        assert_eq!(next(&mut stream), Line::End);
    }
}
