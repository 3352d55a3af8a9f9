//! Contact → verdict: held, slipping, lost, or short of air.
//!
//! The signal is the residual summed over the fingers, over its value when the hold began. Arm motion moves
//! load from finger to finger but hardly changes the sum. Each hypothesis has its file: what it looks at, what
//! of it an arm does to a held object too, and its limits.
//!
//! ```text
//! plateau ─► shares ─► level ─┬─► collapse ──┐
//!                             ├─► slow ──────┼─► evidence ─► Lost
//!                             ├─► one_sided ─┘
//!                             └─► slip ─────────────────────► Slipping
//! Air ─────────────────────────► air ───────────────────────► AirLoss
//! ```

mod air;
mod collapse;
mod evidence;
mod level;
pub mod limits;
pub mod margins;
mod one_sided;
mod plateau;
mod shares;
mod slip;
mod slow;

use air::AirLoss;
use collapse::Collapse;
use evidence::Evidence;
use level::{Level, Smoothing};
use limits::{Limits, Signs};
use one_sided::OneSided;
use plateau::{CALM, Plateau, Reference};
use shares::Shares;
use slip::Slip;

use crate::air::Air;
use crate::command::Motion;
use crate::condition::Reading;
use crate::estimate::Contact;
use crate::math::larger;
use crate::units::{FINGERS, Instant, TICK_US};

/// What counts as a slip and as a loss, of the object or of air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Loss: fall of the summed residual, in percent of its plateau, that counts for nothing.
    pub loss_allowance_percent: f32,
    /// Loss: evidence at which the object is gone, as fall beyond the allowance times its duration.
    pub loss_evidence_percent_ms: f32,
    /// Slip: change of the summed residual at constant pressure, in percent of its plateau.
    pub slip_percent: f32,
    /// The air is going when the pressure lies this far below what the command should give.
    pub air_loss_kpa: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            loss_allowance_percent: 5.0,
            loss_evidence_percent_ms: 8.0,
            slip_percent: 7.0,
            air_loss_kpa: 8.0,
        }
    }
}

impl Settings {
    /// Of settings that are in their ranges.
    pub(crate) fn active(&self) -> Active {
        Active {
            loss_allowance: 0.01 * self.loss_allowance_percent,
            loss_evidence: 0.01 * self.loss_evidence_percent_ms * 1e3 / TICK_US as f32,
            slip: 0.01 * self.slip_percent,
            air_loss_kpa: self.air_loss_kpa,
        }
    }
}

/// The settings in the form that the control tick uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    /// Share of the plateau.
    pub(crate) loss_allowance: f32,
    /// Share of the plateau, times ticks.
    pub(crate) loss_evidence: f32,
    /// Share of the plateau.
    pub(crate) slip: f32,
    pub(crate) air_loss_kpa: f32,
}

/// What the detector makes of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// Nothing is held, so nothing can be lost.
    Unarmed,
    /// The object is where it was.
    Holding,
    /// The residual drifts at constant pressure.
    Slipping {
        /// Change of the normalised residual, 1/s.
        rate: f32,
    },
    /// The object is gone.
    Lost {
        /// When the collapse began.
        onset: Instant,
        /// How it showed.
        cause: LossCause,
        /// How far each finger's residual has fallen, as a share of its plateau; none without a usable
        /// gauge.
        evidence: [Option<f32>; FINGERS],
    },
    /// The pressure is going, and the grip with it.
    AirLoss,
}

/// How a loss showed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LossCause {
    /// The sum over the fingers collapsed.
    Collapse,
    /// One finger emptied while the others felt it go.
    OneSided,
    /// Nothing was there any more when the pressure had been changed.
    Missing,
}

/// How what is held is to be watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Watch {
    /// What the arm does.
    pub motion: Motion,
    /// Fingers that touched when the hold was recognised.
    pub carrying: [bool; FINGERS],
    /// The pressure is on its way to another set-point, so a residual that drifts is no slip, and air that
    /// lags behind is no air loss.
    pub pressure_changes: bool,
    /// The pressure is there, and the fingers follow the last of it: no slip is judged yet.
    pub fingers_follow: bool,
}

/// A latched loss.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Loss {
    /// When the collapse began, as estimated.
    pub onset: Instant,
    /// When it was reported.
    pub flagged: Instant,
    /// How it showed.
    pub cause: LossCause,
    /// How far each finger's residual had fallen when it was reported, as a share of its plateau; none
    /// without a usable gauge.
    pub evidence: [Option<f32>; FINGERS],
}

impl Loss {
    /// From the onset to the report, µs.
    pub fn latency_us(&self) -> u64 {
        self.flagged.micros_since(self.onset)
    }
}

/// A grip that still tightens changes by more before it is a slip.
const SETTLING_SLIP: f32 = 2.0;

/// What is known of the present hold.
#[derive(Debug, Clone, Copy)]
struct Hold {
    reference: Reference,
    level: Level,
    collapse: Collapse,
    one_sided: OneSided,
    evidence: Evidence,
    slip: Slip,
    /// The pressure has changed since the plateau was taken.
    outdated: bool,
}

/// The detector's memory.
#[derive(Debug, Clone, Copy)]
pub struct Detector {
    plateau: Plateau,
    smoothing: Smoothing,
    air: AirLoss,
    /// The present hold, or the one before.
    hold: Hold,
    holds: bool,
    signs: Signs,
}

impl Detector {
    /// Nothing held.
    pub fn new() -> Self {
        Self {
            plateau: Plateau::new(),
            smoothing: Smoothing::new(),
            air: AirLoss::NONE,
            hold: Hold::none(),
            holds: false,
            signs: Signs::NONE,
        }
    }

    /// The normalised residual, smoothed; none while nothing is held.
    pub fn level(&self) -> Option<f32> {
        self.holds.then_some(self.hold.level.value)
    }

    /// What was made of the last tick; none while nothing is held at a steady pressure.
    pub fn signs(&self) -> Option<Signs> {
        (self.holds && self.signs.steady).then_some(self.signs)
    }

    /// Judges one tick. `watch` is given while the supervisor believes that something is held; the first such
    /// tick, and the end of a change of the pressure, make the present plateau the reference.
    pub fn step(
        &mut self,
        now: Instant,
        reading: &Reading,
        contact: &Contact,
        air: &Air,
        watch: Option<Watch>,
        active: &Active,
    ) -> Verdict {
        let hold = self.holds.then_some(&mut self.hold.reference);
        self.plateau.step(contact, hold);
        let Some(watch) = watch else {
            self.holds = false;
            self.air = AirLoss::NONE;
            return Verdict::Unarmed;
        };
        if watch.pressure_changes {
            self.air = AirLoss::NONE;
        } else if self.air.step(air, active.air_loss_kpa) {
            return Verdict::AirLoss;
        }
        let (plateau, smoothing) = (&self.plateau, &self.smoothing);
        // A fall that has begun is judged against the plateau that it began from.
        let has_changed = self.hold.outdated && !watch.pressure_changes;
        if !self.holds || has_changed && self.hold.evidence.is_none() {
            self.hold.begin(now, plateau, watch.carrying);
            self.holds = true;
        }
        let tick = Tick {
            now,
            contact,
            noise_variance: &reading.noise_variance,
            watch,
        };
        self.hold
            .step(&tick, plateau, smoothing, active, &mut self.signs)
    }
}

/// One tick of a hold.
struct Tick<'a> {
    now: Instant,
    contact: &'a Contact,
    noise_variance: &'a [f32; FINGERS],
    watch: Watch,
}

impl Hold {
    /// None yet.
    fn none() -> Self {
        Self {
            reference: Reference::NONE,
            level: Level::START,
            collapse: Collapse::START,
            one_sided: OneSided::START,
            evidence: Evidence::none(Instant::default()),
            slip: Slip::NONE,
            outdated: false,
        }
    }

    /// Begins in place, field by field: a copy would make this tick the dearest, and its stack the deepest.
    #[inline(never)]
    fn begin(&mut self, now: Instant, plateau: &Plateau, carrying: [bool; FINGERS]) {
        self.reference.begin(now, plateau, carrying);
        self.level = Level::START;
        self.collapse = Collapse::START;
        self.one_sided = OneSided::START;
        self.evidence = Evidence::none(now);
        self.slip = Slip::NONE;
        self.outdated = false;
    }

    fn step(
        &mut self,
        tick: &Tick,
        plateau: &Plateau,
        smoothing: &Smoothing,
        active: &Active,
        signs: &mut Signs,
    ) -> Verdict {
        let &Tick {
            now,
            contact,
            noise_variance,
            watch,
        } = tick;
        signs.steady = false;
        self.outdated |= watch.pressure_changes;
        let settling = self.reference.settle(now, plateau, contact, watch.carrying);
        let tightens = self.outdated || settling;
        let (Some(shares), Some(lately)) = (
            Shares::of(&self.reference.plateau, contact, noise_variance),
            Shares::of(&self.reference.lately, contact, noise_variance),
        ) else {
            return Verdict::Holding;
        };
        let limits = Limits::of(watch.motion, shares.fingers);
        self.reference.follow_lately(plateau, contact);
        self.level.step(&shares, smoothing);

        let quick_fall = self
            .collapse
            .step(&shares, &self.level, smoothing, tightens, limits);
        let slow_fall = slow::fall(&shares, &lately);
        let quick = quick_fall - active.loss_allowance - limits.quick_allowance;
        let slow = slow_fall - limits.slow_allowance;
        let collapse = larger(quick, slow);
        let one_sided = self.one_sided.step(&shares, &lately, smoothing, limits);
        let (fall, cause) = match one_sided {
            Some(fall) if fall > collapse => (fall, LossCause::OneSided),
            _ if self.one_sided.is_felt() => (collapse, LossCause::Collapse),
            _ => (slow, LossCause::Collapse),
        };
        // What a free finger would lose at a lower pressure is no evidence.
        let sag = self.reference.sag_ue(contact) * shares.per_ue;
        *signs = Signs {
            steady: !tightens,
            collapse: quick_fall,
            slow: slow_fall,
            one_sided: one_sided.map(|fall| fall + limits.finger_allowance),
            sag,
            excess: fall - sag,
        };
        let lost = self.evidence.step(
            now,
            fall - sag,
            shares.variance,
            active.loss_allowance,
            active.loss_evidence,
        );
        if let Some(onset) = lost {
            return Verdict::Lost {
                onset,
                cause,
                evidence: self.reference.fallen(contact),
            };
        }

        if self.outdated || watch.fingers_follow {
            return Verdict::Holding;
        }
        let slip = limits.slip * active.slip;
        let slip = if settling { SETTLING_SLIP * slip } else { slip };
        // Where the pressure is steady, nothing swells.
        let swell = match settling {
            true => plateau.swell_ue(contact) * shares.per_ue,
            false => 0.0,
        };
        self.judge_slip(contact, plateau, slip, [swell, sag])
    }

    /// Whether the object moves in the grip, where it is not lost. Where nothing moves, the plateau follows creep.
    fn judge_slip(
        &mut self,
        contact: &Contact,
        plateau: &Plateau,
        limit: f32,
        [swell, sag]: [f32; 2],
    ) -> Verdict {
        if self.slip.step(&self.level, limit, swell, sag) {
            return Verdict::Slipping {
                rate: self.level.rate,
            };
        }
        if (self.level.value - 1.0).abs() < CALM && self.evidence.is_none() {
            self.reference.follow_creep(plateau, contact);
        }
        Verdict::Holding
    }
}

impl Default for Detector {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
