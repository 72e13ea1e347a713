//! Begins again with an empty database: when the user asks for it, and after a panic of the main loop.

use super::*;

impl MainLoop {
    /// Discards all that was read and computed. The client's texts, folders and settings stay. Its diagnostics are published
    /// again, even unchanged ones.
    pub(super) fn reload(&mut self) {
        let loader = self.loader.emptied();
        let watcher = Watcher::new(self.sender.clone());
        let mut db = std::mem::take(&mut self.db);
        let rest =
            (std::mem::replace(&mut self.loader, loader), std::mem::replace(&mut self.watcher, watcher));
        // This waits for all workers that read the old database, and frees much memory.
        let discard = move || {
            db.trigger_cancellation();
            drop((db, rest));
        };
        if let Err(error) = std::thread::Builder::new().name("discard".to_owned()).spawn(discard) {
            tracing::warn!("the old database was discarded without a thread: {error}");
        }
        self.workspaces = Arc::new([]);
        (self.shared_documents, self.other_uris) = (Arc::default(), Arc::default());
        self.strays.clear();
        self.documents.0.values_mut().for_each(|open| open.is_dirty = true);
        self.publisher.publish_all_again();
        self.staleness.begin_again();
    }

    /// Continues after a panic. Waiting requests are answered with an error. A text that was being changed is unknown.
    pub(super) fn restart(&mut self, message: &str) {
        tracing::error!("the main loop panicked: {message}");
        self.waiting.clear();
        if let Some(uri) = self.changing.take() {
            self.documents.lost(&uri);
        }
        self.publisher.warn(&format!(
            "A defect of mauve: {message}. All files are read again; after another such defect, the server ends. Please \
             report it."
        ));
        self.reload();
    }
}
