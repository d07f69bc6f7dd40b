//! Errors of building scenes and of queries.

use super::builder::{MAX_COORDINATE, MAX_PRIMITIVES};

/// The reason why a scene cannot be built. Shapes and instances have the numbers that the builder gives them; all other
/// numbers count from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A vertex is not at a finite place, or is too far away to compute with.
    #[error(
        "shape {shape}: vertex {vertex} is at {position:?}: coordinates are numbers from -{MAX_COORDINATE:e} to {MAX_COORDINATE:e}"
    )]
    Vertex {
        /// The number that the shape would have had.
        shape: u32,
        /// The index of the vertex in the positions.
        vertex: usize,
        /// The position of the vertex.
        position: [f32; 3],
    },
    /// A triangle has a corner that the mesh does not have.
    #[error(
        "shape {shape}: triangle {triangle} has the vertex {index}, and there are {vertices}, counted from 0"
    )]
    Index {
        /// The number that the shape would have had.
        shape: u32,
        /// The index of the triangle.
        triangle: usize,
        /// The index of the missing vertex.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A sphere is not at a finite place, is too far away or too large to compute with, or has no size.
    #[error(
        "shape {shape}: sphere {sphere} is at {center:?} with a radius of {radius}: coordinates are numbers from -{MAX_COORDINATE:e} to {MAX_COORDINATE:e}, and a radius is above 0 and no more than that"
    )]
    Sphere {
        /// The number that the shape would have had.
        shape: u32,
        /// The index of the sphere.
        sphere: usize,
        /// The centre of the sphere.
        center: [f32; 3],
        /// The radius of the sphere.
        radius: f32,
    },
    /// The shape to be placed was never added.
    #[error("instance {instance} places shape {shape}, and there are {shapes}, counted from 0")]
    UnknownShape {
        /// The number that the instance would have had.
        instance: u32,
        /// The number of the missing shape.
        shape: u32,
        /// The number of shapes.
        shapes: usize,
    },
    /// A transform is not finite, squeezes space flat, or is so large or so small that it or its inverse leaves the
    /// range of coordinates.
    #[error(
        "instance {instance}: its transform {reason}: it must have an inverse, and both hold numbers from -{MAX_COORDINATE:e} to {MAX_COORDINATE:e}"
    )]
    Transform {
        /// The number that the instance would have had.
        instance: u32,
        /// The fault in the transform.
        reason: &'static str,
    },
    /// A transform moves its shape out of the range of coordinates.
    #[error(
        "instance {instance} of shape {shape} reaches beyond coordinates from -{MAX_COORDINATE:e} to {MAX_COORDINATE:e}"
    )]
    OutOfReach {
        /// The instance.
        instance: u32,
        /// The shape that it places.
        shape: u32,
    },
    /// There is more than ids can count.
    #[error("there are {count} {what}, and the most is {MAX_PRIMITIVES}")]
    TooMany {
        /// Vertices, triangles, spheres, shapes or instances.
        what: &'static str,
        /// The number that there would have been.
        count: usize,
    },
}

/// The columns of a query have different lengths, so the number of rays is unclear. Nothing was traced and nothing
/// written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{column} has {length} entries, and there are {rays} rays (entries of t_max)")]
pub struct LengthMismatch {
    /// The name of the column.
    pub column: &'static str,
    /// Its length.
    pub length: usize,
    /// The length of `t_max`, which is the number of rays.
    pub rays: usize,
}
