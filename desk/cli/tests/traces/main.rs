//! Traces as other people's loggers write them, made from one simulated run.

mod bench;
mod clocks;
mod dialects;
mod rates;
mod setpoints;
mod units;
