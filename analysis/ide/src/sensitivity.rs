//! How far the time of a codel may grow, as text.

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, ModelDb, Project, names_of};
use mauve_timing::Time;
use mauve_wcrt::{Limit, Query, TimeSensitivity, Timed, time_sensitivity};

use crate::markdown;

/// Returns a line for each deployment of the project that executes the codel: the greatest time that it may take there.
pub(crate) fn limits_of_codel(db: &dyn ModelDb, project: Project<'_>, codel: Decl<'_>) -> Vec<String> {
    let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
    let lines = deployments.filter_map(|deployment| {
        let of = Timed::Codel(codel);
        let query = Query::shown(db, project, deployment);
        let found = time_sensitivity(db, project, deployment, of, query).as_ref()?;
        Some(line(found, &markdown::code(deployment.name(db))))
    });
    lines.collect()
}

fn line(found: &TimeSensitivity<'_>, deployment: &str) -> String {
    let late = found.unproved.as_ref().map(|name| markdown::code(name));
    let now = |limit: Time| match found.time {
        Some(now) => match percentage(now, limit) {
            Some(share) => format!(" (now {now}, {share})"),
            None => format!(" (now {now})"),
        },
        None => String::new(),
    };
    match (&found.limit, late) {
        (Limit::Any, _) => format!("may take any time in {deployment}: no deadline depends on it"),
        (Limit::Last(limit), None) => format!("may take at most {limit} in {deployment}{}", now(*limit)),
        (Limit::Proved(limit), None) => {
            format!("may take {limit} in {deployment}{}; more is not proved", now(*limit))
        }
        (Limit::Last(limit) | Limit::Proved(limit), Some(late)) => {
            format!(
                "must take at most {limit} in {deployment}{}: the deadline of {late} is not met",
                now(*limit)
            )
        }
        (Limit::NotFound, Some(late)) => {
            format!("in {deployment}, the deadline of {late} is not met, whatever it takes")
        }
        (Limit::NotAnalysed(Some(instance)), _) => {
            format!(
                "how much it may take in {deployment} is unknown: {} is not analysed",
                markdown::code(instance)
            )
        }
        (Limit::NotAnalysed(None), _) => {
            format!("how much it may take in {deployment} is unknown: the deployment is not analysed")
        }
        (Limit::NotFound | Limit::Exhausted, _) => {
            format!(
                "how much it may take in {deployment} is unknown: the deployment is too large for the search"
            )
        }
    }
}

/// Returns the change from one time to another as a percentage, rounded down, such as `+23 %`; with one decimal below 10 %. None from
/// 0.
pub fn percentage(now: Time, then: Time) -> Option<String> {
    let (now, then) = (i128::from(now.as_nanos()), i128::from(then.as_nanos()));
    let tenths = ((then - now) * 1000).checked_div_euclid(now)?;
    let sign = if tenths < 0 { "-" } else { "+" };
    Some(match tenths.unsigned_abs() {
        0 => "0 %".to_owned(),
        size if size < 100 => format!("{sign}{}.{} %", size / 10, size % 10),
        _ => format!("{sign}{} %", tenths.div_euclid(10).unsigned_abs()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;

    const MODEL: &str = "
codel plan(): int
codel drive(): int
shell S { }
core Planning(S) { update = { plan(); } }
core Driving(S) { update = { drive(); } }
component Planner(S, Planning)
component Driver(S, Driving)
architecture A { instance driver: Driver  instance planner: Planner }
deployment Robot {
  architecture A
  activity driver { priority = 2 period = 50 }
  activity planner { PLANNER }
}
deployment Other { architecture A  activity driver { priority = background }  activity planner { priority = background } }
//- /mauve.toml
timing.tables = [\"times.toml\"]
//- /times.toml
[codel]
TIME
drive = 20
";

    /// The lines about limits in the hover on `plan` where `$0` is.
    fn lines(planner: &str, time: &str, at: &str) -> Vec<String> {
        let text = MODEL.replace("PLANNER", planner).replace("TIME", time);
        let text = text.replacen(at, &format!("$0{at}"), 1);
        let shown = Fixture::new(&text).hover().unwrap().markdown;
        let is_limit = |line: &&str| line.contains("`Robot`") || line.contains("`Other`");
        shown.lines().filter(is_limit).map(str::to_owned).collect()
    }

    const FINE: &str = "priority = 1 period = 100";

    #[test]
    fn a_codel_shows_how_much_it_may_take() {
        let limit = "may take at most 60 ms in `Robot` (now 50 ms, +20 %)";
        let any = "may take any time in `Other`: no deadline depends on it";
        assert_eq!(lines(FINE, "plan = 50", "plan(): int"), [limit, any]);
        assert_eq!(lines(FINE, "plan = 50", "plan = 50"), [limit, any]);
        assert_eq!(lines(FINE, "", "plan(): int")[0], "may take at most 60 ms in `Robot`");
        assert_eq!(
            lines(FINE, "plan = 80", "plan(): int")[0],
            "must take at most 60 ms in `Robot` (now 80 ms, -25 %): the deadline of `planner` is not met"
        );
        assert_eq!(
            lines("priority = 1 period = 100 deadline = 15", "plan = 10", "plan(): int")[0],
            "in `Robot`, the deadline of `planner` is not met, whatever it takes"
        );
        assert_eq!(
            lines("priority = 1", "plan = 10", "plan(): int")[0],
            "how much it may take in `Robot` is unknown: `driver` is not analysed"
        );
    }

    #[test]
    fn percentages_are_rounded_down() {
        let nanos = Time::from_nanos;
        let shown = |now, then| percentage(nanos(now), nanos(then));
        assert_eq!(shown(1000, 1239).as_deref(), Some("+23 %"));
        assert_eq!(shown(1000, 1039).as_deref(), Some("+3.9 %"));
        assert_eq!(shown(1000, 800).as_deref(), Some("-20 %"));
        assert_eq!(shown(1000, 799).as_deref(), Some("-21 %"));
        assert_eq!(shown(10_000, 9999).as_deref(), Some("-0.1 %"));
        assert_eq!(shown(1_000_000, 1_000_001).as_deref(), Some("0 %"));
        assert_eq!(shown(0, 5), None);
    }
}
