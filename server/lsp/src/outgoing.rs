//! The messages that wait to be written.

use std::sync::atomic::{AtomicUsize, Ordering};

use tokio::sync::{Notify, mpsc, oneshot};

/// A message for the client, and an optional signal when it is written.
#[derive(Debug)]
pub(crate) struct Outgoing {
    pub(crate) message: String,
    pub(crate) written: Option<oneshot::Sender<()>>,
}

/// Counts the messages that wait to be written.
#[derive(Debug, Default)]
pub(crate) struct Backlog {
    waiting: AtomicUsize,
    pub(crate) less: Notify,
}

impl Backlog {
    /// Sends a message to the client.
    pub(crate) fn put(&self, outgoing: &mpsc::UnboundedSender<Outgoing>, message: Outgoing) {
        self.waiting.fetch_add(1, Ordering::SeqCst);
        // If the receiver is dropped, the session ends.
        let _ = outgoing.send(message);
    }

    /// Returns the number of waiting messages.
    pub(crate) fn waiting(&self) -> usize {
        self.waiting.load(Ordering::SeqCst)
    }

    /// Records a written message.
    pub(crate) fn written(&self) {
        self.waiting.fetch_sub(1, Ordering::SeqCst);
        self.less.notify_one();
    }
}

/// The number of unread answers at which the server stops reading the client's messages.
pub(crate) const MOST_WAITING: usize = 2000;
