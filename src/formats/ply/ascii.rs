use super::body::Rows;
use super::header::Scalar;
use crate::formats::text::{Lines, finite, integer, shown};

/// Rows of text: one line each, blank lines between them passed over.
pub(super) struct AsciiRows<'a> {
    lines: Lines<'a>,
    /// What is left of the current line.
    row: &'a [u8],
    number: usize,
}

impl<'a> AsciiRows<'a> {
    /// The rows in `text`, which `lines` lines come before.
    pub fn new(text: &'a [u8], lines: usize) -> Self {
        Self { lines: Lines::after(lines, text), row: b"", number: lines }
    }

    fn word(&mut self) -> Result<&'a [u8], String> {
        self.row = self.row.trim_ascii_start();
        let end = self.row.iter().position(u8::is_ascii_whitespace).unwrap_or(self.row.len());
        let (word, rest) = self.row.split_at(end);
        self.row = rest;
        if word.is_empty() { Err("has fewer numbers than the header declares".to_owned()) } else { Ok(word) }
    }
}

impl Rows for AsciiRows<'_> {
    fn left(&self) -> usize {
        self.lines.rest().len()
    }

    fn least(&self, _: Scalar) -> usize {
        "0 ".len()
    }

    fn start_row(&mut self) -> Result<(), String> {
        let line = self.lines.by_ref().find(|line| !line.text.trim_ascii().is_empty());
        let line = line.ok_or("is not there: the file ends before it")?;
        self.row = line.text;
        self.number = line.number;
        Ok(())
    }

    fn number(&mut self, _: Scalar) -> Result<f64, String> {
        let word = self.word()?;
        finite(word).ok_or_else(|| format!("holds `{}`, where a finite number must be", shown(word)))
    }

    fn any_number(&mut self, _: Scalar) -> Result<f64, String> {
        self.word().map(|word| finite(word).unwrap_or(f64::NAN))
    }

    fn integer(&mut self, _: Scalar) -> Result<i64, String> {
        let word = self.word()?;
        integer(word).ok_or_else(|| format!("holds `{}`, where an integer must be", shown(word)))
    }

    fn skip(&mut self, _: Scalar, count: u64) -> Result<(), String> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn end_row(&mut self) -> Result<(), String> {
        match self.row.trim_ascii() {
            b"" => Ok(()),
            rest => Err(format!("has more numbers than the header declares: `{}`", shown(rest))),
        }
    }

    fn place(&self) -> String {
        format!(" (line {})", self.number)
    }
}
