use std::time::{Duration, Instant};

/// Times work again and again and prints the medians as rows of a markdown table.
pub struct Clock {
    /// Runs of a stage.
    repetitions: usize,
}

impl Clock {
    /// A clock that runs stages this often.
    pub fn new(repetitions: usize) -> Self {
        Self { repetitions: repetitions.max(1) }
    }

    /// Runs of what takes tenths of a second.
    pub fn runs(&self) -> usize {
        4 * self.repetitions
    }

    /// Prints the table's head.
    pub fn head(&self) {
        say!("| what | median | fastest | runs |\n|---|---:|---:|---:|");
    }

    /// Times a stage of seconds, after one run that fills caches.
    pub fn stage(&self, what: &str, mut work: impl FnMut() -> anyhow::Result<()>) -> anyhow::Result<()> {
        work()?;
        let mut times = Vec::with_capacity(self.repetitions);
        for _ in 0..self.repetitions {
            let start = Instant::now();
            work()?;
            times.push(start.elapsed());
        }
        row(what, &times);
        Ok(())
    }

    /// Times a kernel of less than a second, some twenty times as often as a stage.
    pub fn kernel(&self, what: &str, mut work: impl FnMut()) {
        self.kernel_each(what, 1, &mut work);
    }

    /// Times a kernel that does `count` things and tells of one.
    pub fn kernel_each(&self, what: &str, count: u32, work: &mut impl FnMut()) {
        work();
        let times = (0..20 * self.repetitions).map(|_| {
            let start = Instant::now();
            work();
            start.elapsed() / count
        });
        row(what, &times.collect::<Vec<_>>());
    }
}

/// Prints one row.
pub fn row(what: &str, times: &[Duration]) {
    let fastest = times.iter().min().copied().unwrap_or_default();
    say!("| {what} | {} | {} | {} |", shown(median(times)), shown(fastest), times.len());
}

/// The median; of an even number, the longer one in the middle.
pub fn median(times: &[Duration]) -> Duration {
    let mut times = times.to_vec();
    times.sort_unstable();
    times.get(times.len() / 2).copied().unwrap_or_default()
}

fn shown(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        1.0.. => format!("{seconds:.2} s"),
        1e-3.. => format!("{:.3} ms", seconds * 1e3),
        _ => format!("{:.3} us", seconds * 1e6),
    }
}
