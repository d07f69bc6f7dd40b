//! The value of a `map_…` line: options and a file name.

use crate::math::{Rgb, Vec2};
use crate::world::assets::{ColorSpace, ImageId, Wrap};
use crate::world::{Channel, Texture};

/// A file, and its mapping onto the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Map<'a> {
    /// The name as written; may contain spaces.
    pub file: &'a str,
    scale: Vec2,
    offset: Vec2,
    clamp: bool,
    linear: bool,
    /// The channel of a map of numbers, if it is given (`-imfchan`).
    pub channel: Option<Channel>,
    /// The factor on a map of normals (`-bm`).
    pub strength: f32,
}

/// All options, and the largest number of words that each takes.
const OPTIONS: [(&str, usize); 13] = [
    ("-s", 3),
    ("-o", 3),
    ("-t", 3),
    ("-mm", 2),
    ("-bm", 1),
    ("-boost", 1),
    ("-blendu", 1),
    ("-blendv", 1),
    ("-cc", 1),
    ("-clamp", 1),
    ("-colorspace", 1),
    ("-imfchan", 1),
    ("-texres", 1),
];

fn option(word: &str) -> Option<usize> {
    if word == "-type" {
        return Some(1);
    }
    OPTIONS.iter().find(|(name, _)| *name == word).map(|(_, words)| *words)
}

impl<'a> Map<'a> {
    /// Parses the value; none if it names no file. Options may precede or follow the name.
    pub fn parse(text: &'a str) -> Option<Map<'a>> {
        let mut map = Map {
            file: "",
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            linear: false,
            channel: None,
            strength: 1.0,
        };
        let mut rest = text.trim();
        while !rest.is_empty() {
            let (word, after) = split_word(rest);
            match option(word) {
                Some(most) => rest = map.read_option(word, most, after),
                None if map.file.is_empty() => {
                    let end = end_of_name(rest);
                    map.file = rest[..end].trim();
                    rest = &rest[end..];
                }
                None => break,
            }
        }
        (!map.file.is_empty()).then_some(map)
    }

    /// Reads an option's values; returns the text that follows them.
    fn read_option(&mut self, name: &str, most: usize, mut rest: &'a str) -> &'a str {
        let mut values = [0.0f32; 3];
        let mut count = 0;
        let mut first = "";
        while count < most {
            let (word, after) = split_word(rest);
            // If an option takes several numbers, all but the first are optional.
            let value = word.parse::<f32>().ok().filter(|value| value.is_finite());
            if count > 0 && value.is_none() {
                break;
            }
            if count == 0 {
                first = word;
            }
            values[count] = value.unwrap_or(0.0);
            count += 1;
            rest = after;
        }
        match name {
            "-s" => self.scale = Vec2::new(values[0], if count > 1 { values[1] } else { 1.0 }),
            "-o" => self.offset = Vec2::new(values[0], values[1]),
            "-clamp" => self.clamp = first == "on",
            "-bm" => self.strength = values[0],
            "-imfchan" => {
                self.channel = match first {
                    "r" => Some(Channel::Red),
                    "g" => Some(Channel::Green),
                    "b" => Some(Channel::Blue),
                    "m" => Some(Channel::Alpha),
                    _ => None,
                }
            }
            "-colorspace" => self.linear = first.eq_ignore_ascii_case("linear"),
            _ => {}
        }
        rest
    }

    /// Converts to a texture of numbers, which are used as stored.
    pub fn numbers(&self, image: ImageId) -> Texture {
        Texture { color_space: ColorSpace::Linear, ..self.texture(image, Rgb::WHITE) }
    }

    /// Converts to a texture, whose v points down: MTL's lookup at `v·s + o` from the bottom is one at
    /// `v·s + (1 − s − o)` from the top.
    pub fn texture(&self, image: ImageId, factor: Rgb) -> Texture {
        Texture {
            wrap: if self.clamp { [Wrap::Clamp; 2] } else { [Wrap::Repeat; 2] },
            scale: self.scale,
            offset: Vec2::new(self.offset.x, 1.0 - self.scale.y - self.offset.y),
            color_space: if self.linear { ColorSpace::Linear } else { ColorSpace::Srgb },
            factor,
            ..Texture::trilinear(image)
        }
    }
}

/// Splits off the first word.
fn split_word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    text.split_once(char::is_whitespace).map_or((text, ""), |(word, rest)| (word, rest.trim_start()))
}

/// The end of the name at the start of `text`: the next option, or the end of the text.
fn end_of_name(text: &str) -> usize {
    let mut rest = text;
    while !rest.is_empty() {
        let (word, after) = split_word(rest);
        if option(word).is_some() {
            return text.len() - rest.len();
        }
        rest = after;
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_found_before_and_after_options() {
        let file = |text| Map::parse(text).map(|map| map.file);
        assert_eq!(file("brick.png"), Some("brick.png"));
        assert_eq!(file("-s 0.1 0.2 specular.jpg"), Some("specular.jpg"));
        assert_eq!(file("-colorspace sRGB -o 0.1 diffuse.jpg"), Some("diffuse.jpg"));
        assert_eq!(file("-imfchan r bump map.jpg -bm 1.5"), Some("bump map.jpg"));
        assert_eq!(file("texture 01.png"), Some("texture 01.png"));
        assert_eq!(file("-type cube_top a-b -c.png"), Some("a-b -c.png"));
        assert_eq!(file("-mm 0.1 0.3 x.jpg"), Some("x.jpg"));
        assert_eq!(file("-clamp on"), None);
        assert_eq!(file("-s"), None);
        assert_eq!(file(""), None);
    }

    #[test]
    fn options_become_a_transform_and_a_wrap_mode() {
        let map = Map::parse("-s 2 4 1 -o 0.25 0.5 -clamp on -colorspace linear a.png").unwrap();
        let texture = map.texture(ImageId(7), Rgb::splat(0.5));
        assert_eq!((texture.image(), texture.factor), (Some(ImageId(7)), Rgb::splat(0.5)));
        assert_eq!((texture.wrap, texture.color_space), ([Wrap::Clamp; 2], ColorSpace::Linear));
        // MTL's v of 0.25 is looked up at 0.25 · 4 + 0.5 = 1.5 from the bottom; ours, 0.75, from the top.
        assert_eq!(0.75 * texture.scale.y + texture.offset.y, 1.0 - 1.5);
        assert_eq!(texture.offset.x, 0.25);
        assert_eq!(
            Map::parse("a.png").unwrap().texture(ImageId(0), Rgb::WHITE),
            Texture::trilinear(ImageId(0))
        );
    }
}
