//! Random numbers that are the same on every machine and in every order of computation.
//!
//! SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), whose whole state is one number, and xoshiro256** (Blackman and Vigna, ACM TOMS 47
//! (2021) 36), which it seeds.  Fits that start anew draw from the first, plans of runs from the second: rows of results and findings
//! that are recorded somewhere depend on the numbers that follow a seed, so neither may take the place of the other.

/// SplitMix64: a generator of 64 bits from one number, which is its seed.
#[derive(Clone, Debug)]
pub struct SplitMix(pub u64);

impl SplitMix {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in (0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64 + f64::EPSILON / 4.0
    }

    /// Standard normal, as the sum of twelve uniform numbers.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// xoshiro256**, seeded by a number and a stream: every quantity has its own, so adding one changes no other.
#[derive(Clone, Debug)]
pub struct Xoshiro([u64; 4]);

impl Xoshiro {
    /// The generator of a stream.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut seeds = SplitMix(seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(17));
        Self(std::array::from_fn(|_| seeds.bits()))
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        let s = &mut self.0;
        let result = s[1].wrapping_mul(5).rotate_left(7).wrapping_mul(9);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// A number in (0, 1), never an end.
    pub fn uniform(&mut self) -> f64 {
        ((self.bits() >> 12) as f64 + 0.5) / (1u64 << 52) as f64
    }

    /// A number below `n`, all alike to within `n / 2^64`.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// The numbers below `n` in a random order (Fisher and Yates).
    pub fn permutation(&mut self, n: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..n as u32).collect();
        for k in (1..n).rev() {
            order.swap(k, self.below(k + 1));
        }
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that follow the seed 1234567, as published for SplitMix64 (Rosetta Code, "Pseudo-random numbers/Splitmix64").
    #[test]
    fn bits_are_those_published() {
        let mut random = SplitMix(1_234_567);
        let published = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
        ];
        assert_eq!(published, std::array::from_fn(|_| random.bits()));
        // xoshiro256** from the state 1, 2, 3, 4, as in the tests of the crate `rand_xoshiro`.
        let mut random = Xoshiro([1, 2, 3, 4]);
        let published = [11_520, 0, 1_509_978_240, 1_215_971_899_390_074_240, 1_216_172_134_540_287_360];
        assert_eq!(published, std::array::from_fn(|_| random.bits()));
    }

    #[test]
    fn streams_are_uniform_and_unlike() {
        let mut random = Xoshiro::new(7, 1);
        let values: Vec<f64> = (0..10_000).map(|_| random.uniform()).collect();
        let mean = values.iter().sum::<f64>() / 1e4;
        // Five standard deviations of the mean of 10000 uniform numbers.
        assert!((mean - 0.5).abs() < 5.0 / (12.0f64 * 1e4).sqrt(), "{mean}");
        let mut other = Xoshiro::new(7, 2);
        let products: f64 = values.iter().map(|v| (v - 0.5) * (other.uniform() - 0.5)).sum::<f64>() / 1e4;
        assert!(products.abs() < 5.0 / 12.0 / 100.0, "{products}");
        let mut order = Xoshiro::new(1, 0).permutation(1000);
        assert_ne!(order, (0..1000).collect::<Vec<u32>>());
        order.sort_unstable();
        assert_eq!(order, (0..1000).collect::<Vec<u32>>());
    }
}
