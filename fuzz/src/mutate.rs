//! Cases from texts: changed bytes, words exchanged for words of a list or of other texts, lines moved, pieces of two texts joined.
//!
//! Random numbers: xorshift64* (Vigna, "An experimental exploration of Marsaglia's xorshift generators, scrambled", 2016).

/// Words that decide what the parser does, and numbers at the ends of ranges.
const WORDS: [&str; 68] = [
    "model",
    "end",
    "equation",
    "algorithm",
    "if",
    "then",
    "else",
    "elseif",
    "end if",
    "for",
    "in",
    "loop",
    "end for",
    "when",
    "end when",
    "while",
    "der",
    "pre",
    "initial",
    "connect",
    "extends",
    "redeclare",
    "replaceable",
    "constrainedby",
    "final",
    "each",
    "parameter",
    "constant",
    "inner",
    "outer",
    "input",
    "output",
    "flow",
    "Real",
    "Integer",
    "Boolean",
    "String",
    "record",
    "function",
    "package",
    "connector",
    "type",
    "import",
    "within",
    "annotation",
    "enumeration",
    "delay",
    "sample",
    "reinit",
    "assert",
    "noEvent",
    "smooth",
    "sum",
    "size",
    "0",
    "1",
    "-1",
    "1e308",
    "1e-308",
    "2147483647",
    "9223372036854775807",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ";",
];

/// A source of cases.
pub(crate) struct Source(u64);

impl Source {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// A number below `n`, 0 if there is none.
    fn below(&mut self, n: usize) -> usize {
        if n == 0 { 0 } else { (self.next() >> 33) as usize % n }
    }

    /// A text with one to eight changes.
    pub(crate) fn mutate(&mut self, texts: &[Vec<u8>]) -> Vec<u8> {
        let mut case = texts[self.below(texts.len())].clone();
        for _ in 0..1 + self.below(8) {
            self.change(&mut case, texts);
        }
        case.truncate(1 << 16);
        case
    }

    fn change(&mut self, case: &mut Vec<u8>, texts: &[Vec<u8>]) {
        let at = self.below(case.len() + 1);
        match self.below(9) {
            0 if at < case.len() => case[at] = self.next() as u8,
            1 => case.insert(at, b"()[]{};,.=:+-*/^<>\"'\\ \n0e_a"[self.below(27)]),
            2 | 3 => {
                let (start, end) = self.word(case);
                let word = WORDS[self.below(WORDS.len())];
                case.splice(start..end, word.bytes());
            }
            4 => {
                let (start, end) = self.word(case);
                let other = &texts[self.below(texts.len())];
                let (from, to) = self.word(other);
                case.splice(start..end, other[from..to].iter().copied());
            }
            5 => {
                let (start, end) = self.line(case);
                case.drain(start..end);
            }
            6 => {
                let (start, end) = self.line(case);
                let line = case[start..end].to_vec();
                let (to, _) = self.line(case);
                case.splice(to..to, line);
            }
            7 => {
                let other = &texts[self.below(texts.len())];
                let (from, to) = self.line(other);
                let (at, _) = self.line(case);
                case.splice(at..at, other[from..to].iter().copied());
            }
            _ => {
                let length = self.below(case.len() - at.min(case.len()) + 1).min(64);
                case.drain(at..at + length);
            }
        }
    }

    /// A word, a number or a sign.
    fn word(&mut self, text: &[u8]) -> (usize, usize) {
        let at = self.below(text.len());
        let inside = |k: usize| text.get(k).is_some_and(|b| b.is_ascii_alphanumeric() || *b == b'_');
        let (mut start, mut end) = (at, (at + 1).min(text.len()));
        while inside(at) && start > 0 && inside(start - 1) {
            start -= 1;
        }
        while inside(at) && inside(end) {
            end += 1;
        }
        (start, end)
    }

    fn line(&mut self, text: &[u8]) -> (usize, usize) {
        let at = self.below(text.len());
        let start = text[..at].iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
        let end = text[at..].iter().position(|b| *b == b'\n').map_or(text.len(), |k| at + k + 1);
        (start, end)
    }
}
