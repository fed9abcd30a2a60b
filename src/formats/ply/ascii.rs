use super::body::Rows;
use super::header::Scalar;
use crate::formats::stream::Stream;
use crate::formats::text::{finite, integer, shown};

/// Rows of text: one line each, blank lines between them passed over.
pub(super) struct AsciiRows<'a, 'b> {
    stream: &'a mut Stream<'b>,
    /// The current line, and where in it what is left of it begins.
    row: Vec<u8>,
    at: usize,
    number: usize,
}

impl<'a, 'b> AsciiRows<'a, 'b> {
    /// The rows in a text.
    pub fn new(stream: &'a mut Stream<'b>) -> Self {
        Self { stream, row: Vec::new(), at: 0, number: 0 }
    }

    fn word(&mut self) -> Result<&[u8], String> {
        let rest = self.row[self.at..].trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at = self.row.len() - rest.len() + end;
        match &rest[..end] {
            b"" => Err("has fewer numbers than the header declares".to_owned()),
            word => Ok(word),
        }
    }
}

impl Rows for AsciiRows<'_, '_> {
    fn left(&self) -> u64 {
        self.stream.left()
    }

    fn least(&self, _: Scalar) -> usize {
        "0 ".len()
    }

    fn start_row(&mut self) -> Result<(), String> {
        while let Some(line) = self.stream.line() {
            if !line.text.trim_ascii().is_empty() {
                (self.at, self.number) = (0, line.number);
                line.text.clone_into(&mut self.row);
                return Ok(());
            }
        }
        Err("is not there: the file ends before it".to_owned())
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
        match self.row[self.at..].trim_ascii() {
            b"" => Ok(()),
            rest => Err(format!("has more numbers than the header declares: `{}`", shown(rest))),
        }
    }

    fn place(&self) -> String {
        format!(" (line {})", self.number)
    }
}
