//! # unused-allow
//!
//! A comment `// mauve: allow(CODE) reason` suppresses nothing: its line and the line below have no diagnostic with that code, or
//! the comment has no reason, or the code is unknown.
//!
//! ```mauve
//! shell S { output port next: int }
//! core C(S) {
//!   update = {
//!     // mauve: allow(lost-write) the second value is the one that counts
//!     write(next, 1);
//!     write(next, 2);   // mauve: allow(lost-write) it is the last one   // warning
//!   }
//! }
//! ```
//!
//! Such a comment hides a known and accepted diagnostic. It never changes a response time or a proof: a hidden error prevents the
//! analysis as well, and `mauve check` still fails while a deadline is not proved (`[deployment.NAME] accept` in `mauve.toml`
//! accepts one). `mauve check` counts hidden diagnostics, and SARIF reports contain them with their reasons. `[lints]` in
//! `mauve.toml` hides all diagnostics of a code. `syntax-error`, `unreadable-file` and `invalid-table`
//! cannot be suppressed, because a deployment may be unknown behind them.
//!
//! Fix: correct the code, or remove the comment.

use super::*;
use crate::allow::Allow;

pub(super) fn report<'db>(file: File, allow: &Allow) -> Diagnostic<'db> {
    let Allow { code, reason, .. } = allow;
    let at = |span: &std::ops::Range<usize>| Location::of_span(file, span);
    let found = if code.contains(',') {
        let message = format!("a comment suppresses one code: write a comment for each of `{code}`");
        Diagnostic::new(&UNUSED_ALLOW, at(&allow.code_span), message)
    } else if code_named(code).is_none() {
        let near = mauve_syntax::similar(code, codes().map(|code| code.name)).map(Name::from);
        Diagnostic::new(&UNUSED_ALLOW, at(&allow.code_span), format!("no diagnostic `{code}`")).did_you_mean(near)
    } else if allow::NEVER_SUPPRESSED.contains(&code.as_str()) {
        let message = format!("`{code}` cannot be suppressed: correct it");
        Diagnostic::new(&UNUSED_ALLOW, at(&allow.span), message)
    } else if reason.is_empty() {
        let message = format!("`allow({code})` has no effect without a reason: write the reason after it");
        Diagnostic::new(&UNUSED_ALLOW, at(&allow.span), message)
    } else {
        let message =
            format!("this comment suppresses nothing: no `{code}` on line {}, remove the comment", allow.line);
        Diagnostic::new(&UNUSED_ALLOW, at(&allow.span), message)
    };
    found.fix("Remove the comment", at(&allow.deletion), String::new())
}
