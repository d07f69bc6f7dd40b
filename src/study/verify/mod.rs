//! Checks that all ways to render give the same film, and locates the first difference if not.

mod bisect;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use crate::film::Film;
use crate::integrator::{RenderSetup, Schedule};
use crate::render::{Options, Session, ThreadError, on_threads};
use crate::simd::Isa;
pub use bisect::{Difference, First};

/// The tested wave sizes.
const WAVES: [usize; 4] = [1, 7, 64, 4096];

/// One way to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    /// The schedule.
    pub schedule: Schedule,
    /// The number of paths in a wave; 0 for the recursive schedule, which has none.
    pub wave: usize,
    /// The instruction set.
    pub isa: Isa,
    /// The number of threads.
    pub threads: usize,
}

impl Way {
    fn options(&self) -> Options {
        // Several tiles even for small images, since otherwise the other threads would be idle.
        let tile = if self.threads == 1 { 64 } else { 16 };
        let (schedule, wave, isa) = (self.schedule, self.wave.max(1), self.isa);
        Options { schedule, wave, isa, tile, ..Options::default() }
    }
}

/// The result of one way.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// The way to render.
    pub way: Way,
    /// The hash of its film.
    pub hash: u128,
    /// The hash of its depths, normals and other features.
    pub features: u128,
    /// The hash of the denoised image; none if there is only one sample.
    pub denoised: Option<u128>,
}

impl Outcome {
    /// True if both have equal hashes.
    pub fn equals(&self, other: &Outcome) -> bool {
        (self.hash, self.features, self.denoised) == (other.hash, other.features, other.denoised)
    }
}

/// The results of all ways.
pub struct Verification {
    /// The outcome of every way; the first is the reference.
    pub outcomes: Vec<Outcome>,
    /// The first difference, if the films differ.
    pub difference: Option<Difference>,
}

impl Verification {
    /// Returns the number of outcomes that differ from the first.
    pub fn mismatches(&self) -> usize {
        self.outcomes.iter().filter(|outcome| !outcome.equals(&self.outcomes[0])).count()
    }
}

/// Returns all combinations of schedules, wave sizes and available instruction sets with one, two and `cores` threads,
/// the simplest first.
pub fn ways(cores: usize) -> Vec<Way> {
    let mut threads = vec![1, 2, cores.max(1)];
    threads.sort_unstable();
    threads.dedup();
    let mut ways = Vec::new();
    for threads in threads {
        for isa in Isa::available() {
            ways.push(Way { schedule: Schedule::Recursive, wave: 0, isa, threads });
            let wavefront = |wave| Way { schedule: Schedule::Wavefront, wave, isa, threads };
            ways.extend(WAVES.map(wavefront));
        }
    }
    ways
}

/// Renders all samples in all ways. After each way, `progress` gets the number of finished ways.
pub fn verify(
    setup: Arc<RenderSetup>,
    samples: u32,
    ways: &[Way],
    progress: &mut (dyn FnMut(usize) + Send),
) -> Result<Verification, ThreadError> {
    Bench { setup, samples, fault: None }.run(ways, progress)
}

/// The input of a verification.
struct Bench {
    setup: Arc<RenderSetup>,
    samples: u32,
    /// For tests: another render setup that some ways use instead.
    fault: Option<PlantedFault>,
}

/// Another render setup, and a predicate for the ways that use it.
type PlantedFault = (Arc<RenderSetup>, fn(&Way) -> bool);

impl Bench {
    fn session(&self, way: &Way) -> Session {
        let setup = match &self.fault {
            Some((setup, hits)) if hits(way) => setup,
            _ => &self.setup,
        };
        Session::of(setup.clone(), self.samples, way.options())
    }

    fn run(
        &self,
        ways: &[Way],
        progress: &mut (dyn FnMut(usize) + Send),
    ) -> Result<Verification, ThreadError> {
        let mut outcomes = Vec::new();
        let mut first: Option<(Way, Film)> = None;
        let mut difference = None;
        for group in ways.chunk_by(|a, b| a.threads == b.threads) {
            on_threads(group[0].threads, || {
                for way in group {
                    let mut session = self.session(way);
                    while !session.is_done() {
                        session.advance(u32::MAX);
                    }
                    let features = crate::film::features::hash(&session.features());
                    let denoised = session.denoised().map(|denoised| denoised.hash());
                    let hash = session.film().hash();
                    outcomes.push(Outcome { way: *way, hash, features, denoised });
                    match &first {
                        None => first = Some((*way, session.into_film())),
                        Some((simplest, film)) if difference.is_none() && film != session.film() => {
                            let sides = [
                                (*simplest, self.session(simplest), film),
                                (*way, self.session(way), session.film()),
                            ];
                            difference = bisect::narrow(sides);
                        }
                        Some(_) => {}
                    }
                    progress(outcomes.len());
                }
            })?;
        }
        Ok(Verification { outcomes, difference })
    }
}
