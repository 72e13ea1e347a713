//! The one form of a figure: a mark, the response time, the deadline and their unit, and where there is room a bar and per cent.
//!
//! ```text
//! ✓ 53 / 100 ms ▰▰▰▱▱▱ 53 %    ! 997 / 1000 ms    ✗ 113 / 100 ms    ✗ CPU 1 overloaded (101.7 %)    ? no time for astar
//! ```
//!
//! Hints, hovers, tables, drawings, actions and messages take it from here. Slack is a figure of its own, in hovers and in
//! `--sensitivity`.

use mauve_timing::{EXTRAPOLATED, Time, Unit};
use mauve_wcrt::Footing;
use serde::{Deserialize, Serialize};

/// The maximum length of a hint, in characters.
pub const MOST_CHARACTERS: usize = 32;

/// Slack below this share of the deadline, in percent, is [`HintStatus::Tight`], unless the user sets another share.
pub const TIGHT_SLACK: u32 = 10;

/// What the figure of a hint says, for its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum HintStatus {
    /// Deadlines are met with slack; a CPU has capacity left.
    Met,
    /// Deadlines are met with little slack; a CPU is nearly fully used.
    Tight,
    /// A deadline is missed, or a CPU is overloaded.
    Missed,
    /// The figure is unknown.
    Unknown,
    /// The figure is that of an earlier text: this one is incomplete.
    Older,
    /// An execution time.
    Time,
    /// The value of a property or constant.
    Value,
}

impl HintStatus {
    /// The name of the status, for editors.
    pub fn name(self) -> &'static str {
        match self {
            HintStatus::Met => "met",
            HintStatus::Tight => "tight",
            HintStatus::Missed => "missed",
            HintStatus::Unknown => "unknown",
            HintStatus::Older => "older",
            HintStatus::Time => "time",
            HintStatus::Value => "value",
        }
    }

    /// Its weight, the worst first: missed, unknown, tight, met, and what is no verdict.
    pub fn rank(self) -> usize {
        let order = [HintStatus::Missed, HintStatus::Unknown, HintStatus::Tight, HintStatus::Met];
        order.iter().position(|it| *it == self).unwrap_or(order.len())
    }
}

/// A figure in fewer and fewer words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forms {
    /// `✓ 53 / 100 ms` and what remains of it as room shrinks: without the unit, without the deadline, and at last the mark alone.
    pub texts: Vec<String>,
    /// `▰▰▰▱▱▱` and `53 %`, where there is a time and a limit.
    pub bar: Option<[String; 2]>,
    /// What it says, for its colour.
    pub status: HintStatus,
}

impl Forms {
    /// A figure without a bar.
    pub(crate) fn of_texts(texts: impl IntoIterator<Item = String>, status: HintStatus) -> Forms {
        Forms { texts: texts.into_iter().collect(), bar: None, status }
    }

    /// Returns the forms of a time beside its limit. Slack below `tight_slack` percent of the limit is [`HintStatus::Tight`].
    ///
    /// ```
    /// use mauve_diagnostics::figure::Forms;
    /// use mauve_timing::Time;
    ///
    /// let ms = |time: u64| Time::from_nanos(time * 1_000_000);
    /// let forms = Forms::of(ms(53), ms(100), 10);
    /// assert_eq!((forms.text(), &*forms.full()), ("✓ 53 / 100 ms", "✓ 53 / 100 ms ▰▰▰▱▱▱ 53 %"));
    /// assert_eq!(Forms::of(ms(113), ms(100), 10).full(), "✗ 113 / 100 ms ▰▰▰▰▰▰ 113 %");
    /// ```
    pub fn of(time: Time, limit: Time, tight_slack: u32) -> Forms {
        Forms::with("", time, limit, Footing::Known, tight_slack)
    }

    pub(crate) fn with(at_most: &str, time: Time, limit: Time, footing: Footing, tight_slack: u32) -> Forms {
        let (mark, status) = match time > limit {
            true => ("✗", HintStatus::Missed),
            false => met(time, limit, tight_slack),
        };
        let texts = response_texts(&format!("{mark}{at_most}"), compared(time, limit), footing);
        Forms { texts, bar: Some(bar(time, limit)), status }
    }

    /// Its form within a sentence: `✓ 53 / 100 ms`.
    pub fn text(&self) -> &str {
        self.texts.first().map_or("", String::as_str)
    }

    /// Its form in a table with a column for the deadline: `✓ 53`, `✗ overloaded`.
    pub fn with_response(&self) -> &str {
        self.texts.iter().rev().nth(1).map_or(self.text(), String::as_str)
    }

    /// Its longest form: `✓ 53 / 100 ms ▰▰▰▱▱▱ 53 %`.
    pub fn full(&self) -> String {
        self.all().swap_remove(0)
    }

    /// All forms, the longest first.
    pub fn all(&self) -> Vec<String> {
        let text = self.text();
        let bar = self
            .bar
            .iter()
            .flat_map(|[bar, percent]| [format!("{text} {bar} {percent}"), format!("{text} {bar}")]);
        bar.chain(self.texts.iter().cloned()).chain(self.texts.is_empty().then(String::new)).collect()
    }
}

/// The number of cells of a bar.
const CELLS: u64 = 6;

/// Returns the share of a limit as a bar and in per cent, rounded up. A bar is full where the limit is reached, and only there.
fn bar(time: Time, limit: Time) -> [String; 2] {
    let (time, limit) = (u128::from(time.as_nanos()), u128::from(limit.as_nanos()).max(1));
    let cells = (time * u128::from(CELLS) / limit).clamp(u128::from(time > 0), u128::from(CELLS)) as usize;
    let bar = "▰".repeat(cells) + &"▱".repeat(CELLS as usize - cells);
    // The last per cents before a limit count.
    let tenths = (time * 1000).div_ceil(limit);
    let is_whole = !(900..=1100).contains(&tenths) || tenths % 10 == 0;
    let percent =
        if is_whole { tenths.div_ceil(10).to_string() } else { format!("{}.{}", tenths / 10, tenths % 10) };
    [bar, format!("{percent} %")]
}

/// Returns a response time before and after a change, and the deadline after it; `None`, it has no bound. The mark is that of the
/// time after the change.
///
/// ```text
/// ✓ 60 → 20 / 50 ms    ! unbounded → 49 / 50 ms    ✗ 120 → 113 / 100 ms    ✓ 70 / 71 ms
/// ```
pub fn changed_figure((before, after): (Option<Time>, Option<Time>), deadline: Time) -> String {
    let Some(after) = after else { return "✗ unbounded".to_owned() };
    let mark = if after > deadline { "✗" } else { met(after, deadline, TIGHT_SLACK).0 };
    let figure = compared(after, deadline).swap_remove(0);
    let before = match before {
        Some(before) if before == after => String::new(),
        Some(before) if unit_of(before) == unit_of(after.max(deadline)) => {
            format!("{} → ", rounded(before, Round::Up).number_in(unit_of(before)))
        }
        Some(before) => format!("{} → ", short(before)),
        None => "unbounded → ".to_owned(),
    };
    format!("{mark} {before}{figure}")
}

/// Returns the forms of a chain's latency beside its limit, or why it has none. Slack is as in [`Forms::of`].
///
/// ```text
/// ✓ ≤ 526 / 600 ms    ✗ ≤ 526 / 500 ms    ≤ 526 ms    ? guidance may skip it
/// ```
pub fn chain_figure((latency, limit): (Option<Time>, Option<Time>), reason: &str, tight_slack: u32) -> Forms {
    match (latency, limit) {
        (Some(latency), Some(limit)) => Forms::with(" ≤", latency, limit, Footing::Known, tight_slack),
        (Some(latency), None) => Forms::of_texts([format!("≤ {}", short(latency))], HintStatus::Time),
        (None, _) => {
            let reason = cut(&format!("? {reason}"), MOST_CHARACTERS);
            Forms::of_texts([reason, "?".to_owned()], HintStatus::Unknown)
        }
    }
}

/// Returns the greatest time with which every deadline is still met, with the mark of the time `now`: `✓ ≤ 467 ms`.
pub fn limit_figure(now: Option<Time>, limit: Time, are_met: bool, tight_slack: u32) -> Forms {
    let (mark, status) = match now {
        _ if !are_met => ("✗", HintStatus::Missed),
        Some(now) => met(now, limit, tight_slack),
        None => ("?", HintStatus::Unknown),
    };
    let unit = unit_of(limit);
    let text = format!("{mark} ≤ {} {unit}", rounded(limit, Round::Down).number_in(unit));
    Forms::of_texts([text, mark.to_owned()], status)
}

/// Returns the mark of a deadline that is met, and its colour.
pub fn met(response: Time, deadline: Time, tight_slack: u32) -> (&'static str, HintStatus) {
    let slack = deadline.checked_sub(response).unwrap_or_default();
    match is_tight(slack, deadline, tight_slack) {
        true => ("!", HintStatus::Tight),
        false => ("✓", HintStatus::Met),
    }
}

/// Whether slack is below this share of the deadline, in percent.
fn is_tight(slack: Time, deadline: Time, tight_slack: u32) -> bool {
    u128::from(slack.as_nanos()) * 100 < u128::from(deadline.as_nanos()) * u128::from(tight_slack)
}

/// Returns `✓ 53 / 100 ms` and the shorter forms, down to the mark alone. Assumed and extrapolated times
/// are always marked.
fn response_texts(mark: &str, figures: Vec<String>, footing: Footing) -> Vec<String> {
    let mut with_mark = figures.iter().map(|figure| format!("{mark} {figure}"));
    let word = match footing {
        Footing::Known => return with_mark.chain([mark.to_owned()]).collect(),
        Footing::Extrapolated => EXTRAPOLATED,
        Footing::Assumed => "assumed",
    };
    let long = with_mark.clone().map(|figure| format!("{figure} · {word}"));
    let in_short = with_mark.next_back().map(|figure| format!("{figure} {word}"));
    long.chain(in_short).chain([format!("{mark} {word}")]).collect()
}

/// Returns a text of at most `most` characters: itself, or its beginning and `…`.
pub fn cut(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let beginning: String = text.chars().take(most.saturating_sub(1)).collect();
    format!("{}…", beginning.trim_end())
}

/// Returns a time with at most six digits: `53 ms`, `991.4 ms`, `1234.56 ms`, `98765.5 s`. Longer ones are rounded up.
pub fn short(time: Time) -> String {
    let unit = unit_of(time);
    format!("{} {unit}", rounded(time, Round::Up).number_in(unit))
}

/// Returns a response time beside its deadline in fewer and fewer words: `53 / 100 ms`, `53 / 100`, `53`. A response time is rounded
/// up and a deadline down, unless the figures would contradict the verdict then. Seconds keep their unit.
fn compared(response: Time, deadline: Time) -> Vec<String> {
    let mut shown = (rounded(response, Round::Up), rounded(deadline, Round::Down));
    if (shown.0 <= shown.1) != (response <= deadline) {
        shown = (response, deadline);
    }
    let unit = unit_of(response.max(deadline));
    let [response, deadline] = [shown.0, shown.1].map(|time| time.number_in(unit));
    let with_unit = format!("{response} / {deadline} {unit}");
    match unit {
        Unit::Seconds => vec![with_unit, format!("{response} s")],
        _ => vec![with_unit, format!("{response} / {deadline}"), response],
    }
}

/// The direction in which a time is rounded that has more than six digits.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Round {
    Up,
    Down,
}

/// Times of 1,000 s and more with many digits are shown in seconds.
fn unit_of(time: Time) -> Unit {
    let is_long = time.as_nanos() >= 1_000_000 * 1_000_000 && digits(time) > MOST_DIGITS;
    if is_long { Unit::Seconds } else { Unit::Milliseconds }
}

/// The maximum number of digits of a time in a hint.
const MOST_DIGITS: usize = 6;

/// The number of digits of a time in milliseconds.
fn digits(time: Time) -> usize {
    time.number().chars().filter(char::is_ascii_digit).count()
}

/// Returns a time with six significant digits.
pub(crate) fn rounded(time: Time, round: Round) -> Time {
    if digits(time) <= MOST_DIGITS {
        return time;
    }
    let nanos = time.as_nanos();
    let step = 10u64.pow(nanos.checked_ilog10().unwrap_or_default().saturating_sub(5));
    Time::from_nanos(match round {
        Round::Up => nanos.div_ceil(step).checked_mul(step).unwrap_or(nanos),
        Round::Down => nanos / step * step,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latency_stands_beside_its_limit() {
        let ms = |time: u64| Some(Time::from_nanos(time * 1_000_000));
        let of =
            |latency, limit| chain_figure((latency, limit), "guidance may skip it for ever, or longer", 10);
        assert_eq!(
            of(ms(526), ms(600)).all(),
            [
                "✓ ≤ 526 / 600 ms ▰▰▰▰▰▱ 88 %",
                "✓ ≤ 526 / 600 ms ▰▰▰▰▰▱",
                "✓ ≤ 526 / 600 ms",
                "✓ ≤ 526 / 600",
                "✓ ≤ 526",
                "✓ ≤"
            ]
        );
        assert_eq!(of(ms(526), ms(526)).status, HintStatus::Tight);
        assert_eq!(of(ms(526), ms(500)).text(), "✗ ≤ 526 / 500 ms");
        assert_eq!(of(ms(526), None).all(), ["≤ 526 ms"]);
        assert_eq!(of(None, ms(500)).all(), ["? guidance may skip it for ever…", "?"]);
    }

    #[test]
    fn a_bar_is_full_only_at_the_limit() {
        let of = |time, limit| bar(Time::from_nanos(time), Time::from_nanos(limit)).join(" ");
        assert_eq!(of(0, 100), "▱▱▱▱▱▱ 0 %");
        assert_eq!(of(1, 1_000_000), "▰▱▱▱▱▱ 1 %");
        assert_eq!(of(530, 1000), "▰▰▰▱▱▱ 53 %");
        assert_eq!(of(940, 1000), "▰▰▰▰▰▱ 94 %");
        assert_eq!(of(997, 1000), "▰▰▰▰▰▱ 99.7 %");
        assert_eq!(of(1000, 1000), "▰▰▰▰▰▰ 100 %");
        assert_eq!(of(100_001, 100_000), "▰▰▰▰▰▰ 100.1 %");
        assert_eq!(of(63, 50), "▰▰▰▰▰▰ 126 %");
        assert_eq!(of(5, 0), "▰▰▰▰▰▰ 500 %");
        assert!(of(u64::MAX, 1).starts_with("▰▰▰▰▰▰ "));
    }

    #[test]
    fn a_change_has_the_mark_of_its_outcome() {
        let ms = |time: u64| Time::from_nanos(time * 1_000_000);
        let of = |before: Option<u64>, after: Option<u64>, deadline| {
            changed_figure((before.map(ms), after.map(ms)), ms(deadline))
        };
        assert_eq!(of(Some(60), Some(20), 50), "✓ 60 → 20 / 50 ms");
        assert_eq!(of(None, Some(49), 50), "! unbounded → 49 / 50 ms");
        assert_eq!(of(Some(120), Some(113), 100), "✗ 120 → 113 / 100 ms");
        assert_eq!(of(Some(53), Some(53), 100), "✓ 53 / 100 ms");
        assert_eq!(of(Some(53), None, 100), "✗ unbounded");
    }

    #[test]
    fn long_times_are_rounded_up() {
        let short = |nanos| short(Time::from_nanos(nanos));
        assert_eq!(short(0), "0 ms");
        assert_eq!(short(53_000_000), "53 ms");
        assert_eq!(short(991_400_000), "991.4 ms");
        assert_eq!(short(1_234), "0.001234 ms");
        assert_eq!(short(1_234_567_891), "1234.57 ms");
        assert_eq!(short(999_999_999), "1000 ms");
        assert_eq!(short(7_200_000_000_001), "7200.01 s");
        for nanos in [1, 999_999, 10_000_001, 123_456_789_012, u64::MAX / 2] {
            assert!(short(nanos).chars().count() <= 16, "{}", short(nanos));
        }
    }

    #[test]
    fn a_response_time_stands_beside_its_deadline() {
        let compared = |response, deadline| compared(Time::from_nanos(response), Time::from_nanos(deadline));
        assert_eq!(compared(53_000_000, 100_000_000), ["53 / 100 ms", "53 / 100", "53"]);
        assert_eq!(compared(991_400_000, 1_000_000_000), ["991.4 / 1000 ms", "991.4 / 1000", "991.4"]);
        let second = 1_000_000_000;
        assert_eq!(compared(53_000_000, 100_000 * second), ["0.053 / 100000 s", "0.053 s"]);
        assert_eq!(compared(7_200 * second + 1, 9_000 * second + 1), ["7200.01 / 9000 s", "7200.01 s"]);
        // Rounded up, the response time would exceed the deadline.
        assert_eq!(compared(1_234_567_891, 1_234_567_899)[2], "1234.567891");
        assert_eq!(compared(1_234_567_899, 1_234_567_891)[2], "1234.57");
    }
}
