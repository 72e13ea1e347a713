//! The gateway to ROS 2: an activity of each host with topics, which moves samples between the ports and the topics. It has no
//! component: its period, priority and CPUs are those of `[ros2] gateway`, and its execution time is the sum of those of its topics.
//!
//! ```text
//! dispatch and context switches + Σ depth × [access] "ros2.INSTANCE.PORT"
//! ```

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Edges, Location, ModelDb, PeriodEdge, Project, config_file, ros2_of};
use mauve_timing::{Level, StateMachine};

use crate::psm::Psm;
use crate::reason::{Reason, Refusal, Timed, TooLong};
use crate::table_set::TableSet;
use crate::timetable::{Lookup, timetable_of};

/// Which gateway an activity is: that of a deployment on a host, by its index in [`mauve_hir::Ros2::hosts`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct Gateway<'db> {
    /// The deployment.
    pub deployment: Decl<'db>,
    /// The host; 0 without any.
    pub host: usize,
}

/// Returns what a gateway moves in a period: the key of each topic of its host behind `ros2.`, and the number of its samples.
pub(crate) fn moved<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Gateway<'db>,
) -> impl Iterator<Item = (Name, u64)> {
    let topics = ros2_of(db, project, of.deployment).topics.iter();
    let topics = topics.filter(move |it| it.host == of.host);
    topics.map(|it| (format!("{}.{}", it.port.0, it.port.1).into(), u64::from(it.depth.max(1))))
}

/// Returns the state machine of a gateway, one state with one edge, or why its time is not known.
#[salsa::tracked(returns(ref))]
pub(crate) fn gateway_psm<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    deployment: Decl<'db>,
    host: usize,
    level: Level,
) -> Result<Psm<'db>, Vec<Refusal<'db>>> {
    let times = timetable_of(db, tables);
    let workspace = tables.project(db).workspace(db);
    let at = config_file(db, workspace).map(|file| Location::Range(file, 0, 0));
    let refuse = |reason| Err(vec![Refusal { reason, at: at.clone() }]);
    let Some(overhead) = times.overhead(level) else {
        return match times.without_level(level) {
            Some(table) => refuse(Reason::NoOverhead { level, table: table.clone() }),
            None => refuse(Reason::TooLong(TooLong::Overhead)),
        };
    };
    let (mut cost, mut assumed) = (overhead, Vec::new());
    for (topic, samples) in moved(db, tables.project(db), Gateway { deployment, host }) {
        let of = Timed::Topic(topic);
        let time = match (times.time(&of, level), times.assume) {
            (Lookup::Known(time) | Lookup::Assumed(time), _) => time,
            (Lookup::Absent, Some(time)) => {
                assumed.push((of.key(db), time));
                time
            }
            (Lookup::Absent, None) => return refuse(Reason::NoTopicTime(of.key(db))),
            (Lookup::Unusable(why), _) => return refuse(Reason::Table(why)),
        };
        let sum = time.checked_mul(samples).and_then(|time| cost.checked_add(time));
        let Some(sum) = sum else { return refuse(Reason::TooLong(TooLong::Program)) };
        cost = sum;
    }
    let edge = PeriodEdge { source: 0, target: 0, transition: None, first: 0, then: Vec::new() };
    let edges = Edges { all: vec![edge], first: vec![Vec::new()] };
    let psm = Psm::of_machine(vec!["Moving".into()], StateMachine::single(cost), edges);
    Ok(Psm { overhead, assumed, ..psm })
}

#[cfg(test)]
mod tests {
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Decl, Project, Workspace, names_of, projects};
    use mauve_pwcet::trace::access_key;
    use mauve_timing::{Method, Time};

    use crate::{Query, observed, response_times};

    /// As the middleware is.
    const RECV: &str = "priority = 19\ncpus = [1]";

    const QUERY: Query = Query { level: mauve_timing::Level::TEN_TO_MINUS_FOUR, method: Method::Best };

    /// Calls `of` with the deployment `D` of these files.
    fn with<R>(files: &[(&str, String)], of: impl FnOnce(&Database, Project<'_>, Decl<'_>) -> R) -> R {
        let db = Database::default();
        let files = files.iter().map(|(path, text)| ((*path).into(), text.clone()));
        let workspace = Workspace::of_texts(&db, "/".into(), files);
        let project = projects(&db, workspace)[0];
        of(&db, project, names_of(&db, project).anywhere(Kind::Deployment, "D")[0])
    }

    /// A deployment with a gateway, or with an activity by hand in its place.
    fn one_host(gateway: bool, table: &str, recv: &str) -> [(&'static str, String); 3] {
        let (instance, activity, topics) = match gateway {
            true => ("", "", "topics = { \"a.o\" = { name = \"/o\", depth = 3 } }"),
            false => (
                "instance ros2: Cb",
                "activity ros2 { priority = 20 period = 10 affinity = 1 }",
                "namespace = \"/x\"",
            ),
        };
        let model = format!(
            "codel a(): int\ncodel b(): int\nshell S {{ output o: double }}\nshell N {{ }}
            core Ka(S) {{ update = {{ a(); }} }}\ncore Kb(N) {{ update = {{ b(); }} }}
            component Ca(S, Ka)\ncomponent Cb(N, Kb)\narchitecture A {{ instance a: Ca {instance} }}
            deployment D {{ architecture A activity a {{ priority = 1 period = 40 affinity = 1 }} {activity} }}"
        );
        let config = format!(
            "timing.tables = [\"t.toml\"]\n[[platform.other]]\nname = \"recv\"\nperiod = \"1 s\"\ntime = \"1 us\"\n{recv}\n[ros2]\ngateway = {{ priority = 20, period = \"10 ms\", cpus = [1] }}\n{topics}\n"
        );
        [("/m.mal", model), ("/mauve.toml", config), ("/t.toml", table.to_owned())]
    }

    /// The names and response times of its activities.
    fn responses(gateway: bool, table: &str, recv: &str) -> Vec<(String, Option<u64>)> {
        with(&one_host(gateway, table, recv), |db, project, of| {
            let all = response_times(db, project, of, QUERY).activities.iter();
            all.map(|it| (it.instance.to_string(), it.response.map(Time::as_nanos))).collect()
        })
    }

    #[test]
    fn a_recording_is_compared_with_the_times_of_topics() {
        let files = one_host(true, "codel.a = 7\naccess = { \"ros2.a.o\" = 1 }\n", RECV);
        let times = with(&files, |db, project, of| {
            let report = response_times(db, project, of, QUERY);
            observed::expected(db, project, of, None, QUERY, report).times
        });
        assert_eq!(times.get(&access_key("ros2.a.o")), Some(&Some(1_000_000)));
    }

    #[test]
    fn a_gateway_delays_like_an_activity_with_the_same_time() {
        let table = "codel.a = 7\n[overhead]\ndispatch = 1\n[access]\n\"ros2.a.o\" = 1\n";
        let found = responses(true, table, RECV);
        assert_eq!(found, responses(false, "codel.a = 7\ncodel.b = 3\n[overhead]\ndispatch = 1\n", RECV));
        assert_eq!(found, [("a".into(), Some(16_001_000)), ("ros2".into(), Some(4_000_000))]);
        // Without its time, it is not analysed, and delays an unknown time.
        assert_eq!(responses(true, "codel.a = 7\n", RECV), [("a".into(), None), ("ros2".into(), None)]);
    }

    /// The threads of the middleware have the CPUs of the gateway and a priority one less.
    #[test]
    fn what_is_below_the_middleware_needs_its_time() {
        let table = "codel.a = 7\n[access]\n\"ros2.a.o\" = 1\n";
        let of_a = |recv: &str| responses(true, table, recv)[0].1;
        for recv in [RECV, "priority = 99", "priority = 19\ncpus = [1, 2]"] {
            assert!(of_a(recv).is_some(), "{recv}");
        }
        for recv in ["priority = 19\ncpus = [2]", "priority = 18\ncpus = [1]"] {
            assert_eq!(of_a(recv), None, "{recv}");
        }
    }

    type Responses = Vec<(String, Option<u64>)>;

    /// The names and response times, and the chains, of the deployment of these files.
    fn figures(model: String, config: String, tables: &[(&str, String)]) -> (Responses, Vec<Option<u64>>) {
        let files = [&[("/m.mal", model), ("/mauve.toml", config)], tables].concat();
        let nanos = |time: Option<Time>| time.map(Time::as_nanos);
        with(&files, |db, project, of| {
            let responses = response_times(db, project, of, QUERY).activities.iter();
            let chains = crate::chains::chains_of(db, project, of, QUERY).all.iter();
            (
                responses.map(|it| (it.instance.to_string(), nanos(it.response))).collect(),
                chains.map(|it| nanos(it.latency)).collect(),
            )
        })
    }

    /// Random hosts together have the figures that each has alone, with its CPUs, its tables and its part of other work.
    #[test]
    fn hosts_are_analysed_as_each_alone() {
        let mut random = mauve_timing::Random::new(7);
        let mut below = move |most: u64| random.up_to(most - 1);
        let mut compared = 0;
        for _ in 0..60 {
            let hosts = 2 + below(2);
            let codels: String = (0..6).map(|it| format!("codel c{it}(): int\n")).collect();
            let cores: String = (0..6)
                .map(|it| format!("core K{it}(S) {{ update = {{ c{it}(); }} }}\ncomponent C{it}(S, K{it})\n"))
                .collect();
            let shared = below(2) == 0;
            let other = "[[platform.other]]\nname = \"lan\"\npriority = 90\nperiod = \"2 ms\"\ntime = \"100 us\"\ncpus = [1]\n";
            let throttling = format!("platform.rt_throttling = {}\n", below(2) == 0);
            let (mut together, mut sections, mut expected) = (String::new(), String::new(), Vec::new());
            let mut instances = String::new();
            let mut tables =
                vec![("/t.toml", (0..6).map(|it| format!("codel.c{it} = {}\n", it + 1)).collect::<String>())];
            for host in 0..hosts {
                let (mut alone, mut names, mut own) = (String::new(), Vec::new(), String::new());
                let table = ["/h0.toml", "/h1.toml", "/h2.toml"][host as usize];
                let has_table = host > 0 && !shared;
                let text = (0..6).map(|it| format!("codel.c{it} = {}\n", 1 + below(4))).collect::<String>();
                let cpus = 1 + below(2);
                for index in 0..1 + below(4) {
                    let name = format!("i{host}_{index}");
                    let cpu = match below(4) {
                        0 => String::new(),
                        _ => format!("cpus = [{}]", 1 + below(cpus)),
                    };
                    let line = format!(
                        "activity {name} {{ priority = {} period = {} {cpu} }}\n",
                        1 + below(20),
                        10 + 5 * below(8)
                    );
                    let instance = format!("instance {name}: C{}\n", below(6));
                    (alone, together) = (alone + &line, together + &line);
                    (own, instances) = (own + &instance, instances + &instance);
                    names.push(format!("\"{name}\""));
                }
                let used = if has_table { table } else { "/t.toml" };
                sections += &format!("[host.h{host}]\nactivities = [{}]\ncpus = {cpus}\n", names.join(", "));
                if has_table {
                    sections += &format!("tables = [\"{}\"]\n", &table[1..]);
                    tables.push((table, text));
                }
                let model = format!(
                    "shell S {{ }}\n{codels}{cores}architecture A {{ {own} }}\ndeployment D {{ architecture A\n{alone} }}"
                );
                let config = format!(
                    "timing.tables = [\"{}\"]\n{throttling}platform.cpus = {cpus}\n{other}",
                    &used[1..]
                );
                expected.extend(figures(model, config, &tables).0);
            }
            let model = format!(
                "shell S {{ }}\n{codels}{cores}architecture A {{ {instances} }}\ndeployment D {{ architecture A\n{together} }}"
            );
            let config = format!("timing.tables = [\"t.toml\"]\n{throttling}{other}{sections}");
            let (found, _) = figures(model.clone(), config.clone(), &tables);
            assert_eq!(found, expected, "{config}\n{model}");
            compared += found.iter().filter(|(_, it)| it.is_some()).count();
        }
        assert!(compared > 150, "{compared}");
    }

    /// A chain across hosts takes as long as one through components that move data like the gateways, and the network.
    #[test]
    fn a_chain_across_hosts_passes_both_gateways_and_the_network() {
        let both = "codel see(): double\ncodel act(x: double): void\n
            shell E { output port out: double }\nshell H { input port into: double }
            core Ke(E) { update = { write(out, see()); } }\ncore Kh(H) { var x: double; update = { read(into, x); act(x); } }
            component Ce(E, Ke)\ncomponent Ch(H, Kh)\n";
        let activities = "activity eye { priority = 5 period = 20 affinity = 1 } activity hand { priority = 5 period = 30 affinity = 1 }";
        let across = format!(
            "{both}architecture A {{ instance eye: Ce instance hand: Ch connection eye.out -> hand.into }}
            deployment D {{ architecture A {activities} }}"
        );
        let recv = "[[platform.other]]\nname = \"recv\"\npriority = 39\nperiod = \"1 s\"\ntime = \"1 ns\"\ncpus = [1]\n";
        let config = format!("timing.tables = [\"t.toml\"]\n{recv}[ros2]\ndiscovery = \"subnet\"\ngateway = {{ priority = 40, period = \"7 ms\", cpus = [1] }}
            [host.a]\nactivities = [\"eye\"]\ncpus = 1\n[host.b]\nactivities = [\"hand\"]\ncpus = 1\n[link.a-b]\nlatency = \"3 ms\"\n");
        let times = "codel.see = 2\ncodel.act = 4\n";
        let table = format!("{times}[access]\n\"ros2.eye.out\" = 1\n\"ros2.hand.into\" = 1\n");
        let (_, across_hosts) = figures(across.clone(), config.clone(), &[("/t.toml", table.clone())]);
        let by_hand = format!("{both}codel move(x: double): double\nshell G {{ input port into: double output port out: double }}
            core Kg(G) {{ var x: double; update = {{ read(into, x); write(out, move(x)); }} }}\ncomponent Cg(G, Kg)
            architecture A {{ instance eye: Ce instance hand: Ch instance one: Cg instance two: Cg
                connection eye.out -> one.into connection one.out -> two.into connection two.out -> hand.into }}
            deployment D {{ architecture A activity eye {{ priority = 5 period = 20 affinity = 1 }} activity hand {{ priority = 5 period = 30 affinity = 2 }}
                activity one {{ priority = 40 period = 7 affinity = 1 }} activity two {{ priority = 40 period = 7 affinity = 2 }} }}");
        let on_both = format!(
            "timing.tables = [\"t.toml\"]\n{recv}{}",
            recv.replace("[1]", "[2]").replace("recv", "other")
        );
        let (_, components) = figures(by_hand, on_both, &[("/t.toml", format!("{times}codel.move = 1\n"))]);
        let network = 3_000_000;
        assert_eq!(across_hosts, components.iter().map(|it| it.map(|it| it + network)).collect::<Vec<_>>());
        assert!(matches!(across_hosts[..], [Some(_)]), "{across_hosts:?}");
        // Without what the network takes, there is no latency.
        let unknown = config.replace("latency = \"3 ms\"", "");
        assert_eq!(figures(across, unknown, &[("/t.toml", table)]).1, [None]);
    }

    /// The latencies of the chains, in microseconds, by their names.
    fn chains(files: &[(&str, String)]) -> Vec<(String, Option<u64>)> {
        let micros = |time: Time| time.as_nanos() / 1000;
        let mut found: Vec<_> = with(files, |db, project, of| {
            let all = &crate::chains::chains_of(db, project, of, QUERY).all;
            let declared = all.iter().filter(|it| it.declared.is_some());
            declared.map(|it| (it.name.to_string(), it.latency.map(micros))).collect()
        });
        found.sort();
        found
    }

    #[derive(Clone, Default)]
    struct Gate {
        ports: String,
        variables: String,
        reads: String,
        writes: String,
    }

    /// Chains across random hosts, links and topics, beside one computer on which a component of each host moves its samples.
    #[test]
    fn random_chains_across_hosts_pass_their_own_gateways() {
        let mut random = mauve_timing::Random::new(11);
        let mut below = move |most: u64| random.up_to(most - 1);
        let (mut compared, mut unknown) = (0, 0);
        for _ in 0..40 {
            let hosts = 2 + below(2);
            let pairs = 1 + below(4);
            let mut network = vec![vec![None; 3]; 3];
            let mut config = "timing.tables = [\"t.toml\"]\n".to_owned();
            let mut by_hand = config.clone();
            for host in 1..=hosts {
                let other = |name: &str, cpu: u64| {
                    format!(
                        "[[platform.other]]\nname = \"{name}\"\npriority = 39\nperiod = \"9 ms\"\ntime = \"100 us\"\ncpus = [{cpu}]\n"
                    )
                };
                config += &(other("recv", 1) + &format!("host = \"h{host}\"\n"));
                by_hand += &other(&format!("recv{host}"), host);
            }
            config += "[ros2]\ndiscovery = \"subnet\"\ngateway = { priority = 40, period = \"7 ms\", cpus = [1] }\n[ros2.topics]\n";
            let codels = "codel see(): double\ncodel act(x: double): void\ncodel move(x: double): double\n
                shell E { output port out: double }\nshell H { input port into: double }
                core Ke(E) { update = { write(out, see()); } }\ncore Kh(H) { var x: double; update = { read(into, x); act(x); } }
                component Ce(E, Ke)\ncomponent Ch(H, Kh)\n";
            let mut table = "codel.see = 1\ncodel.act = 2\n[access]\n".to_owned();
            let (mut instances, mut activities, mut activities_by_hand) =
                (String::new(), String::new(), String::new());
            let (mut on_host, mut gateways) = (vec![Vec::new(); 4], vec![Gate::default(); 4]);
            let (mut links, mut links_by_hand, mut chains_of) = (String::new(), String::new(), String::new());
            let mut ends = Vec::new();
            for pair in 0..pairs {
                let from = 1 + below(hosts);
                let to = 1 + (from - 1 + 1 + below(hosts - 1)) % hosts;
                ends.push((from, to));
                for (kind, component, host) in [("eye", "Ce", from), ("hand", "Ch", to)] {
                    let name = format!("{kind}{pair}");
                    instances += &format!("instance {name}: {component}\n");
                    let fields = format!("priority = {} period = {}", 1 + below(30), 20 + 10 * below(4));
                    activities += &format!("activity {name} {{ {fields} affinity = 1 }}\n");
                    activities_by_hand += &format!("activity {name} {{ {fields} cpus = [{host}] }}\n");
                    on_host[host as usize].push(format!("\"{name}\""));
                }
                if below(3) == 0 {
                    config += &format!("\"eye{pair}.out\" = \"/eye_{pair}\"\n");
                }
                links += &format!("connection eye{pair}.out -> hand{pair}.into\n");
                links_by_hand += &format!(
                    "connection eye{pair}.out -> g{from}.i{pair}s connection g{from}.o{pair}s -> g{to}.i{pair}r connection g{to}.o{pair}r -> hand{pair}.into\n"
                );
                for (host, side, port) in
                    [(from, "s", format!("eye{pair}.out")), (to, "r", format!("hand{pair}.into"))]
                {
                    let (gate, name) = (&mut gateways[host as usize], format!("{pair}{side}"));
                    gate.ports += &format!("input port i{name}: double output port o{name}: double\n");
                    gate.variables += &format!("var x{name}: double;\n");
                    // What it writes is there at its end.
                    gate.reads += &format!("read(i{name}, x{name}); x{name} = move(x{name});\n");
                    gate.writes += &format!("write(o{name}, x{name});\n");
                    table += &format!("\"ros2.{port}\" = 0.1\n");
                }
                chains_of +=
                    &format!("[chains.c{pair}]\nfrom = \"eye{pair}.out\"\nto = \"hand{pair}.into\"\n");
            }
            for host in 1..=hosts {
                config += &format!(
                    "[host.h{host}]\ncpus = 1\nactivities = [{}]\n",
                    on_host[host as usize].join(", ")
                );
            }
            for one in 1..=hosts {
                for other in (1..=hosts).filter(|it| *it != one) {
                    if below(3) > 0 {
                        let latency = 1 + below(9);
                        config += &format!("[link.h{one}-h{other}]\nlatency = \"{latency} ms\"\n");
                        for (a, b) in [(one, other), (other, one)] {
                            let known: &mut Option<u64> = &mut network[a as usize - 1][b as usize - 1];
                            *known = (*known).max(Some(latency));
                        }
                    }
                }
            }
            let mut declared = String::new();
            for host in 1..=hosts {
                let Gate { ports, variables, reads, writes } = &gateways[host as usize];
                if ports.is_empty() {
                    continue;
                }
                declared += &format!(
                    "shell G{host} {{ {ports} }}\ncore Kg{host}(G{host}) {{ {variables} update = {{ {reads}{writes} }} }}\ncomponent Cg{host}(G{host}, Kg{host})\n"
                );
                links_by_hand += &format!("instance g{host}: Cg{host}\n");
                activities_by_hand +=
                    &format!("activity g{host} {{ priority = 40 period = 7 cpus = [{host}] }}\n");
            }
            let model = |more: &str, links: &str, activities: &str| {
                format!(
                    "{codels}{more}architecture A {{ {instances}{links} }}\ndeployment D {{ architecture A\n{activities} }}"
                )
            };
            let across = model("", &links, &activities);
            let found = chains(&[
                ("/m.mal", across.clone()),
                ("/mauve.toml", config.clone() + &chains_of),
                ("/t.toml", table.clone()),
            ]);
            let table = "codel.see = 1\ncodel.act = 2\ncodel.move = 0.1\n".to_owned();
            let local = model(&declared, &links_by_hand, &activities_by_hand);
            let expected =
                chains(&[("/m.mal", local), ("/mauve.toml", by_hand + &chains_of), ("/t.toml", table)]);
            assert_eq!(found.len(), pairs as usize);
            for ((found, expected), (from, to)) in found.iter().zip(&expected).zip(ends) {
                let network = network[from as usize - 1][to as usize - 1];
                let expected = network.and_then(|network| Some(expected.1? + network * 1000));
                assert_eq!(found.1, expected, "{} of\n{across}\n{config}", found.0);
                (compared, unknown) =
                    (compared + usize::from(expected.is_some()), unknown + usize::from(network.is_none()));
            }
        }
        assert!(compared > 40 && unknown > 5, "{compared} {unknown}");
    }

    /// Three hosts: `eye` to `mid` to `hand`, with these topics.
    fn three_hosts(topics: &str, chains: &str) -> [(&'static str, String); 3] {
        let model = "codel see(): double\ncodel turn(x: double): double\ncodel act(x: double): void\n
            shell E { output port out: double }\nshell M { input port into: double output port out: double }\nshell H { input port into: double }
            core Ke(E) { update = { write(out, see()); } }\ncore Km(M) { var x: double; update = { read(into, x); write(out, turn(x)); } }
            core Kh(H) { var x: double; update = { read(into, x); act(x); } }
            component Ce(E, Ke)\ncomponent Cm(M, Km)\ncomponent Ch(H, Kh)
            architecture A { instance eye: Ce instance mid: Cm instance hand: Ch connection eye.out -> mid.into connection mid.out -> hand.into }
            deployment D { architecture A activity eye { priority = 9 period = 100 } activity mid { priority = 9 period = 50 } activity hand { priority = 9 period = 60 } }";
        let mut config = format!(
            "timing.tables = [\"t.toml\"]\n[ros2]\ndiscovery = \"subnet\"\ngateway = {{ priority = 5, period = \"5 ms\" }}\ntopics = {{ {topics} }}\n"
        );
        for (host, instance) in [("a", "eye"), ("b", "mid"), ("c", "hand")] {
            config += &format!("[host.{host}]\ncpus = 1\nactivities = [\"{instance}\"]\n");
        }
        config += "[link.a-b]\nlatency = \"200 ms\"\n[link.b-c]\nlatency = \"2 ms\"\n";
        let table = "codel.see = 1\ncodel.turn = 1\ncodel.act = 1\n[access]\n\"ros2.eye.out\" = 0.1\n\"ros2.mid.into\" = 0.1\n\"ros2.mid.out\" = 0.1\n\"ros2.hand.into\" = 0.1\n";
        [("/m.mal", model.to_owned()), ("/mauve.toml", config + chains), ("/t.toml", table.to_owned())]
    }

    const DECLARED: &str = "[chains.all]\nfrom = \"eye.out\"\nto = \"hand.into\"\n[chains.half]\nfrom = \"eye.out\"\nto = \"mid.out\"\n";

    #[test]
    fn a_chain_that_ends_with_a_topic_passes_its_gateway() {
        // Whether the topic has an entry, or is one of the connection alone.
        for topics in ["", "\"mid.out\" = \"/way\""] {
            with(&three_hosts(topics, DECLARED), |db, project, of| {
                let found = crate::chains::chains_of(db, project, of, QUERY);
                let half = found.all.iter().find(|it| it.name == *"half").unwrap();
                let steps: Vec<&str> = half.steps.iter().map(|it| it.instance.as_str()).collect();
                assert_eq!(steps, ["eye", "ros2@a", "ros2@b", "mid", "ros2@b"], "{topics}");
                assert!(half.latency.is_some(), "{:?}", half.reasons);
            });
        }
    }

    #[test]
    fn a_connection_between_hosts_has_its_own_figure() {
        let latencies = |chains: &str| {
            with(&three_hosts("", chains), |db, project, of| {
                let all = crate::chains::connections_of(db, project, of, QUERY).iter();
                all.map(|it| it.latency).collect::<Vec<_>>()
            })
        };
        let alone = latencies("");
        // Not the 200 ms of the link before.
        assert!(alone[1].is_some_and(|it| it.as_nanos() < 100_000_000), "{alone:?}");
        assert_eq!(latencies(DECLARED), alone);
    }

    #[test]
    fn samples_that_may_be_lost_have_no_bound() {
        let of = |topics: &str| chains(&three_hosts(topics, DECLARED));
        let is_known = |topics: &str| of(topics).into_iter().map(|(_, it)| it.is_some()).collect::<Vec<_>>();
        assert_eq!(is_known(""), [true, true]);
        let lossy = |port: &str| format!("\"{port}\" = {{ reliability = \"best-effort\" }}");
        // Of one end, or of both.
        assert_eq!(is_known(&format!("{}, {}", lossy("eye.out"), lossy("mid.into"))), [false, false]);
        assert_eq!(is_known(&lossy("hand.into")), [false, true]);
    }
}
