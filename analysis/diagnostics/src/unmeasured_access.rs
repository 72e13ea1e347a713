//! # unmeasured-access
//!
//! Activities of a deployment read or write ports whose values are larger than 256 bytes, or of variable size, such as images. No
//! timing table has a time for that, so that the response times count it as nothing. Copying an image of 6 MB takes milliseconds.
//!
//! ```mauve
//! library robot {
//!   use sensor_msgs
//!   codel grab(out image: Image): bool
//!   shell S { output port frame: Image }
//!   core C(S) { var i: Image; update = { if grab(i) then { write(frame, i); } else { } } }
//!   component Camera(S, C)
//!   architecture Robot { instance camera: Camera }
//!   deployment Run { architecture Robot  activity camera { priority = 20  period = 20 } }   // warning
//! }
//! //- /mauve.toml
//! timing.tables = ["times.toml"]
//! //- /times.toml
//! [codel]
//! "robot.grab" = 9.5
//! ```
//!
//! `mauve run --trace` and generated packages record what each access takes, and `mauve pwcet` writes it under `[access]` in the
//! timing table: `"robot.Camera.frame" = 1.1`. A time of 0 says that the times of the codels contain it.

use super::*;
use crate::lists::enumerated;

/// The number of ports that the message names.
const MOST_PORTS: usize = 3;

pub(super) fn report<'db>(at: Location<'db>, ports: &[String]) -> Diagnostic<'db> {
    let mut names: Vec<String> = ports.iter().take(MOST_PORTS).map(|port| format!("`{port}`")).collect();
    let more = ports.len() - names.len();
    names.extend((more > 0).then(|| format!("{more} more")));
    let message = format!(
        "reads and writes of {} copy large values, or values of variable size, and count as nothing: no timing table has `[access]` for \
         them",
        enumerated(&names)
    );
    Diagnostic::new(&UNMEASURED_ACCESS, at, message)
}
