use std::num::NonZeroU32;

use governor::clock::{Clock, DefaultClock};
use governor::{DefaultKeyedRateLimiter, Quota, RateLimiter};

use super::config::RequestLimits;
use super::problem::{Kind, Problem};

/// Clients that are remembered before those that are quiet are forgotten.
const REMEMBERED: usize = 10_000;

/// How often each client may ask.
pub struct RateLimits(DefaultKeyedRateLimiter<String>);

impl RateLimits {
    /// By these limits, each at least one.
    pub fn new(limits: &RequestLimits) -> Self {
        let at_least_one = |count| NonZeroU32::new(count).unwrap_or(NonZeroU32::MIN);
        let quota =
            Quota::per_second(at_least_one(limits.per_second)).allow_burst(at_least_one(limits.burst));
        Self(RateLimiter::keyed(quota))
    }

    /// Counts a request of a client: its key's id, or its address.
    ///
    /// # Errors
    /// A [`Problem`] that says when to come back.
    pub fn count(&self, client: &str) -> Result<(), Problem> {
        if self.0.len() > REMEMBERED {
            self.0.retain_recent();
        }
        self.0.check_key(&client.to_owned()).map_err(|not_until| {
            let wait = not_until.wait_time_from(DefaultClock::default().now());
            Problem::new(Kind::TooManyRequests, "more requests a second than are taken")
                .remedied("wait as long as Retry-After says, and ask less often: events come by themselves")
                .retry_after(wait.as_secs() + 1)
        })
    }
}
