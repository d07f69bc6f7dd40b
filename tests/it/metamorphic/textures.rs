//! Textures on surfaces, with either set of coordinates and with transforms.

use rayfront::math::{Mat4, Rgb, Vec2};
use rayfront::world::{
    AlphaMode, Background, BlinnPhong, BumpMap, Channel, ColorInput, Combination, Material, Mesh,
    PatternTexture, Procedure, ScalarInput, Shape, Sharing, Texels, Texture, TextureId, TexturePattern,
    Transform, Transport, VertexChannel, World,
};
use rayfront::world::{ColorSpace, TextureFilter, Wrap};

use super::stage::{self, camera, grey, number, place, place_mesh, principled};
use super::{Relations, Seen};

const FILTERS: [TextureFilter; 3] =
    [TextureFilter::Nearest, TextureFilter::Bilinear, TextureFilter::Trilinear];

/// The use of a texture.
#[derive(Clone, Copy, Debug)]
enum Use {
    Classic,
    Base,
    Emission,
    Alpha,
}

const USES: [Use; 4] = [Use::Classic, Use::Base, Use::Emission, Use::Alpha];

/// Every transport with every use and filter.
fn combinations() -> impl Iterator<Item = (Transport, Use, TextureFilter)> {
    let uses = stage::BOTH.into_iter().flat_map(|transport| USES.map(|what| (transport, what)));
    uses.flat_map(|(transport, what)| FILTERS.map(|filter| (transport, what, filter)))
}

fn material(texture: TextureId, what: Use) -> Material {
    let input = ColorInput::Texture(texture);
    match what {
        Use::Classic => Material::BlinnPhong(BlinnPhong { diffuse: input, ..BlinnPhong::default() }),
        Use::Base => principled(|m| (m.base_color, m.double_sided) = (input, true)),
        Use::Emission => {
            principled(|m| (m.base_color, m.emission, m.double_sided) = (grey(0.0), input, true))
        }
        Use::Alpha => principled(|m| {
            (m.base_color, m.double_sided) = (grey(0.7), true);
            m.alpha = ScalarInput { factor: 1.0, texture: Some((texture, Channel::Red)) };
            m.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        }),
    }
}

/// An image of 64 × 64 texels with grain finer than any pixel, and with slowly varying colours.
fn fine(world: &mut World, look: impl FnOnce(&mut Texture)) -> TextureId {
    let image = stage::image(&mut world.assets, 64, |u, v| {
        let (x, y) = ((u * 64.0) as u32, (v * 64.0) as u32);
        let noise = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503).wrapping_add(x * y)) >> 3;
        let grain = (noise % 16) as f32 / 15.0;
        [grain, 0.8 * u + 0.2 * grain, 0.8 * v + 0.2 * grain]
    });
    let mut texture = Texture { color_space: ColorSpace::Linear, ..Texture::new(image) };
    look(&mut texture);
    world.assets.add_texture(texture)
}

/// A textured mesh, viewed obliquely under one light, without random effects of the surface.
fn scene(transport: Transport, what: Use, mesh: &dyn Fn() -> Mesh, look: impl FnOnce(&mut Texture)) -> Seen {
    let mut world = stage::world(transport, 24, 16);
    world.settings.max_depth = 0;
    world.settings.background = Background::Constant(Rgb::splat(0.05));
    camera(&mut world, [0.4, 1.6, 2.2], [0.0, 0.0, 0.0], 0.8);
    let texture = fine(&mut world, look);
    place_mesh(&mut world, mesh(), material(texture, what), stage::affine(Mat4::from_rotation_y(0.2)));
    world.entities.spawn((stage::point_light(100.0), stage::at(0.5, 2.0, 1.0)));
    Seen::of(&world)
}

/// A square with two sets of coordinates, or with the second set as its only one.
fn square(first: f32, second: f32, both: bool) -> Mesh {
    let mut mesh = stage::floor(1.0, 0.0);
    let scaled = |by: f32, uvs: &[Vec2]| uvs.iter().map(|uv| *uv * by).collect::<Vec<_>>();
    let plain = mesh.uvs.clone();
    if both {
        (mesh.uvs, mesh.uvs1) = (scaled(first, &plain), scaled(second, &plain));
    } else {
        mesh.uvs = scaled(second, &plain);
    }
    mesh
}

/// A texture on the second set equals that texture on the only one, however fine the first set is.
#[test]
fn second_set_of_coordinates_equals_the_only_one() {
    let mut all = Relations::default();
    for (transport, what, filter) in combinations() {
        for (first, second) in [(0.05, 1.0), (16.0, 1.0), (1.0, 4.0)] {
            let alone = scene(transport, what, &|| square(first, second, false), |t| t.filter = filter);
            let on_second = scene(transport, what, &|| square(first, second, true), |t| {
                (t.filter, t.uv_set) = (filter, 1);
            });
            let case = format!("{transport:?} {what:?} {filter:?}, {first} {second}");
            all.equal(&on_second, &alone, &case);
        }
    }
}

/// Transforms texture coordinates as in KHR_texture_transform.
fn transformed(uv: Vec2, t: &Texture) -> Vec2 {
    let (sin, cos) = (libm::sinf(t.rotation), libm::cosf(t.rotation));
    let s = uv * t.scale;
    Vec2::new(cos * s.x + sin * s.y, -sin * s.x + cos * s.y) + t.offset
}

/// A texture with an offset, a rotation and a scale equals one without at transformed coordinates.
#[test]
fn texture_transforms_equal_transformed_coordinates() {
    let mut all = Relations::default();
    for (transport, what, filter) in combinations() {
        for rotation in [0.0, 0.7, -2.0] {
            let look = |t: &mut Texture| {
                (t.filter, t.rotation, t.scale) = (filter, rotation, Vec2::new(1.5, 0.8));
                (t.offset, t.wrap) = (Vec2::new(0.2, -0.3), [Wrap::Repeat, Wrap::Mirror]);
            };
            let by_texture = scene(transport, what, &|| square(1.0, 1.0, false), look);
            let transformed = || {
                let mut t = Texture::new(rayfront::world::ImageId(0));
                look(&mut t);
                let mut mesh = square(1.0, 1.0, false);
                mesh.uvs.iter_mut().for_each(|uv| *uv = transformed(*uv, &t));
                mesh
            };
            let by_mesh = scene(transport, what, &transformed, |t| {
                (t.filter, t.wrap) = (filter, [Wrap::Repeat, Wrap::Mirror]);
            });
            let case = format!("{transport:?} {what:?} {filter:?} by {rotation}");
            all.equal(&by_texture, &by_mesh, &case);
        }
    }
}

/// A rotation by half a turn mirrors both axes, also for coordinates that are not a mesh's.
#[test]
fn rotation_by_half_a_turn_mirrors_both_axes() {
    let mut all = Relations::default();
    for transport in stage::BOTH {
        for what in [Use::Classic, Use::Emission] {
            let ball = |look: fn(&mut Texture)| {
                let mut world = stage::world(transport, 16, 16);
                world.settings.max_depth = 0;
                camera(&mut world, [0.0, 0.5, 3.0], [0.0, 0.0, 0.0], 0.8);
                let texture = stage::paint(&mut world.assets);
                look(&mut world.assets.textures[texture.0 as usize]);
                place(
                    &mut world,
                    Shape::Sphere { radius_m: 1.0 },
                    material(texture, what),
                    Transform::IDENTITY,
                );
                world.entities.spawn((stage::point_light(100.0), stage::at(0.5, 2.0, 3.0)));
                Seen::of(&world)
            };
            let turned = ball(|t| (t.rotation, t.offset) = (std::f32::consts::PI, Vec2::ONE));
            let mirrored = ball(|t| (t.scale, t.offset) = (-Vec2::ONE, Vec2::ONE));
            all.equal(&turned, &mirrored, &format!("{transport:?} {what:?}"));
        }
    }
}

/// Where the colours of a square are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Colors {
    /// In a picture as smooth as the colours of vertices.
    Picture,
    /// At vertices: factors.
    Factors,
    /// At vertices, looked up by a texture.
    Lookup,
}

/// A lit square with a colour at each corner, in a material with a texture of them; of `Factors`, without one.
fn colored(
    transport: Transport,
    colors: Colors,
    look: impl Fn(&mut World, Option<TextureId>) -> Material,
) -> Seen {
    let mut world = stage::world(transport, 12, 16);
    world.settings.max_depth = 1;
    camera(&mut world, [0.0, 1.5, 1.0], [0.0, 0.0, 0.0], 0.8);
    let texels = vec![[0.1, 0.2, 0.3], [0.9, 0.2, 0.3], [0.1, 0.6, 0.3], [0.9, 0.6, 0.3]];
    let mut mesh = stage::floor(1.0, 0.0);
    let at = |uv: &Vec2| Rgb::from(texels[uv.x as usize + 2 * uv.y as usize]);
    let at_vertices: Vec<Rgb> = mesh.uvs.iter().map(at).collect();
    let texture = match colors {
        Colors::Picture => {
            let image = stage::image(&mut world.assets, 2, |_, _| [0.0; 3]);
            let stored = &mut world.assets.images[image.0 as usize];
            std::sync::Arc::make_mut(stored).texels = Texels::Rgb32(texels);
            // From the centre of one texel to that of the next.
            Some(world.assets.add_texture(Texture {
                color_space: ColorSpace::Linear,
                wrap: [Wrap::Clamp; 2],
                scale: Vec2::splat(0.5),
                offset: Vec2::splat(0.25),
                ..Texture::new(image)
            }))
        }
        Colors::Factors => None,
        Colors::Lookup => Some(vertex(&mut world, VertexChannel::All)),
    };
    if colors != Colors::Picture {
        mesh.colors = at_vertices;
    }
    let look = look(&mut world, texture);
    place_mesh(&mut world, mesh, look, Transform::IDENTITY);
    place_mesh(&mut world, stage::ceiling(1.0, 1.8), stage::matte(0.8), Transform::IDENTITY);
    world.entities.spawn((stage::point_light(100.0), stage::at(0.5, 1.6, 1.0)));
    Seen::of(&world)
}

/// The texture of what is at the vertices.
fn vertex(world: &mut World, channel: VertexChannel) -> TextureId {
    world.assets.add_procedure(Procedure::Combination(Combination::Vertex { channel }))
}

/// Vertex colours equal a texture that is as smooth, as factors and wherever a texture looks them up.
#[test]
fn vertex_colours_equal_a_smooth_texture() {
    let mut all = Relations::default();
    for transport in stage::BOTH {
        let diffuse = |_: &mut World, texture: Option<TextureId>| {
            let input = texture.map_or(grey(1.0), ColorInput::Texture);
            Material::BlinnPhong(BlinnPhong { diffuse: input, ..BlinnPhong::default() })
        };
        let picture = colored(transport, Colors::Picture, diffuse);
        all.equal(&picture, &colored(transport, Colors::Factors, diffuse), &format!("{transport:?} factors"));
        for what in USES {
            let by =
                |colors| colored(transport, colors, |_, texture| material(texture.expect("a texture"), what));
            all.equal(&by(Colors::Picture), &by(Colors::Lookup), &format!("{transport:?} {what:?}"));
        }
    }
}

/// A bump map of vertex colours equals one of a gradient.
#[test]
fn bumps_of_vertex_colours_are_slopes() {
    let mut all = Relations::default();
    let seen = |looked_up: bool| {
        let colors = if looked_up { Colors::Lookup } else { Colors::Picture };
        colored(Transport::Path, colors, |world, _| {
            // Slopes that differ by rounding would change which paths are drawn for reuse.
            world.settings.sharing = Sharing::Off;
            let red = if looked_up {
                vertex(world, VertexChannel::Red)
            } else {
                let mut texture = PatternTexture::new(TexturePattern::Gradient);
                texture.placement.a = ColorInput::Constant(Rgb::splat(0.1));
                texture.placement.b = ColorInput::Constant(Rgb::splat(0.9));
                world.assets.add_procedure(Procedure::Pattern(Box::new(texture)))
            };
            principled(|m| {
                (m.base_color, m.double_sided) = (grey(0.7), true);
                m.bump = Some(BumpMap { texture: red, channel: Channel::Red, height_m: 0.8 });
            })
        })
    };
    all.equal(&seen(true), &seen(false), "bump");
}

/// A constant channel equals a number.
#[test]
fn constant_channels_equal_numbers() {
    let mut all = Relations::default();
    let seen = |textured: bool| {
        let mut world = stage::world(Transport::Path, 12, 64);
        stage::sky(&mut world);
        camera(&mut world, [0.0, 1.5, 1.0], [0.0, 0.0, 0.0], 0.8);
        let image = stage::image(&mut world.assets, 1, |_, _| [0.5, 0.25, 0.75]);
        let texture =
            world.assets.add_texture(Texture { color_space: ColorSpace::Linear, ..Texture::new(image) });
        let of = |channel: Channel, value: f32| match textured {
            true => ScalarInput { factor: 0.8, texture: Some((texture, channel)) },
            false => number(0.8 * value),
        };
        let plain = principled(|m| {
            (m.metallic, m.roughness) = (of(Channel::Red, 0.5), of(Channel::Green, 0.25));
            (m.clearcoat, m.clearcoat_roughness) = (of(Channel::Blue, 0.75), of(Channel::Red, 0.5));
            (m.sheen_color, m.sheen_roughness) = (grey(0.5), of(Channel::Blue, 0.75));
            (m.transmission, m.alpha) = (of(Channel::Red, 0.5), of(Channel::Blue, 0.75));
            (m.alpha_mode, m.double_sided) = (AlphaMode::Blend, true);
        });
        place_mesh(&mut world, stage::floor(1.0, 0.0), plain, Transform::IDENTITY);
        Seen::of(&world)
    };
    all.equal(&seen(true), &seen(false), "channels");
}

/// Stripes on a floor viewed at a grazing angle, with two samples per pixel. Stripes along the view direction keep
/// their contrast, which an isotropic footprint would remove; those across are blurred before they alias. With many
/// samples the image equals the one without mip levels.
#[test]
fn textures_at_grazing_angles_are_sharp_without_aliasing() {
    let mut all = Relations::default();
    for transport in stage::BOTH {
        for away in [true, false] {
            let stripes = |filter: TextureFilter, samples: u32, seed: u64| {
                let mut world = stage::world(transport, 48, samples);
                (world.settings.max_depth, world.settings.seed) = (0, seed);
                camera(&mut world, [0.3, 0.6, 7.0], [0.0, 0.0, -1.0], 0.5);
                let image = stage::image(&mut world.assets, 128, |u, v| {
                    let along = if away { u } else { v };
                    [((along * 64.0) as u32 % 2) as f32; 3]
                });
                let texture = world.assets.add_texture(Texture { filter, ..Texture::new(image) });
                place_mesh(
                    &mut world,
                    stage::floor(8.0, 0.0),
                    material(texture, Use::Emission),
                    Transform::IDENTITY,
                );
                Seen::of(&world).pixels.iter().map(|pixel| f64::from(pixel.r)).collect::<Vec<_>>()
            };
            let truth = stripes(TextureFilter::Bilinear, 2048, 1);
            let error = |filter: TextureFilter, samples: u32| {
                let off = |seed: u64| {
                    let seen = stripes(filter, samples, seed);
                    seen.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / truth.len() as f64
                };
                ((0..8).map(off).sum::<f64>() / 8.0).sqrt()
            };
            let [plain, smooth] =
                [TextureFilter::Bilinear, TextureFilter::Trilinear].map(|filter| error(filter, 2));
            let what = format!("{transport:?}, stripes {}", if away { "away" } else { "across" });
            let most = if away { 0.85 } else { 0.7 };
            all.holds(smooth < most * plain, || {
                format!("{what}: {smooth:.4} beside {plain:.4} without copies")
            });
            let many = error(TextureFilter::Trilinear, 256);
            all.holds(many < 0.0056, || format!("{what}: {many:.5} at 256 samples, less than 45 dB"));
        }
    }
}
