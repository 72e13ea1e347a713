//! The severity of a diagnostic.

/// The severities of diagnostics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The model is invalid.
    Error,
    /// The model is valid, but may not behave as intended.
    Warning,
    /// The model can be improved.
    Hint,
}

impl Severity {
    /// Returns `error`, `warning` or `hint`.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Hint => "hint",
        }
    }
}
