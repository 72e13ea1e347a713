//! Releases by data follow what writes the data: figures by hand.

use expect_test::{Expect, expect};
use mauve_hir::Database;
use mauve_timing::Method;
use mauve_wcrt::chains::chains_of;
use mauve_wcrt::{Query, response_times};

use crate::common::{LEVEL, deployments, verdicts, workspace};

/// A vehicle whose navigation any of three sensors releases, and whose control the navigation releases.
const VEHICLE: &str = "
codel do_imu(): int  codel do_dvl(): int  codel do_depth(): int  codel do_nav(in x: int, in y: int, in z: int): int
codel do_control(in x: int): int  codel do_alloc(in x: int): int  codel do_esc(in x: int): int
shell SensorShell { output port o: int }
shell NavShell { input port acc: int  input port vel: int  input port z: int  output port o: int }
shell PartShell { input port i: int  output port o: int }
core ImuCore(SensorShell) { update = { write(o, do_imu()); } }
core DvlCore(SensorShell) { update = { write(o, do_dvl()); } }
core DepthCore(SensorShell) { update = { write(o, do_depth()); } }
core NavCore(NavShell) {
  var a: int = 0  var v: int = 0  var d: int = 0
  update = { read(acc, a); read(vel, v); read(z, d); write(o, do_nav(a, v, d)); }
}
core ControlCore(PartShell) { var v: int = 0  update = { read(i, v); write(o, do_control(v)); } }
core AllocCore(PartShell) { var v: int = 0  update = { read(i, v); write(o, do_alloc(v)); } }
core EscCore(PartShell) { var v: int = 0  update = { read(i, v); do_esc(v); } }
component Imu(SensorShell, ImuCore)  component Dvl(SensorShell, DvlCore)  component Depth(SensorShell, DepthCore)
component Nav(NavShell, NavCore)  component Control(PartShell, ControlCore)
component Alloc(PartShell, AllocCore)  component Esc(PartShell, EscCore)
architecture A {
  instance imu: Imu  instance dvl: Dvl  instance depth: Depth  instance nav: Nav
  instance control: Control  instance alloc: Alloc  instance esc: Esc
  connection imu.o -> nav.acc
  connection dvl.o -> nav.vel
  connection depth.o -> nav.z
  connection nav.o -> control.i
  connection control.o -> alloc.i
  connection alloc.o -> esc.i
}
deployment D {
  architecture A
  activity imu { cpus = [1] priority = 50 rate = 100 Hz }
  activity dvl { cpus = [1] priority = 45 rate = 5 Hz }
  activity depth { cpus = [1] priority = 46 rate = 20 Hz }
  activity nav { cpus = [1] priority = 40 trigger = any [acc, vel, z] least = 3 }
  activity control { cpus = [1] priority = 35 trigger = i least = 9 deadline = 30 }
  activity alloc { cpus = [1] priority = 34 rate = 20 Hz }
  activity esc { cpus = [1] priority = 33 rate = 50 Hz }
}
//- /mauve.toml
timing.tables = ['times.toml']
platform = { cpus = 1, rt_throttling = false }
[chains.hold]
from = 'imu.o'
to = 'esc.i'
through = ['nav.acc', 'nav.o', 'control.i', 'control.o', 'alloc.i', 'alloc.o']
[chains.drift]
from = 'dvl.o'
to = 'esc.i'
through = ['nav.vel', 'nav.o', 'control.i', 'control.o', 'alloc.i', 'alloc.o']
//- /times.toml
unit = 'us'
[codel]
do_imu = 300
do_dvl = 500
do_depth = 200
do_nav = 2500
do_control = 1800
do_alloc = 700
do_esc = 400
[wait]
do_dvl = { time = 4000, times = 1 }
do_depth = { time = 2500, times = 1 }
";

/// The response times, the utilisation of each CPU in parts of 10,000, and the latencies of chains.
fn figures(fixture: &str) -> String {
    let mut out = verdicts(fixture);
    let db = Database::default();
    let query = Query { level: LEVEL, method: Method::Best };
    let [(project, decl)] = deployments(&db, workspace(&db, fixture))[..] else { panic!("one deployment") };
    for load in &response_times(&db, project, decl, query).cpus {
        out += &format!("CPU {:.0}\n", 1e4 * load.utilisation.as_f64());
    }
    for chain in chains_of(&db, project, decl, query).all.iter().filter(|it| it.declared.is_some()) {
        let latency = chain.latency.map_or("—".to_owned(), |it| it.to_string());
        out += &format!("{}: {latency}\n", chain.name);
    }
    out
}

fn check(fixture: &str, expected: Expect) {
    expected.assert_eq(&figures(fixture));
}

/// CPU, without waits: 0.3/10 + 0.2/50 + 0.5/200 + 2.5 · 125 Hz + 1.8/9 + 0.7/50 + 0.4/20 = 58.3 %. With `least = 3` alone, `nav` would have
/// 83.3 %, and the CPU 110.4 %.
///
/// Waits of `depth` and `dvl` delay others by their lateness: `depth` 0.2 + 2.5 + 0.3 = 3, `dvl` 0.5 + 4 + 0.3 + 0.2 = 5. `nav`: 2.5 +
/// 0.3 + 0.2 + 0.5 = 3.5; its second job, released at 3, ends at 6.
///
/// In a window of t, `nav` has 1 job and one for each datum, ⌈(t + 0.3)/10⌉ + ⌈(t + 3)/50⌉ + ⌈(t + 5)/200⌉, but ⌈t/3⌉ at most: 5 jobs from 12
/// on, 6 from 19.7 to 29.7. `control` has ⌈t/9⌉ jobs.
/// - `control`: 1.8 + 2 · 0.3 + 0.2 + 0.5 + 5 · 2.5 = 15.6, and its second job ends at 17.4, before the third one is released.
/// - `alloc`: 0.7 + 3 · 0.3 + 0.2 + 0.5 + 6 · 2.5 + 3 · 1.8 = 22.7.
/// - `esc`: 0.4 + 0.7 + 3 · 0.3 + 0.2 + 0.5 + 6 · 2.5 + 3 · 1.8 = 23.1, and its second job, released at 20, ends at 23.5.
///
/// Each chain waits for a period of the sensor, for the next release of `nav`, `control` (15.6 after the release of `nav`, whose data it
/// awaits with a lower priority), `alloc` and `esc`, and for the response of `esc`: 10 + 3.5 + 15.6 + 50 + 20 + 23.1 = 122.2. `nav` may
/// execute while `dvl` waits, and is then released 3.5 after the write: 200 + 5 + 3.5 + 15.6 + 50 + 20 + 23.1 = 317.2.
#[test]
fn any_of_three_sensors_releases_the_navigation() {
    check(
        VEHICLE,
        expect![[r#"
        imu met 0.3 ms
        dvl met 5 ms
        depth met 3 ms
        nav missed 3.5 ms
        control met 15.6 ms
        alloc met 22.7 ms
        esc missed 23.1 ms
        CPU 5830
        drift: 317.2 ms
        hold: 122.2 ms
    "#]],
    );
}

/// Where it is not known how often a port is written, `least` alone counts: 2.5/3 of the CPU.
#[test]
fn what_writes_a_port_may_be_unknown() {
    let cpu = |of: &str, by: &str| {
        assert!(VEHICLE.contains(of), "{of}");
        let found = figures(&VEHICLE.replace(of, by));
        found.lines().find(|line| line.starts_with("CPU")).unwrap_or_default().to_owned()
    };
    let known = cpu("least = 3", "least = 3");
    assert_eq!(known, "CPU 5830");
    // A write more in each job of the sensor of 5 Hz; only one port of three.
    assert_eq!(cpu("write(o, do_dvl());", "write(o, 1); write(o, do_dvl());"), "CPU 5955");
    // It keeps its 2.5 · 125 Hz where a release needs data at all ports: 5 Hz.
    assert_eq!(cpu("trigger = any [acc, vel, z]", "trigger = all [acc, vel, z]"), "CPU 920");
    let by_least = "CPU 11038";
    for (of, by) in [
        // A buffer keeps what one job leaves for the next one.
        ("dvl.o -> nav.vel", "dvl.o -> [2] nav.vel"),
        // No job writes what a hook writes.
        (
            "{ update = { write(o, do_dvl()); } }",
            "{ start = { write(o, 1); } update = { write(o, do_dvl()); } }",
        ),
        ("priority = 45 rate = 5 Hz", "priority = background"),
    ] {
        let found = cpu(of, by);
        assert!(found == by_least || by.contains("background") && found == "CPU 11013", "{of}: {found}");
    }
}
