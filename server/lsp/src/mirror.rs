//! Records a session: one JSON object per line, with the message, its sender and its time. A recorded session shows
//! in a bug report what the client and the server said.
//!
//! ```json
//! {"seconds":0.0123,"from":"client","message":{"jsonrpc":"2.0","id":1,"method":"initialize","params":{}}}
//! ```

use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use mauve_projects::replace::append_private;
use serde_json::{Value, json};

/// The sender of a message.
#[derive(Clone, Copy)]
pub(crate) enum MessageSide {
    Client,
    Server,
}

/// Writes the messages of both sides to a file.
#[derive(Clone)]
pub(crate) struct Mirror {
    begin: Instant,
    file: Arc<Mutex<File>>,
}

impl Mirror {
    /// Opens a record and appends to it, since an editor restarts a server after a crash, and the crashed session is
    /// the relevant one. The record contains the texts of the models, so only the user may read it.
    pub(crate) fn create(path: &Path) -> Result<Mirror, String> {
        Ok(Mirror { begin: Instant::now(), file: Arc::new(Mutex::new(append_private(path)?)) })
    }

    /// Writes a line immediately: a session may end at any time. An error does not end the session.
    pub(crate) fn record(&self, from: MessageSide, message: &Value) {
        let from = match from {
            MessageSide::Client => "client",
            MessageSide::Server => "server",
        };
        let line = json!({"seconds": self.begin.elapsed().as_secs_f64(), "from": from, "message": message});
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = writeln!(file, "{line}") {
            tracing::warn!("the session is not recorded: {error}");
        }
    }
}
