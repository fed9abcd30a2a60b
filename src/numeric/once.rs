use std::sync::OnceLock;

/// What a cell keeps, made at its first use. It is made outside of the cell: who makes it shares work with other threads
/// and takes up theirs meanwhile, which may need the same cell and would wait for itself.
pub fn once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    match cell.get() {
        Some(kept) => kept,
        None => {
            let made = make();
            cell.get_or_init(|| made)
        }
    }
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn who_makes_it_may_need_it_meanwhile() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        for _ in 0..100 {
            let cell = OnceLock::new();
            let make = || (0..64u64).into_par_iter().map(|i| i * i).sum::<u64>();
            let all: u64 = pool.install(|| (0..64).into_par_iter().map(|_| *once(&cell, make)).sum());
            assert_eq!(all, 64 * 85_344);
        }
    }
}
