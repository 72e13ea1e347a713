//! What packages contain: manual pages and versions.

use std::fs;
use std::path::Path;

use mauve_tests::{files_in, mauve, scratch};

use crate::MAUVE;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Returns the commands in the help of a command, with the words before them, and theirs.
fn commands(before: &[&str], found: &mut Vec<String>) {
    let help = mauve(MAUVE, root(), &[before, &["--help"]].concat()).out;
    let list = help.split("Commands:\n").nth(1).unwrap_or_default();
    let lines = list.lines().take_while(|line| line.starts_with("  "));
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    for name in names.filter(|name| !name.is_empty() && *name != "help") {
        let path = [before, &[name]].concat();
        found.push(path.join("-"));
        commands(&path, found);
    }
}

#[test]
fn each_command_has_a_section_of_the_reference() {
    let page = include_str!("../spec/commands.md");
    let mut all = Vec::new();
    commands(&[], &mut all);
    for name in all.iter().filter(|it| !it.contains('-') || *it == "analysis-stats") {
        assert!(page.contains(&format!("\n## mauve {name}\n")), "{name}");
        let help = mauve(MAUVE, root(), &["help", name]).out;
        assert!(help.ends_with(&format!("\nReference: commands.md#mauve-{name}\n")), "{help}");
    }
}

#[test]
fn each_command_has_a_manual_page() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), "manual-pages").join("new/man1");
    let written = mauve(MAUVE, root(), &["man", &folder.display().to_string()]);
    assert_eq!((written.code, written.out.as_str(), written.err.as_str()), (0, "", ""));
    let mut names = vec![String::new()];
    commands(&[], &mut names);
    assert!(names.len() > 20 && names.contains(&"editor-install".to_owned()), "{names:?}");
    let mut expected: Vec<String> =
        names.iter().map(|name| format!("mauve-{name}").trim_end_matches('-').to_owned() + ".1").collect();
    expected.sort();
    let pages = files_in(&folder);
    let found: Vec<_> = pages.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(found, expected);
    for page in &pages {
        let text = fs::read_to_string(page).unwrap();
        assert!(text.contains(".SH NAME") && text.contains(".SH SYNOPSIS"), "{}", page.display());
    }
    let refused = mauve(MAUVE, root(), &["man", "/proc/none"]);
    assert!(
        refused.code == 2 && refused.err.contains("cannot write manual pages to `/proc/none`"),
        "{refused:?}"
    );
}

/// The version is written in the workspace's Cargo.toml; formats of others need copies.
#[test]
fn each_copy_of_the_version_is_that_of_the_workspace() {
    let version = env!("CARGO_PKG_VERSION");
    for (file, before, after) in [
        ("editors/vscode/package.json", "\n  \"version\": \"", "\""),
        ("editors/vscode/package-lock.json", "\n  \"version\": \"", "\""),
        ("editors/vscode/package-lock.json", "\n      \"version\": \"", "\""),
        ("editors/vscode/CHANGELOG.md", "\n## ", "\n"),
        ("editors/emacs/mauve-pkg.el", "(define-package \"mauve\" \"", "\""),
        ("editors/zed/extension.toml", "\nversion = \"", "\""),
        ("editors/zed/Cargo.toml", "\nversion = \"", "\""),
        ("editors/tree-sitter/tree-sitter.json", "\"version\": \"", "\""),
        (".github/CHANGELOG.md", "\n## ", "\n"),
        (".github/actions/diff/README.md", "/diff@v", "\n"),
        (".github/actions/diff/gitlab.yml", "MAUVE_VERSION: v", "\n"),
        ("README.md", "install ./mauve-", "-py3-none-"),
        ("README.md", "mauve-linux-x64-", ".vsix"),
        ("README.md", "install ./mauve_", "_amd64.deb"),
    ] {
        let text = fs::read_to_string(root().join(file)).unwrap();
        let found =
            text.split_once(before).and_then(|(_, rest)| rest.split_once(after)).map(|(found, _)| found);
        assert_eq!(found, Some(version), "{file}");
    }
}

#[test]
fn the_wheel_has_the_program_and_what_cargo_says_of_it() {
    let text = fs::read_to_string(root().join("server/pyproject.toml")).unwrap();
    let file: toml::Table = text.parse().unwrap();
    assert_eq!(file["tool"]["maturin"]["bindings"].as_str(), Some("bin"));
    let project = &file["project"];
    assert_eq!(project["name"].as_str(), Some(env!("CARGO_PKG_NAME")));
    assert_eq!(project["license"].as_str(), Some(env!("CARGO_PKG_LICENSE")));
    let dynamic: Vec<_> =
        project["dynamic"].as_array().unwrap().iter().filter_map(|it| it.as_str()).collect();
    assert_eq!(dynamic, ["version", "description"]);
    // Another version of maturin makes another file.
    let build = file["build-system"]["requires"].as_array().unwrap();
    assert!(build.iter().all(|it| it.as_str().unwrap().contains("==")), "{build:?}");
}

#[test]
fn the_workflows_run_the_scripts_of_the_repository() {
    for (file, script) in [("ci.yml", ".ci/run"), ("release.yml", ".github/release")] {
        let text = fs::read_to_string(root().join(".github/workflows").join(file)).unwrap();
        assert!(
            text.lines().any(
                |line| line.trim().trim_start_matches("- ").starts_with("run: ") && line.contains(script)
            ),
            "{file}"
        );
        assert!(root().join(script).is_file());
        // Parsed where there is a parser for YAML.
        let parse = "import sys\ntry:\n import yaml\nexcept ImportError:\n sys.exit(0)\n\
                     d = yaml.safe_load(open(sys.argv[1]))\nassert d['jobs'] and all('runs-on' in j for j in d['jobs'].values())";
        let path = root().join(".github/workflows").join(file);
        if let Ok(parsed) = std::process::Command::new("python3").args(["-c", parse]).arg(&path).output() {
            assert!(parsed.status.success(), "{file}: {}", String::from_utf8_lossy(&parsed.stderr));
        }
    }
}
