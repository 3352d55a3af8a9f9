//! What is asked of a finger or of the simulated gripper: the paper's runs, what it can hold, where its
//! gauge should sit, sweeps, and a finger's fit, table and section; how well the detector does is
//! `evaluate`'s, and no command line may be in it.
#![forbid(unsafe_code)]

pub mod paper;

pub mod capability;
pub mod gauge;
pub mod study;
pub mod sweep;

pub mod fit;
pub mod section;
pub mod table;
