//! A sequential random number generator.

use std::num::Wrapping;

use super::hash::{combine, mix};

/// The sequence of random numbers of a seed, behind `rand`'s traits, for tests and generators of scenes.
#[derive(Clone, Debug)]
pub struct Stream {
    hash: u32,
    counter: u32,
}

impl Stream {
    /// The sequence of `seed`.
    pub fn new(seed: u64) -> Self {
        let halves = (Wrapping(seed as u32), Wrapping((seed >> 32) as u32));
        Self { hash: combine(mix(halves.0), halves.1).0, counter: 0 }
    }
}

impl rand::TryRng for Stream {
    type Error = std::convert::Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Self::Error> {
        self.counter = self.counter.wrapping_add(1);
        Ok(combine(Wrapping(self.hash), Wrapping(self.counter)).0)
    }

    fn try_next_u64(&mut self) -> Result<u64, Self::Error> {
        Ok(u64::from(self.try_next_u32()?) << 32 | u64::from(self.try_next_u32()?))
    }

    fn try_fill_bytes(&mut self, out: &mut [u8]) -> Result<(), Self::Error> {
        for chunk in out.chunks_mut(4) {
            chunk.copy_from_slice(&self.try_next_u32()?.to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn stream_works_as_a_generator_of_rand() {
        let mut a = Stream::new(1);
        let values: Vec<f32> = (0..1000).map(|_| a.random_range(0.0..1.0)).collect();
        let mean = values.iter().sum::<f32>() / 1000.0;
        assert!((mean - 0.5).abs() < 0.04, "{mean}");
        assert_ne!(Stream::new(2).random::<u64>(), Stream::new(1).random::<u64>());
    }
}
