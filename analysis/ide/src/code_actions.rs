//! Code actions: fixes of diagnostics, and refactorings.
//!
//! Each action is a file in `code_actions/` and a line in `code_actions/offers.rs`. A refactoring preserves the behaviour of the model; otherwise
//! it is not offered, or is offered as disabled with the reason.

mod connect;
mod create_codel;
mod create_project;
mod create_state;
mod create_variable;
mod declare_operation;
mod fixes;
mod offers;
mod program;
mod skeleton;
mod sorted_fields;
mod timing;
mod tune;
mod update;
mod uses;

use std::cell::{OnceCell, RefCell};
use std::rc::Rc;

use mauve_diagnostics::{Finding, file_findings, shortened};
use mauve_hir::{Decl, File, Location, ModelDb, Project, Semantics, Workspace, parse};
use mauve_syntax::ast::{self, AstNode};
use mauve_syntax::format::Replacement;
use mauve_syntax::{SyntaxNode, SyntaxToken, TextRange, TextSize, tokens_at};
use rustc_hash::FxHashMap;

pub use offers::code_actions;

use crate::Change;
use program::CorePrograms;

/// A code action.
#[derive(Debug, Clone, PartialEq)]
pub struct CodeAction<'db> {
    /// Its title.
    pub title: String,
    /// Its kind.
    pub kind: ActionKind,
    /// Whether an editor may apply it without asking.
    pub preferred: bool,
    /// The diagnostics that it fixes; empty for a refactoring.
    pub fixed: Vec<Finding<'db>>,
    /// Why it is disabled, if it is.
    pub disabled: Option<String>,
    /// Whether its change creates files.
    pub creates_files: bool,
    /// Its change; `None` if the change was not requested, or the action is disabled.
    pub change: Option<Change>,
}

/// The maximum length of a title, in characters.
pub(crate) const MOST_CHARACTERS: usize = 80;

impl CodeAction<'_> {
    fn new(kind: ActionKind, title: impl Into<String>) -> Self {
        let title = shortened(&title.into(), MOST_CHARACTERS);
        CodeAction {
            title,
            kind,
            preferred: false,
            fixed: Vec::new(),
            disabled: None,
            creates_files: false,
            change: None,
        }
    }
}

/// The kinds of action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ActionKind {
    /// Fixes a diagnostic.
    QuickFix,
    /// Rewrites code without changing its behaviour, or adds a missing declaration.
    Rewrite,
    /// Sorts the `use`s of a file.
    OrganizeUses,
    /// Applies all fixes of a file that an editor may apply unasked.
    FixAll,
}

/// A request for actions.
#[derive(Debug, Clone, Copy)]
pub struct ActionQuestion<'a> {
    /// The file.
    pub file: File,
    /// The selection, or the cursor.
    pub range: TextRange,
    /// Diagnostics to fix regardless of their location: their ranges and codes.
    pub diagnostics: &'a [(TextRange, String)],
    /// The requested kinds. The actions for a whole file, [`ActionKind::OrganizeUses`] and [`ActionKind::FixAll`], are
    /// expensive, so they are computed only on request.
    pub kinds: &'a [ActionKind],
    /// Which changes to compute.
    pub changes: Changes<'a>,
}

/// Which changes are computed; the other actions have a title only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changes<'a> {
    /// No changes.
    None,
    /// The changes of the actions with this title.
    Of(&'a str),
    /// All changes.
    All,
}

/// The programs of a core, by its range.
type ProgramsByRange<'db> = FxHashMap<(Project<'db>, TextRange), Option<Rc<CorePrograms<'db>>>>;

pub(crate) struct Actions<'a, 'db> {
    pub(crate) db: &'db dyn ModelDb,
    pub(crate) workspaces: &'a [Workspace],
    /// The project that answers for the file.
    pub(crate) project: Option<Project<'db>>,
    /// All projects with the file: a change of the text must be right in each of them.
    pub(crate) projects: Vec<Project<'db>>,
    pub(crate) question: ActionQuestion<'a>,
    findings: OnceCell<Rc<[Finding<'db>]>>,
    /// The programs of each core with an action.
    programs: RefCell<ProgramsByRange<'db>>,
    found: Vec<CodeAction<'db>>,
    /// The indices of the found actions, by their titles and the location of the first diagnostic that they fix.
    known: FxHashMap<(String, Option<Location<'db>>), Vec<usize>>,
}

impl<'db> Actions<'_, 'db> {
    pub(crate) fn wants(&self, kind: ActionKind) -> bool {
        self.question.kinds.contains(&kind)
    }

    pub(crate) fn findings(&self) -> Rc<[Finding<'db>]> {
        let all = || {
            let mut found: Vec<Finding<'db>> = Vec::new();
            let mut known: FxHashMap<Location<'db>, Vec<usize>> = FxHashMap::default();
            for &workspace in self.workspaces {
                // Each workspace reports it once.
                let others = found.len();
                for finding in &file_findings(self.db, workspace, self.question.file).shown {
                    let same = known.entry(finding.diagnostic.at.clone()).or_default();
                    let mut others = same.iter().filter(|index| **index < others);
                    if !others.any(|&index| found[index].diagnostic == finding.diagnostic) {
                        same.push(found.len());
                        found.push(finding.clone());
                    }
                }
            }
            found.into()
        };
        self.findings.get_or_init(all).clone()
    }

    /// Offers an action. Computes its change if it is requested; without a change, the action is dropped.
    pub(crate) fn offer<C: Into<Option<Change>>>(
        &mut self,
        kind: ActionKind,
        title: impl Into<String>,
        change: impl FnOnce() -> C,
    ) {
        self.push(CodeAction::new(kind, title), change);
    }

    pub(crate) fn refuse(&mut self, title: &str, reason: String) {
        if self.wants(ActionKind::Rewrite) {
            let disabled = Some(reason);
            self.found.push(CodeAction { disabled, ..CodeAction::new(ActionKind::Rewrite, title) });
        }
    }

    pub(crate) fn offer_fix<C: Into<Option<Change>>>(
        &mut self,
        finding: &Finding<'db>,
        title: impl Into<String>,
        change: impl FnOnce() -> C,
    ) {
        let fixed = vec![finding.clone()];
        self.push(CodeAction { fixed, ..CodeAction::new(ActionKind::QuickFix, title) }, change);
    }

    /// [`Actions::offer`] for an action of any kind. Drops duplicates.
    pub(crate) fn push<C: Into<Option<Change>>>(
        &mut self,
        mut action: CodeAction<'db>,
        change: impl FnOnce() -> C,
    ) {
        if !self.wants(action.kind) {
            return;
        }
        let first = action.fixed.first().map(|it| it.diagnostic.at.clone());
        let known = self.known.entry((action.title.clone(), first)).or_default();
        let is_same = |it: &CodeAction<'_>| it.kind == action.kind && it.fixed == action.fixed;
        if known.iter().any(|&index| is_same(&self.found[index])) {
            return;
        }
        let is_needed = match self.question.changes {
            Changes::None => false,
            Changes::Of(title) => action.title == title,
            Changes::All => true,
        };
        if is_needed {
            let Some(change) = change().into() else { return };
            action.change = Some(change.with_line_ends(self.db));
        }
        known.push(self.found.len());
        self.found.push(action);
    }

    /// Offers a refactoring if all projects with the file agree on the change. `change` returns `None` if the refactoring does
    /// not apply, and an error if it applies but is not possible.
    pub(crate) fn refactor(
        &mut self,
        title: &str,
        change: impl Fn(Project<'db>) -> Option<Result<Change, String>>,
    ) {
        if !self.wants(ActionKind::Rewrite) {
            return;
        }
        let all: Option<Vec<_>> = self.projects.iter().map(|&project| change(project)).collect();
        match all.unwrap_or_default().into_iter().collect::<Result<Vec<Change>, String>>() {
            Err(reason) => self.refuse(title, reason),
            Ok(mut changes) => {
                changes.dedup();
                if let [only] = changes.as_slice() {
                    self.offer(ActionKind::Rewrite, title, || only.clone());
                }
            }
        }
    }

    /// Returns the programs of a core of the file, unresolved names included.
    fn programs(&self, project: Project<'db>, core: &ast::Core) -> Option<Rc<CorePrograms<'db>>> {
        let key = (project, core.syntax().text_range());
        let of = || {
            let semantics = Semantics::at(self.db, project, self.question.file, key.1)?;
            Some(Rc::new(CorePrograms { db: self.db, project, semantics }))
        };
        self.programs.borrow_mut().entry(key).or_insert_with(of).clone()
    }

    pub(crate) fn root(&self) -> SyntaxNode {
        parse(self.db, self.question.file).syntax()
    }

    /// Returns the innermost node of a kind around `range`.
    pub(crate) fn around<N: AstNode>(&self, range: TextRange) -> Option<N> {
        self.root().covering_element(range).ancestors().find_map(N::cast)
    }

    /// Returns the innermost node of a kind around the selection or the cursor.
    pub(crate) fn node<N: AstNode>(&self) -> Option<N> {
        let range = self.selected();
        if !range.is_empty() {
            return self.around(range);
        }
        let tokens = tokens_at(&self.root(), range.start());
        let of = |token: SyntaxToken| token.parent_ancestors().find_map(N::cast);
        tokens.clone().right_biased().and_then(of).or_else(|| tokens.left_biased().and_then(of))
    }

    pub(crate) fn selected_name(&self) -> Option<SyntaxToken> {
        let range = self.selected();
        let tokens = tokens_at(&self.root(), range.start());
        let is_it = |token: &SyntaxToken| token.kind().is_word() && token.text_range().contains_range(range);
        tokens.clone().right_biased().filter(is_it).or_else(|| tokens.left_biased().filter(is_it))
    }

    pub(crate) fn selected(&self) -> TextRange {
        let text = self.question.file.text(self.db);
        let all = TextRange::up_to(TextSize::of(&**text));
        let Some(range) = self.question.range.intersect(all) else { return TextRange::empty(all.end()) };
        let Some(selected) = text.get(std::ops::Range::<usize>::from(range)) else { return range };
        let before = selected.len() - selected.trim_start().len();
        let length = selected.trim().len();
        if length == 0 {
            return TextRange::empty(range.start());
        }
        TextRange::at(range.start() + TextSize::new(before as u32), TextSize::new(length as u32))
    }
}

pub(crate) fn indentation(text: &str, offset: TextSize) -> &str {
    let before = text.get(..usize::from(offset)).unwrap_or_default();
    let line = text.get(before.rfind('\n').map_or(0, |at| at + 1)..).unwrap_or_default();
    let rest = line.trim_start_matches([' ', '\t']);
    line.get(..line.len() - rest.len()).unwrap_or_default()
}

/// Extends `range` for its removal: to complete lines if nothing else is on them, otherwise by the white space after it.
pub(crate) fn with_line(text: &str, range: TextRange) -> TextRange {
    let (start, end) = (usize::from(range.start()), usize::from(range.end()));
    let (before, after) = (text.get(..start).unwrap_or_default(), text.get(end..).unwrap_or_default());
    let blanks = before.len() - before.trim_end_matches([' ', '\t']).len();
    let more = after.len() - after.trim_start_matches([' ', '\t']).len();
    let rest = after.get(more..).unwrap_or_default();
    let end_of_line = ["\r\n", "\n"].into_iter().find(|end| rest.starts_with(end));
    let begins = blanks == start || before.get(..start - blanks).is_some_and(|it| it.ends_with('\n'));
    let (back, forth) = match end_of_line {
        Some(end) if begins => (blanks, more + end.len()),
        _ => (0, more),
    };
    TextRange::new(((start - back) as u32).into(), ((end + forth) as u32).into())
}

pub(crate) fn put(file: File, offset: TextSize, text: String) -> Change {
    let mut change = Change::default();
    change.replace(file, Replacement { range: TextRange::empty(offset), text });
    change
}

/// Returns a change that inserts `item` on a line of its own at the end of a declaration.
pub(crate) fn put_into(db: &dyn ModelDb, of: Decl<'_>, item: &str) -> Change {
    let indentation = if of.library(db).is_some() { "    " } else { "  " };
    put(of.file(db), Location::End(of).range(db).start(), format!("\n{indentation}{item}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_with};
    use expect_test::Expect;

    /// All kinds.
    const KINDS: &[ActionKind] =
        &[ActionKind::QuickFix, ActionKind::Rewrite, ActionKind::OrganizeUses, ActionKind::FixAll];

    /// The first action whose title begins so, at `$0` or from `$0` to `$0`: the lines that it makes, of each file.
    pub(super) fn check(fixture: &str, title: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let marks: Vec<usize> = fixture.match_indices("$0").map(|(at, _)| at).collect();
        let length = if let [start, end] = marks[..] { end - start - 2 } else { 0 };
        let question = ActionQuestion {
            file,
            range: TextRange::at(offset, TextSize::new(length as u32)),
            diagnostics: &[],
            kinds: KINDS,
            changes: Changes::All,
        };
        let actions = code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question);
        let action = actions.iter().find(|it| it.title.starts_with(title));
        let mut shown = String::new();
        match action.map(|it| (&it.change, &it.disabled)) {
            None => shown += "not offered\n",
            Some((_, Some(reason))) => shown += &format!("refused: {reason}\n"),
            Some((None, None)) => shown += "without a change\n",
            Some((Some(change), None)) => {
                for of in &change.files {
                    let (before, after) = (of.file.text(&db), change.applied(&db, of.file));
                    shown += &format!("--- {}\n{}", of.file.path(&db).display(), made(before, &after));
                }
            }
        }
        expected.assert_eq(&shown);
    }

    #[test]
    fn lines_end_as_those_of_the_file_do() {
        let text = "shell S { }\ncore $0C(S) {\n  update = { }\n}\n";
        for (text, expected) in [
            (text.to_owned(), "}\n\ncomponent C(S, C)\n"),
            (text.replace('\n', "\r\n"), "}\r\n\r\ncomponent C(S, C)\r\n"),
        ] {
            let Fixture { db, workspace, file, offset } = Fixture::new(&text);
            let question = ActionQuestion {
                file,
                range: TextRange::empty(offset),
                diagnostics: &[],
                kinds: &[ActionKind::Rewrite],
                changes: Changes::All,
            };
            let actions =
                code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question);
            let action = actions.iter().find(|it| it.title.starts_with("Create a component")).unwrap();
            let after = action.change.as_ref().unwrap().applied(&db, file);
            assert!(after.ends_with(expected), "{after:?}");
        }
    }

    /// The lines of `after` from the first that differs to the last.
    fn made(before: &str, after: &str) -> String {
        let same = |one: &mut dyn Iterator<Item = &str>, other: &mut dyn Iterator<Item = &str>| {
            one.zip(other).take_while(|(one, other)| one == other).count()
        };
        let first = same(&mut before.lines(), &mut after.lines());
        let last = same(&mut before.lines().rev(), &mut after.lines().rev());
        let count = after.lines().count();
        let last = last.min(count - first).min(before.lines().count() - first.min(before.lines().count()));
        after.lines().skip(first).take(count - first - last).map(|line| line.to_owned() + "\n").collect()
    }
}
