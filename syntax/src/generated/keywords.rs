//! Sets of keywords.
//!
//! Made by `tests/generated.rs` from `mauve.ungram`: do not edit.
#![cfg_attr(rustfmt, rustfmt_skip)]

use crate::SyntaxKind;

/// `in`, `out`, `inout`.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    In,
    Out,
    InOut,
}

impl Direction {
    /// All of them, in the order of the grammar.
    pub const ALL: [Direction; 3] = [Direction::In, Direction::Out, Direction::InOut];

    /// Returns the keyword.
    pub fn keyword(self) -> &'static str {
        match self {
            Direction::In => "in",
            Direction::Out => "out",
            Direction::InOut => "inout",
        }
    }

    /// Returns the one with `keyword`.
    pub fn from_keyword(keyword: &str) -> Option<Direction> {
        Self::ALL.into_iter().find(|it| it.keyword() == keyword)
    }

    /// Returns the one whose keyword is a token of `kind`.
    pub fn from_kind(kind: SyntaxKind) -> Option<Direction> {
        match kind {
            SyntaxKind::IN_KW => Some(Direction::In),
            SyntaxKind::OUT_KW => Some(Direction::Out),
            SyntaxKind::INOUT_KW => Some(Direction::InOut),
            _ => None,
        }
    }
}

/// `configure`, `start`, `update`, `stop`, `cleanup`.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HookKind {
    Configure,
    Start,
    Update,
    Stop,
    Cleanup,
}

impl HookKind {
    /// All of them, in the order of the grammar.
    pub const ALL: [HookKind; 5] = [HookKind::Configure, HookKind::Start, HookKind::Update, HookKind::Stop, HookKind::Cleanup];

    /// Returns the keyword.
    pub fn keyword(self) -> &'static str {
        match self {
            HookKind::Configure => "configure",
            HookKind::Start => "start",
            HookKind::Update => "update",
            HookKind::Stop => "stop",
            HookKind::Cleanup => "cleanup",
        }
    }

    /// Returns the one with `keyword`.
    pub fn from_keyword(keyword: &str) -> Option<HookKind> {
        Self::ALL.into_iter().find(|it| it.keyword() == keyword)
    }

    /// Returns the one whose keyword is a token of `kind`.
    pub fn from_kind(kind: SyntaxKind) -> Option<HookKind> {
        match kind {
            SyntaxKind::CONFIGURE_KW => Some(HookKind::Configure),
            SyntaxKind::START_KW => Some(HookKind::Start),
            SyntaxKind::UPDATE_KW => Some(HookKind::Update),
            SyntaxKind::STOP_KW => Some(HookKind::Stop),
            SyntaxKind::CLEANUP_KW => Some(HookKind::Cleanup),
            _ => None,
        }
    }
}

/// `entry`, `run`, `handle`, `exit`.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MethodKind {
    Entry,
    Run,
    Handle,
    Exit,
}

impl MethodKind {
    /// All of them, in the order of the grammar.
    pub const ALL: [MethodKind; 4] = [MethodKind::Entry, MethodKind::Run, MethodKind::Handle, MethodKind::Exit];

    /// Returns the keyword.
    pub fn keyword(self) -> &'static str {
        match self {
            MethodKind::Entry => "entry",
            MethodKind::Run => "run",
            MethodKind::Handle => "handle",
            MethodKind::Exit => "exit",
        }
    }

    /// Returns the one with `keyword`.
    pub fn from_keyword(keyword: &str) -> Option<MethodKind> {
        Self::ALL.into_iter().find(|it| it.keyword() == keyword)
    }

    /// Returns the one whose keyword is a token of `kind`.
    pub fn from_kind(kind: SyntaxKind) -> Option<MethodKind> {
        match kind {
            SyntaxKind::ENTRY_KW => Some(MethodKind::Entry),
            SyntaxKind::RUN_KW => Some(MethodKind::Run),
            SyntaxKind::HANDLE_KW => Some(MethodKind::Handle),
            SyntaxKind::EXIT_KW => Some(MethodKind::Exit),
            _ => None,
        }
    }
}

/// `affinity`, `priority`, `period`, `deadline`.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ActivityField {
    Affinity,
    Priority,
    Period,
    Deadline,
}

impl ActivityField {
    /// All of them, in the order of the grammar.
    pub const ALL: [ActivityField; 4] = [ActivityField::Affinity, ActivityField::Priority, ActivityField::Period, ActivityField::Deadline];

    /// Returns the keyword.
    pub fn keyword(self) -> &'static str {
        match self {
            ActivityField::Affinity => "affinity",
            ActivityField::Priority => "priority",
            ActivityField::Period => "period",
            ActivityField::Deadline => "deadline",
        }
    }

    /// Returns the one with `keyword`.
    pub fn from_keyword(keyword: &str) -> Option<ActivityField> {
        Self::ALL.into_iter().find(|it| it.keyword() == keyword)
    }

    /// Returns the one whose keyword is a token of `kind`.
    pub fn from_kind(kind: SyntaxKind) -> Option<ActivityField> {
        match kind {
            SyntaxKind::AFFINITY_KW => Some(ActivityField::Affinity),
            SyntaxKind::PRIORITY_KW => Some(ActivityField::Priority),
            SyntaxKind::PERIOD_KW => Some(ActivityField::Period),
            SyntaxKind::DEADLINE_KW => Some(ActivityField::Deadline),
            _ => None,
        }
    }
}

/// `background`
pub const BACKGROUND: &str = "background";

/// `true`, `false`.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TruthValue {
    True,
    False,
}

impl TruthValue {
    /// All of them, in the order of the grammar.
    pub const ALL: [TruthValue; 2] = [TruthValue::True, TruthValue::False];

    /// Returns the keyword.
    pub fn keyword(self) -> &'static str {
        match self {
            TruthValue::True => "true",
            TruthValue::False => "false",
        }
    }

    /// Returns the one with `keyword`.
    pub fn from_keyword(keyword: &str) -> Option<TruthValue> {
        Self::ALL.into_iter().find(|it| it.keyword() == keyword)
    }

    /// Returns the one whose keyword is a token of `kind`.
    pub fn from_kind(kind: SyntaxKind) -> Option<TruthValue> {
        match kind {
            SyntaxKind::TRUE_KW => Some(TruthValue::True),
            SyntaxKind::FALSE_KW => Some(TruthValue::False),
            _ => None,
        }
    }
}

/// `new_data`, `old_data`, `no_data`.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PortStatus {
    NewData,
    OldData,
    NoData,
}

impl PortStatus {
    /// All of them, in the order of the grammar.
    pub const ALL: [PortStatus; 3] = [PortStatus::NewData, PortStatus::OldData, PortStatus::NoData];

    /// Returns the keyword.
    pub fn keyword(self) -> &'static str {
        match self {
            PortStatus::NewData => "new_data",
            PortStatus::OldData => "old_data",
            PortStatus::NoData => "no_data",
        }
    }

    /// Returns the one with `keyword`.
    pub fn from_keyword(keyword: &str) -> Option<PortStatus> {
        Self::ALL.into_iter().find(|it| it.keyword() == keyword)
    }

    /// Returns the one whose keyword is a token of `kind`.
    pub fn from_kind(kind: SyntaxKind) -> Option<PortStatus> {
        match kind {
            SyntaxKind::NEW_DATA_KW => Some(PortStatus::NewData),
            SyntaxKind::OLD_DATA_KW => Some(PortStatus::OldData),
            SyntaxKind::NO_DATA_KW => Some(PortStatus::NoData),
            _ => None,
        }
    }
}

/// `success`, `not_ready`, `failure`.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CallStatus {
    Success,
    NotReady,
    Failure,
}

impl CallStatus {
    /// All of them, in the order of the grammar.
    pub const ALL: [CallStatus; 3] = [CallStatus::Success, CallStatus::NotReady, CallStatus::Failure];

    /// Returns the keyword.
    pub fn keyword(self) -> &'static str {
        match self {
            CallStatus::Success => "success",
            CallStatus::NotReady => "not_ready",
            CallStatus::Failure => "failure",
        }
    }

    /// Returns the one with `keyword`.
    pub fn from_keyword(keyword: &str) -> Option<CallStatus> {
        Self::ALL.into_iter().find(|it| it.keyword() == keyword)
    }

    /// Returns the one whose keyword is a token of `kind`.
    pub fn from_kind(kind: SyntaxKind) -> Option<CallStatus> {
        match kind {
            SyntaxKind::SUCCESS_KW => Some(CallStatus::Success),
            SyntaxKind::NOT_READY_KW => Some(CallStatus::NotReady),
            SyntaxKind::FAILURE_KW => Some(CallStatus::Failure),
            _ => None,
        }
    }
}

/// Keywords that are literals.
pub const LITERALS: [&str; 8] = ["true", "false", "new_data", "old_data", "no_data", "success", "not_ready", "failure"];

/// Keywords that begin a declaration.
pub const DECLARATIONS: [&str; 9] = ["include", "library", "use", "codel", "shell", "core", "component", "architecture", "deployment"];

/// Keywords that begin an item of `architecture`.
pub const ARCHITECTURE_ITEMS: [&str; 6] = ["import", "instance", "connection", "operation", "property", "constant"];

/// Keywords that begin an item of `deployment`.
pub const DEPLOYMENT_ITEMS: [&str; 4] = ["architecture", "activity", "property", "constant"];

/// Keywords that begin an item of a declaration, a state machine or a state.
pub const ITEMS: [&str; 27] = ["activity", "architecture", "cleanup", "configure", "connection", "constant", "entry", "exit", "handle", "handler", "import", "initial", "input", "instance", "operation", "output", "property", "provide", "require", "run", "start", "state", "statemachine", "stop", "transition", "update", "var"];
