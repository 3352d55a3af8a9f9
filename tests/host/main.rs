//! Tests of the public library on a mocked board.

mod blackbox;
mod board_limits;
mod commands;
mod faults;
mod flash;
mod frame;
mod grips;
mod hostile;
mod mock;
mod properties;
mod record;
mod regulators;
mod repeats;
mod scenarios;
mod sequences;
mod settings;
mod storage;
mod sweep;
mod torture;
mod zero;
