//! Textures under the path transport, with results known analytically: one quad, one pixel, one light.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use rayfront::math::{Quat, Rgb, Vec2, Vec3};
use rayfront::world::{
    Anisotropy, Background, BlinnPhong, Camera, ColorInput, Image, Light, Material, Mesh, NormalMap,
    PixelFilter, Principled, ScalarInput, Shape, Texels, Texture, TextureId, Transform, Transport, World,
};
use rayfront::world::{TextureFilter, Wrap};

use std::f64::consts::PI;

use super::{near, pixel};
use crate::support::Picture;

/// Texture coordinates of the quad's corners: top left, bottom left, bottom right, top right.
pub type Corners = [[f32; 2]; 4];
/// An upright texture.
pub const UPRIGHT: Corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];

/// A quad from −1 to 1 along X and Y that faces +Z.
pub fn quad(uvs: Corners) -> Mesh {
    Mesh {
        positions: [(-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)]
            .map(|(x, y)| Vec3::new(x, y, 0.0))
            .into(),
        uvs: uvs.map(Vec2::from_array).into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

pub fn placed(translation: Vec3, rotation: Quat, scale: f32) -> Transform {
    Transform::Trs { translation: translation.as_dvec3(), rotation, scale: Vec3::splat(scale) }
}

/// Settings only: one pixel and direct light.
pub fn stage(samples: u32) -> World {
    let mut world = World::default();
    world.settings.size = [1, 1];
    world.settings.samples = samples;
    world.settings.transport = Transport::Path;
    world.settings.filter = PixelFilter::Box;
    world.settings.max_depth = 0;
    world.settings.background = Background::Constant(Rgb::BLACK);
    world
}

/// A texture of an image of linear floats.
pub fn texture(world: &mut World, [width, height]: [u32; 2], texels: Vec<[f32; 3]>) -> Texture {
    let image = Image { source: None, width, height, texels: Texels::Rgb32(texels) };
    Texture::new(world.assets.add_image(image))
}

/// A black material with a texture as emission, for every transport.
fn glowing(texture: TextureId) -> Material {
    Material::BlinnPhong(BlinnPhong {
        diffuse: ColorInput::default(),
        emission: ColorInput::Texture(texture),
        ..BlinnPhong::default()
    })
}

/// Returns the pixel of a camera above (x, y, 0), with a pixel of this size.
pub fn seen(mut world: World, [x, y]: [f32; 2], pixel_m: f32) -> [f64; 3] {
    let eye = placed(Vec3::new(x, y, 5.0), Quat::IDENTITY, 1.0);
    world.entities.spawn((Camera::Orthographic { height_m: pixel_m }, eye));
    Picture::of(&world).at(0, 0).to_array().map(f64::from)
}

/// A world of one quad with an emissive texture.
fn glow(mesh: Mesh, size: [u32; 2], texels: &[[f32; 3]], change: &dyn Fn(&mut Texture)) -> World {
    let mut world = stage(1);
    let mut texture = texture(&mut world, size, texels.to_vec());
    change(&mut texture);
    let texture = world.assets.add_texture(texture);
    let material = world.assets.add_material(None, glowing(texture));
    let mesh = world.assets.add_mesh(mesh);
    world.entities.spawn((Shape::Mesh(mesh), material));
    world
}

pub fn same(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(close, "{found:?} instead of {expected:?}");
}

/// Red is u and green is v.
fn ramp() -> Vec<[f32; 3]> {
    let at = |i: u32| (i as f32 + 0.5) / 64.0;
    (0..64 * 64).map(|i| [at(i % 64), at(i / 64), 0.0]).collect()
}

pub const POINT: f32 = 1e-4;

#[test]
fn textures_are_repeated_clamped_or_mirrored_along_each_axis() {
    let steps = [0.1, 0.2, 0.3, 0.4].map(|grey| [grey; 3]);
    let modes = [
        (Wrap::Repeat, [1, 2, 3, 4, 1, 2, 3, 4, 1, 2, 3, 4]),
        (Wrap::Clamp, [1, 1, 1, 1, 1, 2, 3, 4, 4, 4, 4, 4]),
        (Wrap::Mirror, [4, 3, 2, 1, 1, 2, 3, 4, 4, 3, 2, 1]),
    ];
    // Three copies of the texture wide and high.
    let uvs = UPRIGHT.map(|uv| uv.map(|c| 3.0 * c - 1.0));
    for (mode, expected) in modes {
        for (place, expected) in expected.into_iter().enumerate() {
            let along = (place as f32 + 0.5) / 6.0 - 1.0;
            for axis in [0, 1] {
                let mut wrap = [Wrap::Repeat; 2];
                wrap[axis] = mode;
                let size = if axis == 0 { [4, 1] } else { [1, 4] };
                let world = glow(quad(uvs), size, &steps, &|t| {
                    (t.wrap, t.filter) = (wrap, TextureFilter::Nearest);
                });
                // v grows downwards.
                let point = if axis == 0 { [along, 0.1] } else { [0.1, -along] };
                same(seen(world, point, POINT), [0.1 * f64::from(expected); 3], 1e-6);
            }
        }
    }
}

/// A texture whose corner texel has a quarter of the value in each next mip level.
fn corner_of_copies(mesh: Mesh, change: &dyn Fn(&mut Texture)) -> World {
    let mut texels = vec![[0.0; 3]; 64];
    texels[0] = [1.0; 3];
    glow(mesh, [8, 8], &texels, &|t| {
        (t.filter, t.wrap) = (TextureFilter::Trilinear, [Wrap::Clamp; 2]);
        change(t);
    })
}

/// Entirely beyond the texture's top left corner; 4 texels per metre.
const BEYOND: Corners = [[-9.0, -9.0], [-9.0, -8.0], [-8.0, -8.0], [-8.0, -9.0]];

#[test]
fn mip_level_follows_the_pixels_width() {
    for (pixel_m, expected) in [
        (0.1, 1.0),
        (0.25, 1.0),
        (0.5, 0.25),
        (1.0, 1.0 / 16.0),
        (2.0, 1.0 / 64.0),
        // Half-way on the logarithmic scale.
        (0.25 * 2f32.sqrt(), (1.0 + 0.25) / 2.0),
        (0.5 * 2f32.sqrt(), (0.25 + 0.0625) / 2.0),
    ] {
        same(seen(corner_of_copies(quad(BEYOND), &|_| ()), [0.0; 2], pixel_m), [expected; 3], 1e-5);
        // Repeated twice at half the size.
        let twice =
            seen(corner_of_copies(quad(BEYOND), &|t| t.scale = Vec2::splat(2.0)), [0.0; 2], pixel_m / 2.0);
        same(twice, [expected; 3], 1e-5);
    }
}

#[test]
fn mip_level_follows_distance_and_scale() {
    for (scale, pixel_m, expected) in [(1.0, 0.5, 0.25), (2.0, 0.5, 1.0), (4.0, 1.0, 1.0), (0.5, 0.25, 0.25)]
    {
        let mut world = corner_of_copies(quad(BEYOND), &|_| ());
        let places: Vec<_> = world
            .entities
            .query_mut::<(hecs::Entity, &Shape)>()
            .into_iter()
            .map(|(entity, _)| entity)
            .collect();
        for entity in places {
            let _ = world.entities.insert_one(entity, placed(Vec3::ZERO, Quat::IDENTITY, scale));
        }
        let vertical_fov = 2.0 * libm::atan(pixel_m / 100.0) as f32;
        world.entities.spawn((
            Camera::Pinhole { vertical_fov },
            placed(Vec3::new(0.0, 0.0, 50.0), Quat::IDENTITY, 1.0),
        ));
        let found = Picture::of(&world).at(0, 0).to_array().map(f64::from);
        same(found, [expected; 3], 0.01);
    }
}

/// Adds a second set, rotated by half a turn against the first, and `scale` times as fine.
fn with_two_sets(uvs: Corners, scale: f32) -> Mesh {
    let other = uvs.map(|[u, v]| Vec2::new(1.0 - u, 1.0 - v) * scale);
    Mesh { uvs1: other.into(), ..quad(uvs) }
}

#[test]
fn textures_use_their_set_of_coordinates() {
    for (uv_set, expected) in [(0, [0.65, 0.3, 0.0]), (1, [0.35, 0.7, 0.0])] {
        let world = glow(with_two_sets(UPRIGHT, 1.0), [64, 64], &ramp(), &|t| t.uv_set = uv_set);
        same(seen(world, [0.3, 0.4], POINT), expected, 1e-4);
    }
}

#[test]
fn mip_level_follows_the_textures_set_of_coordinates() {
    // Clamped at the other corner, where the texture is black except for its last mip level.
    for (scale, expected) in [(1.0, 1.0), (2.0, 0.25), (4.0, 1.0 / 16.0)] {
        let uvs1 = BEYOND.map(|uv| Vec2::from_array(uv) * scale).into();
        let world = corner_of_copies(Mesh { uvs1, ..quad(BEYOND) }, &|t| t.uv_set = 1);
        same(seen(world, [0.0; 2], 0.25), [expected; 3], 1e-5);
    }
}

/// At (0.3, 0.4) u is 0.65 and v is 0.3: rotated, scaled and moved.
fn transformed(transport: Transport) {
    for (degrees, scale, offset, [u, v]) in [
        (0.0, [1.0, 1.0], [0.2, -0.1], [0.85, 0.2]),
        (90.0, [1.0, 1.0], [0.0, 0.0], [0.3, 0.35]),
        (180.0, [1.0, 1.0], [0.0, 0.0], [0.35, 0.7]),
        // s = cos 30° · u + sin 30° · v, t = −sin 30° · u + cos 30° · v.
        (30.0, [1.0, 1.0], [0.0, 0.5], [0.7129165, 0.4348076]),
        // Scaled first: (0.325, 0.9).
        (90.0, [0.5, 3.0], [-0.2, 0.6], [0.7, 0.275]),
    ] {
        let mut world = glow(quad(UPRIGHT), [64, 64], &ramp(), &|t| {
            t.rotation = f32::to_radians(degrees);
            (t.scale, t.offset) = (Vec2::from_array(scale), Vec2::from_array(offset));
        });
        world.settings.transport = transport;
        same(seen(world, [0.3, 0.4], POINT), [u, v, 0.0], 1e-3);
    }
}

#[test]
fn textures_are_scaled_then_rotated_then_moved() {
    transformed(Transport::Path);
}

#[test]
fn whitted_transforms_textures_like_the_path_transport() {
    transformed(Transport::Whitted);
}

#[test]
fn whitted_supports_the_second_set_of_coordinates() {
    let mut world = glow(with_two_sets(UPRIGHT, 1.0), [64, 64], &ramp(), &|t| t.uv_set = 1);
    world.settings.transport = Transport::Whitted;
    same(seen(world, [0.3, 0.4], POINT), [0.35, 0.7, 0.0], 1e-3);
}

/// Reflects all light diffusely.
pub fn matte() -> Principled {
    let none = ScalarInput::constant(0.0);
    Principled { metallic: none, specular: none, ..Principled::default() }
}

/// A constant texture.
fn plain(world: &mut World, texel: [f32; 3]) -> TextureId {
    let texture = texture(world, [1, 1], vec![texel]);
    world.assets.add_texture(texture)
}

/// A normal map with a constant normal.
fn normals(world: &mut World, normal: Vec3) -> Option<NormalMap> {
    let texture = plain(world, (normal.normalize() * 0.5 + 0.5).to_array());
    Some(NormalMap { texture, scale: 1.0 })
}

/// The quad, rotated, in light of irradiance 1 from a direction.
fn lit(uvs: Corners, turned: Quat, from: Vec3, material: &dyn Fn(&mut World) -> Principled) -> f64 {
    let mut world = stage(1);
    let material = material(&mut world);
    let material = world.assets.add_material(None, Material::Principled(Box::new(material)));
    let mesh = world.assets.add_mesh(quad(uvs));
    world.entities.spawn((Shape::Mesh(mesh), material, placed(Vec3::ZERO, turned, 1.0)));
    let light = Light::Directional { irradiance: Rgb::WHITE, angle: 0.0 };
    let rotation = Quat::from_rotation_arc(Vec3::Z, from.normalize());
    world.entities.spawn((light, placed(Vec3::ZERO, rotation, 1.0)));
    seen(world, [0.0; 2], POINT)[1]
}

const RIGHT: Vec3 = Vec3::new(0.6, 0.0, 0.8);
const TOP: Vec3 = Vec3::new(0.0, 0.6, 0.8);

#[test]
fn normal_maps_tilt_red_towards_u_and_green_towards_the_top() {
    let upside_down = UPRIGHT.map(|[u, v]| [u, 1.0 - v]);
    let mirrored = UPRIGHT.map(|[u, v]| [1.0 - u, v]);
    // u grows downwards, the texture's top is on the right.
    let turned = UPRIGHT.map(|[u, v]| [v, 1.0 - u]);
    let (left, bottom) = (RIGHT * Vec3::new(-1.0, 1.0, 1.0), TOP * Vec3::new(1.0, -1.0, 1.0));
    for (uvs, stored, expected) in [
        (UPRIGHT, RIGHT, RIGHT),
        (UPRIGHT, TOP, TOP),
        (upside_down, RIGHT, RIGHT),
        (upside_down, TOP, bottom),
        (mirrored, RIGHT, left),
        (mirrored, TOP, TOP),
        (turned, RIGHT, bottom),
        (turned, TOP, RIGHT),
    ] {
        let mapped = |world: &mut World| Principled { normal: normals(world, stored), ..matte() };
        for from in [Vec3::Z, RIGHT, TOP, left, bottom, Vec3::new(0.5, 0.4, 1.0)] {
            let found = lit(uvs, Quat::IDENTITY, from, &mapped);
            near(found, f64::from(expected.dot(from.normalize())) / std::f64::consts::PI, 1e-4);
            // Like the quad itself rotated to that normal.
            let geometry = lit(uvs, Quat::from_rotation_arc(Vec3::Z, expected), from, &|_| matte());
            near(found, geometry, 1e-4);
        }
    }
}

#[test]
fn normal_map_scale_multiplies_the_slope() {
    let mapped = |world: &mut World| {
        let map = normals(world, RIGHT).map(|map| NormalMap { scale: 0.5, ..map });
        Principled { normal: map, ..matte() }
    };
    let expected = Vec3::new(0.3, 0.0, 0.8).normalize();
    for from in [RIGHT, TOP, Vec3::new(0.9, -0.1, 0.2)] {
        let found = lit(UPRIGHT, Quat::IDENTITY, from, &mapped);
        near(found, f64::from(expected.dot(from.normalize())) / std::f64::consts::PI, 1e-4);
    }
}

/// The microfacet BRDF of a white metal times the cosine, for light from a direction, viewed along the normal, without
/// multiple scattering (Heitz 2014).
fn single_scattering([x, y]: [f64; 2], from: [f64; 3]) -> f64 {
    let [lx, ly, lz] = from;
    let length = (lx * lx + ly * ly + (lz + 1.0) * (lz + 1.0)).sqrt();
    let [hx, hy, hz] = [lx / length, ly / length, (lz + 1.0) / length];
    let k = (hx / x).powi(2) + (hy / y).powi(2) + hz * hz;
    let density = 1.0 / (std::f64::consts::PI * x * y * k * k);
    let visible = 0.5 / (lz + ((x * lx).powi(2) + (y * ly).powi(2) + lz * lz).sqrt());
    density * visible * lz
}

const STRENGTH: f32 = 0.8;

/// A rough metal with an anisotropic highlight.
fn brushed(world: &mut World, rotation: f32, texel: Option<[f32; 3]>) -> Principled {
    let texture = texel.map(|texel| plain(world, texel));
    Principled {
        roughness: ScalarInput::constant(0.5),
        anisotropy: Anisotropy { strength: STRENGTH, rotation, texture },
        ..Principled::default()
    }
}

/// Checks that highlights are wider along an axis than across it, by the expected amount.
#[track_caller]
fn wider_along(axis: [f32; 2], strength: f32, uvs: Corners, material: &dyn Fn(&mut World) -> Principled) {
    // At 40 degrees to the normal. Multiple scattering differs little and in the opposite direction.
    let (sin, cos) = (libm::sin(0.7), libm::cos(0.7));
    let [x, y] = axis.map(|c| c * sin as f32 / axis[0].hypot(axis[1]));
    let found = lit(uvs, Quat::IDENTITY, Vec3::new(x, y, cos as f32), material)
        - lit(uvs, Quat::IDENTITY, Vec3::new(-y, x, cos as f32), material);
    let widths = [0.25 + 0.75 * f64::from(strength * strength), 0.25];
    let expected = single_scattering(widths, [sin, 0.0, cos]) - single_scattering(widths, [0.0, sin, cos]);
    assert!(expected > 0.02);
    near(found, expected, 0.035);
}

#[test]
fn anisotropy_widens_highlights_along_its_direction() {
    for (axis, rotation, texel, strength) in [
        ([1.0, 0.0], 0.0, None, STRENGTH),
        ([0.0, 1.0], FRAC_PI_2, None, STRENGTH),
        // Counter-clockwise from the tangent.
        ([1.0, 1.0], FRAC_PI_4, None, STRENGTH),
        // From a texture: its direction, and a factor.
        ([0.0, 1.0], 0.0, Some([0.5, 1.0, 1.0]), STRENGTH),
        ([1.0, 1.0], 0.0, Some([1.0, 1.0, 1.0]), STRENGTH),
        ([1.0, 0.0], 0.0, Some([1.0, 0.5, 0.5]), STRENGTH / 2.0),
        // Both: the texture's direction is rotated.
        ([-1.0, 1.0], FRAC_PI_4, Some([0.5, 1.0, 1.0]), STRENGTH),
    ] {
        wider_along(axis, strength, UPRIGHT, &|world| brushed(world, rotation, texel));
    }
}

#[test]
fn anisotropy_follows_rotated_and_mirrored_texture_coordinates() {
    let slanted = |world: &mut World| brushed(world, FRAC_PI_4, None);
    let textured = |world: &mut World| brushed(world, 0.0, Some([1.0, 1.0, 1.0]));
    // u grows downwards, the texture's top is on the right.
    let turned = UPRIGHT.map(|[u, v]| [v, 1.0 - u]);
    let upside_down = UPRIGHT.map(|[u, v]| [u, 1.0 - v]);
    let mirrored = UPRIGHT.map(|[u, v]| [1.0 - u, v]);
    for (uvs, axis) in [(turned, [1.0, -1.0]), (upside_down, [1.0, -1.0]), (mirrored, [-1.0, 1.0])] {
        wider_along(axis, STRENGTH, uvs, &slanted);
        wider_along(axis, STRENGTH, uvs, &textured);
    }
}

/// Black below a clear coat.
fn coated() -> Principled {
    Principled {
        base_color: ColorInput::default(),
        clearcoat: ScalarInput::constant(1.0),
        clearcoat_roughness: ScalarInput::constant(0.5),
        ..matte()
    }
}

#[test]
fn clearcoat_has_its_own_normals() {
    for from in [Vec3::new(0.3, 0.1, 0.9), Vec3::new(0.96, 0.0, 0.28), Vec3::new(-0.2, 0.0, 0.9)] {
        let turned = Quat::from_rotation_arc(Vec3::Z, RIGHT);
        let tilted = |world: &mut World| Principled { clearcoat_normal: normals(world, RIGHT), ..coated() };
        let (found, geometry) =
            (lit(UPRIGHT, Quat::IDENTITY, from, &tilted), lit(UPRIGHT, turned, from, &|_| coated()));
        assert!(geometry > 1e-4);
        near(found, geometry, 1e-3);
        // The base's normals do not affect the coat.
        let below = |world: &mut World| Principled { normal: normals(world, RIGHT), ..coated() };
        near(
            lit(UPRIGHT, Quat::IDENTITY, from, &below),
            lit(UPRIGHT, Quat::IDENTITY, from, &|_| coated()),
            1e-4,
        );
    }
}

#[test]
fn clearcoat_reflects_where_the_bases_normals_face_away() {
    let from = Vec3::new(-0.8, 0.0, 0.6);
    let steep = Vec3::new(0.8, 0.0, 0.6);
    assert!(steep.dot(from) < 0.0);
    let below = |world: &mut World| Principled { normal: normals(world, steep), ..coated() };
    let flat = lit(UPRIGHT, Quat::IDENTITY, from, &|_| coated());
    assert!(flat > 1e-4);
    near(lit(UPRIGHT, Quat::IDENTITY, from, &below), flat, 1e-4);
}

/// Sheen on black: (2 + 1/α) sin^(1/α) θₕ / 2π over 4 (cos θᵢ + cos θₒ − cos θᵢ cos θₒ), α = r², times cos θᵢ; viewed
/// along the normal θₕ is half of θᵢ.
fn fibres(roughness: f64, angle: f64) -> f64 {
    let inverse = 1.0 / (roughness * roughness);
    let density = (2.0 + inverse) * libm::pow(libm::sin(angle / 2.0), inverse) / std::f64::consts::TAU;
    density / 4.0 * libm::cos(angle)
}

fn sheen(roughness: f64, below: f32) -> Principled {
    Principled {
        base_color: ColorInput::Constant(Rgb::splat(below)),
        sheen_color: ColorInput::Constant(Rgb::new(0.2, 0.5, 1.0)),
        sheen_roughness: ScalarInput::constant(roughness as f32),
        ..matte()
    }
}

#[test]
fn sheen_matches_its_formula() {
    for roughness in [0.3, 0.5, 1.0] {
        for angle in [0.3, 0.8, 1.4] {
            let from = Vec3::new(libm::sin(angle) as f32, 0.0, libm::cos(angle) as f32);
            let found = lit(UPRIGHT, Quat::IDENTITY, from, &|_| sheen(roughness, 0.0));
            near(found, 0.5 * fibres(roughness, angle), 1e-3);
        }
    }
}

#[test]
fn sheen_in_a_furnace_matches_its_albedo() {
    let furnace = |material: Principled| {
        let mut world = stage(4096);
        world.settings.background = Background::Constant(Rgb::WHITE);
        let material = world.assets.add_material(None, Material::Principled(Box::new(material)));
        let mesh = world.assets.add_mesh(quad(UPRIGHT));
        world.entities.spawn((Shape::Mesh(mesh), material));
        seen(world, [0.0; 2], POINT)
    };
    for roughness in [0.5, 1.0] {
        let steps = 4096;
        let ring = |i: i32| {
            let angle = (f64::from(i) + 0.5) / f64::from(steps) * std::f64::consts::FRAC_PI_2;
            fibres(roughness, angle) * libm::sin(angle)
        };
        let width = std::f64::consts::FRAC_PI_2 / f64::from(steps);
        let albedo = (0..steps).map(ring).sum::<f64>() * std::f64::consts::TAU * width;
        let expected = [0.2, 0.5, 1.0].map(|c| c * albedo);
        same(furnace(sheen(roughness, 0.0)), expected, 0.01 * albedo);
        // Sheen attenuates all channels of the base alike, by the albedo of its strongest colour.
        let expected = [0.2, 0.5, 1.0].map(|c| 1.0 - albedo + c * albedo);
        same(furnace(sheen(roughness, 1.0)), expected, 0.01);
    }
}

/// A white matte shape with a bump map whose height grows with u (red) or v (green), lit by 1 W m⁻² from `light`:
/// returns the cosine between the light and the normal at the centre.
fn relief(shape: &str, channel: &str, height: f64, light: [f64; 3]) -> f64 {
    let [x, y, z] = light;
    let lamp = format!(
        "(light: Directional(irradiance: 1), transform: LookAt(from: ({x}, {y}, {z}), to: (0, 0, 0)))"
    );
    let shape = format!(
        "({shape}, material: Principled(metallic: 0, specular: 0, double_sided: true,
           bump: (texture: Image(\"ramp.hdr\", {channel}), height_m: {height})))"
    );
    let camera = "(camera: Orthographic(height_m: 1e-4), transform: (translate: (0, 0, 5)))";
    let found = pixel("transport: Path, sharing: Off", &[camera, &lamp, &shape]);
    found[0] * PI
}

#[test]
fn bump_maps_tilt_normals_by_their_slope_in_metres() {
    let square = "shape: Plane(corners: ((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)))";
    let cos = |slope: [f64; 2], light: [f64; 3]| {
        let normal = [-slope[0], -slope[1], 1.0];
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        normal.iter().zip(light).map(|(a, b)| a * b).sum::<f64>() / length(normal) / length(light)
    };
    let above = [0.0, 0.0, 1.0];
    let lights = [above, [-1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, -1.0, 2.0]];
    for light in lights {
        // A height of 0.4 m from −1 to 1 m; v grows downwards.
        near(relief(square, "Red", 0.4, light), cos([0.2, 0.0], light), 1e-4);
        near(relief(square, "Green", 0.4, light), cos([0.0, -0.2], light), 1e-4);
        near(relief(square, "Green", -0.4, light), cos([0.0, 0.2], light), 1e-4);
        // Twice as large and rotated by a quarter turn, so that u grows along Y.
        let turned = format!("{square}, transform: (scale: 2, rotate_degrees: (0, 0, 90))");
        near(relief(&turned, "Red", 0.4, light), cos([0.0, 0.1], light), 1e-4);
        // A sphere's u grows along X at +Z, by one per circumference.
        let slope = 0.4 / (2.0 * PI * 0.5);
        near(relief("shape: Sphere(radius_m: 0.5)", "Red", 0.4, light), cos([slope, 0.0], light), 1e-3);
        // The same from behind as from the front.
        let mirrored = "shape: Plane(corners: ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)))";
        near(relief(mirrored, "Red", 0.4, light), cos([0.2, 0.0], light), 1e-4);
    }
}
