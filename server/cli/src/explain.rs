//! `mauve explain CODE`: the page of a diagnostic, or of a warning of `mauve pwcet`; `mauve explain all` lists the codes.

use mauve_diagnostics::{codes, measurement_kinds, page, summary};
use mauve_hir::similar;
use mauve_projects::output::Output;

/// The lines of the list have at most this many characters.
const WIDTH: usize = 120;

#[derive(Debug, clap::Args)]
pub struct Explain {
    /// The code of a diagnostic, such as `deadline-missed`, or a warning of `mauve pwcet`; `all` lists the codes.
    code: String,
}

impl Explain {
    pub(crate) fn run(self) -> Result<Output, String> {
        if self.code == "all" {
            return Ok(Output::escaped(list(), 0));
        }
        if let Some(page) = page(&self.code) {
            // Examples of several files.
            let line = |line: &str| match line.strip_prefix("//- /") {
                Some(path) => format!("── {path} ──\n"),
                None => format!("{line}\n"),
            };
            return Ok(Output::escaped(page.lines().map(line).collect::<String>(), 0));
        }
        Err(unknown(&self.code))
    }
}

/// Returns one line per code: its name, its default severity, and the first sentence of its page. Warnings of `mauve pwcet` have no
/// severity.
fn list() -> String {
    let longest = codes().map(|code| code.name.len()).max().unwrap_or_default();
    let of_pwcet = measurement_kinds().map(|name| (name, "pwcet"));
    let line = |(name, severity): (&str, &str)| {
        let start = format!("{name:<longest$}  {severity:<7}  ");
        let room = WIDTH.saturating_sub(start.chars().count());
        format!("{start}{}\n", shortened(&summary(name), room))
    };
    codes().map(|code| (code.name, code.severity.name())).chain(of_pwcet).map(line).collect()
}

/// Returns `text`, cut at a word where it has more than `most` characters.
fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let start: String = text.chars().take(most.saturating_sub(1)).collect();
    let end = start.rfind(' ').unwrap_or(start.len());
    format!("{} …", start.get(..end).unwrap_or_default())
}

/// Returns the message for an unknown code.
pub(super) fn unknown(code: &str) -> String {
    let names: Vec<_> = codes().map(|code| code.name.into()).collect();
    let near = similar(code, &names).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    format!("no diagnostic `{code}`{near} (`mauve explain all` lists them)")
}
