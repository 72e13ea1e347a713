//! The fixes that `mauve check --fix` applies without asking.

use std::collections::HashSet;

use mauve_hir::{File, ModelDb, Workspace, catalogue_of, is_model};
use mauve_syntax::{SyntaxKind, is_nearest};

use crate::{Diagnostic, Fix};

impl<'db> Diagnostic<'db> {
    /// Returns the fix that can be applied without asking: it is the only one, its code allows it, and a corrected name has no
    /// second candidate among the names of the workspace.
    pub fn mechanical_fix(&self, db: &'db dyn ModelDb, workspace: Workspace) -> Option<&Fix<'db>> {
        let [fix] = self.fixes.as_slice() else { return None };
        let is_in_model = is_model(self.at.file(db).path(db));
        let is_mechanical = is_in_model && self.code.mechanical && !self.is_guess(db, workspace, fix);
        is_mechanical.then_some(fix)
    }

    /// Returns whether the fix corrects a name that may as well be a misspelling of another one.
    fn is_guess(&self, db: &'db dyn ModelDb, workspace: Workspace, fix: &Fix<'db>) -> bool {
        let file = self.at.file(db);
        let [(at, near)] = fix.edits.as_slice() else { return false };
        if !self.message.contains(&format!("did you mean `{near}`?")) {
            return false;
        }
        let word = file.text(db).get(std::ops::Range::<usize>::from(at.range(db))).unwrap_or_default();
        // An include is corrected in its last segment; its quotes stay.
        if self.code.name == "unresolved-include" {
            let names = workspace.files(db).keys().filter_map(|path| path.file_name()?.to_str());
            return !is_nearest(last_segment(word, &['/']), last_segment(near, &['/']), names);
        }
        let separators = ['/', '.'];
        let (word, near) = (last_segment(word, &separators), last_segment(near, &separators));
        !is_nearest(word, near, identifiers(db, workspace))
    }
}

/// Returns the last segment of a path, which may have quotes.
fn last_segment<'a>(path: &'a str, separators: &[char]) -> &'a str {
    path.trim_matches('"').rsplit(separators).next().unwrap_or_default()
}

/// Returns the identifiers in the models of a workspace, and the names of message packages and messages.
fn identifiers(db: &dyn ModelDb, workspace: Workspace) -> impl Iterator<Item = &str> {
    let models = workspace.files(db).values().filter(|file| is_model(file.path(db)));
    let packages =
        workspace.packages(db).values().map(AsRef::as_ref).chain(catalogue_of(db, workspace).values());
    let messages = packages.flat_map(|package| package.messages.keys().chain([&package.name]));
    let words = models.flat_map(|&file| identifiers_of(db, file)).map(String::as_str);
    words.chain(messages.map(|name| name.as_str()))
}

#[salsa::tracked(returns(ref))]
fn identifiers_of(db: &dyn ModelDb, file: File) -> HashSet<String> {
    let text = file.text(db);
    let lexed = mauve_syntax::lex(text);
    let names = (0..lexed.len()).filter(|&index| lexed.kind(index) == SyntaxKind::IDENT);
    names.filter_map(|index| text.get(lexed.range(index))).map(str::to_owned).collect()
}
