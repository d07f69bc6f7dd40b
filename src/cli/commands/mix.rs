//! `rayfront mix FILM`: mixes the light groups of a film, without rendering.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use crate::cli::args::{OutputOptions, PictureLook, WorkOptions};
use crate::cli::job::{Job, OutputImage, Outputs, Saved, aov, chosen_exposure, gathered_of, mixed};
use crate::cli::{failure::Failure, output};
use crate::film::Film;
use crate::formats::film_file::{self, FilmFile};
use crate::formats::picture::supported;
use crate::math::Rgb;
use crate::render::on_threads;

/// `rayfront mix`.
#[derive(Args, Debug)]
pub struct Mix {
    /// A film with light groups: of a scene whose lights have a group, or rendered with --light-groups
    pub film: PathBuf,
    /// Multiply the light of a group (* stands for any text), by a number or a colour, such as '"lamp".power_w *= 2';
    /// may be given several times [default: the groups are listed]
    #[arg(long, value_name = "STATEMENT")]
    pub set: Vec<String>,
    /// The options of display.
    #[command(flatten)]
    pub look: PictureLook,
    /// Path of the scene, which --denoise needs [default: the recorded path, if that is in the film's folder, or next
    /// to the film]
    #[arg(long, value_name = "FILE")]
    pub scene_file: Option<PathBuf>,
    /// The options of outputs.
    #[command(flatten)]
    pub output: OutputOptions,
    /// The options of execution.
    #[command(flatten)]
    pub work: WorkOptions,
}

pub fn run(arguments: &Mix) -> Result<ExitCode, Failure> {
    on_threads(arguments.work.threads, || mix(arguments))?
}

fn mix(arguments: &Mix) -> Result<ExitCode, Failure> {
    let (path, work) = (&arguments.film, &arguments.work);
    let outputs = Outputs::of(&arguments.output.output)?;
    outputs.images.iter().try_for_each(|path| supported(path))?;
    if outputs.film.is_some() || outputs.to_stdout {
        let reason = "a mix is an image, such as -o mix.png: the film holds all of its mixes already";
        return Err(Failure::command_line(reason));
    }
    let makes_image = !outputs.images.is_empty() || outputs.stdout_image.is_some();
    if !makes_image && !arguments.set.is_empty() {
        return Err(Failure::command_line("say where the image goes: -o mix.png"));
    }
    let mut file = film_file::load(path)?;
    if file.header.light_groups.is_empty() {
        return Err(Failure::file(format!(
            "{}: it has no light groups: give lights a group in the scene, or render with --light-groups",
            path.display()
        )));
    }
    arguments.look.apply(&mut file.header.settings);
    file.header.note.mix.clone_from(&arguments.set);
    let film = mixed(&file.header, &file.film)?;
    let mut saved = Saved::default();
    let exposure_ev = match makes_image {
        true => Some(write(arguments, &outputs, &file, &film, &mut saved)?),
        false => None,
    };
    let shares = shares(&film);
    let names = file.header.light_groups.iter().map(String::as_str).chain(["(rest)"]);
    let text = if work.json {
        let groups: Vec<_> =
            names.zip(&shares).map(|(name, share)| json!({"name": name, "share": share})).collect();
        let json = json!({
            "film": output::path_json(path), "outputs": output::paths_json(&saved.images), "light_groups": groups,
            "exposure_ev": exposure_ev,
        });
        format!("{json}\n")
    } else if work.quiet {
        String::new()
    } else {
        let images = saved.images.iter().map(|path| format!("image     {}\n", path.display()));
        let groups = names.zip(&shares).map(|(name, share)| format!("{:>8.2} %  {name}\n", 100.0 * share));
        let chosen = exposure_ev.filter(|_| file.header.settings.auto_exposure);
        // Else a lamp alone might look brighter than all together.
        let exposure = chosen.map(|ev| format!("exposure  {}, to compare mixes\n", chosen_exposure(ev)));
        images.chain(exposure).chain(groups).collect()
    };
    saved.report(output::print_text(&text, outputs.takes_stdout()));
    saved.end_of_mix()?;
    Ok(ExitCode::SUCCESS)
}

fn inconsistent(path: &std::path::Path) -> Failure {
    Failure::file(format!("{}: its header is inconsistent (sample ranges and tiles)", path.display()))
}

/// Writes the images of a mixed film; returns their exposure in stops.
fn write(
    arguments: &Mix,
    outputs: &Outputs,
    file: &FilmFile,
    film: &Film,
    saved: &mut Saved,
) -> Result<f32, Failure> {
    let FilmFile { header, .. } = file;
    let picture = OutputImage::new(header, film, arguments.output.bits)?;
    let channels = aov::light_layers(film, header, outputs);
    let mut denoised = None;
    if arguments.output.denoise {
        let (path, work) = (&arguments.film, &arguments.work);
        let job = Job::load_again(header, arguments.scene_file.as_deref(), path, work.quiet)?;
        let gathered = gathered_of(FilmFile { film: film.clone(), ..file.clone() });
        let session = gathered.and_then(|gathered| job.going_on(&work.options(), gathered));
        denoised = session.ok_or_else(|| inconsistent(path))?.denoised();
    }
    picture.write(&outputs.images, &channels, None, saved);
    if let Some(denoised) = &denoised {
        picture.write_denoised(&outputs.images, denoised, saved);
    }
    if let Some(encoding) = outputs.stdout_image {
        saved.pixels(picture.write_to_stdout(encoding, denoised.as_ref(), &channels, None));
    }
    Ok(picture.exposure_ev)
}

/// The share of each light group, and of what belongs to none, in an image's luminance.
fn shares(film: &Film) -> Vec<f64> {
    let luminance = |light: Vec<Rgb>| light.iter().map(|light| f64::from(light.luminance())).sum::<f64>();
    let all = luminance(film.radiance()).max(f64::MIN_POSITIVE);
    let groups = (0..film.light_groups()).map(|group| film.group_radiance(group));
    groups.chain([film.ungrouped_radiance()]).map(|light| luminance(light) / all).collect()
}
