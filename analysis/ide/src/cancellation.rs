//! Work in a database of its own, which a change of the first one cancels.
//!
//! Setting an input waits until no reader of the database is left. A reader that works in another database notices nothing of it, and
//! an edit would wait for all of that work.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use mauve_hir::{Database, ModelDb};
use salsa::{Cancelled, Database as _};

/// So often the first database is asked whether it is to be changed.
const INTERVAL: Duration = Duration::from_millis(2);

/// Returns the result of work in `other`. It ends early, and unwinds, if `db` is cancelled.
pub(crate) fn until_cancelled<T: Send>(
    db: &dyn ModelDb,
    other: Database,
    work: impl FnOnce(&Database) -> T + Send,
) -> T {
    let token = other.cancellation_token();
    let (sender, result) = channel();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let found = catch_unwind(AssertUnwindSafe(|| work(&other)));
            // The receiver waits for it.
            let _ = sender.send(found);
        });
        let mut cancelled = None;
        loop {
            match result.recv_timeout(INTERVAL) {
                Ok(found) => {
                    if let Some(cancelled) = cancelled {
                        resume_unwind(Box::new(cancelled));
                    }
                    return found.unwrap_or_else(|panic| resume_unwind(panic));
                }
                Err(RecvTimeoutError::Disconnected) => resume_unwind(Box::new("the work has no result")),
                Err(RecvTimeoutError::Timeout) => {
                    let asked = Cancelled::catch(AssertUnwindSafe(|| db.unwind_if_revision_cancelled()));
                    cancelled = cancelled.or(asked.err());
                    if cancelled.is_some() {
                        token.cancel();
                    }
                }
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;

    #[test]
    fn an_edit_cancels_work_in_another_database() {
        let Fixture { mut db, file, .. } = Fixture::of_text("codel f(): int");
        let (sender, begun) = channel();
        let reader = db.clone();
        let worker = std::thread::spawn(move || {
            Cancelled::catch(AssertUnwindSafe(|| {
                until_cancelled(&reader, Database::default(), |other: &Database| {
                    let _ = sender.send(());
                    loop {
                        other.unwind_if_revision_cancelled();
                        std::thread::yield_now();
                    }
                })
            }))
        });
        begun.recv().unwrap();
        // It waits for the reader.
        file.set_text(&mut db, "codel g(): int".into());
        let ended: Result<(), Cancelled> = worker.join().unwrap();
        assert!(ended.is_err());
        assert_eq!(until_cancelled(&db, Database::default(), |_| 7), 7);
    }
}
