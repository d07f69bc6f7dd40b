//! The paths of a unit, and what they give and take.

use std::collections::HashMap;
use std::num::Wrapping;
use std::ops::Range;

use super::probe::{MeasuredBlock, is_probed};
use super::{PixelSample, Sink, contains};
use crate::film::{Film, FilmScale, Region};
use crate::integrator::RenderSetup;
use crate::integrator::observe::{self, Observer};
use crate::integrator::path::camera_path::generate;
use crate::integrator::path::light_groups::{GroupLight, GroupQueue};
use crate::integrator::path::{Path, pack_pixel, unpack_pixel};
use crate::integrator::transport::reusable::ReusableVertex;
use crate::math::{Color, Rgb, Vector};
use crate::shading::HitLanes;
use crate::simd::{Float, Int};

/// The second vertex of a path, as it is given to the group.
#[derive(Clone, Copy)]
pub(super) enum SecondVertex {
    /// Nothing to give.
    Nothing,
    /// A second vertex that has not been evaluated yet.
    Open,
    /// Light from infinitely far away in a direction.
    Far(Vector<f32>),
    /// Light from a vertex.
    Near(ReusableVertex<f32>),
}

/// The light that a slot's first vertex takes from its group.
#[derive(Clone, Copy)]
pub(super) struct Received {
    pub radiance: Color<f32>,
    /// The number of second vertices that give any; not counted without an observer.
    pub vertices: u32,
}

/// A path and the radiance that it has found.
#[derive(Clone, Copy)]
pub(super) struct PathSlot {
    pub(super) pixel: u32,
    pub(super) sample: u32,
    /// True if the path exists.
    pub(super) begun: bool,
    /// The material of its first vertex.
    pub(super) material: u32,
    /// True if its first vertex takes: it is connected to second vertices of others.
    pub(super) takes: bool,
    pub(super) offer: SecondVertex,
    /// The throughput from the first vertex, a factor of all radiance found behind it.
    pub(super) weight: Color<f32>,
    /// The radiance that the path has found and keeps, before `weight`.
    pub(super) own: Color<f32>,
    /// The radiance that it has found for the whole group.
    pub(super) shared: Color<f32>,
    /// The fraction of the radiance found behind the second vertex that is given.
    pub(super) onward: Color<f32>,
}

/// The paths of some samples of some blocks of pixels, which are reused among each other.
pub struct PathSlots {
    /// Width and height of a block in pixels.
    pub(super) edge: u32,
    /// The region, in blocks.
    pub(super) blocks: Region,
    pub(super) samples: Range<u32>,
    /// The present units: samples of blocks, in order, with all samples of a block one after another.
    pub(super) units: Range<usize>,
    /// Binary logarithm of the group size, for each block.
    pub(super) sizes: Vec<u8>,
    /// The choices of blocks, stored because samples can come in several passes.
    pub(super) chosen: HashMap<[u32; 2], u8>,
    pub(super) unit: FilmScale,
    /// True while pixels are probed before rendering; the results are in `measured`.
    pub(super) pilot: bool,
    pub(super) measured: Vec<MeasuredBlock>,
    pub(super) slots: Vec<PathSlot>,
    /// The light found behind second vertices, in quanta, because paths that fork there end in any order. Empty if no
    /// path can fork.
    pub(super) found: Vec<[i64; 3]>,
    /// The number of light groups, and what the paths find of each: all of a path's groups one after another.
    pub(super) group_count: usize,
    pub(super) groups: Vec<GroupSlot>,
    /// First hits: t, u, v; primitive and instance.
    pub(super) hits: [Vec<f32>; 3],
    pub(super) ids: [Vec<u32>; 2],
}

impl PathSlots {
    /// Creates room for `units` samples of blocks.
    pub fn new(setup: &RenderSetup, units: usize) -> Self {
        let edge = setup.sharing.map_or(1, |grouping| grouping.edge());
        let count = units * setup.sharing.map_or(1, |grouping| grouping.pixels());
        Self {
            edge,
            blocks: Region { x0: 0, y0: 0, x1: 0, y1: 0 },
            samples: 0..0,
            units: 0..0,
            sizes: Vec::new(),
            chosen: HashMap::new(),
            unit: setup.unit,
            pilot: false,
            measured: Vec::new(),
            slots: vec![PathSlot::EMPTY; count],
            found: vec![[0; 3]; if setup.may_fork() { count } else { 0 }],
            group_count: setup.groups().count(),
            groups: vec![GroupSlot::default(); count * setup.groups().count()],
            hits: std::array::from_fn(|_| vec![0.0; count]),
            ids: std::array::from_fn(|_| vec![0; count]),
        }
    }

    /// Pixels of a block.
    #[inline(always)]
    pub(super) fn pixels(&self) -> usize {
        (self.edge * self.edge) as usize
    }

    /// Bytes of all columns.
    pub fn bytes(&self) -> usize {
        let found = size_of_val(&self.found[..]) + size_of_val(&self.groups[..]);
        self.slots.len() * (size_of::<PathSlot>() + 5 * size_of::<u32>()) + found
    }

    /// Sets the region, whose groups have the size that the setup specifies.
    pub fn enter(&mut self, setup: &RenderSetup, region: Region) {
        let Region { x0, y0, x1, y1 } = region;
        let edge = self.edge;
        self.blocks = Region { x0: x0 / edge, y0: y0 / edge, x1: x1.div_ceil(edge), y1: y1.div_ceil(edge) };
        let log2 = setup.sharing.map_or(0, |grouping| grouping.log2);
        self.sizes = vec![log2 as u8; self.blocks.area()];
    }

    /// Begins a range of samples of the region.
    pub fn start(&mut self, samples: Range<u32>) {
        self.pilot = false;
        self.samples = samples;
        self.units = 0..0;
    }

    /// Advances to the next units; returns false if none are left. Calls `begin` with the pixel and the sample of each
    /// path, in an order in which neighbours follow each other.
    pub fn advance(&mut self, size: [u32; 2], begin: &mut dyn FnMut(u32, u32)) -> bool {
        let all = self.blocks.area() * self.samples.len();
        // Blocks without path reuse are rendered elsewhere.
        let is_plain = |unit: &usize| self.sizes[unit / self.samples.len()] == 0;
        let (edge, pixels) = (self.edge, self.pixels());
        let first = (self.units.end..all).find(|unit| !is_plain(unit)).unwrap_or(all);
        let end = (first..all.min(first + self.slots.len() / pixels)).find(is_plain);
        self.units = first..end.unwrap_or(all.min(first + self.slots.len() / pixels));
        for (unit, slots) in self.units.clone().zip(self.slots.chunks_exact_mut(pixels)) {
            let ([column, row], sample) = unit_at(&self.blocks, &self.samples, unit);
            slots.fill(PathSlot::EMPTY);
            // By squares of 8 × 8 pixels.
            for place in 0..edge * edge {
                let (inner, outer) = (place % 64, place / 64);
                let (x, y) = (outer % (edge / 8) * 8 + inner % 8, outer / (edge / 8) * 8 + inner / 8);
                let (px, py) = (column * edge + x, row * edge + y);
                if px < size[0] && py < size[1] && (!self.pilot || is_probed(edge, px, py)) {
                    let pixel = pack_pixel(px, py);
                    let slot = &mut slots[(y * edge + x) as usize];
                    (slot.pixel, slot.sample, slot.begun) = (pixel, sample, true);
                    begin(pixel, sample);
                }
            }
        }
        self.groups.fill(GroupSlot::default());
        !self.units.is_empty()
    }

    /// The index of the slot of a sample's path.
    #[inline(always)]
    fn index(&self, (pixel, sample): PixelSample) -> usize {
        let (x, y) = unpack_pixel(pixel);
        let edge = self.edge;
        let block = self.blocks.index(x / edge, y / edge);
        let unit = block * self.samples.len() + (sample - self.samples.start) as usize;
        (unit - self.units.start) * self.pixels() + (y % edge * edge + x % edge) as usize
    }

    #[inline(always)]
    fn of(&mut self, path: PixelSample) -> &mut PathSlot {
        let index = self.index(path);
        &mut self.slots[index]
    }

    /// Stores a path's first hit. `receives`: the vertex may take.
    pub fn first(&mut self, path: PixelSample, hit: &HitLanes<f32>, material: u32, takes: bool) {
        let index = self.index(path);
        for (column, value) in self.hits.iter_mut().zip([hit.t, hit.u, hit.v]) {
            column[index] = value;
        }
        for (column, value) in self.ids.iter_mut().zip([hit.primitive.0, hit.instance.0]) {
            column[index] = value;
        }
        let shares = self.sizes[(self.units.start + index / self.pixels()) / self.samples.len()] > 0;
        let slot = &mut self.slots[index];
        (slot.material, slot.takes) = (material, takes && shares);
    }

    /// Stores that a path leaves its first vertex in a direction of density `pdf`. Returns true if the path is reused:
    /// then it goes on with a throughput of 1 and without radiance, so that what it finds can be given. All other paths
    /// bypass the slots from then on.
    pub fn leave(&mut self, path: PixelSample, throughput: Color<f32>, pdf: f32) -> bool {
        let slot = self.of(path);
        let shares = slot.takes && pdf > 0.0;
        if shares {
            (slot.offer, slot.weight) = (SecondVertex::Open, throughput);
        }
        shares
    }

    /// Stores that a reused path has left the scene after its first vertex.
    pub fn miss(&mut self, setup: &RenderSetup, path: PixelSample, direction: Vector<f32>) {
        let slot = self.of(path);
        // A panorama is also sampled directly, by every path for itself.
        if setup.scene.environment.panorama.is_none() {
            slot.offer = SecondVertex::Far(direction);
            slot.onward = Color::new(1.0, 1.0, 1.0);
        }
    }

    /// Stores light that a reused path has found behind its first vertex and keeps.
    pub fn keep(&mut self, path: PixelSample, light: Color<f32>) {
        let slot = self.of(path);
        slot.own = slot.own + light;
    }

    /// Stores what the second vertex of a reused path emits, which the path keeps, and the light that the vertex gives,
    /// if any.
    pub fn second(&mut self, path: PixelSample, emitted: Color<f32>, shared: Option<&ReusableVertex<f32>>) {
        self.keep(path, emitted);
        let Some(shared) = shared else { return };
        let slot = self.of(path);
        slot.offer = SecondVertex::Near(*shared);
        slot.onward = shared.onward;
        slot.shared = slot.shared + shared.gathered;
    }

    /// Stores what a light has sent to a path's second vertex.
    pub fn lit(&mut self, path: PixelSample, radiance: Color<f32>) {
        let slot = self.of(path);
        let part = if let SecondVertex::Near(shared) = &slot.offer { shared.light } else { Color::black() };
        slot.take(radiance, part);
    }

    #[inline(always)]
    fn of_group(&mut self, light: &GroupLight) -> (&mut GroupSlot, &PathSlot) {
        let index = self.index((light.pixel, light.sample));
        (&mut self.groups[index * self.group_count + light.group as usize], &self.slots[index])
    }

    /// Stores light by group that leaves second vertices: what they emit, and that of photons.
    pub fn second_by_group(&mut self, found: &mut GroupQueue) {
        for light in found.kept.drain(..) {
            let (group, _) = self.of_group(&light);
            group.own = group.own + Color::splat(light.light);
        }
        for light in found.given.drain(..) {
            let (group, _) = self.of_group(&light);
            group.shared = group.shared + Color::splat(light.light);
        }
    }

    /// Stores what lights of groups have sent to second vertices.
    pub fn lit_by_group(&mut self, found: &mut GroupQueue) {
        for light in found.kept.drain(..) {
            let (group, slot) = self.of_group(&light);
            let part =
                if let SecondVertex::Near(shared) = &slot.offer { shared.light } else { Color::black() };
            group.take(Color::splat(light.light), part);
        }
    }

    /// The light that a path gives, of all lights or of a group.
    pub(super) fn shared(&self, slot: usize, group: Option<usize>) -> Color<f32> {
        match group {
            None => self.slots[slot].shared,
            Some(group) => self.groups[slot * self.group_count + group].shared,
        }
    }

    /// Divides what the units' paths have found behind their second vertices, if they may fork. All have ended.
    pub fn settle(&mut self) {
        let quantum = self.unit.quantum();
        let used = self.units.len() * self.pixels();
        for (slot, found) in self.slots[..used].iter_mut().zip(&mut self.found) {
            let [r, g, b] = std::mem::take(found).map(|sum| (sum as f64 * quantum) as f32);
            slot.take(Color::new(r, g, b), slot.onward);
        }
        let slots = &self.slots[..used];
        for (slot, groups) in slots.iter().zip(self.groups.chunks_mut(self.group_count.max(1))) {
            for group in groups {
                let [r, g, b] = std::mem::take(&mut group.found).map(|sum| (sum as f64 * quantum) as f32);
                group.take(Color::new(r, g, b), slot.onward);
            }
        }
    }

    /// Adds the radiance that the paths keep and take to the pixels of a film.
    pub(super) fn finish(&self, received: &[Received], film: &mut Film, observer: &mut dyn Observer) {
        let region = film.region();
        for (slot, received) in self.slots[..self.units.len() * self.pixels()].iter().zip(received) {
            let (x, y) = unpack_pixel(slot.pixel);
            let own = slot.weight * slot.own;
            let total = own + received.radiance;
            if observer.is_active() && (slot.takes || slot.weight.max_component() > 0.0) {
                let Received { radiance, vertices } = *received;
                observer.report(&observe::received(slot.pixel, slot.sample, own, radiance, vertices));
            }
            // NaN is added, too: the film counts it.
            let is_black = total.r == 0.0 && total.g == 0.0 && total.b == 0.0;
            if contains(&region, x, y) && !is_black {
                film.add(x, y, slot.sample, total.into());
            }
        }
    }

    /// Adds the light of each group that the paths keep and take to the pixels of a film.
    pub(super) fn finish_groups(&self, received: &[Vec<Color<f32>>], film: &mut Film) {
        let region = film.region();
        let slots = self.slots[..self.units.len() * self.pixels()].iter().enumerate();
        for ((index, slot), own) in slots.zip(self.groups.chunks(self.group_count.max(1))) {
            let (x, y) = unpack_pixel(slot.pixel);
            if !slot.begun || !contains(&region, x, y) {
                continue;
            }
            for (group, (own, received)) in own.iter().zip(received).enumerate() {
                let light = slot.weight * own.own + received[index];
                if light.max_component() > 0.0 {
                    film.add_to_group(x, y, slot.sample, group as u32, light.into());
                }
            }
        }
    }

    /// The first hits of some slots.
    #[inline(always)]
    pub(super) fn hits<F: Float>(&self, places: F::Int, mask: F::Mask) -> HitLanes<F> {
        let [t, u, v] = &self.hits;
        let [primitive, instance] = &self.ids;
        HitLanes {
            t: F::gather(t, places, mask),
            u: F::gather(u, places, mask),
            v: F::gather(v, places, mask),
            primitive: F::Int::gather(primitive, places, mask),
            instance: F::Int::gather(instance, places, mask),
        }
    }
}

/// The light of a group that a path has found: see the fields of [`PathSlot`] and [`PathSlots::found`].
#[derive(Clone, Copy)]
pub(super) struct GroupSlot {
    own: Color<f32>,
    shared: Color<f32>,
    found: [i64; 3],
}

impl Default for GroupSlot {
    fn default() -> Self {
        Self { own: Color::black(), shared: Color::black(), found: [0; 3] }
    }
}

impl GroupSlot {
    fn take(&mut self, radiance: Color<f32>, shared: Color<f32>) {
        self.shared = self.shared + radiance * shared;
        self.own = self.own + radiance * shared.complement();
    }
}

impl PathSlot {
    const EMPTY: PathSlot = {
        let black = Color { r: 0.0, g: 0.0, b: 0.0 };
        PathSlot {
            pixel: 0,
            sample: 0,
            begun: false,
            material: 0,
            takes: false,
            offer: SecondVertex::Nothing,
            weight: black,
            own: black,
            shared: black,
            onward: black,
        }
    };

    /// Divides radiance between the path and the group, whose fraction is `lent`.
    fn take(&mut self, radiance: Color<f32>, shared: Color<f32>) {
        self.shared = self.shared + radiance * shared;
        self.own = self.own + radiance * shared.complement();
    }
}

impl Sink for PathSlots {
    fn deposit(&mut self, pixel: u32, sample: u32, radiance: Rgb) {
        let index = self.index((pixel, sample));
        let slot = &mut self.slots[index];
        let light = Color::splat(radiance);
        let Some(found) = self.found.get_mut(index) else { return slot.take(light, slot.onward) };
        if light.r.is_finite() && light.g.is_finite() && light.b.is_finite() {
            let counted = self.unit.counted(radiance);
            *found = [0, 1, 2].map(|channel| found[channel].saturating_add(counted[channel]));
        } else {
            // The film counts values that are not finite.
            slot.own = slot.own + light;
        }
    }

    fn deposit_to_groups(&mut self, lights: &[GroupLight]) {
        for light in lights {
            let counted = self.unit.counted(light.light);
            let (group, _) = self.of_group(light);
            // In quanta, because a path's light may be found in any order.
            group.found = [0, 1, 2].map(|channel| group.found[channel].saturating_add(counted[channel]));
        }
    }
}

/// The block and the sample of a unit.
pub(super) fn unit_at(blocks: &Region, samples: &Range<u32>, unit: usize) -> ([u32; 2], u32) {
    let (block, sample) = ((unit / samples.len()) as u32, (unit % samples.len()) as u32);
    ([blocks.x0 + block % blocks.width(), blocks.y0 + block / blocks.width()], samples.start + sample)
}

/// The path of a slot, in one lane.
pub(super) fn path_of(setup: &RenderSetup, slot: &PathSlot) -> Path<f32> {
    generate(setup, Wrapping(slot.pixel), Wrapping(slot.sample))
}
