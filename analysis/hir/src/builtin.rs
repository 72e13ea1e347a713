//! The built-in functions: their names and operands.

use std::fmt;

use crate::item_tree::FeatureKind;

/// A function that every program can call. A codel of the same name takes precedence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub enum Builtin {
    /// `read(input port, variable)`: reads a port, and returns its status.
    Read,
    /// `write(output port, value)`
    Write,
    /// `status(input port)`: returns the status of a port.
    Status,
    /// `send(required operation, values…)`: starts a call, and returns a handle.
    Send,
    /// `collect(handler, variables…)`: reads the results of a call, and returns its status.
    Collect,
}

/// The kind of the first argument of a built-in function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// A port; a wrong direction is a separate error.
    Port(FeatureKind),
    /// A required operation.
    Operation,
    /// A handler of the core.
    Handler,
}

impl Builtin {
    /// All functions, in the order of lists for users.
    pub const ALL: [Builtin; 5] =
        [Builtin::Read, Builtin::Write, Builtin::Status, Builtin::Send, Builtin::Collect];

    /// Returns the function of this name.
    ///
    /// ```
    /// use mauve_hir::Builtin;
    /// assert_eq!(Builtin::of_name("send"), Some(Builtin::Send));
    /// assert_eq!(Builtin::of_name("plan"), None);
    /// ```
    pub fn of_name(name: &str) -> Option<Builtin> {
        Builtin::ALL.into_iter().find(|builtin| builtin.name() == name)
    }

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Builtin::Read => "read",
            Builtin::Write => "write",
            Builtin::Status => "status",
            Builtin::Send => "send",
            Builtin::Collect => "collect",
        }
    }

    /// Returns the kind of its first argument.
    pub fn operand(self) -> Operand {
        match self {
            Builtin::Read | Builtin::Status => Operand::Port(FeatureKind::Input),
            Builtin::Write => Operand::Port(FeatureKind::Output),
            Builtin::Send => Operand::Operation,
            Builtin::Collect => Operand::Handler,
        }
    }

    /// Returns whether its first argument may be a feature of this kind. A port of the wrong direction counts, so that only
    /// the direction is reported.
    pub fn takes(self, kind: FeatureKind) -> bool {
        match self.operand() {
            Operand::Port(_) => kind.is_port(),
            Operand::Operation => kind == FeatureKind::Required,
            Operand::Handler => false,
        }
    }
}

impl fmt::Display for Builtin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
