//! Bytes that survive a power cut: records in two erase sectors of NOR flash.
//!
//! A sector is divided into places of [`PLACE`] bytes, filled one after the other; when the last is full, the other
//! sector is erased and filled. So the newest record is never erased. What a record is made of, in the order in which
//! it is written, in words of four bytes:
//!
//! | words | what |
//! | --- | --- |
//! | 2 | its number, and that inverted; counting on goes through the places of both sectors in turn |
//! | 1 | length of its bytes |
//! | | its bytes |
//! | last but one of the place | CRC-32C of all of that: from here on it is valid |
//! | last | zero, once it has been read back: only then the caller hears that it is stored |
//!
//! A power cut leaves the word that was being written, or the sector that was being erased, with bits that read as
//! they like, even erased, and differently the next time. Hence:
//!
//! * A record that was cut is invalid, or valid and what was to be stored. Whatever it reads as, its number is its
//!   place's, so the record in the next place is newer.
//! * After a start the first place that reads erased may be one whose first word was cut. That word is written to
//!   zeros, and the place left out. A later place cannot have been begun, for a place is begun once the one before is
//!   no longer erased.
//! * A sector is erased immediately before its first record is written. One whose erasing was cut has no record with
//!   a higher number than those of the other one, so it is erased again.
//!
//! A record whose last word says that it was stored, and whose sum is wrong, has been damaged since: that is said, and
//! not an older one taken for it. A record that was cut has no such word; an older one counts. (A sector's first
//! record is taken for one that was cut, too, if its very number is damaged.)
//!
//! **Wear.** A sector of 16 KiB takes 16 records per erasing, or 8 if there is a restart before each, and the chip's
//! sectors take 10 000 erasings (DS9405, flash memory endurance): at ten records a day the two last 43 years at least.

use core::ops::Range;

use embedded_storage::nor_flash::{NorFlashError, ReadNorFlash};
use embedded_storage_async::nor_flash::NorFlash;

use crate::checksum::checksum;

/// Bytes that a record takes.
pub const PLACE: u32 = 1024;
/// Bytes that a record can hold.
pub const PAYLOAD: usize = (PLACE - BYTES_AT - 2 * WORD) as usize;

const WORD: u32 = 4;
/// Offsets in a place.
const BYTES_AT: u32 = 3 * WORD;
const SUM_AT: u32 = PLACE - 2 * WORD;
const SEAL_AT: u32 = PLACE - WORD;

/// A record's number is below. Ten thousand erasings of a sector do not get there.
const END: u32 = 1 << 31;
/// The last word of a record that was stored.
const SEALED: u32 = 0;

/// What is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// Nothing has ever been.
    Empty,
    /// As many bytes as this.
    Found {
        /// Their number, at most [`PAYLOAD`].
        length: usize,
    },
    /// Something was, and it has been damaged, or what is there is of somebody else.
    Corrupt,
}

/// Why something was not stored. What was stored before still is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SaveError<E> {
    /// More than [`PAYLOAD`] bytes.
    TooLong,
    /// It reads back as something else: the flash is worn out.
    Unreadable,
    /// The flash refuses.
    Flash(E),
}

impl<E: NorFlashError> From<E> for SaveError<E> {
    fn from(error: E) -> Self {
        Self::Flash(error)
    }
}

/// What has become of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// It is valid, with so many bytes.
    Valid(usize),
    /// It was stored, and is no longer valid.
    Damaged,
    /// It was not stored.
    Cut,
}

/// Where a record is to be written.
struct Place {
    number: u32,
    /// The place before is to be left out, visibly.
    leaves_out: bool,
    /// Neither sector has a record: what is there must not come to life beside this one, which is in the first.
    erases_both: bool,
}

impl Place {
    fn next(number: u32) -> Self {
        Self {
            number,
            leaves_out: false,
            erases_both: false,
        }
    }
}

/// The first two sectors of a flash with words of four bytes.
#[derive(Debug)]
pub struct Storage<F> {
    flash: F,
    /// The number of the next record; unknown after a start, and after a record that failed.
    next: Option<u32>,
}

impl<F: NorFlash + ReadNorFlash> Storage<F> {
    /// Places of a sector.
    const PLACES: u32 = {
        assert!(F::WRITE_SIZE == WORD as usize);
        assert!(F::ERASE_SIZE.is_multiple_of(PLACE as usize));
        F::ERASE_SIZE as u32 / PLACE
    };

    /// Reads and writes nothing yet.
    pub const fn new(flash: F) -> Self {
        Self { flash, next: None }
    }

    /// The flash, for what lies behind the two sectors.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Reads the newest record into `bytes`, as far as there is room; more than [`PAYLOAD`] are not needed.
    ///
    /// # Errors
    ///
    /// What the flash refuses to read.
    pub fn load(&mut self, bytes: &mut [u8]) -> Result<Stored, F::Error> {
        let Some((number, state)) = self.newest(bytes)? else {
            for place in 0..2 * Self::PLACES {
                if !self.is_erased(place)? {
                    return Ok(Stored::Corrupt);
                }
            }
            return Ok(Stored::Empty);
        };
        let State::Valid(length) = state else {
            return Ok(Stored::Corrupt);
        };
        // One that was stored later, and of which not even the number is left.
        for later in Self::behind(number) {
            if self.word(Self::at(later) + SEAL_AT)? == SEALED {
                return Ok(Stored::Corrupt);
            }
        }
        Ok(Stored::Found { length })
    }

    /// Stores `bytes`. Until this returns, what was stored before still is; to drop it half-way is a power cut.
    ///
    /// # Errors
    ///
    /// [`SaveError`].
    pub async fn save(&mut self, bytes: &[u8]) -> Result<(), SaveError<F::Error>> {
        if bytes.len() > PAYLOAD {
            return Err(SaveError::TooLong);
        }
        let Place {
            number,
            leaves_out,
            erases_both,
        } = match self.next.take() {
            Some(number) => Place::next(number),
            None => self.place_after_start()?,
        };
        if number >= END {
            return Err(SaveError::Unreadable);
        }
        let at = Self::at(number);
        let size = F::ERASE_SIZE as u32;
        let first = number.is_multiple_of(Self::PLACES).then_some(at);
        for sector in [erases_both.then_some(size), first].into_iter().flatten() {
            self.flash.erase(sector, sector + size).await?;
        }

        let header = header(number, bytes.len());
        let sum = checksum(checksum(0, &header), bytes);
        let (words, rest) = bytes.as_chunks::<4>();
        let words = words.as_flattened();
        let mut last = [u8::MAX; 4];
        for (place, byte) in last.iter_mut().zip(rest) {
            *place = *byte;
        }
        let pieces: [(u32, &[u8]); 6] = [
            (Self::at(number - 1), if leaves_out { &[0; 4] } else { &[] }),
            (at, &header),
            (at + BYTES_AT, words),
            (
                at + BYTES_AT + words.len() as u32,
                if rest.is_empty() { &[] } else { &last },
            ),
            (at + SUM_AT, &sum.to_le_bytes()),
            (at + SEAL_AT, &SEALED.to_le_bytes()),
        ];
        for (to, piece) in pieces {
            let seals = to == at + SEAL_AT;
            if seals && self.check(number, &mut [])? != State::Valid(bytes.len()) {
                return Err(SaveError::Unreadable);
            }
            self.flash.write(to, piece).await?;
        }
        if self.word(at + SEAL_AT)? != SEALED {
            return Err(SaveError::Unreadable);
        }
        self.next = Some(number + 1);
        Ok(())
    }

    /// The first place that nobody has begun.
    fn place_after_start(&mut self) -> Result<Place, F::Error> {
        let Some((newest, _)) = self.newest(&mut [])? else {
            return Ok(Place {
                erases_both: true,
                ..Place::next(2 * Self::PLACES)
            });
        };
        let mut begun = newest;
        for later in Self::behind(newest) {
            if !self.is_erased(later)? {
                begun = later;
            }
        }
        let doubtful = begun + 1;
        Ok(match doubtful.is_multiple_of(Self::PLACES) {
            true => Place::next(doubtful),
            false => Place {
                leaves_out: true,
                ..Place::next(doubtful + 1)
            },
        })
    }

    /// The newest record that was not cut, and what has become of it; its bytes, as far as there is room.
    fn newest(&mut self, bytes: &mut [u8]) -> Result<Option<(u32, State)>, F::Error> {
        let mut below = END;
        loop {
            let mut newest = None;
            for place in 0..2 * Self::PLACES {
                let at = Self::at(place);
                let (number, inverse) = (self.word(at)?, self.word(at + WORD)?);
                let is_number = number == !inverse && number % (2 * Self::PLACES) == place;
                // Zero is what is written to a place that is left out.
                if is_number && (1..below).contains(&number) {
                    newest = newest.max(Some(number));
                }
            }
            let Some(number) = newest else {
                return Ok(None);
            };
            match self.check(number, bytes)? {
                State::Cut => below = number,
                state => return Ok(Some((number, state))),
            }
        }
    }

    /// What has become of a record; its bytes, as far as there is room.
    fn check(&mut self, number: u32, bytes: &mut [u8]) -> Result<State, F::Error> {
        let at = Self::at(number);
        let length = self.word(at + BYTES_AT - WORD)?;
        let mut room = bytes.iter_mut();
        let mut sum = 0;
        if length <= PAYLOAD as u32 {
            let end = BYTES_AT + length;
            for from in (0..end).step_by(WORD as usize) {
                let word = self.word(at + from)?.to_le_bytes();
                let stored = word.get(..(end - from) as usize).unwrap_or(&word);
                sum = checksum(sum, stored);
                if from >= BYTES_AT {
                    room.by_ref()
                        .zip(stored)
                        .for_each(|(byte, stored)| *byte = *stored);
                }
            }
            if self.word(at + SUM_AT)? == sum {
                return Ok(State::Valid(length as usize));
            }
        }
        Ok(match self.word(at + SEAL_AT)? {
            SEALED => State::Damaged,
            _ => State::Cut,
        })
    }

    /// Whether everything in a record's place reads erased.
    #[inline(never)]
    fn is_erased(&mut self, number: u32) -> Result<bool, F::Error> {
        for from in (0..PLACE).step_by(WORD as usize) {
            if self.word(Self::at(number) + from)? != u32::MAX {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The numbers behind this one in its sector.
    fn behind(number: u32) -> Range<u32> {
        number + 1..(number / Self::PLACES + 1) * Self::PLACES
    }

    /// Where a record lies.
    fn at(number: u32) -> u32 {
        number % (2 * Self::PLACES) * PLACE
    }

    // Never inlined, and not the one before: each would stand in the image several times.
    #[inline(never)]
    fn word(&mut self, at: u32) -> Result<u32, F::Error> {
        let mut word = [0; 4];
        ReadNorFlash::read(&mut self.flash, at, &mut word)?;
        Ok(u32::from_le_bytes(word))
    }
}

fn header(number: u32, length: usize) -> [u8; BYTES_AT as usize] {
    let mut header = [0; BYTES_AT as usize];
    let words = [number, !number, length as u32];
    let (places, _) = header.as_chunks_mut::<4>();
    for (place, word) in places.iter_mut().zip(words) {
        *place = word.to_le_bytes();
    }
    header
}
