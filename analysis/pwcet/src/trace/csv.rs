//! A file of executions in comma-separated values, one execution on a line, in the order of time:
//!
//! ```text
//! codel,execution_ns,instance,elapsed_ns,time_ns
//! nav.plan,1000,pilot,1200,5000000
//! nav.Pilot/Moving.run,3000,pilot,,
//! ```
//!
//! The header names the columns: `codel` and `execution_ns`, which are required, and `instance`, `elapsed_ns` and `time_ns` (when
//! the execution ended). Other columns are ignored. A field may be quoted, and may not have a line break. A value that cannot be
//! read is an error and not skipped: it could be the greatest one.

use std::io::Read;

use super::event::number;
use super::lines::{LineError, Lines};
use super::names::{Name, NameId, Names, SpanKind};
use super::{CsvProblem, Progress, Span, Summary, TraceError, Visitor, is_suspicious};

/// A column that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// `codel`: the key of a codel or of a program in a timing table.
    Codel,
    /// `execution_ns`: the CPU time of the execution.
    Execution,
    /// `instance`: the instance that executed it.
    Instance,
    /// `elapsed_ns`: the time from the begin to the end.
    Elapsed,
    /// `time_ns`: the time of the end.
    Time,
}

impl Column {
    /// All columns.
    pub const ALL: [Column; 5] =
        [Column::Codel, Column::Execution, Column::Instance, Column::Elapsed, Column::Time];

    /// Returns the name in the header.
    pub fn name(self) -> &'static str {
        match self {
            Column::Codel => "codel",
            Column::Execution => "execution_ns",
            Column::Instance => "instance",
            Column::Elapsed => "elapsed_ns",
            Column::Time => "time_ns",
        }
    }
}

/// The columns, and the last end of each series.
#[derive(Debug)]
pub(super) struct Csv {
    /// The index of each of [`Column::ALL`].
    columns: [Option<usize>; 5],
    ends: Vec<u64>,
    /// What is reused for the name of each line.
    name: Vec<u8>,
    order: u64,
}

/// Reads a file to its end.
pub(super) fn read<R: Read>(
    source: R,
    size: Option<u64>,
    names: &mut Names,
    summary: &mut Summary,
    visitor: &mut dyn Visitor,
) -> Result<(), TraceError> {
    let mut lines = Lines::new(source);
    let error = |error: LineError| match error {
        LineError::Io(error) => TraceError::Reading(error),
        LineError::Long(line) => TraceError::LongLine(line),
    };
    let Some(header) = lines.next().map_err(error)? else {
        return Err(TraceError::Csv { line: 1, problem: CsvProblem::NoHeader });
    };
    let mut csv = Csv::of_header(header).map_err(|problem| TraceError::Csv { line: 1, problem })?;
    let mut scratch = Scratch::default();
    loop {
        let done = lines.bytes();
        if lines.number().is_multiple_of(1 << 16)
            && visitor
                .progress(Progress { events: summary.events, bytes: size.map(|size| (done, size)) })
                .is_break()
        {
            return Err(TraceError::Stopped);
        }
        let number = lines.number() + 1;
        let Some(line) = lines.next().map_err(error)? else { return Ok(()) };
        if let Some(span) = csv.line(line, number, &mut scratch, names, summary)?
            && visitor.span(&span, names).is_break()
        {
            return Err(TraceError::Stopped);
        }
    }
}

/// What is reused from line to line.
#[derive(Debug, Default)]
struct Scratch {
    /// The fields of [`Column::ALL`], one after the other.
    text: Vec<u8>,
    /// Where each of them is.
    fields: [Option<(usize, usize)>; 5],
}

impl Scratch {
    fn field(&self, column: Column) -> Option<&[u8]> {
        let (begin, end) = (*self.fields.get(column as usize)?)?;
        self.text.get(begin..end)
    }
}

impl Csv {
    fn of_header(line: &[u8]) -> Result<Csv, CsvProblem> {
        let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
        let mut columns = [None; 5];
        let mut rest = Some(without_return(line));
        let mut index = 0;
        let mut text = Vec::new();
        while let Some(field) = rest {
            text.clear();
            rest = take_field(field, Some(&mut text)).ok_or(CsvProblem::Quotes)?;
            let known = Column::ALL.iter().find(|column| column.name().as_bytes() == text.trim_ascii());
            if let Some(column) = known {
                let place = columns.get_mut(*column as usize);
                if place.is_some_and(|place| place.replace(index).is_some()) {
                    return Err(CsvProblem::RepeatedColumn(*column));
                }
            }
            index += 1;
        }
        for column in [Column::Codel, Column::Execution] {
            if columns.get(column as usize).is_none_or(Option::is_none) {
                return Err(CsvProblem::MissingColumn(column));
            }
        }
        Ok(Csv { columns, ends: Vec::new(), name: Vec::new(), order: 0 })
    }

    fn line(
        &mut self,
        line: &[u8],
        number: u64,
        scratch: &mut Scratch,
        names: &mut Names,
        summary: &mut Summary,
    ) -> Result<Option<Span>, TraceError> {
        let line = without_return(line);
        if line.is_empty() {
            return Ok(None);
        }
        let problem = |problem| TraceError::Csv { line: number, problem };
        self.split(line, scratch).map_err(problem)?;
        let key = scratch.field(Column::Codel).unwrap_or_default();
        if key.is_empty() {
            return Err(problem(CsvProblem::Missing(Column::Codel)));
        }
        let execution = time(scratch, Column::Execution).map_err(problem)?;
        let execution = execution.ok_or_else(|| problem(CsvProblem::Missing(Column::Execution)))?;
        let elapsed = time(scratch, Column::Elapsed).map_err(problem)?;
        let mut end = time(scratch, Column::Time).map_err(problem)?;
        let instance = scratch.field(Column::Instance).unwrap_or_default();

        let mut text = std::mem::take(&mut self.name);
        text.clear();
        text.extend_from_slice(key);
        // No text in UTF-8 has this byte.
        text.push(0xff);
        text.extend_from_slice(instance);
        let name = names.of_text(&text, || {
            let utf8 =
                |bytes: &[u8]| String::from_utf8(bytes.to_vec()).map_err(|_| problem(CsvProblem::NotUtf8));
            let kind = if key.contains(&b'/') { SpanKind::Program } else { SpanKind::Codel };
            Ok(Name { kind, key: utf8(key)?, instance: utf8(instance)? })
        });
        self.name = text;
        let name = name?;
        if let Some(time) = end
            && self.runs_back(name, time)
        {
            // The execution counts, and its place in time is unknown.
            summary.clock_errors += 1;
            end = None;
        }
        summary.events += 1;
        summary.spans += 1;
        if elapsed.is_some_and(|elapsed| is_suspicious(execution, elapsed)) {
            summary.suspicious += 1;
        }
        summary.at(end);
        let order = self.order;
        self.order += 1;
        let begin = end.zip(elapsed).and_then(|(end, elapsed)| end.checked_sub(elapsed));
        Ok(Some(Span {
            name,
            order,
            thread: None,
            cpu: None,
            begin,
            end,
            elapsed,
            execution,
            release: None,
            scheduling: None,
        }))
    }

    /// Returns whether the last execution of this name ended later.
    fn runs_back(&mut self, name: NameId, time: u64) -> bool {
        if self.ends.len() <= name.index() {
            self.ends.resize(name.index() + 1, 0);
        }
        match self.ends.get_mut(name.index()) {
            Some(last) if *last <= time => {
                *last = time;
                false
            }
            _ => true,
        }
    }

    /// Puts the fields that are read into the scratch.
    fn split(&self, line: &[u8], scratch: &mut Scratch) -> Result<(), CsvProblem> {
        scratch.text.clear();
        scratch.fields = [None; 5];
        let mut rest = Some(line);
        let mut index = 0;
        while let Some(field) = rest {
            let begin = scratch.text.len();
            let wanted = self.columns.iter().position(|column| *column == Some(index));
            let text = wanted.is_some().then_some(&mut scratch.text);
            rest = take_field(field, text).ok_or(CsvProblem::Quotes)?;
            if let Some(place) = wanted.and_then(|wanted| scratch.fields.get_mut(wanted)) {
                *place = Some((begin, scratch.text.len()));
            }
            index += 1;
        }
        Ok(())
    }
}

/// Reads a time in nanoseconds; none if the field is empty or missing.
fn time(scratch: &Scratch, column: Column) -> Result<Option<u64>, CsvProblem> {
    let text = scratch.field(column).unwrap_or_default().trim_ascii();
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

fn without_return(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// Appends the first field of a line to `text`. Returns what follows its comma, `Some(None)` at the end of the line; `None` if
/// quotes do not match.
fn take_field<'a>(line: &'a [u8], text: Option<&mut Vec<u8>>) -> Option<Option<&'a [u8]>> {
    let Some(mut rest) = line.strip_prefix(b"\"") else {
        let (field, rest) = match line.iter().position(|byte| *byte == b',') {
            Some(comma) => (line.get(..comma)?, Some(line.get(comma + 1..)?)),
            None => (line, None),
        };
        if let Some(text) = text {
            text.extend_from_slice(field);
        }
        return Some(rest);
    };
    let mut ignored = Vec::new();
    let text = text.unwrap_or(&mut ignored);
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
    use std::ops::ControlFlow;

    use proptest::prelude::*;

    use super::super::Reader;
    use super::*;

    /// An execution: key, instance, execution time, elapsed time, begin, end.
    type Row = (String, String, u64, Option<u64>, Option<u64>, Option<u64>);

    #[derive(Default)]
    struct Rows(Vec<Row>);

    impl Visitor for Rows {
        fn span(&mut self, span: &Span, names: &Names) -> ControlFlow<()> {
            let name = names.get(span.name);
            assert_eq!(name.kind == SpanKind::Program, name.key.contains('/'));
            let (key, instance) = (name.key.clone(), name.instance.clone());
            self.0.push((key, instance, span.execution, span.elapsed, span.begin, span.end));
            ControlFlow::Continue(())
        }
    }

    fn rows(text: &[u8]) -> Result<(Vec<Row>, Summary), TraceError> {
        let (mut reader, mut rows) = (Reader::default(), Rows::default());
        reader.read_csv(text, Some(text.len() as u64), &mut rows)?;
        Ok((rows.0, reader.finish()))
    }

    fn problem(text: &str) -> (u64, CsvProblem) {
        match rows(text.as_bytes()) {
            Err(TraceError::Csv { line, problem }) => (line, problem),
            other => panic!("{text}: {other:?}"),
        }
    }

    fn row(key: &str, instance: &str, execution: u64, times: [Option<u64>; 3]) -> Row {
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
        let expected =
            Summary { events: 3, spans: 3, first: Some(100), last: Some(120), ..Summary::default() };
        assert_eq!(summary, expected);
    }

    #[test]
    fn columns_in_any_order_quotes_and_line_ends() {
        let text = "\u{feff}x,\"execution_ns\", codel\r\n1,5,\"a\"\"b,c\"\r\n\r\n,6,d";
        let none = [None; 3];
        assert_eq!(rows(text.as_bytes()).unwrap().0, [row("a\"b,c", "", 5, none), row("d", "", 6, none)]);
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
            ("codel,execution_ns\nf,1\nf\n", (3, CsvProblem::Missing(Execution))),
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
        let not_utf8 = rows(b"codel,execution_ns\n\xff,1\n");
        assert!(matches!(not_utf8, Err(TraceError::Csv { line: 2, problem: CsvProblem::NotUtf8 })));
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
            prop_assert_eq!(rows(text.as_bytes()).unwrap().0, expected.collect::<Vec<Row>>());
        }
    }
}
