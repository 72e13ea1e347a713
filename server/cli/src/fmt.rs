//! `mauve fmt [PATH…] [--check]`: formats the white space of models.
//!
//! Writes only files in the named paths, not those that they include, and only files that change (`replace.rs`).

use std::io::Read as _;
use std::path::{Path, PathBuf};

use mauve_projects::disk::text_of;
use mauve_projects::load::{is_of_another_language, models_in};
use mauve_projects::output::{Output, print, say};
use mauve_projects::replace::replace;
use mauve_syntax::format::{applied, format};

use crate::options::Paths;
use crate::text::{argument, counted, shown};

#[derive(Debug, clap::Args)]
pub struct Fmt {
    #[command(flatten)]
    paths: Paths,
    /// Write nothing: list the files that would change, and exit with 1 if there are any, or files with syntax errors, which
    /// cannot be formatted. (`-` as PATH formats standard input.)
    #[arg(long)]
    check: bool,
}

impl Fmt {
    pub(crate) fn run(self) -> Result<Output, String> {
        match self.paths.paths.as_slice() {
            [path] if path.as_os_str() == "-" => self.standard_input(),
            paths if paths.iter().any(|path| path.as_os_str() == "-") => {
                Err("`-` is standard input, and cannot be combined with other paths".to_owned())
            }
            paths => self.files(paths),
        }
    }

    fn standard_input(&self) -> Result<Output, String> {
        let mut text = String::new();
        let read = std::io::stdin().lock().read_to_string(&mut text);
        read.map_err(|error| format!("cannot read standard input: {error}"))?;
        let (tidy, has_errors) = self.tidy(&text, ("standard input", "- --stdin-path FILE"));
        if self.check {
            let text =
                difference(&text, &tidy).map(|lines| format!("standard input{lines}")).unwrap_or_default();
            return Ok(Output::escaped(&text, u8::from(has_errors || !text.is_empty())));
        }
        print(tidy.as_bytes())?;
        Ok(Output::verbatim("", 0))
    }

    fn files(&self, paths: &[PathBuf]) -> Result<Output, String> {
        let here = std::env::current_dir().unwrap_or_default();
        let (mut changed, mut unchanged, mut broken, mut problems) = (0, 0, 0, 0);
        let mut text = String::new();
        let (models, unread) = models_in(paths)?;
        for problem in unread {
            say(&problem);
            problems += 1;
        }
        for path in models {
            let name = shown(&path, &here);
            let (old, problem) = text_of(&path);
            if let Some(problem) = problem {
                say(&format!("`{name}`: {problem}; the file is not changed"));
                problems += 1;
                continue;
            }
            if is_of_another_language(&old) {
                // A file of another language with the same extension is not an error.
                continue;
            }
            let (new, has_errors) = self.tidy(&old, (&format!("`{name}`"), &argument(Path::new(&name))));
            broken += usize::from(has_errors);
            let Some(lines) = difference(&old, &new) else {
                unchanged += usize::from(!has_errors);
                continue;
            };
            if self.check {
                text += &format!("{name}{lines}");
            } else if let Err(error) = replace(&path, &new) {
                say(&format!("cannot write `{name}`: {error}"));
                problems += 1;
                continue;
            } else {
                text += &format!("{name}\n");
            }
            changed += 1;
        }
        let done = if self.check { "to be formatted" } else { "formatted" };
        let cannot = if broken > 0 { format!(", {broken} with syntax errors") } else { String::new() };
        text += &format!("{} {done}, {unchanged} unchanged{cannot}\n", counted(changed, "file"));
        let code = if problems > 0 { 2 } else { u8::from(self.check && changed + broken > 0) };
        Ok(Output::escaped(text, code))
    }

    /// Returns the text with its new white space, and whether a part of it cannot be formatted; says so of the file, with its name in a
    /// command.
    fn tidy(&self, text: &str, (name, argument): (&str, &str)) -> (String, bool) {
        let parse = mauve_syntax::parse(text);
        let has_errors = !parse.errors().is_empty();
        if has_errors {
            let errors = counted(parse.errors().len(), "syntax error");
            let what = match self.check {
                true => "the text around them cannot be formatted",
                false => "the text around them is not changed",
            };
            say(&format!("{name} has {errors}: {what}\nhelp: `mauve check {argument}` shows them"));
        }
        (applied(text, &format(&parse, &|| ())), has_errors)
    }
}

/// Returns where two texts begin to differ: `:LINE`, and that line of both; `None` if they are equal.
fn difference(old: &str, new: &str) -> Option<String> {
    if old == new {
        return None;
    }
    let (mut left, mut right) = (old.split_inclusive('\n'), new.split_inclusive('\n'));
    let mut line = 1;
    loop {
        let (old, new) = (left.next(), right.next());
        if old == new {
            line += 1;
            continue;
        }
        let show = |sign: char, line: Option<&str>| {
            line.map(|line| format!("  {sign} {}\n", line.trim_end_matches(['\r', '\n']))).unwrap_or_default()
        };
        return Some(format!(":{line}\n{}{}", show('-', old), show('+', new)));
    }
}
