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
    let mut allowed = ((word.chars().count().min(LONGEST) + 1) / 3).min(3);
    let set = set_of_letters(word);
    let mut best: Option<(usize, &str)> = None;
    for other in words.into_iter().take(MOST_WORDS) {
        let its_set = set_of_letters(other);
        if other.len() > LONGEST * 4 || are_apart(set, its_set, allowed) {
            continue;
        }
        let is_same_set = !are_apart(set, its_set, 0);
        if is_same_set && other != word && allowed > 0 && letters(other).eq(letters(word)) {
            best = best.filter(|best| *best < (0, other)).or(Some((0, other)));
            continue;
        }
        if let Some(found) = distance(word, other, allowed).filter(|found| *found > 0)
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
    let Some(of_near) = distance(word, near, LONGEST) else { return false };
    let mut others = words.into_iter().filter(|other| *other != near);
    others.all(|other| distance(word, other, of_near).is_none_or(|distance| distance == 0))
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
/// and removes at most one. Of many words, this excludes most, in a small part of the time of [`distance`].
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
    distance(word, other, allowed).is_some()
}

const MOST_WORDS: usize = 500;

/// Only the beginnings of longer words are compared.
const LONGEST: usize = 64;

/// Returns the smallest number of changes that turn one word into the other; `None` if it exceeds `allowed`.
fn distance(word: &str, other: &str, allowed: usize) -> Option<usize> {
    let beginning = |word: &'_ str| word.char_indices().nth(LONGEST).map_or(word.len(), |(end, _)| end);
    let (word, other) = (word.get(..beginning(word))?, other.get(..beginning(other))?);
    let lengths = word.chars().count().abs_diff(other.chars().count());
    (lengths <= allowed).then(|| strsim::osa_distance(word, other)).filter(|found| *found <= allowed)
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
                prop_assert_eq!(distance(&word, &other, allowed), None);
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
