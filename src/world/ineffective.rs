//! Cases in which fields of components do nothing: the page greys them out, and compilation warns of values that are
//! given nevertheless.

use hecs::Entity;

use super::components::{Falloff, Light, LightGroup, Pattern};
use super::material::{AlphaMode, BlinnPhong, ColorInput, Material, Principled, ScalarInput, Volume};
use super::settings::{Caustics, DepthLimits, Settings, Sharing, Transport};
use super::{Camera, FocusOn, PatternTexture, World};
use crate::math::Rgb;

/// A case in which fields of a component do nothing.
pub(crate) struct Ineffective<T: 'static> {
    /// The fields' keys, with those of their parts before them: `volume.thickness_m`. The key of a part stands for all
    /// of its fields.
    pub fields: &'static [&'static str],
    /// The cause.
    pub cause: Cause,
    /// True if it is the case, under the transport that the cause names.
    holds: fn(&T, &FieldContext) -> bool,
    /// True if a value is given that does nothing then and was probably meant to.
    is_given: fn(&T) -> bool,
}

/// The cause for which fields do nothing.
#[derive(Clone, Copy)]
pub(crate) enum Cause {
    /// A reason as it follows "does nothing".
    Reason(&'static str),
    /// A transport that makes no use of them, and their name in its warning.
    Transport(Transport, &'static str),
}

/// The things on which the effect of a component's fields depends.
pub(crate) struct FieldContext<'a> {
    pub world: &'a World,
    /// The entity of the component, if it has one.
    pub entity: Option<Entity>,
}

impl<'a> FieldContext<'a> {
    /// The context of a component that no entity has.
    pub fn of(world: &'a World) -> FieldContext<'a> {
        FieldContext { world, entity: None }
    }

    fn settings(&self) -> &Settings {
        &self.world.settings
    }
}

impl<T> Ineffective<T> {
    /// True if the fields do nothing.
    pub fn applies(&self, part: &T, context: &FieldContext) -> bool {
        let is_possible = match self.cause {
            Cause::Reason(_) => true,
            Cause::Transport(transport, _) => context.settings().transport == transport,
        };
        is_possible && (self.holds)(part, context)
    }

    /// True if the fields do nothing although one of them was probably meant to.
    pub fn is_mistaken(&self, part: &T, context: &FieldContext) -> bool {
        (self.is_given)(part) && self.applies(part, context)
    }

    /// The one of its fields that is at a path or is a part that contains it.
    pub fn field_at(&self, path: &str) -> Option<&'static str> {
        let contains = |field: &&str| {
            path.strip_prefix(*field).is_some_and(|inner| inner.is_empty() || inner.starts_with('.'))
        };
        self.fields.iter().copied().find(contains)
    }
}

/// The reason why a field does nothing, as it follows "does nothing"; none if it may do something.
#[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "the page shows it"))]
pub(crate) fn reason<T>(
    cases: &[Ineffective<T>],
    part: &T,
    context: &FieldContext,
    path: &str,
) -> Option<&'static str> {
    let case = cases.iter().find(|case| case.field_at(path).is_some() && case.applies(part, context))?;
    Some(match case.cause {
        Cause::Reason(reason) => reason,
        Cause::Transport(Transport::Whitted, _) => "under the Whitted transport",
        Cause::Transport(Transport::Path, _) => "under the path transport",
    })
}

type Holds<T> = fn(&T, &FieldContext) -> bool;
type Given<T> = fn(&T) -> bool;
type FieldKeys = &'static [&'static str];

/// Fields that do nothing for a reason; values there are harmless.
const fn idle<T>(fields: FieldKeys, reason: &'static str, holds: Holds<T>) -> Ineffective<T> {
    Ineffective { fields, cause: Cause::Reason(reason), holds, is_given: |_| false }
}

/// Fields that do nothing for a reason; a value that is given there is a mistake.
const fn mistake<T>(
    fields: FieldKeys,
    reason: &'static str,
    holds: Holds<T>,
    is_given: Given<T>,
) -> Ineffective<T> {
    Ineffective { fields, cause: Cause::Reason(reason), holds, is_given }
}

/// Fields of which the Whitted transport makes no use, with their name in its warning.
const fn whitted<T>(fields: FieldKeys, name: &'static str, is_given: Given<T>) -> Ineffective<T> {
    Ineffective { fields, cause: Cause::Transport(Transport::Whitted, name), holds: |_, _| true, is_given }
}

/// Fields of which the path transport makes no use.
const fn path<T>(
    fields: FieldKeys,
    name: &'static str,
    holds: Holds<T>,
    is_given: Given<T>,
) -> Ineffective<T> {
    Ineffective { fields, cause: Cause::Transport(Transport::Path, name), holds, is_given }
}

/// The cases of physically based materials.
pub(crate) const OF_PRINCIPLED: &[Ineffective<Principled>] = &[
    mistake(
        &["alpha"],
        "without alpha_mode: Blend or Mask",
        |m, _| m.alpha_mode == AlphaMode::Opaque,
        |m| m.alpha.factor < 1.0 || m.alpha.texture.is_some(),
    ),
    idle(
        &[
            "metallic", "edge_tint", "roughness", "normal", "bump", "emission", "shadow_catcher", "ior",
            "specular", "specular_color", "dispersion", "diffuse_transmission_color", "clearcoat",
            "clearcoat_roughness", "clearcoat_normal", "sheen_color", "sheen_roughness", "anisotropy",
            "iridescence", "caustics",
        ],
        "on an unlit surface",
        |m, _| m.unlit && m.volume.is_none(),
    ),
    mistake(
        &["transmission"],
        "on a metal, which lets no light through (metallic: 0 makes it glass)",
        |m, _| is_metal(m),
        transmits,
    ),
    idle(&["diffuse_transmission"], "on a metal, which lets no light through", |m, _| is_metal(m)),
    idle(&["diffuse_transmission"], "beside a transmission of 1", |m, _| is_one(m.transmission)),
    idle(&["specular", "specular_color"], "on a metal", |m, _| is_metal(m)),
    idle(&["ior"], "on a metal", |m, _| is_metal(m) && !enters(m)),
    idle(&["edge_tint"], "without metallic", |m, _| !exists(m.metallic)),
    idle(&["specular_color"], "without specular", |m, _| !exists(m.specular)),
    mistake(
        &["dispersion"],
        "without a volume: thin glass bends no light",
        |m, _| m.volume.is_none(),
        |m| m.dispersion > 0.0 && transmits(m),
    ),
    idle(&["dispersion"], "without a transmission", |m, _| !transmits(m)),
    mistake(
        &["volume"],
        "without a transmission or diffuse_transmission",
        |m, _| !enters(m),
        |m| {
            m.volume.is_some_and(|volume| {
                volume.attenuation_distance.is_finite() && volume.multiscatter_color.is_black()
            })
        },
    ),
    mistake(
        &["volume.attenuation_color"],
        "without an attenuation_distance_m",
        |m, _| m.volume.is_some_and(|volume| volume.attenuation_distance.is_infinite()),
        |m| m.volume.is_some_and(|volume| !passes_all(&volume) && volume.multiscatter_color.is_black()),
    ),
    mistake(
        &["volume.multiscatter_color"],
        "without an attenuation_color below 1, an attenuation_distance_m, and a transmission or diffuse_transmission",
        |m, _| m.volume.is_some_and(|volume| is_clear(&volume) || !enters(m)),
        |m| m.volume.is_some_and(|volume| !volume.multiscatter_color.is_black()),
    ),
    idle(&["volume.scatter_anisotropy"], "without a multiscatter_color that scatters", |m, _| {
        m.volume.is_some_and(|volume| is_clear(&volume) || volume.multiscatter_color.is_black())
    }),
    idle(&["diffuse_transmission_color"], "without a diffuse_transmission", |m, _| {
        !exists(m.diffuse_transmission)
    }),
    idle(&["clearcoat_roughness", "clearcoat_normal"], "without a clearcoat", |m, _| !exists(m.clearcoat)),
    idle(&["sheen_roughness"], "without a sheen_color", |m, _| is_black(m.sheen_color)),
    idle(&["anisotropy.rotation_degrees", "anisotropy.texture"], "without a strength", |m, _| {
        m.anisotropy.strength == 0.0
    }),
    idle(
        &[
            "iridescence.ior", "iridescence.thickness_minimum_nm", "iridescence.thickness_maximum_nm",
            "iridescence.thickness",
        ],
        "without a factor",
        |m, _| !exists(m.iridescence.factor),
    ),
    idle(&["iridescence.thickness_minimum_nm"], "without a texture of the thickness", |m, _| {
        m.iridescence.thickness.is_none()
    }),
    idle(&["caustics"], "while no photons are traced", |_, context| !context.settings().wants_photons()),
    whitted(&["clearcoat", "clearcoat_roughness", "clearcoat_normal"], "clearcoat", |m| exists(m.clearcoat)),
    whitted(&["sheen_color", "sheen_roughness"], "sheen", |m| !is_black(m.sheen_color)),
    whitted(&["anisotropy"], "anisotropy", |m| m.anisotropy.strength > 0.0),
    whitted(&["iridescence"], "iridescence", |m| exists(m.iridescence.factor)),
    whitted(&["dispersion"], "dispersion", |m| m.dispersion > 0.0),
    whitted(&["diffuse_transmission", "diffuse_transmission_color"], "diffuse_transmission", |m| {
        exists(m.diffuse_transmission)
    }),
    whitted(&["shadow_catcher"], "shadow_catcher", |m| m.shadow_catcher),
    Ineffective {
        fields: &["volume.attenuation_color", "volume.attenuation_distance_m"],
        cause: Cause::Transport(Transport::Whitted, "attenuation"),
        // It darkens thin sheets.
        holds: |m, _| m.volume.is_some_and(|volume| volume.thickness == 0.0),
        is_given: |m| m.volume.is_some_and(|volume| volume.attenuation_distance.is_finite()),
    },
    whitted(&["edge_tint"], "edge_tint", |_| false),
    whitted(&["specular", "specular_color"], "specular", |_| false),
];

/// The cases of classic materials.
pub(crate) const OF_BLINN_PHONG: &[Ineffective<BlinnPhong>] = &[
    idle(&["alpha"], "without alpha_mode: Blend or Mask", |m, _| m.alpha_mode == AlphaMode::Opaque),
    idle(&["kt", "priority"], "without an ior", |m, _| m.ior.is_none()),
    path(&["diffuse"], "diffuse of materials with an ior", |m, _| is_glass(m), |m| !is_black(m.diffuse)),
    path(
        &["kr"],
        "kr of materials with an ior",
        |m, _| is_glass(m),
        |m| !matches!(m.kr, ColorInput::Constant(color) if color == Rgb::WHITE),
    ),
    path(&["specular", "shininess"], "specular", |m, _| is_glass(m), |_| false),
    path(&["highlight"], "highlight", |_, _| true, |_| false),
    idle(&["shininess", "highlight"], "without a specular", |m, _| is_black(m.specular)),
    idle(&["caustics"], "while no photons are traced", |_, context| !context.settings().wants_photons()),
];

/// The cases of lights.
pub(crate) const OF_LIGHTS: &[Ineffective<Light>] = &[
    idle(&["radius_m"], "with constant falloff", |light, _| {
        use Light::{Point, Spot};
        matches!(light, Point { falloff: Falloff::Constant, .. } | Spot { falloff: Falloff::Constant, .. })
    }),
    idle(&["sun_degrees"], "without a sun", |light, _| matches!(light, Light::Sky { sun: 0.0, .. })),
    whitted(
        &["radius_m"],
        "the radius of point lights and spots",
        |light| matches!(light, Light::Point { radius_m, .. } | Light::Spot { radius_m, .. } if *radius_m > 0.0),
    ),
    whitted(
        &["angle_degrees"],
        "the angle of directional lights",
        |light| matches!(light, Light::Directional { angle, .. } if *angle > 0.0),
    ),
    whitted(
        &["sun_degrees"],
        "sun_degrees",
        |light| matches!(light, Light::Sky { sun_angle, .. } if *sun_angle != Light::SUN_ANGLE),
    ),
    path(
        &["samples"],
        "the samples of area lights",
        |_, _| true,
        |light| matches!(light, Light::Area { samples, .. } if *samples > 1),
    ),
    path(
        &["pattern"],
        "the pattern of area lights",
        |_, _| true,
        |light| matches!(light, Light::Area { pattern, .. } if *pattern != Pattern::default()),
    ),
    // The sun of a sky gives light in any case.
    idle(&["radiance", "image"], "beside another environment or sky, which comes first", |light, context| {
        matches!(light, Light::Environment { .. }) && context.world.surroundings().next() != context.entity
    }),
];

/// The cases of cameras.
pub(crate) const OF_CAMERAS: &[Ineffective<Camera>] = &[
    idle(&["focus_distance_m", "aperture", "pattern"], "without a lens_radius_m", |camera, _| {
        matches!(camera, Camera::ThinLens { lens_radius_m: 0.0, .. })
    }),
    idle(&["focus_distance_m", "tilt_degrees", "aperture", "pattern"], "without an f_stop", |camera, _| {
        matches!(camera, Camera::Photographic { f_stop: None, .. })
    }),
    idle(&["focus_distance_m"], "beside a focus_on", |_, context| {
        context.entity.is_some_and(|entity| context.world.entities.satisfies::<&FocusOn>(entity))
    }),
    path(
        &["pattern"],
        "the pattern of lenses",
        |_, _| true,
        |camera| matches!(camera, Camera::ThinLens { pattern, .. } if *pattern != Pattern::default()),
    ),
];

/// The cases of patterns.
#[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "the page shows it"))]
pub(crate) const OF_PATTERNS: &[Ineffective<PatternTexture>] =
    &[idle(&["a", "b"], "beside stops", |texture, _| !texture.placement.stops.is_empty())];

const CATCHERS: &str = "beside shadow catchers, which have sums of their own";
const TRANSPARENT: &str = "in a transparent image, which shows nothing behind things";

/// The cases of the settings.
pub(crate) const OF_SETTINGS: &[Ineffective<Settings>] = &[
    whitted(&["diffuse_depth"], "diffuse_depth", |s| s.depth_limits.diffuse.is_some()),
    whitted(&["glossy_depth"], "glossy_depth", |s| s.depth_limits.glossy.is_some()),
    whitted(&["transmission_depth"], "transmission_depth", |s| s.depth_limits.transmission.is_some()),
    whitted(&["roulette_depth"], "roulette_depth", |s| {
        s.roulette_depth != Settings::default().roulette_depth
    }),
    whitted(&["clamp"], "clamp", |s| s.clamp.is_some()),
    whitted(&["filter_glossy"], "filter_glossy", |s| s.filter_glossy > 0.0),
    whitted(&["sampler"], "sampler", |s| s.sampler != Settings::default().sampler),
    whitted(&["sharing"], "sharing", |s| matches!(s.sharing, Sharing::Groups(_))),
    path(&["ambient"], "ambient", |_, _| true, |s| !s.ambient.is_black()),
    path(
        &["min_throughput"],
        "min_throughput",
        |_, _| true,
        |s| s.min_throughput != Settings::default().min_throughput,
    ),
    path(
        &["pixel_pattern"],
        "pixel_pattern",
        |_, _| true,
        |s| s.pixel_pattern != Settings::default().pixel_pattern,
    ),
    idle(&["diffuse_depth", "glossy_depth", "transmission_depth"], "with max_depth: 0", |s, _| {
        s.max_depth == 0
    }),
    mistake(
        &["caustics"],
        "without bounces, which max_depth and diffuse_depth allow",
        |s, _| !s.allows_caustics(),
        |s| matches!(s.caustics, Caustics::Photons { .. }),
    ),
    idle(&["caustics"], "beside shadow catchers", catches),
    idle(&["sharing"], "beside depth limits, which apply to each path by itself", |s, _| {
        s.is_for_single_paths()
    }),
    mistake(&["backdrop"], TRANSPARENT, |s, _| s.transparent, |s| s.backdrop.is_some()),
    mistake(
        &["backplate"],
        TRANSPARENT,
        |s, _| s.transparent,
        |s| s.backdrop.is_none() && s.backplate.is_some(),
    ),
    mistake(
        &["backdrop"],
        "beside a backplate (--background), which is shown in its place",
        |s, _| s.backplate.is_some() && !s.transparent,
        |s| s.backdrop.is_some(),
    ),
    idle(&["background"], "beside an environment or a sky", |_, context| {
        context.world.surroundings().next().is_some()
    }),
    mistake(&["light_groups"], CATCHERS, catches, |s| s.light_groups),
    mistake(&["light_by_bounce"], CATCHERS, catches, |s| s.light_by_bounce && !s.light_groups),
    mistake(
        &["light_groups"],
        "beside light_by_bounce: a film sums up light by lamp or by bounce",
        |s, context| s.light_by_bounce && !catches(s, context),
        |s| s.light_groups,
    ),
];

impl Settings {
    /// True if paths may reach a matte surface by way of another surface, as the light of photons does.
    pub(crate) fn allows_caustics(&self) -> bool {
        let is_forbidden = self.transport == Transport::Path && self.depth_limits.diffuse == Some(0);
        self.max_depth > 0 && !is_forbidden
    }

    /// True if photons are traced where the scene allows for them.
    pub(crate) fn wants_photons(&self) -> bool {
        let is_off = match self.caustics {
            Caustics::Off => true,
            Caustics::Auto => self.transport == Transport::Whitted,
            Caustics::Photons { .. } => false,
        };
        !is_off && self.allows_caustics()
    }

    /// True if limits apply to each path by itself, so that pixels reuse no paths of others.
    pub(crate) fn is_for_single_paths(&self) -> bool {
        self.depth_limits != DepthLimits::default()
    }
}

/// True if lights have groups that their film does not sum up, because it sums up bounces.
pub(crate) fn has_idle_groups(world: &World) -> bool {
    let Settings { light_groups, light_by_bounce, .. } = world.settings;
    light_by_bounce
        && !light_groups
        && !catches(&world.settings, &FieldContext::of(world))
        && world.entities.query::<&LightGroup>().iter().next().is_some()
}

fn catches(settings: &Settings, context: &FieldContext) -> bool {
    settings.transport == Transport::Path && has_catcher(context.world)
}

fn has_catcher(world: &World) -> bool {
    world.assets.materials.iter().any(|named| match &named.material {
        Material::Principled(material) => material.shadow_catcher,
        Material::BlinnPhong(_) => false,
    })
}

fn exists(input: ScalarInput) -> bool {
    input.factor > 0.0
}

fn is_one(input: ScalarInput) -> bool {
    input.factor >= 1.0 && input.texture.is_none()
}

fn is_black(input: ColorInput) -> bool {
    matches!(input, ColorInput::Constant(color) if color.is_black())
}

fn is_metal(m: &Principled) -> bool {
    is_one(m.metallic)
}

fn transmits(m: &Principled) -> bool {
    exists(m.transmission)
}

fn enters(m: &Principled) -> bool {
    transmits(m) || exists(m.diffuse_transmission)
}

fn passes_all(volume: &Volume) -> bool {
    volume.attenuation_color.to_array().iter().all(|part| *part >= 1.0)
}

fn is_clear(volume: &Volume) -> bool {
    passes_all(volume) || volume.attenuation_distance.is_infinite()
}

/// True if the path transport takes it for glass.
fn is_glass(m: &BlinnPhong) -> bool {
    m.ior.is_some() && !m.is_dissolved()
}
