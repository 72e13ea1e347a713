//! A session on paper: one JSON object a line, with what was said, by whom, and when. A recorded session is a bug report:
//! `mauve replay` says it all again.
//!
//! ```json
//! {"seconds":0.0123,"from":"client","message":{"jsonrpc":"2.0","id":1,"method":"initialize","params":{}}}
//! ```

use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::private::private;

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
    /// Since the session began.
    pub(crate) seconds: f64,
    pub(crate) from: Side,
    pub(crate) message: M,
}

/// Writes what both sides say to a file.
#[derive(Clone)]
pub(crate) struct Mirror {
    begin: Instant,
    file: Arc<Mutex<File>>,
}

impl Mirror {
    /// A record at `path`, behind what is there already: an editor starts a server again that has ended by a defect, and
    /// that session is the one to be looked at. It has the texts of the models, so only the user may read it.
    pub(crate) fn create(path: &Path) -> std::io::Result<Mirror> {
        Ok(Mirror {
            begin: Instant::now(),
            file: Arc::new(Mutex::new(private().create(true).append(true).open(path)?)),
        })
    }

    /// Writes a line at once: a session may end at any time. One that cannot be written is not worth the session.
    pub(crate) fn record(&self, from: Side, message: &Value) {
        let line = Line { seconds: self.begin.elapsed().as_secs_f64(), from, message };
        let Ok(text) = serde_json::to_string(&line) else { return };
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = file.write_all((text + "\n").as_bytes()) {
            tracing::warn!("the session is not recorded: {error}");
        }
    }
}
