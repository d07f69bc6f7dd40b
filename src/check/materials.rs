//! Checks for materials that are probably not what their authors mean.

use std::collections::HashSet;
use std::sync::Arc;

use super::{Checked, finding};
use crate::error::{Diagnostic, Subject};
use crate::math::Rgb;
use crate::world::assets::{ColorSpace, Image, NamedMaterial, Texels};
use crate::world::{AlphaMode, ColorInput, Material, MaterialId, Principled, Shape, TextureId, World};

pub(super) fn check(checked: &Checked, findings: &mut Vec<Diagnostic>) {
    let world = checked.world;
    for (number, named) in world.assets.materials.iter().enumerate().skip(1) {
        let mut find = |code, what: String, remedy: String| {
            // Only for a finding: without a name of its own, all entities are searched.
            let name = called(world, number, named);
            findings.push(finding(code, Some(Subject::named(name)), what, remedy));
        };
        if let Some((key, color)) = too_bright(named) {
            let most = color.max_component();
            let srgb = if most > 1.5 && most <= 255.0 { ": colours go from 0 to 1" } else { "" };
            find(
                "bright-material",
                format!("its {key} is {most}: surfaces cannot send back more light than they get{srgb}"),
                if most > 1.5 {
                    "divide it by 255, or write Srgb(…)".into()
                } else {
                    "use at most 1".into()
                },
            );
        }
        let Material::Principled(material) = &named.material else { continue };
        if is_gone(material) {
            find(
                "invisible-material",
                "nothing of it is there: its alpha is 0 everywhere".into(),
                "alpha: 1, or alpha_mode: Opaque".into(),
            );
        }
        color_spaces(world, material, &mut find);
    }
    colors_of_vertices(world, findings);
    missing_colors(world, findings);
}

/// Finds entities whose materials look up colours of vertices that their meshes do not have.
fn missing_colors(world: &World, findings: &mut Vec<Diagnostic>) {
    let looking = world.assets.looks_up_vertices();
    if !looking.contains(&true) {
        return;
    }
    for entity in world.in_order() {
        let Ok(shape) = world.entities.get::<&Shape>(entity) else { continue };
        let mesh = match *shape {
            Shape::Mesh(id) => world.assets.meshes.get(id.0 as usize),
            _ => None,
        };
        let has_them = mesh.is_some_and(|mesh| !mesh.colors.is_empty() || !mesh.alphas.is_empty());
        let own = mesh.map_or(&[][..], |mesh| &mesh.triangle_materials);
        let looks_up = match world.entities.get::<&MaterialId>(entity) {
            Ok(material) => looking[material.0 as usize],
            Err(_) => own.iter().any(|material| looking[material.0 as usize]),
        };
        if looks_up && !has_them {
            let what = "its material looks up the colours of vertices, and it has none: they are white";
            let remedy =
                "a mesh with colours, such as a glTF file with COLOR_0, or a colour in place of Vertex";
            findings.push(finding("no-vertex-colors", Some(world.subject(entity)), what, remedy));
        }
    }
}

/// Finds meshes whose vertices are brighter than white.
fn colors_of_vertices(world: &World, findings: &mut Vec<Diagnostic>) {
    let mut seen = HashSet::new();
    for entity in world.in_order() {
        let Ok(shape) = world.entities.get::<&Shape>(entity) else { continue };
        let Shape::Mesh(id) = *shape else { continue };
        let Some(mesh) = world.assets.meshes.get(id.0 as usize).filter(|_| seen.insert(id)) else { continue };
        let most = mesh.colors.iter().map(|color| color.max_component()).fold(0.0, f32::max);
        // Rounding is no mistake.
        if most > 1.001 {
            let what = format!(
                "the colours of its vertices go up to {most}: surfaces cannot send back more light than they get"
            );
            let remedy = format!("divide them by {most}, so that they go from 0 to 1");
            findings.push(finding("bright-material", Some(world.subject(entity)), what, remedy));
        }
    }
}

/// The name of a material, or that of the first entity that wears one without a name.
pub(super) fn called(world: &World, number: usize, named: &NamedMaterial) -> String {
    let has_it = |entity: &hecs::Entity| {
        world.entities.get::<&MaterialId>(*entity).is_ok_and(|material| material.0 as usize == number)
    };
    let wearer = || world.in_order().into_iter().find(has_it).map(|entity| world.name_of(entity));
    named.name.clone().or_else(wearer).unwrap_or_else(|| format!("material {number}"))
}

/// Returns a colour that makes a material reflect more light than it receives.
fn too_bright(named: &NamedMaterial) -> Option<(&'static str, Rgb)> {
    let colors = match &named.material {
        Material::BlinnPhong(m) => vec![("diffuse", m.diffuse), ("kr", m.kr)],
        Material::Principled(m) => vec![("base_color", m.base_color)],
    };
    colors.into_iter().find_map(|(key, color)| match color {
        ColorInput::Constant(color) if color.max_component() > 1.0 => Some((key, color)),
        _ => None,
    })
}

fn is_gone(material: &Principled) -> bool {
    let alpha = &material.alpha;
    match material.alpha_mode {
        AlphaMode::Opaque => false,
        AlphaMode::Blend => alpha.factor <= 0.0,
        AlphaMode::Mask { cutoff } => {
            alpha.factor < cutoff && alpha.texture.is_none() || alpha.factor <= 0.0 && cutoff > 0.0
        }
    }
}

/// Finds colour textures read without the sRGB curve, and data textures read with it.
fn color_spaces(world: &World, material: &Principled, find: &mut impl FnMut(&'static str, String, String)) {
    let is = |id: TextureId, space: ColorSpace| {
        let is_linear = |image: &Arc<Image>| matches!(image.texels, Texels::Rgb32(_));
        let may_differ = world.assets.image_of(id).is_some_and(|image| !is_linear(image));
        may_differ && world.assets.textures[id.0 as usize].color_space == space
    };
    let colors = [
        ("base_color", material.base_color),
        ("emission", material.emission),
        ("specular_color", material.specular_color),
        ("sheen_color", material.sheen_color),
    ];
    for (key, color) in colors {
        if let ColorInput::Texture(id) = color
            && is(id, ColorSpace::Linear)
        {
            find(
                "color-space",
                format!("the picture of its {key} is read as numbers, not as colours: it looks pale"),
                "leave color_space out, or color_space: Srgb".into(),
            );
        }
    }
    let scalars = [
        ("roughness", material.roughness.texture.map(|(id, _)| id)),
        ("metallic", material.metallic.texture.map(|(id, _)| id)),
        ("normal", material.normal.map(|map| map.texture)),
    ];
    for (key, id) in scalars {
        if id.is_some_and(|id| is(id, ColorSpace::Srgb)) {
            find(
                "color-space",
                format!("the picture of its {key} is read as colours, not as numbers"),
                "color_space: Linear".into(),
            );
        }
    }
}
