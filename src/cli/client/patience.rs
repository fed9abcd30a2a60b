use std::time::{Duration, Instant};

use super::failure::Failure;

const FIRST_PAUSE: Duration = Duration::from_millis(200);
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// How long is tried again what fails for now.
#[derive(Debug, Clone, Copy)]
pub struct Patience(pub Duration);

/// The pauses between tries, each twice as long as the one before, until patience is at its end.
#[derive(Debug)]
pub struct Pauses {
    until: Instant,
    next: Duration,
}

impl Patience {
    /// Pauses from now on.
    pub fn pauses(self) -> Pauses {
        Pauses { until: Instant::now() + self.0, next: FIRST_PAUSE }
    }

    /// Tries until it does, until it fails for good, or until patience is at its end.
    ///
    /// # Errors
    /// The last [`Failure`].
    pub fn persist<T>(self, mut attempt: impl FnMut() -> Result<T, Failure>) -> Result<T, Failure> {
        let mut pauses = self.pauses();
        loop {
            match attempt() {
                Err(failure) if failure.passes() => pauses.rest(failure)?,
                outcome => return outcome,
            }
        }
    }
}

impl Pauses {
    /// Waits after a failure before the next try.
    ///
    /// # Errors
    /// The failure itself, if there is no time left.
    pub fn rest(&mut self, failure: Failure) -> Result<(), Failure> {
        let left = self.until.saturating_duration_since(Instant::now());
        let pause = failure.retry_after().unwrap_or_default().max(self.next);
        if left.is_zero() || failure.retry_after().is_some_and(|asked| asked > left) {
            return Err(failure);
        }
        std::thread::sleep(pause.min(left));
        self.next = (2 * self.next).min(LONGEST_PAUSE);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn broken() -> Failure {
        Failure::Connection("reset".into())
    }

    #[test]
    fn what_fails_for_now_is_tried_again() {
        let mut tries = 0;
        let outcome = Patience(Duration::from_secs(60)).persist(|| {
            tries += 1;
            if tries < 3 { Err(broken()) } else { Ok(tries) }
        });
        assert_eq!(outcome.unwrap(), 3);
    }

    #[test]
    fn what_fails_for_good_is_not() {
        let mut tries = 0;
        let outcome = Patience(Duration::from_secs(60)).persist(|| -> Result<(), Failure> {
            tries += 1;
            Err(Failure::Odd("a page".into()))
        });
        assert!(outcome.is_err() && tries == 1);
    }

    #[test]
    fn patience_ends() {
        let start = Instant::now();
        assert!(Patience(Duration::from_millis(300)).persist(|| Err::<(), _>(broken())).is_err());
        assert!(Patience(Duration::ZERO).persist(|| Err::<(), _>(broken())).is_err());
        assert!(start.elapsed() < Duration::from_secs(5));
    }
}
