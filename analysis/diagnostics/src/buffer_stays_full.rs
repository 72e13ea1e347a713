//! # buffer-stays-full
//!
//! The reader of a buffer reads less often than its writer writes. The buffer fills, and stays full: each write drops the oldest value,
//! and each value that is read is as old as all that were written after it.
//!
//! ```mauve
//! codel grab(out n: int): void
//! codel look(in n: int): void
//! shell Eye { output port frame: int }
//! shell Search { input port frame: int }
//! core EyeCore(Eye) { var n: int = 0  update = { grab(n); write(frame, n); } }
//! core SearchCore(Search) { var n: int = 0  update = { read(frame, n); look(n); } }
//! component Camera(Eye, EyeCore)
//! component Finder(Search, SearchCore)
//! architecture Robot { instance camera: Camera  instance finder: Finder
//!   connection camera.frame -> [10] finder.frame   // warning
//! }
//! deployment Bench {
//!   architecture Robot
//!   activity camera { priority = 2  period = 20 }
//!   activity finder { priority = 1  period = 50 }
//! }
//! //- /mauve.toml
//! assume.codel = "1 ms"
//! ```
//!
//! Without a buffer, the reader has the newest value. With one, let it read as often as the writer writes: with a shorter period, or
//! with several reads in one period.

use super::*;
use mauve_hir::Link;

pub(super) fn report<'db>(link: &Link<'db>, age: Time) -> Diagnostic<'db> {
    let (writer, reader) = (&link.source.0, &link.target.0);
    let size = link.buffer.unwrap_or_default();
    let message = format!(
        "the buffer of {size} stays full while `{writer}` writes in each period: `{reader}` reads less often, so that values are \
         dropped, and what it reads is at least {age} old; remove `[{size}]`, or read more often"
    );
    Diagnostic::new(&BUFFER_STAYS_FULL, link.at.clone(), message)
}
