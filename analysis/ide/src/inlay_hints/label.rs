//! The texts of hints: short enough for an editor that is split in two.

use mauve_timing::{Time, Unit};

/// The maximum length of a hint, in characters.
pub(crate) const MOST_CHARACTERS: usize = 32;

/// The columns that an editor shows on a small screen, beside its lists of files and its map. Editors that know better choose among
/// the texts themselves.
const COLUMNS: usize = 105;

/// The maximum length of a hint on a line that leaves no more room.
const LEAST_ROOM: usize = 18;

/// Returns the maximum length of a hint that begins at this column.
pub(super) fn most_at(column: usize) -> usize {
    COLUMNS.saturating_sub(column).clamp(LEAST_ROOM, MOST_CHARACTERS)
}

/// Texts that say the same in fewer and fewer words, each of at most [`MOST_CHARACTERS`].
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Texts(Vec<String>);

impl Texts {
    /// Returns those of `texts` that are short enough; if there is none, the last one without its end.
    ///
    /// ```text
    /// Texts::of(["47 ms slack · 53 ms", "47 ms slack", "+47 ms"]).within(15) = "47 ms slack"
    /// ```
    pub(super) fn of(texts: impl IntoIterator<Item = String>) -> Texts {
        let mut texts: Vec<String> = texts.into_iter().collect();
        let last = texts.last().map(|last| cut(last, MOST_CHARACTERS));
        texts.retain(|text| text.chars().count() <= MOST_CHARACTERS);
        if texts.is_empty() {
            texts.extend(last);
        }
        texts.dedup();
        Texts(texts)
    }

    /// Returns the first text of at most `room` characters, otherwise the last one.
    pub(super) fn within(&self, room: usize) -> &str {
        let fits = self.0.iter().find(|text| text.chars().count() <= room);
        fits.or(self.0.last()).map_or("", String::as_str)
    }

    pub(super) fn into_all(self) -> Vec<String> {
        self.0
    }
}

/// Returns a text of at most `most` characters: itself, or its beginning and `…`.
pub(super) fn cut(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let beginning: String = text.chars().take(most.saturating_sub(1)).collect();
    format!("{}…", beginning.trim_end())
}

/// The direction in which a time is rounded that is too long for a hint.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Round {
    /// For response and execution times.
    Up,
    /// For slack.
    Down,
}

/// Returns a time with at most six digits: `53 ms`, `991.4 ms`, `1234.56 ms`, `98765.5 s`. Longer ones are rounded.
pub(super) fn short(time: Time, round: Round) -> String {
    let exact = time.number();
    if exact.chars().filter(char::is_ascii_digit).count() <= 6 {
        return format!("{exact} ms");
    }
    let nanos = time.as_nanos();
    let unit = if nanos < 1_000_000 * 1_000_000 { Unit::Milliseconds } else { Unit::Seconds };
    // Six significant digits are left.
    let digits = nanos.checked_ilog10().unwrap_or_default();
    let step = 10u64.pow(digits.saturating_sub(5));
    let rounded = match round {
        Round::Up => nanos.div_ceil(step).checked_mul(step).unwrap_or(nanos),
        Round::Down => nanos / step * step,
    };
    format!("{} {unit}", Time::from_nanos(rounded).number_in(unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_times_are_rounded_to_the_safe_side() {
        let both = |nanos: u64| {
            let time = Time::from_nanos(nanos);
            (short(time, Round::Up), short(time, Round::Down))
        };
        let same = |text: &str| (text.to_owned(), text.to_owned());
        assert_eq!(both(0), same("0 ms"));
        assert_eq!(both(53_000_000), same("53 ms"));
        assert_eq!(both(991_400_000), same("991.4 ms"));
        assert_eq!(both(1_234), same("0.001234 ms"));
        assert_eq!(both(1_234_567_891), ("1234.57 ms".into(), "1234.56 ms".into()));
        assert_eq!(both(999_999_999), ("1000 ms".into(), "999.999 ms".into()));
        assert_eq!(both(7_200_000_000_001), ("7200.01 s".into(), "7200 s".into()));
        for nanos in [1, 999_999, 10_000_001, 123_456_789_012, u64::MAX / 2] {
            let (up, down) = both(nanos);
            assert!(up.chars().count() <= 16 && down.chars().count() <= 16, "{up} {down}");
        }
    }

    #[test]
    fn the_first_text_that_fits_is_shown() {
        let texts = |texts: &[&str]| Texts::of(texts.iter().map(|text| (*text).to_owned()));
        let long = "x".repeat(33);
        assert_eq!(texts(&[&long, "short"]).into_all(), ["short"]);
        assert_eq!(texts(&["long", "s", "s"]).into_all(), ["long", "s"]);
        assert_eq!(texts(&["long", "s"]).within(4), "long");
        assert_eq!(texts(&["long", "s"]).within(3), "s");
        assert_eq!(texts(&["long", "s"]).within(0), "s");
        assert_eq!(texts(&[&long]).within(40), format!("{}…", "x".repeat(31)));
        assert_eq!(texts(&[]).within(40), "");
        assert_eq!(cut("ab cd", 4), "ab…");
    }
}
