//! The channels of an image file besides colour.

use std::borrow::Cow;

/// A channel: one number for each pixel of a film's region.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmChannel {
    /// The name as compositors read it: the layer's name, a dot and the component's name, such as `depth.Z`.
    pub name: Cow<'static, str>,
    /// The values, row by row from the top, width × height of the region.
    pub values: Values,
}

/// The values of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Measurements.
    Float(Vec<f32>),
    /// Ids and counts.
    Whole(Vec<u32>),
}

impl Values {
    /// The number of values.
    pub fn len(&self) -> usize {
        match self {
            Values::Float(values) => values.len(),
            Values::Whole(values) => values.len(),
        }
    }

    /// True if there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
