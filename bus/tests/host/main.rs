//! The gripper on a bus, with the mocked board of the controller's tests behind it.

mod activation;
mod clients;
mod codec;
mod hostile;
mod line;
mod losses;
#[allow(dead_code, reason = "the controller's tests use the rest")]
#[path = "../../../tests/host/mock.rs"]
mod mock;
mod own;
mod page;
mod together;
