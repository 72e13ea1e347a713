//! Names that C++, RTT and its scripts can have: those of the model wherever they may be used there.

use std::sync::LazyLock;

use rustc_hash::FxHashSet;

/// Names that nothing of a model can have in C++: its keywords, those of later standards too, and macros of common headers.
const CPP_WORDS: [&str; 141] = [
    "alignas",
    "alignof",
    "and",
    "and_eq",
    "asm",
    "assert",
    "auto",
    "bitand",
    "bitor",
    "bool",
    "break",
    "case",
    "catch",
    "char",
    "char8_t",
    "char16_t",
    "char32_t",
    "class",
    "co_await",
    "co_return",
    "co_yield",
    "compl",
    "concept",
    "const",
    "const_cast",
    "consteval",
    "constexpr",
    "constinit",
    "continue",
    "decltype",
    "default",
    "delete",
    "do",
    "double",
    "dynamic_cast",
    "else",
    "enum",
    "explicit",
    "export",
    "extern",
    "false",
    "float",
    "for",
    "friend",
    "goto",
    "if",
    "inline",
    "int",
    "long",
    "mutable",
    "namespace",
    "new",
    "noexcept",
    "not",
    "not_eq",
    "nullptr",
    "operator",
    "or",
    "or_eq",
    "private",
    "protected",
    "public",
    "register",
    "reinterpret_cast",
    "requires",
    "return",
    "short",
    "signed",
    "sizeof",
    "static",
    "static_assert",
    "static_cast",
    "struct",
    "switch",
    "template",
    "this",
    "thread_local",
    "throw",
    "true",
    "try",
    "typedef",
    "typeid",
    "typename",
    "union",
    "unsigned",
    "using",
    "virtual",
    "void",
    "volatile",
    "wchar_t",
    "while",
    "xor",
    "xor_eq",
    "main",
    "linux",
    "unix",
    "i386",
    "errno",
    "stdin",
    "stdout",
    "stderr",
    "offsetof",
    "isnan",
    "isinf",
    "signbit",
    "major",
    "minor",
    "makedev",
    "NULL",
    "TRUE",
    "FALSE",
    "EOF",
    "BUFSIZ",
    "DEBUG",
    "NDEBUG",
    "ERROR",
    "INFINITY",
    "NAN",
    "RAND_MAX",
    "EXIT_SUCCESS",
    "EXIT_FAILURE",
    "INT_MAX",
    "INT_MIN",
    "UINT_MAX",
    "LONG_MAX",
    "LONG_MIN",
    "CHAR_MAX",
    "CHAR_MIN",
    "SHRT_MAX",
    "SHRT_MIN",
    "CHAR_BIT",
    "SIZE_MAX",
    "HUGE_VAL",
    "DOMAIN",
    "OVERFLOW",
    "UNDERFLOW",
    "SING",
    "PLOSS",
    "TLOSS",
    "CLOCKS_PER_SEC",
    "TIME_UTC",
];

/// Namespaces and functions that generated code names, which nothing in the namespace of a package may hide.
const OUTER_WORDS: [&str; 14] = [
    "std",
    "RTT",
    "ros",
    "boost",
    "mauve",
    "MauveTask",
    "log",
    "endlog",
    "trace",
    "mauve_trace",
    "mauve_component_span",
    "mauve_program_span",
    "size_t",
    "catkin",
];

/// Members of `RTT::TaskContext` and its bases, and what generated classes have beside what the model names.
const TASK_CONTEXT_MEMBERS: [&str; 102] = [
    "activate",
    "addAlias",
    "addAttribute",
    "addConstant",
    "addEventPort",
    "addLocalPort",
    "addLocalEventPort",
    "addOperation",
    "addOperationCaller",
    "addPeer",
    "addPort",
    "addProperty",
    "addSynchronousOperation",
    "alias",
    "attributes",
    "checkOperations",
    "cleanup",
    "cleanupHook",
    "clear",
    "configure",
    "configureHook",
    "connectPeers",
    "connectPorts",
    "connectServices",
    "dataOnPort",
    "dataOnPortCallback",
    "dataOnPortHook",
    "dataOnPortRemoved",
    "dataOnPortSize",
    "disconnect",
    "disconnectPeers",
    "doc",
    "ee",
    "engine",
    "error",
    "errorHook",
    "exception",
    "exceptionHook",
    "fatal",
    "forceActivity",
    "getActivity",
    "getConfiguration",
    "getCpuAffinity",
    "getName",
    "getOperation",
    "getPeer",
    "getPeerList",
    "getPeriod",
    "getPort",
    "getProperty",
    "getProvider",
    "getTargetState",
    "getTaskState",
    "getThread",
    "hasPeer",
    "inException",
    "inFatalError",
    "inRunTimeError",
    "isActive",
    "isConfigured",
    "isRunning",
    "localGet",
    "mTaskState",
    "MauveCall",
    "mauve_add_period_port",
    "mauve_add_state_port",
    "mauve_begin",
    "mauve_collect",
    "mauve_end",
    "mauve_makes_room",
    "mauve_may_start",
    "mauve_parse",
    "mauve_runs_as",
    "mauve_send",
    "mauve_set",
    "mauve_show_state",
    "mauve_started",
    "mauve_stopping",
    "operations",
    "our_act",
    "peers",
    "ports",
    "prepareProvide",
    "properties",
    "provides",
    "ready",
    "recover",
    "removePeer",
    "requires",
    "setActivity",
    "setCpuAffinity",
    "setPeriod",
    "start",
    "startHook",
    "stop",
    "stopHook",
    "tcservice",
    "trigger",
    "tcrequests",
    "update",
    "updateHook",
    "writeable",
];

/// Operations that every task has, functions and keywords of RTT's scripts, and of Lua: in scripts nothing is called so.
const SCRIPT_WORDS: [&str; 104] = [
    "mauve_period",
    "mauve_runs_as",
    "mauve_set",
    "activate",
    "cleanup",
    "configure",
    "error",
    "getCpuAffinity",
    "getPeriod",
    "inException",
    "inFatalError",
    "inRunTimeError",
    "isActive",
    "isConfigured",
    "isRunning",
    "loadService",
    "setCpuAffinity",
    "setPeriod",
    "start",
    "stop",
    "trigger",
    "update",
    "recover",
    "getName",
    "alias",
    "and",
    "any",
    "bool",
    "break",
    "call",
    "catch",
    "char",
    "const",
    "const_cast",
    "continue",
    "delete",
    "do",
    "double",
    "else",
    "end",
    "entry",
    "exit",
    "export",
    "false",
    "float",
    "for",
    "foreach",
    "function",
    "global",
    "handle",
    "if",
    "import",
    "in",
    "initial",
    "final",
    "int",
    "intended",
    "local",
    "nil",
    "not",
    "nothing",
    "or",
    "param",
    "preconditions",
    "program",
    "public",
    "private",
    "repeat",
    "require",
    "requires",
    "return",
    "RootMachine",
    "run",
    "select",
    "set",
    "StateMachine",
    "state",
    "SubMachine",
    "string",
    "task",
    "then",
    "this",
    "time",
    "to",
    "transition",
    "transitions",
    "true",
    "try",
    "uint",
    "until",
    "var",
    "void",
    "while",
    "with",
    "yield",
    "Deployer",
    "scripting",
    "collect",
    "collectIfDone",
    "define",
    "done",
    "elseif",
    "include",
    "send",
];

/// What the parser of RTT's scripts takes for a word of its own wherever a statement begins so, whatever follows.
const STATEMENT_PREFIXES: [&str; 11] = [
    "true",
    "false",
    "done",
    "yield",
    "nothing",
    "program",
    "function",
    "export",
    "RootMachine",
    "StateMachine",
    "SubMachine",
];

/// Services that every script finds where no task has their name, and variables of the scripts that are generated.
const GLOBAL_SERVICES: [&str; 11] = [
    "ros",
    "print",
    "os",
    "worked",
    "imported",
    "loaded",
    "values",
    "ready",
    "starts",
    "stopped",
    "all_is_well",
];

/// Devices of Windows: no file and no folder there can be called so, whatever its end and its case.
const DEVICES: [&str; 22] = [
    "con", "prn", "aux", "nul", "com1", "com2", "com3", "com4", "com5", "com6", "com7", "com8", "com9",
    "lpt1", "lpt2", "lpt3", "lpt4", "lpt5", "lpt6", "lpt7", "lpt8", "lpt9",
];

/// Macros of the headers that generated code includes, or a codel may: they mean something wherever they stand.
static MACROS: LazyLock<FxHashSet<&str>> = LazyLock::new(|| words(include_str!("cpp_name/macros.txt")));

/// What those headers declare outside of any namespace: no package can be called so.
static GLOBALS: LazyLock<FxHashSet<&str>> = LazyLock::new(|| words(include_str!("cpp_name/globals.txt")));

fn words(text: &'static str) -> FxHashSet<&'static str> {
    text.lines().filter(|line| !line.starts_with('#')).flat_map(str::split_whitespace).collect()
}

/// Does a name mean something to the compiler, or to its preprocessor, wherever it stands?
fn is_reserved(name: &str) -> bool {
    CPP_WORDS.contains(&name) || MACROS.contains(name)
}

/// The names of one place in C++, such as a class or a function: no two are the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct CppNames {
    taken: FxHashSet<String>,
}

impl CppNames {
    /// Of what stands in the namespace of a package.
    pub(crate) fn of_namespace() -> CppNames {
        CppNames { taken: OUTER_WORDS.map(str::to_owned).into_iter().collect() }
    }

    /// Of packages, each of which is a namespace.
    pub(crate) fn of_packages() -> CppNames {
        let mut names = CppNames::of_namespace();
        names.taken.extend(GLOBALS.iter().map(|&name| name.to_owned()));
        names
    }

    /// Of a class that derives from `RTT::TaskContext`.
    pub(crate) fn of_component() -> CppNames {
        let mut names = CppNames::of_namespace();
        names.taken.extend(TASK_CONTEXT_MEMBERS.map(str::to_owned));
        names
    }

    /// Nothing can be declared with this name here, which means something already.
    pub(crate) fn take(&mut self, name: &str) {
        self.taken.insert(name.to_owned());
    }

    /// Nothing can be declared here that would hide what this type of the user's begins with: `ns` and `T` in
    /// `ns::List<T*>`.
    pub(crate) fn take_type(&mut self, cpp: &str) {
        for name in cpp.split(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != ':') {
            let first = name.split("::").next().unwrap_or_default();
            if !first.is_empty() {
                self.take(first);
            }
        }
    }

    /// `name` as it can be declared here, which is then taken: itself, or with as many `_` behind it as it needs.
    pub(crate) fn declare(&mut self, name: &str) -> String {
        let mut name = as_identifier(name);
        // What becomes of one name never depends on whether there is the other.
        let bare = name.trim_end_matches('_');
        if bare != name && (is_reserved(bare) || OUTER_WORDS.contains(&bare)) {
            name += "0_";
        }
        while is_reserved(&name) || self.taken.contains(&name) {
            // Two of them in a row are the compiler's own.
            name += if name.ends_with('_') { "0_" } else { "_" };
        }
        self.taken.insert(name.clone());
        name
    }
}

/// The identifiers with two `_` in a row, or with one and a capital at their beginning, are the compiler's own; those with
/// these prefixes are macros of the libraries that generated code rests on.
pub(crate) fn as_identifier(name: &str) -> String {
    let mut name = name.to_owned();
    while name.contains("__") {
        name = name.replace("__", "_0_");
    }
    let prefixes = ["BOOST_", "RTT_", "ORO_", "ROS_", "MAUVE_", "TRACEPOINT_"];
    match name.starts_with('_') {
        true => format!("m{name}"),
        false if prefixes.iter().any(|prefix| name.starts_with(prefix)) => format!("m_{name}"),
        false => name,
    }
}

/// What a port, a property or an operation is called at run time: its own name, unless scripts use the word themselves, or
/// know no name that begins with `_`. Two names never become one.
pub(crate) fn script_name(name: &str) -> String {
    with_prefix(name, |bare| bare.starts_with('_')) + with_suffix(name)
}

/// What a task is called at run time, where also statements begin with its name.
pub(crate) fn task_name(name: &str) -> String {
    let is_taken = |bare: &str| {
        let begins_as_a_word = STATEMENT_PREFIXES.iter().any(|word| bare.starts_with(word));
        bare.starts_with('_') || begins_as_a_word || GLOBAL_SERVICES.contains(&bare)
    };
    with_prefix(name, is_taken) + with_suffix(name)
}

/// What is named after `name` on the disk: the name itself, unless it is that of a device. Two names never become one.
pub(crate) fn file_name(name: &str) -> String {
    let bare = name.trim_end_matches('_');
    let is_device = DEVICES.iter().any(|device| bare.eq_ignore_ascii_case(device));
    if is_device { format!("{name}_") } else { name.to_owned() }
}

/// `name` with one more `mal_` before it, where it cannot be used without.
fn with_prefix(name: &str, is_taken: impl Fn(&str) -> bool) -> String {
    let bare = name.trim_start_matches("mal_");
    if is_taken(bare) { format!("mal_{name}") } else { name.to_owned() }
}

/// `_`, where `name` is a word of scripts with as many of them as it has behind it already.
fn with_suffix(name: &str) -> &'static str {
    if SCRIPT_WORDS.contains(&name.trim_end_matches('_')) { "_" } else { "" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_the_same_whatever_else_is_declared() {
        for names in [["and", "and_", "log", "log_"], ["log_", "and_", "log", "and"]] {
            let mut all = CppNames::of_namespace();
            let declared: Vec<(&str, String)> = names.map(|name| (name, all.declare(name))).into();
            for (name, found) in declared {
                assert_eq!(found, CppNames::of_namespace().declare(name));
            }
        }
    }

    #[test]
    fn nothing_is_called_as_a_macro_or_a_global_function() {
        let mut names = CppNames::of_packages();
        let declared = ["system", "tm", "random", "EAGAIN", "M_PI", "TRUE", "BOOST_FOREACH", "motion"]
            .map(|it| names.declare(it));
        let expected =
            ["system_", "tm_", "random_", "EAGAIN_", "M_PI_", "TRUE_", "m_BOOST_FOREACH", "motion"];
        assert_eq!(declared, expected);
        // In the namespace of a package a function may be called as a global one.
        assert_eq!(CppNames::of_namespace().declare("random"), "random");
    }

    #[test]
    fn no_name_hides_a_type() {
        let mut names = CppNames::of_namespace();
        names.take_type("ns::List<T*, ::other::U>");
        let declared = ["ns", "List", "T", "other", "U"].map(|name| names.declare(name));
        assert_eq!(declared, ["ns_", "List", "T_", "other", "U"]);
    }

    #[test]
    fn names_stay_what_they_are_where_they_can() {
        let mut names = CppNames::of_component();
        let declared = ["scan", "start", "class", "scan", "scan", "_", "__x", "RTT", "a__b"]
            .map(|name| names.declare(name));
        assert_eq!(
            declared,
            ["scan", "start_", "class_", "scan_", "scan_0_", "m_", "m_0_x", "RTT_", "a_0_b"]
        );
        assert_eq!(script_name("scan"), "scan");
        assert_eq!(script_name("start"), "start_");
        assert_eq!(script_name("true_heading"), "true_heading");
        assert_eq!(script_name("_x"), "mal__x");
        assert_eq!(task_name("laser"), "laser");
        assert_eq!(task_name("true_heading"), "mal_true_heading");
        assert_eq!(task_name("ros"), "mal_ros");
    }

    #[test]
    fn no_file_is_called_as_a_device() {
        let names = ["con", "Aux", "LPT9", "con_", "con__", "com0", "com10", "console", "_con", "nul1"];
        let files = names.map(file_name);
        let expected =
            ["con_", "Aux_", "LPT9_", "con__", "con___", "com0", "com10", "console", "_con", "nul1"];
        assert_eq!(files, expected);
        // In C++ they are two as well.
        let mut all = CppNames::of_namespace();
        assert_eq!(["con", "con_"].map(|name| all.declare(&file_name(name))), ["con_", "con_0_"]);
    }

    #[test]
    fn no_two_names_are_one_in_scripts() {
        let parts = ["start", "_", "mal_", "ros", "done", "x", "true", "end"];
        let mut names: Vec<String> = vec![String::new()];
        for _ in 0..4 {
            let longer = names.iter().flat_map(|name| parts.map(|part| format!("{name}{part}")));
            names = longer.chain(names.clone()).collect();
        }
        let names: FxHashSet<String> = names.into_iter().filter(|name| !name.is_empty()).collect();
        for mangle in [script_name, task_name] {
            let mangled: FxHashSet<String> = names.iter().map(|name| mangle(name)).collect();
            assert_eq!(mangled.len(), names.len());
        }
    }
}
