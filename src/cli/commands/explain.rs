//! `rayfront explain SCENE X,Y`: follows the paths of a pixel's samples.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use serde_json::{Value, json};

use super::load;
use crate::cli::args::{ImageSize, ModelOptions, SampleOptions};
use crate::cli::{failure::Failure, output};
use crate::error::in_one_line;
use crate::film::Film;
use crate::integrator::observe::Components;
use crate::integrator::observe::decision::PathEvent;
use crate::integrator::path::bounces::LobeKind;
use crate::math::{NONE, Rgb};
use crate::study::explain::{
    self, ExplainedLamp, ExplainedLightRay, Followed, GivenNames, SampleTrace, Shares, Step,
};
use crate::world::Adaptive;

/// The most lines about samples; the first sample is printed in any case.
const MOST_LINES: usize = 200;

/// `rayfront explain`.
#[derive(Args, Debug)]
pub struct Explain {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Column and row of the pixel from the top left, such as 480,270
    #[arg(value_name = "X,Y", value_parser = parse_pixel)]
    pub pixel: ImageSize,
    /// Follow only this sample, counted from 0 [default: all; the first ones are printed]
    #[arg(long, value_name = "N")]
    pub sample: Option<u32>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options of the samples. The random numbers depend on their number.
    #[command(flatten)]
    pub sampling: SampleOptions,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
}

fn parse_pixel(text: &str) -> Result<ImageSize, String> {
    let numbers =
        text.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    numbers.ok_or_else(|| "expected a column and a row, such as 480,270".into())
}

pub fn run(arguments: &Explain) -> Result<ExitCode, Failure> {
    let Explain { scene, sampling, model, .. } = arguments;
    let options = model.of_size(sampling.size);
    let (world, setup) = load(scene, &options, sampling.camera.as_deref(), |world| sampling.apply(world))?;
    let settings = &world.settings;
    let ([x, y], [width, height], samples) = (arguments.pixel, settings.size, settings.samples);
    if x >= width || y >= height {
        return Err(Failure::command_line(format!(
            "there is no pixel {x},{y} in an image of {width}x{height}: columns end at {}, rows at {}",
            width - 1,
            height - 1
        )));
    }
    let range = match arguments.sample {
        // Under adaptive sampling, blocks with more samples have higher sample numbers, too.
        Some(sample) if sample >= samples && settings.adaptive == Adaptive::Off => {
            let last = samples - 1;
            return Err(Failure::command_line(format!(
                "there is no sample {sample}: with {samples} samples a pixel the last one is {last}"
            )));
        }
        Some(sample) => sample..sample.saturating_add(1),
        None => 0..samples,
    };
    let names = GivenNames::new(&world);
    let (lives, film) = explain::explain(Arc::new(setup), &names, arguments.pixel, range);
    let text =
        if arguments.json { format!("{}\n", json(arguments, &lives, &film)) } else { text(&lives, &film) };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Formats components with few digits for reading; the JSON has all of them.
fn triple(components: Components) -> String {
    place(components.map(f64::from))
}

fn place([a, b, c]: [f64; 3]) -> String {
    let digits = |value: f64| {
        let text = format!("{value:.5}");
        if value != 0.0 && value.abs() < 1e-3 { format!("{value:.3e}") } else { text }
    };
    format!("({}, {}, {})", digits(a), digits(b), digits(c))
}

fn mean(film: &Film) -> Components {
    film.radiance().first().map_or([0.0; 3], |pixel| pixel.to_array())
}

fn text(lives: &[SampleTrace], film: &Film) -> String {
    let mut lines = Vec::new();
    let mut shown = 0;
    for life in lives {
        let more = sample_lines(life);
        if shown > 0 && lines.len() + more.len() > MOST_LINES {
            break;
        }
        lines.extend(more);
        shown += 1;
    }
    let luminance = |life: &SampleTrace| Rgb::from(life.radiance()).luminance();
    if let Some(brightest) = lives[shown..].iter().max_by(|a, b| luminance(a).total_cmp(&luminance(b))) {
        let (count, number) = (lives.len() - shown, brightest.sample);
        let light = triple(brightest.radiance());
        lines.push(format!("{count} more, the brightest of which is sample {number}  radiance {light}"));
        lines.push(format!("  (--sample {number} prints it, --json all)"));
    }
    lines.push(format!("mean of all ({}) {}", lives.len(), triple(mean(film))));
    lines.join("\n") + "\n"
}

fn sample_lines(life: &SampleTrace) -> Vec<String> {
    let mut lines = vec![format!("sample {}  radiance {}", life.sample, triple(life.radiance()))];
    for (number, path) in life.paths.iter().enumerate() {
        lines.extend(path_lines(life, number, path));
    }
    if life.drawn.1 > 0 {
        let (light, count) = life.drawn;
        lines.push(format!("  {count} photons that it sees directly bring {}", triple(light)));
    }
    lines
}

fn path_lines(life: &SampleTrace, number: usize, path: &Followed) -> Vec<String> {
    let from = path.from.map_or("from the camera".into(), |(parent, depth)| {
        format!("forked off path {parent} at bounce {depth}")
    });
    let mut lines = vec![format!("  path {number}, {from}")];
    for step in &path.steps {
        lines.extend(step_lines(life, step));
        if step.depth == 0 && path.shares.is_some() && path.steps.len() > 1 {
            lines.push("    from here on what it finds is shared: it is weighted in the end".into());
        }
    }
    let Some(Shares { before, own, shared, vertices }) = &path.shares else {
        lines.push(format!("    ends: {}; it brings {}", path.why.text(), triple(path.radiance)));
        return lines;
    };
    lines.push(format!("    ends: {}", path.why.text()));
    lines.push(format!("    up to the first vertex  {}", triple(*before)));
    lines.push(format!("    by its own path alone   {}", triple(*own)));
    let of = if *vertices == 1 { "vertex" } else { "vertices" };
    lines.push(format!("    from {vertices} second {of} of its group  {}", triple(*shared)));
    lines.push(format!("    it brings {}", triple(path.radiance)));
    lines
}

fn step_lines(life: &SampleTrace, step: &Step) -> Vec<String> {
    let mut lines = vec![
        format!("    bounce {}  queue {}", step.depth, step.queue),
        format!("      ray         {} towards {}", place(life.in_world(step.origin)), triple(step.direction)),
        format!("      throughput  {}", triple(step.throughput)),
    ];
    for ExplainedLamp { light, distance, found, share: weight } in &step.lamps {
        let (light, far) = (in_one_line(light), away(*distance));
        lines.push(format!("      finds       \"{light}\" {far}: {}{}", triple(*found), share(*weight)));
    }
    let Some(vertex) = &step.vertex else {
        lines.push("      meets nothing".into());
        return lines;
    };
    lines.push(format!(
        "      meets       \"{}\" of \"{}\" after {:.5} m, primitive {}{}",
        in_one_line(&vertex.entity),
        in_one_line(&vertex.material),
        vertex.hit.t,
        vertex.hit.primitive & !crate::bvh::SPHERE,
        if vertex.hit.instance == NONE {
            String::new()
        } else {
            format!(", instance {}", vertex.hit.instance)
        }
    ));
    lines.push(format!("      at          {}", place(life.in_world(vertex.position))));
    let normals = if vertex.normal == vertex.geometric_normal {
        triple(vertex.normal)
    } else {
        format!("{} (the surface's own {})", triple(vertex.normal), triple(vertex.geometric_normal))
    };
    lines.push(format!("      normal      {normals}"));
    if vertex.own != [0.0; 3] {
        lines.push(format!("      gives off   {}{}", triple(vertex.own), share(vertex.own_share)));
    }
    if vertex.gathered != [0.0; 3] {
        lines.push(format!("      photons     around it bring {}", triple(vertex.gathered)));
    }
    lines.extend(vertex.lights.iter().map(|lit| light_line(lit, vertex.fate.is_some())));
    if let Some(PathEvent::Scattered { distance_m }) = vertex.fate {
        lines.push(format!("      scattered   within the body, after {distance_m} m"));
    }
    if vertex.fate == Some(PathEvent::Straight) {
        lines.push("      goes on     straight through, which is no bounce".into());
    }
    if let Some(PathEvent::Drawn { kind, through, exact }) = vertex.fate {
        lines.push(format!(
            "      draws       from {} {} lobe{}",
            if exact { "an exact" } else { "a" },
            kind.name(),
            if through && kind == LobeKind::Diffuse { ", to the other side" } else { "" }
        ));
    }
    lines
}

fn away(distance: f32) -> String {
    if distance.is_finite() { format!("at {distance:.5} m") } else { "far away".into() }
}

/// Formats the MIS weight of one of two ways to find a light.
fn share(share: f32) -> String {
    if share == 1.0 { String::new() } else { format!(", weighted by {share:.5}") }
}

fn light_line(lit: &ExplainedLightRay, only_one: bool) -> String {
    let ExplainedLightRay { light, which, distance, contribution, arrived, blocked, .. } = lit;
    let sample = if only_one { String::new() } else { format!(" sample {which}") };
    let brings = if *blocked {
        format!("blocked, would bring {}", triple(*contribution))
    } else if arrived == contribution {
        format!("brings {}", triple(*arrived))
    } else {
        format!("brings {} of {}", triple(*arrived), triple(*contribution))
    };
    let (light, far) = (in_one_line(light), away(*distance));
    format!("      light       \"{light}\"{sample} {far}: {brings}{}", share(lit.share))
}

fn json(arguments: &Explain, lives: &[SampleTrace], film: &Film) -> Value {
    json!({
        "scene": output::path_json(&arguments.scene),
        "pixel": arguments.pixel,
        "mean": mean(film),
        "samples": lives.iter().map(explain::json::life).collect::<Vec<_>>(),
    })
}
