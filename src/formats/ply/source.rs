//! Readers of the numbers in a PLY file's body, as text or binary.

use crate::formats::mended::precise_number;

use super::header::{Element, PropertyKind, Scalar};

/// The reason why a number could not be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberFault {
    /// The file has ended.
    End,
    /// The last word is not a number.
    NotANumber,
    /// The last word is not an integer, or does not fit its type.
    NotAnInteger,
}

/// A position in the body, from which numbers are read in order.
pub trait NumberSource: Clone {
    /// True if numbers are decimals, whose precision does not depend on their type.
    const IS_TEXT: bool;

    /// Reads the next number. Integers are not scaled.
    fn float(&mut self, scalar: Scalar) -> Result<f64, NumberFault>;
    /// Reads the next number, of an integer type.
    fn integer(&mut self, scalar: Scalar) -> Result<i64, NumberFault>;
    /// Skips `count` numbers.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), NumberFault>;
    /// Skips all rows of an element whose rows have equal size.
    fn skip_rows(&mut self, element: &Element) -> Result<(), NumberFault>;
    /// The largest number of values of a type that the rest of the file can contain.
    fn room(&self, scalar: Scalar) -> u64;
    /// The largest number of rows that the rest of the file can contain, if rows take any space.
    fn room_for_rows(&self, element: &Element) -> u64;
    /// Describes a fault in words.
    fn describe(&self, fault: NumberFault) -> String;

    /// Reads the length of a list. The rest of the file is checked to have room for it.
    fn list_length(&mut self, count: Scalar, item: Scalar) -> Result<u64, NumberFault> {
        let count = u64::try_from(self.integer(count)?).map_err(|_| NumberFault::NotAnInteger)?;
        if count > self.room(item) { Err(NumberFault::End) } else { Ok(count) }
    }

    /// Skips one property.
    fn skip_property(&mut self, kind: PropertyKind) -> Result<(), NumberFault> {
        match kind {
            PropertyKind::Scalar(scalar) => self.skip(scalar, 1),
            PropertyKind::List { count, item } => {
                let count = self.list_length(count, item)?;
                self.skip(item, count)
            }
        }
    }

    /// Skips a whole element.
    fn skip_element(&mut self, element: &Element) -> Result<(), String> {
        if element.has_fixed_size() {
            let skipped = self.skip_rows(element);
            return skipped.map_err(|fault| format!("{}: {}", element.name, self.describe(fault)));
        }
        for row in 0..element.count {
            for property in &element.properties {
                let skipped = self.skip_property(property.kind);
                skipped.map_err(|fault| format!("{} {row}: {}", element.name, self.describe(fault)))?;
            }
        }
        Ok(())
    }

    /// Rejects an element with more declared rows than the file can contain, so that a declaration cannot cost more
    /// memory than the file itself.
    fn check_room(&self, element: &Element) -> Result<(), String> {
        let room = self.room_for_rows(element);
        if element.properties.is_empty() || element.count <= room {
            return Ok(());
        }
        Err(format!(
            "the header promises {} of element {}, but the file has room for at most {room}: it is cut short or damaged",
            element.count, element.name
        ))
    }
}

/// The word before a comment, which takes the rest of its line.
const COMMENT: &str = "comment";

/// An index that is stored as a float; none if it is no whole number, or too large to be one.
fn whole(number: f64) -> Option<i64> {
    (number.fract() == 0.0 && number.abs() < 9e15).then_some(number as i64)
}

/// Decimal numbers separated by white space.
#[derive(Clone)]
pub struct Ascii<'a> {
    rest: &'a [u8],
    word: &'a [u8],
}

impl<'a> Ascii<'a> {
    /// A reader of a file's body.
    pub fn new(body: &'a [u8]) -> Self {
        Self { rest: body, word: &[] }
    }

    fn next_word(&mut self) -> Result<&'a [u8], NumberFault> {
        let start = self.rest.iter().position(|b| *b > b' ').ok_or(NumberFault::End)?;
        let rest = &self.rest[start..];
        let end = rest.iter().position(|b| *b <= b' ').unwrap_or(rest.len());
        (self.word, self.rest) = rest.split_at(end);
        Ok(self.word)
    }

    fn skip_line(&mut self) {
        let end = self.rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(self.rest.len());
        self.rest = &self.rest[end..];
    }

    /// A number takes at least a digit and a separator, which the last one does not need.
    fn room_for_numbers(&self) -> u64 {
        (self.rest.len() as u64).div_ceil(2)
    }
}

impl NumberSource for Ascii<'_> {
    const IS_TEXT: bool = true;

    fn float(&mut self, _scalar: Scalar) -> Result<f64, NumberFault> {
        loop {
            let word = std::str::from_utf8(self.next_word()?).map_err(|_| NumberFault::NotANumber)?;
            match precise_number(word) {
                Some(number) => return Ok(number),
                None if word == COMMENT => self.skip_line(),
                None => return Err(NumberFault::NotANumber),
            }
        }
    }

    fn integer(&mut self, scalar: Scalar) -> Result<i64, NumberFault> {
        let value = loop {
            let word = std::str::from_utf8(self.next_word()?).map_err(|_| NumberFault::NotAnInteger)?;
            match word.parse().ok().or_else(|| whole(word.parse().ok()?)) {
                Some(value) => break value,
                None if word == COMMENT => self.skip_line(),
                None => return Err(NumberFault::NotAnInteger),
            }
        };
        let (least, most) = scalar.range();
        if (least..=most).contains(&value) { Ok(value) } else { Err(NumberFault::NotAnInteger) }
    }

    fn skip(&mut self, _scalar: Scalar, count: u64) -> Result<(), NumberFault> {
        (0..count).try_for_each(|_| self.next_word().map(drop))
    }

    fn skip_rows(&mut self, element: &Element) -> Result<(), NumberFault> {
        let columns = element.properties.len() as u64;
        self.skip(Scalar::U8, element.count.saturating_mul(columns))
    }

    fn room(&self, _scalar: Scalar) -> u64 {
        self.room_for_numbers()
    }

    fn room_for_rows(&self, element: &Element) -> u64 {
        self.room_for_numbers() / (element.properties.len() as u64).max(1)
    }

    fn describe(&self, fault: NumberFault) -> String {
        let word: String = String::from_utf8_lossy(self.word).chars().take(40).collect();
        match fault {
            NumberFault::End => "the file ends here: it is cut short".into(),
            NumberFault::NotANumber => format!("{word:?} is not a number"),
            NumberFault::NotAnInteger => format!("{word:?} is not an integer that fits here"),
        }
    }
}

/// Numbers as bytes, big-endian if `BIG`.
#[derive(Clone)]
pub struct Binary<'a, const BIG: bool> {
    rest: &'a [u8],
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    /// A reader of a file's body.
    pub fn new(body: &'a [u8]) -> Self {
        Self { rest: body }
    }

    #[inline(always)]
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], NumberFault> {
        let (bytes, rest) = self.rest.split_first_chunk::<N>().ok_or(NumberFault::End)?;
        self.rest = rest;
        let mut bytes = *bytes;
        if BIG {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn pass(&mut self, bytes: u64) -> Result<(), NumberFault> {
        let bytes = usize::try_from(bytes).map_err(|_| NumberFault::End)?;
        self.rest = self.rest.get(bytes..).ok_or(NumberFault::End)?;
        Ok(())
    }
}

impl<const BIG: bool> NumberSource for Binary<'_, BIG> {
    const IS_TEXT: bool = false;

    #[inline(always)]
    fn float(&mut self, scalar: Scalar) -> Result<f64, NumberFault> {
        Ok(match scalar {
            Scalar::F32 => f32::from_le_bytes(self.bytes()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.bytes()?),
            _ => self.integer(scalar)? as f64,
        })
    }

    #[inline(always)]
    fn integer(&mut self, scalar: Scalar) -> Result<i64, NumberFault> {
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.bytes()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.bytes()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.bytes()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.bytes()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.bytes()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.bytes()?).into(),
            Scalar::F32 => {
                whole(f32::from_le_bytes(self.bytes()?).into()).ok_or(NumberFault::NotAnInteger)?
            }
            Scalar::F64 => whole(f64::from_le_bytes(self.bytes()?)).ok_or(NumberFault::NotAnInteger)?,
        })
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), NumberFault> {
        self.pass(count.saturating_mul(scalar.size() as u64))
    }

    fn skip_rows(&mut self, element: &Element) -> Result<(), NumberFault> {
        self.pass(element.count.saturating_mul(element.least_size()))
    }

    fn room(&self, scalar: Scalar) -> u64 {
        (self.rest.len() / scalar.size()) as u64
    }

    fn room_for_rows(&self, element: &Element) -> u64 {
        self.rest.len() as u64 / element.least_size().max(1)
    }

    fn describe(&self, fault: NumberFault) -> String {
        match fault {
            NumberFault::End => "the file ends here: it is cut short".into(),
            NumberFault::NotANumber => "not a number".into(),
            NumberFault::NotAnInteger => "a list's length or an index is no whole number".into(),
        }
    }
}
