//! The figure of an activity: its response time beside its deadline, or why it has none.

use mauve_hir::ModelDb;
use mauve_timing::Status;
use mauve_wcrt::{ActivityReport, Footing};

use crate::figure::{Forms, HintStatus, MOST_CHARACTERS, cut};
use crate::reasons::short_reason;

/// The length of the start of a reason that says something of it: `? no time…`.
const FEW_CHARACTERS: usize = 10;

/// Returns the forms of an activity's response time, or why it has none. Slack below `tight_slack` percent of the deadline is
/// [`HintStatus::Tight`].
pub fn figure(db: &dyn ModelDb, activity: &ActivityReport<'_>, footing: Footing, tight_slack: u32) -> Forms {
    let deadline = activity.deadline.unwrap_or_default();
    let reason = || activity.reasons.first().map_or_else(String::new, |it| short_reason(db, &it.reason));
    match (activity.verdict, activity.response) {
        (Status::Background, _) => {
            Forms::of_texts(["– not real-time", "–"].map(str::to_owned), HintStatus::Time)
        }
        (Status::Met | Status::Missed, Some(response)) => {
            Forms::with("", response, deadline, footing, tight_slack)
        }
        (Status::NotAnalysed, _) => {
            let reason = format!("? {}", reason());
            let texts = [MOST_CHARACTERS, FEW_CHARACTERS].map(|most| cut(&reason, most));
            Forms::of_texts(texts.into_iter().chain(["?".to_owned()]), HintStatus::Unknown)
        }
        (Status::Unbounded, _) => {
            let (long, short) = (format!("✗ {}", reason()), format!("✗ {}", without_percent(&reason())));
            Forms::of_texts([long, short, "✗ overloaded".to_owned(), "✗".to_owned()], HintStatus::Missed)
        }
        (_, _) => {
            let texts = [format!("✗ no bound: {}", reason()), "✗ no bound".to_owned(), "✗".to_owned()];
            Forms::of_texts(texts, HintStatus::Missed)
        }
    }
}

/// Returns `CPU 1 overloaded` of `CPU 1 overloaded (102.7 %)`.
fn without_percent(reason: &str) -> &str {
    reason.split(" (").next().unwrap_or_default()
}
