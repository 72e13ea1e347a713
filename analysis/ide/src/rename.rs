//! Another name for something: in all models, timing tables and configurations that name it.
//!
//! Whether a name can be taken is not told by rules alone: the texts are read once more as they would be, and every name in
//! them must stand for what it stood for. What cannot be known for sure, since a text is broken or a file is missing, is
//! refused with the place that it hangs on.

use mauve_model::diagnostics::{Diagnostic, Severity, declaration_diagnostics};
use mauve_model::item_tree::{Core, Data, Endpoint, Kind, NameRef, Part, Statement};
use mauve_model::{
    Database, Decl, File, ModelDb, Place, Project, Workspace, behaviour_of, config_file, config_of, data,
    declaration_at, declarations, features_of, flat_of, includes, is_model, names_of, parse, project_files,
    projects, shell_of, table, typing_of,
};
use mauve_syntax::format::Replacement;
use mauve_syntax::{SyntaxKind, SyntaxToken, TextRange, TextSize};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::change::Change;
use crate::definition::names;
use crate::document_symbols::SymbolKind;
use crate::occurrences::{Found, Meaning, escaped_in, names_in};
use crate::project::projects_with;
use crate::references::{files_of, occurrences, word_of};

/// A name that can be changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Renameable {
    /// Where it stands.
    pub range: TextRange,
    /// The name.
    pub name: String,
}

/// The name at `offset`, to be changed.
///
/// # Errors
///
/// Why it cannot be, for the user.
pub fn prepare_rename(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
) -> Result<Renameable, String> {
    let things = names(db, workspaces, file, offset);
    let (name, word) = the_one(db, &things)?;
    Ok(Renameable { range: name.range, name: word })
}

/// Gives what is named at `offset` another name, wherever it is named, in every project that has it.
///
/// ```
/// use mauve_model::{Database, Workspace};
/// let db = Database::default();
/// let text = "shell S { } core C(S) { }".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let change = mauve_ide::rename(&db, &[workspace], file, 6.into(), "Laser").unwrap();
/// assert_eq!(change.applied(&db, file), "shell Laser { } core C(Laser) { }");
/// assert!(mauve_ide::rename(&db, &[workspace], file, 6.into(), "a b").is_err());
/// ```
///
/// # Errors
///
/// Why it cannot be, for the user: the name is none, or is taken; another name would stand for something else; or it is
/// unknown what all must be changed.
pub fn rename(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
    new_name: &str,
) -> Result<Change, String> {
    let things = names(db, workspaces, file, offset);
    let (thing, old_name) = the_one(db, &things)?;
    check_name(thing.kind, new_name)?;
    if new_name == old_name {
        return Ok(Change::default());
    }
    let all = occurrences(db, workspaces, &things);
    let mut concerned: Vec<Project<'_>> = Vec::new();
    for (project, _) in things.iter().chain(&all) {
        if !concerned.contains(project) {
            concerned.push(*project);
        }
    }
    let renaming = Renaming { db, workspaces, thing, old_name: &old_name, new_name, concerned: &concerned };
    concerned.iter().try_for_each(|&project| renaming.check_free(project))?;
    renaming.check_known(&all)?;
    let mut change = Change::default();
    for (_, name) in &all {
        if let Some(problem) = name.file.problem(db) {
            return Err(format!("{} cannot be changed: {}", shown(db, name.file), problem.message()));
        }
        if text_of(db, name.file, name.range) != old_name {
            return Err(format!("{} does not name it by `{old_name}`", renaming.line(name.file, name.range)));
        }
        change.replace(name.file, Replacement { range: name.range, text: new_name.to_owned() });
    }
    for of_file in &mut change.files {
        let is_config = of_file.file.path(db).ends_with(mauve_model::CONFIG_FILE);
        let place = match is_model(of_file.file.path(db)) {
            true => "models",
            false if is_config => mauve_model::CONFIG_FILE,
            false => "timing tables",
        };
        of_file.note = Some(format!("Rename `{old_name}` to `{new_name}` in {place}"));
    }
    renaming.check_meanings(&change)?;
    Ok(change)
}

/// What is to be renamed, and its name: one thing, in whichever projects.
fn the_one<'a, 'db>(
    db: &'db dyn ModelDb,
    things: &'a [(Project<'db>, Found<'db>)],
) -> Result<(&'a Found<'db>, String), String> {
    let Some((_, first)) = things.first() else {
        return Err("there is no name here, or nobody knows what it stands for".to_owned());
    };
    let word = text_of(db, first.file, first.range).to_owned();
    if things.iter().any(|(_, other)| other.meaning != first.meaning) {
        return Err(format!("`{word}` stands for several things here: rename each where it is declared"));
    }
    let refused = match (&first.meaning, first.kind) {
        (Meaning::Declaration(_) | Meaning::Library(_), _) => None,
        (Meaning::Part(_), SymbolKind::Hook) => Some(format!("`{word}` is a word of the language")),
        (Meaning::Part(_), _) => None,
        (Meaning::Package(_), _) => Some(format!("`{word}` is a message package, or `ctypes`")),
        (Meaning::Message(package, _), _) => Some(format!("`{word}` is declared by package `{package}`")),
        (Meaning::Type(_), _) => Some(format!("type `{word}` is built in, or declared in `mauve.toml`")),
        (Meaning::File(_), _) => Some("rename the file: what includes it follows".to_owned()),
    };
    match refused {
        Some(why) => Err(why),
        None if word_of(db, &first.meaning).as_deref() != Some(&word) => {
            Err(format!("`{word}` is written in another way than where it is declared"))
        }
        None => Ok((first, word)),
    }
}

/// Words that are values wherever there may be one.
const VALUES: [&str; 8] =
    ["true", "false", "no_data", "old_data", "new_data", "failure", "success", "not_ready"];

/// What every program can call.
const FUNCTIONS: [&str; 5] = ["read", "write", "status", "send", "collect"];

fn check_name(kind: SymbolKind, name: &str) -> Result<(), String> {
    let mut letters = name.chars();
    let begins = letters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_');
    if !begins || !letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
        return Err(format!(
            "`{name}` is no name: a name is letters, digits and `_`, and does not begin with a digit"
        ));
    }
    let in_programs = !matches!(
        kind,
        SymbolKind::State
            | SymbolKind::Transition
            | SymbolKind::Instance
            | SymbolKind::Library
            | SymbolKind::Shell
            | SymbolKind::Core
            | SymbolKind::Component
            | SymbolKind::Architecture
            | SymbolKind::Deployment
    );
    if in_programs && VALUES.contains(&name) {
        return Err(format!("`{name}` is a value of the language"));
    }
    if matches!(kind, SymbolKind::Codel | SymbolKind::Operation) && FUNCTIONS.contains(&name) {
        return Err(format!("`{name}` is a function of the language"));
    }
    Ok(())
}

struct Renaming<'a, 'db> {
    db: &'db dyn ModelDb,
    workspaces: &'a [Workspace],
    thing: &'a Found<'db>,
    old_name: &'a str,
    new_name: &'a str,
    /// The projects that name it.
    concerned: &'a [Project<'db>],
}

impl<'db> Renaming<'_, 'db> {
    /// The declaration that nothing outside names it from.
    fn home(&self) -> Option<Decl<'db>> {
        let is_inner = matches!(
            self.thing.kind,
            SymbolKind::Variable
                | SymbolKind::Parameter
                | SymbolKind::Handler
                | SymbolKind::State
                | SymbolKind::Transition
        );
        match self.thing.meaning {
            Meaning::Part(Place::Part(decl, _)) if is_inner => Some(decl),
            _ => None,
        }
    }

    fn line(&self, file: File, range: TextRange) -> String {
        let before = file.text(self.db).get(..usize::from(range.start())).unwrap_or_default();
        format!("{}, line {}", shown(self.db, file), before.matches('\n').count() + 1)
    }

    /// Is the new name free where this one is declared?
    fn check_free(&self, project: Project<'db>) -> Result<(), String> {
        let (db, new) = (self.db, self.new_name);
        let names = names_of(db, project);
        let taken = |what: String, place: &Place<'db>| {
            Err(format!("there is {what} already ({})", self.line(place.file(db), place.range(db))))
        };
        match &self.thing.meaning {
            Meaning::Declaration(decl) => {
                let (kind, library) = (decl.kind(db), decl.library(db).as_ref());
                match names.in_library(library, kind, &new.into()).first() {
                    Some(other) => taken(format!("{kind} `{new}`"), &Place::name_of(*other)),
                    None => Ok(()),
                }
            }
            Meaning::Library(_) if names.has_library(&new.into()) => {
                Err(format!("there is library `{new}` already: the two would become one"))
            }
            Meaning::Part(Place::Part(decl, part)) => {
                if let Some(other) = sibling(db, *decl, *part, new) {
                    return taken(format!("`{new}`"), &Place::Part(*decl, other));
                }
                for &other in &names.all {
                    let found = match (decl.kind(db), other.kind(db)) {
                        (Kind::Shell, Kind::Shell) if self.thing.kind != SymbolKind::Parameter => {
                            let features = features_of(db, project, other);
                            let feature = features.get(new).filter(|_| features.shells.contains(decl));
                            feature.and_then(|it| Some(Place::Part(it.shell, it.data(db)?.name.part)))
                        }
                        (Kind::Architecture, Kind::Architecture) => {
                            let flat = flat_of(db, project, other);
                            let instance = flat.instance(new).filter(|_| flat.architectures.contains(decl));
                            instance.and_then(|it| {
                                let data = mauve_model::architecture(db, it.declared.0)?;
                                let name = &data.instances.get(it.declared.1)?.name;
                                Some(Place::Part(it.declared.0, name.part))
                            })
                        }
                        _ => None,
                    };
                    if let Some(place) = found {
                        let kind = other.kind(db);
                        return taken(format!("`{new}` in {kind} `{}`", other.name(db)), &place);
                    }
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Is it known what all must be changed?
    fn check_known(&self, all: &[(Project<'db>, Found<'db>)]) -> Result<(), String> {
        let (db, old) = (self.db, self.old_name);
        let home = self.home();
        let mut seen: FxHashSet<File> = FxHashSet::default();
        for &project in self.concerned {
            let workspace = project.workspace(db);
            let doubtful = project_files(db, project).iter().find(|&&file| {
                file.problem(db).is_some() || includes(db, workspace, file).iter().any(Option::is_none)
            });
            if let Some(&file) = doubtful.filter(|_| home.is_none()) {
                let why = match file.problem(db) {
                    Some(problem) => problem.message().to_owned(),
                    None => "it includes a file that is not found".to_owned(),
                };
                return Err(format!("`{old}` may be used where nobody can look: {}: {why}", shown(db, file)));
            }
            let is_lost = names_of(db, project).scope_lost.is_some() || names_of(db, project).missing;
            for file in files_of(db, project) {
                db.unwind_if_revision_cancelled();
                // What is written with escapes does not have the word in it.
                let escaped = escaped_in(db, project, file);
                if let Some((range, _)) = escaped.iter().find(|(_, it)| *it == self.thing.meaning) {
                    let line = self.line(file, *range);
                    return Err(format!("{line}: `{old}` is written with escapes, which nobody can replace"));
                }
                if file.text(db).contains(old) && seen.insert(file) {
                    self.check_words(file, all, is_lost)?;
                }
            }
        }
        Ok(())
    }

    /// Is each word in a file that may mean it known to do so, or to mean something else?
    fn check_words(
        &self,
        file: File,
        all: &[(Project<'db>, Found<'db>)],
        is_lost: bool,
    ) -> Result<(), String> {
        let (db, text) = (self.db, file.text(self.db));
        let is_model = is_model(file.path(db));
        if !is_model && !self.is_doubtful(file, is_lost) {
            return Ok(());
        }
        let around = match self.home() {
            Some(home) if is_model && home.file(db) != file => return Ok(()),
            Some(home) if is_model => {
                let name = Place::name_of(home).range(db);
                let maps = &mauve_model::source_map(db, file).declarations;
                maps.iter().find(|map| map.range.contains_range(name)).map(|map| map.range)
            }
            _ => None,
        };
        let mut known: FxHashSet<TextRange> =
            all.iter().filter(|(_, it)| it.file == file).map(|(_, it)| it.range).collect();
        let mut all_known = false;
        for (start, word) in text.match_indices(self.old_name) {
            let range = TextRange::at(TextSize::new(start as u32), TextSize::of(word));
            let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
            let is_cut = text[..start].ends_with(is_part) || text[start + word.len()..].starts_with(is_part);
            let is_here = around.is_none_or(|around| around.contains_range(range));
            if is_cut || !is_here || known.contains(&range) {
                continue;
            }
            let may_be = if is_model { self.may_be_meant(file, range) } else { in_key(text, start) };
            if may_be && !all_known {
                all_known = true;
                for project in projects_with(db, self.workspaces, file) {
                    known.extend(names_in(db, project, file).into_iter().map(|it| it.range));
                }
            }
            if may_be && !known.contains(&range) && !self.is_error(file, range) {
                let line = self.line(file, range);
                return Err(format!("{line}: it is unknown whether this `{word}` is meant too"));
            }
        }
        Ok(())
    }

    /// May a table or `mauve.toml` have names that were not read?
    fn is_doubtful(&self, file: File, is_lost: bool) -> bool {
        let db = self.db;
        let of = self.concerned.iter().map(|project| project.workspace(db));
        let mut of = of.filter(|&workspace| config_file(db, workspace) == Some(file));
        match of.next() {
            Some(workspace) => is_lost || config_of(db, workspace).lost,
            None => is_lost || table(db, file).lost,
        }
    }

    /// May a word of a model that nobody knows the meaning of be this name?
    fn may_be_meant(&self, file: File, range: TextRange) -> bool {
        let tokens = parse(self.db, file).syntax().token_at_offset(range.start());
        let Some(token) = tokens.into_iter().find(|token| token.text_range() == range) else { return false };
        let Some(parent) = token.parent() else { return false };
        if !token.kind().is_word() {
            return false;
        }
        if token.kind() != SyntaxKind::IDENT {
            return parent.ancestors().any(|node| node.kind() == SyntaxKind::ERROR);
        }
        let next = |token: &SyntaxToken| {
            std::iter::successors(token.next_token(), SyntaxToken::next_token)
                .find(|it| !it.kind().is_trivia())
        };
        let is_call = || next(&token).is_some_and(|next| next.kind() == SyntaxKind::L_PAREN);
        if FUNCTIONS.contains(&token.text()) && is_call() {
            return false;
        }
        // The types of values are none of ours.
        let ty = parent.parent().filter(|node| node.kind() == SyntaxKind::TYPE);
        let of_value = ty.and_then(|ty| ty.parent()).is_some_and(|of| {
            matches!(
                of.kind(),
                SyntaxKind::CODEL
                    | SyntaxKind::PARAM
                    | SyntaxKind::PROPERTY
                    | SyntaxKind::PORT
                    | SyntaxKind::OPERATION_DECLARATION
                    | SyntaxKind::VAR
                    | SyntaxKind::RESULT_TYPE
            )
        });
        !of_value || matches!(self.thing.meaning, Meaning::Library(_))
    }

    /// Does a word of a model stand for nothing, whoever reads it? All that it could stand for is known there, and what is
    /// renamed is none of it.
    fn is_error(&self, file: File, range: TextRange) -> bool {
        let db = self.db;
        if !is_model(file.path(db)) {
            return false;
        }
        let Some(of) = declaration_at(db, file, range) else { return false };
        let around = parse(db, file).syntax().covering_element(range);
        let is_broken = around.ancestors().any(|node| node.kind() == SyntaxKind::ERROR);
        let mut projects = projects_with(db, self.workspaces, file).into_iter();
        !is_broken && projects.all(|project| self.is_error_in(project, of, range))
    }

    fn is_error_in(&self, project: Project<'db>, of: Decl<'db>, range: TextRange) -> bool {
        let (db, thing) = (self.db, self.thing);
        let names = names_of(db, project);
        let resolved = |kind, ty| names.resolve_type(db, of, kind, ty).ok();
        let is_feature = match &thing.meaning {
            Meaning::Part(Place::Part(shell, _)) => {
                shell.kind(db) == Kind::Shell && thing.kind != SymbolKind::Parameter
            }
            _ => false,
        };
        let lacks = |shell: Decl<'db>| {
            let features = features_of(db, project, shell);
            !features.lost && features.get(self.old_name).is_none()
        };
        let mut ends: Vec<&Endpoint> = Vec::new();
        let mut instances: Vec<&NameRef> = Vec::new();
        let target = match data(db, of).as_deref() {
            Some(Data::Shell(_)) => return is_feature && lacks(of),
            Some(Data::Core(core)) => {
                return is_feature && resolved(Kind::Shell, core.shell.as_ref()).is_some_and(lacks);
            }
            Some(Data::Architecture(data)) => {
                let links = data.connections.iter().chain(&data.operations);
                ends.extend(links.flat_map(|link| [&link.source, &link.target]).flatten());
                ends.extend(data.settings.iter().filter_map(|it| it.endpoint.as_ref()));
                of
            }
            Some(Data::Deployment(data)) => {
                let [target] = data.targets.as_slice() else { return false };
                let Some(target) = resolved(Kind::Architecture, Some(target)) else { return false };
                ends.extend(data.settings.iter().filter_map(|it| it.endpoint.as_ref()));
                instances.extend(data.activities.iter().map(|activity| &activity.instance));
                target
            }
            _ => return false,
        };
        let flat = flat_of(db, project, target);
        let is_here = |name: &NameRef| Place::Part(of, name.part).range(db) == range;
        instances.extend(ends.iter().map(|end| &end.instance));
        if instances.into_iter().any(is_here) {
            let is_whole = flat.lost.is_empty() && flat.instance(self.old_name).is_none();
            return thing.kind != SymbolKind::Instance || is_whole;
        }
        let Some(end) = ends.into_iter().find(|end| end.feature.as_ref().is_some_and(is_here)) else {
            return false;
        };
        let instance = flat.instance(&end.instance.name).filter(|instance| !instance.repeated);
        let shell = instance.and_then(|it| shell_of(db, project, it.component?));
        !is_feature || shell.is_some_and(lacks)
    }

    /// Do all names stand for what they stood for, once it is renamed?
    fn check_meanings(&self, change: &Change) -> Result<(), String> {
        let db = self.db;
        let (scratch, pairs) = applied(db, self.workspaces, change);
        let home = self.home().map(|home| home.file(db));
        for (workspace, changed) in pairs {
            for (&before, &after) in projects(db, workspace).iter().zip(projects(&scratch, changed)) {
                let files = files_of(db, before).into_iter().zip(files_of(&scratch, after));
                for (file, changed) in files {
                    db.unwind_if_revision_cancelled();
                    let text = file.text(db);
                    let has_one = text.contains(self.old_name) || text.contains(self.new_name);
                    // Other models do not see what stands in a declaration.
                    if has_one && home.is_none_or(|home| home == file || !is_model(file.path(db))) {
                        self.check_file((before, file), (&scratch, after, changed), change)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn check_file<'new>(
        &self,
        (project, file): (Project<'db>, File),
        (scratch, new_project, new_file): (&'new Database, Project<'new>, File),
        change: &Change,
    ) -> Result<(), String> {
        let (db, shift) = (self.db, Shift::of(change));
        let mut before: Vec<(Seen, TextRange)> = Vec::new();
        for name in names_in(db, project, file) {
            let mut means = Means::of(db, &name.meaning, &|file, at| shift.moved(file, at));
            if name.meaning == self.thing.meaning
                && let Means::Library(library) = &mut means
            {
                *library = self.new_name.to_owned();
            }
            let seen = (shift.moved(file, name.range.start()), means, format!("{:?}", name.role));
            before.push((seen, name.range));
        }
        let after = names_in(scratch, new_project, new_file).into_iter().map(|name| {
            let means = Means::of(scratch, &name.meaning, &|_, at| at);
            ((name.range.start(), means, format!("{:?}", name.role)), name.range)
        });
        let after: Vec<(Seen, TextRange)> = after.collect();
        let of =
            |all: &[(Seen, TextRange)]| all.iter().map(|(seen, _)| seen.clone()).collect::<FxHashSet<_>>();
        let (old, new) = (of(&before), of(&after));
        let says = |db: &dyn ModelDb, file: File, range: TextRange| {
            let word = text_of(db, file, range).to_owned();
            format!("{}: `{word}` would stand for something else", self.line(file, range))
        };
        if let Some((_, range)) = before.iter().find(|(seen, _)| !new.contains(seen)) {
            return Err(says(db, file, *range));
        }
        if let Some((_, range)) = after.iter().find(|(seen, _)| !old.contains(seen)) {
            let line = scratch_line(scratch, new_file, *range);
            let word = text_of(scratch, new_file, *range);
            return Err(format!("{}, line {line}: `{word}` would come to mean something", shown(db, file)));
        }
        self.check_errors((project, file), (scratch, new_project, new_file), &shift)?;
        let errors = |db: &dyn ModelDb, file: File| match is_model(file.path(db)) {
            true => parse(db, file).errors().len(),
            false => table(db, file).errors.len(),
        };
        let is_config = config_file(db, project.workspace(db)) == Some(file);
        if !is_config && errors(db, file) != errors(scratch, new_file) {
            return Err(format!("{} would have other errors", shown(db, file)));
        }
        Ok(())
    }

    /// Is nothing wrong in the declarations of a file that is right now? Response times are what they are.
    fn check_errors<'new>(
        &self,
        (project, file): (Project<'db>, File),
        (scratch, new_project, new_file): (&'new Database, Project<'new>, File),
        shift: &Shift<'_>,
    ) -> Result<(), String> {
        let db = self.db;
        let old: FxHashSet<(&str, File, TextSize)> = errors(db, project, file)
            .map(|it| {
                let (file, start) = (it.at.file(db), it.at.range(db).start());
                (it.code.name, file, shift.moved(file, start))
            })
            .collect();
        for error in errors(scratch, new_project, new_file) {
            let (at, range) = (error.at.file(scratch), error.at.range(scratch));
            let place = (error.code.name, range.start());
            if at == new_file && !old.contains(&(place.0, file, place.1)) {
                let line = scratch_line(scratch, new_file, range);
                return Err(format!("{}, line {line}: {}", shown(db, file), error.message));
            }
        }
        Ok(())
    }
}

/// What is wrong in the declarations of a file. Deployments have no names of their own, and response times take long; how
/// values flow through the states of a core is no error.
fn errors<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
) -> impl Iterator<Item = &'db Diagnostic<'db>> {
    let found = declarations(db, file).all.iter().flat_map(move |&decl| match decl.kind(db) {
        Kind::Deployment => [&[][..], &[]],
        Kind::Core => {
            [&behaviour_of(db, project, decl).diagnostics[..], &typing_of(db, project, decl).diagnostics]
        }
        _ => [&declaration_diagnostics(db, project, decl)[..], &[]],
    });
    found.flatten().filter(|it| it.code.severity == Severity::Error)
}

/// A name, wherever it stands in the new text: what it stands for, and what it does.
type Seen = (TextSize, Means, String);

/// What a name stands for, in words that mean the same in two databases.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Means {
    Place(std::path::PathBuf, TextSize),
    Library(String),
    Other(String),
}

impl Means {
    fn of(db: &dyn ModelDb, meaning: &Meaning<'_>, moved: &dyn Fn(File, TextSize) -> TextSize) -> Means {
        let at = |place: &Place<'_>| {
            let file = place.file(db);
            Means::Place(file.path(db).clone(), moved(file, place.range(db).start()))
        };
        match meaning {
            Meaning::Declaration(decl) => at(&Place::name_of(*decl)),
            Meaning::Part(place) => at(place),
            Meaning::Library(name) => Means::Library(name.to_string()),
            Meaning::File(file) => Means::Place(file.path(db).clone(), 0.into()),
            other => Means::Other(format!("{other:?}")),
        }
    }
}

/// Where things move to by a change.
struct Shift<'a>(FxHashMap<File, &'a [Replacement]>);

impl Shift<'_> {
    fn of(change: &Change) -> Shift<'_> {
        Shift(change.files.iter().map(|it| (it.file, it.edits.as_slice())).collect())
    }

    fn moved(&self, file: File, at: TextSize) -> TextSize {
        let edits = self.0.get(&file).copied().unwrap_or_default();
        let mut moved = at;
        for edit in edits.iter().take_while(|edit| edit.range.end() <= at) {
            moved = moved + TextSize::of(&edit.text) - edit.range.len();
        }
        moved
    }
}

/// The workspaces that have a changed file, as they would be; each beside what it is now.
fn applied(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    change: &Change,
) -> (Database, Vec<(Workspace, Workspace)>) {
    let scratch = Database::default();
    let mut files: FxHashMap<File, File> = FxHashMap::default();
    let mut pairs = Vec::new();
    for &workspace in workspaces {
        let known = workspace.files(db);
        if !change.files.iter().any(|changed| known.values().any(|&file| file == changed.file)) {
            continue;
        }
        let mut copy = |file: File| {
            *files.entry(file).or_insert_with(|| {
                let is_changed = change.files.iter().any(|changed| changed.file == file);
                let text = if is_changed { change.applied(db, file).into() } else { file.text(db).clone() };
                File::new(&scratch, file.path(db).clone(), text, file.problem(db).clone())
            })
        };
        let copies = known.iter().map(|(path, &file)| (path.clone(), copy(file))).collect();
        let only = workspace.only(db).iter().map(|&file| copy(file)).collect();
        let changed = Workspace::new(
            &scratch,
            workspace.folder(db).clone(),
            std::sync::Arc::new(copies),
            workspace.model_path(db).clone(),
            only,
            workspace.unreadable(db).clone(),
            workspace.packages(db).clone(),
        );
        pairs.push((workspace, changed));
    }
    (scratch, pairs)
}

/// What has that name where `part` of a declaration is declared, beside it.
fn sibling(db: &dyn ModelDb, of: Decl<'_>, part: Part, name: &str) -> Option<Part> {
    let data = data(db, of).as_deref()?;
    let spaces = name_spaces(data).into_iter();
    let mut own = spaces.filter(|names| names.iter().any(|it| it.part == part));
    own.find_map(|names| names.into_iter().find(|it| it.name == name).map(|it| it.part))
}

/// The names of a declaration, by where they must differ.
fn name_spaces(data: &Data) -> Vec<Vec<&NameRef>> {
    match data {
        Data::Codel(codel) => vec![codel.parameters.iter().map(|it| &it.name).collect()],
        Data::Shell(shell) => {
            let own = shell.features.iter().map(|it| &it.name).collect();
            let of_operations =
                shell.features.iter().map(|it| it.parameters.iter().map(|it| &it.name).collect());
            std::iter::once(own).chain(of_operations).collect()
        }
        Data::Core(core) => of_core(core),
        Data::Architecture(data) => vec![data.instances.iter().map(|it| &it.name).collect()],
        Data::Use | Data::Component(_) | Data::Deployment(_) => Vec::new(),
    }
}

fn of_core(core: &Core) -> Vec<Vec<&NameRef>> {
    let mut spaces: Vec<Vec<&NameRef>> = Vec::new();
    let own = core.variables.iter().map(|it| &it.name).chain(core.handlers.iter().map(|it| &it.name));
    spaces.push(own.collect());
    spaces.push(core.operations.iter().map(|it| &it.name).collect());
    for operation in &core.operations {
        spaces.push(operation.parameters.iter().map(|it| &it.name).collect());
    }
    for machine in &core.machines {
        spaces.push(machine.variables.iter().map(|it| &it.name).collect());
        spaces.push(machine.states.iter().map(|it| &it.name).collect());
        for state in &machine.states {
            spaces.push(state.transitions.iter().map(|it| &it.name).collect());
        }
    }
    let mut open: Vec<&[Statement]> =
        core.programs().into_iter().map(|it| it.statements.as_slice()).collect();
    while let Some(block) = open.pop() {
        let mut own = Vec::new();
        for statement in block {
            match statement {
                Statement::Variable(variable) => own.push(&variable.name),
                Statement::If { then, otherwise, .. } => {
                    open.push(then);
                    open.extend(otherwise.as_deref());
                }
                Statement::Block(inner) => open.push(inner),
                Statement::Return(..) | Statement::Assign(..) | Statement::Expr(_) => {}
            }
        }
        spaces.push(own);
    }
    spaces
}

/// Does this stand in a key of TOML, or in a text, and not in a comment?
fn in_key(text: &str, start: usize) -> bool {
    const WORDS: [&str; 10] =
        ["codel", "program", "component", "overhead", "clocks", "chains", "project", "timing", "ms", "us"];
    let before = text.get(..start).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    let rest = text.get(start..).unwrap_or_default();
    let is_header = line.trim_start() == "[" && WORDS.iter().any(|word| rest.starts_with(word));
    !line.contains('#') && !is_header
}

fn text_of(db: &dyn ModelDb, file: File, range: TextRange) -> &str {
    file.text(db).get(std::ops::Range::<usize>::from(range)).unwrap_or_default()
}

fn scratch_line(db: &dyn ModelDb, file: File, range: TextRange) -> usize {
    let before = file.text(db).get(..usize::from(range.start())).unwrap_or_default();
    before.matches('\n').count() + 1
}

/// A file as the user knows it.
fn shown(db: &dyn ModelDb, file: File) -> String {
    file.path(db).file_name().unwrap_or_default().display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    /// The lines that change, as they are then; or why none does.
    fn check(fixture: &str, new_name: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let outcome = match rename(&db, &[workspace], file, offset, new_name) {
            Err(why) => why + "\n",
            Ok(change) => {
                let mut shown = String::new();
                for of_file in &change.files {
                    let path = of_file.file.path(&db).display();
                    let (old, new) = (of_file.file.text(&db), change.applied(&db, of_file.file));
                    for (_, line) in old.lines().zip(new.lines()).filter(|(old, new)| old != new) {
                        shown += &format!("{path}: {line}\n");
                    }
                }
                shown
            }
        };
        expected.assert_eq(&outcome);
    }

    const ROBOT: &str = r#"
//- /one.mal
include "parts.mal"
architecture A { instance laser: parts.Laser
  instance map: Mapper
  connection laser.scan -> map.scan
  operation map.clear -> laser.wipe
}
component Mapper(parts.Map, parts.Map)
deployment D { architecture A activity laser { priority = 1 period = 100 } }
//- /parts.mal
library parts {
  codel shoot(out n: int): int
  shell Base { property rate: int }
  shell Laser extends Base { output port scan: int require wipe(): int }
  shell Map { input port scan: int
    provide clear(): int }
  core Laser(Laser) {
    var n: int
    handler h: wipe
    update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(wipe); { var m: int; shoot(n); m = n; } }
  }
  component Laser(Laser, Laser)
  core Map(Map) {
    provide clear(): int = { return 1; }
    statemachine {
      initial state Idle { transition go if read(scan, n) == new_data to Busy {
        clear(); } }
      state Busy { transition go to Idle }
      var n: int } }
}
//- /two.mal
include "parts.mal"
architecture B { instance laser: parts.Laser
  property laser.rate = 5 }
//- /mauve.toml
project.roots = ["one.mal", "two.mal"]
timing.tables = ["t.toml"]
clocks.synchronised = ["map"]
chains.c = ["laser.scan", "map.scan"]
//- /t.toml
[codel.parts]
shoot = 1
[program]
"Mapper/Idle.go.guard" = 3
"Mapper/clear" = 4
[component]
parts.Laser = 9
"#;

    fn robot(from: &str, new_name: &str, expected: Expect) {
        let cursor = from.replace("$0", "");
        assert!(ROBOT.contains(&cursor), "{cursor}");
        check(&ROBOT.replacen(&cursor, from, 1), new_name, expected);
    }

    #[test]
    fn everywhere() {
        robot(
            "codel sh$0oot",
            "picture",
            expect![[r#"
            /parts.mal:   codel picture(out n: int): int
            /parts.mal:     update = { /* 🦀 é */ picture(n); write(scan, n + rate); h = send(wipe); { var m: int; picture(n); m = n; } }
            /t.toml: picture = 1
        "#]],
        );
        robot(
            "component La$0ser",
            "Lidar",
            expect![[r#"
            /one.mal: architecture A { instance laser: parts.Lidar
            /parts.mal:   component Lidar(Laser, Laser)
            /t.toml: parts.Lidar = 9
            /two.mal: architecture B { instance laser: parts.Lidar
        "#]],
        );
        robot(
            "core Laser(Las$0er)",
            "Lidar",
            expect![[r#"
            /parts.mal:   shell Lidar extends Base { output port scan: int require wipe(): int }
            /parts.mal:   core Laser(Lidar) {
            /parts.mal:   component Laser(Lidar, Laser)
        "#]],
        );
        robot(
            "property ra$0te",
            "pace",
            expect![[r#"
            /parts.mal:   shell Base { property pace: int }
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(scan, n + pace); h = send(wipe); { var m: int; shoot(n); m = n; } }
            /two.mal:   property laser.pace = 5 }
        "#]],
        );
        robot(
            "output port $0scan",
            "ranges",
            expect![[r#"
            /mauve.toml: chains.c = ["laser.ranges", "map.scan"]
            /one.mal:   connection laser.ranges -> map.scan
            /parts.mal:   shell Laser extends Base { output port ranges: int require wipe(): int }
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(ranges, n + rate); h = send(wipe); { var m: int; shoot(n); m = n; } }
        "#]],
        );
        robot(
            "\"Mapper/cle$0ar\"",
            "wipe_out",
            expect![[r#"
            /one.mal:   operation map.wipe_out -> laser.wipe
            /parts.mal:     provide wipe_out(): int }
            /parts.mal:     provide wipe_out(): int = { return 1; }
            /parts.mal:         wipe_out(); } }
            /t.toml: "Mapper/wipe_out" = 4
        "#]],
        );
        robot(
            "require wi$0pe",
            "blank",
            expect![[r#"
            /one.mal:   operation map.clear -> laser.blank
            /parts.mal:   shell Laser extends Base { output port scan: int require blank(): int }
            /parts.mal:     handler h: blank
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(scan, n + rate); h = send(blank); { var m: int; shoot(n); m = n; } }
        "#]],
        );
        robot(
            "initial state I$0dle",
            "Waiting",
            expect![[r#"
            /parts.mal:       initial state Waiting { transition go if read(scan, n) == new_data to Busy {
            /parts.mal:       state Busy { transition go to Waiting }
            /t.toml: "Mapper/Waiting.go.guard" = 3
        "#]],
        );
        robot(
            "transition g$0o if",
            "leave",
            expect![[r#"
            /parts.mal:       initial state Idle { transition leave if read(scan, n) == new_data to Busy {
            /t.toml: "Mapper/Idle.leave.guard" = 3
        "#]],
        );
        robot(
            "library par$0ts",
            "pieces",
            expect![[r#"
            /one.mal: architecture A { instance laser: pieces.Laser
            /one.mal: component Mapper(pieces.Map, pieces.Map)
            /parts.mal: library pieces {
            /t.toml: [codel.pieces]
            /t.toml: pieces.Laser = 9
            /two.mal: architecture B { instance laser: pieces.Laser
        "#]],
        );
        robot(
            "shoot($0n)",
            "k",
            expect![[r#"
            /parts.mal:     var k: int
            /parts.mal:     update = { /* 🦀 é */ shoot(k); write(scan, k + rate); h = send(wipe); { var m: int; shoot(k); m = k; } }
        "#]],
        );
        robot(
            "chains.c = [\"laser.scan\", \"m$0ap",
            "chart",
            expect![[r#"
            /mauve.toml: clocks.synchronised = ["chart"]
            /mauve.toml: chains.c = ["laser.scan", "chart.scan"]
            /one.mal:   instance chart: Mapper
            /one.mal:   connection laser.scan -> chart.scan
            /one.mal:   operation chart.clear -> laser.wipe
        "#]],
        );
    }

    #[test]
    fn what_is_taken() {
        robot(
            "property ra$0te",
            "scan",
            expect![[r#"
            there is `scan` in shell `Laser` already (parts.mal, line 4)
        "#]],
        );
        robot(
            "output port $0scan",
            "rate",
            expect![[r#"
            there is `rate` in shell `Laser` already (parts.mal, line 3)
        "#]],
        );
        robot(
            "component La$0ser",
            "Mapper",
            expect![[r#"
                t.toml, line 4: `Mapper` would come to mean something
            "#]],
        );
        robot(
            "core La$0ser",
            "Map",
            expect![[r#"
            there is core `Map` already (parts.mal, line 13)
        "#]],
        );
        robot(
            "initial state I$0dle",
            "Busy",
            expect![[r#"
            there is `Busy` already (parts.mal, line 18)
        "#]],
        );
        robot(
            "instance ma$0p",
            "laser",
            expect![[r#"
            there is `laser` already (one.mal, line 2)
        "#]],
        );
        robot(
            "handler $0h",
            "n",
            expect![[r#"
            there is `n` already (parts.mal, line 8)
        "#]],
        );
        robot(
            "library par$0ts",
            "parts2",
            expect![[r#"
            /one.mal: architecture A { instance laser: parts2.Laser
            /one.mal: component Mapper(parts2.Map, parts2.Map)
            /parts.mal: library parts2 {
            /t.toml: [codel.parts2]
            /t.toml: parts2.Laser = 9
            /two.mal: architecture B { instance laser: parts2.Laser
        "#]],
        );
        check(
            "library l { } library $0m { }",
            "l",
            expect![[r#"
            there is library `l` already: the two would become one
        "#]],
        );
        // Whatever stands for something else then.
        robot(
            "var $0n: int\n    handler",
            "rate",
            expect![[r#"
            parts.mal, line 10: `rate` would stand for something else
        "#]],
        );
        robot(
            "var $0n: int\n    handler",
            "m",
            expect![[r#"
            parts.mal, line 10: `n` would stand for something else
        "#]],
        );
        robot(
            "var $0n: int\n    handler",
            "shoot",
            expect![[r#"
            parts.mal, line 10: `shoot` would stand for something else
        "#]],
        );
        robot(
            "{ var $0m: int",
            "n",
            expect![[r#"
            parts.mal, line 10: `n` would stand for something else
        "#]],
        );
        robot(
            "codel sh$0oot",
            "clear",
            expect![[r#"
            /parts.mal:   codel clear(out n: int): int
            /parts.mal:     update = { /* 🦀 é */ clear(n); write(scan, n + rate); h = send(wipe); { var m: int; clear(n); m = n; } }
            /t.toml: clear = 1
        "#]],
        );
        check(
            "codel $0f(): int core C(S) { update = { g(); } }",
            "g",
            expect![[r#"
                model.mal, line 1: `g` would come to mean something
            "#]],
        );
        check(
            "shell B { property p: int } shell S extends B { property $0q: int } ",
            "p",
            expect![[r#"
            there is `p` in shell `S` already (model.mal, line 1)
        "#]],
        );
        check(
            "architecture A { instance a: P } architecture B { import A instance $0b: P } ",
            "a",
            expect![[r#"
                there is `a` in architecture `B` already (model.mal, line 1)
            "#]],
        );
    }

    #[test]
    fn what_is_no_name() {
        let why = |name: &str| {
            let Fixture { db, workspace, file, offset } = Fixture::new("codel $0f(): int");
            rename(&db, &[workspace], file, offset, name).unwrap_err()
        };
        for name in ["", "1a", "a b", "é", "a.b", "a-b", "/*"] {
            let expected = "is no name: a name is letters, digits and `_`, and does not begin with a digit";
            assert_eq!(why(name), format!("`{name}` {expected}"));
        }
        for name in ["true", "failure"] {
            assert_eq!(why(name), format!("`{name}` is a value of the language"));
        }
        robot(
            "codel sh$0oot",
            "read",
            expect![[r#"
            `read` is a function of the language
        "#]],
        );
        // Every word may be the name of a state.
        robot(
            "initial state I$0dle",
            "state",
            expect![[r#"
            /parts.mal:       initial state state { transition go if read(scan, n) == new_data to Busy {
            /parts.mal:       state Busy { transition go to state }
            /t.toml: "Mapper/state.go.guard" = 3
        "#]],
        );
        robot(
            "output port $0scan",
            "if",
            expect![[r#"
            /mauve.toml: chains.c = ["laser.if", "map.scan"]
            /one.mal:   connection laser.if -> map.scan
            /parts.mal:   shell Laser extends Base { output port if: int require wipe(): int }
            /parts.mal:     update = { /* 🦀 é */ shoot(n); write(if, n + rate); h = send(wipe); { var m: int; shoot(n); m = n; } }
        "#]],
        );
    }

    #[test]
    fn what_has_no_name_of_ours() {
        robot(
            "rate: i$0nt",
            "x",
            expect![[r#"
            type `int` is built in, or declared in `mauve.toml`
        "#]],
        );
        robot(
            "upd$0ate =",
            "x",
            expect![[r#"
            there is no name here, or nobody knows what it stands for
        "#]],
        );
        robot(
            "include \"pa$0rts",
            "x",
            expect![[r#"
            rename the file: what includes it follows
        "#]],
        );
        robot(
            "wri$0te(",
            "x",
            expect![[r#"
            there is no name here, or nobody knows what it stands for
        "#]],
        );
        check(
            "use std_msgs codel f(a: Str$0ing): int",
            "x",
            expect![[r#"
            `String` is declared by package `std_msgs`
        "#]],
        );
        check(
            "use std$0_msgs codel f(a: String): int",
            "x",
            expect![[r#"
            `std_msgs` is a message package, or `ctypes`
        "#]],
        );
    }

    #[test]
    fn what_nobody_can_know() {
        const MODEL: &str = "//- /a.mal\ncodel $0f(): int codel g(): int\n\
             //- /mauve.toml\nproject.root = 'a.mal'\ntiming.tables = ['t.toml']\n//- /t.toml\n";
        check(
            &format!("{MODEL}codel.\"\\u0066\" = 1\n"),
            "h",
            expect![[r#"
            t.toml, line 1: `f` is written with escapes, which nobody can replace
        "#]],
        );
        check(
            &format!("{MODEL}[codel]\nf = 1\n[program\n"),
            "h",
            expect![[r#"
            /a.mal: codel h(): int codel g(): int
            /t.toml: h = 1
        "#]],
        );
        check(
            &format!("{MODEL}[codel]\ng = 1 # f\n[program\n"),
            "h",
            expect![[r#"
            /a.mal: codel h(): int codel g(): int
        "#]],
        );
        check(
            &format!("include \"no.mal\"\n{}", "codel $0f(): int"),
            "h",
            expect![[r#"
            `f` may be used where nobody can look: model.mal: it includes a file that is not found
        "#]],
        );
        check(
            "include \"no.mal\" core C(S) { var $0f: int update = { f = 1; } }",
            "h",
            expect![[r#"
            /model.mal: include "no.mal" core C(S) { var h: int update = { h = 1; } }
        "#]],
        );
        check(
            "codel $0f(): int codel f(): int core C(S) { update = { f(); } }",
            "h",
            expect![[r#"
            model.mal, line 1: it is unknown whether this `f` is meant too
        "#]],
        );
        check(
            &format!("{MODEL}[codel\nf = 1\n"),
            "h",
            expect![[r#"
            t.toml, line 2: it is unknown whether this `f` is meant too
        "#]],
        );
        check(
            &format!("{MODEL}[codel]\nf = [\n"),
            "h",
            expect![[r#"
            /a.mal: codel h(): int codel g(): int
            /t.toml: h = [
        "#]],
        );
        // A key that is one for several things.
        check(
            "//- /a.mal\nlibrary a { codel $0f(): int } library b { codel f(): int }\n\
             //- /mauve.toml\ntiming.tables = ['t.toml']\n//- /t.toml\ncodel.f = 1\n",
            "h",
            expect![[r#"
                t.toml, line 1: `f` would stand for something else
            "#]],
        );
    }

    #[test]
    fn what_is_an_error_is_not_meant() {
        const MODEL: &str = "shell S { property $0force: int }\nshell T { property gain: int }\ncore C(T) { }\n\
             component M(T, C)\n";
        let expected = || {
            expect![[r#"
                /model.mal: shell S { property power: int }
            "#]]
        };
        let with = |text: &str| check(&format!("{MODEL}{text}"), "power", expected());
        with("architecture A { instance m: M  property m.force = 2 }");
        with("architecture A { instance m: M } deployment D { architecture A property m.force = 2 }");
        with("architecture A { instance m: M instance n: M connection m.force -> n.force }");
        with("architecture A { instance force: M property fore.gain = 2 }");
        with("architecture A { instance m: M property force.gain = 2 }");
        with("core D(T) { update = { var n: int; n = force; } }");
        with("shell U extends T { constant c: int = force }");
        let refused = |text: &str| {
            let Fixture { db, workspace, file, offset } = Fixture::new(&format!("{MODEL}{text}"));
            let why = rename(&db, &[workspace], file, offset, "power").unwrap_err();
            assert!(why.ends_with("it is unknown whether this `force` is meant too"), "{text}: {why}");
        };
        // Whoever mends one of these may make it mean the renamed one.
        refused("architecture A { instance m: Unknown property m.force = 2 }");
        refused("architecture A { property m.force = 2 }");
        refused("architecture A { instance m: M instance m: M property m.force = 2 }");
        refused(
            "component N(U, C) shell U extends V { } architecture A { instance m: N property m.force = 2 }",
        );
        refused("core D(Unknown) { update = { var n: int; n = force; } }");
        let instance =
            "architecture B { instance $0b: M } architecture A { instance a: M property b.gain = 2 }";
        let text = format!("{}{instance}", MODEL.replace("$0", ""));
        check(
            &text,
            "d",
            expect![[r#"
                /model.mal: architecture B { instance d: M } architecture A { instance a: M property b.gain = 2 }
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        let shell = "shell S { output port p: int }\n/* 🦀 é */ core C(S) { update = { write($0p, 1); } }\n";
        check(
            &format!("{shell}core D(S) {{ update = {{ if (x  }}"),
            "q",
            expect![[r#"
            /model.mal: shell S { output port q: int }
            /model.mal: /* 🦀 é */ core C(S) { update = { write(q, 1); } }
        "#]],
        );
        check(
            &format!("{shell}core D(S) {{ update = {{ write(p"),
            "q",
            expect![[r#"
            /model.mal: shell S { output port q: int }
            /model.mal: /* 🦀 é */ core C(S) { update = { write(q, 1); } }
            /model.mal: core D(S) { update = { write(q
        "#]],
        );
        check(
            &format!("{shell}core D(S) {{ wri p"),
            "q",
            expect![[r#"
            model.mal, line 3: it is unknown whether this `p` is meant too
        "#]],
        );
        check(
            &format!("{shell}core D(T) {{ update = {{ write(p, 2); }} }}"),
            "q",
            expect![[r#"
            model.mal, line 3: it is unknown whether this `p` is meant too
        "#]],
        );
        check(
            "$0",
            "q",
            expect![[r#"
            there is no name here, or nobody knows what it stands for
        "#]],
        );
    }

    #[test]
    fn a_name_to_be_changed() {
        let Fixture { db, workspace, file, offset } = Fixture::new("/* 🦀 */ codel sho$0ot(): int");
        let found = prepare_rename(&db, &[workspace], file, offset).unwrap();
        assert_eq!((found.name.as_str(), &file.text(&db)[found.range]), ("shoot", "shoot"));
        assert_eq!(rename(&db, &[workspace], file, offset, "shoot"), Ok(Change::default()));
        assert!(prepare_rename(&db, &[workspace], file, 2.into()).is_err());
    }
}
