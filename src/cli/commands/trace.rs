//! `rayfront trace SCENE --rays FILE`: traces rays from a file, writes the hits, and measures the speed.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::{Value, json};

use crate::bvh::{self, Bvh, Coherence, HitsMut, Rays, Stack};
use crate::cli::args::{COHERENCES, ImageSize, ModelOptions, name_of, one_of, parse_level, parse_size};
use crate::cli::{failure::Failure, output, process_times};
use crate::files::are_same;
use crate::files::atomic_write::writable;
use crate::formats::rays::{HIT_BYTES, HitRecord, HitSummary, RAY_BYTES, load_hits, load_rays, save_hits};
use crate::math::Hit;
use crate::query::{HitBatch, RayBatch};
use crate::render::thread_pool;
use crate::scene::CompiledScene;
use crate::simd::Isa;
use crate::world::{Camera, World};

/// The number of rays that a thread takes at a time.
const CHUNK: usize = bvh::QUEUE;

/// `rayfront trace`.
#[derive(Args, Debug)]
pub struct Trace {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// File of rays: 8 little-endian 32-bit floats each, origin x y z, direction x y z, t_min, t_max
    #[arg(long, value_name = "FILE")]
    pub rays: PathBuf,
    /// File for the hits: for each ray 3 floats t u v and the primitive as a 32-bit integer; infinity 0 0 and 2^32 - 1
    /// for a miss
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Only test whether each ray hits anything: 0 0 0 and primitive 0 for each that does
    #[arg(long)]
    pub any: bool,
    /// Take the rays as relative to the origin of the compiled scene, as profile --capture writes them where that is
    /// not the world's
    #[arg(long)]
    pub relative: bool,
    /// Trace this many times; the best time counts
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub repeat: u32,
    /// Threads; 0 means one for each core
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Instruction set [default: the widest available]; the hits are the same
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub simd: Option<Isa>,
    /// Coherence of consecutive rays; the hits are the same
    #[arg(long, default_value = "unknown", value_parser = one_of(COHERENCES))]
    pub coherence: Coherence,
    /// Hits to compare with, in the format of --out
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Size of the image in pixels, for which curved shapes are fine enough [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<ImageSize>,
    /// Name of the camera for which curved shapes are fine enough [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
}

pub fn run(arguments: &Trace) -> Result<ExitCode, Failure> {
    let threads = thread_pool(arguments.threads)?;
    let mut rays = load_rays(&arguments.rays, most_rays())?;
    let reference = reference(arguments, rays.len())?;
    let scene = threads.install(|| load(arguments))?;
    if !arguments.relative {
        rays.relative_to(scene.compiled.origin);
    }
    arguments.out.iter().try_for_each(|path| writable(path))?;
    if let Some(out) = &arguments.out
        && [Some(&arguments.rays), arguments.reference.as_ref()]
            .into_iter()
            .flatten()
            .any(|read| are_same(read, out))
    {
        return Err(Failure::command_line(format!("{} is read: name another --out", out.display())));
    }

    let query = TraceQuery {
        bvh: &scene.compiled.bvh,
        isa: arguments.simd.unwrap_or(Isa::detect()),
        coherence: arguments.coherence,
        any: arguments.any,
        threads: threads.current_num_threads(),
        stacks: Mutex::default(),
    };
    let mut answers = Answers::new(rays.len(), query.any);
    let mut best = Time { wall: Duration::MAX, cpu: None };
    for _ in 0..arguments.repeat {
        best = best.or_less(query.trace(&rays, &mut answers));
    }
    if let Some(out) = &arguments.out {
        save_hits(out, answers.records())?;
    }
    let mismatches = reference.map(|reference| mismatches(&answers, &reference, query.any));
    let report = TraceReport {
        arguments,
        scene: &scene,
        query: &query,
        rays: rays.len(),
        hits: HitSummary::of(answers.records()),
        best,
        mismatches,
    };
    let text = if arguments.json { format!("{}\n", report.json()) } else { report.text() };
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the largest number of rays that fit in memory, with their hits and reference hits.
fn most_rays() -> u64 {
    let each = RAY_BYTES + size_of::<Hit>() + HIT_BYTES;
    crate::memory::available().unwrap_or(u64::MAX) / each as u64
}

fn reference(arguments: &Trace, rays: usize) -> Result<Option<Vec<HitRecord>>, Failure> {
    let Some(path) = &arguments.reference else { return Ok(None) };
    let hits = load_hits(path, most_rays())?;
    if hits.len() != rays {
        return Err(Failure::file(format!(
            "{}: has {} hits and {} has {rays} rays: they do not belong together",
            path.display(),
            hits.len(),
            arguments.rays.display()
        )));
    }
    Ok(Some(hits))
}

/// The scene, and the time that it took to load and compile it.
struct TracedScene {
    compiled: CompiledScene,
    load: Duration,
    compile: Duration,
}

fn load(arguments: &Trace) -> Result<TracedScene, Failure> {
    let start = Instant::now();
    let mut world = crate::formats::load_with(&arguments.scene, &arguments.model.of_size(arguments.size))?;
    if let Some(out) = &arguments.out {
        super::check_is_not_read(out, &world.assets.files, "--out")?;
    }
    let load = start.elapsed();
    let start = Instant::now();
    give_camera(&mut world);
    let compiled = crate::compile::compile(&world, arguments.camera.as_deref())
        .map_err(Failure::compile(&arguments.scene))?;
    Ok(TracedScene { compiled, load, compile: start.elapsed() })
}

/// Adds a camera to a scene without one: rays come from a file, but compiling needs a camera.
fn give_camera(world: &mut World) {
    if crate::compile::camera_names(world).is_empty() {
        world.entities.spawn((Camera::Orthographic { height_m: 1.0 },));
    }
}

/// The query and its parameters.
struct TraceQuery<'a> {
    bvh: &'a Bvh,
    isa: Isa,
    coherence: Coherence,
    any: bool,
    threads: usize,
    /// The threads' buffers. They are reused from one repetition to the next, as in a renderer, with the measured
    /// speeds of the kernels.
    stacks: Mutex<Vec<Stack>>,
}

/// The time that all rays took.
#[derive(Clone, Copy)]
struct Time {
    wall: Duration,
    /// The CPU time of all threads in seconds, if the system provides it.
    cpu: Option<f64>,
}

impl Time {
    fn or_less(self, other: Time) -> Time {
        let cpu = match (self.cpu, other.cpu) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Time { wall: self.wall.min(other.wall), cpu }
    }
}

/// The work that a thread takes at a time: rays, and the places for their results.
type TraceJob<'a> = (Rays<'a>, Places<'a>);

enum Places<'a> {
    Hits(HitsMut<'a>),
    Blocked(&'a mut [u32]),
}

impl TraceQuery<'_> {
    /// Traces all rays once. Threads take chunks in turn, so that none waits for another.
    fn trace(&self, rays: &RayBatch, answers: &mut Answers) -> Time {
        let jobs: Vec<TraceJob> = rays.chunks(CHUNK).zip(answers.places()).collect();
        let jobs = Mutex::new(jobs.into_iter());
        let start = Instant::now();
        let cpu = std::thread::scope(|scope| {
            // If no more threads can be started, the existing ones do all the work.
            let spawn = |_| std::thread::Builder::new().spawn_scoped(scope, || self.work(&jobs)).ok();
            let others: Vec<_> = (1..self.threads).map_while(spawn).collect();
            let own = self.work(&jobs);
            others.into_iter().fold(own, |sum, other| {
                let other = other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                sum.zip(other).map(|(a, b)| a + b)
            })
        });
        Time { wall: start.elapsed(), cpu }
    }

    /// Works until no job is left; returns the thread's CPU seconds.
    fn work<'a>(&self, jobs: &Mutex<impl Iterator<Item = TraceJob<'a>>>) -> Option<f64> {
        let stack = self.stacks.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut stack = stack.unwrap_or_else(|| Stack::new(self.bvh));
        let start = process_times::thread_cpu_seconds();
        let next = || jobs.lock().unwrap_or_else(PoisonError::into_inner).next();
        while let Some((rays, places)) = next() {
            match places {
                Places::Hits(hits) => {
                    bvh::closest(self.isa, self.bvh, rays, self.coherence, &mut stack, hits);
                }
                Places::Blocked(blocked) => {
                    bvh::any(self.isa, self.bvh, rays, self.coherence, &mut stack, blocked);
                }
            }
        }
        let took = start.zip(process_times::thread_cpu_seconds()).map(|(before, after)| after - before);
        self.stacks.lock().unwrap_or_else(PoisonError::into_inner).push(stack);
        took
    }
}

/// The results of all rays.
enum Answers {
    Hits(HitBatch),
    Blocked(Vec<u32>),
}

impl Answers {
    fn new(count: usize, any: bool) -> Answers {
        // Not zeros: the system would provide their pages one by one while the time is measured.
        if any { Answers::Blocked(vec![u32::MAX; count]) } else { Answers::Hits(HitBatch::new(count)) }
    }

    /// Returns the chunks that jobs write to.
    fn places(&mut self) -> Box<dyn Iterator<Item = Places<'_>> + '_> {
        match self {
            Answers::Hits(hits) => Box::new(hits.chunks_mut(CHUNK).map(Places::Hits)),
            Answers::Blocked(blocked) => Box::new(blocked.chunks_mut(CHUNK).map(Places::Blocked)),
        }
    }

    fn records(&self) -> Box<dyn Iterator<Item = HitRecord> + '_> {
        match self {
            Answers::Hits(hits) => Box::new(hits.iter().map(|hit| HitRecord::new(&hit))),
            Answers::Blocked(blocked) => {
                Box::new(blocked.iter().map(|blocked| HitRecord::any(*blocked != 0)))
            }
        }
    }
}

/// Returns the number of results that differ by more than rounding explains.
fn mismatches(answers: &Answers, reference: &[HitRecord], any: bool) -> usize {
    let differs = |(ours, theirs): (HitRecord, &HitRecord)| {
        let far = |t: f32| (t - theirs.t).abs() > 1e-4 * theirs.t + 1e-6;
        ours.is_miss() != theirs.is_miss() || (!any && !ours.is_miss() && far(ours.t))
    };
    answers.records().zip(reference).filter(|pair| differs(*pair)).count()
}

/// The data of the report.
struct TraceReport<'a> {
    arguments: &'a Trace,
    scene: &'a TracedScene,
    query: &'a TraceQuery<'a>,
    rays: usize,
    hits: HitSummary,
    best: Time,
    mismatches: Option<usize>,
}

impl TraceReport<'_> {
    fn name(&self) -> &'static str {
        if self.query.any { "any" } else { "closest" }
    }

    /// Returns the millions of rays per second, if all took so many seconds.
    fn speed(&self, seconds: f64) -> f64 {
        self.rays as f64 / seconds.max(1e-9) / 1e6
    }

    fn bytes_per_triangle(&self) -> Option<f64> {
        let triangles = self.scene.compiled.geometry.triangles.len();
        (triangles > 0).then(|| self.scene.compiled.bvh.bytes() as f64 / triangles as f64)
    }

    /// Returns the report as a JSON object.
    fn json(&self) -> Value {
        let TracedScene { compiled, load, compile } = self.scene;
        let memory = compiled.memory();
        let mut object = json!({
            "scene": output::path_json(&self.arguments.scene),
            "rays_file": output::path_json(&self.arguments.rays),
            "query": self.name(),
            "rays": self.rays,
            "hits": self.hits.hits,
            "hits_hash": self.hits.digits(),
            "coherence": name_of(COHERENCES, &self.arguments.coherence),
            "simd": self.query.isa.name(),
            "threads": self.query.threads,
            "repeat": self.arguments.repeat,
            "mrays_per_cpu_s": self.best.cpu.map(|seconds| self.speed(seconds)),
            "mrays_per_s": self.speed(self.best.wall.as_secs_f64()),
            "cpu_s": self.best.cpu,
            "wall_s": self.best.wall.as_secs_f64(),
            "load_s": load.as_secs_f64(),
            "compile_s": compile.as_secs_f64(),
            "build_s": compiled.bvh.statistics.time.as_secs_f64(),
            "build_peak_bytes": compiled.bvh.statistics.peak_bytes,
            "bvh_bytes": memory.bvh,
            "bytes_per_triangle": self.bytes_per_triangle(),
            "geometry_bytes": memory.geometry,
            "triangles": compiled.geometry.triangles.len(),
            "spheres": compiled.geometry.spheres.len(),
            "instances": compiled.geometry.instances.len(),
            "peak_rss_bytes": crate::memory::peak(),
        });
        if let Some(mismatches) = self.mismatches {
            object["mismatches"] = mismatches.into();
        }
        object
    }

    /// Returns a human-readable report of a few lines.
    fn text(&self) -> String {
        let TracedScene { compiled, load, compile } = self.scene;
        let (memory, geometry) = (compiled.memory(), &compiled.geometry);
        let megabytes = |bytes: usize| format!("{:.1} MB", bytes as f64 / 1e6);
        let seconds = |d: Duration| format!("{:.3} s", d.as_secs_f64());
        let per_cpu = self.best.cpu.map_or("unknown".into(), |s| format!("{:.2} M", self.speed(s)));
        let each = self.bytes_per_triangle().map_or(String::new(), |b| format!(" ({b:.1} bytes a triangle)"));
        let mut lines = vec![
            format!(
                "scene      {} triangles, {} spheres, {} instances; {} load, {} compile",
                geometry.triangles.len(),
                geometry.spheres.len(),
                geometry.instances.len(),
                seconds(*load),
                seconds(*compile)
            ),
            format!(
                "build      {}, {} in addition to the result",
                seconds(compiled.bvh.statistics.time),
                megabytes(compiled.bvh.statistics.peak_bytes)
            ),
            format!(
                "memory     bvh {}{each}, geometry {}",
                megabytes(memory.bvh),
                megabytes(memory.geometry)
            ),
            format!(
                "rays       {}, {} hits, hash {}, query {}",
                self.rays,
                self.hits.hits,
                self.hits.digits(),
                self.name()
            ),
            format!(
                "speed      {per_cpu} rays a CPU second, {:.2} M a second; best of {}, threads: {}, {}",
                self.speed(self.best.wall.as_secs_f64()),
                self.arguments.repeat,
                self.query.threads,
                self.query.isa.name()
            ),
        ];
        if let Some(mismatches) = self.mismatches {
            lines.push(format!("reference  {mismatches} mismatches"));
        }
        lines.join("\n") + "\n"
    }
}
