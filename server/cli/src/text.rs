//! Counts, paths, times and tables as text.

use std::path::Path;

use mauve_diagnostics::shortened;
use mauve_ide::in_columns;
use mauve_projects::output::terminal_columns;
use mauve_timing::{Time, Unit};

/// Returns a path as it is shown: relative to `here` if it is below that folder.
pub(super) fn shown(path: &Path, here: &Path) -> String {
    path.strip_prefix(here).unwrap_or(path).display().to_string()
}

/// Returns a path as an argument of a command that is printed for a shell.
pub(super) fn argument(path: &Path) -> String {
    let shown = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+,@%=:".contains(letter);
    if shown.chars().all(is_plain) { shown } else { format!("'{}'", shown.replace('\'', r"'\''")) }
}

/// Returns a time in milliseconds with two significant digits, rounded up: for a line that somebody copies into a table.
pub(super) fn two_digits(nanoseconds: u64) -> String {
    two_digits_in(nanoseconds, Unit::Milliseconds)
}

/// The same in another unit.
pub(super) fn two_digits_in(nanoseconds: u64, of: Unit) -> String {
    let mut unit = 1_000_u64;
    while nanoseconds > unit.saturating_mul(99) {
        unit = unit.saturating_mul(10);
    }
    Time::from_nanos(nanoseconds.div_ceil(unit).saturating_mul(unit)).number_in(of)
}

/// Returns the line of a codel under `[wait]` of a table in this unit; `times` is 0 where it is not known how often it waits.
pub(super) fn wait_entry(codel: &str, wait: u64, times: u64, unit: Unit) -> String {
    let time = two_digits_in(wait, unit);
    match times {
        0 => format!("\"{codel}\" = {time}"),
        _ => format!("\"{codel}\" = {{ time = {time}, waits = {times} }}"),
    }
}

/// Says in which states a chain is intended to work, and what has to answer: `while the states are guidance.Steering, and if there is an
/// answer of sweep`.
pub(super) fn assumptions(states: &[&str], answers: &[&str]) -> String {
    let all = [("while the states are", states), ("if there is an answer of", answers)];
    let all = all.into_iter().filter(|(_, names)| !names.is_empty());
    all.map(|(what, names)| format!("{what} {}", names.join(", "))).collect::<Vec<_>>().join(", and ")
}

/// Returns a count with its noun: `1 file`, `2 files`, `no files`.
pub(super) fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}s"),
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    }
}

/// The letters of a cell: names may have tens of thousands, for which each row would have as many spaces.
const MOST_LETTERS: usize = 400;

/// The columns of a line where standard output is not a terminal.
const LINE: usize = 120;

/// Words of more letters than these may leave a table that is too wide: a figure has fewer, and in a column without a head, its bar.
const FEW_LETTERS: usize = 24;
const FEW_LETTERS_OF_NOTES: usize = 8;

/// Returns a text for people: what has no room in a line continues below it.
pub(super) fn wrapped(text: &str) -> String {
    // In a narrow terminal, the rows of tables are wider than it is, as their columns need so much.
    let most = Some(room().max(LINE));
    let line = |line: &str| match line.len() - line.trim_start_matches(' ').len() {
        0 => in_columns(line, most, ""),
        indentation => in_columns(line, most, &" ".repeat(indentation + 2)),
    };
    text.split_inclusive('\n').map(line).collect()
}

fn room() -> usize {
    terminal_columns().unwrap_or(LINE)
}

/// Formats a table: text is aligned to the left, numbers to the right. Words for which a line has no room are below their row.
pub(super) fn columns(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    wrapped(&columns_in(room(), header, rows))
}

fn columns_in(room: usize, header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let names = header.iter().map(|name| (*name).to_owned()).collect();
    let rows = std::iter::once(names).chain(rows);
    let rows = rows.map(|row: Vec<String>| row.iter().map(|cell| shortened(cell, MOST_LETTERS)).collect());
    let mut rows: Vec<Vec<String>> = rows.collect();
    let mut below = vec![Vec::new(); rows.len()];
    let widths = fitted(room, &mut rows, &mut below, header.len());
    let is_number = |cell: &str| cell.starts_with(|letter: char| letter.is_ascii_digit()) || cell == "—";
    // The head of a column may be a level, which is no number of it.
    let is_right =
        |column: usize| rows.iter().skip(1).any(|row| row.get(column).is_some_and(|it| is_number(it)));
    let right: Vec<bool> = (0..header.len()).map(is_right).collect();
    let mut out = String::new();
    for (row, below) in rows.iter().zip(below) {
        let mut line = String::from(" ");
        for ((cell, width), is_right) in row.iter().zip(&widths).zip(&right) {
            let gap = " ".repeat(width.saturating_sub(letters(cell)));
            line += &if *is_right { format!(" {gap}{cell} ") } else { format!(" {cell}{gap} ") };
        }
        out += line.trim_end();
        out.push('\n');
        out.extend(below.iter().map(|cell| format!("    {cell}\n")));
    }
    out
}

fn letters(cell: &str) -> usize {
    cell.chars().count()
}

/// Returns the widths of the columns of a table. While it is too wide, the long cells of a column go below their rows, then the ends
/// of the names; then the figures lose their per cent, then their bars.
fn fitted(room: usize, rows: &mut [Vec<String>], below: &mut [Vec<String>], columns: usize) -> Vec<usize> {
    let has_head: Vec<bool> = rows.first().into_iter().flatten().map(|head| !head.is_empty()).collect();
    let is_long = |column: usize, cell: &String| {
        let few = if has_head.get(column) == Some(&true) { FEW_LETTERS } else { FEW_LETTERS_OF_NOTES };
        cell.contains(' ') && letters(cell) > few
    };
    let is_bar = |cell: &String| cell.starts_with(['▰', '▱']);
    let mut has_long_names = true;
    loop {
        let cells = |column: usize| rows.iter().filter_map(move |row| row.get(column));
        let width = |column| cells(column).map(|cell| letters(cell)).max().unwrap_or_default();
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let excess = widths.iter().map(|width| width + 2).sum::<usize>().saturating_sub(room);
        if excess == 0 {
            return widths;
        }
        let long = (1..columns).filter(|column| cells(*column).any(|cell| is_long(*column, cell)));
        if let Some(column) = long.max_by_key(|column| width(*column)) {
            for (row, below) in rows.iter_mut().zip(&mut *below) {
                below.extend(row.get_mut(column).filter(|cell| is_long(column, cell)).map(std::mem::take));
            }
        } else if std::mem::take(&mut has_long_names) {
            let most = width(0).saturating_sub(excess).max(FEW_LETTERS);
            for (row, below) in rows.iter_mut().zip(&mut *below) {
                let name = row.first_mut().filter(|name| letters(name) > most);
                let lines = name.as_ref().map(|name| in_columns(name, Some(most), ""));
                if let Some((name, (start, end))) =
                    name.zip(lines.as_ref().and_then(|it| it.split_once('\n')))
                {
                    below.insert(0, end.replace('\n', " "));
                    *name = start.to_owned();
                }
            }
        } else if let Some(bars) = rows.iter().find_map(|row| row.iter().position(is_bar)) {
            let lost = if width(bars + 1) > 0 { bars + 1 } else { bars };
            rows.iter_mut().filter_map(|row| row.get_mut(lost)).for_each(String::clear);
        } else {
            return widths;
        }
    }
}

/// A table with a row for each item: its columns are listed once, for people and for programs.
pub(super) struct Sheet<'a, T> {
    items: &'a [T],
    heads: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl<'a, T> Sheet<'a, T> {
    pub(super) fn of(items: &'a [T]) -> Self {
        Sheet { items, heads: Vec::new(), rows: items.iter().map(|_| Vec::new()).collect() }
    }

    /// Adds a column: its head, and its cell of an item.
    pub(super) fn column(mut self, head: impl Into<String>, cell: impl FnMut(&T) -> String) -> Self {
        self.heads.push(head.into());
        self.rows.iter_mut().zip(self.items.iter().map(cell)).for_each(|(row, cell)| row.push(cell));
        self
    }

    /// Adds a column that is not always shown.
    pub(super) fn column_if(
        self,
        is_shown: bool,
        head: impl Into<String>,
        cell: impl FnMut(&T) -> String,
    ) -> Self {
        if is_shown { self.column(head, cell) } else { self }
    }

    /// Returns the table for people.
    pub(super) fn text(self) -> String {
        columns(&self.heads.iter().map(String::as_str).collect::<Vec<_>>(), self.rows)
    }

    /// Returns the table as CSV.
    pub(super) fn csv(self) -> String {
        let line =
            |row: &Vec<String>| row.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n";
        std::iter::once(&self.heads).chain(&self.rows).map(line).collect()
    }
}

/// Returns a time in ms.
pub(super) fn number(time: Option<Time>) -> String {
    time.map_or_else(|| "—".to_owned(), Time::number)
}

/// Returns a time in ms as a cell of CSV.
pub(super) fn csv_number(time: Option<Time>) -> String {
    time.map(Time::number).unwrap_or_default()
}

/// Returns a cell of CSV, in quotes if it needs them.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// Returns a time with four digits, in the unit that fits: `1.235 ms`.
pub(super) fn duration(nanoseconds: u64) -> String {
    let (scale, unit) = match nanoseconds {
        0..1_000 => return format!("{nanoseconds} ns"),
        1_000..1_000_000 => (1e3, "µs"),
        1_000_000..1_000_000_000 => (1e6, "ms"),
        _ => (1e9, "s"),
    };
    let value = nanoseconds as f64 / scale;
    let decimals = match value {
        ..9.9995 => 3,
        ..99.995 => 2,
        ..999.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$} {unit}")
}

#[cfg(test)]
mod tests {
    use mauve_timing::Rounding;

    use super::*;

    #[test]
    fn a_path_is_one_argument() {
        let of = |path: &str| argument(Path::new(path));
        assert_eq!(of("../robot-1/é.mal"), "../robot-1/é.mal");
        assert_eq!((of("my robot"), of("it's")), ("'my robot'".to_owned(), r"'it'\''s'".to_owned()));
        assert_eq!((of("~x"), of("$(a)")), ("'~x'".to_owned(), "'$(a)'".to_owned()));
    }

    #[test]
    fn a_narrow_table_shows_less_of_a_figure() {
        let row = |cells: [&str; 5]| cells.map(str::to_owned).to_vec();
        let rows =
            [row(["a", "✓ 53 / 100 ms", "▰▰▰▱▱▱", "53 %", "accepted: x"]), row(["b", "–", "", "", ""])];
        let of = |room| columns_in(room, &["", "response", "", "", ""], rows.iter().cloned());
        let first = |room| of(room).lines().nth(1).unwrap_or_default().to_owned();
        assert_eq!(first(80), "  a  ✓ 53 / 100 ms  ▰▰▰▱▱▱  53 %  accepted: x");
        assert_eq!(of(40), "     response\n  a  ✓ 53 / 100 ms  ▰▰▰▱▱▱  53 %\n    accepted: x\n  b  –\n");
        assert_eq!(first(32), "  a  ✓ 53 / 100 ms  ▰▰▰▱▱▱");
        assert_eq!(first(20), "  a  ✓ 53 / 100 ms");
    }

    #[test]
    fn suggested_times_are_not_shorter_than_observed_ones() {
        for (nanoseconds, text) in
            [(1, "0.001"), (8_060_000, "8.1"), (8_100_000, "8.1"), (99_001, "0.1"), (123_456_789, "130")]
        {
            assert_eq!(two_digits(nanoseconds), text);
        }
        for nanoseconds in (1..u64::MAX / 11).step_by(usize::MAX / 1000) {
            let time = Time::parse(&two_digits(nanoseconds), Unit::Milliseconds, Rounding::Up);
            assert!(time.is_ok_and(|time| time.as_nanos() >= nanoseconds), "{nanoseconds}");
        }
    }
}
