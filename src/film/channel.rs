//! Columns of numbers, one for each pixel, that an image file may hold besides light.

/// A column of numbers, one for each pixel of a film's region.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmChannel {
    /// As compositors read it: the layer's name, a dot and the component's name, such as `depth.Z`.
    pub name: &'static str,
    /// Row by row from the top, width × height of the region.
    pub values: Values,
}

/// Its numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Measurements.
    Float(Vec<f32>),
    /// Ids and counts.
    Whole(Vec<u32>),
}

impl Values {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Values::Float(values) => values.len(),
            Values::Whole(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
