//! Reports the progress of work that takes long. An edit or the user can cancel it.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::watch;
use tower_lsp::Client;
use tower_lsp::lsp_types::notification::Progress;
use tower_lsp::lsp_types::request::WorkDoneProgressCreate;
use tower_lsp::lsp_types::{
    ProgressParams, ProgressParamsValue, ProgressToken, WorkDoneProgress, WorkDoneProgressBegin,
    WorkDoneProgressCreateParams, WorkDoneProgressEnd, WorkDoneProgressReport,
};

/// The time after which progress is shown.
const PATIENCE: Duration = Duration::from_millis(500);

/// The work of the server that may take long, with numbers of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum ServerWork {
    #[default]
    Nothing,
    /// Walking through folders.
    Searching,
    Reading(usize),
    Analysing(usize),
}

impl fmt::Display for ServerWork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            ServerWork::Nothing => Ok(()),
            ServerWork::Searching => write!(f, "searching for models"),
            ServerWork::Reading(files) => write!(f, "reading {}", counted(files)),
            ServerWork::Analysing(files) => write!(f, "analysing {}", counted(files)),
        }
    }
}

fn counted(files: usize) -> String {
    format!("{files} file{}", if files == 1 { "" } else { "s" })
}

/// Reports work, if it is other work than before.
pub(crate) fn report(to: &watch::Sender<ServerWork>, work: ServerWork) {
    to.send_if_modified(|before| std::mem::replace(before, work) != work);
}

/// The number of the progress that is shown; 0 without one.
#[derive(Debug, Clone, Default)]
pub(crate) struct ShownProgress(Arc<AtomicU64>);

impl ShownProgress {
    /// Returns whether this is the token of the progress that is shown.
    pub(crate) fn is(&self, other: &ProgressToken) -> bool {
        let number = self.0.load(Ordering::SeqCst);
        number > 0 && token(number) == *other
    }
}

fn token(number: u64) -> ProgressToken {
    ProgressToken::String(format!("mauve/analysis/{number}"))
}

/// Shows a progress whenever work takes long, with what the server is doing.
pub(crate) async fn show(client: Client, mut work: watch::Receiver<ServerWork>, shown: ShownProgress) {
    let mut number = 0;
    loop {
        // The sender is dropped when the server ends.
        if work.wait_for(|work| *work != ServerWork::Nothing).await.is_err() {
            return;
        }
        if tokio::time::timeout(PATIENCE, work.wait_for(|work| *work == ServerWork::Nothing)).await.is_ok() {
            continue;
        }
        number += 1;
        let create = WorkDoneProgressCreateParams { token: token(number) };
        if client.send_request::<WorkDoneProgressCreate>(create).await.is_err() {
            return;
        }
        let say = |value| {
            let params = ProgressParams { token: token(number), value: ProgressParamsValue::WorkDone(value) };
            client.send_notification::<Progress>(params)
        };
        shown.0.store(number, Ordering::SeqCst);
        let mut now = *work.borrow_and_update();
        say(WorkDoneProgress::Begin(WorkDoneProgressBegin {
            title: "MAUVE".to_owned(),
            cancellable: Some(true),
            message: Some(now.to_string()).filter(|message| !message.is_empty()),
            percentage: None,
        }))
        .await;
        while now != ServerWork::Nothing && work.changed().await.is_ok() {
            now = *work.borrow_and_update();
            if now != ServerWork::Nothing {
                let message = Some(now.to_string());
                let report = WorkDoneProgressReport { message, ..WorkDoneProgressReport::default() };
                say(WorkDoneProgress::Report(report)).await;
            }
        }
        shown.0.store(0, Ordering::SeqCst);
        say(WorkDoneProgress::End(WorkDoneProgressEnd { message: None })).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_counted() {
        let shown = [0, 1, 2].map(|files| ServerWork::Reading(files).to_string());
        assert_eq!(shown, ["reading 0 files", "reading 1 file", "reading 2 files"]);
    }

    #[test]
    fn only_the_token_of_the_shown_progress_is_known() {
        let shown = ShownProgress::default();
        assert!(!shown.is(&token(0)) && !shown.is(&token(1)));
        shown.0.store(2, Ordering::SeqCst);
        assert!(shown.is(&token(2)) && !shown.is(&token(1)) && !shown.is(&ProgressToken::Number(2)));
    }
}
