//! `rayfront verify SCENE`: checks that all ways to render give the same film.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use indicatif::ProgressBar;
use serde_json::{Value, json};

use crate::cli::args::{ImageSize, SCHEDULES, StudyOptions, name_of, parse_size};
use crate::cli::failure::{Failure, Fault};
use crate::cli::{output, progress::styled};
use crate::integrator::Schedule;
use crate::study::descriptions::{describe, title};
use crate::study::verify::{self, Difference, First, Verification, Way};

/// `rayfront verify`.
#[derive(Args, Debug)]
#[command(
    after_help = "Exit codes: 0 all films are equal, 5 some are not, 1 a file is at fault, 2 the command line is."
)]
pub struct Verify {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Size of the image in pixels; it is rendered dozens of times
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "96x54")]
    pub size: ImageSize,
    /// Samples per pixel
    #[arg(short = 's', long, visible_alias = "samples-per-pixel", value_name = "N", default_value_t = 2,
          value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    pub spp: u32,
    /// The other options.
    #[command(flatten)]
    pub options: StudyOptions,
}

pub fn run(arguments: &Verify) -> Result<ExitCode, Failure> {
    let Verify { scene, size, spp, options } = arguments;
    let (_, setup) = super::setup(scene, options, *size, *spp)?;
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let ways = verify::ways(cores);

    let bar = ProgressBar::new(ways.len() as u64);
    let bar = styled(bar, "rendering {bar:32} {pos} of {len} ways  {eta} left");
    let found = verify::verify(setup, *spp, &ways, &mut |done| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    let text = if options.json { format!("{}\n", json(arguments, &found)) } else { text(arguments, &found) };
    output::print(&text)?;
    Ok(if found.mismatches() == 0 { ExitCode::SUCCESS } else { Fault::Difference.code() })
}

fn schedule(way: &Way) -> String {
    match way.schedule {
        Schedule::Recursive => "recursive".into(),
        Schedule::Wavefront => format!("wave {}", way.wave),
    }
}

fn threads(way: &Way) -> String {
    format!("{} thread{}", way.threads, if way.threads == 1 { "" } else { "s" })
}

fn way_text(way: &Way) -> String {
    format!("{}, {}, {}", schedule(way), way.isa.name(), threads(way))
}

/// Returns a table of the films' hashes and, if they differ, the first difference.
fn text(arguments: &Verify, found: &Verification) -> String {
    let [width, height] = arguments.size;
    let first = &found.outcomes[0];
    let expected = first.hash;
    let mut lines = vec![
        format!("scene      {}, {width}x{height}, {} spp", arguments.scene.display(), arguments.spp),
        format!("film       {expected:032x}"),
        String::new(),
    ];
    let rows = || found.outcomes.chunk_by(|a, b| (a.way.threads, a.way.isa) == (b.way.threads, b.way.isa));
    for (number, row) in rows().enumerate() {
        if number == 0 {
            let columns: String = row.iter().map(|cell| format!("{:>12}", schedule(&cell.way))).collect();
            lines.push(format!("{:22}{columns}", ""));
        }
        let cell = |outcome: &verify::Outcome| {
            let mark = if outcome.equals(first) { ' ' } else { '≠' };
            format!("  {mark}{:09x}", outcome.hash >> 92)
        };
        let cells: String = row.iter().map(cell).collect();
        lines.push(format!("{:10}{:12}{cells}", row[0].way.isa.name(), threads(&row[0].way)));
    }
    lines.push(String::new());
    lines.push(match found.mismatches() {
        0 => format!(
            "{} films, all equal, and their depths, normals, ids and images without noise",
            found.outcomes.len()
        ),
        some => format!("{some} of {} films differ from the first", found.outcomes.len()),
    });
    for outcome in found.outcomes.iter().filter(|o| o.hash == expected && !o.equals(first)) {
        lines
            .push(format!("depths, normals, ids or images without noise differ: {}", way_text(&outcome.way)));
    }
    if let Some(difference) = &found.difference {
        lines.extend(tell(difference));
    }
    lines.join("\n") + "\n"
}

fn tell(difference: &Difference) -> Vec<String> {
    let [x, y] = difference.pixel;
    let mut lines =
        vec![String::new(), format!("pixel      {x},{y} is the first of {} that differ", difference.pixels)];
    for side in &difference.sides {
        lines.push(format!("{:10} {}: {:?} quanta", "", way_text(&side.way), side.sum.total()));
    }
    let Some(first) = &difference.first else {
        lines.push(
            "cause      all that is observed there is equal when its tile is rendered by itself".into(),
        );
        lines.push("           on one thread: look at threads and at what is left in buffers".into());
        return lines;
    };
    let place = first.place;
    lines.push(format!(
        "cause      sample {}, bounce {}, branch {:08x}, stage {}",
        place.sample,
        place.depth,
        place.branch,
        first.stage.name()
    ));
    lines.extend(columns(difference, first));
    lines
}

/// Returns the events of both sides, line by line.
fn columns(difference: &Difference, first: &First) -> Vec<String> {
    let [a, b] = [0, 1].map(|side| match &first.happened[side] {
        Some(what) => (title(what), describe(what)),
        None => ("nothing", Vec::new()),
    });
    let names = difference.sides.map(|side| schedule(&side.way));
    let row = |mark, name: &str, a: &str, b: &str| format!("{mark}{name:17} {a:40} {b}");
    let mut lines = vec![row(' ', "", &names[0], &names[1]), row(' ', "", a.0, b.0)];
    let facts = if a.1.is_empty() { &b.1 } else { &a.1 };
    for (i, (name, _)) in facts.iter().enumerate() {
        let value =
            |side: &[(&str, String)]| side.get(i).map_or_else(String::new, |(_, value)| value.clone());
        let (a, b) = (value(&a.1), value(&b.1));
        lines.push(row(if a == b { ' ' } else { '≠' }, name, &a, &b));
    }
    lines
}

fn way_json(way: &Way) -> Value {
    json!({
        "schedule": name_of(SCHEDULES, &way.schedule),
        "wave": (way.wave > 0).then_some(way.wave),
        "simd": way.isa.name(),
        "threads": way.threads,
    })
}

/// Returns the report as a JSON object.
fn json(arguments: &Verify, found: &Verification) -> Value {
    let films: Vec<Value> = found
        .outcomes
        .iter()
        .map(|outcome| {
            let mut way = way_json(&outcome.way);
            way["film_hash"] = format!("{:032x}", outcome.hash).into();
            way["denoised_hash"] = outcome.denoised.map(|hash| format!("{hash:032x}")).into();
            way["features_hash"] = format!("{:032x}", outcome.features).into();
            way
        })
        .collect();
    let difference = found.difference.as_ref().map(|difference| {
        let side = |i: usize| {
            let mut side = way_json(&difference.sides[i].way);
            side["sum_quanta"] =
                json!(difference.sides[i].sum.total().map(|sum| i64::try_from(sum).unwrap_or(i64::MAX)));
            let happened = difference.first.as_ref().and_then(|first| first.happened[i]);
            side["event"] = happened.map_or(Value::Null, |what| json!(title(&what)));
            side["facts"] = happened.map_or(Value::Null, |what| describe(&what).into_iter().collect());
            side
        };
        let place = difference.first.as_ref().map(|first| first.place);
        json!({
            "pixel": difference.pixel,
            "pixels": difference.pixels,
            "sample": place.map(|place| place.sample),
            "bounce": place.map(|place| place.depth),
            "branch": place.map(|place| place.branch),
            "stage": difference.first.as_ref().map(|first| first.stage.name()),
            "sides": [side(0), side(1)],
        })
    });
    json!({
        "scene": output::path_json(&arguments.scene),
        "size": arguments.size,
        "samples": arguments.spp,
        "films": films,
        "mismatches": found.mismatches(),
        "difference": difference,
    })
}
