//! Materials to columns of the Whitted transport.

use super::classic;
use crate::math::{NONE, Rgb};
use crate::scene::Materials;
use crate::scene::materials::{ColorColumn, flag};
use crate::world::assets::Assets;
use crate::world::{BlinnPhong, ColorInput, Highlight, Material};

pub(super) fn compile(assets: &Assets) -> Materials {
    let mut out = Materials::default();
    for (index, named) in assets.materials.iter().enumerate() {
        let name = named.name.clone().unwrap_or_else(|| match index {
            0 => "default".into(),
            _ => format!("material {index}"),
        });
        match &named.material {
            Material::BlinnPhong(material) => {
                push(&mut out, material, name);
            }
            Material::Principled(material) => {
                let classic = classic::from_principled(material, assets);
                let row = push(&mut out, &classic.material, name) as usize;
                out.diffuse.constant[row] = classic.diffuse.to_array();
                out.specular.constant[row] = classic.specular.to_array();
                out.kr.constant[row] = classic.kr.to_array();
            }
        }
    }
    out
}

/// Adds a row to every column; returns its index.
pub(super) fn push(out: &mut Materials, material: &BlinnPhong, name: String) -> u32 {
    push_color(&mut out.diffuse, material.diffuse);
    push_color(&mut out.specular, material.specular);
    push_color(&mut out.kr, material.kr);
    push_color(&mut out.emission, material.emission);
    out.kt.push(material.kt.to_array());
    out.shininess.push(material.shininess);
    out.flags.push(if material.highlight == Highlight::Phong { flag::PHONG } else { 0 });
    out.ior.push(material.ior.unwrap_or(0.0));
    out.names.push(name);
    out.names.len() as u32 - 1
}

fn push_color(column: &mut ColorColumn, input: ColorInput) {
    let (constant, texture) = match input {
        ColorInput::Constant(color) => (color, NONE),
        ColorInput::Texture(texture) => (Rgb::WHITE, texture.0),
    };
    column.constant.push(constant.to_array());
    column.texture.push(texture);
}
