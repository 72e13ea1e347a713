//! While `mauve generate` is at work, somebody exchanges its folders for links and back, at any moment: nothing
//! is written, changed or removed where the links lead.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{MetadataExt as _, symlink};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use mauve_tests::{Random, copy, mauve, scratch, search, write};

use crate::MAUVE;

const CONFIG: &str = "assume.codel = \"1 ms\"\nplatform.rt_throttling = false\n[generate]\nout = \"out\"\n";

const MODEL: &str = "library maths {
  codel half(in x: double): double
}
library motion {
  use maths
  codel clearance(in width: double): double
  shell S { property gain: double = 0.5  output port speed: double }
  core C(S) {
    var v: double = 0.0
    update = { v = clearance(gain); v = half(v); write(speed, v); }
  }
  component Guide(S, C)
  component Spare(S, C)
}
library robot {
  architecture A { instance guide: motion.Guide }
  deployment D { architecture A  activity guide { priority = 1 period = 100 } }
}
";

/// In a full search, packages are generated so often, while names change places so often at least.
const RUNS: u64 = 600;
const EXCHANGES: u64 = 10_000;

/// The number of exchanges in a burst: a link exists for less time than a check and a write take.
const BURST: usize = 200;

/// The properties of a file or a folder: its text, its inode, the time of its last change, its mode. A temporary file
/// in a folder changes the time of the folder.
type Entry = (Vec<u8>, u64, (i64, i64), u32);

fn everything(folder: &Path) -> BTreeMap<PathBuf, Entry> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        let data = path.symlink_metadata().unwrap();
        let mut text = Vec::new();
        if data.is_dir() {
            open.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else {
            text = fs::read(&path).unwrap();
        }
        found.insert(path, (text, data.ino(), (data.mtime(), data.mtime_nsec()), data.mode()));
    }
    found
}

/// Two names change places, at once where the system has that.
fn exchange(a: &Path, b: &Path) {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE).unwrap();
    }
    #[cfg(not(target_os = "linux"))]
    {
        let aside = b.with_extension("aside");
        fs::rename(a, &aside).unwrap();
        fs::rename(b, a).unwrap();
        fs::rename(aside, b).unwrap();
    }
}

/// Exchanges a folder and a link, there and back, in bursts. Between two of them there is time for a run that
/// succeeds.
fn attack(folder: &Path, link: &Path, made: &AtomicUsize, is_over: &AtomicBool) {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    while !is_over.load(Ordering::Relaxed) {
        for _ in 0..BURST {
            exchange(folder, link);
            made.fetch_add(1, Ordering::Relaxed);
            let end = Instant::now() + Duration::from_micros(random.below(100) as u64);
            while Instant::now() < end {
                std::hint::spin_loop();
            }
        }
        // Some runs end without an exchange.
        std::thread::sleep(Duration::from_millis(random.below(500) as u64));
    }
}

/// Generates again and again, each time from another model, while the folder `inner` of the project is
/// exchanged for a link to its like outside.
fn race(name: &str, inner: &str) {
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("generate_races_{name}"));
    let top = top.canonicalize().unwrap();
    let robot = top.join("robot");
    let mut runs = 0;
    let mut run = || {
        runs += 1;
        // Files are made, changed and removed, each time.
        let model = MODEL.replace("Spare", &format!("Spare{runs}"));
        write(&robot, &[("robot.mal", model.as_str()), ("mauve.toml", CONFIG)]);
        mauve(MAUVE, &robot, &["generate"])
    };
    let first = run();
    assert_eq!(first.code, 0, "{}", first.err);
    // All is there that a run could look for.
    copy(&robot.join("out"), &top.join("outside/out"));
    let link = top.join("link");
    symlink(top.join("outside").join(inner), &link).unwrap();
    let before = everything(&top.join("outside"));
    let (made, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let wanted = search::cases::<usize>("MAUVE_RACES", RUNS);
    let exchanges = search::share(EXCHANGES) as usize;
    let mut results = Vec::new();
    std::thread::scope(|scope| {
        let attacker = scope.spawn(|| attack(&robot.join(inner), &link, &made, &is_over));
        // A failure waits until the end, which would not come otherwise.
        while !attacker.is_finished() && (results.len() < wanted || made.load(Ordering::Relaxed) < exchanges)
        {
            results.push(run());
        }
        is_over.store(true, Ordering::Relaxed);
    });
    assert!(results.len() >= wanted && made.load(Ordering::Relaxed) >= exchanges);
    for it in &results {
        assert!([0, 1, 2].contains(&it.code), "{}: {}", it.code, it.err);
        assert!(!it.err.contains("could not be put back"), "{}", it.err);
    }
    let done = results.iter().filter(|it| it.code == 0).count();
    let refused = results.len() - done;
    assert!(done > 0, "{refused} runs were refused, and no other one was made");
    assert_eq!(everything(&top.join("outside")), before, "{done} runs were done, {refused} were refused");
    // Refused runs leave no files.
    let last = run();
    assert_eq!(last.code, 0, "{}", last.err);
    let check = mauve(MAUVE, &robot, &["generate", "--check"]);
    assert_eq!(check.code, 0, "{}{}", check.out, check.err);
    assert_eq!(everything(&top.join("outside")), before);
}

#[test]
fn the_folder_of_the_packages_is_exchanged() {
    race("out", "out");
}

#[test]
fn the_folder_of_a_package_is_exchanged() {
    race("package", "out/motion");
}
