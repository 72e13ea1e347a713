//! The messages of errors in an exported task set.

use mauve_timing::task_set::{FORMAT, MOST_ACTIVITIES, TaskSetError, Times, Unknown};
use mauve_timing::{Level, MOST_LEVELS};

use crate::timing_reasons::machine_error;

/// Returns why a file is no task set. Control characters, which a terminal obeys, are replaced: a message quotes the file.
///
/// ```
/// use mauve_timing::task_set::Exported;
///
/// let error = Exported::parse("{}").unwrap_err();
/// let message = mauve_diagnostics::task_set_error_message(&error);
/// assert_eq!(message, "it is no task set of MAUVE: it has no `format`");
/// ```
pub fn task_set_error_message(error: &TaskSetError) -> String {
    let harmless = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    message(error).chars().map(harmless).collect()
}

fn message(error: &TaskSetError) -> String {
    match error {
        TaskSetError::Json(error) => error.clone(),
        TaskSetError::NoFormat => "it is no task set of MAUVE: it has no `format`".to_owned(),
        TaskSetError::OtherFormat(format) => {
            format!("its format is `{format}`: this version reads `{FORMAT}`")
        }
        TaskSetError::OtherUnit(unit) => format!("its unit is `{unit}`: expected `ns`"),
        TaskSetError::NoContent => "expected either `deployment` or `component` in it".to_owned(),
        TaskSetError::OtherDigest => {
            "it was changed since it was written: its digest is another. Generate it again, or remove `digest` where the \
             change is meant"
                .to_owned()
        }
        TaskSetError::ControlCharacter(text) => format!("a control character stands in {text:?}"),
        TaskSetError::TooManyLevels(count) => {
            format!("it has {count} levels: at most {MOST_LEVELS} are read")
        }
        TaskSetError::NoLevels => "it has no levels".to_owned(),
        TaskSetError::RepeatedLevel(level) => format!("the level {level} is there twice"),
        TaskSetError::ReasonForOtherLevel(level) => {
            format!("a reason is for {level}, which is not one of the levels")
        }
        TaskSetError::NoCpu => "`cpus` is 0: there is one at least".to_owned(),
        TaskSetError::TooManyActivities(count) => {
            format!("it has {count} activities: at most {MOST_ACTIVITIES} are analysed")
        }
        TaskSetError::RepeatedActivity(name) => format!("activity `{name}` is there twice"),
        TaskSetError::OfActivity(name, error) => format!("activity `{name}`: {}", message(error)),
        TaskSetError::NoPeriod => "a period and a deadline are greater than 0".to_owned(),
        TaskSetError::LateDeadline => "its deadline is later than its period".to_owned(),
        TaskSetError::BackgroundMachine => "it is in the background, and has a state machine".to_owned(),
        TaskSetError::NoReason(unknown, level) => {
            let unknown = match unknown {
                Unknown::Times => "there are no times",
                Unknown::Priority => "its priority is unknown",
                Unknown::PeriodOrDeadline => "its period or its deadline is unknown",
                Unknown::Cpu => "its affinity is not one of the CPUs that there are",
            };
            format!("{unknown} at {level}, and no reason for that is in `not_analysed`")
        }
        TaskSetError::RepeatedState => "two of its states have one name".to_owned(),
        TaskSetError::NoInitialState(name) => {
            format!("there is no state `{name}`, which is to be the initial one")
        }
        TaskSetError::RepeatedProgram => "two of its programs have one name".to_owned(),
        TaskSetError::NoState { edge, state } => format!("edge {edge}: there is no state `{state}`"),
        TaskSetError::NoProgram { edge, program } => format!("edge {edge}: there is no program `{program}`"),
        TaskSetError::NoCost(edge) => format!("edge {edge} has no cost"),
        TaskSetError::LowCost(edge) => format!("edge {edge} costs less than what it executes"),
        TaskSetError::Machine(error) => machine_error(*error),
        TaskSetError::OtherCount { of, times, levels } => {
            format!("{}: {times} for {levels} levels: expected one for each", name(of))
        }
        TaskSetError::FallingTimes(of) => format!(
            "{}: its times fall from level to level: what is exceeded more rarely is not shorter",
            name(of)
        ),
        TaskSetError::OtherLevels(of, level) => {
            let at = level.map_or_else(String::new, |level: Level| format!(": see {level}"));
            format!("{}: `overhead` has times at other levels than this{at}", name(of))
        }
    }
}

fn name(of: &Times) -> String {
    match of {
        Times::Overhead => "overhead".to_owned(),
        Times::ComponentTime => "component_time".to_owned(),
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
            TaskSetError::RepeatedActivity("front".to_owned()),
            TaskSetError::OfActivity("front".to_owned(), Box::new(TaskSetError::NoPeriod)),
            TaskSetError::LateDeadline,
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
            its format is `mauve�`: this version reads `mauve-1`
            its unit is `ms`: expected `ns`
            expected either `deployment` or `component` in it
            it was changed since it was written: its digest is another. Generate it again, or remove `digest` where the change is meant
            a control character stands in "a\nb"
            it has 65 levels: at most 64 are read
            it has no levels
            the level 1e-4 is there twice
            a reason is for 1e-4, which is not one of the levels
            `cpus` is 0: there is one at least
            it has 9999 activities: at most 2896 are analysed
            activity `front` is there twice
            activity `front`: a period and a deadline are greater than 0
            its deadline is later than its period
            it is in the background, and has a state machine
            there are no times at 1e-4, and no reason for that is in `not_analysed`
            its priority is unknown at 1e-4, and no reason for that is in `not_analysed`
            its period or its deadline is unknown at 1e-4, and no reason for that is in `not_analysed`
            its affinity is not one of the CPUs that there are at 1e-4, and no reason for that is in `not_analysed`
            two of its states have one name
            there is no state `Idle`, which is to be the initial one
            two of its programs have one name
            edge 1: there is no state `Idle`
            edge 1: there is no program `Idle.run`
            edge 1 has no cost
            edge 1 costs less than what it executes
            state 0 has no outgoing edge
            component_time: 1 for 2 levels: expected one for each
            program `Idle.run`: its times fall from level to level: what is exceeded more rarely is not shorter
            edge 1: `overhead` has times at other levels than this: see 1e-4
            overhead: `overhead` has times at other levels than this
        "#]].assert_eq(&messages);
    }
}
