//! Damaged files, the same ones on every run.

/// Calls `read` with every beginning of `file` and with `rounds` damaged copies.
pub fn damage(file: &[u8], rounds: u64, mut read: impl FnMut(&[u8])) {
    (0..file.len()).for_each(|end| read(&file[..end]));
    for round in 0..rounds {
        let mut random = Random(round.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let mut copy = file.to_vec();
        for _ in 0..=random.below(3) {
            strike(&mut copy, &mut random);
        }
        read(&copy);
    }
}

/// What breaks readers: the ends of integer ranges, numbers that are none, brackets and blanks out of place.
const WORDS: [&[u8]; 16] = [
    b"0",
    b"-1",
    b"4294967295",
    b"18446744073709551615",
    b"-9223372036854775808",
    b"1e999",
    b"nan",
    b"null",
    b"[",
    b"}",
    b"\n",
    b" ",
    b"\\\n",
    b"\xff\xff\xff\xff",
    b"\0\0\0\x80",
    b"\0\0\xc0\x7f",
];

fn strike(copy: &mut Vec<u8>, random: &mut Random) {
    if copy.is_empty() {
        return;
    }
    let at = random.below(copy.len());
    let end = (at + random.below(9)).min(copy.len());
    match random.below(7) {
        0 => copy[at] ^= 1 << random.below(8),
        1 => copy[at] = random.below(256) as u8,
        2 => drop(copy.drain(at..end)),
        3 => drop(copy.splice(at..end, WORDS[random.below(WORDS.len())].iter().copied())),
        4 => copy.splice(at..at, copy[at..end].to_vec()).for_each(drop),
        5 => replace_number(copy, at, WORDS[random.below(7)]),
        _ => {
            let from = random.below(copy.len());
            copy.swap(at, from);
        }
    }
}

/// Replaces the first run of digits at or after `at`.
fn replace_number(copy: &mut Vec<u8>, at: usize, word: &[u8]) {
    let Some(start) = copy[at..].iter().position(u8::is_ascii_digit).map(|found| at + found) else { return };
    let length = copy[start..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    drop(copy.splice(start..start + length, word.iter().copied()));
}

/// Xorshift64: enough to strike anywhere.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}
