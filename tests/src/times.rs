//! The results of a benchmark over the real binary: median, 95th percentile and maximum.

use std::time::Duration;

/// Times of one thing that was done often.
#[derive(Debug, Default, Clone)]
pub struct Times(Vec<Duration>);

impl Times {
    /// The header of the table.
    pub const HEAD: &str = "in ms                                                               median       p95  greatest      of";

    /// One more.
    pub fn add(&mut self, time: Duration) {
        self.0.push(time);
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The time in ms that this share of them does not exceed; not a number, where there are none.
    pub fn at(&self, share: f64) -> f64 {
        let mut times = self.0.clone();
        times.sort();
        let index = ((times.len() as f64 - 1.0) * share).round() as usize;
        times.get(index).map_or(f64::NAN, |time| time.as_secs_f64() * 1e3)
    }

    /// A row of a table.
    pub fn row(&self, what: &str) -> String {
        let (median, p95, greatest) = (self.at(0.5), self.at(0.95), self.at(1.0));
        format!("{what:<64} {median:>9.2} {p95:>9.2} {greatest:>9.2} {:>7}", self.count())
    }

    /// [`Times::row`], with what the 95th percentile is to be.
    pub fn row_with_target(&self, what: &str, target: f64) -> String {
        let is_met = if self.at(0.95) <= target { "" } else { "  MISSED" };
        format!("{}   ≤ {target} ms{is_met}", self.row(what))
    }
}
