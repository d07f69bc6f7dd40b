//! Worlds, meshes and materials for the tests' images.

use rayfront::math::{DAffine3, Mat4, Rgb, Vec2, Vec3, Vec4};
use rayfront::world::{
    AlphaMode, Anisotropy, Assets, Background, BlinnPhong, Camera, Channel, ColorInput, Image, ImageId,
    Material, MaterialId, Mesh, NormalMap, PixelFilter, Principled, ScalarInput, Shape, Texels, Texture,
    TextureId, Transform, Transport, Volume, World,
};
use rayfront::world::{ColorSpace, TextureFilter};

pub use crate::support::{at, point_light};

pub const BOTH: [Transport; 2] = [Transport::Whitted, Transport::Path];

/// A square image without entities.
pub fn world(transport: Transport, size: u32, samples: u32) -> World {
    let mut world = World::default();
    world.settings.size = [size, size];
    world.settings.samples = samples;
    world.settings.transport = transport;
    world.settings.filter = PixelFilter::Box;
    world.settings.max_depth = 4;
    world
}

/// A sky that is brighter and bluer above, and warm below.
pub fn sky(world: &mut World) {
    world.settings.background =
        Background::Gradient { bottom: Rgb::new(0.5, 0.3, 0.2), top: Rgb::new(0.6, 0.9, 1.4) };
}

/// A transform from a point that turns −Z towards another.
pub fn looking(from: [f32; 3], to: [f32; 3]) -> Transform {
    let (from, to) = (Vec3::from(from), Vec3::from(to));
    let z = (from - to).normalize();
    let up = if z.y.abs() > 0.99 { Vec3::Z } else { Vec3::Y };
    let x = up.cross(z).normalize();
    let y = z.cross(x);
    affine(Mat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), from.extend(1.0)))
}

/// The transform of an affine matrix.
pub fn affine(matrix: Mat4) -> Transform {
    Transform::Matrix(DAffine3::from_mat4(matrix.as_dmat4()))
}

/// Adds a camera with an angle of view in radians.
pub fn camera(world: &mut World, from: [f32; 3], to: [f32; 3], vertical_fov: f32) {
    world.entities.spawn((Camera::Pinhole { vertical_fov }, looking(from, to)));
}

pub fn place(world: &mut World, shape: Shape, material: Material, transform: Transform) {
    let material = world.assets.add_material(None, material);
    world.entities.spawn((shape, material, transform));
}

pub fn place_mesh(world: &mut World, mesh: Mesh, material: Material, transform: Transform) {
    let mesh = Shape::Mesh(world.assets.add_mesh(mesh));
    place(world, mesh, material, transform);
}

/// Turns meshes into instances: adds a distant black instance of each, and allows no copies.
pub fn as_instances(world: &mut World) {
    let mut meshes = Vec::new();
    for shape in world.entities.query_mut::<&Shape>() {
        if let Shape::Mesh(mesh) = shape {
            meshes.push(*mesh);
        }
    }
    for mesh in meshes {
        place(world, Shape::Mesh(mesh), matte(0.0), at(0.0, -1000.0, 0.0));
    }
    world.settings.copied_triangles = 0;
}

/// A parallelogram, counter-clockwise seen from the front: u from the first corner along `a`, v along `−b`, so that
/// textures are upright.
pub fn quad(corner: [f32; 3], a: [f32; 3], b: [f32; 3]) -> Mesh {
    let [corner, a, b] = [corner, a, b].map(Vec3::from);
    Mesh {
        positions: vec![corner, corner + a, corner + a + b, corner + b],
        uvs: vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::X, Vec2::ZERO],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A square floor at a height, facing up.
pub fn floor(half: f32, y: f32) -> Mesh {
    quad([-half, y, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half])
}

/// A square at a height, facing down.
pub fn ceiling(half: f32, y: f32) -> Mesh {
    quad([-half, y, -half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, 2.0 * half])
}

/// The mesh with reversed faces.
pub fn reversed(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// Two meshes as one.
pub fn joined(mut a: Mesh, b: &Mesh) -> Mesh {
    let first = a.positions.len() as u32;
    a.positions.extend(&b.positions);
    a.normals.extend(&b.normals);
    a.uvs.extend(&b.uvs);
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + first)));
    a
}

/// A bent sheet that faces +Y, with normals and both sets of texture coordinates.
pub fn shell() -> Mesh {
    const SIDE: u32 = 21;
    let mut mesh = Mesh::default();
    for i in 0..SIDE * SIDE {
        let (u, v) = ((i % SIDE) as f32 / (SIDE - 1) as f32, (i / SIDE) as f32 / (SIDE - 1) as f32);
        let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        mesh.positions.push(Vec3::new(x, 0.25 * (x * x - z * z + x), z));
        mesh.normals.push(Vec3::new(-0.5 * x - 0.25, 1.0, 0.5 * z).normalize());
        mesh.uvs.push(Vec2::new(u, v));
        mesh.uvs1.push(Vec2::new(1.0 - v, u) * 1.5);
    }
    for row in 0..SIDE - 1 {
        for column in 0..SIDE - 1 {
            let a = row * SIDE + column;
            mesh.triangles.extend([[a, a + SIDE, a + 1], [a + 1, a + SIDE, a + SIDE + 1]]);
        }
    }
    mesh
}

/// The bent sheet with tangents along growing u.
pub fn shell_with_tangents() -> Mesh {
    let mut mesh = shell();
    let along = |(p, n): (&Vec3, &Vec3)| {
        let t = Vec3::new(1.0, 0.25 * (2.0 * p.x + 1.0), 0.0);
        (t - *n * n.dot(t)).normalize().extend(1.0)
    };
    mesh.tangents = mesh.positions.iter().zip(&mesh.normals).map(along).collect();
    mesh
}

/// Applies a matrix to a mesh and keeps its front. (Normals are interpolated after the transform instead of before,
/// which is invisible with small triangles.)
pub fn baked(mesh: &Mesh, matrix: Mat4) -> Mesh {
    let turn = matrix.inverse().transpose();
    let side = matrix.determinant().signum();
    let mut out = mesh.clone();
    out.positions.iter_mut().for_each(|p| *p = matrix.transform_point3(*p));
    out.normals.iter_mut().for_each(|n| *n = turn.transform_vector3(*n).normalize());
    let along = |t: &Vec4| matrix.transform_vector3(t.truncate()).normalize().extend(t.w * side);
    out.tangents = mesh.tangents.iter().map(along).collect();
    if side < 0.0 { reversed(out) } else { out }
}

/// A ball of triangles, with smooth normals.
pub fn ball(subdivisions: u32) -> Mesh {
    let mut mesh = crate::support::icosphere(subdivisions, |_| 1.0);
    mesh.normals = mesh.positions.clone();
    mesh
}

pub fn grey(value: f32) -> ColorInput {
    ColorInput::Constant(Rgb::splat(value))
}

pub fn number(value: f32) -> ScalarInput {
    ScalarInput::constant(value)
}

/// A Blinn-Phong material without a highlight.
pub fn matte(albedo: f32) -> Material {
    Material::BlinnPhong(BlinnPhong { diffuse: grey(albedo), ..BlinnPhong::default() })
}

/// Black on both sides, except for its emission.
pub fn lamp(radiance: f32) -> Material {
    let black = grey(0.0);
    Material::BlinnPhong(BlinnPhong { diffuse: black, emission: grey(radiance), ..BlinnPhong::default() })
}

/// A dielectric of the principled material, with changes.
pub fn principled(change: impl FnOnce(&mut Principled)) -> Material {
    let mut material = Principled { metallic: number(0.0), ..Principled::default() };
    change(&mut material);
    Material::Principled(Box::new(material))
}

/// Black, except for the emission on its front.
pub fn front_lamp(radiance: f32, change: impl FnOnce(&mut Principled)) -> Material {
    principled(|m| {
        m.base_color = grey(0.0);
        m.specular = number(0.0);
        m.emission = grey(radiance);
        change(m);
    })
}

/// A black double-sided sheet with some alpha.
pub fn veil(alpha: f32) -> Material {
    principled(|m| {
        m.base_color = grey(0.0);
        m.specular = number(0.0);
        m.alpha = number(alpha);
        m.alpha_mode = AlphaMode::Blend;
        m.double_sided = true;
    })
}

/// A smooth, repeating, asymmetric square image of floats by (u, v).
pub fn image(assets: &mut Assets, side: u32, of: impl Fn(f32, f32) -> [f32; 3]) -> ImageId {
    let at = |i: u32| (i as f32 + 0.5) / side as f32;
    let texels = (0..side * side).map(|i| of(at(i % side), at(i / side))).collect();
    assets.add_image(Image { source: None, width: side, height: side, texels: Texels::Rgb32(texels) })
}

fn wave(turns: f32) -> f32 {
    libm::sinf(std::f32::consts::TAU * turns)
}

/// Colours that distinguish u, v and both directions.
pub fn paint(assets: &mut Assets) -> TextureId {
    let image =
        image(assets, 16, |u, v| [0.5 + 0.4 * wave(u), 0.4 + 0.3 * wave(v + 0.1), 0.3 + 0.2 * wave(u + v)]);
    assets.add_texture(Texture { filter: TextureFilter::Trilinear, ..Texture::new(image) })
}

/// A normal map of smooth bumps, steeper along u.
pub fn bumps(assets: &mut Assets) -> TextureId {
    let image = image(assets, 16, |u, v| {
        let n = Vec3::new(0.7 * wave(u) + 0.2, 0.5 + 0.3 * wave(2.0 * u + v), 1.0).normalize();
        (n * 0.5 + 0.5).to_array()
    });
    assets.add_texture(Texture { color_space: ColorSpace::Linear, ..Texture::new(image) })
}

/// A constant normal map.
pub fn tilted(assets: &mut Assets, normal: [f32; 3]) -> TextureId {
    let n = Vec3::from(normal).normalize() * 0.5 + 0.5;
    let image = image(assets, 1, |_, _| n.to_array());
    assets.add_texture(Texture { color_space: ColorSpace::Linear, ..Texture::new(image) })
}

/// A grid of holes: red is 0 or 1.
pub fn holes(assets: &mut Assets) -> TextureId {
    let image = image(assets, 8, |u, v| {
        let part = |x: f32| ((x * 8.0) as u32).is_multiple_of(2);
        [f32::from(part(u) || part(v)); 3]
    });
    let filter = TextureFilter::Nearest;
    assets.add_texture(Texture { filter, color_space: ColorSpace::Linear, ..Texture::new(image) })
}

/// One material of each kind, by name, including all that cut holes or blend.
pub fn materials(assets: &mut Assets) -> Vec<(&'static str, Material)> {
    let (paint, bumps, holes) = (paint(assets), bumps(assets), holes(assets));
    let painted = ColorInput::Texture(paint);
    let map = Some(NormalMap { texture: bumps, scale: 1.0 });
    let clear =
        Volume { attenuation_color: Rgb::new(0.9, 0.7, 0.8), attenuation_distance: 1.0, ..Volume::default() };
    let classic = BlinnPhong { diffuse: painted, specular: grey(0.2), ..BlinnPhong::default() };
    let glass = BlinnPhong { ior: Some(1.4), ..BlinnPhong::default() };
    let two = |change: fn(&mut Principled)| {
        principled(|m| {
            (m.base_color, m.double_sided) = (painted, true);
            change(m);
        })
    };
    vec![
        ("classic", Material::BlinnPhong(classic)),
        ("classic glass", Material::BlinnPhong(glass)),
        ("paint, one side", principled(|m| m.base_color = painted)),
        ("bumpy", principled(|m| (m.base_color, m.normal, m.double_sided) = (painted, map, true))),
        ("bumpy metal, one side", {
            principled(|m| (m.metallic, m.roughness, m.normal) = (number(1.0), number(0.5), map))
        }),
        ("brushed", {
            let brush = Anisotropy { strength: 0.9, rotation: 0.6, texture: None };
            principled(|m| {
                (m.metallic, m.roughness, m.anisotropy) = (number(1.0), number(0.5), brush);
                m.double_sided = true;
            })
        }),
        ("coat over bumps", {
            principled(|m| {
                (m.base_color, m.normal, m.double_sided) = (painted, map, true);
                (m.clearcoat, m.clearcoat_roughness) = (number(1.0), number(0.4));
            })
        }),
        ("bumpy coat", {
            principled(|m| {
                (m.base_color, m.double_sided, m.clearcoat_normal) = (painted, true, map);
                (m.clearcoat, m.clearcoat_roughness) = (number(1.0), number(0.3));
            })
        }),
        ("sheen", two(|m| (m.sheen_color, m.sheen_roughness) = (grey(0.8), number(0.5)))),
        ("frosted sheet", two(|m| (m.transmission, m.roughness) = (number(0.9), number(0.5)))),
        ("frosted body", {
            principled(|m| (m.transmission, m.roughness, m.volume) = (number(1.0), number(0.5), Some(clear)))
        }),
        ("translucent", two(|m| m.diffuse_transmission = number(0.6))),
        ("holes", {
            principled(|m| {
                (m.base_color, m.double_sided) = (painted, true);
                m.alpha = ScalarInput { factor: 1.0, texture: Some((holes, Channel::Red)) };
                m.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
            })
        }),
        ("blended", two(|m| (m.alpha, m.alpha_mode) = (number(0.5), AlphaMode::Blend))),
        ("lamp, one side", principled(|m| (m.emission, m.base_color) = (painted, grey(0.2)))),
    ]
}

/// The names of [`materials`].
pub fn names() -> Vec<&'static str> {
    materials(&mut Assets::default()).into_iter().map(|(name, _)| name).collect()
}

/// One of [`materials`].
pub fn material(assets: &mut Assets, index: usize) -> Material {
    materials(assets).swap_remove(index).1
}

/// The material for spheres, which have no tangents: without normal maps and anisotropy.
pub fn without_tangents(material: &Material) -> Material {
    let mut material = material.clone();
    if let Material::Principled(m) = &mut material {
        (m.normal, m.clearcoat_normal, m.anisotropy) = (None, None, Anisotropy::default());
    }
    material
}

/// Adds a material and returns its id.
pub fn add(world: &mut World, material: &Material) -> MaterialId {
    world.assets.add_material(None, material.clone())
}
