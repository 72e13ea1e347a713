//! The layout of a task set in JSON: a line for each key at the top, each task and each edge.

use std::io::{Result, Write};

use serde::Serialize;

use super::TaskSet;

impl TaskSet {
    /// Returns the text of the file in JSON, which ends with a line break: the same for the same content.
    pub fn to_json(&self) -> String {
        let mut out = Vec::new();
        // All keys are texts, and memory takes every byte: there is no error.
        let _ =
            self.serialize(&mut serde_json::Serializer::with_formatter(&mut out, TaskSetLayout { depth: 0 }));
        out.push(b'\n');
        String::from_utf8_lossy(&out).into_owned()
    }
}

struct TaskSetLayout {
    /// The number of objects around this place.
    depth: usize,
}

impl TaskSetLayout {
    fn line<W: Write + ?Sized>(&self, to: &mut W) -> Result<()> {
        write!(to, "\n{:1$}", "", 2 * self.depth)
    }
}

impl serde_json::ser::Formatter for TaskSetLayout {
    fn begin_object<W: Write + ?Sized>(&mut self, to: &mut W) -> Result<()> {
        if self.depth > 0 {
            self.depth += 1;
            self.line(to)?;
            self.depth -= 1;
        }
        self.depth += 1;
        to.write_all(b"{")
    }

    fn end_object<W: Write + ?Sized>(&mut self, to: &mut W) -> Result<()> {
        self.depth -= 1;
        if self.depth == 0 {
            self.line(to)?;
        }
        to.write_all(b"}")
    }

    fn begin_object_key<W: Write + ?Sized>(&mut self, to: &mut W, first: bool) -> Result<()> {
        match (self.depth, first) {
            (1, true) => self.line(to),
            (1, false) => to.write_all(b",").and_then(|()| self.line(to)),
            (_, true) => Ok(()),
            (_, false) => to.write_all(b", "),
        }
    }

    fn begin_object_value<W: Write + ?Sized>(&mut self, to: &mut W) -> Result<()> {
        to.write_all(b": ")
    }
}
