//! Plans the changes that update a folder to a set of packages, without losing files of the user.
//!
//! A generated file is overwritten if its text differs, and removed if it is no longer generated, provided that it
//! still has the hash in the manifest of its package (`manifest.rs`). Otherwise somebody edited it, or it is not
//! ours: that needs force. Line ends do not count, since checkouts change them.
//!
//! A folder may have come from a stranger, and its manifest may know the hash of any file. So only what says of itself that
//! the generator wrote it is removed, with force too, and is overwritten without. Names that differ in case alone are one
//! file on some file systems: what is made no more stays where it is called almost as what is made.
//!
//! A codel's file is the user's, and is written only where there is none, or a stub that nobody has edited. When the prototype is
//! another one, a stub of it is put beside: `clearance.cpp.new`. That is settled when the user's file defines what the model says now
//! (`prototype.rs`), or when the user has removed the stub; then the stub goes, unless it was edited. No force changes that.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use crate::codels::{is_empty_stub, is_stub};
use crate::generated_file::{FileOwner, GeneratedFile, GeneratedPackage, is_marked};
use crate::manifest::{CodelFile, MANIFEST, Manifest, ManifestError, Offer};
use crate::prototype::Prototype;
use crate::type_hash::hash;

/// The steps that update a folder.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Plan {
    /// The steps, sorted by path within each package; empty if all files are up to date.
    pub steps: Vec<PlanStep>,
    /// The paths of generated files that were edited. Without `--force`, no step is executed while there are any.
    pub edited: Vec<String>,
    /// Codels whose prototype has changed, and whose file the user has not yet updated.
    pub changed_codels: Vec<ChangedCodel>,
    /// The paths of codel files whose codels are no longer in the model. They belong to the user, and are kept.
    pub left_codels: Vec<String>,
    /// The paths of files that a manifest lists as generated, that are no longer generated, and that the user may
    /// have written. They are kept, and removed from the manifest.
    pub left_files: Vec<String>,
}

impl Plan {
    /// Returns whether all files are up to date.
    pub fn is_settled(&self) -> bool {
        self.steps.is_empty() && self.edited.is_empty() && self.changed_codels.is_empty()
    }

    /// Returns whether what is compiled is up to date. The exported analyses have times of timing tables, and no build reads them.
    pub fn has_current_code(&self) -> bool {
        let is_export = |path: &str| path.contains("/models/") && path.ends_with(".json");
        let is_other = |step: &PlanStep| {
            let is_known = is_export(&step.path) || step.path.ends_with(MANIFEST);
            is_known && matches!(step.action, Action::Change(_))
        };
        self.changed_codels.is_empty()
            && self.steps.iter().all(is_other)
            && self.edited.iter().all(|path| is_export(path))
    }
}

/// A file to create, change or remove.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanStep {
    /// The path relative to the folder of the packages, with `/` separators.
    pub path: String,
    /// The change of the file.
    pub action: Action,
}

/// A change of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Creates the file with this text.
    Create(String),
    /// Replaces the text of the file.
    Change(String),
    /// Removes the file.
    Remove,
}

impl Action {
    /// Returns the word for the action.
    pub fn name(&self) -> &'static str {
        match self {
            Action::Create(_) => "create",
            Action::Change(_) => "change",
            Action::Remove => "remove",
        }
    }
}

/// A codel whose prototype differs from the one that the user's file was written for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedCodel {
    /// The path of the user's file, relative to the folder of the packages.
    pub path: String,
    /// The prototype that the file defines, or was written for; empty if unknown.
    pub before: String,
    /// The prototype in the model.
    pub now: String,
}

/// Why there is no plan for a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlanError {
    /// A file of the folder cannot be read: the message of the reader.
    Unreadable(String),
    /// The names of these two packages differ in case only.
    SameFolder(String, String),
    /// A manifest is invalid.
    Manifest {
        /// The path of the manifest, relative to the folder of the packages.
        path: String,
        /// Why.
        error: ManifestError,
    },
}

/// Plans the steps that update a folder to `packages`. `read` returns the text of a file in the folder, or `None` if
/// it does not exist.
///
/// # Errors
///
/// `read` fails, a manifest is invalid, or two packages would have the same folder on a file system that ignores case.
pub fn plan(
    packages: &[GeneratedPackage],
    read: &dyn Fn(&str) -> Result<Option<String>, String>,
) -> Result<Plan, PlanError> {
    let mut plan = Plan::default();
    let mut names: FxHashMap<String, &str> = FxHashMap::default();
    for package in packages {
        // Within a project this is reported as a problem; here the packages may come from several projects.
        let first = *names.entry(package.name.to_ascii_lowercase()).or_insert(&package.name);
        if first != package.name {
            return Err(PlanError::SameFolder(first.to_owned(), package.name.clone()));
        }
        let manifest = format!("{}/{MANIFEST}", package.name);
        let text = read(&manifest).map_err(PlanError::Unreadable)?;
        let unusable = |error| PlanError::Manifest { path: manifest.clone(), error };
        let read_manifest = |text| Manifest::read(&package.name, text);
        let before = text.as_deref().map_or_else(|| Ok(Manifest::default()), read_manifest);
        let before = before.map_err(unusable)?;
        let mut written: FxHashMap<String, Vec<String>> = FxHashMap::default();
        for (path, hash) in &before.files {
            written.entry(path.to_ascii_lowercase()).or_default().push(hash.clone());
        }
        let (now, begin) = (Manifest::default(), plan.steps.len());
        let mut planner = Planner { package, read, before, written, now, plan: &mut plan };
        planner.package().map_err(PlanError::Unreadable)?;
        let now = planner.now.text().map_err(unusable)?;
        planner.write(MANIFEST, text.as_deref(), &now);
        plan.steps[begin..].sort_by(|a, b| a.path.cmp(&b.path));
    }
    Ok(plan)
}

/// Returns whether two texts are equal except for their line ends.
fn is_same_text(a: &str, b: &str) -> bool {
    a == b || hash(a) == hash(b)
}

/// Plans the steps for one package; paths are relative to its folder.
struct Planner<'a> {
    package: &'a GeneratedPackage,
    read: &'a dyn Fn(&str) -> Result<Option<String>, String>,
    before: Manifest,
    /// The hashes of its generated files, by their paths in lower case, as some file systems compare names.
    written: FxHashMap<String, Vec<String>>,
    now: Manifest,
    plan: &'a mut Plan,
}

impl Planner<'_> {
    fn package(&mut self) -> Result<(), String> {
        for file in &self.package.files {
            match &file.owner {
                FileOwner::Generator => self.generated(file)?,
                FileOwner::User { prototype } => self.codel(file, prototype)?,
            }
        }
        // In lower case, as some file systems compare names.
        let paths = self.package.files.iter().map(|file| file.path.as_str());
        let paths: BTreeMap<String, &str> = paths.map(|path| (path.to_ascii_lowercase(), path)).collect();
        let before = std::mem::take(&mut self.before);
        for (path, written) in &before.files {
            match paths.get(&path.to_ascii_lowercase()) {
                None => self.stale(path, written)?,
                Some(current) if path != current && self.is_another(path, current)? => {
                    self.plan.left_files.push(self.path(path));
                }
                Some(_) => {}
            }
        }
        for (path, known) in &before.codels {
            match paths.get(&path.to_ascii_lowercase()) {
                None => {
                    if self.text(path)?.is_some() {
                        self.plan.left_codels.push(self.path(path));
                    }
                    self.withdraw(path, known.offered.as_ref())?;
                }
                Some(current) if path != current && self.is_another(path, current)? => {
                    self.plan.left_codels.push(self.path(path));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    /// Returns whether `path` and `current`, which differ in case only, are two files. On a file system that ignores
    /// case, both are the same file.
    fn is_another(&self, path: &str, current: &str) -> Result<bool, String> {
        let there = self.text(path)?;
        Ok(there.is_some() && there != self.text(current)?)
    }

    fn path(&self, path: &str) -> String {
        format!("{}/{path}", self.package.name)
    }

    fn text(&self, path: &str) -> Result<Option<String>, String> {
        (self.read)(&self.path(path))
    }

    fn step(&mut self, path: &str, action: Action) {
        let path = self.path(path);
        self.plan.steps.push(PlanStep { path, action });
    }

    /// Plans a file with this text, where `there` is its text now.
    fn write(&mut self, path: &str, there: Option<&str>, text: &str) {
        match there {
            None => self.step(path, Action::Create(text.to_owned())),
            Some(there) if is_same_text(there, text) => {}
            Some(_) => self.step(path, Action::Change(text.to_owned())),
        }
    }

    fn generated(&mut self, file: &GeneratedFile) -> Result<(), String> {
        let path = file.path.as_str();
        let there = self.text(path)?;
        if let Some(text) = there.as_deref().filter(|it| !is_same_text(it, &file.text)) {
            let written = self.written.get(&path.to_ascii_lowercase());
            let is_written = written.is_some_and(|written| written.contains(&hash(text)));
            if !is_written || !is_marked(text) {
                self.plan.edited.push(self.path(path));
            }
        }
        self.write(path, there.as_deref(), &file.text);
        self.now.files.insert(path.to_owned(), hash(&file.text));
        Ok(())
    }

    /// Plans for a listed file that is no longer generated.
    fn stale(&mut self, path: &str, written: &str) -> Result<(), String> {
        let Some(text) = self.text(path)? else { return Ok(()) };
        if !is_marked(&text) {
            self.plan.left_files.push(self.path(path));
            return Ok(());
        }
        if hash(&text) != written {
            self.plan.edited.push(self.path(path));
        }
        self.step(path, Action::Remove);
        Ok(())
    }

    /// Plans for the file of a codel.
    fn codel(&mut self, stub: &GeneratedFile, prototype: &str) -> Result<(), String> {
        let path = stub.path.as_str();
        let known = self.before.codels.remove(path).unwrap_or_default();
        let is_stub = |text: &String| {
            let is_unedited = known.stub.as_deref() == Some(&hash(text)) && is_empty_stub(text);
            is_unedited || is_same_text(text, &stub.text)
        };
        let there = self.text(path)?;
        let now = match there.as_ref().filter(|text| !is_stub(text)) {
            Some(text) => self.written(stub, prototype, text, known)?,
            None => {
                self.write(path, there.as_deref(), &stub.text);
                self.withdraw(path, known.offered.as_ref())?;
                let (prototype, stub) = (Some(prototype.to_owned()), Some(hash(&stub.text)));
                CodelFile { prototype, stub, ..CodelFile::default() }
            }
        };
        self.now.codels.insert(path.to_owned(), now);
        Ok(())
    }

    /// Plans for a file that the user has written, and returns its new record.
    fn written(
        &mut self,
        stub: &GeneratedFile,
        prototype: &str,
        text: &str,
        mut known: CodelFile,
    ) -> Result<CodelFile, String> {
        let path = stub.path.as_str();
        let beside = offered_path(path);
        let there = self.text(&beside)?;
        // The user has removed the stub, and so has confirmed the file.
        if let Some(offer) = known.offered.take_if(|_| there.is_none()) {
            known = CodelFile { prototype: Some(offer.prototype), is_right: true, ..known };
        }
        let before = known.prototype.as_deref();
        let is_same = before.is_some_and(|before| Prototype::is_same(before, prototype));
        // A compiler does not notice two exchanged parameters of the same type.
        let moved = before.filter(|before| is_same && Prototype::has_moved(before, prototype));
        let other_in = |prototype: &str| Prototype::read(prototype)?.other_in(text);
        let other = other_in(prototype);
        let is_defined = Prototype::read(prototype).is_some_and(|it| it.is_defined_in(text));
        let follows = moved.is_none_or(|before| other_in(before).is_some());
        let is_as_said = is_same && moved.is_none();
        if is_as_said && known.is_right || other.is_none() && (is_as_said || is_defined && follows) {
            self.withdraw(path, known.offered.as_ref())?;
            let is_right = is_as_said && known.is_right;
            return Ok(CodelFile { prototype: Some(prototype.to_owned()), is_right, offered: None, ..known });
        }
        self.plan.changed_codels.push(ChangedCodel {
            path: self.path(path),
            before: other.or_else(|| known.prototype.clone()).unwrap_or_default(),
            now: prototype.to_owned(),
        });
        let offer = Offer { prototype: prototype.to_owned(), hash: hash(&stub.text) };
        let is_ours = |text: &str| known.offered.as_ref().is_some_and(|it| is_offered(it, text));
        // The user has edited the stub.
        if there.as_ref().is_some_and(|text| !is_same_text(text, &stub.text) && !is_ours(text)) {
            return Ok(known);
        }
        self.write(&beside, there.as_deref(), &stub.text);
        Ok(CodelFile { offered: Some(offer), ..known })
    }

    /// Removes the stub next to a file of the user, unless the user has edited it.
    fn withdraw(&mut self, path: &str, offered: Option<&Offer>) -> Result<(), String> {
        let beside = offered_path(path);
        if let Some(offer) = offered
            && self.text(&beside)?.is_some_and(|text| is_offered(offer, &text))
        {
            self.step(&beside, Action::Remove);
        }
        Ok(())
    }
}

/// Returns whether a text is the unchanged stub that was written next to a file of the user.
fn is_offered(offer: &Offer, text: &str) -> bool {
    offer.hash == hash(text) && is_stub(text)
}

fn offered_path(path: &str) -> String {
    format!("{path}.new")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::codels::STUB;
    use crate::generated_file::generated_from;

    /// The files of a folder.
    #[derive(Debug, Clone, PartialEq, Eq, Default)]
    struct Folder(BTreeMap<String, String>);

    impl Folder {
        fn plan(&self, packages: &[GeneratedPackage]) -> Plan {
            plan(packages, &|path| Ok(self.0.get(path).cloned())).unwrap()
        }

        fn apply(&mut self, plan: &Plan) {
            for PlanStep { path, action } in &plan.steps {
                let before = match action {
                    Action::Create(text) => (self.0.insert(path.clone(), text.clone()), false),
                    Action::Change(text) => (self.0.insert(path.clone(), text.clone()), true),
                    Action::Remove => (self.0.remove(path), true),
                };
                assert_eq!(before.0.is_some(), before.1, "{path}: {action:?}");
            }
        }

        /// The steps and findings of a plan, a line each, and what they lead to.
        fn generate(&mut self, packages: &[GeneratedPackage]) -> String {
            let plan = self.plan(packages);
            if plan.edited.is_empty() {
                self.apply(&plan);
            }
            shown(&plan)
        }

        fn text(&mut self, path: &str) -> &mut String {
            self.0.get_mut(path).unwrap()
        }
    }

    fn shown(plan: &Plan) -> String {
        let mut out = String::new();
        for PlanStep { path, action } in plan.steps.iter().filter(|step| !step.path.ends_with(MANIFEST)) {
            // Each begins with a mark.
            let rest = |text: &str| text.split_once('\n').map(|(_, rest)| rest.trim().to_owned());
            let (sign, text) = match action {
                Action::Create(text) => ("+", rest(text).unwrap()),
                Action::Change(text) => ("~", rest(text).unwrap()),
                Action::Remove => ("-", String::new()),
            };
            out += format!("{sign} {path} {text}").trim();
            out.push('\n');
        }
        plan.edited.iter().for_each(|path| out += &format!("edited {path}\n"));
        plan.left_codels.iter().chain(&plan.left_files).for_each(|path| out += &format!("left {path}\n"));
        for ChangedCodel { path, before, now } in &plan.changed_codels {
            out += &format!("changed {path}: {before:?} to {now:?}\n");
        }
        out
    }

    /// A text as the generator writes it.
    fn marked(text: &str) -> String {
        format!("# {}\n{text}", generated_from("p"))
    }

    fn generated(path: &str, text: &str) -> GeneratedFile {
        GeneratedFile { path: path.to_owned(), text: marked(text), owner: FileOwner::Generator }
    }

    /// The stub of `f`, with this prototype.
    fn codel(name: &str, prototype: &str) -> GeneratedFile {
        GeneratedFile {
            path: format!("src/codels/{name}.cpp"),
            text: format!("{STUB}\n{prototype} {{ }}\n"),
            owner: FileOwner::User { prototype: prototype.to_owned() },
        }
    }

    fn package(files: Vec<GeneratedFile>) -> [GeneratedPackage; 1] {
        [GeneratedPackage { name: "p".to_owned(), files }]
    }

    const A: &str = "launch/a.launch";
    const B: &str = "launch/b.launch";
    const C: &str = "scripts/c.lua";
    const D: &str = "scripts/d.lua";

    const F: &str = "p/src/codels/f.cpp";
    const NEW: &str = "p/src/codels/f.cpp.new";

    #[test]
    fn only_what_changes_is_written() {
        let mut folder = Folder::default();
        let first = package(vec![generated(A, "a 1\n"), generated(C, "c 1\n"), codel("f", "int f()")]);
        assert_eq!(
            folder.generate(&first),
            "+ p/launch/a.launch a 1\n+ p/scripts/c.lua c 1\n+ p/src/codels/f.cpp int f() { }\n"
        );
        assert!(folder.plan(&first).is_settled());
        let second = package(vec![generated(A, "a 2\n"), generated(D, "d 1\n"), codel("f", "int f()")]);
        assert_eq!(
            folder.generate(&second),
            "~ p/launch/a.launch a 2\n- p/scripts/c.lua\n+ p/scripts/d.lua d 1\n"
        );
        assert!(folder.plan(&second).is_settled());
        // What was taken away comes again.
        folder.0.remove("p/launch/a.launch");
        assert_eq!(folder.generate(&second), "+ p/launch/a.launch a 2\n");
    }

    #[test]
    fn a_generated_file_that_was_edited_is_for_force_alone() {
        let mut folder = Folder::default();
        let first = package(vec![generated(A, "a 1\n"), generated(B, "b 1\n")]);
        folder.generate(&first);
        *folder.text("p/launch/a.launch") += "mine\n";
        let edited = "~ p/launch/a.launch a 1\nedited p/launch/a.launch\n";
        assert_eq!(folder.generate(&first), edited);
        assert_eq!(folder.generate(&first), edited);
        assert_eq!(
            folder.generate(&package(Vec::new())),
            "- p/launch/a.launch\n- p/launch/b.launch\nedited p/launch/a.launch\n"
        );
        // What the edit made of it is what the model makes of it now.
        let as_edited = package(vec![generated(A, "a 1\nmine\n"), generated(B, "b 1\n")]);
        assert_eq!(folder.generate(&as_edited), "");
        assert!(folder.plan(&as_edited).is_settled());
    }

    #[test]
    fn a_file_that_no_manifest_knows_is_somebodys() {
        let mut folder = Folder::default();
        folder.0.insert("p/launch/a.launch".to_owned(), "mine\n".to_owned());
        folder.0.insert("p/launch/b.launch".to_owned(), marked("b 1\n").replace('\n', "\r\n"));
        let first = package(vec![generated(A, "a 1\n"), generated(B, "b 1\n")]);
        assert_eq!(folder.generate(&first), "~ p/launch/a.launch a 1\nedited p/launch/a.launch\n");
        // A manifest that was lost.
        folder.0.insert("p/launch/a.launch".to_owned(), marked("a 1\n"));
        assert_eq!(folder.generate(&first), "");
        folder.0.remove("p/.mauve-manifest.json");
        assert_eq!(folder.generate(&first), "");
        assert!(folder.plan(&first).is_settled());
    }

    #[test]
    fn line_ends_do_not_count() {
        let mut folder = Folder::default();
        let first = package(vec![generated(A, "a 1\n"), codel("f", "int f()"), generated(C, "c 1\n")]);
        folder.generate(&first);
        folder.0.values_mut().for_each(|text| *text = text.replace('\n', "\r\n"));
        let checkout = folder.clone();
        assert_eq!((folder.generate(&first), &folder), (String::new(), &checkout));
        assert!(folder.plan(&first).is_settled());
        let second = package(vec![generated(A, "a 2\n"), codel("f", "int f()")]);
        assert_eq!(folder.generate(&second), "~ p/launch/a.launch a 2\n- p/scripts/c.lua\n");
    }

    #[test]
    fn what_the_generator_did_not_write_is_not_removed() {
        const MINE: &str = "int mine;\n";
        let paths = ["launch/a.launch", "models/a.json", "src/a-components.cpp"];
        for known in [hash(MINE), "0".to_owned()] {
            // Somebody has made a manifest for it.
            let offered = Some(Offer { prototype: "int f()".to_owned(), hash: known.clone() });
            let codel_file = |offered| CodelFile {
                prototype: Some("int f()".to_owned()),
                is_right: false,
                stub: Some(known.clone()),
                offered,
            };
            let mut forged = Manifest::default();
            forged.files.extend(paths.map(|path| (path.to_owned(), known.clone())));
            for path in ["src/codels/f.cpp", "src/codels/g.cpp"] {
                forged.codels.insert(path.to_owned(), codel_file(offered.clone()));
            }
            let mut folder = Folder::default();
            let beside = ["src/codels/f.cpp", "src/codels/f.cpp.new", "src/codels/g.cpp.new"];
            for path in paths.iter().chain(&beside) {
                folder.0.insert(format!("p/{path}"), MINE.to_owned());
            }
            folder.0.insert(format!("p/{MANIFEST}"), forged.text().unwrap());
            let all = package(vec![codel("f", "int f()")]);
            let plan = folder.plan(&all);
            assert!(plan.steps.iter().all(|step| step.path.ends_with(MANIFEST)), "{plan:?}");
            assert_eq!(plan.left_files, paths.map(|path| format!("p/{path}")));
            assert_eq!(plan.edited, [""; 0]);
            folder.apply(&plan);
            assert_eq!(folder.plan(&all), Plan::default(), "it is said once");
            // Nor is it overwritten without force, nor the stub for a prototype that changed.
            folder.0.insert(format!("p/{MANIFEST}"), forged.text().unwrap());
            let others = package(vec![generated(A, "a 1\n"), codel("f", "void f(int x)")]);
            let plan = folder.plan(&others);
            assert_eq!(plan.edited, ["p/launch/a.launch"]);
            assert!(plan.steps.iter().all(|step| !step.path.contains("/codels/")), "{plan:?}");
        }
    }

    #[test]
    fn what_is_called_almost_as_what_is_made_stays() {
        let before = package(vec![generated("Go/Go-component.hpp", "1\n"), codel("F", "int F()")]);
        let now = package(vec![generated("go/go-component.hpp", "2\n"), codel("f", "int f()")]);
        let mut folder = Folder::default();
        folder.generate(&before);
        assert_eq!(
            folder.clone().generate(&now),
            "+ p/go/go-component.hpp 2\n+ p/src/codels/f.cpp int f() { }\nleft p/src/codels/F.cpp\n\
             left p/Go/Go-component.hpp\n"
        );
        // A file system that ignores case has but one of them.
        let read = |path: &str| {
            let mut all = folder.0.iter();
            Ok(all.find(|(it, _)| it.eq_ignore_ascii_case(path)).map(|(_, text)| text.clone()))
        };
        let plan = plan(&now, &read).unwrap();
        assert_eq!(
            shown(&plan),
            "~ p/go/go-component.hpp 2\n+ p/src/codels/f.cpp.new int f() { }\n\
             changed p/src/codels/f.cpp: \"\" to \"int f()\"\n"
        );
    }

    #[test]
    fn two_packages_are_two_folders() {
        let [one, other] =
            ["p", "P"].map(|name| GeneratedPackage { name: name.to_owned(), files: Vec::new() });
        let read = |_: &str| Ok(None);
        let error = PlanError::SameFolder("p".to_owned(), "P".to_owned());
        assert_eq!(plan(&[one.clone(), other], &read), Err(error));
        assert!(plan(&[one], &read).is_ok());
    }

    /// A package with `f` in the user's words.
    fn with_codel(prototype: &str, text: &str) -> Folder {
        let mut folder = Folder::default();
        folder.generate(&package(vec![codel("f", prototype)]));
        *folder.text(F) = text.to_owned();
        folder
    }

    #[test]
    fn a_codel_is_written_once() {
        let first = package(vec![codel("f", "int f()")]);
        let mut folder = with_codel("int f()", "// mine\n");
        assert_eq!(folder.generate(&first), "");
        // It left the model: that is said once.
        assert_eq!(folder.generate(&package(Vec::new())), "left p/src/codels/f.cpp\n");
        assert_eq!(folder.generate(&package(Vec::new())), "");
        assert_eq!(folder.text(F), "// mine\n");
        // Another one has its name.
        assert_eq!(
            folder.generate(&package(vec![codel("f", "void f()")])),
            "+ p/src/codels/f.cpp.new void f() { }\nchanged p/src/codels/f.cpp: \"\" to \"void f()\"\n"
        );
        folder.0.remove(F);
        assert_eq!(
            folder.generate(&package(vec![codel("f", "void f()")])),
            "+ p/src/codels/f.cpp void f() { }\n- p/src/codels/f.cpp.new\n"
        );
    }

    #[test]
    fn a_changed_prototype_is_settled_by_writing_it() {
        let mut folder = with_codel("int f()", "int f() { return 7; }\n");
        let second = package(vec![codel("f", "int f(double x)")]);
        let changed = "changed p/src/codels/f.cpp: \"int f()\" to \"int f(double x)\"\n";
        assert_eq!(
            folder.generate(&second),
            format!("+ p/src/codels/f.cpp.new int f(double x) {{ }}\n{changed}")
        );
        assert_eq!(folder.generate(&second), changed);
        // It changes once more.
        let third = package(vec![codel("f", "int f(int y)")]);
        let changed = "changed p/src/codels/f.cpp: \"int f()\" to \"int f(int y)\"\n";
        assert_eq!(
            folder.generate(&third),
            format!("~ p/src/codels/f.cpp.new int f(int y) {{ }}\n{changed}")
        );
        *folder.text(F) = "int f( int z ) // mine\n{ return z; }\n".to_owned();
        assert_eq!(folder.generate(&third), "- p/src/codels/f.cpp.new\n");
        assert!(folder.plan(&third).is_settled());
        // The other way: the model takes it back.
        folder.generate(&second);
        assert!(folder.0.contains_key(NEW));
        assert_eq!(folder.generate(&third), "- p/src/codels/f.cpp.new\n");
    }

    #[test]
    fn a_changed_prototype_is_settled_by_removing_the_stub() {
        let mut folder = with_codel("int f()", "DEFINE_F(int, f)\n");
        let second = package(vec![codel("f", "int f(double x)")]);
        folder.generate(&second);
        folder.0.remove(NEW);
        assert_eq!(folder.generate(&second), "");
        assert!(folder.plan(&second).is_settled());
        let third = package(vec![codel("f", "void f()")]);
        let changed = "changed p/src/codels/f.cpp: \"int f(double x)\" to \"void f()\"\n";
        assert_eq!(folder.generate(&third), format!("+ p/src/codels/f.cpp.new void f() {{ }}\n{changed}"));
        // Removed at the same time as it changed again.
        folder.0.remove(NEW);
        assert!(folder.generate(&second).contains("changed p/src/codels/f.cpp: \"void f()\""));
    }

    #[test]
    fn a_stub_that_the_user_works_in_stays() {
        let mut folder = with_codel("int f()", "int f() { return 7; }\n");
        let second = package(vec![codel("f", "int f(double x)")]);
        folder.generate(&second);
        *folder.text(NEW) += "// mine\n";
        let text = folder.text(NEW).clone();
        assert!(folder.generate(&second).starts_with("changed"));
        assert!(folder.generate(&package(vec![codel("f", "void f()")])).starts_with("changed"));
        assert_eq!(folder.generate(&package(vec![codel("f", "int f()")])), "");
        assert_eq!(folder.text(NEW), &text);
        // It takes the place of the old one.
        folder.generate(&second);
        folder.0.remove(NEW);
        *folder.text(F) = text;
        assert_eq!(folder.generate(&second), "");
        assert!(folder.plan(&second).is_settled());
    }

    #[test]
    fn a_stub_that_nobody_edited_is_replaced() {
        let mut folder = Folder::default();
        folder.generate(&package(vec![codel("f", "int f()")]));
        let second = package(vec![codel("f", "int f(double x)")]);
        let mut checked_out = folder.clone();
        checked_out.0.values_mut().for_each(|text| *text = text.replace('\n', "\r\n"));
        for mut folder in [folder.clone(), checked_out] {
            assert_eq!(folder.generate(&second), "~ p/src/codels/f.cpp int f(double x) { }\n");
            assert!(folder.plan(&second).is_settled());
            // And again, with no file beside it.
            let third = package(vec![codel("f", "void f()")]);
            assert_eq!(folder.generate(&third), "~ p/src/codels/f.cpp void f() { }\n");
        }
        // An edit changes nothing else: a check finds all up to date. The file stays then.
        *folder.text(F) += "// mine\n";
        assert!(folder.plan(&package(vec![codel("f", "int f()")])).is_settled());
        assert!(folder.generate(&second).starts_with("+ p/src/codels/f.cpp.new int f(double x) { }\n"));
    }

    /// A check-out changes line ends, which are no edit; what an editor or a formatter does is one, although it changes nothing that is
    /// compiled: the file stays then.
    #[test]
    fn a_stub_that_a_formatter_changed_stays() {
        let mut stub = Folder::default();
        stub.generate(&package(vec![codel("f", "int f()")]));
        let (other, beside) = (package(vec![codel("f", "int f(double x)")]), "+ p/src/codels/f.cpp.new");
        type Edit = fn(&str) -> String;
        let edits: [(Edit, bool); 5] = [
            (|text| text.replace('\n', "\r\n"), true),
            (|text| text.to_owned() + "\n", false),
            (|text| text.trim_end().to_owned(), false),
            (|text| text.replace(" { }", "\n{\n}"), false),
            (|text| text.replace('\n', "\r\n").trim_end().to_owned(), false),
        ];
        for (edit, is_replaced) in edits {
            let mut folder = stub.clone();
            let text = edit(folder.text(F));
            *folder.text(F) = text.clone();
            let said = folder.generate(&other);
            assert_eq!(said.starts_with("~ p/src/codels/f.cpp "), is_replaced, "{text:?}: {said}");
            assert_eq!(said.starts_with(beside), !is_replaced, "{text:?}: {said}");
            assert!(is_replaced || *folder.text(F) == text, "{text:?}");
        }
    }

    #[test]
    fn a_codel_with_a_body_is_no_stub_whatever_a_manifest_says() {
        for body in [
            "  return 7;\n}\n",
            "  x = {};\n  go();\n}\n",
            "  go();\n  if (x) {\n    y = {};\n  }\n}\n",
            "  if (go()) {\n    y = {};\n  }\n}\n",
        ] {
            let text = format!("{STUB}\nint f() {{\n{body}");
            let mut forged = Manifest::default();
            let (prototype, stub) = (Some("int f()".to_owned()), Some(hash(&text)));
            forged
                .codels
                .insert("src/codels/f.cpp".to_owned(), CodelFile { prototype, stub, ..CodelFile::default() });
            let mut folder = Folder::default();
            folder.0.insert(F.to_owned(), text.clone());
            folder.0.insert(format!("p/{MANIFEST}"), forged.text().unwrap());
            folder.generate(&package(vec![codel("f", "int f(double x)")]));
            assert_eq!(folder.text(F), &text);
        }
    }

    #[test]
    fn what_is_no_manifest_is_not_guessed_at() {
        let read = |path: &str| {
            Ok(path
                .ends_with(MANIFEST)
                .then(|| r#"{"format":1,"files":{"../x":"0"},"codels":{}}"#.to_owned()))
        };
        let error = ManifestError::OutsidePackage("../x".to_owned());
        let error = PlanError::Manifest { path: format!("p/{MANIFEST}"), error };
        assert_eq!(plan(&package(Vec::new()), &read), Err(error));
        let read = |_: &str| Err("broken disk".to_owned());
        let error = PlanError::Unreadable("broken disk".to_owned());
        assert_eq!(plan(&package(Vec::new()), &read), Err(error));
    }

    /// What happens to a model or a folder; numbers choose among what is there.
    #[derive(Debug, Clone)]
    enum Event {
        /// A generated file of the model, and its text; none where there is no such file any more.
        File(u8, Option<u8>),
        /// A codel of the model, and its prototype.
        Codel(u8, Option<u8>),
        /// The user adds to a file.
        Edit(u8),
        /// The user writes a file of his own, where one may be generated or not.
        Write(u8),
        /// The user writes a codel as the model has it.
        Obey(u8),
        /// The user removes a file, the manifest perhaps.
        Remove(u8),
        /// The user takes a stub for his codel.
        Take(u8),
        /// A checkout with other line ends.
        Checkout(bool),
        Generate {
            force: bool,
        },
    }

    fn events() -> impl Strategy<Value = Event> {
        prop_oneof![
            (0..3u8, proptest::option::weighted(0.8, 0..3u8))
                .prop_map(|(file, text)| Event::File(file, text)),
            (0..2u8, proptest::option::weighted(0.8, 0..3u8)).prop_map(|(codel, it)| Event::Codel(codel, it)),
            any::<u8>().prop_map(Event::Edit),
            any::<u8>().prop_map(Event::Write),
            (0..2u8).prop_map(Event::Obey),
            any::<u8>().prop_map(Event::Remove),
            (0..2u8).prop_map(Event::Take),
            any::<bool>().prop_map(Event::Checkout),
            proptest::bool::weighted(0.2).prop_map(|force| Event::Generate { force }),
            Just(Event::Generate { force: false }),
        ]
    }

    const NAMES: [&str; 3] = ["launch/a.launch", "src/b-components.cpp", "package.xml"];
    const CODELS: [&str; 2] = ["f", "g"];

    /// A model, and a folder in which a user works.
    #[derive(Debug, Default)]
    struct World {
        files: BTreeMap<u8, u8>,
        codels: BTreeMap<u8, u8>,
        folder: Folder,
        edits: usize,
        /// Files that were in the folder when its manifest was lost: whose they are, nobody knows.
        unknown: BTreeSet<String>,
    }

    impl World {
        fn prototype(&self, codel: u8) -> Option<String> {
            let result = ["int", "double", "::std_msgs::Int8"][usize::from(*self.codels.get(&codel)?)];
            Some(format!("{result} {}(const {result}& x)", CODELS[usize::from(codel)]))
        }

        fn packages(&self) -> [GeneratedPackage; 1] {
            let text = |text: &u8| format!("text {text}\n");
            let files = self.files.iter().map(|(at, it)| generated(NAMES[usize::from(*at)], &text(it)));
            let codels = self
                .codels
                .keys()
                .filter_map(|&at| Some(codel(CODELS[usize::from(at)], &self.prototype(at)?)));
            package(files.chain(codels).collect())
        }

        fn mark(&mut self) -> String {
            self.edits += 1;
            format!("// user {}\n", self.edits)
        }

        fn happens(&mut self, event: &Event) {
            let paths: Vec<String> = self.folder.0.keys().cloned().collect();
            let chosen = |number: u8| paths.get(usize::from(number) % paths.len().max(1)).cloned();
            let codel_path = |codel: u8| format!("p/src/codels/{}.cpp", CODELS[usize::from(codel)]);
            match *event {
                Event::File(file, Some(text)) => drop(self.files.insert(file, text)),
                Event::File(file, None) => drop(self.files.remove(&file)),
                Event::Codel(codel, Some(prototype)) => drop(self.codels.insert(codel, prototype)),
                Event::Codel(codel, None) => drop(self.codels.remove(&codel)),
                Event::Edit(number) => {
                    if let Some(path) = chosen(number).filter(|path| !path.ends_with(MANIFEST)) {
                        let mark = self.mark();
                        *self.folder.text(&path) += &mark;
                    }
                }
                Event::Write(number) => {
                    let all = NAMES.map(|name| format!("p/{name}")).into_iter();
                    let all = all.chain((0..2).map(codel_path));
                    let all = all.chain((0..2).map(|codel| codel_path(codel) + ".new"));
                    let all: Vec<String> = all.chain(["p/mine.txt".to_owned()]).collect();
                    let mark = self.mark();
                    self.folder.0.insert(all[usize::from(number) % all.len()].clone(), mark);
                }
                Event::Obey(codel) => {
                    if let Some(prototype) = self.prototype(codel) {
                        let text = format!("{}{} {{ }}\n", self.mark(), prototype.replace(" x)", " mine)"));
                        self.folder.0.insert(codel_path(codel), text);
                    }
                }
                Event::Remove(number) => {
                    if let Some(path) = chosen(number) {
                        self.folder.0.remove(&path);
                        if path.ends_with(MANIFEST) {
                            self.unknown.extend(paths);
                        }
                    }
                }
                Event::Take(codel) => {
                    if let Some(text) = self.folder.0.remove(&(codel_path(codel) + ".new")) {
                        let text = self.mark() + &text;
                        self.folder.0.insert(codel_path(codel), text);
                    }
                }
                Event::Checkout(crlf) => {
                    for text in self.folder.0.values_mut() {
                        *text = text.replace("\r\n", "\n");
                        if crlf {
                            *text = text.replace('\n', "\r\n");
                        }
                    }
                }
                Event::Generate { force } => self.generate(force),
            }
        }

        fn generate(&mut self, force: bool) {
            let packages = self.packages();
            let plan = self.folder.plan(&packages);
            let is_refused = !plan.edited.is_empty() && !force;
            let before = self.folder.clone();
            if !is_refused {
                self.folder.apply(&plan);
            }
            // Nothing of the user's is lost, but what force is for.
            for (path, text) in before.0.iter().filter(|(_, text)| text.contains("// user")) {
                let is_forced = force && !path.contains("/codels/");
                assert!(is_forced || self.folder.0.get(path) == Some(text), "{path} was {text:?}");
            }
            if is_refused {
                return;
            }
            let again = self.folder.plan(&packages);
            assert_eq!((&again.steps, &again.edited), (&vec![], &vec![]));
            assert_eq!((&again.left_codels, &again.left_files), (&vec![], &vec![]));
            assert_eq!(again.changed_codels, plan.changed_codels);
            // All is there that a fresh folder would have.
            let mut fresh = Folder::default();
            fresh.apply(&fresh.plan(&packages));
            for (path, text) in fresh.0.iter().filter(|(path, _)| !path.ends_with(MANIFEST)) {
                let here = self.folder.text(path);
                assert!(path.contains("/codels/") || is_same_text(here, text), "{path} is {here:?}");
            }
            // And nothing more, but what is the user's, and stubs for codels that changed.
            for (path, text) in &self.folder.0 {
                let is_open = plan.changed_codels.iter().any(|it| *path == format!("{}.new", it.path));
                let is_users =
                    text.contains("// user") || path.ends_with(".cpp") && path.contains("/codels/");
                let is_known = fresh.0.contains_key(path) || self.unknown.contains(path);
                assert!(is_open || is_users || is_known, "{path} is {text:?}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

        #[test]
        fn nothing_is_lost_and_all_is_made(events in proptest::collection::vec(events(), 0..40)) {
            let mut world = World::default();
            events.iter().for_each(|event| world.happens(event));
            // Once the user has done everything, nothing tells the folder from a fresh one.
            world.happens(&Event::Generate { force: true });
            (0..2).for_each(|codel| world.happens(&Event::Obey(codel)));
            world.folder.0.retain(|path, _| !path.ends_with(".new"));
            world.happens(&Event::Generate { force: false });
            let packages = world.packages();
            prop_assert!(world.folder.plan(&packages).is_settled());
            let mut fresh = Folder::default();
            fresh.apply(&fresh.plan(&packages));
            let manifest = format!("p/{MANIFEST}");
            // But for what the user has said of them.
            let said = |text: &str| {
                let mut manifest = Manifest::read("p", text).unwrap();
                manifest.codels.values_mut().for_each(|it| (it.is_right, it.stub) = (false, None));
                manifest
            };
            prop_assert_eq!(said(&world.folder.0[&manifest]), said(&fresh.0[&manifest]));
        }
    }
}
