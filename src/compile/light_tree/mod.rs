//! Builds a light tree: separates distant lights from those at a finite place, and cuts each set in two, recursively,
//! by the surface area orientation heuristic (Conty Estevez and Kulla, "Importance sampling of many lights with
//! adaptive tree splitting", 2018; PBRT 4th ed., 12.6.3).

mod bound;
mod cut;

use bound::WideBounds;
use cut::{CutBox, best_cut};

use crate::math::{Aabb, Vec3};
use crate::scene::light_tree::{LEAF, LightTree, NODE};

/// The bounds of a light: its place, its directions and its power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// The box around all of its points; without meaning for a distant light.
    pub bounds: Aabb,
    /// True if it is infinitely far away.
    pub far: bool,
    /// Its intensity along its normal in W/sr, or the irradiance of a distant light in W/m², in any common scale; for a
    /// two-sided light, that of the brighter side.
    pub power: f32,
    /// The middle of its normals, of any length; for a distant light, of the directions to it.
    pub axis: Vec3,
    /// Cosine of the angle from the axis within which these are: 1 for a flat light, −1 for one that emits everywhere,
    /// such as a point.
    pub cos_spread: f32,
    /// Cosine of the angle from a normal within which light leaves: 0 for a diffuse surface. For a spot light with its
    /// axis as normal, that of the outer angle.
    pub cos_emission: f32,
    /// True if light also leaves on the other side of the normals.
    pub two_sided: bool,
    /// The intensity outside of these directions, as a fraction of `power`; only for one-sided lights.
    pub outside: f32,
}

/// The longest path in the tree: the number of bits of a word.
const LONGEST_PATH: u32 = 32;

/// Builds the tree over all lights, which it identifies by their index in the slice. At most 2³¹.
pub fn build(lights: &[LightBounds]) -> LightTree {
    if lights.is_empty() {
        return LightTree::default();
    }
    let bounds: Vec<WideBounds> = lights.iter().map(WideBounds::new).collect();
    let total: f64 = bounds.iter().map(|bound| bound.power).sum();
    let mut builder = LightTreeBuilder {
        scale: if total > 0.0 { 1.0 / total } else { 0.0 },
        nodes: Vec::with_capacity(2 * lights.len()),
        paths: vec![0; lights.len()],
        bounds,
    };
    let items = builder.bounds.iter().enumerate().map(CutItem::new);
    let (mut far, mut near): (Vec<CutItem>, Vec<CutItem>) =
        items.partition(|item| lights[item.light as usize].far);
    let mixed = !far.is_empty() && !near.is_empty();
    if mixed {
        builder.nodes.resize(4, [0.0; NODE]);
        let bound = builder.subtree(&mut near, 2, 0, 1);
        builder.subtree(&mut far, 3, 1, 1);
        builder.nodes[0] = bound.node(builder.scale, 2).to_floats();
    } else {
        builder.nodes.resize(2, [0.0; NODE]);
        near.append(&mut far);
        builder.subtree(&mut near, 0, 0, 0);
    }
    LightTree { nodes: builder.nodes, paths: builder.paths, mixed }
}

/// A light with the bounds by which cuts are chosen, stored by value so that a range of items is contiguous in memory.
#[derive(Clone, Copy)]
struct CutItem {
    extent: CutBox,
    light: u32,
}

impl CutItem {
    fn new((light, bound): (usize, &WideBounds)) -> Self {
        Self { extent: CutBox::new(bound), light: light as u32 }
    }
}

struct LightTreeBuilder {
    bounds: Vec<WideBounds>,
    /// Powers are multiplied by this.
    scale: f64,
    nodes: Vec<[f32; NODE]>,
    paths: Vec<u32>,
}

impl LightTreeBuilder {
    /// Builds over lights, with the root in an existing slot.
    fn subtree(&mut self, items: &mut [CutItem], slot: usize, path: u32, depth: u32) -> WideBounds {
        let (bound, next) = if let [item] = items {
            self.paths[item.light as usize] = path;
            (self.bounds[item.light as usize], LEAF | item.light)
        } else {
            let (left, right) = cut(items, LONGEST_PATH - 1 - depth);
            let children = self.nodes.len();
            self.nodes.extend([[0.0; NODE]; 2]);
            let first = self.subtree(left, children, path, depth + 1);
            let second = self.subtree(right, children + 1, path | 1 << depth, depth + 1);
            (first.union(&second), children as u32)
        };
        self.nodes[slot] = bound.node(self.scale, next).to_floats();
        bound
    }
}

/// The two parts of a good cut; neither is empty or has more than 2^`levels` lights.
fn cut(items: &mut [CutItem], levels: u32) -> (&mut [CutItem], &mut [CutItem]) {
    let half = items.len() / 2;
    let cut = if items.len() > 2 { best_cut(items) } else { None };
    let Some(cut) = cut else { return items.split_at_mut(half) };
    // Swaps from both ends: the order depends only on the input.
    let (mut low, mut high) = (0, items.len());
    while low < high {
        if cut.is_first(&items[low].extent) {
            low += 1;
        } else {
            high -= 1;
            items.swap(low, high);
        }
    }
    let most = low.max(items.len() - low) as u64;
    let refused = low == 0 || low == items.len() || most > 1 << levels;
    items.split_at_mut(if refused { half } else { low })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use crate::scene::light_tree::field;
    use rand::RngExt;

    fn lamp(place: Vec3, power: f32) -> LightBounds {
        let bounds = Aabb { min: place, max: place };
        let (axis, far) = (Vec3::Z, false);
        LightBounds {
            bounds,
            far,
            power,
            axis,
            cos_spread: -1.0,
            cos_emission: 0.0,
            two_sided: false,
            outside: 0.0,
        }
    }

    /// The length of the longest path; checks that each light's path leads to it.
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
    fn tree_depth_is_limited_for_any_input() {
        // Each light is a little farther and fainter than the one before, so each cut would split off one.
        let far: Vec<_> = (0..3000)
            .map(|i| lamp(Vec3::X * 2f32.powf(i as f32 * 0.04), 2f32.powf(i as f32 * -0.03)))
            .collect();
        assert!(longest_path(&build(&far)) <= 32);
        assert!(longest_path(&build(&[lamp(Vec3::ONE, 1.0); 3000])) <= 12);
    }

    #[test]
    fn invalid_lights_give_a_finite_tree() {
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
}
