//! Changes to what bytes mean: the text of scenes token by token, the JSON of glTF and film files value by value,
//! with lengths and check sums that are right again.

use crate::targets::NEXT_FILM;
use serde_json::{Map, Value, json};
use xxhash_rust::xxh3::xxh3_128;

/// Numbers from a seed (xorshift).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u32) -> Random {
        Random((u64::from(seed) << 17) ^ 0x9e37_79b9_7f4a_7c15)
    }

    pub fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % end.max(1)
    }
}

/// Texts that break things.
const NUMBERS: [&str; 24] = [
    "0", "-0.0", "1", "-1", "2", "3", "0.5", "1e-30", "-1e-30", "1e30", "-1e30", "3.4e38", "1e39", "1e-45", "NaN",
    "inf", "-inf", "255", "256", "65535", "65536", "2147483648", "4294967295", "18446744073709551615",
];

/// A changed input of a target; none if its form is not known.
pub fn by_meaning(target: &str, bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    match target {
        "ron" | "study" | "query" | "edit" => {
            let text = std::str::from_utf8(bytes).ok()?;
            Some(text_changed(text, random).into_bytes())
        }
        "gltf" => gltf_changed(bytes, random),
        "film" => film_changed(bytes, random),
        "films" => {
            let cut = bytes.windows(NEXT_FILM.len()).position(|window| window == NEXT_FILM)?;
            let (first, second) = (&bytes[..cut], &bytes[cut + NEXT_FILM.len()..]);
            // What one of them says and the other does not; or both the same.
            Some(match random.below(4) {
                0 => [first, NEXT_FILM, &film_changed(second, random)?].concat(),
                1 => [&film_changed(first, random)?, NEXT_FILM, second].concat(),
                2 => [first, NEXT_FILM, first].concat(),
                _ => {
                    let changed = film_changed(first, random)?;
                    [&changed, NEXT_FILM, &changed].concat()
                }
            })
        }
        _ => None,
    }
}

/// Words, numbers, strings, spaces and single signs.
fn tokens(text: &str) -> Vec<&str> {
    let mut out = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_alphanumeric() || "_.-+".contains(c);
        let end = match first {
            '"' => rest[1..].find('"').map_or(rest.len(), |end| end + 2),
            c if is_word(c) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            c if c.is_whitespace() => rest.find(|c: char| !c.is_whitespace()).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        out.push(&rest[..end]);
        rest = &rest[end..];
    }
    out
}

/// Behind the bracket that closes the one at `start`, or behind the token.
fn end_of_group(tokens: &[&str], start: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(start) {
        match *token {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        if depth <= 0 {
            return at + 1;
        }
    }
    tokens.len()
}

fn text_changed(text: &str, random: &mut Random) -> String {
    let all = tokens(text);
    let mut out: Vec<&str> = all.clone();
    for _ in 0..=random.below(3) {
        if out.is_empty() {
            break;
        }
        let at = random.below(out.len());
        let from = random.below(all.len());
        let taken = &all[from..end_of_group(&all, from)];
        let end = end_of_group(&out, at);
        match random.below(6) {
            0 => drop(out.drain(at..end)),
            1 => drop(out.splice(at..at, taken.iter().copied())),
            2 => drop(out.splice(at..end, taken.iter().copied())),
            _ => {
                // The next number becomes another.
                let is_number = |token: &&str| token.trim_start_matches('-').starts_with(|c: char| c.is_ascii_digit());
                match (at..out.len()).find(|at| is_number(&out[*at])) {
                    Some(at) => out[at] = NUMBERS[random.below(NUMBERS.len())],
                    None => out[at] = NUMBERS[random.below(NUMBERS.len())],
                }
            }
        }
    }
    out.concat()
}

/// Takes a GLB apart, changes its JSON, and puts it together.
fn gltf_changed(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize);
    let (json, rest) = if bytes.starts_with(b"glTF") {
        let length = word(12)?;
        (bytes.get(20..)?.get(..length)?, bytes.get(20 + length..)?)
    } else {
        (bytes, &[][..])
    };
    let mut value: Value = serde_json::from_slice(json).ok()?;
    for _ in 0..=random.below(3) {
        json_changed(&mut value, random);
    }
    let mut json = serde_json::to_vec(&value).ok()?;
    if !bytes.starts_with(b"glTF") {
        return Some(json);
    }
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((20 + json.len() as u32 + rest.len() as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    let mut rest = rest.to_vec();
    // What vertices, keys and pictures are.
    if rest.len() > 16 && random.below(2) == 0 {
        let at = 8 + random.below(rest.len() - 12);
        let number = NUMBERS[random.below(NUMBERS.len())].parse().unwrap_or(0.0f32);
        rest[at & !3..][..4].copy_from_slice(&number.to_le_bytes());
    }
    out.extend(rest);
    Some(out)
}

/// The value at a random place.
fn place<'v>(value: &'v mut Value, random: &mut Random) -> &'v mut Value {
    let count = match value {
        Value::Array(items) => items.len(),
        Value::Object(fields) => fields.len(),
        _ => 0,
    };
    if count == 0 || random.below(8) == 0 {
        return value;
    }
    let at = random.below(count);
    let below = match value {
        Value::Array(items) => items.get_mut(at),
        Value::Object(fields) => fields.values_mut().nth(at),
        _ => None,
    };
    match below {
        Some(below) => place(below, random),
        None => unreachable!("counted before"),
    }
}

fn json_changed(value: &mut Value, random: &mut Random) {
    let taken = place(&mut value.clone(), random).clone();
    let place = place(value, random);
    let number = || -> [Value; 2] { [json!(0), json!(1)] };
    *place = match (random.below(8), &mut *place) {
        (0, Value::Array(items)) if !items.is_empty() => {
            items.remove(random.below(items.len()));
            return;
        }
        (1, Value::Array(items)) => {
            let item = if items.is_empty() { taken } else { items[random.below(items.len())].clone() };
            items.push(item);
            return;
        }
        (0 | 1, Value::Object(fields)) if !fields.is_empty() => {
            let key = fields.keys().nth(random.below(fields.len())).cloned().unwrap_or_default();
            fields.remove(&key);
            return;
        }
        (2, Value::Object(fields)) => {
            if let Value::Object(others) = taken {
                fields.extend(others);
            }
            return;
        }
        (3, _) => taken,
        (4, Value::Number(old)) => json!(old.as_f64().unwrap_or(0.0) * -1.5),
        (5, Value::Number(old)) => json!(old.as_i64().unwrap_or(0).wrapping_add(1)),
        (6, Value::Bool(old)) => json!(!*old),
        (7, _) if random.below(4) == 0 => number()[random.below(2)].clone(),
        // What is not said could be a number.
        (_, Value::Number(_) | Value::Null) => {
            let text = NUMBERS[random.below(NUMBERS.len())];
            serde_json::from_str(text).unwrap_or_else(|_| json!(1e38))
        }
        (_, other) => other.take(),
    };
}

/// A film with another header or other blocks, and sums that are theirs.
fn film_changed(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize);
    let length = word(12)?;
    let (start, header) = (bytes.get(..12)?, bytes.get(32..)?.get(..length)?);
    let mut blocks = bytes.get(32 + length..)?.to_vec();
    let mut value: Value = serde_json::from_slice::<Map<String, Value>>(header).ok()?.into();
    let changes_header = random.below(2) == 0;
    if changes_header {
        json_changed(&mut value, random);
    } else if let Some(content) = blocks.get_mut(20..).filter(|content| !content.is_empty()) {
        // The first block alone.
        let at = random.below(content.len());
        content[at] ^= 1 << random.below(8);
        let length = content.len() as u32;
        let start = [0u32.to_le_bytes(), length.to_le_bytes()].concat();
        let sum = xxh3_128(&[&start[..], &xxh3_128(content).to_le_bytes()].concat());
        blocks[4..20].copy_from_slice(&sum.to_le_bytes());
    }
    let header = serde_json::to_vec(&value).ok()?;
    let length = (header.len() as u32).to_le_bytes();
    let sum = xxh3_128(&[&start[8..12], &length, &header].concat());
    Some([start, &length, &sum.to_le_bytes(), &header, &blocks].concat())
}
