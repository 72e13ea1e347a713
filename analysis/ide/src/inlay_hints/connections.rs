//! Hints of the connections in an architecture: how long data takes there, at most, in all deployments, or why that is not known.

use mauve_diagnostics::connection_reason;
use mauve_hir::{Decl, ModelDb, Project};

use super::label::Texts;
use super::{HintOf, HintSubject, ShownHint, end_of_line};
use crate::connections::{LinkReport, connections_in};
use crate::occurrences::grouped;
use mauve_diagnostics::figure::{Forms, HintStatus, TIGHT_SLACK, chain_figure, short};

pub(super) fn of_connections<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    architecture: Decl<'db>,
    found: &mut Vec<HintOf>,
) {
    let text = architecture.file(db).text(db);
    let connected = connections_in(db, project, architecture).into_iter();
    for (at, all) in grouped(connected.map(|it| (&it.link.at, it))) {
        let (Some(Forms { texts, status, .. }), Some(first)) = (shown(db, &all), all.first()) else {
            continue;
        };
        let range = at.range(db);
        let missing = (status == HintStatus::Time).then_some(0);
        let target = format!("{}.{}", first.link.target.0, first.link.target.1);
        let (subject, offset) = (HintSubject::Connection(target.into()), end_of_line(text, range.end()));
        let shown = ShownHint { texts: Texts::of(texts), status, missing };
        found.push(shown.at(text, offset, subject, range.start()));
    }
}

/// Returns what is shown of a connection, in fewer and fewer words: what is wrong in some deployment, or the greatest latency.
fn shown<'db>(db: &'db dyn ModelDb, all: &[LinkReport<'db>]) -> Option<Forms> {
    let of = |texts: Vec<String>, status| Some(Forms { texts, bar: None, status });
    if let Some(by) = all.iter().find_map(|it| it.report.overwritten.as_ref()) {
        let short = "may be overwritten";
        return of(vec![format!("{short} in {}", by.state), short.to_owned()], HintStatus::Unknown);
    }
    if let Some(age) = all.iter().filter_map(|it| it.report.stays_full).max() {
        let texts = [format!("stays full, ≥ {} old", short(age)), "stays full".to_owned()];
        return of(texts.to_vec(), HintStatus::Tight);
    }
    if let Some(it) = all.iter().find(|it| it.report.latency.is_none()) {
        let reason = it.report.reason.as_ref()?;
        let (_, words) = connection_reason(db, it.link, reason);
        return Some(chain_figure((None, None), &words, TIGHT_SLACK));
    }
    let latency = all.iter().filter_map(|it| it.report.latency).max()?;
    Some(chain_figure((Some(latency), None), "", TIGHT_SLACK))
}

#[cfg(test)]
mod tests {
    use mauve_syntax::{TextRange, TextSize};

    use crate::fixture::{Fixture, project_of};
    use crate::inlay_hints::{EarlierFigures, HintOptions, inlay_hints};

    const MODEL: &str = "
codel look(out n: int): bool
codel use(in n: int): void
shell Eye { output port seen: int }
shell Leg { input port goal: int }
core EyeCore(Eye) { var n: int = 0  update = { if (look(n)) then { write(seen, n); } else { OTHERWISE } } }
core LegCore(Leg) { var n: int = 0  update = { read(goal, n); use(n); } }
component Camera(Eye, EyeCore)
component Base(Leg, LegCore)
architecture Robot { instance camera: Camera  instance base: Base
  connection camera.seen -> BUFFERbase.goal
}
deployment Bench {
  architecture Robot
  activity camera { affinity = 1  priority = 2  period = 16 }
  activity base { affinity = 1  priority = 1  period = 32 }
}
//- /mauve.toml
assume.codel = \"1 ms\"
";

    /// Returns the hints at the connection, each with its status.
    fn hints(otherwise: &str, buffer: &str) -> Vec<String> {
        let text = MODEL.replace("OTHERWISE", otherwise).replace("BUFFER", buffer);
        let Fixture { db, workspace, file, .. } = Fixture::new(&text);
        let all = TextRange::up_to(TextSize::of(&**file.text(&db)));
        let project = project_of(&db, workspace, file);
        let options = HintOptions { program_times: false, ..HintOptions::default() };
        let found = inlay_hints(&db, project, file, all, options, &EarlierFigures::default());
        let at = file.text(&db).find("  connection").unwrap();
        let line = at..at + file.text(&db)[at..].find('\n').unwrap() + 1;
        let here = found.iter().filter(|it| line.contains(&usize::from(it.offset)));
        here.map(|it| format!("{} ({})", it.label, it.status.name())).collect()
    }

    #[test]
    fn a_connection_has_its_latency_or_what_is_wrong() {
        // 32 ms until the next release of the base, and 2 ms until it has used the data: it starts after the camera.
        assert_eq!(hints("write(seen, n);", ""), ["≤ 34 ms (time)"]);
        assert_eq!(hints("write(seen, n);", "[100] "), ["stays full, ≥ 1584 ms old (tight)"]);
        assert_eq!(hints("write(seen, 0);", ""), ["may be overwritten in update (unknown)"]);
    }

    #[test]
    fn of_several_deployments_the_greatest_latency_is_shown() {
        let other =
            MODEL.replace("deployment Bench", "deployment Slow").replace("period = 32", "period = 64");
        let other = &other[other.find("deployment").unwrap()..other.find("//-").unwrap()];
        let text = MODEL
            .replace("//-", &format!("{other}//-"))
            .replace("OTHERWISE", "write(seen, n);")
            .replace("BUFFER", "");
        let Fixture { db, workspace, file, .. } = Fixture::new(&text);
        let all = TextRange::up_to(TextSize::of(&**file.text(&db)));
        let project = project_of(&db, workspace, file);
        let found = inlay_hints(&db, project, file, all, HintOptions::default(), &EarlierFigures::default());
        assert!(found.iter().any(|it| it.label == "≤ 66 ms"), "{found:#?}");
    }
}
