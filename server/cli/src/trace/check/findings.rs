//! What a recording and a model do not agree on, in words: what is wrong, why, and what to do.

use mauve_pwcet::trace::port_of;
use mauve_timing::Time;
use mauve_wcrt::observed::{FindingKind, Interferer, TraceFinding, UnknownPath, Waited};

use super::super::import::executions;
use super::checked::Checked;
use crate::text::{counted, duration, two_digits};

/// Returns the stable name of a kind of finding.
pub(super) fn code(kind: &FindingKind) -> &'static str {
    match kind {
        FindingKind::NotObserved => "not-observed",
        FindingKind::NothingObserved => "nothing-observed",
        FindingKind::Clock => "clock",
        FindingKind::Priority { .. } => "priority",
        FindingKind::Cpus { .. } => "cpus",
        FindingKind::OtherCpu { .. } => "other-cpu",
        FindingKind::Component { .. } => "component",
        FindingKind::Path(_) => "path",
        FindingKind::UnknownProgram { .. } => "unknown-program",
        FindingKind::UnknownCodel { .. } => "unknown-codel",
        FindingKind::UnknownInstance { .. } => "unknown-instance",
        FindingKind::ExecutionTime { .. } => "execution-time",
        FindingKind::Execution { .. } => "execution-of-period",
        FindingKind::Wait { .. } => "wait",
        FindingKind::Response { .. } => "response",
        FindingKind::Chain { .. } => "chain-too-late",
        FindingKind::Skipped => "skipped",
        FindingKind::Untimed { .. } => "untimed",
        FindingKind::Gap { .. } => "gap",
        FindingKind::Period { .. } => "period",
    }
}

fn execution_message(
    instance: &str,
    count: u64,
    (own, greatest): (u64, u64),
    port: Option<&(String, u64)>,
) -> String {
    let why = match port {
        Some((port, time)) => format!(
            "its port `{port}` took up to {}; in a timing table in ms, [access] \"{port}\" = {}",
            duration(*time),
            two_digits(*time)
        ),
        None => "a codel exceeded its time, or code outside the codels takes time that `[overhead]` in a timing table does not have"
            .to_owned(),
    };
    format!(
        "`{instance}` executed longer than {}, the greatest execution time of a period in the model, in {}; the longest took {}: {why}",
        duration(own),
        periods(count),
        duration(greatest)
    )
}

fn wait_message(
    instance: &str,
    key: &str,
    wait: Option<u64>,
    (count, executions): (u64, u64),
    greatest: u64,
) -> String {
    let assumed = match wait {
        Some(wait) => format!("and the tables have {}", duration(wait)),
        None => "which no table has".to_owned(),
    };
    format!(
        "`{key}` waited for something in {count} of {executions} executions in `{instance}`, for up to {}, {assumed}; in a timing table in \
         ms, [wait] \"{key}\" = {}",
        duration(greatest),
        two_digits(greatest)
    )
}

/// Returns the message of a finding.
pub(super) fn message(it: &Checked<'_>, finding: &TraceFinding) -> String {
    let instance = instance(it, finding).unwrap_or_default();
    let count = finding.count;
    let after = |first: &str| match finding.at {
        Some(at) => format!(", {first}{} after the begin", duration(it.since_begin(at))),
        None => String::new(),
    };
    let (first, at) = (after("first "), after(""));
    match &finding.kind {
        FindingKind::NotObserved => format!(
            "`{instance}` is not in the recording: it did not run, or its package was built without -DMAUVE_TRACING=ON"
        ),
        FindingKind::NothingObserved => nothing_message(it),
        FindingKind::Clock => format!(
            "a clock ran backwards at {}, so that response times say nothing: sort the lines of a file by time_ns, and record on a kernel \
             with a stable clock",
            executions(count)
        ),
        FindingKind::Priority { expected, observed } => format!(
            "`{instance}` has {} instead of {} in {}{first}: the deployment script failed to set it, or another program changed it",
            scheduler(*observed),
            scheduler(*expected),
            periods(count)
        ),
        FindingKind::Cpus { expected, observed } => format!(
            "`{instance}` may use {} instead of {} in {}{first}: check the affinity in the deployment, and `taskset` and cgroups on \
             the robot",
            observed,
            expected,
            periods(count)
        ),
        FindingKind::OtherCpu { expected, observed } => format!(
            "`{instance}` began {} on {observed}, and the deployment gives it {expected}{first}",
            periods(count)
        ),
        FindingKind::Component { expected, observed } => format!(
            "`{instance}` executes programs of `{observed}`, and the model deploys `{expected}`: generate, build and record again"
        ),
        FindingKind::Path(path) => path_message(instance, path, &periods(count), &first),
        FindingKind::UnknownProgram { key } => format!(
            "`{instance}` executed `{key}`{first}, which the model does not have: the recording is of another version of the model"
        ),
        FindingKind::UnknownCodel { key, is_known } => codel_message(instance, key, *is_known, &first),
        FindingKind::UnknownInstance { instance } => {
            format!("the recording has `{instance}`{first}, which is not an instance of {}", it.name)
        }
        FindingKind::ExecutionTime { key, time, level, executions, expected, greatest } => format!(
            "{} exceeded its time of {} in {count} of {executions} executions; at {level:e}, {} are expected on average; the longest \
             took {}{at}: measure it again, and update the table",
            port_of(key).map_or_else(|| format!("`{key}`"), |port| format!("port `{port}`")),
            duration(*time),
            number(*expected),
            duration(*greatest)
        ),
        FindingKind::Execution { own, greatest, port } => {
            execution_message(instance, count, (*own, *greatest), port.as_ref())
        }
        FindingKind::Wait { key, wait, executions, greatest } => {
            wait_message(instance, key, *wait, (count, *executions), *greatest)
        }
        FindingKind::Response { .. } => response_message(instance, finding, &at),
        FindingKind::Chain { chain, latency, bound } => {
            chain_message(it, *chain, (*latency, *bound), count, &at)
        }
        FindingKind::Skipped => format!(
            "`{instance}` skipped {}{first}: it does not catch up late periods, or it was stopped for a moment",
            periods(count)
        ),
        FindingKind::Untimed { periods } => format!(
            "{count} of {periods} periods of `{instance}` have no place in time, since their lines are not in the order of time or a \
             clock ran backwards: its response times, activations and transitions are not compared in them"
        ),
        FindingKind::Gap { expected, burst, observed } => format!(
            "`{instance}` has {} too early{first}: {} in {}, and the deployment says {burst} in {} at most",
            counted(count as usize, "release"),
            burst.saturating_add(1),
            precise(*observed),
            precise(*expected)
        ),
        FindingKind::Period { expected, observed } => format!(
            "`{instance}` begins a period each {} on average, and the deployment says {}: its response times are not compared",
            precise(*observed),
            precise(*expected)
        ),
    }
}

/// What was read of a recording that shows nothing, and why nothing of it is an execution.
fn nothing_message(it: &Checked<'_>) -> String {
    let summary = &it.summary;
    let counts = [
        (summary.dropped, "near events that the tracer discarded"),
        (summary.clock_errors, "where a clock ran backwards"),
        (summary.unbalanced, "with a begin or an end only"),
        (summary.cut_at_start, "begun before the recording"),
        (summary.cut_at_end, "not ended in the recording"),
    ];
    let lost = counts.into_iter().filter(|(count, _)| *count > 0);
    let lost: Vec<String> = lost.map(|(count, why)| format!("{count} {why}")).collect();
    let lost = if lost.is_empty() { String::new() } else { format!("; not used: {}", lost.join(", ")) };
    format!(
        "no execution of {} was observed, so that nothing was compared: {} events were read, with {} complete executions{lost}; start the \
         deployment before the recording, stop it after, and build its packages with -DMAUVE_TRACING=ON",
        it.name, summary.events, summary.spans
    )
}

/// Returns the instance that a finding is about.
pub(super) fn instance<'a>(it: &'a Checked<'_>, finding: &TraceFinding) -> Option<&'a str> {
    Some(it.expected.instances.get(finding.instance?)?.instance.as_str())
}

fn codel_message(instance: &str, key: &str, is_known: bool, first: &str) -> String {
    if instance.is_empty() {
        return format!(
            "the recording has the codel `{key}`{first}, and no component of the deployment calls it"
        );
    }
    let component = if is_known { "its component" } else { "no component of the deployment" };
    let calls = if is_known { "does not call" } else { "calls" };
    format!(
        "`{instance}` executed the codel `{key}`{first}, and {component} {calls} it in the model: the recording is of another \
         version of the model"
    )
}

fn path_message(instance: &str, path: &UnknownPath, periods: &str, first: &str) -> String {
    let programs = match path.programs.as_slice() {
        [] => "no program".to_owned(),
        programs => format!("`{}`", programs.join("`, `")),
    };
    let which = match (&path.state, path.is_of_other_state) {
        (Some(state), _) => format!("in state `{state}`, which no transition of that state does"),
        (None, true) => "in a state that its previous periods do not lead to".to_owned(),
        (None, false) => "which no state of the model does".to_owned(),
    };
    format!(
        "`{instance}` executed {programs} in {periods}{first}, {which}: the recording is of another version of the model"
    )
}

/// Why a chain may be late: which response time, or which number of periods, is not that of the model.
fn chain_message(
    it: &Checked<'_>,
    chain: usize,
    (latency, bound): (u64, u64),
    count: u64,
    at: &str,
) -> String {
    let (Some(expected), Some(observed)) = (it.expected.chains.get(chain), it.observed.chains.get(chain))
    else {
        return String::new();
    };
    let mut reasons = Vec::new();
    for (step, releases) in expected.steps.iter().zip(&observed.releases) {
        let name = &step.instance;
        let found =
            it.expected.instances.iter().zip(&it.observed.instances).find(|(it, _)| it.instance == *name);
        let response = found.and_then(|(model, seen)| Some((seen.response?.time, model.response?)));
        if let Some((response, bound)) = response.filter(|(response, bound)| response > bound) {
            let (response, bound) = (precise(response), precise(bound));
            reasons.push(format!("`{name}` responded after {response}, later than its bound of {bound}"));
        }
        if let Some(most) = step.releases.filter(|most| releases > most) {
            reasons.push(format!(
                "`{name}` passed data on in its {releases}. period, and in the model in the {most}. at the latest"
            ));
        }
    }
    if reasons.is_empty() {
        reasons.push(
            "each response time and number of periods is as in the model: check the connections and the periods of the robot"
                .to_owned(),
        );
    }
    let what = if expected.bound == Some(bound) { "bound" } else { "limit" };
    let times = if count > 1 { format!(", {count} times") } else { String::new() };
    format!(
        "chain `{}` took {}{at} from a change to its effect, and exceeds its {what} of {}{times}: {}",
        expected.name,
        precise(latency),
        precise(bound),
        reasons.join("; ")
    )
}

fn response_message(instance: &str, finding: &TraceFinding, at: &str) -> String {
    let FindingKind::Response { bound, deadline, response, execution, own, interference, waited } =
        &finding.kind
    else {
        return String::new();
    };
    let limit = match (bound, deadline) {
        (Some(bound), _) => format!("its bound of {}", precise(*bound)),
        (None, Some(deadline)) => format!("its deadline of {}", precise(*deadline)),
        (None, None) => String::new(),
    };
    let mut reasons = Vec::new();
    if let Some(own) = own.filter(|own| execution > own) {
        reasons.push(format!(
            "it executed {}, longer than the {} of the model",
            precise(*execution),
            precise(own)
        ));
    }
    let exceeding = |it: &&Interferer| it.execution > it.bound || it.jobs > it.bound_jobs;
    for other in interference.iter().filter(exceeding).take(3) {
        let in_bound = match other.bound_jobs {
            0 => "the bound counts none of it".to_owned(),
            jobs => format!("the bound counts {} in {}", duration(other.bound), periods(jobs)),
        };
        reasons.push(format!(
            "`{}` executed {} in {}, and {in_bound}",
            other.instance,
            duration(other.execution),
            periods(other.jobs)
        ));
    }
    let known: u64 = interference.iter().map(|it| it.execution).fold(*execution, u64::saturating_add);
    let rest = response.saturating_sub(known);
    // What is left: less than a tenth is no explanation.
    if rest > response / 10 {
        let why = match waited {
            Waited::Unknown => {
                "it waited for a resource, an interrupt or a program that is not in the model".to_owned()
            }
            Waited::Never => {
                "no codel waited longer than the tables say, so that an interrupt or a program that is not in the model preempted it"
                    .to_owned()
            }
            Waited::Codel(codel, time) if *time >= rest - response / 10 => {
                format!("codel `{codel}` waited for up to {}", duration(*time))
            }
            Waited::Codel(codel, time) => format!(
                "codel `{codel}` waited for up to {}, and an interrupt or a program that is not in the model preempted it for the rest",
                duration(*time)
            ),
        };
        reasons.push(format!("no activity of the recording explains {} of it: {why}", duration(rest)));
    } else if reasons.is_empty() {
        reasons.push(match interference.first() {
            Some(most) => {
                format!("most interference is of `{}`, {}", most.instance, duration(most.execution))
            }
            None => format!("it executed {}", duration(*execution)),
        });
    }
    let late = match finding.count {
        0 | 1 => String::new(),
        count => format!(", as at least {count} periods do"),
    };
    format!(
        "`{instance}` responded after {}{at}, and exceeds {limit}{late}: {}",
        precise(*response),
        reasons.join("; ")
    )
}

/// Returns a time with all its digits: two times that differ never look the same.
fn precise(nanoseconds: u64) -> String {
    Time::from_nanos(nanoseconds).to_string()
}

fn scheduler(priority: u32) -> String {
    match priority {
        0 => "no real-time priority".to_owned(),
        priority => format!("priority {priority}"),
    }
}

pub(super) fn periods(count: u64) -> String {
    counted(count as usize, "period")
}

/// Returns an expected number of executions.
pub(super) fn number(value: f64) -> String {
    match value {
        ..=0.0 => "0".to_owned(),
        ..0.001 => format!("{value:.0e}"),
        ..10.0 => format!("{value:.3}"),
        _ => format!("{value:.0}"),
    }
}
