use proptest::prelude::*;

use super::*;
use crate::film::{Allocation, FilmScale};
use crate::formats::{EnvironmentPreset, LoadOptions, SkyOptions};
use crate::math::Rgb;
use crate::world::{Settings, Sharing, SourceFiles};

/// A film, with or without squares; its region of 300 × 500 pixels has three blocks. Some pixels are bright.
fn film(region: Region, variance: bool) -> FilmFile {
    // Half of all films have groups.
    let lights = if variance { 2 } else { 0 };
    let kinds = GroupKinds { lights, has_transparency: variance, has_catcher: variance };
    let groups = kinds.count();
    let mut film = Film::new(region, FilmScale::new(1e6, 1e6)).with_groups(kinds);
    let mut moments = variance.then(|| Moments::new(region));
    for sample in 0..3u32 {
        let mut one = Film::new(region, film.unit()).with_groups(kinds);
        for (x, y) in (region.y0..region.y1).flat_map(|y| (region.x0..region.x1).map(move |x| (x, y))) {
            let noise = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503) ^ sample) % 1000;
            one.count(x, y, sample);
            one.add(x, y, sample, Rgb::new(noise as f32, 0.5, if x == y { 3e5 } else { 0.0 }));
            for group in 0..groups as u32 {
                one.add_to_group(x, y, sample, group, Rgb::new(0.25 * noise as f32, 0.1 * group as f32, 0.0));
            }
        }
        if let Some(moments) = &mut moments {
            moments.add_sample(&one);
        }
        film.merge(&one);
    }
    let transparent = kinds.has_transparency;
    let settings = Settings { size: [400, 700], samples: 8, transparent, ..Settings::default() };
    let mut header = FilmHeader {
        program: PROGRAM.into(),
        scene: Source::new("scenes/a.ron".as_ref(), &SourceFiles::default()),
        view: RenderedView {
            options: LoadOptions { time_s: Some(0.1), ..LoadOptions::default() },
            ..RenderedView::default()
        },
        settings,
        region,
        unit: film.unit(),
        variance,
        catches: kinds.has_catcher,
        light_groups: (0..film.light_groups()).map(|group| format!("lamp {group}")).collect(),
        wanted: [0, 4],
        samples: vec![[0, 3]],
        most: 0,
        begun: None,
        rays: None,
        allocation: None,
        shard: Some([0, 2]),
        film_hash: String::new(),
        moments_hash: None,
        note: Note { hosts: vec!["Zoë's".into()], ..Note::default() },
    };
    header.set_film(&film, moments.as_ref());
    FilmFile { header, film, moments }
}

fn bytes(file: &FilmFile) -> Vec<u8> {
    let mut out = Vec::new();
    write(&mut out, &file.header, &file.film, file.moments.as_ref()).expect("memory takes all");
    out
}

fn read_all(bytes: &[u8]) -> Result<Option<FilmFile>, String> {
    read(&mut &bytes[..], "a.film".as_ref()).map_err(|error| error.to_string())
}

const LARGE: Region = Region { x0: 20, y0: 10, x1: 320, y1: 510 };
const SMALL: Region = Region { x0: 1, y0: 2, x1: 13, y1: 11 };

#[test]
fn written_films_read_back_unchanged() {
    for (region, variance) in [(LARGE, true), (LARGE, false), (SMALL, true)] {
        let file = film(region, variance);
        let written = bytes(&file);
        assert_eq!(read_all(&written), Ok(Some(file.clone())));
        // Two in a row.
        let twice = [&written[..], &written].concat();
        let mut rest = &twice[..];
        let path = Path::new("-");
        assert_eq!(read(&mut rest, path).unwrap().as_ref(), Some(&file));
        assert_eq!(read(&mut rest, path).unwrap().as_ref(), Some(&file));
        assert_eq!(read(&mut rest, path).unwrap(), None);
    }
}

/// Header numbers are compared, and some are doubles, so they must read back bit for bit. (Fuzzing found 1e-45, which a
/// less exact float parser read as another number.)
#[test]
fn header_numbers_read_back_unchanged() {
    let mut file = film(SMALL, false);
    let mut comes_back = |number: f64| {
        let sun = SkyOptions { azimuth_degrees: number, ..SkyOptions::default() };
        file.header.view.options.surroundings = Some(EnvironmentPreset::Sky(sun));
        file.header.view.options.edits.orbit = Some([number, -number]).filter(|_| number.abs() < 36_000.0);
        assert_eq!(read_all(&bytes(&file)), Ok(Some(file.clone())), "{number:e}");
    };
    comes_back(1e-45);
    // Arbitrary bits, but the same in each run.
    let mut bits = 1u64;
    for _ in 0..2000 {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let number = f64::from_bits(bits);
        if number.is_finite() {
            comes_back(number);
        }
    }
}

/// Sums in different units cannot be added, and invalid ranges and shards are rejected.
#[test]
fn inconsistent_headers_are_rejected() {
    let file = film(SMALL, false);
    let other = FilmHeader { unit: FilmScale::new(1e12, 1e12), ..file.header.clone() };
    assert!(file.header.difference(&other).is_some_and(|what| what.contains("unit")));
    assert_eq!(file.header.difference(&file.header.clone()), None);
    let refused = |change: fn(&mut FilmHeader)| {
        let mut file = film(SMALL, false);
        change(&mut file.header);
        read_all(&bytes(&file)).is_err_and(|error| error.contains("damaged"))
    };
    assert!(refused(|header| header.wanted = [0, 40]));
    assert!(refused(|header| header.wanted = [3, 2]));
    assert!(refused(|header| header.shard = Some([0, u32::MAX])));
    assert!(refused(|header| header.shard = Some([2, 2])));
    assert!(!refused(|header| header.shard = None));
}

/// Replaces each number of a header by various values: the header is rejected, or its use terminates soon.
#[test]
fn header_numbers_have_the_bounds_of_their_options() {
    use serde_json::{Value, json};
    fn numbers(value: &Value, path: &str, found: &mut Vec<String>) {
        match value {
            Value::Number(_) => found.push(path.to_owned()),
            Value::Array(items) => {
                items.iter().enumerate().for_each(|(i, item)| numbers(item, &format!("{path}/{i}"), found));
            }
            Value::Object(fields) => {
                fields.iter().for_each(|(key, item)| numbers(item, &format!("{path}/{key}"), found));
            }
            _ => {}
        }
    }
    let mut header = film(SMALL, false).header;
    header.view.shutter_s = Some(0.5);
    header.view.moments = Some(16);
    header.view.options.size = Some([400, 700]);
    (header.view.options.edits.orbit, header.view.options.edits.zoom) = (Some([3.0, 4.0]), Some(2.0));
    header.view.options.surroundings = Some(EnvironmentPreset::Sky(SkyOptions::default()));
    header.begun =
        Some(Begun { samples: [3, 4], until: None, tile: 64, tiles: vec![0], blocks: Some(vec![0]) });
    header.rays = Some(vec![7]);
    header.allocation = Allocation::new(vec![32]);
    let settings = &mut header.settings;
    (settings.clamp, settings.sharing) = (Some(3.0), Sharing::Groups(8));
    let limits = &mut settings.depth_limits;
    (limits.diffuse, limits.glossy, limits.transmission) = (Some(1), Some(2), Some(3));
    let sound = serde_json::to_value(&header).expect("JSON");
    let parse = |value: &Value| FilmHeader::parse(value.to_string().as_bytes());
    assert_eq!(parse(&sound).as_ref(), Ok(&header));
    let mut places = Vec::new();
    numbers(&sound, "", &mut places);
    assert!(places.len() > 50, "{places:?}");
    // Numbers for which any value is valid, or on which nothing depends.
    let free = ["/settings/seed", "/begun/blocks/0", "/begun/tiles/0", "/view/time_s", "azimuth_degrees"];
    let bright = ["/settings/background", "/settings/ambient", "/settings/clamp", "/settings/min_throughput"];
    let start = std::time::Instant::now();
    for place in &places {
        for wrong in [json!(0), json!(-1), json!(1e9), json!(4_294_967_295u32), json!(u64::MAX), json!(1e300)]
        {
            let mut changed = sound.clone();
            *changed.pointer_mut(place).expect("a number") = wrong.clone();
            let Ok(read) = parse(&changed) else { continue };
            let is_large = wrong.as_f64().is_some_and(|wrong| wrong > 1e6);
            let may_be_large = free.iter().chain(&bright).any(|free| place.contains(free))
                || place.contains("radius")
                || place.ends_with("/seconds")
                || place.contains("/rays");
            assert!(!is_large || may_be_large, "{place} may be {wrong}");
            let RenderedView { .. } = read.view.at(read.view.moments() - 1);
            let _ = (read.part(0, 4), read.view.moments_among(&read.samples, read.total()), read.ranges());
        }
    }
    // A list as long as a header can contain.
    let mut long = header.clone();
    (long.allocation, long.begun, long.rays) = (None, None, None);
    long.settings.samples = Settings::MOST_SAMPLES;
    long.view.moments = Some(RenderedView::MOST_MOMENTS);
    long.samples = (0..200_000).map(|i| [3 * i, 3 * i + 1]).collect();
    let long = parse(&serde_json::to_value(&long).expect("JSON")).expect("it can be");
    assert!(long.view.moments_among(&long.samples, long.total()) > 0);
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}

/// However few samples there are, they cover the whole exposure.
#[test]
fn moments_are_visited_in_an_order_that_covers_the_exposure() {
    let view =
        |moments| RenderedView { shutter_s: Some(1.0), moments: Some(moments), ..RenderedView::default() };
    for (moments, samples) in
        [(16, 256), (16, 64), (16, 16), (16, 5), (5, 100), (1, 7), (7, 7), (4096, 10_000)]
    {
        let view = view(moments);
        let mut counts = vec![0; moments as usize];
        let mut sample = 0;
        while sample < samples {
            let (moment, end) = view.moment_of(sample, samples);
            assert!(end > sample && end <= samples, "{moments} {samples} {sample} {end}");
            assert!((sample..end).all(|sample| view.moment_of(sample, samples) == (moment, end)));
            counts[moment as usize] += end - sample;
            sample = end;
        }
        let (least, most) = (counts.iter().min().copied(), counts.iter().max().copied());
        assert!(
            most.zip(least).is_some_and(|(most, least)| most - least <= 2),
            "{moments} {samples}: {counts:?}"
        );
    }
    let firsts =
        |count: u32| (0..count).map(|sample| view(16).moment_of(sample * 4, 256).0).collect::<Vec<_>>();
    assert_eq!(firsts(4), [0, 9, 3, 12]);
    let mut all = firsts(16);
    all.sort_unstable();
    assert_eq!(all, (0..16).collect::<Vec<_>>());
    assert_eq!((view(16).moments_among(&[[0, 64]], 256), view(16).moments_among(&[[0, 10]], 256)), (16, 3));
}

#[test]
fn high_byte_planes_take_little_space() {
    let file = film(LARGE, false);
    let (packed, plain) = (bytes(&file).len(), size_of_val(file.film.pixels()));
    assert!(packed * 2 < plain, "{packed} of {plain} bytes");
}

#[test]
fn truncated_films_are_reported_as_cut_off() {
    let written = bytes(&film(SMALL, true));
    for length in 1..written.len() {
        let error = read_all(&written[..length]).expect_err("cut off");
        assert!(
            error.starts_with("a.film: ") && error.contains("cut off") || length < 8,
            "{length}: {error}"
        );
    }
    assert_eq!(read_all(&[]), Ok(None));
}

#[test]
fn foreign_and_invalid_files_are_rejected_with_the_reason() {
    let file = film(SMALL, false);
    let mut newer = bytes(&file);
    newer[8] = 2;
    let mut other = file.clone();
    other.header.program = "rayfront 99.0.0".into();
    let mut nonsense = file.clone();
    nonsense.header.samples = vec![[0, 3], [2, 4]];
    let mut outside = file.clone();
    outside.header.settings.size = [4, 4];
    for (written, words) in [
        (newer, "format 2"),
        (bytes(&other), "use rayfront 99.0.0"),
        (bytes(&nonsense), "damaged"),
        (bytes(&outside), "damaged"),
        (b"(settings: ())".to_vec(), "not a film"),
        (vec![0x89, b'R'], "not a film"),
    ] {
        let error = read_all(&written).expect_err(words);
        assert!(error.contains(words) && error.lines().count() == 1, "{error}");
    }
}

#[test]
fn differences_between_headers_are_named() {
    let file = film(SMALL, false).header;
    let mut other = file.clone();
    other.settings.seed = 7;
    assert_eq!(other.difference(&file).as_deref(), Some("of other settings: seed is 7, not 0"));
    let mut looks = file.clone();
    looks.settings.exposure_ev = 2.0;
    assert_eq!(looks.difference(&file), None, "films do not depend on exposure");
    let folder = tempfile::tempdir().expect("a folder");
    let source = |text: &str| {
        let (scene, mesh) = (folder.path().join("a.ron"), folder.path().join("meshes/b.ply"));
        std::fs::create_dir_all(folder.path().join("meshes")).expect("a folder");
        std::fs::write(&scene, "()").expect("a scene");
        std::fs::write(&mesh, text).expect("a mesh");
        let files = SourceFiles::default();
        [&scene, &mesh].iter().for_each(|path| drop(files.read(path).expect("a file")));
        Source::new(&scene, &files)
    };
    let (first, second) = (source("one"), source("two"));
    assert_eq!(first.difference(&source("one")), None);
    assert_eq!(first.difference(&second).as_deref(), Some("meshes/b.ply differs"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever bit is flipped: the film is rejected, or it is the same.
    #[test]
    fn flipped_bits_are_detected_or_harmless(place in any::<prop::sample::Index>(), bit in 0u8..8, variance in any::<bool>()) {
        let file = film(SMALL, variance);
        let mut written = bytes(&file);
        let at = place.index(written.len());
        written[at] ^= 1 << bit;
        match read_all(&written) {
            Ok(read) => prop_assert_eq!(read, Some(file)),
            Err(error) => prop_assert!(error.starts_with("a.film: "), "{}", error),
        }
    }
}
