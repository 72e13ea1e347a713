//! Hints of a timing table: beside each time, the greatest one with which every deadline is still met, how many activities execute
//! it, and where it comes from.
//!
//! A limit takes a search of many analyses. So the hints are given until a moment, without the limits that are not found by then; who
//! asked computes these, which salsa keeps, and asks again.

use std::time::Instant;

use mauve_diagnostics::figure::{Forms, HintStatus, limit_figure};
use mauve_diagnostics::short_reason;
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, File, ModelDb, Project, names_of};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::{Entry, Status, Table, TableSection};
use mauve_wcrt::{
    ExecutedTime, Limit, Origin, Query, TableSet, TimeSensitivity, Timed, executed_times, files_of,
    origin_of, response_times, table, table_files, time_sensitivity, timed_by,
};
use rustc_hash::FxHashMap;

use super::earlier::EarlierFigures;
use super::in_file::on_lines;
use super::label::{Texts, most_at};
use super::other_files::in_other_file;
use super::{HintOf, HintOptions, HintSubject, InlayHint, column, end_of_line, hash_of};

/// Returns the hints of a timing table in `range` for the projects that share it, and whether limits are missing: those that are not
/// found by `end`. Those of a `mauve.toml` are the response times of the gateways that it declares, those of a file of threads the ones
/// of its threads.
pub fn table_hints<'db>(
    db: &'db dyn ModelDb,
    projects: &[Project<'db>],
    file: File,
    range: TextRange,
    options: HintOptions,
    earlier: &EarlierFigures,
    end: Option<Instant>,
) -> (Vec<InlayHint>, bool) {
    let mut found = in_other_file(db, projects, file, options, earlier);
    found.retain(|it| range.contains_inclusive(it.hint.offset));
    let has_it = |project: &Project<'db>| table_files(db, project.workspace(db)).files.contains(&file);
    if !options.program_times || !projects.iter().any(has_it) {
        return (on_lines(found), false);
    }
    let (text, times) = (file.text(db), times_in(db, projects, Some(file)));
    let mut by_subject: FxHashMap<(Project<'db>, Timed<'db>), Vec<&TimeIn<'db>>> = FxHashMap::default();
    for it in &times {
        by_subject.entry((it.project, it.executed.of.clone())).or_default().push(it);
    }
    let mut is_incomplete = false;
    for (section, entry) in entries(table(db, file)) {
        let offset = end_of_line(text, TextSize::new(entry.value_span.end as u32));
        if !range.contains_inclusive(offset) || entry.value.is_none() {
            continue;
        }
        let of_project = |&project: &Project<'db>| {
            by_subject.get(&(project, timed_by(db, project, section, &entry.key).into_iter().next()?))
        };
        let shown = projects.iter().filter_map(of_project).flatten().map(|it| {
            let is_late = end.is_some_and(|end| Instant::now() >= end);
            is_incomplete |= is_late;
            it.shown(db, if is_late { None } else { it.sensitivity(db) }, options.tight_slack)
        });
        // Of several deployments, the worst one; the first of equal ones.
        let worst = shown.min_by_key(|(rank, _)| *rank).map(|(_, shown)| shown);
        let (texts, status) =
            worst.unwrap_or_else(|| (Texts::of(["– not used".to_owned()]), HintStatus::Time));
        let explained_at = Some(TextSize::new(entry.key_span.start as u32));
        let room = most_at(column(text, offset));
        let hint = InlayHint::new(offset, texts, room, status, explained_at);
        let subject = Some(HintSubject::Time(entry.key.as_str().into()));
        found.push(HintOf { hint, subject, figure: None, room });
    }
    (on_lines(found), is_incomplete)
}

/// Returns the limit of the time of a codel as the hints show it, and its status: of several deployments, the worst one.
pub fn limit_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    codel: Decl<'db>,
    tight_slack: u32,
) -> Option<(String, HintStatus)> {
    let times = times_in(db, &[project], None);
    let own = times.iter().filter(|it| it.executed.of == Timed::Codel(codel));
    let shown = own.map(|it| it.shown(db, it.sensitivity(db), tight_slack));
    let (_, (texts, status)) = shown.min_by_key(|(rank, _)| *rank)?;
    Some((texts.within(usize::MAX).split(" · ").next()?.to_owned(), status))
}

/// Returns a value that changes when what the limits depend on changes: times, and the activities with their responses. No limit is
/// searched for it.
pub fn hash_of_table(
    db: &dyn ModelDb,
    projects: &[Project<'_>],
    file: File,
    options: HintOptions,
    earlier: &EarlierFigures,
) -> u64 {
    let is_table = projects.iter().any(|it| table_files(db, it.workspace(db)).files.contains(&file));
    let times = if is_table { times_in(db, projects, Some(file)) } else { Vec::new() };
    let of_time = |it: &TimeIn<'_>| (it.executed.time(db, it.query.level), it.executed.activities().len());
    let of_deployment = |all: &[TimeIn<'_>]| {
        let report = all.first().map(|it| response_times(db, it.project, it.deployment, it.query));
        let activities = report.into_iter().flat_map(|report| &report.activities);
        let activities = activities.map(|it| (it.response, it.period, it.deadline, it.verdict.name()));
        (activities.collect::<Vec<_>>(), all.iter().map(of_time).collect::<Vec<_>>())
    };
    let of_each = times.chunk_by(|one, other| one.deployment == other.deployment).map(of_deployment);
    let others = in_other_file(db, projects, file, options, earlier).into_iter().map(|it| it.hint.label);
    hash_of((of_each.collect::<Vec<_>>(), others.collect::<Vec<_>>(), options))
}

/// Returns the entries whose times periods consist of.
fn entries(table: &Table) -> impl Iterator<Item = (TableSection, &Entry)> {
    let is_shown = |section| !matches!(section, TableSection::Component | TableSection::Wait);
    let sections = table.sections().into_iter().filter(move |(section, _)| is_shown(*section));
    sections.flat_map(|(section, all)| all.iter().map(move |entry| (section, entry)))
}

/// A time that a deployment executes.
struct TimeIn<'db> {
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    executed: &'db ExecutedTime<'db>,
    origin: Origin,
}

/// Returns the times that deployments execute: those with this table, if there is one.
fn times_in<'db>(db: &'db dyn ModelDb, projects: &[Project<'db>], file: Option<File>) -> Vec<TimeIn<'db>> {
    let mut found = Vec::new();
    for &project in projects {
        for deployment in names_of(db, project).of_kind(db, Kind::Deployment) {
            let query = Query::shown(db, project, deployment);
            for executed in executed_times(db, project, deployment, query.level) {
                let has_it =
                    |tables: &TableSet<'db>| file.is_none_or(|it| files_of(db, *tables).contains(&it));
                let with_file = executed.tables.iter().find(|it| has_it(it));
                found.extend(with_file.map(|&tables| {
                    let origin = origin_of(db, tables, &executed.of, query.level);
                    TimeIn { project, deployment, query, executed, origin }
                }));
            }
        }
    }
    found
}

impl<'db> TimeIn<'db> {
    fn sensitivity(&self, db: &'db dyn ModelDb) -> Option<&'db TimeSensitivity<'db>> {
        time_sensitivity(db, self.project, self.deployment, self.executed.of.clone(), self.query).as_ref()
    }

    /// Returns what is shown of it, with how bad that is: a lower rank is worse.
    fn shown(
        &self,
        db: &'db dyn ModelDb,
        found: Option<&TimeSensitivity<'db>>,
        tight_slack: u32,
    ) -> ((u8, u64), (Texts, HintStatus)) {
        let texts = |texts: [String; 2], status| Forms { texts: texts.into(), bar: None, status };
        let (rank, forms) = match found.map(|it| (&it.limit, &it.unproved, it)) {
            Some((Limit::Last(limit) | Limit::Proved(limit), late, it)) => {
                let rank = if late.is_some() { 1 } else { 4 };
                let forms = limit_figure(it.time, *limit, late.is_none(), tight_slack);
                ((rank, limit.as_nanos()), forms)
            }
            // Its own activities are in time: another one is late, whatever it takes.
            Some((_, Some(late), _)) if !self.is_late(db) => {
                ((3, 1), texts([format!("– {late} is late anyway"), "–".to_owned()], HintStatus::Time))
            }
            Some((_, Some(late), _)) => (
                (0, 0),
                texts([format!("✗ {}", self.why_late(db, late)), "✗".to_owned()], HintStatus::Missed),
            ),
            Some((Limit::Any, ..)) => {
                ((5, 0), texts(["✓ any time".to_owned(), "✓".to_owned()], HintStatus::Met))
            }
            Some((Limit::NotAnalysed(Some(instance)), ..)) => {
                ((2, 0), texts([format!("? see {instance}"), "?".to_owned()], HintStatus::Unknown))
            }
            Some(_) => ((2, 1), texts(["? not analysed".to_owned(), "?".to_owned()], HintStatus::Unknown)),
            // The search goes on.
            None => ((3, 0), texts(["…".to_owned(), "…".to_owned()], HintStatus::Older)),
        };
        let uses = match self.executed.activities().len() {
            0 => " · background".to_owned(),
            1 => " · 1 use".to_owned(),
            more => format!(" · {more} uses"),
        };
        let origin = match self.origin {
            Origin::Measured => " · measured",
            Origin::Assumed => " · assumed",
            Origin::Given => "",
        };
        let text = forms.text();
        let longer = [format!("{text}{uses}{origin}"), format!("{text}{origin}")];
        (rank, (Texts::of(longer.into_iter().chain(forms.texts.iter().cloned())), forms.status))
    }

    /// Whether an activity that executes it is late.
    fn is_late(&self, db: &'db dyn ModelDb) -> bool {
        let report = response_times(db, self.project, self.deployment, self.query);
        let own = self.executed.activities().iter().filter_map(|&index| report.activities.get(index));
        own.into_iter().any(|it| matches!(it.verdict, Status::Missed | Status::Unbounded | Status::NoBound))
    }

    /// Returns why the deadline of an activity is not met with any time of the codel.
    fn why_late(&self, db: &'db dyn ModelDb, late: &Name) -> String {
        let report = response_times(db, self.project, self.deployment, self.query);
        let overloaded = report.activities.iter().find(|it| it.instance == *late);
        let overloaded = overloaded.filter(|it| it.verdict == Status::Unbounded);
        let reason = overloaded.and_then(|it| Some(short_reason(db, &it.reasons.first()?.reason)));
        reason.unwrap_or_else(|| format!("{late} misses its deadline"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use expect_test::{Expect, expect};

    const MODEL: &str = "//- /robot.mal
codel plan(): int
codel drive(): int
codel idle(): int
shell S { }
core Planning(S) { update = { plan(); drive(); } }
core Driving(S) { update = { drive(); } }
component Planner(S, Planning)
component Driver(S, Driving)
architecture A { instance driver: Driver  instance planner: Planner }
deployment D {
  architecture A
  activity driver { priority = 2 period = 50 DRIVER }
  activity planner { priority = 1 period = 100 }
}
//- /mauve.toml
timing.tables = [\"times.toml\"]
platform.rt_throttling = false
//- /times.toml
";

    fn fixture(driver: &str, times: &str) -> (Fixture, File) {
        let fixture = Fixture::new(&(MODEL.replace("DRIVER", driver) + times));
        let file = fixture.workspace.file(&fixture.db, "/times.toml".as_ref()).unwrap();
        (fixture, file)
    }

    fn hints(driver: &str, times: &str, end: Option<Instant>) -> (Vec<InlayHint>, bool) {
        let (fixture, file) = fixture(driver, times);
        let project = project_of(&fixture.db, fixture.workspace, file);
        let all = TextRange::up_to(TextSize::of(times));
        table_hints(
            &fixture.db,
            &[project],
            file,
            all,
            HintOptions::default(),
            &EarlierFigures::default(),
            end,
        )
    }

    fn check(driver: &str, times: &str, expected: Expect) {
        let (hints, is_incomplete) = hints(driver, times, None);
        assert!(!is_incomplete);
        let mut text = times.to_owned();
        for hint in hints.iter().rev() {
            text.insert_str(hint.offset.into(), &format!("⟨{} | {}⟩", hint.label, hint.status.name()));
        }
        expected.assert_eq(&text);
    }

    #[test]
    fn each_time_has_its_limit_its_use_and_its_origin() {
        check(
            "",
            "[codel]\nplan = 30\ndrive = 5 # assumed\nidle = 1\n",
            expect![[r#"
                [codel]
                plan = 30⟨✓ ≤ 85 ms · 1 use | met⟩
                drive = 5 # assumed⟨✓ ≤ 23.3333 ms · assumed | met⟩
                idle = 1⟨– not used | time⟩
            "#]],
        );
        check(
            "",
            "codel = { plan = [ 30 ], drive = 23.4 }\nlevels = [1e-4]\n",
            expect![[r#"
            codel = { plan = [ 30 ], drive = 23.4 }⟨plan: ✗ ≤ 29.8 ms · 1 use | missed⟩⟨drive: ✗ ≤ 23.3333 ms · 2 uses | missed⟩
            levels = [1e-4]
        "#]],
        );
        check(
            "",
            "[codel]\nplan = 30\n[program]\n\"Driver/update\" = 3\n",
            expect![[r#"
            [codel]
            plan = 30⟨? see planner · 1 use | unknown⟩
            [program]
            "Driver/update" = 3⟨? see planner · 1 use | unknown⟩
        "#]],
        );
    }

    #[test]
    fn a_time_because_of_which_a_deadline_is_missed_is_wrong() {
        check(
            "deadline = 7",
            "[codel]\nplan = 30\ndrive = 8\n",
            expect![[r#"
            [codel]
            plan = 30⟨✓ ≤ 76 ms · 1 use | met⟩
            drive = 8⟨✗ ≤ 7 ms · 2 uses | missed⟩
        "#]],
        );
        check(
            "",
            "[codel]\nplan = 300\ndrive = 60\n",
            expect![[r#"
            [codel]
            plan = 300⟨✗ CPU 1 overloaded (480.0 %) | missed⟩
            drive = 60⟨✗ CPU 1 overloaded (120.0 %) | missed⟩
        "#]],
        );
    }

    #[test]
    fn a_time_is_not_wrong_because_of_another_activity() {
        check(
            "",
            "[codel]\nplan = 300\ndrive = 5\n[program]\n\"Driver/update\" = 5\n",
            expect![[r#"
            [codel]
            plan = 300⟨✗ ≤ 85 ms · 1 use | missed⟩
            drive = 5⟨✗ CPU 1 overloaded (315.0 %) | missed⟩
            [program]
            "Driver/update" = 5⟨– planner is late anyway · 1 use | time⟩
        "#]],
        );
    }

    #[test]
    fn limits_that_take_long_come_later() {
        let (hints, is_incomplete) = hints("", "[codel]\nplan = 30\ndrive = 5\n", Some(Instant::now()));
        assert!(is_incomplete);
        assert_eq!(hints[0].label, "… · 1 use");
        assert_eq!(hints[0].status, HintStatus::Older);
    }

    #[test]
    fn another_period_is_another_hash() {
        let hash = |driver: &str, times: &str| {
            let (fixture, file) = fixture(driver, times);
            let project = project_of(&fixture.db, fixture.workspace, file);
            hash_of_table(&fixture.db, &[project], file, HintOptions::default(), &EarlierFigures::default())
        };
        let times = "[codel]\nplan = 30\ndrive = 5\n";
        assert_eq!(hash("", times), hash("", &format!("# comment\n{times}")));
        assert_ne!(hash("", times), hash("deadline = 40", times));
        assert_ne!(hash("", times), hash("", &times.replace("30", "31")));
    }
}
