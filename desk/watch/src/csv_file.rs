//! Recordings as CSV files: a row for each observation, which begins as a trace does.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};

use crate::fields::{FIELDS, Field, Kind, Place};
use crate::observation::Observation;
use crate::told::{EventTold, Told};

/// The last column: names of the events of a row's tick, or since the row before, with blanks between them.
const EVENTS: &str = "events";
/// So much is lost at most where a recording is cut off.
const FLUSH: Duration = Duration::from_secs(1);

/// A CSV file that is being written.
pub struct CsvFile {
    writer: csv::Writer<BufWriter<File>>,
    /// The last row: its events come after it.
    row: Option<Observation>,
    events: Vec<String>,
    flushed: Instant,
}

impl CsvFile {
    /// Begins a recording.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn new(file: File) -> anyhow::Result<Self> {
        let mut writer = csv::Writer::from_writer(BufWriter::new(file));
        let names = FIELDS.iter().map(|field| field.name);
        writer.write_record(names.chain([EVENTS]))?;
        Ok(Self {
            writer,
            row: None,
            events: Vec::new(),
            flushed: Instant::now(),
        })
    }

    /// Writes what is told, as far as there is a column for it.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, told: &Told) -> anyhow::Result<()> {
        match told {
            Told::Observation(seen) => {
                self.write_row()?;
                self.row = Some(**seen);
            }
            Told::Event(event) => self.events.push(event.name.clone()),
            _ => {}
        }
        if self.flushed.elapsed() >= FLUSH {
            self.flushed = Instant::now();
            self.writer.flush()?;
        }
        Ok(())
    }

    fn write_row(&mut self) -> anyhow::Result<()> {
        if let Some(mut row) = self.row.take() {
            let cells = FIELDS.iter().map(|field| field.text(&mut row));
            self.writer
                .write_record(cells.chain([self.events.join(" ")]))?;
            self.events.clear();
        }
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.write_row()?;
        self.writer.flush()?;
        Ok(())
    }
}

/// Reads a recording; `take` gets what is told, in its order. Columns may be missing, and others are ignored. A last line
/// that was cut off is left out, and told as a note.
///
/// # Errors
/// If the file cannot be read, has no time or no rows, or a cell is none of its column; the message names the line. Or if
/// `take` fails.
pub fn read(path: &Path, take: &mut impl FnMut(Told) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let name = || path.display().to_string();
    let bytes = std::fs::read(path).with_context(name)?;
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    let (whole, cut) = bytes.split_at(end.map_or(0, |end| end + 1));
    read_rows(whole, take).with_context(name)?;
    if !cut.is_empty() {
        take(Told::Note(format!(
            "{}: the last line has no end: it was cut off, and is left out",
            name()
        )))?;
    }
    Ok(())
}

fn read_rows(
    bytes: &[u8],
    take: &mut impl FnMut(Told) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut reader = csv::Reader::from_reader(bytes);
    let header = reader.headers()?.clone();
    let columns: Vec<Option<&Field>> = header
        .iter()
        .map(|name| FIELDS.iter().find(|field| field.name == name))
        .collect();
    ensure!(
        columns.iter().flatten().any(|field| field.name == "t_s"),
        "no column t_s: `softgrip telemetry` lists the columns of a recording; foreign traces are for `softgrip replay`"
    );
    let mut has_rows = false;
    for row in reader.records() {
        let row = row?;
        has_rows = true;
        let line = row.position().map_or(0, csv::Position::line);
        let mut seen = Observation::default();
        for (field, text) in columns.iter().zip(&row) {
            if let (Some(field), false) = (field, text.is_empty()) {
                parse(field, text, &mut seen).with_context(|| format!("line {line}"))?;
            }
        }
        let t_s = seen
            .t_s
            .with_context(|| format!("line {line}: t_s is empty"))?;
        take(Told::Observation(Box::new(seen)))?;
        let events = header.iter().zip(&row);
        let events = events.filter(|(name, _)| *name == EVENTS);
        for name in events.flat_map(|(_, text)| text.split_whitespace()) {
            take(Told::Event(EventTold {
                t_s,
                name: name.into(),
                text: name.into(),
            }))?;
        }
    }
    ensure!(has_rows, "it has no rows: nothing was recorded");
    Ok(())
}

/// Puts a cell into an observation.
fn parse(field: &Field, text: &str, seen: &mut Observation) -> anyhow::Result<()> {
    let name = field.name;
    let wrong = || format!("{name} = {text:?}: must be a number, or empty where there is none");
    match ((field.place)(seen), field.kind) {
        (Place::Double(place), _) => {
            let number = text.parse().ok().filter(|value: &f64| value.is_finite());
            *place = Some(number.with_context(wrong)?);
        }
        (Place::Float(place), _) => {
            let number = text.parse().ok().filter(|value: &f32| value.is_finite());
            *place = Some(number.with_context(wrong)?);
        }
        (Place::Whole(place), Kind::Choice(words)) => {
            let known = words.iter().position(|word| *word == text);
            let number = known.with_context(|| {
                format!("{name} = {text:?}: must be one of {}", words.join(", "))
            })?;
            *place = Some(number as u16);
        }
        (Place::Whole(place), _) => *place = Some(text.parse().with_context(wrong)?),
        (Place::Flag(place), _) => match text {
            "0" => *place = Some(false),
            "1" => *place = Some(true),
            _ => bail!("{name} = {text:?}: must be 0 or 1"),
        },
    }
    Ok(())
}
