//! The canonical tests of a ray with boxes, triangles, spheres and blocks of them, common to all kernels, and the choice of
//! the nearest hit.

pub(super) mod hit_sink;
pub(super) mod leaf;
pub(super) mod ray;
pub mod sphere;
pub mod triangle;
