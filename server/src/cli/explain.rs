//! `mauve explain CODE`: the page of a diagnostic.

use mauve_diagnostics::{codes, page};
use mauve_hir::similar;

use crate::Output;

#[derive(Debug, clap::Args)]
pub(crate) struct Explain {
    /// The code behind an error or a warning, such as `deadline-missed`; `all` lists them.
    code: String,
}

impl Explain {
    pub(crate) fn run(self) -> Result<Output, String> {
        if self.code == "all" {
            let line =
                |code: &mauve_diagnostics::Code| format!("{:<24} {}\n", code.name, code.severity.name());
            return Ok(Output::escaped(codes().map(line).collect::<String>(), 0));
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

/// What to say where no diagnostic has this code.
pub(super) fn unknown(code: &str) -> String {
    let names: Vec<_> = codes().map(|code| code.name.into()).collect();
    let near = similar(code, &names).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    format!("no diagnostic `{code}`{near} (`mauve explain all` lists them)")
}
