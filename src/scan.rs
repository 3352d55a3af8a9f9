//! Converter samples of one tick → one frame.

use crate::condition::RawFrame;
use crate::frontend;
use crate::units::{AdcCode, FINGERS};

/// Channels of one scan, in this order: a gauge per finger, the pressure monitor, the supply, the chip's
/// internal reference.
pub const CHANNELS: usize = FINGERS + 3;

/// Averages 12-bit samples of whole scans, oldest first. Up to some thousand scans fit. `calibrated`: what
/// the internal reference reads at 3.3 V, see [`reference_code`](crate::frontend::reference_code).
pub fn average(samples: &[u16], calibrated: u16, overrun: bool) -> RawFrame {
    let (scans, _) = samples.as_chunks::<CHANNELS>();
    let mut sums = [0u32; CHANNELS];
    for scan in scans {
        for (sum, &sample) in sums.iter_mut().zip(scan) {
            *sum = sum.saturating_add(u32::from(sample));
        }
    }
    let count = scans.len() as u32;
    let [gauge_1, gauge_2, gauge_3, monitor, supply, reference] = sums.map(|sum| mean(sum, count));
    RawFrame {
        gauges: [gauge_1, gauge_2, gauge_3],
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

    #[test]
    fn the_mean_keeps_its_fraction() {
        let frame = average(
            &[1, 2, 3, 4, 4095, 1500, 2, 2, 4, 4, 4095, 1500],
            1515,
            false,
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
        assert_eq!(average(&[], 1500, false).scans, 0);
    }

    #[test]
    fn an_unfinished_scan_is_left_out() {
        let frame = average(&[7, 7, 7, 7, 7, 1500, 4095, 4095], 1500, true);
        assert_eq!(frame.gauges, [AdcCode(112); FINGERS]);
        assert_eq!((frame.scans, frame.overrun), (1, true));
    }
}
