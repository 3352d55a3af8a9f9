//! The gripper on a bus: Modbus RTU, and what a robot sees and wants. Without allocation, hardware or a clock of its own.
//!
//! A package of its own, so that it is built for size: all of it but [`robot::Link`] runs outside the control tick.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod modbus;
pub mod robot;

pub mod page;
