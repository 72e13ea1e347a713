//! Renders timing facts as diagnostics.

use super::*;
use mauve_wcrt::{ActivityField, Recorded, TimingFact, TimingFactKind as Fact, file_name};

/// Returns the diagnostic of a fact.
pub(super) fn timing_diagnostic<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    TimingFact { at, kind }: &TimingFact<'db>,
) -> Diagnostic<'db> {
    let at = at.clone();
    match kind {
        Fact::Unresolved(kind) => {
            render(db, project, &mauve_hir::fact::Fact { at, kind: kind.clone(), is_follow_up: false })
        }
        Fact::NoTarget => deployment_target::none(at),
        Fact::SecondTarget => deployment_target::second(at),
        Fact::DuplicateActivity { instance, first, in_list } => {
            duplicate_activity::report(at, instance, first, *in_list)
        }
        Fact::MissingActivity { of, instance } => missing_activity::report(db, project, at, *of, instance),
        Fact::DuplicateField { of, id, field, instance, first } => {
            duplicate_field::report((*of, *id), *field, instance, first)
        }
        Fact::UnknownField { name, near } => unknown_field::report(at, name, *near),
        Fact::MissingPriority { of, activity, free, period } => {
            missing_field::priority(*of, activity, *free, *period)
        }
        Fact::MissingPeriod { of, activity, priority, has_trigger } => {
            missing_field::period(*of, activity, *priority, *has_trigger)
        }
        Fact::ConflictingFields { of, id, field, other, first } => {
            conflicting_fields::report((*of, *id), *field, *other, first)
        }
        Fact::FieldWithoutOther { of, id, field } => conflicting_fields::without_other(*of, *id, *field),
        Fact::OtherInThread { thread, field, first } => {
            conflicting_fields::other_in_thread(at, thread, *field, first)
        }
        Fact::InvalidField(field, expected) => invalid_field::report(at, *field, expected),
        Fact::BackgroundField { of, id, field, instance } => background_field(*of, *id, *field, instance),
        Fact::NotSynchronised { of, id, activity, instance } => {
            unused_offset::not_synchronised(*of, *id, activity, instance.as_deref())
        }
        Fact::NoSuchCpu(missing) => invalid_field::no_such_cpu(at, *missing),
        Fact::DeadlineExceedsPeriod { deadline, period, written, period_at } => {
            deadline_exceeds_period::report(at, *deadline, (*period, written, period_at))
        }
        Fact::EqualPriorities { instance, priority, others } => {
            equal_priorities::report(at, instance, *priority, others)
        }
        Fact::NotDeadlineMonotonic { activity, other, other_at, free } => {
            not_deadline_monotonic::report(at, activity, other, other_at, *free)
        }
        Fact::StaleData { reader, writer, port, writer_at } => {
            stale_data::report(at, [reader, writer], port, writer_at)
        }
        Fact::NeverTriggered { instance, port, writer } => {
            never_triggered::report(at, [instance, port], writer.as_ref())
        }
        Fact::TriggerNotRead { instance, port } => unread_trigger::report(at, instance, port),
        Fact::ThreadWithoutActivity { of, id, timer, has_priority } => {
            let timer = timer.as_deref();
            not_analysed::thread_without_activity(at, of.name(db), id, timer, *has_priority)
        }
        Fact::ThreadFile(kind) => Diagnostic::new(&UNKNOWN_TIMING_KEY, at, file_problem(kind)),
        Fact::InvalidTable(fault) => invalid_table::report(db, at, fault),
        Fact::RepeatedTime { key, first } => invalid_table::repeated(db, at, key, first),
        Fact::UnknownTimingKey { kind, key, near, fixed } => {
            let name = key.rsplit('.').next().unwrap_or(key).into();
            let file = file_outside(db, project, *kind, &name);
            let found = unknown_timing_key::report(at, &format!("no {kind} `{key}`"), near, fixed);
            let of_case = key
                .rsplit_once('.')
                .and_then(|(it, _)| misspelt_name::of_letter_case(db, project, it, &found));
            of_case.unwrap_or_else(|| found.caused_by(file.map(Cause::NotIncluded)))
        }
        Fact::UnknownTimingLibrary { library, keys, near, written } => {
            unknown_timing_key::library(at, library, *keys, near.as_ref(), written)
        }
        Fact::WrongTableSection { key, section } => {
            unknown_timing_key::wrong_section(at, key, section.header())
        }
        Fact::UnknownProgram { program, near, fixed } => {
            unknown_timing_key::report(at, &table_reasons::wrong_program(db, program), near, fixed)
        }
        Fact::UnknownTimedPort { component, port, near, fixed } => {
            let what = format!("{} has no port `{port}`", component.name(db));
            unknown_timing_key::report(at, &what, near, fixed)
        }
        Fact::UnknownTopic { topic, near, fixed, known } => {
            unknown_timing_key::of_topic(at, topic, near, fixed, known)
        }
        Fact::UnknownConfiguredCodel { lock, codel, near } => {
            let near = near.as_ref().map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            let by = lock.as_ref().map_or("`dependent`".to_owned(), |lock| format!("the lock `{lock}`"));
            let message = format!("no codel `{codel}`, which {by} names{near}");
            invalid_configuration::report(at, message)
        }
        Fact::AmbiguousTimingKey { key, first } => {
            unknown_timing_key::ambiguous(at, key, &first.qualified(db))
        }
        Fact::Recorded(recorded) => of_recording(db, at, recorded),
        Fact::UnmeasuredAccess { ports } => unmeasured_access::report(at, ports),
        Fact::OutdatedMeasurement { key, changed } => outdated_measurement::report(at, key, changed),
        Fact::DoubtfulMeasurement { key, warnings } => doubtful_measurement::report(at, key, warnings),
        Fact::LackingLevel { deployment, lacking } => {
            invalid_configuration::lacking_level(db, project, at, *deployment, lacking)
        }
        Fact::NoTimesAtLevel(level, table) => missing_time::no_level(db, at, *level, table),
        Fact::NoTimes { tables, codels, others } => missing_time::no_table(db, at, *tables, *codels, others),
        Fact::MissingTime(missing, budget) => missing_time::report(db, at, missing, budget.as_ref()),
        Fact::Overloaded(overload) => deadline_missed::overloaded(db, at, overload),
        Fact::StarvedBackground { instance, cpus } => starved_background::report(at, instance, cpus),
        Fact::DeadlineMissed { instance, deadline, missed } => {
            deadline_missed::report(db, at, instance, *deadline, missed)
        }
        Fact::NotAnalysed { instance, reasons } => not_analysed::report(db, at, instance, reasons),
    }
}

fn of_recording<'db>(db: &'db dyn ModelDb, at: Location<'db>, recorded: &Recorded<'db>) -> Diagnostic<'db> {
    let name = |file: &File| file_name(db, *file);
    match recorded {
        Recorded::RefutedTime { of, observed, written, file } => {
            refuted_time::report(db, at, of, *observed, *written, &name(file))
        }
        Recorded::WaitingCodel { codel, wait, written, is_known, file } => {
            waiting_codel::report(at, codel, (*wait, *written), *is_known, &name(file))
        }
        Recorded::BriefWait { codel, wait, executions, file } => {
            brief_wait::report(at, codel, *wait, *executions, &name(file))
        }
        Recorded::WaitsOften { codel, times, written, file } => {
            waiting_codel::more_often(at, codel, *times, *written, &name(file))
        }
        Recorded::UndeclaredLock { lock, codel, held, declared } => {
            undeclared_lock::report(at, lock, codel, *held, *declared)
        }
        Recorded::WorkElsewhere { thread, per_second } => work_elsewhere::report(at, thread, *per_second),
    }
}

/// A background activity has a field that has an effect on real-time activities only.
fn background_field<'db>(
    of: Decl<'db>,
    id: SourceId,
    field: ActivityField,
    instance: &str,
) -> Diagnostic<'db> {
    let (code, wanted) = match field {
        ActivityField::Jitter => (&UNUSED_JITTER, "real-time activity"),
        ActivityField::Offset => (&UNUSED_OFFSET, "real-time activity"),
        _ => (&UNUSED_DEADLINE, "deadline"),
    };
    let field = field.keyword();
    let message = format!(
        "the analysis ignores the {field} of `{instance}`: its priority is `background`; for a {wanted}, write a priority \
         from 1 to 99"
    );
    let found = Diagnostic::new(code, Location::Source(of, id), message);
    found.remove(format!("Remove the {field}"), of, id)
}
