//! Inlay hints: response times and deadlines of activities, the utilisation of CPUs (`inlay_hints/deployment.rs`), how long data
//! takes on connections (`inlay_hints/connections.rs`), execution times of programs (`inlay_hints/programs.rs`), values in
//! effect (`inlay_hints/values.rs`), activities in other files (`inlay_hints/other_files.rs`), and the limits of the times in timing tables (`inlay_hints/tables.rs`). While a text is incomplete, the figures of the last complete one are shown, marked as older
//! (`inlay_hints/earlier.rs`).

mod connections;
mod declaration;
mod deployment;
mod earlier;
mod figures;
mod in_file;
mod label;
mod other_files;
mod programs;
mod tables;
mod values;

pub use earlier::EarlierFigures;
pub use in_file::{hash_of_hints, inlay_hints};
pub(crate) use programs::components_of;
pub use tables::{hash_of_table, limit_of, table_hints};

use mauve_timing::CpuSet;
use std::hash::{BuildHasher as _, BuildHasherDefault, DefaultHasher, Hash};
use std::sync::Arc;

use mauve_hir::ProgramId;
use mauve_hir::item_tree::Name;
use mauve_syntax::{SyntaxKind, SyntaxNode, TextSize};

use self::label::{Texts, most_at};
use mauve_diagnostics::figure::{HintStatus, MOST_CHARACTERS, TIGHT_SLACK};

/// A label that an editor shows inside the text, of at most 32 characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InlayHint {
    /// Its position. Where it is a figure, nothing but comments follows on the line, so that it moves no text.
    pub offset: TextSize,
    /// Its text, for a small screen.
    pub label: String,
    /// Texts that say the same in fewer and fewer words, for editors that know how much room there is.
    pub labels: Arc<[String]>,
    /// What its figure says.
    pub status: HintStatus,
    /// The utilisation of the CPU that it shows, in percent.
    pub load: Option<u32>,
    /// The offset at which a [`hover`](crate::hover()) explains it, if one does.
    pub explained_at: Option<TextSize>,
}

impl InlayHint {
    /// Returns a hint that shows the first of the texts with at most `room` characters.
    fn new(
        offset: TextSize,
        texts: Texts,
        room: usize,
        status: HintStatus,
        explained_at: Option<TextSize>,
    ) -> InlayHint {
        let label = texts.within(room).to_owned();
        InlayHint { offset, label, labels: texts.into_all(), status, load: None, explained_at }
    }
}

/// The requested hints; by default all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct HintOptions {
    /// Response times of activities, how many deadlines are met beside deployments, and how long data takes on connections.
    pub response_times: bool,
    /// The utilisation of the CPUs beside deployments.
    pub loads: bool,
    /// Execution times of programs, states and transitions.
    pub program_times: bool,
    /// The values that instances and settings override.
    pub values: bool,
    /// Slack below this share of the deadline, in percent, is [`HintStatus::Tight`].
    pub tight_slack: u32,
}

impl Default for HintOptions {
    fn default() -> HintOptions {
        HintOptions {
            response_times: true,
            loads: true,
            program_times: true,
            values: true,
            tight_slack: TIGHT_SLACK,
        }
    }
}

/// A hint, and what a later text may need of it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct HintOf {
    hint: InlayHint,
    /// Its subject; none for values.
    subject: Option<HintSubject>,
    /// Its figure, if it is known.
    figure: Option<HintFigure>,
    /// The maximum length of a label there.
    room: usize,
}

/// What a figure is about. It has the same name in every text.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum HintSubject {
    /// The deadlines of a deployment.
    Deadlines,
    /// The CPUs of a deployment, a bit each.
    Cpus(CpuSet),
    /// The activity of an instance.
    Activity(Name),
    /// A program, a state or a transition of a core.
    Program(HintPlace),
    /// The connection to this port.
    Connection(Name),
    /// The time with this key in a timing table.
    Time(Name),
}

impl HintSubject {
    /// Its name, where several activities or programs have their hints on one line.
    fn name(&self) -> Option<&str> {
        match self {
            HintSubject::Deadlines | HintSubject::Cpus(_) => None,
            HintSubject::Activity(name) | HintSubject::Connection(name) | HintSubject::Time(name) => {
                Some(name)
            }
            HintSubject::Program(place) => Some(place.name()),
        }
    }
}

/// What a label of a core is about.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
enum HintPlace {
    Program(ProgramId),
    State(Name),
    /// The names of its state and of itself.
    Transition((Name, Name)),
}

impl HintPlace {
    /// Returns its keyword or name.
    fn name(&self) -> &str {
        match self {
            HintPlace::Program(ProgramId::Hook(kind)) => kind.keyword(),
            HintPlace::Program(ProgramId::Method { kind, .. }) => kind.keyword(),
            HintPlace::Program(_) => "",
            HintPlace::State(name) | HintPlace::Transition((_, name)) => name,
        }
    }
}

/// A figure.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct HintFigure {
    texts: Texts,
    /// How many activities are not included, since they are not analysed.
    missing: usize,
}

/// The texts of a hint, and what they say.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ShownHint {
    texts: Texts,
    status: HintStatus,
    /// How many activities its figure does not include; none if it shows no known figure.
    missing: Option<usize>,
}

impl ShownHint {
    /// Returns the hint of a subject at an offset of the text.
    fn at(self, text: &str, offset: TextSize, subject: HintSubject, explained_at: TextSize) -> HintOf {
        let room = most_at(column(text, offset));
        // A reason is shown in full: without it, the hint says little.
        let most = if self.status == HintStatus::Unknown { MOST_CHARACTERS } else { room };
        let figure = self.figure();
        let hint = InlayHint::new(offset, self.texts, most, self.status, Some(explained_at));
        HintOf { hint, subject: Some(subject), figure, room }
    }

    fn figure(&self) -> Option<HintFigure> {
        self.missing.map(|missing| HintFigure { texts: self.texts.clone(), missing })
    }
}

/// Returns the hash of what an editor shows.
fn hash_of(shown: impl Hash) -> u64 {
    BuildHasherDefault::<DefaultHasher>::default().hash_one(shown)
}

/// Returns the number of characters before `offset` in its line.
fn column(text: &str, offset: TextSize) -> usize {
    let before = text.get(..usize::from(offset)).unwrap_or_default();
    before.chars().rev().take_while(|it| *it != '\n').count()
}

/// Returns the end of the line with the end of `node` if it is on one line of the text, otherwise that with its opening brace.
fn beside(text: &str, node: &SyntaxNode) -> Option<TextSize> {
    let brace = |of: &SyntaxNode| of.children_with_tokens().find(|it| it.kind() == SyntaxKind::L_CURLY);
    // The brace of a program is in its block.
    let block = || node.children().find(|it| it.kind() == SyntaxKind::BLOCK);
    let range = node.text_range();
    let offset = match text.get(std::ops::Range::<usize>::from(range))?.contains('\n') {
        true => brace(node).or_else(|| brace(&block()?))?.text_range().end(),
        false => range.end(),
    };
    Some(end_of_line(text, offset))
}

/// Returns the end of the line with `offset`, behind its spaces: a hint there moves no text, nor the cursor.
fn end_of_line(text: &str, offset: TextSize) -> TextSize {
    let rest = text.get(usize::from(offset)..).unwrap_or_default();
    let line = rest.lines().next().unwrap_or_default();
    offset + TextSize::of(line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use crate::project::projects_with;
    use expect_test::{Expect, expect};
    use mauve_hir::Workspace;
    use mauve_syntax::TextRange;

    /// The text of the first file with the hints in it, in `⟨…⟩`.
    fn check(fixture: &str, expected: Expect) {
        check_kinds(fixture, HintOptions::default(), expected);
    }

    fn check_kinds(fixture: &str, options: HintOptions, expected: Expect) {
        let fixture = Fixture::new(fixture);
        let file = fixture.file;
        let text = file.text(&fixture.db);
        let all = TextRange::up_to(TextSize::of(&**text));
        let projects = projects_with(&fixture.db, &[fixture.workspace], file);
        let mut shown = String::new();
        for &project in &projects {
            if projects.len() > 1 {
                shown += &format!("⟨{}⟩\n", project.root(&fixture.db).path(&fixture.db).display());
            }
            let mut done = 0;
            for hint in inlay_hints(&fixture.db, project, file, all, options, &EarlierFigures::default()) {
                let offset = usize::from(hint.offset);
                shown += &format!("{}⟨{}⟩", &text[done..offset], hint.label);
                done = offset;
            }
            shown += &text[done..];
        }
        let lines: Vec<&str> = shown.lines().filter(|line| line.contains('⟨')).map(str::trim).collect();
        expected.assert_eq(&(lines.join("\n") + "\n"));
    }

    const NONE: HintOptions = HintOptions {
        response_times: false,
        loads: false,
        program_times: false,
        values: false,
        tight_slack: 10,
    };

    const PARTS: &str = "
codel plan(): int
codel drive(): int
shell S { }
core Planning(S) { update = { plan(); } }
core Driving(S) { update = { drive(); } }
component Planner(S, Planning)
component Driver(S, Driving)
architecture A { instance planner: Planner  instance driver: Driver }
";

    fn robot(deployment: &str, times: &str) -> String {
        format!(
            "{PARTS}{deployment}\n//- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n[platform]\nrt_throttling = false\n\
             //- /times.toml\n{times}\n"
        )
    }

    #[test]
    fn times_of_several_tables() {
        let deployments = "deployment D { architecture A activity driver { priority = 2 period = 50 } activity planner { priority = \
                           background } }\ndeployment Sea { architecture A activity driver { priority = 2 period = 50 } activity \
                           planner { priority = background } }";
        let text = robot(deployments, "codel.plan = 70\ncodel.drive = 17");
        let sea = "[timing.deployment.Sea]\ntables = [\"sea.toml\"]\n[platform]";
        let text =
            text.replacen("[platform]", sea, 1) + "\n//- /sea.toml\ncodel.plan = 70\ncodel.drive = 19\n";
        check(
            &text,
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨70 ms⟩
                core Driving(S) { update = { drive(); } }⟨17 ms to 19 ms⟩
                deployment D { architecture A activity driver { priority = 2 period = 50 } activity planner { priority = background } }⟨1 of 1 met at 1e-4⟩⟨CPU 1 34.0 %⟩⟨driver: ✓ 17 / 50 ms⟩⟨planner: – not real-time⟩
                deployment Sea { architecture A activity driver { priority = 2 period = 50 } activity planner { priority = background } }⟨1 of 1 met at 1e-4⟩⟨CPU 1 38.0 %⟩⟨driver: ✓ 19 / 50 ms⟩⟨planner: – not real-time⟩
            "#]],
        );
    }

    #[test]
    fn met_and_missed_and_what_is_left_out() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 2 period = 50 deadline = 20 }\n \
                 activity planner {\n  priority = 1\n  period = 100\n }\n}",
                "codel.plan = 70\ncodel.drive = 17",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨70 ms⟩
                core Driving(S) { update = { drive(); } }⟨17 ms⟩
                deployment D {⟨1 of 2 met at 1e-4⟩⟨✗ CPU 1 overloaded (104.0 %)⟩
                activity driver { priority = 2 period = 50 deadline = 20 }⟨✓ 17 / 20 ms⟩
                activity planner {⟨✗ CPU 1 overloaded (104.0 %)⟩
            "#]],
        );
        check(
            &robot(
                "deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 16 } \
                 activity planner { priority = background } }",
                "codel.plan = 70\ncodel.drive = 17",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨70 ms⟩
                core Driving(S) { update = { drive(); } }⟨17 ms⟩
                deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 16 } activity planner { priority = background } }⟨0 of 1 met at 1e-4⟩⟨CPU 1 34.0 %⟩⟨driver: ✗ 17 / 16 ms⟩⟨planner: – not real-time⟩
            "#]],
        );
    }

    #[test]
    fn what_is_not_analysed_says_why_and_what_it_may_take() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 1 period = 50 deadline = 50 }\n \
                 activity planner { priority = 2 period = 100 deadline = 100 }\n}",
                "codel.drive = 17",
            ),
            expect![[r#"
                core Driving(S) { update = { drive(); } }⟨17 ms⟩
                deployment D {⟨0 of 2 met, 2 not analysed⟩⟨CPU 1 ≥ 34.0 %⟩
                activity driver { priority = 1 period = 50 deadline = 50 }⟨? see planner⟩
                activity planner { priority = 2 period = 100 deadline = 100 }⟨? no time for plan⟩
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 2 period = }\n \
                 activity planner { priority = 1 period = 100 }\n",
                "codel.plan = 70\ncodel.drive = 17",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨70 ms⟩
                core Driving(S) { update = { drive(); } }⟨17 ms⟩
                deployment D {⟨0 of 2 met, 2 not analysed⟩⟨CPU 1 ≥ 70.0 %⟩
                activity driver { priority = 2 period = }⟨? syntax error⟩
                activity planner { priority = 1 period = 100 }⟨? syntax error⟩
            "#]],
        );
    }

    #[test]
    fn a_deadline_that_does_not_count_is_said_to() {
        check(
            &robot(
                "deployment D {\n architecture A\n activity driver { priority = 2 period = 10 deadline = 100 }\n \
                 activity planner { priority = 1 period = 1000 deadline = 1000.0 }\n}",
                "codel.plan = 70\ncodel.drive = 9",
            ),
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨70 ms⟩
                core Driving(S) { update = { drive(); } }⟨9 ms⟩
                deployment D {⟨2 of 2 met at 1e-4⟩⟨CPU 1 nearly full (97.0 %)⟩
                activity driver { priority = 2 period = 10 deadline = 100 }⟨✓ 9 / 100 ms⟩
                activity planner { priority = 1 period = 1000 deadline = 1000.0 }⟨✓ 700 / 1000 ms⟩
            "#]],
        );
    }

    #[test]
    fn each_project_has_its_own_figures() {
        let parts = PARTS.replace("codel plan(): int\n", "");
        let deployment = "deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 20 }\n\
                          activity planner { priority = 1 period = 100 deadline = 100 } }";
        let root = |times: &str| format!("include \"shared.mal\"\ncodel plan(): int\n{times}");
        check(
            &format!(
                "//- /shared.mal\n{parts}{deployment}\n//- /one.mal\n{}\n//- /two.mal\n{}\n//- /mauve.toml\n[project]\n\
                 roots = [\"one.mal\", \"two.mal\"]\n[timing]\ntables = [\"times.toml\"]\n[platform]\nrt_throttling = false\n\
                 //- /times.toml\ncodel.drive = 17\ncodel.plan = 20\n",
                root(""),
                root("codel plan(): int\n"),
            ),
            expect![[r#"
                ⟨/one.mal⟩
                core Planning(S) { update = { plan(); } }⟨20 ms⟩
                core Driving(S) { update = { drive(); } }⟨17 ms⟩
                deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 20 }⟨2 of 2 met at 1e-4⟩⟨CPU 1 54.0 %⟩⟨✓ 17 / 20 ms⟩
                activity planner { priority = 1 period = 100 deadline = 100 } }⟨✓ 37 / 100 ms⟩
                ⟨/two.mal⟩
                core Driving(S) { update = { drive(); } }⟨17 ms⟩
                deployment D { architecture A activity driver { priority = 2 period = 50 deadline = 20 }⟨1 of 2 met, 1 not analysed⟩⟨CPU 1 ≥ 34.0 %⟩⟨✓ 17 / 20 ms⟩
                activity planner { priority = 1 period = 100 deadline = 100 } }⟨? error in Planning⟩
            "#]],
        );
    }

    /// A measured time is extrapolated at a level that no execution confirms, and at stricter ones.
    #[test]
    fn extrapolated_times_are_marked_at_their_levels() {
        let at = |level: &str, expected: Expect| {
            let model = "
codel plan(): int
shell S { }
core Planning(S) { update = { plan(); } }
component Planner(S, Planning)
architecture A { instance planner: Planner }
deployment D { architecture A
  activity planner { priority = 2 period = 100 deadline = 100 }
}
//- /times.toml
levels = [1e-3, 1e-4]
[codel]
plan = [5, 6]
[measured.plan]
executions = 6000
greatest = 4.5
times = [5, 6]
method = \"\"
date = 2026-11-23
samples = \"\"
files = []
bytes = 0
warnings = [\"extrapolated-from-1e-4\"]
//- /mauve.toml
timing.tables = [\"times.toml\"]
";
            check(&format!("{model}timing.significance = {level}\n"), expected);
        };
        at(
            "1e-3",
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨5 ms⟩
                deployment D { architecture A⟨1 of 1 met at 1e-3⟩⟨CPU 1 5.0 %⟩
                activity planner { priority = 2 period = 100 deadline = 100 }⟨✓ 5 / 100 ms⟩
            "#]],
        );
        at(
            "1e-4",
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨6 ms⟩
                deployment D { architecture A⟨1 of 1 met at 1e-4⟩⟨CPU 1 6.0 %⟩
                activity planner { priority = 2 period = 100 deadline = 100 }⟨✓ 6 / 100 ms · extrapolated⟩
            "#]],
        );
    }

    #[test]
    fn assumed_times_are_marked() {
        check(
            "
codel plan(): int
shell S { }
core Planning(S) { update = { plan(); } }
component Planner(S, Planning)
architecture A { instance planner: Planner }
deployment D { architecture A
  activity planner { priority = 2 period = 100 deadline = 100 }
}
//- /mauve.toml
[assume]
codel = \"5 ms\"
",
            expect![[r#"
                core Planning(S) { update = { plan(); } }⟨5 ms · assumed⟩
                deployment D { architecture A⟨1 of 1 met at 1e-4⟩⟨CPU 1 5.0 %⟩
                activity planner { priority = 2 period = 100 deadline = 100 }⟨✓ 5 / 100 ms · assumed⟩
            "#]],
        );
    }

    #[test]
    fn synchronised_clocks_are_said() {
        check(
            "
codel plan(): int
shell S { }
core K(S) { update = { plan(); } }
component C(S, K)
architecture A { instance first: C  instance second: C }
deployment D { architecture A
  activity first { priority = 2 period = 100 }
  activity second { priority = 1 period = 100 offset = 50 }
}
//- /mauve.toml
assume.codel = \"5 ms\"
platform.rt_throttling = false
clocks.synchronised = [\"first\", \"second\"]
",
            expect![[r#"
                core K(S) { update = { plan(); } }⟨5 ms · assumed⟩
                deployment D { architecture A⟨2 of 2 met at 1e-4⟩⟨CPU 1 10.0 %⟩
                activity first { priority = 2 period = 100 }⟨✓ 5 / 100 ms · assumed⟩
                activity second { priority = 1 period = 100 offset = 50 }⟨✓ 5 / 100 ms · assumed⟩
            "#]],
        );
    }

    const MACHINE: &str = "
/* 🦀 é */ codel plan(): int  codel look(): int
shell S { }
core C(S) {
  statemachine {
    initial state Waiting {
      transition go if (look() > 0) to Moving
    }
    state Moving { entry = { look(); }  run = {
        plan();
      } exit = { }  transition done to Waiting { look(); } }
    state Never { run = { plan(); } }
  }
}
core U(S) { update = { plan(); } }
component Pilot(S, C)  component Quick(S, U)  component Slow(S, U)
//- /mauve.toml
timing.tables = [\"t.toml\"]
//- /t.toml
codel.plan = 20
codel.look = 1
program.\"Quick/update\" = 5
";

    #[test]
    fn programs_states_and_transitions_have_their_times() {
        check(
            MACHINE,
            expect![[r#"
                initial state Waiting {⟨≤ 2 ms per period⟩
                transition go if (look() > 0) to Moving⟨≤ 2 ms per period⟩
                state Moving { entry = { look(); }  run = {⟨Moving: ≤ 21 ms per period⟩⟨entry: 1 ms⟩⟨run: 20 ms⟩
                } exit = { }  transition done to Waiting { look(); } }⟨≤ 21 ms per period⟩
                core U(S) { update = { plan(); } }⟨5 ms to 20 ms⟩
            "#]],
        );
        // Where the time of one component is unknown, nothing is said that may be taken for it.
        check(&MACHINE.replace("codel.plan = 20\n", ""), expect!["\n\n"]);
        let off = HintOptions { program_times: false, ..HintOptions::default() };
        check_kinds(MACHINE, off, expect!["\n\n"]);
    }

    const VALUES: &str = "
shell S { constant base: int = 2  property rate: int = base * 3  property name: string  property x: double = 1  property y: int = 1 }
core C(S) { update = { } }
component P(S, C)
architecture A {
  instance a: P
  instance b: P
  instance c: Unknown
  property a.rate = 4 + 4
  property b.name = \"é\"
}
deployment D {
  architecture A
  activity a { priority = 2 period = 10 }
  property a.rate = 9
  property b.rate = 6
  property b.x = 2
  property b.nothing = 2
}
";

    #[test]
    fn hints_show_the_values_of_properties_in_effect() {
        let only = HintOptions { values: true, ..NONE };
        check_kinds(
            VALUES,
            only,
            expect![[r#"
                instance a: P⟨rate = 8⟩
                instance b: P⟨name = "é"⟩
                property a.rate = 4 + 4⟨= 8⟩
                property a.rate = 9⟨overrides 8⟩
                property b.x = 2⟨overrides 1⟩
            "#]],
        );
        check_kinds(VALUES, HintOptions { values: false, ..only }, expect!["\n\n"]);
    }

    #[test]
    fn each_kind_can_be_left_out() {
        let text = robot(
            "deployment D {\n architecture A\n activity driver { priority = 2 period = 50 }\n \
             activity planner { priority = 1 period = 200 } }",
            "codel.plan = 70\ncodel.drive = 17",
        );

        check_kinds(&text, NONE, expect!["\n\n"]);
        check_kinds(
            &text,
            HintOptions { response_times: true, ..NONE },
            expect![[r#"
                deployment D {⟨2 of 2 met at 1e-4⟩
                activity driver { priority = 2 period = 50 }⟨✓ 17 / 50 ms⟩
                activity planner { priority = 1 period = 200 } }⟨✓ 121 / 200 ms⟩
            "#]],
        );
        check_kinds(
            &text,
            HintOptions { loads: true, ..NONE },
            expect![[r#"
            deployment D {⟨CPU 1 69.0 %⟩
        "#]],
        );
        // Where no CPU is known, there is no load, and no hint without words.
        let lost = text.replace("codel.plan = 70", "codel.plan = ");
        check_kinds(&lost, HintOptions { loads: true, ..NONE }, expect!["\n\n"]);
    }

    #[test]
    fn an_edit_of_another_file_builds_no_hints_again() {
        let deployment = "include \"parts.mal\"\ndeployment D { architecture A  \
            activity driver { priority = 2 period = 50 }  activity planner { priority = 1 period = 200 } }";
        let files = [
            ("/robot.mal".into(), deployment.to_owned()),
            ("/parts.mal".into(), PARTS.to_owned()),
            ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
            ("/times.toml".into(), "codel.plan = 70\ncodel.drive = 17".to_owned()),
        ];
        let mut db = mauve_hir::Database::with_log();
        let workspace = Workspace::of_texts(&db, "/".into(), files);
        let [file, parts] =
            ["/robot.mal", "/parts.mal"].map(|path| workspace.file(&db, path.as_ref()).unwrap());
        let all = TextRange::up_to(TextSize::of(deployment));
        let hash = |db: &mauve_hir::Database| {
            hash_of_hints(
                db,
                project_of(db, workspace, file),
                file,
                HintOptions::default(),
                &EarlierFigures::default(),
            )
        };
        let before = (
            hash(&db),
            inlay_hints(
                &db,
                project_of(&db, workspace, file),
                file,
                all,
                HintOptions::default(),
                &EarlierFigures::default(),
            ),
        );
        assert!(db.take_log().executed.iter().any(|query| query == "of_declaration"));
        for (from, to, is_same) in [
            ("shell S", "// a comment\nshell S", true),
            ("{ plan(); }", "{ plan(); if 1 > 2 then { } else { } }", true),
            ("{ plan(); }", "{ plan(); plan(); }", false),
        ] {
            parts.set_text(&mut db, PARTS.replace(from, to).into());
            assert_eq!(hash(&db) == before.0, is_same, "{to}");
            let hints = inlay_hints(
                &db,
                project_of(&db, workspace, file),
                file,
                all,
                HintOptions::default(),
                &EarlierFigures::default(),
            );
            assert_eq!(hints == before.1, is_same, "{to}");
            let executed = db.take_log().executed;
            let count = executed.iter().filter(|query| *query == "of_declaration").count();
            assert_eq!(count, usize::from(!is_same), "{to}: {executed:?}");
        }
    }

    #[test]
    fn an_edit_that_changes_no_time_builds_no_labels_again() {
        let text = "codel plan(in goal: int): int\nshell S { }\ncore K(S) { var goal: int = 0; statemachine {\n\
            initial state A { run = { goal = 1; goal = plan(goal); } } } }\ncomponent C(S, K)\n";
        let files = [
            ("/robot.mal".into(), text.to_owned()),
            ("/mauve.toml".into(), "timing.tables = [\"times.toml\"]".to_owned()),
            ("/times.toml".into(), "codel.plan = 70".to_owned()),
        ];
        let mut db = mauve_hir::Database::with_log();
        let workspace = Workspace::of_texts(&db, "/".into(), files);
        let file = workspace.file(&db, "/robot.mal".as_ref()).unwrap();
        let mut built = |text: String| {
            file.set_text(&mut db, text.into());
            hash_of_hints(
                &db,
                project_of(&db, workspace, file),
                file,
                HintOptions::default(),
                &EarlierFigures::default(),
            );
            db.take_log().executed.iter().filter(|query| *query == "labels_of").count()
        };
        assert_eq!(built(text.to_owned()), 1);
        assert_eq!(built(text.replace("goal = 1;", "goal = 2;")), 0);
        assert_eq!(built(text.replace("goal = 1;", "goal = plan(1);")), 1);
    }
}
