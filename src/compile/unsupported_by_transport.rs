//! Values in a world that its transport does not use.

use crate::error::Diagnostic;
use crate::math::Rgb;
use crate::world::{
    Camera, ColorInput, Light, Material, Pattern, Principled, ScalarInput, Settings, Sharing, Transport,
    World,
};

/// One warning that lists all of them.
pub(super) fn by_transport(world: &World) -> Option<Diagnostic> {
    let (names, transport, other) = match world.settings.transport {
        Transport::Whitted => (by_whitted(world), "Whitted", "Path"),
        Transport::Path => (by_path(world), "path", "Whitted"),
    };
    let list = names.join(", ");
    (!names.is_empty()).then(|| {
        let text = format!("the {transport} transport makes no use of {list}");
        Diagnostic::warning("unused-by-transport", text).fixed_by(format!("transport: {other} does"))
    })
}

fn by_whitted(world: &World) -> Vec<&'static str> {
    let (settings, usual) = (&world.settings, Settings::default());
    let mut names: Vec<&str> = settings.depth_limits.given().map(|(name, _)| name).collect();
    let mut note = |name, is_said: bool| names.extend(is_said.then_some(name));
    note("roulette_depth", settings.roulette_depth != usual.roulette_depth);
    note("clamp", settings.clamp.is_some());
    note("sampler", settings.sampler != usual.sampler);
    note("sharing", matches!(settings.sharing, Sharing::Groups(_)));
    let wide = |light: &Light| matches!(light, Light::Directional { angle, .. } if *angle > 0.0);
    note("the angle of directional lights", world.entities.query::<&Light>().iter().any(wide));
    for (name, says) in OF_SURFACES {
        let says = |material: &Material| match material {
            Material::Principled(material) => says(material),
            Material::BlinnPhong(_) => false,
        };
        note(name, world.assets.materials.iter().any(|named| says(&named.material)));
    }
    names
}

fn by_path(world: &World) -> Vec<&'static str> {
    let (settings, usual) = (&world.settings, Settings::default());
    let mut names = Vec::new();
    let mut note = |name, is_said: bool| names.extend(is_said.then_some(name));
    note("ambient", !settings.ambient.is_black());
    note("min_throughput", settings.min_throughput != usual.min_throughput);
    note("pixel_pattern", settings.pixel_pattern != usual.pixel_pattern);
    let lights = &mut world.entities.query::<&Light>();
    let areas = lights.iter().filter_map(|light| match light {
        Light::Area { samples, pattern, .. } => Some((*samples, *pattern)),
        _ => None,
    });
    let areas: Vec<(u32, Pattern)> = areas.collect();
    note("the samples of area lights", areas.iter().any(|(samples, _)| *samples > 1));
    note("the pattern of area lights", areas.iter().any(|(_, pattern)| *pattern != Pattern::default()));
    let glass = world.assets.materials.iter().filter_map(|named| match &named.material {
        Material::BlinnPhong(m) if m.ior.is_some() && super::materials::from_dissolve(m).is_none() => Some(m),
        _ => None,
    });
    let glass: Vec<_> = glass.collect();
    note("diffuse of materials with an ior", glass.iter().any(|m| !is_black(m.diffuse)));
    let is_white = |kr| matches!(kr, ColorInput::Constant(color) if color == Rgb::WHITE);
    note("kr of materials with an ior", glass.iter().any(|m| !is_white(m.kr)));
    let spread = |camera: &Camera| matches!(camera, Camera::ThinLens { pattern, .. } if *pattern != Pattern::default());
    note("the pattern of lenses", world.entities.query::<&Camera>().iter().any(spread));
    names
}

type IsUsed = fn(&Principled) -> bool;

/// Features of physically based surfaces that [`super::classic`] leaves out, with a test for each.
const OF_SURFACES: [(&str, IsUsed); 10] = [
    ("normal maps", |m| m.normal.is_some()),
    ("bump maps", |m| m.bump.is_some()),
    ("clearcoat", |m| exists(m.clearcoat)),
    ("sheen", |m| !is_black(m.sheen_color)),
    ("anisotropy", |m| m.anisotropy.strength > 0.0),
    ("iridescence", |m| exists(m.iridescence.factor)),
    ("dispersion", |m| m.dispersion > 0.0),
    ("diffuse_transmission", |m| exists(m.diffuse_transmission)),
    ("shadow_catcher", |m| m.shadow_catcher),
    ("attenuation", |m| m.volume.is_some_and(|volume| volume.attenuation_distance.is_finite())),
];

fn exists(input: ScalarInput) -> bool {
    input.factor > 0.0
}

fn is_black(input: ColorInput) -> bool {
    matches!(input, ColorInput::Constant(color) if color.is_black())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;
    use crate::math::Vec2;
    use crate::world::{Outline, Transform};

    #[test]
    fn values_that_the_transport_ignores_give_a_warning() {
        let said = |change: fn(&mut World)| {
            let mut world = World::default();
            world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 }, Transform::IDENTITY));
            change(&mut world);
            let warnings = compile(&world, None).expect("a scene").warnings;
            let found = warnings.iter().find(|warning| warning.code == "unused-by-transport");
            found.map(ToString::to_string)
        };
        assert_eq!(said(|_| ()), None);
        assert_eq!(said(|world| world.settings.transport = Transport::Path), None);
        let whitted = said(|world| {
            world.settings.clamp = Some(3.0);
            world.settings.depth_limits.glossy = Some(1);
            let sun = Light::Directional { irradiance: Rgb::WHITE, angle: 0.01 };
            world.entities.spawn((sun, Transform::IDENTITY));
            let paint = Principled {
                clearcoat: ScalarInput::constant(1.0),
                sheen_color: ColorInput::Constant(Rgb::WHITE),
                shadow_catcher: true,
                ..Principled::default()
            };
            world.assets.add_material(None, Material::Principled(Box::new(paint)));
        });
        let expected = "the Whitted transport makes no use of glossy_depth, clamp, the angle of directional \
                        lights, clearcoat, sheen, shadow_catcher (transport: Path does)";
        assert_eq!(whitted.as_deref(), Some(expected));
        let path = said(|world| {
            world.settings.transport = Transport::Path;
            world.settings.ambient = Rgb::WHITE;
            let lamp = Light::Area {
                power_w: Rgb::WHITE,
                radiance: Rgb::BLACK,
                size_m: Vec2::ONE,
                outline: Outline::default(),
                samples: 4,
                pattern: Pattern::Uniform,
                visible: true,
            };
            world.entities.spawn((lamp, Transform::IDENTITY));
        });
        let expected = "the path transport makes no use of ambient, the samples of area lights, the pattern of \
                        area lights (transport: Whitted does)";
        assert_eq!(path.as_deref(), Some(expected));
        // Values on neither list are used by both transports.
        let plain = |world: &mut World| {
            let plain = Material::Principled(Box::default());
            world.assets.add_material(None, plain);
        };
        assert_eq!(said(plain), None);
    }
}
