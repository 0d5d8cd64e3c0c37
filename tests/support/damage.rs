//! Damaged files: reproducible mutants of sound files.

/// Reproducible pseudorandom numbers (splitmix64).
pub struct Noise(pub u64);

impl Noise {
    /// Next number in 0..`below`.
    pub fn next(&mut self, below: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % below.max(1) as u64) as usize
    }
}

/// Copy of the bytes with one to four changes.
pub fn mutant(bytes: &[u8], noise: &mut Noise) -> Vec<u8> {
    const WORDS: [&[u8]; 10] = [
        b"999999999999",
        b"-1",
        b"0",
        b"4294967296",
        b"1e400",
        b"nan",
        b"\xff\xff\xff\x7f",
        b"\xff\xff\xff\xff",
        b"\n",
        b"*",
    ];
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + noise.next(4) {
        let at = noise.next(bytes.len());
        match noise.next(7) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << noise.next(8),
            1 if !bytes.is_empty() => bytes[at] = noise.next(256) as u8,
            2 => bytes.truncate(at),
            3 => {
                let end = (at + noise.next(64)).min(bytes.len());
                bytes.drain(at.min(end)..end);
            }
            4 => {
                // One number replaces another number.
                let word = WORDS[noise.next(WORDS.len())];
                let digits = bytes[at.min(bytes.len())..]
                    .iter()
                    .position(u8::is_ascii_digit)
                    .map_or(at, |k| at + k);
                let length = bytes[digits.min(bytes.len())..]
                    .iter()
                    .take_while(|b| b.is_ascii_digit())
                    .count();
                bytes.splice(digits..digits + length, word.iter().copied());
            }
            5 => {
                let word = WORDS[noise.next(WORDS.len())];
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
            _ => {
                let from = noise.next(bytes.len());
                let piece = bytes[from..(from + noise.next(200)).min(bytes.len())].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}
