//! What is read, written and refused. `mauve-diagnostics` compares exported files with their models.

use expect_test::{Expect, expect};
use proptest::prelude::*;
use serde_json::{Value, json};

use super::*;
use crate::level::MOST_LEVELS;
use crate::{Bound, CpuSet, Demand, Options, Priority, StateMachine, Task, TaskKind, TaskOperation, Time};

fn level(probability: f64) -> Level {
    Level::from_f64(probability).unwrap()
}

fn time(nanos: u64) -> Option<Time> {
    Some(Time::from_nanos(nanos))
}

/// Two tasks that are analysed, `rear` at one of two levels only, one in the background, and what delays them.
fn example() -> Value {
    json!({
        "generated": "by hand", "name": "D", "times": "Sea", "unit": "ns", "levels": [1e-3, 1e-9], "significance": 1e-9,
        "rt_throttling": true,
        "task": [
            {
                "name": "front", "component": "Pilot", "period": 1000, "deadline": 900, "jitter": 7, "offset": 8, "priority": 2,
                "cpus": [1, 3],
                "machine": [
                    { "from": "Idle", "to": "Idle", "time": [13, 24] },
                    { "from": "Idle", "to": "Busy", "time": [83, 94], "name": "go" },
                    { "from": "Busy", "to": "Idle", "time": 3, "name": "back" },
                ],
                "initial": "Busy", "classic_time": [900, null], "assumed": { "pilot.turn": 5 },
                "not_analysed": [{ "reason": "no time", "levels": [1e-9], "classic_only": true }],
            },
            {
                "name": "rear", "period": 1000, "priority": 1, "cpus": 1, "time": [9, null],
                "not_analysed": [{ "reason": "no time", "levels": [1e-9] }],
            },
            { "name": "idle", "priority": "background" },
        ],
        "other": [{ "name": "lan", "period": 1000, "jitter": 2, "priority": 50, "cpus": 1, "time": 9 }],
        "operation": [
            { "name": "plan", "provider": "front", "client": "rear", "sends": 2, "time": [3, 4] },
            { "name": "log", "provider": "rear", "client": "front", "sends": 2, "during": 0, "time": 5 },
        ],
    })
}

fn parse(document: &Value) -> Result<TaskSet, TaskSetError> {
    // On several lines, so that a place is one.
    TaskSet::parse(&serde_json::to_string_pretty(document).unwrap(), Notation::Json)
}

#[test]
fn what_is_written_is_read() {
    let set = parse(&example()).unwrap();
    let text = set.to_json();
    assert_eq!(TaskSet::parse(&text, Notation::Json).as_ref(), Ok(&set));
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), example());
    // It is laid out for people.
    expect![[r#"
        {
          "generated": "by hand",
          "name": "D",
          "times": "Sea",
          "unit": "ns",
          "levels": [0.001,1e-9],
          "significance": 1e-9,
          "rt_throttling": true,
          "task": [
            {"name": "front", "component": "Pilot", "period": 1000, "deadline": 900, "jitter": 7, "offset": 8, "priority": 2, "cpus": [1,3], "machine": [
              {"from": "Idle", "to": "Idle", "time": [13,24]},
              {"from": "Idle", "to": "Busy", "time": [83,94], "name": "go"},
              {"from": "Busy", "to": "Idle", "time": 3, "name": "back"}], "initial": "Busy", "classic_time": [900,null], "assumed": 
              {"pilot.turn": 5}, "not_analysed": [
              {"reason": "no time", "levels": [1e-9], "classic_only": true}]},
            {"name": "rear", "period": 1000, "priority": 1, "cpus": 1, "time": [9,null], "not_analysed": [
              {"reason": "no time", "levels": [1e-9]}]},
            {"name": "idle", "priority": "background"}],
          "other": [
            {"name": "lan", "period": 1000, "jitter": 2, "priority": 50, "cpus": 1, "time": 9}],
          "operation": [
            {"name": "plan", "provider": "front", "client": "rear", "sends": 2, "time": [3,4]},
            {"name": "log", "provider": "rear", "client": "front", "sends": 2, "during": 0, "time": 5}]
        }
    "#]]
    .assert_eq(&text);
}

#[test]
fn what_the_analysis_reads() {
    let set = parse(&example()).unwrap();
    assert_eq!((set.level(), set.task[0].states()), (level(1e-9), vec!["Idle", "Busy"]));
    assert_eq!(set.assumed(&set.task[0]), [("pilot.turn".to_owned(), Time::from_nanos(5))]);
    let found = set.at(level(1e-3), Method::Classic).unwrap();
    let [front, rear, idle] = found.activities() else { panic!("three") };
    let edge = |source, target, cost| crate::Edge { source, target, cost: Time::from_nanos(cost) };
    let machine = StateMachine::new(2, vec![edge(0, 0, 13), edge(0, 1, 83), edge(1, 0, 3)]).unwrap();
    let expected = Task {
        name: "front".into(),
        priority: Priority::RealTime(2),
        period: time(1000),
        deadline: time(900),
        jitter: Time::from_nanos(7),
        offset: time(8),
        cpus: Some(CpuSet(5)),
        demand: Demand::Machine { machine, whole: time(900) },
        ..Task::default()
    };
    assert_eq!(*front, expected);
    assert_eq!(
        (rear.deadline, rear.jitter, rear.offset, rear.cpus),
        (time(1000), Time::ZERO, None, Some(CpuSet(1)))
    );
    assert_eq!((idle.priority, &idle.demand, idle.cpus), (Priority::Background, &Demand::Unknown, None));
    let other = Task::new(50, Time::from_nanos(1000), StateMachine::single(Time::from_nanos(9)));
    let other = Task { name: "lan".into(), jitter: Time::from_nanos(2), ..other };
    assert_eq!(found.others(), [other]);
    // Real-time tasks run on CPU 1 and 3.
    let throttled = (4..found.all().len()).map(|it| (found.kind(it), found.all()[it].cpus));
    assert!(throttled.eq([1, 4].map(|cpu| (TaskKind::Throttling, Some(CpuSet(cpu))))));
    let operation = |provider, client, time, during| TaskOperation {
        provider,
        client,
        sends: 2,
        time: Time::from_nanos(time),
        during,
        ..TaskOperation::default()
    };
    assert_eq!(found.operations, [operation(0, 1, 3, None), operation(1, 0, 5, Some(0))]);
    // At the other level, `rear` is not analysed, nor `front` by the classic method.
    let known = |method| {
        let found = set.at(level(1e-9), method).unwrap();
        found.activities().iter().map(|it| it.demand != Demand::Unknown).collect::<Vec<_>>()
    };
    assert_eq!((known(Method::Psm), known(Method::Classic)), (vec![true, false, false], vec![false; 3]));
    let unknown = level(1e-5);
    let levels = vec![level(1e-3), level(1e-9)];
    assert_eq!(set.at(unknown, Method::Psm), Err(TaskSetError::NoLevel { level: unknown, levels }));
}

#[test]
fn three_notations_of_one_set() {
    let json = r#"{ "unit": "us", "levels": [1e-3, 1e-6], "task": [
        { "name": "laser", "period": 100, "time": [40.5, 43], "priority": 10 },
        { "name": "map", "period": 1e3, "deadline": 500, "time": 99, "priority": 5, "cpus": [1, 2] }] }"#;
    let toml = "unit = 'us'\nlevels = [1e-3, 1e-6]\n[[task]]\nname = 'laser'\nperiod = 100\ntime = [40.5, 43]\npriority = 10\n\
                [[task]]\nname = 'map'\nperiod = 1e3\ndeadline = 500\ntime = 99\npriority = 5\ncpus = [1, 2]\n";
    let csv = "\u{feff}unit,us,,\r\nlevels,1e-3,1e-6\r\n\r\nname,priority,period,time,deadline,cpus\r\n\"laser\", 10,100,40.5 43,,\r\n\
               map,5,1e3,99,500,1 2\r\n";
    let read = |text: &str, notation| {
        let set = TaskSet::parse(text, notation).unwrap();
        [1e-3, 1e-6].map(|it| set.at(level(it), Method::Psm).unwrap())
    };
    let expected = read(json, Notation::Json);
    assert_eq!(read(toml, Notation::Toml), expected);
    assert_eq!(read(csv, Notation::Csv), expected);
    // Without CPUs, a task may use all that others name.
    let cpus: Vec<Option<CpuSet>> = expected[0].activities().iter().map(|it| it.cpus).collect();
    assert_eq!(cpus, [Some(CpuSet(3)); 2]);
    let [strict, _] = [1, 0].map(|it| expected[it].activities()[0].demand.own(Method::Psm));
    assert_eq!(strict, time(43_000));
}

#[test]
fn the_smallest_file_is_three_lines() {
    let set =
        TaskSet::parse("name,period,time,priority\nlaser,100,43,20\nmap,200,50,10\n", Notation::Csv).unwrap();
    let found = set.at(level(0.123), Method::Psm).unwrap();
    let options = Options { method: Method::Psm, is_brief: false };
    let responses = found.response_times(&options, &|| ()).responses;
    let bounds: Vec<_> = responses.iter().map(|it| it.bound.clone()).collect();
    let ms = |time: u64| Bound::Response(Time::from_nanos(time * 1_000_000));
    assert_eq!(bounds, [ms(43), ms(93)]);
}

#[test]
fn the_notation_of_a_file() {
    let notations = ["a/b.json", "b.toml", "b.csv", "mauve.toml", "a/b.mal", "json", "b.JSON"];
    let found = notations.map(|it| Notation::of(it.as_ref()));
    assert_eq!(
        found,
        [Some(Notation::Json), Some(Notation::Toml), Some(Notation::Csv), None, None, None, None]
    );
}

fn check(changes: &[(&str, Value)], expected: Expect) {
    let mut found = String::new();
    for (path, value) in changes {
        let mut document = example();
        let path = path.replace("front", "/task/0").replace("rear", "/task/1");
        let (parent, key) = path.rsplit_once('/').unwrap();
        match key.parse::<usize>() {
            Ok(index) => document.pointer_mut(parent).unwrap()[index] = value.clone(),
            Err(_) => document.pointer_mut(parent).unwrap()[key] = value.clone(),
        }
        found += &match parse(&document) {
            Ok(_) => "fine\n".to_owned(),
            Err(error) => format!("{error:?}\n"),
        };
    }
    expected.assert_eq(&found);
}

#[test]
fn what_is_refused_of_the_set() {
    check(
        &[
            ("/format", json!("mauve-3")),
            ("/unit", json!("min")),
            ("/more", json!(1)),
            ("/levels", json!([1e-3, 1e-3])),
            ("/levels", json!([1e-3, 2])),
            ("/levels", json!(["1e-3", "1e-9"])),
            ("/levels", json!([])),
            ("/cpus", json!(0)),
            ("/cpus", json!(129)),
            ("/cpus", json!(2)),
            ("/cpus", json!(3)),
            ("/name", json!("a\nb")),
            ("/times", json!("\u{1b}[2J")),
            ("/rt_throttling", json!(1)),
            ("/not_analysed", json!(["a\u{7}"])),
            ("/not_analysed", json!(["a task is lost"])),
            ("/other/0/not_analysed", json!([{ "reason": "no time" }])),
            ("/task", json!(null)),
            ("/other/0/name", json!("a\nb")),
            ("/other/0/name", json!("")),
            ("/other/0/cpus", json!(0)),
            ("/other/0/priority", json!(100)),
            ("/other/0/priority", json!("background")),
            ("/other/0/period", json!(0)),
            ("/other/0/time", json!(null)),
            ("/operation/0/provider", json!("nobody")),
            ("/operation/0/client", json!("nobody")),
            ("/operation/0/time", json!([1])),
            ("/operation/0/time", json!([1, null])),
            ("/operation/0/during", json!(0)),
            ("/operation/1/during", json!(1)),
            ("/operation/1/client", json!("rear")),
            ("/operation/0/name", json!("a\nb")),
            ("/operation/0/sends", json!(-1)),
        ],
        expect![[r#"
            EarlierFormat("mauve-3")
            Syntax { message: "unknown variant `min`, expected one of `ns`, `us`, `ms`, `s`", line: 120 }
            Syntax { message: "unknown field `more`, expected one of `generated`, `name`, `times`, `unit`, `levels`, `significance`, `cpus`, `rt_throttling`, `not_analysed`, `task`, `other`, `lock`, `operation`, `trigger`", line: 7 }
            Repeated("level", "1e-3")
            Syntax { message: "expected a probability between 0 and 1, such as 1e-4", line: 6 }
            fine
            Of { section: "task", name: "front", error: ReasonForOtherLevel(Level { bits: 4472406533629990549 }) }
            NoCpu("0")
            NoCpu("129")
            Of { section: "task", name: "front", error: NoCpu("3") }
            fine
            ControlCharacter("a\nb")
            ControlCharacter("\u{1b}[2J")
            Syntax { message: "invalid type: integer `1`, expected a boolean", line: 38 }
            ControlCharacter("a\u{7}")
            fine
            Of { section: "other", name: "lan", error: Missing { key: "time", level: Level { bits: 4562254508917369340 } } }
            Syntax { message: "invalid type: null, expected a sequence", line: 40 }
            Of { section: "other", name: "a\nb", error: ControlCharacter("a\nb") }
            NoName { section: "other", number: 1 }
            Of { section: "other", name: "lan", error: NoCpu("0") }
            Of { section: "other", name: "lan", error: NoPriority("100") }
            Of { section: "other", name: "lan", error: Missing { key: "priority", level: Level { bits: 4562254508917369340 } } }
            Of { section: "other", name: "lan", error: Zero("period") }
            Of { section: "other", name: "lan", error: Missing { key: "time", level: Level { bits: 4562254508917369340 } } }
            Of { section: "operation", name: "plan", error: NoTask("nobody") }
            Of { section: "operation", name: "plan", error: NoTask("nobody") }
            Of { section: "operation", name: "plan", error: OtherCount { key: "time", times: 1, levels: 2 } }
            Of { section: "operation", name: "plan", error: Missing { key: "time", level: Level { bits: 4472406533629990549 } } }
            Of { section: "operation", name: "plan", error: NoOperation(0) }
            Of { section: "operation", name: "log", error: NoOperation(1) }
            Of { section: "operation", name: "log", error: NoOperation(0) }
            Of { section: "operation", name: "a\nb", error: ControlCharacter("a\nb") }
            Syntax { message: "invalid value: integer `-1`, expected u64", line: 13 }
        "#]],
    );
}

#[test]
fn what_is_refused_of_a_task() {
    check(
        &[
            ("front/cpus", json!(2)),
            ("front/cpus", json!(0)),
            ("front/cpus", json!(129)),
            ("front/cpus", json!([])),
            ("front/cpus", json!([1, null])),
            ("front/cpus", json!(null)),
            ("front/priority", json!(0)),
            ("front/priority", json!(100)),
            ("front/priority", json!(1.5)),
            ("front/priority", json!("idle")),
            ("front/priority", json!(null)),
            ("front/priority", json!("background")),
            ("front/period", json!(0)),
            ("front/period", json!(-5)),
            ("front/period", json!(1000.5)),
            ("front/period", json!(1e30)),
            ("front/period", json!(0.123_456_789_012_345_6)),
            ("front/period", json!("5 ms")),
            ("front/period", json!("1e3")),
            ("front/period", json!([1000, 1000])),
            ("front/period", json!(true)),
            ("front/period", json!(null)),
            ("front/deadline", json!(0)),
            ("front/deadline", json!(1001)),
            ("front/deadline", json!(null)),
            ("front/offset", json!(1000)),
            ("front/jitter", json!(1001)),
            ("front/jitter", json!(-1)),
            ("front/sporadic", json!(true)),
            ("front/burst", json!(2)),
            ("rear/sporadic", json!(true)),
            ("front/thread", json!("drivers")),
            ("front/clock", json!(-1)),
            ("front/name", json!("rear")),
            ("front/name", json!(null)),
            ("front/priod", json!(5)),
            ("front/time", json!(5)),
            ("front/machine", json!(null)),
            ("front/machine", json!([])),
            ("front/initial", json!("Lost")),
            ("front/machine/0/to", json!("Lost")),
            ("front/machine/0/from", json!(null)),
            ("front/machine/0/time", json!(null)),
            ("front/machine/0/time", json!([13])),
            ("front/machine/0/time", json!([13, null])),
            ("front/machine/0/time", json!([100, 94])),
            ("front/machine/0/time", json!([83, u64::MAX])),
            ("front/machine/0/name", json!("a\nb")),
            ("front/machine/0/from", json!("a\nb")),
            ("front/classic_time", json!([2, 1])),
            ("front/assumed", json!({ "pilot.turn": "long" })),
            ("rear/not_analysed", json!([])),
            ("rear/not_analysed/0/levels", json!([1e-3])),
            ("rear/not_analysed/0/levels", json!([1e-5])),
            ("rear/not_analysed/0/classic_only", json!(true)),
            ("rear/not_analysed/0/reason", json!("a\nb")),
            ("rear/time", json!(0.5)),
            ("rear/time", json!(["9", null])),
        ],
        expect![[r#"
            fine
            Of { section: "task", name: "front", error: NoCpu("0") }
            Of { section: "task", name: "front", error: NoCpu("129") }
            Of { section: "task", name: "front", error: NoCpu("[]") }
            Of { section: "task", name: "front", error: NoCpu("null") }
            fine
            Of { section: "task", name: "front", error: NoPriority("0") }
            Of { section: "task", name: "front", error: NoPriority("100") }
            Of { section: "task", name: "front", error: NoPriority("1.5") }
            Of { section: "task", name: "front", error: NoPriority("idle") }
            Of { section: "task", name: "front", error: Missing { key: "priority", level: Level { bits: 4562254508917369340 } } }
            fine
            Of { section: "task", name: "front", error: Zero("period") }
            Of { section: "task", name: "front", error: InvalidTime { key: "period", text: "-5", unit: Nanoseconds, error: Negative } }
            Of { section: "task", name: "front", error: InvalidTime { key: "period", text: "1000.5", unit: Nanoseconds, error: TooFine } }
            Of { section: "task", name: "front", error: InvalidTime { key: "period", text: "1000000000000000000000000000000", unit: Nanoseconds, error: TooLarge } }
            Of { section: "task", name: "front", error: ManyDigits("period") }
            Of { section: "task", name: "front", error: InvalidTime { key: "period", text: "5 ms", unit: Nanoseconds, error: NotANumber } }
            fine
            Syntax { message: "expected a number", line: 96 }
            Syntax { message: "expected a number", line: 93 }
            Of { section: "task", name: "front", error: Missing { key: "period", level: Level { bits: 4562254508917369340 } } }
            Of { section: "task", name: "front", error: Zero("deadline") }
            fine
            Syntax { message: "expected a number", line: 54 }
            Of { section: "task", name: "front", error: LateOffset }
            fine
            Of { section: "task", name: "front", error: InvalidTime { key: "jitter", text: "-1", unit: Nanoseconds, error: Negative } }
            Of { section: "task", name: "front", error: NotPeriodic("offset") }
            Of { section: "task", name: "front", error: NotPeriodic("offset") }
            fine
            fine
            Of { section: "task", name: "front", error: NoCount { key: "clock", text: "-1", least: 0 } }
            Repeated("task", "rear")
            Syntax { message: "invalid type: null, expected a string", line: 82 }
            Syntax { message: "unknown field `priod`, expected one of `name`, `component`, `period`, `sporadic`, `burst`, `thread`, `order`, `preemptive`, `wake_up`, `deadline`, `jitter`, `offset`, `clock`, `priority`, `cpus`, `time`, `wait`, `waits`, `machine`, `initial`, `classic_time`, `assumed`, `not_analysed`", line: 94 }
            Of { section: "task", name: "front", error: TimeAndMachine }
            Of { section: "task", name: "front", error: Missing { key: "time", level: Level { bits: 4562254508917369340 } } }
            Of { section: "task", name: "front", error: NoState("Busy") }
            Of { section: "task", name: "front", error: NoState("Lost") }
            Of { section: "task", name: "front", error: NoState("Lost") }
            Syntax { message: "invalid type: null, expected a string", line: 59 }
            Syntax { message: "expected a number, or a list of numbers", line: 60 }
            Of { section: "task", name: "front", error: OtherCount { key: "time", times: 1, levels: 2 } }
            Of { section: "task", name: "front", error: Missing { key: "time", level: Level { bits: 4472406533629990549 } } }
            Of { section: "task", name: "front", error: FallingTimes("time") }
            Of { section: "task", name: "front", error: Machine(TooLarge) }
            Of { section: "task", name: "front", error: ControlCharacter("a\nb") }
            Of { section: "task", name: "front", error: ControlCharacter("a\nb") }
            Of { section: "task", name: "front", error: FallingTimes("classic_time") }
            Of { section: "task", name: "front", error: InvalidTime { key: "assumed", text: "long", unit: Nanoseconds, error: NotANumber } }
            Of { section: "task", name: "rear", error: Missing { key: "time", level: Level { bits: 4472406533629990549 } } }
            Of { section: "task", name: "rear", error: Missing { key: "time", level: Level { bits: 4472406533629990549 } } }
            Of { section: "task", name: "rear", error: ReasonForOtherLevel(Level { bits: 4532020583610935537 }) }
            Of { section: "task", name: "rear", error: Missing { key: "time", level: Level { bits: 4472406533629990549 } } }
            Of { section: "task", name: "rear", error: ControlCharacter("a\nb") }
            fine
            fine
        "#]],
    );
}

#[test]
fn threads_bursts_and_sporadic_tasks() {
    let text = "name,period,deadline,time,priority,sporadic,burst,thread\n\
        idle,10,,1,3,,,\na,10,30,1,2,,,my drivers\nb,10,,2,2,false,1,my drivers\nc,10,,1,1,true,,\nd,10,,1,1,,3,\n";
    let set = TaskSet::parse(text, Notation::Csv).unwrap();
    let read = set.at(level(1e-4), Method::Psm).unwrap();
    let found: Vec<_> = read.activities().iter().map(|it| (it.thread, it.is_sporadic, it.burst)).collect();
    let expected = [(None, false, 0), (Some(1), false, 0), (Some(1), false, 1), (None, true, 0)];
    assert_eq!(found, [expected.as_slice(), &[(None, false, 3)]].concat());
    assert_eq!(read.activities()[1].deadline, Some(Time::from_nanos(30_000_000)));
    let other = |key: &str| format!("OtherInThread {{ key: \"{key}\", thread: \"my drivers\" }}");
    for (from, to, error) in [
        (",2,2,f", ",2,4,f", other("priority")),
        (",3,", ",0,", "NoCount { key: \"burst\", text: \"0\", least: 1 }".to_owned()),
        (",3,", ",1.5,", "NoCount { key: \"burst\", text: \"1.5\", least: 1 }".to_owned()),
    ] {
        // The last of them.
        let at = text.rfind(from).unwrap();
        let changed = format!("{}{to}{}", &text[..at], &text[at + from.len()..]);
        let found = refused(&changed, Notation::Csv);
        assert!(found.contains(&error), "{found}\n{error}");
    }
}

#[test]
fn orders_of_threads() {
    let text =
        "name,period,time,priority,sporadic,thread,order,preemptive\na,10,1,2,,one,,\nb,10,2,2,,one,,false\n";
    let orders = |text: &str| {
        let read = TaskSet::parse(text, Notation::Csv).unwrap().at(level(1e-4), Method::Psm).unwrap();
        let of = |task: &Task| (task.order, task.is_not_preempted);
        [of(&read.activities()[0]), of(&read.activities()[1])]
    };
    assert_eq!(orders(text), [(Order::List, false), (Order::List, true)]);
    // Those that a thread cannot release together.
    let any = [(Order::Any, false), (Order::Any, true)];
    assert_eq!(orders(&text.replace("b,10", "b,20")), any);
    assert_eq!(orders(&text.replace("b,10,2,2,", "b,10,2,2,true")), any);
    let fifo = text.replace("one,,", "one,fifo,");
    assert_eq!(orders(&fifo), [(Order::Fifo, false), (Order::Fifo, true)]);
    assert_eq!(orders(&fifo.replace("b,10,2,2,", "b,20,2,2,true")), orders(&fifo));
    let list = text.replace("one,,", "one,list,");
    for (refused_text, error) in [
        (list.replace("b,10", "b,20"), "OtherInThread { key: \"period\", thread: \"one\" }"),
        (list.replace("b,10,2,2,", "b,10,2,2,true"), "NotPeriodic(\"thread\")"),
        (fifo.replacen("fifo", "any", 1), "OtherInThread { key: \"order\", thread: \"one\" }"),
        (text.replacen("one,,", "one,lifo,", 1), "unknown variant `lifo`"),
    ] {
        let found = refused(&refused_text, Notation::Csv);
        assert!(found.contains(error), "{found}\n{error}");
    }
}

/// The message of a text that is refused, or the name of the first task.
fn refused(text: &str, notation: Notation) -> String {
    match TaskSet::parse(text, notation) {
        Ok(set) => format!("fine: {} tasks", set.task.len()),
        Err(error) => format!("{error:?}"),
    }
}

#[test]
fn what_is_refused_of_a_text() {
    let mut found = String::new();
    for text in [
        "",
        "[]",
        "null",
        "{}",
        "{\"name\": \"a\"}",
        "{\"format\": \"\u{7}\"}",
        "{\"task\": []}",
        "{\"task\": [5]}",
    ] {
        found += &format!("{text:?}: {}\n", refused(text, Notation::Json));
    }
    let twice = example().to_string().replace("\"sends\":2", "\"sends\":2,\"sends\":3");
    found += &format!("twice: {}\n", refused(&twice, Notation::Json));
    for text in [
        "",
        "task = 5",
        "[[task]]\nname = 'a'\nname = 'b'",
        "[[task]]\nname = 'a'\nperiod = 5",
        "[[task]]\nperiod = nan",
        "x = [[",
    ] {
        found += &format!("{text:?}: {}\n", refused(text, Notation::Toml));
    }
    for text in [
        "",
        "a,100,4,3\n",
        "unit,us\nunit,ms\nname\n",
        "rt_throttling,maybe\nname\n",
        "unit,us\n\nname,period,time,priority\n,,,\n",
        "levels,1e-3\nname,period,time,priority\na,9,1,1\n",
        "levels,1e-3,1e-4\nname,period,time,priority\na,9,1,1\n",
        "name,period,time,wait,waits,priority\na,10,2,3,1,9\n",
        "name,period,time,wait,waits,priority\na,10,2,3,often,9\n",
        "name,period,time,priority\na,9,1,1,5\n",
        "name,period,time,time,priority\na,9,1,1,5\n",
        "name,period,time,priority\na,9,1\n",
        "name,period,tine,priority\n\na,9,1,1\n",
        "name,period,machine\n\na,9,x\n",
        "name,period,machine\na,9,x\n",
        "name,period,time,priority\n\"a\nb\",9,1,1\n",
        "name,period,time,priority\na,9,\"1\n",
    ] {
        found += &format!("{text:?}: {}\n", refused(text, Notation::Csv));
    }
    expect![[r#"
        "": Syntax { message: "EOF while parsing a value", line: 1 }
        "[]": Syntax { message: "invalid length 9, expected a task set", line: 1 }
        "null": Syntax { message: "invalid type: null, expected a task set", line: 1 }
        "{}": Syntax { message: "missing field `task`", line: 1 }
        "{\"name\": \"a\"}": Syntax { message: "missing field `task`", line: 1 }
        "{\"format\": \"\u{7}\"}": Syntax { message: "unknown field `format`, expected one of `generated`, `name`, `times`, `unit`, `levels`, `significance`, `cpus`, `rt_throttling`, `not_analysed`, `task`, `other`, `lock`, `operation`, `trigger`", line: 1 }
        "{\"task\": []}": fine: 0 tasks
        "{\"task\": [5]}": Syntax { message: "invalid type: integer `5`, expected a task", line: 1 }
        twice: Syntax { message: "duplicate field `sends`", line: 1 }
        "": Syntax { message: "missing field `task`", line: 1 }
        "task = 5": Syntax { message: "invalid type: integer `5`, expected a sequence", line: 1 }
        "[[task]]\nname = 'a'\nname = 'b'": Syntax { message: "duplicate key", line: 3 }
        "[[task]]\nname = 'a'\nperiod = 5": Of { section: "task", name: "a", error: Missing { key: "time", level: Level { bits: 4547007122018943789 } } }
        "[[task]]\nperiod = nan": NoName { section: "task", number: 1 }
        "x = [[": Syntax { message: "unclosed array, expected `]`", line: 1 }
        "": NoHeader
        "a,100,4,3\n": NoHeader
        "unit,us\nunit,ms\nname\n": Syntax { message: "duplicate field `unit`", line: 2 }
        "rt_throttling,maybe\nname\n": Syntax { message: "invalid type: string \"maybe\", expected a boolean", line: 1 }
        "unit,us\n\nname,period,time,priority\n,,,\n": NoTasks { line: 3 }
        "levels,1e-3\nname,period,time,priority\na,9,1,1\n": fine: 1 tasks
        "levels,1e-3,1e-4\nname,period,time,priority\na,9,1,1\n": fine: 1 tasks
        "name,period,time,wait,waits,priority\na,10,2,3,1,9\n": fine: 1 tasks
        "name,period,time,wait,waits,priority\na,10,2,3,often,9\n": Of { section: "task", name: "a", error: NoCount { key: "waits", text: "often", least: 0 } }
        "name,period,time,priority\na,9,1,1,5\n": WrongColumns { line: 2 }
        "name,period,time,time,priority\na,9,1,1,5\n": WrongColumns { line: 2 }
        "name,period,time,priority\na,9,1\n": Of { section: "task", name: "a", error: Missing { key: "priority", level: Level { bits: 4547007122018943789 } } }
        "name,period,tine,priority\n\na,9,1,1\n": Syntax { message: "unknown field `tine`, expected one of `name`, `component`, `period`, `sporadic`, `burst`, `thread`, `order`, `preemptive`, `wake_up`, `deadline`, `jitter`, `offset`, `clock`, `priority`, `cpus`, `time`, `wait`, `waits`, `machine`, `initial`, `classic_time`, `assumed`, `not_analysed`", line: 1 }
        "name,period,machine\n\na,9,x\n": Syntax { message: "invalid type: string \"x\", expected a sequence", line: 3 }
        "name,period,machine\na,9,x\n": Syntax { message: "invalid type: string \"x\", expected a sequence", line: 2 }
        "name,period,time,priority\n\"a\nb\",9,1,1\n": Of { section: "task", name: "a\nb", error: ControlCharacter("a\nb") }
        "name,period,time,priority\na,9,\"1\n": Of { section: "task", name: "a", error: Missing { key: "priority", level: Level { bits: 4547007122018943789 } } }
    "#]].assert_eq(&found);
}

/// Nothing that the analysis needs may be missing, and no key is ignored.
#[test]
fn every_key_is_needed_or_has_a_default() {
    let whole = example();
    let mut needed = Vec::new();
    let mut open = vec![(String::new(), &whole)];
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Array(values) => {
                open.extend(values.iter().enumerate().map(|(index, it)| (format!("{path}/{index}"), it)));
            }
            // Its keys are names of codels.
            Value::Object(_) if path.ends_with("/assumed") => {}
            Value::Object(fields) => {
                for (key, value) in fields {
                    let mut document = whole.clone();
                    document.pointer_mut(&path).unwrap().as_object_mut().unwrap().remove(key);
                    if parse(&document).is_err() {
                        needed.push(format!("{path}/{key}"));
                    }
                    open.push((format!("{path}/{key}"), value));
                }
                let mut document = whole.clone();
                document.pointer_mut(&path).unwrap()["wcet"] = 5.into();
                assert!(parse(&document).is_err(), "more in {path}");
            }
            _ => {}
        }
    }
    needed.sort();
    expect![[r#"
        /levels
        /operation/0/client
        /operation/0/name
        /operation/0/provider
        /operation/0/sends
        /operation/0/time
        /operation/1/client
        /operation/1/name
        /operation/1/provider
        /operation/1/sends
        /operation/1/time
        /other/0/name
        /other/0/period
        /other/0/priority
        /other/0/time
        /task
        /task/0/machine
        /task/0/machine/0/from
        /task/0/machine/0/time
        /task/0/machine/0/to
        /task/0/machine/1/from
        /task/0/machine/1/time
        /task/0/machine/1/to
        /task/0/machine/2/from
        /task/0/machine/2/time
        /task/0/machine/2/to
        /task/0/name
        /task/0/not_analysed
        /task/0/not_analysed/0/reason
        /task/0/period
        /task/0/priority
        /task/1/name
        /task/1/not_analysed
        /task/1/not_analysed/0/reason
        /task/1/period
        /task/1/priority
        /task/1/time
        /task/2/name
        /task/2/priority"#]]
    .assert_eq(&needed.join("\n"));
}

#[test]
fn sets_that_are_too_large() {
    let mut document = example();
    let other = |number: usize| {
        let mut other = example()["other"][0].take();
        other["name"] = format!("other {number}").into();
        other
    };
    let mut check = |key: &str, values: Vec<Value>| {
        let before = document[key].take();
        document[key] = values.into();
        let found = parse(&document).err();
        document[key] = before;
        found
    };
    let others: Vec<Value> = (0..MOST_TASKS - 2).map(other).collect();
    let too_many = |what, count, most| Some(TaskSetError::TooMany { what, count, most });
    assert_eq!(check("other", others[1..].to_vec()), None);
    assert_eq!(check("other", others), too_many("tasks", MOST_TASKS + 1, MOST_TASKS));
    let operations = vec![example()["operation"][0].take(); MOST_OPERATIONS + 1];
    assert_eq!(check("operation", operations[1..].to_vec()), None);
    assert_eq!(check("operation", operations), too_many("operations", MOST_OPERATIONS + 1, MOST_OPERATIONS));
    let levels: Vec<Value> = (2..67).map(|n| (1.0 / f64::from(n)).into()).collect();
    assert_eq!(check("levels", levels), too_many("levels", MOST_LEVELS + 1, MOST_LEVELS));
}

#[test]
fn many_states() {
    let states: Vec<String> = (0..20_000).map(|number| format!("S{number}")).collect();
    let time = Numbers::One(Number::Whole(1));
    let edge = |(from, to): (&String, &String)| EdgeEntry {
        from: from.clone(),
        to: to.clone(),
        time: time.clone(),
        wait: None,
        name: None,
    };
    let machine = states.iter().zip(states.iter().cycle().skip(1)).map(edge).collect();
    let number = |number| Some(Number::Whole(number));
    let task = TaskEntry {
        name: "C".to_owned(),
        period: number(5),
        priority: number(1),
        machine: Some(machine),
        ..TaskEntry::default()
    };
    let set = TaskSet { task: vec![task], ..TaskSet::default() };
    assert_eq!(TaskSet::parse(&set.to_json(), Notation::Json), Ok(set));
}

proptest! {
    #[test]
    fn no_text_fails(text in "(\\{|\\}|\\[|\\]|\"(unit|task|machine|cost|name)\"|:|,|=|name|\n|null|nan|1e400|-1|\\PC){0,40}") {
        for notation in [Notation::Json, Notation::Toml, Notation::Csv] {
            let _ = TaskSet::parse(&text, notation);
        }
    }

    /// Bytes that are lost or come in change no number into one that the text does not have.
    #[test]
    fn a_torn_file_is_refused(at in 0_usize..2000) {
        let text = parse(&example()).unwrap().to_json();
        let end = at % (text.len() - 2);
        prop_assert!(TaskSet::parse(&text[..end], Notation::Json).is_err());
    }
}
