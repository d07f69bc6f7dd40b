//! Compiles images and textures to texels and columns.

mod mips;
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
use crate::world::assets::{Assets, ColorSpace, Image, Texels, Texture, TextureFilter, Wrap};
use crate::world::{AlphaMode, Channel, ColorInput, Material};

/// The kind of an image's mip levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct MipKind {
    /// True if texels are floats, not bytes.
    float: bool,
    /// True if there are smaller levels.
    smaller: bool,
    /// True if texels are means of light, not of stored values. An image may be read both ways; this is set if any
    /// texture needs it.
    srgb: bool,
    /// True if colours are weighted by their alpha.
    cut: bool,
}

/// All inputs of texels.
#[derive(PartialEq)]
pub(super) struct TextureInputs {
    images: Vec<ByPtr<Image>>,
    /// The kind of each image's levels.
    kinds: Vec<MipKind>,
    /// The textures, by which images are looked up.
    textures: DebugText,
}

impl TextureInputs {
    pub(super) fn new(assets: &Assets) -> TextureInputs {
        let images = memo::all(&assets.images);
        TextureInputs { images, kinds: kinds(assets), textures: debug_text(&assets.textures) }
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
    for texture in &assets.textures {
        let image = &assets.images[texture.image.0 as usize];
        push(&mut out, texture, image, &first_levels);
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
        let end = match image.texels {
            Texels::Rgba8(_) => &mut bytes,
            Texels::Rgb32(_) => &mut floats,
        };
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
        let mut room = match image.texels {
            Texels::Rgba8(_) => TexelsOut::Bytes(rest8.split_off_mut(..count).unwrap_or_default()),
            Texels::Rgb32(_) => TexelsOut::Floats(rest32.split_off_mut(..count).unwrap_or_default()),
        };
        let before = known.get(&Arc::as_ptr(image)).filter(|before| before.kind == *used);
        if before.is_some_and(|before| room.copy(before)) {
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
    kind: MipKind,
    texels8: &'a [u32],
    texels32: &'a [[f32; 3]],
}

/// The levels of all images, by the images' addresses.
fn known(before: &Memo<TextureInputs, Arc<Textures>>) -> HashMap<*const Image, KnownLevels<'_>> {
    let Memo { inputs: TextureInputs { images, kinds, .. }, output: made } = before;
    let (mut rest8, mut rest32) = (&made.texels8[..], &made.texels32[..]);
    let mut all = HashMap::with_capacity(images.len());
    for (ByPtr(image), kind) in images.iter().zip(kinds) {
        let sizes = mips::sizes([image.width as usize, image.height as usize], kind.smaller);
        let count = sizes.iter().map(|[width, height]| width * height).sum();
        let [bytes, floats] = if kind.float { [0, count] } else { [count, 0] };
        let texels8 = rest8.split_off(..bytes).unwrap_or_default();
        let texels32 = rest32.split_off(..floats).unwrap_or_default();
        all.insert(Arc::as_ptr(image), KnownLevels { kind: *kind, texels8, texels32 });
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
        float: matches!(image.texels, Texels::Rgb32(_)),
        ..MipKind::default()
    };
    let mut kinds: Vec<MipKind> = assets.images.iter().map(kind).collect();
    for texture in &assets.textures {
        let kind = &mut kinds[texture.image.0 as usize];
        kind.smaller |= texture.filter == TextureFilter::Trilinear;
        kind.srgb |= texture.color_space == ColorSpace::Srgb;
    }
    for material in &assets.materials {
        let Material::Principled(material) = &material.material else { continue };
        let alpha = material.alpha.texture.filter(|_| material.alpha_mode != AlphaMode::Opaque);
        if let (ColorInput::Texture(color), Some((alpha, Channel::Alpha))) = (&material.base_color, alpha) {
            let [color, alpha] = [*color, alpha].map(|id| assets.textures[id.0 as usize].image.0 as usize);
            kinds[color].cut |= color == alpha;
        }
    }
    kinds
}

fn push(out: &mut Textures, texture: &Texture, image: &Image, first_levels: &[u32]) {
    let mode = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Clamp => 1,
        Wrap::Mirror => 2,
    };
    let blends = texture.filter != TextureFilter::Nearest;
    let srgb = texture.color_space == ColorSpace::Srgb;
    let float = matches!(image.texels, Texels::Rgb32(_));
    let wrap = texture.wrap.map(mode);
    let first_level = first_levels[texture.image.0 as usize];
    let (sin, cos) = (libm::sin(texture.rotation as f64) as f32, libm::cos(texture.rotation as f64) as f32);
    let (sx, sy) = (texture.scale.x, texture.scale.y);
    let next = first_levels.get(texture.image.0 as usize + 1).copied();
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
    });
}
