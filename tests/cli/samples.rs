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
