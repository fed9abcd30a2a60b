use std::ops::Range;

/// A file's bytes, some of them replaced, from its beginning to its end.
pub(super) struct Splices<'a> {
    bytes: &'a [u8],
    out: Vec<u8>,
    done: usize,
}

impl<'a> Splices<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, out: Vec::with_capacity(bytes.len()), done: 0 }
    }

    /// Puts others in the place of the bytes in `range`, which must lie behind those that were replaced before.
    pub fn replace(&mut self, range: Range<usize>, with: &[u8]) {
        self.out.extend(&self.bytes[self.done..range.start]);
        self.out.extend(with);
        self.done = range.end;
    }

    /// Puts others in the place of `part`, a slice of the bytes.
    pub fn replace_part(&mut self, part: &[u8], with: &[u8]) {
        if let Some(range) = range_in(part, self.bytes) {
            self.replace(range, with);
        }
    }

    /// The bytes with all that was replaced.
    pub fn finish(mut self) -> Vec<u8> {
        self.out.extend(&self.bytes[self.done..]);
        self.out
    }
}

/// Where `part` lies in `whole`, if it is a slice of it and not empty.
pub(super) fn range_in(part: &[u8], whole: &[u8]) -> Option<Range<usize>> {
    let start = whole.element_offset(part.first()?)?;
    Some(start..start + part.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_replaced_stays() {
        let text = b"one two three";
        let mut splices = Splices::new(text);
        splices.replace_part(&text[4..7], b"2");
        splices.replace(8..13, b"");
        assert_eq!(splices.finish(), b"one 2 ");
        assert_eq!(Splices::new(text).finish(), text);
        assert_eq!(range_in(&text[4..7], text), Some(4..7));
        assert_eq!(range_in(b"two", text), None);
    }
}
