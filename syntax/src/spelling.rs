//! Finds the intended word of a misspelling.

/// Returns the word of `words` of which `word` may be a misspelling. Of very many words, only the first are compared:
/// with a missing file, each of its names is looked up here.
///
/// ```
/// use mauve_syntax::similar;
/// assert_eq!(similar("pilto", ["laser", "pilot"]), Some("pilot"));
/// assert_eq!(similar("Navigation", ["navigation"]), Some("navigation"));
/// assert_eq!(similar("camera", ["laser", "pilot"]), None);
/// ```
pub fn similar<'a>(word: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let written = word;
    let word: Vec<char> = word.chars().take(LONGEST).collect();
    let mut allowed = ((word.len() + 1) / 3).min(3);
    let set = set_of_letters(written);
    let mut rows = Rows::default();
    let mut best: Option<(usize, &str)> = None;
    for other in words.into_iter().take(MOST_WORDS) {
        let its_set = set_of_letters(other);
        if other.len() > LONGEST * 4 || are_apart(set, its_set, allowed) {
            continue;
        }
        let is_same_set = !are_apart(set, its_set, 0);
        if is_same_set && other != written && allowed > 0 && letters(other).eq(letters(written)) {
            best = best.filter(|best| *best < (0, other)).or(Some((0, other)));
            continue;
        }
        if let Some(found) = rows.distance(&word, other, allowed).filter(|found| *found > 0)
            && best.is_none_or(|best| (found, other) < best)
        {
            (best, allowed) = (Some((found, other)), found);
        }
    }
    best.map(|(_, other)| other)
}

/// Returns whether `near` is closer to the misspelt `word` than all other `words` are.
///
/// ```
/// use mauve_syntax::is_nearest;
/// assert!(is_nearest("pilto", "pilot", ["pilot", "laser"]));
/// assert!(!is_nearest("plan", "plan1", ["plan1", "plan2"]));
/// ```
pub fn is_nearest<'a>(word: &str, near: &str, words: impl IntoIterator<Item = &'a str>) -> bool {
    let word: Vec<char> = word.chars().take(LONGEST).collect();
    let mut rows = Rows::default();
    let Some(distance) = rows.distance(&word, near, LONGEST) else { return false };
    words.into_iter().filter(|other| *other != near).all(|other| {
        match rows.distance(&word, other, distance) {
            Some(0) | None => true,
            Some(_) => false,
        }
    })
}

/// Returns the letters and digits of a word in lower case, without `_`: `planPath` and `plan_path` differ in style only.
fn letters(word: &str) -> impl Iterator<Item = char> {
    word.chars().filter(|letter| *letter != '_').flat_map(char::to_lowercase)
}

/// The set of the [`letters`] of a word, a bit each; `None` if only its beginning is compared, or if a letter is not
/// ASCII, since it may be several in lower case.
fn set_of_letters(word: &str) -> Option<u128> {
    let letters = || word.bytes().filter(|letter| *letter != b'_').map(|letter| letter.to_ascii_lowercase());
    let is_plain = word.is_ascii() && word.len() <= LONGEST;
    is_plain.then(|| letters().fold(0, |set, letter| set | 1 << letter))
}

/// Returns whether words with these sets of letters differ in more than `allowed` changes: each adds at most one letter,
/// and removes at most one. Of many words, this excludes most, in a small part of the time of [`Rows::distance`].
fn are_apart(word: Option<u128>, other: Option<u128>, allowed: usize) -> bool {
    word.zip(other).is_some_and(|(word, other)| {
        (word & !other).count_ones().max((other & !word).count_ones()) as usize > allowed
    })
}

/// Returns whether at most `changes` changes turn `word` into `other`: a letter is added, removed or replaced, or two
/// neighbours are swapped. Words with more than 64 letters are also similar if their beginnings are.
///
/// ```
/// use mauve_syntax::is_within;
/// assert!(is_within("pilto", "pilot", 1) && is_within("pilot", "pilot", 0));
/// assert!(!is_within("piltto", "pilot", 1));
/// ```
pub fn is_within(word: &str, other: &str, changes: usize) -> bool {
    if word == other {
        return true;
    }
    let is_long = word.len() > LONGEST || other.len() > LONGEST;
    // An additional letter at the beginning moves one beyond the end.
    let allowed = if is_long { changes * 2 } else { changes };
    if !is_long && word.len().abs_diff(other.len()) > allowed * 4 {
        return false;
    }
    let word: Vec<char> = word.chars().take(LONGEST).collect();
    Rows::default().distance(&word, other, allowed).is_some()
}

const MOST_WORDS: usize = 500;

/// Only the beginnings of longer words are compared.
const LONGEST: usize = 64;

/// Greater than any distance.
const FAR: usize = usize::MAX / 2;

/// The last three rows of a table of distances between the beginnings of two words.
#[derive(Default)]
struct Rows {
    other: Vec<char>,
    before_last: Vec<usize>,
    last: Vec<usize>,
    row: Vec<usize>,
}

impl Rows {
    /// Returns the smallest number of changes that turn one word into the other; `None` if it exceeds `allowed`.
    fn distance(&mut self, word: &[char], other: &str, allowed: usize) -> Option<usize> {
        self.other.clear();
        self.other.extend(other.chars().take(LONGEST));
        if self.other.len().abs_diff(word.len()) > allowed {
            return None;
        }
        // A common prefix or suffix needs no change.
        let same = word.iter().zip(&self.other).take_while(|(x, y)| x == y).count();
        self.other.drain(..same);
        let word = &word[same..];
        let same = word.iter().rev().zip(self.other.iter().rev()).take_while(|(x, y)| x == y).count();
        self.other.truncate(self.other.len() - same);
        let word = &word[..word.len() - same];
        let width = self.other.len() + 1;
        self.last.clear();
        self.last.extend(0..width);
        self.before_last.clear();
        self.before_last.resize(width, FAR);
        for (i, &x) in word.iter().enumerate() {
            self.row.clear();
            self.row.resize(width, FAR);
            self.row[0] = i + 1;
            // Cells outside this band need more changes than allowed.
            let band = i.saturating_sub(allowed)..(i + allowed + 1).min(self.other.len());
            for j in band {
                let y = self.other[j];
                let change = self.last[j] + usize::from(x != y);
                let mut best = change.min(self.last[j + 1] + 1).min(self.row[j] + 1);
                if i > 0 && j > 0 && x == self.other[j - 1] && word[i - 1] == y {
                    best = best.min(self.before_last[j - 1] + 1);
                }
                self.row[j + 1] = best;
            }
            if self.row.iter().all(|&distance| distance > allowed) {
                return None;
            }
            std::mem::swap(&mut self.before_last, &mut self.last);
            std::mem::swap(&mut self.last, &mut self.row);
        }
        self.last.last().copied().filter(|found| *found <= allowed)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn sets_of_letters_exclude_no_similar_word(
            word in "[a-dA-D_é]{0,9}", other in "[a-dA-D_é]{0,9}", allowed in 0_usize..4,
        ) {
            if are_apart(set_of_letters(&word), set_of_letters(&other), allowed) {
                let word_letters: Vec<char> = word.chars().collect();
                prop_assert_eq!(Rows::default().distance(&word_letters, &other, allowed), None);
                prop_assert!(!letters(&word).eq(letters(&other)));
            }
        }
    }

    #[test]
    fn the_nearest_word_is_taken_and_never_the_word_itself() {
        assert_eq!(similar("statmachine", ["state", "statemachine"]), Some("statemachine"));
        assert_eq!(similar("activity", ["activity"]), None);
        assert_eq!(similar("cor", ["core", "codel"]), Some("core"));
        assert_eq!(similar("planPathToGo", ["plan_paths_to_go", "plan_path_to_go"]), Some("plan_path_to_go"));
        assert_eq!(similar("plan_path", ["plan_path"]), None);
        assert_eq!(similar("", ["a"]), None);
        assert_eq!(similar("ab", ["ba"]), Some("ba"));
        assert_eq!(similar("naïve", ["naive"]), Some("naive"));
        assert_eq!(similar(&"x".repeat(1000), ["x"]), None);
    }
}
