//! # never-triggered
//!
//! Data at a port that `trigger` names releases an activity, and nothing writes it: no connection and no topic of ROS 2 leads to the
//! port, or the core of the writer never writes its port. The activity never executes.
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
//! Connect the port to an output that is written, name its topic in `[ros2] topics` of mauve.toml, or give the activity a period.

use super::*;

pub(super) fn report<'db>(
    at: Location<'db>,
    [instance, port]: [&str; 2],
    writer: Option<&(Name, Name)>,
) -> Diagnostic<'db> {
    let why = match writer {
        Some((writer, output)) => format!("`{writer}` never writes `{output}`, which is connected to it"),
        None => "no connection leads to it: connect it, name its topic in `[ros2] topics`, or write a `period`".to_owned(),
    };
    let message = format!("nothing releases `{instance}`: data at `{port}` does, and {why}");
    Diagnostic::new(&NEVER_TRIGGERED, at, message)
}
