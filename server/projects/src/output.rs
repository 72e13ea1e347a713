//! What a command prints: its result, and messages to standard error.

use std::io::{IsTerminal as _, Write as _};

use crate::harmless::harmless;

/// What a command gives: its text, and how it ends.
pub struct Output {
    /// For standard output.
    pub text: String,
    /// 0 or 1; 2 where a part of it could not be read or written; of a language server that has a defect, 101.
    pub code: u8,
}

impl Output {
    /// Text for a terminal: control characters in it are made visible.
    pub fn escaped(text: impl AsRef<str>, code: u8) -> Output {
        Output { text: harmless(text.as_ref()), code }
    }

    /// Text for programs, or text whose control characters are escaped already.
    pub fn verbatim(text: impl Into<String>, code: u8) -> Output {
        Output { text: text.into(), code }
    }
}

/// Prints bytes as they are: other outputs lose escape sequences where they are not for a terminal.
pub fn print(bytes: &[u8]) -> Result<(), String> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(format!("cannot write the result: {error}"))
        }
        _ => Ok(()),
    }
}

/// Prints a patch: as it is for programs, which apply it, and with visible control characters on a terminal.
pub fn print_patch(patch: &str) -> Result<(), String> {
    let is_terminal = std::io::stdout().is_terminal();
    print(if is_terminal { harmless(patch) } else { patch.to_owned() }.as_bytes())
}

/// Returns the columns of the terminal that standard output goes to; none if it goes elsewhere. The variable `COLUMNS` overrides them.
pub fn terminal_columns() -> Option<usize> {
    let set = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let of_terminal = || rustix::termios::tcgetwinsize(std::io::stdout()).ok().map(|size| size.ws_col.into());
    set.or_else(of_terminal).filter(|columns: &usize| *columns > 0)
}

/// Prints a message to standard error.
pub fn say(message: &str) {
    let _ = writeln!(anstream::stderr(), "mauve: {}", harmless(message));
}
