use std::borrow::Cow;
use std::io::{self, Read};

use super::text::{Line, line_end};

/// Bytes that are asked for at once.
const WINDOW: usize = 1 << 18;

/// A file's bytes in their order, a few of them in memory at a time; of bytes that are there already, all.
pub(super) struct Stream<'a> {
    input: Box<dyn Read + 'a>,
    /// Bytes that the input has not given yet.
    beyond: u64,
    window: Cow<'a, [u8]>,
    /// Where in the window the next byte is.
    at: usize,
    lines: usize,
    error: Option<io::Error>,
}

impl<'a> Stream<'a> {
    /// The `length` bytes that `input` gives; fewer if it ends before or fails, which [`error`](Self::error) then tells.
    pub fn new(input: impl Read + 'a, length: u64) -> Self {
        let window = Cow::Owned(Vec::new());
        Self { input: Box::new(input), beyond: length, window, at: 0, lines: 0, error: None }
    }

    /// Bytes that are there.
    pub fn of(bytes: &'a [u8]) -> Self {
        Self { window: Cow::Borrowed(bytes), ..Self::new(io::empty(), 0) }
    }

    /// Why the input failed, if it did.
    pub fn error(&mut self) -> Option<io::Error> {
        self.error.take()
    }

    /// Bytes not read yet.
    pub fn left(&self) -> u64 {
        self.here().len() as u64 + self.beyond
    }

    /// The bytes that come next, 256 KiB of them or as many as are left; they are not read by this.
    pub fn beginning(&mut self) -> &[u8] {
        self.fill(WINDOW);
        self.here()
    }

    /// The next `N` bytes, unless fewer are left.
    #[inline]
    pub fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        if self.here().len() < N {
            self.fill(N);
        }
        let bytes = *self.here().first_chunk::<N>()?;
        self.at += N;
        Some(bytes)
    }

    /// Passes over `count` bytes; over none, which `false` tells, where fewer are left.
    pub fn skip(&mut self, count: u64) -> bool {
        if count > self.left() {
            return false;
        }
        let mut left = count;
        loop {
            let step = left.min(self.here().len() as u64);
            self.at += step as usize;
            left -= step;
            if left == 0 {
                return true;
            }
            if !self.more() {
                return false;
            }
        }
    }

    /// Passes over the byte order mark that some editors put before a text.
    pub fn skip_mark(&mut self) {
        self.fill(3);
        self.at = self.window.len() - super::text::without_mark(self.here()).len();
    }

    /// The next line, which LF, CR LF or CR end.
    pub fn line(&mut self) -> Option<Line<'_>> {
        self.line_or_more(false)
    }

    /// The next line; one that ends in a backslash goes on in the one after it, backslash and line end within its text.
    pub fn continued_line(&mut self) -> Option<Line<'_>> {
        self.line_or_more(true)
    }

    /// All bytes not read yet.
    pub fn rest(&mut self) -> Cow<'_, [u8]> {
        while self.more() {}
        Cow::Borrowed(self.here())
    }

    fn line_or_more(&mut self, continued: bool) -> Option<Line<'_>> {
        if self.here().is_empty() && !self.more() {
            return None;
        }
        let number = self.lines + 1;
        let mut from = 0;
        let (text_end, next) = loop {
            let (text_end, next) = self.line_end(from);
            self.lines += 1;
            let goes_on = continued && self.here()[..text_end].ends_with(b"\\") && next < self.here().len();
            if !goes_on {
                break (text_end, next);
            }
            from = next;
        };
        let text = self.at..self.at + text_end;
        self.at += next;
        Some(Line { number, text: &self.window[text] })
    }

    /// Where the line that `from` is in ends, and where the next one begins, counted from the next byte.
    fn line_end(&mut self, mut from: usize) -> (usize, usize) {
        loop {
            let (end, next) = line_end(self.here(), from);
            // What ends with the window may go on behind it, a CR with its LF.
            if next < self.here().len() || !self.more() {
                return (end, next);
            }
            from = end;
        }
    }

    fn here(&self) -> &[u8] {
        &self.window[self.at..]
    }

    /// Has `count` bytes or all that are left in the window.
    #[cold]
    fn fill(&mut self, count: usize) {
        while self.here().len() < count && self.more() {}
    }

    /// Has more bytes in the window than before, unless there are none.
    fn more(&mut self) -> bool {
        if self.beyond == 0 {
            return false;
        }
        let window = self.window.to_mut();
        window.drain(..self.at);
        self.at = 0;
        let most = self.beyond.min(WINDOW as u64);
        window.reserve(most as usize);
        let read = (&mut self.input).take(most).read_to_end(window);
        let read = read.unwrap_or_else(|error| {
            self.error = Some(error);
            0
        });
        self.beyond = if read == 0 { 0 } else { self.beyond - read as u64 };
        read > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives its bytes one by one.
    struct Trickle<'a>(&'a [u8]);

    impl Read for Trickle<'_> {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            let count = out.len().min(1);
            self.0.read(&mut out[..count])
        }
    }

    fn both(bytes: &[u8]) -> [Stream<'_>; 2] {
        [Stream::of(bytes), Stream::new(Trickle(bytes), bytes.len() as u64)]
    }

    fn texts(mut stream: Stream, continued: bool) -> Vec<(usize, String)> {
        let mut all = Vec::new();
        while let Some(line) = if continued { stream.continued_line() } else { stream.line() } {
            all.push((line.number, String::from_utf8_lossy(line.text).into_owned()));
        }
        all
    }

    fn numbered(expected: &[(usize, &str)]) -> Vec<(usize, String)> {
        expected.iter().map(|&(number, text)| (number, text.to_owned())).collect()
    }

    #[test]
    fn lines_end_and_go_on_as_those_of_a_whole_text() {
        for stream in both(b"a\r\nb\rc\n\nd") {
            let expected = numbered(&[(1, "a"), (2, "b"), (3, "c"), (4, ""), (5, "d")]);
            assert_eq!(texts(stream, false), expected);
        }
        for stream in both(b"f 1 \\\r\n2 3\ng\\") {
            assert_eq!(texts(stream, true), numbered(&[(1, "f 1 \\\r\n2 3"), (3, "g\\")]));
        }
    }

    #[test]
    fn lines_may_lie_across_windows_and_be_longer_than_one() {
        for length in [WINDOW - 2, WINDOW - 1, WINDOW, 3 * WINDOW] {
            let first = "x".repeat(length);
            let text = format!("{first}\r\nlast\r");
            let stream = Stream::new(text.as_bytes(), text.len() as u64);
            assert_eq!(texts(stream, false), [(1, first), (2, "last".to_owned())]);
        }
    }

    #[test]
    fn bytes_come_in_order_and_only_as_many_as_there_are() {
        let bytes: Vec<u8> = (0..600_000).map(|i| i as u8).collect();
        for mut stream in [Stream::of(&bytes), Stream::new(&bytes[..], bytes.len() as u64)] {
            assert_eq!(stream.beginning()[..3], [0, 1, 2]);
            assert_eq!(stream.take(), Some([0, 1, 2]));
            assert!(stream.skip(500_000));
            assert_eq!((stream.left(), stream.take()), (99_997, Some([bytes[500_003]])));
            assert!(!stream.skip(99_997));
            assert_eq!(*stream.rest(), bytes[500_004..]);
            assert!(stream.skip(99_995));
            assert_eq!((stream.take::<2>(), stream.left()), (None, 1));
        }
    }

    #[test]
    fn an_input_that_fails_or_ends_early_ends_the_stream() {
        let mut short = Stream::new(&b"ab"[..], 5);
        assert_eq!((short.left(), short.take::<3>(), short.left()), (5, None, 2));
        assert!(short.error().is_none());
        struct Broken;
        impl Read for Broken {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("broken"))
            }
        }
        let mut broken = Stream::new(Broken, 5);
        assert!(broken.line().is_none());
        assert_eq!(broken.error().unwrap().to_string(), "broken");
    }
}
