//! Converter samples of one tick → one frame.

use core::sync::atomic::{AtomicU16, Ordering::Relaxed};

use crate::condition::RawFrame;
use crate::frontend;
use crate::units::{AdcCode, FINGERS};

/// Channels of one scan, in this order: a gauge per finger, the pressure monitor, the supply, the chip's
/// internal reference.
pub const CHANNELS: usize = FINGERS + 3;

/// Averages 12-bit samples of `count` scans in a ring of whole ones, from this one on. Up to some thousand scans fit.
/// `calibrated`: what the internal reference reads at 3.3 V, see [`reference_code`](crate::frontend::reference_code).
pub fn average(
    ring: &[AtomicU16],
    from: usize,
    count: usize,
    calibrated: u16,
    overrun: bool,
) -> RawFrame {
    let (ring, _) = ring.as_chunks::<CHANNELS>();
    let (newest, oldest) = ring.split_at_checked(from).unwrap_or_default();
    let scans = oldest.iter().chain(newest).take(count);
    let mut sums = [0u32; CHANNELS];
    let mut count = 0u32;
    for scan in scans {
        for (sum, sample) in sums.iter_mut().zip(scan) {
            *sum = sum.wrapping_add(sample.load(Relaxed).into());
        }
        count = count.wrapping_add(1);
    }
    let means = sums.map(|sum| mean(sum, count));
    let Some((&gauges, &[monitor, supply, reference])) = means.split_first_chunk() else {
        return RawFrame::default();
    };
    RawFrame {
        gauges,
        monitor,
        supply,
        rail: frontend::rail(reference, calibrated),
        scans: count as u16,
        overrun,
        carried: false,
    }
}

/// Rounded, and left-aligned to 16 bits: times 16 before the division keeps the fraction.
fn mean(sum: u32, count: u32) -> AdcCode {
    let code = sum
        .saturating_mul(16)
        .saturating_add(count / 2)
        .checked_div(count)
        .unwrap_or(0);
    AdcCode(u16::try_from(code).unwrap_or(u16::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Millivolts;
    use std::vec::Vec;

    /// The mean of so many scans from this one on.
    fn average(samples: &[u16], from: usize, count: usize, calibrated: u16) -> RawFrame {
        let ring: Vec<AtomicU16> = samples.iter().copied().map(AtomicU16::new).collect();
        super::average(&ring, from, count, calibrated, false)
    }

    #[test]
    fn the_mean_keeps_its_fraction() {
        let frame = average(
            &[1, 2, 3, 4, 4095, 1500, 2, 2, 4, 4, 4095, 1500],
            0,
            2,
            1515,
        );
        assert_eq!(
            frame,
            RawFrame {
                gauges: [AdcCode(24), AdcCode(32), AdcCode(56)],
                monitor: AdcCode(64),
                supply: AdcCode(65_520),
                // 1 % above 3.3 V.
                rail: Millivolts(3_333),
                scans: 2,
                overrun: false,
                carried: false,
            }
        );
    }

    #[test]
    fn no_samples_are_no_scans() {
        assert_eq!(average(&[], 0, 3, 1500).scans, 0);
        assert_eq!(average(&[1; CHANNELS], 0, 0, 1500).scans, 0);
        // A place that the ring has not.
        assert_eq!(average(&[1; CHANNELS], 2, 1, 1500).scans, 0);
    }

    #[test]
    fn the_ring_is_read_over_its_end() {
        let samples: Vec<u16> = (0..4).flat_map(|scan| [scan; CHANNELS]).collect();
        let means = |from, count| average(&samples, from, count, 1500).gauges[0].0;
        assert_eq!(means(3, 2), 16 * 3 / 2);
        assert_eq!(means(1, 2), 16 * 3 / 2);
        // What is cut at the end is no scan, and none is counted twice.
        assert_eq!(average(&samples[..23], 0, 9, 1500).scans, 3);
    }
}
