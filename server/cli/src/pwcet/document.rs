//! The estimates as a JSON document.

use mauve_diagnostics::{check_name, measurement_refusal, measurement_warning, no_bound, warning_kind};
use mauve_projects::analysis_document::milliseconds;
use mauve_projects::json::{self, object};
use mauve_pwcet::trace::SpanKind;
use mauve_pwcet::{Estimate, InstanceMeasurement};
use mauve_timing::Level;
use serde::Serialize;

use super::estimates::{Estimates, MeasuredEntry};

/// All times are in milliseconds; `bounds` has one for each of `levels`.
pub(super) fn document(estimates: &Estimates) -> Result<String, String> {
    json::text(&object! {
        unit: "ms",
        levels: estimates.levels.iter().map(|level| level.as_f64()).collect::<Vec<_>>(),
        confidence: 0.95,
        seed: estimates.options.seed,
        budget_level: estimates.budgets.as_ref().map(|it| it.level.as_f64()),
        recording: estimates.recording.clone(),
        codels: estimates.measurements.iter().map(|it| codel(estimates, it)).collect::<Vec<_>>(),
    })
}

fn codel(estimates: &Estimates, it: &MeasuredEntry) -> impl Serialize + use<> {
    let lack = estimates.lack(it);
    object! {
        key: it.key().to_owned(),
        kind: match SpanKind::of(&it.measurement.key) {
            SpanKind::Program => "program",
            SpanKind::Access => "port",
            _ => "codel",
        },
        executions: it.measurement.count(),
        greatest: ms(it.measurement.greatest() as f64),
        bounds: (!it.is_refused())
            .then(|| it.times.iter().map(|time| time.map(milliseconds)).collect::<Vec<_>>()),
        budget: it.budget.map(milliseconds),
        warnings: estimates.kinds(it),
        // With so many executions more, the levels that are needed have times.
        [missing_executions]: lack.map(|it| it.more),
        remarks: it.remarks(),
        over_budget: it.is_over_budget,
        instances: it.measurement.instances.iter().map(|it| instance(&estimates.levels, it)).collect::<Vec<_>>(),
    }
}

fn instance(levels: &[Level], it: &InstanceMeasurement) -> impl Serialize + use<> {
    object! {
        instance: it.instance.clone(),
        executions: it.executions.len(),
        runs: it.runs.len(),
        refused: it.result.as_ref().err().map(|it| measurement_refusal(&it.refusal)),
        estimate: it.result.as_ref().ok().map(|it| estimate(levels, it)),
    }
}

fn estimate(levels: &[Level], it: &Estimate) -> impl Serialize + use<> {
    let of_levels = it.levels.iter().zip(levels).enumerate().map(|(index, (at, level))| {
        object! {
            level: level.as_f64(),
            estimate: ms(at.point),
            bound: at.bound.ok().map(ms),
            refused: at.bound.err().map(|it| no_bound(&it)),
            warnings: it.warnings_at(index).iter().map(warning_kind).collect::<Vec<_>>(),
            is_extrapolated: at.is_extrapolated,
            depth: at.depth,
            ratio: at.bound.ok().map(|bound| bound / it.greatest as f64),
        }
    });
    let checks = it.checks.iter().map(|check| {
        object! {
            test: check_name(check.kind),
            statistic: check.statistic,
            p: check.p,
            adjusted: check.adjusted,
            is_rejected: check.is_rejected(),
        }
    });
    let hold_out = it.hold_out.iter().map(|at| {
        object! { level: at.level, bound: ms(at.bound), executions: at.executions, exceedances: at.exceedances, p: at.p }
    });
    object! {
        least: ms(it.least as f64),
        mean: ms(it.mean),
        greatest: ms(it.greatest as f64),
        resolution: ms(it.resolution as f64),
        distinct: it.distinct,
        threshold: ms(it.tail.threshold),
        excesses: it.tail.excesses,
        shape: it.tail.model.shape,
        scale: ms(it.tail.model.scale),
        free_shape: it.tail.free.shape,
        greatest_shape: it.tail.greatest_shape,
        fit_p: it.tail.p,
        levels: of_levels.collect::<Vec<_>>(),
        checks: checks.collect::<Vec<_>>(),
        hold_out: hold_out.collect::<Vec<_>>(),
        warnings: it.warnings.iter().map(measurement_warning).collect::<Vec<_>>(),
    }
}

/// Nanoseconds in milliseconds.
fn ms(nanoseconds: f64) -> f64 {
    nanoseconds / 1e6
}
