//! `KHR_draco_mesh_compression`: decompresses the contents of a primitive's accessors.

use std::collections::HashMap;

use gltf::json::mesh::Primitive;

use super::document::Document;
#[cfg(feature = "draco")]
use super::extensions::draco::DracoPrimitive;
use crate::error::LoadError;

/// The name of the extension.
pub(super) const NAME: &str = "KHR_draco_mesh_compression";

/// The vertices and triangles of a primitive.
#[cfg_attr(not(feature = "draco"), allow(dead_code, reason = "nothing makes one"))]
pub(super) struct Decoded {
    /// Three vertex numbers for each triangle.
    pub corners: Vec<u32>,
    pub columns: HashMap<String, Attribute>,
}

/// An attribute of all vertices.
#[cfg_attr(not(feature = "draco"), allow(dead_code, reason = "nothing makes one"))]
pub(super) struct Attribute {
    /// Components per vertex, at most four.
    pub width: usize,
    pub numbers: Vec<f32>,
    /// The divisor for normalised integers; 1 for floats.
    pub one: f32,
}

impl Attribute {
    /// The first `N` components of each vertex; missing ones are 0.
    pub(super) fn elements<const N: usize>(&self, normalized: bool) -> Vec<[f32; N]> {
        let fraction = |number: f32| match normalized && self.one != 1.0 {
            true => (number / self.one).max(-1.0),
            false => number,
        };
        let element =
            |numbers: &[f32]| std::array::from_fn(|i| numbers.get(i).copied().map_or(0.0, fraction));
        self.numbers.chunks_exact(self.width).map(element).collect()
    }
}

/// Decompresses a primitive; none if it is not compressed.
#[cfg(feature = "draco")]
pub(super) fn decode(
    document: &Document,
    primitive: &Primitive,
    at: &str,
) -> Result<Option<Decoded>, LoadError> {
    let extensions = primitive.extensions.as_ref().map(|extensions| &extensions.others);
    let Some(read) = document.strict_extension::<DracoPrimitive>(extensions, NAME, at)? else {
        return Ok(None);
    };
    let at = format!("{at}/extensions/{NAME}");
    let data = document.view(read.buffer_view, &at)?;
    let left = document.affordable();
    let limits = draco_core::DecodeLimits::default().with_max_decoded_bytes(left).with_max_faces(left / 12);
    let mut buffer = draco_core::DecoderBuffer::new(data).with_limits(limits);
    let mut mesh = draco_core::Mesh::new();
    draco_core::MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|error| {
        let reason: String = error.to_string().chars().take(200).flat_map(char::escape_debug).collect();
        document.error(&at, format!("the compressed data are damaged: {reason}"))
    })?;
    let vertices = mesh.num_points();
    document.charge(mesh.num_faces() as u64 * 12, &at)?;
    let corners: Vec<u32> = mesh.faces().iter().flat_map(|face| face.map(|point| point.0)).collect();
    if corners.iter().any(|corner| *corner as usize >= vertices) {
        return Err(document.error(&at, "a triangle has a vertex that is not there"));
    }
    let mut columns = HashMap::new();
    for (name, id) in &read.attributes {
        let Some(attribute) = mesh.attribute_by_unique_id(*id) else {
            let reason = format!("there is no attribute {id} in the compressed data");
            return Err(document.error(format!("{at}/attributes/{}", crate::error::words(name)), reason));
        };
        let width = usize::from(attribute.num_components()).clamp(1, 4);
        document.charge((vertices * width) as u64 * 4, &at)?;
        let one = match attribute.data_type() {
            draco_core::DataType::Int8 => 127.0,
            draco_core::DataType::Uint8 => 255.0,
            draco_core::DataType::Int16 => 32_767.0,
            draco_core::DataType::Uint16 => 65_535.0,
            _ => 1.0,
        };
        let numbers = attribute.read_f32s(vertices, width);
        columns.insert(name.clone(), Attribute { width, numbers, one });
    }
    document.allow_for((vertices * 16) as u64);
    Ok(Some(Decoded { corners, columns }))
}

/// Without the feature, only the uncompressed copy that the file may contain is used.
#[cfg(not(feature = "draco"))]
pub(super) fn decode(_: &Document, _: &Primitive, _: &str) -> Result<Option<Decoded>, LoadError> {
    Ok(None)
}
