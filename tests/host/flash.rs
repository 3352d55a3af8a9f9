//! NOR flash as in the STM32F429 (RM0090, chapter 3), whose power goes off when you like.
//!
//! Programming clears bits, in words of four bytes; erasing a sector sets them. What a cut leaves is worse than
//! anybody has seen: the word that was being programmed, or any word of the sector that was being erased, may
//! read as anything, erased and finished included, and some of its bits differently each time.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::future::Future;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use embedded_storage_async::nor_flash::{NorFlash, ReadNorFlash as AsyncReadNorFlash};
use fastrand::Rng;

/// Bytes of a word.
const WORD: usize = 4;
const ERASED: u32 = u32::MAX;

/// What was being done when the power went off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// The word at this index.
    Program { word: usize, value: u32 },
    /// The sector that begins with this word.
    Erase { word: usize },
}

/// The flash just before an operation.
#[derive(Debug, Clone)]
pub struct Moment<const SECTOR: usize> {
    flash: Flash<SECTOR>,
    pub operation: Operation,
}

/// Every operation since somebody last looked.
pub type Log<const SECTOR: usize> = Rc<RefCell<Vec<Moment<SECTOR>>>>;

/// Two sectors of this many bytes.
#[derive(Debug, Clone)]
pub struct Flash<const SECTOR: usize> {
    words: Vec<u32>,
    /// Bits that read as they like.
    loose: BTreeMap<usize, u32>,
    noise: Cell<u64>,
    /// Where every operation is noted, if it is.
    log: Option<Log<SECTOR>>,
    /// A word that is worn out, and reads erased whatever is written.
    pub worn: Option<usize>,
    /// How often each sector has been erased.
    pub erased: [u32; 2],
}

/// What the driver refuses, too: not whole words, or beyond the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refused;

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::NotAligned
    }
}

impl<const SECTOR: usize> Flash<SECTOR> {
    /// As it comes from the factory.
    pub fn new(seed: u64) -> Self {
        Self {
            words: vec![ERASED; 2 * SECTOR / WORD],
            loose: BTreeMap::new(),
            noise: Cell::new(seed),
            log: None,
            worn: None,
            erased: [0; 2],
        }
    }

    fn read_word(&self, word: usize) -> u32 {
        if self.worn == Some(word) {
            return ERASED;
        }
        let loose = self.loose.get(&word).copied().unwrap_or(0);
        let mut bits = 0;
        if loose != 0 {
            let mut noise = Rng::with_seed(self.noise.get());
            bits = noise.u32(..);
            self.noise.set(noise.u64(..));
        }
        self.words[word] & !loose | bits & loose
    }

    /// Notes every operation from now on.
    pub fn logged(&mut self) -> Log<SECTOR> {
        self.log.insert(Log::default()).clone()
    }

    fn note(&mut self, operation: Operation) {
        if let Some(log) = self.log.take() {
            let flash = self.clone();
            log.borrow_mut().push(Moment { flash, operation });
            self.log = Some(log);
        }
    }

    /// Flips a bit of what has been written.
    pub fn flip(&mut self, at: usize, bit: u32) {
        self.words[at / WORD] ^= 1 << bit;
    }

    /// Leaves a word in between.
    fn tear(&mut self, word: usize, before: u32, after: u32, random: &mut Rng) {
        self.words[word] = match random.u8(..4) {
            0 => before,
            1 => after,
            // Half of what was to change.
            2 => before ^ (before ^ after) & random.u32(..),
            _ => random.u32(..),
        };
        let loose = match random.u8(..3) {
            0 => 0,
            1 => (before ^ after) & random.u32(..),
            _ => random.u32(..) & random.u32(..) & random.u32(..),
        };
        self.loose.insert(word, loose);
    }
}

impl<const SECTOR: usize> Moment<SECTOR> {
    /// The flash after a power cut in the middle of the operation.
    pub fn cut(self, random: &mut Rng) -> Flash<SECTOR> {
        let mut flash = self.flash;
        flash.noise.set(random.u64(..));
        match self.operation {
            Operation::Program { word, value } => {
                let before = flash.words[word];
                flash.tear(word, before, before & value, random);
            }
            Operation::Erase { word } => {
                // How much of the sector is torn: all, hardly anything, or nothing that shows.
                let share = [1.0, 0.01, 0.0][random.usize(..3)];
                let looks_erased = random.bool();
                for word in word..word + SECTOR / WORD {
                    let before = flash.words[word];
                    if random.f64() < share {
                        flash.tear(word, before, ERASED, random);
                    } else if looks_erased {
                        flash.words[word] = ERASED;
                        flash.loose.remove(&word);
                    }
                }
            }
        }
        flash
    }
}

impl<const SECTOR: usize> ErrorType for Flash<SECTOR> {
    type Error = Refused;
}

impl<const SECTOR: usize> ReadNorFlash for Flash<SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        let at = offset as usize;
        if at + bytes.len() > 2 * SECTOR || !at.is_multiple_of(WORD) {
            return Err(Refused);
        }
        for (i, bytes) in bytes.chunks_mut(WORD).enumerate() {
            let word = self.read_word(at / WORD + i).to_le_bytes();
            bytes.copy_from_slice(&word[..bytes.len()]);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

/// The driver's other face.
impl<const SECTOR: usize> AsyncReadNorFlash for Flash<SECTOR> {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        ReadNorFlash::read(self, offset, bytes)
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl<const SECTOR: usize> NorFlash for Flash<SECTOR> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        let (from, to) = (from as usize, to as usize);
        if !from.is_multiple_of(SECTOR) || to != from + SECTOR || to > 2 * SECTOR {
            return Err(Refused);
        }
        self.note(Operation::Erase { word: from / WORD });
        for word in from / WORD..to / WORD {
            self.words[word] = ERASED;
            self.loose.remove(&word);
        }
        self.erased[from / SECTOR] += 1;
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        let at = offset as usize;
        let whole = at.is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD);
        if !whole || at + bytes.len() > 2 * SECTOR {
            return Err(Refused);
        }
        for (i, bytes) in bytes.chunks(WORD).enumerate() {
            let word = at / WORD + i;
            let value = u32::from_le_bytes(bytes.try_into().expect("a word"));
            // RM0090, 3.6.4: anything else takes an erase. What reads erased after a cut is not.
            let erased = self.words[word] == ERASED && !self.loose.contains_key(&word);
            assert!(
                value == 0 || erased,
                "word {word} is written again: {value:#010x}"
            );
            self.note(Operation::Program { word, value });
            self.words[word] &= value;
            match value {
                0 => self.loose.remove(&word),
                _ => None,
            };
        }
        Ok(())
    }
}

/// Runs what never waits.
pub fn now<T>(future: impl Future<Output = T>) -> T {
    let mut context = Context::from_waker(Waker::noop());
    match pin!(future).poll(&mut context) {
        Poll::Ready(done) => done,
        Poll::Pending => panic!("it waits, and nothing here makes it go on"),
    }
}
