//! The functions that every program can call: their names, operands and what they give. All that reads, checks, shows or
//! translates a call of one asks here.

use std::fmt;

use crate::item_tree::{FeatureKind, Name};

/// A function that every program can call. A codel of the same name comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
pub enum Builtin {
    /// `read(input port, variable)`: takes the value of a port, and gives its status.
    Read,
    /// `write(output port, value)`
    Write,
    /// `status(input port)`: gives the status of a port.
    Status,
    /// `send(required operation, values…)`: starts a call, and gives a handler.
    Send,
    /// `collect(handler, variables…)`: asks for the results of a call, and gives its status.
    Collect,
}

/// What the first argument of a built-in function names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// A port; the other direction is an error of its own.
    Port(FeatureKind),
    /// A required operation.
    Operation,
    /// A handler of the core.
    Handler,
}

impl Builtin {
    /// All of them, in the order in which they are listed for a user.
    pub const ALL: [Builtin; 5] =
        [Builtin::Read, Builtin::Write, Builtin::Status, Builtin::Send, Builtin::Collect];

    /// The function of this name.
    ///
    /// ```
    /// use mauve_hir::Builtin;
    /// assert_eq!(Builtin::of_name("send"), Some(Builtin::Send));
    /// assert_eq!(Builtin::of_name("plan"), None);
    /// ```
    pub fn of_name(name: &str) -> Option<Builtin> {
        Builtin::ALL.into_iter().find(|builtin| builtin.name() == name)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Builtin::Read => "read",
            Builtin::Write => "write",
            Builtin::Status => "status",
            Builtin::Send => "send",
            Builtin::Collect => "collect",
        }
    }

    /// What its first argument names.
    pub fn operand(self) -> Operand {
        match self {
            Builtin::Read | Builtin::Status => Operand::Port(FeatureKind::Input),
            Builtin::Write => Operand::Port(FeatureKind::Output),
            Builtin::Send => Operand::Operation,
            Builtin::Collect => Operand::Handler,
        }
    }

    /// Whether its first argument may be a feature of this kind. A port of the wrong direction counts: what is meant is
    /// clear, and the direction is reported.
    pub fn takes(self, kind: FeatureKind) -> bool {
        match self.operand() {
            Operand::Port(_) => kind.is_port(),
            Operand::Operation => kind == FeatureKind::Required,
            Operand::Handler => false,
        }
    }

    /// The names of all of them.
    pub fn names() -> [Name; 5] {
        Builtin::ALL.map(|builtin| Name::from(builtin.name()))
    }
}

impl fmt::Display for Builtin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
