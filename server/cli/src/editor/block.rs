//! Lines in a configuration file of the user, between two marks. Without them, the file is as it was, to the byte.

const BEGIN: &str = "# mauve: begin\n";
const END: &str = "# mauve: end";

/// Returns a text without the lines between its marks, and without these.
///
/// # Errors
///
/// The text has the first mark, and not the second.
pub(super) fn without(text: &str) -> Result<String, String> {
    let is_line = |at: usize| at == 0 || text.as_bytes().get(at - 1) == Some(&b'\n');
    let Some(begin) = text.match_indices(BEGIN).map(|(at, _)| at).find(|&at| is_line(at)) else {
        return Ok(text.to_owned());
    };
    let (mut before, after) = text.split_at(begin);
    let body = after.strip_prefix(BEGIN).unwrap_or_default();
    let end = body.match_indices(END).map(|(at, _)| at).find(|&at| is_line(begin + BEGIN.len() + at));
    let end = end.ok_or_else(|| format!("has the line `{}` without `{END}`", BEGIN.trim_end()))?;
    let after = body.get(end..).unwrap_or_default();
    let after = after.get(after.find('\n').unwrap_or(after.len())..).unwrap_or_default();
    // The blank line before the block, and the line break that the last line did not have.
    if before.ends_with("\n\n") {
        before = before.strip_suffix('\n').unwrap_or(before);
    }
    let after = after.strip_prefix('\n').unwrap_or_else(|| {
        before = before.strip_suffix('\n').unwrap_or(before);
        after
    });
    Ok(format!("{before}{after}"))
}

/// Inserts lines at an offset: at the end, or behind a line that is not blank. [`without`] removes them again.
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
    out += &format!("{BEGIN}{lines}{END}");
    if is_complete {
        out.push('\n');
    }
    out + after
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_block_ends_a_file() {
        let block = "# mauve: begin\na\n# mauve: end";
        assert_eq!(insert("", 0, "a\n"), format!("{block}\n"));
        assert_eq!(insert("x\n", 2, "a\n"), format!("x\n\n{block}\n"));
        assert_eq!(insert("x", 1, "a\n"), format!("x\n\n{block}"));
        assert_eq!(insert("x\ny", 2, "a\n"), format!("x\n{block}\ny"));
    }

    #[test]
    fn text_around_a_block_may_change() {
        let text = insert("x\n", 2, "a\n").replace("x\n", "x\ny\n") + "z\n";
        assert_eq!(without(&text).as_deref(), Ok("x\ny\nz\n"));
        assert!(without("# mauve: begin\na\n").is_err());
        assert_eq!(without("x # mauve: begin\n").as_deref(), Ok("x # mauve: begin\n"));
    }

    proptest! {
        #[test]
        fn without_its_block_a_text_is_as_it_was(text in "([a-c#é\n\r =]|\n\n|\r\n){0,20}", line in 0..20_usize) {
            let lines: Vec<usize> = text.split_inclusive('\n').scan(0, |at, line| {
                *at += line.len();
                Some((*at, line))
            }).filter(|(_, line)| !line.trim().is_empty()).map(|(at, _)| at).chain([text.len()]).collect();
            let at = lines[line % lines.len()];
            prop_assert_eq!(without(&insert(&text, at, "k = 1\n")), Ok(text));
        }
    }
}
