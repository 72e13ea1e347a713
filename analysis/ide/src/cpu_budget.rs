//! The CPU budget of a deployment: for each CPU a bar of its instances, the largest part first, and what is left. Above 90 %, a second
//! bar of characters shows the last per cents enlarged: 94 % and 99.7 % are not alike.
//!
//! ```text
//! P3dxDeployment at 1e-4: CPU budget
//!
//! ! CPU 1: 99.4 % used, 0.6 % left
//!   hokuyo       43.0 %  █████████████████
//!   navigation   29.4 %                   ████████████
//!   …
//!   90 to 100 %          █████████████████████████████████████▋░░▏
//! ```

use std::fmt::Write as _;

use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::HintStatus;
use mauve_diagnostics::{known_utilisation, times_of};
use mauve_hir::{Decl, ModelDb, Project};
use mauve_timing::CpuLoad;
use mauve_wcrt::{CpuBudget, CpuPart, Query, response_times};

use crate::chart::Axis;
use crate::drawing::{Drawing, drawn_name};
use crate::svg::{Anchor, Svg, fitted, text_width};
use crate::text_canvas::{cells, padded};

/// The CPU budget of a deployment as it is drawn.
#[derive(Debug, Clone)]
pub struct DrawnBudget<'db> {
    /// The title.
    pub title: String,
    /// The CPUs that are used.
    pub cpus: Vec<DrawnCpu<'db>>,
}

/// A CPU as it is drawn, or several CPUs that activities may use alternatively.
#[derive(Debug, Clone)]
pub struct DrawnCpu<'db> {
    /// `CPU 1`, `CPUs 1 and 2`.
    pub name: String,
    /// `! CPU 1: 99.4 % used, 0.6 % left`
    pub figure: String,
    /// The colour of the figure.
    pub status: HintStatus,
    /// The utilisation of one CPU: 1 is all of it.
    pub used: f64,
    /// The number of CPUs.
    pub limit: f64,
    /// The CPUs with their exact utilisation.
    pub load: &'db CpuLoad,
    /// What executes there, the largest part first, with the figure of its response time; empty for other work than activities.
    pub parts: Vec<(CpuPart, String)>,
}

/// Returns the mark and the status of a CPU. Less than `tight_slack` percent left are little.
pub fn cpu_status(load: &CpuLoad, tight_slack: u32) -> (&'static str, HintStatus) {
    let limit = load.cpus.len().max(1) as f64;
    let left = limit - load.utilisation.as_f64();
    match load.complete {
        _ if limit > 1.0 && left < 0.0 || limit == 1.0 && load.utilisation.exceeds_one() => {
            ("✗", HintStatus::Missed)
        }
        false => ("?", HintStatus::Unknown),
        true if left * 100.0 < limit * f64::from(tight_slack) => ("!", HintStatus::Tight),
        true => ("✓", HintStatus::Met),
    }
}

/// Returns the CPU budget of a deployment. Less than `tight_slack` percent left are little.
pub fn drawn_budget<'db>(
    db: &'db dyn ModelDb,
    (project, of, query): (Project<'db>, Decl<'db>, Query),
    tight_slack: u32,
) -> DrawnBudget<'db> {
    let report = response_times(db, project, of, query);
    let footings = report.footings();
    let drawn = |CpuBudget { load, parts }: CpuBudget<'db>| {
        let (used, limit) = (load.utilisation.as_f64(), load.cpus.len().max(1) as f64);
        let left = limit - used;
        let (mark, status) = cpu_status(load, tight_slack);
        let name = report.hosts.names(load.cpus);
        let rest = match status == HintStatus::Missed {
            true => format!("overloaded by {}", percent(-left)),
            false => format!("{} left", percent(left)),
        };
        let figure_of = |it: &CpuPart| {
            let activity = report.activities.get(it.activity?)?;
            Some(figure(db, activity, *footings.get(it.activity?)?, tight_slack).text().to_owned())
        };
        let part = |it: CpuPart| {
            (CpuPart { name: drawn_name(&it.name).into(), ..it.clone() }, figure_of(&it).unwrap_or_default())
        };
        DrawnCpu {
            figure: format!("{mark} {name}: {} used, {rest}", known_utilisation(load)),
            name,
            status,
            used,
            limit,
            load,
            parts: parts.into_iter().map(part).collect(),
        }
    };
    let times = times_of(report.times.as_deref());
    DrawnBudget {
        title: format!("{} at {}{times}: CPU budget", drawn_name(of.name(db)), query.level),
        cpus: report.budgets().into_iter().map(drawn).collect(),
    }
}

/// Returns `29.4 %`; a part that is not 0 never becomes 0.
fn percent(share: f64) -> String {
    let percent = share * 100.0;
    match percent {
        0.05.. => format!("{percent:.1} %"),
        0.0 => "0.0 %".to_owned(),
        _ => "< 0.1 %".to_owned(),
    }
}

/// The greatest number of parts that have a name.
const MOST_PARTS: usize = 12;

impl DrawnCpu<'_> {
    /// Returns the parts that are shown with their figures; many small ones are one.
    fn shown(&self) -> Vec<(String, f64, &str)> {
        let (shown, others) = self.parts.split_at(match self.parts.len() {
            several if several > MOST_PARTS => MOST_PARTS - 1,
            all => all,
        });
        let of_others = others.iter().map(|(it, _)| it.share).sum();
        let others = (!others.is_empty()).then(|| (format!("{} more", others.len()), of_others, ""));
        shown
            .iter()
            .map(|(it, figure)| (it.name.to_string(), it.share, figure.as_str()))
            .chain(others)
            .collect()
    }

    /// Returns `████▉▏ ! CPU 1: 99.4 % used, 0.6 % left: hokuyo 43.0 %, navigation 29.4 %, 6 more 27.0 %`, with names as `name` writes
    /// them. The bar has four characters for 90 %, and one for the last 10 %.
    pub(crate) fn line(&self, name: impl Fn(&str) -> String) -> String {
        const NAMED: usize = 4;
        let part = self.used / self.limit;
        let bar = match part {
            0.9.. => "████".to_owned() + &filled((part - 0.9) * 10.0, 1),
            _ => filled(part / 0.9, 4) + "░",
        };
        let (shown, others) = self.parts.split_at(self.parts.len().min(NAMED));
        let of_others = others.iter().map(|(it, _)| it.share).sum();
        let others = (!others.is_empty()).then(|| format!("{} more {}", others.len(), percent(of_others)));
        let shown = shown.iter().map(|(it, _)| format!("{} {}", name(&it.name), percent(it.share)));
        format!("{bar}▏ {}: {}", self.figure, shown.chain(others).collect::<Vec<_>>().join(", "))
    }

    /// Returns what a bar of the last per cents shows, as parts of the limit: `(0.9, 1.0)`.
    fn enlarged(&self) -> Option<(f64, f64)> {
        match self.used / self.limit {
            0.9..=1.0 => Some((0.9, 1.0)),
            1.0..1.1 => Some((0.9, 1.1)),
            _ => None,
        }
    }
}

/// Draws the CPU budget.
pub fn draw_budget(budget: &DrawnBudget<'_>, drawing: Drawing) -> String {
    match drawing {
        Drawing::Svg | Drawing::Narrow => svg(budget),
        Drawing::Text(_) | Drawing::Dot => text(budget, drawing.columns()),
    }
}

fn text(budget: &DrawnBudget<'_>, columns: Option<usize>) -> String {
    const MOST_COLUMNS: usize = 40;
    let mut out = format!("{}\n", budget.title);
    for cpu in &budget.cpus {
        let shown = cpu.shown();
        let enlarged = cpu
            .enlarged()
            .map(|(from, to)| (format!("{:.0} to {:.0} %", from * 100.0, to * 100.0), from, to));
        let names = shown
            .iter()
            .map(|(name, ..)| name.as_str())
            .chain(enlarged.as_ref().map(|(name, ..)| name.as_str()));
        let widest = names.map(cells).fold(0.0, f64::max) as usize;
        // Beside the name, the share and the space between them.
        let room = columns.map_or(MOST_COLUMNS, |all| all.saturating_sub(widest + 14));
        let room = room.clamp(10, MOST_COLUMNS);
        let whole = cpu.limit.max(cpu.used);
        let column = |part: f64| (part / whole * room as f64).round() as usize;
        let row = |name: &str, share: &str, bar: &str| {
            format!("  {}  {share:>7}  {bar}", padded(name, widest)).trim_end().to_owned() + "\n"
        };
        let _ = writeln!(out, "\n{}", cpu.figure);
        let mut used = 0.0;
        for (name, share, _) in &shown {
            let (start, end) = (column(used), column(used + share).max(column(used) + 1));
            used += share;
            // What is beyond the limit looks different.
            let cell = |at: usize| if at < column(cpu.limit) { '█' } else { '▒' };
            let bar: String = std::iter::repeat_n(' ', start).chain((start..end).map(cell)).collect();
            out += &row(name, &percent(*share), &bar);
        }
        if let Some((name, from, to)) = enlarged {
            let part = (cpu.used / cpu.limit - from) / (to - from);
            out += &row(&name, "", &(filled(part, room) + "▏"));
        }
    }
    out
}

/// Returns a bar in eighths of a character, with the space that is left: full only if all of it is used.
fn filled(part: f64, columns: usize) -> String {
    const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let eighths = ((part.clamp(0.0, 1.0) * columns as f64 * 8.0) as usize).min(columns * 8);
    let bar = "█".repeat(eighths / 8) + EIGHTHS.get(eighths % 8).copied().unwrap_or_default();
    bar + &"░".repeat(columns - eighths.div_ceil(8))
}

const WIDTH: f64 = 620.0;
const MARGIN: f64 = 16.0;
const PLOT: f64 = WIDTH - 2.0 * MARGIN;
const BAR: f64 = 26.0;
const LINE: f64 = 19.0;

fn svg(budget: &DrawnBudget<'_>) -> String {
    let mut svg = Svg::default();
    let mut y = 58.0;
    for cpu in &budget.cpus {
        svg_cpu(&mut svg, cpu, &mut y);
    }
    let width = WIDTH.max(text_width(&budget.title, 14.0, true) + 2.0 * MARGIN);
    svg.document((width, y), (MARGIN, 24.0), &budget.title)
}

fn svg_cpu(svg: &mut Svg, cpu: &DrawnCpu<'_>, y: &mut f64) {
    let shown = cpu.shown();
    let axis = Axis::linear((0.0, cpu.limit.max(cpu.used)), 0.0, (MARGIN, MARGIN + PLOT));
    svg.group(&format!("box {}", cpu.status.name()), &[], &cpu.figure);
    svg.text("name status", (MARGIN, *y), Anchor::Start, &fitted(&cpu.figure, PLOT, 13.0, true));
    *y += 9.0;
    svg_bar(svg, &shown, cpu, &axis, *y);
    *y += BAR + 13.0;
    for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let x = axis.at(part * cpu.limit);
        let anchor = match x - MARGIN {
            ..8.0 => Anchor::Start,
            x if x > PLOT - 8.0 => Anchor::End,
            _ => Anchor::Middle,
        };
        svg.text("mark", (x, *y), anchor, &format!("{:.0} %", part * cpu.limit * 100.0));
    }
    *y += 6.0;
    for (index, (name, share, figure)) in shown.iter().enumerate() {
        let column = (index % 2) as f64 * (PLOT / 2.0 + 8.0);
        *y += if column == 0.0 { LINE } else { 0.0 };
        let (x, width) = (MARGIN + column, PLOT / 2.0 - 16.0);
        svg.rect_with(&format!("cpu{}", index % 8), [x, *y - 10.0, 11.0, 11.0], &[("rx", &2)], "");
        // The name comes first where both have no room.
        let of_name = text_width(name, 12.0, false).min(width - 190.0);
        let figure = &fitted(figure, width - of_name - 84.0, 12.0, false);
        let name = fitted(name, width - text_width(figure, 12.0, false) - 84.0, 12.0, false);
        svg.text("figure", (x + 74.0, *y), Anchor::Start, &name);
        svg.text("figure", (x + 66.0, *y), Anchor::End, &percent(*share));
        svg.text("soft", (x + width, *y), Anchor::End, figure);
    }
    svg.end();
    *y += 40.0;
}

/// Draws the parts of a bar, and the limit.
fn svg_bar(svg: &mut Svg, shown: &[(String, f64, &str)], cpu: &DrawnCpu<'_>, axis: &Axis, y: f64) {
    let mut rect = |class: &str, start: f64, end: f64, title: &str| {
        let (x, width) = (axis.at(start), axis.at(end) - axis.at(start));
        if width > 0.0 {
            svg.rect_with(class, [x, y, width, BAR], &[], title);
        }
    };
    rect("track", 0.0, cpu.limit, "");
    let mut used = 0.0;
    let mut labels = Vec::new();
    for (index, (name, share, figure)) in shown.iter().enumerate() {
        let (start, end) = (used, used + share);
        used = end;
        let title = format!("{name}: {} {figure}", percent(*share));
        rect(&format!("slice cpu{}", index % 8), start, end, title.trim_end());
        let width = axis.at(end.min(cpu.limit)) - axis.at(start) - 8.0;
        if text_width(name, 12.0, false) <= width {
            labels.push((axis.at(start) + 4.0, name));
        }
    }
    rect("late", cpu.limit, used.max(cpu.used), "beyond the CPU");
    for (x, name) in labels {
        svg.text("inner figure", (x, y + 17.0), Anchor::Start, name);
    }
    if cpu.used > cpu.limit {
        svg.path("deadline", &format!("M{:.1} {:.1}v{}", axis.at(cpu.limit), y - 4.0, BAR + 8.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use expect_test::expect;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::names_of;

    /// The budget of activities on CPU 1 with these times in a period of 1000 ms.
    fn drawn(times: &[u32], drawing: Drawing) -> String {
        let mut text = "shell S { } ".to_owned();
        let (mut instances, mut activities, mut codels) = (String::new(), String::new(), String::new());
        for (index, time) in times.iter().enumerate() {
            text += &format!(
                "codel c{index}(): int core C{index}(S) {{ update = {{ c{index}(); }} }} component K{index}(S, C{index}) "
            );
            instances += &format!("instance i{index}: K{index} ");
            activities +=
                &format!("activity i{index} {{ affinity = 1 priority = {} period = 1000 }} ", 90 - index);
            codels += &format!("codel.c{index} = {time}\n");
        }
        text += &format!("architecture A {{ {instances} }} deployment D {{ architecture A {activities} }}\n");
        text += &format!(
            "//- /mauve.toml\ntiming.tables = [\"t.toml\"]\nplatform.cpus = 2\nplatform.rt_throttling = true\n//- /t.toml\n{codels}"
        );
        let Fixture { db, workspace, file, .. } = Fixture::new(&text);
        let project = project_of(&db, workspace, file);
        let of = names_of(&db, project).of_kind(&db, Kind::Deployment).next().unwrap();
        let budget = drawn_budget(&db, (project, of, Query::shown(&db, project, of)), 10);
        let lines: Vec<String> = budget.cpus.iter().map(|it| it.line(str::to_owned)).collect();
        draw_budget(&budget, drawing) + &lines.join("\n") + "\n"
    }

    #[test]
    fn the_largest_part_is_the_first() {
        expect![[r#"
            D at 1e-4: CPU budget

            ✓ CPU 1: 85.0 % used, 15.0 % left
              i1                     50.0 %  ████████████████████
              i2                     20.0 %                      ████████
              i0                     10.0 %                              ████
              real-time throttling    5.0 %                                  ██
            ███▊░▏ ✓ CPU 1: 85.0 % used, 15.0 % left: i1 50.0 %, i2 20.0 %, i0 10.0 %, real-time throttling 5.0 %
        "#]].assert_eq(&drawn(&[100, 500, 200], Drawing::Text(None)));
    }

    #[test]
    fn the_last_per_cents_differ() {
        let found = drawn(&[890], Drawing::Text(None)) + &drawn(&[947], Drawing::Text(None));
        expect![[r#"
            D at 1e-4: CPU budget

            ! CPU 1: 94.0 % used, 6.0 % left
              i0                     89.0 %  ████████████████████████████████████
              real-time throttling    5.0 %                                      ██
              90 to 100 %                    ███████████████▉░░░░░░░░░░░░░░░░░░░░░░░░▏
            ████▍▏ ! CPU 1: 94.0 % used, 6.0 % left: i0 89.0 %, real-time throttling 5.0 %
            D at 1e-4: CPU budget

            ! CPU 1: 99.7 % used, 0.3 % left
              i0                     94.7 %  ██████████████████████████████████████
              real-time throttling    5.0 %                                        ██
              90 to 100 %                    ██████████████████████████████████████▊░▏
            ████▉▏ ! CPU 1: 99.7 % used, 0.3 % left: i0 94.7 %, real-time throttling 5.0 %
        "#]]
        .assert_eq(&found);
    }

    #[test]
    fn an_overload_goes_beyond_the_cpu() {
        expect![[r#"
            D at 1e-4: CPU budget

            ✗ CPU 1: 135.0 % used, overloaded by 35.0 %
              i1                     70.0 %  █████████████████████
              i0                     60.0 %                       █████████▒▒▒▒▒▒▒▒▒
              real-time throttling    5.0 %                                         ▒
            █████▏ ✗ CPU 1: 135.0 % used, overloaded by 35.0 %: i1 70.0 %, i0 60.0 %, real-time throttling 5.0 %
        "#]].assert_eq(&drawn(&[600, 700], Drawing::Text(None)));
        let svg = drawn(&[600, 700], Drawing::Svg);
        assert!(
            svg.contains("class=\"late\"") && svg.contains("✗ CPU 1: 135.0 % used, overloaded by 35.0 %"),
            "{svg}"
        );
    }

    #[test]
    fn many_small_parts_are_one() {
        let text = drawn(&[1; 40], Drawing::Text(None));
        let is_rest = |line: &str| line.starts_with("  30 more ") && line.contains("  3.0 %  ");
        assert!(text.lines().any(is_rest), "{text}");
    }
}
