//! The ranges of samples that a film holds.

use std::ops::Range;

/// A set of sample numbers: ranges that neither overlap nor touch, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SampleRanges(Vec<Range<u32>>);

impl SampleRanges {
    /// The samples of one range.
    pub fn of(range: Range<u32>) -> SampleRanges {
        let mut ranges = SampleRanges::default();
        ranges.insert(range);
        ranges
    }

    /// The samples of several ranges in any order; `None` if a range is empty or two overlap.
    pub fn disjoint(ranges: impl IntoIterator<Item = Range<u32>>) -> Option<SampleRanges> {
        let mut sorted: Vec<Range<u32>> = ranges.into_iter().collect();
        sorted.sort_unstable_by_key(|range| range.start);
        let is_empty = sorted.iter().any(Range::is_empty);
        let overlap = sorted.windows(2).any(|pair| pair[1].start < pair[0].end);
        (!is_empty && !overlap).then(|| SampleRanges(joined(sorted)))
    }

    /// Adds a range; ranges that overlap or touch are joined.
    pub fn insert(&mut self, range: Range<u32>) {
        if range.is_empty() {
            return;
        }
        let mut ranges = std::mem::take(&mut self.0);
        ranges.push(range);
        ranges.sort_by_key(|range| range.start);
        self.0 = joined(ranges);
    }

    /// Adds all ranges of another set.
    pub fn extend(&mut self, others: &SampleRanges) {
        others.0.iter().for_each(|range| self.insert(range.clone()));
    }

    /// The ranges.
    pub fn iter(&self) -> impl Iterator<Item = Range<u32>> {
        self.0.iter().cloned()
    }

    /// The number of samples.
    pub fn count(&self) -> u32 {
        self.0.iter().map(|range| range.len() as u32).sum()
    }

    /// Returns the sample at an index within the set.
    pub fn nth(&self, place: u32) -> Option<u32> {
        let mut left = place;
        for range in self.iter() {
            match range.len() as u32 {
                length if left < length => return Some(range.start + left),
                length => left -= length,
            }
        }
        None
    }

    /// Returns the first range that both sets contain.
    pub fn common(&self, other: &SampleRanges) -> Option<Range<u32>> {
        let both = |a: &Range<u32>, b: &Range<u32>| a.start.max(b.start)..a.end.min(b.end);
        let pairs = self.0.iter().flat_map(|a| other.0.iter().map(move |b| both(a, b)));
        pairs.filter(|range| !range.is_empty()).min_by_key(|range| range.start)
    }

    /// Returns the part of a range that the set lacks.
    pub fn missing(&self, of: Range<u32>) -> SampleRanges {
        let mut missing = Vec::new();
        let mut next = of.start;
        for range in self.0.iter().filter(|range| range.end > of.start && range.start < of.end) {
            if range.start > next {
                missing.push(next..range.start);
            }
            next = range.end;
        }
        if next < of.end {
            missing.push(next..of.end);
        }
        SampleRanges(missing)
    }

    /// Returns the samples of `others` that are not in this set.
    pub fn missing_from(&self, others: &SampleRanges) -> SampleRanges {
        SampleRanges(others.iter().flat_map(|range| self.missing(range).0).collect())
    }

    /// Returns part `index` of `count` of `samples` samples, which are cut as evenly as possible.
    pub fn shard(samples: u32, index: u32, count: u32) -> Range<u32> {
        let cut = |i: u32| (u64::from(samples) * u64::from(i) / u64::from(count.max(1))) as u32;
        cut(index)..cut(index + 1)
    }
}

/// Joins sorted ranges that overlap or touch.
fn joined(sorted: Vec<Range<u32>>) -> Vec<Range<u32>> {
    let mut joined: Vec<Range<u32>> = Vec::with_capacity(sorted.len());
    for range in sorted {
        match joined.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

impl std::fmt::Display for SampleRanges {
    /// Formats the ranges as `0..16, 32..64`.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        for (i, range) in self.0.iter().enumerate() {
            let comma = if i > 0 { ", " } else { "" };
            write!(f, "{comma}{}..{}", range.start, range.end)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn shards_cover_all_samples_once() {
        for (samples, count) in [(64, 7), (3, 8), (1, 1), (4_194_304, 64)] {
            let parts = (0..count).map(|i| SampleRanges::shard(samples, i, count));
            let parts = SampleRanges::disjoint(parts.filter(|part| !part.is_empty()));
            assert_eq!(parts, Some(SampleRanges::of(0..samples)));
        }
    }

    #[test]
    fn overlapping_and_empty_ranges_are_detected() {
        let ranges = SampleRanges::disjoint([8..16, 0..4]).unwrap();
        assert_eq!(ranges.to_string(), "0..4, 8..16");
        assert_eq!(ranges.common(&SampleRanges::of(3..9)), Some(3..4));
        assert_eq!(ranges.common(&SampleRanges::of(4..8)), None);
        assert_eq!(SampleRanges::disjoint([0..4, 3..5]), None);
        assert_eq!(SampleRanges::disjoint([std::ops::Range { start: 4, end: 4 }]), None);
    }

    proptest! {
        #[test]
        fn ranges_behave_like_sets_of_numbers(ranges in prop::collection::vec((0u32..40, 0u32..9), 0..9), of in 0u32..50) {
            let mut all = SampleRanges::default();
            let mut set = std::collections::BTreeSet::new();
            for (start, length) in ranges {
                all.insert(start..start + length);
                set.extend(start..start + length);
            }
            prop_assert!(all.iter().flatten().eq(set.iter().copied()));
            prop_assert_eq!(all.count() as usize, set.len());
            let places = (0..set.len() as u32).filter_map(|place| all.nth(place));
            prop_assert!(places.eq(set.iter().copied()) && all.nth(set.len() as u32).is_none());
            let missing = (0..of).filter(|sample| !set.contains(sample));
            prop_assert!(all.missing(0..of).iter().flatten().eq(missing));
        }
    }
}
