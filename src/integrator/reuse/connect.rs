//! Connections from the first vertices of a group to its second vertices: rays, weights and sums.

use std::marker::PhantomData;
use std::num::Wrapping;

use smallvec::SmallVec;

use super::partition::Partition;
use super::path_slots::{PathSlots, Received, SecondVertex, path_of, unit_at};
use super::receive::{GatheredGroup, Lender, PADDING, Pairs, Receive, count_senders};
use crate::bvh::{AnyHitFilter, Crossing, HitPredicate, Rays};
use crate::film::Film;
use crate::integrator::RenderSetup;
use crate::integrator::observe::Observer;
use crate::integrator::path::Path;
use crate::integrator::path::any_hit::PathRay;
use crate::integrator::path::camera_path::generate;
use crate::integrator::path::columns::Columns;
use crate::integrator::setup::reuse_groups::run_of;
use crate::integrator::transport::path_tracing::bsdf;
use crate::integrator::transport::reusable::{Connection, splat};
use crate::math::{Color, Ray, Vector};
use crate::sampling::hash::{combine, mix, to_unit};
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::parameters::Outside;
use crate::shading::surface::offset_origin;
use crate::shading::{ShadingPoint, Surface};
use crate::simd::{Float, Int, Isa, Kernel, Lanes, Mask, Outlined, dispatch};

/// The number of rays that are traced together, if enough are left.
const RAYS: usize = 1 << 13;
/// A function that finds for each ray whether it is blocked. The second argument holds the ends of the ray bundles,
/// each of which leads to one second vertex.
pub type Any<'a> = dyn FnMut(Rays, &[u32], &mut [u32], &mut dyn Observer) + 'a;

/// Buffers for the connections of a wave's groups, which are processed about 8,192 rays at a time.
pub struct Connections {
    rays: RayQueue,
    /// The end of the ray bundle of each second vertex, in the queue.
    fans: Vec<u32>,
    blocked: Vec<u32>,
    t_min: Vec<f32>,
    groups: Vec<GatheredGroup>,
    /// Slots whose first vertices take.
    members: Vec<u32>,
    lenders: Vec<Lender>,
    pairs: Pairs,
    /// Indexed by slot.
    received: Vec<Received>,
    /// The radiance by light group.
    by_group: Vec<Vec<Color<f32>>>,
    /// True if the second vertices that give light are counted.
    counts: bool,
    /// The number of rays so far.
    pub traced: u64,
}

/// A queue of rays: origin, direction, end; index of the pair, slot of the origin.
struct RayQueue(Columns<7, 2>);

impl RayQueue {
    #[inline(always)]
    fn append<F: Float>(&mut self, ray: &Ray<F>, pair: F::Int, slot: F::Int, mask: F::Mask) {
        let (o, d) = (ray.origin, ray.direction);
        self.0.append::<F>(mask, [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_max], [pair, slot]);
    }
}

/// The any-hit filter of the rays of connections.
struct ConnectionAnyHit<'a> {
    setup: &'a RenderSetup,
    slots: &'a PathSlots,
    queue: &'a RayQueue,
}

impl HitPredicate for ConnectionAnyHit<'_> {
    /// A ray to another path's second vertex hits what the first vertex's own ray would have hit there: it draws the
    /// same random numbers, so that all densities are those of one scene.
    fn accepts(&self, ray: usize, crossing: &Crossing) -> bool {
        let Self { setup, slots, queue } = *self;
        let path = || {
            let vector = |column: usize| {
                let [x, y, z] = [0, 1, 2].map(|axis| queue.0.floats(column + axis)[ray]);
                Vector::new(x, y, z)
            };
            let (origin, direction) = (vector(0), vector(3));
            let slot = &slots.slots[queue.0.integers(1)[ray] as usize];
            Path { origin, direction, depth: std::num::Wrapping(1), ..path_of(setup, slot) }
        };
        PathRay { setup, path: &path, shadow: None }.meets(crossing)
    }
}

impl Default for Connections {
    fn default() -> Self {
        // A group adds at most 64 × 64 pairs to a queue that is not yet full.
        let capacity = RAYS + 4096;
        Self {
            rays: RayQueue(Columns::new(capacity)),
            fans: Vec::new(),
            blocked: vec![0; capacity],
            t_min: vec![0.0; capacity],
            groups: Vec::new(),
            members: Vec::new(),
            lenders: Vec::new(),
            pairs: Pairs::default(),
            received: Vec::new(),
            by_group: Vec::new(),
            counts: false,
            traced: 0,
        }
    }
}

impl Connections {
    /// Bytes of all buffers.
    pub fn bytes(&self) -> usize {
        self.rays.0.bytes()
            + size_of_val(&self.blocked[..])
            + size_of_val(&self.t_min[..])
            + self.pairs.density.capacity() * 4 * size_of::<f32>()
            + self.received.capacity() * size_of::<Received>()
            + self.by_group.len() * self.received.capacity() * size_of::<Color<f32>>()
    }

    /// Connects the groups of all units and adds what their paths have found to the film. `any` finds the blocked rays.
    pub fn finish(
        &mut self,
        setup: &RenderSetup,
        isa: Isa,
        slots: &PathSlots,
        film: &mut Film,
        observer: &mut dyn Observer,
        any: &mut Any,
    ) {
        let Some(grouping) = &setup.sharing else { return };
        let pixels = slots.pixels();
        self.received.clear();
        let nothing = Received { radiance: Color::black(), vertices: 0 };
        self.received.resize(slots.units.len() * pixels, nothing);
        self.by_group.resize_with(setup.groups().count(), Vec::new);
        for received in &mut self.by_group {
            received.clear();
            received.resize(self.received.len(), Color::black());
        }
        self.counts = observer.is_active();
        for (index, unit) in slots.units.clone().enumerate() {
            let (block, sample) = unit_at(&slots.blocks, &slots.samples, unit);
            let log2 = u32::from(slots.sizes[unit / slots.samples.len()]);
            if log2 == 0 {
                continue;
            }
            let run = run_of(Wrapping(sample)).0;
            for group in Partition::new(grouping, log2, setup.seed, block, run).groups() {
                let Some(group) = self.gather(setup.seed, slots, index * pixels, group) else { continue };
                let Self { members, lenders, pairs, rays, fans, .. } = self;
                dispatch(isa, Connect { setup, slots, members, lenders, group: &group, pairs, rays, fans });
                self.groups.push(group);
                if self.rays.0.len() >= RAYS {
                    self.trace(setup, isa, slots, observer, any);
                }
            }
        }
        self.trace(setup, isa, slots, observer, any);
        slots.finish(&self.received, film, observer);
        slots.finish_groups(&self.by_group, film);
    }

    /// Gathers the members and lenders of a group; none if there are no lenders.
    fn gather(&mut self, seed: u64, slots: &PathSlots, first: usize, group: &[u16]) -> Option<GatheredGroup> {
        let (from_member, from_lender) = (self.members.len(), self.lenders.len());
        let slot = |place: &u16| first + usize::from(*place);
        self.members.extend(group.iter().map(slot).filter(|at| slots.slots[*at].takes).map(|at| at as u32));
        // Lanes that are evaluated together have the same material.
        self.members[from_member..].sort_by_key(|at| slots.slots[*at as usize].material);
        for (place, at) in self.members[from_member..].iter().enumerate() {
            let slot = &slots.slots[*at as usize];
            if matches!(slot.offer, SecondVertex::Far(_) | SecondVertex::Near(_))
                && slot.shared.max_component() > 0.0
            {
                self.lenders.push(Lender { slot: *at, place: place as u32, factor: 1.0 });
            }
        }
        draw_lenders(seed, slots, &mut self.lenders, from_lender);
        let lenders = from_lender..self.lenders.len();
        if lenders.is_empty() {
            self.members.truncate(from_member);
            return None;
        }
        let pairs = self.pairs.density.len();
        let group = GatheredGroup { members: from_member..self.members.len(), lenders, pairs };
        let end = pairs + group.row() * group.lenders.len();
        self.pairs.density.resize(end, 0.0);
        self.pairs.value.iter_mut().for_each(|column| column.resize(end, 0.0));
        Some(group)
    }

    /// Traces the queued rays and adds what arrives.
    fn trace(
        &mut self,
        setup: &RenderSetup,
        isa: Isa,
        slots: &PathSlots,
        observer: &mut dyn Observer,
        any: &mut Any,
    ) {
        let count = self.rays.0.len();
        let surfaces = ConnectionAnyHit { setup, slots, queue: &self.rays };
        let rays = Rays {
            origin: [0, 1, 2].map(|i| self.rays.0.floats(i)),
            direction: [3, 4, 5].map(|i| self.rays.0.floats(i)),
            t_min: &self.t_min[..count],
            t_max: self.rays.0.floats(6),
            filter: AnyHitFilter::new(&surfaces, 0),
        };
        any(rays, &self.fans, &mut self.blocked[..count], observer);
        self.traced += count as u64;
        for (pair, blocked) in self.rays.0.integers(0).iter().zip(&self.blocked) {
            if *blocked != 0 {
                self.pairs.density[*pair as usize] = 0.0;
            }
        }
        for group in &self.groups {
            let Self { members, lenders, pairs, received, by_group, .. } = self;
            dispatch(isa, Receive { group, members, lenders, pairs, slots, received, by_group });
            if self.counts {
                count_senders(group, &self.members, &self.pairs, &mut self.received);
            }
        }
        self.rays.0.clear();
        self.fans.clear();
        self.groups.clear();
        self.members.clear();
        self.lenders.clear();
        self.pairs.density.clear();
        self.pairs.value.iter_mut().for_each(Vec::clear);
    }
}

/// Draws the lenders of a group, the last ones of `lenders`: one that gives less light than the mean remains with a
/// probability that is proportional to its light, and then gives as much as the mean (Russian roulette). Faint ones take
/// as long to connect as bright ones. The draws are systematic: their number is as even as possible.
fn draw_lenders(seed: u64, slots: &PathSlots, lenders: &mut Vec<Lender>, from: usize) {
    let light = |lender: &Lender| slots.slots[lender.slot as usize].shared.max_component();
    let [first, ..] = &lenders[from..] else { return };
    let slot = &slots.slots[first.slot as usize];
    let words = [seed as u32, (seed >> 32) as u32, slot.pixel, slot.sample];
    let bits = words.into_iter().fold(Wrapping(0x6c65_6e64), |hash, word| combine(hash, Wrapping(word)));
    let mut sum = to_unit::<f32>(mix(bits));
    let mean = lenders[from..].iter().map(light).sum::<f32>() / (lenders.len() - from) as f32;
    let mut end = from;
    for at in from..lenders.len() {
        let lender = lenders[at];
        let probability = (light(&lender) / mean).min(1.0);
        sum += probability;
        if sum >= 1.0 {
            sum -= 1.0;
            lenders[end] = Lender { factor: 1.0 / probability, ..lender };
            end += 1;
        }
    }
    lenders.truncate(end);
}

/// Computes the pairs of a group's lenders and members, and the rays between them.
struct Connect<'a> {
    setup: &'a RenderSetup,
    slots: &'a PathSlots,
    members: &'a [u32],
    lenders: &'a [Lender],
    group: &'a GatheredGroup,
    pairs: &'a mut Pairs,
    rays: &'a mut RayQueue,
    fans: &'a mut Vec<u32>,
}

impl Kernel for Connect<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let members = &self.members[self.group.members.clone()];
        let material = |place: usize| self.slots.slots[members[place] as usize].material;
        let mut receivers = SmallVec::<[Receivers<L::Queue>; 4]>::new();
        let mut first = 0;
        while first < members.len() {
            let mut end = first + 1;
            while end < members.len() && end - first < L::Queue::WIDTH && material(end) == material(first) {
                end += 1;
            }
            let look_up =
                ReceiverLookUp { connect: &self, first, end, material: material(first), lanes: PhantomData };
            receivers.push(<L::Queue as Float>::outlined(look_up));
            first = end;
        }
        // All rays to one second vertex follow each other: a bundle.
        for (row, lender) in self.lenders[self.group.lenders.clone()].iter().enumerate() {
            for some in &receivers {
                self.connect(row, lender, some);
            }
            self.fans.push(self.rays.0.len() as u32);
        }
    }
}

/// Rays to second vertices end at this fraction of the distance, so that the vertices' own surfaces do not block them:
/// the kernels guarantee hit distances to half of the remainder.
const CONNECTION_END: f32 = 1.0 - 1.0 / 8192.0;

/// First vertices of one material, evaluated.
struct Receivers<F: Float> {
    /// The place of the first one among the group's members.
    first: usize,
    /// Their slots.
    places: F::Int,
    mask: F::Mask,
    /// The origins of rays.
    origin: Vector<F>,
    bsdf: Bsdf<F>,
}

/// Evaluates first vertices of one material.
struct ReceiverLookUp<'c, 'a, F> {
    connect: &'c Connect<'a>,
    first: usize,
    end: usize,
    material: u32,
    lanes: PhantomData<F>,
}

impl<F: Float> Outlined for ReceiverLookUp<'_, '_, F> {
    type Output = Receivers<F>;
    #[inline(always)]
    fn run(self) -> Receivers<F> {
        let Self { connect, first, end, material, .. } = self;
        let Connect { setup, slots, group, members, .. } = *connect;
        let members = &members[group.members.clone()][first..end];
        let (mut at, mut pixel, mut sample) = ([0; PADDING], [0; PADDING], [0; PADDING]);
        for (lane, member) in members.iter().enumerate() {
            let slot = &slots.slots[*member as usize];
            (at[lane], pixel[lane], sample[lane]) = (*member, slot.pixel, slot.sample);
        }
        let mask = F::Mask::first(members.len());
        let places = F::Int::load(&at);
        let hit = slots.hits::<F>(places, mask);
        let path = generate::<F>(setup, F::Int::load(&pixel), F::Int::load(&sample));
        let surface = Surface::new(&setup.scene.geometry, &path.ray(), &hit, mask);
        let width = path.width + path.spread * hit.t;
        let point = ShadingPoint::new(&setup.scene, material, &hit, &surface, path.direction, width, mask);
        let bsdf = bsdf(point.has(), setup, &path, &point, &Outside::air(), path.path_key(setup.seed), mask);
        let normal = surface.geometric_normal;
        // No light is transmitted: all rays leave on the viewer's side.
        let origin = offset_origin(surface.position, normal, surface.offset, normal);
        Receivers { first, places, mask, origin, bsdf }
    }
}

impl Connect<'_> {
    /// Computes part of the row of pairs of one lender.
    #[inline(always)]
    fn connect<F: Float>(&mut self, row: usize, lender: &Lender, some: &Receivers<F>) {
        let Self { slots, group, .. } = *self;
        let Receivers { first, places, mask, origin, bsdf } = some;
        let (sight, t_max) = match &slots.slots[lender.slot as usize].offer {
            SecondVertex::Far(direction) => (far::<F>(splat(*direction), *mask), F::splat(f32::INFINITY)),
            SecondVertex::Near(shared) => {
                let sight = shared.seen_from(*origin, *mask);
                let t_max = sight.distance * F::splat(CONNECTION_END);
                (sight, t_max)
            }
            _ => return,
        };
        let (value, pdf) = bsdf.evaluate(sight.direction, sight.visible);
        let density = pdf * sight.geometry;
        let found = sight.visible & density.gt(F::zero());
        let value = value * sight.part * sight.geometry;
        let start = group.pairs + row * group.row() + first;
        F::select(found, density, F::zero()).store(&mut self.pairs.density[start..]);
        for (column, value) in self.pairs.value.iter_mut().zip([value.r, value.g, value.b]) {
            value.store(&mut column[start..]);
        }
        let number = F::Int::load(&LANES);
        let itself = number.eq(F::Int::splat(lender.place.wrapping_sub(*first as u32)));
        let ray = Ray { origin: *origin, direction: sight.direction, t_min: F::zero(), t_max };
        let pair = number + F::Int::splat(start as u32);
        self.rays.append(&ray, pair, *places, found & !itself);
    }
}

const LANES: [u32; PADDING] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// The connection to what is infinitely far away and looks the same from everywhere.
#[inline(always)]
fn far<F: Float>(direction: Vector<F>, visible: F::Mask) -> Connection<F> {
    let one = F::one();
    Connection { direction, distance: one, part: Color::new(one, one, one), geometry: one, visible }
}
