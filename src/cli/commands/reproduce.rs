//! `rayfront reproduce IMAGE`: checks whether an image can be rendered again to the same bits.

use std::collections::HashSet;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use crate::cli::args::WorkOptions;
use crate::cli::failure::{Failure, Fault};
use crate::cli::job::{Job, OutputImage, gathered_of, header_of_image, mixed};
use crate::cli::output;
use crate::film::{Film, SampleRanges};
use crate::formats::DENOISED;
use crate::formats::film_file::{self, Begun, FilmFile, FilmHeader};
use crate::formats::picture::load_text;
use crate::integrator::Stop;
use crate::render::{MemoryEstimate, Options, RenderState, Session, on_threads};
use crate::world::Adaptive;

/// `rayfront reproduce`.
#[derive(Args, Debug)]
pub struct Reproduce {
    /// An image that rayfront has written (.png, .exr, .hdr), or a .film
    pub image: PathBuf,
    /// Path of the scene [default: the recorded path, if that is in the image's folder, or next to the image]
    #[arg(long, value_name = "FILE")]
    pub scene_file: Option<PathBuf>,
    /// The options of execution.
    #[command(flatten)]
    pub work: WorkOptions,
}

pub fn run(arguments: &Reproduce) -> Result<ExitCode, Failure> {
    on_threads(arguments.work.threads, || reproduce(arguments))?
}

fn reproduce(arguments: &Reproduce) -> Result<ExitCode, Failure> {
    let path = &arguments.image;
    let (header, film, denoised) = if film_file::is_film(path) {
        let FilmFile { header, film, .. } = film_file::load(path)?;
        (header, Some(film), None)
    } else {
        (header_of_image(path)?, None, load_text(path, DENOISED)?)
    };
    let mut job = Job::load_again(&header, arguments.scene_file.as_deref(), path, arguments.work.quiet)?;
    MemoryEstimate::usual(job.header.region).check(&job.setup, &job.header.settings)?;
    let session = render(&mut job, &header, &arguments.work.options())
        .ok_or_else(|| Failure::file(format!("{}: its record says what cannot be", path.display())))?;
    let found = format!("{:032x}", session.film().hash());
    // An image may show a mix of light groups.
    let shown = RenderState { film: mixed(&header, session.film())?, ..session.state().clone() };
    let cleaned = match denoised {
        Some(_) => job.going_on(&arguments.work.options(), shown.clone()).and_then(|shown| shown.denoised()),
        None => None,
    };
    let clean = cleaned.as_ref().map(|clean| format!("{:032x}", clean.hash()));
    let is_same_film = found == header.film_hash;
    // An image may have been changed since, and still have the same metadata.
    let shows_it = !is_same_film
        || film.is_some()
        || OutputImage::new(&header, &shown.film, 8)?.is_in(path, cleaned.as_ref())?;
    let identical = is_same_film && clean == denoised && shows_it;
    let places = film.as_ref().map(|film| differing(film, session.film()));
    if arguments.work.json {
        let json = json!({
            "image": output::path_json(path), "identical": identical, "film_hash": found, "film_hash_of_image": header.film_hash,
            "denoised_hash": clean, "denoised_hash_of_image": denoised,
            "shows_the_film": shows_it,
            "differing_pixels": places.as_ref().map(|(count, _)| count),
        });
        output::print(&format!("{json}\n"))?;
    } else if !arguments.work.quiet {
        let path = path.display();
        if identical {
            output::print(&format!("{path}: identical\nfilm      {found}\n"))?;
        } else {
            let what = match (is_same_film, places) {
                (true, _) if !shows_it => {
                    "the film is identical, but the image was changed afterwards: its pixels are others"
                        .to_owned()
                }
                (true, _) => "the film is identical, what was left without noise is not".to_owned(),
                (false, Some((count, Some([x, y])))) => {
                    format!("{count} pixels differ, the first at {x},{y}")
                }
                (false, _) => "the film differs".to_owned(),
            };
            let was = &header.film_hash;
            output::print(&format!("{path}: {what}\nfilm      {found}\nit was    {was}\n"))?;
        }
    }
    Ok(if identical { ExitCode::SUCCESS } else { Fault::Difference.code() })
}

/// Renders the samples of a film again; `None` if it names impossible ones.
fn render(job: &mut Job, header: &FilmHeader, work: &Options) -> Option<Session> {
    let mut session = job.session(work);
    let most = |session: &Session| {
        session.film().pixels().iter().map(|pixel| pixel.count[0] + pixel.count[1]).max().unwrap_or(0)
    };
    if header.settings.adaptive == Adaptive::On {
        // Round by round, as far as the film got.
        let up_to = header.begun.as_ref().map_or(header.most, |begun| begun.samples[0]);
        while !session.is_done() && most(&session) < up_to {
            session.advance(1);
        }
    }
    for range in header.ranges()?.iter() {
        if header.settings.adaptive == Adaptive::On {
            break;
        }
        session = session.with_samples(range);
        while !session.is_done() {
            job.advance(&mut session, 16, &Stop::NEVER, &|_| ()).ok()?;
        }
    }
    let Some(begun) = &header.begun else { return Some(session) };
    // From an interrupted pass, only the tiles that it reached are rendered.
    let region = job.header.region;
    let count = crate::render::tiles(region, begun.tile.max(1)).len() as u32;
    let reached: HashSet<u32> = begun.tiles.iter().copied().collect();
    let others = (0..count).filter(|tile| !reached.contains(tile)).collect();
    let rest = FilmHeader { begun: Some(Begun { tiles: others, ..begun.clone() }), ..header.clone() };
    let RenderState { film, moments, .. } = session.into_gathered();
    let gathered = gathered_of(FilmFile { header: rest, film, moments })?;
    let samples: SampleRanges = gathered.samples.clone();
    let mut session = job.going_on(work, gathered)?;
    job.advance(&mut session, 1, &Stop::NEVER, &|_| ()).ok()?;
    job.going_on(work, RenderState { samples, ..session.into_gathered() })
}

/// Returns the number of pixels in which two films differ, and the first of them.
fn differing(one: &Film, other: &Film) -> (usize, Option<[u32; 2]>) {
    let width = one.region().width().max(1);
    let mut places = (0u32..)
        .zip(one.pixels().iter().zip(other.pixels()))
        .filter(|(_, (a, b))| a != b)
        .map(|(place, _)| [one.region().x0 + place % width, one.region().y0 + place / width]);
    let first = places.next();
    (places.count() + usize::from(first.is_some()), first)
}
