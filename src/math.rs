//! Arithmetic that more than one module needs.

use crate::units::TICK_US;
use micromath::F32Ext;

/// Share of the way that a first-order lag goes in one tick: `1 − exp(−dt/τ)`, for time constants from a tick on. It is
/// `2t / (1 + t)` with `t = tanh(dt/2τ)`, whose Padé approximant is off by 1e-5 at a tick, and less beyond.
pub(crate) fn lag_gain(time_constant_ms: f32) -> f32 {
    let half = 0.5 * (TICK_US as f32 * 1e-3) / time_constant_ms;
    let square = half * half;
    let tanh = half * (15.0 + square) / (15.0 + 6.0 * square);
    2.0 * tanh / (1.0 + tanh)
}

/// Square root of a number that is not negative. micromath's is up to 6 % off; two Newton steps bring
/// that to 2e-6, for less than the exact root of libm costs.
pub(crate) fn root(x: f32) -> f32 {
    let mut root = F32Ext::sqrt(x);
    if root > 0.0 {
        root = 0.5 * (root + x / root);
        root = 0.5 * (root + x / root);
    }
    root
}

/// Milliseconds of a valid setting, at most a minute, in µs.
pub(crate) fn micros(ms: f32) -> u64 {
    // The core converts to 32 bits.
    u64::from((1e3 * ms) as u32)
}

/// The larger of two numbers; `b` where `a` is none. `f32::max` is a call into the runtime on this core,
/// which has no instruction for it.
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers; `b` where `a` is none.
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_reaches_63_percent_after_its_time_constant() {
        let gain = lag_gain(80.0);
        let mut value = 0.0;
        for _ in 0..80 {
            value += gain * (1.0 - value);
        }
        assert!((value - (1.0 - libm::expf(-1.0))).abs() < 1e-5);
    }

    #[test]
    fn the_share_of_a_lag_is_what_the_exponential_gives() {
        let mut time_constant_ms = 1.0f32;
        while time_constant_ms < 6e5 {
            let exact = -libm::expm1f(-1.0 / time_constant_ms);
            let error = lag_gain(time_constant_ms) / exact - 1.0;
            assert!(error.abs() < 1e-5, "{error} at {time_constant_ms} ms");
            time_constant_ms *= 1.1;
        }
    }

    #[test]
    fn the_approximate_root_is_inside_the_budget_of_a_thousandth() {
        assert!(root(0.0) < 1e-3);
        let mut x = 1e-3f32;
        while x < 1e8 {
            let error = root(x) / libm::sqrtf(x) - 1.0;
            assert!(error.abs() < 1e-5, "{error} at {x}");
            x *= 1.01;
        }
    }
}
