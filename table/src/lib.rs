//! The table of a finger that the controller carries: data only.
//!
//! The crate `finger` fills it from a recipe, the build script of `softgrip` writes it as a constant, and
//! `softgrip::table` looks it up. All three use these types, so they cannot disagree on a unit, a shape or
//! an order.
#![no_std]
#![forbid(unsafe_code)]

/// Links, and joints, of the equivalent chain (paper, section 4.1).
pub const LINKS: usize = 6;

/// Fingers, and strain gauges, of the gripper that is built: those of its recipe, two to four.
pub const FINGERS: usize = include!(concat!(env!("OUT_DIR"), "/fingers.rs"));

/// Kinds of object whose lift a row holds, one for each [`ObjectKind`].
pub const OBJECTS: usize = 2;

/// Rows of the table: 2 kPa apart for a finger up to 160 kPa. That keeps linear interpolation within
/// 0.1 % of full scale and the table within 4 KiB.
pub const ROWS: usize = 81;

/// A kind of object whose lift the table knows, in the size that the recipe states.
///
/// Lists of [`OBJECTS`] values are in the order of the variants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ObjectKind {
    /// A sphere.
    Sphere,
    /// An upright cylinder.
    Cylinder,
}

/// The finger at one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Gauge strain of the free finger, µε.
    pub free_strain_ue: f32,
    /// Angle of the last link to the unbent finger, degrees.
    pub tip_angle_deg: f32,
    /// Greatest force of all fingers against gravity on an object of each kind before it slides
    /// (statics), N; zero in rows from [`FingerTable::lift_rows`] on.
    pub lift_n: [f32; OBJECTS],
}

/// The links of the finger at one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkRow {
    /// Position of the free finger's tip, mm: along the unbent finger and towards the inside of the bend.
    pub tip_mm: [f32; 2],
    /// Torque that the pressure exerts at each joint, from the clamp to the tip, N·mm (paper, table 3).
    pub torque_nmm: [f32; LINKS],
}

/// The links of one finger, at the pressures of its [`FingerTable`]: its shape, for whoever draws it or calculates with
/// it. A table of its own, because no tick looks at it: an image that does not either is without these 2.6 kB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkTable {
    /// Pressure of the last row, kPa.
    pub max_pressure_kpa: f32,
    /// Stiffness of each joint, from the clamp to the tip, N·mm/deg (paper, table 2).
    pub stiffness_nmm_per_deg: [f32; LINKS],
    /// The links at rising pressure.
    pub rows: [LinkRow; ROWS],
}

/// One finger at [`ROWS`] evenly spaced pressures from zero to [`FingerTable::max_pressure_kpa`], and where
/// the numbers come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerTable {
    /// Name of the recipe it was made from.
    pub recipe: &'static str,
    /// First eight bytes of the SHA-256 of that recipe, the first one the most significant.
    pub inputs_hash: u64,
    /// Largest deviation of the interpolated table from the model, in percent of each column's full
    /// scale; lift apart.
    pub error_bound_percent: f32,
    /// The same for the lift, in percent of the largest one, half-way between rows. It sets in with a kink
    /// where the fingers first touch.
    pub lift_error_percent: f32,
    /// Rows, from the first on, whose lift of each kind of object is known, 0 to [`ROWS`]: none without a
    /// grasp in the recipe, not all where fingers and object find no equilibrium.
    pub lift_rows: [u8; OBJECTS],
    /// Pressure of the last row, kPa.
    pub max_pressure_kpa: f32,
    /// Pressure at which the tips of three free fingers meet on the gripper's axis, kPa; none without a grasp in
    /// the recipe, or if they do not up to the last row.
    pub meeting_kpa: Option<f32>,
    /// The finger at rising pressure.
    pub rows: [Row; ROWS],
}
