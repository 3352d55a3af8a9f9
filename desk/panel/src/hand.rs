//! What the gauges say about the shape of the fingers, and about what is between them.

use settings::Values;
use sim::setup::Setup;
use softgrip::estimate::GaugeSense;
use softgrip::settings::Settings;
use softgrip::table::{self, FingerTable, LINKS, LinkTable, ROWS};
use softgrip::units::{FINGERS, Kilopascals, Microstrain};

/// Heights at which the largest ball between the fingers is looked for, mm apart.
const STEP_MM: f32 = 0.5;
/// A finger's axis is looked at in so many places on each link.
const PLACES: usize = 6;

/// Three fingers.
#[derive(Debug, Clone)]
pub struct Hand {
    /// What a free finger shows.
    pub table: &'static FingerTable,
    links: LinkTable,
    /// Length of each link from the clamp, mm.
    pub links_mm: [f32; LINKS],
    /// Distance of the clamps from the gripper's axis, mm.
    pub palm_mm: f32,
    /// Distance of a finger's surface from its links, mm.
    pub radius_mm: f32,
}

/// The largest ball that has room between the fingers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its radius, mm.
    pub radius_mm: f32,
    /// Its centre below the palm, mm.
    pub depth_mm: f32,
}

/// What the settings say of the mounted fingers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Castings {
    gain: [f32; FINGERS],
    stiffness: [f32; FINGERS],
    sense: GaugeSense,
    contact_ue: f32,
    contact_share: f32,
}

impl Castings {
    /// Of these settings.
    pub fn of(values: &Values) -> Self {
        let settings = Settings::of(values).finger;
        Self {
            gain: settings.free_bend_gain,
            stiffness: settings.stiffness,
            sense: settings.gauge_sense,
            contact_ue: settings.contact_ue,
            contact_share: 0.01 * settings.contact_percent,
        }
    }
}

impl Hand {
    /// Of a gripper whose fingers are the recipe's.
    pub fn of(setup: &Setup) -> Self {
        let mm = |m: f64| (1e3 * m) as f32;
        Self {
            table: setup.table(),
            links: finger::table::links(&setup.chain),
            links_mm: setup.chain.link_length_m.map(mm),
            palm_mm: mm(setup.grasp.palm_radius_m),
            radius_mm: mm(setup.grasp.link_radius_m),
        }
    }

    /// Pressures of the rows of the table, kPa.
    pub fn pressures_kpa(&self) -> [f32; ROWS] {
        let step = self.table.max_pressure_kpa / (ROWS - 1) as f32;
        std::array::from_fn(|row| step * row as f32)
    }

    /// What the gauge of each finger shows while the finger is free and has come to rest, µε.
    pub fn free_ue(&self, kpa: f32, castings: &Castings) -> [f32; FINGERS] {
        std::array::from_fn(|i| {
            let alike = Kilopascals(kpa / castings.stiffness[i]);
            let (strain, _) = table::free_strain(self.table, alike);
            match castings.sense {
                GaugeSense::Bend => castings.gain[i] * strain.0,
                GaugeSense::Contact => 0.0,
            }
        })
    }

    /// Residual that contact must exceed at a pressure, µε.
    pub fn contact_limit_ue(&self, kpa: f32, castings: &Castings) -> f32 {
        let (free, _) = table::free_strain(self.table, Kilopascals(kpa));
        castings.contact_ue + castings.contact_share * free.0
    }

    /// Angle of each link of a free finger at a pressure, °.
    pub fn free_links_deg(&self, kpa: f32) -> [f32; LINKS] {
        let (angles, _) = table::link_angles(&self.links, Kilopascals(kpa));
        angles.map(|angle| angle.0)
    }

    /// Angle of each link of a finger whose gauge shows this strain, as if it were bent as a free one, °. Gauges that see
    /// contact alone say nothing of it: none.
    pub fn links_deg(
        &self,
        finger: usize,
        strain_ue: f32,
        castings: &Castings,
    ) -> Option<[f32; LINKS]> {
        let is_bend = castings.sense == GaugeSense::Bend;
        let gain = castings.gain.get(finger).filter(|_| is_bend)?;
        let (pressure, _) = table::pressure_for_strain(self.table, Microstrain(strain_ue / gain));
        Some(self.free_links_deg(pressure.0))
    }

    /// The largest ball on the gripper's axis that has room between three fingers that are bent so, on the average.
    pub fn ball(&self, links_deg: &[[f32; LINKS]; FINGERS]) -> Ball {
        let mean: [f32; LINKS] = std::array::from_fn(|i| {
            links_deg.iter().map(|deg| deg[i]).sum::<f32>() / FINGERS as f32
        });
        let axis = self.axis_mm(&mean);
        let deepest = axis.iter().fold(0.0_f32, |deepest, [_, z]| deepest.max(*z));
        let mut best = Ball {
            radius_mm: 0.0,
            depth_mm: 0.0,
        };
        let mut depth_mm = 0.0;
        while depth_mm < deepest {
            // The palm is in the way, too.
            let room = axis
                .iter()
                .map(|[r, z]| r.hypot(z - depth_mm) - self.radius_mm)
                .fold(depth_mm, f32::min);
            if room > best.radius_mm {
                best = Ball {
                    radius_mm: room,
                    depth_mm,
                };
            }
            depth_mm += STEP_MM;
        }
        best
    }

    /// Places on the axis of a finger from the clamp on, mm: from the gripper's axis, and below the palm.
    fn axis_mm(&self, links_deg: &[f32; LINKS]) -> Vec<[f32; 2]> {
        let mut at = [self.palm_mm, 0.0];
        let mut axis = vec![at];
        for (length, deg) in self.links_mm.iter().zip(links_deg) {
            let (sine, cosine) = deg.to_radians().sin_cos();
            for _ in 0..PLACES {
                at[0] -= length * sine / PLACES as f32;
                at[1] += length * cosine / PLACES as f32;
                axis.push(at);
            }
        }
        axis
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::sync::LazyLock;

    static HAND: LazyLock<Hand> = LazyLock::new(|| {
        let text = include_str!("../../../recipes/rtv225.toml");
        let recipe = finger::recipe::parse(Path::new("rtv225.toml"), text).expect("a recipe");
        Hand::of(&Setup::of(&recipe).expect("a gripper"))
    });

    fn castings() -> Castings {
        Castings::of(&Values::DEFAULT)
    }

    #[test]
    fn a_free_finger_is_drawn_as_it_bends_at_its_pressure() {
        let (hand, castings) = (&*HAND, castings());
        for kpa in [0.0, 60.0, 100.0, 141.3, 160.0] {
            let [strain, ..] = hand.free_ue(kpa, &castings);
            let links = hand.links_deg(0, strain, &castings).expect("bending");
            for (drawn, free) in links.iter().zip(hand.free_links_deg(kpa)) {
                assert!((drawn - free).abs() < 0.01, "{kpa}: {drawn} {free}");
            }
        }
    }

    #[test]
    fn a_casting_is_taken_into_account_in_what_is_expected_and_in_what_is_drawn() {
        let hand = &*HAND;
        let mut values = Values::DEFAULT;
        values.set(221, 1.25).expect("in range");
        values.set(231, 1.1).expect("in range");
        let castings = Castings::of(&values);
        let [first, second, third] = hand.free_ue(110.0, &castings);
        let [softer, ..] = hand.free_ue(100.0, &castings);
        assert_eq!(first, third);
        assert!((second - 1.25 * softer).abs() < 1.0, "{second} {softer}");
        let links = hand.links_deg(1, second, &castings).expect("bending");
        let [.., tip] = links;
        let [.., expected] = hand.free_links_deg(100.0);
        assert!((tip - expected).abs() < 0.01, "{tip} {expected}");
    }

    #[test]
    fn gauges_that_see_contact_alone_expect_nothing_and_draw_nothing() {
        let hand = &*HAND;
        let mut values = Values::DEFAULT;
        values.set(200, 1.0).expect("in range");
        let castings = Castings::of(&values);
        assert_eq!(hand.free_ue(140.0, &castings), [0.0; FINGERS]);
        assert_eq!(hand.links_deg(0, 1_000.0, &castings), None);
    }

    #[test]
    fn straight_fingers_leave_room_for_what_the_palm_allows_and_bent_ones_for_less() {
        let hand = &*HAND;
        let open = hand.ball(&[[0.0; LINKS]; FINGERS]);
        let most = hand.palm_mm - hand.radius_mm;
        assert!((open.radius_mm - most).abs() < 0.1, "{open:?}, {most}");
        let bent = hand.ball(&[hand.free_links_deg(120.0); FINGERS]);
        assert!(bent.radius_mm < open.radius_mm, "{bent:?}");
        assert!(bent.depth_mm >= bent.radius_mm, "{bent:?}");
    }
}
