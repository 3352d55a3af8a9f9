//! The sectors of flash that settings and black box have, which the model of the part does not change: it knows the registers and the
//! times, and here is the array (RM0090, 3.6).

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rigless::chip::parallel::Peer;
use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::snapshot::Store;
use rigless::soc::stm32f427::generated::FLASH;
use rigless::soc::stm32f427::generated::flash::{Register, cr, sr};
use rigless::soc::stm32f427::peripherals::flash::Flash;
use rigless::soc::{Layout, Width};
use rigless::time::{EventId, VirtualNanos};

/// Where the sectors lie.
pub const BASE: u64 = 0x0810_0000;
const SECTOR: usize = 16 << 10;
const SECTORS: u64 = 3;
/// Bytes of all.
pub const SIZE: usize = SECTORS as usize * SECTOR;
/// What the first is called in the control register.
const FIRST: u64 = 0b1_0000;
/// Where the board has them answer: the core's accesses are led there, for where they lie the model has memory that
/// nobody can write.
pub const WINDOW: u64 = 0x9000_0000;
/// Programming of a word (DS9405, flash memory programming).
const PROGRAM_NANOS: u64 = 16_000;
/// The parallelism that the board's rail allows and the firmware asks for: a word.
const WORDS: u64 = 0b10;
const HSI_HZ: u64 = 16_000_000;

/// What is being done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operation {
    Program { word: usize, value: u32 },
    Erase { sector: usize },
}

/// The cells.
#[derive(Debug)]
pub struct Array {
    words: Vec<u32>,
    /// A store that the registers have not heard of.
    stored: Option<(usize, u32)>,
    running: Option<Operation>,
    /// Words programmed, and sectors erased.
    pub programmed: u32,
    /// Sectors erased.
    pub erased: u32,
    /// Cuts while a word was programmed, and while a sector was erased.
    pub cuts: (u32, u32),
    /// The supply goes off in the middle of the operation that makes this zero.
    pub until_cut: Option<u32>,
    /// Or in the middle of the next erase.
    pub cuts_erases: bool,
    /// State of what draws the bits that a cut leaves.
    noise: u32,
}

impl Array {
    /// The sectors as they come from the factory, or with something in them.
    pub fn new(bytes: Option<&[u8]>) -> Self {
        let mut words = vec![u32::MAX; SIZE / 4];
        let (given, _) = bytes.unwrap_or_default().as_chunks::<4>();
        for (word, bytes) in words.iter_mut().zip(given) {
            *word = u32::from_le_bytes(*bytes);
        }
        Self {
            words,
            stored: None,
            running: None,
            programmed: 0,
            erased: 0,
            cuts: (0, 0),
            until_cut: None,
            cuts_erases: false,
            noise: 0x9e37_79b9,
        }
    }

    /// What is in it.
    pub fn bytes(&self) -> Vec<u8> {
        self.words
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .collect()
    }

    fn random(&mut self) -> u32 {
        // xorshift
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 17;
        self.noise ^= self.noise << 5;
        self.noise
    }

    /// Whether the supply goes off in the middle of what begins now.
    fn is_cut(&mut self, operation: Operation) -> bool {
        let erases = matches!(operation, Operation::Erase { .. });
        let cut = self.until_cut == Some(0) || erases && self.cuts_erases;
        self.until_cut = match self.until_cut {
            Some(left) if !cut => Some(left - 1),
            _ => None,
        };
        cut
    }

    fn finish(&mut self) {
        match self.running.take() {
            Some(Operation::Program { word, value }) => {
                self.words[word] &= value;
                self.programmed += 1;
            }
            Some(Operation::Erase { sector }) => {
                let first = sector * SECTOR / 4;
                self.words[first..first + SECTOR / 4].fill(u32::MAX);
                self.erased += 1;
            }
            None => {}
        }
    }

    /// A reset in the middle of an operation leaves nobody knows what.
    pub fn cut(&mut self) {
        self.stored = None;
        self.until_cut = None;
        self.cuts_erases = false;
        match self.running.take() {
            Some(Operation::Program { word, value }) => {
                self.cuts.0 += 1;
                let kept = self.random();
                self.words[word] &= value | kept;
            }
            Some(Operation::Erase { sector }) => {
                self.cuts.1 += 1;
                let first = sector * SECTOR / 4;
                for word in first..first + SECTOR / 4 {
                    let set = self.random();
                    self.words[word] |= set;
                }
            }
            None => {}
        }
    }
}

/// The array, as several models have it.
pub type Shared = Arc<Mutex<Array>>;

/// For as long as nobody else needs it.
pub fn lock(array: &Shared) -> MutexGuard<'_, Array> {
    array.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The array where the core reads and writes it.
#[derive(Debug)]
pub struct Cells(pub Shared);

/// Its runs start from reset.
impl Store for Cells {}

impl Peer for Cells {
    fn read(&mut self, offset: u64, width: Width, _context: &mut DeviceContext<'_>) -> u64 {
        let array = lock(&self.0);
        let word = array.words.get(offset as usize / 4);
        let word = u64::from(word.copied().unwrap_or(u32::MAX));
        word >> (8 * (offset % 4)) & width.mask()
    }

    fn write(&mut self, offset: u64, width: Width, value: u64, context: &mut DeviceContext<'_>) {
        // What is not a whole word is an error that is not modelled: then nothing is programmed.
        if width == Width::W32 && offset.is_multiple_of(4) {
            lock(&self.0).stored = Some((offset as usize / 4, value as u32));
        }
        // A write of no flag, by which the registers' model hears of it.
        let status = FLASH.base + u64::from(Register::Sr.spec().offset);
        context.write_to(status, Width::W32, 0, 0);
    }
}

/// The registers, which change the array.
#[derive(Debug)]
pub struct Programmer {
    model: Flash,
    array: Shared,
    /// The end of programming, or the moment of a cut.
    event: Option<EventId>,
    cuts: bool,
}

impl Programmer {
    /// The registers out of a reset.
    pub fn new(array: Shared) -> Self {
        Self {
            model: Flash::with_clock(HSI_HZ),
            array,
            event: None,
            cuts: false,
        }
    }

    fn begin(&mut self, operation: Operation, takes: u64, context: &mut DeviceContext<'_>) {
        let mut array = lock(&self.array);
        array.running = Some(operation);
        self.cuts = array.is_cut(operation);
        let after = if self.cuts { takes / 2 } else { takes };
        // The model itself ends an erase that is not cut.
        if self.cuts || matches!(operation, Operation::Program { .. }) {
            let at = VirtualNanos(context.now().0 + after);
            self.event = Some(context.schedule(at));
        }
    }

    fn program(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let Some((word, value)) = lock(&self.array).stored.take() else {
            return;
        };
        let (control, status) = (registers.get(Register::Cr), registers.get(Register::Sr));
        let allowed = cr::PG.is_set(control)
            && !cr::LOCK.is_set(control)
            && cr::PSIZE.get(control) == WORDS
            && !sr::BSY.is_set(status);
        if !allowed {
            registers.set(Register::Sr, sr::PGSERR.set(status, 1));
            return;
        }
        registers.set(Register::Sr, sr::BSY.set(status, 1));
        self.begin(Operation::Program { word, value }, PROGRAM_NANOS, context);
    }
}

impl Device for Programmer {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let was_busy = sr::BSY.is_set(registers.get(Register::Sr));
        self.model.write(register, value, registers, context);
        let is_busy = sr::BSY.is_set(registers.get(Register::Sr));
        let control = registers.get(Register::Cr);
        if register == Register::Cr && is_busy && !was_busy {
            let sector = cr::SNB.get(control);
            if cr::SER.is_set(control) && (FIRST..FIRST + SECTORS).contains(&sector) {
                let sector = (sector - FIRST) as usize;
                self.begin(Operation::Erase { sector }, 200_000_000, context);
            }
        }
        if register == Register::Sr {
            self.program(registers, context);
        }
    }

    fn on_event(
        &mut self,
        event: EventId,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if self.event != Some(event) {
            self.model.on_event(event, registers, context);
            if !sr::BSY.is_set(registers.get(Register::Sr)) {
                lock(&self.array).finish();
            }
            return;
        }
        self.event = None;
        if self.cuts {
            context.request_reset();
            return;
        }
        lock(&self.array).finish();
        let status = sr::BSY.set(registers.get(Register::Sr), 0);
        let ended = cr::EOPIE.is_set(registers.get(Register::Cr));
        let status = sr::EOP.set(status, ended.into());
        registers.set(Register::Sr, status);
        // Has the model look at its interrupt.
        self.model.write(Register::Sr, 0, registers, context);
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.on_clock(hz, registers, context);
    }
}
