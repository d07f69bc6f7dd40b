//! Compiles images and textures to texels and columns.

mod mips;
mod procedures;
mod srgb;

use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use self::mips::{MipJob, TexelsOut};
use super::memo::{self, ByPtr, DebugText, Memo, debug_text};
use crate::error::CompileError;
use crate::film::tonemap::srgb_decode;
use crate::memory;
use crate::scene::Textures;
use crate::scene::textures::SampledTexture;
use crate::world::assets::{Assets, ColorSpace, Image, Texels, Texture, TextureFilter, TextureSource, Wrap};
use crate::world::{AlphaMode, Channel, ColorInput, Material, fields};

/// The kind of an image's mip levels. Images of 16 bits are compiled to floats, decoded as their textures say, or to
/// bytes if their alpha is used, which floats lack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
struct MipKind {
    /// True if texels are floats, not bytes.
    float: bool,
    /// True if there are smaller levels.
    smaller: bool,
    /// True if texels are means of light, not of stored values. Bytes may be read both ways; this is set if any texture
    /// needs it.
    srgb: bool,
    /// True if colours are weighted by their alpha.
    cut: bool,
}

/// All inputs of texels.
#[derive(PartialEq)]
pub(super) struct TextureInputs {
    /// The images; one of 16 bits is listed twice if it is read both as colours and as numbers.
    images: Vec<ByPtr<Image>>,
    /// The kind of each image's levels.
    kinds: Vec<MipKind>,
    /// The place in `images` of each texture's image.
    places: Vec<u32>,
    /// The textures, by which images are looked up, and those that are computed.
    textures: [DebugText; 2],
}

impl TextureInputs {
    pub(super) fn new(assets: &Assets) -> TextureInputs {
        let mut images = memo::all(&assets.images);
        let mut kinds = kinds(assets);
        let is_float = |place: usize| kinds[place].float;
        let is_wide = |place: usize| matches!(assets.images[place].texels, Texels::Rgba16(_));
        // Floats of 16-bit images are decoded beforehand: in one way each.
        let mut second = HashMap::new();
        let mut place = |texture: &Texture| {
            let Some(image) = texture.image() else { return 0 };
            let place = image.0 as usize;
            if !is_wide(place)
                || !is_float(place)
                || (texture.color_space == ColorSpace::Srgb) == kinds[place].srgb
            {
                return place as u32;
            }
            let end = images.len() + second.len();
            *second.entry(place).or_insert(end) as u32
        };
        let places = assets.textures.iter().map(&mut place).collect();
        let mut second: Vec<(usize, usize)> = second.into_iter().collect();
        second.sort_unstable_by_key(|(_, end)| *end);
        for (place, _) in second {
            images.push(ByPtr(assets.images[place].clone()));
            kinds.push(MipKind { srgb: !kinds[place].srgb, ..kinds[place] });
        }
        TextureInputs {
            images,
            kinds,
            places,
            textures: [debug_text(&assets.textures), debug_text(&assets.procedures)],
        }
    }
}

/// Compiles all textures. `before` may have been made from some of the same images: their texels are copied, or shared
/// if all are the same.
pub(super) fn compile(
    assets: &Assets,
    inputs: &TextureInputs,
    before: Option<&Memo<TextureInputs, Arc<Textures>>>,
) -> Result<Arc<Textures>, CompileError> {
    let unit = |i: u16| f32::from(i) / 255.0;
    let decode = (0..256).map(unit).chain((0..256).map(|i| srgb_decode(unit(i))));
    let mut out = Textures { decode: decode.collect(), ..Textures::default() };
    let first_levels = levels(inputs, &mut out, before)?;
    for (texture, place) in assets.textures.iter().zip(&inputs.places) {
        let place = *place as usize;
        match texture.source {
            TextureSource::Image(_) => {
                push(&mut out, texture, inputs.kinds[place].float, &first_levels[place..]);
            }
            TextureSource::Procedure(id) => procedures::push(&mut out, assets, texture, id)?,
        }
    }
    Ok(Arc::new(out))
}

/// Makes the texels of all images and their levels. Returns the first level of each image.
fn levels(
    inputs: &TextureInputs,
    out: &mut Textures,
    before: Option<&Memo<TextureInputs, Arc<Textures>>>,
) -> Result<Vec<u32>, CompileError> {
    let TextureInputs { images, kinds, .. } = inputs;
    let mut first_levels = Vec::with_capacity(images.len());
    let mut sizes = Vec::with_capacity(images.len());
    let (mut bytes, mut floats) = (0, 0);
    for (ByPtr(image), used) in images.iter().zip(kinds) {
        let end = if used.float { &mut floats } else { &mut bytes };
        let own = [image.width as usize, image.height as usize];
        let levels = mips::sizes(own, used.smaller);
        first_levels.push(out.levels.first.len() as u32);
        for [width, height] in &levels {
            out.levels.first.push(*end as u32);
            out.levels.width.push(*width as f32);
            out.levels.height.push(*height as f32);
            *end += width * height;
        }
        sizes.push(levels);
    }
    // Lanes address texels with signed 32-bit numbers.
    if bytes.max(floats * 3) > i32::MAX as usize {
        return Err(CompileError::TooLarge(
            "its textures have more than 2³¹ texels: use smaller ones".into(),
        ));
    }
    if let Some(before) =
        before.filter(|before| (&before.inputs.images, &before.inputs.kinds) == (images, kinds))
    {
        (out.texels8, out.texels32) = (before.output.texels8.clone(), before.output.texels32.clone());
        return Ok(first_levels);
    }
    let what = format_args!("the texels of {} pictures, smaller copies and all,", images.len());
    let _claim = memory::reserve(what, 4 * bytes as u64 + 12 * floats as u64)?;
    let known: HashMap<_, _> = before.map(known).unwrap_or_default();
    let (mut texels8, mut texels32) = (vec![0; bytes], vec![[0.0; 3]; floats]);
    let (mut rest8, mut rest32) = (&mut texels8[..], &mut texels32[..]);
    let (linear, curved) = out.decode.split_at(256);
    let mut work = Vec::with_capacity(images.len());
    for ((ByPtr(image), used), sizes) in images.iter().zip(kinds).zip(sizes) {
        let count = sizes.iter().map(|[width, height]| width * height).sum();
        let mut room = match used.float {
            false => TexelsOut::Bytes(rest8.split_off_mut(..count).unwrap_or_default()),
            true => TexelsOut::Floats(rest32.split_off_mut(..count).unwrap_or_default()),
        };
        if known.get(&(Arc::as_ptr(image), *used)).is_some_and(|before| room.copy(before)) {
            continue;
        }
        let decode = [if used.srgb { curved } else { linear }, linear];
        work.push(MipJob { texels: &image.texels, sizes, room, decode, srgb: used.srgb, cut: used.cut });
    }
    let (large, small): (Vec<_>, Vec<_>) = work.into_iter().partition(MipJob::is_large);
    large.into_iter().for_each(MipJob::run);
    small.into_par_iter().for_each(MipJob::run);
    (out.texels8, out.texels32) = (Arc::new(texels8), Arc::new(texels32));
    Ok(first_levels)
}

/// The levels of an image that were made before.
struct KnownLevels<'a> {
    texels8: &'a [u32],
    texels32: &'a [[f32; 3]],
}

/// The levels of all images, by the images' addresses and the levels' kinds.
fn known(before: &Memo<TextureInputs, Arc<Textures>>) -> HashMap<(*const Image, MipKind), KnownLevels<'_>> {
    let Memo { inputs: TextureInputs { images, kinds, .. }, output: made } = before;
    let (mut rest8, mut rest32) = (&made.texels8[..], &made.texels32[..]);
    let mut all = HashMap::with_capacity(images.len());
    for (ByPtr(image), kind) in images.iter().zip(kinds) {
        let sizes = mips::sizes([image.width as usize, image.height as usize], kind.smaller);
        let count = sizes.iter().map(|[width, height]| width * height).sum();
        let [bytes, floats] = if kind.float { [0, count] } else { [count, 0] };
        let texels8 = rest8.split_off(..bytes).unwrap_or_default();
        let texels32 = rest32.split_off(..floats).unwrap_or_default();
        all.insert((Arc::as_ptr(image), *kind), KnownLevels { texels8, texels32 });
    }
    all
}

impl TexelsOut<'_> {
    /// Copies known texels if they fill the room exactly; returns true if so.
    fn copy(&mut self, known: &KnownLevels) -> bool {
        match self {
            TexelsOut::Bytes(room) if room.len() == known.texels8.len() => {
                room.copy_from_slice(known.texels8);
            }
            TexelsOut::Floats(room) if room.len() == known.texels32.len() => {
                room.copy_from_slice(known.texels32);
            }
            _ => return false,
        }
        true
    }
}

fn kinds(assets: &Assets) -> Vec<MipKind> {
    let kind = |image: &Arc<Image>| MipKind {
        float: !matches!(image.texels, Texels::Rgba8(_)),
        ..MipKind::default()
    };
    let mut kinds: Vec<MipKind> = assets.images.iter().map(kind).collect();
    for texture in &assets.textures {
        let Some(image) = texture.image() else { continue };
        let kind = &mut kinds[image.0 as usize];
        kind.smaller |= texture.filter == TextureFilter::Trilinear;
        kind.srgb |= texture.color_space == ColorSpace::Srgb;
    }
    for material in &assets.materials {
        fields::for_each_texture(material.material.clone().part(), &mut |id, channel| {
            let Some(image) = assets.textures[id.0 as usize].image() else { return };
            let place = image.0 as usize;
            let is_wide = matches!(assets.images[place].texels, Texels::Rgba16(_));
            kinds[place].float &= !(is_wide && channel == Some(Channel::Alpha));
        });
        let Material::Principled(material) = &material.material else { continue };
        let alpha = material.alpha.texture.filter(|_| material.alpha_mode != AlphaMode::Opaque);
        if let (ColorInput::Texture(color), Some((alpha, Channel::Alpha))) = (&material.base_color, alpha) {
            let [color, alpha] = [*color, alpha].map(|id| assets.textures[id.0 as usize].image());
            if let Some(image) = color.filter(|_| color == alpha) {
                kinds[image.0 as usize].cut = true;
            }
        }
    }
    kinds
}

/// Adds a texture; the first levels are those of its image and of the images after it.
fn push(out: &mut Textures, texture: &Texture, float: bool, first_levels: &[u32]) {
    let blends = texture.filter != TextureFilter::Nearest;
    let srgb = texture.color_space == ColorSpace::Srgb;
    let wrap = texture.wrap.map(Wrap::number);
    let first_level = first_levels[0];
    let (sin, cos) = (libm::sin(texture.rotation as f64) as f32, libm::cos(texture.rotation as f64) as f32);
    let (sx, sy) = (texture.scale.x, texture.scale.y);
    let next = first_levels.get(1).copied();
    let end = next.unwrap_or(out.levels.first.len() as u32);
    out.sampled.push(SampledTexture {
        matrix: [[cos * sx, sin * sy, texture.offset.x], [-sin * sx, cos * sy, texture.offset.y]],
        uv_set: texture.uv_set,
        factor: texture.factor.to_array(),
        blends,
        srgb,
        float,
        wrap,
        first_level,
        smaller_levels: if texture.filter == TextureFilter::Trilinear { end - first_level - 1 } else { 0 },
        program: [0; 2],
        levels: [0.0; 2],
    });
}
