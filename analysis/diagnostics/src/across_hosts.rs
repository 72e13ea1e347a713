//! # across-hosts
//!
//! The robot has several computers, `[host.NAME]` in `mauve.toml`, and what it distributes cannot be: an instance has no host or two, an
//! activity executes instances of two hosts or has a CPU that its host lacks, or a connection leads to another host and cannot be a topic
//! of ROS 2. A call of an operation runs on the computer of its caller: operations across hosts do not exist. Releases of instances on two
//! hosts are synchronised only with `[clocks] ptp`. Hosts find each other with `[ros2] discovery = "subnet"`.
//!
//! ```mauve
//! shell S { output port out: int }
//! shell T { input port into: int }
//! core C(S) { update = { write(out, 1); } }
//! core E(T) { var n: int; update = { read(into, n); } }
//! component Eye(S, C)
//! component Brain(T, E)
//! architecture A { instance eye: Eye  instance brain: Brain  connection eye.out -> brain.into }
//! deployment D {
//!   architecture A
//!   activity eye { priority = 1 period = 100 }
//!   activity brain { priority = 1 period = 100 }
//! }
//! //- /mauve.toml
//! [lints]
//! not-analysed = "allow"
//! [ros2]
//! discovery = "subnet"
//! gateway = { priority = 20, period = "1 ms" }
//! [clocks]
//! synchronised = ["eye", "brain"]   # error
//! [host.eyes]
//! activities = ["eye"]
//! [host.head]
//! activities = ["brain"]
//! [link."eyes-head"]
//! latency = "2 ms"
//! [link."eyes-tail"]   # error
//! latency = "2 ms"
//! ```

use super::*;
use mauve_hir::fact::Ros2Fact as F;

pub(super) fn report<'db>(at: Location<'db>, fact: &F) -> Diagnostic<'db> {
    let message = match fact {
        F::NoHost { instance } => {
            format!("no host has `{instance}`: add it to the `activities` of a `[host.NAME]` in mauve.toml")
        }
        F::TwoHosts { instance, first } => {
            format!("`{instance}` runs on host `{first}` already: delete it here or there")
        }
        F::NoCpuOfHost { instance, host, cpus } => format!(
            "`{instance}` may run on a CPU that its host `{host}` does not have: `[host.{host}] cpus` is {cpus}"
        ),
        F::OperationAcross { link, hosts: [from, to] } => format!(
            "operation {link} leads from host `{from}` to host `{to}`: a call cannot leave its computer; use ports, or put both instances on one host"
        ),
        F::NoMessageAcross { link, hosts: [from, to], ty } => format!(
            "{link} leads from host `{from}` to host `{to}`, and its type {} cannot be a topic; use a message as the type of the ports",
            type_name(ty)
        ),
        F::NotOnSubnet { link, hosts: [from, to] } => format!(
            "{link} leads from host `{from}` to host `{to}`, which do not find each other: `discovery` is \"localhost\"; write `discovery = \"subnet\"` into `[ros2]`"
        ),
        F::ActivityAcross { instances: [one, other], hosts: [first, second] } => format!(
            "one activity executes `{one}` on host `{first}` and `{other}` on host `{second}`: put both on one host, or give each an activity"
        ),
        F::NoRos2 { link, hosts: [from, to] } => format!(
            "{link} leads from host `{from}` to host `{to}`, and mauve.toml has no `[ros2]`: add it, with its `gateway`"
        ),
        F::InvalidLink { name, near } => {
            let found = format!("no hosts for link `{name}`: name two hosts, joined by `-`");
            return Diagnostic::new(&ACROSS_HOSTS, at.clone(), found).link_instead(near.as_ref(), at);
        }
        F::AmbiguousLink { name, pairs: [[a, b], [c, d]] } => format!(
            "link `{name}` may join `{a}` and `{b}`, or `{c}` and `{d}`: rename a host"
        ),
        F::SecondLink { name, first } => format!(
            "links `{first}` and `{name}` join the same hosts, and the greater latency counts: delete one of them"
        ),
        F::ClockAcross { instance, other, hosts: [from, to] } => format!(
            "`{instance}` on host `{to}` is not synchronised with `{other}` on host `{from}`: add `ptp`, by how much their clocks differ at most, to `[clocks]`"
        ),
        _ => return missing_link::report(at, fact),
    };
    Diagnostic::new(&ACROSS_HOSTS, at, message)
}

impl<'db> Diagnostic<'db> {
    fn link_instead(mut self, near: Option<&Name>, at: Location<'db>) -> Diagnostic<'db> {
        let Some(near) = near else { return self };
        self.message += &format!("; did you mean `{near}`?");
        self.fix(format!("Change to `{near}`"), at, mauve_hir::toml_key(near))
    }
}
