//! The texts of hints: short enough for an editor that is split in two.

use std::sync::Arc;

use mauve_diagnostics::figure::{Forms, MOST_CHARACTERS, cut};

/// The columns that an editor shows on a small screen, beside its lists of files and its map. Editors that know better choose among
/// the texts themselves.
const COLUMNS: usize = 105;

/// The maximum length of a hint on a line that leaves no more room.
const LEAST_ROOM: usize = 20;

/// Returns the maximum length of a hint that begins at this column.
pub(super) fn most_at(column: usize) -> usize {
    COLUMNS.saturating_sub(column).clamp(LEAST_ROOM, MOST_CHARACTERS)
}

/// Texts that say the same in fewer and fewer words, each of at most [`MOST_CHARACTERS`].
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Texts {
    all: Arc<[String]>,
    /// How many of them have a bar: they are longer, for editors that know how much room there is.
    bars: usize,
}

impl Texts {
    /// Returns those of `texts` that are short enough; if there is none, the last one without its end.
    ///
    /// ```text
    /// Texts::of(["✓ 53 / 100 ms", "✓ 53 / 100", "✓ 53", "✓"]).within(8) = "✓ 53"
    /// ```
    pub(super) fn of(texts: impl IntoIterator<Item = String>) -> Texts {
        let mut texts: Vec<String> = texts.into_iter().collect();
        let last = texts.last().map(|last| cut(last, MOST_CHARACTERS));
        texts.retain(|text| text.chars().count() <= MOST_CHARACTERS);
        if texts.is_empty() {
            texts.extend(last);
        }
        texts.dedup();
        Texts { all: texts.into(), bars: 0 }
    }

    /// Returns the forms of a figure.
    pub(super) fn of_forms(forms: &Forms) -> Texts {
        let mut all = forms.all();
        let texts = all.split_off(all.len().saturating_sub(forms.texts.len()));
        all.retain(|text| text.chars().count() <= MOST_CHARACTERS);
        let bars = all.len();
        all.extend_from_slice(&Texts::of(texts).all);
        Texts { all: all.into(), bars }
    }

    /// Returns the first text of at most `room` characters, otherwise the last one.
    pub(super) fn within(&self, room: usize) -> &str {
        let fits = self.all.iter().skip(self.bars).find(|text| text.chars().count() <= room);
        fits.or(self.all.last()).map_or("", String::as_str)
    }

    /// Returns the texts with the mark of older figures, `…`, in the place of their own.
    pub(super) fn as_older(&self) -> Texts {
        let older = self.all.iter().skip(self.bars).map(|text| {
            let mut words = text.splitn(2, ' ');
            match (words.next(), words.next()) {
                (Some("✓" | "!" | "✗" | "–"), rest) => format!("… {}", rest.unwrap_or_default()),
                _ => format!("… {text}"),
            }
        });
        let older: Vec<String> = older.map(|text| cut(text.trim_end(), MOST_CHARACTERS)).collect();
        Texts::of(older.into_iter().chain(["…".to_owned()]))
    }

    /// Returns all of them, the longest first.
    pub(super) fn into_all(self) -> Arc<[String]> {
        self.all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_text_that_fits_is_shown() {
        let texts = |texts: &[&str]| Texts::of(texts.iter().map(|text| (*text).to_owned()));
        let long = "x".repeat(33);
        assert_eq!(texts(&[&long, "short"]).into_all()[..], ["short"]);
        assert_eq!(texts(&["long", "s", "s"]).into_all()[..], ["long", "s"]);
        assert_eq!(texts(&["long", "s"]).within(4), "long");
        assert_eq!(texts(&["long", "s"]).within(3), "s");
        assert_eq!(texts(&["long", "s"]).within(0), "s");
        assert_eq!(texts(&[&long]).within(40), format!("{}…", "x".repeat(31)));
        assert_eq!(texts(&[]).within(40), "");
        assert_eq!(cut("ab cd", 4), "ab…");
    }
}
