//! What the main of a deployment says of its topics of ROS 2.
//!
//! ```text
//! mauve::Ros2 ros2(robot, "/uav", "robot_Run");
//! ros2.gateway(1000000, 20, 0x1, 1000000, 400000);
//! ros2.publish<sensor_msgs::LaserScan>({"laser.scan", "laser", "scan", "/uav/laser/scan", "RIHS01_…", "…", 1, true, false, 1048576});
//! ```

use std::collections::BTreeSet;

use mauve_hir::{Decl, Topic, TopicOrigin, config_of, hosts_of, ros2_of};
use mauve_timing::Time;
use mauve_wcrt::system_of;
use rustc_hash::FxHashMap;

use super::cpu_set::cpu_set;
use crate::cpp_name::{host_name, script_name};
use crate::cpp_type::cpp_type;
use crate::deployment::RunnableDeployment;
use crate::escape::cpp_string;
use crate::library::Model;
use crate::template::lines;
use crate::type_hash::type_hash;

/// The lines of a main.
#[derive(Debug, Default)]
pub(super) struct TopicCalls {
    pub(super) headers: String,
    pub(super) gateway: String,
    pub(super) topics: String,
}

/// Returns the lines for the topics of a host. `bounds` are the response times.
pub(super) fn calls<'db>(
    model: Model<'_, 'db>,
    of: Decl<'db>,
    deployed: &RunnableDeployment,
    host: usize,
    bounds: &FxHashMap<String, Option<Time>>,
) -> TopicCalls {
    let Model { db, project, .. } = model;
    let (found, config) = (ros2_of(db, project, of), config_of(db, project.workspace(db)));
    let Some(written) = config.ros2.as_ref() else { return TopicCalls::default() };
    let namespace = written.namespace.as_ref().map_or("", |(it, _)| it.trim_matches('/'));
    let name = found.gateway(host);
    let node = match &deployed.host {
        Some(host) => format!("{}_{}_{}", deployed.package, deployed.name, host_name(host)),
        None => format!("{}_{}", deployed.package, deployed.name),
    };
    let own_name = if deployed.host.is_some() { format!(", {}", cpp_string(&name)) } else { String::new() };
    let gateway = &written.gateway;
    let period = gateway.period.unwrap_or_default().as_nanos();
    // Those of the analysis, as for an activity without an affinity.
    let cpus = system_of(db, project, of).activities.iter().find(|it| it.instance == name);
    let cpus = cpus.and_then(|it| it.cpus).map(|it| hosts_of(db, project.workspace(db)).local(it).1);
    let cpus = cpus.filter(|it| !it.is_empty()).map_or("0".to_owned(), cpu_set);
    let response = bounds.get(name.as_str()).copied().flatten();
    let response = response.map_or("mauve::no_bound".to_owned(), |it| it.as_nanos().to_string());
    let gateway = [
        format!(
            "  mauve::Ros2 ros2(robot, {}, {});",
            cpp_string(&format!("/{namespace}")),
            cpp_string(&node)
        ),
        format!("  ros2.domain({});", written.domain.unwrap_or_default()),
        format!(
            "  ros2.discovery(mauve::Ros2::{});",
            if written.is_on_subnet { "Subnet" } else { "Localhost" }
        ),
        format!(
            "  ros2.gateway({period}, {}, {cpus}, {period}, {response}{own_name});",
            gateway.priority.unwrap_or(2)
        ),
    ];
    let messages = found.topics_of(host).filter(|it| !it.ty.is_wrapped);
    let headers: BTreeSet<String> =
        messages.map(|it| format!("#include <{}/{}.h>", it.ty.package, it.ty.message)).collect();
    TopicCalls {
        headers: lines(headers),
        gateway: lines(gateway),
        topics: lines(found.topics_of(host).filter_map(|it| call(model, of, it))),
    }
}

/// Returns the call for a topic; `None` if its type is unknown, which is an error of the model.
fn call<'db>(model: Model<'_, 'db>, of: Decl<'db>, topic: &Topic) -> Option<String> {
    let Model { db, project, .. } = model;
    let (instance, port) = &topic.port;
    let ty = &topic.ty;
    let cpp = match ty.is_wrapped {
        true => {
            let (flat, _) = mauve_hir::deployed(db, project, of)?;
            let features = flat.instance(instance)?.features(db, project)?;
            cpp_type(db, model.workspace(), &features.get(port)?.ty(db, project))?
        }
        false => format!("{}::{}", ty.package, ty.message),
    };
    let hash = type_hash(db, project.workspace(db), &ty.package, &ty.message)?;
    let texts = [
        format!("{instance}.{port}"),
        instance.to_string(),
        script_name(port),
        topic.name.to_string(),
        hash,
        format!("{}::msg::dds_::{}_", ty.package, ty.message),
    ];
    let texts = texts.map(|it| cpp_string(&it)).join(", ");
    let call = if topic.is_published { "publish" } else { "subscribe" };
    let (reliable, transient_local) = (!topic.is_best_effort, topic.is_transient_local);
    let (depth, max_bytes) = (topic.depth, topic.max_bytes);
    let other_end =
        other_hosts(model, of, topic).map_or_else(String::new, |it| format!(", {}", cpp_string(&it)));
    Some(format!(
        "  ros2.{call}<{cpp}>({{{texts}, {depth}, {reliable}, {transient_local}, {max_bytes}{other_end}}});"
    ))
}

/// Returns the hosts at the other ends of a connection across hosts, such as `host eyes`.
fn other_hosts<'db>(model: Model<'_, 'db>, of: Decl<'db>, topic: &Topic) -> Option<String> {
    let found = ros2_of(model.db, model.project, of);
    let others = found.topics.iter().filter(|it| {
        let is_across = matches!(it.origin, TopicOrigin::AcrossHosts(_));
        is_across && it.name == topic.name && it.is_published != topic.is_published
    });
    let hosts: BTreeSet<&str> =
        others.filter_map(|it| found.hosts.get(it.host)).map(|it| it.as_str()).collect();
    let is_across = matches!(topic.origin, TopicOrigin::AcrossHosts(_)) && !hosts.is_empty();
    let names = hosts.iter().copied().collect::<Vec<_>>().join(", ");
    is_across.then(|| format!("host{} {names}", if hosts.len() > 1 { "s" } else { "" }))
}
