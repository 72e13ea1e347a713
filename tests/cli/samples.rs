//! The small sample projects: what each shows is so.

use mauve_tests::{mauve, models};
use serde_json::Value;

use crate::MAUVE;

fn activities(model: &str, arguments: &[&str]) -> Vec<Value> {
    let arguments = [&["wcrt", "--format", "json"], arguments].concat();
    let document: Value = serde_json::from_str(&mauve(MAUVE, &models().join(model), &arguments).out).unwrap();
    document["results"][0]["activities"].as_array().unwrap().clone()
}

fn responses(model: &str, arguments: &[&str]) -> Vec<f64> {
    activities(model, arguments).iter().map(|it| it["response"].as_f64().unwrap()).collect()
}

#[test]
fn only_paths_prove_the_sorter() {
    for (method, monitor) in [("psm", 38.0), ("ibf", 38.0), ("exact", 28.0), ("best", 28.0)] {
        assert_eq!(responses("sorter", &["--method", method]), [7.0, 18.0, monitor], "{method}");
    }
    let checked = mauve(MAUVE, &models().join("sorter"), &["check"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    assert!(checked.out.contains("all 3 deadlines are proved"), "{}", checked.out);
}

#[test]
fn operations_and_sets_of_cpus_have_all_figures() {
    let model = "shared_cpus";
    let checked = mauve(MAUVE, &models().join(model), &["check"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    assert!(checked.out.contains("all 6 deadlines are proved"), "{}", checked.out);
    assert!(checked.out.contains("CPUs 1 and 2 utilisation: 113.0 % of 200 %"), "{}", checked.out);
    // wheels: with the network driver. pilot: 3, wheels, the driver twice, and its jitter. map: 5, three calls of 3, and the laser.
    assert_eq!(responses(model, &[]), [2.2, 8.0, 5.9, 22.0, 13.6, 47.0]);
    let map = &activities(model, &[])[3];
    assert_eq!(map["own"], 14);
    let calls: Vec<String> = map["calls"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| format!("{} for {}: {} in {} ms", it["operation"], it["client"], it["calls"], it["time"]))
        .collect();
    // ⌈⌈(50 + 22 + 5.9)/20⌉/2⌉, since each second job of the pilot sends, and ⌈(50 + 22 + 13.6)/100⌉.
    assert_eq!(calls, ["\"way\" for \"pilot\": 2 in 6 ms", "\"way\" for \"tour\": 1 in 3 ms"]);
    let simulated = mauve(MAUVE, &models().join(model), &["simulate", "--for", "20s"]);
    assert_eq!(simulated.code, 0, "{}", simulated.out);
    // The network driver has its name in each form of a schedule.
    for format in ["svg", "json", "perfetto"] {
        let simulated =
            mauve(MAUVE, &models().join(model), &["simulate", "--for", "100ms", "--format", format]);
        assert!(simulated.out.contains("network (platform)"), "{format}");
        assert!(!simulated.out.contains("throttling"), "{format}");
        let call = if format == "json" { "\"operation\": \"way\"" } else { "way for pilot" };
        assert!(simulated.out.contains(call), "{format}: {call}");
    }
}

/// A sample after a public system.
struct Robot {
    model: &'static str,
    deadlines: usize,
    /// Each declared chain, in the order of names: the parts of its latency in milliseconds, added by hand as its README does, and its
    /// limit.
    chains: &'static [(&'static str, &'static [f64], f64)],
}

const ROBOTS: [Robot; 5] = [
    Robot {
        model: "ethercat_arm",
        deadlines: 6,
        // The control thread ends after its wake-up, its four functions and the master: 24 + 250 + 60 µs; its controller, after
        // 24 + 180 + 60. The servo node is preempted once by the force sensor: 924 + 104.
        chains: &[
            ("contact", &[2.0, 8.0, 1.028, 1.0, 0.334], 15.0),
            ("inner", &[1.0, 0.334], 2.0),
            ("outer", &[1.0, 0.264, 8.0, 1.028, 1.0, 0.334], 15.0),
        ],
    },
    Robot {
        model: "flight_stack",
        deadlines: 13,
        // 0.14: all four modules of the first queue. The others add theirs: 0.06 of each IMU, 0.21 of the second queue, 0.5, 0.5, 0.2.
        // 6.17 = 5 + 0.2 + 0.97, the next sample; 3.12 = 2.5 + 0.2 + 3 · 0.14, the next angular velocity; 8.55 = 6.17 + 0.97 + 3 · 0.47,
        // the next estimate. 2.5 and 20 are the `least` of the selector and of the position control, 5 that of the estimator.
        chains: &[
            ("hold", &[100.0, 1.67, 6.17, 0.97, 2.5, 0.47, 20.0, 0.47, 8.55, 0.47, 3.12, 3.0 * 0.14], 250.0),
            ("level", &[2.0 * 2.5, 5.0, 0.97, 2.5, 0.47, 0.47, 3.12, 3.0 * 0.14], 40.0),
            ("stabilise", &[2.5, 0.2, 4.0 * 0.14], 5.0),
        ],
    },
    Robot {
        model: "machine",
        deadlines: 9,
        // 0.119: 86 µs of the servo thread, and 11 of the base thread three times.
        chains: &[
            ("position", &[0.05, 1.0, 0.119, 0.05, 0.011], 1.5),
            ("stop", &[0.05, 1.0, 0.119, 0.05, 0.011], 2.0),
        ],
    },
    Robot {
        model: "perception",
        deadlines: 14,
        // 112 = 100 + 2 + 10, the next cloud of the other LiDAR; 118 = 100 + 18, the next path.
        chains: &[
            (
                "brake",
                &[100.0, 2.0, 8.0, 112.0, 6.0, 12.0, 25.0, 28.0, 100.0, 8.0, 13.0, 118.0, 2.0, 1.0],
                650.0,
            ),
            ("hot_path", &[100.0, 2.0, 8.0, 112.0, 6.0, 12.0, 25.0, 28.0], 400.0),
            ("locate", &[100.0, 2.0, 8.0, 112.0, 6.0, 18.0, 35.0], 350.0),
        ],
    },
    Robot {
        model: "underwater",
        deadlines: 9,
        // 8 is the `least` of the navigation, 20 the period of the speed controllers; 21.6 = 10 + 0.3 + 2 · 3.5 + 4.3, the next job of
        // control. 5 = 0.3 + 0.2 + 0.5 + 2.5 + 0.8 + 0.3 + 0.4: the waits of the sensors leave the CPU to others.
        chains: &[
            ("avoid", &[100.0, 1000.0, 25.0 + 30.0, 21.6, 4.3, 20.0, 5.0], 1500.0),
            ("drift", &[200.0, 5.0, 8.0, 3.5, 1.8, 20.0, 5.0], 300.0),
            ("push", &[10.0, 8.0, 3.5, 1.8, 20.0, 5.0], 100.0),
            ("sink", &[50.0, 3.0, 8.0, 3.5, 1.8, 20.0, 5.0], 150.0),
        ],
    },
];

#[test]
fn robots_of_public_systems_have_the_latencies_of_their_readmes() {
    for Robot { model, deadlines, chains } in ROBOTS {
        let folder = models().join(model);
        let checked = mauve(MAUVE, &folder, &["check", "--hints"]);
        assert_eq!((checked.code, checked.err.as_str()), (0, ""), "{}", checked.out);
        assert!(checked.has(&format!("all {deadlines} deadlines are proved")), "{}", checked.out);
        assert!(checked.has(&format!("all {} limits of chains hold", chains.len())), "{}", checked.out);
        assert!(checked.has("no errors, no warnings") && !checked.has("hint["), "{}", checked.out);
        let formatted = mauve(MAUVE, &folder, &["fmt", "--check"]);
        assert_eq!(formatted.code, 0, "{}", formatted.out);

        let found = mauve(MAUVE, &folder, &["chains", "--format", "json"]);
        let document: Value = serde_json::from_str(&found.out).unwrap();
        let declared = document["chains"].as_array().unwrap().iter().filter(|it| it["declared"] == true);
        let declared: Vec<_> = declared
            .map(|it| {
                assert_eq!(it["status"], "met", "{it}");
                (it["name"].as_str().unwrap(), it["latency"].as_f64().unwrap(), it["limit"].as_f64().unwrap())
            })
            .collect();
        let in_microseconds = |milliseconds: f64| (milliseconds * 1000.0).round() / 1000.0;
        let expected: Vec<_> = chains
            .iter()
            .map(|(name, parts, limit)| (*name, in_microseconds(parts.iter().sum()), *limit))
            .collect();
        assert_eq!(declared, expected, "{model}");
        let readme = std::fs::read_to_string(folder.join("README.md")).unwrap().replace(',', "");
        for (name, latency, _) in declared {
            let row = readme.lines().find(|it| it.starts_with(&format!("| `{name}`: "))).unwrap();
            assert!(row.ends_with(&format!(" {latency} |")), "{model}: {latency} in {row}");
        }
    }
}
