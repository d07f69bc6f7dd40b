//! The life of a pixel's samples: every vertex of every path, told by the recursive schedule.

use std::collections::HashMap;
use std::sync::Arc;

use crate::film::{Film, Region};
use crate::integrator::observe::{Event, Place, Triple, Way, What};
use crate::integrator::{Frame, Schedule};
use crate::math::{Hit, NONE};
use crate::render::{Options, Session};
use crate::world::{Transport, World};

/// A sample from the camera to the ends of all its paths.
#[derive(Clone, Debug)]
pub struct Life {
    /// Which.
    pub sample: u32,
    /// Its paths: first the camera's, each fork behind the path that it comes from.
    pub paths: Vec<Followed>,
}

impl Life {
    /// What it adds to the film.
    pub fn radiance(&self) -> Triple {
        let mut sum = [0.0; 3];
        for path in &self.paths {
            (0..3).for_each(|channel| sum[channel] += path.radiance[channel]);
        }
        sum
    }
}

/// A path to its end.
#[derive(Clone, Debug)]
pub struct Followed {
    /// 0 for the camera's path, a hash for those that were forked off.
    pub branch: u32,
    /// The path and the bounce that it was forked off at.
    pub from: Option<(usize, u32)>,
    /// Its rays and what they met.
    pub steps: Vec<Step>,
    /// What it adds to the film.
    pub radiance: Triple,
    /// Why it went no further.
    pub why: Why,
}

/// A ray and what it met.
#[derive(Clone, Debug)]
pub struct Step {
    /// Bounces so far.
    pub depth: u32,
    /// In which queue the ray waited: of the camera's, reflected or refracted ones.
    pub queue: &'static str,
    /// Where from.
    pub origin: Triple,
    /// Where to.
    pub direction: Triple,
    /// The part of what it finds that reaches the film.
    pub throughput: Triple,
    /// What it met, if anything.
    pub vertex: Option<Vertex>,
}

/// A place on a surface.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// Name of the entity.
    pub entity: String,
    /// Name of the material.
    pub material: String,
    /// Where on it.
    pub hit: Hit,
    /// In world space.
    pub position: Triple,
    /// Of the surface itself, on the viewer's side.
    pub geometric_normal: Triple,
    /// For shading.
    pub normal: Triple,
    /// What the surface gives off by itself, as it reaches the film.
    pub own: Triple,
    /// Rays to lights.
    pub lights: Vec<Lit>,
}

/// A ray to a light.
#[derive(Clone, Debug)]
pub struct Lit {
    /// Name of the light's entity.
    pub light: String,
    /// Which of its samples.
    pub which: u32,
    /// Where to.
    pub direction: Triple,
    /// How far.
    pub distance: f32,
    /// What reaches the film if nothing is between.
    pub contribution: Triple,
    /// Whether something is.
    pub blocked: bool,
}

/// Why a path went no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// It met nothing.
    Escaped,
    /// The surface neither mirrors nor lets light through.
    Surface,
    /// It had all the bounces that it may have.
    Bounces,
    /// Too little would have been left of it.
    Weak,
}

impl Why {
    /// For people.
    pub fn text(self) -> &'static str {
        match self {
            Why::Escaped => "it met nothing and sees the background",
            Why::Surface => "the surface neither mirrors nor lets light through",
            Why::Bounces => "it has had max_depth bounces",
            Why::Weak => "less than min_throughput would be left of it",
        }
    }
}

/// What names people gave.
pub struct Names {
    entities: HashMap<u32, String>,
    lights: Vec<String>,
}

impl Names {
    /// Those of a world.
    pub fn new(world: &World) -> Names {
        Names { entities: world.names(), lights: crate::compile::light_names(world) }
    }

    fn entity(&self, number: u32) -> String {
        self.entities.get(&number).cloned().unwrap_or_else(|| format!("entity {number}"))
    }

    fn light(&self, index: u32) -> String {
        let name = self.lights.get(index as usize).cloned();
        name.unwrap_or_else(|| {
            if index == crate::math::NONE { "a light".into() } else { format!("light {index}") }
        })
    }
}

/// Follows samples of a pixel. Returns them and the pixel's film.
pub fn explain(
    frame: Arc<Frame>,
    names: &Names,
    [x, y]: [u32; 2],
    samples: std::ops::Range<u32>,
) -> (Vec<Life>, Film) {
    let region = Region { x0: x, y0: y, x1: x + 1, y1: y + 1 };
    let options = Options { schedule: Schedule::Recursive, region: Some(region), ..Options::default() };
    let session = Session::of(frame.clone(), samples.end, options).with_samples(samples);
    let mut story = Story { frame: &frame, names, lives: Vec::new(), begun: HashMap::new() };
    let film = session.observe(Some([x, y]), &mut |event| {
        if let Event::Sample(place, what) = event {
            story.tell(*place, what);
        }
    });
    (story.lives, film)
}

/// Events to lives.
struct Story<'a> {
    frame: &'a Frame,
    names: &'a Names,
    lives: Vec<Life>,
    /// For each path that goes on from a vertex how, and where from.
    begun: HashMap<Place, (Way, usize)>,
}

impl Story<'_> {
    fn tell(&mut self, place: Place, what: &What) {
        match what {
            What::Ray { origin, direction, throughput, hit } => {
                self.begin(place);
                let queue = match self.begun.get(&place) {
                    None => "camera",
                    Some((Way::Reflect, _)) => "reflect",
                    Some((Way::Refract, _)) => "refract",
                    Some((Way::Scatter, _)) => "scatter",
                };
                let (origin, direction, throughput) = (*origin, *direction, *throughput);
                let vertex = (!hit.is_miss()).then(|| self.vertex(*hit));
                let step = Step { depth: place.depth, queue, origin, direction, throughput, vertex };
                self.path().into_iter().for_each(|path| path.steps.push(step.clone()));
            }
            What::Vertex { position, geometric_normal, normal, radiance } => {
                let before = self.path().map_or([0.0; 3], |path| path.radiance);
                if let Some(path) = self.path() {
                    path.radiance = *radiance;
                }
                if let Some(vertex) = self.last_vertex() {
                    vertex.position = *position;
                    vertex.geometric_normal = *geometric_normal;
                    vertex.normal = *normal;
                    vertex.own = [0, 1, 2].map(|channel| radiance[channel] - before[channel]);
                }
            }
            What::Light { light, which, direction, distance, contribution, .. } => {
                let light = self.names.light(*light);
                let (which, direction, distance) = (*which, *direction, *distance);
                let lit =
                    Lit { light, which, direction, distance, contribution: *contribution, blocked: false };
                self.last_vertex().into_iter().for_each(|vertex| vertex.lights.push(lit.clone()));
            }
            What::Shadow { blocked } => {
                let lit = self.last_vertex().and_then(|vertex| vertex.lights.last_mut());
                let Some(lit) = lit else { return };
                lit.blocked = *blocked;
                let contribution = lit.contribution;
                if let Some(path) = self.path().filter(|_| !blocked) {
                    (0..3).for_each(|channel| path.radiance[channel] += contribution[channel]);
                }
            }
            What::Onward { way, .. } => {
                let from = self.lives.last().map_or(0, |life| life.paths.len().saturating_sub(1));
                self.begun.insert(place, (*way, from));
            }
            What::End { radiance } => {
                let why = self.why(place);
                if let Some(path) = self.path() {
                    (path.radiance, path.why) = (*radiance, why);
                }
            }
        }
    }

    /// A new sample or path, if this is not of the one that is followed.
    fn begin(&mut self, place: Place) {
        if self.lives.last().is_none_or(|life| life.sample != place.sample) {
            self.lives.push(Life { sample: place.sample, paths: Vec::new() });
        }
        let from = self.begun.get(&place).map(|(_, from)| (*from, place.depth.saturating_sub(1)));
        let Some(life) = self.lives.last_mut() else { return };
        // The path transport forks nothing.
        let forked = self.frame.transport == Transport::Whitted;
        if life.paths.last().is_none_or(|path| forked && path.branch != place.branch) {
            let (branch, steps) = (place.branch, Vec::new());
            life.paths.push(Followed { branch, from, steps, radiance: [0.0; 3], why: Why::Escaped });
        }
    }

    fn path(&mut self) -> Option<&mut Followed> {
        self.lives.last_mut().and_then(|life| life.paths.last_mut())
    }

    fn last_vertex(&mut self) -> Option<&mut Vertex> {
        self.path()?.steps.last_mut()?.vertex.as_mut()
    }

    /// What is known of a hit before it has been looked up.
    fn vertex(&self, hit: Hit) -> Vertex {
        let scene = &self.frame.scene;
        let material = scene.geometry.material_of(hit.primitive, hit.instance);
        let name = scene.materials.names.get(material as usize);
        Vertex {
            entity: self.names.entity(scene.geometry.entity_of(hit.primitive, hit.instance)),
            material: name.cloned().unwrap_or_else(|| format!("material {material}")),
            hit,
            position: [0.0; 3],
            geometric_normal: [0.0; 3],
            normal: [0.0; 3],
            own: [0.0; 3],
            lights: Vec::new(),
        }
    }

    /// Why the path ends here.
    fn why(&mut self, place: Place) -> Why {
        let Some(hit) = self.last_vertex().map(|vertex| vertex.hit) else { return Why::Escaped };
        let scene = &self.frame.scene;
        let material = scene.geometry.material_of(hit.primitive, hit.instance) as usize;
        let (materials, kr) = (&scene.materials, &scene.materials.kr);
        let mirrors = kr.constant[material] != [0.0; 3] || kr.texture[material] != NONE;
        if !mirrors && materials.ior[material] <= 0.0 {
            Why::Surface
        } else if place.depth >= self.frame.max_depth {
            Why::Bounces
        } else {
            Why::Weak
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::QUANTUM;
    use crate::math::{Quat, Rgb, Vec3};
    use crate::world::{BlinnPhong, Camera, ColorInput, Falloff, Light, Material, Name, Shape, Transform};

    /// A ball of glass before a wall that mirrors a little.
    fn world() -> World {
        let mut world = World::default();
        world.settings.size = [9, 9];
        world.settings.samples = 3;
        world.settings.max_depth = 2;
        let at = |x, y, z| Transform::Trs {
            translation: Vec3::new(x, y, z),
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
        };
        world.entities.spawn((Camera::Pinhole { vertical_fov: 0.5 }, at(0.0, 0.0, 5.0)));
        let glass =
            BlinnPhong { ior: Some(1.5), kr: ColorInput::Constant(Rgb::WHITE), ..BlinnPhong::default() };
        let glass = world.assets.add_material(Some("glass".into()), Material::BlinnPhong(glass));
        world.entities.spawn((
            Name("ball".into()),
            Shape::Sphere { radius_m: 0.3 },
            Transform::IDENTITY,
            glass,
        ));
        let corner = |x: f32, y: f32| Vec3::new(4.0 * x, 4.0 * y, -2.0);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        world.entities.spawn((Name("wall".into()), Shape::Plane { corners }, Transform::IDENTITY));
        let lamp = Light::Point { power_w: Rgb::splat(300.0), falloff: Falloff::InverseSquare };
        world.entities.spawn((Name("lamp".into()), lamp, at(2.0, 3.0, 4.0)));
        world
    }

    fn explained(pixel: [u32; 2]) -> (Vec<Life>, Film) {
        let world = world();
        let scene = crate::compile::compile(&world, None).unwrap();
        let frame = Arc::new(Frame::new(scene, &world.settings));
        explain(frame, &Names::new(&world), pixel, 0..3)
    }

    #[test]
    fn a_wall_is_lit_and_ends_the_path() {
        let (lives, _) = explained([0, 4]);
        assert_eq!(lives.iter().map(|life| life.sample).collect::<Vec<_>>(), [0, 1, 2]);
        for life in &lives {
            let [path] = &life.paths[..] else { panic!("{life:?}") };
            assert_eq!((path.branch, path.from, path.why), (0, None, Why::Surface));
            let [step] = &path.steps[..] else { panic!("{path:?}") };
            let vertex = step.vertex.as_ref().expect("the wall");
            assert_eq!((step.queue, vertex.entity.as_str()), ("camera", "wall"));
            assert_eq!((vertex.lights.len(), vertex.lights[0].light.as_str()), (1, "lamp"));
            assert!((vertex.position[2] + 2.0).abs() < 1e-4 && vertex.normal == [0.0, 0.0, 1.0]);
        }
    }

    #[test]
    fn glass_forks_and_all_paths_add_up_to_the_pixel() {
        let (lives, film) = explained([4, 4]);
        let life = &lives[0];
        assert!(life.paths.len() >= 3, "{life:?}");
        assert_eq!(life.paths[0].steps[0].vertex.as_ref().map(|v| v.material.as_str()), Some("glass"));
        assert!(
            life.paths[1..].iter().all(|path| path.from.is_some_and(|(parent, _)| parent < life.paths.len()))
        );
        assert!(life.paths[1..].iter().all(|path| path.steps[0].queue == "refract"));
        assert!(life.paths.iter().any(|path| path.why == Why::Bounces));
        let sum: f64 = lives.iter().map(|life| f64::from(life.radiance()[1])).sum();
        let pixel = film.pixels()[0];
        let film_sum = (pixel.sum[0][1] + pixel.sum[1][1]) as f64 * QUANTUM;
        assert!((sum - film_sum).abs() < 1e-4 * film_sum, "{sum} {film_sum}");
    }
}
