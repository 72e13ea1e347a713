//! Figures of a deployment with other values, such as `imu.period = 5` or `nav.plan = 12ms`. The files stay as they are.
//!
//! The values become edits of the texts, in a database of their own. So the figures are those of the changed texts, and a value that
//! a text cannot have is refused for the same reason.
//!
//! [`edit_of_fields`] writes values of activities: for what-if questions, code actions and `mauve tune` alike.

use std::collections::BTreeMap;
use std::path::Path;

use mauve_diagnostics::{declaration_diagnostics, time_error_message};
use mauve_hir::item_tree::{Field, Kind, Name};
use mauve_hir::ros2_files::{EditRefusal, ThreadChange, ThreadPlace, ThreadPolicy, YamlEdit, change_thread};
use mauve_hir::{
    ACTIVITY_FIELDS, Database, Decl, FieldKind, File, Location, ModelDb, PLACES, Project, config_file,
    deployment, field_entry, names_of, parse, projects, same_fields, similar, similar_field,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::keywords::ActivityField;
use mauve_syntax::{SyntaxKind, TextRange, TextSize};
use mauve_timing::{CpuSet, Rounding, Time, with_time};
use mauve_wcrt::{
    DeclaredThread, TableSet, Timed, WhatIfField, declared_threads, executed_times, file_name, files_of,
    in_threads, system_of,
};
use rustc_hash::FxHashSet;

use crate::cancellation::until_cancelled;
use crate::change::Change;
use crate::comparison::{Comparison, Figures};
use crate::occurrences::range_of;
use crate::project::DeploymentAt;

/// Another value of a field of an activity, or of an execution time.
#[derive(Debug, Clone, PartialEq, Eq)]
enum WhatIfSetting<'db> {
    Field(WhatIfField),
    Time { key: String, time: Time, tables: Vec<TableSet<'db>> },
}

/// Returns the figures of a deployment as it is, beside those with other values: each as `INSTANCE.FIELD=VALUE` or `KEY=TIME`, where
/// the key is that of a timing table.
///
/// # Errors
///
/// What is wrong with a value, and what to write.
///
/// ```
/// use mauve_hir::{Database, Workspace, names_of, projects, item_tree::Kind};
/// use mauve_wcrt::Query;
/// let db = Database::default();
/// let model = "shell S { } codel look(): int core K(S) { update = { look(); } } component C(S, K)
///     architecture A { instance eye: C }
///     deployment D { architecture A activity eye { priority = 1 period = 10 } }";
/// let files = [("/m.mal", model), ("/mauve.toml", "timing.tables = [\"t.toml\"]"), ("/t.toml", "codel.look = 4")];
/// let files = files.map(|(path, text)| (path.into(), text.to_owned()));
/// let project = projects(&db, Workspace::of_texts(&db, "/".into(), files))[0];
/// let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
/// let query = Query::shown(&db, project, deployment);
/// let values = ["look=6ms".to_owned(), "eye.period = 8".to_owned()];
/// let found = mauve_ide::what_if(&db, (project, deployment, query), &values).unwrap();
/// assert_eq!(found.activities[0].shown(), ["✓ 4 / 10 ms", "✓ 6 / 8 ms"]);
/// ```
pub fn what_if<'db>(
    db: &'db dyn ModelDb,
    at: DeploymentAt<'db>,
    values: &[String],
) -> Result<Comparison, String> {
    let with = |values: &[String]| compared(db, at, &what_if_change(db, at, values)?);
    with(values).map_err(|why| {
        // Which value it is, where one alone is refused for the same reason.
        let alone = values.iter().find(|it| with(std::slice::from_ref(it)).as_ref() == Err(&why));
        let subject = |it: &String| it.split('=').next().is_some_and(|it| why.contains(it.trim()));
        match alone.filter(|it| !subject(it)) {
            Some(value) => format!("`{value}`: {why}"),
            None => why,
        }
    })
}

/// Returns the edits that write the values of [`what_if`].
///
/// # Errors
///
/// What is wrong with a value, and what to write.
pub fn what_if_change<'db>(
    db: &'db dyn ModelDb,
    at: DeploymentAt<'db>,
    values: &[String],
) -> Result<Change, String> {
    let (project, of, _) = at;
    let mut fields: Vec<WhatIfField> = Vec::new();
    let mut times: FxHashSet<String> = FxHashSet::default();
    let mut texts: BTreeMap<&Path, (File, String)> = BTreeMap::new();
    for value in values {
        let is_new = match setting(db, at, value)? {
            WhatIfSetting::Field(new) => {
                let is_same = |it: &WhatIfField| same_fields(&it.field) == same_fields(&new.field);
                let is_new = !fields.iter().any(|it| it.instance == new.instance && is_same(it));
                fields.push(new);
                is_new
            }
            WhatIfSetting::Time { key, time, tables } => {
                for tables in tables {
                    write_time(db, project, &mut texts, (&key, time), tables)?;
                }
                times.insert(key)
            }
        };
        if !is_new {
            return Err(format!("`{value}`: there is another value for the same"));
        }
    }
    let mut change = edit_of_fields(db, project, of, &fields)?;
    for (file, text) in texts.into_values() {
        change.replace(file, difference(file.text(db), &text));
    }
    Ok(change)
}

/// Writes a time into the tables that have its key; if none has it, into the first one.
fn write_time<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    texts: &mut BTreeMap<&'db Path, (File, String)>,
    (key, time): (&str, Time),
    tables: TableSet<'db>,
) -> Result<(), String> {
    let files = files_of(db, tables);
    let first = files.first().ok_or_else(|| {
        let key = key.trim_start_matches("(access) ");
        match config_file(db, project.workspace(db)) {
            Some(_) => format!("`{key}`: {} of mauve.toml names no timing table", tables.header(db)),
            None => format!("`{key}`: there is no mauve.toml that names a timing table"),
        }
    })?;
    let mut write = |file: File, is_added: bool| {
        let known = texts.get(file.path(db).as_path());
        let text = known.map_or_else(|| file.text(db).as_ref(), |(_, text)| text.as_str());
        let new = with_time(text, key, time, is_added);
        let is_written = new.is_some();
        texts.extend(new.map(|new| (file.path(db).as_path(), (file, new))));
        is_written
    };
    let written = files.iter().filter(|file| write(**file, false)).count();
    if written == 0 {
        write(*first, true);
    }
    Ok(())
}

/// Returns the figures of a deployment as it is, beside those after a change of texts.
///
/// # Errors
///
/// The message of an error that the deployment has then, and does not have now.
pub fn compared<'db>(
    db: &'db dyn ModelDb,
    (project, of, query): DeploymentAt<'db>,
    change: &Change,
) -> Result<Comparison, String> {
    let before = Figures::of(db, project, of, query);
    let (scratch, pairs) = change.scratch(db, &[project.workspace(db)]);
    let Some(&(_, workspace)) = pairs.first() else {
        return Ok(Comparison::of(Some(before.clone()), Some(before)));
    };
    let (root, name) = (project.root(db).path(db), of.qualified(db));
    let known: Vec<String> =
        declaration_diagnostics(db, project, of).iter().map(|it| it.message.clone()).collect();
    let after = until_cancelled(db, scratch, |scratch: &Database| {
        let same = projects(scratch, workspace).iter().find(|it| it.root(scratch).path(scratch) == root);
        let found = same.and_then(|project| {
            let mut all = names_of(scratch, *project).of_kind(scratch, Kind::Deployment);
            Some((*project, all.find(|it| it.qualified(scratch) == name)?))
        });
        let Some((project, of)) = found else { return Ok(None) };
        // What the text cannot have is an error in it: the first one says why.
        let is_new = |it: &&std::sync::Arc<mauve_diagnostics::Diagnostic<'_>>| {
            it.code.is_of_text() && !known.contains(&it.message)
        };
        match declaration_diagnostics(scratch, project, of).iter().find(is_new) {
            Some(error) => Err(error.message.clone()),
            None => Ok(Some(Figures::of(scratch, project, of, query))),
        }
    });
    Ok(Comparison::of(Some(before), after?))
}

/// Reads one value.
fn setting<'db>(
    db: &'db dyn ModelDb,
    (project, of, query): DeploymentAt<'db>,
    text: &str,
) -> Result<WhatIfSetting<'db>, String> {
    let wrong = || {
        format!(
            "`{text}`: expected INSTANCE.FIELD=VALUE or CODEL=TIME, such as imu.period=5 or nav.plan=12ms"
        )
    };
    let (subject, value) = text.split_once('=').ok_or_else(wrong)?;
    let (subject, value) = (subject.trim(), value.trim());
    let is_plain = |letter: char| letter.is_alphanumeric() || " .,[]_/-+µ".contains(letter);
    if subject.is_empty() || value.is_empty() || !value.chars().all(is_plain) {
        return Err(wrong());
    }
    let activities = deployment(db, of).map_or(&[][..], |it| &it.activities);
    if let Some((instance, field)) = subject.rsplit_once('.')
        && activities.iter().any(|it| it.executes(instance))
        && let Some(field) = ActivityField::from_keyword(field)
    {
        let value = field_value(field, value).map_err(|why| format!("`{text}`: {why}"))?;
        return Ok(WhatIfSetting::Field(WhatIfField {
            instance: instance.into(),
            field,
            value: value.as_str().into(),
        }));
    }
    let times = executed_times(db, project, of, query.level);
    let key = |of: &Timed<'db>| match of {
        Timed::Access(..) | Timed::Topic(_) => format!("(access) {}", of.key(db)),
        _ => of.key(db),
    };
    // A key may lack the library, if only one fits.
    let is_it = |it: &&mauve_wcrt::ExecutedTime<'db>| it.of.key(db) == subject;
    let ends = format!(".{subject}");
    let mut without_library = times.iter().filter(|it| it.of.key(db).ends_with(&ends));
    let found = times.iter().find(is_it).or_else(|| {
        let first = without_library.next();
        first.filter(|_| without_library.next().is_none())
    });
    if let Some(found) = found {
        let time = Time::parse_with_unit(value, Rounding::Up).map_err(|error| {
            format!("`{text}`: a time needs its unit, as in 12ms: {}", time_error_message(error))
        })?;
        return Ok(WhatIfSetting::Time { key: key(&found.of), time, tables: found.tables.clone() });
    }
    let fields = activities.iter().flat_map(|it| &it.instances).flat_map(|instance| {
        ActivityField::ALL.iter().map(|field| format!("{}.{}", instance.name, field.keyword()))
    });
    let keys = times.iter().map(|it| it.of.key(db));
    let names: Vec<Name> = keys.chain(fields).map(Name::from).collect();
    let other_name = subject.rsplit_once('.').and_then(|(instance, field)| {
        let is_instance = activities.iter().any(|it| it.executes(instance));
        let near = similar_field(field).filter(|_| is_instance)?;
        Some(Name::from(format!("{instance}.{}", near.keyword()).as_str()))
    });
    let near = other_name.or_else(|| similar(subject, &names));
    let near = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    let name = of.name(db);
    Err(format!("`{subject}` is neither a field of an activity of {name} nor a time that it executes{near}"))
}

/// Returns a value as the text of a model has it: times in milliseconds, CPUs as a list.
fn field_value(field: ActivityField, value: &str) -> Result<String, String> {
    match field_entry(field).kind {
        FieldKind::Time | FieldKind::PositiveTime if value.ends_with(char::is_alphabetic) => {
            let rounding = if field == ActivityField::Jitter { Rounding::Up } else { Rounding::Down };
            Ok(Time::parse_with_unit(value, rounding).map_err(time_error_message)?.number())
        }
        FieldKind::CpuList if value.starts_with(|it: char| it.is_ascii_digit()) => Ok(format!("[{value}]")),
        _ => Ok(value.to_owned()),
    }
}

/// Returns the smallest replacement that makes the one text of the other: an editor keeps its cursors elsewhere.
fn difference(old: &str, new: &str) -> Replacement {
    let same = |(a, b): &(char, char)| a == b;
    let length = |it: (char, char)| it.0.len_utf8();
    let start: usize = old.chars().zip(new.chars()).take_while(same).map(length).sum();
    let [rest, new] = [old, new].map(|it| it.get(start..).unwrap_or_default());
    let end: usize = rest.chars().rev().zip(new.chars().rev()).take_while(same).map(length).sum();
    let to = |text: &str| text.len() - end;
    let offset = |at: usize| TextSize::try_from(at).unwrap_or_default();
    Replacement {
        range: TextRange::new(offset(start), offset(start + to(rest))),
        text: new.get(..to(new)).unwrap_or_default().to_owned(),
    }
}

/// Returns the edit that writes these values of activities: each in the place of the present one. A missing field stands where it
/// usually does among the others: `affinity`, `priority`, `period`. Priorities and CPUs of threads of `[platform] threads` stand in their
/// files.
///
/// # Errors
///
/// Why a file of threads cannot have a value.
pub fn edit_of_fields<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    fields: &[WhatIfField],
) -> Result<Change, String> {
    let mut change = Change::default();
    let Some(data) = deployment(db, of) else { return Ok(change) };
    let declared = declared_threads(db, project.workspace(db));
    let thread_of = |instance: &Name| {
        let activities = &system_of(db, project, of).activities;
        let activity = activities.iter().find(|it| it.instance == *instance)?;
        declared.all.get(activity.declared_thread?.0)
    };
    let mut of_threads: BTreeMap<(&Path, ThreadPlace), (&DeclaredThread, ThreadChange)> = BTreeMap::new();
    let place = |id| Location::Source(of, id);
    let has = |all: &[Field], field: ActivityField| all.iter().any(|it| it.name.name == field.keyword());
    let any_has = |field| data.activities.iter().any(|it| has(&it.fields, field));
    let lists_cpus = any_has(ActivityField::Cpus) && !any_has(ActivityField::Affinity);
    for WhatIfField { instance, field, value } in &in_threads(data, declared, fields) {
        let Some(activity) = data.activities.iter().find(|it| it.executes(instance)) else {
            continue;
        };
        let is_of_thread = *field == ActivityField::Priority || PLACES.contains(field);
        if let Some(thread) = thread_of(instance).filter(|_| is_of_thread) {
            let key = (thread.file.path(db).as_path(), thread.place);
            let (_, new) = of_threads.entry(key).or_insert_with(|| (thread, ThreadChange::default()));
            if *field == ActivityField::Priority {
                new.level = value.parse().ok();
                new.policy = thread.priority.real_time().is_none().then_some(ThreadPolicy::Fifo);
            } else {
                new.affinity = value.parse().ok().map(CpuSet);
            }
            continue;
        }
        // CPUs have the form of the activity, otherwise that of the others.
        let lists_cpus = has(&activity.fields, ActivityField::Cpus)
            || lists_cpus && !has(&activity.fields, ActivityField::Affinity);
        let cpus = value.parse::<u128>().ok().filter(|_| *field == ActivityField::Affinity && lists_cpus);
        let list = cpus.map(|cpus| {
            let cpus: Vec<String> = CpuSet(cpus).iter().map(|cpu| (cpu + 1).to_string()).collect();
            Name::from(format!("[{}]", cpus.join(", ")))
        });
        let (field, value) = list.as_ref().map_or((field, value), |list| (&ActivityField::Cpus, list));
        let written = format!("{} = {value}", field.keyword());
        let file = place(activity.name.id).file(db);
        let range = |id| place(id).range(db);
        let gap = |of: &Field| indentation(file.text(db), range(of.name.id).start());
        // The usual place of a field.
        let rank = |field| ACTIVITY_FIELDS.iter().position(|it| it.field == field);
        let says_it = |it: &&Field| same_fields(field).iter().any(|of| it.name.name == of.keyword());
        let is_behind =
            |it: &&Field| ActivityField::from_keyword(&it.name.name).and_then(rank) > rank(*field);
        let fields_of = || activity.fields.iter();
        let (known, next) = (fields_of().find(says_it), fields_of().find(is_behind));
        let (range, text) = match (known, next, activity.fields.last()) {
            (Some(known), ..) if known.name.name == field.keyword() => {
                (range(known.value_id), value.to_string())
            }
            // A period instead of a rate.
            (Some(known), ..) => (range(known.name.id).cover(range(known.value_id)), written),
            (_, Some(next), _) => (TextRange::empty(range(next.name.id).start()), written + &gap(next)),
            (.., Some(last)) => (TextRange::empty(range(last.value_id).end()), gap(last) + &written),
            (None, None, None) => {
                let tree = parse(db, file).syntax().covering_element(range(activity.name.id));
                let node = tree.ancestors().find_map(ast::Activity::cast);
                let mut tokens = node.into_iter().flat_map(|it| it.syntax().children_with_tokens());
                let Some(brace) = tokens.find(|it| it.kind() == SyntaxKind::L_CURLY) else { continue };
                (TextRange::empty(brace.text_range().end()), format!(" {written}"))
            }
        };
        change.replace(file, Replacement { range, text });
    }
    for (thread, new) in of_threads.into_values() {
        let edits = change_thread(thread.file.text(db), thread.place, &new).map_err(|why| {
            format!("`{}` in {} cannot be changed: {}", thread.id, file_name(db, thread.file), refusal(&why))
        })?;
        for YamlEdit { range, text } in edits {
            change.replace(thread.file, Replacement { range: range_of(&range), text });
        }
    }
    Ok(change)
}

/// Says why a file of threads is not changed.
fn refusal(why: &EditRefusal) -> &'static str {
    match why {
        EditRefusal::NoSuchEntry => "it is an alias",
        EditRefusal::Incomplete => "the file has errors",
        EditRefusal::Shared(_) => "an alias refers to the value, and another thread would change",
        EditRefusal::Layout(_) => "the value is written in an unusual form",
        EditRefusal::LevelNeeded | EditRefusal::InvalidValue => "it cannot have the value",
        EditRefusal::NotConfirmed => "another value would change",
    }
}

/// Returns the separator of two fields: a new line if the field at `offset` begins its line, otherwise a space.
fn indentation(text: &str, offset: TextSize) -> String {
    let before = text.get(..usize::from(offset)).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    let is_alone = line.len() < before.len() && line.trim().is_empty();
    if is_alone { format!("\n{line}") } else { " ".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;

    #[test]
    fn fields_keep_their_order_layout_and_comments() {
        let text = "deployment D {
  activity a { period = 10 } // the laser
  activity b {
    priority = 1
    rate = 10 Hz /* é */
  }
  activity c { }
}";
        let Fixture { db, workspace, file, .. } = Fixture::new(text);
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let field = |instance: &str, field, value: &str| WhatIfField {
            instance: instance.into(),
            field,
            value: value.into(),
        };
        let fields = [
            field("a", ActivityField::Affinity, "2"),
            field("a", ActivityField::Priority, "3"),
            field("a", ActivityField::Deadline, "9"),
            field("b", ActivityField::Affinity, "1"),
            field("b", ActivityField::Priority, "2"),
            field("b", ActivityField::Period, "50"),
            field("c", ActivityField::Affinity, "1"),
            field("c", ActivityField::Priority, "1"),
            field("none", ActivityField::Priority, "2"),
        ];
        let edited = edit_of_fields(&db, project, of, &fields).unwrap().applied(&db, file);
        expect_test::expect![[r#"
            deployment D {
              activity a { affinity = 2 priority = 3 period = 10 deadline = 9 } // the laser
              activity b {
                affinity = 1
                priority = 2
                period = 50 /* é */
              }
              activity c { affinity = 1 priority = 1 }
            }"#]]
        .assert_eq(&edited);
    }

    #[test]
    fn cpus_are_written_as_the_file_writes_them() {
        let edited = |text: &str| {
            let Fixture { db, workspace, file, .. } = Fixture::new(text);
            let project = projects(&db, workspace)[0];
            let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
            let field = |instance: &str, value: &str| WhatIfField {
                instance: instance.into(),
                field: ActivityField::Affinity,
                value: value.into(),
            };
            edit_of_fields(&db, project, of, &[field("a", "2"), field("b", "5")]).unwrap().applied(&db, file)
        };
        for (a, b, new_a, new_b) in [
            ("cpus = [1]", "", "cpus = [2]", "cpus = [1, 3] "),
            ("cpus = [1]", "affinity = 1 ", "cpus = [2]", "affinity = 5 "),
            ("affinity = 1", "", "affinity = 2", "affinity = 5 "),
        ] {
            let text = |a: &str, b: &str| {
                format!(
                    "deployment D {{ activity a {{ {a} priority = 1 }} activity b {{ {b}priority = 2 }} }}"
                )
            };
            assert_eq!(edited(&text(a, b)), text(new_a, new_b));
        }
    }

    #[test]
    fn only_what_differs_is_replaced() {
        for (old, new, range, text) in [
            ("a = 1\nb = 2", "a = 1\nb = 3", 10..11, "3"),
            ("a = 11", "a = 1", 5..6, ""),
            ("a = 1", "a = 11", 5..5, "1"),
            ("é = 1", "é = 2\n", 5..6, "2\n"),
            ("", "x", 0..0, "x"),
            ("same", "same", 4..4, ""),
        ] {
            let found = difference(old, new);
            assert_eq!(
                (usize::from(found.range.start())..usize::from(found.range.end()), &*found.text),
                (range, text)
            );
        }
    }
}
