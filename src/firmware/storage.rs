//! The settings in flash: read once at the start, and written by a task of their own, below all others.

use core::sync::atomic::Ordering::Relaxed;

use embedded_storage_async::nor_flash::NorFlash;
use softgrip::blackbox::{self, Phase, Recorder};
use softgrip::settings::{Active, ENCODED_BYTES, FACTORY, TARE, Values};
use softgrip::storage::{SaveError, Storage, Stored};
use softgrip::table::FINGER;

use crate::board::SettingsFlash;
use crate::links::{self, BLACK_BOX, BLACK_BOX_CHANGED, LEARNED, SAVE, STORED, SWEPT, TARED};

/// Where the black box lies in flash: in the sector behind those of the settings.
const BLACK_BOX_AT: u32 = 2 * SettingsFlash::ERASE_SIZE as u32;

/// The settings, and where they are kept.
pub struct Keeper {
    storage: Storage<SettingsFlash>,
    /// Something that was stored is not valid, and the factory's is in use instead.
    pub invalid: bool,
}

/// The settings as they are stored. None but for the first caller.
// Never inlined, so that what it needs is off the stack again when the controller is made.
#[inline(never)]
pub fn keeper(flash: SettingsFlash) -> Option<&'static mut Keeper> {
    let keeper = cortex_m::singleton!(KEEPER: Keeper = Keeper {
        storage: Storage::new(flash),
        invalid: false,
    })?;
    keeper.load();
    Some(keeper)
}

impl Keeper {
    /// Reads what is stored.
    fn load(&mut self) {
        // A newer release may have stored settings that are unknown here.
        let mut bytes = [0; 2 * ENCODED_BYTES];
        match self.storage.load(&mut bytes) {
            Ok(Stored::Empty) => defmt::info!("settings: the factory's"),
            Ok(Stored::Found { length }) => {
                self.take(bytes.get(..length).unwrap_or(&bytes));
                defmt::info!(
                    "settings: {=usize} bytes stored, tare {} ue",
                    length,
                    TARE.map(|number| links::values().get(number).unwrap_or_default()),
                );
            }
            Ok(Stored::Corrupt) | Err(_) => {
                defmt::error!("the stored settings are damaged: the factory's are used");
                self.invalid = true;
            }
        }
    }

    /// The black box, with what stands in flash, or else has come before a restart. To be called once.
    pub fn black_box(&mut self, failed: bool) -> Recorder {
        let stored = blackbox::restore(self.storage.flash(), BLACK_BOX_AT, &BLACK_BOX);
        let recorder = Recorder::new(&BLACK_BOX, failed);
        if recorder.stands() && stored != Ok(true) {
            BLACK_BOX_CHANGED.store(true, Relaxed);
            LEARNED.signal(());
        }
        recorder
    }

    /// Stores what has come to stand in the black box, or that nothing does any more.
    async fn save_black_box(&mut self) {
        let phase = blackbox::load(&BLACK_BOX, 0);
        let flash = self.storage.flash();
        let saved = match Phase::of(phase) {
            Some(Phase::Stands) => blackbox::keep(flash, BLACK_BOX_AT, &BLACK_BOX).await,
            _ => blackbox::forget(flash, BLACK_BOX_AT).await,
        };
        match saved {
            Ok(()) => defmt::info!("black box stored"),
            Err(_) => defmt::error!("black box not stored: the flash refuses"),
        }
    }

    fn take(&mut self, bytes: &[u8]) {
        let decoded = Values::decode(&FACTORY, bytes, FINGER.max_pressure_kpa);
        if decoded.unknown > 0 {
            defmt::warn!("{=u16} stored settings are unknown here", decoded.unknown);
        }
        for number in decoded.wrong() {
            defmt::error!(
                "the stored setting {=u16} is wrong: the factory's is used",
                number
            );
            self.invalid = true;
        }
        links::set_values(decoded.values);
    }

    async fn save(&mut self) {
        let mut bytes = [0; ENCODED_BYTES];
        let length = links::values().encode(&FACTORY, &mut bytes);
        let saved = match length.and_then(|length| bytes.get(..length)) {
            Some(bytes) => self.storage.save(bytes).await,
            None => Err(SaveError::TooLong),
        };
        STORED.signal(saved.is_ok());
        match saved {
            Ok(()) => defmt::info!("settings stored"),
            Err(error) => {
                let why = match error {
                    SaveError::TooLong => "too many",
                    SaveError::Unreadable => "they read back as something else",
                    SaveError::Flash(_) => "the flash refuses",
                };
                defmt::error!("settings not stored: {=str}", why);
            }
        }
    }
}

/// What has been measured becomes what the control task uses.
fn learn(stated: &[(u16, f32)]) {
    let mut values = links::values();
    for &(number, value) in stated {
        if let Err(error) = values.set(number, value) {
            defmt::error!("not kept: {}", error);
        }
    }
    match Active::of(&values, &FINGER) {
        Ok(active) => {
            links::set_values(values);
            links::send_settings(active);
        }
        Err(error) => defmt::error!("not used: {}", error),
    }
}

#[embassy_executor::task]
pub async fn run(keeper: &'static mut Keeper) -> ! {
    if keeper.invalid {
        // Said at this start; the next one shall not stop for it.
        keeper.save().await;
    }
    loop {
        LEARNED.wait().await;
        let mut saves = SAVE.swap(false, Relaxed);
        if let Some(tare_ue) = TARED.try_take() {
            let mut stated = TARE.map(|number| (number, 0.0));
            for ((_, value), ue) in stated.iter_mut().zip(tare_ue) {
                *value = ue;
            }
            learn(&stated);
            saves = true;
        }
        if let Some(found) = SWEPT.try_take() {
            learn(&found.stated(&links::values(), &FINGER));
            saves = true;
        }
        if saves {
            keeper.save().await;
        }
        if BLACK_BOX_CHANGED.swap(false, Relaxed) {
            keeper.save_black_box().await;
        }
    }
}
