//! The best position of the gauge on the finger: gauges over every span of the finger, compared on the same
//! random grasps.

pub mod chart;
pub mod judge;
pub mod record;

use std::fmt::Write;

use finger::chain::{Chain, LINKS};
use report::json::round;
use serde_json::{Value, json};
use sim::scenario::ObjectKind;
use sim::setup::Setup;

use judge::{Floor, ObjectResult, Span, judge, quantile};
use record::{Grasps, HELD_ACCELS_M_S2, Wanted, grasps};

/// Spans begin and end on multiples of this, m.
const GRID_M: f64 = 0.005;
/// The chain's joints stand for 18 mm; anything shorter than this is not told apart, m.
const SHORTEST_M: f64 = 0.015;
/// A place that is so much worse than the best one is as good, as a share.
const AS_GOOD: f64 = 0.05;
/// The objects, in the order of [`SpanResult::seen`].
pub const OBJECTS: [ObjectKind; 2] = [ObjectKind::Sphere, ObjectKind::Cylinder];

/// A span with its results.
#[derive(Debug, Clone)]
pub struct SpanResult {
    /// Position of the gauge.
    pub span: Span,
    /// Results for each of [`OBJECTS`].
    pub seen: [ObjectResult; 2],
}

impl SpanResult {
    /// Whether it detects every loss.
    fn misses_nothing(&self) -> bool {
        let ms = self.seen.iter().flat_map(|seen| &seen.loss_ms);
        ms.into_iter().all(|ms| ms.is_finite())
    }

    fn slip_m(&self) -> [f64; 2] {
        self.seen.each_ref().map(|seen| quantile(&seen.slip_m, 0.9))
    }
}

/// Results of all spans and of the one in the recipe.
pub struct GaugeStudy {
    /// Seed of the random grasps.
    pub seed: u64,
    /// Disturbances that a slip must exceed.
    pub floor: Floor,
    /// Grasps of each object.
    pub wanted: Wanted,
    /// Stretches of the finger, by their start and then by their end.
    pub spans: Vec<SpanResult>,
    /// The span in the recipe.
    pub recipe: SpanResult,
}

/// Runs the grasps of each object once and judges every span by them. `done` is called after each grasp.
///
/// # Errors
/// If too few random grasps are lost or held as wanted.
pub fn study(
    setup: &Setup,
    seed: u64,
    floor: Floor,
    wanted: Wanted,
    done: impl Fn() + Sync,
) -> anyhow::Result<GaugeStudy> {
    let mut all: Vec<Grasps> = Vec::new();
    for object in OBJECTS {
        let mut setup = setup.clone();
        setup.scenario.object = object;
        all.push(grasps(&setup, seed, wanted, &done)?);
    }
    let chain = &setup.chain;
    let result = |span| SpanResult {
        span,
        seen: std::array::from_fn(|i| judge(span, chain, &all[i], floor)),
    };
    Ok(GaugeStudy {
        seed,
        floor,
        wanted,
        spans: spans(chain).into_iter().map(result).collect(),
        recipe: result(Span {
            from_m: chain.gauge.from_m,
            to_m: chain.gauge.to_m,
        }),
    })
}

fn spans(chain: &Chain) -> Vec<Span> {
    // The last link is the solid tip.
    let length_m: f64 = chain.link_length_m[..LINKS - 1].iter().sum();
    let places = (length_m / GRID_M).round() as usize;
    let shortest = (SHORTEST_M / GRID_M).round() as usize;
    let place = |n: usize| GRID_M * n as f64;
    let from = |from: usize| {
        (from + shortest..=places).map(move |to| Span {
            from_m: place(from),
            to_m: place(to),
        })
    };
    (0..places).flat_map(from).collect()
}

impl GaugeStudy {
    /// How much further, on the geometric mean of both objects, the object has slid in nine of ten losses when
    /// this span warns, than with the best span for each. Infinite for one that misses a loss.
    fn cost(&self, result: &SpanResult) -> f64 {
        if !result.misses_nothing() {
            return f64::INFINITY;
        }
        let least = |i: usize| {
            let slips = self.spans.iter().map(|result| result.slip_m()[i]);
            slips.fold(f64::INFINITY, f64::min)
        };
        let slip_m = result.slip_m();
        (slip_m[0] / least(0) * slip_m[1] / least(1)).sqrt()
    }

    /// The span that warns earliest.
    pub fn best(&self) -> &SpanResult {
        let mut best = &self.recipe;
        for result in &self.spans {
            if self.cost(result) < self.cost(best) {
                best = result;
            }
        }
        best
    }

    /// The recommendation as text.
    pub fn recommendation(&self) -> String {
        let best = self.best();
        let limit = (1.0 + AS_GOOD) * self.cost(best);
        let good = self
            .spans
            .iter()
            .filter(|result| self.cost(result) <= limit);
        let ends = good.filter(|result| result.span.from_m == 0.0);
        let ends: Vec<_> = ends.map(|result| 1e3 * result.span.to_m).collect();
        let as_good = match (ends.first(), ends.last()) {
            (Some(first), Some(last)) => format!(
                "From the clamp any end between {first:.0} and {last:.0} mm is within {:.0} % of that.",
                1e2 * AS_GOOD
            ),
            _ => "No span from the clamp is as good.".into(),
        };
        let [sphere, cylinder] = &best.seen;
        let worse = self.cost(&self.recipe) / self.cost(best) - 1.0;
        let verdict = match worse {
            worse if worse.is_infinite() => "it misses losses".to_string(),
            worse if worse <= AS_GOOD => format!("it is {:.0} % worse and may stay", 1e2 * worse),
            worse => format!("it is {:.0} % worse", 1e2 * worse),
        };
        let [sphere_m, cylinder_m] = self.recipe.slip_m();
        format!(
            "With a drift of {} %, bond the gauge from {} mm. In nine of ten losses a sphere has then slid {:.1} mm and a cylinder {:.0} mm when the residual sum tells it from a held one, and the sum collapses {:.0} and {:.0} ms (median) after the first sliding. {as_good} At the recipe's place, {} mm, they have slid {} and {} mm: {verdict}.",
            1e2 * self.floor.drift,
            place(best.span),
            1e3 * quantile(&sphere.slip_m, 0.9),
            1e3 * quantile(&cylinder.slip_m, 0.9),
            quantile(&sphere.loss_ms, 0.5),
            quantile(&cylinder.loss_ms, 0.5),
            place(self.recipe.span),
            number(1e3 * sphere_m, 1),
            number(1e3 * cylinder_m, 0),
        )
    }

    /// Selected spans and the recommendation, as text.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{} losses and {} held grasps of each object, seed {}, {} µε of noise, {} % of drift\n\n",
            self.wanted.lost,
            HELD_ACCELS_M_S2.len() * self.wanted.held,
            self.seed,
            self.floor.noise_ue,
            1e2 * self.floor.drift,
        );
        out += "                             held, %   warning     slid, mm    warned  signal    loss\n";
        out += "span, mm                     5 10 m/s²    at, %   p50     p90  by 15 mm  / held  p50 ms\n";
        let coarse = |span: Span| {
            let on = |m: f64| ((1e3 * m).round() as usize).is_multiple_of(15);
            on(span.from_m) && on(span.to_m)
        };
        let rows = self.spans.iter().filter(|result| coarse(result.span));
        let named = [("recipe", &self.recipe), ("best", self.best())];
        let rows = named.into_iter().chain(rows.map(|result| ("", result)));
        for (name, result) in rows {
            for (object, seen) in OBJECTS.iter().zip(&result.seen) {
                // Writing to a String cannot fail.
                let _ = writeln!(
                    out,
                    "{:<9} {name:<6} {object:<8} {:>5.1} {:>7.1} {:>8.1} {:>5} {:>7} {:>7.0} % {:>7.1} {:>7}",
                    place(result.span),
                    1e2 * seen.held[0],
                    1e2 * seen.held[1],
                    1e2 * seen.threshold,
                    number(1e3 * quantile(&seen.slip_m, 0.5), 1),
                    number(1e3 * quantile(&seen.slip_m, 0.9), 1),
                    1e2 * seen.early(),
                    quantile(&seen.signal, 0.5),
                    number(quantile(&seen.loss_ms, 0.5), 0),
                );
            }
        }
        let _ = writeln!(out, "\n{}", self.recommendation());
        out
    }

    /// The study as JSON; what never happens is null.
    pub fn json(&self) -> Value {
        json!({
            "seed": self.seed,
            "noise_ue": self.floor.noise_ue,
            "drift_percent": round(1e2 * self.floor.drift, 3),
            "lost_per_object": self.wanted.lost,
            "held_per_object_and_acceleration": self.wanted.held,
            "recipe": json(&self.recipe),
            "best": json(self.best()),
            "recommendation": self.recommendation(),
            "spans": self.spans.iter().map(json).collect::<Vec<_>>(),
        })
    }
}

fn json(result: &SpanResult) -> Value {
    let seen = |seen: &ObjectResult| {
        let finite = |x: f64, decimals| x.is_finite().then(|| round(x, decimals));
        let both = |sorted: &[f64], scale: f64| {
            json!({
                "p50": finite(scale * quantile(sorted, 0.5), 1),
                "p90": finite(scale * quantile(sorted, 0.9), 1),
            })
        };
        json!({
            "plateau_ue": round(seen.plateau_ue, 0),
            "held_5_m_s2_percent": round(1e2 * seen.held[0], 2),
            "held_10_m_s2_percent": round(1e2 * seen.held[1], 2),
            "threshold_percent": round(1e2 * seen.threshold, 2),
            "signal_over_shaking": round(quantile(&seen.signal, 0.5), 2),
            "slip_mm": both(&seen.slip_m, 1e3),
            "warned_before_15_mm": round(seen.early(), 3),
            "loss_ms": both(&seen.loss_ms, 1.0),
            "loss_mm": both(&seen.loss_m, 1e3),
        })
    };
    json!({
        "from_mm": round(1e3 * result.span.from_m, 3),
        "to_mm": round(1e3 * result.span.to_m, 3),
        "sphere": seen(&result.seen[0]),
        "cylinder": seen(&result.seen[1]),
    })
}

fn place(span: Span) -> String {
    format!("{:.0} to {:.0}", 1e3 * span.from_m, 1e3 * span.to_m)
}

fn number(x: f64, decimals: usize) -> String {
    match x.is_finite() {
        true => format!("{x:.decimals$}"),
        false => "never".into(),
    }
}
