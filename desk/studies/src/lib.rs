//! Studies of a finger or of the simulated gripper: the paper's experiments, capability, gauge position,
//! sweeps; fit, table and section of a finger. The performance of the detector belongs to
//! `softgrip-evaluate`, command lines to `softgrip-cli`.
#![forbid(unsafe_code)]

pub mod paper;

pub mod capability;
pub mod gauge;
pub mod study;
pub mod sweep;

pub mod fit;
pub mod section;
pub mod table;
