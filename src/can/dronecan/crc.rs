//! The two checksums of DroneCAN v0: of a transfer's payload, and of a type's definition (its signature).

/// CRC-16-CCITT, high bit first: x^16 + x^12 + x^5 + 1.
const POLYNOMIAL_16: u16 = 0x1021;
/// CRC-64-WE, high bit first.
const POLYNOMIAL_64: u64 = 0x42F0_E1EB_A9EA_3693;

/// What each byte does to the checksum of a payload, so that a frame costs a look for each of its bytes.
const TABLE: [u16; 256] = table();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u16) << 8;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x8000 != 0 { crc << 1 ^ POLYNOMIAL_16 } else { crc << 1 };
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// Goes on with the checksum of a transfer's payload.
#[must_use]
pub(in crate::can) fn transfer_crc(seed: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(seed, |crc, byte| {
        let index = usize::from(crc >> 8) ^ usize::from(*byte);
        crc << 8 ^ TABLE.get(index).copied().unwrap_or(0)
    })
}

/// Where the checksum of each transfer of a type begins: behind the type's signature, low byte first.
#[must_use]
pub(super) fn transfer_seed(signature: u64) -> u16 {
    transfer_crc(0xFFFF, &signature.to_le_bytes())
}

/// Goes on with a signature, from `from`; that of nothing is 0.
#[must_use]
pub(super) fn signature(from: u64, bytes: &[u8]) -> u64 {
    let crc = bytes.iter().fold(!from, |crc, byte| {
        (0..8).fold(crc ^ u64::from(*byte) << 56, |crc, _| {
            if crc >> 63 == 1 { crc << 1 ^ POLYNOMIAL_64 } else { crc << 1 }
        })
    });
    !crc
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check values of the two polynomials over `123456789`.
    #[test]
    fn the_published_check_values() {
        assert_eq!(transfer_crc(0xFFFF, b"123456789"), 0x29B1);
        assert_eq!(signature(0, b"123456789"), 0x62EC_59E3_F1A4_F00A);
    }

    #[test]
    fn both_go_on_where_they_stopped() {
        assert_eq!(transfer_crc(transfer_crc(0xFFFF, b"1234"), b"56789"), 0x29B1);
        assert_eq!(signature(signature(0, b"1234"), b"56789"), 0x62EC_59E3_F1A4_F00A);
    }
}
