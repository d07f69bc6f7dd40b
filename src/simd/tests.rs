//! The wide types compared with plain numbers.

use proptest::prelude::*;

use super::*;

/// Runs every operation on 16 inputs and returns all results as bits.
struct Everything<'a> {
    a: &'a [f32; 16],
    b: &'a [f32; 16],
    table: &'a [f32],
}

impl Kernel for Everything<'_> {
    type Output = Vec<[u32; 16]>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let mut out = vec![[0; 16]; 31];
        each::<L::Queue>(&self, &mut out);
        out
    }
}

#[inline(always)]
fn each<F: Float>(input: &Everything, out: &mut [[u32; 16]]) {
    for start in (0..16).step_by(F::WIDTH) {
        let (a, b) = (F::load(&input.a[start..]), F::load(&input.b[start..]));
        let (i, j) = (a.to_bits(), b.to_bits());
        let small = i & F::Int::splat(31);
        let all = F::Mask::first(F::WIDTH);
        let truth = |m: F::Mask| F::Int::select(m, F::Int::splat(1), F::Int::splat(0));
        // Up to the very end of the table.
        let first = F::Int::select(small.lt(F::Int::splat(29)), small, F::Int::splat(29));
        let three = F::gather_three(input.table, first, all & a.lt(b));
        let mut words = [0; 32];
        for (word, value) in words.iter_mut().zip(input.table) {
            *word = value.to_bits();
        }
        let words = F::Int::gather_three(&words, first, all & !a.lt(b));
        let results = [
            (a + b).to_bits(),
            (a - b).to_bits(),
            (a * b).to_bits(),
            (a / b).to_bits(),
            a.abs().sqrt().to_bits(),
            (-a).to_bits(),
            a.min(b).to_bits(),
            a.max(b).to_bits(),
            a.floor().to_bits(),
            a.to_int(),
            truth(a.lt(b)),
            truth(a.le(b)),
            truth(a.eq(b)),
            i + j,
            i - j,
            i * j,
            i & j,
            i | j,
            i ^ j,
            i.shl::<5>() ^ i.shr::<7>(),
            i.reverse_bits(),
            truth(i.lt(j)),
            truth(i.eq(j) | !i.lt(j)),
            i.to_float().to_bits(),
            F::gather(input.table, small, all & a.lt(b)).to_bits(),
            three[0].to_bits(),
            three[2].to_bits(),
            words[0],
            words[1],
            truth(a.le(b) ^ a.lt(b)),
            F::select(a.eq(a) & b.eq(b), a.max_abs(b), F::zero()).to_bits(),
        ];
        for (row, result) in out.iter_mut().zip(results) {
            result.store(&mut row[start..]);
        }
    }
}

proptest! {
    #[test]
    fn every_level_gives_the_same_bits(a: [u32; 16], b: [u32; 16], small: [f32; 16]) {
        let table: Vec<f32> = (0..32).map(|i| i as f32 * 1.5).collect();
        let floats = |bits: [u32; 16]| bits.map(f32::from_bits);
        for (a, b) in [(floats(a), floats(b)), (small, floats(b)), (small, small)] {
            let input = |a, b| Everything { a, b, table: &table };
            let expected = dispatch(Isa::PORTABLE, input(&a, &b));
            for isa in Isa::available() {
                let got = dispatch(isa, input(&a, &b));
                for (op, (e, g)) in expected.iter().zip(&got).enumerate() {
                    for lane in 0..16 {
                        // Only the payload of a NaN may differ.
                        let nan = |bits: u32| op < 9 && f32::from_bits(bits).is_nan();
                        prop_assert!(e[lane] == g[lane] || (nan(e[lane]) && nan(g[lane])), "{isa:?} op {op}");
                    }
                }
            }
        }
    }
}

struct Packing(u32);

impl Kernel for Packing {
    type Output = Vec<f32>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<f32> {
        let width = L::Queue::WIDTH;
        let lanes: Vec<f32> = (0..width).map(|i| i as f32).collect();
        let mask = <L::Queue as Float>::Mask::from_bits(self.0);
        let mut out = vec![0.0; width];
        L::Queue::load(&lanes).compress(mask, &mut out);
        out.truncate(mask.count());
        out
    }
}

#[test]
fn compress_packs_the_lanes_of_the_mask_in_order() {
    for isa in Isa::available() {
        for bits in [0u32, 1, 0b1010_0110, 0xffff, 0x8001] {
            let got = dispatch(isa, Packing(bits));
            let expected: Vec<f32> = (0..16).filter(|i| bits >> i & 1 == 1).map(|i| i as f32).collect();
            assert_eq!(got, expected[..got.len()], "{isa:?}");
        }
    }
}

struct RowsAndColumns<'a> {
    table: &'a [[f32; 4]],
    index: &'a [u32; 16],
}

impl Kernel for RowsAndColumns<'_> {
    type Output = [[f32; 4]; 16];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let mut out = [[0.0; 4]; 16];
        for at in (0..16).step_by(L::Queue::WIDTH) {
            let index = <L::Queue as Float>::Int::load(&self.index[at..]);
            let columns = L::Queue::load_rows(self.table, index);
            for (column, values) in columns.iter().enumerate() {
                let mut lanes = [0.0; 16];
                values.store(&mut lanes);
                for (lane, value) in lanes[..L::Queue::WIDTH].iter().enumerate() {
                    assert_eq!(*value, self.table[self.index[at + lane] as usize][column]);
                }
            }
            L::Queue::store_rows(columns, &mut out[at..]);
            let mut mixed = [[0.0; 4]; 16];
            L::Queue::store_rows_mixed(columns, &mut mixed);
            for lane in 0..L::Queue::WIDTH {
                assert_eq!(mixed[L::Queue::mixed(lane)], out[at + lane]);
            }
        }
        out
    }
}

#[test]
fn stored_rows_equal_the_loaded_rows() {
    let table: Vec<[f32; 4]> = (0..40).map(|i| [0, 1, 2, 3].map(|c| (4 * i + c) as f32)).collect();
    let index = std::array::from_fn(|i| (i as u32 * 7 + 3) % 40);
    for isa in Isa::available() {
        let rows = dispatch(isa, RowsAndColumns { table: &table, index: &index });
        assert_eq!(rows, index.map(|i| table[i as usize]), "{isa:?}");
    }
}

struct OutsideOfRows;

impl Kernel for OutsideOfRows {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        L::Queue::load_rows(&[[0.0; 4]; 3], <L::Queue as Float>::Int::splat(3));
    }
}

#[test]
fn load_rows_outside_its_table_panics() {
    for isa in Isa::available() {
        assert!(std::panic::catch_unwind(|| dispatch(isa, OutsideOfRows)).is_err(), "{isa:?}");
    }
}

struct OutOfRange;

impl Kernel for OutOfRange {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let index = <L::Queue as Float>::Int::splat(3);
        L::Queue::gather(&[1.0, 2.0, 3.0], index, <L::Queue as Float>::Mask::first(1));
    }
}

#[test]
fn gather_outside_its_table_panics() {
    for isa in Isa::available() {
        assert!(std::panic::catch_unwind(|| dispatch(isa, OutOfRange)).is_err(), "{isa:?}");
    }
}

struct Children<'a> {
    near: &'a [f32; 16],
    far: &'a [f32; 16],
    words: &'a [u32; 16],
    /// The orders from front to back and from back to front.
    orders: [u64; 2],
}

/// The contents of a stack, and the word that is reported to lie on top.
struct Stacked {
    nears: Vec<f32>,
    words: Vec<u32>,
    top: u32,
}

impl Kernel for Children<'_> {
    /// The results for the nearest hit and for any, and the bits of the children that are entered, from front to back.
    type Output = (Stacked, (Vec<u32>, u32), u32);
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (near, far) = (L::Node::load(self.near), L::Node::load(self.far));
        let (mut nears, mut words, mut others) = ([0.0; 16], [0; 16], [0; 16]);
        let (top, count) =
            Sixteen::take_in_order(near, far, self.words, self.orders[1], &mut nears, &mut words);
        let (word, same) = Sixteen::take_entered(near, far, self.words, &mut others);
        assert_eq!(count, same);
        let count = count as usize;
        let stacked = Stacked { nears: nears[..count].to_vec(), words: words[..count].to_vec(), top };
        (stacked, (others[..count].to_vec(), word), L::Node::in_order(near.le(far), self.orders[0]))
    }
}

#[test]
fn entered_children_are_taken_once_each_and_the_next_one_lies_on_top() {
    let words = std::array::from_fn(|i| 100 + i as u32);
    // From front to back: 5, 10, 15, 4, …
    let slots: [usize; 16] = std::array::from_fn(|i| (5 * i + 5) % 16);
    let order = |slots: &mut dyn Iterator<Item = usize>| {
        slots.enumerate().fold(0, |order, (place, slot)| order | (slot as u64) << sixteen::shift(place))
    };
    let orders = [order(&mut slots.into_iter()), order(&mut slots.into_iter().rev())];
    assert!((0..16).all(|place| sixteen::slot(orders[0], place) == slots[place]));
    for isa in Isa::available() {
        for bits in [0u32, 1, 0x8000, 0b1010_0110, 0xff00, 0x00ff, 0xffff, 0x1234, 0xfedc] {
            let near = std::array::from_fn(|i| (i * 7 % 16) as f32);
            let far =
                near.map(|near| if bits >> (near as usize * 7 % 16) & 1 == 1 { near } else { near - 1.0 });
            let entered: Vec<usize> = (0..16).filter(|i| near[*i] <= far[*i]).collect();
            let (stacked, (found, word), in_order) =
                dispatch(isa, Children { near: &near, far: &far, words: &words, orders });
            let place = |i: usize| slots.iter().position(|slot| *slot == i).unwrap();
            assert_eq!(in_order, entered.iter().fold(0, |bits, i| bits | 1 << place(*i)), "{isa:?}");
            assert_eq!(found, entered.iter().map(|i| words[*i]).collect::<Vec<_>>(), "{isa:?}");
            if entered.is_empty() {
                continue;
            }
            assert_eq!((Some(&stacked.top), Some(&word)), (stacked.words.last(), found.last()), "{isa:?}");
            let nearest = entered.iter().copied().min_by_key(|i| near[*i] as usize).unwrap();
            let foremost = entered.iter().copied().min_by_key(|i| place(*i)).unwrap();
            assert!([nearest, foremost].iter().any(|i| stacked.top == words[*i]), "{isa:?}");
            let mut pairs: Vec<_> = stacked.words.into_iter().zip(stacked.nears).collect();
            pairs.sort_by_key(|(word, _)| *word);
            let expected: Vec<_> = entered.iter().map(|i| (words[*i], near[*i])).collect();
            assert_eq!(pairs, expected, "{isa:?}");
        }
    }
}

struct Halves;

impl Kernel for Halves {
    type Output = [Vec<f32>; 2];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let low = std::array::from_fn(|i| i as f32);
        let (mut loaded, mut same) = ([0.0; 16], [0.0; 16]);
        L::Queue::load_halves(&low, &[9.0; 8]).store(&mut loaded);
        L::Queue::splat_halves(-1.0, 2.5).store(&mut same);
        [loaded, same].map(|lanes| lanes[..L::Queue::WIDTH].to_vec())
    }
}

#[test]
fn halves_of_the_lanes_come_from_two_sources() {
    for isa in Isa::available() {
        let [loaded, same] = dispatch(isa, Halves);
        assert!(loaded.iter().enumerate().all(|(i, v)| *v == if i < 8 { i as f32 } else { 9.0 }), "{isa:?}");
        assert!(same.iter().enumerate().all(|(i, v)| *v == if i < 8 { -1.0 } else { 2.5 }), "{isa:?}");
    }
    assert!([0, 1, u32::MAX].into_iter().all(|number| opaque(number) == number));
}

struct Least<'a>(&'a [f32; 16]);

impl Kernel for Least<'_> {
    type Output = [f32; 3];
    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; 3] {
        let (values, zero) = (L::Queue::load(self.0), L::Queue::zero());
        let [least, a, b, c] = L::Queue::least_of_four([values, values + values, -values, zero]);
        assert!(a == 2.0 * least && c == 0.0);
        assert_eq!(b, -self.0[..L::Queue::WIDTH].iter().fold(f32::NEG_INFINITY, |most, v| v.max(most)));
        [L::Block::load(self.0).least(), values.least(), least]
    }
}

#[test]
fn least_lane_is_found_at_every_position() {
    for isa in Isa::available() {
        for place in 0..16 {
            let values = std::array::from_fn(|i| if i == place { -1.0 } else { i as f32 });
            for least in dispatch(isa, Least(&values)) {
                // Only as many places are checked as there are lanes.
                assert!(least == -1.0 || least == 0.0 && place > 0, "{isa:?}");
            }
        }
        assert_eq!(dispatch(isa, Least(&[f32::INFINITY; 16])), [f32::INFINITY; 3]);
    }
}
