//! The chosen board's family of chips.

#[cfg(feature = "board-nucleo-f429zi")]
pub use super::stm32f4::*;
#[cfg(feature = "board-nucleo-g474re")]
pub use super::stm32g4::*;
