//! What a command prints: its result, and messages to standard error.

use std::io::Write as _;

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
