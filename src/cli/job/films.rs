//! Conversions between the state of a render and film files, and words about films.

use std::path::Path;

use crate::cli::failure::Failure;
use crate::error::{Diagnostic, SaveError};
use crate::film::{Allocation, SampleRanges};
use crate::formats::film_file::{self, Begun, FilmFile, FilmHeader};
use crate::render::{RenderPass, RenderState, adaptive};
use crate::world::Adaptive;

/// Returns the film that already exists at a path, if any. It must be of the same samples; another film is replaced
/// only if `overwrite` is set.
pub fn load_existing_film(
    path: &Path,
    header: &FilmHeader,
    overwrite: bool,
) -> Result<Option<FilmFile>, Failure> {
    if overwrite || !path.exists() {
        return Ok(None);
    }
    let to_do = "--overwrite replaces it";
    let film = film_file::load(path).map_err(|error| Failure::output(format!("{error}; {to_do}")))?;
    match film.header.difference_of_job(header) {
        Some(what) => Err(Failure::output(format!("{} is {what}: {to_do}", path.display()))),
        None => Ok(Some(film)),
    }
}

/// Returns the state of the render in a film file; `None` if it is inconsistent.
pub fn gathered_of(file: FilmFile) -> Option<RenderState> {
    let FilmFile { header, film, moments } = file;
    let samples = header.ranges()?;
    let pass = match &header.begun {
        None => None,
        Some(Begun { samples: [start, end], until, tile, tiles, blocks }) => {
            let range = *start..*end;
            let sound = !range.is_empty() && samples.common(&SampleRanges::of(range.clone())).is_none();
            let mut pass = RenderPass::new(range, (*tile).max(1), header.region);
            pass.until = until.unwrap_or(*end);
            for number in tiles {
                *pass.done.get_mut(*number as usize)? = true;
            }
            if let Some(blocks) = blocks {
                let mut chosen = vec![false; adaptive::blocks(header.region).len()];
                for number in blocks {
                    *chosen.get_mut(*number as usize)? = true;
                }
                pass.blocks = Some(chosen);
            }
            Some(sound.then_some(pass)?)
        }
    };
    let FilmHeader { rays, allocation, .. } = header;
    let is_sound = allocation.as_ref().is_none_or(Allocation::is_sound);
    is_sound.then_some(RenderState { film, moments, samples, pass, rays, allocation })
}

/// Records the contents of the film in its header.
pub fn describe(header: &mut FilmHeader, gathered: &RenderState) {
    header.set_film(&gathered.film, gathered.moments.as_ref());
    header.set_ranges(&gathered.samples);
    header.rays.clone_from(&gathered.rays);
    header.allocation.clone_from(&gathered.allocation);
    header.begun = gathered.pass.as_ref().map(|pass| Begun {
        samples: [pass.samples.start, pass.samples.end],
        until: (pass.until > pass.samples.end).then_some(pass.until),
        tile: pass.tile,
        tiles: numbers(&pass.done),
        blocks: pass.blocks.as_ref().map(|blocks| numbers(blocks)),
    });
}

/// Returns the indices of the flags that are set.
fn numbers(flags: &[bool]) -> Vec<u32> {
    (0..).zip(flags).filter(|(_, is_set)| **is_set).map(|(number, _)| number).collect()
}

/// Saves a film. The header must describe it: see [`describe`].
pub fn save(path: &Path, header: &FilmHeader, gathered: &RenderState) -> Result<(), SaveError> {
    film_file::save(path, header, &gathered.film, gathered.moments.as_ref())
}

/// Writes a film to standard output. The header must describe it.
pub fn write_to_stdout(header: &FilmHeader, gathered: &RenderState) -> Result<(), Failure> {
    film_file::write(&mut std::io::stdout().lock(), header, &gathered.film, gathered.moments.as_ref())
        .map_err(Failure::stdout("the film"))
}

/// Returns the number of samples that pixels have, and the number wanted.
pub fn samples(header: &FilmHeader) -> String {
    let FilmHeader { samples, most, settings, .. } = header;
    let asked = settings.samples;
    let done: u32 = samples.iter().map(|[start, end]| end - start).sum();
    let is_uneven = settings.adaptive != Adaptive::Off && *most > samples.last().map_or(0, |[_, end]| *end);
    match &header.allocation {
        Some(allocation) => {
            let (least, most) = (allocation.samples().iter().min().copied().unwrap_or(0), allocation.most());
            let part = if done == most { String::new() } else { format!("{done} of ") };
            format!("{part}{least} to {most}, for the rays of {asked}")
        }
        None if is_uneven => format!("{done} to {most}, for the rays of {asked}"),
        None if asked == done => done.to_string(),
        None => format!("{done} of {asked}"),
    }
}

/// Returns a warning if some of the moments of motion blur have no samples.
pub fn uneven_blur(header: &FilmHeader) -> Option<Diagnostic> {
    let (moments, total) = (header.view.moments(), header.settings.samples);
    let there = header.view.moments_among(&header.samples, total);
    let all = header.view.moments_among(&[[0, total]], total);
    (moments > 1 && there < all).then(|| {
        let text =
            format!("motion is blurred by {there} of {moments} moments, since not all samples are there");
        Diagnostic::warning("uneven-blur", text)
    })
}
