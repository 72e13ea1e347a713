//! Message packages: the types of a `use` that names no library.
//!
//! Installed packages are read from their `.msg` files, of ROS 1 or ROS 2. The common packages are built in, so that models can be
//! analysed without an installation of ROS: `messages/ros2.txt` for a project with `[ros2]`, `messages/catalogue.txt` for others.

use crate::msg::{Message, Package, read_message};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::item_tree::{Kind, Name};
use crate::project::{Project, config_of, group_in, groups_of, is_model, project_files};
use crate::source::{declarations, item_tree_of};
use crate::{File, ModelDb, Workspace};

/// Returns the built-in packages of ROS 1, by name, which ROS 2 has in other forms: see [`catalogue_of`].
pub fn catalogue() -> &'static BTreeMap<Name, Package> {
    static CATALOGUE: LazyLock<BTreeMap<Name, Package>> =
        LazyLock::new(|| read_catalogue(include_str!("messages/catalogue.txt")));
    &CATALOGUE
}

/// Returns the built-in packages of ROS 2, by name.
pub fn ros2_catalogue() -> &'static BTreeMap<Name, Package> {
    static CATALOGUE: LazyLock<BTreeMap<Name, Package>> =
        LazyLock::new(|| read_catalogue(include_str!("messages/ros2.txt")));
    &CATALOGUE
}

/// Returns the built-in packages of a workspace: those of ROS 2, if `mauve.toml` has `[ros2]`. Installed packages take
/// precedence: see [`package`].
pub fn catalogue_of(db: &dyn ModelDb, workspace: Workspace) -> &'static BTreeMap<Name, Package> {
    if has_ros2(db, workspace) { ros2_catalogue() } else { catalogue() }
}

/// Returns whether `mauve.toml` has `[ros2]`. A query, so that another change of that file invalidates no user of a package.
#[salsa::tracked(returns(copy))]
fn has_ros2(db: &dyn ModelDb, workspace: Workspace) -> bool {
    config_of(db, workspace).ros2.is_some()
}

/// Reads a catalogue: `package P` begins a package, and `Message: field; field` is a message.
fn read_catalogue(text: &str) -> BTreeMap<Name, Package> {
    let mut packages = BTreeMap::new();
    let mut name = Name::default();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        if let Some(package) = line.strip_prefix("package ") {
            name = package.trim().into();
        } else if let Some((message, fields)) = line.split_once(':') {
            let package: &mut Package = packages
                .entry(name.clone())
                .or_insert_with(|| Package { name: name.clone(), ..Package::default() });
            package.messages.insert(message.into(), read_message(&fields.replace(';', "\n")));
        }
    }
    packages
}

/// Returns the message package of that name: the installed one, otherwise the built-in one.
pub fn package<'db>(db: &'db dyn ModelDb, workspace: Workspace, name: &Name) -> Option<&'db Package> {
    match installed(db, workspace, name.clone()) {
        Some(package) => Some(package.as_ref()),
        None => catalogue_of(db, workspace).get(name),
    }
}

/// Returns an installed package. A query by name, so that a changed package invalidates only the queries that use it.
#[salsa::tracked(returns(ref))]
fn installed(db: &dyn ModelDb, workspace: Workspace, name: Name) -> Option<Arc<Package>> {
    workspace.packages(db).get(&name).cloned()
}

/// Resolves `path`, written in `library`, to a message and its package: `package.Message`, or a message of the first package
/// that the library uses and that has it. Outside libraries, all packages that the project uses are visible.
pub fn message_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: Option<&Name>,
    path: &[Name],
) -> Option<(&'db Package, &'db Message)> {
    let workspace = project.workspace(db);
    let in_package = |of: &Name, name: &Name| {
        let package = package(db, workspace, of)?;
        Some((package, package.messages.get(name)?))
    };
    match path {
        [name] => {
            used_packages(db, project).get(&library.cloned())?.iter().find_map(|of| in_package(of, name))
        }
        [of, name] => in_package(of, name),
        // The form of C++ and of the tools of ROS 2.
        [of, msg, name] if msg == "msg" => in_package(of, name),
        _ => None,
    }
}

/// Returns, for each library, the message packages that it uses, in the order of the project's files and their texts; for
/// `None`, all packages that the project uses.
#[salsa::tracked(returns(ref))]
pub fn used_packages<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> FxHashMap<Option<Name>, Vec<Name>> {
    let all = || project_files(db, project).iter().flat_map(|&file| &declarations(db, file).all).copied();
    let libraries: FxHashSet<&Name> =
        project_files(db, project).iter().flat_map(|&file| &declarations(db, file).libraries).collect();
    let mut used: FxHashMap<Option<Name>, Vec<Name>> = FxHashMap::default();
    let mut seen: FxHashSet<(Option<Name>, &Name)> = FxHashSet::default();
    for decl in all().filter(|decl| decl.kind(db) == Kind::Use && !libraries.contains(decl.name(db))) {
        let library = decl.library(db).clone();
        for library in library.is_some().then_some(library).into_iter().chain([None]) {
            let packages = used.entry(library.clone()).or_default();
            if !decl.name(db).is_empty() && seen.insert((library, decl.name(db))) {
                packages.push(decl.name(db).clone());
            }
        }
    }
    used
}

/// Returns the names in the models of a workspace that may be message packages: `use package`, `package.Message`.
#[salsa::tracked(returns(ref))]
pub fn named_packages(db: &dyn ModelDb, workspace: Workspace) -> BTreeSet<Name> {
    let groups = groups_of(models_in(db, workspace));
    groups.flat_map(|group| named_in_group(db, workspace, group)).cloned().collect()
}

#[salsa::tracked(returns(ref))]
fn models_in(db: &dyn ModelDb, workspace: Workspace) -> Vec<File> {
    workspace.files(db).values().filter(|file| is_model(file.path(db))).copied().collect()
}

/// Returns the names in a group of models, as [`crate::file_groups`] has them.
#[salsa::tracked(returns(ref))]
fn named_in_group(db: &dyn ModelDb, workspace: Workspace, group: u32) -> BTreeSet<Name> {
    let models = group_in(models_in(db, workspace), group).iter();
    models.flat_map(|&file| named_in(db, file)).cloned().collect()
}

#[salsa::tracked(returns(ref))]
fn named_in(db: &dyn ModelDb, file: File) -> BTreeSet<Name> {
    let declared = file.outline(db).declarations.iter();
    let used = declared.filter(|it| it.kind == Kind::Use && !it.name.is_empty()).map(|it| it.name.clone());
    let mut names: BTreeSet<Name> = used.collect();
    for data in &item_tree_of(db, file).data {
        let types = data.types().into_iter().map(|(ty, _)| ty);
        names.extend(types.filter(|ty| ty.path.len() > 1).filter_map(|ty| ty.path.first().cloned()));
    }
    names
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use super::*;
    use crate::msg::BUILT_IN_TYPES;
    use crate::{Database, projects};
    use expect_test::{Expect, expect};
    use salsa::Setter as _;

    fn check(text: &str, expected: Expect) {
        expected.assert_eq(&line_of(&read_message(text)).replace("; ", "\n"));
    }

    /// As in the catalogue.
    fn line_of(message: &Message) -> String {
        let fields = message.fields.iter().map(ToString::to_string);
        let all: Vec<String> = fields.chain(message.constants.iter().map(ToString::to_string)).collect();
        all.join("; ")
    }

    #[test]
    fn fields_and_constants_of_ros_1() {
        check(
            "# a comment\n\nHeader header\n  geometry_msgs/Pose   pose # where\n\tfloat64[36] covariance\r\n\
             uint8[] data#bytes\nbyte DEBUG=1 #debug\nint32 X = -5\nstring A= a text # with this \nstring E=\n",
            expect![[r#"
                std_msgs/Header header
                geometry_msgs/Pose pose
                float64[36] covariance
                uint8[] data
                byte DEBUG=1
                int32 X=-5
                string A=a text # with this
                string E="#]],
        );
    }

    #[test]
    fn bounds_and_defaults_of_ros_2() {
        check(
            "string<=10 name \"a # \\\" b\" # c\nwstring<=5[<=3] names\nPoint[<=4] points\nint32[] samples [1, 2] # c\n\
             float64 speed 1.5\nbool on true#c\nstring WORD=\"one # two\" # c\nstd_msgs/Header header\nstring s 'it''s'",
            expect![[r#"
                string<=10 name "a # \" b"
                wstring<=5[<=3] names
                Point[<=4] points
                int32[] samples [1, 2]
                float64 speed 1.5
                bool on true
                std_msgs/Header header
                string s 'it'
                string WORD="one # two""#]],
        );
    }

    #[test]
    fn skips_invalid_lines() {
        check(
            "\u{feff}int32 a\n---\n=\n= =\nint32\nint32 =5\nint32 5\n5 x\nint32[ x\nint32] x\nint32[x] x\na/b/c x\n/b x\na/ x\n\
             int32 é\nint32 a-b\nint32[2] X=1\na/B X=1\nint8 Y=\nstring<=x s\nint32<=5 s\n<html>\n\0\n@optional x",
            expect!["int32 a"],
        );
    }

    #[test]
    fn element_types_of_arrays() {
        let message = read_message("a/B[3] x\nstring<=3[] y\nint8 z");
        let elements: Vec<_> = message.fields.iter().map(|it| (it.element(), it.is_array())).collect();
        assert_eq!(elements, [("a/B", true), ("string", true), ("int8", false)]);
    }

    /// Checks that the reader skips nothing of a catalogue, and that it has the types of all fields.
    fn check_catalogue(text: &str, catalogue: &BTreeMap<Name, Package>, built_in: &[&str]) {
        let packages: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("package ")).collect();
        assert!(packages.is_sorted(), "{packages:?}");
        assert_eq!(catalogue.keys().map(Name::as_str).collect::<Vec<_>>(), packages);
        for package in catalogue.values() {
            for (name, message) in &package.messages {
                let line = format!("{name}: {}", line_of(message));
                assert!(text.lines().any(|it| it == line.trim_end()), "{line}");
                for field in &message.fields {
                    let ty = field.element();
                    let (of, ty) = ty.split_once('/').unwrap_or((&package.name, ty));
                    let is_declared = built_in.contains(&field.element())
                        || catalogue.get(of).is_some_and(|of| of.messages.contains_key(ty));
                    assert!(is_declared, "{}/{name}: {field}", package.name);
                }
            }
        }
        let messages =
            text.lines().filter(|line| !line.starts_with(['#', 'p']) && line.contains(':')).count();
        assert_eq!(catalogue.values().map(|it| it.messages.len()).sum::<usize>(), messages);
    }

    #[test]
    fn every_type_in_the_catalogue_is_built_in_or_in_the_catalogue() {
        check_catalogue(include_str!("messages/catalogue.txt"), catalogue(), &BUILT_IN_TYPES);
        let of_ros2: Vec<&str> =
            BUILT_IN_TYPES.into_iter().filter(|it| !["time", "duration"].contains(it)).collect();
        check_catalogue(include_str!("messages/ros2.txt"), ros2_catalogue(), &of_ros2);
    }

    /// ROS 2 has these no more, or `rosbags` has them not.
    #[test]
    fn the_packages_of_ros_1_are_those_of_ros_2_but_for_a_few() {
        let lacking: Vec<&str> =
            catalogue().keys().filter(|it| !ros2_catalogue().contains_key(*it)).map(Name::as_str).collect();
        assert_eq!(lacking, ["map_msgs", "tf"]);
        assert_eq!(ros2_catalogue().values().map(|it| it.messages.len()).sum::<usize>(), 162);
    }

    /// The output of this test is the catalogue, if the packages named at the start of the catalogue are installed. Without
    /// them, only [`every_type_in_the_catalogue_is_built_in_or_in_the_catalogue`] checks the catalogue.
    #[test]
    fn the_catalogue_equals_the_installed_packages_of_debian() {
        let mut wrong = String::new();
        for package in catalogue().values() {
            let folder = Path::new("/usr/share").join(&*package.name).join("msg");
            for path in std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
                let name = path.file_stem().unwrap().to_str().unwrap();
                let installed = read_message(&std::fs::read_to_string(&path).unwrap());
                if package.messages.get(name) != Some(&installed) {
                    let _ = writeln!(wrong, "{}: {name}: {}", package.name, line_of(&installed));
                }
            }
        }
        assert_eq!(wrong, "");
    }

    fn workspace(db: &Database, files: &[(&str, &str)]) -> Workspace {
        Workspace::of_texts(
            db,
            "/".into(),
            files.iter().map(|(path, text)| ((*path).into(), (*text).to_owned())),
        )
    }

    fn install(db: &mut Database, workspace: Workspace, packages: &[(&str, &str)]) {
        let package = |&(name, message): &(&str, &str)| {
            let messages = BTreeMap::from([(message.into(), read_message("int8 installed"))]);
            (name.into(), Arc::new(Package { name: name.into(), messages }))
        };
        workspace.set_packages(db).to(Arc::new(packages.iter().map(package).collect()));
    }

    fn found(db: &Database, workspace: Workspace, library: Option<&str>, path: &[&str]) -> Option<String> {
        let path: Vec<Name> = path.iter().map(|&id| id.into()).collect();
        let library = library.map(Name::from);
        let (package, message) = message_of(db, projects(db, workspace)[0], library.as_ref(), &path)?;
        Some(format!("{}: {}", package.name, line_of(message)))
    }

    const MODEL: &str = "
        use sensor_msgs
        library a { use std_msgs use b use nothing use tf2_msgs }
        library b { use geometry_msgs codel f(): int }
        library a { use nav_msgs use std_msgs }";

    #[test]
    fn a_message_is_one_of_the_packages_that_its_library_uses() {
        let db = Database::default();
        let workspace = workspace(&db, &[("/a.mal", MODEL)]);
        let found = |library, path: &[&str]| found(&db, workspace, library, path);
        assert_eq!(found(Some("a"), &["String"]).as_deref(), Some("std_msgs: string data"));
        assert_eq!(
            found(Some("a"), &["GridCells"]).as_deref(),
            Some(
                "nav_msgs: std_msgs/Header header; float32 cell_width; float32 cell_height; \
                 geometry_msgs/Point[] cells"
            )
        );
        // Library `a` does not see the packages that `b` uses; a qualified name needs no `use`.
        assert_eq!(found(Some("a"), &["Pose"]), None);
        assert_eq!(
            found(Some("a"), &["geometry_msgs", "Pose"]).as_deref(),
            Some("geometry_msgs: Point position; Quaternion orientation")
        );
        assert_eq!(found(Some("b"), &["Joy"]), None);
        for name in ["Pose", "Joy", "String"] {
            assert!(found(None, &[name]).is_some(), "{name}");
        }
        for path in [&["std_msgs", "Nothing"] as &[&str], &["nothing", "String"], &["std_msgs"], &[], &[""]] {
            assert_eq!(found(Some("a"), path), None, "{path:?}");
        }
        let msg = found(Some("a"), &["std_msgs", "msg", "String"]);
        assert_eq!(msg.as_deref(), Some("std_msgs: string data"));
        assert_eq!(found(Some("a"), &["std_msgs", "srv", "String"]), None);
    }

    #[test]
    fn a_project_with_ros_2_has_its_messages() {
        let db = Database::default();
        let of = |toml| workspace(&db, &[("/a.mal", MODEL), ("/mauve.toml", toml)]);
        let header = |toml| found(&db, of(toml), None, &["std_msgs", "Header"]).unwrap();
        assert_eq!(header("[timing]\n"), "std_msgs: uint32 seq; time stamp; string frame_id");
        assert_eq!(header("[ros2]\n"), "std_msgs: builtin_interfaces/Time stamp; string frame_id");
    }

    #[test]
    fn an_installed_package_replaces_the_built_in_one() {
        let mut db = Database::default();
        let workspace = workspace(&db, &[("/a.mal", MODEL)]);
        install(&mut db, workspace, &[("std_msgs", "Mine"), ("nothing", "Thing")]);
        assert_eq!(found(&db, workspace, Some("a"), &["Mine"]).as_deref(), Some("std_msgs: int8 installed"));
        assert_eq!(found(&db, workspace, Some("a"), &["Thing"]).as_deref(), Some("nothing: int8 installed"));
        assert_eq!(found(&db, workspace, Some("a"), &["String"]), None);
        assert!(found(&db, workspace, None, &["Joy"]).is_some());
    }

    /// A query that uses a package.
    #[salsa::tracked(returns(copy))]
    fn user(db: &dyn ModelDb, workspace: Workspace) -> usize {
        package(db, workspace, &"std_msgs".into()).map_or(0, |package| package.messages.len())
    }

    #[test]
    fn a_changed_package_invalidates_only_its_users() {
        let mut db = Database::with_log();
        let workspace = workspace(&db, &[("/a.mal", MODEL)]);
        install(&mut db, workspace, &[("std_msgs", "Mine")]);
        assert_eq!(user(&db, workspace), 1);
        db.take_log();
        install(&mut db, workspace, &[("std_msgs", "Mine"), ("other_msgs", "Other")]);
        assert_eq!(user(&db, workspace), 1);
        assert_eq!(db.take_log().executed, ["installed"]);
        install(&mut db, workspace, &[("std_msgs", "Another")]);
        assert_eq!(user(&db, workspace), 1);
        assert_eq!(db.take_log().executed, ["installed", "user"]);
    }

    #[test]
    fn packages_are_named_by_uses_and_by_qualified_types() {
        let db = Database::default();
        let model = "use a library l { use b }
            codel f(in x: c::X, out y: Y): d.D
            shell S extends lib.S { input port p: e.E property q: int require o(in x: f::F): g.G }
            core C(lib.S) {
              var v: h.H
              handler o: o
              provide w(in x: i.I) = { var v: j.J }
              statemachine {
                var m: k.K
                initial state S {
                  run = { if v then { { var w: n.N = 1; } } else { var w: p.P; } }
                  transition t to S { var w: q.Q; }
                }
              }
            }
            component M(lib.S, lib.C)";
        let workspace = workspace(&db, &[("/a.mal", model), ("/mauve.toml", "x = \"y.z\"")]);
        let named: Vec<&str> = named_packages(&db, workspace).iter().map(Name::as_str).collect();
        assert_eq!(named.join(" "), "a b c d e f g h i j k n p q");
    }
}
