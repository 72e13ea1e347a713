//! The messages of errors in an exported task set.

use mauve_timing::task_set::{FORMAT, MOST_ACTIVITIES, MOST_OPERATIONS, TaskSetError, Times, Unknown};
use mauve_timing::{Level, MOST_LEVELS};

use crate::reasons::machine_error;

/// Returns why a file is no task set. Control characters, which a terminal obeys, are replaced: a message quotes the file.
///
/// ```
/// use mauve_timing::task_set::Exported;
///
/// let error = Exported::parse("{}").unwrap_err();
/// let message = mauve_diagnostics::task_set_error_message(&error);
/// assert_eq!(message, "not a MAUVE task set: no `format`");
/// ```
pub fn task_set_error_message(error: &TaskSetError) -> String {
    let harmless = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    message(error).chars().map(harmless).collect()
}

fn message(error: &TaskSetError) -> String {
    match error {
        TaskSetError::Json(error) => error.clone(),
        TaskSetError::NoFormat => "not a MAUVE task set: no `format`".to_owned(),
        TaskSetError::OtherFormat(format) => {
            format!("unknown format `{format}`: this version reads `{FORMAT}`; generate the file again")
        }
        TaskSetError::OtherUnit(unit) => format!("unknown unit `{unit}`: expected `ns`"),
        TaskSetError::NoContent => "expected either `deployment` or `component`".to_owned(),
        TaskSetError::OtherDigest => {
            "the file was changed after it was generated (other `digest`): generate it again, or remove `digest` to keep \
             the change"
                .to_owned()
        }
        TaskSetError::ControlCharacter(text) => format!("control character in {text:?}"),
        TaskSetError::TooManyLevels(count) => {
            format!("{count} levels: the limit is {MOST_LEVELS}")
        }
        TaskSetError::NoLevels => "no levels".to_owned(),
        TaskSetError::RepeatedLevel(level) => format!("a second level {level}"),
        TaskSetError::ReasonForOtherLevel(level) => {
            format!("a reason is for {level}, which is not one of `levels`")
        }
        TaskSetError::NoCpu => "`cpus` is 0: expected 1 or more".to_owned(),
        TaskSetError::TooManyActivities(count) => {
            format!("{count} activities: the limit is {MOST_ACTIVITIES}")
        }
        TaskSetError::TooManyOperations(count) => {
            format!("{count} operations: the limit is {MOST_OPERATIONS}")
        }
        TaskSetError::RepeatedActivity(name) => format!("a second activity `{name}`"),
        TaskSetError::OfActivity(name, error) => format!("activity `{name}`: {}", message(error)),
        TaskSetError::OfOther(name, error) => format!("other work `{name}`: {}", message(error)),
        TaskSetError::RepeatedOther(name) => format!("a second entry `{name}` in `other`"),
        TaskSetError::OfOperation(name, error) => format!("operation `{name}`: {}", message(error)),
        TaskSetError::NoActivity(name) => format!("no activity `{name}`"),
        TaskSetError::NoOperation(number) => {
            format!("`during` is {number}: expected the number of an earlier operation that the client executes")
        }
        TaskSetError::NoPriority(priority) => format!("priority {priority}: expected 1 to 99"),
        TaskSetError::NoPeriod => "the period and the deadline must be greater than 0".to_owned(),
        TaskSetError::LateDeadline => "the deadline exceeds the period".to_owned(),
        TaskSetError::LateOffset => "the offset is not less than the period".to_owned(),
        TaskSetError::BackgroundMachine => "a background activity has no state machine".to_owned(),
        TaskSetError::NoReason(unknown, level) => {
            let unknown = match unknown {
                Unknown::Times => "no times",
                Unknown::Priority => "the priority is unknown",
                Unknown::PeriodOrDeadline => "the period or the deadline is unknown",
                Unknown::Cpu => "the affinity is not one of `cpus`",
            };
            format!("{unknown} at {level}, and `not_analysed` has no reason")
        }
        TaskSetError::RepeatedState => "two states have the same name".to_owned(),
        TaskSetError::NoInitialState(name) => {
            format!("no state `{name}`, which `initial` names")
        }
        TaskSetError::RepeatedProgram => "two programs have the same name".to_owned(),
        TaskSetError::NoState { edge, state } => format!("edge {edge}: no state `{state}`"),
        TaskSetError::NoProgram { edge, program } => format!("edge {edge}: no program `{program}`"),
        TaskSetError::NoProgramOfState { state, program } => format!("state `{state}`: no program `{program}`"),
        TaskSetError::MoreFirst(edge) => {
            format!("edge {edge}: `first` exceeds the number of programs in `first` of its source")
        }
        TaskSetError::NoCost(edge) => format!("edge {edge} has no cost"),
        TaskSetError::LowCost(edge) => format!("edge {edge} costs less than its programs"),
        TaskSetError::Machine(error) => machine_error(*error),
        TaskSetError::OtherCount { of, times, levels } => {
            format!("{}: {times} for {levels} levels: expected one for each", name(of))
        }
        TaskSetError::FallingTimes(of) => format!(
            "{}: the time is shorter at a stricter level",
            name(of)
        ),
        TaskSetError::OtherLevels(of, level) => {
            let at = level.map_or_else(String::new, |level: Level| format!(": see {level}"));
            format!("{}: other levels than those of `overhead`{at}", name(of))
        }
    }
}

fn name(of: &Times) -> String {
    match of {
        Times::Overhead => "overhead".to_owned(),
        Times::ComponentTime => "component_time".to_owned(),
        Times::Operation => "time".to_owned(),
        Times::Program(name) => format!("program `{name}`"),
        Times::Edge(index) => format!("edge {index}"),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use mauve_timing::MachineError;

    use super::*;

    #[test]
    fn each_error_has_its_message() {
        let level = Level::TEN_TO_MINUS_FOUR;
        let errors = [
            TaskSetError::OtherFormat("mauve\u{7}".to_owned()),
            TaskSetError::OtherUnit("ms".to_owned()),
            TaskSetError::NoContent,
            TaskSetError::OtherDigest,
            TaskSetError::ControlCharacter("a\nb".to_owned()),
            TaskSetError::TooManyLevels(65),
            TaskSetError::NoLevels,
            TaskSetError::RepeatedLevel(level),
            TaskSetError::ReasonForOtherLevel(level),
            TaskSetError::NoCpu,
            TaskSetError::TooManyActivities(9999),
            TaskSetError::TooManyOperations(99999),
            TaskSetError::RepeatedActivity("front".to_owned()),
            TaskSetError::OfActivity("front".to_owned(), Box::new(TaskSetError::NoPeriod)),
            TaskSetError::OfOther("lan".to_owned(), Box::new(TaskSetError::NoPriority(100))),
            TaskSetError::RepeatedOther("lan".to_owned()),
            TaskSetError::OfOperation(
                "plan".to_owned(),
                Box::new(TaskSetError::NoActivity("rear".to_owned())),
            ),
            TaskSetError::OfOperation("plan".to_owned(), Box::new(TaskSetError::NoOperation(3))),
            TaskSetError::LateDeadline,
            TaskSetError::LateOffset,
            TaskSetError::BackgroundMachine,
            TaskSetError::NoReason(Unknown::Times, level),
            TaskSetError::NoReason(Unknown::Priority, level),
            TaskSetError::NoReason(Unknown::PeriodOrDeadline, level),
            TaskSetError::NoReason(Unknown::Cpu, level),
            TaskSetError::RepeatedState,
            TaskSetError::NoInitialState("Idle".to_owned()),
            TaskSetError::RepeatedProgram,
            TaskSetError::NoState { edge: 1, state: "Idle".to_owned() },
            TaskSetError::NoProgram { edge: 1, program: "Idle.run".to_owned() },
            TaskSetError::NoProgramOfState { state: "Idle".to_owned(), program: "Idle.run".to_owned() },
            TaskSetError::MoreFirst(1),
            TaskSetError::NoCost(1),
            TaskSetError::LowCost(1),
            TaskSetError::Machine(MachineError::DeadEnd { state: 0 }),
            TaskSetError::OtherCount { of: Times::ComponentTime, times: 1, levels: 2 },
            TaskSetError::FallingTimes(Times::Program("Idle.run".to_owned())),
            TaskSetError::OtherLevels(Times::Edge(1), Some(level)),
            TaskSetError::OtherLevels(Times::Overhead, None),
        ];
        let messages: String = errors.iter().map(|error| task_set_error_message(error) + "\n").collect();
        expect![[r#"
            unknown format `mauve�`: this version reads `mauve-3`; generate the file again
            unknown unit `ms`: expected `ns`
            expected either `deployment` or `component`
            the file was changed after it was generated (other `digest`): generate it again, or remove `digest` to keep the change
            control character in "a\nb"
            65 levels: the limit is 64
            no levels
            a second level 1e-4
            a reason is for 1e-4, which is not one of `levels`
            `cpus` is 0: expected 1 or more
            9999 activities: the limit is 2896
            99999 operations: the limit is 65536
            a second activity `front`
            activity `front`: the period and the deadline must be greater than 0
            other work `lan`: priority 100: expected 1 to 99
            a second entry `lan` in `other`
            operation `plan`: no activity `rear`
            operation `plan`: `during` is 3: expected the number of an earlier operation that the client executes
            the deadline exceeds the period
            the offset is not less than the period
            a background activity has no state machine
            no times at 1e-4, and `not_analysed` has no reason
            the priority is unknown at 1e-4, and `not_analysed` has no reason
            the period or the deadline is unknown at 1e-4, and `not_analysed` has no reason
            the affinity is not one of `cpus` at 1e-4, and `not_analysed` has no reason
            two states have the same name
            no state `Idle`, which `initial` names
            two programs have the same name
            edge 1: no state `Idle`
            edge 1: no program `Idle.run`
            state `Idle`: no program `Idle.run`
            edge 1: `first` exceeds the number of programs in `first` of its source
            edge 1 has no cost
            edge 1 costs less than its programs
            state 0 has no outgoing edge
            component_time: 1 for 2 levels: expected one for each
            program `Idle.run`: the time is shorter at a stricter level
            edge 1: other levels than those of `overhead`: see 1e-4
            overhead: other levels than those of `overhead`
        "#]].assert_eq(&messages);
    }
}
