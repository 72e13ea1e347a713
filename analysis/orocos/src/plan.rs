//! What has to be done to a folder so that it holds these packages, and nothing of the user's is lost.

use crate::package::Package;

/// What has to be done, step by step.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Plan {
    /// In the order of the paths within each package. None: everything is as it should be.
    pub steps: Vec<Step>,
    /// Generated files that somebody edited since: their paths. Unless it is forced, nothing is to be done while there are any.
    pub edited: Vec<String>,
    /// Codels whose prototype changed, and whose file was not yet written anew by the user.
    pub changed_codels: Vec<ChangedCodel>,
}

/// A file that is made, changed or removed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// From the folder of the packages, with `/` between its parts.
    pub path: String,
    /// What is done.
    pub action: Action,
}

/// What is done to a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// It is not there, and gets this text.
    Create(String),
    /// It gets this text instead of its own.
    Change(String),
    /// It goes.
    Remove,
}

/// A codel whose prototype is another than that which the user's file was written for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedCodel {
    /// The user's file, from the folder of the packages.
    pub path: String,
    /// What it was written for.
    pub before: String,
    /// What the model says now.
    pub now: String,
}

/// What has to be done so that a folder holds `packages`. `read` gives the text of a file of it, by its path there; nothing
/// where there is none.
///
/// # Errors
///
/// What `read` says of a file that cannot be read, or why a manifest cannot be understood.
pub fn plan(
    _packages: &[Package],
    _read: &dyn Fn(&str) -> Result<Option<String>, String>,
) -> Result<Plan, String> {
    Ok(Plan::default())
}
