//! Certificates: why the deadlines of a deployment are met, for a checker that does not trust this analysis.

use serde_json::{Map, Value, json};

use crate::chains::{ChainReport, chains_of};
use crate::report::{Query, Report};
use crate::response::response_times;
use crate::system::system_of;
use crate::table_set::tables_of;
use crate::task_set::DeployedTasks;
use mauve_hir::{Decl, ModelDb, Project, config_of};
use mauve_timing::task_set::{TaskSet, TaskSetError};
use mauve_timing::{ChainRule, Time};

/// Returns the certificate of a deployment: see [`mauve_timing::Tasks::certificate`]. `why` renders why the analysis itself does not prove
/// the latency of a chain.
pub fn certificate_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    why: &dyn Fn(&ChainReport<'db>) -> String,
) -> Map<String, Value> {
    let (tables, system) = (tables_of(db, project, deployment), system_of(db, project, deployment));
    let deployed = DeployedTasks::of_model(db, tables, system, query);
    let report = response_times(db, project, deployment, query);
    let mut parts = certificate(&deployed, report, query, &|| db.unwind_if_revision_cancelled());
    let mut certified = Vec::new();
    let declared = &config_of(db, project.workspace(db)).chains;
    for it in &chains_of(db, project, deployment, query).all {
        let declared = it.declared.and_then(|index| declared.get(index));
        let is_open = declared.is_some() && (it.latency.is_none() || !it.is_within_limit());
        let found = if is_open { Err(why(it)) } else { chain(it, report, &parts).map_err(str::to_owned) };
        match found {
            Ok(mut value) => {
                let names = |of: Option<&[(String, _)]>| -> Value {
                    of.into_iter().flatten().map(|(name, _)| name.as_str()).collect()
                };
                value["while"] = names(declared.map(|it| it.states.as_slice()));
                value["answers"] = names(declared.map(|it| it.answers.as_slice()));
                certified.push(value);
            }
            // The others promise nothing.
            Err(why) if declared.is_some() => {
                if let Some(Value::Array(all)) = parts.get_mut("not_certified") {
                    all.push(json!([format!("chain {}", it.name), why]));
                }
            }
            Err(_) => {}
        }
    }
    parts.insert("chains".to_owned(), certified.into());
    parts
}

/// Returns the certificate of a chain, or why its steps alone do not prove that it is within its limit. Its latency counts whole response
/// times, where the analysis counts up to the write, so that each step can be checked alone: it may be more.
fn chain(
    chain: &ChainReport<'_>,
    report: &Report<'_>,
    parts: &Map<String, Value>,
) -> Result<Value, &'static str> {
    let claims = parts.get("claims").and_then(Value::as_array).map_or(&[] as &[_], Vec::as_slice);
    let has_claim = |task: usize| claims.iter().any(|it| it["task"] == task);
    if chain.steps.iter().filter_map(|it| it.timed.as_ref()).any(|it| !has_claim(it.task)) {
        return Err("no-claim");
    }
    let activity = |task: usize| report.activities.get(task);
    let mut tasks = chain.steps.iter().filter_map(|it| activity(it.timed.as_ref()?.task));
    if tasks.any(|it| !it.is_periodic()) {
        return Err("released-by-data");
    }
    by_steps(chain, report, claims).ok_or("not-by-steps")
}

fn by_steps(chain: &ChainReport<'_>, report: &Report<'_>, claims: &[Value]) -> Option<Value> {
    let found = chain.latency?.as_nanos();
    let (mut sum, mut exact, mut steps) = (0u64, 0u64, Vec::new());
    for (index, step) in chain.steps.iter().enumerate() {
        let (of, part) = (step.timed.as_ref()?, step.part);
        let activity = report.activities.get(of.task)?;
        let claim = claims.iter().find(|it| it["task"] == of.task)?;
        let is_before = index + 1 < chain.steps.len() && part.rule == ChainRule::HigherPriority;
        let run = if is_before { activity.jitter.as_nanos() } else { claim["response"].as_u64()? };
        let releases = u64::from(of.releases.max(1));
        let waits = activity.period?.as_nanos().checked_mul(releases)?;
        if part.buffer > Time::ZERO || part.by_data || part.run.as_nanos() > run {
            return None;
        }
        sum = sum.checked_add(waits)?.checked_add(run)?;
        exact = exact.checked_add(step.total().as_nanos())?;
        steps.push((of.task, releases));
    }
    let limit = chain.limit.map(Time::as_nanos);
    // What else is in the latency has no form there.
    let is_proved = exact == found && sum >= found && limit.is_none_or(|limit| sum <= limit);
    is_proved.then(|| json!({ "name": &*chain.name, "latency": sum, "limit": limit, "steps": steps }))
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
