//! Vectors, colours, rays and boxes. Everything above speaks in these types: the
//! author's side in `Vec3` and [`Rgb`], the renderer's in lanes of [`Vector`] and [`Color`].

pub mod aabb;
pub mod elementary;
pub mod ray;
pub mod rgb;
pub mod vector;

pub use aabb::Aabb;
pub use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
pub use ray::{Hit, NONE, Ray};
pub use rgb::Rgb;
pub use vector::{Color, Vector};
