//! `rayfront merge FILM…`: merges films of different samples of one image.

mod audit;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use serde_json::json;

use self::audit::Audited;
use crate::cli::args::{OutputOptions, WorkOptions};
use crate::cli::command_line::{of_samples, of_shard};
use crate::cli::job::record::{self, scene_of};
use crate::cli::job::{
    Job, OutputImage, Outputs, Saved, aov, describe, gathered_of, load_existing_film, noise_line, samples,
    save, uneven_blur, write_to_stdout,
};
use crate::cli::{failure::Failure, output};
use crate::film::{FilmChannel, SampleRanges};
use crate::formats::film_file::{self, FilmFile, FilmHeader};
use crate::formats::picture::supported;
use crate::render::{MemoryEstimate, RenderState, Session, film_channels, on_threads};
use crate::world::Adaptive;

/// `rayfront merge`.
#[derive(Args, Debug)]
pub struct Merge {
    /// Films of one image, in any order; a folder for the part-*.film in it; - for one film after another on standard
    /// input
    #[arg(required = true)]
    pub films: Vec<PathBuf>,
    /// Make the image even if samples are missing
    #[arg(long)]
    pub partial: bool,
    /// Refuse films of a scene that has been changed since
    #[arg(long)]
    pub current: bool,
    /// Render this part of every film again, chosen at random, and compare the bits, such as 1%
    #[arg(long, value_name = "PERCENT", value_parser = audit::parse)]
    pub audit: Option<f64>,
    /// Path of the scene, if it is needed (--denoise, --audit, --current, output variables) [default: the recorded
    /// path, if that is in the first film's folder, or next to that film]
    #[arg(long, value_name = "FILE")]
    pub scene_file: Option<PathBuf>,
    /// The options of outputs.
    #[command(flatten)]
    pub output: OutputOptions,
    /// The options of execution.
    #[command(flatten)]
    pub work: WorkOptions,
}

pub fn run(arguments: &Merge) -> Result<ExitCode, Failure> {
    on_threads(arguments.work.threads, || merge(arguments))?.map(ExitCode::from)
}

/// The result of the films merged so far.
struct Merged {
    header: FilmHeader,
    gathered: RenderState,
    /// The scene, if it is needed.
    job: Option<Job>,
    /// The films with their samples, including those that only some of their pixels have.
    parts: Vec<(PathBuf, SampleRanges, FilmHeader)>,
    audited: Vec<Audited>,
}

fn merge(arguments: &Merge) -> Result<u8, Failure> {
    let start = Instant::now();
    let outputs = Outputs::of(&arguments.output.output)?;
    outputs.images.iter().try_for_each(|path| supported(path))?;
    outputs.film.iter().try_for_each(|path| film_file::writable(path))?;
    let mut merged: Option<Merged> = None;
    let films = arguments.films.iter().map(|path| films_at(path)).collect::<Result<Vec<_>, _>>()?.concat();
    for path in &films {
        if path.as_os_str() == "-" {
            let mut input = std::io::stdin().lock();
            let name = Path::new("standard input");
            let mut number = 0;
            while let Some(film) = film_file::read(&mut input, name)? {
                number += 1;
                let path = PathBuf::from(format!("film {number} of standard input"));
                add(&mut merged, film, &path, arguments)?;
            }
        } else {
            add(&mut merged, film_file::load(path)?, path, arguments)?;
        }
    }
    let Some(mut merged) = merged else {
        return Err(Failure::file("standard input: there is no film"));
    };
    let scene = scene_of(&merged.header, &merged.parts[0].0, arguments.scene_file.as_deref());
    // Changes of a scene that must not be read go unnoticed.
    let scene = if arguments.current { Some(scene?) } else { scene.ok() };
    if let Some(changed) = scene.and_then(|scene| merged.header.scene.changed(&scene)) {
        let changed = format!("{} has been changed since the films were rendered", changed.display());
        if arguments.current {
            return Err(Failure::file(format!("{changed}: render the parts again (--overwrite)")));
        }
        output::note(format_args!("warning: {changed}: this is the scene as it was"));
    }
    describe(&mut merged.header, &merged.gathered);
    let missing = merged.gathered.samples.missing(0..merged.header.total());
    let unfinished = merged.parts.iter().any(|(_, _, header)| header.begun.is_some());
    if missing.count() > 0 && !arguments.partial {
        return Err(Failure::file(what_is_missing(&merged, &missing)));
    }
    if merged.audited.iter().any(|audited| audited.differing > 0) {
        let lines: Vec<_> = merged.audited.iter().filter_map(Audited::complaint).collect();
        return Err(Failure::difference(lines.join("\n")));
    }
    if unfinished && (outputs.film.is_some() || outputs.to_stdout) {
        let reason = "a film made of unfinished films cannot be continued";
        return Err(Failure::command_line(format!(
            "{reason}: finish them with rayfront resume, or ask for images alone"
        )));
    }
    // The outputs of the parts are not those of the merge.
    merged.header.note.outputs.clone_from(&outputs.images);
    merged.header.wanted = [0, merged.header.settings.samples];
    merged.header.shard = None;
    merged.header.note.stopped_by = None;
    let mut saved = Saved::default();
    if let Some(path) = &outputs.film {
        let is_part = films.iter().any(|film| crate::files::are_same(film, path));
        if is_part && !arguments.output.overwrite {
            let path = path.display();
            return Err(Failure::output(format!(
                "{path} is one of the films to merge: name another with -o"
            )));
        }
        load_existing_film(path, &merged.header, arguments.output.overwrite)?;
        saved.film(path, save(path, &merged.header, &merged.gathered));
    }
    if outputs.to_stdout {
        saved.pixels(write_to_stdout(&merged.header, &merged.gathered));
    }
    write_images(arguments, &outputs, merged, &missing, start, saved)
}

/// Returns the films that a path stands for.
fn films_at(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let folder = path.display();
    let unreadable = |error: std::io::Error| Failure::file(format!("{folder}: {error}"));
    let entries = std::fs::read_dir(path).map_err(unreadable)?;
    let is_part = |name: &str| name.starts_with("part-") && name.ends_with(".film");
    let parts = entries.flatten().filter(|entry| is_part(&entry.file_name().to_string_lossy()));
    let mut parts: Vec<_> = parts.map(|entry| entry.path()).collect();
    parts.sort();
    match parts.is_empty() {
        true => Err(Failure::file(format!("{folder}: no part-*.film is in this folder"))),
        false => Ok(parts),
    }
}

/// Adds a film, if it belongs to the others.
fn add(merged: &mut Option<Merged>, film: FilmFile, path: &Path, arguments: &Merge) -> Result<(), Failure> {
    let wrong = |reason: String| Failure::file(format!("{}: {reason}", path.display()));
    let header = film.header.clone();
    if header.begun.is_some() && !arguments.partial {
        let resume = record::resume(path, &header);
        return Err(wrong(format!("it is unfinished: {resume}")));
    }
    if header.settings.adaptive == Adaptive::On {
        let resume = record::resume(path, &header);
        return Err(wrong(format!(
            "adaptive samples that are chosen in rounds are in one film: {resume} -o image.png"
        )));
    }
    if let Some(first) = merged
        && let Some(what) = header.difference(&first.header)
    {
        return Err(wrong(format!("{what} (as in {})", first.parts[0].0.display())));
    }
    let has = header.ranges().unwrap_or_default();
    let mut touched = has.clone();
    header.begun.iter().for_each(|begun| touched.insert(begun.samples[0]..begun.samples[1]));
    for (other, theirs, _) in merged.iter().flat_map(|merged| &merged.parts) {
        if let Some(both) = theirs.common(&touched) {
            let (other, both) = (other.display(), SampleRanges::of(both));
            return Err(wrong(format!("{other} has samples {both}, too")));
        }
    }
    let mut audited = Vec::new();
    let needs_scene = arguments.output.denoise
        || arguments.audit.is_some()
        || header.settings.aov.iter().any(|aov| !aov.is_of_film()) && !arguments.output.output.is_empty();
    let mut job = match merged {
        None if needs_scene => {
            Some(Job::load_again(&header, arguments.scene_file.as_deref(), path, arguments.work.quiet)?)
        }
        _ => None,
    };
    let known = match merged {
        Some(merged) => merged.job.as_mut(),
        None => job.as_mut(),
    };
    if let (Some(part), Some(job)) = (arguments.audit, known) {
        audited.push(audit::audit(job, &film, path, part, &arguments.work.options())?);
    }
    let gathered = gathered_of(film)
        .ok_or_else(|| wrong("its header is inconsistent (sample ranges and tiles)".into()))?;
    match merged {
        None => {
            let gathered = RenderState { pass: None, ..gathered };
            let parts = vec![(path.to_owned(), touched, header.clone())];
            *merged = Some(Merged { header, gathered, job, parts, audited });
        }
        Some(merged) => {
            if let Some(what) = header.difference_of_picture(&merged.header)
                && !arguments.output.output.is_empty()
            {
                let (path, first) = (path.display(), merged.parts[0].0.display());
                output::note(format_args!("warning: {path}: {what}, as in {first}, which counts"));
            }
            merged.gathered.merge(&gathered);
            let (note, more) = (&mut merged.header.note, &header.note);
            note.seconds += more.seconds;
            let new = more.hosts.iter().filter(|host| !note.hosts.contains(host)).cloned();
            note.hosts = note.hosts.iter().cloned().chain(new).collect();
            merged.parts.push((path.to_owned(), touched, header));
            merged.audited.append(&mut audited);
        }
    }
    Ok(())
}

/// The largest number of commands to print.
const MOST_COMMANDS: usize = 64;

/// Returns the missing samples and the commands that render them.
fn what_is_missing(merged: &Merged, missing: &SampleRanges) -> String {
    let total = merged.header.total();
    let mut lines =
        vec![format!("samples {missing} of {total} are missing (--partial makes the image of the others):")];
    let unfinished = |(_, _, header): &&(PathBuf, SampleRanges, FilmHeader)| {
        header.ranges().is_none_or(|has| has.missing(header.wanted[0]..header.wanted[1]).count() > 0)
    };
    let mut missing = missing.clone();
    for (path, _, header) in merged.parts.iter().filter(unfinished) {
        lines.push(format!("  {}", record::resume(path, header)));
        let [start, end] = header.wanted;
        missing = SampleRanges::of(start..end).missing_from(&missing);
    }
    let (path, _, header) = &merged.parts[0];
    match header.shard {
        Some([_, count]) => {
            let lost = |index: &u32| {
                let part = SampleRanges::of(header.part(*index, count));
                missing.common(&part).is_some()
            };
            let mut lost = (0..count).filter(lost);
            let commands = lost.by_ref().take(MOST_COMMANDS);
            lines.extend(commands.map(|index| format!("  {}", of_shard(header, path, [index, count]))));
            if lost.next().is_some() {
                lines.push("  and more".into());
            }
        }
        None => {
            let commands = missing.iter().map(|range| of_samples(header, path, range));
            lines.extend(commands.map(|command| format!("  {command}")));
        }
    }
    lines.join("\n")
}

fn of_other_pixels() -> Failure {
    Failure::file("the films are of other pixels than the image: render them again")
}

/// Returns the channels of an image besides colour, and the names of the ids in them. Those that the film does not hold
/// need a session.
fn channels_of(
    header: &FilmHeader,
    gathered: &RenderState,
    session: Option<(&Session, &Job)>,
    outputs: &Outputs,
) -> (Vec<FilmChannel>, Option<String>) {
    let aovs = &header.settings.aov;
    let mut channels = match session {
        Some((session, _)) => session.channels(aovs),
        None => film_channels(gathered, aovs),
    };
    let manifest = session.and_then(|(session, job)| aov::manifest(&channels, &job.names, session.scene()));
    channels.extend(aov::light_layers(&gathered.film, header, outputs));
    (channels, manifest)
}

fn write_images(
    arguments: &Merge,
    outputs: &Outputs,
    merged: Merged,
    missing: &SampleRanges,
    start: Instant,
    mut saved: Saved,
) -> Result<u8, Failure> {
    let Merged { header, gathered, job, parts, audited } = merged;
    let images = aov::with_file(&outputs.images, &header.settings.aov);
    images.iter().try_for_each(|path| supported(path))?;
    let noise = gathered.film.relative_noise();
    if let Some(job) = &job {
        let denoises = arguments.output.denoise;
        let needs = MemoryEstimate {
            denoises,
            has_film: true,
            saves_film: false,
            ..MemoryEstimate::usual(job.header.region)
        };
        needs.check(&job.setup, &header.settings)?;
    }
    let held = match &job {
        Some(job) => Ok(job.going_on(&arguments.work.options(), gathered).ok_or_else(of_other_pixels)?),
        None => Err(gathered),
    };
    let (session, gathered) = match &held {
        Ok(session) => (Some(session), session.state()),
        Err(gathered) => (None, gathered),
    };
    if let Some(fault) = uneven_blur(&header).filter(|_| !images.is_empty()) {
        output::note(format_args!("warning: {fault}"));
    }
    let picture = OutputImage::new(&header, &gathered.film, arguments.output.bits);
    let Ok(picture) = picture.map_err(|failure| saved.pixels(Err(failure))) else {
        return saved.end_of_merge(&header, gathered, &arguments.films).map(|()| 0);
    };
    let shows = !images.is_empty() || outputs.stdout_image.is_some();
    let held = session.zip(job.as_ref()).filter(|_| shows);
    let (channels, manifest) =
        channels_of(&header, gathered, held, &Outputs { images: images.clone(), ..outputs.clone() });
    picture.write(&images, &channels, manifest.clone(), &mut saved);
    let mut written: Vec<PathBuf> = saved.images.iter().chain(&saved.film).cloned().collect();
    let denoised = session.filter(|_| arguments.output.denoise).and_then(|session| session.denoised());
    match &denoised {
        Some(denoised) => written.extend(picture.write_denoised(&outputs.images, denoised, &mut saved)),
        None if arguments.output.denoise => {
            output::note("warning: nothing is denoised: that takes two samples of each pixel");
        }
        None => {}
    }
    if let Some(encoding) = outputs.stdout_image {
        saved.pixels(picture.write_to_stdout(encoding, denoised.as_ref(), &channels, manifest));
    }
    let films: Vec<_> = parts.iter().map(|(path, _, _)| output::path_json(path)).collect();
    let text = if arguments.work.json {
        let region = header.region;
        let json = json!({
            "program": "rayfront", "version": env!("CARGO_PKG_VERSION"),
            "scene": output::path_json(&header.scene.path), "films": films,
            "outputs": output::paths_json(&written),
            "size": header.settings.size, "region": [region.x0, region.y0, region.x1, region.y1],
            "samples": gathered.samples.count(), "samples_asked": header.settings.samples,
            "missing": missing.to_string(), "noise": noise, "hosts": header.note.hosts,
            "render_seconds": header.note.seconds, "seconds": start.elapsed().as_secs_f64(),
            "exposure_ev": picture.exposure_ev, "film_hash": header.film_hash,
            "audited": audited.iter().map(Audited::json).collect::<Vec<_>>(),
        });
        format!("{json}\n")
    } else if arguments.work.quiet {
        String::new()
    } else {
        let mut text = String::new();
        written.iter().for_each(|path| text += &format!("image     {}\n", path.display()));
        let count = films.len();
        text += &format!("samples   {}, in {count} films\n", samples(&header));
        if missing.count() > 0 {
            text += &format!("missing   {missing}\n");
        }
        audited.iter().for_each(|audited| text += &format!("audit     {}\n", audited.line()));
        if let Some(noise) = noise {
            text += &format!("noise     {}\n", noise_line(noise, gathered.film.samples_per_pixel(), false));
        }
        text + &format!("film      {}\n", header.film_hash)
    };
    saved.report(output::print_text(&text, outputs.takes_stdout()));
    saved.end_of_merge(&header, gathered, &arguments.films)?;
    Ok(0)
}
