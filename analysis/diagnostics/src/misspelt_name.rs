//! # misspelt-name
//!
//! A type or a message package is unknown, and its name is similar to a known one. A type that is not similar to any has
//! the hint `unknown-type`, since a model may use types that only its codels know.
//!
//! ```mauve
//! library a { use geometry_msg }   // warning
//! library b {
//!   use nav_msgs
//!   codel locate(out here: Odometri): bol   // warning // warning
//! }
//! ```
//!
//! The names of types in other languages count too:
//!
//! ```mauve
//! library a {
//!   shell S { output port name: std::string  output port count: integer }   // warning // warning
//! }
//! ```
//!
//! Fix: change the name, everywhere in its library. Where the name is right, declare it in `mauve.toml`:
//!
//! ```toml
//! [types.Odometri]
//! cpp = "odo::Metri"
//! header = "odo.h"
//! ```

use super::*;
use mauve_syntax::is_nearest;
use mauve_hir::{C_TYPES, LANGUAGE_TYPES, catalogue_of, data, external_types, message_of, package, used_packages};

/// Reports the unknown type `ty`, which may be a misspelling of `near`.
pub(super) fn of_type<'db>(scope: Scope<'db>, at: Location<'db>, ty: &TypeRef, near: &str) -> Diagnostic<'db> {
    let Scope { db, project, of } = scope;
    let same_library = |decl: &&Decl<'db>| decl.library(db) == of.library(db);
    let mut edits = Vec::new();
    for &decl in names_of(db, project).all.iter().filter(same_library) {
        let types = data(db, decl).as_deref().into_iter().flat_map(|it| it.types());
        // Only a result may be `void`.
        let same = types.filter(|(it, takes_void)| it.path == ty.path && (*takes_void || near != "void"));
        edits.extend(same.map(|(it, _)| (Location::Source(decl, it.id), near.to_owned())));
    }
    if !edits.iter().any(|(edited, _)| *edited == at) {
        let message = format!("unknown type `{ty}`: `{near}` is only a result type");
        return Diagnostic::new(&MISSPELT_NAME, at, message);
    }
    let message = format!("unknown type `{ty}`: did you mean `{near}`?");
    let mut found = Diagnostic::new(&MISSPELT_NAME, at, message);
    found.fixes.push(Fix { title: format!("Change to `{near}`"), edits });
    found
}

/// Reports the unknown package `name`, which may be a misspelling of `near`.
pub(super) fn of_package<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    name: &str,
    near: Name,
) -> Diagnostic<'db> {
    let message = format!("no library or message package `{name}`");
    let cause = match &at {
        Location::Source(of, _) => Some(Cause::NotUsed(of.library(db).clone(), near.clone())),
        _ => None,
    };
    let found = Diagnostic::new(&MISSPELT_NAME, at, message).did_you_mean(Some(near)).caused_by(cause);
    of_letter_case(db, project, name, &found).unwrap_or(found)
}

impl<'db> Scope<'db> {
    /// Returns the location of a `use`, in the library, that is most likely a misspelling of `library`.
    pub(super) fn misspelt_use(self, library: &Name) -> Option<Location<'db>> {
        let Scope { db, project, of } = self;
        let files = project_files(db, project).iter();
        let mut uses = files.flat_map(|&file| &declarations(db, file).all).copied().filter(|it| {
            it.kind(db) == Kind::Use && it.library(db) == of.library(db)
        });
        let is_unknown = |name: &Name| {
            !names_of(db, project).has_library(name) && package(db, project.workspace(db), name).is_none()
        };
        let found = uses.find(|it| {
            is_unknown(it.name(db)) && similar_package(db, project, it.name(db)).as_ref() == Some(library)
        });
        found.map(Location::name_of)
    }

    /// Returns the type that `path` is most likely a misspelling of: a built-in type, a message of a package that the library uses, or a
    /// type that `mauve.toml` declares.
    pub(super) fn similar_type(self, path: &[Name]) -> Option<String> {
        let Scope { db, project, of } = self;
        let workspace = project.workspace(db);
        match path {
            [name] => {
                let used = used_packages(db, project).get(of.library(db)).into_iter().flatten();
                let messages = used.filter_map(|of| package(db, workspace, of)).flat_map(|it| it.messages.keys());
                let candidates = messages.chain(external_types(db, workspace).keys());
                // `booxl` is nearer to `bool` than to the message `Bool`.
                let built_ins = || LANGUAGE_TYPES.iter().map(|(it, _)| *it);
                let own = similar(name, candidates).filter(|near| is_nearest(name, near, built_ins()));
                let own = || own.map(|near| near.to_string());
                exact_built_in(name).map(str::to_owned).or_else(own).or_else(|| similar_built_in(name))
            }
            [of_std, name] if of_std == "std" => built_in(name).map(str::to_owned),
            [of_package, .., name] => {
                let declares = |it: &Name| package(db, workspace, it).is_some_and(|it| it.messages.contains_key(name));
                let known = package(db, workspace, of_package);
                let near = similar(name, known.into_iter().flat_map(|it| it.messages.keys()));
                if let Some(near) = near {
                    return Some(format!("{of_package}.{near}"));
                }
                if known.is_none() && message_of(db, project, of.library(db).as_ref(), std::slice::from_ref(name)).is_some() {
                    return Some(name.to_string());
                }
                let near = similar_package(db, project, of_package).filter(declares)?;
                Some(format!("{near}.{name}"))
            }
            [] => None,
        }
    }
}

/// The names of libraries that a project has in several letter cases, by the name in lower case: each with its places, which are
/// the library in each file, and its `use`s.
#[salsa::tracked(returns(ref))]
fn letter_cases<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> FxHashMap<String, Vec<(Name, Vec<Location<'db>>)>> {
    let mut all: FxHashMap<String, Vec<(Name, Vec<Location<'db>>)>> = FxHashMap::default();
    let mut add = |name: &Name, at: Location<'db>| {
        let spellings = all.entry(name.to_lowercase()).or_default();
        match spellings.iter_mut().find(|(known, _)| known == name) {
            Some((_, places)) => places.push(at),
            None => spellings.push((name.clone(), vec![at])),
        }
    };
    for &file in project_files(db, project) {
        let mut seen = FxHashSet::default();
        for &decl in &declarations(db, file).all {
            if decl.kind(db) == Kind::Use {
                add(decl.name(db), Location::name_of(decl));
            }
            decl.library(db).iter().filter(|it| seen.insert(*it)).for_each(|it| add(it, Location::Library(decl)));
        }
    }
    all.retain(|_, spellings| spellings.len() > 1);
    all
}

/// Returns the diagnostic that stands for `found`, and for all others that follow, where the project has the name of `library` in
/// several letter cases, and the rarest is that of a library: `library Motion` beside `library motion`, or beside several
/// `use motion`.
pub(super) fn of_letter_case<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: &str,
    found: &Diagnostic<'db>,
) -> Option<Diagnostic<'db>> {
    let key = library.to_lowercase();
    let spellings = letter_cases(db, project).get(&key)?;
    let frequency = |it: &&(Name, Vec<Location<'db>>)| (it.1.len(), it.0.clone());
    let (right, _) = spellings.iter().max_by_key(frequency)?;
    let (wrong, places) = spellings.iter().min_by_key(frequency)?;
    let at = places.iter().find(|at| matches!(at, Location::Library(_)))?;
    let message =
        format!("library `{wrong}` differs from `{right}` only in letter case; did you mean `{right}`?");
    let mut report = Diagnostic::new(found.code, at.clone(), message).related(&found.at, cause::FOLLOWS);
    let edits = places.iter().map(|at| (at.clone(), right.to_string())).collect();
    report.fixes.push(Fix { title: format!("Change to `{right}`"), edits });
    Some(report.caused_by(Some(Cause::LetterCase(key))))
}

/// Returns the built-in type that a type of another language is called like: `String`, `integer`, `f64`.
fn exact_built_in(name: &str) -> Option<&'static str> {
    let foreign = |it: &&(&str, &'static str)| name.eq_ignore_ascii_case(it.0);
    let language = LANGUAGE_TYPES.iter().map(|(it, _)| *it).find(|it| name.eq_ignore_ascii_case(it));
    language.or_else(|| FOREIGN.iter().find(foreign).map(|(_, own)| *own))
}

/// Returns whether `name` is more likely a built-in type than a message of that name.
pub(super) fn is_built_in(name: &str) -> bool {
    exact_built_in(name).is_some()
}

/// Names of types in other languages, with the built-in type.
const FOREIGN: [(&str, &str); 19] = [
    ("integer", "int"),
    ("signed", "int"),
    ("unsigned", "uint"),
    ("str", "string"),
    ("text", "string"),
    ("real", "double"),
    ("f32", "float"),
    ("f64", "double"),
    ("i8", "int8"),
    ("i16", "int16"),
    ("i32", "int32"),
    ("i64", "int64"),
    ("u8", "uint8"),
    ("u16", "uint16"),
    ("u32", "uint32"),
    ("u64", "uint64"),
    ("usize", "size_t"),
    ("none", "void"),
    ("unit", "void"),
];

fn built_in(name: &str) -> Option<&'static str> {
    let mut all = LANGUAGE_TYPES.iter().chain(&C_TYPES).map(|(it, _)| *it);
    all.find(|it| *it == name)
}

/// Returns the built-in type of which `name` is a misspelling. A misspelt word begins with the right letter: `Joint` is not
/// a misspelling of `int`.
fn similar_built_in(name: &str) -> Option<String> {
    let lower = name.to_lowercase();
    let first = lower.chars().next()?;
    let all = LANGUAGE_TYPES.iter().chain(&C_TYPES).map(|(it, _)| Name::from(*it));
    let candidates: Vec<Name> = all.filter(|it| it.starts_with(first)).collect();
    if candidates.iter().any(|it| *it == lower.as_str()) {
        return Some(lower);
    }
    similar(&lower, &candidates).map(|near| near.to_string())
}

/// Returns the library or the message package that `name` is most likely a misspelling of. Packages of different versions,
/// such as `nav_msgs` and `nav2_msgs`, are different packages.
pub(super) fn similar_package<'db>(db: &'db dyn ModelDb, project: Project<'db>, name: &str) -> Option<Name> {
    let known = known_packages(db, project).get(&digits(name))?;
    // All packages of messages end alike: `arm_msgs` is not a misspelling of `nav_msgs`.
    let own = stem(name);
    known.by_stem.get(own).or_else(|| known.by_stem.get(&similar(own, &known.stems)?)).cloned()
}

/// The libraries and the message packages of one version.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct KnownPackages {
    stems: Vec<Name>,
    /// The first package of each stem.
    by_stem: FxHashMap<Name, Name>,
}

/// Returns the libraries and the message packages that a project knows, by the digits in their names.
#[salsa::tracked(returns(ref))]
fn known_packages<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> FxHashMap<String, KnownPackages> {
    let mut known: FxHashMap<String, KnownPackages> = FxHashMap::default();
    for package in names_of(db, project).libraries().chain(catalogue_of(db, project.workspace(db)).keys()) {
        let of_version = known.entry(digits(package)).or_default();
        let stem = Name::from(stem(package));
        of_version.stems.push(stem.clone());
        of_version.by_stem.entry(stem).or_insert_with(|| package.clone());
    }
    known
}

fn digits(package: &str) -> String {
    package.chars().filter(char::is_ascii_digit).collect()
}

fn stem(package: &str) -> &str {
    ["_msgs", "_msg", "_messages", "_message"].iter().find_map(|end| package.strip_suffix(end)).unwrap_or(package)
}
