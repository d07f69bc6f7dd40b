//! A traversal stack: child words and entry distances in two arrays, accessed a window at a time.

use super::sixteen::SIXTEEN;

/// A stack of child words and entry distances. Places are not checked: beyond the capacity, they wrap around to the
/// bottom.
pub struct TraversalStack {
    words: Box<[u32]>,
    nears: Box<[f32]>,
    /// The number of places, a power of two, minus one.
    last: usize,
}

/// The number of entries in a cache line.
const LINE: usize = 64 / size_of::<u32>();

impl TraversalStack {
    /// The first place. Below it lie this many words and distances.
    pub const FIRST: u32 = 8;

    /// Creates a stack with room for `capacity` entries and with the word `bottom` in all places.
    pub fn new(capacity: usize, bottom: u32) -> Self {
        let places = (Self::FIRST as usize + capacity).next_power_of_two();
        // A window at the last place fits; and the number of cache lines is odd, so that not all stacks begin in the
        // same set of the cache.
        let size = LINE * ((places + SIXTEEN).div_ceil(LINE) | 1);
        Self { words: vec![bottom; size].into(), nears: vec![0.0; size].into(), last: places - 1 }
    }

    /// The window of words and distances from a place on.
    #[inline(always)]
    pub fn from(&mut self, place: u32) -> (&mut [u32; SIXTEEN], &mut [f32; SIXTEEN]) {
        debug_assert!(place as usize <= self.last, "a stack that is too small");
        let place = place as usize & self.last;
        // SAFETY: behind every place, both arrays have `SIXTEEN` entries.
        unsafe {
            (&mut *self.words.as_mut_ptr().add(place).cast(), &mut *self.nears.as_mut_ptr().add(place).cast())
        }
    }

    /// The window of distances below a place.
    #[inline(always)]
    pub fn nears_below(&self, place: u32) -> &[f32; Self::FIRST as usize] {
        let first = place.wrapping_sub(Self::FIRST) as usize & self.last;
        // SAFETY: as above, and these are fewer.
        unsafe { &*self.nears.as_ptr().add(first).cast() }
    }

    /// The word at a place.
    #[inline(always)]
    pub fn word(&self, place: u32) -> u32 {
        // SAFETY: every place is within both arrays.
        unsafe { *self.words.get_unchecked(place as usize & self.last) }
    }

    /// The distance at a place.
    #[inline(always)]
    pub fn near(&self, place: u32) -> f32 {
        // SAFETY: every place is within both arrays.
        unsafe { *self.nears.get_unchecked(place as usize & self.last) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_read_back_and_the_bottom_is_preserved() {
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
        // Reads below the bottom and beyond the top are allowed.
        stack.nears_below(0);
        stack.word(u32::MAX);
        stack.near(last + 1);
    }
}
