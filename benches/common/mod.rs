//! Scenes and rays for benchmarks, all generated here: no benchmark reads a file.

// Each benchmark is a crate of its own and uses only a part of this module.
#![allow(dead_code)]

use std::f64::consts::TAU;

use criterion::Criterion;
use rand::RngExt;
use rayfront::compile::compile;
use rayfront::internals::bvh::{self, Coherence, SPHERE, Stack};
use rayfront::internals::film::{Film, Region};
use rayfront::internals::integrator::{RayStatistics, RenderSetup, Schedule, Sorting, Work, Worker};
use rayfront::internals::render::Prepared;
use rayfront::internals::sampling::Stream;
use rayfront::internals::scene::CompiledScene;
use rayfront::internals::simd::Isa;
use rayfront::math::{DVec3, NONE, Quat, Rgb, Vec2, Vec3};
use rayfront::query::{HitBatch, RayBatch};
use rayfront::world::{
    BlinnPhong, Camera, ColorInput, Falloff, Image, Light, Material, MaterialId, Mesh, Pattern, Shape,
    Texels, Texture, Transform, World,
};

/// Few and short samples: all benchmarks together take a few minutes.
pub fn criterion() -> Criterion {
    use std::time::Duration;
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .without_plots()
}

/// A unit sphere with bumps, of about `triangles` triangles, with normals and texture coordinates.
pub fn bumpy_sphere(triangles: usize) -> Mesh {
    let rows = ((triangles as f64 / 4.0).sqrt().round() as u32).max(3);
    let columns = 2 * rows;
    let mut mesh = Mesh { name: "bumpy sphere".into(), ..Mesh::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
            let (phi, theta) = (u * TAU, v * TAU / 2.0);
            let radius = 1.0 + 0.04 * libm::sin(24.0 * phi) * libm::sin(24.0 * theta);
            let ring = libm::sin(theta);
            let outward = [libm::cos(phi) * ring, libm::cos(theta), -libm::sin(phi) * ring];
            mesh.positions.push(Vec3::from_array(outward.map(|c| (c * radius) as f32)));
            mesh.normals.push(Vec3::from_array(outward.map(|c| c as f32)));
            mesh.uvs.push(Vec2::new(u as f32, v as f32));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let corner = row * (columns + 1) + column;
            let below = corner + columns + 1;
            mesh.triangles.push([corner, below, below + 1]);
            mesh.triangles.push([corner, below + 1, corner + 1]);
        }
    }
    mesh
}

/// A ball with nine smaller ones on it, each with nine, and so on, `depth` times: centres and radii.
pub fn sphereflake(depth: u32) -> Vec<(Vec3, f32)> {
    let mut balls = vec![(Vec3::ZERO, 0.5)];
    let mut shell = vec![(Vec3::ZERO, 0.5, Vec3::Y)];
    for _ in 0..depth {
        let mut next = Vec::new();
        for (center, radius, axis) in shell {
            let side = axis.any_orthonormal_vector();
            let other = axis.cross(side);
            for k in 0..9 {
                // Six around the equator, three above.
                let (turn, lift) = if k < 6 { (k as f32 / 6.0, 0.0) } else { (k as f32 / 3.0, 0.75) };
                let flat = (1.0f32 - lift * lift).sqrt();
                let angle = turn * std::f32::consts::TAU;
                let out = side * (angle.cos() * flat) + other * (angle.sin() * flat) + axis * lift;
                next.push((center + out * (radius * 4.0 / 3.0), radius / 3.0, out.normalize()));
            }
        }
        balls.extend(next.iter().map(|(center, radius, _)| (*center, *radius)));
        shell = next;
    }
    balls
}

/// A world under construction.
#[derive(Default)]
pub struct Stage(pub World);

impl Stage {
    /// A world whose image has `size` pixels, with `samples` samples each.
    pub fn new(size: [u32; 2], samples: u32) -> Self {
        let mut world = World::default();
        world.settings.size = size;
        world.settings.samples = samples;
        Self(world)
    }

    /// Adds a material.
    pub fn material(&mut self, material: BlinnPhong) -> MaterialId {
        self.0.assets.add_material(None, Material::BlinnPhong(material))
    }

    /// Adds a shape.
    pub fn shape(&mut self, shape: Shape, transform: Transform, material: MaterialId) {
        self.0.entities.spawn((shape, transform, material));
    }

    /// Adds a mesh.
    pub fn mesh(&mut self, mesh: Mesh, material: MaterialId) {
        let id = self.0.assets.add_mesh(mesh);
        self.shape(Shape::Mesh(id), Transform::IDENTITY, material);
    }

    /// Adds a square floor of 20 m at a height.
    pub fn ground(&mut self, height: f64, material: MaterialId) {
        let corner = |x: f64, z: f64| DVec3::new(10.0 * x, height, 10.0 * z);
        let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
        self.shape(Shape::Plane { corners }, Transform::IDENTITY, material);
    }

    /// Adds a light.
    pub fn light(&mut self, light: Light, transform: Transform) {
        self.0.entities.spawn((light, transform));
    }

    /// Adds a point light.
    pub fn point_light(&mut self, watts: f32, place: Vec3) {
        let light =
            Light::Point { power_w: Rgb::splat(watts), falloff: Falloff::InverseSquare, radius_m: 0.0 };
        self.light(light, look(place, Vec3::ZERO));
    }

    /// Adds a pinhole camera that looks at the origin.
    pub fn camera(&mut self, from: Vec3) {
        self.0.entities.spawn((Camera::Pinhole { vertical_fov: 0.7 }, look(from, Vec3::ZERO)));
    }

    /// Adds a checkerboard of 64 × 64 fields of 8 × 8 texels, repeated `repeats` times.
    pub fn checkers(&mut self, repeats: f32) -> ColorInput {
        let side = 512;
        let texel = |i: u32| {
            let odd = (i % side / 8 + i / side / 8) % 2 == 1;
            if odd { [230, 230, 220, 255] } else { [60, 90, 120, 255] }
        };
        let texels = Texels::Rgba8((0..side * side).map(texel).collect());
        let image = self.0.assets.add_image(Image { source: None, width: side, height: side, texels });
        let texture = Texture { scale: Vec2::splat(repeats), ..Texture::new(image) };
        ColorInput::Texture(self.0.assets.add_texture(texture))
    }

    /// Compiles the scene.
    pub fn compile(&self) -> CompiledScene {
        compile(&self.0, None).expect("a benchmark's scene is sound")
    }

    /// Compiles the scene to a render setup, with its settings.
    pub fn setup(&self) -> RenderSetup {
        rayfront::internals::render::setup(self.compile(), &self.0.settings)
    }
}

/// A transform at `from` whose −Z looks towards `to`.
pub fn look(from: Vec3, to: Vec3) -> Transform {
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, (to - from).normalize());
    // Without a roll about the line of sight.
    let right = rotation * Vec3::X;
    let level = (to - from).cross(Vec3::Y).normalize_or(right);
    let rotation = Quat::from_rotation_arc(right, level) * rotation;
    Transform::Trs { translation: from.as_dvec3(), rotation, scale: Vec3::ONE }
}

/// A material with a diffuse colour.
pub fn matte(diffuse: ColorInput) -> BlinnPhong {
    BlinnPhong { diffuse, ..BlinnPhong::default() }
}

/// A grey for all of a colour's components.
pub fn grey(value: f32) -> ColorInput {
    ColorInput::Constant(Rgb::splat(value))
}

/// A glass material.
pub fn glass() -> BlinnPhong {
    BlinnPhong {
        diffuse: grey(0.0),
        specular: grey(0.3),
        shininess: 200.0,
        kr: grey(1.0),
        ior: Some(1.5),
        ..BlinnPhong::default()
    }
}

/// A visible square light with sides of 1 m.
pub fn area_light(watts: f32, samples: u32) -> Light {
    Light::Area {
        power_w: Rgb::splat(watts),
        radiance: Rgb::BLACK,
        size_m: Vec2::ONE,
        outline: Default::default(),
        samples,
        pattern: Pattern::Jittered,
        visible: true,
    }
}

/// Renders the whole image on this thread; returns it and the number of rays.
pub fn render(setup: &RenderSetup, worker: &mut Worker, isa: Isa, samples: u32) -> (Film, u64) {
    let mut statistics = RayStatistics::default();
    let prepared = Prepared::now(setup);
    // Without photons: their cost is measured with whole images.
    let work = Work { setup, pilot: prepared.pilot.as_ref(), photons: None, isa };
    let film = worker.render(work, Region::whole(setup.size), 0..samples, &mut statistics);
    (film, statistics.rays.total())
}

/// A worker with waves of the default size.
pub fn worker(setup: &RenderSetup, schedule: Schedule) -> Worker {
    Worker::new(setup, schedule, rayfront::render::DEFAULT_WAVE, Sorting::default())
}

/// Rays of four classes through one scene, from coherent to scattered.
pub struct RayClasses {
    /// Camera rays from a pinhole, row by row.
    pub primary: RayBatch,
    /// From primary hits to one light.
    pub shadow: RayBatch,
    /// From primary hits into the hemisphere, up to 0.5 m.
    pub ambient_occlusion: RayBatch,
    /// From primary hits into the hemisphere, cosine-weighted, without end.
    pub bounce: RayBatch,
}

impl RayClasses {
    /// Rays of an image of `side` × `side` pixels; each secondary class has one ray for each hit.
    pub fn new(scene: &CompiledScene, side: u32, lamp: Vec3) -> Self {
        let mut classes = Self {
            primary: primary(scene, side),
            shadow: RayBatch::default(),
            ambient_occlusion: RayBatch::default(),
            bounce: RayBatch::default(),
        };
        let rays = classes.primary.rays();
        let mut hits = HitBatch::new(rays.len());
        bvh::closest(
            Isa::detect(),
            &scene.bvh,
            rays,
            Coherence::Unknown,
            &mut Stack::new(&scene.bvh),
            hits.hits_mut(),
        );
        let mut random = Stream::new(7);
        for i in 0..rays.len() {
            if hits.primitive()[i] == NONE {
                continue;
            }
            let origin = Vec3::from_array(rays.origin.map(|c| c[i]));
            let direction = Vec3::from_array(rays.direction.map(|c| c[i]));
            let position = origin + direction * hits.t()[i];
            let normal = facing(normal_at(scene, hits.primitive()[i], position), -direction);
            let start = position + normal * 1e-4;
            let to_lamp = lamp - start;
            classes.shadow.push(start, to_lamp.normalize(), 0.0, to_lamp.length() * 0.999);
            classes.ambient_occlusion.push(start, about(normal, &mut random), 0.0, 0.5);
            classes.bounce.push(start, about(normal, &mut random), 0.0, f32::INFINITY);
        }
        classes
    }
}

fn primary(scene: &CompiledScene, side: u32) -> RayBatch {
    let camera = &scene.camera;
    let rayfront::internals::scene::Projection::Pinhole(view) = camera.projection else {
        panic!("benchmarks look through a pinhole");
    };
    let [tan_half_fov, _] = view.scale(1.0);
    let place = |i: u32| ((i as f32 + 0.5) / side as f32 * 2.0 - 1.0) * tan_half_fov;
    let mut rays = RayBatch::default();
    for row in 0..side {
        for column in 0..side {
            let direction = camera.forward + camera.right * place(column) - camera.up * place(row);
            rays.push(camera.origin, direction.normalize(), 0.0, f32::INFINITY);
        }
    }
    rays
}

fn normal_at(scene: &CompiledScene, primitive: u32, position: Vec3) -> Vec3 {
    let geometry = &scene.geometry;
    if primitive & SPHERE != 0 {
        let [x, y, z, _] = geometry.spheres[(primitive & !SPHERE) as usize];
        return (position - Vec3::new(x, y, z)).normalize();
    }
    let corners = geometry.triangles[primitive as usize];
    let [a, b, c] = corners.map(|v| Vec3::from_array(geometry.positions[v as usize]));
    (b - a).cross(c - a).normalize_or(Vec3::Y)
}

fn facing(normal: Vec3, viewer: Vec3) -> Vec3 {
    if normal.dot(viewer) < 0.0 { -normal } else { normal }
}

/// A cosine-weighted direction about a normal: the normal and a point on the unit sphere.
fn about(normal: Vec3, random: &mut Stream) -> Vec3 {
    let height: f32 = random.random_range(-1.0..1.0);
    let angle: f32 = random.random_range(0.0..std::f32::consts::TAU);
    let flat = (1.0 - height * height).sqrt();
    let sphere = Vec3::new(flat * angle.cos(), height, flat * angle.sin());
    (normal + sphere * 0.999).normalize()
}
