//! Model of one pneumatic soft finger (std, f64): from a recipe to the table that the controller carries.
//!
//! ```text
//! recipe (TOML) -> chain of links and springs -> table on a pressure grid
//! ```
#![forbid(unsafe_code)]

mod bordered;
pub mod capability;
pub mod cartesian;
pub mod chain;
pub mod check;
mod complementarity;
pub mod contact;
pub mod cubic;
pub mod curve;
pub mod geometry;
pub mod hyperelastic;
pub mod links;
pub mod material;
pub mod mesh;
pub mod model;
mod mounting;
mod object;
pub mod ogden;
mod potential;
pub mod recipe;
pub mod section;
mod stability;
pub mod stiffness;
pub mod table;
pub mod yeoh;
