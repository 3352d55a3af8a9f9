//! Specification of a sweep, from a TOML file.

use std::path::Path;

use anyhow::{Context, bail, ensure};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use sim::setup::{self, Value};

/// More runs than this are a slip of the pen: a week on two processors.
const MOST_RUNS: u64 = 10_000_000;

/// A parsed and checked sweep specification.
#[derive(Debug, Clone, PartialEq)]
pub struct Spec {
    /// Text of the specification, TOML.
    pub text: String,
    /// Number of runs of the whole sweep.
    pub runs: u64,
    fixed: Vec<(String, Value)>,
    axes: Vec<(String, Axis)>,
    /// Seed of a random sample; a grid has none.
    seed: Option<u64>,
}

#[derive(Debug, Clone, PartialEq)]
enum Axis {
    /// One value of a list.
    List(Vec<Value>),
    /// Evenly distributed in between.
    Between(f64, f64),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    kind: Kind,
    runs: Option<u64>,
    seed: Option<u64>,
    #[serde(default)]
    fixed: toml::Table,
    vary: toml::Table,
}

#[derive(Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Grid,
    Random,
}

/// A range of numbers as it stands in the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    from: toml::Value,
    to: toml::Value,
    steps: Option<u32>,
}

impl Spec {
    /// Reads and checks a specification.
    ///
    /// # Errors
    /// If the file cannot be read, or as [`Self::parse`].
    pub fn load(path: &Path) -> anyhow::Result<Self> {
        std::fs::read_to_string(path)
            .map_err(anyhow::Error::from)
            .and_then(|text| Self::parse(&text))
            .with_context(|| path.display().to_string())
    }

    /// Parses and checks the text of a specification.
    ///
    /// # Errors
    /// If a key, a parameter or a value is not possible; the message says what would be.
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        let file: File = toml::from_str(text)?;
        let mut fixed = Vec::new();
        for (name, value) in flat(&file.fixed) {
            fixed.push((name.clone(), setup::value(&name, value).context("fixed")?));
        }
        let mut axes = Vec::new();
        for (name, value) in flat(&file.vary) {
            ensure!(
                fixed.iter().all(|(other, _)| *other != name),
                "{name}: stands in both fixed and vary"
            );
            axes.push((
                name.clone(),
                axis(&name, value, &file.kind).context("vary")?,
            ));
        }
        ensure!(!axes.is_empty(), "vary: must name at least one parameter");
        // What belongs to the object comes after the object.
        fixed.sort_by_key(|(name, _)| name != setup::OBJECT);
        axes.sort_by_key(|(name, _)| name != setup::OBJECT);
        let runs = match (&file.kind, file.runs) {
            (Kind::Grid, None) => axes.iter().try_fold(1u64, |runs, (_, axis)| match axis {
                Axis::List(values) => runs.checked_mul(values.len() as u64),
                Axis::Between(..) => None,
            }),
            (Kind::Random, Some(runs)) => Some(runs),
            (Kind::Grid, Some(_)) => {
                bail!("runs: a grid has as many as it has points; leave it out")
            }
            (Kind::Random, None) => bail!("runs: a random sample must say how many"),
        };
        let runs = runs.filter(|runs| (1..=MOST_RUNS).contains(runs));
        Ok(Self {
            text: text.to_string(),
            runs: runs.with_context(|| format!("runs: must lie within 1 and {MOST_RUNS}"))?,
            fixed,
            axes,
            seed: (file.kind == Kind::Random).then(|| file.seed.unwrap_or(1)),
        })
    }

    /// Names of all parameters that it sets, in the order of [`Spec::values`].
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let fixed = self.fixed.iter().map(|(name, _)| name.as_str());
        fixed.chain(self.axes.iter().map(|(name, _)| name.as_str()))
    }

    /// The parameters of run number `run`, counted from zero.
    pub fn values(&self, run: u64) -> impl Iterator<Item = (&str, Value)> {
        let varied = match self.seed {
            None => self.on_grid(run),
            Some(seed) => self.at_random(seed, run),
        };
        let fixed = self.fixed.iter().map(|(_, value)| *value);
        self.names().zip(fixed.chain(varied).collect::<Vec<_>>())
    }

    /// The last axis runs fastest.
    fn on_grid(&self, run: u64) -> Vec<Value> {
        let mut rest = run;
        let mut values: Vec<Value> = Vec::new();
        for (_, axis) in self.axes.iter().rev() {
            if let Axis::List(list) = axis {
                values.push(list[(rest % list.len() as u64) as usize]);
                rest /= list.len() as u64;
            }
        }
        values.reverse();
        values
    }

    /// Each run has its own stream, so that shards and interruptions change nothing.
    fn at_random(&self, seed: u64, run: u64) -> Vec<Value> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(run);
        let axes = self.axes.iter();
        axes.map(|(_, axis)| match axis {
            Axis::List(list) => list[rng.random_range(0..list.len())],
            Axis::Between(from, to) => Value::Number(rng.random_range(*from..=*to)),
        })
        .collect()
    }
}

/// The entries of nested tables under names with dots; a range is an entry.
fn flat(table: &toml::Table) -> Vec<(String, &toml::Value)> {
    let mut entries = Vec::new();
    for (name, value) in table {
        match value {
            toml::Value::Table(inner) if !inner.contains_key("from") => {
                let inner = flat(inner).into_iter();
                entries.extend(inner.map(|(rest, value)| (format!("{name}.{rest}"), value)));
            }
            value => entries.push((name.clone(), value)),
        }
    }
    entries
}

fn axis(name: &str, value: &toml::Value, kind: &Kind) -> anyhow::Result<Axis> {
    match value {
        toml::Value::Array(list) => {
            ensure!(
                !list.is_empty(),
                "{name} = []: must hold at least one value"
            );
            let values = list.iter().map(|value| setup::value(name, value));
            Ok(Axis::List(values.collect::<anyhow::Result<_>>()?))
        }
        toml::Value::Table(_) => {
            let range: Range = value.clone().try_into().with_context(|| name.to_string())?;
            let (Value::Number(from), Value::Number(to)) = (
                setup::value(name, &range.from)?,
                setup::value(name, &range.to)?,
            ) else {
                bail!("{name}: must be a list, such as [\"sphere\", \"cylinder\"]");
            };
            ensure!(
                from < to,
                "{name}: from = {from}: must be less than to = {to}"
            );
            match (kind, range.steps) {
                (Kind::Random, None) => Ok(Axis::Between(from, to)),
                (Kind::Grid, Some(steps @ 2..=1_000_000)) => {
                    let last = f64::from(steps - 1);
                    let at = |n: u32| from + (to - from) * f64::from(n) / last;
                    Ok(Axis::List(
                        (0..steps).map(|n| Value::Number(at(n))).collect(),
                    ))
                }
                (Kind::Random, Some(_)) => {
                    bail!("{name}: steps: only a grid has steps; leave it out")
                }
                (Kind::Grid, _) => {
                    bail!("{name}: steps: must lie within 2 and 1000000, both ends included")
                }
            }
        }
        other => bail!(
            "{name} = {other}: must be a list or {{ from = …, to = … }}; what is the same in every run belongs into [fixed]"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(text: &str) -> Spec {
        Spec::parse(text).expect("a good spec")
    }

    fn error(text: &str) -> String {
        format!("{:#}", Spec::parse(text).expect_err("a bad spec"))
    }

    #[test]
    fn a_grid_has_every_combination_once() {
        let spec = spec(
            "kind = 'grid'\n[fixed]\naccel_m_s2 = 5\n[vary]\nmass_kg = [0.1, 0.2]\narm.jerk_ramp_ms = { from = 20, to = 60, steps = 3 }\nobject = ['sphere', 'cylinder']\n",
        );
        assert_eq!(spec.runs, 12);
        let names: Vec<_> = spec.names().collect();
        assert_eq!(
            names,
            ["accel_m_s2", "object", "arm.jerk_ramp_ms", "mass_kg"]
        );
        let mut seen: Vec<String> = (0..12)
            .map(|run| {
                spec.values(run)
                    .map(|(_, value)| format!("{value} "))
                    .collect()
            })
            .collect();
        assert_eq!(seen[0], "5 sphere 20 0.1 ");
        assert_eq!(seen[11], "5 cylinder 60 0.2 ");
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), 12);
    }

    #[test]
    fn the_manuals_specification_is_a_good_one() {
        let spec = spec(include_str!("../../../../docs/sweep.toml"));
        assert_eq!(spec.runs, 20);
    }

    #[test]
    fn a_random_sample_stays_in_its_ranges_and_does_not_depend_on_the_order() {
        let spec = spec(
            "kind = 'random'\nruns = 50\nseed = 3\n[vary]\nfriction = { from = 0.7, to = 0.9 }\n",
        );
        let value = |run| spec.values(run).next().expect("one parameter").1;
        for run in (0..50).rev() {
            let Value::Number(friction) = value(run) else {
                panic!("a number");
            };
            assert!((0.7..=0.9).contains(&friction));
            assert_eq!(value(run), value(run));
        }
        assert_ne!(value(0), value(1));
    }

    #[test]
    fn every_bad_spec_is_named_with_what_would_be_right() {
        for (text, expected) in [
            (
                "kind = 'grid'\n[vary]\nfricton = [1]",
                "vary: fricton: there is no such parameter; there are object, mass_kg",
            ),
            (
                "kind = 'grid'\n[vary]\nmass_kg = [-1]",
                "mass_kg = -1: must be a number within 0.001 and 5",
            ),
            (
                "kind = 'grid'\n[vary]\nmass_kg = [nan]",
                "must be a number within",
            ),
            (
                "kind = 'grid'\n[vary]\nmass_kg = []",
                "mass_kg = []: must hold at least one value",
            ),
            (
                "kind = 'grid'\n[vary]\n",
                "must name at least one parameter",
            ),
            (
                "kind = 'grid'\n[vary]\nobject = ['cube']",
                "must be \"sphere\" or \"cylinder\"",
            ),
            (
                "kind = 'grid'\n[vary]\nmass_kg = 0.1",
                "belongs into [fixed]",
            ),
            (
                "kind = 'grid'\n[vary]\nmass_kg = { from = 0.2, to = 0.1, steps = 2 }",
                "must be less than",
            ),
            (
                "kind = 'grid'\n[vary]\nmass_kg = { from = 0.1, to = 0.2 }",
                "steps: must lie within 2",
            ),
            (
                "kind = 'grid'\nruns = 3\n[vary]\nmass_kg = [0.1]",
                "runs: a grid",
            ),
            (
                "kind = 'random'\n[vary]\nmass_kg = [0.1]",
                "runs: a random sample must say how many",
            ),
            (
                "kind = 'random'\nruns = 0\n[vary]\nmass_kg = [0.1]",
                "runs: must lie within 1",
            ),
            (
                "kind = 'grid'\ncolour = 1\n[vary]\nmass_kg = [0.1]",
                "colour",
            ),
            ("kind = 'line'\n[vary]\nmass_kg = [0.1]", "line"),
            (
                "kind = 'grid'\n[fixed]\nmass_kg = 0.1\n[vary]\nmass_kg = [0.1]",
                "both fixed and vary",
            ),
        ] {
            let message = error(text);
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}
