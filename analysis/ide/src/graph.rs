//! The graph of an architecture: its instances and their connections; for a deployment, with utilisations and response times.

use std::collections::BTreeMap;

use mauve_diagnostics::{model_reason, times_of};
use mauve_hir::item_tree::{FeatureKind, Kind, Name};
use mauve_hir::{
    Decl, File, FlatInstance, Location, ModelDb, Project, architecture, declaration_at, declarations,
    deployed, file_and_line, flat_of, hosts_of, is_model, names_of, target_of,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::Status;
use mauve_wcrt::chains::chains_of;
use mauve_wcrt::{ActivityReport, Query, Report, response_times};

use crate::drawing::drawn_name;
use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::{Forms, HintStatus};

/// A graph of instances and connections.
#[derive(Debug, Clone)]
pub struct Graph<'db> {
    /// Its title.
    pub title: String,
    /// The instances, those of imported architectures first.
    pub nodes: Vec<GraphNode<'db>>,
    /// The connections between these instances.
    pub edges: Vec<GraphEdge<'db>>,
    /// The response times, for a deployment.
    pub report: Option<&'db Report<'db>>,
    /// The reasons why something may be missing.
    pub missing: Vec<String>,
}

/// An instance in a graph.
#[derive(Debug, Clone)]
pub struct GraphNode<'db> {
    /// Its name.
    pub instance: Name,
    /// Its component: the declared name, or as written if it is unknown.
    pub component: Name,
    /// Its ports and operations, as far as they are known.
    pub ports: Vec<GraphPort>,
    /// Its declaration.
    pub at: Location<'db>,
    /// The file and the line of its declaration.
    pub place: String,
    /// Its activity, for a deployment.
    pub activity: Option<&'db ActivityReport<'db>>,
    /// The [`figure`] of its activity, `✓ 53 / 100 ms`; empty without an activity.
    pub figure: String,
    /// The figure where there is less room: `✓ 53`, `✗ overloaded`.
    pub short: String,
    /// What the figure says; none without an activity.
    pub status: Option<HintStatus>,
    /// The utilisation of its activity, if known; 1 is a full CPU.
    pub load: Option<f64>,
    /// The host that it runs on, of several.
    pub host: Option<Name>,
    /// Whether it is in the chain that is lit.
    pub is_lit: bool,
}

/// A port or an operation of an instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GraphPort {
    /// Its name.
    pub name: Name,
    /// Its kind: no constant or property.
    pub kind: FeatureKind,
}

/// A connection in a graph.
#[derive(Debug, Clone)]
pub struct GraphEdge<'db> {
    /// The number of the source instance, and its port or operation.
    pub source: (usize, Name),
    /// The number of the target instance, and its port or operation.
    pub target: (usize, Name),
    /// Whether it connects operations instead of ports.
    pub operation: bool,
    /// Its declaration.
    pub at: Location<'db>,
    /// The file and the line of its declaration.
    pub place: String,
    /// Whether it is in the chain that is lit.
    pub is_lit: bool,
}

impl<'db> Graph<'db> {
    /// Lights a chain of the deployment. Returns whether there is one of this name.
    pub fn light(
        &mut self,
        db: &'db dyn ModelDb,
        (project, of, query): (Project<'db>, Decl<'db>, Query),
        name: &str,
    ) -> bool {
        let deployed = deployed(db, project, of).filter(|_| self.report.is_some());
        let chain = |_| chains_of(db, project, of, query).all.iter().find(|chain| chain.name == name);
        let Some(((flat, _), chain)) = deployed.and_then(|it| Some((it, chain(it)?))) else { return false };
        let links = || chain.steps.iter().filter_map(|step| flat.links.get(step.connection?));
        for node in &mut self.nodes {
            node.is_lit = chain.steps.iter().any(|step| step.instance == node.instance);
        }
        for edge in &mut self.edges {
            edge.is_lit = links().any(|link| link.at == edge.at);
        }
        true
    }
}

/// Selects deployments or architectures of a project.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GraphsOf<'a> {
    /// By name, `library.Name` or `Name`.
    Name(&'a str),
    /// The one at this offset of the file.
    At(TextSize),
    /// The deployments of the file, otherwise its architectures. For a file without any, such as a timing table, those of the
    /// project.
    File,
}

/// Returns the selected deployments or architectures, at least one.
///
/// # Errors
///
/// The reason why there is none, for the user.
pub fn selected_graphs<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    selection: GraphsOf<'_>,
) -> Result<Vec<Decl<'db>>, String> {
    let kinds = [Kind::Deployment, Kind::Architecture];
    let is_graph = |decl: &Decl<'db>| kinds.contains(&decl.kind(db));
    let of_project = |is_it: &dyn Fn(&Decl<'db>) -> bool| -> Vec<Decl<'db>> {
        names_of(db, project).all.iter().copied().filter(is_it).collect()
    };
    // Offsets in a table or in `mauve.toml` are not offsets in a model.
    let own = if is_model(file.path(db)) { declarations(db, file).all.as_slice() } else { &[] };
    let found = match selection {
        GraphsOf::Name(name) => {
            let found = of_project(&|of| is_graph(of) && of.is_called(db, name));
            if found.is_empty() {
                return Err(format!("no deployment or architecture `{name}` in the project of this file"));
            }
            found
        }
        GraphsOf::At(offset) if is_model(file.path(db)) => {
            let at = declaration_at(db, file, TextRange::empty(offset)).filter(is_graph);
            of_project(&|of| Some(*of) == at)
        }
        GraphsOf::At(_) | GraphsOf::File => {
            let has = |kind| own.iter().any(|of| of.kind(db) == kind);
            match kinds.into_iter().find(|&kind| has(kind)) {
                Some(kind) => of_project(&|of| of.kind(db) == kind && of.file(db) == file),
                None => {
                    let all = kinds.into_iter().map(|kind| of_project(&|of| of.kind(db) == kind));
                    all.into_iter().find(|all| !all.is_empty()).unwrap_or_default()
                }
            }
        }
    };
    if found.is_empty() { Err("no deployment or architecture here".to_owned()) } else { Ok(found) }
}

/// Returns the graph of an architecture, or of a deployment with its response times. `None` for other declarations, and for a
/// deployment whose architecture is unknown. `tight_slack` is that of [`figure`].
pub fn graph<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
    tight_slack: u32,
) -> Option<Graph<'db>> {
    let (target, report) = match of.kind(db) {
        Kind::Architecture => (of, None),
        Kind::Deployment => (target_of(db, project, of)?, Some(response_times(db, project, of, query))),
        _ => return None,
    };
    let reported =
        report.into_iter().flat_map(|it| it.activities.iter().zip(it.footings()).zip(it.utilisations()));
    let mut figures: BTreeMap<&Name, DrawnActivity<'db>> = BTreeMap::new();
    for ((activity, footing), load) in reported {
        let forms = figure(db, activity, footing, tight_slack);
        let load = load.filter(|_| activity.verdict != Status::Background);
        // Of several activities of one instance, the first one is shown.
        figures.entry(&activity.instance).or_insert(DrawnActivity { activity, forms, load });
    }
    let flat = flat_of(db, project, target);
    let mut number: BTreeMap<&Name, usize> = BTreeMap::new();
    let nodes = flat.instances.iter().enumerate().filter_map(|(index, instance)| {
        db.unwind_if_revision_cancelled();
        number.entry(&instance.name).or_insert(index);
        node(db, (project, of), instance, figures.get(&instance.name))
    });
    let nodes: Vec<GraphNode<'db>> = nodes.collect();
    let edges = flat.links.iter().filter_map(|link| {
        db.unwind_if_revision_cancelled();
        let end = |(instance, feature): &(Name, Name)| Some((*number.get(instance)?, feature.clone()));
        let (source, target) = (end(&link.source)?, end(&link.target)?);
        let place = file_and_line(db, project.workspace(db), &link.at);
        Some(GraphEdge {
            source,
            target,
            operation: link.operation,
            at: link.at.clone(),
            place,
            is_lit: false,
        })
    });
    let mut missing: Vec<String> =
        flat.refusals.iter().map(|refusal| model_reason(db, &refusal.reason)).collect();
    if flat.link_completeness.is_incomplete() {
        missing.push("a connection has an error".to_owned());
    }
    let title = match report {
        None => drawn_name(of.name(db)),
        Some(report) => format!(
            "{} at {}{}: response times and deadlines in ms, CPU utilisation",
            drawn_name(of.name(db)),
            query.level,
            times_of(report.times.as_deref())
        ),
    };
    Some(Graph { title, nodes, edges: edges.collect(), report, missing })
}

/// An activity, with its figures.
struct DrawnActivity<'db> {
    activity: &'db ActivityReport<'db>,
    forms: Forms,
    load: Option<f64>,
}

fn node<'db>(
    db: &'db dyn ModelDb,
    (project, of): (Project<'db>, Decl<'db>),
    instance: &FlatInstance<'db>,
    drawn: Option<&DrawnActivity<'db>>,
) -> Option<GraphNode<'db>> {
    let (declared, index) = instance.declared;
    let data = architecture(db, declared)?.instances.get(index)?;
    let written = data.component.as_ref().and_then(|component| component.path.last());
    let component = instance.component.map(|component| component.name(db).clone());
    let hosts = hosts_of(db, project.workspace(db));
    let host = hosts.of(&instance.name).filter(|_| of.kind(db) == Kind::Deployment);
    let forms = drawn.map(|it| &it.forms);
    let at = Location::Source(declared, data.name.id);
    let features = instance.features(db, project).into_iter().flat_map(|features| features.by_name.values());
    let features = features.filter_map(|all| Some((all.first()?.kind, all.first()?.data(db)?)));
    let ports = features
        .filter(|(kind, _)| kind.is_port() || kind.is_operation())
        .map(|(kind, data)| GraphPort { name: data.name.name.clone(), kind });
    Some(GraphNode {
        instance: instance.name.clone(),
        component: component.or_else(|| written.cloned()).unwrap_or_default(),
        place: file_and_line(db, project.workspace(db), &at),
        ports: ports.collect(),
        at,
        activity: drawn.map(|it| it.activity),
        figure: forms.map_or_else(String::new, |it| it.text().to_owned()),
        short: forms.map_or_else(String::new, |it| it.with_response().to_owned()),
        status: forms.map(|it| it.status),
        load: drawn.and_then(|it| it.load),
        host: host.and_then(|it| hosts.all.get(it)).map(|it| it.name.clone()),
        is_lit: false,
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use mauve_hir::projects;

    /// Also for drawings.
    pub(crate) const MODEL: &str = "
codel see(): int  codel plan(): int
shell L { output port scan: int  require stop(): int }
shell P { input port scan: int  input port back: int  output port go: int  provide stop(): int }
core CL(L) { update = { see(); } }  core CP(P) { provide stop(): int = { return 1; } update = { plan(); } }
component Laser(L, CL)  component Pilot(P, CP)
architecture Base { instance laser: Laser }
architecture A {
  import Base
  instance pilot: Pilot  instance spare: Unknown
  connection laser.scan -> pilot.scan
  connection pilot.go -> pilot.back
}
architecture WithCall { import A operation laser.stop -> pilot.stop }
deployment D {
  architecture A
  activity laser { priority = 2 period = 100 }
  activity pilot { priority = 1 period = 100 deadline = 40 }
  activity spare { priority = background }
}
//- /mauve.toml
timing.tables = [\"t.toml\"]
//- /t.toml
codel.see = 20
codel.plan = 30
";

    #[test]
    fn each_project_has_its_own() {
        let Fixture { db, workspace, .. } = Fixture::new(
            "//- /a.mal\ninclude \"lib.mal\" architecture A { } deployment D { architecture A }\n\
             //- /b.mal\ninclude \"lib.mal\" architecture B { import Shared }\n\
             //- /lib.mal\nlibrary l { architecture Shared { } }\n\
             //- /mauve.toml\ntiming.tables = ['t.toml']\n//- /t.toml\ncodel.deployment = 1\n//- /other.toml\n",
        );
        let [a, b] = projects(&db, workspace)[..] else { panic!("two roots") };
        let selection = |project, path: &str, of: GraphsOf<'_>| {
            let file = workspace.file(&db, path.as_ref()).unwrap();
            selected_graphs(&db, project, file, of)
                .map(|found| found.into_iter().map(|of| of.qualified(&db)).collect::<Vec<_>>().join(", "))
        };
        let ok = |text: &str| Ok(text.to_owned());
        for project in [a, b] {
            for of in [GraphsOf::File, GraphsOf::At(20.into()), GraphsOf::Name("Shared")] {
                assert_eq!(selection(project, "/lib.mal", of), ok("l.Shared"));
            }
            let why = selection(project, "/lib.mal", GraphsOf::At(2.into()));
            assert_eq!(why, Err("no deployment or architecture here".to_owned()));
        }
        assert_eq!(selection(b, "/lib.mal", GraphsOf::Name("B")), ok("B"));
        assert_eq!(selection(a, "/a.mal", GraphsOf::File), ok("D"));
        assert_eq!(selection(a, "/a.mal", GraphsOf::At(30.into())), ok("A"));
        for of in [GraphsOf::File, GraphsOf::At(8.into())] {
            assert_eq!(selection(a, "/t.toml", of), ok("D"));
            assert_eq!(selection(b, "/t.toml", of), ok("B, l.Shared"));
        }
        // The other project has it.
        let none = "no deployment or architecture `B` in the project of this file";
        assert_eq!(selection(a, "/lib.mal", GraphsOf::Name("B")), Err(none.to_owned()));
    }

    /// A wait needs no CPU, and each job of a burst does: as in the budget of the CPU.
    #[test]
    fn utilisations_are_those_of_the_cpus() {
        let text = MODEL.replace(
            "activity pilot { priority = 1 period = 100",
            "activity pilot { priority = 1 trigger = scan rate = 10 Hz burst = 2",
        );
        // No more often than the laser writes.
        let text = text.replace("{ see(); }", "{ write(scan, see()); write(scan, 1); }") + "wait.see = 15\n";
        let Fixture { db, workspace, file, .. } = Fixture::new(&text);
        let project = project_of(&db, workspace, file);
        let of = names_of(&db, project).of_kind(&db, Kind::Deployment).next().unwrap();
        let found = graph(&db, project, of, Query::shown(&db, project, of), 10).unwrap();
        let report = found.report.unwrap();
        let budgets = report.budgets();
        let parts: Vec<_> = budgets.iter().flat_map(|it| &it.parts).collect();
        for (name, load) in [("laser", 0.2), ("pilot", 0.6)] {
            let node = found.nodes.iter().find(|it| it.instance == *name).unwrap();
            assert!(node.load.is_some_and(|it| (it - load).abs() < 1e-9), "{name}: {:?}", node.load);
            assert!(parts.iter().filter(|it| it.name == *name).all(|it| Some(it.share) == node.load));
        }
    }

    #[test]
    fn the_graph_at_the_cursor() {
        let text = format!(
            "include \"more.mal\"{MODEL}//- /more.mal\nlibrary l {{ architecture M {{ }} }}deployment N {{ }}\n"
        );
        let Fixture { db, workspace, file, .. } = Fixture::new(&text);
        let more = workspace.file(&db, "/more.mal".as_ref()).unwrap();
        let ask = |file: File, of: GraphsOf<'_>| match selected_graphs(
            &db,
            project_of(&db, workspace, file),
            file,
            of,
        ) {
            Ok(all) => all.iter().map(|of| of.name(&db).as_str()).collect::<Vec<_>>().join(", "),
            Err(why) => why,
        };
        let at = |text: &str| GraphsOf::At((file.text(&db).find(text).unwrap() as u32).into());
        assert_eq!(ask(file, GraphsOf::File), "D");
        assert_eq!([ask(file, at("spare: U")), ask(file, at("pilot { pr"))], ["A", "D"]);
        assert_eq!(ask(file, at("core CL")), "no deployment or architecture here");
        // At the end of one; and where another begins.
        let ends = [GraphsOf::At(30.into()), GraphsOf::At(32.into()), GraphsOf::At(48.into())];
        assert_eq!(ends.map(|of| ask(more, of)), ["M", "N", "N"]);
        assert_eq!(["M", "l.M", "N"].map(|name| ask(file, GraphsOf::Name(name))), ["M", "M", "N"]);
        assert_eq!(
            ask(file, GraphsOf::Name("K")),
            "no deployment or architecture `K` in the project of this file"
        );
    }
}
