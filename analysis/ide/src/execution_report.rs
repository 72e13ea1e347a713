//! The report of measured execution times: one HTML document with figures, plots, tests and fits, for engineers who decide whether the
//! times may be used.
//!
//! The document needs no network, no other file and no scripts. Its size does not depend on the number of executions.
//!
//! | file | content |
//! |---|---|
//! | `page.rs` | the document: header, overview, a section for each codel |
//! | `tables.rs` | the tables of a section: levels, tests, hold-out, fits |
//! | `plots.rs` | the plots of a section: recording, density, tail, fit, convergence |
//! | `frame.rs` | the frame of a plot, its ticks and marks |
//! | `samples.rs` | few points that show many executions |
//! | `figures.rs` | times, levels and counts as text |
//! | `plots.css` | what it adds to the styles of all pages |

mod figures;
mod frame;
mod page;
mod plots;
mod samples;
mod tables;

pub use page::execution_report;

use mauve_pwcet::{EstimateOptions, InstanceMeasurement};
use mauve_timing::Time;

/// All that a report shows. No text needs to be escaped.
#[derive(Debug, Clone, Copy)]
pub struct ExecutionReport<'a> {
    /// The date of the report, as it is shown.
    pub date: &'a str,
    /// The files with the samples: their names, as they are shown, and the digests of their contents with the name of the algorithm.
    pub sources: &'a [(String, String)],
    /// The options of all estimates.
    pub options: &'a EstimateOptions,
    /// The codels and programs, each instance of its own.
    pub measured: &'a [ReportedCodel<'a>],
}

/// A codel or program in one instance.
#[derive(Debug, Clone, Copy)]
pub struct ReportedCodel<'a> {
    /// The key in timing tables.
    pub key: &'a str,
    /// What was measured, and the estimate with the options of the report.
    pub measurement: &'a InstanceMeasurement,
    /// The time in the timing table for each level of the options; empty if the table has no time of this codel.
    pub table: &'a [Time],
    /// The greatest acceptable time, and the index of its level in the options.
    pub budget: Option<(usize, Time)>,
}

impl<'a> ReportedCodel<'a> {
    /// Returns the instance; none if the measurement has all instances together.
    fn instance(&self) -> Option<&'a str> {
        Some(self.measurement.instance.as_str()).filter(|name| !name.is_empty())
    }

    fn is_program(&self) -> bool {
        self.key.contains('/')
    }

    /// Returns the greatest acceptable time at a level.
    fn budget_at(&self, index: usize) -> Option<Time> {
        self.budget.filter(|(level, _)| *level == index).map(|(_, time)| time)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use expect_test::expect;
    use mauve_pwcet::estimate;

    const LEVELS: [f64; 3] = [1e-3, 1e-4, 1e-7];

    /// About exponential times from 1 ms on, with a clock of 10 ns.
    fn exponential(count: u64) -> Vec<u64> {
        let time = |index: u64| {
            // SplitMix64.
            let mixed = (index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            let part = ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
            1_000_000 + (-(part.max(1e-12)).ln() * 5_000.0) as u64 * 10
        };
        (0..count).map(time).collect()
    }

    struct Sample {
        key: &'static str,
        instance: &'static str,
        executions: Vec<u64>,
        budget: Option<(usize, Time)>,
    }

    fn sample(key: &'static str, executions: Vec<u64>) -> Sample {
        Sample { key, instance: "", executions, budget: None }
    }

    fn report(samples: &[Sample]) -> String {
        let options = EstimateOptions { levels: LEVELS.to_vec(), seed: 1 };
        let measurement = |it: &Sample| InstanceMeasurement {
            instance: it.instance.to_owned(),
            executions: it.executions.clone(),
            runs: vec![0, 100],
            result: estimate(&it.executions, &options),
        };
        let measurements: Vec<_> = samples.iter().map(measurement).collect();
        let measured = samples.iter().zip(&measurements).map(|(sample, measurement)| ReportedCodel {
            key: sample.key,
            measurement,
            table: &[],
            budget: sample.budget,
        });
        execution_report(&ExecutionReport {
            date: "2026-11-23",
            sources: &[("<p3dx>".to_owned(), "sha256 00ff".to_owned())],
            options: &options,
            measured: &measured.collect::<Vec<_>>(),
        })
    }

    fn samples() -> Vec<Sample> {
        vec![
            sample("scan.read", exponential(3000)),
            Sample {
                instance: "left",
                budget: Some((2, Time::from_nanos(1_100_000))),
                ..sample("scan.filter", exponential(5000))
            },
            sample("empty", Vec::new()),
            sample("once", vec![7]),
            sample("three", vec![1_200_000, 1_250_000, 1_100_000]),
            sample("constant", vec![2_000_000; 400]),
        ]
    }

    /// Returns the texts of a document, a line for each, without styles.
    fn texts(html: &str) -> Vec<String> {
        let body = html.split("</style>").nth(1).unwrap_or_default();
        let texts = body.split('>').filter_map(|rest| rest.split('<').next()).map(str::trim);
        texts.filter(|text| !text.is_empty()).map(str::to_owned).collect()
    }

    /// Returns the headings, indented by their level.
    fn outline(html: &str) -> String {
        let mut out = String::new();
        for rest in html.split("<h").skip(1) {
            let Some((level @ ('1' | '2' | '3'), rest)) = rest.chars().next().map(|it| (it, rest)) else {
                continue;
            };
            let heading = rest.split("</h").next().unwrap_or_default();
            let indent = "  ".repeat(level as usize - '1' as usize);
            let words = texts(&format!("</style><h{heading}")).join(" ");
            out += &format!("{indent}{words}\n");
        }
        out
    }

    /// Checks that each element is closed, as in XML.
    fn check_tags(html: &str) {
        let mut open: Vec<&str> = Vec::new();
        for tag in html.split('<').skip(1).filter(|tag| !tag.starts_with('!')) {
            let (tag, _) = tag.split_once('>').expect("the end of a tag");
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap_or_default();
            if tag.starts_with('/') {
                assert_eq!(open.pop(), Some(name), "</{name}> in {open:?}");
            } else if !tag.ends_with('/') {
                open.push(name);
            }
        }
        assert!(open.is_empty(), "{open:?}");
    }

    #[test]
    fn refusals_and_warnings_come_first() {
        expect![[r#"
            Execution times of &lt;p3dx&gt;
              How to read this report
              Overview
              scan. filter codel of instance left
                Warnings
                Levels
                Tests
                Hold-out
                Clock
                Fit of the tail
              empty codel
                No estimate
              once codel
                No estimate
              three codel
                No estimate
              constant codel
                No estimate
              scan. read codel
                Warnings
                Levels
                Tests
                Hold-out
                Clock
                Fit of the tail
                Sources
        "#]]
        .assert_eq(&outline(&report(&samples())));
    }

    #[test]
    fn the_overview_has_a_row_for_each_codel() {
        let html = report(&samples());
        let overview =
            html.split("<table class=\"overview\">").nth(1).and_then(|it| it.split("</table>").next());
        let rows = overview.unwrap_or_default().split("<tr>").skip(1);
        let rows: String = rows.map(|row| texts(&format!("</style><tr>{row}")).join(" | ") + "\n").collect();
        expect![[r#"
            codel or program | instance | verdict | executions | high-water | mark | 95 % upper bound at level
            1e-3 | 1e-4 | 1e-7
            scan. | filter | left | over budget | extrapolated | 5000 | 1.417 ms | 1.417 ms | 1.00 × | 1.562 ms ~ | 1.10 × | 2.292 ms ~ | 1.62 ×
            empty | all | refused | 0 | – | 0 executions are too few for a tail: measure at least 200, better 5000
            once | all | refused | 1 | 7 ns | 1 execution is too few for a tail: measure at least 200, better 5000
            three | all | refused | 3 | 1.25 ms | 3 executions are too few for a tail: measure at least 200, better 5000
            constant | all | refused | 400 | 2 ms | all executions took exactly 2 ms: a real clock gives different times; write the time by hand if it is the worst case
            scan. | read | all | extrapolated | 3000 | 1.382 ms | 1.382 ms | 1.00 × | 1.615 ms ~ | 1.17 × | 2.76 ms ~ | 2.00 ×
        "#]].assert_eq(&rows);
    }

    #[test]
    fn tables_of_a_codel() {
        let html = report(&samples()[..1]);
        let tables = html.split("<h3>Levels</h3>").nth(1).and_then(|it| it.split("</section>").next());
        let rows = tables.unwrap_or_default().split("<tr>").skip(1);
        let rows: String = rows.map(|row| texts(&format!("</style><tr>{row}")).join(" | ") + "\n").collect();
        expect![[r#"
            level | estimate | 95 % upper | bound | ratio | expected | p·n | the bound is
            1e-3 | 1.339 | 1.382 | 1.00 × | 3 | counted in the sample
            1e-4 | 1.45 | 1.615 | 1.17 × | 0.3 | extrapolated: one exceedance in 3 such measurements
            1e-7 | 1.783 | 2.76 | 2.00 × | 0.0003 | extrapolated: one exceedance in 3333 such measurements | Tests | Adjusted for the number of tests (Holm): below 0.05, the assumption is rejected.
            test | assumption | statistic | p | adjusted p | verdict
            Ljung–Box, 20 lags | executions do not depend on earlier ones | 17.69 | 0.608 | 1.000 | not rejected
            runs about the median | fast and slow executions alternate at random | 1.096 | 0.273 | 1.000 | not rejected
            distances of long executions | long executions do not come in groups | 2.252 | 1.000 | 1.000 | not rejected
            Kolmogorov–Smirnov, two halves | both halves of the measurement have one distribution | 0.02667 | 0.660 | 1.000 | not rejected
            KPSS, 9 lags | the mean does not change | 0.04478 | 0.907 | 1.000 | not rejected
            likelihood ratio of the tail | the tail is not heavier than exponential | 4.901e-6 | 0.499 | 1.000 | not rejected
            hold-out | the bounds of the first half hold in the second half | 7 | 1.000 | 1.000 | not rejected | Hold-out | Bounds from the first half of the executions, in ms, and the exceedances in the second half.
            level | bound | expected at most | observed | p | verdict
            1e-2 | 1.272 | 15 | 7 | 0.993 | not rejected
            1e-3 | 1.452 | 1.5 | 0 | 1.000 | not rejected | Clock | Times without ties need a fine clock.
            property | value
            resolution of the clock | 10 ns
            distinct times | 2602
            executions with the time of another one | 398 (13 %)
            mean | 1.05 ms | Fit of the tail | Excesses over the threshold, with a generalised Pareto distribution. The bounds come from this fit.
            peaks over threshold | value
            threshold | 1.097 ms
            excesses | 450 (15 %)
            free fit | ξ = 0.000118, σ = 0.04814 ms
            fit with ξ ≥ 0 | ξ = 0.000118, σ = 0.04814 ms
            greatest ξ that is not rejected | 0.1219
            goodness of the free fit | Anderson–Darling 0.3787, p = 0.534
        "#]].assert_eq(&rows);
    }

    #[test]
    fn documents_are_well_formed() {
        for html in [report(&samples()), report(&[])] {
            check_tags(&html);
            let ids: Vec<&str> = html.split(" id=\"").skip(1).filter_map(|it| it.split('"').next()).collect();
            assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len(), "{ids:?}");
            for link in html.split("href=\"").skip(1).filter_map(|it| it.split('"').next()) {
                assert!(link.strip_prefix('#').is_some_and(|id| ids.contains(&id)), "{link}");
            }
            for number in ["NaN", "inf", "http:", "https:", "<script", "url("] {
                assert!(!html.contains(number), "{number}");
            }
        }
    }

    #[test]
    fn texts_from_outside_are_escaped() {
        let key = "<script>alert('1')</script>\" onload=\"x\"&\u{202e}\u{0}";
        let mut evil = sample(key, exponential(400));
        evil.instance = "</title></style>";
        let html = report(&[evil]);
        check_tags(&html);
        assert!(
            !html.contains("<script") && !html.contains("onload=\"x") && !html.contains("</title></style>")
        );
        assert!(html.contains("&lt;p3dx&gt;") && html.contains("&lt;script&gt;alert"));
        assert!(!html.contains(['\u{202e}', '\u{0}']));
    }

    #[test]
    fn the_size_does_not_depend_on_the_number_of_executions() {
        let many = exponential(400_000);
        // Each execution is a new high-water mark.
        let rising: Vec<u64> = (0..400_000).collect();
        for executions in [many, rising] {
            let options = EstimateOptions { levels: LEVELS.to_vec(), seed: 1 };
            let first = estimate(&executions[..4000], &options);
            let size = |executions: &[u64]| {
                let measurement = InstanceMeasurement {
                    instance: String::new(),
                    executions: executions.to_vec(),
                    runs: (0..executions.len()).collect(),
                    result: first.clone(),
                };
                let measured = [ReportedCodel {
                    key: "Pilot/update",
                    measurement: &measurement,
                    table: &[],
                    budget: None,
                }];
                execution_report(&ExecutionReport {
                    date: "",
                    sources: &[],
                    options: &options,
                    measured: &measured,
                })
                .len()
            };
            let (few, many) = (size(&executions[..4000]), size(&executions));
            assert!(many < few + 3000 && many < 60_000, "{few} and {many} bytes");
        }
    }

    #[test]
    fn equal_values_give_equal_documents() {
        assert_eq!(report(&samples()), report(&samples()));
    }
}
