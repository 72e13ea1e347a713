//! Completion and signature help on the sample robot: wherever the cursor is, whatever is missing behind it or before it; and
//! each name of the models, taken away, is offered where it stood.

use std::collections::HashSet;
use std::ops::Range;
use std::path::PathBuf;

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::{Database, File, Workspace};
use mauve_ide::{CompletionKind, Completions, completions, signature_help};
use mauve_syntax::{SyntaxKind, SyntaxNode, TextRange, TextSize};
use mauve_tests::{Random, models, search, texts_moved};

use crate::project_of;

/// Operations and handlers, which the sample robot does not have.
const OPERATIONS: &str = r#"
//- /operations.mal
library plans {
  use geometry_msgs
  codel far(in pose: Pose): bool
  codel way(in goal: Pose, out length: double): bool
  shell Planner { provide plan(in goal: Pose, out length: double): bool  provide forget(): void }
  core PlannerCore(Planner) {
    provide plan(in goal: Pose, out length: double): bool = { return way(goal, length); }
    provide forget() = { }
    update = { }
  }
  component PlannerOf(Planner, PlannerCore)
}
library drives {
  use geometry_msgs
  use plans
  shell Driver {
    constant most: int = 3
    property tries: int [0; most] = most
    input port goal: Pose
    require plan(in goal: Pose, out length: double): bool
    require forget(): void
  }
  core DriverCore(Driver) {
    var goal_pose: Pose;
    var length: double;
    var found: bool;
    handler planning: plan
    start = { return tries > 0; }
    statemachine {
      initial state Idle {
        run = { read(goal, goal_pose); }
        transition asked if (status(goal) == new_data && far(goal_pose)) to Waiting {
          planning = send(plan, goal_pose);
        }
      }
      state Waiting {
        transition done if (collect(planning, found, length) == success) to Idle
      }
    }
  }
  component DriverOf(Driver, DriverCore)
  architecture Both {
    instance planner: PlannerOf
    instance driver: DriverOf
    operation planner.plan -> driver.plan
    operation planner.forget -> driver.forget
    property driver.tries = 2
  }
  deployment D {
    architecture Both
    activity planner { priority = 1 period = 100 }
    activity driver { priority = 2 period = 100 }
  }
}
"#;

struct Sample {
    db: Database,
    workspace: Workspace,
    files: Vec<File>,
}

fn sample(texts: impl IntoIterator<Item = (PathBuf, String)>) -> Sample {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/robot".into(), texts);
    let files = workspace.files(&db).values().copied().collect();
    Sample { db, workspace, files }
}

/// The sample robot.
fn robot() -> Sample {
    sample(texts_moved(&models().join("p3dx"), "/robot"))
}

fn operations() -> Sample {
    let files = mauve_tests::fixture(OPERATIONS).into_iter();
    sample(files.map(|(path, text)| (PathBuf::from(format!("/robot{path}")), text)))
}

impl Sample {
    /// What completion offers; every edit of it, and every signature, is within its text.
    fn ask(&mut self, file: File, text: &str, offset: usize) -> Completions {
        file.set_text(&mut self.db, text.into());
        let offset = TextSize::new(offset as u32);
        let found = completions(&self.db, project_of(&self.db, self.workspace, file), file, offset);
        for item in &found.items {
            let range = item.replaced;
            assert!(range.contains_inclusive(offset), "{item:?} at {offset:?}");
            let replaced = text.get(Range::<usize>::from(range)).unwrap();
            assert!(!replaced.contains('\n'), "{item:?} replaces {replaced:?}");
            assert!(!item.label.is_empty());
            for more in &item.more {
                assert!(text.get(Range::<usize>::from(more.range)).is_some());
                assert!(more.range.intersect(range).is_none_or(|both| both.is_empty()), "{item:?}");
            }
        }
        let mut shown = HashSet::new();
        for item in &found.items {
            let is_new = shown.insert((&item.label, &item.detail, &item.note));
            assert!(is_new, "{item:?} is in the list twice at {offset:?} of\n{text}");
        }
        if let Some(signature) =
            signature_help(&self.db, project_of(&self.db, self.workspace, file), file, offset)
        {
            for parameter in &signature.parameters {
                assert!(signature.label.get(Range::<usize>::from(*parameter)).is_some());
            }
        }
        found
    }
}

/// At every place of every file, with all that follows taken away, and with damage of other kinds at some.
#[test]
fn wherever_the_cursor_is_edits_fit_the_text() {
    edits_fit_the_text(0);
}

#[test]
fn wherever_else_the_cursor_is_edits_fit_the_text() {
    edits_fit_the_text(1);
}

/// Asks in every second piece of 100 bytes: the two halves of a full search are every place.
fn edits_fit_the_text(half: usize) {
    let mut random = Random(7);
    for mut sample in [robot(), operations()] {
        for file in sample.files.clone() {
            let text = file.text(&sample.db).to_string();
            for (offset, letter) in text.char_indices() {
                let head = &text[..offset];
                let (text, offset) = match random.below(8) {
                    0 => (text.clone(), offset),
                    1 => (format!("{head}{}", &text[offset + letter.len_utf8()..]), offset),
                    2 => {
                        let with = random.of(&["{", "}", "(", ")", "é", ".", "\"", "/*", "->", "state "]);
                        (format!("{head}{with}{}", &text[offset..]), offset + with.len())
                    }
                    _ => (head.to_owned(), offset),
                };
                let piece = head.len() / 100;
                if piece % 2 == half && search::is_searched(piece / 2) {
                    sample.ask(file, &text, offset);
                }
            }
            sample.ask(file, &text, text.len());
        }
    }
}

/// What completion does not offer where it stood, of all names that refer to something: with the text of the name taken away,
/// and at its end.
fn not_offered(mut sample: Sample) -> (usize, Vec<String>) {
    let mut missing = Vec::new();
    let mut count = 0;
    for file in sample.files.clone() {
        if file.path(&sample.db).extension().is_none_or(|it| it != "mal") {
            continue;
        }
        let text = file.text(&sample.db).to_string();
        let root = mauve_syntax::parse(&text).syntax();
        let names = root.descendants().filter(|node| node.kind() == SyntaxKind::NAME_REF);
        let names: Vec<TextRange> = names.map(|it: SyntaxNode| it.text_range()).collect();
        for range in names {
            let (start, end) = (usize::from(range.start()), usize::from(range.end()));
            let name = &text[start..end];
            let line = text[..start].rsplit('\n').next().unwrap_or_default().trim_start();
            let path = file.path(&sample.db).file_name().unwrap().display().to_string();
            let without = format!("{}{}", &text[..start], &text[end..]);
            count += 1;
            for (text, offset, shown) in
                [(&*without, start, format!("|{name}")), (&*text, end, format!("{name}|"))]
            {
                let found = sample.ask(file, text, offset);
                if !found.items.iter().any(|item| item.label == name) {
                    missing.push(format!("{path}: {line}{shown}"));
                }
            }
        }
        file.set_text(&mut sample.db, text.as_str().into());
    }
    (count, missing)
}

#[test]
fn a_name_that_is_taken_away_is_offered_where_it_stood() {
    for (sample, least) in [(robot(), 800), (operations(), 70)] {
        let (count, missing) = not_offered(sample);
        assert!(missing.is_empty(), "{} of {count}:\n{}", missing.len(), missing.join("\n"));
        assert!(count > least, "only {count} names were looked at");
    }
}

/// What is offered first fits: in the place of a name it resolves, goes the right way, and is of the right kind.
#[test]
fn what_is_offered_first_fits() {
    let (mut count, mut wrong) = (0, Vec::new());
    for (mut sample, each) in [(robot(), 11), (operations(), 2)] {
        for file in sample.files.clone() {
            if file.path(&sample.db).extension().is_none_or(|it| it != "mal") {
                continue;
            }
            let text = file.text(&sample.db).to_string();
            let root = mauve_syntax::parse(&text).syntax();
            let names = root.descendants().filter(|node| node.kind() == SyntaxKind::NAME_REF);
            let names: Vec<TextRange> = names.map(|it: SyntaxNode| it.text_range()).collect();
            for range in names.into_iter().step_by(each) {
                let (start, end) = (usize::from(range.start()), usize::from(range.end()));
                let without = format!("{}{}", &text[..start], &text[end..]);
                let items = sample.ask(file, &without, start).items;
                for item in items.into_iter().filter(|it| it.rank <= 1) {
                    let is_text = matches!(item.kind, CompletionKind::Keyword | CompletionKind::Skeleton);
                    let is_end = item.label.contains('.') && text[end..].starts_with('.');
                    if is_text || is_end || item.label == "activity" {
                        continue;
                    }
                    count += 1;
                    let is_call = matches!(
                        item.kind,
                        CompletionKind::Codel | CompletionKind::BuiltIn | CompletionKind::Operation
                    );
                    let brackets = if is_call && item.snippet.is_some() { "()" } else { "" };
                    let with = format!("{}{}{brackets}{}", &text[..start], item.label, &text[end..]);
                    file.set_text(&mut sample.db, with.into());
                    for found in workspace_diagnostics(&sample.db, sample.workspace) {
                        let code = found.diagnostic.code.name;
                        let is_unfit = code.starts_with("unresolved-")
                            || matches!(
                                code,
                                "syntax-error"
                                    | "unknown-type"
                                    | "unknown-package"
                                    | "misspelt-name"
                                    | "invalid-type"
                                    | "port-direction"
                                    | "connection-direction"
                                    | "connection-type"
                                    | "two-writers"
                                    | "out-argument"
                                    | "not-assignable"
                                    | "wrong-shell"
                                    | "inheritance-cycle"
                                    | "import-cycle"
                            );
                        // What follows elsewhere, since another name stood here, is no fault of the name.
                        let at = found.diagnostic.at.range(&sample.db);
                        let is_here = found.diagnostic.at.file(&sample.db) == file
                            && at.contains_inclusive(range.start());
                        if is_unfit && is_here {
                            let line = text[..start].rsplit('\n').next().unwrap_or_default().trim_start();
                            wrong.push(format!("{line}⟨{}⟩: {}", item.label, found.diagnostic.message));
                        }
                    }
                }
            }
            file.set_text(&mut sample.db, text.as_str().into());
        }
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(count > 1000, "only {count} items were tried");
}
