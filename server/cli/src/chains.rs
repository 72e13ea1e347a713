//! `mauve chains [PATH]`: how long data takes from sensors to actuators, or why there is no bound.

use std::fmt::Write as _;

use clap::ValueEnum;
use mauve_diagnostics::figure::{TIGHT_SLACK, chain_figure};
use mauve_diagnostics::{
    errors_of, help_of_chain, not_lasting, origins, reasons_of_chain, steps_apart, times_of,
};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Flat, Project, config_of, deployed, file_and_line, hosts_of, ros2_of};
use mauve_ide::{Drawing, draw_chains, drawn_chains};
use mauve_projects::analysis_document::milliseconds;
use mauve_projects::harmless::harmless;
use mauve_projects::json::{object, one_or_all};
use mauve_projects::output::{Output, terminal_columns};
use mauve_timing::{ChainRule, Level, Time};
use mauve_wcrt::chains::{ChainReport, ChainStepReport, Chains, chains_of};
use mauve_wcrt::{Query, basis_of, response_times};
use serde::Serialize;

use crate::check::verdict::conditions_of;
use crate::errors::{say_errors, several_of};
use crate::options::{Models, level};
use crate::text::{Sheet, assumptions, columns, counted, csv_number, number, shown};
use crate::wcrt::{bar_of, shown_tables};

#[derive(Debug, clap::Args)]
pub struct ChainsCommand {
    #[command(flatten)]
    models: Models,
    /// The significance level of the execution times; by default that of mauve.toml, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    significance: Option<Level>,
    /// Only this chain, with what each of its components adds.
    #[arg(long, value_name = "NAME")]
    chain: Option<String>,
    /// How to show the figures.
    #[arg(long, value_enum, default_value = "table")]
    format: ChainsFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ChainsFormat {
    /// For people.
    Table,
    /// One document.
    Json,
    /// A line for each chain.
    Csv,
    /// A bar for each chain, for terminals.
    Text,
    /// The same for browsers.
    Svg,
}

/// The chains of a deployment that are shown.
struct ChainList<'db> {
    db: &'db Database,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    flat: Option<&'db Flat<'db>>,
    chains: &'db Chains<'db>,
    shown: Vec<&'db ChainReport<'db>>,
}

impl ChainsCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        let mut db = Database::default();
        let (db, found, _) = self.models.deployments(&mut db, "analyse")?;
        let of = |(project, deployment)| self.shown(db, project, deployment);
        let all: Vec<ChainList<'_>> = found.iter().copied().map(of).collect();
        if let Some(name) = self.chain.as_deref().filter(|_| all.iter().all(|it| it.shown.is_empty())) {
            let names: Vec<_> = all.iter().flat_map(|it| &it.chains.all).map(|it| it.name.clone()).collect();
            let near = mauve_hir::similar(name, &names);
            let hint = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            return Err(format!("no chain `{name}`{hint}"));
        }
        let text = match self.format {
            ChainsFormat::Table => {
                shown_tables(&all.iter().map(|it| self.table(it)).collect::<Vec<_>>()).join("\n")
            }
            ChainsFormat::Json => one_or_all(all.iter().map(ChainList::document))?,
            ChainsFormat::Csv => figures_csv(&all),
            ChainsFormat::Svg => match all.as_slice() {
                [one] => self.drawing(one, Drawing::Svg),
                _ => return Err(several_of(db, Kind::Deployment, &found)),
            },
            ChainsFormat::Text => {
                let drawn = all.iter().map(|it| self.drawing(it, Drawing::Text(terminal_columns())));
                harmless(&drawn.collect::<Vec<_>>().join("\n"))
            }
        };
        let mut projects: Vec<Project<'_>> = found.into_iter().map(|(project, _)| project).collect();
        projects.dedup();
        let errors = projects.into_iter().map(|project| errors_of(db, project)).sum();
        say_errors(errors);
        let is_late = all.iter().flat_map(|it| &it.shown).any(|chain| !chain.is_within_limit());
        Ok(Output::verbatim(text, u8::from(is_late || errors > 0)))
    }

    fn shown<'db>(&self, db: &'db Database, project: Project<'db>, deployment: Decl<'db>) -> ChainList<'db> {
        let query = Query::at_level(db, project, deployment, self.significance);
        let chains = chains_of(db, project, deployment, query);
        let is_shown = |it: &&ChainReport<'db>| self.chain.as_deref().is_none_or(|name| it.name == *name);
        ChainList {
            db,
            project,
            deployment,
            query,
            flat: deployed(db, project, deployment).map(|(flat, _)| flat),
            chains,
            shown: chains.all.iter().filter(is_shown).collect(),
        }
    }

    fn drawing(&self, it: &ChainList<'_>, drawing: Drawing) -> String {
        let of = (it.project, it.deployment, it.query);
        draw_chains(&drawn_chains(it.db, of, self.chain.as_deref(), TIGHT_SLACK), drawing)
    }

    fn table(&self, it: &ChainList<'_>) -> String {
        let times = response_times(it.db, it.project, it.deployment, it.query).times.as_deref();
        let basis = basis_of(it.db, it.project, it.deployment, it.query.level);
        let origins = origins(&basis).map_or_else(String::new, |it| format!("; {it}"));
        let mut out = format!(
            "{}: latency of chains in ms at {}{}{origins}\n",
            it.deployment.name(it.db),
            it.query.level,
            times_of(times)
        );
        if it.shown.is_empty() {
            let why =
                if it.flat.is_some() { "no component has an output of its own" } else { "no architecture" };
            let _ = writeln!(out, "  no chains: {why}");
            return out;
        }
        let row = |chain: &&ChainReport<'_>| {
            let reasons = reasons_of_chain(it.db, chain);
            let why = reasons.first().map_or("", String::as_str);
            let more = match reasons.len() {
                0 | 1 => String::new(),
                several => format!(" ({})", counted(several - 1, "more reason")),
            };
            let figure = (chain.latency.filter(|_| reasons.is_empty()), chain.limit);
            let forms = chain_figure(figure, "", TIGHT_SLACK);
            let text = match figure.0 {
                Some(_) => forms.text().to_owned(),
                None => format!("? {why}{more}"),
            };
            let name = chain.name.to_string();
            vec![name, number(chain.age_at_write), text, bar_of(&forms, 0), bar_of(&forms, 1)]
        };
        out += &columns(&["chain", "age at write", "latency / limit", "", ""], it.shown.iter().map(row));
        if it.chains.left_out > 0 && self.chain.is_none() {
            out += "  too many chains: only the shortest from each source to each effect is shown\n";
        }
        for chain in it.shown.iter().filter(|_| self.chain.is_some()) {
            out.push('\n');
            if chain.latency.is_some() {
                out += &it.hops(chain);
            }
            out.extend(steps_apart(chain).map(|why| format!("  {why}\n")));
            reasons_of_chain(it.db, chain).iter().for_each(|why| out += &format!("  {why}\n"));
            let (places, remedy) = help_of_chain(it.db, it.project, it.deployment, chain);
            for (at, why) in places {
                let of_file = file_and_line(it.db, it.project.workspace(it.db), &at);
                let text = at.file(it.db).text(it.db).get(std::ops::Range::from(at.range(it.db)));
                let text = text.unwrap_or_default().lines().next().unwrap_or_default();
                let _ = writeln!(out, "    {of_file}: {why}: `{}`", harmless(text));
            }
            out.extend(remedy.map(|it| format!("  help: {it}\n")));
        }
        let broken = |it: &&&ChainReport<'_>| it.declared.is_some() && it.latency.is_none();
        if let (None, Some(chain)) = (&self.chain, it.shown.iter().find(broken)) {
            let _ = writeln!(out, "  `mauve chains --chain {}` says where, and what to do", chain.name);
        }
        if it.shown.iter().any(|chain| chain.latency.is_some()) {
            out += &format!("  no data takes longer{}\n", conditions_of(&basis));
        }
        let ros2 = ros2_of(it.db, it.project, it.deployment);
        for ([one, other], latency) in ros2.latencies.iter().filter(|(ends, _)| it.crosses(*ends)) {
            let name = |host: &usize| ros2.hosts.get(*host).map_or("", |it| it.as_str());
            let (one, other) = (name(one), name(other));
            let _ = writeln!(
                out,
                "  assumption: between {one} and {other}, a sample takes {latency} at most, until Cyclone DDS has received it"
            );
        }
        for chain in it.shown.iter().filter(|chain| chain.latency.is_some()) {
            out += &it.assumed(chain);
            out.extend(not_lasting(chain).map(|why| format!("  {}: {why}\n", chain.name)));
        }
        out
    }
}

fn status(chain: &ChainReport<'_>) -> &'static str {
    match (chain.latency, chain.limit) {
        (None, _) => "no-bound",
        (Some(_), None) => "bounded",
        (Some(_), Some(_)) if chain.is_within_limit() => "met",
        (Some(_), Some(_)) => "late",
    }
}

impl<'db> ChainList<'db> {
    /// Says in which states a chain is intended to work, and what has to answer.
    fn assumed(&self, chain: &ChainReport<'db>) -> String {
        let config = config_of(self.db, self.project.workspace(self.db));
        let Some(declared) = chain.declared.and_then(|it| config.chains.get(it)) else {
            return String::new();
        };
        let [states, answers] = [&declared.states, &declared.answers]
            .map(|of| of.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>());
        let assumed = assumptions(&states, &answers);
        if assumed.is_empty() { assumed } else { format!("  {}: {assumed}\n", chain.name) }
    }

    /// Returns whether a chain with a latency passes the network between two hosts.
    fn crosses(&self, ends: [usize; 2]) -> bool {
        let hosts = hosts_of(self.db, self.project.workspace(self.db));
        let crosses = |chain: &&ChainReport<'db>| {
            // The gateways are steps of no host.
            let on: Vec<usize> = chain.steps.iter().filter_map(|it| hosts.of(&it.instance)).collect();
            on.windows(2).any(|pair| *pair == ends || *pair == [ends[1], ends[0]])
        };
        self.shown.iter().filter(|chain| chain.latency.is_some()).any(crosses)
    }

    /// Returns where a chain begins (0) or ends (1).
    fn end(&self, chain: &ChainReport<'db>, end: usize) -> Option<String> {
        Some(chain.ends.as_ref()?.get(end)?.shown(self.db))
    }

    /// Returns the connection that leads to a step, as users write it.
    fn connection(&self, step: &ChainStepReport<'db>) -> Option<String> {
        Some(self.flat?.links.get(step.connection?)?.to_string())
    }

    /// The parts of a latency: a row for each component, and their sum.
    fn hops(&self, chain: &ChainReport<'db>) -> String {
        let report = response_times(self.db, self.project, self.deployment, self.query);
        let row = |step: &ChainStepReport<'db>| {
            let part = step.part;
            let mut notes = Vec::new();
            notes.extend(
                (step.releases > Some(1)).then(|| counted(step.releases.unwrap_or(0) as usize, "release")),
            );
            notes.extend(step.decides.then(|| "decides the write".to_owned()));
            notes.extend(part.by_data.then(|| "released by data".to_owned()));
            notes.extend(part.stays_full.then(|| "the buffer before it stays full".to_owned()));
            let response = step.activity.and_then(|it| report.activities.get(it)?.response);
            let network = step.timed.as_ref().zip(response).and_then(|(it, own)| it.write.checked_sub(own));
            let network = network.filter(|it| *it > Time::ZERO);
            notes.extend(network.map(|it| format!("the network takes {it} of it at most")));
            notes.extend(match part.rule {
                ChainRule::AfterWrite => None,
                ChainRule::HigherPriority => {
                    Some("of a higher priority: the next one waits for its release only".to_owned())
                }
                ChainRule::SameJob => Some("the same job of the thread executes the next one".to_owned()),
                ChainRule::NextJob => Some("the next job of the thread executes the next one".to_owned()),
            });
            let times = [part.wait, part.buffer, part.periods, part.run, step.total()];
            let name = self.connection(step).unwrap_or_else(|| step.instance.to_string());
            std::iter::once(name).chain(times.map(Time::number)).chain([notes.join("; ")]).collect()
        };
        let empty = std::iter::repeat_n(String::new(), 4);
        let total = std::iter::once(chain.name.to_string()).chain(empty).chain([number(chain.latency)]);
        columns(
            &["", "wait", "buffer", "periods", "run", "sum", ""],
            chain.steps.iter().map(row).chain([total.collect()]),
        )
    }

    fn document(&self) -> impl Serialize + use<> {
        let chains = self.shown.iter().map(|chain| {
            let hops = chain.steps.iter().map(|step| {
                let part = step.part;
                object! {
                    // Null for the first component.
                    connection: self.connection(step),
                    instance: step.instance.to_string(),
                    releases: step.releases,
                    wait: milliseconds(part.wait),
                    periods: milliseconds(part.periods),
                    buffer: milliseconds(part.buffer),
                    run: milliseconds(part.run),
                    [released_by_data]: part.by_data.then_some(true),
                    [stays_full]: part.stays_full.then_some(true),
                }
            });
            object! {
                name: chain.name.to_string(),
                declared: chain.declared.is_some(),
                from: self.end(chain, 0),
                to: self.end(chain, 1),
                latency: chain.latency.map(milliseconds),
                age_at_write: chain.age_at_write.map(milliseconds),
                limit: chain.limit.map(milliseconds),
                status: status(chain),
                reasons: reasons_of_chain(self.db, chain),
                // Why an effect may show older data than the one before it.
                [not_lasting]: not_lasting(chain),
                hops: hops.collect::<Vec<_>>(),
            }
        });
        object! {
            deployment: self.deployment.name(self.db).to_string(),
            root: self.project.root(self.db).path(self.db).display().to_string(),
            unit: "ms",
            significance: self.query.level.as_f64(),
            chains: chains.collect::<Vec<_>>(),
            // Longer chains between two ends that are left out, as there are too many, at least.
            [left_out]: Some(self.chains.left_out).filter(|left_out| *left_out > 0),
        }
    }
}

fn figures_csv(all: &[ChainList<'_>]) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    let rows = all.iter().flat_map(|it| it.shown.iter().map(move |chain| (it, *chain)));
    Sheet::of(&rows.collect::<Vec<_>>())
        .column("deployment", |(it, _)| it.deployment.name(it.db).to_string())
        .column("significance", |(it, _)| it.query.level.to_string())
        .column("chain", |(_, chain)| chain.name.to_string())
        .column("from", |(it, chain)| it.end(chain, 0).unwrap_or_default())
        .column("to", |(it, chain)| it.end(chain, 1).unwrap_or_default())
        .column("latency_ms", |(_, chain)| csv_number(chain.latency))
        .column("age_at_write_ms", |(_, chain)| csv_number(chain.age_at_write))
        .column("limit_ms", |(_, chain)| csv_number(chain.limit))
        .column("status", |(_, chain)| status(chain).to_owned())
        .column("reasons", |(it, chain)| reasons_of_chain(it.db, chain).join("; "))
        .column("root", |(it, _)| shown(it.project.root(it.db).path(it.db), &here))
        .csv()
}
