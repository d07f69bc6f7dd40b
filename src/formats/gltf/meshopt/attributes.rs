//! Attributes: each byte position is coded as deltas between successive elements, in groups of as few bits as they
//! need.

use super::ByteSource;

/// The number of elements with a common bit width.
const GROUP: usize = 16;
/// Upper limits for the bytes and the elements of a block.
const MOST_BYTES: usize = 8192;
const MOST_ELEMENTS: usize = 256;

/// Decodes elements of `stride` bytes; none if the data are damaged.
pub(super) fn decode(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let (header, data) = data.split_first()?;
    let second = match header {
        0xa0 => false,
        0xa1 => true,
        _ => return None,
    };
    // The tail: zeros, the first element, and in the second version a byte per four bytes of an element with the kind
    // of their deltas.
    let kinds = if second { stride / 4 } else { 0 };
    let least = if second { 24 } else { 32 };
    let (data, tail) = data.split_at_checked(data.len().checked_sub((stride + kinds).max(least))?)?;
    let (_, tail) = tail.split_at_checked(tail.len() - stride - kinds)?;
    let (first, kinds) = tail.split_at_checked(stride)?;
    let mut source = ByteSource(data);
    let mut last = first.to_vec();
    let mut elements = vec![0; count * stride];
    let size = ((MOST_BYTES / stride) & !(GROUP - 1)).min(MOST_ELEMENTS);
    let mut columns = vec![0; 4 * size];
    for block in elements.chunks_mut(size * stride) {
        let count = block.len() / stride;
        let controls = if second { source.take(stride / 4)? } else { &[] };
        for four in 0..stride / 4 {
            for byte in 0..4 {
                let control = controls.get(four).map(|control| control >> (2 * byte) & 3);
                column(&mut source, &mut columns[byte * size..][..size], count, control)?;
            }
            let kind = kinds.get(four).copied().unwrap_or(0);
            let last: &mut [u8; 4] = last.get_mut(four * 4..)?.first_chunk_mut()?;
            let columns: [&[u8]; 4] = std::array::from_fn(|byte| &columns[byte * size..][..count]);
            let places = block.iter_mut().skip(four * 4);
            add_up(columns, kind, last, places, stride)?;
        }
    }
    source.0.is_empty().then_some(elements)
}

/// Reads the deltas of one byte position for all elements of a block.
fn column(source: &mut ByteSource, column: &mut [u8], count: usize, control: Option<u8>) -> Option<()> {
    const WIDTHS: [[u32; 4]; 3] = [[0, 2, 4, 8], [0, 1, 2, 4], [1, 2, 4, 8]];
    let widths = match control {
        None => WIDTHS[0],
        Some(control @ (0 | 1)) => WIDTHS[1 + usize::from(control)],
        Some(2) => {
            column.fill(0);
            return Some(());
        }
        Some(_) => {
            column[..count].copy_from_slice(source.take(count)?);
            return Some(());
        }
    };
    let groups = count.div_ceil(GROUP);
    let headers = source.take(groups.div_ceil(4))?;
    for (number, group) in column.chunks_mut(GROUP).take(groups).enumerate() {
        let width = widths[usize::from(headers[number / 4] >> (number % 4 * 2) & 3)];
        read_group(source, group, width)?;
    }
    Some(())
}

/// Reads sixteen deltas of `width` bits each. If all bits are set, a whole byte follows later instead.
fn read_group(source: &mut ByteSource, group: &mut [u8], width: u32) -> Option<()> {
    match width {
        0 => group.fill(0),
        8 => group.copy_from_slice(source.take(GROUP)?),
        _ => {
            let packed = source.take(GROUP * width as usize / 8)?;
            let (a_byte, whole) = (8 / width as usize, (1 << width) - 1);
            for (number, value) in group.iter_mut().enumerate() {
                let (byte, place) = (packed[number / a_byte], (number % a_byte) as u32 * width);
                // Single bits are stored least significant first, all others most significant first.
                let shift = if width == 1 { place } else { 8 - width - place };
                *value = byte >> shift & whole;
                if *value == whole {
                    *value = source.byte()?;
                }
            }
        }
    }
    Some(())
}

/// Accumulates deltas to elements, four bytes of each.
fn add_up<'b>(
    columns: [&[u8]; 4],
    kind: u8,
    last: &mut [u8; 4],
    places: impl Iterator<Item = &'b mut u8>,
    stride: usize,
) -> Option<()> {
    let mut places = places;
    for number in 0..columns[0].len() {
        let change = columns.map(|column| column[number]);
        match kind & 3 {
            0 => last.iter_mut().zip(change).for_each(|(byte, change)| {
                *byte = byte.wrapping_add(change >> 1 ^ (change & 1).wrapping_neg());
            }),
            1 => {
                for (half, change) in last.chunks_exact_mut(2).zip(change.chunks_exact(2)) {
                    let change = u16::from_le_bytes([change[0], change[1]]);
                    let change = change >> 1 ^ (change & 1).wrapping_neg();
                    let sum = u16::from_le_bytes([half[0], half[1]]).wrapping_add(change);
                    half.copy_from_slice(&sum.to_le_bytes());
                }
            }
            2 => {
                let turned = u32::from_le_bytes(change).rotate_right(u32::from(kind >> 4));
                *last = (u32::from_le_bytes(*last) ^ turned).to_le_bytes();
            }
            _ => return None,
        }
        for byte in *last {
            *places.next()? = byte;
        }
        if number + 1 < columns[0].len() {
            // Skips to the same four bytes of the next element.
            if stride > 4 {
                places.nth(stride - 5)?;
            }
        }
    }
    Some(())
}
