//! Columns of numbers, one for each pixel, that an image file may hold besides light.

/// One of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// As compositors read it: the layer's name, a dot, the component's.
    pub name: &'static str,
    /// Row by row from the top.
    pub values: Values,
}

/// Its numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Measures.
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
