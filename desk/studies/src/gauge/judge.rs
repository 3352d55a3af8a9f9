//! How well a gauge over one span of the finger detects slips and losses, compared with held objects.

use finger::chain::{Chain, Gauge, LINKS};

use super::record::{Grasps, Record};

/// Ticks before the lift that make the plateau.
const PLATEAU_TICKS: usize = 100;
/// Noise stays below this many standard deviations in a working day of ticks.
const SIGMAS: f64 = 5.0;
/// A slip must exceed the greatest signal of held objects by this factor.
const ABOVE_HELD: f64 = 1.5;
/// A loss begins when the residual sum leaves this share of its plateau for good.
const COLLAPSE: f64 = 0.9;
/// A warning is early if it comes before the object has slid this far, m.
pub const EARLY_M: f64 = 0.015;

/// Disturbances that a slip must exceed, besides the signals of held objects.
#[derive(Debug, Clone, Copy)]
pub struct Floor {
    /// Noise of a gauge, rms at the control tick, µε.
    pub noise_ue: f64,
    /// Change of the residual sum that creep and drift may make, as a share of its plateau.
    pub drift: f64,
}

/// A stretch of the finger, from the clamp, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// End at the clamp, m from the clamp.
    pub from_m: f64,
    /// End at the tip, m from the clamp.
    pub to_m: f64,
}

impl Span {
    /// Strain per angle of each joint, µε/rad.
    fn weights(self, chain: &Chain) -> [f64; LINKS] {
        let moved = Chain {
            gauge: Gauge {
                from_m: self.from_m,
                to_m: self.to_m,
                ..chain.gauge
            },
            ..chain.clone()
        };
        std::array::from_fn(|joint| {
            moved.gauge_strain_ue(&std::array::from_fn(|i| f64::from(u8::from(i == joint))))
        })
    }
}

/// Signals of one kind of object. Vectors are sorted over the lost grasps; infinite where nothing was
/// detected.
#[derive(Debug, Clone)]
pub struct ObjectResult {
    /// Median of the residual sum before the lift, µε.
    pub plateau_ue: f64,
    /// Greatest change of the residual sum of a held object, as a share of its plateau, at each
    /// acceleration.
    pub held: [f64; 2],
    /// Change that is taken for a slip, as a share of the plateau: the median over the runs.
    pub threshold: f64,
    /// Greatest change while the object slides its first 15 mm, over what held objects did.
    pub signal: Vec<f64>,
    /// Slide at the detection of the slip, m.
    pub slip_m: Vec<f64>,
    /// Time from the first slide to the collapse of the residual sum, ms.
    pub loss_ms: Vec<f64>,
    /// Slide at the collapse, m.
    pub loss_m: Vec<f64>,
}

impl ObjectResult {
    /// Share of the losing runs with a warning before 15 mm.
    pub fn early(&self) -> f64 {
        let early = self.slip_m.iter().filter(|&&m| m < EARLY_M).count();
        early as f64 / self.slip_m.len() as f64
    }
}

/// The value below which a share of sorted values lies.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

/// The residual sum of one run over its plateau, from the lift on, and the plateau, µε.
fn normalised(record: &Record, weights: &[f64; LINKS]) -> (Vec<f64>, f64) {
    let sum =
        |withheld: &[f64; LINKS]| -> f64 { (0..LINKS).map(|i| weights[i] * withheld[i]).sum() };
    let before = &record.withheld_rad[record.lift - PLATEAU_TICKS..record.lift];
    let plateau = before.iter().map(sum).sum::<f64>() / PLATEAU_TICKS as f64;
    let lifted = record.withheld_rad[record.lift..].iter();
    (
        lifted.map(|withheld| sum(withheld) / plateau).collect(),
        plateau,
    )
}

/// Judges a span by the grasps of one kind of object.
pub fn judge(span: Span, chain: &Chain, grasps: &Grasps, floor: Floor) -> ObjectResult {
    let weights = span.weights(chain);
    let held = grasps.held.each_ref().map(|records| {
        let changes = records
            .iter()
            .map(|record| greatest(&normalised(record, &weights).0));
        changes.fold(0.0, f64::max)
    });
    let shaken = held[0].max(held[1]);
    let noise_ue = 3f64.sqrt() * floor.noise_ue;
    let mut seen = ObjectResult {
        plateau_ue: 0.0,
        held,
        threshold: 0.0,
        signal: Vec::new(),
        slip_m: Vec::new(),
        loss_ms: Vec::new(),
        loss_m: Vec::new(),
    };
    let (mut plateaus, mut thresholds) = (Vec::new(), Vec::new());
    for record in &grasps.lost {
        let Some(slides) = record.slides().map(|tick| tick - record.lift) else {
            continue;
        };
        let (x, plateau) = normalised(record, &weights);
        let moved = &record.moved_m[record.lift..];
        let threshold = floor
            .drift
            .max(ABOVE_HELD * shaken)
            .max(SIGMAS * noise_ue / plateau);
        let slip = x.iter().position(|x| (x - 1.0).abs() > threshold);
        let far = slides + moved[slides..].iter().take_while(|&&m| m < EARLY_M).count();
        let loss = x
            .iter()
            .rposition(|&x| x >= COLLAPSE)
            .map_or(0, |tick| tick + 1);
        let at = |tick: Option<usize>| tick.and_then(|tick| moved.get(tick).copied());
        plateaus.push(plateau);
        thresholds.push(threshold);
        seen.signal.push(greatest(&x[slides..far]) / shaken);
        seen.slip_m.push(at(slip).unwrap_or(f64::INFINITY));
        seen.loss_m.push(at(Some(loss)).unwrap_or(f64::INFINITY));
        let late = match loss < x.len() {
            true => loss as f64 - slides as f64,
            false => f64::INFINITY,
        };
        seen.loss_ms.push(late);
    }
    for values in [
        &mut plateaus,
        &mut thresholds,
        &mut seen.signal,
        &mut seen.slip_m,
        &mut seen.loss_ms,
        &mut seen.loss_m,
    ] {
        values.sort_by(f64::total_cmp);
    }
    seen.plateau_ue = quantile(&plateaus, 0.5);
    seen.threshold = quantile(&thresholds, 0.5);
    seen
}

/// Greatest change against the plateau.
fn greatest(x: &[f64]) -> f64 {
    x.iter().map(|x| (x - 1.0).abs()).fold(0.0, f64::max)
}
