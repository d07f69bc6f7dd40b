//! Lights to light tree: cut in two, again and again, where the surface area orientation
//! heuristic says (Conty Estevez and Kulla, "Importance sampling of many lights with adaptive
//! tree splitting", 2018; PBRT 4th ed., 12.6.3).

use std::f64::consts::{FRAC_PI_2, PI};

use crate::math::{Aabb, DVec3, Vec3};
use crate::scene::light_tree::{LEAF, LightTree, NODE, Node};

/// Where a light is and where it shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Around all points of it.
    pub bounds: Aabb,
    /// What it sends out in W, in any scale; that of the brighter side if it has two.
    pub power: f32,
    /// The middle of its normals, of any length.
    pub axis: Vec3,
    /// Cosine of the angle from the axis within which its normals are: 1 for what is flat, −1
    /// for what shines everywhere, such as a point.
    pub cos_spread: f32,
    /// Cosine of the angle from a normal within which its light leaves: 0 for a diffuse surface.
    /// For a spot light with its axis as normal, that of the outer angle.
    pub cos_emission: f32,
    /// Whether light leaves on the other side of the normals, too.
    pub two_sided: bool,
}

/// How many bins compete for a cut along each axis.
const BINS: usize = 12;
/// No path in the tree is longer than the bits of a word.
const LONGEST_PATH: u32 = 32;
/// Cones are wider by this angle, spheres by this part, than computed: for rounding.
const SLACK: f64 = 1e-5;

/// The tree over all of them; the index of a light is its own in the slice. At most 2³¹.
pub fn build(lights: &[LightBounds]) -> LightTree {
    if lights.is_empty() {
        return LightTree::default();
    }
    let bounds: Vec<Bound> = lights.iter().map(Bound::new).collect();
    let total: f64 = bounds.iter().map(|bound| bound.power).sum();
    let mut builder = Builder {
        centers: bounds.iter().map(|bound| (bound.min + bound.max) * 0.5).collect(),
        order: (0..lights.len() as u32).collect(),
        scale: if total > 0.0 { 1.0 / total } else { 0.0 },
        bounds,
        nodes: vec![[0.0; NODE]; 2],
        paths: vec![0; lights.len()],
    };
    builder.nodes.reserve(2 * lights.len());
    builder.subtree(0, lights.len(), 0, 0, 0);
    LightTree { nodes: builder.nodes, paths: builder.paths }
}

struct Builder {
    bounds: Vec<Bound>,
    centers: Vec<DVec3>,
    /// Lights, in the order of leaves when it is done.
    order: Vec<u32>,
    /// Powers are multiplied by this.
    scale: f64,
    nodes: Vec<[f32; NODE]>,
    paths: Vec<u32>,
}

impl Builder {
    /// Builds over a range of the order, with its root in a slot that is there already.
    fn subtree(&mut self, begin: usize, end: usize, slot: usize, path: u32, depth: u32) -> Bound {
        let (bound, next) = if end - begin == 1 {
            let light = self.order[begin];
            self.paths[light as usize] = path;
            (self.bounds[light as usize], LEAF | light)
        } else {
            let middle = self.cut(begin, end, LONGEST_PATH - 1 - depth);
            let children = self.nodes.len();
            self.nodes.extend([[0.0; NODE]; 2]);
            let first = self.subtree(begin, middle, children, path, depth + 1);
            let second = self.subtree(middle, end, children + 1, path | 1 << depth, depth + 1);
            (first.union(&second), children as u32)
        };
        self.nodes[slot] = bound.node(self.scale, next).to_floats();
        bound
    }

    /// Orders a range so that the two parts of a good cut follow each other; gives where the
    /// second begins. Neither has more than 2^`levels` lights.
    fn cut(&mut self, begin: usize, end: usize, levels: u32) -> usize {
        let range = &mut self.order[begin..end];
        let half = begin + range.len() / 2;
        let Some(cut) = best_cut(&self.bounds, &self.centers, range) else { return half };
        // Swapping from both ends: the same order for the same input.
        let (mut low, mut high) = (0, range.len());
        while low < high {
            if cut.is_first(self.centers[range[low] as usize]) {
                low += 1;
            } else {
                high -= 1;
                range.swap(low, high);
            }
        }
        let most = low.max(range.len() - low);
        if low == 0 || low == range.len() || most as u64 > 1 << levels { half } else { begin + low }
    }
}

/// A plane between two bins along an axis.
struct Cut {
    axis: usize,
    low: f64,
    /// Bins a metre.
    scale: f64,
    /// The first bin of the second part.
    bin: usize,
}

impl Cut {
    fn bin_of(&self, center: DVec3) -> usize {
        (((center[self.axis] - self.low) * self.scale) as usize).min(BINS - 1)
    }

    fn is_first(&self, center: DVec3) -> bool {
        self.bin_of(center) < self.bin
    }
}

/// The cut of lowest cost; none if all centres are the same.
fn best_cut(bounds: &[Bound], centers: &[DVec3], range: &[u32]) -> Option<Cut> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut extent = Bound::NONE;
    for &light in range {
        low = low.min(centers[light as usize]);
        high = high.max(centers[light as usize]);
        extent.grow_box(&bounds[light as usize]);
    }
    let mut best: Option<(f64, Cut)> = None;
    for axis in 0..3 {
        let width = high[axis] - low[axis];
        if width.is_nan() || width <= 0.0 || !width.is_finite() {
            continue;
        }
        let mut cut = Cut { axis, low: low[axis], scale: BINS as f64 / width, bin: 0 };
        let mut bins = [Bound::NONE; BINS];
        for &light in range {
            let bin = &mut bins[cut.bin_of(centers[light as usize])];
            *bin = bin.union(&bounds[light as usize]);
        }
        // Long, thin parts cost more.
        let size = extent.max - extent.min;
        let thinness = size.max_element() / size[axis].max(f64::MIN_POSITIVE);
        let (cost, bin) = cheapest(&bins);
        if best.as_ref().is_none_or(|(lowest, _)| cost * thinness < *lowest) {
            cut.bin = bin;
            best = Some((cost * thinness, cut));
        }
    }
    best.map(|(_, cut)| cut)
}

/// The lowest cost of the cuts between bins, and the bin before which it is.
fn cheapest(bins: &[Bound; BINS]) -> (f64, usize) {
    let mut after = [0.0; BINS];
    let mut bound = Bound::NONE;
    for i in (1..BINS).rev() {
        bound = bound.union(&bins[i]);
        after[i] = bound.cost();
    }
    let mut best = (f64::INFINITY, BINS / 2);
    let mut bound = Bound::NONE;
    for i in 1..BINS {
        bound = bound.union(&bins[i - 1]);
        let cost = bound.cost() + after[i];
        if cost < best.0 {
            best = (cost, i);
        }
    }
    best
}

/// [`LightBounds`] of one light or many, in double precision, angles in radians.
#[derive(Clone, Copy, Debug)]
struct Bound {
    min: DVec3,
    max: DVec3,
    power: f64,
    axis: DVec3,
    spread: f64,
    emission: f64,
    two_sided: bool,
}

impl Bound {
    /// Of no light; as lights without power, it widens nothing.
    const NONE: Bound = Bound {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
        power: 0.0,
        axis: DVec3::Z,
        spread: 0.0,
        emission: 0.0,
        two_sided: false,
    };

    fn new(light: &LightBounds) -> Self {
        let (min, max) = (light.bounds.min.as_dvec3(), light.bounds.max.as_dvec3());
        let power = light.power as f64;
        if !(min.is_finite() && max.is_finite() && power.is_finite() && power > 0.0)
            || light.bounds.is_empty()
        {
            return Self { min: DVec3::ZERO, max: DVec3::ZERO, ..Self::NONE };
        }
        let axis = light.axis.as_dvec3();
        let length = axis.length();
        let directed = length > 0.0 && length.is_finite();
        let angle = |cos: f32| libm::acos(cos.clamp(-1.0, 1.0) as f64);
        Self {
            min,
            max,
            power,
            axis: if directed { axis / length } else { DVec3::Z },
            spread: if directed { angle(light.cos_spread) } else { PI },
            emission: angle(light.cos_emission),
            two_sided: light.two_sided,
        }
    }

    fn grow_box(&mut self, other: &Self) {
        if other.power > 0.0 {
            self.min = self.min.min(other.min);
            self.max = self.max.max(other.max);
        }
    }

    fn union(&self, other: &Self) -> Self {
        if other.power == 0.0 {
            return *self;
        }
        if self.power == 0.0 {
            return *other;
        }
        let (axis, spread) = self.cone(other);
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            power: self.power + other.power,
            axis,
            spread,
            emission: self.emission.max(other.emission),
            two_sided: self.two_sided | other.two_sided,
        }
    }

    /// The narrowest cone around those of two (PBRT 3.8.4).
    fn cone(&self, other: &Self) -> (DVec3, f64) {
        let (a, mut b) = (self.axis, other.axis);
        if self.spread >= PI || other.spread >= PI {
            return (a, PI);
        }
        // The normals of what has two sides may as well be turned around.
        if other.two_sided && a.dot(b) < 0.0 {
            b = -b;
        }
        let sin = a.cross(b).length();
        let between = libm::atan2(sin, a.dot(b));
        if between + other.spread <= self.spread {
            return (a, self.spread);
        }
        if between + self.spread <= other.spread {
            return (b, other.spread);
        }
        let spread = 0.5 * (self.spread + between + other.spread);
        if spread >= PI {
            return (a, PI);
        }
        if sin < 1e-9 {
            // Parallel within rounding, or opposite: then anything across would do.
            return if between < FRAC_PI_2 { (a, spread + SLACK) } else { (a, PI) };
        }
        let turn = spread - self.spread;
        let axis = a * libm::sin(between - turn) + b * libm::sin(turn);
        (axis.normalize(), spread)
    }

    /// Power, times the measure of directions, times the area of the box (PBRT, "EvaluateCost").
    fn cost(&self) -> f64 {
        if self.power == 0.0 {
            return 0.0;
        }
        let (spread, end) = (self.spread, (self.spread + self.emission).min(PI));
        let (sin, cos) = (libm::sin(spread), libm::cos(spread));
        let around = 2.0 * end * sin - libm::cos(spread - 2.0 * end) - 2.0 * spread * sin + cos;
        let directions = 2.0 * PI * (1.0 - cos) + FRAC_PI_2 * around;
        let d = self.max - self.min;
        // Lights in one row have no area, yet should be cut where they are far apart.
        let area = d.x * d.y + d.y * d.z + d.z * d.x + 1e-6 * d.length_squared();
        self.power * directions * area
    }

    fn node(&self, scale: f64, next: u32) -> Node {
        let center = ((self.min + self.max) * 0.5).as_vec3();
        let reach = (self.max - center.as_dvec3()).max(center.as_dvec3() - self.min);
        let spread = (self.spread + SLACK).min(PI);
        let power = if self.power > 0.0 { (self.power * scale).max(1e-30) } else { 0.0 };
        Node {
            center: center.to_array(),
            radius_square: (reach.length_squared() * (1.0 + SLACK)) as f32,
            axis: self.axis.as_vec3().to_array(),
            cos_spread: libm::cos(spread) as f32,
            sin_spread: libm::sin(spread) as f32,
            cos_emission: libm::cos((self.emission + SLACK).min(PI)) as f32,
            power: power as f32,
            two_sided: if self.two_sided { 1.0 } else { 0.0 },
            next,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use crate::scene::light_tree::field;
    use rand::RngExt;

    fn lamp(place: Vec3, power: f32) -> LightBounds {
        let bounds = Aabb { min: place, max: place };
        LightBounds { bounds, power, axis: Vec3::Z, cos_spread: -1.0, cos_emission: 0.0, two_sided: false }
    }

    /// The length of the longest path, after checking that each light's leads to it.
    fn longest_path(tree: &LightTree) -> u32 {
        let next = |node: u32| tree.nodes[node as usize][field::NEXT as usize].to_bits();
        let mut longest = 0;
        for light in 0..tree.len() {
            let (mut path, mut at, mut length) = (tree.paths[light], next(0), 0);
            while at & LEAF == 0 {
                at = next(at + (path & 1));
                path >>= 1;
                length += 1;
            }
            assert_eq!(at, LEAF | light as u32);
            longest = longest.max(length);
        }
        longest
    }

    #[test]
    fn every_light_is_a_leaf_at_the_end_of_its_path() {
        let mut stream = Stream::new(1);
        for n in [1usize, 2, 3, 17, 1000] {
            let mut random = || Vec3::from_array([0; 3].map(|_| stream.random_range(-9.0..9.0)));
            let lights: Vec<_> = (0..n).map(|i| lamp(random(), 1.0 + i as f32)).collect();
            let tree = build(&lights);
            assert_eq!((tree.len(), tree.nodes.len()), (n, 2 * n));
            assert!(longest_path(&tree) < 24);
            assert!((tree.nodes[0][field::POWER as usize] - 1.0).abs() < 1e-6);
            assert_eq!(build(&lights).nodes.as_flattened().len(), 16 * tree.nodes.len());
        }
    }

    #[test]
    fn no_input_makes_a_deep_tree() {
        // Each is a thousand times as far as the one before, so each cut would take one off.
        let far: Vec<_> = (0..3000)
            .map(|i| lamp(Vec3::X * 2f32.powf(i as f32 * 0.04), 2f32.powf(i as f32 * -0.03)))
            .collect();
        assert!(longest_path(&build(&far)) <= 32);
        assert!(longest_path(&build(&[lamp(Vec3::ONE, 1.0); 3000])) <= 12);
    }

    #[test]
    fn odd_lights_do_no_harm() {
        let broken = [
            lamp(Vec3::NAN, 1.0),
            lamp(Vec3::ONE, f32::INFINITY),
            lamp(Vec3::ONE, -1.0),
            LightBounds { bounds: Aabb::EMPTY, ..lamp(Vec3::ONE, 1.0) },
            LightBounds { axis: Vec3::ZERO, ..lamp(Vec3::ONE, 1.0) },
            lamp(Vec3::splat(f32::MAX), 1.0),
        ];
        let tree = build(&broken);
        assert_eq!(tree.len(), 6);
        assert!(
            tree.nodes.as_flattened().chunks(NODE).all(|node| node[10].is_finite() && node[0].is_finite())
        );
        assert!(build(&[]).is_empty());
        assert_eq!(build(&[lamp(Vec3::ONE, 0.0)]).nodes[0][field::POWER as usize], 0.0);
    }

    #[test]
    fn cones_hold_what_is_in_them() {
        let mut stream = Stream::new(3);
        for round in 0..5000 {
            let mut cone = || {
                let axis = DVec3::from_array([0; 3].map(|_| stream.random_range(-1.0..1.0)));
                let spread = if round % 3 == 0 { 0.0 } else { stream.random_range(0.0..3.0) };
                Bound { axis: axis.normalize(), spread, power: 1.0, ..Bound::NONE }
            };
            let (a, b) = (cone(), cone());
            let both = a.union(&b);
            for part in [a, b] {
                let between = libm::acos(part.axis.dot(both.axis).clamp(-1.0, 1.0));
                assert!(between + part.spread <= both.spread + 1e-7 || both.spread >= PI);
            }
        }
    }
}
