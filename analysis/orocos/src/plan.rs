//! What has to be done to a folder so that it holds these packages, and nothing of the user's is lost.
//!
//! A generated file is written anew where its text is another, and removed where it is made no more, if it still has the
//! hash that the manifest of its package has for it (`manifest.rs`). Otherwise somebody edited it, or it is not ours: that
//! needs force. Line ends do not count, since checkouts change them.
//!
//! A codel's file is the user's, and is written only where there is none. When the prototype is another one, a stub of it
//! is put beside: `clearance.cpp.new`. That is settled when the user's file defines what the model says now
//! (`prototype.rs`), or when the user has removed the stub; then the stub goes, unless it was edited. No force changes that.

use std::collections::BTreeSet;

use crate::manifest::{CodelFile, MANIFEST, Manifest, Offer, hash};
use crate::package::{GeneratedFile, Owner, Package};
use crate::prototype::Prototype;

/// What has to be done, step by step.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Plan {
    /// In the order of the paths within each package. None: everything is as it should be.
    pub steps: Vec<Step>,
    /// Generated files that somebody edited since: their paths. Unless it is forced, nothing is to be done while there are any.
    pub edited: Vec<String>,
    /// Codels whose prototype changed, and whose file was not yet written anew by the user.
    pub changed_codels: Vec<ChangedCodel>,
    /// Files of codels that are in the model no more: their paths. They are the user's, and stay.
    pub left_codels: Vec<String>,
}

impl Plan {
    /// Is everything as it should be?
    pub fn is_settled(&self) -> bool {
        self.steps.is_empty() && self.edited.is_empty() && self.changed_codels.is_empty()
    }
}

/// A file that is made, changed or removed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// From the folder of the packages, with `/` between its parts.
    pub path: String,
    /// What is done.
    pub action: Action,
}

/// What is done to a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// It is not there, and gets this text.
    Create(String),
    /// It gets this text instead of its own.
    Change(String),
    /// It goes.
    Remove,
}

/// A codel whose prototype is another than that which the user's file was written for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedCodel {
    /// The user's file, from the folder of the packages.
    pub path: String,
    /// What it was written for; empty where nobody knows any more.
    pub before: String,
    /// What the model says now.
    pub now: String,
}

/// What has to be done so that a folder holds `packages`. `read` gives the text of a file of it, by its path there; nothing
/// where there is none.
///
/// # Errors
///
/// What `read` says of a file that cannot be read, or why a manifest cannot be understood.
pub fn plan(
    packages: &[Package],
    read: &dyn Fn(&str) -> Result<Option<String>, String>,
) -> Result<Plan, String> {
    let mut plan = Plan::default();
    for package in packages {
        let manifest = format!("{}/{MANIFEST}", package.name);
        let text = read(&manifest)?;
        let before = text.as_deref().map_or_else(|| Ok(Manifest::default()), Manifest::read).map_err(|why| {
            format!(
                "`{manifest}` cannot be understood: {why}; remove it and generate again: generated files that are not as \
                 they would be made now then need --force, and your codels stay"
            )
        })?;
        let mut planner =
            Planner { package, read, before, now: Manifest::default(), steps: Vec::new(), plan: &mut plan };
        planner.package()?;
        let Planner { now, mut steps, .. } = planner;
        let now = now.text()?;
        match text {
            None => steps.push((MANIFEST.to_owned(), Action::Create(now))),
            Some(text) if is_same_text(&text, &now) => {}
            Some(_) => steps.push((MANIFEST.to_owned(), Action::Change(now))),
        }
        steps.sort_by(|(a, _), (b, _)| a.cmp(b));
        let of_folder =
            |(path, action): (String, Action)| Step { path: format!("{}/{path}", package.name), action };
        plan.steps.extend(steps.into_iter().map(of_folder));
    }
    Ok(plan)
}

/// Are two texts the same but for their line ends?
fn is_same_text(a: &str, b: &str) -> bool {
    a == b || hash(a) == hash(b)
}

/// Plans for one package; paths are from its folder.
struct Planner<'a> {
    package: &'a Package,
    read: &'a dyn Fn(&str) -> Result<Option<String>, String>,
    before: Manifest,
    now: Manifest,
    steps: Vec<(String, Action)>,
    plan: &'a mut Plan,
}

impl Planner<'_> {
    fn package(&mut self) -> Result<(), String> {
        for file in &self.package.files {
            match &file.owner {
                Owner::Generator => self.generated(file)?,
                Owner::User { prototype } => self.codel(file, prototype)?,
            }
        }
        let paths: BTreeSet<&str> = self.package.files.iter().map(|file| file.path.as_str()).collect();
        let before = std::mem::take(&mut self.before);
        for (path, written) in before.files.iter().filter(|(path, _)| !paths.contains(path.as_str())) {
            self.stale(path, written)?;
        }
        for (path, known) in before.codels.iter().filter(|(path, _)| !paths.contains(path.as_str())) {
            if self.text(path)?.is_some() {
                self.plan.left_codels.push(self.path(path));
            }
            self.withdraw(path, known.offered.as_ref())?;
        }
        Ok(())
    }

    fn path(&self, path: &str) -> String {
        format!("{}/{path}", self.package.name)
    }

    fn text(&self, path: &str) -> Result<Option<String>, String> {
        (self.read)(&self.path(path))
    }

    fn step(&mut self, path: &str, action: Action) {
        self.steps.push((path.to_owned(), action));
    }

    /// A file that is the generator's.
    fn generated(&mut self, file: &GeneratedFile) -> Result<(), String> {
        let path = file.path.as_str();
        match self.text(path)? {
            None => self.step(path, Action::Create(file.text.clone())),
            Some(text) if is_same_text(&text, &file.text) => {}
            Some(text) => {
                if self.before.files.get(path) != Some(&hash(&text)) {
                    self.plan.edited.push(self.path(path));
                }
                self.step(path, Action::Change(file.text.clone()));
            }
        }
        self.now.files.insert(path.to_owned(), hash(&file.text));
        Ok(())
    }

    /// A file that the generator wrote, and makes no more.
    fn stale(&mut self, path: &str, written: &str) -> Result<(), String> {
        if let Some(text) = self.text(path)? {
            if hash(&text) != written {
                self.plan.edited.push(self.path(path));
            }
            self.step(path, Action::Remove);
        }
        Ok(())
    }

    /// A file that is the user's.
    fn codel(&mut self, stub: &GeneratedFile, prototype: &str) -> Result<(), String> {
        let path = stub.path.as_str();
        let known = self.before.codels.remove(path).unwrap_or_default();
        let now = match self.text(path)? {
            Some(text) => self.written(stub, prototype, &text, known)?,
            None => {
                self.step(path, Action::Create(stub.text.clone()));
                self.withdraw(path, known.offered.as_ref())?;
                CodelFile { prototype: Some(prototype.to_owned()), offered: None }
            }
        };
        self.now.codels.insert(path.to_owned(), now);
        Ok(())
    }

    /// A file that the user has written: what is known of it now.
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
        // Whoever removes the stub has seen it.
        if let Some(offer) = known.offered.take_if(|_| there.is_none()) {
            known.prototype = Some(offer.prototype);
        }
        let is_for = |known: &CodelFile| {
            known.prototype.as_ref().is_some_and(|before| Prototype::is_same(before, prototype))
        };
        if is_for(&known) || Prototype::read(prototype).is_some_and(|it| it.is_defined_in(text)) {
            self.withdraw(path, known.offered.as_ref())?;
            return Ok(CodelFile { prototype: Some(prototype.to_owned()), offered: None });
        }
        self.plan.changed_codels.push(ChangedCodel {
            path: self.path(path),
            before: known.prototype.clone().unwrap_or_default(),
            now: prototype.to_owned(),
        });
        let offer = Offer { prototype: prototype.to_owned(), hash: hash(&stub.text) };
        let is_ours = |text: &str| known.offered.as_ref().is_some_and(|it| it.hash == hash(text));
        match there {
            None => self.step(&beside, Action::Create(stub.text.clone())),
            Some(text) if is_same_text(&text, &stub.text) => {}
            Some(text) if is_ours(&text) => self.step(&beside, Action::Change(stub.text.clone())),
            // The user is at work in it.
            Some(_) => return Ok(known),
        }
        Ok(CodelFile { offered: Some(offer), ..known })
    }

    /// Removes the stub beside a file of the user's, unless the user has edited it.
    fn withdraw(&mut self, path: &str, offered: Option<&Offer>) -> Result<(), String> {
        let beside = offered_path(path);
        if let Some(offer) = offered
            && self.text(&beside)?.is_some_and(|text| hash(&text) == offer.hash)
        {
            self.step(&beside, Action::Remove);
        }
        Ok(())
    }
}

/// Where the stub for a changed prototype is put.
fn offered_path(path: &str) -> String {
    format!("{path}.new")
}
