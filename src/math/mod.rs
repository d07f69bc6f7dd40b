//! Vectors, colours and rays. Everything above speaks in these types.

pub mod rgb;

pub use glam::{Affine3A, DAffine3, DMat3, DMat4, DQuat, DVec3, Mat3, Mat4, Quat, Vec2, Vec3};
pub use rgb::Rgb;
