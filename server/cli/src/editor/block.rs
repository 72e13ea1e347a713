//! Lines in a configuration file of the user, between two marks, the second one with a digest of the lines. Without them, the
//! file is as it was, to the byte.

use mauve_timing::digest_of;

const BEGIN: &str = "# mauve: begin\n";
const END: &str = "# mauve: end";

/// A text, split at the marks in it.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Split {
    /// The text without the block.
    pub(super) rest: String,
    /// Whether the lines between the marks were edited, if the text has marks.
    pub(super) is_edited: Option<bool>,
}

/// Splits a text at its marks.
///
/// # Errors
///
/// The text has the first mark, and not the second.
pub(super) fn split(text: &str) -> Result<Split, String> {
    let is_line = |at: usize| at == 0 || text.as_bytes().get(at - 1) == Some(&b'\n');
    let Some(begin) = text.match_indices(BEGIN).map(|(at, _)| at).find(|&at| is_line(at)) else {
        return Ok(Split { rest: text.to_owned(), is_edited: None });
    };
    let (mut before, after) = text.split_at(begin);
    let body = after.strip_prefix(BEGIN).unwrap_or_default();
    let end = body.match_indices(END).map(|(at, _)| at).find(|&at| is_line(begin + BEGIN.len() + at));
    let end = end.ok_or_else(|| format!("has the line `{}` without `{END}`", BEGIN.trim_end()))?;
    let (body, after) = body.split_at(end);
    let after = after.strip_prefix(END).unwrap_or_default();
    let (digest, after) = after.split_at(after.find('\n').unwrap_or(after.len()));
    let is_edited = digest.trim() != digest_of(body.as_bytes());
    // The blank line before the block, and the line break that the last line did not have.
    if before.ends_with("\n\n") {
        before = before.strip_suffix('\n').unwrap_or(before);
    }
    let after = after.strip_prefix('\n').unwrap_or_else(|| {
        before = before.strip_suffix('\n').unwrap_or(before);
        after
    });
    Ok(Split { rest: format!("{before}{after}"), is_edited: Some(is_edited) })
}

/// Inserts lines at an offset: at the end, or behind a line that is not blank. [`split`] returns both again.
pub(super) fn insert(text: &str, at: usize, lines: &str) -> String {
    let (before, after) = text.split_at_checked(at).unwrap_or((text, ""));
    let mut out = String::from(before);
    let is_complete = before.is_empty() || before.ends_with('\n');
    if !is_complete {
        out.push('\n');
    }
    if after.is_empty() && !before.is_empty() {
        out.push('\n');
    }
    out += &format!("{BEGIN}{lines}{END} {}", digest_of(lines.as_bytes()));
    if is_complete {
        out.push('\n');
    }
    out + after
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The digest of `a` and a line break.
    const DIGEST: &str = "089bdc07b544e7b2";

    #[test]
    fn a_block_ends_a_file() {
        let block = format!("# mauve: begin\na\n# mauve: end {DIGEST}");
        assert_eq!(insert("", 0, "a\n"), format!("{block}\n"));
        assert_eq!(insert("x\n", 2, "a\n"), format!("x\n\n{block}\n"));
        assert_eq!(insert("x", 1, "a\n"), format!("x\n\n{block}"));
        assert_eq!(insert("x\ny", 2, "a\n"), format!("x\n{block}\ny"));
    }

    #[test]
    fn text_around_a_block_may_change() {
        let text = insert("x\n", 2, "a\n").replace("x\n", "x\ny\n") + "z\n";
        let rest = || "x\ny\nz\n".to_owned();
        assert_eq!(split(&text), Ok(Split { rest: rest(), is_edited: Some(false) }));
        for edited in [text.replace("a\n", "b\n"), text.replace(DIGEST, "")] {
            assert_eq!(split(&edited), Ok(Split { rest: rest(), is_edited: Some(true) }));
        }
        assert!(split("# mauve: begin\na\n").is_err());
        assert_eq!(split("x # mauve: begin\n").map(|it| it.is_edited), Ok(None));
    }

    proptest! {
        #[test]
        fn without_its_block_a_text_is_as_it_was(text in "([a-c#é\n\r =]|\n\n|\r\n){0,20}", line in 0..20_usize) {
            let lines: Vec<usize> = text.split_inclusive('\n').scan(0, |at, line| {
                *at += line.len();
                Some((*at, line))
            }).filter(|(_, line)| !line.trim().is_empty()).map(|(at, _)| at).chain([text.len()]).collect();
            let at = lines[line % lines.len()];
            prop_assert_eq!(split(&insert(&text, at, "k = 1\n")), Ok(Split { rest: text, is_edited: Some(false) }));
        }
    }
}
