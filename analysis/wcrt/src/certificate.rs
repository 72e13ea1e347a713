//! Certificates: why the deadlines of a deployment are met, for a checker that does not trust this analysis.

use serde_json::{Map, Value, json};

use crate::chains::{ChainReport, chains_of};
use crate::report::{Query, Report};
use crate::response::response_times;
use crate::system::system_of;
use crate::table_set::tables_of;
use crate::task_set::DeployedTasks;
use mauve_hir::{Decl, ModelDb, Project};
use mauve_timing::task_set::{TaskSet, TaskSetError};
use mauve_timing::{ChainRule, Time};

/// Returns the certificate of a deployment: see [`mauve_timing::Tasks::certificate`].
pub fn certificate_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Map<String, Value> {
    let (tables, system) = (tables_of(db, project, deployment), system_of(db, project, deployment));
    let deployed = DeployedTasks::of_model(db, tables, system, query);
    let report = response_times(db, project, deployment, query);
    let mut parts = certificate(&deployed, report, query, &|| db.unwind_if_revision_cancelled());
    let chains =
        chains_of(db, project, deployment, query).all.iter().filter_map(|it| chain(it, report, &parts));
    let chains: Value = chains.collect();
    parts.insert("chains".to_owned(), chains);
    parts
}

/// Returns the certificate of a chain; none without a latency. It counts less exactly than the analysis, so that each step can be
/// checked alone, and so its latency may be more.
fn chain(chain: &ChainReport<'_>, report: &Report<'_>, parts: &Map<String, Value>) -> Option<Value> {
    let latency = chain.latency?;
    let claims = parts.get("claims").and_then(Value::as_array)?;
    let last = chain.steps.len().saturating_sub(1);
    let mut all = Vec::with_capacity(chain.steps.len());
    let steps = chain.steps.iter().enumerate().map(|(index, it)| {
        let (of, part) = (it.timed.as_ref()?, it.part);
        let activity = report.activities.get(of.task).filter(|it| it.is_periodic())?;
        let claim =
            claims.iter().find(|claim| claim.get("task").and_then(Value::as_u64) == Some(of.task as u64))?;
        let response = claim.get("response")?.as_u64()?;
        let wait = activity.period?;
        let periods = wait.checked_mul(u64::from(of.releases.max(1)) - 1)?;
        let is_before = index < last && part.rule == ChainRule::HigherPriority;
        let run = if is_before { activity.jitter.as_nanos() } else { response };
        // What else is in the latency cannot be checked step by step.
        let is_more = part.wait > wait || part.periods > periods || part.run.as_nanos() > run;
        if is_more || part.buffer > Time::ZERO || part.by_data {
            return None;
        }
        all.push(it.total());
        let [wait, periods] = [wait, periods].map(Time::as_nanos);
        let sum = wait.checked_add(periods)?.checked_add(run)?;
        Some((
            json!({ "task": of.task, "releases": of.releases, "wait": wait, "periods": periods, "run": run }),
            sum,
        ))
    });
    let steps: Option<Vec<(Value, u64)>> = steps.collect();
    let sum_of_parts = all.iter().try_fold(Time::ZERO, |sum, it| sum.checked_add(*it));
    let refused = |reason: &str| json!({ "name": &*chain.name, "reason": reason, "steps": [] });
    let Some(steps) = steps.filter(|_| sum_of_parts == Some(latency)) else {
        return Some(refused("not-by-step"));
    };
    let sum = steps.iter().try_fold(0u64, |sum, it| sum.checked_add(it.1))?;
    let limit = chain.limit.filter(|limit| latency <= *limit).map(Time::as_nanos);
    if limit.is_some_and(|limit| sum > limit) {
        return Some(refused("not-within-limit-by-step"));
    }
    let steps: Vec<Value> = steps.into_iter().map(|it| it.0).collect();
    Some(json!({ "name": &*chain.name, "latency": sum, "limit": limit, "steps": steps }))
}

/// Returns the certificate of a task set of a file, whose response times are those of the report.
///
/// # Errors
///
/// The file has no times at the level.
pub fn certificate_of_file(
    set: &TaskSet,
    query: Query,
    report: &Report<'_>,
) -> Result<Map<String, Value>, TaskSetError> {
    Ok(certificate(&DeployedTasks::of_file(set, query.level, query.method)?, report, query, &|| ()))
}

fn certificate(
    deployed: &DeployedTasks<'_>,
    report: &Report<'_>,
    query: Query,
    interrupt: &dyn Fn(),
) -> Map<String, Value> {
    let is_met = |task: usize| {
        report.activities.get(task).is_some_and(|it| it.response.is_some() && it.verdict.is_met())
    };
    let mut parts = deployed.tasks.certificate(&is_met, interrupt);
    parts.insert("significance".to_owned(), query.level.to_string().into());
    parts
}
