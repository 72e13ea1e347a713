//! What a misspelt word may be.

/// The one of `words` that `word` may be a misspelling of. Of very many only the first thousand are looked at: a missing
/// file must not make every name in its place slow.
///
/// ```
/// use mauve_syntax::similar;
/// assert_eq!(similar("pilto", ["laser", "pilot"]), Some("pilot"));
/// assert_eq!(similar("Navigation", ["navigation"]), Some("navigation"));
/// assert_eq!(similar("camera", ["laser", "pilot"]), None);
/// ```
pub fn similar<'a>(word: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    let allowed = ((length + 1) / 3).min(3);
    let near = words.into_iter().take(1000).filter(|other| other.len().abs_diff(length) <= allowed);
    let (found, other) = near.map(|other| (distance(word, other), other)).min()?;
    (found <= allowed && found > 0).then_some(other)
}

/// How many letters must be added, removed, changed or swapped with their neighbour to make one word the other.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(64).collect(), b.chars().take(64).collect());
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for (i, &x) in a.iter().enumerate() {
        let mut row = vec![i + 1];
        for (j, &y) in b.iter().enumerate() {
            let mut best = (rows[i][j] + usize::from(x != y)).min(rows[i][j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && x == b[j - 1] && a[i - 1] == y {
                best = best.min(rows[i - 1][j - 1] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows.last().and_then(|row| row.last()).copied().unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_taken_and_never_the_word_itself() {
        assert_eq!(similar("statmachine", ["state", "statemachine"]), Some("statemachine"));
        assert_eq!(similar("activity", ["activity"]), None);
        assert_eq!(similar("cor", ["core", "codel"]), Some("core"));
        assert_eq!(similar("", ["a"]), None);
    }
}
