//! # invalid-topic
//!
//! A topic of ROS 2 cannot exist as `[ros2]` of `mauve.toml` has it: its name breaks the rules of ROS 2, its port has a
//! type that is not a message, a connection feeds its input already, two ports have it with different types, two outputs are one topic
//! although a connection of one leads to another host, or a reader asks for a better quality of service than the writer offers (no
//! sample would ever arrive).
//!
//! ```mauve
//! use std_msgs
//! shell S { input port goal: String  input port start: String  output port speed: double }
//! core C(S) { var s: String; update = { read(goal, s); read(start, s); write(speed, 1.0); } }
//! component Driver(S, C)
//! architecture A { instance driver: Driver }
//! deployment D { architecture A  activity driver { priority = 1 period = 100 } }
//! //- /mauve.toml
//! [lints]
//! not-analysed = "allow"
//! [ros2]
//! gateway = { priority = 20, period = "1 ms" }
//! [ros2.topics]
//! "driver.goal" = "/goal"
//! "driver.start" = "/2d/start"   # error
//! "driver.speed" = "speed"
//! ```
//!
//! A type can be a topic if it is `bool`, an integer but `char` and `size_t`, `float`, `double`, `string`, or a message whose fields
//! all can: not `wstring`, not the `time` of ROS 1, not a message that contains itself. A port without a connection and with a
//! message as its type is a topic by itself; connect it, or give it another type, if it should not be one.
//!
//! Names have letters, digits, `_` and `/`; no part between `/` begins with a digit or is empty.
//!
//! Fix: change a name to the valid one.

use super::*;
use mauve_hir::fact::{InvalidName, Quality, Ros2Fact as F, Unmapped};
use mauve_hir::toml_key;

pub(super) fn report<'db>(at: Location<'db>, fact: &F) -> Diagnostic<'db> {
    let message = match fact {
        F::NoPort { key } => {
            format!("`{key}` is not `instance.port`: write a port, such as \"camera.frame\"")
        }
        F::ConnectedInput { port, link } => format!(
            "`{port}` has the connection {link} already, and an input has one writer: delete the connection or this entry"
        ),
        F::NoMessage { port, ty } => format!(
            "`{port}` cannot be a topic: its type {} is not a message; give the port a message as its type, or delete this entry",
            type_name(ty)
        ),
        F::Unmapped { port, message, why } => {
            format!("`{port}` cannot be a topic of {message}: {}", unmapped(why))
        }
        F::InvalidName { name, why, fixed } => {
            let message = format!("invalid name of ROS 2 `{name}`: {}", name_rule(*why));
            let found = Diagnostic::new(&INVALID_TOPIC, at.clone(), message);
            return match fixed {
                Some(fixed) => found.fix(format!("Change to `{fixed}`"), at, toml_string(fixed)),
                None => found,
            };
        }
        F::TwoTypes { topic, ports: [(first, ty), (second, other)] } => format!(
            "topic `{topic}` has two types: {ty} of `{first}`, and {other} of `{second}`; give one of them another name in `[ros2] topics`"
        ),
        F::TwoOutputs { topic, outputs: [first, second] } => format!(
            "topic `{topic}` is the output `{first}` and the output `{second}`, and one of them leads to another host, where their \
             samples cannot be told apart: give one of them another name in `[ros2] topics`"
        ),
        F::Quality { topic, writer, reader, property: Quality::Reliability } => format!(
            "`{reader}` never gets a sample of `{writer}` on `{topic}`: a reliable reader, a best-effort writer; add `reliability = \"best-effort\"` to `{reader}`"
        ),
        F::Quality { topic, writer, reader, property: Quality::Durability } => format!(
            "`{reader}` never gets a sample of `{writer}` on `{topic}`: a transient-local reader, a volatile writer; add `durability = \"transient-local\"` to `{writer}`"
        ),
        F::NoGateway { key } => {
            let example = if *key == "priority" { "priority = 20" } else { "period = \"1 ms\"" };
            format!("the robot has topics, and `[ros2] gateway` has no `{key}`: add `{example}`")
        }
        F::NameOfGateway { name, is_host: false } => {
            format!("instance `{name}` has the name of the gateway to ROS 2: rename it")
        }
        F::NameOfGateway { name, is_host: true } => {
            format!("host `{name}` would give its gateway, `ros2@{name}`, an ambiguous name: rename it")
        }
        _ => return across_hosts::report(at, fact),
    };
    Diagnostic::new(&INVALID_TOPIC, at, message)
}

fn toml_string(text: &str) -> String {
    // A valid name has no character to escape.
    format!("\"{}\"", toml_key(text).trim_matches('"'))
}

/// Returns why a message cannot be a topic.
fn unmapped(why: &Unmapped) -> String {
    let of = |field: &String| match field.as_str() {
        "" => String::new(),
        field => format!("field `{field}`: "),
    };
    match why {
        Unmapped::NoPackage { field, package } => {
            format!("{}no package `{package}`; install it, so that AMENT_PREFIX_PATH has its .msg files", of(field))
        }
        Unmapped::NoSuchMessage { field, ty } if matches!(ty.as_str(), "time" | "duration") => {
            let instead = if ty == "time" { "Time" } else { "Duration" };
            format!("{}`{ty}` is of ROS 1; write builtin_interfaces/{instead}", of(field))
        }
        Unmapped::NoSuchMessage { field, ty } => format!("{}no message `{ty}`", of(field)),
        Unmapped::WideString { field } => format!("{}`wstring` is not supported; write `string`", of(field)),
        Unmapped::Recursive { field } => format!("{}the message contains itself, or is nested too deeply", of(field)),
    }
}

fn name_rule(why: InvalidName) -> String {
    match why {
        InvalidName::Empty => "it is empty: write at least one part, such as `/scan`".to_owned(),
        InvalidName::Character(sign) => {
            format!("`{}` is not allowed: use letters, digits, `_` and `/`", sign.escape_default())
        }
        InvalidName::Digit => "a part begins with a digit: begin it with a letter or `_`".to_owned(),
        InvalidName::DoubleSlash => "`//` is not allowed: write one `/`".to_owned(),
        InvalidName::EndsWithSlash => "it ends with `/`: delete it".to_owned(),
        InvalidName::Tilde => "`~` is not supported: write the name of the node out".to_owned(),
        InvalidName::TooLong => "it is longer than 255 bytes with its prefix `rt`: shorten it".to_owned(),
    }
}
