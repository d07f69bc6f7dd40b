//! Shared helpers: scenes from text with synthetic files, and their films.

use std::path::Path;
use std::sync::Arc;

use rayfront::compile::compile;
use rayfront::error::{Diagnostic, LoadError};
use rayfront::internals::film::Film;
use rayfront::internals::formats::gltf::GltfModel;
use rayfront::internals::formats::{AssetFiles, ron};
use rayfront::internals::world::DecodedImage;
use rayfront::math::{Quat, Rgb, Vec2, Vec3};
use rayfront::render::{Options, Session};
use rayfront::world::{Assets, Falloff, Image, Light, Mesh, Texels, Transform, World};

/// Synthetic meshes and images, by name.
pub struct MadeUp;

impl AssetFiles for MadeUp {
    fn mesh(&mut self, path: &Path, _: &mut Assets, _: &mut Vec<Diagnostic>) -> Result<Arc<Mesh>, LoadError> {
        match path.file_stem().and_then(|stem| stem.to_str()) {
            Some("tetrahedron") => Ok(tetrahedron().into()),
            Some("cube") => Ok(cube().into()),
            Some("square") => Ok(square().into()),
            Some("inward cube") => Ok(Mesh { triangles: inwards(&cube()), ..cube() }.into()),
            Some("bowl") => Ok(bowl().into()),
            Some("ball") => Ok(icosphere(3, |_| 1.0).into()),
            Some("nicked ball") => {
                let mut ball = icosphere(3, |_| 1.0);
                ball.triangles.truncate(ball.triangles.len() - 2);
                Ok(ball.into())
            }
            _ => {
                Err(LoadError::Invalid { file: path.into(), reason: "no such mesh has been made up".into() })
            }
        }
    }

    fn model(
        &mut self,
        path: &Path,
        _: &mut Assets,
        _: &mut Vec<Diagnostic>,
    ) -> Result<GltfModel, LoadError> {
        Err(LoadError::Invalid { file: path.into(), reason: "no model has been made up".into() })
    }

    fn image(&mut self, path: &Path) -> Result<DecodedImage, LoadError> {
        match path.file_stem().and_then(|stem| stem.to_str()) {
            Some("quarters") => Ok(quarters().into()),
            Some("noise") => Ok(noise().into()),
            Some("floats") => Ok(floats().into()),
            Some("ramp") => Ok(ramp().into()),
            Some("lamp") => Ok(lamp(1.0).into()),
            Some("sun") => Ok(sun().into()),
            Some("bright-lamp") => Ok(lamp(1000.0).into()),
            _ => Err(LoadError::Invalid {
                file: path.into(),
                reason: "no such picture has been made up".into(),
            }),
        }
    }
}

/// A world from the text of a scene file.
pub fn world(text: &str) -> World {
    ron::parse(text, Path::new("test.ron"), &mut MadeUp).unwrap_or_else(|error| panic!("{error}"))
}

/// Renders all samples of a world's image.
pub fn session(world: &World, options: Options) -> Session {
    let scene = compile(world, None).unwrap_or_else(|error| panic!("{error}"));
    let mut session = Session::new(scene, &world.settings, options);
    session.advance(u32::MAX);
    session
}

/// Returns the film of all samples.
pub fn film(world: &World, options: Options) -> Film {
    session(world, options).film().clone()
}

/// A translation.
pub fn at(x: f32, y: f32, z: f32) -> Transform {
    Transform::Trs { translation: Vec3::new(x, y, z).as_dvec3(), rotation: Quat::IDENTITY, scale: Vec3::ONE }
}

/// A grey light without an area.
pub fn point_light(power_w: f32) -> Light {
    Light::Point { power_w: Rgb::splat(power_w), falloff: Falloff::InverseSquare, radius_m: 0.0 }
}

/// The mean of an image's pixels, by channel.
pub fn mean_rgb(pixels: &(impl AsRef<[Rgb]> + ?Sized)) -> [f64; 3] {
    let pixels = pixels.as_ref();
    let sum = |channel: usize| pixels.iter().map(|pixel| f64::from(pixel.to_array()[channel])).sum::<f64>();
    [0, 1, 2].map(|channel| sum(channel) / pixels.len() as f64)
}

/// The mean of an image's pixels and channels.
pub fn mean(pixels: &(impl AsRef<[Rgb]> + ?Sized)) -> f64 {
    mean_rgb(pixels).iter().sum::<f64>() / 3.0
}

/// An image, row by row.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<Rgb>,
}

impl AsRef<[Rgb]> for Picture {
    fn as_ref(&self) -> &[Rgb] {
        &self.pixels
    }
}

impl Picture {
    pub fn of(world: &World) -> Picture {
        let [width, height] = world.settings.size.map(|side| side as usize);
        Picture { width, height, pixels: film(world, Options::default()).radiance() }
    }

    pub fn at(&self, x: usize, y: usize) -> Rgb {
        assert!(x < self.width && y < self.height);
        self.pixels[y * self.width + x]
    }
}

/// Renders the image of a scene's text.
pub fn picture(text: &str) -> Picture {
    Picture::of(&world(text))
}

/// Red, green / blue, white, two texels a side.
fn quarters() -> Image {
    let texels = vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]];
    Image { source: None, width: 2, height: 2, texels: Texels::Rgba8(texels) }
}

/// 5 × 3 bytes without a pattern.
fn noise() -> Image {
    let byte = |i: u32| (i.wrapping_mul(2_654_435_761) >> 13) as u8;
    let texels = (0..15).map(|i| [byte(3 * i), byte(3 * i + 1), byte(3 * i + 2), 255]).collect();
    Image { source: None, width: 5, height: 3, texels: Texels::Rgba8(texels) }
}

/// 4 × 4 floats, some above 1.
fn floats() -> Image {
    let texels = (0..16).map(|i| [0.1 * i as f32, 1.0 / (i as f32 + 0.5), (i % 3) as f32]).collect();
    Image { source: None, width: 4, height: 4, texels: Texels::Rgb32(texels) }
}

/// Red is u and green is v, with interpolated texels.
fn ramp() -> Image {
    const SIDE: u32 = 64;
    let at = |i: u32| (i as f32 + 0.5) / SIDE as f32;
    let texels = (0..SIDE * SIDE).map(|i| [at(i % SIDE), at(i / SIDE), 1.0]).collect();
    Image { source: None, width: SIDE, height: SIDE, texels: Texels::Rgb32(texels) }
}

/// A photometric profile: twice as bright towards +Y as towards −Y, and dark behind.
fn lamp(whole: f32) -> Image {
    const SIZE: [u32; 2] = [64, 32];
    let texel = |i: u32| {
        let (column, row) = (i % SIZE[0], i / SIZE[0]);
        let there = if row < SIZE[1] / 2 { whole } else { 0.0 };
        [if column < SIZE[0] / 2 { 2.0 * there } else { there }; 3]
    };
    let texels = (0..SIZE[0] * SIZE[1]).map(texel).collect();
    Image { source: None, width: SIZE[0], height: SIZE[1], texels: Texels::Rgb32(texels) }
}

/// A small sun in a dim sky.
fn sun() -> Image {
    let texel = |i: u32| {
        if (8..10).contains(&(i / 64)) && (20..22).contains(&(i % 64)) { [400.0; 3] } else { [0.1; 3] }
    };
    Image { source: None, width: 64, height: 32, texels: Texels::Rgb32((0..64 * 32).map(texel).collect()) }
}

/// A tetrahedron without normals, with colours and texture coordinates at its corners.
fn tetrahedron() -> Mesh {
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    Mesh {
        positions: vec![
            corner(1.0, 1.0, 1.0),
            corner(-1.0, -1.0, 1.0),
            corner(-1.0, 1.0, -1.0),
            corner(1.0, -1.0, -1.0),
        ],
        uvs: vec![Vec2::ZERO, Vec2::new(2.5, 0.0), Vec2::new(0.0, -1.5), Vec2::ONE],
        colors: vec![
            Rgb::new(1.0, 0.2, 0.2),
            Rgb::new(0.2, 1.0, 0.2),
            Rgb::new(0.2, 0.2, 1.0),
            Rgb::splat(1.0),
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..Mesh::default()
    }
}

/// A cube with sides of 1 about the origin, without normals.
fn cube() -> Mesh {
    let corner = |i: u32| Vec3::from_array([0, 1, 2].map(|axis| (i >> axis & 1) as f32 - 0.5));
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    }
}

/// The triangles of a mesh, facing the other way.
fn inwards(mesh: &Mesh) -> Vec<[u32; 3]> {
    mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
}

/// A square with sides of 1 about the origin, perpendicular to y.
fn square() -> Mesh {
    let corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)];
    Mesh {
        positions: corners.map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A grid bent to a paraboloid, open above, with smooth normals (except for one zero normal, which means flat).
fn bowl() -> Mesh {
    const SIDE: u32 = 9;
    let mut mesh = Mesh::default();
    for i in 0..SIDE * SIDE {
        let (u, v) = ((i % SIDE) as f32 / (SIDE - 1) as f32, (i / SIDE) as f32 / (SIDE - 1) as f32);
        let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        mesh.positions.push(Vec3::new(x, 0.5 * (x * x + z * z), z));
        mesh.normals.push(if i == 0 { Vec3::ZERO } else { Vec3::new(-x, 1.0, -z).normalize() });
        mesh.uvs.push(Vec2::new(u, v));
    }
    for row in 0..SIDE - 1 {
        for column in 0..SIDE - 1 {
            let a = row * SIDE + column;
            mesh.triangles.extend([[a, a + SIDE, a + 1], [a + 1, a + SIDE, a + SIDE + 1]]);
        }
    }
    mesh
}

/// A subdivided icosahedron without normals, with each vertex at `radius(direction)`.
pub fn icosphere(subdivisions: u32, radius: impl Fn(Vec3) -> f32) -> Mesh {
    let golden = (1.0 + 5f32.sqrt()) * 0.5;
    let mut positions = Vec::new();
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        positions.extend([Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)]);
    }
    // Its faces are the triples of vertices with the smallest mutual distance, 2.
    let mut triangles = Vec::new();
    let near = |a: usize, b: usize| (positions[a] - positions[b]).length() < 2.1;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let normal = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
                    let outwards = normal.dot(positions[a]) > 0.0;
                    triangles.push(if outwards { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..subdivisions {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]) * 0.5);
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    for position in &mut positions {
        let direction = position.normalize();
        *position = direction * radius(direction);
    }
    Mesh { positions, triangles, ..Mesh::default() }
}
