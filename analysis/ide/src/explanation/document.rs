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

use mauve_diagnostics::capitalised;
use mauve_diagnostics::figure::{Forms, TIGHT_SLACK};
use mauve_hir::item_tree::Name;
use mauve_timing::{Status, Time};
use mauve_wcrt::Share;

use super::{Explanation, Load, Overload, OwnTime, Released, Row, SHOWN_PERIODS, Sum, Trace};
use crate::doc::{Align, Block, Doc, Line, Span, Table, words};
use crate::occurrences::grouped;

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
        match (&self.sum, self.activity.response, self.activity.first_job) {
            (Some(sum), Some(response), _) => {
                doc.blocks.push(self.sum_table(sum, response, "response time", most))
            }
            (Some(sum), None, Some(end)) if self.overload.is_none() => {
                doc.blocks.push(self.sum_table(sum, end, "end of its first job", most));
            }
            _ => {}
        }
        doc.blocks.extend(self.overload.as_ref().map(|overload| load_table(overload, most)));
        if let Some(own) = self.own.as_ref().filter(|own| own.of_programs > Time::ZERO) {
            own.costliest_period(&mut doc);
        }
        if let Some(trace) = self.trace.as_ref().filter(|trace| !trace.periods.is_empty()) {
            trace.costliest_path(&mut doc);
        }
        doc.blocks.push(Block::Rule);
        doc.list(self.details());
        doc
    }

    /// Adds the first line, and the reasons below it if there are several.
    fn verdict(&self, doc: &mut Doc<'db>) {
        let activity = self.activity;
        let deadline = activity.deadline.unwrap_or_default();
        let first = self.reasons.first().map(|why| why.text.clone()).unwrap_or_default();
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
        let assumed = if self.is_assumed { ", with assumed times" } else { "" };
        match activity.verdict {
            Status::Background => {}
            // Most reasons do not depend on the level.
            Status::NotAnalysed => rest += &self.of_which,
            _ => rest += &format!(" at {}{assumed}{}", self.query.level, self.of_which),
        }
        doc.blocks.push(Block::Line(vec![Span::Strong(strong), Span::Words(rest)]));
        let others = self.reasons.iter().skip(1).map(|why| words(why.text.clone()));
        let behind = self.reasons.iter().filter_map(|why| why.behind.as_ref());
        let behind = behind.map(|(instance, text)| vec![code(instance), Span::Words(format!(": {text}"))]);
        doc.list(others.chain(behind));
    }

    /// Returns the table of a response time, or of the time until the first job ends. Its rows sum to that.
    fn sum_table(&self, sum: &Sum<'db>, total: Time, name: &str, most: usize) -> Block<'db> {
        let whole = total.as_nanos() as f64;
        let mut rows: Vec<Vec<Line<'db>>> = Vec::new();
        let mut line = |what: Line<'db>, priority: String, jobs: String, time: Time| {
            let bar = Span::Bar(time.as_nanos() as f64 / whole);
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
                        Span::Words("operation ".into()),
                        code(&it.operation),
                        Span::Words(" for ".into()),
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
            line(named(it), priority(it.priority), jobs_of(it.count, it.each, it.time), it.time);
        }
        if others > 0 {
            line(words(format!("{others} more activities")), String::new(), String::new(), of_others);
        }
        if sum.blocking > Time::ZERO {
            line(words("lower priorities that hold locks"), String::new(), String::new(), sum.blocking);
        }
        let mut without_bar = |what: &str, time: String| {
            let empty = Vec::new;
            rows.push(vec![words(what), empty(), empty(), words(time), empty()]);
        };
        if sum.at_once > Time::ZERO {
            without_bar("on several CPUs at once", format!("−{}", sum.at_once));
        }
        match sum.released {
            Released::AtStart => {}
            Released::After(by) => {
                without_bar("start of the busy window until the release", format!("−{by}"))
            }
            Released::Before(by) => without_bar("release until the start of the busy window", by.to_string()),
        }
        rows.push(last_row(name, total.to_string()));
        Block::Table(Table { columns: SUM, rows })
    }

    fn details(&self) -> Vec<Line<'db>> {
        let activity = self.activity;
        let jitter = Some(activity.jitter).filter(|jitter| *jitter > Time::ZERO);
        let times = [("period", activity.period), ("deadline", activity.deadline), ("jitter", jitter)];
        let times = times.into_iter().filter_map(|(name, time)| Some(format!("{name} {}", time?)));
        let method = format!("method {}", self.method());
        let rest: Vec<String> = times.chain(self.released.clone()).chain([method]).collect();
        let rest = rest.join(", ");
        let first = match activity.component_name.is_empty() {
            true => words(rest),
            false => {
                vec![
                    Span::Words("component ".into()),
                    code(&activity.component_name),
                    Span::Words(format!(", {rest}")),
                ]
            }
        };
        let mut found = vec![first];
        found.extend(self.notes.iter().cloned().chain(self.busy_window()).map(words));
        if let Some(crossed) = &self.crossed {
            found.push(words(format!(
                "fixed-point iteration {} exceeds the deadline, {} after the start of the busy window: {}",
                crossed.iteration, crossed.deadline, crossed.shown
            )));
        }
        if let Some(first_job) = self.critical.filter(|time| activity.response != Some(*time)) {
            found.push(words(format!("response time at the critical instant: {first_job}")));
        }
        found
    }
}

fn code<'db>(name: &Name) -> Span<'db> {
    Span::Code(name.to_string())
}

/// Returns the name of an activity with its note and the mark of assumed times.
fn named<'db>(of: &Row<'db>) -> Line<'db> {
    let assumed = if of.is_assumed { " (with assumed times)" } else { "" };
    let note = of.note.as_ref().map_or_else(String::new, |note| format!(" ({note})"));
    vec![Span::Name(of.name.clone(), of.at.clone()), Span::Words(note + assumed)]
}

fn priority(of: Option<u32>) -> String {
    of.map_or_else(String::new, |priority| priority.to_string())
}

fn last_row<'db>(name: &str, total: String) -> Vec<Line<'db>> {
    vec![vec![Span::Strong(name.to_owned())], Vec::new(), Vec::new(), vec![Span::Strong(total)], Vec::new()]
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

/// Returns the table of the utilisation of an overloaded CPU.
fn load_table<'db>(overload: &Overload<'db>, most: usize) -> Block<'db> {
    let mut parts: Vec<_> = overload.parts.iter().collect();
    parts.sort_by(|a, b| b.share.0.total_cmp(&a.share.0));
    let percent = |share: f64| format!("{:.1} %", share * 100.0);
    let row = |Load { of, period, share: Share(share) }: &Load<'db>| {
        let time = of.each.zip(*period).map(|(time, period)| format!("{time} per {period}"));
        let bar = Span::Bar(share / overload.utilisation.0);
        let (priority, time) = (words(priority(of.priority)), words(time.unwrap_or_default()));
        vec![named(of), priority, time, words(percent(*share)), vec![bar]]
    };
    let mut rows: Vec<Vec<Line<'db>>> = parts.iter().take(most).map(|of| row(of)).collect();
    if let Some(others) = parts.len().checked_sub(most).filter(|others| *others > 0) {
        let share = parts.iter().skip(most).map(|it| it.share.0).sum();
        let what = words(format!("{others} more activities"));
        rows.push(vec![what, Vec::new(), Vec::new(), words(percent(share)), Vec::new()]);
    }
    let what = format!("{}, priority ≥ {}", overload.named, overload.priority);
    rows.push(last_row(&what, percent(overload.utilisation.0)));
    Block::Table(Table { columns: LOAD, rows })
}

impl OwnTime<'_> {
    /// Adds the greatest execution time of a period by programs and codels.
    fn costliest_period(&self, doc: &mut Doc<'_>) {
        let line = Span::Words(format!("costliest period: {}, ", self.of_programs));
        doc.blocks.push(Block::Line(vec![line, Span::Code(self.period.clone())]));
        let programs = self.programs.iter().map(|(program, codels)| {
            let mut line = vec![code(&program.name), Span::Words(format!(" {}", program.time))];
            for (index, it) in codels.iter().enumerate() {
                let assumed = if it.is_assumed { " (assumed)" } else { "" };
                let sign = if index == 0 { ": " } else { ", " };
                line.push(Span::Words(sign.to_owned()));
                line.extend([code(&it.name), Span::Words(format!(" {}{assumed}", it.time))]);
            }
            line
        });
        doc.list(programs.chain(self.others().map(|(time, what)| words(format!("{what} {time}")))));
    }
}

impl Trace<'_> {
    fn costliest_path(&self, doc: &mut Doc<'_>) {
        let total = self.total.map_or_else(String::new, |sum| format!(": {sum}"));
        doc.blocks.push(Block::Line(words(format!("costliest {SHOWN_PERIODS} consecutive periods{total}"))));
        // Each kind of period once, as a cycle repeats them.
        let kinds = grouped(self.periods.iter().map(|it| ((&it.name, it.time), it.count))).into_iter();
        doc.list(kinds.map(|((name, time), counts)| {
            let count: u64 = counts.into_iter().sum();
            vec![code(name), Span::Words(format!(" {count} × {time}"))]
        }));
    }
}
