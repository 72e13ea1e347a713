//! What is known of folders: a search reads again only those that have changed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::DirEntry;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ignore::Match;
use ignore::gitignore::{Gitignore, GitignoreBuilder};
use mauve_hir::{CONFIG_FILE, is_model};

use crate::disk::{is_hidden, is_made_up, read};

const MADE_BY_TOOLS: [&str; 5] = ["build", "devel", "install", "log", "node_modules"];

/// The beginning of the file that marks a cache, such as the `target` of cargo: <https://bford.info/cachedir/>.
const CACHE: (&str, &[u8]) = ("CACHEDIR.TAG", b"Signature: 8a477f597d28d172789f06886806bc55");

/// The maximal length of a `.gitignore`, and of all of them together: a pattern takes much more memory than its text.
const LONGEST_IGNORE: u64 = 1 << 16;
const MOST_IGNORED: u64 = 1 << 19;

/// The files with ignore rules; the first one has precedence.
const IGNORING: [&str; 2] = [".ignore", ".gitignore"];

/// The ignore rules of a folder and of those above, in the order of [`IGNORING`].
#[derive(Debug)]
pub(super) struct Rules {
    own: [Gitignore; 2],
    /// The length of the files with its own rules.
    bytes: u64,
    /// Whether a repository begins here: the Git rules of folders above do not apply in it.
    is_repository: bool,
    above: Option<Arc<Rules>>,
}

impl Rules {
    /// Reads the ignore rules of a folder, which may have `left` bytes, if it `has` files of these names.
    ///
    /// # Errors
    ///
    /// Why the rules are unknown.
    fn read(
        folder: &Path,
        above: Option<Arc<Rules>>,
        left: u64,
        has: impl Fn(&str) -> bool,
    ) -> Result<Rules, String> {
        let mut rules = Rules { is_repository: has(".git"), ..Rules::none(above) };
        for (name, own) in IGNORING.iter().zip(&mut rules.own).filter(|(name, _)| has(name)) {
            let path = folder.join(name);
            // A link has no rules, as for Git: what it leads to may change unnoticed.
            if path.is_symlink() {
                continue;
            }
            let bytes = match read(&path, LONGEST_IGNORE.min(left - rules.bytes)) {
                Ok(bytes) => bytes,
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => {
                    return Err(format!("this folder is not searched: cannot read its `{name}`: {error}"));
                }
            };
            rules.bytes += bytes.len() as u64;
            let mut builder = GitignoreBuilder::new(folder);
            for line in String::from_utf8_lossy(&bytes).lines() {
                // An invalid line is no rule.
                let _ = builder.add_line(None, line);
            }
            *own = builder.build().unwrap_or_else(|_| Gitignore::empty());
        }
        Ok(rules)
    }

    /// Returns the rules of a folder that has none itself.
    fn none(above: Option<Arc<Rules>>) -> Rules {
        Rules { own: [Gitignore::empty(), Gitignore::empty()], bytes: 0, is_repository: false, above }
    }

    fn ignores(&self, path: &Path, is_folder: bool) -> bool {
        for kind in 0..IGNORING.len() {
            let mut rules = Some(self);
            while let Some(here) = rules {
                match here.own.get(kind).map(|own| own.matched(path, is_folder)) {
                    Some(Match::Ignore(_)) => return true,
                    Some(Match::Whitelist(_)) => return false,
                    _ => {}
                }
                let ends = here.is_repository && IGNORING.get(kind) == Some(&".gitignore");
                rules = here.above.as_deref().filter(|_| !ends);
            }
        }
        false
    }
}

/// What a search finds in a folder.
#[derive(Debug)]
pub(super) struct FolderContent {
    pub(super) rules: Arc<Rules>,
    /// The number of all entries.
    pub(super) entries: usize,
    /// The folders in it, with their file systems.
    pub(super) folders: BTreeMap<PathBuf, Option<u64>>,
    /// The models and the configuration that are regular files.
    pub(super) regular: BTreeSet<PathBuf>,
    /// Other entries that are called like models: links, pipes.
    pub(super) special: BTreeSet<PathBuf>,
    /// Whether it has a configuration, and whether that is not ignored.
    pub(super) has_config: bool,
    pub(super) is_config_found: bool,
}

impl FolderContent {
    fn read(
        path: &Path,
        above: Option<Arc<Rules>>,
        everywhere: &Gitignore,
        left: u64,
    ) -> Result<FolderContent, String> {
        let all = entries(path)?;
        let has = |name: &str| all.iter().any(|entry| entry.file_name() == name);
        let mut found = FolderContent {
            rules: Arc::new(Rules::read(path, above, left, has)?),
            entries: all.len(),
            folders: BTreeMap::new(),
            regular: BTreeSet::new(),
            special: BTreeSet::new(),
            has_config: has(CONFIG_FILE),
            is_config_found: false,
        };
        if has(CACHE.0) && read(&path.join(CACHE.0), 1 << 12).is_ok_and(|it| it.starts_with(CACHE.1)) {
            return Ok(FolderContent { has_config: false, ..found });
        }
        for entry in all {
            let (path, kind) = (entry.path(), entry.file_type());
            let is_folder = kind.as_ref().is_ok_and(std::fs::FileType::is_dir);
            if !found.takes(&path, is_folder) || everywhere.matched(&path, is_folder).is_ignore() {
                continue;
            }
            let is_config = path.ends_with(CONFIG_FILE);
            found.is_config_found |= is_config;
            if is_folder && !is_config {
                let device = device_of(&path);
                found.folders.insert(path, device);
            } else if kind.is_ok_and(|kind| kind.is_file()) {
                found.regular.insert(path);
            } else if !is_config {
                found.special.insert(path);
            }
        }
        Ok(found)
    }

    /// Returns whether a search looks at this entry, unless the user's global rules ignore it.
    fn takes(&self, path: &Path, is_folder: bool) -> bool {
        let Some(name) = path.file_name() else { return false };
        let is_searched = || !MADE_BY_TOOLS.iter().any(|made| name == *made) && !is_made_up(path);
        let is_wanted = is_model(path) || name == CONFIG_FILE;
        (is_wanted || is_folder && is_searched())
            && !is_hidden(Path::new(name))
            && !self.rules.ignores(path, is_folder)
    }

    fn has(&self, path: &Path) -> bool {
        self.folders.contains_key(path) || self.special.contains(path)
    }
}

/// The folders that were read.
#[derive(Debug, Default, Clone)]
pub(crate) struct KnownFolders {
    known: BTreeMap<PathBuf, Arc<FolderContent>>,
    /// Those of them that have changed.
    outdated: BTreeSet<PathBuf>,
    /// The regular files that were found since they were taken.
    pub(super) new: BTreeSet<PathBuf>,
    /// How many folders were read.
    pub(super) count: u64,
    /// The length of all ignore rules.
    ignored: u64,
}

impl KnownFolders {
    /// Returns what is in a folder, which is read if that is unknown.
    ///
    /// # Errors
    ///
    /// Why the folder cannot be searched.
    pub(super) fn get(
        &mut self,
        path: &Path,
        above: Option<Arc<Rules>>,
        everywhere: &Gitignore,
    ) -> Result<Arc<FolderContent>, String> {
        if let Some(folder) = self.known.get(path).filter(|_| !self.outdated.contains(path)) {
            return Ok(Arc::clone(folder));
        }
        self.count += 1;
        let before = self.known.remove(path);
        self.ignored -= before.as_ref().map_or(0, |folder| folder.rules.bytes);
        let left = MOST_IGNORED.saturating_sub(self.ignored);
        let folder = Arc::new(FolderContent::read(path, above, everywhere, left)?);
        self.ignored += folder.rules.bytes;
        let is_new = |file: &&PathBuf| before.as_ref().is_none_or(|before| !before.regular.contains(*file));
        self.new.extend(folder.regular.iter().filter(is_new).cloned());
        self.outdated.remove(path);
        self.known.insert(path.to_owned(), Arc::clone(&folder));
        Ok(folder)
    }

    /// Returns the ignore rules of a folder around those that are searched. If they cannot be read, it has none.
    pub(super) fn rules_of(&self, path: &Path, above: Option<Arc<Rules>>) -> Arc<Rules> {
        let has = |name: &str| path.join(name).symlink_metadata().is_ok();
        match self.known.get(path) {
            Some(folder) => Arc::clone(&folder.rules),
            None => {
                let rules = Rules::read(path, above.clone(), LONGEST_IGNORE, has);
                Arc::new(rules.unwrap_or_else(|_| Rules::none(above)))
            }
        }
    }

    /// Notes that `path` was created, removed or changed. Returns whether a search may find something else now.
    pub(super) fn note(&mut self, path: &Path) -> bool {
        let Some((parent, name)) = path.parent().zip(path.file_name()) else { return self.forget(path) };
        if name == ".git" || IGNORING.iter().any(|rules| name == *rules) {
            return self.forget(parent);
        }
        let is_changed = self.forget(path);
        let Some(folder) = self.known.get(parent) else { return is_changed };
        let kind = path.symlink_metadata().ok().map(|data| data.file_type());
        let is_regular = kind.is_some_and(|kind| kind.is_file());
        let is_folder = kind.is_some_and(|kind| kind.is_dir());
        let is_new = match folder.regular.contains(path) {
            true => !is_regular,
            false if name == CONFIG_FILE || name == CACHE.0 => true,
            false => folder.has(path) || kind.is_some() && folder.takes(path, is_folder),
        };
        if is_new {
            self.outdated.insert(parent.to_owned());
        }
        is_changed || is_new
    }

    /// Forgets a folder and those in it. Returns whether one was known.
    pub(super) fn forget(&mut self, folder: &Path) -> bool {
        // In this order, the folders in a folder follow it.
        let from = self.known.range(folder.to_owned()..);
        let gone: Vec<PathBuf> =
            from.map(|(path, _)| path).take_while(|it| it.starts_with(folder)).cloned().collect();
        let gone_folders = gone.iter().filter_map(|folder| self.known.remove(folder));
        self.ignored -= gone_folders.map(|folder| folder.rules.bytes).sum::<u64>();
        !gone.is_empty()
    }

    /// Reads again the folders that were not watched when they were read: `is_watched` returns whether a folder was, and
    /// nothing for a folder that still is not.
    pub(super) fn distrust(&mut self, is_watched: impl Fn(&Path) -> Option<bool>) {
        self.known.retain(|folder, _| is_watched(folder).is_some());
        self.ignored = self.known.values().map(|folder| folder.rules.bytes).sum();
        let new = self.known.keys().filter(|folder| is_watched(folder) == Some(false));
        self.outdated.extend(new.cloned());
    }

    /// Returns whether a search has not found this file where it would find one: it was created since, and read because another one
    /// includes it.
    pub(super) fn lacks(&self, path: &Path) -> bool {
        let folder = path.parent().and_then(|folder| self.known.get(folder));
        folder.is_some_and(|folder| !folder.regular.contains(path) && folder.takes(path, false))
    }

    /// Returns whether this is a regular file that a search has found: its path has no links.
    pub(super) fn has_regular(&self, path: &Path) -> bool {
        let folder = path.parent().and_then(|folder| self.known.get(folder));
        folder.is_some_and(|folder| folder.regular.contains(path))
    }
}

/// Returns the number of the file system of a folder.
pub(super) fn device_of(folder: &Path) -> Option<u64> {
    use std::os::unix::fs::MetadataExt as _;
    folder.symlink_metadata().ok().map(|data| data.dev())
}

/// Returns the entries of a folder, sorted by name; why there are none if it cannot be read.
pub(super) fn entries(folder: &Path) -> Result<Vec<DirEntry>, String> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut entries = entries.map_err(|error| format!("cannot read this folder: {error}"))?;
    entries.sort_by_key(DirEntry::file_name);
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use mauve_hir::Database;
    use mauve_tests::{Random, own_scratch, write};

    use super::*;
    use crate::load::{DiskSearch, LoadedWorkspaces, Loader, Workspace};

    /// What a server does with a folder: it is told of what changes in watched folders, and only that.
    struct Server {
        top: PathBuf,
        db: Database,
        loader: Loader,
        watched: BTreeSet<PathBuf>,
        workspaces: Vec<Workspace>,
        is_due: bool,
        search: Option<DiskSearch>,
        /// What was changed last, which often changes again.
        last: PathBuf,
    }

    impl Server {
        fn new(top: &Path) -> Server {
            let (db, loader, watched) = (Database::default(), Loader::new(false), BTreeSet::new());
            let (workspaces, search, last) = (Vec::new(), None, top.join("d/n.mal"));
            let mut server =
                Server { top: top.to_owned(), db, loader, watched, workspaces, is_due: false, search, last };
            server.load();
            server.settle();
            server
        }

        fn load(&mut self) {
            let Some(LoadedWorkspaces { workspaces, .. }) =
                self.loader.load(&mut self.db, std::slice::from_ref(&self.top))
            else {
                self.is_due = true;
                return;
            };
            self.loader.forget_texts();
            self.workspaces = workspaces;
            let mut folders = self.loader.watch_set().folders_to_watch();
            folders.retain(|folder| folder.is_dir());
            let new = folders.difference(&self.watched).cloned().collect::<BTreeSet<PathBuf>>();
            self.loader.distrust(|folder| folders.contains(folder).then(|| !new.contains(folder)), &new);
            self.watched = folders;
            self.is_due |= !new.is_empty();
        }

        /// The server is told of a change.
        fn event(&mut self, path: &Path) {
            if !self.watched.contains(path) && !path.parent().is_some_and(|it| self.watched.contains(it)) {
                return;
            }
            let known = self.watched.len();
            self.watched.retain(|folder| !folder.starts_with(path));
            if self.loader.refreshed(&mut self.db, path).is_none() {
                self.is_due |= self.loader.note(path, self.watched.len() < known);
            }
        }

        /// Begins a search, or takes what it has found.
        fn advance(&mut self) {
            match self.search.take() {
                None if self.is_due => {
                    self.is_due = false;
                    let mut search = self.loader.search();
                    search.run(&|| false, &|_| {});
                    self.search = Some(search);
                }
                None => {}
                Some(search) => {
                    let is_wanted = self.loader.walks.is_one_wanted();
                    let (is_changed, is_again) = self.loader.learn(&self.db, search);
                    self.is_due |= is_again;
                    if is_changed || is_wanted {
                        self.load();
                    }
                }
            }
        }

        fn settle(&mut self) {
            while self.is_due || self.search.is_some() {
                self.advance();
            }
        }

        /// The files of the workspaces with their texts.
        fn state(&self) -> Vec<String> {
            let files = self.workspaces.iter().flat_map(|workspace| {
                let folder = workspace.folder(&self.db).display();
                let files = workspace.files(&self.db).iter();
                files.map(move |(path, file)| {
                    let (text, problem) = (file.text(&self.db), file.problem(&self.db));
                    format!("{folder}: {}: {text:?} {problem:?}", path.display())
                })
            });
            let mut files: Vec<String> = files.collect();
            files.sort();
            files
        }

        /// A program changes something at random.
        fn change(&mut self, random: &mut Random) -> String {
            let folders = ["a", "a/b", "a/b/c", "d", "d/e", "build", "d/node_modules", ".hidden", "x.mal"];
            let [one, other] = [*random.of(&folders), *random.of(&folders)].map(|name| self.top.join(name));
            let files = ["m.mal", "n.mal", "mauve.toml", "t.toml", ".gitignore", "CACHEDIR.TAG", ".git/x"];
            let name = *random.of(&files);
            let path = match random.below(6) {
                0 => self.top.join(name),
                1 | 2 => self.last.clone(),
                _ => one.join(name),
            };
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            self.last = path.clone();
            let below = |path: &Path| {
                let mut all = vec![path.to_owned()];
                let mut next = 0;
                while let Some(path) = all.get(next).cloned() {
                    let is_link = path.is_symlink();
                    let inner = fs::read_dir(&path).into_iter().flatten().flatten().filter(|_| !is_link);
                    all.extend(inner.map(|entry| entry.path()));
                    next += 1;
                }
                all
            };
            let (what, changed) = match random.below(7) {
                0 => (format!("remove {}", one.display()), {
                    let gone = below(&one);
                    let _ = fs::remove_dir_all(&one).or_else(|_| fs::remove_file(&one));
                    gone
                }),
                1 => (format!("remove {}", path.display()), {
                    let _ = fs::remove_file(&path);
                    vec![path]
                }),
                2 => (format!("rename {} {}", one.display(), other.display()), {
                    let _ = fs::rename(&one, &other);
                    vec![one, other]
                }),
                3 => (format!("link {}", path.display()), {
                    let _ = symlink(random.of(&["m.mal", "../a/n.mal", "b", "nothing"]), &path);
                    vec![path]
                }),
                4 => (format!("make {}", one.display()), {
                    let _ = fs::create_dir_all(&one);
                    one.ancestors().map(Path::to_owned).collect()
                }),
                _ => {
                    let text = match name.as_str() {
                        ".gitignore" => *random.of(&["", "b\n", "*.mal\n!m.mal\n", "/d/\n"]),
                        "CACHEDIR.TAG" => *random.of(&["Signature: 8a477f597d28d172789f06886806bc55\n", ""]),
                        "mauve.toml" => *random.of(&["", "timing.tables = [\"*.toml\", \"**/t.toml\"]\n"]),
                        _ => *random.of(&["codel f(): int\n", "codel g(): int\n", "include \"a/m.mal\"\n"]),
                    };
                    let _ = fs::create_dir_all(path.parent().unwrap()).and_then(|()| fs::write(&path, text));
                    // It may be a link to a file, which is written instead.
                    let real = path.canonicalize().ok();
                    let all = path.ancestors().map(Path::to_owned).chain(real).collect::<Vec<PathBuf>>();
                    (format!("write {} {text:?}", path.display()), all.into_iter().rev().collect())
                }
            };
            let top = self.top.clone();
            for path in changed.iter().filter(|path| **path != top && path.starts_with(&top)) {
                self.event(path);
            }
            what
        }
    }

    #[test]
    fn what_was_searched_step_by_step_is_what_a_first_search_finds() {
        for seed in mauve_tests::search::seeds("MAUVE_HISTORIES", 750) {
            let top = own_scratch(&format!("folders-{seed}")).canonicalize().unwrap();
            let mut random = Random::of_seed(seed);
            write(&top, &[("a/b/m.mal", "codel f(): int\n"), ("d/n.mal", "codel h(): int\n")]);
            let mut server = Server::new(&top);
            let mut said = Vec::new();
            for _ in 0..1 + random.below(25) {
                said.push(server.change(&mut random));
                // Changes meet the search at different moments.
                if random.below(3) > 0 {
                    server.advance();
                }
                // A text is opened, for example.
                if random.below(6) == 0 {
                    server.load();
                }
            }
            server.settle();
            let fresh = Server::new(&top);
            assert_eq!(server.state(), fresh.state(), "seed {seed}: {said:#?}");
            fs::remove_dir_all(top).unwrap();
        }
    }

    /// A file that was renamed and back while a search passed, and that another one includes meanwhile.
    #[test]
    fn a_file_that_is_only_known_by_an_include_is_searched() {
        let top = own_scratch("folders-include").canonicalize().unwrap();
        write(&top, &[("m.mal", "include \"d/n.mal\"\n"), ("d/n.mal", "codel g(): int\n")]);
        let mut server = Server::new(&top);
        let (file, other) = (top.join("d/n.mal"), top.join("d/renamed"));
        fs::rename(&file, &other).unwrap();
        server.event(&file);
        server.advance();
        fs::rename(&other, &file).unwrap();
        server.advance();
        server.event(&file);
        write(&top, &[("m.mal", "codel f(): int\n"), ("mauve.toml", "")]);
        server.event(&top.join("m.mal"));
        server.event(&top.join("mauve.toml"));
        server.settle();
        assert_eq!(server.state(), Server::new(&top).state());
        assert!(server.state().iter().any(|it| it.contains("codel g")));
        fs::remove_dir_all(top).unwrap();
    }

    #[test]
    fn only_what_has_changed_is_searched_and_what_is_ignored_costs_nothing() {
        let top = own_scratch("folders-count").canonicalize().unwrap();
        for number in 0..40 {
            let path = format!("d{}/e{number}/m.mal", number % 4);
            write(&top, &[(path.as_str(), "codel f(): int\n")]);
        }
        write(&top, &[(".gitignore", "*.log\n/out/\n"), ("mauve.toml", "")]);
        let mut server = Server::new(&top);
        let searched = |server: &mut Server, paths: &[&str]| {
            let before = server.loader.searched();
            paths.iter().for_each(|path| server.event(&top.join(path)));
            server.settle();
            server.loader.searched() - before
        };
        // The folder around it, itself, and itself again once it is watched.
        write(&top, &[("d1/new/m.mal", "codel g(): int\n")]);
        assert_eq!(searched(&mut server, &["d1/new"]), 3);
        assert!(server.state().iter().any(|file| file.contains("d1/new/m.mal")));
        fs::remove_dir_all(top.join("d1/new")).unwrap();
        assert_eq!(searched(&mut server, &["d1/new/m.mal", "d1/new"]), 1);
        // A file of another kind, a text that has changed, what came and went, and what nothing looks at.
        for (event, path) in [
            ("d1/notes.txt", "d1/notes.txt"),
            ("d1/e1/m.mal", "d1/e1/m.mal"),
            ("node_modules", "node_modules/x/m.mal"),
            ("build", "build/m.mal"),
            (".cache", ".cache/m.mal"),
            ("out", "out/m.mal"),
            ("d1/a.log", "d1/a.log/m.mal"),
        ] {
            write(&top, &[(path, "codel h(): int\n")]);
            assert_eq!(searched(&mut server, &[event, path, "d1/4913"]), 0, "{path}");
        }
        assert!(server.state().iter().any(|file| file.contains("codel h")));
        // The mark of a cache ends the search there.
        write(&top, &[("target/CACHEDIR.TAG", str::from_utf8(CACHE.1).unwrap()), ("target/debug/m.mal", "")]);
        assert_eq!(searched(&mut server, &["target"]), 3);
        assert!(server.state().iter().all(|file| !file.contains("target")));
        // New rules apply to all below, and only there.
        write(&top, &[("d2/.gitignore", "e2\n")]);
        assert_eq!(searched(&mut server, &["d2/.gitignore"]), 10);
        fs::remove_dir_all(top).unwrap();
    }
}
