//! Timing tables: execution times by codel, program or component, one per significance level, in TOML.

pub(crate) mod error;
pub mod keys;
pub(crate) mod measured;
pub(crate) mod reader;
pub(crate) mod update;

use std::ops::Range;

use self::error::TableError;
use crate::{Level, Time};

/// A timing table, as it was read, and what is wrong with it.
///
/// ```
/// use mauve_timing::{Level, Table, Time};
///
/// let table = Table::parse(
///     r#"
///     unit = "ms"                          # ns us ms s; ms where it is left out
///     levels = [1e-3, 1e-4, 1e-5]          # none where every time holds at every level
///     [codel]
///     "navigation.astar" = [297, 297, 297]
///     navigation.dist = 1                  # the same as "navigation.dist"
///     [program]
///     "Hokuyo/update" = [40, 43, 44]
///     [component]
///     "Navigation" = 299
///     [wait]                               # in addition: time off the CPU, by the codel's own will
///     "drivers.imu_read" = { time = [0.8, 0.8, 0.9], waits = 1 }
///     [access]                             # reads and writes of ports
///     "Camera.frame" = 0.9
///     [overhead]
///     dispatch = 0
///     context_switch = 0
///     "#,
/// );
/// assert!(table.errors.is_empty());
/// let level = Level::from_f64(1e-4).expect("between 0 and 1");
/// let update = table.programs[0].value.as_ref().and_then(|times| table.time(times, level));
/// assert_eq!(update, Some(Time::from_nanos(43_000_000)));
/// ```
///
/// Times finer than a nanosecond round up. The value of an entry with an error is `None`, which is not the same as an entry
/// that is not there. A table with any error is incomplete: what is wrong may have swallowed other entries.
#[derive(Clone, PartialEq, Eq, Hash, Default, Debug)]
pub struct Table {
    /// The significance levels, in the order in which they are written; empty where every time holds at every level.
    pub levels: Vec<Level>,
    /// `[codel]`, in the order of the text.
    pub codels: Vec<Entry>,
    /// `[program]`: times of whole programs, which replace the sums of their codels.
    pub programs: Vec<Entry>,
    /// `[component]`: times of whole components, for the classic method only.
    pub components: Vec<Entry>,
    /// `[wait]`: by how much longer a call of a codel takes than it executes, in the order of the text.
    pub waits: Vec<Entry>,
    /// `[access]`: times of reads and writes of ports.
    pub accesses: Vec<Entry>,
    /// `[overhead]`, for each wake-up of a thread.
    pub overhead: Overhead,
    /// The bytes of the first key in it.
    pub overhead_span: Range<usize>,
    /// `[measured]`, in the order of the keys.
    pub measured: Vec<Measured>,
    /// What is wrong, in the order of the text.
    pub errors: Vec<TableError>,
    /// The table is unusable as a whole: text that is not understood may contain a time that would raise a bound.
    /// Results that depend on the table are not analysed.
    pub lost: bool,
}

/// A section of a timing table.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[allow(missing_docs, reason = "the names are those of the sections")]
pub enum TableSection {
    Codel,
    Program,
    Component,
    Wait,
    Access,
    Overhead,
}

impl TableSection {
    /// Returns its header.
    pub fn header(self) -> &'static str {
        match self {
            TableSection::Codel => "[codel]",
            TableSection::Program => "[program]",
            TableSection::Component => "[component]",
            TableSection::Wait => "[wait]",
            TableSection::Access => "[access]",
            TableSection::Overhead => "[overhead]",
        }
    }
}

/// One line of a table: `"navigation.astar" = [297, 297, 297]`.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Entry {
    /// The whole key: of `a.b = 1`, of `"a.b" = 1`, and of `b = 1` under `[codel.a]`, it is `a.b`.
    pub key: String,
    /// The bytes of the last part of the key as it is written, quotes included.
    pub key_span: Range<usize>,
    /// The parts that the key is written in, those of the header first, without that of the section: of `b = 1` under
    /// `[codel.a]`, `a` and `b`.
    pub key_parts: Vec<KeyPart>,
    /// The times; `None` where an error was reported at the entry or at the levels.
    pub value: Option<Times>,
    /// The bytes of the value.
    pub value_span: Range<usize>,
    /// Of a wait, how often a call waits at most; `None` if that is not written.
    pub waits: Option<u64>,
    /// Whether a comment behind the value begins with `assumed`: a measurement replaces it.
    pub is_assumed: bool,
}

/// A part of a dotted key or header; a quoted part may contain dots.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct KeyPart {
    /// Which bytes of [`Entry::key`] it is.
    pub of_key: Range<usize>,
    /// Where it is written, without its quotes.
    pub span: Range<usize>,
    /// Is it written as it is, without escapes?
    pub verbatim: bool,
}

impl Entry {
    /// Where these bytes of the key stand in the text; `None` where they are written with escapes, or in several parts.
    ///
    /// ```
    /// let text = "[codel.pose]  # of pose\n'filter.update' = 1";
    /// let entry = &mauve_timing::Table::parse(text).codels[0];
    /// assert_eq!(entry.key, "pose.filter.update");
    /// assert_eq!(entry.written(0..4), Some(7..11));
    /// assert_eq!(entry.written(12..18).map(|span| &text[span]), Some("update"));
    /// assert_eq!(entry.written(2..8), None);
    /// ```
    pub fn written(&self, bytes: Range<usize>) -> Option<Range<usize>> {
        let KeyPart { of_key, span, verbatim } = self
            .key_parts
            .iter()
            .find(|part| part.of_key.start <= bytes.start && bytes.end <= part.of_key.end)?;
        let start = span.start + (bytes.start - of_key.start);
        verbatim.then(|| start..start + bytes.len())
    }
}

/// An execution time, at every level or at each.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Times {
    /// One bound for every level.
    Always(Time),
    /// One for each of [`Table::levels`], in their order.
    PerLevel(Vec<Time>),
}

impl Times {
    /// Returns the time at `level`; `None` where the times are of other `levels`.
    pub fn at(&self, levels: &[Level], level: Level) -> Option<Time> {
        match self {
            Times::Always(time) => Some(*time),
            Times::PerLevel(times) => times.get(levels.iter().position(|&column| column == level)?).copied(),
        }
    }

    /// Returns the greatest time of all levels.
    pub fn greatest(&self) -> Time {
        match self {
            Times::Always(time) => *time,
            Times::PerLevel(times) => times.iter().copied().max().unwrap_or_default(),
        }
    }
}

impl Default for Times {
    fn default() -> Times {
        Times::Always(Time::ZERO)
    }
}

/// What the platform takes for each job, beside what the job executes.
#[derive(Clone, PartialEq, Eq, Hash, Default, Debug)]
pub struct Overhead {
    /// To dispatch it; 0 where it is left out.
    pub dispatch: Times,
    /// For one context switch (a job takes two); 0 where it is left out.
    pub context_switch: Times,
}

/// The record of one measured entry: `[measured."nav.astar"]`.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Measured {
    /// The key of the entry.
    pub key: String,
    /// The bytes of its first key.
    pub span: Range<usize>,
    /// How many executions were measured.
    pub executions: u64,
    /// The greatest of them, the high-water mark.
    pub greatest: Time,
    /// The measured bounds, one for each level. If the entry has other times, somebody edited it.
    pub times: Times,
    /// The method of the estimate.
    pub method: String,
    /// When, as a date in ISO 8601.
    pub date: String,
    /// The digest of the executions.
    pub samples: String,
    /// The sample files, relative to the table.
    pub files: Vec<String>,
    /// Their size together: it grows with each run.
    pub bytes: u64,
    /// The source of the codel, relative to the table; `None` if it was not found.
    pub source: Option<String>,
    /// The [`digest_of`](crate::digest_of) its content.
    pub source_digest: Option<String>,
    /// What is wrong with the measurement: kinds of warnings, that of [`EXTRAPOLATED`] with its level; or sentences in older tables.
    pub warnings: Vec<String>,
}

impl Measured {
    /// Returns whether a test rejected that executions are independent of earlier ones.
    pub fn is_dependent(&self) -> bool {
        // Older tables have a sentence: executions depend on earlier ones.
        self.warnings.iter().any(|it| it == DEPENDENT || it.contains("depend on"))
    }
}

/// The warning that the time of a level is that of a fitted tail, which no execution confirms. Records have it with the least strict
/// such level: `extrapolated-from-1e-4`.
pub const EXTRAPOLATED: &str = "extrapolated";

/// Returns the level of a warning `extrapolated-from-1e-4`; `None` for any other one. Times at this level and stricter ones are
/// extrapolated.
///
/// ```
/// assert_eq!(mauve_timing::extrapolated_from("extrapolated-from-1e-4"), Some(mauve_timing::Level::TEN_TO_MINUS_FOUR));
/// assert_eq!(mauve_timing::extrapolated_from("heavy-tail"), None);
/// ```
pub fn extrapolated_from(warning: &str) -> Option<Level> {
    Level::from_f64(warning.strip_prefix(EXTRAPOLATED)?.strip_prefix("-from-")?.parse().ok()?)
}

/// The warning of [`Measured::is_dependent`].
pub const DEPENDENT: &str = "dependent-executions";

/// Returns whether what follows a value says that it is assumed: ` # assumed: as on the last robot`.
fn is_assumption(after: &str) -> bool {
    let comment = after.lines().next().unwrap_or_default().trim_start().strip_prefix('#');
    let word = comment.map(|it| it.trim_start().split(|it: char| !it.is_alphanumeric()).next());
    word.flatten().is_some_and(|it| it.eq_ignore_ascii_case("assumed"))
}

impl Table {
    /// The time at `level`; `None` where `times` are of other levels.
    pub fn time(&self, times: &Times, level: Level) -> Option<Time> {
        times.at(&self.levels, level)
    }

    /// Whether every time of the table holds at `level`: it is one of `levels`, or no time depends on the level.
    pub fn covers(&self, level: Level) -> bool {
        self.levels.contains(&level) || !self.depends_on_level()
    }

    /// Whether any time of the table depends on the level.
    pub fn depends_on_level(&self) -> bool {
        self.times().any(|times| matches!(times, Times::PerLevel(_)))
    }

    /// Returns the sections with times, each with its entries.
    pub fn sections(&self) -> [(TableSection, &Vec<Entry>); 5] {
        [
            (TableSection::Codel, &self.codels),
            (TableSection::Program, &self.programs),
            (TableSection::Component, &self.components),
            (TableSection::Wait, &self.waits),
            (TableSection::Access, &self.accesses),
        ]
    }

    /// Returns the entries of all sections with times.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.sections().into_iter().flat_map(|(_, entries)| entries)
    }

    fn entries_mut(&mut self) -> impl Iterator<Item = &mut Entry> {
        let Table { codels, programs, components, waits, accesses, .. } = self;
        [codels, programs, components, waits, accesses].into_iter().flatten()
    }

    fn times(&self) -> impl Iterator<Item = &Times> {
        let overhead = [&self.overhead.dispatch, &self.overhead.context_switch];
        self.entries().filter_map(|entry| entry.value.as_ref()).chain(overhead)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MOST_LEVELS, TableErrorKind};
    use expect_test::{Expect, expect};
    use proptest::prelude::*;

    fn check(text: &str, expected: Expect) {
        let table = Table::parse(text);
        let mut found = String::new();
        for level in &table.levels {
            found.push_str(&format!("level {level}\n"));
        }
        for (section, entries) in &table.sections()[..3] {
            let name = section.header().trim_matches(['[', ']']);
            for entry in *entries {
                let times = match &entry.value {
                    None => "error".to_owned(),
                    Some(Times::Always(time)) => time.to_string(),
                    Some(Times::PerLevel(times)) => {
                        times.iter().map(Time::to_string).collect::<Vec<_>>().join(", ")
                    }
                };
                found.push_str(&format!(
                    "{name} {} {:?}: {times} {:?}\n",
                    entry.key,
                    &text[entry.key_span.clone()],
                    &text[entry.value_span.clone()]
                ));
            }
        }
        if table.overhead != Overhead::default() {
            found.push_str(&format!("{:?}\n", table.overhead));
        }
        for error in &table.errors {
            found.push_str(&format!("error at {:?}: {:?}\n", &text[error.span.clone()], error.kind));
        }
        if table.lost {
            found.push_str("lost\n");
        }
        expected.assert_eq(&found);
    }

    #[test]
    fn keys_and_times() {
        check(
            r#"
levels = [1e-3, 1e-4]
[codel]
"navigation.astar" = [297, 297.5]
navigation.dist = 1
loop = 0.0000001
[codel.pose.filter]
update = 0x10
[program]
"Hokuyo/update" = [40, 1_000]
[component]
Navigation = 2.5e2
[overhead]
context_switch = 0.002
"#,
            expect![[r#"
                level 1e-3
                level 1e-4
                codel navigation.astar "\"navigation.astar\"": 297 ms, 297.5 ms "[297, 297.5]"
                codel navigation.dist "dist": 1 ms "1"
                codel loop "loop": 0.000001 ms "0.0000001"
                codel pose.filter.update "update": 16 ms "0x10"
                program Hokuyo/update "\"Hokuyo/update\"": 40 ms, 1000 ms "[40, 1_000]"
                component Navigation "Navigation": 250 ms "2.5e2"
                Overhead { dispatch: Always(Time(0)), context_switch: Always(Time(2000)) }
            "#]],
        );
    }

    /// The parts of each key as they are written, each with its line and what it is of the key.
    fn check_parts(text: &str, expected: Expect) {
        let table = Table::parse(text);
        let mut found = String::new();
        for entry in table.codels.iter().chain(&table.programs) {
            let parts = entry.key_parts.iter().map(|KeyPart { of_key, span, verbatim }| {
                let line = text[..span.start].matches('\n').count() + 1;
                let escaped = if *verbatim { "" } else { " escaped" };
                assert_eq!(entry.written(of_key.clone()), verbatim.then(|| span.clone()));
                format!("{line}:{} = {}{escaped}", &text[span.clone()], &entry.key[of_key.clone()])
            });
            found += &(parts.collect::<Vec<_>>().join("  ") + "\n");
        }
        expected.assert_eq(&found);
    }

    #[test]
    fn every_part_of_a_key_has_its_own_place() {
        check_parts(
            "[codel.parts]  # of parts\nshoot = 1 # parts.shoot = 2\nwipe = [\n[1],\n]\nl . 'g h' = 1\nl.\"f\\u0041\".i = 1\n\
             [codel.parts.more] # parts\na = 1\n\"b.c\" = { d = 1, e.f = { g = 2 } }\nh = 1\n[codel.'pa.rts'.x]\n[ program ]\n\"A/Idle\".run = 1",
            expect![[r#"
                1:parts = parts  2:shoot = shoot
                1:parts = parts  3:wipe = wipe
                1:parts = parts  6:l = l  6:g h = g h
                1:parts = parts  7:l = l  7:f\u0041 = fA escaped  7:i = i
                8:parts = parts  8:more = more  9:a = a
                8:parts = parts  8:more = more  10:b.c = b.c  10:d = d
                8:parts = parts  8:more = more  10:b.c = b.c  10:e = e  10:f = f  10:g = g
                8:parts = parts  8:more = more  11:h = h
                12:pa.rts = pa.rts  12:x = x
                14:A/Idle = A/Idle  14:run = run
            "#]],
        );
        check_parts(
            "codel = { a = { b = 1 }, c . d = 1 }\nprogram.\"A/u\" = 3",
            expect![[r#"
                1:a = a  1:b = b
                1:c = c  1:d = d
                2:A/u = A/u
            "#]],
        );
        // `""` is a part as every other: neither is a time of `a`, nor of `b`.
        check_parts(
            "[codel]\n\"\".a = 1\n[program.\"\"]\nb = 1\n",
            expect![[r#"
                2: =   2:a = a
                3: =   4:b = b
            "#]],
        );
        assert_eq!(Table::parse("[codel]\n\"\".a = 1").codels[0].key, ".a");
        // Not TOML: the same key is recovered from it.
        check_parts(
            "[codel]\n.a = 1\n",
            expect![[r#"
                2: =   2:a = a
            "#]],
        );
    }

    #[test]
    fn one_wrong_entry_is_lost_alone() {
        check(
            r#"
unit = "us"
levels = [1e-3, 1e-4, 1e-5]
[codel]
a = [1, 2]
b = -1
c = inf
d = nan
e = 1e40
f = "5 ms"
g = [1, -2, true]
h = [[1], 2, 3]
i = true
j = []
k = 99999999999999999999999999
l = 0xfffffffffffffffffffff
ok = 1
"#,
            expect![[r#"
                level 1e-3
                level 1e-4
                level 1e-5
                codel a "a": error "[1, 2]"
                codel b "b": error "-1"
                codel c "c": error "inf"
                codel d "d": error "nan"
                codel e "e": error "1e40"
                codel f "f": error "\"5 ms\""
                codel g "g": error "[1, -2, true]"
                codel h "h": error "[[1], 2, 3]"
                codel i "i": error "true"
                codel j "j": error "[]"
                codel k "k": error "99999999999999999999999999"
                codel l "l": error "0xfffffffffffffffffffff"
                codel ok "ok": 0.001 ms "1"
                error at "[1, 2]": OtherCount { times: 2, levels: 3 }
                error at "-1": InvalidTime { text: "-1", unit: Microseconds, error: Negative }
                error at "inf": InvalidTime { text: "inf", unit: Microseconds, error: NotANumber }
                error at "nan": InvalidTime { text: "nan", unit: Microseconds, error: NotANumber }
                error at "1e40": InvalidTime { text: "1e40", unit: Microseconds, error: TooLarge }
                error at "\"5 ms\"": TimeWithUnit { text: "5 ms", unit: Microseconds }
                error at "-2": InvalidTime { text: "-2", unit: Microseconds, error: Negative }
                error at "true": TimeOfKind { found: Boolean, unit: Microseconds }
                error at "[1]": TimeOfKind { found: Array, unit: Microseconds }
                error at "true": TimeOfKind { found: Boolean, unit: Microseconds }
                error at "[]": OtherCount { times: 0, levels: 3 }
                error at "99999999999999999999999999": InvalidTime { text: "99999999999999999999999999", unit: Microseconds, error: TooLarge }
                error at "0xfffffffffffffffffffff": InvalidTime { text: "0xfffffffffffffffffffff", unit: Microseconds, error: TooLarge }
            "#]],
        );
    }

    #[test]
    fn times_do_not_fall() {
        check(
            "levels = [1e-3, 1e-4, 1e-5]\n[codel]\na = [1, 2, 3]\nb = [60, 7, 90]\nc = [2, 2, 2]\n",
            expect![[r#"
                level 1e-3
                level 1e-4
                level 1e-5
                codel a "a": 1 ms, 2 ms, 3 ms "[1, 2, 3]"
                codel b "b": error "[60, 7, 90]"
                codel c "c": 2 ms, 2 ms, 2 ms "[2, 2, 2]"
                error at "[60, 7, 90]": FallingTime { key: "b", before: (Time(60000000), Level { bits: 4562254508917369340 }), after: (Time(7000000), Level { bits: 4547007122018943789 }) }
            "#]],
        );
        check(
            "levels = [1e-5, 1e-4, 1e-3]\n[codel]\na = [1, 2, 3]\n[program]\n\"B/u\" = [1, 1, 2]\n\"C/u\" = [1, 1, 1]\n",
            expect![[r#"
                level 1e-5
                level 1e-4
                level 1e-3
                codel a "a": error "[1, 2, 3]"
                program B/u "\"B/u\"": error "[1, 1, 2]"
                program C/u "\"C/u\"": 1 ms, 1 ms, 1 ms "[1, 1, 1]"
                error at "[1e-5, 1e-4, 1e-3]": AllFalling
                lost
            "#]],
        );
        let overhead = Table::parse("levels = [1e-3, 1e-4]\n[overhead]\ndispatch = [9, 1]\n");
        assert!(overhead.lost && overhead.errors.len() == 1);
        // In any order, as long as that of the times is the same.
        assert_eq!(Table::parse("levels = [1e-5, 1e-3]\n[codel]\na = [3, 1]\nb = [4, 1]\n").errors, []);
    }

    #[test]
    fn times_that_fall_in_some_entries() {
        // One alone, and two of three that vary.
        check(
            "levels = [1e-3, 1e-4]\n[codel]\na = [2, 1]\n",
            expect![[r#"
            level 1e-3
            level 1e-4
            codel a "a": error "[2, 1]"
            error at "[2, 1]": FallingTime { key: "a", before: (Time(2000000), Level { bits: 4562254508917369340 }), after: (Time(1000000), Level { bits: 4547007122018943789 }) }
        "#]],
        );
        check(
            "levels = [1e-3, 1e-4, 1e-5]\n[codel]\na = [3, 2, 2]\nb = [3, 2, 2]\nc = [1, 2, 3]\n",
            expect![[r#"
                level 1e-3
                level 1e-4
                level 1e-5
                codel a "a": error "[3, 2, 2]"
                codel b "b": error "[3, 2, 2]"
                codel c "c": 1 ms, 2 ms, 3 ms "[1, 2, 3]"
                error at "[3, 2, 2]": FallingTime { key: "a", before: (Time(3000000), Level { bits: 4562254508917369340 }), after: (Time(2000000), Level { bits: 4547007122018943789 }) }
                error at "[3, 2, 2]": FallingTime { key: "b", before: (Time(3000000), Level { bits: 4562254508917369340 }), after: (Time(2000000), Level { bits: 4547007122018943789 }) }
            "#]],
        );
    }

    #[test]
    fn levels_between_0_and_1() {
        check(
            "levels = [0, 1, 1e-3, 1.0, \"1e-4\"]\n",
            expect![[r#"
            error at "0": NotALevel
            error at "1": NotALevel
            error at "1.0": NotALevel
            error at "\"1e-4\"": NotALevel
            lost
        "#]],
        );
        let levels = |number: u32| {
            let levels: Vec<String> = (0..number).map(|level| format!("1e-{}", level + 1)).collect();
            Table::parse(&format!("levels = [{}]\n", levels.join(", ")))
        };
        let most = MOST_LEVELS as u32;
        assert_eq!((levels(most).levels.len(), levels(most).errors.len()), (MOST_LEVELS, 0));
        let errors = levels(most + 1).errors;
        assert_eq!(
            errors.into_iter().map(|error| error.kind).collect::<Vec<_>>(),
            [TableErrorKind::TooManyLevels(65)]
        );
    }

    #[test]
    fn values_that_are_no_time() {
        check(
            "a = 1\nb = 2.5\nc = \"5 ms\"\n[codel]\nd = 1\n",
            expect![[r#"
            codel d "d": 1 ms "1"
            error at "a": NoSection("a")
            error at "c": UnknownKey("c")
            lost
        "#]],
        );
        check(
            "[codel]\na = {}\nb = \"5 ms\"\nc = \"fast\"\nd = true\n[codel.e]\n",
            expect![[r#"
            codel a "a": error "{}"
            codel b "b": error "\"5 ms\""
            codel c "c": error "\"fast\""
            codel d "d": error "true"
            codel e "e": error "[codel.e]"
            error at "a": NoTime("a")
            error at "\"5 ms\"": TimeWithUnit { text: "5 ms", unit: Milliseconds }
            error at "\"fast\"": TimeOfKind { found: String, unit: Milliseconds }
            error at "true": TimeOfKind { found: Boolean, unit: Milliseconds }
            error at "e": NoTime("e")
        "#]],
        );
    }

    #[test]
    fn arrays_need_levels() {
        check(
            "[codel]\na = [1]\nb = 2\nc = [3]\n",
            expect![[r#"
                codel a "a": error "[1]"
                codel b "b": 2 ms "2"
                codel c "c": error "[3]"
                error at "[1]": NoLevels { times: 1 }
            "#]],
        );
    }

    #[test]
    fn the_same_key_in_two_spellings() {
        check(
            "[codel]\n\"a.b\" = 1\na.b = 2\na.c = 3\n[program]\n\"a.b\" = 4\n",
            expect![[r#"
                codel a.b "\"a.b\"": error "1"
                codel a.b "b": error "2"
                codel a.c "c": 3 ms "3"
                program a.b "\"a.b\"": 4 ms "4"
                error at "b": RepeatedKey("a.b")
            "#]],
        );
    }

    #[test]
    fn nothing_that_looks_like_an_entry_is_dropped() {
        for text in [
            "[codel]\na = 1\n[[program]]\n\"C/update\" = 50\n",
            "program = 5\n[codel]\na = 1\n",
            "overhead = 7\n[codel]\na = 1\n",
            "[codel]\na = 1\n[[overhead]]\ndispatch = 5\n",
            "[codel]\na = 1\nunit = \"s\"\n",
            "[codel]\na = 1\nlevels = [1e-3]\n",
            "[codel.a]\nunit = \"s\"\nb = 1\n",
            "[codel]\na.unit = \"s\"\na.b = 1\n",
            "[codel]\n\"a.unit\" = \"s\"\n",
            "[codel.a]\nlevels = [1e-3]\nb = 1\n",
            "[codel]\na = [1, 2]\n[overhead]\ndispatch = [5, 6]\n",
        ] {
            let table = Table::parse(text);
            assert!(table.lost && table.errors.len() == 1, "{text}: {:?}", table.errors);
        }
        for text in ["[program]\n\"C/update\" = {}\n", "[program.\"C/update\"]\n# 50\n"] {
            let table = Table::parse(text);
            assert_eq!(table.programs.len(), 1, "{text}");
            assert!(
                table.programs[0].value.is_none() && table.errors.len() == 1,
                "{text}: {:?}",
                table.errors
            );
        }
    }

    #[test]
    fn what_loses_the_whole_table() {
        check(
            "[codel]\na = 1\n[programs]\nx = 40\n",
            expect![[r#"
                codel a "a": 1 ms "1"
                error at "programs": UnknownKey("programs")
                lost
            "#]],
        );
        check(
            "[codel]\na = 1\nb = [1,\n[program]\n\"H/u\" = 40\n",
            expect![[r#"
                codel a "a": 1 ms "1"
                codel b "b": error "[1,\n[program]\n\"H/u\" = 40"
                error at "program": NotToml("string values must be quoted, expected literal string")
                lost
            "#]],
        );
        check(
            "[codel]\na = 1\na = 2\n",
            expect![[r#"
                codel a "a": 1 ms "1"
                error at "a": NotToml("duplicate key")
                lost
            "#]],
        );
        check(
            "unit = \"min\"\n",
            expect![[r#"
                error at "\"min\"": UnknownUnit("min")
                lost
            "#]],
        );
        check(
            "unit = 5\n",
            expect![[r#"
                error at "5": UnitOfKind(Number)
                lost
            "#]],
        );
        check(
            "levels = [1e-3, 1e-3]\n[codel]\na = [1, 2]\nb = [1]\n",
            expect![[r#"
                codel a "a": error "[1, 2]"
                codel b "b": error "[1]"
                error at "1e-3": RepeatedLevel(Level { bits: 4562254508917369340 })
                lost
            "#]],
        );
        check(
            "levels = [0, 1, 2.0, nan, \"1e-3\", 1e-400]\n",
            expect![[r#"
                error at "0": NotALevel
                error at "1": NotALevel
                error at "2.0": NotALevel
                error at "nan": NotALevel
                error at "\"1e-3\"": NotALevel
                error at "1e-400": NotALevel
                lost
            "#]],
        );
        check(
            "levels = 1e-3\n",
            expect![[r#"
                error at "1e-3": LevelsOfKind(Number)
                lost
            "#]],
        );
        check(
            "[overhead]\ndispatch = -1\n",
            expect![[r#"
                error at "-1": InvalidTime { text: "-1", unit: Milliseconds, error: Negative }
                lost
            "#]],
        );
        check(
            "[overhead]\nswitch = 1\n",
            expect![[r#"
                error at "switch": UnknownOverhead("switch")
                lost
            "#]],
        );
        check(
            "codel = 1\n[[program]]\na = 1\n",
            expect![[r#"
                error at "1": NotASection { name: "codel", found: Number }
                error at "[[program]]": NotASection { name: "program", found: Array }
                lost
            "#]],
        );
    }

    #[test]
    fn levels_are_never_interpolated() {
        let table = Table::parse("levels = [1e-3, 1e-5]\n[codel]\na = [1, 2]\nb = 3\n");
        let level = |probability| Level::from_f64(probability).unwrap();
        let time = |entry: usize, probability| {
            let times = table.codels[entry].value.as_ref().unwrap();
            table.time(times, level(probability)).map(|time| time.to_string())
        };
        assert_eq!(time(0, 1e-5).as_deref(), Some("2 ms"));
        assert_eq!(time(0, 1e-4), None);
        assert_eq!(time(1, 1e-4).as_deref(), Some("3 ms"));
        assert!(table.covers(level(1e-3)) && !table.covers(level(1e-4)));
        assert!(Table::parse("[codel]\na = 1\n").covers(level(1e-4)));
        assert!(Table::parse("levels = [1e-3]\n[codel]\na = 1\n").covers(level(1e-4)));
    }

    #[test]
    fn levels_are_ordered_and_shown_by_their_value() {
        let level = |probability| Level::from_f64(probability).unwrap();
        assert!(level(1e-9) < level(1e-3));
        assert_eq!(level(1e-4).to_string(), "1e-4");
        assert_eq!(level(0.0025).to_string(), "2.5e-3");
        assert_eq!(Level::from_f64(0.0), None);
        assert_eq!(Level::from_f64(1.0), None);
        assert_eq!(Level::from_f64(f64::NAN), None);
    }

    proptest! {
        #[test]
        fn no_text_fails(text in "(unit|levels|codel|program|\\[codel.a\\]\n|a = 1\n|a|\\[|\\]|=|\"|[.,#0-9e\n-]|\\PC){0,40}") {
            let table = Table::parse(&text);
            for error in &table.errors {
                prop_assert!(text.get(error.span.clone()).is_some());
            }
            for entry in table.codels.iter().chain(&table.programs) {
                let parts: Vec<&str> = entry.key_parts.iter().map(|part| &entry.key[part.of_key.clone()]).collect();
                // A key without `=` is no TOML: its parts are unknown.
                prop_assert!(parts.join(".") == entry.key || parts.is_empty() && table.lost);
                for part in entry.key_parts.iter().filter(|part| part.verbatim) {
                    prop_assert_eq!(text.get(part.span.clone()), entry.key.get(part.of_key.clone()));
                }
            }
        }
    }
}
