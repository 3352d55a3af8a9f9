//! Who calls whom in the image, read off its machine code: can the control tick reach a panic?
//!
//! Direct calls, jumps from one function into another, and functions whose address is taken, be it as a
//! constant or by way of a table of functions (a trait object's or a waker's): all count as calls. A call by
//! a pointer that comes from RAM cannot be followed; such sites are counted and named.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use anyhow::Context;
use object::{Object, ObjectSection, ObjectSymbol};

use crate::image::Image;

/// One function.
#[derive(Debug, Clone, Default)]
struct Function {
    name: String,
    size: u64,
    /// Functions that it may call.
    calls: BTreeSet<u64>,
    /// Calls by pointer.
    indirect: usize,
    /// Instructions that stop the program.
    traps: usize,
}

/// Every function of an image.
pub struct Calls {
    functions: BTreeMap<u64, Function>,
}

/// A way from a function to a panic: the functions in between, first to last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Way(pub Vec<String>);

/// What can be reached from a function.
#[derive(Debug, Clone, Default)]
pub struct Reach {
    /// Functions that were looked at.
    pub functions: usize,
    /// Bytes of their code.
    pub bytes: u64,
    /// Functions that call by a pointer from RAM, with the number of such calls.
    pub indirect: Vec<(String, usize)>,
    /// The last steps of every way into a panic or a trap.
    pub panics: Vec<Way>,
}

impl Calls {
    /// Reads the image's code.
    pub fn read(image: &Image) -> anyhow::Result<Self> {
        let file = object::File::parse(image.bytes.as_slice())?;
        let memory = Memory::of(&file)?;
        let data = data_ranges(&file);
        let mut functions = BTreeMap::new();
        for (name, symbol) in image.functions() {
            if symbol.size > 0 {
                functions.insert(
                    symbol.address,
                    Function {
                        name: name.into(),
                        size: symbol.size,
                        ..Function::default()
                    },
                );
            }
        }
        let starts: BTreeMap<u64, u64> = functions
            .iter()
            .map(|(&start, function)| (start, function.size))
            .collect();
        let owner = |address: u64| {
            let (&start, &size) = starts.range(..=address).next_back()?;
            (address < start + size).then_some(start)
        };
        for (&start, function) in &mut functions {
            scan(start, function, &memory, &data, &owner);
        }
        Ok(Self { functions })
    }

    /// What the functions whose names end like `roots` can reach.
    pub fn reach(&self, roots: &[&str]) -> anyhow::Result<Reach> {
        let mut from: BTreeMap<u64, Option<u64>> = BTreeMap::new();
        let mut queue = VecDeque::new();
        for root in roots {
            let (&start, _) = self
                .functions
                .iter()
                .find(|(_, function)| function.name.ends_with(root))
                .with_context(|| format!("the image has no function {root}"))?;
            from.insert(start, None);
            queue.push_back(start);
        }
        let mut reach = Reach::default();
        while let Some(start) = queue.pop_front() {
            let function = &self.functions[&start];
            if is_panic(&function.name) || function.traps > 0 {
                let mut way = vec![function.name.clone()];
                let mut at = start;
                while let Some(Some(before)) = from.get(&at) {
                    way.insert(0, self.functions[before].name.clone());
                    at = *before;
                }
                reach.panics.push(Way(way));
                continue;
            }
            reach.functions += 1;
            reach.bytes += function.size;
            if function.indirect > 0 {
                reach
                    .indirect
                    .push((function.name.clone(), function.indirect));
            }
            for &callee in &function.calls {
                if self.functions.contains_key(&callee) && !from.contains_key(&callee) {
                    from.insert(callee, Some(start));
                    queue.push_back(callee);
                }
            }
        }
        Ok(reach)
    }
}

/// Where the image calls a panic, by an instruction of four bytes.
pub fn panic_site(image: &Image) -> Option<u64> {
    let file = object::File::parse(image.bytes.as_slice()).ok()?;
    let memory = Memory::of(&file).ok()?;
    let panics: Vec<u64> = image
        .functions()
        .filter(|(name, _)| is_panic(name))
        .map(|(_, symbol)| symbol.address)
        .collect();
    let functions = image.functions().filter(|(name, _)| !is_panic(name));
    functions
        .flat_map(|(_, symbol)| (symbol.address..symbol.address + symbol.size).step_by(2))
        .find(|&at| {
            let (first, second) = (memory.half(at), memory.half(at + 2));
            first.zip(second).is_some_and(|(first, second)| {
                matches!(decode(at, first, Some(second)), Step::Jump(to) if panics.contains(&to))
            })
        })
}

/// Functions that do nothing but panic.
fn is_panic(name: &str) -> bool {
    name.contains("core::panicking::")
        || name.contains("rust_begin_unwind")
        || name.contains("failsafe::panicked")
        || name.contains("unwrap_failed")
        || name.contains("expect_failed")
        || name.contains("_fail")
        || name.contains("core::cell::panic_already")
}

/// The bytes of the image that lie in flash.
struct Memory(Vec<(u64, Vec<u8>)>);

impl Memory {
    fn of(file: &object::File<'_>) -> anyhow::Result<Self> {
        let mut sections = Vec::new();
        for section in file.sections() {
            if (0x0800_0000..0x0820_0000).contains(&section.address()) {
                sections.push((section.address(), section.data()?.to_vec()));
            }
        }
        Ok(Self(sections))
    }

    fn half(&self, address: u64) -> Option<u32> {
        let (start, bytes) = self
            .0
            .iter()
            .find(|(start, bytes)| (*start..*start + bytes.len() as u64).contains(&address))?;
        let at = (address - start) as usize;
        let pair: [u8; 2] = bytes.get(at..at + 2)?.try_into().ok()?;
        Some(u32::from(u16::from_le_bytes(pair)))
    }

    fn word(&self, address: u64) -> Option<u64> {
        Some(u64::from(
            self.half(address)? | self.half(address + 2)? << 16,
        ))
    }
}

/// Where the code holds data: from each `$d` to the next `$t` (ELF for the ARM architecture, 5.5.5).
fn data_ranges(file: &object::File<'_>) -> Vec<(u64, u64)> {
    let mut marks: Vec<(u64, bool)> = file
        .symbols()
        .filter_map(|symbol| match symbol.name().ok()? {
            name if name == "$d" || name.starts_with("$d.") => Some((symbol.address(), true)),
            name if name == "$t" || name.starts_with("$t.") => Some((symbol.address() & !1, false)),
            _ => None,
        })
        .collect();
    marks.sort_unstable();
    marks
        .windows(2)
        .filter(|pair| pair[0].1)
        .map(|pair| (pair[0].0, pair[1].0))
        .collect()
}

/// A table of functions has no more entries than this that matter here.
const TABLE_WORDS: u64 = 8;

/// Finds what one function calls.
fn scan(
    start: u64,
    function: &mut Function,
    memory: &Memory,
    data: &[(u64, u64)],
    owner: &impl Fn(u64) -> Option<u64>,
) {
    let end = start + function.size;
    let mut constants = Vec::new();
    // The lower halves that `movw` has put into registers.
    let mut lower = [None; 16];
    let mut at = start;
    while at < end {
        if let Some(&(_, data_end)) = data.iter().find(|(from, to)| (*from..*to).contains(&at)) {
            let mut word_at = at.next_multiple_of(4);
            while word_at + 4 <= data_end.min(end) {
                constants.extend(memory.word(word_at));
                word_at += 4;
            }
            at = data_end;
            continue;
        }
        let Some(first) = memory.half(at) else { break };
        let wide = first >> 11 >= 0b11101;
        let second = if wide {
            memory.half(at + 2).unwrap_or(0)
        } else {
            0
        };
        match decode(at, first, wide.then_some(second)) {
            Step::Jump(target) => {
                if !(start..end).contains(&target) {
                    function.calls.extend(owner(target));
                }
            }
            Step::Indirect => function.indirect += 1,
            Step::Trap => function.traps += 1,
            Step::Lower(register, value) => lower[register] = Some(value),
            Step::Upper(register, value) => {
                if let Some(low) = lower[register] {
                    constants.push(u64::from(value << 16 | low));
                }
            }
            Step::Other => {}
        }
        at += if wide { 4 } else { 2 };
    }
    for constant in constants {
        if constant & 1 == 1 && owner(constant & !1) == Some(constant & !1) {
            function.calls.insert(constant & !1);
            continue;
        }
        for i in 0..TABLE_WORDS {
            let Some(entry) = memory.word(constant + 4 * i) else {
                break;
            };
            if constant % 4 == 0 && entry & 1 == 1 && owner(entry & !1) == Some(entry & !1) {
                function.calls.insert(entry & !1);
            }
        }
    }
}

/// What matters about an instruction.
enum Step {
    /// It goes, or may go, there.
    Jump(u64),
    /// It goes where a register says.
    Indirect,
    /// It stops the program.
    Trap,
    /// It loads the lower half of a constant.
    Lower(usize, u32),
    /// It loads the upper half of a constant.
    Upper(usize, u32),
    Other,
}

/// Thumb encodings (ARMv7-M ARM, A5 and A7.7).
fn decode(at: u64, first: u32, second: Option<u32>) -> Step {
    let offset = |value: u32, bits: u32| {
        let shift = 32 - bits;
        i64::from((value << shift) as i32 >> shift)
    };
    let jump = |offset: i64| Step::Jump((at as i64 + 4 + offset) as u64);
    let Some(second) = second else {
        return match first {
            // UDF
            _ if first >> 8 == 0xde => Step::Trap,
            // B, conditional and not
            _ if first >> 12 == 0xd && first >> 8 & 0xf < 0xe => {
                jump(offset((first & 0xff) << 1, 9))
            }
            _ if first >> 11 == 0b11100 => jump(offset((first & 0x7ff) << 1, 12)),
            // BLX, BX; BX LR returns
            _ if first & 0xff87 == 0x4780 => Step::Indirect,
            _ if first & 0xff87 == 0x4700 && first != 0x4770 => Step::Indirect,
            _ => Step::Other,
        };
    };
    let (sign, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let low = second & 0x7ff;
    if first >> 11 == 0b11110 && second >> 15 == 1 {
        // BL and B.W
        if second >> 12 & 1 == 1 {
            let (i1, i2) = (!(j1 ^ sign) & 1, !(j2 ^ sign) & 1);
            let value = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | low << 1;
            return jump(offset(value, 25));
        }
        // B<c>.W
        if second >> 14 & 1 == 0 && first >> 7 & 7 != 7 {
            let value = sign << 20 | j2 << 19 | j1 << 18 | (first & 0x3f) << 12 | low << 1;
            return jump(offset(value, 21));
        }
        // UDF.W
        if first & 0xfff0 == 0xf7f0 && second >> 12 == 0xa {
            return Step::Trap;
        }
    }
    if first >> 11 == 0b11110 && second >> 15 == 0 {
        let value =
            (first & 0xf) << 12 | (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xff;
        let register = (second >> 8 & 0xf) as usize;
        match first & 0xfbf0 {
            0xf240 => return Step::Lower(register, value),
            0xf2c0 => return Step::Upper(register, value),
            _ => {}
        }
    }
    // LDR PC; from the stack it is a return.
    if first & 0xff70 == 0xf850 && first & 0xf != 13 && second >> 12 == 0xf {
        return Step::Indirect;
    }
    Step::Other
}
