//! Ray queries by themselves: triangles, spheres and instances in, nearest hits or any hits
//! out, for programs that do something else with rays than to render with this crate.
//!
//! ```
//! use rayfront::math::{DAffine3, DVec3, Vec3};
//! use rayfront::query::{BuildQuality, Coherence, HitBatch, RayBatch, SceneBuilder};
//!
//! // A square of two triangles, one unit wide, and a ball.
//! let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
//! let mut builder = SceneBuilder::new(BuildQuality::Default);
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
//! // Is there anything at all, with a tracer for each of several threads.
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
//! A [`SceneBuilder`] takes *shapes*, meshes and sets of spheres, each in coordinates of its
//! own, and *places* them: an instance is a shape and an affine transform. What is not placed
//! is not there. Each shape is stored once, however often it is placed. A shape that is placed
//! once is moved into the world (spheres, only where the transform is a translation) and
//! costs what it would cost without a transform; to the others rays are transformed, in
//! single precision. An instance places a shape, never other instances.
//!
//! Everything is checked when it is added: a [`BuildError`] says which shape, triangle,
//! sphere or instance is at fault. Limits are [`MAX_PRIMITIVES`] and [`MAX_COORDINATE`]; what
//! is smaller than 10⁻¹² may be missed.
//!
//! # Rays
//!
//! A ray is the points `origin + t · direction` with `t_min` < t ≤ `t_max`; `t_min` itself is
//! out, so that a ray that starts on a surface at 0 does not hit it there, and `t_max` itself
//! is in. A query takes rays in columns, one slice for each component: views of memory that
//! the caller has ([`Rays`]), or a [`RayBatch`], which owns its columns.
//!
//! - `direction` need not be of unit length; t counts in its lengths. It should be between
//!   10⁻⁶ and 10⁶ long: a ray of a shorter or longer one may miss. One of length zero misses.
//! - `t_min` is at least 0; a negative one counts as 0.
//! - `t_max` is infinity where nothing bounds the ray. With a `t_max` below `t_min` it misses.
//! - A ray with a NaN anywhere, or with infinity in its origin or direction, misses.
//!
//! There is no alignment and no multiple of anything to keep to: columns may begin anywhere
//! and be of any length, zero too. Many rays at once are faster than one at a time:
//! [`QUEUE`] of them are best, some thousands nearly as good, and a few dozen the least that fill the lanes
//! of the processor.
//! [`Coherence`] is what the caller knows of rays that follow each other. It may change the
//! time that a query takes and changes nothing else.
//!
//! # What a ray hits
//!
//! Triangles are hit from both sides; nothing is culled. Spheres are surfaces: a ray from
//! inside hits them, too, and the hit is the first of the two intersections beyond `t_min`.
//! Triangles without area are never hit.
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
//! The point that was hit is (1 − u − v) · a + u · b + v · c on the triangle a b c, which is
//! more exact than `origin + t · direction`; placed, it is that point transformed. What is
//! linear over a triangle is interpolated in the same way. `u` and `v` are at least 0 and
//! `u + v` is at most 1, up to rounding.
//!
//! `primitive` and `instance` are ids of the scene as it was built, to be compared with each
//! other and kept. [`Scene::locate`] makes a [`HitPrimitive`] of them: instance, shape, and the
//! triangle's or sphere's place in what was handed over. (So that queries write what they
//! find and no more: the rest is looked up for those hits that it is wanted of.)
//!
//! # Exactness
//!
//! The test for triangles is watertight (Woop, Benthin and Wald 2013): where two triangles of a
//! shape have an edge in common, that is, have the same two coordinates at its ends, no ray
//! passes between them, be it aimed at the edge or at a vertex. No box is ever culled before a hit in it.
//! Where t may be off by more than a 16,384th part of itself it is computed in double precision,
//! so that a ray which leaves a surface at a distance of its rounding error does not hit it again.
//!
//! The answer is a function of scene and ray: it is the same, to the last bit, for every
//! [`Coherence`] and [`Level`], for every split of rays into batches, and on every number of
//! threads. Of hits at the same t, the one with the smallest ids wins: of one mesh, the
//! triangle that comes first. Scenes that were built by the same calls are the same; with
//! another [`BuildQuality`] the t of a grazing hit may differ in its last bits.
//!
//! # Threads, memory and time
//!
//! A [`Scene`] never changes: it is `Send` and `Sync`, and any number of threads may trace
//! through it at once, each with a [`Tracer`] of its own. There is no lock, no global state,
//! and after [`Scene::tracer`] no allocation. A query runs on the thread that asks; to use
//! several, give each a part of the rays ([`RayBatch::chunks`], [`HitBatch::chunks_mut`]).
//! [`SceneBuilder::build`] uses the threads of the rayon pool that it is called from.
//!
//! A scene takes 50 to 60 bytes a triangle and about 150 an instance
//! ([`Scene::memory_bytes`]); the builder's copy of vertices and triangles is gone after
//! building, so keep what shading needs. Building needs about as much again for a while
//! ([`Statistics`]). Time to build grows as n log n, time to trace a ray roughly as log n.
//! [`BuildQuality`] weighs one against the other.
//!
//! Queries never panic, and the only error is [`LengthMismatch`].
//!
//! [`NONE`]: crate::math::NONE
//! [`Level`]: crate::simd::Level

mod batch;
mod builder;
mod error;
mod scene;

#[cfg(test)]
mod tests;

pub use crate::bvh::{BuildQuality, BuildStatistics, Coherence, HitsMut, QUEUE, Rays};
pub use crate::math::{Aabb, Hit, NONE};
pub use crate::simd::Level;
pub use batch::{HitBatch, RayBatch};
pub use builder::{InstanceId, MAX_COORDINATE, MAX_PRIMITIVES, SceneBuilder, ShapeId};
pub use error::{BuildError, LengthMismatch};
pub use scene::{HitPrimitive, Scene, Statistics, Tracer};
