//! The notations of a task set.

use std::path::Path;

use serde::Deserialize;
use serde_json::{Map, Value};

use super::{TaskEntry, TaskSet, TaskSetError};

/// How a file writes a task set.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub enum Notation {
    Json,
    Toml,
    Csv,
}

impl Notation {
    /// Returns the notation of the task set in a file with this name; none where it is that of another file.
    pub fn of(path: &Path) -> Option<Notation> {
        match path.extension()?.to_str()? {
            "json" => Some(Notation::Json),
            "toml" if path.file_name()? != "mauve.toml" => Some(Notation::Toml),
            "csv" => Some(Notation::Csv),
            _ => None,
        }
    }

    pub(super) fn read(self, text: &str) -> Result<TaskSet, TaskSetError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        match self {
            Notation::Json => json(text),
            Notation::Toml => toml(text),
            Notation::Csv => csv(text),
        }
    }
}

fn json(text: &str) -> Result<TaskSet, TaskSetError> {
    #[derive(Deserialize)]
    struct Earlier {
        format: String,
    }
    serde_json::from_str(text).map_err(|error| match serde_json::from_str(text) {
        Ok(Earlier { format }) => TaskSetError::EarlierFormat(format),
        Err(_) => {
            let message = error.to_string();
            let message = message.rsplit_once(" at line ").map_or(&*message, |(message, _)| message);
            syntax(message.to_owned(), error.line())
        }
    })
}

fn toml(text: &str) -> Result<TaskSet, TaskSetError> {
    toml::from_str(text).map_err(|error: toml::de::Error| {
        let before = text.get(..error.span().map_or(0, |span| span.start)).unwrap_or_default();
        syntax(error.message().to_owned(), before.matches('\n').count() + 1)
    })
}

/// Reads the lines before the header, each with a key and its values, then a task from each line.
fn csv(text: &str) -> Result<TaskSet, TaskSetError> {
    let mut reader = csv::ReaderBuilder::new();
    let reader = reader.has_headers(false).flexible(true).trim(csv::Trim::All);
    let mut head = Map::from_iter([("task".to_owned(), Value::Array(Vec::new()))]);
    let mut header: Option<(usize, Vec<String>)> = None;
    let mut tasks = Vec::new();
    for record in reader.from_reader(text.as_bytes()).records() {
        let line = |at: Option<&csv::Position>| {
            let (line, byte) = at.map_or((1, 0), |at| (at.line() as usize, at.byte() as usize));
            // It is the position before blank lines.
            let before = text.get(byte..).unwrap_or_default();
            line + before.chars().take_while(|c| matches!(c, '\r' | '\n')).filter(|c| *c == '\n').count()
        };
        let record = record.map_err(|error| syntax(error.to_string(), line(error.position())))?;
        let line = line(record.position());
        // Spreadsheets fill lines with empty cells.
        let mut cells: Vec<&str> = record.iter().collect();
        cells.truncate(cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1));
        match (cells.as_slice(), &header) {
            ([], _) => {}
            (cells, Some((first, header))) => {
                let entry = fields(header, cells).ok_or(TaskSetError::WrongColumns { line })?;
                let task = TaskEntry::deserialize(Value::Object(entry)).map_err(|error| {
                    let message = error.to_string();
                    // The header has the names of the fields.
                    let line = if message.starts_with("unknown field") { *first } else { line };
                    syntax(message, line)
                });
                tasks.push(task?);
            }
            (cells, None) if cells.contains(&"name") => {
                header = Some((line, cells.iter().map(|&key| key.to_owned()).collect()));
            }
            ([key, values @ ..], None) => {
                let value = match values {
                    [value] if *key != "levels" => {
                        value.parse().map_or_else(|_| (*value).into(), Value::Bool)
                    }
                    values => values.into(),
                };
                if head.insert((*key).to_owned(), value).is_some() {
                    return Err(syntax(format!("duplicate field `{key}`"), line));
                }
            }
        }
    }
    let (line, _) = header.ok_or(TaskSetError::NoHeader)?;
    let head = TaskSet::deserialize(Value::Object(head)).map_err(|error| syntax(error.to_string(), 1))?;
    // A table without tasks is a mistake. JSON and TOML may have none: such exports exist.
    if tasks.is_empty() { Err(TaskSetError::NoTasks { line }) } else { Ok(TaskSet { task: tasks, ..head }) }
}

/// Reads the fields of a line; `None` if it has more cells than the header, or two with one name. A cell with several words is
/// a list of numbers, where it is no name.
fn fields(header: &[String], cells: &[&str]) -> Option<Map<String, Value>> {
    let mut fields = Map::new();
    for (index, cell) in cells.iter().enumerate().filter(|(_, cell)| !cell.is_empty()) {
        let key = header.get(index)?;
        let words: Vec<&str> = cell.split_whitespace().collect();
        let value = match words.as_slice() {
            [_, _, ..] if !["name", "component", "thread"].contains(&key.as_str()) => words.into(),
            [word] if ["sporadic", "preemptive"].contains(&key.as_str()) => {
                word.parse().map_or_else(|_| (*word).into(), Value::Bool)
            }
            _ => (*cell).into(),
        };
        if fields.insert(key.clone(), value).is_some() {
            return None;
        }
    }
    Some(fields)
}

fn syntax(message: String, line: usize) -> TaskSetError {
    TaskSetError::Syntax { message, line }
}
