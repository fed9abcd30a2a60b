use std::ops::Deref;
use std::sync::OnceLock;

use bytes::Bytes;

/// Something that many ask for: it is put into words once, however many are told.
#[derive(Debug)]
pub struct Told<T> {
    what: T,
    words: OnceLock<Bytes>,
}

impl<T> Told<T> {
    /// Nobody has been told yet.
    pub fn new(what: T) -> Self {
        Self { what, words: OnceLock::new() }
    }

    /// The words that the first who asked had found for it.
    pub fn words(&self, find: impl FnOnce(&T) -> Vec<u8>) -> Bytes {
        self.words.get_or_init(|| find(&self.what).into()).clone()
    }
}

impl<T> Deref for Told<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.what
    }
}

impl<T: PartialEq> PartialEq for Told<T> {
    fn eq(&self, other: &Self) -> bool {
        self.what == other.what
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_once() {
        let told = Told::new(7);
        assert_eq!(told.words(|what| what.to_string().into_bytes()), "7");
        assert_eq!(told.words(|_| unreachable!("they are there")), "7");
    }
}
