//! The report of `rayfront profile`, as tables and as JSON.

use serde_json::{Value, json};

use crate::bvh::kernels::counters::Visits;
use crate::cli::args::{SCHEDULES, name_of};
use crate::cli::job::rounded_count;
use crate::cli::output;
use crate::film::PixelSum;
use crate::integrator::setup::NoPhotons;
use crate::integrator::{RayCounts, Schedule, Sorting, Stage};
use crate::render::Options;
use crate::render::photons::PhotonBytes;
use crate::simd::Isa;
use crate::study::profile::counters::{Counted, Counts};
use crate::study::profile::flow::{Bounce, StageFlow};
use crate::study::profile::report::{ProfileReport, percent};
use crate::study::profile::{Spread, Timed, wave_bytes};
use crate::world::Transport;

/// The number of bounces in the table; the JSON has all.
const SHOWN: usize = 12;

/// The title of a column, and a function that returns its number.
type TableColumn = (&'static str, fn(&Bounce) -> u64);

fn milliseconds(spread: &Spread) -> String {
    let [median, least, most] = [spread.median, spread.least, spread.most].map(|s| s * 1e3);
    format!("{median:.1} ms ({least:.1} to {most:.1})")
}

/// Formats a percentage, if there is one.
fn share(part: Option<f64>) -> String {
    part.map_or("-".into(), percent)
}

impl ProfileReport<'_> {
    /// Returns tables of at most 100 columns.
    pub fn text(&self) -> String {
        let mut lines = self.heading();
        lines.extend(self.schedules());
        lines.extend(self.steps());
        lines.extend(self.stages());
        lines.extend(self.bounces());
        lines.extend(self.costs());
        lines.extend(self.lanes());
        lines.extend(self.counters());
        lines.join("\n") + "\n"
    }

    fn heading(&self) -> Vec<String> {
        let [width, height] = self.size;
        vec![
            format!("scene      {}, {width}x{height}, {} spp", self.scene.display(), self.plan.samples),
            format!(
                "measured   {} run{} of each way to render, in turn, after one that does not count",
                self.plan.runs,
                if self.plan.runs == 1 { "" } else { "s" }
            ),
            format!(
                "with       {}, {}, waves of {}",
                match self.plan.threads {
                    0 => "a thread for each core".into(),
                    1 => "1 thread".into(),
                    several => format!("{several} threads"),
                },
                self.plan.isa.name(),
                self.plan.wave
            ),
        ]
    }

    /// Returns the table of both schedules, side by side.
    fn schedules(&self) -> Vec<String> {
        let [wavefront, recursive] = self.as_used();
        let row = |title: &str, value: &dyn Fn(&Timed) -> String| {
            format!("{title:20}{:32}{}", value(wavefront), value(recursive))
        };
        let rays = |value: fn(&RayCounts) -> u64| move |timed: &Timed| rounded_count(value(&timed.rays));
        let memory = self.setup.scene.memory();
        let film = self.setup.size[0] as usize * self.setup.size[1] as usize * size_of::<PixelSum>();
        let megabytes = |bytes: usize| format!("{:.1} MB", bytes as f64 / 1e6);
        vec![
            String::new(),
            row("", &|timed| name_of(SCHEDULES, &timed.options.schedule).into()),
            row("time", &|timed| milliseconds(&timed.wall)),
            row("CPU time", &|timed| timed.cpu.as_ref().map_or("unknown".into(), milliseconds)),
            row("rays a second", &|timed| format!("{:.2} M", timed.mrays_per_s())),
            row("rays a CPU second", &|timed| {
                timed.mrays_per_cpu_s().map_or("unknown".into(), |speed| format!("{speed:.2} M"))
            }),
            row("camera rays", &rays(|rays| rays.camera)),
        ]
        .into_iter()
        .chain(match self.setup.transport {
            Transport::Whitted => vec![
                row("reflected rays", &rays(|rays| rays.reflect)),
                row("refracted rays", &rays(|rays| rays.refract)),
            ],
            Transport::Path => vec![
                row("scattered rays", &rays(|rays| rays.scatter)),
                row("refracted rays", &rays(|rays| rays.refract)),
                row("connecting rays", &rays(|rays| rays.connect)),
            ],
        })
        .chain(self.photons.is_ok().then(|| row("rays of photons", &rays(|rays| rays.photon))))
        .chain([
            row("shadow rays", &rays(|rays| rays.shadow)),
            row("queues", &|timed| match timed.options.schedule {
                Schedule::Wavefront => format!("{} a thread", megabytes(wave_bytes(self.setup, self.plan))),
                Schedule::Recursive => "none".into(),
            }),
            row("forks that waited", &|timed| rounded_count(timed.spilled)),
            row("film", &|timed| format!("{:016x}", timed.hash >> 64)),
            format!(
                "memory              geometry {}, tree {}, textures {}, film {}",
                megabytes(memory.geometry),
                megabytes(memory.bvh),
                megabytes(memory.textures),
                megabytes(film)
            ),
            match self.photons {
                Ok(photons) => format!(
                    "photons             {} a sample, in memory about {}",
                    rounded_count(photons.into()),
                    megabytes(PhotonBytes::most(self.setup).total() as usize)
                ),
                Err(why) => format!("photons             none: {}", why.text()),
            },
        ])
        .collect()
    }

    /// Returns the table of the steps from recursion to the wavefront.
    fn steps(&self) -> Vec<String> {
        let mut lines = vec![
            String::new(),
            format!(
                "{:40}{:>14}{:>14}{:>14}",
                "what makes the difference", "time", "of the last", "of the first"
            ),
        ];
        let first = self.times[0].wall.median;
        let mut last = first;
        for timed in self.times {
            let name = timed.step.title(self.plan.isa);
            let time = timed.wall.median;
            let of = |other: f64| format!("{:.2}", time / other.max(1e-12));
            lines.push(format!(
                "{name:40}{:>14}{:>14}{:>14}",
                format!("{:.1} ms", time * 1e3),
                of(last),
                of(first)
            ));
            last = time;
        }
        lines.push(self.comparison());
        lines
    }

    /// Returns the table of the wavefront's stages and their queues.
    fn stages(&self) -> Vec<String> {
        let mut lines = vec![
            String::new(),
            format!(
                "{:10}{:>12}{:>9}{:>8}{:>12}{:>12}{:>10}{:>12}{:>10}",
                "stage",
                if self.stages.are_cpu { "CPU time" } else { "time" },
                "of all",
                "calls",
                "in",
                "out",
                "full",
                "bytes",
                "ns/item"
            ),
        ];
        let total: f64 = self.stages.seconds.iter().sum();
        for stage in self.stages_in_use() {
            let (seconds, flow) = (self.stages.seconds[stage as usize], &self.flows.stages[stage as usize]);
            lines.push(format!(
                "{:10}{:>12}{:>9}{:>8}{:>12}{:>12}{:>10}{:>12}{:>10.1}",
                stage.name(),
                format!("{:.2} ms", seconds * 1e3),
                percent(seconds / total.max(1e-12)),
                flow.calls,
                rounded_count(flow.entering),
                rounded_count(flow.leaving),
                share(flow.fill()),
                format!("{:.1} MB", flow.bytes as f64 / 1e6),
                seconds * 1e9 / flow.entering.max(1) as f64
            ));
        }
        lines
    }

    /// Returns the kinds of rays of the transport.
    fn kinds(&self) -> Vec<TableColumn> {
        match self.setup.transport {
            Transport::Whitted => {
                vec![("camera", |b| b.camera), ("reflect", |b| b.reflect), ("refract", |b| b.refract)]
            }
            Transport::Path => {
                vec![("camera", |b| b.camera), ("scatter", |b| b.scatter), ("refract", |b| b.refract)]
            }
        }
    }

    /// Returns the table of rays and their costs by bounce.
    fn bounces(&self) -> Vec<String> {
        let kinds = self.kinds();
        let names: String = kinds.iter().map(|(name, _)| format!("{name:>10}")).collect();
        let before = 7 + names.len() + 27;
        let mut lines = vec![
            String::new(),
            format!("{:before$}{:>17}{:>18}", "", "a ray", "a shadow ray"),
            format!(
                "{:7}{names}{:>9}{:>10}{:>8}{:>8}{:>9}{:>9}{:>9}",
                "bounce", "alive", "shadow", "blocked", "nodes", "tests", "nodes", "tests"
            ),
        ];
        let first = self.flows.bounces.first().map_or(1, |bounce| bounce.rays().max(1)) as f64;
        for (depth, bounce) in self.flows.bounces.iter().enumerate().take(SHOWN) {
            let each = |visits: u64, rays: u64| format!("{:.1}", visits as f64 / rays.max(1) as f64);
            let rays: String =
                kinds.iter().map(|(_, of)| format!("{:>10}", rounded_count(of(bounce)))).collect();
            lines.push(format!(
                "{:<7}{rays}{:>9}{:>10}{:>8}{:>8}{:>9}{:>9}{:>9}",
                depth,
                percent(bounce.rays() as f64 / first),
                rounded_count(bounce.shadow),
                percent(bounce.blocked as f64 / bounce.shadow.max(1) as f64),
                each(bounce.visits.nodes, bounce.rays()),
                each(bounce.visits.primitives, bounce.rays()),
                each(bounce.shadow_visits.nodes, bounce.shadow),
                each(bounce.shadow_visits.primitives, bounce.shadow),
            ));
        }
        let more = self.flows.bounces.len().saturating_sub(SHOWN);
        if more > 0 {
            lines.push(format!("and {more} more bounces"));
        }
        lines
    }

    /// Returns the table of the lanes that are taken, and of those that go on.
    fn lanes(&self) -> Vec<String> {
        let width = self.flows.stages[Stage::Shade as usize].width;
        let mut lines = vec![
            String::new(),
            format!(
                "{:10}{:>10}{:>10}   groups of {width} lanes by how many of them go on, 0 to {width}",
                "lanes", "taken", "go on"
            ),
        ];
        let with_lanes = [Stage::Retire, Stage::Shade, Stage::Light, Stage::Shadow];
        for stage in self.stages_in_use().filter(|stage| with_lanes.contains(stage)) {
            let flow = &self.flows.stages[stage as usize];
            lines.push(format!(
                "{:10}{:>10}{:>10}   {}",
                stage.name(),
                share(flow.occupied()),
                share(flow.active()),
                histogram(flow)
            ));
        }
        lines
    }

    fn counters(&self) -> Vec<String> {
        let counted = match self.counted {
            Ok(counted) => counted,
            Err(reason) => return vec![String::new(), format!("counters   {reason}")],
        };
        let mut lines = vec![
            String::new(),
            format!(
                "{:10}{:>14}{:>16}{:>8}{:>16}{:>16}",
                "counters", "cycles", "instructions", "a cycle", "cache misses", "branch misses"
            ),
        ];
        let of = |stage: Stage| (stage.name(), &counted.stages[stage as usize]);
        let stages = self.stages_in_use().map(of);
        for (name, counts) in stages.chain([("recursive", &counted.recursive)]) {
            lines.push(format!(
                "{name:10}{:>14}{:>16}{:>8.2}{:>16}{:>16}",
                rounded_count(counts.cycles),
                rounded_count(counts.instructions),
                counts.instructions as f64 / counts.cycles.max(1) as f64,
                rounded_count(counts.cache_misses),
                rounded_count(counts.branch_misses)
            ));
        }
        lines
    }

    /// Returns the report as a JSON object.
    pub fn json(&self) -> Value {
        let memory = self.setup.scene.memory();
        let stages: serde_json::Map<String, Value> = Stage::ALL
            .iter()
            .map(|stage| {
                let seconds = self.stages.seconds[*stage as usize];
                (stage.name().into(), stage_json(seconds, &self.flows.stages[*stage as usize]))
            })
            .collect();
        let counters = match self.counted {
            Ok(counted) => counted_json(counted),
            Err(reason) => json!({ "refused": reason }),
        };
        let [wavefront, recursive] = self.as_used();
        json!({
            "scene": output::path_json(self.scene),
            "size": self.size,
            "samples": self.plan.samples,
            "runs": self.plan.runs,
            "threads": self.plan.threads,
            "simd": self.plan.isa.name(),
            "wave": self.plan.wave,
            "wavefront": timed_json(wavefront),
            "recursive": timed_json(recursive),
            "steps": self.times.iter().map(step_json).collect::<Vec<_>>(),
            "stages": stages,
            "stage_seconds_are_cpu": self.stages.are_cpu,
            "bounces": self.flows.bounces.iter().map(bounce_json).collect::<Vec<_>>(),
            "entities": self.entities_json(),
            "materials": self.materials_json(),
            "memory_bytes": {
                "geometry": memory.geometry, "bvh": memory.bvh, "textures": memory.textures,
                "queues_a_thread": wave_bytes(self.setup, self.plan),
                "photons": if self.photons.is_ok() { PhotonBytes::most(self.setup).total() } else { 0 }, "peak": crate::memory::peak(),
            },
            "photons": {"a_sample": self.photons.unwrap_or(0), "none": self.photons.err().map(NoPhotons::text)},
            "counters": counters,
        })
    }
}

/// Returns a bar for each number of lanes, whose height is the number's frequency.
fn histogram(flow: &StageFlow) -> String {
    const BARS: [char; 9] = ['·', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let most = flow.lanes.iter().max().copied().unwrap_or(0).max(1);
    let bar = |n: u64| BARS[(n * 8).div_ceil(most) as usize];
    flow.lanes[..=flow.width.min(16)].iter().map(|n| bar(*n)).collect()
}

fn spread_json(spread: &Spread) -> Value {
    json!({"median": spread.median, "least": spread.least, "most": spread.most})
}

fn step_json(timed: &Timed) -> Value {
    let Options { isa, traversal, sorting, schedule, .. } = timed.options;
    json!({
        "step": timed.step.name(),
        "schedule": name_of(SCHEDULES, &schedule),
        "traversal": traversal.unwrap_or(isa).name(),
        "shading": if schedule == Schedule::Recursive { Isa::PORTABLE } else { isa }.name(),
        "sorted": schedule == Schedule::Wavefront && sorting == Sorting::ByMaterial,
        "wall_s": spread_json(&timed.wall),
        "film_hash": format!("{:032x}", timed.hash),
    })
}

fn timed_json(timed: &Timed) -> Value {
    json!({
        "wall_s": spread_json(&timed.wall),
        "cpu_s": timed.cpu.as_ref().map(spread_json),
        "mrays_per_s": timed.mrays_per_s(),
        "mrays_per_cpu_s": timed.mrays_per_cpu_s(),
        "rays": {
            "camera": timed.rays.camera, "reflect": timed.rays.reflect, "refract": timed.rays.refract,
            "scatter": timed.rays.scatter, "shadow": timed.rays.shadow, "connect": timed.rays.connect, "photon": timed.rays.photon, "total": timed.rays.total(),
        },
        "spilled_forks": timed.spilled,
        "film_hash": format!("{:032x}", timed.hash),
    })
}

fn stage_json(seconds: f64, flow: &StageFlow) -> Value {
    json!({
        "seconds": seconds,
        "calls": flow.calls,
        "in": flow.entering,
        "out": flow.leaving,
        "fill": flow.fill(),
        "bytes": flow.bytes,
        "lane_width": flow.width,
        "lanes_taken": flow.occupied(),
        "lanes_going_on": flow.active(),
        "lanes_histogram": flow.lanes[..=flow.width.min(16)],
    })
}

pub(super) fn visits_json(visits: &Visits) -> Value {
    json!({
        "nodes": visits.nodes, "leaves": visits.leaves,
        "primitives": visits.primitives, "instances": visits.instances,
    })
}

fn bounce_json(bounce: &Bounce) -> Value {
    json!({
        "camera": bounce.camera, "reflect": bounce.reflect, "refract": bounce.refract,
        "scatter": bounce.scatter, "hits": bounce.hits, "shadow": bounce.shadow, "blocked": bounce.blocked, "ends": bounce.ends,
        "visits": visits_json(&bounce.visits), "shadow_visits": visits_json(&bounce.shadow_visits),
    })
}

fn counts_json(counts: &Counts) -> Value {
    json!({
        "cycles": counts.cycles, "instructions": counts.instructions,
        "cache_misses": counts.cache_misses, "branch_misses": counts.branch_misses,
    })
}

fn counted_json(counted: &Counted) -> Value {
    let stages: serde_json::Map<String, Value> = Stage::ALL
        .iter()
        .map(|stage| (stage.name().into(), counts_json(&counted.stages[*stage as usize])))
        .collect();
    json!({"stages": stages, "recursive": counts_json(&counted.recursive)})
}
