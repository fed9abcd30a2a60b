//! Lines and words of text formats, as bytes: names and comments in them need not be UTF-8.

/// One line of a text, without its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line<'a> {
    /// Counted from 1.
    pub number: usize,
    pub text: &'a [u8],
}

/// The lines of a text, each ended by LF, CR LF or CR.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
    continued: bool,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self { rest: text, number: 0, continued: false }
    }

    /// A line that ends in a backslash goes on in the next one; the backslash and the line end stay in its text.
    pub fn continued(text: &'a [u8]) -> Self {
        Self { continued: true, ..Self::new(text) }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        if self.rest.is_empty() {
            return None;
        }
        let number = self.number + 1;
        let mut end = 0;
        loop {
            let (text_end, next) = line_end(self.rest, end);
            self.number += 1;
            end = next;
            let goes_on = self.continued && self.rest[..text_end].ends_with(b"\\") && next < self.rest.len();
            if !goes_on {
                let line = Line { number, text: &self.rest[..text_end] };
                self.rest = &self.rest[end..];
                return Some(line);
            }
        }
    }
}

/// Where the line that `from` is in ends, and where the next one begins.
pub(super) fn line_end(text: &[u8], from: usize) -> (usize, usize) {
    let length = text[from..].iter().position(|&b| b == b'\n' || b == b'\r');
    let end = from + length.unwrap_or(text.len() - from);
    let next = match &text[end..] {
        [b'\r', b'\n', ..] => end + 2,
        [] => end,
        _ => end + 1,
    };
    (end, next)
}

/// A text without the byte order mark that some editors put before it.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text)
}

/// The words of a line; backslashes that continue it count as blanks.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|&b| b.is_ascii_whitespace() || b == b'\\').filter(|word| !word.is_empty())
}

/// The finite number that a word spells.
pub(super) fn finite(word: &[u8]) -> Option<f64> {
    let number: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    number.is_finite().then_some(number)
}

/// The integer that a word spells.
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0i64;
    for &digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        value = value.checked_mul(10)?.checked_add(i64::from(digit - b'0'))?;
    }
    Some(if negative { -value } else { value })
}

/// The beginning of some bytes as they may stand in a message: a few, printable, on one line.
pub(super) fn shown(bytes: &[u8]) -> String {
    const MOST: usize = 40;
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(MOST)]);
    let printable = start.chars().map(|c| if c.is_control() { '.' } else { c });
    let ellipsis = if bytes.len() > MOST { "..." } else { "" };
    printable.chain(ellipsis.chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(lines: Lines) -> Vec<(usize, String)> {
        lines.map(|line| (line.number, String::from_utf8_lossy(line.text).into_owned())).collect()
    }

    fn numbered(expected: &[(usize, &str)]) -> Vec<(usize, String)> {
        expected.iter().map(|&(number, text)| (number, text.to_owned())).collect()
    }

    #[test]
    fn every_line_end_counts_once() {
        let lines = texts(Lines::new(b"a\r\nb\rc\n\nd"));
        assert_eq!(lines, numbered(&[(1, "a"), (2, "b"), (3, "c"), (4, ""), (5, "d")]));
    }

    #[test]
    fn a_backslash_continues_a_line() {
        let text = b"f 1 \\\r\n2 3\ng\\";
        assert_eq!(texts(Lines::continued(text)), numbered(&[(1, "f 1 \\\r\n2 3"), (3, "g\\")]));
        let joined: Vec<_> = words(b"f 1 \\\r\n2 3").collect();
        assert_eq!(joined, [&b"f"[..], b"1", b"2", b"3"]);
    }

    #[test]
    fn numbers_are_finite_and_integers_whole() {
        assert_eq!(finite(b"-1.5e3"), Some(-1500.0));
        assert!([&b"nan"[..], b"inf", b"1e999", b"", b"\xff"].iter().all(|word| finite(word).is_none()));
        assert_eq!(integer(b"-12"), Some(-12));
        assert!([&b""[..], b"-", b"1.0", b"99999999999999999999"].iter().all(|word| integer(word).is_none()));
    }
}
