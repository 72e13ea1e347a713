//! The messages of errors in the files of task sets.

use mauve_syntax::similar;
use mauve_timing::TimeError;
use mauve_timing::task_set::TaskSetError;

use crate::configuration::time_error;
use crate::reasons::machine_error;

/// Returns why a file is no task set. Control characters, which a terminal obeys, are replaced: a message quotes the file.
///
/// ```
/// use mauve_timing::task_set::{Notation, TaskSet};
///
/// let error = TaskSet::parse("name,priod\npilot,50\n", Notation::Csv).unwrap_err();
/// let message = mauve_diagnostics::task_set_error_message(&error);
/// assert_eq!(message, "line 1: unknown key `priod`; did you mean `period`?");
/// ```
pub fn task_set_error_message(error: &TaskSetError) -> String {
    let harmless = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    message(error).chars().map(harmless).collect()
}

fn message(error: &TaskSetError) -> String {
    match error {
        TaskSetError::Syntax { message, line } => format!("line {line}: {}", of_parser(message)),
        TaskSetError::EarlierFormat(format) => {
            format!("`{format}` is the format of an earlier version: generate the package again")
        }
        TaskSetError::NoHeader => {
            "no line with the names of the columns: expected `name,period,time,priority`".to_owned()
        }
        TaskSetError::NoTasks { line } => {
            format!("line {line}: no task below the names of the columns: write a line for each task")
        }
        TaskSetError::WrongColumns { line } => {
            format!("line {line}: more cells than the header, or two columns with one name")
        }
        TaskSetError::Of { section, name, error } => format!("{section} `{name}`: {}", message(error)),
        TaskSetError::NoName { section, number } => format!("{section} {number}: no `name`"),
        TaskSetError::NoLevel { level, levels } => {
            let levels: Vec<String> = levels.iter().map(ToString::to_string).collect();
            format!("no times at {level}: the file has {}", levels.join(", "))
        }
        TaskSetError::TooMany { what, count, most } => format!("{count} {what}: the limit is {most}"),
        TaskSetError::Repeated(what, name) => format!("a second {what} `{name}`"),
        TaskSetError::ControlCharacter(text) => format!("control character in {text:?}"),
        TaskSetError::Missing { key, level } => {
            format!("no `{key}` at {level}: give it, or say why in `not_analysed`")
        }
        TaskSetError::TimeAndMachine => "`time` and `machine`: expected one of them".to_owned(),
        TaskSetError::InvalidTime { key, text, unit, error } => {
            let hint = match error {
                TimeError::NotANumber => format!(": expected a number in {unit}, the `unit` of the file"),
                _ => String::new(),
            };
            format!("`{key}` is `{text}`: {}{hint}", time_error(*error))
        }
        TaskSetError::ManyDigits(key) => {
            format!("`{key}` has more than 15 digits: write the number in quotes")
        }
        TaskSetError::Zero(key) => format!("`{key}` is 0: expected more"),
        TaskSetError::NoCount { key, text, least } => {
            format!("`{key}` is `{text}`: expected a whole number from {least} on")
        }
        TaskSetError::NotPeriodic(key) => {
            format!("`{key}`: only for a `task` with neither `sporadic` nor `burst`")
        }
        TaskSetError::OtherInThread { key, thread } => {
            format!("the thread `{thread}` has one `{key}`: give all of its tasks the same")
        }
        TaskSetError::LateOffset => "the offset is not less than the period".to_owned(),
        TaskSetError::NoPriority(text) => format!("priority `{text}`: expected 1 to 99, or `background`"),
        TaskSetError::NoCpu(text) => format!("`cpus` names `{text}`: expected 1 to the number of CPUs"),
        TaskSetError::OtherCount { key, levels: 0, .. } => {
            format!("`{key}` is a list, and the file has no `levels`")
        }
        TaskSetError::OtherCount { key, times, levels } => {
            format!("`{key}` has {times} times for {levels} levels: expected one for each")
        }
        TaskSetError::FallingTimes(key) => format!("`{key}`: the time is shorter at a stricter level"),
        TaskSetError::ReasonForOtherLevel(level) => {
            format!("a reason is for {level}, which is not one of `levels`")
        }
        TaskSetError::NoState(name) => format!("no edge of the machine starts at state `{name}`"),
        TaskSetError::Machine(error) => machine_error(*error),
        TaskSetError::NoTask(name) => format!("no task `{name}`"),
        TaskSetError::NoOperation(number) => {
            format!(
                "`during` is {number}: expected the number of an earlier operation that the client executes"
            )
        }
    }
}

/// Returns the message for an error of a parser, which lists the known keys where one is unknown.
fn of_parser(message: &str) -> String {
    let mut names = message.strip_prefix("unknown field ").unwrap_or_default().split('`').skip(1).step_by(2);
    let Some(unknown) = names.next() else { return message.to_owned() };
    match similar(unknown, names.clone()) {
        Some(near) => format!("unknown key `{unknown}`; did you mean `{near}`?"),
        None => format!("unknown key `{unknown}`: expected {}", names.collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use mauve_timing::task_set::{Notation, TaskSet};
    use mauve_timing::{Level, MachineError, Unit};

    use super::*;

    #[test]
    fn each_error_has_its_message() {
        let level = Level::TEN_TO_MINUS_FOUR;
        let of_task =
            |error| TaskSetError::Of { section: "task", name: "pilot".to_owned(), error: Box::new(error) };
        let not_a_time = |text: &str, error| TaskSetError::InvalidTime {
            key: "period",
            text: text.to_owned(),
            unit: Unit::Milliseconds,
            error,
        };
        let errors = [
            TaskSetError::Syntax { message: "duplicate field `cpus`".to_owned(), line: 3 },
            TaskSetError::EarlierFormat("mauve\u{7}".to_owned()),
            TaskSetError::NoHeader,
            TaskSetError::NoTasks { line: 3 },
            TaskSetError::WrongColumns { line: 3 },
            TaskSetError::NoName { section: "task", number: 3 },
            TaskSetError::NoLevel { level, levels: vec![level, level] },
            TaskSetError::TooMany { what: "tasks", count: 9999, most: 2896 },
            TaskSetError::Repeated("task", "pilot".to_owned()),
            of_task(TaskSetError::ControlCharacter("a\nb".to_owned())),
            of_task(TaskSetError::Missing { key: "period", level }),
            of_task(TaskSetError::TimeAndMachine),
            of_task(not_a_time("5 ms", TimeError::NotANumber)),
            of_task(not_a_time("-5", TimeError::Negative)),
            of_task(TaskSetError::ManyDigits("period")),
            of_task(TaskSetError::Zero("period")),
            of_task(TaskSetError::NoCount { key: "burst", text: "0".to_owned(), least: 1 }),
            of_task(TaskSetError::NotPeriodic("offset")),
            of_task(TaskSetError::OtherInThread { key: "period", thread: "drivers".to_owned() }),
            of_task(TaskSetError::LateOffset),
            of_task(TaskSetError::NoPriority("100".to_owned())),
            of_task(TaskSetError::NoCpu("0".to_owned())),
            of_task(TaskSetError::OtherCount { key: "time", times: 1, levels: 0 }),
            of_task(TaskSetError::OtherCount { key: "time", times: 1, levels: 2 }),
            of_task(TaskSetError::FallingTimes("time")),
            of_task(TaskSetError::ReasonForOtherLevel(level)),
            of_task(TaskSetError::NoState("Idle".to_owned())),
            of_task(TaskSetError::Machine(MachineError::NoState)),
            TaskSetError::NoTask("pilot".to_owned()),
            TaskSetError::NoOperation(3),
        ];
        let messages: String = errors.iter().map(|error| task_set_error_message(error) + "\n").collect();
        expect![[r#"
            line 3: duplicate field `cpus`
            `mauve�` is the format of an earlier version: generate the package again
            no line with the names of the columns: expected `name,period,time,priority`
            line 3: no task below the names of the columns: write a line for each task
            line 3: more cells than the header, or two columns with one name
            task 3: no `name`
            no times at 1e-4: the file has 1e-4, 1e-4
            9999 tasks: the limit is 2896
            a second task `pilot`
            task `pilot`: control character in "a\nb"
            task `pilot`: no `period` at 1e-4: give it, or say why in `not_analysed`
            task `pilot`: `time` and `machine`: expected one of them
            task `pilot`: `period` is `5 ms`: not a number: write a decimal number such as 40, 0.5 or 1e-3: expected a number in ms, the `unit` of the file
            task `pilot`: `period` is `-5`: a time cannot be negative
            task `pilot`: `period` has more than 15 digits: write the number in quotes
            task `pilot`: `period` is 0: expected more
            task `pilot`: `burst` is `0`: expected a whole number from 1 on
            task `pilot`: `offset`: only for a `task` with neither `sporadic` nor `burst`
            task `pilot`: the thread `drivers` has one `period`: give all of its tasks the same
            task `pilot`: the offset is not less than the period
            task `pilot`: priority `100`: expected 1 to 99, or `background`
            task `pilot`: `cpus` names `0`: expected 1 to the number of CPUs
            task `pilot`: `time` is a list, and the file has no `levels`
            task `pilot`: `time` has 1 times for 2 levels: expected one for each
            task `pilot`: `time`: the time is shorter at a stricter level
            task `pilot`: a reason is for 1e-4, which is not one of `levels`
            task `pilot`: no edge of the machine starts at state `Idle`
            task `pilot`: a state machine has at least one state
            no task `pilot`
            `during` is 3: expected the number of an earlier operation that the client executes
        "#]].assert_eq(&messages);
    }

    #[test]
    fn unknown_keys_have_suggestions() {
        let message = |text: &str| {
            let error = TaskSet::parse(text, Notation::Toml).unwrap_err();
            task_set_error_message(&error)
        };
        assert_eq!(message("unit = 'ms'\ntasks = []"), "line 2: unknown key `tasks`; did you mean `task`?");
        let of_table = message("[codel]\nloop = 5");
        assert!(of_table.starts_with("line 1: unknown key `codel`: expected generated, name,"), "{of_table}");
    }
}
