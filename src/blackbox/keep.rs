//! The black box in flash, for when the power goes.

use embedded_storage::nor_flash::ReadNorFlash;
use embedded_storage_async::nor_flash::NorFlash;

use super::layout::{Memory, Phase, WORDS, load, store};
use crate::checksum::checksum;

/// Bytes of a word.
const WORD: u32 = 4;
/// Where the checksum stands, behind the words.
const SUM_AT: u32 = WORD * WORDS as u32;

/// Writes what stands to the sector at this offset, which is erased before.
///
/// # Errors
/// What the flash refuses; nothing stands there then.
pub async fn keep<F: NorFlash>(flash: &mut F, at: u32, memory: &Memory) -> Result<(), F::Error> {
    forget(flash, at).await?;
    let mut sum = 0;
    for word in 0..WORDS {
        let bytes = load(memory, word).to_le_bytes();
        sum = checksum(sum, &bytes);
        flash.write(at + WORD * word as u32, &bytes).await?;
    }
    flash.write(at + SUM_AT, &sum.to_le_bytes()).await
}

/// Erases it.
///
/// # Errors
/// What the flash refuses.
pub async fn forget<F: NorFlash>(flash: &mut F, at: u32) -> Result<(), F::Error> {
    flash.erase(at, at + F::ERASE_SIZE as u32).await
}

/// Copies what stands there to the memory; says whether anything does. What was cut while it was written does not.
///
/// # Errors
/// What the flash refuses.
pub fn restore<F: ReadNorFlash>(flash: &mut F, at: u32, memory: &Memory) -> Result<bool, F::Error> {
    let mut word_at = |offset: u32| {
        let mut bytes = [0; WORD as usize];
        flash.read(at + offset, &mut bytes).map(|()| bytes)
    };
    if u32::from_le_bytes(word_at(0)?) != Phase::Stands as u32 {
        return Ok(false);
    }
    let mut sum = 0;
    for word in 0..WORDS as u32 {
        sum = checksum(sum, &word_at(WORD * word)?);
    }
    if u32::from_le_bytes(word_at(SUM_AT)?) != sum {
        return Ok(false);
    }
    for word in 0..WORDS {
        let bytes = word_at(WORD * word as u32)?;
        store(memory, word, u32::from_le_bytes(bytes));
    }
    Ok(true)
}
