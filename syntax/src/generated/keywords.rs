//! Sets of keywords.
//!
//! Made by `tests/generated.rs` from `mauve.ungram`: do not edit.
#![cfg_attr(rustfmt, rustfmt_skip)]

use crate::SyntaxKind;

keyword_set! {
    /// `in`, `out`, `inout`.
    Direction {
        In "in" IN_KW;
        Out "out" OUT_KW;
        InOut "inout" INOUT_KW;
    }
}

keyword_set! {
    /// `configure`, `start`, `update`, `stop`, `cleanup`.
    HookKind {
        Configure "configure" CONFIGURE_KW;
        Start "start" START_KW;
        Update "update" UPDATE_KW;
        Stop "stop" STOP_KW;
        Cleanup "cleanup" CLEANUP_KW;
    }
}

keyword_set! {
    /// `entry`, `run`, `handle`, `exit`.
    MethodKind {
        Entry "entry" ENTRY_KW;
        Run "run" RUN_KW;
        Handle "handle" HANDLE_KW;
        Exit "exit" EXIT_KW;
    }
}

keyword_set! {
    /// `instances`, `thread`, `order`, `affinity`, `cpus`, `priority`, `preemptive`, `trigger`, `least`, `period`, `rate`, `burst`, `deadline`, `jitter`, `offset`.
    ActivityField {
        Instances "instances" INSTANCES_KW;
        Thread "thread" THREAD_KW;
        Order "order" ORDER_KW;
        Affinity "affinity" AFFINITY_KW;
        Cpus "cpus" CPUS_KW;
        Priority "priority" PRIORITY_KW;
        Preemptive "preemptive" PREEMPTIVE_KW;
        Trigger "trigger" TRIGGER_KW;
        Least "least" LEAST_KW;
        Period "period" PERIOD_KW;
        Rate "rate" RATE_KW;
        Burst "burst" BURST_KW;
        Deadline "deadline" DEADLINE_KW;
        Jitter "jitter" JITTER_KW;
        Offset "offset" OFFSET_KW;
    }
}

/// `background`
pub const BACKGROUND: &str = "background";

keyword_set! {
    /// `true`, `false`.
    TruthValue {
        True "true" TRUE_KW;
        False "false" FALSE_KW;
    }
}

keyword_set! {
    /// `new_data`, `old_data`, `no_data`.
    PortStatus {
        NewData "new_data" NEW_DATA_KW;
        OldData "old_data" OLD_DATA_KW;
        NoData "no_data" NO_DATA_KW;
    }
}

keyword_set! {
    /// `success`, `not_ready`, `failure`.
    CallStatus {
        Success "success" SUCCESS_KW;
        NotReady "not_ready" NOT_READY_KW;
        Failure "failure" FAILURE_KW;
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
