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

/// Sends which build runs, as its ELF file says too: a hash of the whole image by the linker.
#[inline(never)]
pub fn tell_build() {
    unsafe extern "C" {
        #[link_name = "BUILD_ID"]
        static ID: [u8; BUILD_BYTES];
    }
    // SAFETY: the linker script puts it at those bytes in flash, which nobody writes.
    let id = unsafe { &ID };
    defmt::info!("{=str}{=[u8; 8]:02x}", BUILD_MARK, *id);
}

impl Identity {
    /// Sends it.
    pub fn tell(&self) {
        defmt::info!(
            "softgrip {=str} ({=str}) on {=str}, chip {=[u8; 12]:02x}, reset: {}, clock: {}; finger {=str}, table {=u64:016x}, error {=f32} %",
            env!("CARGO_PKG_VERSION"),
            env!("SOFTGRIP_COMMIT"),
            board::NAME,
            board::unique_id(),
            self.reset,
            self.clock,
            FINGER.recipe,
            FINGER.inputs_hash,
            FINGER.error_bound_percent,
        );
        tell_build();
        if let Some(failure) = &self.failure {
            failsafe::tell(failure);
        }
        board::check_brown_out();
        board::check_revision();
    }
}
