//! The messages about sample files.

use std::path::Path;

use mauve_pwcet::samples::{Damage, SamplesError};

/// Returns the message for a sample file that cannot be read.
pub(super) fn unreadable_samples(samples: &Path, error: &SamplesError) -> String {
    let shown = samples.display();
    match error {
        SamplesError::Io(error) => format!("cannot read `{shown}`: {error}"),
        SamplesError::NotSamples => {
            format!("`{shown}` is not a sample file: `mauve trace import` makes one from a trace")
        }
        SamplesError::Empty => {
            format!(
                "`{shown}` is empty: an import did not end, or the disk was full; remove it, and run `mauve trace import` again"
            )
        }
        SamplesError::LaterVersion => {
            format!("`{shown}` was written by a later version of mauve: update mauve")
        }
        error => samples_error(samples, error),
    }
}

/// Returns the message for a sample file that cannot be written.
pub(super) fn samples_error(samples: &Path, error: &SamplesError) -> String {
    let shown = samples.display();
    match error {
        SamplesError::Io(error) => format!("cannot write `{shown}`: {error}"),
        SamplesError::NotSamples | SamplesError::Empty => {
            format!(
                "`{shown}` is not a sample file, and is not overwritten: choose another path for --output"
            )
        }
        SamplesError::LaterVersion => {
            format!(
                "`{shown}` was written by a later version of mauve: update mauve, or choose another path for --output"
            )
        }
        SamplesError::Damaged { offset, damage } => {
            let how = match damage {
                Damage::Truncated => "a block ends too early",
                Damage::Checksum => "a checksum is wrong",
                Damage::Content => "a block is not valid",
            };
            format!(
                "`{shown}` is damaged at byte {offset}: {how}; restore the file, or import its traces into a new one"
            )
        }
        SamplesError::Locked => {
            format!(
                "another mauve imports into `{shown}`: wait for its end, or choose another path for --output"
            )
        }
        SamplesError::Duplicate { run } => {
            format!("`{shown}` has the same executions in run {}: a trace is imported once", run + 1)
        }
        SamplesError::Overlap { run } => format!(
            "`{shown}` has some of these executions in run {}: they would count twice; import the whole recording into a new file",
            run + 1
        ),
        SamplesError::Repeated { run } => format!(
            "`{shown}` has the executions of its run {} in common with another file: they would count twice; name one of the files",
            run + 1
        ),
        SamplesError::LongName => format!("a name in the trace is too long for `{shown}`"),
        SamplesError::TooMany => format!("`{shown}` is full: choose another path for --output"),
        SamplesError::UnknownSeries => format!("`{shown}` has changed: try again"),
    }
}
