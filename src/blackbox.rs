//! The black box: converter codes and command of the last two seconds before the first loss or fault, and of a tenth of a
//! second after it.
//!
//! It lies in memory that a restart leaves alone, and that others read, as words. Each tick is how far each code is off
//! what the ones before predict, as Rice codes whose parameter follows the signal (Weinberger, Seroussi and Sapiro,
//! *The LOCO-I lossless image compression algorithm*, 2000): 2.4 s of gauges with 20 µε of noise fit, 1.7 s with 100 and 1.35 s
//! with 300. Blocks are filled one after the other, and each can be read without the ones before.
//!
//! | words | what |
//! | --- | --- |
//! | 0 | [`Phase`] |
//! | 1 | what came: 1 the residuals collapsed, 2 one finger emptied, 3 nothing was there after a change of pressure; or 256 more than a fault's code |
//! | 2, 3 | when, µs, lower half first; zero where the program failed, as nobody knows |
//! | 4 | the tick in which it came, counted as the blocks do |
//! | 5 … | 24 blocks of 53 words: number of the first tick; how many ticks (upper half) and the command; codes of gauges 1 and 2; of gauge 3 and monitor (all gauges and the monitor in pairs); then the bits, from each word's highest on |

mod keep;
mod layout;
mod read;
mod recorder;
mod rice;

pub use keep::{forget, keep, restore};
pub use layout::{CHANNELS, Codes, Memory, Phase, WORDS, load};
pub use read::{Kept, ticks};
pub use recorder::Recorder;
