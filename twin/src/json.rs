//! Numbers as JSON shows them.

/// The float nearest to `x` with so many decimals, so that JSON shows 1.234 and not 1.2340000000000002,
/// and never a negative zero.
pub fn round(x: f64, decimals: usize) -> f64 {
    format!("{x:.decimals$}").parse().unwrap_or(x) + 0.0
}
