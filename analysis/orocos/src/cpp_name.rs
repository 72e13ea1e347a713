//! Names for C++, RTT and its scripts: the names of the model unless they are reserved. Users write scripts of their own, and
//! lines at the prompt of the deployer.

use std::sync::LazyLock;

use rustc_hash::FxHashSet;

type WordSet = LazyLock<FxHashSet<&'static str>>;

/// Keywords of C++ and macros of the headers that generated code or a codel may include: reserved in every scope.
static RESERVED: WordSet = LazyLock::new(|| {
    words(concat!(include_str!("cpp_name/keywords.txt"), include_str!("cpp_name/macros.txt")))
});

/// Keywords of C++.
static KEYWORDS: WordSet = LazyLock::new(|| words(include_str!("cpp_name/keywords.txt")));

/// Names outside of any namespace in those headers: no package can have one.
static GLOBALS: WordSet = LazyLock::new(|| words(include_str!("cpp_name/globals.txt")));

/// Names that generated code uses, and that no declaration in the namespace of a package may hide.
static OUTER_WORDS: WordSet = LazyLock::new(|| words(include_str!("cpp_name/namespace.txt")));

/// Members of every generated class and of its bases.
static MEMBERS: WordSet = LazyLock::new(|| words(include_str!("cpp_name/members.txt")));

/// Names that are reserved in scripts.
static SCRIPT_WORDS: WordSet = LazyLock::new(|| words(include_str!("cpp_name/scripts.txt")));

/// Words that the parser of RTT's scripts recognises at the beginning of a statement, whatever follows them.
static STATEMENT_PREFIXES: WordSet = LazyLock::new(|| {
    words("true false done yield nothing program function export RootMachine StateMachine SubMachine")
});

/// Global services of scripts, which a task of the same name would hide.
static GLOBAL_SERVICES: WordSet = LazyLock::new(|| words("ros print os"));

/// Devices of Windows: no file or folder there can have such a name, whatever its extension and its case.
static DEVICES: WordSet = LazyLock::new(|| {
    words(
        "con prn aux nul com1 com2 com3 com4 com5 com6 com7 com8 com9 lpt1 lpt2 lpt3 lpt4 lpt5 lpt6 lpt7 lpt8 lpt9",
    )
});

fn words(text: &'static str) -> FxHashSet<&'static str> {
    text.lines().filter(|line| !line.starts_with('#')).flat_map(str::split_whitespace).collect()
}

/// The names of one scope in C++, such as a class or a function: no two are the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct CppNames<'o> {
    /// The scope around this one, whose names are taken as well.
    outer: Option<&'o CppNames<'o>>,
    /// Names that are reserved in every scope of this kind.
    reserved: Vec<&'static FxHashSet<&'static str>>,
    taken: FxHashSet<String>,
}

impl<'o> CppNames<'o> {
    /// Returns the scope of the namespace of a package.
    pub(crate) fn of_namespace() -> CppNames<'o> {
        CppNames { reserved: vec![&OUTER_WORDS], ..CppNames::default() }
    }

    /// Returns the scope of packages: each is a global namespace.
    pub(crate) fn of_packages() -> CppNames<'o> {
        CppNames { reserved: vec![&OUTER_WORDS, &GLOBALS], ..CppNames::default() }
    }

    /// Returns the scope of a class that derives from `RTT::TaskContext`.
    pub(crate) fn of_component() -> CppNames<'o> {
        CppNames { reserved: vec![&OUTER_WORDS, &MEMBERS], ..CppNames::default() }
    }

    /// Returns a scope within this one, such as that of a member function. It costs nothing, however many names this one has.
    pub(crate) fn inner(&self) -> CppNames<'_> {
        CppNames { outer: Some(self), ..CppNames::default() }
    }

    fn is_taken(&self, name: &str) -> bool {
        self.taken.contains(name)
            || self.reserved.iter().any(|words| words.contains(name))
            || self.outer.is_some_and(|outer| outer.is_taken(name))
    }

    /// Reserves a name that is already in use.
    pub(crate) fn take(&mut self, name: &str) {
        self.taken.insert(name.to_owned());
    }

    /// Frees a name that was declared here.
    pub(crate) fn free(&mut self, name: &str) {
        self.taken.remove(name);
    }

    /// Reserves the names that the user's type refers to: `ns` and `T` in `ns::List<T*>`.
    pub(crate) fn take_type(&mut self, cpp: &str) {
        for name in cpp.split(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != ':') {
            let first = name.split("::").next().unwrap_or_default();
            if !first.is_empty() {
                self.take(first);
            }
        }
    }

    /// Returns a name that can be declared here, and reserves it: `name`, followed by `_` as often as needed.
    pub(crate) fn declare(&mut self, name: &str) -> String {
        let mut name = as_identifier(name);
        // The result for a name must not depend on other names.
        let bare = name.trim_end_matches('_');
        if bare != name && (RESERVED.contains(bare) || OUTER_WORDS.contains(bare)) {
            name += "0_";
        }
        while RESERVED.contains(name.as_str()) || self.is_taken(&name) {
            // Names with two consecutive `_` are reserved.
            name += if name.ends_with('_') { "0_" } else { "_" };
        }
        self.taken.insert(name.clone());
        name
    }
}

/// Identifiers with two consecutive `_`, or with a leading `_` and a capital letter, are reserved for the compiler;
/// those with these prefixes are macros of the libraries that generated code uses.
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

/// Returns the run-time name of a port, a property or an operation: its own name, unless it is reserved in scripts or
/// begins with `_`. Distinct names stay distinct.
pub(crate) fn script_name(name: &str) -> String {
    with_prefix(name, |bare| bare.starts_with('_')) + with_suffix(name)
}

/// Returns the name that an instance has in Orocos and in recordings of it: that of a task, with which statements of scripts may begin.
pub fn task_name(name: &str) -> String {
    let is_taken = |bare: &str| {
        let begins_as_a_word = STATEMENT_PREFIXES.iter().any(|word| bare.starts_with(word));
        bare.starts_with('_') || begins_as_a_word || GLOBAL_SERVICES.contains(bare)
    };
    with_prefix(name, is_taken) + with_suffix(name)
}

/// Returns whether a name is a keyword of C++.
pub(crate) fn is_keyword(name: &str) -> bool {
    KEYWORDS.contains(name)
}

/// Returns the name of a field or a constant of a message in C++: that of ROS's headers, with a `_` where C++ does not allow
/// it in a struct with the name `message`.
pub(crate) fn field_name(name: &str, message: &str) -> String {
    let is_taken = is_keyword(name) || name == message || name == "std";
    if is_taken { format!("{name}_") } else { name.to_owned() }
}

/// Returns the file name for `name`: the name itself, unless it is a device of Windows. Distinct names stay distinct.
pub(crate) fn file_name(name: &str) -> String {
    let bare = name.trim_end_matches('_');
    let is_device = DEVICES.iter().any(|device| bare.eq_ignore_ascii_case(device));
    if is_device { format!("{name}_") } else { name.to_owned() }
}

/// Returns `name` with a further prefix `mal_` if it cannot be used without.
fn with_prefix(name: &str, is_taken: impl Fn(&str) -> bool) -> String {
    let bare = name.trim_start_matches("mal_");
    if is_taken(bare) { format!("mal_{name}") } else { name.to_owned() }
}

/// Returns `_` if `name` without trailing `_` is reserved in scripts.
fn with_suffix(name: &str) -> &'static str {
    if SCRIPT_WORDS.contains(name.trim_end_matches('_')) { "_" } else { "" }
}

/// Returns the name of a host in the names of programs and nodes, which have letters, digits and `_`. Distinct names stay distinct.
pub(crate) fn host_name(host: &str) -> String {
    let letters = |it: char| match it {
        'a'..='z' | 'A'..='Z' | '0'..='9' => it.to_string(),
        '_' => "__".to_owned(),
        other => format!("_u{:x}_", u32::from(other)),
    };
    host.chars().map(letters).collect()
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
    fn fields_have_the_names_of_ros() {
        let names = ["header", "ERROR", "start", "class", "std", "Pose"].map(|name| field_name(name, "Pose"));
        assert_eq!(names, ["header", "ERROR", "start", "class_", "std_", "Pose_"]);
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
