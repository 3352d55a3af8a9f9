//! The three fingers as they come out of the mould: none is quite its recipe.

use anyhow::Context;
use finger::chain::Chain;
use finger::geometry::Geometry;
use finger::recipe::Recipe;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use softgrip::FINGERS;

/// Outer radius, bore radius and bore offset are each off by up to this, m: what a printed mould is good for.
const DIMENSION_M: f64 = 0.1e-3;
/// The rubber's modulus is off by up to this share: mixing ratio and cure.
const MODULUS: f64 = 0.10;
/// A gauge's gain is off by up to this share: gauge factor, and the grid's distance from the neutral axis.
const GAUGE_GAIN: f64 = 0.05;
/// A gauge's zero is off by up to this, µε: 1 % of its full scale.
const GAUGE_OFFSET_UE: f64 = 200.0;
/// Stiffnesses among which that of a finger is looked for: the range of the setting, in steps of a thousandth.
const SOFTEST: f64 = 0.7;
const STIFFEST: f64 = 1.5;
const STIFFNESSES: u32 = 800;

/// Three fingers and their gauges.
#[derive(Debug, Clone, PartialEq)]
pub struct Hand {
    /// Each finger as links and springs.
    pub chains: [Chain; FINGERS],
    /// Gain of each gauge over its nominal one.
    pub gauge_gain: [f64; FINGERS],
    /// What each gauge shows without strain, µε.
    pub gauge_offset_ue: [f64; FINGERS],
}

/// Fingers as their recipe's with a stiffness `s` and a gauge of gain `g`: `ε(p) = g ε_free(p / s)`, as the controller's
/// settings describe them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likeness {
    /// Gain of each finger's gauge over the recipe's.
    pub gain: [f64; FINGERS],
    /// Stiffness of each finger over the recipe's.
    pub stiffness: [f64; FINGERS],
    /// Largest difference to the fingers as they are, percent of the recipe's full scale.
    pub error_percent: f64,
}

impl Hand {
    /// Three times the same finger, with perfect gauges.
    pub fn alike(chain: &Chain) -> Self {
        Self {
            chains: std::array::from_fn(|_| chain.clone()),
            gauge_gain: [1.0; FINGERS],
            gauge_offset_ue: [0.0; FINGERS],
        }
    }

    /// Three castings of a recipe, each off by its own random amounts, uniform within the tolerances of this file.
    /// What such a finger does is computed as for the recipe itself.
    ///
    /// # Errors
    /// If the recipe gives measured links instead of a geometry, or a finger of this seed cannot be inflated as far
    /// as the recipe.
    pub fn cast(recipe: &Recipe, seed: u64) -> anyhow::Result<Self> {
        let geometry = recipe.geometry.as_ref().with_context(|| {
            format!(
                "the recipe {} gives measured links: castings can only be drawn for one with kind = \"geometry\"",
                recipe.name
            )
        })?;
        let max_kpa = recipe.chain.max_pressure_kpa();
        let mut hand = Self::alike(&recipe.chain);
        for i in 0..FINGERS {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(i as u64);
            let finger = casting(geometry, &mut rng);
            hand.chains[i] = finger
                .chain(max_kpa)
                .with_context(|| format!("finger {} of seed {seed}", i + 1))?;
            hand.gauge_gain[i] = 1.0 + GAUGE_GAIN * rng.random_range(-1.0..=1.0);
            hand.gauge_offset_ue[i] = GAUGE_OFFSET_UE * rng.random_range(-1.0..=1.0);
        }
        Ok(hand)
    }

    /// Free-bend strain of each finger over that of `nominal`, without the gauges' errors, by least squares over all
    /// pressures: what a free-bend sweep would find.
    pub fn free_bend_gain(&self, nominal: &Chain) -> [f64; FINGERS] {
        let steps = 32;
        let at = |n: u32| nominal.max_pressure_kpa() * f64::from(n) / f64::from(steps);
        self.chains.each_ref().map(|chain| {
            let (mut product, mut square) = (0.0, 0.0);
            for kpa in (1..=steps).map(at) {
                let expected = nominal.free_strain_ue(kpa);
                product += expected * chain.free_strain_ue(kpa);
                square += expected * expected;
            }
            product / square
        })
    }

    /// What comes closest to these fingers and their gauges, without their weight, by least squares over all pressures.
    pub fn likeness(&self, nominal: &Chain) -> Likeness {
        const PRESSURES: u32 = 32;
        let max_kpa = nominal.max_pressure_kpa();
        let pressures = (1..=PRESSURES).map(|n| max_kpa * f64::from(n) / f64::from(PRESSURES));
        let strains = pressures.map(|kpa| {
            let shown = |i: usize| self.gauge_gain[i] * self.chains[i].free_strain_ue(kpa);
            (kpa, std::array::from_fn(shown))
        });
        Likeness::of(nominal, &strains.collect::<Vec<_>>())
    }
}

impl Likeness {
    /// What comes closest to fingers that show these strains, µε, at these pressures, kPa, with nothing in the grip, by
    /// least squares.
    pub fn of(nominal: &Chain, strains: &[(f64, [f64; FINGERS])]) -> Self {
        let max_kpa = nominal.max_pressure_kpa();
        let full_ue = nominal.free_strain_ue(max_kpa);
        let mut likeness = Self {
            gain: [1.0; FINGERS],
            stiffness: [1.0; FINGERS],
            error_percent: 0.0,
        };
        for i in 0..FINGERS {
            let fit = |stiffness: f64| {
                let (mut xx, mut xy, mut yy, mut pairs) = (0.0, 0.0, 0.0, Vec::new());
                for (kpa, strain_ue) in strains {
                    // A softer finger's last pressures are beyond the recipe.
                    if kpa / stiffness > max_kpa {
                        continue;
                    }
                    let (x, y) = (nominal.free_strain_ue(kpa / stiffness), strain_ue[i]);
                    (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
                    pairs.push((x, y));
                }
                let gain = xy / xx;
                let off = pairs.iter().map(|(x, y)| (y - gain * x).abs());
                // Relative, because the highest pressure is not the same for all.
                ((yy - gain * xy) / yy, gain, off.fold(0.0, f64::max))
            };
            let tried = (0..=STIFFNESSES).map(|n| {
                let stiffness =
                    SOFTEST + (STIFFEST - SOFTEST) * f64::from(n) / f64::from(STIFFNESSES);
                (stiffness, fit(stiffness))
            });
            let best = tried.min_by(|(_, (a, ..)), (_, (b, ..))| a.total_cmp(b));
            if let Some((stiffness, (_, gain, off_ue))) = best {
                (likeness.gain[i], likeness.stiffness[i]) = (gain, stiffness);
                let off_percent = 100.0 * off_ue / full_ue;
                likeness.error_percent = likeness.error_percent.max(off_percent);
            }
        }
        likeness
    }
}

/// A finger from the same mould as `nominal`, as far as moulds are the same.
fn casting(nominal: &Geometry, rng: &mut ChaCha8Rng) -> Geometry {
    let mut off = || rng.random_range(-1.0..=1.0);
    let [outer, bore, offset] = [off(), off(), off()].map(|share: f64| DIMENSION_M * share);
    let modulus = 1.0 + MODULUS * off();
    let mut finger = nominal.clone();
    for (_, section) in &mut finger.stations {
        section.outer_radius_m += outer;
        section.bore_radius_m += bore;
        section.bore_offset_m = (section.bore_offset_m + offset).max(0.0);
    }
    finger.youngs_modulus_pa *= modulus;
    finger.rubber = finger.rubber.scaled(modulus);
    finger
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(name: &str) -> Recipe {
        let recipes = concat!(env!("CARGO_MANIFEST_DIR"), "/../../recipes");
        finger::recipe::load(&std::path::Path::new(recipes).join(name)).expect("a recipe")
    }

    #[test]
    fn castings_differ_from_the_recipe_and_from_each_other_and_are_those_of_their_seed() {
        let recipe = recipe("rtv225.toml");
        let hand = Hand::cast(&recipe, 7).expect("three fingers");
        assert_eq!(hand, Hand::cast(&recipe, 7).expect("the same three"));
        let tips: Vec<f64> = hand.chains.iter().map(|c| c.tip_angle_rad(140.0)).collect();
        let nominal = recipe.chain.tip_angle_rad(140.0);
        for (i, tip) in tips.iter().enumerate() {
            // 0.1 mm moves the curvature by 7-14 %, and there are three dimensions and a modulus.
            let share = tip / nominal - 1.0;
            assert!(share.abs() > 1e-3 && share.abs() < 0.7, "{share}");
            assert!(tips[..i].iter().all(|other| (other - tip).abs() > 1e-3));
        }
        let gains = hand.free_bend_gain(&recipe.chain);
        for (gain, chain) in gains.iter().zip(&hand.chains) {
            let at_140 = chain.free_strain_ue(140.0) / recipe.chain.free_strain_ue(140.0);
            assert!((gain / at_140 - 1.0).abs() < 0.1, "{gain} {at_140}");
        }
    }

    #[test]
    fn a_casting_is_its_recipes_finger_with_a_stiffness_and_a_gain() {
        let recipe = recipe("rtv225.toml");
        let alike = Hand::alike(&recipe.chain).likeness(&recipe.chain);
        for (gain, stiffness) in alike.gain.iter().zip(alike.stiffness) {
            assert!((gain - 1.0).abs() < 1e-9 && (stiffness - 1.0).abs() < 1e-9);
        }
        let hand = Hand::cast(&recipe, 7).expect("three fingers");
        let likeness = hand.likeness(&recipe.chain);
        assert!(likeness.error_percent < 1.0, "{likeness:?}");
        assert!(likeness.stiffness.iter().any(|s| (s - 1.0).abs() > 0.02));
    }

    #[test]
    fn castings_of_measured_links_are_refused() {
        let error = Hand::cast(&recipe("paper.toml"), 1).expect_err("no geometry");
        assert!(error.to_string().contains("kind = \"geometry\""), "{error}");
    }
}
