//! Vectors, colours, hits and boxes: the types that all other modules share. Worlds and queries use glam's vectors and
//! [`Rgb`]; the renderer computes in lanes of `Vector` and `Color`.

pub(crate) mod aabb;
pub(crate) mod elementary;
pub(crate) mod hash;
pub(crate) mod ray;
pub(crate) mod rgb;
#[cfg(any(test, feature = "render"))]
pub(crate) mod stream;
pub(crate) mod vector;

pub use aabb::Aabb;
#[doc(no_inline)]
pub use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3, Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
pub(crate) use ray::Ray;
pub use ray::{Hit, NONE};
pub use rgb::Rgb;
pub(crate) use vector::{Color, Vector};
