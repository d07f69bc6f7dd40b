//! Accessors: typed numbers in buffers, interleaved, normalised, sparse.

use std::fmt::Display;

use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, Type, sparse};
use gltf::json::buffer::View;
use gltf::json::validation::Checked;

use super::document::Document;
use crate::error::LoadError;

/// The types and components allowed for an accessor in a certain use.
pub(super) struct Rule {
    pub types: &'static [Type],
    pub components: &'static [ComponentType],
    /// True if integers are always normalised in this use.
    pub always_normalized: bool,
}

/// The layout of an accessor: `count` elements of one type.
#[derive(Clone, Copy)]
struct AccessorLayout {
    component: ComponentType,
    /// Components of an element.
    width: usize,
    normalized: bool,
    count: usize,
}

impl AccessorLayout {
    /// The layout of an accessor that follows the rule; the error is the reason why it does not.
    fn new(accessor: &Accessor, number: usize, rule: &Rule) -> Result<Self, String> {
        let (Checked::Valid(kind), Checked::Valid(component)) = (accessor.type_, accessor.component_type)
        else {
            return Err(format!("accessor {number} is of an unknown type"));
        };
        let component = component.0;
        if !rule.types.contains(&kind) || !rule.components.contains(&component) {
            let (types, components) = (rule.types, rule.components);
            return Err(format!(
                "accessor {number} is {kind:?} of {component:?}: this must be {types:?} of {components:?}"
            ));
        }
        let count = usize::try_from(accessor.count.0).ok().filter(|count| *count > 0);
        let count = count.ok_or_else(|| format!("accessor {number} has a count of {}", accessor.count.0))?;
        let normalized = accessor.normalized || rule.always_normalized;
        Ok(Self { component, width: kind.multiplicity(), normalized, count })
    }

    fn element_bytes(&self) -> usize {
        self.width * self.component.size()
    }

    /// The components of an element. If `N` is larger, the rest stays 0.
    fn floats<const N: usize>(&self, element: &[u8]) -> [f32; N] {
        let mut numbers = [0.0; N];
        for (number, bytes) in numbers.iter_mut().zip(element.chunks_exact(self.component.size())) {
            *number = float(bytes, self.component, self.normalized);
        }
        numbers
    }
}

/// Returns the number of elements of an accessor; the error is the reason why it does not follow the rule. The data are
/// not read.
pub(super) fn count_of(document: &Document, index: Index<Accessor>, rule: &Rule) -> Result<usize, String> {
    let (number, accessors) = (index.value(), &document.root.accessors);
    let accessor = accessors.get(number);
    let accessor =
        accessor.ok_or_else(|| format!("there is no accessor {number}, the file has {}", accessors.len()))?;
    AccessorLayout::new(accessor, number, rule).map(|layout| layout.count)
}

/// Reads elements as floats, the first `N` components of each. They need not be finite.
pub(super) fn floats<const N: usize>(
    document: &Document,
    index: Index<Accessor>,
    rule: &Rule,
    place: impl Display,
) -> Result<Vec<[f32; N]>, LoadError> {
    read(document, index, rule, [0.0; N], AccessorLayout::floats, &place).map(|(elements, _)| elements)
}

/// True if all numbers of an element are finite.
pub(super) fn is_finite<const N: usize>(element: &[f32; N]) -> bool {
    element.iter().all(|number| number.is_finite())
}

/// Reads elements as finite floats, the first `N` components of each.
pub(super) fn finite_floats<const N: usize>(
    document: &Document,
    index: Index<Accessor>,
    rule: &Rule,
    place: impl Display,
) -> Result<Vec<[f32; N]>, LoadError> {
    let elements = floats(document, index, rule, &place)?;
    match elements.iter().position(|element| !is_finite(element)) {
        None => Ok(elements),
        Some(at) => {
            let reason = format!("element {at} of accessor {} is not finite", index.value());
            Err(document.error(place, reason))
        }
    }
}

/// Reads vertex indices, each below `vertices`.
pub(super) fn indices(
    document: &Document,
    index: Index<Accessor>,
    vertices: usize,
    place: impl Display,
) -> Result<Vec<u32>, LoadError> {
    const RULE: Rule = Rule {
        types: &[Type::Scalar],
        components: &[ComponentType::U8, ComponentType::U16, ComponentType::U32],
        always_normalized: false,
    };
    let whole = |_: &AccessorLayout, element: &[u8]| whole(element);
    let (indices, _) = read(document, index, &RULE, 0, whole, &place)?;
    match indices.iter().position(|vertex| *vertex as usize >= vertices) {
        None => Ok(indices),
        Some(at) => {
            let reason = format!("index {at} is {}, but there are {vertices} vertices", indices[at]);
            Err(document.error(place, reason))
        }
    }
}

/// Reads elements with `element`; elements that the file leaves out are `zero`.
fn read<T: Clone>(
    document: &Document,
    index: Index<Accessor>,
    rule: &Rule,
    zero: T,
    element: impl Fn(&AccessorLayout, &[u8]) -> T,
    place: &dyn Display,
) -> Result<(Vec<T>, AccessorLayout), LoadError> {
    let accessor = document.get(&document.root.accessors, index, place, "accessor")?;
    let number = index.value();
    let layout =
        AccessorLayout::new(accessor, number, rule).map_err(|reason| document.error(place, reason))?;
    let made = (layout.count as u64).saturating_mul(size_of::<T>() as u64);
    let mut elements = match accessor.buffer_view {
        None => {
            document.charge(made, place)?;
            vec![zero; layout.count]
        }
        Some(view) => {
            let offset = accessor.byte_offset.unwrap_or_default().0;
            let bytes = strided(document, view, offset, layout.count, layout.element_bytes(), number, place)?;
            document.charge(made, place)?;
            bytes.map(|bytes| element(&layout, bytes)).collect()
        }
    };
    if let Some(sparse) = &accessor.sparse {
        override_some(document, sparse, number, &layout, element, &mut elements, place)?;
    }
    Ok((elements, layout))
}

/// Overwrites some elements with a sparse accessor's own values.
fn override_some<T>(
    document: &Document,
    sparse: &sparse::Sparse,
    number: usize,
    layout: &AccessorLayout,
    element: impl Fn(&AccessorLayout, &[u8]) -> T,
    elements: &mut [T],
    place: &dyn Display,
) -> Result<(), LoadError> {
    let Checked::Valid(component) = sparse.indices.component_type else {
        return Err(
            document.error(place, format!("the sparse indices of accessor {number} are of no known type"))
        );
    };
    let count = usize::try_from(sparse.count.0).ok().filter(|count| *count <= layout.count);
    let count = count.ok_or_else(|| {
        let (count, all) = (sparse.count.0, layout.count);
        document.error(place, format!("accessor {number} overrides {count} of its {all} elements"))
    })?;
    let (at, values) = (&sparse.indices, &sparse.values);
    let size = component.0.size();
    let indices = strided(document, at.buffer_view, at.byte_offset.0, count, size, number, place)?;
    let size = layout.element_bytes();
    let values = strided(document, values.buffer_view, values.byte_offset.0, count, size, number, place)?;
    for (index, value) in indices.zip(values) {
        let index = whole(index);
        let slot = elements.get_mut(index as usize).ok_or_else(|| {
            let count = layout.count;
            document.error(place, format!("accessor {number} overrides element {index} of {count}"))
        })?;
        *slot = element(layout, value);
    }
    Ok(())
}

/// Returns `count` elements of `size` bytes of a view.
fn strided<'d>(
    document: &'d Document,
    view: Index<View>,
    offset: u64,
    count: usize,
    size: usize,
    accessor: usize,
    place: &dyn Display,
) -> Result<impl Iterator<Item = &'d [u8]> + use<'d>, LoadError> {
    let bytes = document.view(view, place)?;
    let stride = document.root.buffer_views.get(view.value()).and_then(|view| view.byte_stride);
    let stride = stride.map_or(size, |stride| stride.0);
    if stride < size {
        let reason = format!(
            "accessor {accessor} has elements of {size} bytes, its buffer view a byteStride of {stride}"
        );
        return Err(document.error(place, reason));
    }
    let last = count.saturating_sub(1) as u128;
    let end = if count == 0 { 0 } else { u128::from(offset) + last * stride as u128 + size as u128 };
    if end > bytes.len() as u128 {
        let (view, length) = (view.value(), bytes.len());
        let reason =
            format!("accessor {accessor} reaches byte {end} of buffer view {view}, which has {length}");
        return Err(document.error(place, reason));
    }
    let start = (offset as usize).min(bytes.len());
    Ok(bytes[start..end.max(start as u128) as usize].chunks(stride).map(move |chunk| &chunk[..size]))
}

/// Decodes a component; normalised integers as in the specification (3.6.2.2).
fn float(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let (value, one) = match component {
        ComponentType::I8 => (f32::from(i8::from_le_bytes(array(bytes))), 127.0),
        ComponentType::U8 => (f32::from(u8::from_le_bytes(array(bytes))), 255.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes(array(bytes))), 32_767.0),
        ComponentType::U16 => (f32::from(u16::from_le_bytes(array(bytes))), 65_535.0),
        ComponentType::U32 => return u32::from_le_bytes(array(bytes)) as f32,
        ComponentType::F32 => return f32::from_le_bytes(array(bytes)),
    };
    if normalized { (value / one).max(-1.0) } else { value }
}

/// An unsigned integer of one, two or four bytes.
fn whole(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk().copied().unwrap_or([0; N])
}
