//! Model of one pneumatic soft finger (std, f64): from a recipe to the table that the controller carries.
//!
//! ```text
//! recipe (TOML) -> chain of links and springs -> table on a pressure grid
//! ```
#![forbid(unsafe_code)]

mod bordered;
pub mod chain;
pub mod cubic;
pub mod hyperelastic;
pub mod mesh;
pub mod recipe;
pub mod section;
pub mod table;
pub mod yeoh;
