//! What commands say about the errors of a project, without which a figure may be missing.

use crate::cli::text::counted;
use crate::output::say;

/// Says that a project has errors, if it has.
pub(super) fn say_errors(errors: usize) {
    if errors > 0 {
        say(&with_errors(errors));
    }
}

/// Says that there is no deployment, for which the errors may be the reason.
pub(super) fn nothing_to(doing: &str, errors: usize) -> String {
    let nothing = format!("no deployment in these models: nothing to {doing}");
    if errors == 0 { nothing } else { format!("{nothing}; {}", with_errors(errors)) }
}

fn with_errors(errors: usize) -> String {
    let them = if errors == 1 { "it" } else { "them" };
    format!("the project has {} (`mauve check` shows {them})", counted(errors, "error"))
}
