//! Values in a world that its transport does not use.

use crate::error::Diagnostic;
use crate::world::ineffective::{
    Cause, FieldContext, Ineffective, OF_BLINN_PHONG, OF_CAMERAS, OF_LIGHTS, OF_PRINCIPLED, OF_SETTINGS,
};
use crate::world::{Camera, Light, Material, Transport, World};

/// One warning that lists all of them.
pub(super) fn by_transport(world: &World) -> Option<Diagnostic> {
    let (transport, other) = match world.settings.transport {
        Transport::Whitted => ("Whitted", "Path"),
        Transport::Path => ("path", "Whitted"),
    };
    let lights: Vec<Light> = world.entities.query::<&Light>().iter().cloned().collect();
    let cameras: Vec<Camera> = world.entities.query::<&Camera>().iter().copied().collect();
    let materials = || world.assets.materials.iter().map(|named| &named.material);
    let principled = materials().filter_map(|material| match material {
        Material::Principled(material) => Some(&**material),
        Material::BlinnPhong(_) => None,
    });
    let classic = materials().filter_map(|material| match material {
        Material::BlinnPhong(material) => Some(material),
        Material::Principled(_) => None,
    });
    let mut names = given(world, OF_SETTINGS, [&world.settings]);
    names.extend(given(world, OF_LIGHTS, &lights));
    names.extend(given(world, OF_PRINCIPLED, principled));
    names.extend(given(world, OF_BLINN_PHONG, classic));
    names.extend(given(world, OF_CAMERAS, &cameras));
    let list = names.join(", ");
    (!names.is_empty()).then(|| {
        let text = format!("the {transport} transport makes no use of {list}");
        Diagnostic::warning("unused-by-transport", text).fixed_by(format!("transport: {other} does"))
    })
}

/// The names of values that the transport does not use although some of the components give them.
fn given<'a, T>(
    world: &World,
    cases: &[Ineffective<T>],
    parts: impl IntoIterator<Item = &'a T>,
) -> Vec<&'static str> {
    let (context, parts) = (FieldContext::of(world), Vec::from_iter(parts));
    let name = |case: &Ineffective<T>| match case.cause {
        Cause::Transport(_, name) => {
            parts.iter().any(|part| case.is_mistaken(part, &context)).then_some(name)
        }
        Cause::Reason(_) => None,
    };
    cases.iter().filter_map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;
    use crate::math::{Rgb, Vec2};
    use crate::world::{ColorInput, Outline, Pattern, Principled, ScalarInput, Transform};

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
