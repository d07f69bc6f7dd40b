//! Renders parts of a film again, to check whether the machine that rendered it can be trusted.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::{Path, PathBuf};

use serde_json::json;

use crate::cli::job::Job;
use crate::cli::{failure::Failure, output};
use crate::film::Region;
use crate::formats::film_file::FilmFile;
use crate::integrator::Stop;
use crate::render::{Options, Session};

/// The width and height in pixels of the tiles that are chosen at random.
const TILE: u32 = 16;

/// The result of auditing a film.
pub struct Audited {
    path: PathBuf,
    hosts: Vec<String>,
    /// The number of tiles rendered again.
    tiles: usize,
    /// The number of them that differ.
    pub differing: usize,
    /// The first tile that differs.
    first: Option<Region>,
}

impl Audited {
    /// Returns the result in a line.
    pub fn line(&self) -> String {
        let Audited { path, tiles, differing, .. } = self;
        format!("{}: {tiles} tiles rendered again, {differing} differ", path.display())
    }

    /// Returns the reason not to trust the film, if any tile differs.
    pub fn complaint(&self) -> Option<String> {
        let Region { x0, y0, x1, y1 } = self.first?;
        let hosts = if self.hosts.is_empty() { "?".to_owned() } else { self.hosts.join(", ") };
        let Audited { tiles, differing, path, .. } = self;
        let path = path.display();
        Some(format!(
            "{path} (rendered on {hosts}): {differing} of {tiles} tiles differ from what this machine renders, such as pixels {x0},{y0},{x1},{y1}: render it again elsewhere"
        ))
    }

    /// Returns the result as JSON.
    pub fn json(&self) -> serde_json::Value {
        json!({ "film": output::path_json(&self.path), "hosts": self.hosts, "tiles": self.tiles, "differing": self.differing })
    }
}

pub fn parse(text: &str) -> Result<f64, String> {
    let part = text.strip_suffix('%').and_then(|percent| percent.trim().parse::<f64>().ok());
    let part = part.map(|percent| percent / 100.0).filter(|part| *part > 0.0 && *part <= 1.0);
    part.ok_or_else(|| "expected a percentage above 0 and at most 100, such as 1%".into())
}

/// Renders a fraction of a film's tiles again and compares them.
pub fn audit(
    job: &mut Job,
    file: &FilmFile,
    path: &Path,
    part: f64,
    work: &Options,
) -> Result<Audited, Failure> {
    let region = file.film.region();
    let tiles = crate::render::tiles(region, TILE);
    let count = ((tiles.len() as f64 * part).ceil() as usize).clamp(1, tiles.len().max(1));
    // At random: someone who knew the tiles could prepare for the audit.
    let random = RandomState::new();
    let mut drawn: Vec<(u64, Region)> = tiles
        .into_iter()
        .enumerate()
        .map(|(number, tile)| {
            let mut hasher = random.build_hasher();
            hasher.write_usize(number);
            (hasher.finish(), tile)
        })
        .collect();
    drawn.sort_unstable_by_key(|(order, _)| *order);
    let mut audited = Audited {
        path: path.to_owned(),
        hosts: file.header.note.hosts.clone(),
        tiles: count,
        differing: 0,
        first: None,
    };
    for (_, tile) in drawn.into_iter().take(count) {
        if !is_same(job, file, tile, work)? {
            audited.differing += 1;
            audited.first.get_or_insert(tile);
        }
    }
    Ok(audited)
}

/// True if a tile has the same bits in the film as when it is rendered here.
fn is_same(job: &mut Job, file: &FilmFile, tile: Region, work: &Options) -> Result<bool, Failure> {
    let mut again = job.session_of(work, tile);
    let mut add = |again: Session, [start, end]: [u32; 2]| -> Result<Session, Failure> {
        let mut again = again.with_samples(start..end);
        while !again.is_done() {
            job.advance(&mut again, 16, &Stop::NEVER, &|_| ())?;
        }
        Ok(again)
    };
    for range in &file.header.samples {
        again = add(again, *range)?;
    }
    let whole = again.film().pixels().to_vec();
    let begun = of_unfinished_pass(file, tile);
    if let Some(pass) = file.header.begun.as_ref().filter(|_| !begun.is_empty()) {
        again = add(again, pass.samples)?;
    }
    let width = tile.width().max(1) as usize;
    let has =
        |part: &Region, x: u32, y: u32| (part.x0..part.x1).contains(&x) && (part.y0..part.y1).contains(&y);
    let rows = whole.chunks(width).zip(again.film().pixels().chunks(width));
    Ok((tile.y0..tile.y1).zip(rows).all(|(y, (whole, begun_too))| {
        let start = file.film.region().index(tile.x0, y);
        let found = &file.film.pixels()[start..start + whole.len()];
        (tile.x0..tile.x1).zip(found).zip(whole.iter().zip(begun_too)).all(
            |((x, found), (whole, begun_too))| {
                let is_begun = begun.iter().any(|part| has(part, x, y));
                found == if is_begun { begun_too } else { whole }
            },
        )
    }))
}

/// Returns the parts of a tile that have the samples of an unfinished pass.
fn of_unfinished_pass(file: &FilmFile, tile: Region) -> Vec<Region> {
    let Some(begun) = &file.header.begun else { return Vec::new() };
    let tiles = crate::render::tiles(file.film.region(), begun.tile.max(1));
    let done = begun.tiles.iter().filter_map(|number| tiles.get(*number as usize)).copied();
    done.filter(|part| part.x0 < tile.x1 && tile.x0 < part.x1 && part.y0 < tile.y1 && tile.y0 < part.y1)
        .collect()
}
