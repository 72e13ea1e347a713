//! Reports the progress of a long analysis. An edit or the user can cancel it.

use std::time::Duration;

use tokio::sync::watch;
use tower_lsp::Client;
use tower_lsp::lsp_types::notification::Progress;
use tower_lsp::lsp_types::request::WorkDoneProgressCreate;
use tower_lsp::lsp_types::{
    ProgressParams, ProgressParamsValue, ProgressToken, WorkDoneProgress, WorkDoneProgressBegin,
    WorkDoneProgressCreateParams, WorkDoneProgressEnd,
};

/// The time after which progress is shown.
const PATIENCE: Duration = Duration::from_millis(500);

/// Shows a progress whenever `busy` stays true for long.
pub(crate) async fn show(client: Client, mut busy: watch::Receiver<bool>) {
    let mut number = 0;
    loop {
        // The sender is dropped when the server ends.
        if busy.wait_for(|busy| *busy).await.is_err() {
            return;
        }
        if tokio::time::timeout(PATIENCE, busy.wait_for(|busy| !*busy)).await.is_ok() {
            continue;
        }
        number += 1;
        let token = ProgressToken::String(format!("mauve/analysis/{number}"));
        let create = WorkDoneProgressCreateParams { token: token.clone() };
        if client.send_request::<WorkDoneProgressCreate>(create).await.is_err() {
            return;
        }
        let begin = WorkDoneProgress::Begin(WorkDoneProgressBegin {
            title: "Computing response times".to_owned(),
            cancellable: Some(true),
            ..WorkDoneProgressBegin::default()
        });
        let say =
            |value| ProgressParams { token: token.clone(), value: ProgressParamsValue::WorkDone(value) };
        client.send_notification::<Progress>(say(begin)).await;
        let _ = busy.wait_for(|busy| !*busy).await;
        client
            .send_notification::<Progress>(say(WorkDoneProgress::End(WorkDoneProgressEnd { message: None })))
            .await;
    }
}
