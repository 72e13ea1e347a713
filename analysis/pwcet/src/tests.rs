//! Tests against R (evd, tseries, goftest, stats), SciPy and mpmath: `tests/fixtures/README.md` says how their values were made.

use serde_json::Value;

use crate::anderson_darling;
use crate::checks;
use crate::distributions;
use crate::gpd::Gpd;
use crate::likelihood_region::LikelihoodRegion;
use crate::order::SortedTimes;

fn fixture(name: &str) -> Value {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name);
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A set of data, with what R and SciPy say of it.
struct Set {
    name: String,
    times: SortedTimes,
    r: Value,
    scipy: Value,
}

impl Set {
    fn all() -> Vec<Set> {
        let [data, r, scipy] = ["data.json", "r.json", "scipy.json"].map(fixture);
        let sets = data["sets"].as_array().unwrap().iter().enumerate();
        let set = |(index, set): (usize, &Value)| {
            let (r, scipy) = (r["sets"][index].clone(), scipy["sets"][index].clone());
            assert!(r["name"] == set["name"] && scipy["name"] == set["name"]);
            let values = set["values"].as_array().unwrap().iter().map(|it| it.as_f64().unwrap());
            Set {
                name: set["name"].as_str().unwrap().to_owned(),
                times: SortedTimes::of(values.collect()),
                r,
                scipy,
            }
        };
        sets.map(set).collect()
    }

    /// The excesses over the threshold of the fixtures, in milliseconds: ascending.
    fn excesses(&self) -> Vec<f64> {
        let threshold = number(&self.scipy["threshold"]["u"]);
        let excesses = self.times.ascending.iter().filter(|&&time| time > threshold);
        excesses.map(|time| (time - threshold) / 1e6).collect()
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is a number"))
}

#[track_caller]
fn close(of: &str, actual: f64, expected: &Value, tolerance: f64) {
    let expected = number(expected);
    // R computes small p-values as 1 − P, which can be 0.
    let error = (actual - expected).abs() / expected.abs().max(1e-6);
    assert!(error <= tolerance, "{of}: {actual} instead of {expected}, {error:e}");
}

#[test]
fn tests_of_independence_and_identity() {
    for set in Set::all() {
        let tests = &set.r["tests"];
        let values = &set.times.recorded;
        for (name, lags) in [("ljung_box_10", 10), ("ljung_box_20", 20)] {
            let (statistic, p) = checks::ljung_box(values, lags);
            close(&set.name, statistic, &tests[name]["statistic"], 1e-9);
            close(&set.name, p, &tests[name]["p"], 1e-8);
        }
        let (statistic, p) = checks::runs(&set.times);
        close(&set.name, statistic, &tests["runs"]["statistic"], 1e-9);
        close(&set.name, p, &tests["runs"]["p"], 1e-8);
        for name in ["kpss_short", "kpss_long"] {
            let lags = number(&tests[name]["lag"]) as usize;
            let (statistic, p) = checks::kpss(values, lags);
            close(&set.name, statistic, &tests[name]["statistic"], 1e-9);
            // R interpolates in a table that was simulated.
            if tests[name]["clipped"] == Value::Bool(false) {
                close(&set.name, p, &tests[name]["p"], 0.1);
            }
        }
        let (statistic, p) = checks::halves(values);
        close(&set.name, statistic, &tests["ks_halves"]["statistic"], 1e-12);
        close(&set.name, p, &set.scipy["kolmogorov_smirnov"]["halves"]["p_kolmogorov"], 1e-9);
    }
}

#[test]
fn several_tests_are_adjusted_as_in_r() {
    for set in Set::all() {
        let tests = &set.r["tests"];
        let p = |name: &str, field: &str| number(&tests[name][field]);
        let found = distributions::holm(&[
            p("ljung_box_10", "p"),
            p("runs", "p"),
            p("kpss_short", "p"),
            p("ks_halves", "p_asymptotic"),
        ]);
        for (index, found) in found.into_iter().enumerate() {
            assert!((found - number(&tests["holm"]["p"][index])).abs() < 1e-12, "{}", set.name);
        }
    }
}

#[test]
fn fits_of_excesses() {
    let mut compared = 0;
    for set in Set::all() {
        let excesses = set.excesses();
        let fits = &set.scipy["gpd"];
        if let Some(shape) = fits["refined"]["shape"].as_f64() {
            let fitted = Gpd::fit(&excesses).unwrap();
            assert!((fitted.shape - shape).abs() < 1e-8, "{}: {} instead of {shape}", set.name, fitted.shape);
            close(&set.name, fitted.scale * 1e6, &fits["refined"]["scale"], 1e-8);
            let count = excesses.len() as f64;
            close(
                &set.name,
                count * 1e6_f64.ln() - fitted.log_likelihood(&excesses),
                &fits["refined"]["nllf"],
                1e-12,
            );
            // evd stops its search earlier.
            let evd = &set.r["gpd"]["evd"];
            assert!((fitted.shape - number(&evd["shape"])).abs() < 1e-6, "{}: evd", set.name);
            let scipy = number(&fits["raw"]["shape"]);
            assert!((fitted.shape - scipy).abs() < 1e-4, "{}: SciPy and pyextremes", set.name);
            let statistic = anderson_darling::statistic(&excesses, &fitted);
            close(&set.name, statistic, &set.r["gpd"]["anderson_darling"]["statistic"], 1e-6);
            compared += 1;
        }
        let fitted = Gpd::fit_without_end(&excesses).unwrap();
        let expected = &fits["not_negative"];
        assert!((fitted.shape - number(&expected["shape"])).abs() < 1e-8, "{}", set.name);
        close(&set.name, fitted.scale * 1e6, &expected["scale"], 1e-8);
    }
    assert_eq!(compared, 10);
}

#[test]
fn confidence_bounds_of_quantiles() {
    for set in Set::all() {
        let excesses = set.excesses();
        let best = Gpd::fit_without_end(&excesses).unwrap();
        let region = LikelihoodRegion::new(&excesses, best, 2.705_543_454_095_404);
        let share = excesses.len() as f64 / set.times.count() as f64;
        let (threshold, expected) = (number(&set.scipy["threshold"]["u"]), &set.scipy["gpd"]["not_negative"]);
        for (level, name) in [(1e-3, "1e-3"), (1e-4, "1e-4"), (1e-6, "1e-6"), (1e-9, "1e-9")] {
            let bound = threshold + 1e6 * region.greatest_exceeded_with(level / share);
            close(&format!("{} at {name}", set.name), bound, &expected["upper_bounds"][name], 5e-4);
            let point = threshold + 1e6 * best.exceeded_with(level / share);
            close(&set.name, point, &expected["quantiles"][name], 1e-7);
        }
    }
}

#[test]
fn functions() {
    let fixture = fixture("scipy.json");
    let functions = &fixture["functions"];
    let points = |name: &str| functions[name]["points"].as_array().unwrap().clone();
    for point in points("chi_square_sf") {
        close(
            "χ²",
            distributions::chi_square(number(&point["at"][1]), number(&point["at"][0]) as u32),
            &point["value"],
            1e-9,
        );
    }
    for point in points("kolmogorov_sf") {
        close("Kolmogorov", distributions::kolmogorov(number(&point["at"][0])), &point["value"], 1e-9);
    }
    for point in points("normal_sf") {
        let at = number(&point["at"][0]);
        if at >= 0.0 {
            close("normal", distributions::normal_two_sided(at) / 2.0, &point["value"], 1e-9);
        }
    }
    for point in points("binomial_sf") {
        let [k, n, p] = [0, 1, 2].map(|index| number(&point["at"][index]));
        close("binomial", distributions::binomial_at_least(k as u64 + 1, n as u64, p), &point["value"], 1e-9);
    }
    for law in functions["gpd"].as_array().unwrap() {
        let law_of = Gpd { shape: number(&law["shape"]), scale: 1.0 };
        for at in law["at"].as_array().unwrap() {
            let found = law_of.survival(number(&at["x"]));
            assert!((found - number(&at["sf"])).abs() < 1e-9, "{law_of:?} at {}", at["x"]);
        }
        for at in law["exceeded_with"].as_array().unwrap() {
            close("GPD", law_of.exceeded_with(number(&at["p"])), &at["quantile"], 1e-7);
        }
    }
}
