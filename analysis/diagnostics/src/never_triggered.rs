//! # never-triggered
//!
//! Data at the port that `trigger` names releases an activity, and no component writes it: no connection leads to the port, or the core of the
//! writer never writes its port. The activity never executes.
//!
//! ```mauve
//! shell Eye { output port frame: int }
//! shell Search { input port frame: int }
//! core EyeCore(Eye) { update = { } }
//! core SearchCore(Search) { var n: int = 0  update = { read(frame, n); } }
//! component Camera(Eye, EyeCore)
//! component Finder(Search, SearchCore)
//! architecture Robot { instance camera: Camera  instance finder: Finder
//!   connection camera.frame -> finder.frame
//! }
//! deployment Bench {
//!   architecture Robot
//!   activity camera { priority = 2  period = 20 }
//!   activity finder { priority = 1  trigger = frame  least = 30 }   // error
//! }
//! ```
//!
//! Connect the port to an output that is written, or give the activity a period. A topic of ROS 2 releases no activity.

use super::*;

pub(super) fn report<'db>(
    at: Location<'db>,
    [instance, port]: [&str; 2],
    writer: Option<&(Name, Name)>,
) -> Diagnostic<'db> {
    let why = match writer {
        Some((writer, output)) => format!("`{writer}` never writes `{output}`, which is connected to it"),
        None => "no connection leads to it; a topic releases none: connect the port, or write a `period`".to_owned(),
    };
    let message = format!("nothing releases `{instance}`: data at `{port}` does, and {why}");
    Diagnostic::new(&NEVER_TRIGGERED, at, message)
}
