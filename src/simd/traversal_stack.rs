//! What waits for a ray, in two columns that are read and written a window at a time.

use super::sixteen::SIXTEEN;

/// A stack of words and of distances. Places are not checked: beyond its capacity, they begin again at the bottom.
pub struct TraversalStack {
    words: Box<[u32]>,
    nears: Box<[f32]>,
    /// The number of places, a power of two, less one.
    last: usize,
}

/// Numbers of a cache line.
const LINE: usize = 64 / size_of::<u32>();

impl TraversalStack {
    /// The first place. Below it lie as many words and distances.
    pub const FIRST: u32 = 8;

    /// With room for so many entries, and with the word `bottom` in all places.
    pub fn new(capacity: usize, bottom: u32) -> Self {
        let places = (Self::FIRST as usize + capacity).next_power_of_two();
        // What is written at the last place fits; and an odd number of cache lines, so that not all stacks begin in the
        // same set of the cache.
        let size = LINE * ((places + SIXTEEN).div_ceil(LINE) | 1);
        Self { words: vec![bottom; size].into(), nears: vec![0.0; size].into(), last: places - 1 }
    }

    /// The words and distances from a place on.
    #[inline(always)]
    pub fn from(&mut self, place: u32) -> (&mut [u32; SIXTEEN], &mut [f32; SIXTEEN]) {
        debug_assert!(place as usize <= self.last, "a stack that is too small");
        let place = place as usize & self.last;
        // SAFETY: behind every place, both columns have `SIXTEEN` entries.
        unsafe {
            (&mut *self.words.as_mut_ptr().add(place).cast(), &mut *self.nears.as_mut_ptr().add(place).cast())
        }
    }

    /// The distances below a place.
    #[inline(always)]
    pub fn nears_below(&self, place: u32) -> &[f32; Self::FIRST as usize] {
        let first = place.wrapping_sub(Self::FIRST) as usize & self.last;
        // SAFETY: as above, and these are fewer.
        unsafe { &*self.nears.as_ptr().add(first).cast() }
    }

    /// The word at a place.
    #[inline(always)]
    pub fn word(&self, place: u32) -> u32 {
        // SAFETY: every place is within both columns.
        unsafe { *self.words.get_unchecked(place as usize & self.last) }
    }

    /// The distance at a place.
    #[inline(always)]
    pub fn near(&self, place: u32) -> f32 {
        // SAFETY: every place is within both columns.
        unsafe { *self.nears.get_unchecked(place as usize & self.last) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_found_and_the_bottom_stays() {
        let mut stack = TraversalStack::new(20, 7);
        let last = stack.last as u32;
        assert!(last >= 20 + TraversalStack::FIRST - 1);
        assert_eq!(stack.word(TraversalStack::FIRST - 1), 7);
        for place in [TraversalStack::FIRST, 12, last] {
            let (words, nears) = stack.from(place);
            for i in 0..SIXTEEN {
                (words[i], nears[i]) = (100 + i as u32, i as f32);
            }
            assert_eq!((stack.word(place), stack.near(place)), (100, 0.0));
            let above = (place + 8).min(last);
            let first = 8.0 - (place + 8 - above) as f32;
            assert_eq!((stack.word(above), stack.near(above)), (100 + first as u32, first));
            if place + 8 == above {
                assert_eq!(*stack.nears_below(above), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
            }
        }
        assert_eq!(stack.word(TraversalStack::FIRST - 1), 7);
        // Below the bottom and beyond the top there is something, whatever it is.
        stack.nears_below(0);
        stack.word(u32::MAX);
        stack.near(last + 1);
    }
}
