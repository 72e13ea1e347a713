//! The messages about what prevents the generation of packages, for the command line and for editors.

use mauve_orocos::{Artifact, ManifestError, PlanError, ProblemKind};

/// Returns what is wrong in a project, and what to do.
pub fn problem_message(problem: &ProblemKind) -> String {
    match problem {
        ProblemKind::Diagnostic(message) => message.clone(),
        ProblemKind::SamePath { of, first, second } => {
            let (what, path) = match of {
                Artifact::Package => ("packages", "folder"),
                Artifact::Codel => ("codels", "file"),
                Artifact::Component => ("components", "folder"),
                Artifact::Deployment => ("deployments", "file"),
            };
            format!(
                "{what} `{first}` and `{second}` would be the same {path} on a file system that ignores case: \
                 rename one of them"
            )
        }
        ProblemKind::IncompleteComponent => "this component is not complete".to_owned(),
        ProblemKind::UnmappedType(name) => {
            format!("`[types.{name}]` in mauve.toml does not say what `{name}` is in C++: add `cpp`")
        }
        ProblemKind::UnknownType(ty) => format!(
            "the C++ type of `{ty}` is unknown: add `[types.{ty}]` with `cpp` and `header` to mauve.toml, or \
             `use` its message package"
        ),
        ProblemKind::CyclicPackages { package, others } => {
            let others: Vec<String> = others.iter().map(|other| format!("`{other}`")).collect();
            format!(
                "libraries `{package}` and {} depend on each other: the components of each call codels of the \
                 other, directly or indirectly, so neither package can be built first; move the codels that \
                 both call to a separate library",
                others.join(" and ")
            )
        }
    }
}

/// Returns why there is no plan for a folder, and what to do.
pub(super) fn plan_message(error: &PlanError) -> String {
    match error {
        PlanError::Unreadable(message) => message.clone(),
        PlanError::SameFolder(first, second) => format!(
            "packages `{first}` and `{second}` would be the same folder on a file system that ignores case: \
             generate them into different folders (`--out`), or rename one of the libraries"
        ),
        PlanError::Manifest { path, error } => format!(
            "the manifest `{path}` is invalid: {}; remove it and generate again: generated files that differ \
             from the new output then need `--force`; your codels are kept",
            manifest_message(error)
        ),
    }
}

fn manifest_message(error: &ManifestError) -> String {
    match error {
        ManifestError::Json(message) => message.clone(),
        ManifestError::Format { found, known } => {
            format!("its format is {found}, and this version of mauve reads format {known}")
        }
        ManifestError::OutsidePackage(path) => format!("{path:?} is not a path in the package"),
        ManifestError::UserFile(path) => format!("{path:?} is a file of the user, not a generated one"),
        ManifestError::NotGenerated(path) => format!("{path:?} is not a file that the generator writes"),
        ManifestError::NotACodel(path) => format!("{path:?} is not a file of a codel"),
    }
}

#[cfg(test)]
mod tests {
    use mauve_hir::{Database, Workspace, projects};
    use mauve_orocos::{GeneratedPackage, MANIFEST, plan, problems};

    use super::*;

    /// The marked word of each problem of a model, with its message.
    fn messages(model: &str) -> Vec<String> {
        let db = Database::default();
        let texts = mauve_tests::fixture(model).into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let [project] = projects(&db, workspace)[..] else { panic!("one project") };
        let problems = problems(&db, project).into_iter().map(|it| {
            let at = &it.at.file(&db).text(&db)[it.at.range(&db)];
            format!("{at}: {}", problem_message(&it.kind))
        });
        problems.collect()
    }

    #[test]
    fn an_error_is_what_its_diagnostic_says() {
        assert_eq!(messages("component C(S, K)"), ["S: no shell `S`", "K: no core `K`"]);
    }

    #[test]
    fn names_that_differ_in_case_only() {
        let model = "library l { codel plan(): int  codel Plan(): int } library L { codel plan(): int } \
            shell S { } core K(S) { update = { } } component Go(S, K) component GO(S, K) \
            architecture A { instance a: Go } deployment D { architecture A activity a { priority = 1 period = 10 } } \
            deployment d { architecture A activity a { priority = 1 period = 10 } }";
        assert_eq!(
            messages(model),
            [
                "plan: packages `l` and `L` would be the same folder on a file system that ignores case: \
                 rename one of them",
                "Plan: codels `plan` and `Plan` would be the same file on a file system that ignores case: \
                 rename one of them",
                "GO: components `Go` and `GO` would be the same folder on a file system that ignores case: \
                 rename one of them",
                "d: deployments `D` and `d` would be the same file on a file system that ignores case: rename \
                 one of them",
            ]
        );
    }

    #[test]
    fn components_that_are_incomplete() {
        // The parser reports what makes it incomplete, too.
        assert_eq!(problem_message(&ProblemKind::IncompleteComponent), "this component is not complete");
    }

    #[test]
    fn types_that_are_not_known() {
        let model = "codel f(in a: own, in b: pkg.Other): void\n//- /mauve.toml\n[types.own]\n";
        assert_eq!(
            messages(model),
            [
                "own: `[types.own]` in mauve.toml does not say what `own` is in C++: add `cpp`",
                "pkg.Other: the C++ type of `pkg.Other` is unknown: add `[types.pkg.Other]` with `cpp` and \
                 `header` to \
                 mauve.toml, or `use` its message package",
            ]
        );
    }

    #[test]
    fn packages_that_need_each_other() {
        let library = |own: &str, other: &str| {
            format!(
                "library {own} {{ use {other}  codel f_{own}(): void  shell S {{ }} \
                 core K(S) {{ update = {{ f_{other}(); }} }} component C(S, K) }}\n"
            )
        };
        assert_eq!(
            messages(&(library("a", "b") + &library("b", "a"))),
            ["C: libraries `a` and `b` depend on each other: the components of each call codels of the \
                 other, directly or indirectly, so neither package can be built first; move the codels that \
                 both call to a separate library"]
        );
    }

    #[test]
    fn folders_without_a_plan() {
        let package = |name: &str| GeneratedPackage { name: name.to_owned(), files: Vec::new() };
        let message = |packages: &[GeneratedPackage], manifest: Result<&str, &str>| {
            let read = |path: &str| {
                assert!(path.ends_with(MANIFEST));
                manifest.map(|text| Some(text.to_owned())).map_err(str::to_owned)
            };
            plan_message(&plan(packages, &read).unwrap_err())
        };
        let one = [package("p")];
        assert_eq!(message(&one, Err("broken disk")), "broken disk");
        let empty = r#"{"format":1,"files":{},"codels":{}}"#;
        assert_eq!(
            message(&[package("p"), package("P")], Ok(empty)),
            "packages `p` and `P` would be the same folder on a file system that ignores case: generate them \
             into different folders (`--out`), or rename one of the libraries"
        );
        for (manifest, why) in [
            ("", "EOF while parsing a value at line 1 column 0"),
            (r#"{"format":2}"#, "its format is 2, and this version of mauve reads format 1"),
            (r#"{"format":1,"files":{"../x":""},"codels":{}}"#, "\"../x\" is not a path in the package"),
            (
                r#"{"format":1,"files":{"user.cmake":""},"codels":{}}"#,
                "\"user.cmake\" is a file of the user, not a generated one",
            ),
            (
                r#"{"format":1,"files":{"main.cpp":""},"codels":{}}"#,
                "\"main.cpp\" is not a file that the generator writes",
            ),
            (r#"{"format":1,"files":{},"codels":{"main.cpp":{}}}"#, "\"main.cpp\" is not a file of a codel"),
        ] {
            let expected = format!(
                "the manifest `p/.mauve-manifest.json` is invalid: {why}; remove it and generate again: \
                 generated files that differ from the new output then need `--force`; your codels are kept"
            );
            assert_eq!(message(&one, Ok(manifest)), expected);
        }
    }
}
