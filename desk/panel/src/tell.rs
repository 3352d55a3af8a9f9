//! What the source tells, as the JSON that a page gets.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::Serialize;
use serde_json::{Value, json};
use settings::{FIELDS, Field, Kind, Values};
use softgrip::table::LINKS;
use softgrip::units::FINGERS;
use watch::fields::{CAUSES, STATES};
use watch::told::{EventTold, Provenance};
use watch::{Observation, Told};

use crate::hand::{Ball, Castings, Hand};
use crate::hub::{Board, Frame, Hub};
use crate::manual;
use crate::order::WORLD_FAULTS;

/// Pages get no more frames than one in this time, but for those in which something changes.
const FRAME_PERIOD: Duration = Duration::from_millis(19);

/// What a page must know of a source.
pub struct About {
    /// What it is, in words.
    pub name: String,
    /// How often an observation is to come, Hz; 0 where nobody knows.
    pub rate_hz: f64,
    /// It takes commands.
    pub commands: bool,
    /// It is the virtual gripper, whose world takes orders too.
    pub world: bool,
}

/// Tells the pages what the source tells.
pub struct Teller {
    hand: Hand,
    castings: Castings,
    period_s: Option<f64>,
    /// Time of the last observation, s.
    last_s: Option<f64>,
    /// Observations that should have come.
    dropped: u64,
    /// When the last frame was made, and what it showed.
    shown: Option<(Instant, Shown)>,
}

/// What a page must show at once.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shown {
    state: Option<u16>,
    lost: Option<bool>,
    fault: Option<u16>,
    gauge_fault: [Option<u16>; FINGERS],
}

#[derive(Serialize)]
struct View {
    n: u64,
    t_s: f64,
    state: Option<&'static str>,
    lost: Option<Value>,
    fault: Option<u16>,
    gauge_faults: [Option<u16>; FINGERS],
    tare_due: Option<bool>,
    kpa: Option<f32>,
    set_kpa: Option<f32>,
    bend_deg: Option<f32>,
    level: Option<f32>,
    margin: Option<f32>,
    residual_ue: [Option<f32>; FINGERS],
    strain_ue: [Option<f32>; FINGERS],
    free_ue: [Option<f32>; FINGERS],
    limit_ue: Option<f32>,
    noise_ue: [Option<f32>; FINGERS],
    drift_ue: [Option<f32>; FINGERS],
    touching: [Option<bool>; FINGERS],
    links_deg: [Option<[f32; LINKS]>; FINGERS],
    free_deg: Option<[f32; LINKS]>,
    object: Option<Value>,
    dropped: u64,
}

impl Teller {
    /// Before anything has been told of three such fingers.
    pub fn new(hand: Hand, about: &About) -> Self {
        let free_ue = hand.table.rows.last().map_or(0.0, |row| row.free_strain_ue);
        let values = Values::for_finger(hand.table.max_pressure_kpa, free_ue);
        Self {
            castings: Castings::of(&values),
            hand,
            period_s: (about.rate_hz > 0.0).then(|| 1.0 / about.rate_hz),
            last_s: None,
            dropped: 0,
            shown: None,
        }
    }

    /// What each page gets first.
    pub fn hello(&self, about: &About) -> String {
        let hand = &self.hand;
        let full_ue = hand.table.rows.last().map_or(0.0, |row| row.free_strain_ue);
        let hello = json!({
            "source": about.name,
            "commands": about.commands,
            "world": about.world,
            "world_faults": WORLD_FAULTS,
            "hand": { "links_mm": hand.links_mm, "palm_mm": hand.palm_mm, "radius_mm": hand.radius_mm },
            "most_kpa": hand.table.max_pressure_kpa,
            "full_strain_ue": full_ue,
            "curve_kpa": hand.pressures_kpa().to_vec(),
            "faults": manual::faults(),
            "sweep_rejections": manual::sweep_rejections(),
            "fields": FIELDS.iter().map(field).collect::<Vec<_>>(),
        });
        json!({ "hello": hello }).to_string()
    }

    /// Tells the pages.
    pub fn tell(&mut self, hub: &Hub, told: &Told) {
        match told {
            Told::Provenance(provenance) => self.provenance(hub, provenance),
            Told::Settings(told) => {
                self.castings = Castings::of(&told.values);
                hub.post(Board::Settings, self.settings(&told.values));
            }
            Told::Observation(observation) => self.observation(hub, observation),
            Told::Event(event) => tell_event(hub, event),
            Told::Note(text) => note(hub, text),
            Told::Tick(_) => {}
            Told::Ended(why) => end(hub, "note", why),
            Told::Failed(why) => end(hub, "alarm", why),
        }
    }

    fn provenance(&self, hub: &Hub, provenance: &Provenance) {
        let Provenance {
            version,
            recipe,
            table,
            ..
        } = provenance;
        if !version.is_empty() {
            note(hub, &format!("the gripper's program: {version}"));
        }
        let ours = format!("{:016x}", self.hand.table.inputs_hash);
        if !table.is_empty() && !ours.starts_with(table.as_str()) {
            let text = format!(
                "the gripper is built for another finger (recipe {recipe} {table}) than this page is told (recipe {} {ours}): what is expected of free fingers is wrong; give --recipe",
                self.hand.table.recipe
            );
            hub.put_line(|n| line(n, None, "warn", &text, false));
        }
    }

    fn settings(&self, values: &Values) -> String {
        let by_number: serde_json::Map<String, Value> = FIELDS
            .iter()
            .zip(values.all())
            .map(|(field, value)| (field.number.to_string(), json!(value)))
            .collect();
        let pressures = self.hand.pressures_kpa();
        let free = pressures.map(|kpa| self.hand.free_ue(kpa, &self.castings));
        let curves: [Vec<f32>; FINGERS] =
            std::array::from_fn(|i| free.iter().map(|ue| rounded(ue[i], 1.0)).collect());
        json!({ "settings": { "values": by_number, "curves_ue": curves } }).to_string()
    }

    fn observation(&mut self, hub: &Hub, seen: &Observation) {
        self.count_dropped(seen.t_s);
        let shown = Shown {
            state: seen.state,
            lost: seen.lost,
            fault: seen.fault,
            gauge_fault: seen.gauge_fault,
        };
        let (is_new, is_due) = match &self.shown {
            Some((at, last)) => (*last != shown, at.elapsed() >= FRAME_PERIOD),
            None => (true, true),
        };
        if is_new || is_due {
            self.shown = Some((Instant::now(), shown));
            hub.put_frame(|n| {
                let view = self.view(n, seen);
                let mut sample = vec![json!(view.t_s)];
                sample.extend(view.residual_ue.iter().map(|ue| json!(ue)));
                sample.extend([json!(view.kpa), json!(view.set_kpa)]);
                Frame {
                    sample: Value::Array(sample).to_string(),
                    text: json!(view).to_string(),
                    is_urgent: is_new,
                }
            });
        }
    }

    /// Counts what should have come since the last observation; a clock that goes back is a new start.
    fn count_dropped(&mut self, now_s: Option<f64>) {
        if let (Some(now_s), Some(last_s), Some(period_s)) = (now_s, self.last_s, self.period_s) {
            let periods = (now_s - last_s) / period_s;
            self.dropped += (periods.round() as u64).saturating_sub(1);
        }
        self.last_s = now_s;
    }

    fn view(&self, n: u64, seen: &Observation) -> View {
        let free = seen
            .pressure_kpa
            .map(|kpa| self.hand.free_ue(kpa, &self.castings));
        // Where no strain is told, it is what the residual leaves of the free one.
        let strain: [Option<f32>; FINGERS] = std::array::from_fn(|i| {
            let left = || Some(free?[i] - seen.residual_ue[i]?);
            seen.strain_ue[i].or_else(left)
        });
        let links: [Option<[f32; LINKS]>; FINGERS] = std::array::from_fn(|i| {
            let links = self.hand.links_deg(i, strain[i]?, &self.castings)?;
            Some(links.map(|deg| rounded(deg, 10.0)))
        });
        View {
            n,
            t_s: (1e3 * seen.t_s.unwrap_or_default()).round() / 1e3,
            state: seen
                .state
                .and_then(|state| STATES.get(usize::from(state)).copied()),
            lost: (seen.lost == Some(true)).then(|| json!({ "words": loss(seen) })),
            fault: seen.fault,
            gauge_faults: seen.gauge_fault,
            tare_due: seen.tare_due,
            kpa: in_tenths(seen.pressure_kpa),
            set_kpa: in_tenths(seen.setpoint_kpa),
            bend_deg: in_tenths(seen.bend_deg),
            level: seen.level.map(|level| rounded(level, 1e3)),
            margin: seen.margin.map(|margin| rounded(margin, 1e3)),
            residual_ue: seen.residual_ue.map(whole),
            strain_ue: strain.map(whole),
            free_ue: std::array::from_fn(|i| whole(Some(free?[i]))),
            limit_ue: whole(
                seen.pressure_kpa
                    .map(|kpa| self.hand.contact_limit_ue(kpa, &self.castings)),
            ),
            noise_ue: seen.noise_ue.map(whole),
            drift_ue: seen.drift_ue.map(whole),
            touching: seen.touching,
            object: self.object(seen, &links),
            links_deg: links,
            free_deg: seen
                .pressure_kpa
                .map(|kpa| self.hand.free_links_deg(kpa).map(|deg| rounded(deg, 10.0))),
            dropped: self.dropped,
        }
    }

    /// What is held, as large as there is room for between the fingers.
    fn object(&self, seen: &Observation, links: &[Option<[f32; LINKS]>; FINGERS]) -> Option<Value> {
        let mut all = [[0.0; LINKS]; FINGERS];
        for (place, finger) in all.iter_mut().zip(links) {
            *place = (*finger)?;
        }
        let is_there = seen.holding == Some(true) && seen.lost != Some(true);
        let Ball {
            radius_mm,
            depth_mm,
        } = self.hand.ball(&all);
        is_there.then(|| json!({ "radius_mm": rounded(radius_mm, 10.0), "depth_mm": depth_mm }))
    }
}

/// A number with so many parts of one.
fn rounded(value: f32, parts: f32) -> f32 {
    (parts * value).round() / parts
}

fn whole(value: Option<f32>) -> Option<f32> {
    value.map(f32::round)
}

fn in_tenths(value: Option<f32>) -> Option<f32> {
    value.map(|value| rounded(value, 10.0))
}

/// How a loss showed, in words.
fn loss(seen: &Observation) -> String {
    let cause = seen.loss_cause.map(usize::from);
    let how = match cause.and_then(|cause| CAUSES.get(cause).copied()) {
        Some("collapse") => "the grip has collapsed",
        Some("one_sided") => "one finger has emptied",
        Some("missing") => "nothing was there after a change of pressure",
        _ => "how is not told",
    };
    match seen.loss_latency_ms {
        Some(ms) => format!("{how}, reported {ms:.0} ms after it began"),
        None => how.into(),
    }
}

fn field(field: &Field) -> Value {
    let limit = field.limit();
    let words = match field.kind {
        Kind::Choice(words) => Some(words),
        Kind::Number { .. } | Kind::Whole { .. } => None,
    };
    json!({
        "number": field.number,
        "name": field.name,
        "unit": field.unit,
        "min": limit.min,
        "max": limit.max,
        "whole": limit.whole,
        "words": words,
        "sentence": field.sentence,
    })
}

fn tell_event(hub: &Hub, event: &EventTold) {
    let level = match event.name.as_str() {
        "lost" | "fault" | "air_loss" => "alarm",
        "slip" | "refused" | "tare_due" | "clock_internal" => "warn",
        "holding" | "swept" | "tared" => "good",
        _ => "event",
    };
    let event = (event.t_s, event.name.as_str(), &*event.text);
    hub.put_line(|n| line(n, Some((event.0, event.1)), level, event.2, false));
}

fn end(hub: &Hub, level: &str, why: &str) {
    let text = format!("the source has ended: {why}");
    hub.put_line(|n| line(n, None, level, &text, true));
}

/// Tells the pages something that is no event.
pub fn note(hub: &Hub, text: &str) {
    hub.put_line(|n| line(n, None, "note", text, false));
}

/// A line of the log: its number, time and name if it is an event, and whether it is the last one.
fn line(n: u64, event: Option<(f64, &str)>, level: &str, text: &str, ended: bool) -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let line = json!({
        "n": n,
        "at_ms": now.unwrap_or_default().as_millis() as u64,
        "t_s": event.map(|(t_s, _)| t_s),
        "name": event.map(|(_, name)| name),
        "level": level,
        "text": text,
        "ended": ended,
    });
    json!({ "log": line }).to_string()
}
