//! The figures of earlier texts. While the user types, the text is incomplete, and most figures are unknown: in their place,
//! an editor shows the last known ones, marked as older. They are shown in hints only: nothing else reads them.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, File, ModelDb, Project, declarations, parse, source_map};
use mauve_syntax::{NodeOrToken, SyntaxKind, TextRange, TextSize};
use mauve_timing::Level;
use mauve_wcrt::level_shown;

use super::declaration::{hash_of_declaration, of_declaration};
use super::figures::{LastFigures, PATIENCE, is_newer, older};
use super::label::{Texts, most_at};
use super::{
    HintFigure, HintOf, HintOptions, HintSubject, InlayHint, column, end_of_line, hash_of, programs,
};
use mauve_diagnostics::figure::{HintStatus, MOST_CHARACTERS};

/// The last known figures of the declarations in open files.
#[derive(Debug, Clone, Default)]
pub struct EarlierFigures {
    of: HashMap<FigureOwner, Arc<LastFigures>>,
}

/// A declaration in a project, at a significance level. It has the same name in every text.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct FigureOwner {
    root: File,
    file: File,
    kind: Kind,
    name: String,
    level: Level,
}

impl FigureOwner {
    pub(super) fn of(db: &dyn ModelDb, project: Project<'_>, decl: Decl<'_>) -> FigureOwner {
        FigureOwner {
            root: project.root(db),
            file: decl.file(db),
            kind: decl.kind(db),
            name: decl.qualified(db),
            level: level_shown(db, project),
        }
    }
}

impl EarlierFigures {
    pub(super) fn of(&self, owner: &FigureOwner) -> Option<&LastFigures> {
        self.of.get(owner).map(Arc::as_ref)
    }

    /// Returns a value that changes when the older figures of a declaration, or their reasons, are shown or hidden.
    pub(super) fn hash_of(&self, owner: &FigureOwner) -> u64 {
        let figures = self.of(owner).filter(|figures| figures.older.is_some());
        hash_of(figures.map(|figures| (figures.hash, figures.are_reasons_shown())))
    }

    /// Returns the time after which hints say why figures are unknown; none if they do already, or all figures are known.
    pub fn reasons_due(&self) -> Option<Duration> {
        let waiting = self.of.values().filter(|figures| !figures.are_reasons_shown());
        waiting.filter_map(|figures| Some(PATIENCE.saturating_sub(figures.older?.0.elapsed()))).min()
    }

    /// Returns these figures with the known ones of `files`, each with its project, if it has one, and of `deployments` in other files. If the texts `are_saved`, the hints say at once why a figure is
    /// unknown.
    #[must_use]
    pub fn updated(
        &self,
        db: &dyn ModelDb,
        files: &[(File, Option<Project<'_>>)],
        deployments: &[(Project<'_>, Decl<'_>)],
        options: HintOptions,
        are_saved: bool,
    ) -> EarlierFigures {
        let mut updated = EarlierFigures::default();
        let with_projects = files.iter().filter_map(|&(file, project)| Some((file, project?)));
        let declared = with_projects
            .flat_map(|(file, project)| declarations(db, file).all.iter().map(move |&decl| (project, decl)));
        for (project, decl) in declared.chain(deployments.iter().copied()) {
            let owner = FigureOwner::of(db, project, decl);
            let before = self.of.get(&owner);
            let hash = hash_of_declaration(db, project, decl, options);
            let figures = match before {
                Some(before) if before.hash == hash && before.older.is_none() => Arc::clone(before),
                _ => Arc::new(figures_of(db, project, decl, options, before, hash, are_saved)),
            };
            if !figures.of.is_empty() {
                updated.of.insert(owner, figures);
            }
        }
        // A declaration may be missing because of a syntax error.
        let is_broken =
            |file: File| files.iter().any(|(it, _)| *it == file) && !parse(db, file).errors().is_empty();
        for (owner, figures) in self.of.iter().filter(|(owner, _)| is_broken(owner.file)) {
            updated.of.entry(owner.clone()).or_insert_with(|| match figures.older {
                Some(_) => Arc::clone(figures),
                None => Arc::new(LastFigures {
                    older: Some((Instant::now(), are_saved)),
                    ..LastFigures::clone(figures)
                }),
            });
        }
        updated
    }

    /// Returns the figures that the hints in `range` show and these ones lack: an editor may show them before all texts are compared.
    #[must_use]
    pub fn shown(
        &self,
        db: &dyn ModelDb,
        (file, project): (File, Project<'_>),
        range: TextRange,
        options: HintOptions,
        are_saved: bool,
    ) -> EarlierFigures {
        let declared = declarations(db, file).all.iter().zip(&source_map(db, file).declarations);
        let mut shown = EarlierFigures::default();
        for (&decl, _) in declared.filter(|(_, map)| map.range.intersect(range).is_some()) {
            let owner = FigureOwner::of(db, project, decl);
            let before = self.of.get(&owner);
            let hash = hash_of_declaration(db, project, decl, options);
            if before.is_none_or(|before| before.hash != hash) {
                let figures = figures_of(db, project, decl, options, before, hash, are_saved);
                shown.of.extend((!figures.of.is_empty()).then(|| (owner, Arc::new(figures))));
            }
        }
        shown
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Takes in what [`EarlierFigures::shown`] has returned for the texts that these figures are of, or for the next ones.
    pub fn add(&mut self, shown: EarlierFigures) {
        for (owner, figures) in shown.of {
            if self.of.get(&owner).is_none_or(|known| known.hash != figures.hash) {
                self.of.insert(owner, figures);
            }
        }
    }

    /// Returns the figures of the deployments that the complete text of a file had, with their qualified names.
    fn of_deployments<'a>(
        &'a self,
        db: &'a dyn ModelDb,
        project: Project<'a>,
        file: File,
    ) -> impl Iterator<Item = (&'a str, &'a LastFigures)> + 'a {
        let (root, level) = (project.root(db), level_shown(db, project));
        let is_it = move |owner: &FigureOwner| {
            (owner.root, owner.file, owner.kind, owner.level) == (root, file, Kind::Deployment, level)
        };
        self.of.iter().filter(move |(owner, _)| is_it(owner)).map(|(owner, it)| (owner.name.as_str(), &**it))
    }

    /// Returns a value that changes when the older figures of deployments that the text lacks, or their reasons, are shown or
    /// hidden.
    pub(super) fn hash_of_lacking(&self, db: &dyn ModelDb, project: Project<'_>, file: File) -> u64 {
        let declared: HashSet<String> =
            declarations(db, file).all.iter().map(|it| it.qualified(db)).collect();
        let lacking = self.of_deployments(db, project, file).filter(|(name, _)| !declared.contains(*name));
        let mut shown: Vec<(&str, bool)> =
            lacking.map(|(name, figures)| (name, figures.are_reasons_shown())).collect();
        shown.sort_unstable();
        hash_of(shown)
    }
}

/// Returns the last known figures of a declaration.
fn figures_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
    options: HintOptions,
    before: Option<&Arc<LastFigures>>,
    hash: u64,
    are_saved: bool,
) -> LastFigures {
    let mut figures = LastFigures { hash, ..LastFigures::default() };
    let known = before.map(|before| &before.of);
    let mut is_older = false;
    let mut note = |subject: &HintSubject, figure: Option<&HintFigure>| {
        let earlier = known.and_then(|known| known.get(subject));
        let last = if is_newer(figure, earlier) { figure } else { earlier };
        is_older |= last != figure;
        figures.of.extend(last.map(|last| (subject.clone(), last.clone())));
    };
    match decl.kind(db) {
        Kind::Core if options.program_times => match programs::figures(db, project, decl) {
            Some(labels) => labels.for_each(|(subject, figure)| note(&subject, Some(&figure))),
            None => known.into_iter().flatten().for_each(|(subject, _)| note(subject, None)),
        },
        Kind::Architecture | Kind::Deployment => {
            for found in of_declaration(db, project, decl, options) {
                found.subject.iter().for_each(|subject| note(subject, found.figure.as_ref()));
            }
        }
        _ => {}
    }
    if is_older {
        // The subject of a figure may be missing because of the same error.
        for (subject, figure) in known.into_iter().flatten() {
            figures.of.entry(subject.clone()).or_insert_with(|| figure.clone());
        }
        let since = before.and_then(|before| before.older).map_or_else(Instant::now, |(since, _)| since);
        figures.older = Some((since, are_saved));
    }
    figures
}

/// Returns the older figures of activities in `range` that a syntax error has taken out of their deployment: behind a brace too
/// many, say. `found` are the hints of the declarations.
///
/// Only the names decide: the parser may read the rest of such a text in any way.
pub(super) fn of_lost_activities(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    range: TextRange,
    earlier: &EarlierFigures,
    found: &[HintOf],
) -> Vec<HintOf> {
    let deployments: Vec<(&str, &LastFigures)> = earlier.of_deployments(db, project, file).collect();
    let parse = parse(db, file);
    if deployments.is_empty() || parse.errors().is_empty() {
        return Vec::new();
    }
    let (places, subjects): (HashSet<TextSize>, Vec<Option<HintSubject>>) =
        found.iter().map(|found| (found.hint.offset, found.subject.clone())).unzip();
    let mut subjects: HashSet<HintSubject> = subjects.into_iter().flatten().collect();
    let text = file.text(db);
    let mut lost = Vec::new();
    let (mut deployment, mut before) = (String::new(), SyntaxKind::EOF);
    let tokens = parse.syntax().descendants_with_tokens().filter_map(NodeOrToken::into_token);
    for token in tokens.filter(|token| !token.kind().is_trivia()) {
        let keyword = std::mem::replace(&mut before, token.kind());
        let name = token.text();
        match keyword {
            SyntaxKind::DEPLOYMENT_KW => deployment = name.to_owned(),
            SyntaxKind::ACTIVITY_KW if range.contains_inclusive(token.text_range().start()) => {
                let subject = HintSubject::Activity(Name::from(name));
                let having = deployments.iter().filter_map(|(of, it)| Some((*of, *it, it.get(&subject)?)));
                let having: Vec<(&str, &LastFigures, &HintFigure)> = having.collect();
                let is_named = |of: &str| of.rsplit('.').next() == Some(deployment.as_str());
                let offset = end_of_line(text, token.text_range().end());
                let of = match having.as_slice() {
                    // Its hint is elsewhere: this activity is a second one.
                    [_] if subjects.contains(&subject) => None,
                    [only] => Some(only),
                    several => several.iter().find(|(of, ..)| is_named(of)),
                };
                if let Some((_, figures, figure)) = of.filter(|_| !places.contains(&offset)) {
                    subjects.insert(subject.clone());
                    let room = most_at(column(text, offset));
                    let reason = Texts::of(["? syntax error", "?"].map(str::to_owned));
                    let hint = InlayHint::new(offset, reason, MOST_CHARACTERS, HintStatus::Unknown, None);
                    let reason = HintOf { hint, subject: Some(subject), figure: None, room };
                    lost.push(HintOf { hint: older(&reason, figure), ..reason.clone() });
                    lost.extend(figures.are_reasons_shown().then_some(reason));
                }
            }
            _ => {}
        }
    }
    lost
}

#[cfg(test)]
mod tests {
    use mauve_hir::{Database, Workspace};
    use salsa::Setter as _;

    use super::*;
    use crate::fixture::{project_of, project_with};
    use crate::inlay_hints;

    const MODEL: &str = "codel plan(): int
codel drive(): int
shell S { }
core Planning(S) {
  statemachine {
    initial state Plan {
      run = { plan(); }
      transition again to Plan
    }
  }
}
core Driving(S) { update = { drive(); } }
component Planner(S, Planning)
component Driver(S, Driving)
architecture A { instance planner: Planner  instance driver: Driver }
deployment D {
  architecture A
  activity driver { priority = 2 period = 50 }
  activity planner { priority = 1 period = 200 }
}
";

    /// An editor: a model, and what is kept of its earlier texts.
    struct Editor {
        db: Database,
        workspace: Workspace,
        file: File,
        earlier: EarlierFigures,
    }

    impl Editor {
        fn new() -> Editor {
            let db = Database::default();
            let files = [
                ("/robot.mal".into(), MODEL.to_owned()),
                ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
                ("/times.toml".into(), "codel.plan = 70\ncodel.drive = 17".to_owned()),
            ];
            let workspace = Workspace::of_texts(&db, "/".into(), files);
            let file = workspace.file(&db, "/robot.mal".as_ref()).unwrap();
            let mut editor = Editor { db, workspace, file, earlier: EarlierFigures::default() };
            editor.update(true);
            editor
        }

        fn update(&mut self, is_saved: bool) {
            let files = [(self.file, project_with(&self.db, self.workspace, self.file))];
            let options = HintOptions::default();
            self.earlier = self.earlier.updated(&self.db, &files, &[], options, is_saved);
        }

        /// Changes the text; returns the hints, each with the beginning of its line.
        fn set(&mut self, path: &str, text: &str, is_saved: bool) -> Vec<String> {
            let file = self.workspace.file(&self.db, path.as_ref()).unwrap();
            file.set_text(&mut self.db, text.into());
            self.update(is_saved);
            let text = self.file.text(&self.db);
            let all = TextRange::up_to(TextSize::of(&**text));
            let options = HintOptions::default();
            let hints = inlay_hints(
                &self.db,
                project_of(&self.db, self.workspace, self.file),
                self.file,
                all,
                options,
                &self.earlier,
            );
            let line = |offset: TextSize| text[..usize::from(offset)].lines().last().unwrap_or_default();
            let shown = |hint: &InlayHint| {
                let start: String = line(hint.offset).trim().chars().take(17).collect();
                format!("{} | {} | {}", start.trim(), hint.label, hint.status.name())
            };
            hints.iter().map(shown).collect()
        }

        fn set_model(&mut self, from: &str, to: &str) -> Vec<String> {
            self.set("/robot.mal", &MODEL.replacen(from, to, 1), false)
        }
    }

    const COMPLETE: [&str; 8] = [
        "initial state Pla | ≤ 70 ms per period | time",
        "run = { plan(); } | 70 ms | time",
        "transition again | ≤ 70 ms per period | time",
        "core Driving(S) { | 17 ms | time",
        "deployment D { | 2 of 2 met at 1e-4 | met",
        "deployment D { | CPU 1 69.0 % | met",
        "activity driver { | ✓ 17 / 50 ms | met",
        "activity planner | ✓ 121 / 200 ms | met",
    ];

    #[test]
    fn older_figures_stand_where_the_text_is_incomplete() {
        let mut editor = Editor::new();
        assert_eq!(editor.set_model("", ""), COMPLETE);
        let in_core = [
            "initial state Pla | … ≤ 70 ms per period | older",
            "run = { plan(); p | … 70 ms | older",
            "transition again | … ≤ 70 ms per period | older",
            "core Driving(S) { | 17 ms | time",
            "deployment D { | … 2 of 2 met at 1e-4 | older",
            "deployment D { | … CPU 1 69.0 % | older",
            "activity driver { | ✓ 17 / 50 ms | met",
            "activity planner | … 121 / 200 ms | older",
        ];
        assert_eq!(editor.set_model("plan(); }", "plan(); pl }"), in_core);
        // The figures of the last complete text are kept, however many incomplete ones follow.
        assert_eq!(editor.set_model("plan(); }", "plan(); pla }")[0], in_core[0]);
        let doubled = editor.set_model("plan(); }", "plan(); plan(); }");
        assert_eq!(doubled[7], "activity planner | ✗ CPU 1 overloaded (104.0 %) | missed");
        let older = editor.set_model("plan(); }", "plan(); plan(); p }");
        assert_eq!(older[7], "activity planner | … CPU 1 overloaded (104.0 %) | older");
        assert_eq!(editor.set_model("", ""), COMPLETE);
    }

    #[test]
    fn older_figures_of_one_line_have_names_and_are_marked() {
        let mut editor = Editor::new();
        let one_line = |from: &str, to: &str| {
            let text = MODEL.replace("period = 50 }\n  activity", "period = 50 } activity");
            text.replace("planner", "planner_of_the_arm").replacen(from, to, 1)
        };
        editor.set("/robot.mal", &one_line("", ""), false);
        let shown = editor.set("/robot.mal", &one_line("codel drive(): int", "codel drive(): "), false);
        assert_eq!(
            shown[6..],
            [
                "activity driver { | driver: … 17 / 50 ms | older",
                "activity driver { | planner_of_the_…: … 121 / 200 ms | older",
            ]
        );
    }

    #[test]
    fn reasons_stand_beside_older_figures_of_saved_texts() {
        let mut editor = Editor::new();
        let broken = MODEL.replace("period = 200", "period = ");
        let shown = editor.set("/robot.mal", &broken, true);
        assert_eq!(
            shown[5..],
            [
                "deployment D { | CPU 1 ≥ 34.0 % | unknown",
                "activity driver { | ✓ 17 / 50 ms | met",
                "activity planner | … 121 / 200 ms | older",
                "activity planner | ? syntax error | unknown",
            ]
        );
        assert_eq!(editor.earlier.reasons_due(), None);
        // Another figure may be unknown for another reason.
        editor.set_model("", "");
        assert_eq!(editor.earlier.reasons_due(), None);
        editor.set("/robot.mal", &broken, false);
        assert!(editor.earlier.reasons_due().is_some_and(|due| due <= PATIENCE));
    }

    #[test]
    fn figures_without_a_time_and_without_a_declaration_are_kept() {
        let mut editor = Editor::new();
        let shown = editor.set("/times.toml", "codel.plan = \ncodel.drive = 17", false);
        assert_eq!(shown[6], "activity driver { | … 17 / 50 ms | older");
        assert_eq!(editor.set("/times.toml", "codel.plan = 70\ncodel.drive = 17", false), COMPLETE);
        let without = editor.set_model("deployment D", "deploy D");
        assert_eq!(
            without[4..],
            ["activity driver { | … 17 / 50 ms | older", "activity planner | … 121 / 200 ms | older",]
        );
        let again = editor.set_model("priority = 2 period = 50", "priority = 2 period = ");
        assert_eq!(again[6], "activity driver { | … 17 / 50 ms | older");
    }

    #[test]
    fn activities_behind_a_brace_too_many_keep_their_figures() {
        let mut editor = Editor::new();
        let shown = editor.set_model("period = 50 }", "period = 50 } }");
        assert_eq!(
            shown[6..],
            ["activity driver { | … 17 / 50 ms | older", "activity planner | … 121 / 200 ms | older",]
        );
        let path = "/robot.mal";
        let saved = editor.set(path, &MODEL.replacen("period = 50 }", "period = 50 } }", 1), true);
        let reason = "activity planner | ? syntax error | unknown".to_owned();
        assert!(saved.contains(&reason), "{saved:?}");
        assert_eq!(editor.set_model("", ""), COMPLETE);
    }

    #[test]
    fn activities_of_two_deployments_keep_their_own_figures() {
        let mut editor = Editor::new();
        let other = "\ndeployment Slow {\n  architecture A\n  activity planner { priority = 1 period = 900 }\n\
                     \x20 activity driver { priority = 2 period = 30 }\n}\n";
        let text = MODEL.to_owned() + other;
        editor.set("/robot.mal", &text, true);
        let shown = editor.set("/robot.mal", &text.replacen("period = 900 }", "period = 900 } }", 1), false);
        let drivers: Vec<&String> = shown.iter().filter(|line| line.starts_with("activity driver")).collect();
        assert_eq!(drivers.len(), 2, "{shown:?}");
        let planners: Vec<&String> =
            shown.iter().filter(|line| line.starts_with("activity planner")).collect();
        assert_eq!(planners.len(), 2, "{shown:?}");
    }

    #[test]
    fn figures_of_another_level_are_not_older_ones() {
        let mut editor = Editor::new();
        editor.workspace.set_significance(&mut editor.db).to(Level::from_f64(1e-6));
        let shown = editor.set_model("period = 200", "period = ");
        assert!(!shown.iter().any(|line| line.contains("… ")), "{shown:?}");
    }
}
