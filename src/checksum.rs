//! CRC-32C, the checksum of everything that is kept.

use crc::{CRC_32_ISCSI, Crc, NoTable};

/// The checksum of something, of which `before` is the checksum of what stands before these bytes; zero for nothing.
pub(crate) fn checksum(before: u32, bytes: &[u8]) -> u32 {
    bytes.iter().fold(before, |sum, &byte| add(sum, byte))
}

// Once in the image: where it knows how many bytes there are, the compiler writes a shift for each of their bits,
// which for a failure's record was 8 kB.
#[inline(never)]
fn add(before: u32, byte: u8) -> u32 {
    let crc = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);
    // What comes out is inverted, and what goes in has its bits the other way round.
    let mut digest = crc.digest_with_initial((!before).reverse_bits());
    digest.update(&[byte]);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::checksum;

    #[test]
    fn it_is_crc_32c_however_it_is_cut() {
        // RFC 3720, B.4: 32 bytes of zeros, and from 0 to 31.
        let count: [u8; 32] = core::array::from_fn(|i| i as u8);
        for (bytes, sum) in [([0; 32], 0x8a91_36aa), (count, 0x46dd_794e)] {
            for cut in 0..=32 {
                let (first, second) = bytes.split_at(cut);
                assert_eq!(checksum(checksum(0, first), second), sum);
            }
        }
    }
}
