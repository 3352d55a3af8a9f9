//! How the fingers close: freely until they meet, or held up by what lies between them.
//!
//! Fingers that have met leave a residual as an object does, and where they stop bending a large sphere may stop
//! them, too. The way there tells: an object holds them up before they meet, so that on the way they lack strain
//! that free fingers would show. The mean over the fingers is looked at, because their own weight bends one further
//! and the others less. A finger that inflates faster than its model lacks nothing; a slower one does, and its empty
//! close passes for a grip.

use crate::estimate::{Contact, Meeting};
use crate::math::{lag_gain, larger, smaller};

/// Averaging of the strains, ms.
const AVERAGE_MS: f32 = 10.0;
/// The fingers are open below this share of the strain at which free ones meet.
const OPEN: f32 = 0.3;
/// From this share on, what they lack counts: an object as wide as two thirds of the palm has long been touched. What
/// they lack until then is taken for their own weight, which grows with their bend, …
const JUDGED: f32 = 0.4;
/// … up to this share of what a weightless finger shows.
const WEIGHT: f32 = 0.15;
/// Beyond this share of the strain at which they meet, …
const BEYOND: f32 = 1.15;
/// … fingers that lack a lot bend around something small. Fingers that have met press on one another and bend back by more
/// than this.
const BENDS_BACK: f32 = 0.025;
/// Fingers that have been ahead of their model by this share hide what they lack: where they come to rest close to where
/// they would meet, they must bend back to have met.
const AHEAD: f32 = 0.2;
const CLOSE: f32 = 1.05;
/// Beyond this share there is nothing between the fingers; they have passed one another.
const PASSED: f32 = 1.45;

/// The mean over the fingers since they were open.
#[derive(Debug, Clone, Copy)]
pub(super) struct Approach {
    gain: f32,
    /// They have been seen open.
    seen: bool,
    /// Mean strain, averaged over [`AVERAGE_MS`], µε, and the largest so far.
    mean_ue: f32,
    peak_ue: f32,
    /// What it lacks of a free finger's strain, or of the one where free fingers meet, averaged alike, µε, …
    lack_ue: f32,
    /// … which is taken for this share of a weightless one's strain, …
    weighted: f32,
    /// … and lacked at most; nothing yet where the pressure was too low to tell.
    lacked_ue: Option<f32>,
    /// What they have been ahead of it at most, µε.
    ahead_ue: f32,
}

impl Approach {
    /// Fingers that have not been seen open.
    pub fn unseen() -> Self {
        Self {
            gain: lag_gain(AVERAGE_MS),
            seen: false,
            mean_ue: 0.0,
            peak_ue: 0.0,
            lack_ue: 0.0,
            weighted: 1.0,
            lacked_ue: None,
            ahead_ue: 0.0,
        }
    }

    /// Takes one tick in which nothing is held.
    /// `meeting`: none where free fingers do not meet.
    pub fn step(&mut self, contact: &Contact, meeting: Option<Meeting>) {
        let (Some(mean), Some(meeting)) = (contact.mean, meeting) else {
            return;
        };
        let met_ue = meeting.strain_ue;
        let (mean_ue, free_ue) = (mean.0, contact.free.0);
        let lack_ue = self.weighted * smaller(free_ue, met_ue) - mean_ue;
        if free_ue < OPEN * met_ue {
            *self = Self {
                gain: self.gain,
                seen: true,
                mean_ue,
                peak_ue: mean_ue,
                lack_ue,
                weighted: 1.0,
                lacked_ue: None,
                ahead_ue: 0.0,
            };
            return;
        }
        self.mean_ue += self.gain * (mean_ue - self.mean_ue);
        self.lack_ue += self.gain * (lack_ue - self.lack_ue);
        self.peak_ue = larger(self.peak_ue, self.mean_ue);
        if self.lacked_ue.is_none() && free_ue < JUDGED * met_ue {
            self.weighted = larger(smaller(self.mean_ue / free_ue, 1.0), 1.0 - WEIGHT);
        } else if self.seen {
            // What they bend back from where they have met is no lack.
            let lack_ue = self.lack_ue - (self.peak_ue - self.mean_ue);
            let most = self.lacked_ue.unwrap_or(lack_ue);
            self.lacked_ue = Some(larger(most, lack_ue));
            if free_ue < met_ue {
                self.ahead_ue = larger(self.ahead_ue, -self.lack_ue);
            }
        }
    }

    /// Whether the fingers have closed freely, and are free or have met.
    pub fn is_free(&self, contact: &Contact, meeting: Option<Meeting>) -> bool {
        let (Some(lacked_ue), Some(meeting)) = (self.lacked_ue, meeting) else {
            return false;
        };
        let met_ue = meeting.strain_ue;
        let free_ue = contact.free.0;

        if self.mean_ue > PASSED * met_ue {
            return true;
        }
        let back_ue = self.peak_ue - self.mean_ue;
        let hides = match self.mean_ue > BEYOND * met_ue {
            true => self.mean_ue < meeting.around * free_ue,
            false => self.mean_ue < CLOSE * met_ue && self.ahead_ue > AHEAD * met_ue,
        };
        if hides && back_ue < BENDS_BACK * met_ue {
            return false;
        }
        lacked_ue < meeting.lacks_at_most_ue
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Settings;
    use crate::table::{self, FINGER, Range};
    use crate::units::{Degrees, FINGERS, Kilopascals, Microstrain};

    /// What a free finger shows at 140 kPa, µε.
    fn far_ue() -> f32 {
        table::free_strain(&FINGER, Kilopascals(140.0)).0.0
    }

    fn met() -> Option<Meeting> {
        Settings::default().active(&FINGER).meeting
    }

    /// What a free finger shows where the fingers meet, µε.
    fn met_ue() -> f32 {
        let meeting = FINGER.meeting_kpa.expect("fingers that meet");
        table::free_strain(&FINGER, Kilopascals(meeting)).0.0
    }

    fn contact(mean_ue: f32, free_ue: f32) -> Contact {
        Contact {
            residual: [mean_ue; FINGERS].map(|mean_ue| Some(Microstrain(free_ue - mean_ue))),
            touching: [true; FINGERS],
            mean: Some(Microstrain(mean_ue)),
            free: Microstrain(free_ue),
            bend: Degrees(60.0),
            range: Range::Inside,
            known: true,
        }
    }

    /// Whether fingers have closed freely that show `mean` of what free ones do, while these go from one strain to
    /// another in two seconds and then stay for one.
    fn close(
        approach: &mut Approach,
        met: Option<Meeting>,
        [from_ue, to_ue]: [f32; 2],
        mean: impl Fn(f32) -> f32,
    ) -> bool {
        for ms in 0..3_000 {
            let share = (ms as f32 / 2_000.0).min(1.0);
            let free_ue = from_ue + share * (to_ue - from_ue);
            approach.step(&contact(mean(free_ue), free_ue), met);
        }
        approach.is_free(&contact(mean(to_ue), to_ue), met)
    }

    fn closes_freely(mean: impl Fn(f32) -> f32) -> bool {
        close(&mut Approach::unseen(), met(), [0.0, far_ue()], mean)
    }

    #[test]
    fn fingers_that_close_until_they_meet_have_closed_freely_whatever_gauges_and_weight_make_of_it()
    {
        for gain in [0.9, 1.0, 1.1] {
            for weight in [0.95, 1.0] {
                let met = |free: f32| gain * (weight * free).min(met_ue());
                assert!(closes_freely(met), "{gain} {weight}");
            }
        }
        // They press on one another and bend back.
        let back = |free: f32| free.min(met_ue()) - 0.1 * (free - met_ue()).max(0.0);
        assert!(closes_freely(back));
        // They pass one another.
        assert!(closes_freely(|free| free));
    }

    #[test]
    fn an_object_holds_them_up_before_they_meet() {
        for at in [0.3, 0.5, 0.6, 0.9] {
            // They go on bending by a fifth around it.
            let stop_ue = at * met_ue();
            let stopped = |free: f32| free.min(stop_ue + 0.2 * (free - stop_ue));
            assert!(!closes_freely(stopped), "{at}");
        }
    }

    #[test]
    fn what_was_held_before_is_forgotten_when_they_open() {
        let mut approach = Approach::unseen();
        let mut closes = |stop_ue: f32| {
            let free = [0.0, far_ue()];
            close(&mut approach, met(), free, |free| free.min(stop_ue))
        };
        assert!(!closes(0.4 * met_ue()));
        assert!(closes(met_ue()));
        assert!(!closes(0.4 * met_ue()));
    }

    #[test]
    fn fingers_that_bend_far_beyond_where_they_meet_and_still_lack_a_lot_have_a_small_object_in_them()
     {
        let stops = |at: f32| move |free: f32| free.min(at * met_ue());
        assert!(1.3 * met_ue() < 0.7 * far_ue());
        assert!(!closes_freely(stops(1.3)));
        assert!(closes_freely(stops(1.1)));
    }

    #[test]
    fn fingers_ahead_of_their_model_must_bend_back_to_have_met() {
        // By a quarter of the strain at which they meet.
        let ahead = |free: f32| (free + 0.25 * met_ue()).min(met_ue());
        assert!(!closes_freely(ahead));
        let back = |free: f32| ahead(free) - 0.1 * (free - met_ue()).max(0.0);
        assert!(closes_freely(back));
    }

    #[test]
    fn nothing_is_known_without_an_approach_a_mean_strain_or_a_place_where_they_meet() {
        // The program starts under pressure.
        let under_pressure = [0.5 * met_ue(), far_ue()];
        let stops = |free: f32| free.min(met_ue());
        assert!(!close(
            &mut Approach::unseen(),
            met(),
            under_pressure,
            stops
        ));
        let free = [0.0, far_ue()];
        assert!(!close(&mut Approach::unseen(), None, free, stops));
        let mut approach = Approach::unseen();
        for ms in 0..2_000 {
            let free_ue = ms as f32 / 2_000.0 * far_ue();
            let blind = Contact {
                mean: None,
                ..contact(0.0, free_ue)
            };
            approach.step(&blind, met());
        }
        assert!(!approach.is_free(&contact(met_ue(), far_ue()), met()));
    }
}
