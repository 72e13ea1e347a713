//! # unread-trigger
//!
//! Data at a port releases an activity whose core never reads that port: what the activity executes does not depend on it.
//!
//! ```mauve
//! shell Eye { output port frame: int }
//! shell Search { input port frame: int }
//! core EyeCore(Eye) { update = { write(frame, 1); } }
//! core SearchCore(Search) { update = { } }
//! component Camera(Eye, EyeCore)
//! component Finder(Search, SearchCore)
//! architecture Robot { instance camera: Camera  instance finder: Finder
//!   connection camera.frame -> finder.frame
//! }
//! deployment Bench {
//!   architecture Robot
//!   activity camera { priority = 2  period = 20 }
//!   activity finder { priority = 1  trigger = frame  least = 30 }   // warning
//! }
//! ```
//!
//! Read the port, or name the one that is read.

use super::*;

pub(super) fn report<'db>(at: Location<'db>, instance: &str, port: &str) -> Diagnostic<'db> {
    let message = format!("data at `{port}` releases `{instance}`, whose core never reads it");
    Diagnostic::new(&UNREAD_TRIGGER, at, message)
}
