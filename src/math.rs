//! Arithmetic that more than one module needs.

use crate::units::TICK_US;
use micromath::F32Ext;

/// Share of the way that a first-order lag goes in one tick: `1 − exp(−dt/τ)`. libm, because at long
/// time constants the share is small and an approximate exponential would be off by more than itself.
pub(crate) fn lag_gain(time_constant_ms: f32) -> f32 {
    -libm::expm1f(-(TICK_US as f32) * 1e-3 / time_constant_ms)
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

/// Milliseconds of a valid setting, in µs.
pub(crate) fn micros(ms: f32) -> u64 {
    (1e3 * ms) as u64
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
