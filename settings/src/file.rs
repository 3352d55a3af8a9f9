//! The settings file: reading, with every problem at once.

use std::format;
use std::path::{Path, PathBuf};
use std::string::{String, ToString};
use std::vec::Vec;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::VERSION;
use crate::field::{Field, Kind};
use crate::fields::FIELDS;
use crate::values::Values;

/// The key that says which version of the numbers and names a file is for.
const VERSION_KEY: &str = "version";

/// How alike a wrong name and the one that was probably meant are, from 0 to 1.
const ALIKE: f64 = 0.85;

/// One setting that a file states, and its line; the first is 1.
#[derive(Debug, Clone, Copy)]
struct Entry {
    number: u16,
    value: f32,
    line: usize,
}

/// A file that is refused, with all that is wrong.
#[derive(Debug, thiserror::Error)]
#[error("{}", self.lines().join("\n"))]
pub struct FileError {
    path: PathBuf,
    /// Lines, and what is wrong there and what would be right; line zero is the whole file.
    problems: Vec<(usize, String)>,
}

impl FileError {
    /// Every problem with its file and line, in their order.
    pub fn lines(&self) -> Vec<String> {
        let path = self.path.display();
        let line = |(line, what): &(usize, String)| match line {
            0 => format!("{path}: {what}"),
            line => format!("{path}:{line}: {what}"),
        };
        self.problems.iter().map(line).collect()
    }
}

/// Reads the file at `path`, which need not state every setting, for a finger whose table ends at `table_kpa`. Gives
/// each setting that it states: its number, and its value or a choice's place in the list of its words.
///
/// # Errors
/// If it cannot be read, is no TOML, is for a newer version, or states anything but settings in their ranges.
pub fn read(path: &Path, table_kpa: f32) -> Result<Vec<(u16, f32)>, FileError> {
    let fail = |line, what| FileError {
        path: path.to_path_buf(),
        problems: Vec::from([(line, what)]),
    };
    let bytes = std::fs::read(path).map_err(|error| fail(0, error.to_string()))?;
    match core::str::from_utf8(&bytes) {
        Ok(text) => parse(path, text, table_kpa),
        Err(error) => {
            let newlines = bytes[..error.valid_up_to()].iter().filter(|&&b| b == b'\n');
            let what = "is not text in UTF-8, so this is no settings file";
            Err(fail(1 + newlines.count(), what.into()))
        }
    }
}

/// The same for a file's `text`; `path` is for messages.
///
/// # Errors
/// As [`read`], except that there is nothing to read.
pub fn parse(path: &Path, text: &str, table_kpa: f32) -> Result<Vec<(u16, f32)>, FileError> {
    let mut reader = Reader {
        text,
        entries: Vec::new(),
        problems: Vec::new(),
    };
    reader.document();
    reader.check_pressures(table_kpa);
    let Reader {
        entries,
        mut problems,
        ..
    } = reader;
    if problems.is_empty() {
        let stated = entries.iter().map(|entry| (entry.number, entry.value));
        return Ok(stated.collect());
    }
    problems.sort_by_key(|(line, _)| *line);
    Err(FileError {
        path: path.to_path_buf(),
        problems,
    })
}

struct Reader<'a> {
    text: &'a str,
    entries: Vec<Entry>,
    problems: Vec<(usize, String)>,
}

impl Reader<'_> {
    fn line(&self, byte: usize) -> usize {
        let before = self.text.bytes().take(byte);
        1 + before.filter(|&b| b == b'\n').count()
    }

    fn refuse(&mut self, value: &Spanned<DeValue>, what: String) {
        self.problems.push((self.line(value.span().start), what));
    }

    fn document(&mut self) {
        let (document, errors) = DeTable::parse_recoverable(self.text);
        let damaged: Vec<usize> = errors
            .iter()
            .map(|error| self.line(error.span().map_or(0, |span| span.start)))
            .collect();
        let document = document.into_inner();
        match document.get(VERSION_KEY) {
            Some(version) => self.check_version(version),
            None => {
                let what = format!("must begin with {VERSION_KEY} = {VERSION}");
                self.problems.push((0, what));
            }
        }
        let rest = document.iter();
        for (key, value) in rest.filter(|(key, _)| key.get_ref() != VERSION_KEY) {
            self.node(key.get_ref(), key, value);
        }
        // What is left of a damaged line says nothing.
        self.problems.retain(|(line, _)| !damaged.contains(line));
        let messages = errors.iter().map(|error| error.message().to_string());
        self.problems.extend(damaged.iter().copied().zip(messages));
        if !self.text.is_empty() && !self.text.ends_with('\n') {
            let what = "the last line has no end, so the file may have been cut off: end it with a line break";
            self.problems
                .push((self.line(self.text.len()), what.into()));
        }
    }

    fn check_version(&mut self, value: &Spanned<DeValue>) {
        let stated = value.get_ref().as_integer();
        let stated = stated.and_then(|stated| stated.as_str().parse::<u64>().ok());
        match stated {
            Some(stated) if stated == u64::from(VERSION) => {}
            Some(stated) if stated > u64::from(VERSION) => self.refuse(
                value,
                format!(
                    "{VERSION_KEY} = {stated}: is newer than this release, which reads {VERSION}"
                ),
            ),
            _ => {
                let shown = shown(value.get_ref());
                self.refuse(value, format!("{VERSION_KEY} = {shown}: must be {VERSION}"));
            }
        }
    }

    /// What a file has under a name, down to every single value.
    fn node(&mut self, name: &str, key: &Spanned<impl Sized>, value: &Spanned<DeValue>) {
        if let Some(field) = named(name) {
            return self.leaf(field, value);
        }
        let places = places(name);
        match value.get_ref() {
            DeValue::Table(table) if is_table(name) => {
                for (key, value) in table {
                    self.node(&format!("{name}.{}", key.get_ref()), key, value);
                }
            }
            DeValue::Array(list) if places > 0 && list.len() == places => {
                for (n, value) in list.iter().enumerate() {
                    self.node(&format!("{name}[{n}]"), value, value);
                }
            }
            DeValue::Array(list) if places > 0 => {
                let what = format!("{name} has {} values: must have {places}", list.len());
                self.refuse(value, what);
            }
            other if places > 0 => {
                let what = format!("{name} = {}: must be a list of {places}", shown(other));
                self.refuse(value, what);
            }
            other if is_table(name) => {
                let what = format!("{name} = {}: must be a table, [{name}]", shown(other));
                self.refuse(value, what);
            }
            _ => {
                let line = self.line(key.span().start);
                let meant =
                    meant(name).map_or_else(String::new, |m| format!("; did you mean {m}?"));
                let what = format!("{name}: there is no such setting{meant}");
                self.problems.push((line, what));
            }
        }
    }

    fn leaf(&mut self, field: &Field, value: &Spanned<DeValue>) {
        let (name, shown) = (field.name, shown(value.get_ref()));
        let line = self.line(value.span().start);
        let found = match (field.kind, value.get_ref()) {
            (Kind::Choice(words), DeValue::String(word)) => words
                .iter()
                .position(|known| known == word)
                .map(|n| n as f32),
            (Kind::Number { .. } | Kind::Whole { .. }, value) => {
                number_of(value).filter(|number| field.limit().allows(*number))
            }
            _ => None,
        };
        if let Some(value) = found {
            let number = field.number;
            self.entries.push(Entry {
                number,
                value,
                line,
            });
            return;
        }
        let right = match (field.kind, number_of(value.get_ref())) {
            (Kind::Choice(words), _) => {
                let quoted: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
                format!("must be one of {}", quoted.join(", "))
            }
            (Kind::Whole { min, max }, _) => {
                format!("must be a whole number from {min} to {max}")
            }
            (Kind::Number { min, max }, Some(_)) => format!("must lie within {min} and {max}"),
            (Kind::Number { min, max }, None) => {
                format!("must be a number within {min} and {max}")
            }
        };
        self.problems
            .push((line, format!("{name} = {shown}: {right}")));
    }

    /// Pressures that are right by themselves, but not together, or not with this finger.
    fn check_pressures(&mut self, table_kpa: f32) {
        let stated: Vec<(u16, f32)> = self.entries.iter().map(|e| (e.number, e.value)).collect();
        let Ok(values) = Values::DEFAULT.with(&stated, table_kpa) else {
            return;
        };
        // A grip is judged by what the highest pressure can be, not by one that is refused itself.
        let mut possible = values;
        let _ = possible.set(100, values.highest_kpa(table_kpa));
        let own = values
            .problems(table_kpa)
            .filter(|problem| problem.number != 400);
        let grip = possible
            .problems(table_kpa)
            .filter(|problem| problem.number == 400);
        for problem in own.chain(grip) {
            let entries = self.entries.iter();
            for entry in entries.filter(|entry| entry.number == problem.number) {
                let by = match entry.number {
                    400 => "regulator.max_pressure_kpa",
                    _ => "what finger and regulator reach",
                };
                let what = format!("{problem}, {by}");
                self.problems.push((entry.line, what));
            }
        }
    }
}

/// The setting with this name.
pub(crate) fn named(name: &str) -> Option<&'static Field> {
    const { &FIELDS }.iter().find(|field| field.name == name)
}

/// Whether settings have names that begin with this and a dot.
fn is_table(name: &str) -> bool {
    let inside = |field: &Field| {
        let rest = field.name.strip_prefix(name);
        rest.is_some_and(|rest| rest.starts_with('.'))
    };
    FIELDS.iter().any(inside)
}

/// How long the list with this name is; zero if there is none.
pub(crate) fn places(name: &str) -> usize {
    let has = |n: &usize| {
        let place = format!("{name}[{n}]");
        FIELDS.iter().any(|field| field.name.starts_with(&place))
    };
    (0..).take_while(has).count()
}

/// The setting whose name is most like this one, if it is alike.
fn meant(name: &str) -> Option<&'static str> {
    let last = |name: &'static str| name.rsplit('.').next().unwrap_or(name);
    let key = name.rsplit('.').next().unwrap_or(name);
    let likeness = |field: &Field| {
        let whole = strsim::normalized_damerau_levenshtein(name, field.name);
        // The right key in the wrong table.
        whole.max(strsim::normalized_damerau_levenshtein(
            key,
            last(field.name),
        ))
    };
    let scored = FIELDS.iter().map(|field| (likeness(field), field.name));
    let best = scored.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(likeness, _)| *likeness >= ALIKE)
        .map(|(_, name)| name)
}

/// A number, whole or not.
fn number_of(value: &DeValue) -> Option<f32> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            let whole = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
            whole.map(|whole| whole as f32)
        }
        _ => None,
    }
}

/// A value as it stands in the file, if it is short.
fn shown(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("{text:?}"),
        DeValue::Integer(integer) => integer.as_str().into(),
        DeValue::Float(float) => float.as_str().into(),
        DeValue::Boolean(truth) => truth.to_string(),
        DeValue::Datetime(moment) => moment.to_string(),
        DeValue::Array(_) => "a list".into(),
        DeValue::Table(_) => "a table".into(),
    }
}

#[cfg(test)]
mod tests;
