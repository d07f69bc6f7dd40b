//! Values in a world that have no effect, whatever the transport.

use crate::error::{Diagnostic, words};
use crate::world::ineffective::{self, Cause, FieldContext, Ineffective};
use crate::world::{Background, Light, Material, MaterialId, Principled, World};

/// One warning for each kind.
pub(super) fn values(world: &World) -> Vec<Diagnostic> {
    let mut told: Vec<Diagnostic> = around(world).into_iter().chain(stretched(world)).collect();
    if world.settings.background != Background::default() {
        told.extend(world.hidden_background());
    }
    let context = FieldContext::of(world);
    let without_effect = |text: String| Diagnostic::warning("value-without-effect", text);
    for case in ineffective::OF_SETTINGS {
        if case.is_mistaken(&world.settings, &context) {
            told.extend(sentence(case).map(without_effect));
        }
    }
    if ineffective::has_idle_groups(world) {
        let text = "the groups of lights do nothing beside light_by_bounce: a film sums up light by lamp or by bounce";
        told.push(without_effect(text.into()));
    }
    for case in ineffective::OF_PRINCIPLED {
        let names = names(world, case);
        let sentence = sentence(case).filter(|_| !names.is_empty());
        told.extend(sentence.map(|text| without_effect(format!("{text}: {}", names.join(", ")))));
    }
    told
}

/// A case as a sentence about its first field; none if a transport is its cause.
fn sentence<T>(case: &Ineffective<T>) -> Option<String> {
    let Cause::Reason(reason) = case.cause else { return None };
    let field = case.fields[0].rsplit('.').next().unwrap_or_default();
    // The option is not called as the field is.
    let option = if field == "backplate" { " (--background)" } else { "" };
    Some(format!("{field}{option} does nothing {reason}"))
}

/// A warning about environments and skies after the first one, which counts.
fn around(world: &World) -> Option<Diagnostic> {
    let mut all = world.surroundings();
    let first = words(&world.name_of(all.next()?));
    let others: Vec<_> = all.take(4).collect();
    let is_sky =
        |entity| world.entities.get::<&Light>(entity).is_ok_and(|light| matches!(*light, Light::Sky { .. }));
    let suns = if others.iter().copied().any(is_sky) { ", except for the sun of a sky" } else { "" };
    (!others.is_empty()).then(|| {
        let names: Vec<String> = others.iter().map(|entity| words(&world.name_of(*entity))).collect();
        let names = names.join(", ");
        let text = format!(
            "a scene has one environment or sky, and \"{first}\" is the first: no light comes from {names}{suns}"
        );
        Diagnostic::warning("several-surroundings", text)
    })
}

/// A note about the image of an environment that is not twice as wide as it is high.
fn stretched(world: &World) -> Option<Diagnostic> {
    let entity = world.surroundings().next()?;
    let image = match *world.entities.get::<&Light>(entity).ok()? {
        Light::Environment { image, .. } => world.assets.images.get(image?.0 as usize)?,
        _ => return None,
    };
    let (width, height) = (u64::from(image.width), u64::from(image.height));
    // A single texel has no shape.
    if width * height == 1 || (19 * height..=21 * height).contains(&(10 * width)) {
        return None;
    }
    let what = "environments are equirectangular, twice as wide as high, so it is stretched over the sphere";
    let text =
        format!("\"{}\": its picture has {width}x{height} texels: {what}", words(&world.name_of(entity)));
    Some(Diagnostic::note("environment-stretched", text))
}

/// Up to four names of materials that are a case.
fn names(world: &World, case: &Ineffective<Principled>) -> Vec<String> {
    let context = FieldContext::of(world);
    let materials = (0u32..).zip(&world.assets.materials);
    let found = materials.filter(|(_, named)| match &named.material {
        Material::Principled(material) => case.is_mistaken(material, &context),
        Material::BlinnPhong(_) => false,
    });
    found.map(|(id, _)| words(&world.assets.material_name(MaterialId(id)))).take(4).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::world::{AlphaMode, Backplate, Light, ScalarInput, Transport, Volume};

    type Change = Box<dyn Fn(&mut Principled)>;

    fn said(change: impl Fn(&mut Principled)) -> Vec<String> {
        let mut world = World::default();
        let mut material = Principled { metallic: ScalarInput::constant(0.0), ..Principled::default() };
        change(&mut material);
        world.assets.add_material(Some("pane".into()), Material::Principled(Box::new(material)));
        values(&world).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn values_without_effect_give_warnings() {
        let half = ScalarInput::constant(0.5);
        let volume = Volume { attenuation_color: Rgb::splat(0.5), ..Volume::default() };
        let thick = Volume { attenuation_distance: 1.0, ..volume };
        let cases: [(&str, Change); 7] = [
            (
                "transmission does nothing on a metal",
                Box::new(move |m| (m.metallic, m.transmission) = (ScalarInput::constant(1.0), half)),
            ),
            ("alpha", Box::new(move |m| m.alpha = half)),
            ("dispersion", Box::new(move |m| (m.transmission, m.dispersion) = (half, 1.0))),
            ("attenuation_color", Box::new(move |m| (m.transmission, m.volume) = (half, Some(volume)))),
            ("volume", Box::new(move |m| m.volume = Some(thick))),
            (
                "multiscatter",
                Box::new(move |m| {
                    m.volume = Some(Volume { multiscatter_color: Rgb::WHITE, ..thick });
                }),
            ),
            (
                "multiscatter",
                Box::new(move |m| {
                    m.transmission = half;
                    m.volume = Some(Volume { multiscatter_color: Rgb::WHITE, ..Volume::default() });
                }),
            ),
        ];
        for (what, change) in cases {
            let told = said(change);
            assert!(
                told.len() == 1 && told[0].contains(what) && told[0].ends_with("pane"),
                "{what}: {told:?}"
            );
        }
        let whole: [Change; 5] = [
            Box::new(move |_| ()),
            Box::new(move |m| m.transmission = half),
            Box::new(move |m| (m.alpha, m.alpha_mode) = (half, AlphaMode::Blend)),
            Box::new(move |m| (m.transmission, m.volume, m.dispersion) = (half, Some(thick), 1.0)),
            Box::new(move |m| {
                m.transmission = half;
                m.volume = Some(Volume { multiscatter_color: Rgb::WHITE, ..thick });
            }),
        ];
        for change in whole {
            assert_eq!(said(change), Vec::<String>::new());
        }
    }

    #[test]
    fn surroundings_after_the_first_give_a_warning() {
        let mut world = World::default();
        let light = || Light::Environment { radiance: Rgb::WHITE, image: None };
        world.entities.spawn((crate::world::Name("first".into()), light()));
        assert_eq!(values(&world), []);
        world.entities.spawn((crate::world::Name("second".into()), light()));
        assert!(values(&world)[0].text.contains("no light comes from second"));
    }

    #[test]
    fn light_groups_beside_a_shadow_catcher_give_a_warning() {
        let mut world = World::default();
        (world.settings.transport, world.settings.light_groups) = (Transport::Path, true);
        assert_eq!(values(&world), []);
        let floor = Principled { shadow_catcher: true, ..Principled::default() };
        world.assets.add_material(Some("paper".into()), Material::Principled(Box::new(floor)));
        assert!(values(&world)[0].text.contains("light_groups does nothing"), "{:?}", values(&world));
    }

    #[test]
    fn a_backdrop_that_nobody_sees_gives_a_warning() {
        let mut world = World::default();
        world.settings.backdrop = Some(Background::Constant(Rgb::WHITE));
        assert_eq!(values(&world), []);
        world.settings.transparent = true;
        assert!(values(&world)[0].text.contains("backdrop does nothing in a transparent image"));
        world.settings.backdrop = None;
        world.settings.backplate = Some(Backplate::Constant(Rgb::WHITE));
        assert!(values(&world)[0].text.contains("backplate (--background) does nothing"));
        world.settings.transparent = false;
        assert_eq!(values(&world), []);
        world.settings.backdrop = Some(Background::Constant(Rgb::WHITE));
        assert!(values(&world)[0].text.contains("backdrop does nothing beside a backplate"));
    }
}
