//! What the image costs, against what it has cost and what it may cost.

use std::collections::BTreeMap;

use anyhow::Context as _;
use serde::{Deserialize, Serialize};
use sim::scenario::Scenario;
use softgrip::TICK_US;

use super::test::{Context, Outcome, Test};
use crate::bench::{self, MS, Setup};
use crate::calls::Calls;
use crate::closed_loop::{self, Loop};
use crate::image::Image;
use crate::rtt::Host;

pub const TESTS: [Test; 2] = [
    Test {
        name: "budget",
        about: "instructions, stack, flash, RAM and start, against hil/budgets.toml",
        run: budget,
    },
    Test {
        name: "no panic",
        about: "in all that the control tick can reach, as the machine code shows",
        run: no_panic,
    },
];

/// A value may grow by this much before somebody must look at it.
const GROWTH: f64 = 1.05;

/// One line of the budgets' file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Budget {
    /// What it was when somebody last looked.
    measured: u64,
    /// The most that it may ever be.
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<u64>,
}

type Budgets = BTreeMap<String, Budget>;

fn file() -> std::path::PathBuf {
    crate::image::root().join("hil/budgets.toml")
}

fn budget(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::default();
    let measured = measure(context.image)?;
    let path = file();
    let text = std::fs::read_to_string(&path).with_context(|| format!("{}", path.display()))?;
    let mut budgets: Budgets =
        toml::from_str(&text).with_context(|| format!("{}", path.display()))?;
    for (name, value) in &measured {
        let Some(budget) = budgets.get(name).copied() else {
            outcome.number(name, *value as f64, "");
            outcome.must(
                context.write_budgets,
                format!("{name} is not in hil/budgets.toml: write it with --write-budgets"),
            );
            budgets.insert(
                name.clone(),
                Budget {
                    measured: *value,
                    limit: None,
                },
            );
            continue;
        };
        let grown = if context.write_budgets {
            f64::INFINITY
        } else {
            (budget.measured as f64 * GROWTH).floor()
        };
        let limit = budget.limit.map_or(grown, |limit| grown.min(limit as f64));
        outcome.at_most(name, *value as f64, "", limit);
    }
    for name in budgets.keys() {
        outcome.must(
            measured.contains_key(name) || context.write_budgets,
            format!("{name} is in hil/budgets.toml, but nobody measures it"),
        );
    }
    if context.write_budgets {
        budgets.retain(|name, _| measured.contains_key(name));
        for (name, value) in measured {
            if let Some(budget) = budgets.get_mut(&name) {
                budget.measured = value;
            }
        }
        let head: String = text
            .lines()
            .take_while(|line| line.starts_with('#'))
            .map(|line| format!("{line}\n"))
            .collect();
        std::fs::write(&path, format!("{head}\n{}", toml::to_string(&budgets)?))
            .with_context(|| format!("{}", path.display()))?;
    }
    Ok(outcome)
}

/// The 90th percentile of a tick that has a record, and what the record costs of it: the mean against one in fifty.
fn with_records(image: &Image, scenario: &Scenario) -> anyhow::Result<[u64; 2]> {
    let per_tick = |telemetry_us: u32| {
        let setup = Setup {
            telemetry_us,
            ..Setup::new(image, Host::Reading)
        };
        let plant = Loop::new(scenario, closed_loop::fingers()?);
        let (_, record) = bench::run(&setup, plant, |plant, moment| Ok(plant.step(moment)))?;
        let mut ticks = record.tick_instructions();
        ticks.sort_unstable();
        let p90 = ticks.get(ticks.len() * 9 / 10).copied().unwrap_or(0);
        anyhow::Ok((p90, ticks.iter().sum::<u64>() / ticks.len().max(1) as u64))
    };
    let (p90, often) = per_tick(1_000)?;
    let (_, seldom) = per_tick(50_000)?;
    Ok([p90, often.saturating_sub(seldom) * 50 / 49])
}

fn measure(image: &Image) -> anyhow::Result<BTreeMap<String, u64>> {
    let mut measured = BTreeMap::new();
    let flash = image.sections.iter().map(|section| section.flash).sum();
    let ram = image.sections.iter().map(|section| section.ram).sum();
    measured.insert("flash_bytes".into(), flash);
    measured.insert("ram_bytes".into(), ram);
    for section in &image.sections {
        let name = section.name.trim_start_matches('.');
        measured.insert(format!("section_{name}_bytes"), section.size);
    }

    // A whole pick-and-place, with the sphere lost on the way: the dearest that there is.
    let scenario = Scenario {
        accel_m_s2: 10.0,
        ..Scenario::default()
    };
    let stack = image.stack()?;
    let plant = Loop::new(&scenario, closed_loop::fingers()?);
    let setup = Setup::new(image, Host::Reading);
    let ((_, used), record) = bench::run(&setup, (plant, 0), move |(plant, used), moment| {
        if moment.ms == 0 {
            moment.paint(stack.clone())?;
        }
        let on_its_way = plant.step(moment);
        if !on_its_way {
            *used = moment.used(stack.clone())?;
        }
        Ok(on_its_way)
    })?;
    measured.insert("stack_bytes".into(), used);
    let first = record.ticks.first().context("the image makes no tick")?;
    measured.insert("start_us".into(), first.at.0 * TICK_US / MS);

    let mut steps: Vec<u64> = record.ticks.iter().map(|tick| tick.step).collect();
    let mut ticks = record.tick_instructions();
    for (name, values) in [("step", &mut steps), ("tick", &mut ticks)] {
        values.sort_unstable();
        let median = values.get(values.len() / 2).copied().unwrap_or(0);
        let most = values.last().copied().unwrap_or(0);
        // One tick in twenty sends a snapshot.
        let without_snapshot = values.get(values.len() * 9 / 10).copied().unwrap_or(0);
        measured.insert(format!("{name}_instructions_median"), median);
        measured.insert(format!("{name}_instructions_p90"), without_snapshot);
        measured.insert(format!("{name}_instructions_max"), most);
    }
    let [tick, record] = with_records(image, &scenario)?;
    measured.insert("record_instructions".into(), record);
    measured.insert("record_tick_instructions_p90".into(), tick);
    Ok(measured)
}

fn no_panic(context: &Context<'_>) -> anyhow::Result<Outcome> {
    let calls = Calls::read(context.image)?;
    let mut outcome = Outcome::default();
    let tick = calls.reach(&["control::Control::tick"])?;
    outcome.number(
        "functions that the tick can reach",
        tick.functions as f64,
        "",
    );
    outcome.at_most(
        "ways into a panic from the tick",
        tick.panics.len() as f64,
        "",
        0.0,
    );
    for way in &tick.panics {
        outcome.failures.push(way.0.join(" → "));
    }
    let indirect: usize = tick.indirect.iter().map(|(_, calls)| calls).sum();
    outcome.number("calls by a pointer from RAM", indirect as f64, "");
    for (name, calls) in &tick.indirect {
        outcome.notes.push(format!("{calls} of them in {name}"));
    }
    let driver = calls.reach(&["converter::Converter::frame"])?;
    let bus = calls.reach(&["line::Slave::take", "line::Slave::answer"])?;
    for (name, reach) in [("the converter's driver", driver), ("the bus", bus)] {
        let ways = reach.panics.len() as f64;
        outcome.at_most(format!("ways into a panic from {name}"), ways, "", 0.0);
        for way in &reach.panics {
            outcome.failures.push(way.0.join(" → "));
        }
    }
    Ok(outcome)
}
