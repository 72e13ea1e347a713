//! Codels that wait and take locks where it is easy to overlook: in operations that are executed for others, and within other locks.

use std::path::{Path, PathBuf};

use mauve_tests::{mauve, scratch, test_name, write};
use serde_json::Value;

use crate::MAUVE;

/// Writes a robot: its components, activities and instances, `[codel]` and what follows in the table, and the configuration.
fn robot(name: &str, model: &str, times: &str, config: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("{}-{name}", test_name()));
    let config = format!(
        "timing.tables = [\"times.toml\"]\nplatform = {{ cpus = 2, rt_throttling = false }}\n{config}"
    );
    write(&folder, &[("robot.mal", model), ("mauve.toml", &config), ("times.toml", times)]);
    folder
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let found = mauve(MAUVE, folder, &[arguments, &["--format", "json"]].concat());
    serde_json::from_str(&found.out).unwrap_or_else(|_| panic!("{}{}", found.out, found.err))
}

fn response(folder: &Path, instance: &str) -> Option<f64> {
    let found = json(folder, &["wcrt"]);
    let mut all = found["results"][0]["activities"].as_array().unwrap().iter();
    all.find(|it| it["instance"] == instance).unwrap()["response"].as_f64()
}

/// `eye` writes for `wheels`, below it on the CPU, and executes `ask` for `talker`; `high` is above both, and `low` between them.
const CALLS: &str = "
codel sense(): int
codel slow(): int
codel act(in x: int): void
codel high(): void
codel low(): void
shell Eye { output port out: int  provide ask(): int }
core EyeCore(Eye) { provide ask(): int = { return slow(); }  update = { write(out, sense()); } }
component Camera(Eye, EyeCore)
shell Wheels { input port inp: int }
core WheelsCore(Wheels) { var x: int; update = { read(inp, x); act(x); } }
component Base(Wheels, WheelsCore)
shell Talk { require ask(): int }
core TalkCore(Talk) { handler h: ask; update = { h = send(ask); } }
component Talker(Talk, TalkCore)
shell None {}
core HighCore(None) { update = { high(); } }
core LowCore(None) { update = { low(); } }
component High(None, HighCore)
component Low(None, LowCore)
architecture A {
  instance eye: Camera  instance wheels: Base  instance talker: Talker  instance high: High  instance low: Low
  connection eye.out -> wheels.inp
  operation eye.ask -> talker.ask
}
deployment Robot {
  architecture A
  activity high { affinity = 1 priority = 40 period = 60 }
  activity eye { affinity = 1 priority = 30 period = 100 }
  activity low { affinity = 1 priority = 25 period = 50 }
  activity wheels { affinity = 1 priority = 20 period = 150 }
  activity talker { affinity = 2 priority = 10 period = 190 }
}
";

const TIMES: &str = "unit = \"ms\"\n[codel]\nsense = 1\nslow = 5\nact = 1\nlow = 5\nhigh = 10\n";

/// While `eye` waits in a call, `wheels` may read before it has written: its whole response time counts.
#[test]
fn a_call_that_waits_delays_the_write() {
    let chain = "[chains.drive]\nfrom = 'sense'\nto = 'act'\n";
    let latency = |name: &str, wait: &str| {
        let folder = robot(name, CALLS, &format!("{TIMES}{wait}"), chain);
        let found = json(&folder, &["chains"])["chains"][0]["latency"].as_f64().unwrap();
        let [eye, wheels] = ["eye", "wheels"].map(|it| response(&folder, it).unwrap());
        (found, eye, wheels)
    };
    // At most two periods, and the job of `wheels`: `eye` has written before.
    let (found, _, wheels) = latency("executes", "");
    assert_eq!(found, 100.0 + 150.0 + wheels);
    let (found, eye, wheels) = latency("waits", "[wait]\nslow = 20\n");
    assert_eq!(found, 100.0 + eye + 150.0 + wheels);
}

/// While `eye` waits in a call, `low` may take the lock again: how often is unknown.
#[test]
fn a_call_that_waits_lets_a_lock_be_taken() {
    let lock = "[locks.bus]\ncodels = ['sense', 'low']\nprotocol = 'inheritance'\n";
    assert!(response(&robot("executes", CALLS, TIMES, lock), "eye").is_some());
    let folder = robot("waits", CALLS, &format!("{TIMES}[wait]\nslow = 20\n"), lock);
    assert!(response(&folder, "eye").is_none());
    let said = mauve(MAUVE, &folder, &["wcrt"]).out;
    assert!(said.contains("while `eye` waits, a lower priority may take the lock `bus` again"), "{said}");
    // The file of the tasks knows it too.
    let generated = mauve(MAUVE, &folder, &["generate", "--out", "generated"]);
    assert_eq!(generated.code, 0, "{}", generated.err);
    let set = std::fs::read_dir(folder.join("generated")).unwrap().next().unwrap().unwrap();
    let found = mauve(MAUVE, &set.path(), &["wcrt", "models/Robot.json"]).out;
    assert!(found.contains("while `eye` waits, a lower priority may take the lock `bus` again"), "{found}");
}

/// `holder` takes two locks at once. While it waits for the one of `other`, it keeps that of `high`.
#[test]
fn a_lock_is_held_while_its_holder_waits_for_another() {
    const MODEL: &str = "
codel high(): void
codel holder(): void
codel other(): void
shell None {}
core HighCore(None) { update = { high(); } }
core HolderCore(None) { update = { holder(); } }
core OtherCore(None) { update = { other(); } }
component High(None, HighCore)
component Holder(None, HolderCore)
component Other(None, OtherCore)
architecture A { instance high: High  instance holder: Holder  instance other: Other }
deployment Robot {
  architecture A
  activity high { affinity = 1 priority = 30 period = 100 }
  activity holder { affinity = 1 priority = 10 period = 300 }
  activity other { affinity = CPU priority = 5 period = 300 }
}
";
    let times = "unit = \"ms\"\n[codel]\nhigh = 2\nholder = 3\nother = 60\n";
    for (cpu, protocol, found) in
        [("1", "ceiling", Some(5.0)), ("2", "ceiling", None), ("1", "inheritance", None)]
    {
        let locks = ["a", "b"].map(|lock| {
            let with = if lock == "a" { "other" } else { "high" };
            format!("[locks.{lock}]\ncodels = ['holder', '{with}']\nprotocol = '{protocol}'\n")
        });
        let folder = robot(&format!("{protocol}-{cpu}"), &MODEL.replace("CPU", cpu), times, &locks.concat());
        assert_eq!(response(&folder, "high"), found, "{protocol} on {cpu}");
    }
}

/// A codel that sleeps for 8 ms leaves the CPU and returns: two context switches, beside the two of each job. A longer wait is as long as
/// its wake-up takes.
#[test]
fn a_wait_has_its_context_switches() {
    const MODEL: &str = "
codel nap(): int
shell None {}
core NapCore(None) { update = { nap(); } }
component Nap(None, NapCore)
architecture A { instance nap: Nap }
deployment Robot { architecture A  activity nap { affinity = 1 priority = 30 period = 100 } }
";
    for (name, wait, expected, row) in [
        // 1 to execute, 2 × 0.5 in each job, and 2 × 0.5 for each wait.
        ("once", "{ time = 8, waits = 1 }", 11.0, "- context switches of its waits 1 ms\n"),
        ("thrice", "{ time = 8, times = 3 }", 13.0, "- context switches of its waits 3 ms\n"),
        // How often is not known: they are in the time.
        ("unknown", "8", 10.0, ""),
    ] {
        let times = format!(
            "unit = \"ms\"\n[codel]\nnap = 1\n[wait]\nnap = {wait}\n[overhead]\ncontext_switch = 0.5\n"
        );
        let folder = robot(name, MODEL, &times, "");
        assert_eq!(response(&folder, "nap"), Some(expected), "{name}");
        let said = mauve(MAUVE, &folder, &["wcrt", "--explain", "nap"]).out;
        let rows = "- update 1 ms: nap 1 ms\n- dispatch and context switches 1 ms\n";
        let waits = "- waits of its codels, until the thread runs again 8 ms\n";
        let shown = format!("costliest period: {expected} ms, update\n\n{rows}{row}{waits}");
        assert!(said.contains(&shown), "{name}: {said}");
        // The document of the tasks has the same figure.
        let generated = mauve(MAUVE, &folder, &["generate", "--out", "generated"]);
        assert_eq!(generated.code, 0, "{}", generated.err);
        let set = std::fs::read_dir(folder.join("generated")).unwrap().next().unwrap().unwrap();
        let found = json(&set.path(), &["wcrt", "models/Robot.json"]);
        assert_eq!(found["results"][0]["activities"][0]["response"].as_f64(), Some(expected), "{name}");
    }
    // Too many switches to count are no bound, rather than none of them.
    let times = "unit = \"ms\"\n[codel]\nnap = 1\n[wait]\nnap = { time = 8, times = 4000000000000000000 }\n[overhead]\ncontext_switch = 0.5\n";
    assert_eq!(response(&robot("endless", MODEL, times, ""), "nap"), None);
}

/// A loop and a service below it, which sleeps while it holds their lock.
const BUS: &str = "
codel exchange(): int
codel service(): int
codel idle(): int
shell None {}
shell Bus { provide help(): int }
shell Client { require help(): int }
core Cyclic(None) { update = { exchange(); } }
core House(Bus) { provide help() = { return SERVED(); }  update = { DONE(); } }
core Asking(Client) { handler h: help  update = { h = send(help); } }
component Loop(None, Cyclic)
component Service(Bus, House)
component Asker(Client, Asking)
architecture A { instance cyclic: Loop  instance house: Service  instance asker: Asker  operation house.help -> asker.help }
deployment Robot {
  architecture A
  activity cyclic { affinity = 1 priority = 90 period = 1 }
  activity house { affinity = 1 PRIORITY }
  activity asker { affinity = 2 priority = 1 period = 100 }
}
";

/// While the holder waits, the loop waits for the lock: at least 2.12 ms for its 1 ms.
#[test]
fn a_lock_whose_holder_waits_has_no_bound() {
    let times = "unit = \"ms\"\n[codel]\nexchange = 0.12\nservice = 0.2\nidle = 0.1\n";
    let wait = "[wait]\nservice = { time = 2, times = 4 }\n";
    let of = |name: &str, priority: &str, protocol: &str, is_served: bool, wait: &str| {
        let [served, done] = if is_served { ["service", "idle"] } else { ["idle", "service"] };
        let model = BUS.replace("SERVED", served).replace("DONE", done).replace("PRIORITY", priority);
        let locks = format!("[locks.port]\ncodels = ['exchange', 'service']\nprotocol = '{protocol}'\n");
        robot(name, &model, &format!("{times}{wait}"), &locks)
    };
    let real_time = "priority = 20 period = 10";
    for (name, priority, protocol, is_served) in [
        ("inheritance", real_time, "inheritance", false),
        ("ceiling", real_time, "ceiling", false),
        ("none", real_time, "none", false),
        ("by-an-operation", real_time, "inheritance", true),
        ("in-the-background", "priority = background", "inheritance", false),
        ("ceiling-in-the-background", "priority = background", "ceiling", false),
    ] {
        let folder = of(name, priority, protocol, is_served, "");
        assert!(response(&folder, "cyclic").is_some(), "{name} without a wait");
        let folder = of(&format!("{name}-waits"), priority, protocol, is_served, wait);
        assert_eq!(response(&folder, "cyclic"), None, "{name}");
        let found = mauve(MAUVE, &folder, &["check"]);
        assert_eq!(found.code, 1, "{}", found.out);
        for said in [
            "`house` may hold the lock `port` for an unknown time",
            "`service` waits while it holds the lock",
        ] {
            assert!(found.out.contains(said), "{name}: {}", found.out);
        }
        // What is not proved is certified neither.
        let found = mauve(MAUVE, &folder, &["wcrt", "--certificate", "proof.json"]);
        assert!(found.err.is_empty(), "{}", found.err);
        let found = mauve(MAUVE, &folder, &["verify", "proof.json"]);
        assert!(found.code == 1 && found.out.contains("cyclic: not certified"), "{}", found.out);
    }
}

/// `middle` takes a ceiling within the other one. While `low` sleeps with it, `high` waits for both.
#[test]
fn a_chain_of_locks_whose_last_holder_waits_has_no_bound() {
    const MODEL: &str = "
codel high(): void
codel middle(): void
codel low(): void
shell None {}
core HighCore(None) { update = { high(); } }
core MiddleCore(None) { update = { middle(); } }
core LowCore(None) { update = { low(); } }
component High(None, HighCore)
component Middle(None, MiddleCore)
component Low(None, LowCore)
architecture A { instance high: High  instance middle: Middle  instance low: Low }
deployment Robot {
  architecture A
  activity high { affinity = 1 priority = 30 period = 20 }
  activity middle { affinity = 1 priority = 20 period = 50 }
  activity low { affinity = 1 priority = 10 period = 100 }
}
";
    let locks = "[locks.a]\ncodels = ['high', 'middle']\nprotocol = 'ceiling'\n\
                 [locks.b]\ncodels = ['middle', 'low']\nprotocol = 'ceiling'\n";
    let times = "unit = \"ms\"\n[codel]\nhigh = 0.5\nmiddle = 0.5\nlow = 0.2\n";
    assert_eq!(response(&robot("executes", MODEL, times, locks), "high"), Some(1.0));
    let folder = robot("waits", MODEL, &format!("{times}[wait]\nlow = 6\n"), locks);
    assert_eq!(response(&folder, "high"), None);
    let said = mauve(MAUVE, &folder, &["wcrt"]).out;
    assert!(
        said.contains("`middle` may hold the lock `a` for an unknown time, since it shares locks with `low`"),
        "{said}"
    );
}

/// 5 + 5 + 5, throttled for 50, and the lock of the background twice: before, and while the activity is throttled.
#[test]
fn the_background_takes_a_lock_again_while_real_time_is_throttled() {
    const MODEL: &str = "
codel first(): void
codel between(): void
codel log(): void
shell None {}
core Both(None) { update = { first(); between(); first(); } }
core Log(None) { update = { log(); } }
component Loop(None, Both)
component Logger(None, Log)
architecture A { instance loop_1: Loop  instance logger: Logger }
deployment Robot {
  architecture A
  activity loop_1 { affinity = 1 priority = 20 period = 1000 }
  activity logger { affinity = 1 priority = background }
}
";
    let lock = "[locks.a]\ncodels = ['first', 'log']\nprotocol = 'inheritance'\n";
    let times = "unit = \"ms\"\n[codel]\nfirst = 5\nbetween = 5\nlog = 40\n";
    let folder = robot("free", MODEL, times, lock);
    assert_eq!(response(&folder, "loop_1"), Some(55.0));
    let config = std::fs::read_to_string(folder.join("mauve.toml")).unwrap();
    write(&folder, &[("mauve.toml", &config.replace("rt_throttling = false", "rt_throttling = true"))]);
    assert_eq!(response(&folder, "loop_1"), Some(145.0));
    // A file of the tasks and the certificate say the same.
    let found = mauve(MAUVE, &folder, &["check", "--verify"]);
    assert_eq!((found.code, found.err.as_str()), (0, ""), "{}", found.out);
}

/// A codel that goes from one ceiling to the next holds one or the other.
#[test]
fn a_codel_with_two_ceilings_holds_them_one_after_the_other() {
    const MODEL: &str = "
codel fast(): void
codel slow(): void
shell None {}
core Fast(None) { update = { fast(); } }
core Slow(None) { update = { slow(); } }
component High(None, Fast)
component Low(None, Slow)
architecture A { instance high: High  instance low: Low }
deployment Robot {
  architecture A
  activity high { affinity = 1 priority = 20 period = 10 }
  activity low { affinity = 1 priority = 10 period = 20 }
}
";
    let lock = |name: &str, held: &str| {
        format!("[locks.{name}]\ncodels = ['fast', 'slow']\nprotocol = 'ceiling'\nheld = '{held}'\n")
    };
    let times = "unit = \"ms\"\n[codel]\nfast = 2\nslow = 6\n";
    // Not for longer than the codel takes.
    for (held, expected) in [("2 ms", 6.0), ("5 ms", 8.0)] {
        let folder = robot(held, MODEL, times, &[lock("a", held), lock("b", held)].concat());
        assert_eq!(response(&folder, "high"), Some(expected), "{held}");
    }
}
