//! Bytes of a CSV text whose lines are bounded, so that a file without ends of lines is refused before it fills the memory.

use std::io::{self, ErrorKind, Read};

/// Longest line (bytes): thrice what the names of as many variables take as a model may have.
const LONGEST: u64 = 256 << 20;
/// Most fields of a line: twice as many variables as a model may have.
const MOST_FIELDS: u64 = 1 << 22;

/// Passes bytes on until a line is too long.
pub(crate) struct LineLimit<R> {
    source: R,
    line: u64,
    bytes: u64,
    separators: u64,
    /// Within quotes an end of a line ends nothing.
    quoted: bool,
}

impl<R> LineLimit<R> {
    pub(crate) fn new(source: R) -> Self {
        Self { source, line: 1, bytes: 0, separators: 0, quoted: false }
    }

    fn count(&mut self, bytes: &[u8]) -> io::Result<()> {
        for &byte in bytes {
            self.bytes += 1;
            match byte {
                b'"' => self.quoted = !self.quoted,
                b',' if !self.quoted => self.separators += 1,
                b'\n' => {
                    self.line += 1;
                    if !self.quoted {
                        (self.bytes, self.separators) = (0, 0);
                    }
                }
                _ => {}
            }
            if self.separators >= MOST_FIELDS {
                let sentence = format!("line {} has more than {MOST_FIELDS} fields", self.line);
                return Err(io::Error::new(ErrorKind::InvalidData, sentence));
            }
            if self.bytes > LONGEST {
                let sentence = format!("line {} is longer than {} MB", self.line, LONGEST >> 20);
                return Err(io::Error::new(ErrorKind::InvalidData, sentence));
            }
        }
        Ok(())
    }
}

impl<R: Read> Read for LineLimit<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.count(&buffer[..count])?;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, repeat};

    use super::LineLimit;

    #[test]
    fn endless_lines_end_in_a_sentence() {
        let said = |source: &mut dyn Read| {
            std::io::copy(&mut LineLimit::new(source), &mut std::io::sink()).map_err(|error| error.to_string())
        };
        assert_eq!(said(&mut "a,b\n".as_bytes().chain(repeat(b'x'))), Err("line 2 is longer than 256 MB".into()));
        assert_eq!(
            said(&mut "a\n\n".as_bytes().chain(repeat(b','))),
            Err("line 3 has more than 4194304 fields".into())
        );
        // What is quoted goes over ends of lines.
        let quoted = |end: &'static str| "a\n\"b".as_bytes().chain(repeat(b'\n').take(300 << 20)).chain(end.as_bytes());
        assert!(said(&mut quoted("\"")).is_err_and(|said| said.ends_with("is longer than 256 MB")));
        // Lines as such may be many, and commas within quotes separate nothing.
        assert_eq!(said(&mut repeat(b'\n').take(300 << 20)), Ok(300 << 20));
        let commas = "\"".as_bytes().chain(repeat(b',').take(5 << 20)).chain("\"\n".as_bytes());
        assert_eq!(said(&mut { commas }), Ok((5 << 20) + 3));
    }
}
