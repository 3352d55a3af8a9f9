//! Model of one pneumatic soft finger (std, f64): from a recipe to the table that the controller carries.
//!
//! ```text
//! recipe (TOML) -> geometry -> sections under pressure -> curvature -> chain of links and springs
//!               -> grasp of three fingers -> table on a pressure grid
//! ```
//!
//! SI units throughout; a name ends in its unit, as `bore_radius_m` does. Equations, sections and tables are
//! those of the paper; where it is wrong, the module that corrects it says so.
#![forbid(unsafe_code)]

// Each group is built on those above it.

// Mathematics, and checks of values.
mod bordered;
pub mod check;
mod complementarity;
pub mod cubic;
pub mod curve;

// Rubber.
mod deformation;
pub mod hyperelastic;
pub mod material;
pub mod ogden;
mod stability;

// A section under pressure.
pub mod mesh;
mod potential;
pub mod section;
pub mod yeoh;

// The chain that stands for the finger.
pub mod chain;
pub mod links;
pub mod stiffness;

// Three chains around an object.
pub mod capability;
pub mod contact;
pub mod grasp;
pub mod object;

// From a recipe to the table.
pub mod cartesian;
pub mod geometry;
pub mod model;
mod mounting;
pub mod recipe;
pub mod table;
