//! What may be wrong with topics, hosts and links.

use crate::item_tree::Name;
use crate::types::Type;

/// What is wrong with a topic, a host or a link.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum Ros2Fact {
    /// A key of `topics` is not `instance.port`.
    NoPort { key: Name },
    /// An entry of `topics` for an input that this connection feeds.
    ConnectedInput { port: Name, link: String },
    /// The type of this port is no message.
    NoMessage { port: Name, ty: Type },
    /// A message of this port cannot be a topic, because of a field.
    Unmapped { port: Name, message: String, why: Unmapped },
    /// The name of a topic, or the namespace, is invalid, with the valid form where there is a similar one.
    InvalidName { name: Name, why: InvalidName, fixed: Option<String> },
    /// Two ports of different types are this topic: each with its type.
    TwoTypes { topic: Name, ports: [(String, String); 2] },
    /// Two outputs are this topic, and one of them leads to another host.
    TwoOutputs { topic: Name, outputs: [String; 2] },
    /// A reader asks for more than a writer of the same topic offers.
    Quality { topic: Name, writer: String, reader: String, property: Quality },
    /// `[ros2]` has topics, and its gateway lacks this key.
    NoGateway { key: &'static str },
    /// An instance or a host has a name that the gateways have.
    NameOfGateway { name: Name, is_host: bool },
    /// No host has this instance.
    NoHost { instance: Name },
    /// Two hosts have this instance.
    TwoHosts { instance: Name, first: Name },
    /// An activity may run on a CPU that its host does not have.
    NoCpuOfHost { instance: Name, host: Name, cpus: u32 },
    /// A connection between operations of instances on different hosts.
    OperationAcross { link: String, hosts: [Name; 2] },
    /// A connection across hosts whose type is no message.
    NoMessageAcross { link: String, hosts: [Name; 2], ty: Type },
    /// A connection across hosts without `[ros2]`.
    NoRos2 { link: String, hosts: [Name; 2] },
    /// A connection across hosts, and other computers are not found: `[ros2] discovery`.
    NotOnSubnet { link: String, hosts: [Name; 2] },
    /// One activity executes instances of different hosts.
    ActivityAcross { instances: [Name; 2], hosts: [Name; 2] },
    /// Hosts that have connections, and no link.
    NoLink { hosts: [Name; 2], link: String },
    /// A link whose name is not that of two hosts.
    InvalidLink { name: Name, near: Option<Name> },
    /// A link whose name is that of two pairs of hosts.
    AmbiguousLink { name: Name, pairs: [[Name; 2]; 2] },
    /// Two links join the same hosts.
    SecondLink { name: Name, first: Name },
    /// An instance has a clock with one of another host, and `[clocks] ptp` is missing.
    ClockAcross { instance: Name, other: Name, hosts: [Name; 2] },
}

/// Why a message cannot be a topic. `field` is its path, such as `header.stamp`.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Unmapped {
    NoPackage { field: String, package: Name },
    NoSuchMessage { field: String, ty: String },
    WideString { field: String },
    Recursive { field: String },
}

/// Why the name of a topic, or a namespace, is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum InvalidName {
    Empty,
    Character(char),
    Digit,
    DoubleSlash,
    EndsWithSlash,
    Tilde,
    TooLong,
}

/// A property of the quality of service that does not match.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Quality {
    Reliability,
    Durability,
}

impl Ros2Fact {
    /// Returns whether it is an error, instead of a hint.
    pub(crate) fn is_error(&self) -> bool {
        !matches!(self, Ros2Fact::NoLink { .. })
    }
}
