//! The document of an explanation: the verdict, a table whose rows sum to the response time, the costliest path through the state
//! machine, and the details.
//!
//! ```text
//! ✓ 53 / 100 ms ▰▰▰▱▱▱ 53 %, slack 47 ms at 1e-4
//!
//!                priority       jobs   time
//! own time              9  1 × 43 ms  43 ms  ████████████████▎
//! p3dx_driver          10  1 × 10 ms  10 ms  ███▊
//! response time                       53 ms
//! ```

use mauve_diagnostics::figure::{Forms, TIGHT_SLACK};
use mauve_diagnostics::{capitalised, times_of};
use mauve_hir::item_tree::Name;
use mauve_timing::{Status, THROTTLING, Task, Time};
use mauve_wcrt::{ActivityReport, Reason, Share};

use super::{Explanation, Sum, Summand, blocking_priorities, releases};
use crate::doc::{Align, Doc, DocBlock, DocLine, DocSpan, DocTable, words};

/// Columns of numbers beside each other, which editors set without a space: the priority is in the middle of its column.
const SUM: &[(&str, Align)] = &[
    ("", Align::Left),
    ("priority", Align::Middle),
    ("jobs", Align::Right),
    ("time", Align::Right),
    ("", Align::Left),
];

const LOAD: &[(&str, Align)] = &[
    ("", Align::Left),
    ("priority", Align::Middle),
    ("execution time", Align::Right),
    ("utilisation", Align::Right),
    ("", Align::Left),
];

impl<'db> Explanation<'_, 'db> {
    /// Returns the document. A table names at most as many activities; its last row sums the others.
    pub(super) fn document(&self, most: usize) -> Doc<'db> {
        let mut doc = Doc::default();
        self.verdict(&mut doc);
        if self.activity.verdict == Status::Background {
            return doc;
        }
        let overload = self.load_table(most);
        doc.blocks.extend(match (self.activity.response, self.activity.first_job) {
            (Some(response), _) => self.sum_table(response, "response time", most),
            (None, Some(end)) if overload.is_none() => self.sum_table(end, "end of its first job", most),
            _ => None,
        });
        doc.blocks.extend(overload);
        if let Some(own) = self.own.as_ref().filter(|own| own.of_programs > Time::ZERO) {
            let line = DocSpan::Words(format!("costliest period: {}, ", own.of_programs));
            doc.blocks.push(DocBlock::Line(vec![line, DocSpan::Code(own.period.clone())]));
            let others = own.others.iter().map(|(time, what)| words(format!("{what} {time}")));
            doc.list(own.programs.iter().cloned().chain(others));
        }
        if let Some((line, kinds)) = self.costliest_path() {
            doc.blocks.push(DocBlock::Line(words(line)));
            doc.list(kinds);
        }
        doc.blocks.push(DocBlock::Rule);
        doc.list(self.details());
        doc
    }

    /// Adds the first line, and the reasons below it if there are several.
    fn verdict(&self, doc: &mut Doc<'db>) {
        let activity = self.activity;
        let deadline = activity.deadline.unwrap_or_default();
        let (reasons, behind) = self.reasons();
        let first = reasons.first().cloned().unwrap_or_default();
        let after = |from: Time, to: Time| to.checked_sub(from).unwrap_or_default();
        let figure = |response: Time, slack: String| {
            let forms = Forms::of(response, deadline, TIGHT_SLACK);
            let bar = forms.bar.as_ref().map(|bar| bar.join(" ")).unwrap_or_default();
            (forms.text().to_owned(), format!(" {bar}, {slack}"))
        };
        let (strong, mut rest) = match (activity.verdict, activity.response) {
            (Status::Background, _) => ("Background".to_owned(), ": not real-time, not analysed".to_owned()),
            (Status::Met, Some(response)) => figure(response, format!("slack {}", after(response, deadline))),
            (Status::Missed, Some(response)) => {
                figure(response, format!("missed by {}", after(deadline, response)))
            }
            (Status::Unbounded, _) => (first, ": no bounded response time".to_owned()),
            (Status::NotAnalysed, _) => ("Not analysed".to_owned(), format!(": {first}")),
            (_, _) => (capitalised(&first), String::new()),
        };
        let is_assumed = self.report.with_assumptions().get(self.index) == Some(&true);
        let assumed = if is_assumed { ", with assumed times" } else { "" };
        let of_which = times_of(self.report.times.as_deref());
        match activity.verdict {
            Status::Background => {}
            // Most reasons do not depend on the level.
            Status::NotAnalysed => rest += &of_which,
            _ => rest += &format!(" at {}{assumed}{}", self.query.level, of_which),
        }
        doc.blocks.push(DocBlock::Line(vec![DocSpan::Strong(strong), DocSpan::Words(rest)]));
        doc.list(reasons.into_iter().skip(1).map(words).chain(behind));
    }

    /// Returns the table of a response time, or of the time until the first job ends. Its rows sum to that.
    fn sum_table(&self, total: Time, name: &str, most: usize) -> Option<DocBlock<'db>> {
        let sum = Sum::new(self.db, self.report, self.index, self.own.as_ref())?;
        let whole = total.as_nanos() as f64;
        let mut rows: Vec<Vec<DocLine<'db>>> = Vec::new();
        let mut line = |what: DocLine<'db>, priority: String, jobs: String, time: Time| {
            let bar = DocSpan::Bar(time.as_nanos() as f64 / whole);
            rows.push(vec![what, words(priority), words(jobs), words(time.to_string()), vec![bar]]);
        };
        let jobs = self.activity.window.as_ref().map_or(1, |window| window.job);
        let own_priority = priority(self.activity.priority.real_time());
        match sum.programs() {
            Some(time) => {
                let greatest = self.own.as_ref().and_then(|own| match own.of_component {
                    Some(time) => Some(time),
                    None => own.of_programs.checked_sub(own.overhead),
                });
                line(words("own time"), own_priority, jobs_of(jobs, greatest, time), time);
                for it in &sum.calls {
                    let calls = if it.calls == 1 { "call" } else { "calls" };
                    let what = vec![
                        DocSpan::Words("operation ".into()),
                        code(&it.operation),
                        DocSpan::Words(" for ".into()),
                        code(&it.client),
                    ];
                    line(what, String::new(), format!("{} {calls}", it.calls), it.time);
                }
                if sum.overhead > Time::ZERO {
                    let each = self.own.as_ref().map(|own| own.overhead);
                    let what = words("dispatch and context switches");
                    line(what, String::new(), jobs_of(jobs, each, sum.overhead), sum.overhead);
                }
            }
            None => line(words("own time"), own_priority, jobs.to_string(), sum.own),
        }
        let (shown, others, of_others) = sum.greatest(most);
        for it in shown {
            line(named_row(it), priority(it.priority), jobs_of(it.count, it.each, it.time), it.time);
        }
        if others > 0 {
            line(words(format!("{others} more activities")), String::new(), String::new(), of_others);
        }
        if sum.blocking > Time::ZERO {
            line(words(blocking_priorities(self.report)), String::new(), String::new(), sum.blocking);
        }
        let without_bar = [
            ("on several CPUs at once", "−", sum.at_once),
            ("start of the busy window until the release", "−", sum.until_release),
            ("release until the start of the busy window", "", sum.since_release),
        ];
        for (what, sign, time) in without_bar.into_iter().filter(|(.., time)| *time > Time::ZERO) {
            let time = words(format!("{sign}{time}"));
            rows.push(vec![words(what), Vec::new(), Vec::new(), time, Vec::new()]);
        }
        rows.push(last_row(name, total.to_string()));
        Some(DocBlock::Table(DocTable { columns: SUM, rows }))
    }

    fn details(&self) -> Vec<DocLine<'db>> {
        let activity = self.activity;
        let jitter = Some(activity.jitter).filter(|jitter| *jitter > Time::ZERO);
        let times = [("period", activity.period), ("deadline", activity.deadline), ("jitter", jitter)];
        let times = times.into_iter().filter_map(|(name, time)| Some(format!("{name} {}", time?)));
        // The method that gives the response time, otherwise the requested one.
        let method = activity.method.map_or(self.query.method, |(method, _)| method);
        let method = format!("method {method}");
        let rest: Vec<String> = times.chain(releases(&activity.task)).chain([method]).collect();
        let rest = rest.join(", ");
        let first = match activity.component_name.is_empty() {
            true => words(rest),
            false => {
                vec![
                    DocSpan::Words("component ".into()),
                    code(&activity.component_name),
                    DocSpan::Words(format!(", {rest}")),
                ]
            }
        };
        std::iter::once(first).chain(self.notes().into_iter().map(words)).collect()
    }

    /// Returns the table of the utilisation of its CPU, if that is overloaded.
    fn load_table(&self, most: usize) -> Option<DocBlock<'db>> {
        let overload = self.activity.reasons.iter().find_map(|it| match &it.reason {
            Reason::Overloaded { cpu, named, priority, utilisation } => {
                Some((*cpu, named, *priority, *utilisation))
            }
            _ => None,
        });
        let (cpu, named, least, Share(utilisation)) = overload?;
        let is_counted =
            |it: &Task| it.priority.real_time() >= Some(least) && it.cpus.is_some_and(|cpus| cpus.meets(cpu));
        let of_activity = |it: &ActivityReport<'db>| Some((Summand::activity(it), it.period, it.share?.0));
        let of_other = |it: &Task| {
            let (time, period) = it.greatest_cost().zip(it.period)?;
            let share = time.as_nanos() as f64 * it.burst() as f64 / period.as_nanos() as f64;
            Some((Summand::other(it), it.period, share))
        };
        let activities = self.report.activities.iter().filter(|it| is_counted(it)).filter_map(of_activity);
        let others = self.report.others().iter().filter(|it| is_counted(it)).filter_map(of_other);
        let throttling = self.origin.throttling == Some(true);
        let throttling = throttling.then(|| (Summand::named(THROTTLING), None, 0.05));
        let mut parts: Vec<_> = activities.chain(others).chain(throttling).collect();
        parts.sort_by(|a, b| b.2.total_cmp(&a.2));
        let percent = |share: f64| format!("{:.1} %", share * 100.0);
        let row = |(of, period, share): &(Summand<'db>, Option<Time>, f64)| {
            let time = of.each.zip(*period).map(|(time, period)| format!("{time} per {period}"));
            let bar = DocSpan::Bar(share / utilisation);
            let (priority, time) = (words(priority(of.priority)), words(time.unwrap_or_default()));
            vec![named_row(of), priority, time, words(percent(*share)), vec![bar]]
        };
        let mut rows: Vec<Vec<DocLine<'db>>> = parts.iter().take(most).map(row).collect();
        if let Some(others) = parts.len().checked_sub(most).filter(|others| *others > 0) {
            let share = parts.iter().skip(most).map(|it| it.2).sum();
            let what = words(format!("{others} more activities"));
            rows.push(vec![what, Vec::new(), Vec::new(), words(percent(share)), Vec::new()]);
        }
        rows.push(last_row(&format!("{named}, priority ≥ {least}"), percent(utilisation)));
        Some(DocBlock::Table(DocTable { columns: LOAD, rows }))
    }
}

fn code<'db>(name: &Name) -> DocSpan<'db> {
    DocSpan::Code(name.to_string())
}

/// Returns the name of an activity with its note and the mark of assumed times.
fn named_row<'db>(of: &Summand<'db>) -> DocLine<'db> {
    let assumed = if of.is_assumed { " (with assumed times)" } else { "" };
    let note = of.note.as_ref().map_or_else(String::new, |note| format!(" ({note})"));
    vec![DocSpan::Name(of.name.clone(), of.at.clone()), DocSpan::Words(note + assumed)]
}

fn priority(of: Option<u32>) -> String {
    of.map_or_else(String::new, |priority| priority.to_string())
}

fn last_row<'db>(name: &str, total: String) -> Vec<DocLine<'db>> {
    vec![
        vec![DocSpan::Strong(name.to_owned())],
        Vec::new(),
        Vec::new(),
        vec![DocSpan::Strong(total)],
        Vec::new(),
    ]
}

/// Returns `10 × 43 ms` where each job has the greatest time, `10 × ≤ 297 ms` where some have less. A job without demand, which
/// counts as 1 ns, has no factor.
fn jobs_of(jobs: u64, greatest: Option<Time>, sum: Time) -> String {
    let all = greatest.and_then(|greatest| Some((greatest, greatest.checked_mul(jobs)?)));
    match all {
        Some((greatest, all)) if all == sum => format!("{jobs} × {greatest}"),
        Some((greatest, all)) if all > sum => format!("{jobs} × ≤ {greatest}"),
        _ => jobs.to_string(),
    }
}
