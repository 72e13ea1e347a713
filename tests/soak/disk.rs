//! Somebody else changes the disk: single files, folders, and storms of both, as `git checkout` causes.

use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Stdio};

use super::*;

/// Files that come and go, beside those that are edited. The last two become links.
const EXTRA: [&str; 5] = [
    "p3dx/extra.mal",
    "p3dx/components/extra.mal",
    "project/deep/down/extra.mal",
    "project/linked.mal",
    "p3dx/components/linked.mal",
];

/// A repository of the files, outside their folder; none where git is not installed.
pub(super) struct Repository {
    folder: PathBuf,
    commits: Vec<String>,
}

impl Repository {
    /// Commits several states of the files that are edited. The last state is the first one.
    pub(super) fn new(top: &Path, random: &mut Random) -> Option<Repository> {
        let mut repository = Repository { folder: top.with_extension("git"), commits: Vec::new() };
        let _ = std::fs::remove_dir_all(&repository.folder);
        repository.git(top, &["init", "-q"])?;
        for round in 0..4 {
            let files = FILES.iter().filter(|file| **file != LINK && **file != UNTITLED);
            for file in files.filter(|_| round > 0) {
                let path = top.join(file);
                let Ok(text) = std::fs::read_to_string(&path) else { continue };
                match random.below(4) {
                    0 => drop(std::fs::rename(&path, path.with_extension("moved.mal"))),
                    1 => drop(std::fs::remove_file(&path)),
                    _ => drop(std::fs::write(&path, damaged(random, &text))),
                }
            }
            repository.git(top, &["add", "-A"])?;
            repository.git(top, &["commit", "-q", "-m", "state"])?;
            repository.commits.push(repository.git(top, &["rev-parse", "HEAD"])?.trim().to_owned());
        }
        repository.check_out(top, 0);
        Some(repository)
    }

    fn git(&self, top: &Path, arguments: &[&str]) -> Option<String> {
        let output = Command::new("git")
            .env("GIT_DIR", &self.folder)
            .env("GIT_WORK_TREE", top)
            .env("GIT_CONFIG_GLOBAL", "/dev/null")
            .args(["-c", "user.name=soak", "-c", "user.email=soak@localhost", "-c", "gc.auto=0"])
            .args(arguments)
            .stderr(Stdio::null())
            .output()
            .ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    }

    fn check_out(&self, top: &Path, commit: usize) {
        let commit = &self.commits[commit % self.commits.len()];
        let _ = self.git(top, &["checkout", "-q", "-f", commit]);
    }
}

impl Session {
    /// Somebody else writes a file, takes it away, or moves it.
    pub(super) fn change_disk(&mut self, random: &mut Random) {
        let file = random.below(FILES.len() - 2);
        let kind = self.change_file(&self.top.join(FILES[file]), &self.originals[file].clone(), random);
        self.notice(&[(file, kind)], random);
    }

    /// Many changes at once, of all kinds.
    pub(super) fn storm(&mut self, random: &mut Random) {
        for _ in 0..5 + random.below(40) {
            match random.below(8) {
                0 => self.change_extra(random),
                1 => self.change_mode(random),
                2 => self.move_a_folder(random),
                3 if random.below(5) == 0 => self.check_out(random),
                _ => self.change_disk(random),
            }
        }
    }

    fn check_out(&mut self, random: &mut Random) {
        if let Some(repository) = &self.repository {
            repository.check_out(&self.top, random.below(4));
            self.disk_operations += 1;
        }
    }

    /// Returns the kind of change as the protocol counts them.
    fn change_file(&mut self, path: &Path, original: &str, random: &mut Random) -> u8 {
        self.disk_operations += 1;
        let away = path.with_extension("away.mal");
        match random.below(5) {
            0 => {
                drop(std::fs::write(path, damaged(random, original)));
                2
            }
            1 => {
                drop(std::fs::remove_file(path));
                3
            }
            2 if away.exists() => {
                drop(std::fs::rename(&away, path));
                1
            }
            2 => {
                drop(std::fs::rename(path, &away));
                3
            }
            3 => {
                // At once, as editors and git write.
                let new = path.with_extension("new");
                if std::fs::write(&new, original).is_ok() {
                    drop(std::fs::rename(new, path));
                }
                1
            }
            _ => {
                drop(std::fs::write(path, original));
                2
            }
        }
    }

    /// A file that no project had before, a folder that is called like a model, or a link to another model. A text that may be
    /// open, itself or through a link, becomes no folder: a server does not open folders.
    fn change_extra(&mut self, random: &mut Random) {
        self.disk_operations += 1;
        let extra = random.below(EXTRA.len() + 1);
        let path = self.top.join(EXTRA.get(extra).unwrap_or(&LINK));
        let original = random.of(&self.originals).clone();
        let folder = path.parent().unwrap().to_owned();
        drop(std::fs::remove_file(&path));
        drop(std::fs::remove_dir_all(&path));
        match random.below(4) {
            0 => drop(folder.ends_with("down").then(|| std::fs::remove_dir_all(&folder))),
            1 if (1..EXTRA.len()).contains(&extra) => drop(std::fs::create_dir_all(path)),
            _ if extra < 3 => {
                drop(std::fs::create_dir_all(&folder));
                drop(std::fs::write(path, original));
            }
            _ => {
                let to = random.of(&[FILES[0], FILES[9], FILES[11], "p3dx/never.mal", EXTRA[0]]);
                drop(std::os::unix::fs::symlink(self.top.join(to), path));
            }
        }
    }

    fn change_mode(&mut self, random: &mut Random) {
        self.disk_operations += 1;
        let path = self.top.join(FILES[random.below(FILES.len() - 2)]);
        let mode = *random.of(&[0o600, 0o444, 0o755]);
        let _ = std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode));
    }

    /// The client may see what changes on the disk as well as the server does.
    pub(super) fn notice(&mut self, files: &[(usize, u8)], random: &mut Random) {
        if random.below(2) == 0 {
            let change = |(file, kind): &(usize, u8)| json!({"uri": uri(&self.top, *file), "type": kind});
            let changes: Vec<Value> = files.iter().map(change).collect();
            self.client.notify("workspace/didChangeWatchedFiles", json!({"changes": changes}));
        }
    }

    /// Removes, restores or replaces a folder.
    pub(super) fn move_a_folder(&mut self, random: &mut Random) {
        self.disk_operations += 1;
        let name = *random.of(&["p3dx/timing", "p3dx/components"]);
        let (here, away) = (self.top.join(name), self.top.join(format!("{name}.away")));
        if !here.exists() {
            drop(std::fs::rename(away, here));
        } else if random.below(2) == 0 && !away.exists() {
            drop(std::fs::rename(here, away));
        } else if name == "p3dx/timing" && !away.exists() && std::fs::rename(&here, &away).is_ok() {
            drop(std::fs::create_dir(&here));
            drop(std::fs::write(here.join("p3dx.toml"), damaged(random, &self.originals[1])));
            drop(std::fs::remove_dir_all(away));
        }
    }
}
