//! # falling-time
//!
//! A timing table gives a shorter time at a stricter level. A time at 1e-4 is exceeded once in ten thousand executions,
//! one at 1e-3 once in a thousand, so it is the longer of the two, or as long. The figures are used as they stand, but one
//! of them is probably a mistake.
//!
//! ```mauve
//! codel plan(): int
//! codel land(): int
//! //- /mauve.toml
//! timing.tables = ["times.toml"]
//! //- /times.toml
//! levels = [1e-3, 1e-4, 1e-5]
//! [codel]
//! plan = [290, 97, 310]   # warning
//! land = [3, 3, 4]
//! ```

use mauve_timing::Level;

use super::*;

code!(FALLING_TIME, Warning, "falling-time");

pub(crate) fn report<'db>(
    at: Place<'db>,
    key: &str,
    (level, time): (Level, Time),
    (stricter, shorter): (Level, Time),
) -> Diagnostic<'db> {
    let message = format!(
        "`{key}` has {time} at {level} and only {shorter} at {stricter}: what is exceeded more rarely is not shorter"
    );
    Diagnostic::new(&FALLING_TIME, at, message)
}
