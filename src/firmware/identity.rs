//! What runs on this chip.

use softgrip::failure::Failure;
use softgrip::table::FINGER;
use softgrip::telemetry::{BUILD_BYTES, BUILD_MARK};

use crate::board::{self, Clock, ResetReason};
use crate::failsafe;

/// What runs here, and since when: told at the start, and to a host that asks.
#[derive(Clone, Copy)]
pub struct Identity {
    /// Why the chip started.
    pub reset: ResetReason,
    /// What drives it.
    pub clock: Clock,
    /// What ended the run before, if something did.
    pub failure: Option<Failure>,
}

/// What the linker has made of the whole image, as its ELF file says too.
pub fn build() -> &'static [u8; BUILD_BYTES] {
    unsafe extern "C" {
        #[link_name = "BUILD_ID"]
        static ID: [u8; BUILD_BYTES];
    }
    // SAFETY: the linker script puts it at those bytes in flash, which nobody writes.
    unsafe { &ID }
}

impl Identity {
    /// Sends it.
    pub fn tell(&self) {
        defmt::info!(
            "softgrip {=str} ({=str}) on {=str}, chip {=[u8; 12]:02x}, reset: {}, clock: {}; finger {=str}, table {=u64:016x}, error {=f32} %, {=str}{=[u8; 8]:02x}",
            env!("CARGO_PKG_VERSION"),
            env!("SOFTGRIP_COMMIT"),
            board::NAME,
            board::unique_id(),
            self.reset,
            self.clock,
            FINGER.recipe,
            FINGER.inputs_hash,
            FINGER.error_bound_percent,
            BUILD_MARK,
            *build(),
        );
        if let Some(failure) = &self.failure {
            failsafe::tell(failure);
        }
        board::check_brown_out();
        board::check_revision();
    }
}
