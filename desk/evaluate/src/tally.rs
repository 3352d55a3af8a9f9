//! Counts of false reports by activity.

use serde::{Deserialize, Serialize};

use crate::baselines::RULES;
use crate::cycle::Activity;

/// False reports that are kept in full, of each level of noise.
const KEPT: usize = 30;

/// Time and false reports during one activity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Count {
    /// Simulated time, s.
    pub time_s: f64,
    /// How often the activity occurred.
    pub times: u64,
    /// False reports of *lost*.
    pub lost: u64,
    /// False warnings of a slip: the object had not given way.
    pub slips: u64,
    /// False faults and false air losses.
    pub faults: u64,
}

impl std::ops::AddAssign for Count {
    fn add_assign(&mut self, other: Self) {
        self.time_s += other.time_s;
        self.times += other.times;
        self.lost += other.lost;
        self.slips += other.slips;
        self.faults += other.faults;
    }
}

/// A false report, so that it can be found again.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FalseAlarm {
    /// Noise of the gauges, µε.
    pub noise_ue: f64,
    /// Index of its block.
    pub block: u64,
    /// Time in that block, s.
    pub t_s: f64,
    /// The activity at the time.
    pub activity: Activity,
    /// The motion at the time, for a reader.
    pub detail: String,
    /// The false event, for a reader.
    pub event: String,
}

/// Time and false reports at one level of noise.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Tally {
    /// Noise of the gauges, µε.
    pub noise_ue: f64,
    /// By activity, in the order of [`Activity::ALL`].
    pub counts: [Count; Activity::ALL.len()],
    /// The false reports of *lost* and the faults; of a sum, the first ones.
    pub alarms: Vec<FalseAlarm>,
    /// The greatest score of every baseline in each hold, if they were compared.
    pub scores: Vec<[f32; RULES]>,
}

impl Tally {
    /// All counts zero.
    pub fn none(noise_ue: f64) -> Self {
        Self {
            noise_ue,
            counts: [Count::default(); Activity::ALL.len()],
            alarms: Vec::new(),
            scores: Vec::new(),
        }
    }

    /// Adds what was counted after this.
    pub fn add(&mut self, later: Self) {
        for (sum, count) in self.counts.iter_mut().zip(later.counts) {
            *sum += count;
        }
        self.alarms.extend(later.alarms);
        self.alarms.truncate(KEPT);
        self.scores.extend(later.scores);
    }

    /// Sum over all activities.
    pub fn total(&self) -> Count {
        let mut total = Count::default();
        for count in self.counts {
            total += count;
        }
        total
    }

    /// Sum over the activities of hard motion.
    pub fn hard_motion(&self) -> Count {
        let mut total = Count::default();
        for (activity, count) in Activity::ALL.iter().zip(self.counts) {
            if activity.is_hard_motion() {
                total += count;
            }
        }
        total
    }
}
