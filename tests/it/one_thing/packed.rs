//! Compressed data of glTF files, by the plainest means that the formats allow: meshopt by appendices A and B of
//! `EXT_meshopt_compression` and the second version of attributes of `KHR_meshopt_compression`, Draco by the
//! specification of its bitstream 2.2.

use super::gltf::Column;

/// Appends a number in groups of seven bits, the lowest first.
fn add_number(bytes: &mut Vec<u8>, mut number: u32) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// Maps 0, −1, 1, −2 … to 0, 1, 2, 3 …
fn fold(change: i32) -> u32 {
    (change << 1 ^ change >> 31) as u32
}

/// Elements of `stride` bytes in the first version: groups of sixteen deltas that are all 0 or whole bytes.
pub fn meshopt_attributes(elements: &[u8], stride: usize) -> Vec<u8> {
    let mut data = vec![0xa0];
    let first = &elements[..stride];
    let mut last = first.to_vec();
    for block in blocks(elements, stride) {
        for (byte, last) in last.iter_mut().enumerate() {
            let column = block[byte..].iter().step_by(stride).map(|value| {
                let change = value.wrapping_sub(*last) as i8;
                *last = *value;
                fold(change.into()) as u8
            });
            let column: Vec<u8> = column.collect();
            let groups: Vec<&[u8]> = column.chunks(16).collect();
            let is_zero = |group: &&[u8]| group.iter().all(|change| *change == 0);
            let header = |four: &[&[u8]]| {
                let bits = |(at, group)| if is_zero(group) { 0 } else { 3u8 << (2 * at) };
                four.iter().enumerate().map(bits).fold(0, |bits, group| bits | group)
            };
            data.extend(groups.chunks(4).map(header));
            for group in groups.iter().filter(|group| !is_zero(group)) {
                data.extend(*group);
                data.resize(data.len() + 16 - group.len(), 0);
            }
        }
    }
    data.resize(data.len() + 32usize.saturating_sub(stride), 0);
    data.extend(first);
    data
}

/// The second version: columns of whole bytes or of zeros, and deltas of bytes, of words or of bits, by turns.
pub fn meshopt_attributes_2(elements: &[u8], stride: usize) -> Vec<u8> {
    const TURN: u32 = 5;
    let kinds: Vec<u8> = (0..stride / 4).map(|four| [2 | (TURN as u8) << 4, 1, 0][four % 3]).collect();
    let mut data = vec![0xa1];
    let first = &elements[..stride];
    let mut last = first.to_vec();
    for block in blocks(elements, stride) {
        let mut columns = vec![Vec::new(); stride];
        for element in block.chunks_exact(stride) {
            for (four, kind) in kinds.iter().enumerate() {
                let four_of =
                    |bytes: &[u8]| <[u8; 4]>::try_from(&bytes[4 * four..][..4]).expect("four bytes");
                let (old, new) = (four_of(&last), four_of(element));
                let changes: [u8; 4] = match kind & 3 {
                    0 => std::array::from_fn(|at| fold((new[at].wrapping_sub(old[at]) as i8).into()) as u8),
                    1 => {
                        let word = |bytes: [u8; 4], at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
                        let [a, b] = [0, 2].map(|at| {
                            let change = word(new, at).wrapping_sub(word(old, at)) as i16;
                            (fold(change.into()) as u16).to_le_bytes()
                        });
                        [a[0], a[1], b[0], b[1]]
                    }
                    _ => (u32::from_le_bytes(new) ^ u32::from_le_bytes(old)).rotate_left(TURN).to_le_bytes(),
                };
                (0..4).for_each(|byte| columns[4 * four + byte].push(changes[byte]));
            }
            last = element.to_vec();
        }
        let is_zero = |column: &&Vec<u8>| column.iter().all(|change| *change == 0);
        for four in columns.chunks(4) {
            let bits = |(at, column)| (if is_zero(&column) { 2u8 } else { 3 }) << (2 * at);
            data.push(four.iter().enumerate().map(bits).fold(0, |bits, column| bits | column));
        }
        columns.iter().filter(|column| !is_zero(column)).for_each(|column| data.extend(column));
    }
    data.resize(data.len() + 24usize.saturating_sub(stride + kinds.len()), 0);
    data.extend(first);
    data.extend(kinds);
    data
}

fn blocks(elements: &[u8], stride: usize) -> impl Iterator<Item = &[u8]> {
    elements.chunks(stride * ((8192 / stride) & !15).min(256))
}

/// Triangles beside the one before if they have its last edge, else with all three vertices written.
pub fn meshopt_triangles(triangles: &[[u32; 3]]) -> Vec<u8> {
    let (mut codes, mut data) = (vec![0xe1], Vec::new());
    let mut last = 0;
    let mut write = |data: &mut Vec<u8>, vertex: u32| {
        add_number(data, fold(vertex.wrapping_sub(last) as i32));
        last = vertex;
    };
    let mut edge = None;
    for triangle in triangles {
        let [a, b, c] = *triangle;
        if edge == Some((a, b)) {
            codes.push(0x0f);
            write(&mut data, c);
        } else {
            codes.push(0xff);
            data.push(0xff);
            triangle.iter().for_each(|vertex| write(&mut data, *vertex));
        }
        edge = Some((a, c));
    }
    codes.extend(data);
    codes.extend([0; 16]);
    codes
}

/// Vertex numbers as deltas from the one before of an even or odd place.
pub fn meshopt_sequence(indices: &[u32]) -> Vec<u8> {
    let mut data = vec![0xd1];
    let mut bases = [0u32; 2];
    for (at, index) in indices.iter().enumerate() {
        let base = &mut bases[at % 2];
        add_number(&mut data, fold(index.wrapping_sub(*base) as i32) << 1 | (at % 2) as u32);
        *base = *index;
    }
    data.extend([0; 4]);
    data
}

/// A change of attributes before compression.
#[derive(Clone, Copy, Debug)]
pub enum Filter {
    None,
    /// Of normals of 16 bits.
    Octahedral,
    /// Of unit quaternions as floats.
    Quaternion,
    /// Of floats.
    Exponential,
    /// Of red, green, blue and alpha of 16 bits; alpha is 1.
    Color,
}

impl Filter {
    pub fn apply(self, bytes: &[u8]) -> Vec<u8> {
        let words = |element: &[u8]| -> [u16; 4] {
            std::array::from_fn(|at| u16::from_le_bytes([element[2 * at], element[2 * at + 1]]))
        };
        let floats = bytes.as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four));
        match self {
            Filter::None => bytes.to_vec(),
            Filter::Octahedral => bytes
                .chunks_exact(8)
                .flat_map(|element| {
                    let [s, t] = octahedron(words(element).map(|word| f32::from(word as i16)));
                    [s, t, 1.0, 0.0].map(|number| (number * 32_767.0).round() as i16)
                })
                .flat_map(i16::to_le_bytes)
                .collect(),
            Filter::Quaternion => {
                let numbers: Vec<f32> = floats.collect();
                let element =
                    |quaternion: &[f32; 4]| {
                        let largest = (0..4).fold(0, |most, at| {
                            if quaternion[at].abs() > quaternion[most].abs() { at } else { most }
                        });
                        let unit = 32_767.0 * std::f32::consts::SQRT_2 * quaternion[largest].signum();
                        let rest = [1, 2, 3].map(|at| (quaternion[(largest + at) & 3] * unit).round() as i16);
                        [rest[0], rest[1], rest[2], 32_764 | largest as i16]
                    };
                numbers.as_chunks::<4>().0.iter().flat_map(element).flat_map(i16::to_le_bytes).collect()
            }
            Filter::Exponential => floats.map(exponential).flat_map(i32::to_le_bytes).collect(),
            Filter::Color => bytes
                .chunks_exact(8)
                .flat_map(|element| {
                    let [r, g, b, _] = words(element).map(i32::from);
                    let (y, co, cg) = ((r + 2 * g + b) / 4, (r - b) / 2, (2 * g - r - b) / 4);
                    [y as u16, co as i16 as u16, cg as i16 as u16, u16::MAX]
                })
                .flat_map(u16::to_le_bytes)
                .collect(),
        }
    }
}

/// A signed exponent of 8 bits above a signed mantissa of 24.
fn exponential(number: f32) -> i32 {
    if number == 0.0 {
        return 0;
    }
    let exponent = (number.to_bits() >> 23 & 0xff) as i32 - 127 - 22;
    let mantissa = (f64::from(number) * f64::from(exponent).exp2().recip()).round() as i32;
    exponent << 24 | mantissa & 0xff_ffff
}

/// The first two coordinates of a direction on the octahedron |x| + |y| + |z| = 1, the half of negative z folded out.
fn octahedron(direction: [f32; 4]) -> [f32; 2] {
    let [x, y, z, _] = direction;
    let sum = x.abs() + y.abs() + z.abs();
    let (s, t) = (x / sum, y / sum);
    let sign = |number: f32| if number < 0.0 { -1.0 } else { 1.0 };
    if z < 0.0 { [(1.0 - t.abs()) * sign(s), (1.0 - s.abs()) * sign(t)] } else { [s, t] }
}

/// Draco's numbers of a data type and of coders of attributes.
const FLOAT: u8 = 9;
const GENERIC: u8 = 0;
const QUANTIZED: u8 = 2;
const NORMALS: u8 = 3;
/// The bits of a coordinate on the octahedron.
const BITS: u8 = 14;

/// A mesh in Draco's sequential encoding without compression: attributes as floats, or as integers of 16 bits and
/// normals on an octahedron. The ids of attributes are their numbers.
pub fn draco(columns: &[Column], triangles: &[[u32; 3]], quantized: bool) -> Vec<u8> {
    let count = columns[0].numbers.len() / columns[0].width;
    // Version 2.2; a mesh; sequential; no flags.
    let mut data = b"DRACO\x02\x02\x01\x00\x00\x00".to_vec();
    add_number(&mut data, triangles.len() as u32);
    add_number(&mut data, count as u32);
    data.push(1);
    for index in triangles.as_flattened() {
        let bytes = index.to_le_bytes();
        data.extend(&bytes[..if count < 256 { 1 } else { 2 }]);
    }
    data.push(1);
    add_number(&mut data, columns.len() as u32);
    for (id, column) in columns.iter().enumerate() {
        let kind = match column.name {
            "POSITION" => 0,
            "NORMAL" => 1,
            "COLOR_0" => 2,
            _ => 3,
        };
        data.extend([kind, FLOAT, column.width as u8, 0, id as u8]);
    }
    let coder = |column: &Column| match (quantized, column.name) {
        (false, _) => GENERIC,
        (true, "NORMAL") => NORMALS,
        (true, _) => QUANTIZED,
    };
    data.extend(columns.iter().map(coder));
    let mut parameters = Vec::new();
    for column in columns {
        let integers: Vec<u16> = match coder(column) {
            GENERIC => {
                data.extend(column.numbers.iter().flat_map(|number| number.to_le_bytes()));
                continue;
            }
            NORMALS => {
                parameters.push(BITS);
                let most = f32::from((1u16 << BITS) - 2);
                let of = |[x, y, z]: &[f32; 3]| {
                    octahedron([*y, *z, *x, 0.0]).map(|number| ((number + 1.0) * 0.5 * most).round() as u16)
                };
                column.numbers.as_chunks().0.iter().flat_map(of).collect()
            }
            _ => {
                let least: Vec<f32> = (0..column.width)
                    .map(|at| column.numbers[at..].iter().step_by(column.width).copied().fold(9.0, f32::min))
                    .collect();
                let places = column.numbers.iter().zip(least.iter().cycle());
                let range = places.clone().map(|(number, least)| number - least).fold(1e-3, f32::max);
                parameters.extend(least.iter().chain([&range]).flat_map(|number| number.to_le_bytes()));
                parameters.push(16);
                places.map(|(number, least)| ((number - least) / range * 65_535.0).round() as u16).collect()
            }
        };
        // No prediction, no compression, four bytes a number.
        data.extend([0xfe, 0, 4]);
        let written = |number: &u16| fold((*number).into()).to_le_bytes();
        data.extend(integers.iter().flat_map(written));
    }
    data.extend(parameters);
    data
}
