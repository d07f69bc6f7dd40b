use super::*;
use crate::math::Vec3;
use crate::world::shapes::tests::{area_of, assert_sound, is_closed, volume_of};

/// A contour: points in units of the font, and whether each is on the curve.
type Outline = Vec<(i16, i16, bool)>;

fn square(x: i16, y: i16, side: i16, clockwise: bool) -> Outline {
    let mut points = vec![(x, y, true), (x, y + side, true), (x + side, y + side, true), (x + side, y, true)];
    if !clockwise {
        points.reverse();
    }
    points
}

fn glyph(contours: &[Outline]) -> Vec<u8> {
    if contours.is_empty() {
        return Vec::new();
    }
    let points: Vec<_> = contours.concat();
    let mut bytes = Vec::new();
    let mut word = |value: i16| bytes.extend(value.to_be_bytes());
    word(contours.len() as i16);
    let (xs, ys) = (points.iter().map(|p| p.0), points.iter().map(|p| p.1));
    [xs.clone().min(), ys.clone().min(), xs.max(), ys.max()].into_iter().flatten().for_each(&mut word);
    let mut end = -1;
    for contour in contours {
        end += contour.len() as i16;
        word(end);
    }
    word(0);
    bytes.extend(points.iter().map(|point| u8::from(point.2)));
    for coordinate in [|p: &(i16, i16, bool)| p.0, |p: &(i16, i16, bool)| p.1] {
        let mut before = 0;
        for point in &points {
            bytes.extend((coordinate(point) - before).to_be_bytes());
            before = coordinate(point);
        }
    }
    bytes.resize(bytes.len().next_multiple_of(2), 0);
    bytes
}

/// The file of a font of our own, of 1000 units an em: `I` is a square of 500, `O` a square of 600 with a square hole
/// of 200, `o` nearly a disc of radius 250; all are 700 wide, and `O` after `I` is 100 nearer.
pub(crate) fn font_file() -> Vec<u8> {
    let k = 104;
    let disc = [(250, 0), (250, k), (177, 177), (k, 250), (0, 250)];
    let mut round = Vec::new();
    for turn in 0..4 {
        for (number, (x, y)) in disc[..4].iter().enumerate() {
            let (x, y) = match turn {
                0 => (*x, -*y),
                1 => (-*y, -*x),
                2 => (-*x, *y),
                _ => (*y, *x),
            };
            round.push((x + 250, y + 250, number % 2 == 0));
        }
    }
    let o = vec![square(0, 0, 600, true), square(200, 200, 200, false)];
    let glyphs = [glyph(&[]), glyph(&[square(0, 0, 500, true)]), glyph(&o), glyph(&[round]), glyph(&[])];
    let words =
        |values: &[i32]| -> Vec<u8> { values.iter().flat_map(|v| (*v as u16).to_be_bytes()).collect() };
    let mut loca = vec![0];
    for glyph in &glyphs {
        loca.push(loca[loca.len() - 1] + glyph.len() as i32 / 2);
    }
    let group = |character: char, glyph: u32| [character as u32, character as u32, glyph];
    let groups = [group(' ', 4), group('I', 1), group('O', 2), group('o', 3)].concat();
    let mut cmap = words(&[0, 1, 0, 4, 0, 12, 12, 0]);
    let long = [16 + 4 * groups.len() as u32, 0, groups.len() as u32 / 3];
    cmap.extend(long.iter().chain(&groups).flat_map(|v| v.to_be_bytes()));
    let head =
        [1, 0, 1, 0, 0, 0, 0x5f0f, 0x3cf5, 0, 1000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 700, 700, 0, 8, 2, 0, 0];
    let mut hhea = vec![1, 0, 800, -200, 0, 700];
    hhea.resize(17, 0);
    hhea.push(5);
    let tables: [(&[u8; 4], Vec<u8>); 8] = [
        (b"cmap", cmap),
        (b"glyf", glyphs.concat()),
        (b"head", words(&head)),
        (b"hhea", words(&hhea)),
        (b"hmtx", words(&[700, 0].repeat(5))),
        (b"kern", words(&[0, 1, 0, 20, 1, 1, 6, 0, 0, 1, 2, -100])),
        (b"loca", words(&loca)),
        (b"maxp", words(&[0, 0x5000, 5])),
    ];
    let mut file = words(&[1, 0, tables.len() as i32, 0, 0, 0]);
    let mut offset = 12 + 16 * tables.len() as u32;
    for (tag, table) in &tables {
        file.extend_from_slice(*tag);
        file.extend([0, offset, table.len() as u32].iter().flat_map(|v| v.to_be_bytes()));
        offset += table.len() as u32;
    }
    file.extend(tables.iter().flat_map(|(_, table)| table));
    file
}

fn font() -> Font {
    Font { source: None, data: font_file() }
}

fn style() -> TextStyle {
    let fineness = Fineness::Metres(1e-4);
    TextStyle { size_m: 1.0, depth_m: 0.2, bevel_m: 0.0, align: Align::Left, segments: None, fineness }
}

fn width(mesh: &Mesh) -> [f32; 2] {
    let xs = || mesh.positions.iter().map(|position| position.x);
    [xs().fold(f32::INFINITY, f32::min), xs().fold(f32::NEG_INFINITY, f32::max)]
}

#[test]
fn letters_are_closed_solids_with_holes_and_kerning() {
    check_font(&font()).unwrap();
    let mesh = mesh("IO", &font(), style()).unwrap();
    assert_sound(&mesh);
    assert!(is_closed(&mesh));
    assert!((volume_of(&mesh) - 0.2 * (0.25 + 0.36 - 0.04)).abs() < 1e-6, "{}", volume_of(&mesh));
    assert!((area_of(&mesh) - (2.0 * 0.57 + 0.2 * (2.0 + 2.4 + 0.8))).abs() < 1e-5);
    let [left, right] = width(&mesh);
    assert!(left == 0.0 && (right - (0.7 - 0.1 + 0.6)).abs() < 1e-6, "{left} {right}");
    assert!(mesh.positions.iter().all(|p| p.z.abs() == 0.1 && (0.0..=0.6001).contains(&p.y)));
    assert!(mesh.normals.contains(&Vec3::Z));
}

#[test]
fn lines_are_aligned_and_below_each_other() {
    for (align, part) in [(Align::Left, 0.0f32), (Align::Center, 0.5), (Align::Right, 1.0)] {
        let mesh = mesh("I I\nI", &font(), TextStyle { align, size_m: 2.0, ..style() }).unwrap();
        // Three glyphs of 700 above, one below.
        let low = mesh.positions.iter().filter(|p| p.y < -1.0).map(|p| p.x).fold(f32::INFINITY, f32::min);
        assert!((width(&mesh)[0] + part * 4.2).abs() < 1e-5 && (low + part * 1.4).abs() < 1e-5, "{align:?}");
        let bottom = mesh.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        assert!((bottom + 2.0).abs() < 1e-5, "a line is an em high");
    }
}

#[test]
fn curves_of_letters_are_round_and_bevels_widen_them() {
    let plain = mesh("o", &font(), style()).unwrap();
    assert_sound(&plain);
    assert!(is_closed(&plain));
    for (position, normal) in plain.positions.iter().zip(&plain.normals).filter(|(_, n)| n.z == 0.0) {
        let out = Vec3::new(position.x - 0.25, position.y - 0.25, 0.0);
        assert!((out.length() - 0.25).abs() < 2e-3 && out.normalize().dot(*normal) > 0.999, "{position}");
    }
    for text in ["o", "IO"] {
        let style = TextStyle { bevel_m: 0.05, ..style() };
        let bevelled = mesh(text, &font(), style).unwrap();
        assert_sound(&bevelled);
        assert!(is_closed(&bevelled), "{text}");
        let [flat, round] = [mesh(text, &font(), TextStyle { bevel_m: 0.0, ..style }).unwrap(), bevelled];
        assert!(volume_of(&round) > volume_of(&flat));
        assert!((width(&round)[0] + 0.05).abs() < 1e-3 && width(&flat)[0].abs() < 1e-3);
        assert!(round.positions.iter().all(|p| p.z.abs() < 0.1 + 1e-6));
    }
}

#[test]
fn damaged_fonts_and_missing_letters_are_refused() {
    let data = font_file();
    for length in [0, 3, 50, 150] {
        let font = Font { source: None, data: data[..length].to_vec() };
        assert!(check_font(&font).unwrap_err().contains("no font"), "{length}");
    }
    // Any byte may be wrong: letters may be odd then, and nothing panics.
    for place in 0..data.len() {
        let mut data = data.clone();
        data[place] ^= 0x55;
        let font = Font { source: None, data };
        if check_font(&font).is_ok() {
            let _ = mesh("IOo", &font, style()).map(|mesh| mesh.positions.len());
        }
    }
    assert_eq!((missing("I O\n", &font()), missing("Ix", &font())), (None, Some('x')));
}
