//! `mauve trace import`: files of executions become runs of a sample file.

use std::path::Path;
use std::process::Command;

use mauve_tests::{Run, mauve, scratch, test_name, write};

use crate::MAUVE;

const HEADER: &str = "codel,execution_ns,instance,elapsed_ns,time_ns\n";

fn folder(files: &[(&str, &str)]) -> std::path::PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    write(&folder, files);
    folder
}

fn import(folder: &Path, arguments: &[&str]) -> Run {
    let arguments = [&["trace", "import"], arguments, &["--output", "robot.samples"]].concat();
    mauve(MAUVE, folder, &arguments)
}

/// The lines of the table, without its columns' widths.
fn lines(text: &str) -> Vec<String> {
    text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
}

#[test]
fn traces_become_runs() {
    let first = format!(
        "{HEADER}nav.plan,1000,pilot,1200,5000\nnav.plan,2000,pilot,2200,9000\nnav.Pilot/Free.run,5000000,pilot,,\n"
    );
    let folder = folder(&[
        ("monday/executions.csv", first.as_str()),
        ("tuesday.csv", "codel,execution_ns\nnav.plan,1500\n"),
    ]);
    let run = import(&folder, &["monday", "tuesday.csv"]);
    assert_eq!((run.code, run.err.as_str()), (0, ""));
    assert_eq!(
        lines(&run.out),
        [
            "codel or port instance executions least mean greatest",
            "nav.plan — 1 1.500 µs 1.500 µs 1.500 µs",
            "nav.plan pilot 2 1.000 µs 1.500 µs 2.000 µs",
            "and 1 execution of 1 program: --programs lists them",
            "imported 4 executions in 2 runs; robot.samples has 4 executions in 2 runs",
            "`robot.observed.toml` has what was observed; in mauve.toml, so that `mauve check` compares it with the timing tables:",
            "[timing]",
            "observed = [\"robot.observed.toml\"]",
        ]
    );
    // Each trace is imported once.
    let before = std::fs::read(folder.join("robot.samples")).unwrap();
    let run = import(&folder, &["monday/executions.csv"]);
    assert_eq!((run.code, run.out.as_str()), (2, ""));
    assert!(run.err.contains("was imported into `robot.samples` before, from `monday`"), "{}", run.err);
    assert_eq!(std::fs::read(folder.join("robot.samples")).unwrap(), before);
}

/// A line of a codel that executed for 0.06 ms, and ended after `elapsed`.
fn waiting(number: u64, elapsed: u64, waits: &str) -> String {
    format!("arm.read,60000,driver,{elapsed},{},{waits}\n", 1_000_000 * (number + 1))
}

#[test]
fn waits_are_told_and_remembered() {
    let header = "codel,execution_ns,instance,elapsed_ns,time_ns,waits\n";
    let recording = |waits: &str| {
        let lines = (0..10).map(|it| waiting(it, if it == 7 { 870_000 } else { 70_000 }, waits));
        format!("{header}{}", lines.collect::<String>())
    };
    let (waited, preempted) = (recording("1"), recording("0"));
    // As earlier versions wrote it.
    let unknown = recording("").replace(",waits", "").replace(",\n", "\n");
    let files = [("waited.csv", waited), ("preempted.csv", preempted), ("unknown.csv", unknown)];
    let folder = folder(&files.each_ref().map(|(name, text)| (*name, text.as_str())));

    let run = import(&folder, &["unknown.csv"]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(
        run.err.contains("codel `arm.read` was off the CPU for up to 810.0 µs, in 1 of 10 executions"),
        "{}",
        run.err
    );
    assert!(run.err.contains("[wait] \"arm.read\" = 0.81"), "{}", run.err);
    assert!(!run.out.contains("[wait]"), "{}", run.out);
    let remembered = || std::fs::read_to_string(folder.join("robot.observed.toml")).unwrap();
    assert!(remembered().contains("wait = 0.81\nwaits = \"unknown\"\n"), "{}", remembered());

    let mut alone = vec!["trace", "import", "preempted.csv", "-o", "other.samples"];
    let run = mauve(MAUVE, &folder, &alone);
    assert_eq!((run.code, run.err.as_str(), run.out.contains("[wait]")), (0, "", false), "{}", run.out);
    let other = std::fs::read_to_string(folder.join("other.observed.toml")).unwrap();
    assert!(!other.contains("wait"), "{other}");

    alone[2] = "waited.csv";
    let run = mauve(MAUVE, &folder, &alone);
    assert_eq!(run.code, 2, "the times of both are the same: {}", run.out);
    let run = mauve(MAUVE, &folder, &["trace", "import", "waited.csv", "-o", "third.samples"]);
    assert_eq!((run.code, run.err.as_str()), (0, ""), "{}", run.out);
    assert!(
        run.out.contains("codel `arm.read` waited for up to 810.0 µs, in 10 of 10 executions\n"),
        "{}",
        run.out
    );
    assert!(run.out.contains("\n[wait]\n\"arm.read\" = { time = 0.81, waits = 1 }\n"), "{}", run.out);
}

/// With other flags, times are others: one file for both programs would promise the times of one to the other.
#[test]
fn recordings_of_programs_that_were_built_differently_are_told_apart() {
    let rec = |build: &str, time: u64| format!("{HEADER}{build}f,7,a,8,{time}\n");
    let note = |flags: &str| format!("\"(build) GNU 12.2.0 x86_64 {flags}\",0,,,\n");
    let folder = folder(&[
        ("plain.csv", rec("", 50).as_str()),
        ("fast.csv", rec(&note("-O2 -DX=\"\"a,b\"\""), 100).as_str()),
        ("again.csv", rec(&note("-O2 -DX=\"\"a,b\"\""), 200).as_str()),
        ("slow.csv", rec(&note("-O0"), 300).as_str()),
    ]);
    for trace in ["plain.csv", "fast.csv", "again.csv"] {
        let run = import(&folder, &[trace]);
        assert!(run.code == 0 && !run.err.contains("was recorded with a program"), "{trace}: {}", run.err);
        assert!(run.out.contains("imported 1 execution in 1 run"), "a note is no execution: {}", run.out);
    }
    let run = import(&folder, &["slow.csv"]);
    let said = "`slow.csv` was recorded with a program of `GNU 12.2.0 x86_64 -O0`, and `again.csv` in `robot.observed.toml` with one of \
                `GNU 12.2.0 x86_64 -O2 -DX=\"a,b\"`";
    assert!(run.code == 0 && run.err.contains(said), "{}", run.err);
    let observed = std::fs::read_to_string(folder.join("robot.observed.toml")).unwrap();
    assert_eq!(observed.matches("build = ").count(), 3, "{observed}");
    assert!(observed.contains("build = 'GNU 12.2.0 x86_64 -O2 -DX=\"a,b\"'"), "{observed}");
}

#[test]
fn a_trace_that_cannot_be_read_adds_nothing() {
    let bad = format!("{HEADER}f,1,a,2,3\nf,NaN,a,2,4\n");
    let folder = folder(&[
        ("bad.csv", bad.as_str()),
        ("good.csv", "codel,execution_ns\nf,7\n"),
        ("open/executions.csv.partial", HEADER),
        ("empty.csv", HEADER),
        ("other/a.txt", ""),
        ("returns.csv", "codel,execution_ns\rf,7\r"),
        ("semicolons.csv", "codel;execution_ns\nf;7\n"),
        ("stubs/executions.csv", &format!("{HEADER}(from tables),0,,,\nf,7,a,8,100\n")),
        ("stubs/periods.csv", "instance,begin_ns,end_ns,execution_ns\na,1,100,8\n"),
    ]);
    for (trace, message) in [
        ("bad.csv", "`bad.csv`, line 3: `NaN` is not a time for `execution_ns`: write nanoseconds"),
        ("open", "`open/executions.csv.partial` is incomplete"),
        ("empty.csv", "`empty.csv` has no execution of a codel or a program"),
        (
            "returns.csv",
            "`returns.csv`, line 1: the lines end in a carriage return only: convert the file with `tr '\\r' '\\n' < FILE",
        ),
        (
            "semicolons.csv",
            "`semicolons.csv`, line 1: the fields are separated by `;`: convert the file with `tr ';' ','",
        ),
        ("other", "`other` is not a trace"),
        ("missing", "cannot read `missing`"),
        ("other/a.txt", "`other/a.txt`, line 1: the file is empty"),
        ("stubs", "the execution times in `stubs` are those of the timing tables"),
    ] {
        let run = import(&folder, &[trace]);
        assert_eq!((run.code, run.out.as_str()), (2, ""), "{trace}");
        assert!(run.err.contains(message), "{trace}: {}", run.err);
        assert!(!folder.join("robot.samples").exists(), "{trace}");
    }
    // The traces before it are imported.
    let run = import(&folder, &["good.csv", "bad.csv"]);
    assert_eq!(run.code, 2);
    assert!(run.out.contains("imported 1 execution in 1 run") && run.err.contains("line 3"), "{run:?}");
}

/// The cut number is a part of the greatest one: it is not taken for a small one.
#[test]
fn a_cut_file_is_read_up_to_the_cut() {
    let text = "codel,execution_ns\nnav.plan,1020\nnav.plan,9876";
    let folder = folder(&[("cut.csv", text)]);
    let run = import(&folder, &["cut.csv"]);
    assert_eq!(run.code, 0, "{run:?}");
    assert_eq!(lines(&run.out)[1], "nav.plan — 1 1.020 µs 1.020 µs 1.020 µs");
    assert!(run.err.contains("`cut.csv` was cut, such as by a power failure or a full disk"), "{}", run.err);
    assert!(run.err.contains("is used (1 execution)"), "{}", run.err);
}

#[test]
fn other_files_are_not_overwritten() {
    let folder = folder(&[("good.csv", "codel,execution_ns\nf,7\n"), ("robot.samples", "important\n")]);
    let run = import(&folder, &["good.csv"]);
    assert_eq!(run.code, 2);
    assert!(run.err.contains("`robot.samples` is not a sample file, and is not overwritten"), "{}", run.err);
    assert_eq!(std::fs::read_to_string(folder.join("robot.samples")).unwrap(), "important\n");
}

#[test]
fn lines_out_of_order_are_warned_of() {
    let text = format!("{HEADER}f,1,a,2,30\nf,1,a,2,20\nf,9000000,a,2,40\n");
    let folder = folder(&[("a.csv", text.as_str())]);
    let run = import(&folder, &["a.csv"]);
    assert_eq!(run.code, 0);
    assert!(run.err.contains("`a.csv`: a clock ran backwards at 1 execution:"), "{}", run.err);
    assert!(
        run.err.contains("`a.csv`: 1 execution used more CPU time than the time that passed"),
        "{}",
        run.err
    );
}

/// A limit of the size of files, in blocks of 512 bytes, is as a disk that is full.
#[test]
fn a_full_disk_leaves_the_sample_file_as_it_was() {
    let executions = |seed: u32| {
        let line = |it: u32| format!("nav.plan,{},pilot,,\n", (it.wrapping_mul(seed) >> 8) + 1000);
        format!("{HEADER}{}", (0..4000).map(line).collect::<String>())
    };
    let folder = folder(&[
        ("one.csv", executions(2_654_435_761).as_str()),
        ("two.csv", executions(2_246_822_519).as_str()),
        ("empty.samples", ""),
    ]);
    let import_within = |blocks: u32, trace: &str| {
        let script =
            format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" trace import {trace} -o robot.samples");
        Command::new("sh").args(["-c", &script, MAUVE]).current_dir(&folder).output().unwrap()
    };
    let samples = folder.join("robot.samples");
    for blocks in [0, 1] {
        let refused = import_within(blocks, "one.csv");
        let said = String::from_utf8_lossy(&refused.stderr);
        assert!(
            refused.status.code() == Some(2) && said.contains("cannot write `robot.samples`: "),
            "{blocks}: {said}"
        );
        assert!(!samples.exists(), "{blocks}");
    }
    assert_eq!(import(&folder, &["one.csv"]).code, 0);
    let before = std::fs::read(&samples).unwrap();
    let refused = import_within(before.len() as u32 / 512 + 2, "two.csv");
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
    assert_eq!(std::fs::read(&samples).unwrap(), before);

    let run = mauve(MAUVE, &folder, &["pwcet", "empty.samples"]);
    assert!(
        run.code == 2 && run.err.contains("`empty.samples` is empty: an import did not end"),
        "{}",
        run.err
    );
}

/// The lines can be pasted into the table that the project has: in its unit, without a key or a section that it has already.
#[test]
fn printed_lines_can_be_pasted_into_the_table() {
    let header = "codel,execution_ns,instance,elapsed_ns,time_ns,waits\n";
    let line = |codel: &str, at: u64| format!("arm.{codel},60000,driver,870000,{},1\n", 1_000_000 * at);
    let recording =
        [header.to_owned(), line("read", 1), line("send", 2), line("look", 3), line("stop", 4)].concat();
    let table = "unit = \"us\"\n[codel]\n\"arm.read\" = 100\n[wait]\n\"arm.send\" = 900\nlook = 700\n";
    let config = "timing.tables = [\"t*.toml\"]\n";
    let folder = folder(&[("rec.csv", &recording), ("times.toml", table), ("mauve.toml", config)]);
    let run = import(&folder, &["rec.csv"]);
    let printed = "for `times.toml` in us:\nunder [wait]\n\
                   \"arm.read\" = { time = 810, waits = 1 }\n\"arm.stop\" = { time = 810, waits = 1 }\n\
                   in `times.toml`, replace `look`: \"arm.look\" = { time = 810, waits = 1 }\n";
    assert!(run.out.contains(printed), "{}", run.out);
    assert!(!run.out.contains("arm.send\" ="), "{}", run.out);
    let pasted = format!("{table}{}", "\"arm.read\" = { time = 810, waits = 1 }\n");
    assert_eq!(mauve_timing::Table::parse(&pasted).errors, []);
}
