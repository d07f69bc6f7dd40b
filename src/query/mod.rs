//! Ray queries on their own: triangles, spheres and instances in, nearest hits or any hits out, for programs that
//! need rays for something other than rendering with this crate.
//!
//! ```
//! use rayfront::math::{DAffine3, DVec3, Vec3};
//! use rayfront::query::{Coherence, HitBatch, RayBatch, SceneBuilder};
//!
//! // A square of two triangles, one unit wide, and a ball.
//! let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
//! let mut builder = SceneBuilder::new();
//! let square = builder.add_mesh(&corners, &[[0, 1, 2], [0, 2, 3]])?;
//! let ball = builder.add_spheres(&[[0.5, 0.5, 0.0, 0.25]])?;
//!
//! // The square twice: where it is, and ten units to the right and twice as large. The ball
//! // three units above the first.
//! let here = builder.place(square, &DAffine3::IDENTITY)?;
//! let right = DAffine3::from_translation(DVec3::X * 10.0) * DAffine3::from_scale(DVec3::splat(2.0));
//! let there = builder.place(square, &right)?;
//! let above = builder.place(ball, &DAffine3::from_translation(DVec3::Z * 3.0))?;
//! let scene = builder.build()?;
//!
//! // Straight down from z = 5.
//! let mut rays = RayBatch::default();
//! for (x, y) in [(0.5, 0.5), (0.9, 0.1), (10.2, 1.8), (5.0, 0.5)] {
//!     rays.push(Vec3::new(x, y, 5.0), Vec3::NEG_Z, 0.0, f32::INFINITY);
//! }
//! let mut hits = HitBatch::new(rays.len());
//! scene.tracer().closest(rays.rays(), Coherence::Coherent, hits.hits_mut())?;
//!
//! assert_eq!(hits.t(), [1.75, 5.0, 5.0, f32::INFINITY]);
//! let places: Vec<_> = hits.iter().map(|hit| scene.locate(&hit)).collect();
//! assert_eq!(places[0].map(|p| (p.instance, p.shape, p.primitive)), Some((above, ball, 0)));
//! assert_eq!(places[1].map(|p| (p.instance, p.shape, p.primitive)), Some((here, square, 0)));
//! assert_eq!(places[2].map(|p| (p.instance, p.shape, p.primitive)), Some((there, square, 1)));
//! assert_eq!(places[3], None);
//!
//! // Any-hit queries, on several threads with a tracer for each.
//! let mut blocked = vec![0; rays.len()];
//! std::thread::scope(|scope| {
//!     for (rays, blocked) in rays.chunks(2).zip(blocked.chunks_mut(2)) {
//!         let scene = &scene;
//!         scope.spawn(move || scene.tracer().any(rays, Coherence::Unknown, blocked));
//!     }
//! });
//! assert_eq!(blocked, [1, 1, 1, 0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Shapes and instances
//!
//! A [`SceneBuilder`] takes *shapes*, that is, meshes and sets of spheres, each in coordinates of its own, and *places*
//! them: an instance is a shape and an affine transform. A shape that is not placed cannot be hit. Each shape is stored
//! once, however often it is placed. A shape that is placed once is moved into the world (spheres only if the transform
//! is a translation) and costs what it would cost without a transform. For all others, rays are transformed to the
//! shape's space, in single precision. An instance places a shape, never other instances.
//!
//! Everything is checked when it is added: a [`BuildError`] names the shape, triangle, sphere or instance at fault.
//! Limits are [`MAX_PRIMITIVES`] and [`MAX_COORDINATE`]; anything smaller than 10⁻¹² may be missed.
//!
//! # Rays
//!
//! A ray is the set of points `origin + t · direction` with `t_min` < t ≤ `t_max`. `t_min` itself is excluded, so that
//! a ray that starts on a surface with a `t_min` of 0 does not hit that surface; `t_max` is included. A query takes
//! rays in columns, one slice for each component: views of memory that the caller has ([`Rays`]), or a [`RayBatch`],
//! which owns its columns.
//!
//! - `direction` need not be of unit length; t is measured in its length. It should be between 10⁻⁶ and 10⁶ long:
//!   with a shorter or longer one the ray may miss. With one of length zero it misses.
//! - `t_min` is at least 0; a negative one counts as 0.
//! - `t_max` is infinity where nothing bounds the ray. With a `t_max` below `t_min` it misses.
//! - A ray with a NaN anywhere, or with infinity in its origin or direction, misses.
//!
//! Columns need no alignment and may have any length, zero included. Batches of rays are faster than single rays:
//! [`QUEUE`] of them are best, some thousands nearly as good, and a few dozen are the least that fill the lanes of the
//! processor. [`Tracer::closest_one`] is for rays that depend on the hits of others. [`Coherence`] is a hint about
//! consecutive rays. It affects only the time that a query takes.
//!
//! # What a ray hits
//!
//! Triangles are hit from both sides; nothing is culled. Spheres are surfaces: a ray from inside hits them, too, and
//! the hit is the first of the two intersections beyond `t_min`. Triangles without area are never hit.
//!
//! A hit is a row of five columns ([`HitsMut`] views them, a [`HitBatch`] owns them):
//!
//! | column | hit | miss |
//! |---|---|---|
//! | `t` | distance in lengths of `direction` | infinity |
//! | `u`, `v` | weights of a triangle's second and third corner; 0 for a sphere | 0 |
//! | `primitive` | an id within the scene | [`NONE`] |
//! | `instance` | an id within the scene, or [`NONE`] | [`NONE`] |
//!
//! The point that was hit is (1 − u − v) · a + u · b + v · c on the triangle a b c, which is more exact than `origin +
//! t · direction`; in an instance, that point has to be transformed. Whatever is linear over a triangle is interpolated
//! in the same way. `u` and `v` are at least 0 and `u + v` is at most 1, up to rounding.
//!
//! `primitive` and `instance` are ids within the built scene, which can be compared and stored. [`Scene::locate`] turns
//! them into a [`HitPrimitive`]: the instance, the shape, and the index of the triangle or sphere among those that were
//! added. (Queries write only these columns; the rest is looked up for the hits that need it.)
//!
//! # Exactness
//!
//! The triangle test is watertight (Woop, Benthin and Wald 2013): where two triangles of a shape share an edge, that
//! is, have the same two points at its ends, no ray passes between them, whether it is aimed at the edge or at a
//! vertex. A box is never culled if there is a hit in it. Where t may be off by more than 1/16,384 of itself, it is
//! computed in double precision, so that a ray which leaves a surface from a point that is off by its rounding error
//! does not hit it again.
//!
//! The result is a function of scene and ray: it is the same, to the last bit, for every [`Coherence`] and [`Isa`], for
//! every split of rays into batches, and with any number of threads. Among hits at the same t, the one with the
//! smallest ids wins: within a mesh, the triangle that comes first. The same calls build the same scene.
//!
//! # Threads, memory and time
//!
//! A [`Scene`] is immutable: it is `Send` and `Sync`, and any number of threads may trace through it concurrently, each
//! with a [`Tracer`] of its own. There are no locks and no global state. A tracer's buffers grow with its first queries
//! and are reused; then queries allocate nothing. A query runs on the thread that calls it; to use several, give each a
//! part of the rays ([`RayBatch::chunks`], [`HitBatch::chunks_mut`]). [`SceneBuilder::build`] uses the threads of the
//! rayon pool that it is called from.
//!
//! A scene takes 50 to 60 bytes for each triangle and about 150 for each instance ([`Scene::memory_bytes`]). The
//! builder's copy of vertices and triangles is freed after building, so keep what shading needs. During the build, a
//! scene takes another 80 bytes for each triangle ([`Statistics`]). Time to build grows as n log n, time to trace a ray
//! roughly as log n. Long, thin triangles at an angle to the axes are split where rays gain from it: they take up to three
//! times the memory, twice in most cases, and four to six times the time to build.
//!
//! Queries never panic, and the only error is [`LengthMismatch`].
//!
//! [`NONE`]: crate::math::NONE
//! [`Isa`]: crate::simd::Isa

mod batch;
mod builder;
mod error;
mod scene;

#[cfg(test)]
mod tests;

pub use crate::bvh::{BuildStatistics, Coherence, HitsMut, QUEUE, Rays};
pub use crate::math::{Aabb, Hit, NONE};
pub use crate::simd::Isa;
pub use batch::{HitBatch, RayBatch};
pub use builder::{InstanceId, MAX_COORDINATE, MAX_PRIMITIVES, SceneBuilder, ShapeId};
pub use error::{BuildError, LengthMismatch};
pub use scene::{HitPrimitive, Scene, Statistics, Tracer};
