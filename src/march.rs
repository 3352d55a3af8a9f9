//! A test of memory that nobody uses yet.

/// March C− (van de Goor, *Using march tests to test SRAMs*, 1993): finds every cell that is stuck, does not
/// change or is changed by another one, and every address that reaches another cell or none. Ten accesses per
/// word, with all bits alike; what two bits of one word do to each other is not looked for. Leaves zeros.
/// Says whether the memory is good.
pub fn march(words: usize, read: impl Fn(usize) -> u32, write: impl Fn(usize, u32)) -> bool {
    const ZEROS: u32 = 0;
    const ONES: u32 = u32::MAX;
    let turn = |at: usize, from: u32, to: u32| {
        let good = read(at) == from;
        write(at, to);
        good
    };
    (0..words).for_each(|at| write(at, ZEROS));
    (0..words).all(|at| turn(at, ZEROS, ONES))
        && (0..words).all(|at| turn(at, ONES, ZEROS))
        && (0..words).rev().all(|at| turn(at, ZEROS, ONES))
        && (0..words).rev().all(|at| turn(at, ONES, ZEROS))
        && (0..words).all(|at| read(at) == ZEROS)
}

#[cfg(test)]
mod tests {
    use super::march;
    use std::cell::RefCell;
    use std::vec;

    const WORDS: usize = 64;

    /// Marches over memory of which every write may go wrong.
    fn good(write: impl Fn(&mut [u32], usize, u32)) -> bool {
        let memory = RefCell::new(vec![0xdead_beef; WORDS]);
        march(
            WORDS,
            |at| memory.borrow()[at],
            |at, value| write(&mut memory.borrow_mut(), at, value),
        )
    }

    #[test]
    fn good_memory_is_good() {
        assert!(good(|memory, at, value| memory[at] = value));
    }

    #[test]
    fn a_bit_that_is_stuck_is_found_wherever_it_is() {
        for word in 0..WORDS {
            for bit in 0..32 {
                let stuck = |high: bool| {
                    good(|memory, at, value| {
                        let mask = u32::from(at == word) << bit;
                        memory[at] = if high { value | mask } else { value & !mask };
                    })
                };
                assert!(!stuck(false) && !stuck(true), "word {word}, bit {bit}");
            }
        }
    }

    #[test]
    fn a_write_that_changes_another_word_is_found_either_way() {
        for (from, to) in [(3, 40), (40, 3)] {
            for rises in [false, true] {
                assert!(
                    !good(|memory, at, value| {
                        if at == from && (value != 0) == rises && memory[at] != value {
                            memory[to] ^= 0x80;
                        }
                        memory[at] = value;
                    }),
                    "{from} to {to}, {rises}"
                );
            }
        }
    }

    #[test]
    fn two_addresses_of_one_word_are_found() {
        assert!(!good(|memory, at, value| {
            for other in [at, at ^ 16] {
                memory[other] = value;
            }
        }));
    }
}
