//! Targets of photons: balls around everything that makes caustics.

use crate::bvh::layout::sidedness::SPHERE;
use crate::math::{NONE, Vec3};
use crate::scene::{CompiledScene, Geometry};
use crate::world::Transport;

/// The largest number of balls. Each photon ray is tested against all of them.
pub(in crate::integrator) const MOST: usize = 32;
/// A ball is divided if the discs of its parts together are smaller than this fraction of its own.
const WORTH: f32 = 0.7;

/// The largest number of pieces that are divided, to limit the time.
const LARGE: u32 = 1 << 17;

/// A ball that encloses something that makes caustics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// The centre in world space.
    pub center: Vec3,
    /// The radius in metres.
    pub radius: f32,
}

impl Ball {
    /// The area of its shadow in parallel light.
    pub fn disc(&self) -> f32 {
        std::f32::consts::PI * self.radius * self.radius
    }
}

/// The box of something that makes caustics, as its minimum and maximum corner.
type Piece = [Vec3; 2];

/// Pieces and the ball around them.
struct Cluster {
    ball: Ball,
    pieces: Vec<Piece>,
}

/// Returns balls around everything that makes caustics.
pub fn targets(scene: &CompiledScene, transport: Transport) -> Vec<Ball> {
    let mut pieces = pieces(scene, transport);
    if pieces.is_empty() {
        return Vec::new();
    }
    let mut clusters = vec![Cluster::new(std::mem::take(&mut pieces))];
    // Divides the largest cluster first.
    let mut whole: Vec<Cluster> = Vec::new();
    while let Some(at) = largest(&clusters) {
        let cluster = clusters.swap_remove(at);
        if clusters.len() + whole.len() + 2 > MOST {
            whole.push(cluster);
            break;
        }
        match cluster.divided() {
            Ok(parts) => clusters.extend(parts),
            Err(cluster) => whole.push(cluster),
        }
    }
    whole.extend(clusters);
    whole.into_iter().map(|cluster| cluster.ball).collect()
}

fn largest(clusters: &[Cluster]) -> Option<usize> {
    let places = 0..clusters.len();
    places.max_by(|a, b| clusters[*a].ball.radius.total_cmp(&clusters[*b].ball.radius))
}

impl Cluster {
    fn new(pieces: Vec<Piece>) -> Self {
        let all = pieces.iter().copied().reduce(|[low, high], [a, b]| [low.min(a), high.max(b)]);
        let [low, high] = all.unwrap_or([Vec3::ZERO; 2]);
        let center = 0.5 * (low + high);
        // The corners of the boxes may be nearer than half of the whole diagonal.
        let farthest = |[a, b]: &Piece| (*a - center).abs().max((*b - center).abs()).length();
        let radius = pieces.iter().map(farthest).fold(0.0, f32::max);
        // The margin includes rays that graze it.
        Self { ball: Ball { center, radius: radius * 1.001 }, pieces }
    }

    /// Divides the cluster in two if that saves enough photons.
    fn divided(self) -> Result<[Self; 2], Self> {
        if self.pieces.len() < 2 {
            return Err(self);
        }
        let middle = |[a, b]: &Piece| 0.5 * (*a + *b);
        let all = self.pieces.iter().map(|piece| [middle(piece); 2]);
        let [low, high] = all.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)]).unwrap_or_default();
        let size = high - low;
        let axis = if size.x >= size.y.max(size.z) {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let cut = 0.5 * (low[axis] + high[axis]);
        let (left, right): (Vec<_>, Vec<_>) =
            self.pieces.iter().copied().partition(|piece| middle(piece)[axis] < cut);
        if left.is_empty() || right.is_empty() {
            return Err(self);
        }
        let parts = [Self::new(left), Self::new(right)];
        let together: f32 = parts.iter().map(|part| part.ball.disc()).sum();
        if together < WORTH * self.ball.disc() { Ok(parts) } else { Err(self) }
    }
}

/// Boxes of all triangles, spheres and instances whose material makes caustics.
fn pieces(scene: &CompiledScene, transport: Transport) -> Vec<Piece> {
    let geometry = &*scene.geometry;
    let makes: Vec<bool> =
        scene.materials.iter().map(|material| material.makes_caustics_under(transport)).collect();
    if !makes.contains(&true) {
        return Vec::new();
    }
    let does = |primitive: u32, instance: u32| makes[geometry.material_of(primitive, instance) as usize];
    let mut pieces = Vec::new();
    // Several triangles of a large mesh are one piece: neighbours in a list are mostly neighbours in space.
    let run = (geometry.world_triangles / LARGE + 1) as usize;
    for first in (0..geometry.world_triangles).step_by(run) {
        let some = first..geometry.world_triangles.min(first + run as u32);
        let boxes = some.filter(|at| does(*at, NONE)).map(|at| box_of(geometry, at));
        pieces.extend(boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)]));
    }
    for sphere in 0..geometry.world_spheres {
        if does(sphere | SPHERE, NONE) {
            pieces.push(box_of(geometry, sphere | SPHERE));
        }
    }
    // A subtree may have several materials; there is no quick way to tell which of them an instance contains.
    let all = geometry.triangles.len() as u32;
    let any_behind = (geometry.world_triangles..all).any(|triangle| does(triangle, NONE));
    for (number, instance) in scene.bvh.instances.iter().enumerate() {
        let own = geometry.instance_materials[number];
        if if own == NONE { any_behind } else { makes[own as usize] } {
            let bounds = &instance.root.bounds;
            pieces.push(placed(&geometry.instances[number], bounds.min, bounds.max));
        }
    }
    pieces
}

/// The bounding box of a primitive, in the space of its tree.
fn box_of(geometry: &Geometry, primitive: u32) -> Piece {
    if primitive & SPHERE != 0 {
        let [x, y, z, radius] = geometry.spheres[(primitive & !SPHERE) as usize];
        let (center, radius) = (Vec3::new(x, y, z), Vec3::splat(radius.abs()));
        return [center - radius, center + radius];
    }
    let corners = geometry.triangles[primitive as usize];
    let [a, b, c] = corners.map(|corner| Vec3::from(geometry.positions[corner as usize]));
    [a.min(b).min(c), a.max(b).max(c)]
}

/// The bounding box of a box that an instance places.
fn placed(rows: &[f32; 24], low: Vec3, high: Vec3) -> Piece {
    let row = |i: usize| Vec3::new(rows[4 * i], rows[4 * i + 1], rows[4 * i + 2]);
    let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
    let at = |i: usize| row(i).dot(center) + rows[4 * i + 3];
    let reach = |i: usize| row(i).abs().dot(half);
    let center = Vec3::new(at(0), at(1), at(2));
    let reach = Vec3::new(reach(0), reach(1), reach(2));
    [center - reach, center + reach]
}
