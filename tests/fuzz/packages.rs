//! What holds for whatever stands in a folder of packages: run by `cargo fuzz`, and on some texts by
//! `analysis/orocos/tests/fuzz.rs`.

use std::sync::LazyLock;

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::{Action, GeneratedPackage, MANIFEST, packages, plan};

/// A text that the generator did not write. A forged manifest may know its hash.
pub(crate) const MINE: &str = "mine\n";

/// The packages of a small model.
pub(crate) static PACKAGES: LazyLock<Vec<GeneratedPackage>> = LazyLock::new(|| {
    let db = Database::default();
    let model = "library l { codel f(in a: int, in b: double, out c: string): int \
        shell S { } core K(S) { var n: int  var s: string  update = { n = f(n, 0.5, s); } } component C(S, K) } \
        architecture A { instance a: l.C } deployment D { architecture A activity a { priority = 1 period = 10 } }";
    let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), model.to_owned())]);
    let projects = projects(&db, workspace).iter();
    projects.flat_map(|&project| packages(&db, project, None).unwrap_or_default()).collect()
});

/// Whatever a manifest says, nothing that the generator did not write is removed, and what it overwrites needs force.
pub(crate) fn manifest(text: &str) {
    let read =
        |path: &str| Ok(Some(if path.ends_with(MANIFEST) { text.to_owned() } else { MINE.to_owned() }));
    let Ok(plan) = plan(&PACKAGES, &read) else { return };
    for step in &plan.steps {
        match step.action {
            Action::Remove => panic!("{} is removed", step.path),
            Action::Create(_) => panic!("{} is there", step.path),
            Action::Change(_) => {
                let is_known = step.path.ends_with(MANIFEST) || plan.edited.contains(&step.path);
                assert!(is_known, "{} is overwritten without force", step.path);
            }
        }
    }
}

/// Whatever stands in the file of a codel, it stays, and reading it ends.
pub(crate) fn prototype(text: &str) {
    let codels = |path: &str| path.contains("/src/codels/");
    let read = |path: &str| Ok(if codels(path) { Some(text.to_owned()) } else { None });
    let Ok(plan) = plan(&PACKAGES, &read) else { return };
    assert!(plan.steps.iter().all(|step| !codels(&step.path)));
}
