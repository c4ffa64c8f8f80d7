//! Values to the pages of a Parquet file, compressed by zstd.
//!
//! A column chunk is one page or a few, each with a header of its own: a structure of Apache Thrift's compact protocol, of which
//! only integers are needed.  Numbers are written as byte-stream split: first the lowest bytes of all values, then the next ones,
//! and so on, so that signs and exponents, which hardly change from row to row, stand together.  Columns are required, so pages
//! hold values and nothing else.
//! Source: Apache Parquet, "File format" (parquet.thrift, Encodings.md, Compression.md); Apache Thrift, "Compact protocol".

use std::io;

use zstd::bulk::Compressor;

use crate::Cells;

/// Level of compression: level 1 makes pages of runs no smaller and takes up to twice as long, level 3 saves half a percent for
/// four times as long.
const LEVEL: i32 = -1;
/// Most values of a page.
const VALUES: usize = 1 << 17;
/// Bytes of a page of texts after which another one begins.
const TEXT_BYTES: usize = 1 << 20;

/// A chunk of no more bytes is not compressed: a few numbers become hardly smaller, and take microseconds on the way in and out, which
/// adds up where sweeps write some of many columns at a time.
const FEW_BYTES: usize = 256;

/// Encodings as their numbers stand in headers.
const PLAIN: i32 = 0;
const LEVELS: i32 = 3;
const BYTE_STREAM_SPLIT: i32 = 9;

/// Types of fields in the compact protocol.
const INTEGER: u8 = 5;
const STRUCTURE: u8 = 12;

/// Pages of one column chunk.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Size {
    /// Bytes in the file.
    pub(crate) compressed: u64,
    /// Bytes before compression.
    pub(crate) plain: u64,
    /// It is not compressed.
    pub(crate) is_plain: bool,
}

/// Encodes chunks one after the other.
pub(crate) struct PageEncoder {
    compressor: Compressor<'static>,
    plain: Vec<u8>,
    compressed: Vec<u8>,
}

impl PageEncoder {
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self { compressor: Compressor::new(LEVEL)?, plain: Vec::new(), compressed: Vec::new() })
    }

    /// Appends the pages of a chunk.
    pub(crate) fn cells(&mut self, cells: &Cells, out: &mut Vec<u8>) -> io::Result<Size> {
        match cells {
            Cells::Numbers(values) => self.numbers(values, out),
            Cells::Wholes(values) => self.wholes(values, out),
            Cells::Texts(values) => self.texts(values, out),
        }
    }

    /// The same for numbers.
    pub(crate) fn numbers(&mut self, values: &[f64], out: &mut Vec<u8>) -> io::Result<Size> {
        let mut size = Size::default();
        for values in values.chunks(VALUES) {
            self.plain.resize(8 * values.len(), 0);
            split_bytes(values, &mut self.plain);
            self.page(values.len(), BYTE_STREAM_SPLIT, out, &mut size)?;
        }
        Ok(size)
    }

    fn wholes(&mut self, values: &[i64], out: &mut Vec<u8>) -> io::Result<Size> {
        let mut size = Size::default();
        for values in values.chunks(VALUES) {
            self.plain.clear();
            self.plain.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            self.page(values.len(), PLAIN, out, &mut size)?;
        }
        Ok(size)
    }

    fn texts(&mut self, values: &[String], out: &mut Vec<u8>) -> io::Result<Size> {
        let (mut size, mut count) = (Size::default(), 0);
        self.plain.clear();
        for (k, text) in values.iter().enumerate() {
            let length = u32::try_from(text.len()).map_err(|_| io::Error::other("a text is too long"))?;
            self.plain.extend_from_slice(&length.to_le_bytes());
            self.plain.extend_from_slice(text.as_bytes());
            count += 1;
            if self.plain.len() >= TEXT_BYTES || k + 1 == values.len() {
                self.page(count, PLAIN, out, &mut size)?;
                self.plain.clear();
                count = 0;
            }
        }
        Ok(size)
    }

    /// Header and compressed bytes of what stands in `plain`.
    fn page(&mut self, values: usize, encoding: i32, out: &mut Vec<u8>, size: &mut Size) -> io::Result<()> {
        // Only a chunk of one page has so small a first one.
        let is_first = size.plain == 0;
        size.is_plain |= is_first && self.plain.len() <= FEW_BYTES;
        if !size.is_plain {
            self.compressed.clear();
            self.compressed.reserve(zstd::zstd_safe::compress_bound(self.plain.len()));
            self.compressor.compress_to_buffer(&self.plain, &mut self.compressed)?;
        }
        let bytes = if size.is_plain { &self.plain } else { &self.compressed };
        let begin = out.len();
        header([self.plain.len(), bytes.len(), values], encoding, out)?;
        let head = out.len() - begin;
        out.extend_from_slice(bytes);
        size.compressed += (head + bytes.len()) as u64;
        size.plain += (head + self.plain.len()) as u64;
        Ok(())
    }
}

/// The lowest bytes of all values, then the next ones, up to the highest.
fn split_bytes(values: &[f64], out: &mut [u8]) {
    for (place, stream) in out.chunks_exact_mut(values.len()).enumerate() {
        for (byte, value) in stream.iter_mut().zip(values) {
            *byte = (value.to_bits() >> (8 * place)) as u8;
        }
    }
}

/// `PageHeader` of a data page: sizes before and after compression, number of values.
fn header([plain, compressed, values]: [usize; 3], encoding: i32, out: &mut Vec<u8>) -> io::Result<()> {
    let number = |value: usize| i32::try_from(value).map_err(|_| io::Error::other("a page is too large"));
    // Each field: how far its number lies after the one before, its type, its value.
    integer(1, 0, out);
    integer(1, number(plain)?, out);
    integer(1, number(compressed)?, out);
    out.push(2 << 4 | STRUCTURE);
    integer(1, number(values)?, out);
    integer(1, encoding, out);
    integer(1, LEVELS, out);
    integer(1, LEVELS, out);
    // The ends of both structures.
    out.extend_from_slice(&[0, 0]);
    Ok(())
}

/// A field with an integer: zigzag, seven bits to a byte.
fn integer(step: u8, value: i32, out: &mut Vec<u8>) {
    out.push(step << 4 | INTEGER);
    let mut rest = ((value << 1) ^ (value >> 31)).cast_unsigned();
    while rest >= 0x80 {
        out.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    out.push(rest as u8);
}
