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
        ("editors/emacs/mauve-pkg.el", "(define-package \"mauve\" \"", "\""),
        ("editors/zed/extension.toml", "\nversion = \"", "\""),
        ("editors/zed/Cargo.toml", "\nversion = \"", "\""),
        ("README.md", "--vsix editors/vscode/mauve-", ".vsix"),
        ("README.md", "install ./mauve_", "_amd64.deb"),
    ] {
        let text = fs::read_to_string(root().join(file)).unwrap();
        let found =
            text.split_once(before).and_then(|(_, rest)| rest.split_once(after)).map(|(found, _)| found);
        assert_eq!(found, Some(version), "{file}");
    }
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
