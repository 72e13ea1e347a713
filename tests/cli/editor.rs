//! `mauve editor`: the files of editors in a home of the test's own.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mauve_tests::{Run, scratch, test_name, write};

use crate::MAUVE;

/// A home folder, in which `mauve` is not on PATH.
struct Home(PathBuf);

impl Home {
    fn new(files: &[(&str, &str)]) -> Home {
        let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("editor-{}", test_name()));
        let home = top.canonicalize().unwrap();
        write(&home, files);
        Home(home)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(MAUVE);
        command.arg("editor").args(arguments).env_clear().env("HOME", &self.0).env("PATH", "/usr/bin:/bin");
        command.stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> Run {
        ended(&mut self.command(arguments))
    }

    /// Everything below the folder: files with their texts, links with their targets, and folders.
    fn all(&self) -> BTreeMap<PathBuf, String> {
        let mut found = BTreeMap::new();
        let mut open = vec![self.0.clone()];
        while let Some(folder) = open.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let text = match path.symlink_metadata().unwrap().file_type() {
                    kind if kind.is_symlink() => format!("-> {}", fs::read_link(&path).unwrap().display()),
                    kind if kind.is_dir() => {
                        open.push(path.clone());
                        "a folder".to_owned()
                    }
                    _ => fs::read_to_string(&path).unwrap(),
                };
                found.insert(path.strip_prefix(&self.0).unwrap().to_owned(), text);
            }
        }
        found
    }

    fn path(&self, path: &str) -> PathBuf {
        self.0.join(path)
    }

    fn text(&self, path: &str) -> String {
        fs::read_to_string(self.path(path)).unwrap()
    }
}

fn ended(command: &mut Command) -> Run {
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    Run { out: text(&output.stdout), err: text(&output.stderr), code: output.status.code().unwrap_or(-1) }
}

const EDITORS: [&str; 4] = ["nvim", "helix", "emacs", "zed"];
const PLUGIN: &str = ".local/share/nvim/site/pack/mauve/start/mauve";

#[test]
fn a_second_run_changes_nothing() {
    for files in [
        &[] as &[(&str, &str)],
        &[
            (".config/helix/config.toml", "theme = \"x\"\n[editor.lsp]\n  display-inlay-hints = true"),
            (".local/share/nvim/x", ""),
        ],
    ] {
        let home = Home::new(files);
        for editor in EDITORS {
            let before = home.all();
            let planned = home.run(&["install", editor, "--dry-run"]);
            assert_eq!((planned.code, planned.err.as_str()), (0, ""));
            assert!(planned.out.starts_with("would "), "{}", planned.out);
            assert_eq!(home.all(), before);

            let done = home.run(&["install", editor]);
            assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
            let did = planned.out.replace("would write", "wrote").replace("would change", "changed");
            assert_eq!(did, done.out, "a dry run lists each step");
            let written = done.out.lines().filter_map(|line| line.strip_prefix("wrote "));
            assert!(written.clone().count() > 0 && written.clone().all(|path| Path::new(path).is_file()));
            // The files of the user, and those of other editors, stay.
            let installed = home.all();
            let is_changed =
                |path: &PathBuf| done.out.contains(&format!("changed {}", home.0.join(path).display()));
            let mut others = before.iter().filter(|(path, _)| !is_changed(path));
            assert!(others.all(|(path, text)| installed[path] == *text), "{editor}");

            let again = home.run(&["install", editor]);
            assert!(again.code == 0 && again.out.ends_with("up to date: nothing was changed\n"), "{again:?}");
            assert_eq!(home.all(), installed);
        }
    }
}

#[test]
fn the_folders_of_the_environment_are_used() {
    let home = Home::new(&[]);
    let own = |editor| {
        let mut command = home.command(&["install", editor]);
        command.env("XDG_DATA_HOME", home.path("data")).env("XDG_CONFIG_HOME", home.path("set"));
        command.env("NVIM_APPNAME", "other");
        ended(&mut command)
    };
    assert_eq!(own("nvim").code, 0);
    assert!(home.path("data/other/site/pack/mauve/start/mauve/plugin/mauve.lua").is_file());
    assert_eq!(own("helix").code, 0);
    assert!(home.path("set/helix/languages.toml").is_file() && !home.path(".config").exists());
    fs::create_dir(home.path("set/emacs")).unwrap();
    assert_eq!(own("emacs").code, 0);
    assert!(home.path("set/emacs/elpa/mauve/mauve.el").is_file() && !home.path(".emacs.d").exists());
    let mut nowhere = home.command(&["install", "nvim"]);
    let found = ended(nowhere.env("HOME", "relative"));
    assert!(found.code == 2 && found.err.contains("set HOME"), "{found:?}");
}

#[test]
fn an_editor_starts_this_program() {
    let home = Home::new(&[]);
    for (editor, file) in [
        ("nvim", &*format!("{PLUGIN}/plugin/00-mauve-server.lua")),
        ("helix", ".config/helix/languages.toml"),
        ("emacs", ".emacs.d/elpa/mauve/mauve-autoloads.el"),
    ] {
        let done = home.run(&["install", editor]);
        assert!(done.out.contains(&format!(" starts {MAUVE}")), "{}", done.out);
        assert!(home.text(file).contains(&format!("\"{MAUVE}\"")), "{}", home.text(file));
        // Settings that are there are the user's.
        if editor == "helix" {
            fs::remove_file(home.path(file)).unwrap();
        }
        // The same program on PATH needs no path.
        fs::create_dir_all(home.path("bin")).unwrap();
        let _ = symlink(MAUVE, home.path("bin/mauve"));
        let done = ended(home.command(&["install", editor]).env("PATH", home.path("bin")));
        assert!(done.code == 0 && !done.out.contains("note: `mauve` on PATH"), "{}", done.out);
        assert!(!home.text(file).contains(MAUVE), "{}", home.text(file));
        fs::remove_dir_all(home.path("bin")).unwrap();
    }
}

#[test]
fn files_of_the_user_are_refused() {
    let file = format!("{PLUGIN}/plugin/mauve.lua");
    let home = Home::new(&[(&file, "mine")]);
    let before = home.all();
    let refused = home.run(&["install", "nvim"]);
    assert_eq!((refused.code, refused.err.as_str()), (1, ""));
    let expected = format!(
        "refused: `{}` exists, and mauve did not write it: rename it, or overwrite it with --force\nnothing was changed\n",
        home.path(&file).display()
    );
    assert_eq!((refused.out, home.all()), (expected, before));
    // A file with our text, whoever wrote it, is ours.
    fs::copy(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../editors/nvim/plugin/mauve.lua"),
        home.path(&file),
    )
    .unwrap();
    assert_eq!(home.run(&["install", "nvim"]).code, 0);

    fs::write(home.path(&file), "mine").unwrap();
    let forced = home.run(&["install", "nvim", "--force"]);
    assert!(forced.code == 0 && forced.out.contains("changed "), "{forced:?}");
}

#[test]
fn files_of_an_earlier_version_are_updated() {
    let home = Home::new(&[]);
    assert_eq!(home.run(&["install", "nvim"]).code, 0);
    let file = format!("{PLUGIN}/plugin/mauve.lua");
    let new = home.text(&file);
    // Another text, with its mark.
    fs::copy(home.path(PLUGIN).join("lua/mauve/figures.lua"), home.path(&file)).unwrap();
    let mine = home.path(PLUGIN).join("plugin/mine.lua");
    fs::write(&mine, "-- Mine.\n").unwrap();
    let done = home.run(&["install", "nvim"]);
    let changed: Vec<&str> = done.out.lines().filter(|line| !line.starts_with("note: ")).collect();
    assert_eq!((done.code, changed), (0, vec![&*format!("changed {}", home.path(&file).display())]));
    assert_eq!((home.text(&file), fs::read_to_string(mine).unwrap().as_str()), (new, "-- Mine.\n"));
}

/// `:helptags ALL` writes the index of the help file again.
#[test]
fn an_index_that_the_editor_wrote_is_ours() {
    let home = Home::new(&[]);
    assert_eq!(home.run(&["install", "nvim"]).code, 0);
    fs::write(home.path(PLUGIN).join("doc/tags"), "mauve\tmauve.txt\t/*mauve*\n").unwrap();
    let again = home.run(&["install", "nvim"]);
    assert!(again.code == 0 && again.out.contains("changed "), "{again:?}");
}

#[test]
fn links_are_not_written_through() {
    // As the plugin can be installed by hand.
    let home = Home::new(&[("clone/plugin/mauve.lua", "theirs")]);
    fs::create_dir_all(home.path(PLUGIN).parent().unwrap()).unwrap();
    symlink(home.path("clone"), home.path(PLUGIN)).unwrap();
    let before = home.all();
    let refused = home.run(&["install", "nvim", "--force"]);
    assert!(
        refused.code == 1 && refused.out.contains("is below a file or a link: remove or rename it"),
        "{refused:?}"
    );
    assert_eq!(home.all(), before);
    fs::remove_file(home.path(PLUGIN)).unwrap();
    fs::create_dir_all(home.path(PLUGIN).join("plugin")).unwrap();
    symlink(home.path("clone/plugin/mauve.lua"), home.path(PLUGIN).join("plugin/mauve.lua")).unwrap();
    let refused = home.run(&["install", "nvim", "--force"]);
    assert!(refused.code == 1 && refused.out.contains("is a link: remove or rename it"), "{refused:?}");
    assert_eq!(home.text("clone/plugin/mauve.lua"), "theirs");

    // Settings that are kept elsewhere stay as well.
    let home = Home::new(&[("kept/languages.toml", "# mine\n"), (".config/helix/themes/x", "")]);
    symlink("../../kept/languages.toml", home.path(".config/helix/languages.toml")).unwrap();
    assert_eq!(home.run(&["install", "helix"]).code, 0);
    assert_eq!(home.text("kept/languages.toml"), "# mine\n");
    assert!(home.path(".config/helix/languages.toml").is_symlink());
    fs::remove_file(home.path(".config/helix/config.toml")).unwrap();
    symlink("nowhere", home.path(".config/helix/config.toml")).unwrap();
    let dangling = home.run(&["install", "helix"]);
    assert!(dangling.code == 2 && dangling.err.contains("leads nowhere"), "{dangling:?}");
}

#[test]
fn what_may_not_be_written_stays_as_it_is() {
    let home = Home::new(&[]);
    let plugin = format!("{PLUGIN}/plugin/mauve.lua");
    assert_eq!(home.run(&["install", "nvim"]).code, 0);
    let old = home.text(&plugin).replace("mauve: installed", "mauve: installed 12ab");
    fs::write(home.path(&plugin), &old).unwrap();
    let closed = home.path(&plugin);
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o444)).unwrap();
    // Root may write everything, unless it gives that up.
    let is_root = fs::OpenOptions::new().write(true).open(&closed).is_ok();
    let mut command = match is_root {
        true => {
            let mut command = Command::new("setpriv");
            command.args(["--bounding-set", "-dac_override,-dac_read_search", "--", MAUVE]);
            command
        }
        false => Command::new(MAUVE),
    };
    let found = ended(command.args(["editor", "install", "nvim"]).env("HOME", &home.0));
    assert!(
        found.code == 2 && found.err.contains("cannot write `") && found.err.contains("plugin/mauve.lua"),
        "{found:?}"
    );
    assert_eq!(home.text(&plugin), old);
    // The rest can be repeated.
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o644)).unwrap();
    assert_eq!(home.run(&["install", "nvim"]).code, 0);
    assert!(home.text(&plugin) != old);
}

#[test]
fn settings_of_helix_are_kept() {
    for (languages, config) in [
        ("# Mine\n[[language]]\nname = \"rust\"", "theme = \"x\"\n[editor]\nmouse = false"),
        ("[language-server.mauve]\ncommand = \"own\"\n", "editor.lsp.display-inlay-hints = false\n"),
        ("a = \n", "\u{feff}"),
    ] {
        let home =
            Home::new(&[(".config/helix/config.toml", config), (".config/helix/languages.toml", languages)]);
        for arguments in [&["install", "helix"] as &[&str], &["install", "helix", "--force"]] {
            let done = home.run(arguments);
            assert_eq!(done.code, 0, "{done:?}");
            for (path, text) in
                [("languages.toml", "[language-server.mauve]\n"), ("config.toml", "[editor.lsp]\n")]
            {
                let path = home.path(".config/helix").join(path);
                let shown = format!(
                    "note: `{}` is yours, and stays as it is; add these lines to it:\n{text}",
                    path.display()
                );
                assert!(done.out.contains(&shown), "{}", done.out);
            }
            assert_eq!(home.text(".config/helix/config.toml"), config);
            assert_eq!(home.text(".config/helix/languages.toml"), languages);
        }
    }
    // Who has added the lines is told nothing.
    let home = Home::new(&[]);
    assert_eq!(home.run(&["install", "helix"]).code, 0);
    for path in ["languages.toml", "config.toml"] {
        let path = format!(".config/helix/{path}");
        let text = format!("# mine\n{}[more]\n", home.text(&path));
        fs::write(home.path(&path), text).unwrap();
    }
    let again = home.run(&["install", "helix"]);
    assert!(again.code == 0 && !again.out.contains("is yours"), "{again:?}");
}

/// A program that behaves like `code` for one extension.
const CODE: &str = "#!/bin/sh
case $1 in
  --list-extensions) echo other.other@1.0.0; [ ! -e \"$HOME/installed\" ] || cat \"$HOME/installed\" ;;
  --install-extension) [ \"$(cat \"$2\")\" = package ] || { echo 'not a package' >&2; exit 1; }; echo mauve.mauve@VERSION >\"$HOME/installed\" ;;
esac
";

#[test]
fn vscode_installs_the_package_beside_the_program() {
    let code = CODE.replace("VERSION", env!("CARGO_PKG_VERSION"));
    let home = Home::new(&[
        ("bin/codium", &code),
        ("m.vsix", "package"),
        ("bad.vsix", "x"),
        ("prefix/share/mauve/mauve.vsix", "package"),
    ]);
    fs::set_permissions(home.path("bin/codium"), fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:/usr/bin:/bin", home.path("bin").display());
    let run = |arguments: &[&str]| ended(home.command(arguments).env("PATH", &path).current_dir(&home.0));
    let none = run(&["install", "vscode"]);
    assert!(none.code == 2 && none.err.contains("there is no mauve.vsix beside"), "{none:?}");
    let bad = run(&["install", "vscode", "--vsix", "bad.vsix"]);
    assert!(bad.code == 2 && bad.err.contains("failed: not a package"), "{bad:?}");
    let planned = run(&["install", "vscode", "--vsix", "m.vsix", "--dry-run"]);
    assert!(
        planned.code == 0 && planned.out.starts_with("would install ") && !home.path("installed").exists()
    );
    let done = run(&["install", "vscode", "--vsix", "m.vsix"]);
    assert!(
        done.code == 0 && done.out.starts_with("installed ") && home.path("installed").exists(),
        "{done:?}"
    );
    let again = run(&["install", "vscode", "--vsix", "m.vsix"]);
    assert!(again.code == 0 && again.out.ends_with("is up to date: nothing was changed\n"), "{again:?}");
    fs::remove_file(home.path("installed")).unwrap();
    // As packages install both.
    fs::create_dir_all(home.path("prefix/bin")).unwrap();
    fs::copy(MAUVE, home.path("prefix/bin/mauve")).unwrap();
    let mut command = Command::new(home.path("prefix/bin/mauve"));
    let found = ended(command.args(["editor", "install", "vscode"]).env("HOME", &home.0).env("PATH", &path));
    assert!(found.code == 0 && found.out.contains("/share/mauve/mauve.vsix with "), "{found:?}");

    let home = Home::new(&[]);
    let without = home.run(&["install", "vscode", "--vsix", "m.vsix"]);
    assert!(without.code == 2 && without.err.contains("none of code, codium, "), "{without:?}");
    let other = home.run(&["install", "nvim", "--program", "code"]);
    assert!(other.code == 2 && other.err.contains("--vsix and --program are for vscode only"), "{other:?}");
    let missing = home.run(&["install", "vscode", "--program", "/no/such/code", "--vsix", MAUVE]);
    assert!(missing.code == 2 && missing.err.contains("`/no/such/code` cannot be started"), "{missing:?}");
}

#[test]
fn emacs_without_packages_is_told_what_to_load() {
    let early = "; (setq package-enable-at-startup nil)\n(setq package-enable-at-startup nil)\n";
    let home = Home::new(&[(".emacs.d/early-init.el", early), (".emacs.d/package-quickstart.el", "")]);
    let done = home.run(&["install", "emacs"]);
    let load = format!("(load \"{}\")", home.path(".emacs.d/elpa/mauve/mauve-autoloads.el").display());
    assert!(done.out.contains(&load) && done.out.contains("package-quickstart-refresh"), "{}", done.out);
    assert_eq!(home.text(".emacs.d/early-init.el"), early);
}

#[test]
fn neovim_with_a_plugin_manager_is_told_what_to_add() {
    let home = Home::new(&[(".local/share/nvim/lazy/x", "")]);
    let done = home.run(&["install", "nvim"]);
    assert!(
        done.out.contains(&format!("add {{ dir = \"{}\" }}", home.path(PLUGIN).display())),
        "{}",
        done.out
    );
}
