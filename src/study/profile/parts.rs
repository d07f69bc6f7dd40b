//! The cost of a scene's parts: the rays that end at each entity and material, and the rays to lights from there.

use std::collections::{BTreeMap, HashMap};

use smallvec::SmallVec;

use super::StageTimes;
use crate::bvh::kernels::counters::Visits;
use crate::integrator::Stage;
use crate::integrator::observe::{Components, EventKind, PathKey};
use crate::scene::CompiledScene;

/// The number of an entity and the index of its material; none for rays that hit nothing.
pub type ScenePart = Option<[u32; 2]>;

/// The rays of a part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartCost {
    /// Rays that end there.
    pub rays: u64,
    /// Rays to lights from there.
    pub shadow: u64,
    /// The traversal cost of the rays that end there, each traced by itself.
    pub visits: Visits,
    /// The traversal cost of the rays to lights.
    pub shadow_visits: Visits,
}

impl PartCost {
    fn add(&mut self, other: &PartCost) {
        self.rays += other.rays;
        self.shadow += other.shadow;
        self.visits.add(other.visits);
        self.shadow_visits.add(other.shadow_visits);
    }

    /// The nodes visited and the primitives tested for all of its rays.
    pub fn tests(&self) -> u64 {
        tests(&self.visits) + tests(&self.shadow_visits)
    }
}

/// The nodes visited and the primitives tested.
pub(super) fn tests(visits: &Visits) -> u64 {
    visits.nodes + visits.primitives
}

/// The costs of all parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartCosts(pub BTreeMap<ScenePart, PartCost>);

impl PartCosts {
    /// The costs by entity, the highest first; none is the number of no entity.
    pub fn by_entity(&self) -> Vec<(Option<u32>, PartCost)> {
        self.summed(|part| part.map(|[entity, _]| entity))
    }

    /// The costs by material, the highest first.
    pub fn by_material(&self) -> Vec<(Option<u32>, PartCost)> {
        self.summed(|part| part.map(|[_, material]| material))
    }

    fn summed(&self, key: fn(ScenePart) -> Option<u32>) -> Vec<(Option<u32>, PartCost)> {
        let mut sums: BTreeMap<Option<u32>, PartCost> = BTreeMap::new();
        for (part, cost) in &self.0 {
            sums.entry(key(*part)).or_default().add(cost);
        }
        let mut sums: Vec<_> = sums.into_iter().collect();
        sums.sort_by_key(|(_, cost)| std::cmp::Reverse(cost.tests()));
        sums
    }

    /// The seconds of the wavefront's stages that a part takes, about: those of tracing in proportion to nodes and tests,
    /// all others in proportion to rays.
    pub fn seconds(&self, cost: &PartCost, times: &StageTimes) -> f64 {
        let mut all = PartCost::default();
        self.0.values().for_each(|other| all.add(other));
        let ratio = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
        let share = |stage: Stage| match stage {
            Stage::Intersect => ratio(tests(&cost.visits), tests(&all.visits)),
            Stage::Shadow => ratio(tests(&cost.shadow_visits), tests(&all.shadow_visits)),
            Stage::Light => ratio(cost.shadow, all.shadow),
            _ => ratio(cost.rays, all.rays),
        };
        Stage::ALL.into_iter().map(|stage| times.seconds[stage as usize] * share(stage)).sum()
    }
}

/// Counts the rays of parts from the events of a rendering.
pub struct PartCounter<'a> {
    scene: &'a CompiledScene,
    /// The vertices of the present wave. Paths of several forks may share a key.
    vertices: HashMap<PathKey, SmallVec<[(Components, ScenePart); 1]>>,
    /// True if the wave has been shaded: the next ray belongs to another one.
    is_shaded: bool,
    /// The costs so far.
    pub costs: PartCosts,
}

impl<'a> PartCounter<'a> {
    /// Creates a counter for the rays in a scene.
    pub fn new(scene: &'a CompiledScene) -> Self {
        Self { scene, vertices: HashMap::new(), is_shaded: false, costs: PartCosts::default() }
    }

    /// Takes note that a wave has been shaded.
    pub fn shaded(&mut self) {
        self.is_shaded = true;
    }

    /// Counts the ray of an event, if it reports one, with its cost.
    pub fn take(&mut self, place: PathKey, what: &EventKind, visits: Visits) {
        match what {
            EventKind::Ray { origin, direction, hit, .. } => {
                if std::mem::take(&mut self.is_shaded) {
                    self.vertices.clear();
                }
                let geometry = &self.scene.geometry;
                let (primitive, instance) = (hit.primitive, hit.instance);
                let part = (!hit.is_miss()).then(|| {
                    [geometry.entity_of(primitive, instance), geometry.material_of(primitive, instance)]
                });
                let cost = self.costs.0.entry(part).or_default();
                cost.rays += 1;
                cost.visits.add(visits);
                if part.is_some() {
                    let at = [0, 1, 2].map(|axis| origin[axis] + direction[axis] * hit.t);
                    self.vertices.entry(place).or_default().push((at, part));
                }
            }
            EventKind::Light { origin, .. } => {
                let distance =
                    |at: &Components| -> f32 { at.iter().zip(origin).map(|(a, b)| (a - b) * (a - b)).sum() };
                let vertices = self.vertices.get(&place).into_iter().flatten();
                let nearest = vertices.min_by(|a, b| distance(&a.0).total_cmp(&distance(&b.0)));
                let cost = self.costs.0.entry(nearest.and_then(|(_, part)| *part)).or_default();
                cost.shadow += 1;
                cost.shadow_visits.add(visits);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::integrator::Schedule;
    use crate::math::{DVec3, Quat, Rgb, Vec3};
    use crate::render::Options;
    use crate::study::profile::flow;
    use crate::world::{
        BlinnPhong, Camera, ColorInput, Falloff, Light, Material, Shape, Transform, Transport, World,
    };

    /// A mirror ball on a floor under two lamps.
    fn world(transport: Transport) -> World {
        let mut world = World::default();
        (world.settings.size, world.settings.samples, world.settings.transport) = ([24, 16], 2, transport);
        let at = |x, y, z| Transform::Trs {
            translation: DVec3::new(x, y, z),
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
        };
        world.entities.spawn((Camera::Pinhole { vertical_fov: 0.8 }, at(0.0, 0.5, 5.0)));
        let mirror = BlinnPhong { kr: ColorInput::Constant(Rgb::splat(0.5)), ..BlinnPhong::default() };
        let mirror = world.assets.add_material(None, Material::BlinnPhong(mirror));
        world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, Transform::IDENTITY, mirror));
        let corner = |x: f64, z: f64| DVec3::new(4.0 * x, -1.0, 4.0 * z);
        let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
        world.entities.spawn((Shape::Plane { corners }, Transform::IDENTITY));
        for x in [2.0, -2.0] {
            let lamp =
                Light::Point { power_w: Rgb::splat(300.0), falloff: Falloff::InverseSquare, radius_m: 0.0 };
            world.entities.spawn((lamp, at(x, 3.0, 4.0)));
        }
        world
    }

    #[test]
    fn parts_cost_the_same_in_both_schedules_and_add_up() {
        for transport in [Transport::Whitted, Transport::Path] {
            let world = world(transport);
            let scene = crate::compile::compile(&world, None).expect("a scene");
            let setup = Arc::new(crate::render::setup(scene, &world.settings));
            let of =
                |schedule| flow::of_region(&setup, Options { schedule, wave: 64, ..Options::default() }, 2);
            let [wavefront, recursive] = [Schedule::Wavefront, Schedule::Recursive].map(of);
            assert_eq!(wavefront.parts, recursive.parts, "{transport:?}");
            let mut sum = PartCost::default();
            wavefront.parts.0.values().for_each(|cost| sum.add(cost));
            let all = |what: fn(&flow::Bounce) -> u64| wavefront.bounces.iter().map(what).sum::<u64>();
            assert_eq!((sum.rays, sum.shadow), (all(|b| b.rays()), all(|b| b.shadow)), "{transport:?}");
            assert_eq!(wavefront.parts.by_entity().len(), 3, "ball, floor and nothing");
            assert!(wavefront.parts.0[&None].shadow == 0 && sum.shadow > 100, "{transport:?}");
            // The times of stages are divided among bounces; those of stages without items may be, too.
            let seconds = Stage::ALL.map(|stage| 1.0 + stage as usize as f64);
            let divided = wavefront.seconds_by_bounce(&StageTimes { seconds, are_cpu: true });
            for (stage, flow) in Stage::ALL.into_iter().zip(&wavefront.stages) {
                let sum: f64 = divided.iter().map(|row| row[stage as usize]).sum();
                let is_whole = (sum - seconds[stage as usize]).abs() < 1e-9;
                assert!(is_whole || flow.entering == 0, "{transport:?} {stage:?}: {sum}");
            }
            let (turns, intersect) = (&wavefront.turns, &wavefront.stages[Stage::Intersect as usize]);
            let rays: u64 = turns.iter().map(|turn| u64::from(turn[Stage::Intersect as usize])).sum();
            assert_eq!((rays, turns.len() as u64), (intersect.entering, intersect.calls), "{transport:?}");
        }
    }
}
