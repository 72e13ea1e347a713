//! Records a session: one JSON object per line, with the message, its sender and its time. A recorded session is a bug
//! report: `mauve replay` sends it again.
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
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The sender of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Side {
    Client,
    Server,
}

/// A line of the record.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Line<M = Value> {
    /// The time since the session began.
    pub(crate) seconds: f64,
    pub(crate) from: Side,
    pub(crate) message: M,
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
    pub(crate) fn record(&self, from: Side, message: &Value) {
        let line = Line { seconds: self.begin.elapsed().as_secs_f64(), from, message };
        let Ok(text) = serde_json::to_string(&line) else { return };
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = file.write_all((text + "\n").as_bytes()) {
            tracing::warn!("the session is not recorded: {error}");
        }
    }
}
