//! A font of stencil capitals, as a TrueType file. Strokes do not touch, so that each is a contour of its own.

use std::f64::consts::PI;

use glam::DVec2;

/// Units of an em.
const EM: f64 = 1000.0;
/// The height of capitals.
const CAPITAL: f64 = 700.0;
/// The width of strokes, and of the gaps between them.
const STROKE: f64 = 96.0;
const GAP: f64 = 30.0;
/// The blank beside a letter.
const SIDE: f64 = 45.0;

/// A stroke, counter-clockwise.
type Contour = Vec<DVec2>;

/// The letters of the font: each with its width and its strokes.
fn letters() -> Vec<(char, f64, Vec<Contour>)> {
    let (top, middle, right) = (CAPITAL, CAPITAL / 2.0, 440.0);
    let (s, half, after) = (STROKE, STROKE / 2.0, STROKE + GAP);
    let stem = bar(0.0, 0.0, s, top);
    let foot = bar(after, 0.0, right - 40.0, s);
    let head = bar(after, top - s, right - 40.0, top);
    let tongue = bar(after, middle - half, right - 90.0, middle + half);
    let radius = CAPITAL / 2.0;
    let bowl = |from: f64, to: f64| ring(DVec2::new(radius, radius), radius, from, to);
    // The gap's angle at a ring's middle.
    let open = (GAP / (radius - half)).to_degrees() / 2.0;
    let belly = |y: f64, radius: f64| {
        let mut belly = ring(DVec2::new(after + 60.0, y), radius, -90.0, 90.0);
        // The ring's ends go on to the stem.
        let inner = belly.len() / 2;
        belly.insert(inner, DVec2::new(after, y + radius));
        belly.insert(inner + 1, DVec2::new(after, y + radius - s));
        belly.push(DVec2::new(after, y - radius + s));
        belly.push(DVec2::new(after, y - radius));
        belly
    };
    let upper = belly(top - 195.0, 195.0);
    let leg = slant(after + 60.0, right - s, 0.0, top - 390.0 - GAP, true);
    vec![
        (
            'A',
            560.0,
            vec![
                slant(0.0, 232.0, 0.0, top, false),
                slant(232.0 + GAP, 464.0, 0.0, top, true),
                bar(230.0, 170.0, 330.0, 170.0 + 0.8 * s),
            ],
        ),
        ('C', 620.0, vec![bowl(45.0, 180.0 - open), bowl(180.0 + open, 315.0)]),
        ('D', after + 60.0 + radius, vec![stem.clone(), belly(middle, radius)]),
        ('E', right - 40.0, vec![stem.clone(), foot.clone(), tongue.clone(), head.clone()]),
        ('F', right - 40.0, vec![stem.clone(), tongue.clone(), head.clone()]),
        (
            'H',
            right + 40.0,
            vec![
                stem.clone(),
                bar(after, middle - half, right + 40.0 - after, middle + half),
                bar(right + 40.0 - s, 0.0, right + 40.0, top),
            ],
        ),
        ('I', s, vec![stem.clone()]),
        ('L', right - 60.0, vec![stem.clone(), foot.clone()]),
        (
            'M',
            620.0,
            vec![
                stem.clone(),
                slant(after, 310.0 - half - GAP / 2.0, 160.0, top, true),
                slant(310.0 - half + GAP / 2.0, 620.0 - after - s, 160.0, top, false),
                bar(620.0 - s, 0.0, 620.0, top),
            ],
        ),
        (
            'N',
            540.0,
            vec![
                stem.clone(),
                slant(after, 540.0 - after - s, 0.0, top, true),
                bar(540.0 - s, 0.0, 540.0, top),
            ],
        ),
        ('O', CAPITAL, vec![bowl(90.0 + open, 270.0 - open), bowl(-90.0 + open, 90.0 - open)]),
        ('R', right, vec![stem.clone(), upper, leg]),
        (
            'T',
            right + 20.0,
            vec![bar(0.0, top - s, right + 20.0, top), bar(230.0 - half, 0.0, 230.0 + half, top - s - GAP)],
        ),
        (
            'Y',
            500.0,
            vec![
                slant(0.0, 202.0 - GAP, 320.0 + GAP, top, true),
                slant(202.0 + GAP / 2.0, 404.0, 320.0 + GAP, top, false),
                bar(202.0, 0.0, 202.0 + s, 320.0),
            ],
        ),
        (',', 110.0, vec![slant(0.0, 30.0, -90.0, 110.0, false)]),
        ('.', 110.0, vec![bar(0.0, 0.0, 110.0, 110.0)]),
    ]
}

fn bar(x0: f64, y0: f64, x1: f64, y1: f64) -> Contour {
    [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(DVec2::from).into()
}

/// A slanted stroke with level ends, whose left edge goes from `x0` to `x1`: upwards, or, if it `falls`, downwards.
fn slant(x0: f64, x1: f64, bottom: f64, top: f64, falls: bool) -> Contour {
    let (low, high) = if falls { (x1, x0) } else { (x0, x1) };
    [(low, bottom), (low + STROKE, bottom), (high + STROKE, top), (high, top)].map(DVec2::from).into()
}

/// Part of a ring between two angles, in degrees.
fn ring(middle: DVec2, radius: f64, from: f64, to: f64) -> Contour {
    const STEPS: u32 = 24;
    let at = |radius: f64, step: u32| {
        let angle = (from + (to - from) * f64::from(step) / f64::from(STEPS)) * PI / 180.0;
        middle + radius * DVec2::new(libm::cos(angle), libm::sin(angle))
    };
    let outer = (0..=STEPS).map(|step| at(radius, step));
    outer.chain((0..=STEPS).rev().map(|step| at(radius - STROKE, step))).collect()
}

/// The font as a file (OpenType specification, "The OpenType Font File").
pub fn file() -> Vec<u8> {
    let letters = letters();
    // Glyph 0 stands for what the font lacks, glyph 1 for a blank.
    let mut glyphs = vec![Vec::new(), Vec::new()];
    let mut advances = vec![400u16, 260];
    let mut codes = vec![(' ', 1u16)];
    for (letter, width, contours) in &letters {
        codes.push((*letter, glyphs.len() as u16));
        advances.push((width + 2.0 * SIDE) as u16);
        glyphs.push(glyph(contours));
    }
    let most_points =
        letters.iter().map(|(_, _, contours)| contours.iter().map(Vec::len).sum::<usize>()).max();
    let most_contours = letters.iter().map(|(_, _, contours)| contours.len()).max();
    let count = glyphs.len() as u16;
    let (mut outlines, mut places) = (Vec::new(), Vec::new());
    for glyph in &glyphs {
        places.extend((outlines.len() as u32).to_be_bytes());
        outlines.extend(glyph);
    }
    places.extend((outlines.len() as u32).to_be_bytes());
    let metrics = advances.iter().flat_map(|advance| [*advance, SIDE as u16]).flat_map(u16::to_be_bytes);
    let (ascent, descent) = (800u16, (-200i16) as u16);
    let words = |words: &[u16]| words.iter().flat_map(|word| word.to_be_bytes()).collect::<Vec<u8>>();
    let head = [
        // Version 1.0, revision 1.0, no checksum; the magic number.
        words(&[1, 0, 1, 0, 0, 0, 0x5f0f, 0x3cf5, 0, EM as u16]),
        // Two dates of 1904.
        vec![0; 16],
        // The bounds of all glyphs, style, smallest legible size, direction; places of 4 bytes.
        words(&[0, descent, EM as u16, ascent, 0, 8, 2, 1, 0]),
    ]
    .concat();
    let across = words(&[1, 0, ascent, descent, 100, 1000, 0, 0, 1000, 1, 0, 0, 0, 0, 0, 0, 0, count]);
    let (points, contours) = (most_points.unwrap_or(0) as u16, most_contours.unwrap_or(0) as u16);
    let profile = words(&[1, 0, count, points, contours, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    let mut tables = [
        (*b"cmap", characters(&mut codes)),
        (*b"glyf", outlines),
        (*b"head", head),
        (*b"hhea", across),
        (*b"hmtx", metrics.collect()),
        (*b"loca", places),
        (*b"maxp", profile),
    ];
    let mut file = words(&[1, 0, tables.len() as u16, 64, 2, 16 * tables.len() as u16 - 64]);
    let mut place = file.len() + 16 * tables.len();
    let mut content = Vec::new();
    for (tag, table) in &mut tables {
        let length = table.len() as u32;
        table.resize(table.len().next_multiple_of(4), 0);
        let sum = table.as_chunks().0.iter().map(|word| u32::from_be_bytes(*word)).fold(0, u32::wrapping_add);
        file.extend(*tag);
        [sum, place as u32, length].iter().for_each(|word| file.extend(word.to_be_bytes()));
        place += table.len();
        content.append(table);
    }
    file.extend(content);
    file
}

/// An outline of straight lines, moved by the blank at its left.
fn glyph(contours: &[Contour]) -> Vec<u8> {
    let points: Vec<[i16; 2]> = contours
        .iter()
        // TrueType's outer contours go clockwise.
        .flat_map(|contour| contour.iter().rev())
        .map(|point| [(point.x + SIDE).round() as i16, point.y.round() as i16])
        .collect();
    let bound = |axis: usize, pick: fn(i16, i16) -> i16| {
        points.iter().map(|point| point[axis]).reduce(pick).unwrap_or(0)
    };
    let bounds = [bound(0, i16::min), bound(1, i16::min), bound(0, i16::max), bound(1, i16::max)];
    let mut bytes = Vec::new();
    let mut word = |word: i16| bytes.extend(word.to_be_bytes());
    word(contours.len() as i16);
    bounds.into_iter().for_each(&mut word);
    let mut end = 0;
    for contour in contours {
        end += contour.len();
        word(end as i16 - 1);
    }
    word(0);
    // All points lie on the curve, with coordinates of two bytes.
    bytes.extend(vec![1; points.len()]);
    for axis in 0..2 {
        let mut before = 0;
        for point in &points {
            bytes.extend((point[axis] - before).to_be_bytes());
            before = point[axis];
        }
    }
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// The glyphs of characters, by ranges of one character each.
fn characters(codes: &mut [(char, u16)]) -> Vec<u8> {
    codes.sort_unstable();
    let codes: Vec<(u16, u16)> = codes.iter().map(|(code, glyph)| (*code as u16, *glyph)).collect();
    // The last range is that of no character.
    let ends: Vec<u16> = codes.iter().map(|(code, _)| *code).chain([0xffff]).collect();
    let steps: Vec<u16> = codes.iter().map(|(code, glyph)| glyph.wrapping_sub(*code)).chain([1]).collect();
    let count = ends.len() as u16;
    let search = 2 << count.ilog2();
    let table = [
        vec![0, 1, 3, 1, 0, 12],
        vec![4, 16 + 8 * count, 0, 2 * count, search, count.ilog2() as u16, 2 * count - search],
        ends.clone(),
        vec![0],
        ends,
        steps,
        vec![0; usize::from(count)],
    ];
    table.concat().iter().flat_map(|word: &u16| word.to_be_bytes()).collect()
}
