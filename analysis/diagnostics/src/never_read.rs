//! # never-read
//!
//! A writer writes five values or more between two reads: all but the last one are never read. The time that the writer takes for
//! them is in vain, unless another component reads them.
//!
//! ```mauve
//! codel grab(out n: int): void
//! shell Eye { output port frame: int }
//! shell Search { input port frame: int }
//! core EyeCore(Eye) { var n: int = 0  update = { grab(n); write(frame, n); } }
//! core SearchCore(Search) { var n: int = 0  update = { read(frame, n); } }
//! component Camera(Eye, EyeCore)
//! component Finder(Search, SearchCore)
//! architecture Robot { instance camera: Camera  instance finder: Finder
//!   connection camera.frame -> finder.frame   // hint
//! }
//! deployment Bench {
//!   architecture Robot
//!   activity camera { priority = 2  period = 20 }
//!   activity finder { priority = 1  period = 200 }
//! }
//! ```
//!
//! The same where data releases the reader, if it is written more often than that may be: values that arrive meanwhile have no job
//! of their own. A shorter `least` gives them one, and a buffer keeps those of bursts.
//!
//! Where the reader needs the newest value only, that is as it should be. Otherwise, lengthen the period of the writer, shorten that
//! of the reader, or connect them with a buffer.

use super::*;
use mauve_hir::Link;

/// The least number of values that are reported: a reader often has a few times the period of its writer.
const LEAST: u64 = 5;

pub(super) fn report<'db>(link: &Link<'db>, values: u64) -> Option<Diagnostic<'db>> {
    if values < LEAST {
        return None;
    }
    let (writer, reader) = (&link.source.0, &link.target.0);
    let never = values.saturating_sub(1);
    let message = format!("`{reader}` never reads {never} of {values} values that `{writer}` writes: its period is longer");
    Some(Diagnostic::new(&NEVER_READ, link.at.clone(), message))
}

/// Reports values that have no release of their own, since data releases the reader less often than it is written.
pub(super) fn report_faster<'db>(link: &Link<'db>, [writes, releases]: [Time; 2]) -> Diagnostic<'db> {
    let (writer, reader) = (&link.source.0, &link.target.0);
    let (mut one, mut other) = (writes.as_nanos(), releases.as_nanos());
    while other > 0 {
        (one, other) = (other, one % other);
    }
    let [jobs, values] = [writes, releases].map(|it| it.as_nanos() / one.max(1));
    let lost = match values {
        ..100 => format!("{} of {values}", values.saturating_sub(jobs)),
        _ => format!("{} %", values.saturating_sub(jobs).saturating_mul(100) / values),
    };
    let message = format!(
        "`{reader}` does not process {lost} values that `{writer}` writes one by one: data releases it every {releases} at most, and \
         `{writer}` writes every {writes}"
    );
    Diagnostic::new(&NEVER_READ, link.at.clone(), message)
}
