//! What is expected, and where each number comes from.

/// Noise of a good gauge, µε rms (`boards/README.md`, "What a good board shows"), …
pub const GOOD_NOISE_UE: f32 = 4.0;
/// … noise that is worth a look: the detector is tuned on up to 100 µε, …
pub const NOISE_WARNS_UE: f32 = 100.0;
/// … and noise from which the controller cannot tell a loss (`NOISY_UE` in `src/condition/channel.rs`).
pub const NOISE_FAILS_UE: f32 = 1_200.0;

/// A residual at rest beyond this asks for a tare: it would count as contact (`finger.contact_ue`), …
pub const ZERO_WARNS_UE: f32 = 500.0;
/// … and beyond this a tare is refused (`TARE_LIMIT_UE` in `src/zero.rs`).
pub const ZERO_FAILS_UE: f32 = 2_000.0;
/// A gauge at rest moves by less than this in the time that it is watched, µε: what a tare takes for steady
/// (`TARE_DRIFT_UE` in `src/zero.rs`).
pub const DRIFT_WARNS_UE: f32 = 30.0;

/// Pressure is within this of where it should be, kPa: the worst case of the monitor's divider is 3.2 kPa at 100 kPa
/// (`boards/README.md`), and regulators are good for 1 % of 200 kPa.
pub const PRESSURE_KPA: f32 = 3.0;
/// Pressure at rest stays within this, kPa, from its lowest to its highest.
pub const RESTS_KPA: f32 = 1.5;
/// Beyond where it comes to rest the pressure goes by less than this, kPa: so far above the highest command lies the
/// limit of the interlock.
pub const OVERSHOOT_KPA: f32 = 5.0;
/// Delay of a regulator, ms: a valve alone takes 5, and a pump's loop up to a second.
pub const DELAY_MS: std::ops::RangeInclusive<f64> = 5.0..=1_000.0;

/// Steps of the pressure, kPa.
pub const STEP_KPA: f32 = 20.0;
/// Strain of a free finger is within this share of its table: castings and gauges differ by 10 to 15 %, and its weight
/// takes another 15 %, …
pub const STRAIN_WARNS_SHARE: f32 = 0.3;
/// … and fingers that no sweep has learned may be soft, heavy and with a gauge of little gain at once: of 48 castings of the
/// simulated gripper (`softgrip check --from virtual --yes --finger-seed 1`, … 16) none lacked more than 43 % at 60 kPa.
pub const STRAIN_FAILS_SHARE: f32 = 0.5;
/// A finger that is bent by hand shows more than this, µε: what counts as contact (`finger.contact_ue`).
pub const BENT_UE: f32 = 500.0;

/// How long each channel is watched at rest, s.
pub const REST_S: f64 = 3.0;
/// How long a pressure is held at least, s, before it is looked at: the fingers' slowest lag is 0.12 s.
pub const HOLD_S: f64 = 1.5;
/// How long it may take to rest, s, beyond the slew.
pub const SETTLE_S: f64 = 5.0;
/// The part at the end of it that is looked at, s.
pub const WINDOW_S: f64 = 0.5;
/// How long a release may take, s: what an activation waits for at most (`docs/registers.md`).
pub const RELEASE_S: f64 = 3.0;
/// How long a stop or an acknowledgement may take to show, s: some looks at the slowest line.
pub const ANSWER_S: f64 = 1.0;
