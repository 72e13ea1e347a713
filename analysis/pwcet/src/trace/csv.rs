//! Files of executions and of periods in comma-separated values, one on a line, in the order of time:
//!
//! ```text
//! codel,execution_ns,instance,elapsed_ns,time_ns
//! nav.plan,1000,pilot,1200,5000000
//! nav.Pilot/Moving.run,3000,pilot,,
//! ```
//!
//! ```text
//! instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpus,cpu
//! pilot,4990000,4990100,5000100,3500,2,1,0
//! ```
//!
//! The header names the columns. A file of executions requires `codel` and `execution_ns`, and may have `instance`, `elapsed_ns` and
//! `time_ns` (when the execution ended). A file of periods requires `instance`, `begin_ns`, `end_ns` and `execution_ns`, and may
//! have `release_ns`, `priority`, `cpus` (a bit for each that the thread might use) and `cpu` (the number of the one where the period
//! began). Other columns are ignored. A field may be quoted, and may not have a line break. A value that cannot be read is an error
//! and not skipped: it could be the greatest one. A last line without its line feed is incomplete: it is counted, and not used.
//!
//! A file of executions may also have `waits` (how often the thread of a codel gave up the CPU by its own will, other than to wait for
//! a lock that the recording has) and `blocked_ns` (for how long it waited for such locks). A line with the key `(access) PORT` is an
//! access of a port; one with the key `(lock NAME) CODEL`, a time for which the codel held the lock; one with the key `(work) THREAD`
//! says how much CPU time threads of this name used within the elapsed time, which are not those of instances. `status` says what an
//! access (`no_data`, `old_data`, `new_data`; `written`, `lost`, `unconnected`) or a codel (`true`, `false`) came to, and `number`
//! which of the values that the port has written was read or written.
//!
//! A line of executions with the key `(lost)` says how many executions and periods the recorder has lost, in `execution_ns`, and when;
//! one with the key `(from tables)`, that the execution times are those of timing tables, and nothing was measured; one with the key
//! `(build) COMPILER FLAGS`, how the program was built.
//!
//! The periods of a recording contain its executions. The column `order` numbers the lines of both files, each of which is in this
//! order; without it, the times of the ends say the order.

use std::io::Read;
use std::ops::ControlFlow;

use super::column::{COLUMNS, Column, FileKind};
use super::error::{CsvProblem, TraceError};
use super::event::number;
use super::lines::TraceLines;
use super::names::{NameId, SpanKind, SpanName, SpanNames};
use super::{Outcome, Progress, Scheduling, Span, Totals, Visitor, is_suspicious};

/// Reads a file of executions to its end, and beside it that of the periods, in one order.
pub(super) fn read<R: Read>(
    executions: R,
    periods: Option<R>,
    size: Option<u64>,
    names: &mut SpanNames,
    summary: &mut Totals,
    visitor: &mut dyn Visitor,
) -> Result<(), TraceError> {
    let mut executions = Rows::of(executions, FileKind::Executions)?;
    let mut periods = periods.map(|it| Rows::of(it, FileKind::Periods)).transpose()?;
    let (mut execution, mut period) = (None, None);
    loop {
        executions.report(size, summary, visitor)?;
        if execution.is_none() {
            execution = executions.next(names, summary)?;
        }
        if let (None, Some(periods)) = (&period, &mut periods) {
            period = periods.next(names, summary)?;
        }
        let row =
            if is_before(period.as_ref(), execution.as_ref()) { period.take() } else { execution.take() };
        let Some(row) = row else { return Ok(()) };
        if row.report(names, visitor).is_break() {
            return Err(TraceError::Stopped);
        }
    }
}

/// Returns whether a period comes before an execution.
fn is_before(period: Option<&CsvRow>, execution: Option<&CsvRow>) -> bool {
    let Some(period) = period else { return false };
    let Some(execution) = execution else { return true };
    match execution.order.zip(period.order) {
        Some((execution, period)) => period < execution,
        // An execution whose time is unknown comes first.
        None => execution.span.end.is_some_and(|end| period.span.end.is_none_or(|period| period < end)),
    }
}

/// A line.
struct CsvRow {
    span: Span,
    /// Its number among the lines of both files.
    order: Option<u64>,
}

/// What a line says.
enum RowKind<'a> {
    /// Something happened.
    Span,
    /// Something is missing.
    Loss,
    /// The execution times are not measured.
    FromTables,
    /// Threads of this name, which are not those of instances, used CPU time.
    Work(&'a str),
    /// The program was built so.
    Build(&'a str),
}

impl RowKind<'_> {
    /// No codel has parentheses in its name.
    fn of(key: &str) -> RowKind<'_> {
        if !key.starts_with('(') {
            return RowKind::Span;
        }
        match key.split_once(") ").unwrap_or((key, "")) {
            ("(lost)", "") => RowKind::Loss,
            ("(from tables)", "") => RowKind::FromTables,
            ("(work", thread) => RowKind::Work(thread),
            ("(build", build) => RowKind::Build(build),
            _ => RowKind::Span,
        }
    }
}

impl CsvRow {
    fn report(&self, names: &SpanNames, visitor: &mut dyn Visitor) -> ControlFlow<()> {
        let span = &self.span;
        match RowKind::of(&names.get(span.name).key) {
            RowKind::Span => return visitor.span(span, names),
            RowKind::Loss => visitor.lost(span.begin.unwrap_or(0), span.end.unwrap_or(u64::MAX)),
            RowKind::FromTables => return visitor.times_are_from_tables(),
            RowKind::Build(build) => visitor.built(build),
            RowKind::Work(thread) => visitor.work(thread, span.execution, span.elapsed.unwrap_or(0)),
        }
        ControlFlow::Continue(())
    }
}

/// The lines of a file, one by one.
struct Rows<R> {
    lines: TraceLines<R>,
    kind: FileKind,
    /// What each field of a line is; none of a column that is ignored.
    columns: Vec<Option<Column>>,
    values: CsvValues,
    /// For each name, the last end, and the last one that was before it.
    ends: Vec<(u64, u64)>,
    /// What is reused for the name of each line.
    name: Vec<u8>,
}

impl<R: Read> Rows<R> {
    fn of(source: R, kind: FileKind) -> Result<Rows<R>, TraceError> {
        let mut lines = TraceLines::new(source);
        let header = match lines.advance() {
            Ok(true) => {
                columns(lines.line(), kind).map_err(|problem| foreign(lines.line()).unwrap_or(problem))
            }
            Ok(false) => Err(CsvProblem::NoHeader),
            // A file with other line ends is one long line.
            Err(TraceError::LongLine(line)) => Err(foreign(lines.line()).ok_or(TraceError::LongLine(line))?),
            Err(error) => return Err(error),
        };
        let columns = header.map_err(|problem| TraceError::Csv { file: kind, line: 1, problem })?;
        let (ends, name) = (Vec::new(), Vec::new());
        Ok(Rows { lines, kind, columns, values: CsvValues::default(), ends, name })
    }

    fn next(&mut self, names: &mut SpanNames, summary: &mut Totals) -> Result<Option<CsvRow>, TraceError> {
        while self.lines.advance()? {
            if !self.lines.is_complete() {
                // A cut number is another number, and a smaller one: `12` of `120000`.
                summary.cuts += 1;
            } else if !without_return(self.lines.line()).is_empty() {
                return self.row(names, summary).map(Some);
            }
        }
        Ok(None)
    }

    /// Reads the line that was read last.
    fn row(&mut self, names: &mut SpanNames, summary: &mut Totals) -> Result<CsvRow, TraceError> {
        let (file, line) = (self.kind, self.lines.number());
        let problem = |problem| TraceError::Csv { file, line, problem };
        self.values.read(without_return(self.lines.line()), &self.columns).map_err(problem)?;
        let said = match file {
            FileKind::Executions => self.values.execution(),
            FileKind::Periods => self.values.period(),
        };
        let (key, instance, mut span) = said.map_err(problem)?;
        let line_order = self.values.time(Column::Order).map_err(problem)?;
        self.name.clear();
        self.name.extend_from_slice(key);
        // No text in UTF-8 has this byte.
        self.name.push(0xff);
        self.name.extend_from_slice(instance);
        span.name = names.of_text(&self.name, || name_of(file, key, instance).map_err(problem))?;
        if span.end.is_some_and(|end| runs_back(&mut self.ends, span.name, end)) {
            // The execution counts, and its place in time is unknown.
            summary.clock_errors += 1;
            span.end = None;
        }
        match RowKind::of(&names.get(span.name).key) {
            RowKind::Span => {
                summary.events += 1;
                summary.spans += 1;
                let is_suspicious =
                    span.elapsed.is_some_and(|elapsed| is_suspicious(span.execution, elapsed));
                summary.suspicious += u64::from(is_suspicious);
            }
            RowKind::Loss => {
                summary.losses += 1;
                summary.lost_events = summary.lost_events.saturating_add(span.execution);
            }
            RowKind::FromTables => summary.is_from_tables = true,
            RowKind::Work(_) | RowKind::Build(_) => {}
        }
        summary.at(span.end);
        span.begin = span.end.zip(span.elapsed).and_then(|(end, elapsed)| end.checked_sub(elapsed));
        Ok(CsvRow { span, order: line_order })
    }

    /// Reports the progress now and then.
    fn report(
        &self,
        size: Option<u64>,
        summary: &Totals,
        visitor: &mut dyn Visitor,
    ) -> Result<(), TraceError> {
        if !self.lines.number().is_multiple_of(1 << 16) {
            return Ok(());
        }
        let done = self.lines.bytes();
        let progress = Progress { events: summary.events, bytes: size.map(|size| (done, size)) };
        if visitor.progress(progress).is_break() { Err(TraceError::Stopped) } else { Ok(()) }
    }
}

/// Returns what a file is whose first line is no header.
fn foreign(begin: &[u8]) -> Option<CsvProblem> {
    let has = |byte: u8| begin.contains(&byte);
    match begin {
        [0x1f, 0x8b, ..] => Some(CsvProblem::Compressed),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some(CsvProblem::Utf16),
        // UTF-16 without a mark: every second byte of English is 0.
        [0, _, ..] | [_, 0, ..] => Some(CsvProblem::Utf16),
        _ if begin.strip_suffix(b"\r").unwrap_or(begin).contains(&b'\r') => Some(CsvProblem::CarriageReturns),
        _ if has(b';') && !has(b',') => Some(CsvProblem::Separator(';')),
        _ if has(b'\t') && !has(b',') => Some(CsvProblem::Separator('\t')),
        _ => None,
    }
}

/// Reads the header.
fn columns(line: &[u8], kind: FileKind) -> Result<Vec<Option<Column>>, CsvProblem> {
    let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
    let mut columns = Vec::new();
    let mut rest = Some(without_return(line));
    let mut text = Vec::new();
    while let Some(field) = rest {
        rest = take_field(field, &mut text).ok_or(CsvProblem::Quotes)?;
        let known = Column::NAMES.iter().find(|(_, name)| name.as_bytes() == text.trim_ascii());
        let known = known.map(|(column, _)| *column);
        if let Some(column) = known.filter(|_| columns.contains(&known)) {
            return Err(CsvProblem::RepeatedColumn(column));
        }
        columns.push(known);
    }
    match kind.required().iter().find(|column| !columns.contains(&Some(**column))) {
        Some(column) => Err(CsvProblem::MissingColumn(*column)),
        None => Ok(columns),
    }
}

/// Reads a name that is new.
fn name_of(file: FileKind, key: &[u8], instance: &[u8]) -> Result<SpanName, CsvProblem> {
    let utf8 = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).map_err(|_| CsvProblem::NotUtf8);
    let key = utf8(key)?;
    let kind = match file {
        FileKind::Periods => SpanKind::Period,
        FileKind::Executions => SpanKind::of(&key),
    };
    Ok(SpanName { kind, key, instance: utf8(instance)? })
}

/// Returns whether the last execution of a name ended later. If two in a row did, in their order, the last one was wrong.
fn runs_back(ends: &mut Vec<(u64, u64)>, name: NameId, time: u64) -> bool {
    // An import has millions of executions: the ends are by number, as the names are.
    let index = name.0 as usize;
    if ends.len() <= index {
        ends.resize(index + 1, (0, 0));
    }
    let Some((last, back)) = ends.get_mut(index) else { return true };
    let follows = *last <= time || (*back > 0 && *back <= time);
    *back = if follows { 0 } else { time };
    if follows {
        *last = time;
    }
    !follows
}

/// The values of a line by their columns; reused from line to line.
#[derive(Debug, Default)]
struct CsvValues {
    of: [Vec<u8>; COLUMNS],
    ignored: Vec<u8>,
}

impl CsvValues {
    fn read(&mut self, line: &[u8], columns: &[Option<Column>]) -> Result<(), CsvProblem> {
        let mut rest = Some(line);
        let mut found = 0;
        while let Some(field) = rest {
            let column = columns.get(found).copied().flatten();
            let place = column.and_then(|column| self.of.get_mut(column as usize));
            rest = take_field(field, place.unwrap_or(&mut self.ignored)).ok_or(CsvProblem::Quotes)?;
            found += 1;
        }
        match columns.len() {
            expected if expected == found => Ok(()),
            expected => Err(CsvProblem::Fields { expected, found }),
        }
    }

    fn execution(&self) -> Result<LineContent<'_>, CsvProblem> {
        let key = self.name(Column::Codel)?;
        let span = Span {
            execution: self.required(Column::Execution)?,
            elapsed: self.time(Column::Elapsed)?,
            end: self.time(Column::Time)?,
            waits: self.time(Column::Waits)?,
            blocked: self.time(Column::Blocked)?.unwrap_or(0),
            // Other programs may have other columns of these names.
            outcome: Outcome::of_name(self.text(Column::Status)),
            number: number(self.text(Column::Number)),
            ..Span::default()
        };
        Ok((key, self.text(Column::Instance), span))
    }

    fn period(&self) -> Result<LineContent<'_>, CsvProblem> {
        let execution = self.required(Column::Execution)?;
        let instance = self.name(Column::Instance)?;
        let (begun, end) = (self.required(Column::Begin)?, self.required(Column::End)?);
        let elapsed = end.checked_sub(begun).ok_or(CsvProblem::AfterEnd(Column::Begin))?;
        let release = self.time(Column::Release)?;
        if release.is_some_and(|release| release > end) {
            return Err(CsvProblem::AfterEnd(Column::Release));
        }
        let cpus = self.time(Column::Cpus)?.unwrap_or_default();
        let priority = self.small(Column::Priority)?;
        let span = Span {
            execution,
            elapsed: Some(elapsed),
            end: Some(end),
            release,
            scheduling: priority.map(|priority| Scheduling { priority, cpus }),
            cpu: self.small(Column::Cpu)?,
            overhead: self.time(Column::Overhead)?,
            ..Span::default()
        };
        Ok((b"", instance, span))
    }

    /// Returns a value without the spaces around it; empty where the file has none.
    fn text(&self, column: Column) -> &[u8] {
        self.of.get(column as usize).map_or(b"", |text| text.trim_ascii())
    }

    /// Reads a name, which may not be empty.
    fn name(&self, column: Column) -> Result<&[u8], CsvProblem> {
        Some(self.text(column)).filter(|text| !text.is_empty()).ok_or(CsvProblem::Missing(column))
    }

    /// Reads a time that may not be missing.
    fn required(&self, column: Column) -> Result<u64, CsvProblem> {
        self.time(column)?.ok_or(CsvProblem::Missing(column))
    }

    /// Reads a number of 32 bits.
    fn small(&self, column: Column) -> Result<Option<u32>, CsvProblem> {
        let small =
            |number: u64| u32::try_from(number).map_err(|_| CsvProblem::Number(column, number.to_string()));
        self.time(column)?.map(small).transpose()
    }

    /// Reads a time in nanoseconds; none if the field is empty or missing.
    fn time(&self, column: Column) -> Result<Option<u64>, CsvProblem> {
        let text = self.text(column);
        if text.is_empty() {
            return Ok(None);
        }
        // Times are added and subtracted as signed numbers elsewhere; 292 years are enough.
        match number(text).filter(|time| i64::try_from(*time).is_ok()) {
            Some(time) => Ok(Some(time)),
            None => {
                let text = text.get(..text.len().min(40)).unwrap_or_default();
                Err(CsvProblem::Number(column, String::from_utf8_lossy(text).into_owned()))
            }
        }
    }
}

/// What a line says: a key, which a period has not, an instance, and an execution without its name and its begin.
type LineContent<'a> = (&'a [u8], &'a [u8], Span);

fn without_return(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// Puts the first field of a line into `text`. Returns what follows its comma, `Some(None)` at the end of the line; `None` if quotes
/// do not match.
fn take_field<'a>(line: &'a [u8], text: &mut Vec<u8>) -> Option<Option<&'a [u8]>> {
    text.clear();
    let Some(mut rest) = line.strip_prefix(b"\"") else {
        let end = line.iter().position(|byte| *byte == b',');
        text.extend_from_slice(line.get(..end.unwrap_or(line.len()))?);
        return Some(end.and_then(|comma| line.get(comma + 1..)));
    };
    loop {
        let quote = rest.iter().position(|byte| *byte == b'"')?;
        text.extend_from_slice(rest.get(..quote)?);
        rest = rest.get(quote + 1..)?;
        match rest.split_first() {
            None => return Some(None),
            Some((b',', rest)) => return Some(Some(rest)),
            Some((b'"', after)) => {
                text.push(b'"');
                rest = after;
            }
            Some(_) => return None,
        }
    }
}

#[cfg(test)]
mod tests {

    use proptest::prelude::*;

    use super::super::TraceReader;
    use super::*;

    /// An execution: key, instance, execution time, elapsed time, begin, end.
    type Execution = (String, String, u64, Option<u64>, Option<u64>, Option<u64>);

    #[derive(Default)]
    struct Found(Vec<Execution>);

    impl Visitor for Found {
        fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
            let name = names.get(span.name);
            assert_eq!(name.kind == SpanKind::Program, name.key.contains('/'));
            let (key, instance) = (name.key.clone(), name.instance.clone());
            self.0.push((key, instance, span.execution, span.elapsed, span.begin, span.end));
            ControlFlow::Continue(())
        }
    }

    fn rows(text: &[u8]) -> Result<(Vec<Execution>, Totals), TraceError> {
        let (mut reader, mut rows) = (TraceReader::default(), Found::default());
        reader.read_csv(text, Some(text.len() as u64), &mut rows)?;
        Ok((rows.0, reader.finish()))
    }

    fn problem(text: &str) -> (u64, CsvProblem) {
        match rows(text.as_bytes()) {
            Err(TraceError::Csv { line, problem, .. }) => (line, problem),
            other => panic!("{text}: {other:?}"),
        }
    }

    fn row(key: &str, instance: &str, execution: u64, times: [Option<u64>; 3]) -> Execution {
        (key.to_owned(), instance.to_owned(), execution, times[0], times[1], times[2])
    }

    #[test]
    fn the_file_of_the_runtime() {
        let text = "codel,execution_ns,instance,elapsed_ns,time_ns\nf,10,a,12,100\nC/S.run,20,b,30,90\nf,11,a,12,120\n";
        let (found, summary) = rows(text.as_bytes()).unwrap();
        assert_eq!(
            found,
            [
                row("f", "a", 10, [Some(12), Some(88), Some(100)]),
                row("C/S.run", "b", 20, [Some(30), Some(60), Some(90)]),
                row("f", "a", 11, [Some(12), Some(108), Some(120)]),
            ]
        );
        let expected = Totals { events: 3, spans: 3, first: Some(100), last: Some(120), ..Totals::default() };
        assert_eq!(summary, expected);
    }

    #[test]
    fn columns_in_any_order_quotes_and_line_ends() {
        let text = "\u{feff}x,\"execution_ns\", codel\r\n1,5,\"a\"\"b,c\"\r\n\r\n,6,d\n";
        let none = [None; 3];
        assert_eq!(rows(text.as_bytes()).unwrap().0, [row("a\"b,c", "", 5, none), row("d", "", 6, none)]);
    }

    /// Wherever a power failure cuts a file, the values are those of complete lines.
    #[test]
    fn a_cut_line_is_not_used() {
        let text = "codel,execution_ns,time_ns\nf,1234567,10\ng,98765432,200\n";
        let header = text.find('\n').unwrap() + 1;
        let first = header + "f,1234567,10\n".len();
        for end in header..=text.len() {
            let (found, summary) = rows(&text.as_bytes()[..end]).unwrap();
            let lines = text[header..end].matches('\n').count();
            assert_eq!((found.len(), summary.spans), (lines, lines as u64), "{end}");
            assert!(found.iter().all(|it| it.2 == 1_234_567 || it.2 == 98_765_432), "{found:?}");
            assert_eq!(summary.cuts, u64::from(![header, first, text.len()].contains(&end)), "{end}");
        }
    }

    #[test]
    fn lines_that_are_not_in_order_have_no_time() {
        let text = "codel,execution_ns,elapsed_ns,time_ns\nf,1,1,100\nf,2,1,50\nf,3000000,1,101\n";
        let (found, summary) = rows(text.as_bytes()).unwrap();
        assert_eq!(found[1], row("f", "", 2, [Some(1), None, None]));
        assert_eq!((summary.clock_errors, summary.suspicious, summary.spans), (1, 1, 3));
    }

    #[test]
    fn errors_have_their_lines() {
        use Column::{Codel, Elapsed, Execution};
        let number = |column, text: &str| CsvProblem::Number(column, text.to_owned());
        for (text, expected) in [
            ("", (1, CsvProblem::NoHeader)),
            ("\n", (1, CsvProblem::MissingColumn(Codel))),
            ("codel\nf\n", (1, CsvProblem::MissingColumn(Execution))),
            ("codel,execution_ns,codel\n", (1, CsvProblem::RepeatedColumn(Codel))),
            ("codel,execution_ns\nf,1\nf,\n", (3, CsvProblem::Missing(Execution))),
            ("codel,execution_ns\nf,1\nf\n", (3, CsvProblem::Fields { expected: 2, found: 1 })),
            ("codel,execution_ns\nf,1,032,411\n", (2, CsvProblem::Fields { expected: 2, found: 4 })),
            ("codel,execution_ns\n,1\n", (2, CsvProblem::Missing(Codel))),
            ("codel,execution_ns\nf,NaN\n", (2, number(Execution, "NaN"))),
            ("codel,execution_ns\nf,-1\n", (2, number(Execution, "-1"))),
            ("codel,execution_ns\nf,1.5\n", (2, number(Execution, "1.5"))),
            ("codel,execution_ns\nf,18446744073709551616\n", (2, number(Execution, "18446744073709551616"))),
            ("codel,execution_ns\nf,9223372036854775808\n", (2, number(Execution, "9223372036854775808"))),
            ("codel,execution_ns,elapsed_ns\nf,1,x\n", (2, number(Elapsed, "x"))),
            ("codel,execution_ns\n\"f,1\n", (2, CsvProblem::Quotes)),
            ("codel,execution_ns\n\"f\"x,1\n", (2, CsvProblem::Quotes)),
        ] {
            assert_eq!(problem(text), expected, "{text}");
        }
        for (text, expected) in [
            (&b"\x1f\x8b\x08\x00\n"[..], CsvProblem::Compressed),
            (b"\xff\xfec\0o\0d\0e\0l\0,\0\n\0", CsvProblem::Utf16),
            (b"\xfe\xff\0c\0o\0,\0\n", CsvProblem::Utf16),
            (b"c\0o\0d\0e\0l\0,\0\n\0", CsvProblem::Utf16),
            (b"codel,execution_ns\rf,1\rf,2\r", CsvProblem::CarriageReturns),
            (b"codel;execution_ns\nf;1\n", CsvProblem::Separator(';')),
            (b"codel\texecution_ns\nf\t1\n", CsvProblem::Separator('\t')),
        ] {
            let found = rows(text);
            assert!(
                matches!(&found, Err(TraceError::Csv { line: 1, problem, .. }) if *problem == expected),
                "{found:?}"
            );
        }
        // Longer than a line may be.
        let returns = format!("codel,execution_ns\r{}", "f,1000\r".repeat(20_000));
        assert_eq!(problem(&returns), (1, CsvProblem::CarriageReturns));
        let not_utf8 = rows(b"codel,execution_ns\n\xff,1\n");
        assert!(matches!(not_utf8, Err(TraceError::Csv { line: 2, problem: CsvProblem::NotUtf8, .. })));
    }

    #[test]
    fn periods_have_an_order_in_time() {
        use Column::{Begin, Cpu, Priority, Release};
        let order = CsvProblem::AfterEnd;
        let number = |column| CsvProblem::Number(column, "4294967296".to_owned());
        for (line, expected) in [
            ("a,1,10,9,5,3,0", order(Begin)),
            ("a,12,5,9,5,3,0", order(Release)),
            ("a,1,5,9,5,4294967296,0", number(Priority)),
            ("a,1,5,9,5,3,4294967296", number(Cpu)),
        ] {
            let text = format!("instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpu\n{line}\n");
            let (mut names, mut summary) = (SpanNames::default(), Totals::default());
            let executions = &b"codel,execution_ns\n"[..];
            let found = read(
                executions,
                Some(text.as_bytes()),
                None,
                &mut names,
                &mut summary,
                &mut Found::default(),
            );
            assert!(
                matches!(found, Err(TraceError::Csv { line: 2, problem, .. }) if problem == expected),
                "{line}"
            );
        }
    }

    #[test]
    fn lost_executions_are_counted_and_are_none() {
        let (found, summary) =
            rows(b"codel,execution_ns,elapsed_ns,time_ns\nf,1,1,100\n(lost),7,50,200\nf,2,1,300\n").unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!((summary.losses, summary.lost_events, summary.spans), (1, 7, 2));
    }

    #[test]
    fn times_from_tables_are_said_to_be_so() {
        let text = "codel,execution_ns,time_ns\n(from tables),0,\nf,1,100\n";
        let (found, summary) = rows(text.as_bytes()).unwrap();
        assert_eq!((found.len(), summary.spans, summary.events), (1, 1, 1));
        assert_eq!((summary.is_from_tables, summary.first), (true, Some(100)));
    }

    /// One time that is much too late does not take the times of all later lines.
    #[test]
    fn one_wrong_time_is_one_error() {
        let times = [100, 200, i64::MAX as u64, 300, 400, 500];
        let lines = times.map(|time| format!("f,1,{time}\n")).concat();
        let (found, summary) = rows(format!("codel,execution_ns,time_ns\n{lines}").as_bytes()).unwrap();
        assert_eq!((found.iter().filter(|it| it.5.is_some()).count(), summary.clock_errors), (5, 1));
    }

    /// The names, releases and schedulings of spans.
    #[derive(Default)]
    struct Both(Vec<(String, Option<u64>, Option<Scheduling>)>);

    impl Visitor for Both {
        fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
            let name = names.get(span.name);
            let key = if name.kind == SpanKind::Period { &name.instance } else { &name.key };
            self.0.push((key.clone(), span.release, span.scheduling));
            ControlFlow::Continue(())
        }
    }

    fn both(executions: &str, periods: &str) -> Vec<(String, Option<u64>, Option<Scheduling>)> {
        let (mut names, mut summary, mut found) = (SpanNames::default(), Totals::default(), Both::default());
        let (executions, periods) = (executions.as_bytes(), periods.as_bytes());
        read(executions, Some(periods), None, &mut names, &mut summary, &mut found).unwrap();
        assert_eq!(summary.spans, found.0.len() as u64);
        found.0
    }

    #[test]
    fn periods_follow_their_executions() {
        let periods = "instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpus,cpu,order\na,1,2,9,5,3,6,0,2\nb,1,,9,5,,,,4\n";
        let periods = periods.replace("b,1,,", "b,1,2,");
        let executions = "codel,execution_ns,time_ns,order\nf,1,10,0\ng,1,9,1\nh,1,9,3\n";
        let scheduling = Some(Scheduling { priority: 3, cpus: 6 });
        let execution = |key: &str| (key.to_owned(), None, None);
        let first = ("a".to_owned(), Some(1), scheduling);
        let second = ("b".to_owned(), Some(1), None);
        assert_eq!(
            both(executions, &periods),
            [execution("f"), execution("g"), first, execution("h"), second]
        );
        // Without numbers, the times of the ends say the order.
        let periods = "instance,begin_ns,end_ns,execution_ns\na,2,9,5\nb,2,12,5\n";
        let executions = "codel,execution_ns,time_ns\nf,1,5\ng,1,9\nh,1,10\n";
        let period = |key: &str| (key.to_owned(), None, None);
        assert_eq!(
            both(executions, periods),
            [execution("f"), execution("g"), period("a"), execution("h"), period("b")]
        );
    }

    proptest! {
        #[test]
        fn any_text_is_read_without_a_panic(
            lines in "([a,\"\r\n0-9/.-]|codel|execution_ns|,|\n){0,60}",
        ) {
            let _ = rows(lines.as_bytes());
            let _ = rows(format!("codel,execution_ns,time_ns\n{lines}").as_bytes());
        }

        #[test]
        fn values_are_those_that_were_written(
            values in proptest::collection::vec((0_usize..3, 0..u64::MAX / 2), 0..20),
        ) {
            let keys = ["f", "g,\"h\"", "C/u"];
            let mut text = "execution_ns,codel\n".to_owned();
            for (key, value) in &values {
                text += &format!("{value},\"{}\"\n", keys[*key].replace('"', "\"\""));
            }
            let expected = values.iter().map(|(key, value)| row(keys[*key], "", *value, [None; 3]));
            prop_assert_eq!(rows(text.as_bytes()).unwrap().0, expected.collect::<Vec<Execution>>());
        }
    }
}
