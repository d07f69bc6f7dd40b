//! A profile as one page: the stages of the wavefront and their queues, times, lanes, a roofline, costs and the tree.

mod diagram;

use super::flow::{Bounce, StageFlow};
use super::parts::{PartCost, tests};
use super::report::{ProfileReport, percent};
use super::roofline::{Ceilings, StageWork, work};
use super::wave_bytes;
use crate::integrator::{Schedule, Stage};
use crate::study::experiment::fit::Estimate;
use crate::study::experiment::plot::{Curve, Figure, PlottedQuantity, svg};
use crate::study::html::{document, escaped, grouped, table};
use crate::study::machine;

/// The number of bounces, and of entities and materials in a table.
const SHOWN: usize = 12;
/// Points of a curve over time; of more turns, means are drawn.
const MOST_POINTS: usize = 400;

/// Returns the page; the error says why a plot could not be drawn.
pub fn html(report: &ProfileReport, ceilings: &Ceilings) -> Result<String, String> {
    let sections = [
        heading(report),
        stages(report),
        queues(report)?,
        bounces(report),
        steps(report),
        lanes(report),
        roofline(report, ceilings)?,
        costs(report),
        tree(report),
        machine(),
    ];
    Ok(document(&format!("Where the time goes in {}", report.scene.display()), &sections.concat()))
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.1} ms", seconds * 1e3)
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}

/// Formats a number, if there is one.
fn optional(value: Option<f64>, format: impl Fn(f64) -> String) -> String {
    value.map_or("-".into(), format)
}

fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

fn section(title: &str, text: &str) -> String {
    format!("<h2>{}</h2>\n{}", escaped(title), paragraph(text))
}

fn heading(report: &ProfileReport) -> String {
    let [width, height] = report.size;
    let plan = report.plan;
    let threads = match plan.threads {
        0 => "a thread for each core".to_owned(),
        1 => "one thread".into(),
        several => format!("{several} threads"),
    };
    let comparison = report.comparison();
    paragraph(&format!(
        "{width} × {height} pixels, {} samples per pixel, {threads}, {}, waves of {}. {}{}.",
        plan.samples,
        plan.isa.name(),
        grouped(plan.wave as u64),
        comparison[..1].to_uppercase(),
        &comparison[1..]
    ))
}

fn stages(report: &ProfileReport) -> String {
    let whose = if report.stages.are_cpu { "CPU time" } else { "time" };
    let total: f64 = report.stages.seconds.iter().sum();
    let row = |stage: Stage| {
        let (seconds, flow) = (report.stages.seconds[stage as usize], &report.flows.stages[stage as usize]);
        [
            stage.name().to_owned(),
            milliseconds(seconds),
            percent(seconds / total.max(1e-12)),
            grouped(flow.calls),
            grouped(flow.entering),
            grouped(flow.leaving),
            optional(flow.fill(), percent),
            megabytes(flow.bytes),
            format!("{:.1}", seconds * 1e9 / flow.entering.max(1) as f64),
        ]
    };
    section(
        "The stages of the wavefront",
        &format!(
            "A wave of paths goes through one stage after another, turn by turn, until no path is left. The redder a stage, \
the more {whose} it takes on one thread, the least of {} runs. Numbers at arrows are items of all turns.",
            report.plan.runs
        ),
    ) + &format!("<figure>{}</figure>\n", diagram::svg(report))
        + &table(
            &["stage", whose, "of all", "calls", "in", "out", "full", "bytes of queues", "ns an item"],
            report.stages_in_use().map(row),
        )
}

/// Items of the queues turn by turn.
fn queues(report: &ProfileReport) -> Result<String, String> {
    let turns = &report.flows.turns;
    let each = turns.len().div_ceil(MOST_POINTS).max(1);
    let curve = |label: &str, stage: Stage| {
        let mean = |(at, turns): (usize, &[[u32; Stage::ALL.len()]])| {
            let sum: u64 = turns.iter().map(|turn| u64::from(turn[stage as usize])).sum();
            let mean = sum as f64 / turns.len() as f64;
            ((at * each + 1) as f64, Estimate { mean, margin: None })
        };
        let points = turns.chunks(each).enumerate().map(mean).collect();
        Curve { label: label.into(), scene: 0, points, fit: None }
    };
    let curves = vec![
        curve("rays that find their hits (intersect)", Stage::Intersect),
        curve("hits that are shaded (shade)", Stage::Shade),
        curve("rays to lights (shadow)", Stage::Shadow),
    ];
    let means = if each > 1 { format!(", means of {each}") } else { String::new() };
    let figure = Figure {
        title: "Items in the queues".into(),
        x_label: format!("turn of the wave{means}"),
        y: PlottedQuantity::Items,
        log: [false; 2],
        curves,
    };
    let text = match report.setup.sharing {
        None => {
            "New samples and forks fill the places of paths that have ended, so that the wave stays full until its tile runs \
out of samples. Each tile ends with a few turns of few paths."
        }
        Some(_) => {
            "Paths that share light with their neighbours go to their ends together: then the rays that connect them are traced, \
and the wave is filled again."
        }
    };
    Ok(section("Queues over time", text) + &format!("<figure>{}</figure>\n", svg(&figure)?))
}

/// A cell whose background grows with the part.
fn shaded_cell(text: &str, part: f64) -> String {
    let strength = (100.0 * part.clamp(0.0, 1.0)).round();
    format!("<td style=\"background:color-mix(in srgb,var(--b) {strength}%,transparent)\">{text}</td>")
}

/// Time by stage and bounce, and the rays of each bounce.
fn bounces(report: &ProfileReport) -> String {
    let times = report.flows.seconds_by_bounce(report.stages);
    let stages: Vec<Stage> = report.stages_in_use().filter(|stage| *stage != Stage::Photons).collect();
    let most = times.iter().flatten().fold(1e-12, |a: f64, b| a.max(*b));
    let heads: String = stages.iter().map(|stage| format!("<th>{}</th>", stage.name())).collect();
    let row = |title: String, row: [f64; Stage::ALL.len()]| {
        let cell = |stage: &Stage| {
            let seconds = row[*stage as usize];
            shaded_cell(&format!("{:.1}", seconds * 1e3), seconds / most)
        };
        let cells: String = stages.iter().map(cell).collect();
        format!("<tr><td>{title}</td>{cells}<td>{:.1}</td></tr>\n", row.iter().sum::<f64>() * 1e3)
    };
    let (shown, others) = times.split_at(times.len().min(SHOWN));
    let mut rows: String = shown.iter().enumerate().map(|(bounce, r)| row(bounce.to_string(), *r)).collect();
    if !others.is_empty() {
        let sum = |stage: Stage| others.iter().map(|row| row[stage as usize]).sum();
        rows += &row(format!("{SHOWN} and more"), Stage::ALL.map(sum));
    }
    section(
        "Time by stage and bounce",
        "Milliseconds. A wave holds paths of all depths, so these times are not measured but divided: those of tracing in \
proportion to nodes and tests, those of other stages in proportion to items.",
    ) + &format!(
        "<div class=\"wide\"><table><tr><th>bounce</th>{heads}<th>all</th></tr>\n{rows}</table></div>\n"
    )
}

/// The steps from recursion to the wavefront, as bars.
fn steps(report: &ProfileReport) -> String {
    let most = report.times.iter().fold(1e-12, |a: f64, timed| a.max(timed.wall.median));
    let bar = |timed: &super::Timed| {
        let seconds = timed.wall.median;
        let color = match timed.options.schedule {
            Schedule::Wavefront => "var(--a)",
            Schedule::Recursive => "var(--f)",
        };
        format!(
            "<tr><td>{}</td><td>{}</td><td style=\"width:50%;text-align:left\"><div style=\"height:1em;width:{:.1}%;background:{color}\"></div></td></tr>\n",
            escaped(timed.step.title(report.plan.isa).trim_start()),
            milliseconds(seconds),
            100.0 * seconds / most
        )
    };
    let rows: String = report.times.iter().map(bar).collect();
    let text = format!(
        "Each line changes one thing of the line before it: the order of work, lanes for rays, lanes for all other work, and \
so on. Medians of {} runs by the clock. All films have the same bits.",
        report.plan.runs
    );
    section("What makes the difference", &text)
        + &format!(
            "<div class=\"wide\"><table style=\"width:100%\"><tr><th>step</th><th>time</th><th></th></tr>\n{rows}</table></div>\n"
        )
}

/// The number of lanes that work together and go on.
fn lanes(report: &ProfileReport) -> String {
    let with_lanes = |stage: &Stage| report.flows.stages[*stage as usize].width > 0;
    let row = |stage: Stage| {
        let flow = &report.flows.stages[stage as usize];
        format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            stage.name(),
            optional(flow.occupied(), percent),
            optional(flow.active(), percent),
            histogram(flow)
        )
    };
    let rows: String = report.stages_in_use().filter(with_lanes).map(row).collect();
    section(
        "Lanes",
        "Items are processed in groups, an item a lane. The bars show how many groups went on with none of their lanes (left) \
to all of them (right): bars in the middle are lanes that idle later.",
    ) + &format!(
        "<table><tr><th>stage</th><th>lanes taken</th><th>lanes that go on</th><th>groups</th></tr>\n{rows}</table>\n"
    )
}

fn histogram(flow: &StageFlow) -> String {
    let counts = &flow.lanes[..=flow.width.min(16)];
    let most = counts.iter().copied().max().unwrap_or(0).max(1);
    let bar = |(place, count): (usize, &u64)| {
        let height = 24.0 * *count as f64 / most as f64;
        let title = format!("{place} lanes: {} groups", grouped(*count));
        format!(
            "<rect x=\"{}\" y=\"{:.1}\" width=\"9\" height=\"{height:.1}\" fill=\"var(--a)\"><title>{title}</title></rect>",
            place * 11,
            25.0 - height
        )
    };
    let bars: String = counts.iter().enumerate().map(bar).collect();
    format!(
        "<svg class=\"drawn\" width=\"{0}\" height=\"26\" viewBox=\"0 0 {0} 26\"><path d=\"M0 25.5H{0}\" stroke=\"var(--ink)\"/>{bars}</svg>",
        counts.len() * 11
    )
}

/// The work of the stages under the machine's ceilings.
fn roofline(report: &ProfileReport, ceilings: &Ceilings) -> Result<String, String> {
    let work = work(report.flows, report.stages);
    let point = |x: f64, y: f64| (x, Estimate { mean: y / 1e9, margin: None });
    let roof = |label: String, bandwidth: f64| {
        let at = |step: i32| {
            let intensity = 2f64.powf(f64::from(step) / 8.0);
            point(intensity, ceilings.operations.min(bandwidth * intensity))
        };
        Curve { label, scene: 0, points: (-24..=48).map(at).collect(), fit: None }
    };
    let gigabytes = |bandwidth: f64| format!("{:.1} GB/s", bandwidth / 1e9);
    let mut curves = vec![
        roof(format!("roof: copies within caches, {}", gigabytes(ceilings.queues)), ceilings.queues),
        roof(format!("roof: copies through memory, {}", gigabytes(ceilings.memory)), ceilings.memory),
    ];
    let known = work.iter().filter_map(|work| Some((work, work.intensity()?, work.operations?)));
    curves.extend(known.map(|(work, intensity, operations)| Curve {
        label: work.stage.name().into(),
        scene: 0,
        points: vec![point(intensity, operations as f64 / work.seconds.max(1e-12))],
        fit: None,
    }));
    let figure = Figure {
        title: "Roofline of one core".into(),
        x_label: "operations for each byte of queues, nodes and primitives".into(),
        y: PlottedQuantity::Gigaoperations,
        log: [true; 2],
        curves,
    };
    let row = |work: &StageWork| {
        let speed = work.bytes as f64 / work.seconds.max(1e-12);
        let operations = work.operations.map(|operations| operations as f64 / work.seconds.max(1e-12));
        [
            work.stage.name().to_owned(),
            megabytes(work.bytes),
            gigabytes(speed),
            percent(speed / ceilings.queues),
            optional(operations, |speed| format!("{:.2}", speed / 1e9)),
            optional(operations, |speed| percent(speed / ceilings.operations)),
        ]
    };
    let rows = work.iter().filter(|work| work.bytes > 0).map(row);
    let text = "A stage under the slanted part of a roof waits for memory, one under the flat part for arithmetic; far below both, \
it waits for something else: for the results of branches, or for data whose address it learns late. Operations of tracing \
are those that each ray needs by itself, at least: packets do more of them. Those of other stages are not counted.";
    Ok(section("Roofline", text)
        + &format!("<figure>{}</figure>\n", svg(&figure)?)
        + &table(
            &["stage", "bytes", "speed", "of copies", "billion operations a second", "of the most"],
            rows,
        ))
}

/// Entities and materials.
fn costs(report: &ProfileReport) -> String {
    let rows = |costs: Vec<(String, PartCost)>| -> Vec<[String; 6]> {
        let all: u64 = costs.iter().map(|(_, cost)| cost.tests()).sum();
        let row = |(name, cost): &(String, PartCost)| {
            [
                name.clone(),
                grouped(cost.rays),
                grouped(cost.shadow),
                grouped(cost.tests()),
                percent(cost.tests() as f64 / all.max(1) as f64),
                milliseconds(report.flows.parts.seconds(cost, report.stages)),
            ]
        };
        costs.iter().take(SHOWN).map(row).collect()
    };
    let heads = |what| [what, "rays", "rays to lights", "nodes and tests", "of all", "time, about"];
    let (entities, materials) = (report.entities(), report.materials());
    let more = |whole: usize, what: &str| match whole.saturating_sub(SHOWN) {
        0 => String::new(),
        more => paragraph(&format!("The other {what}: {more}.")),
    };
    let after = [more(entities.len(), "entities"), more(materials.len(), "materials")];
    section("What costs", "Rays count where they end; rays to lights, where they begin.")
        + &table(&heads("entity"), rows(entities))
        + &after[0]
        + &table(&heads("material"), rows(materials))
        + &after[1]
}

/// The tree and what rays visit in it.
fn tree(report: &ProfileReport) -> String {
    let (bvh, memory) = (&report.setup.scene.bvh, report.setup.scene.memory());
    let shape = bvh.shape();
    let facts = [
        ("nodes of 16 boxes", grouped(bvh.nodes.len() as u64)),
        ("their boxes in use", percent(shape.filled_nodes)),
        ("blocks of 8 triangles", grouped(bvh.triangles.len() as u64)),
        ("blocks of 8 spheres", grouped(bvh.spheres.len() as u64)),
        ("places in blocks in use", percent(shape.filled_blocks)),
        ("placed subtrees", grouped(bvh.instances.len() as u64)),
        ("most nodes one below another", grouped(shape.depth as u64)),
        ("memory", megabytes(memory.bvh as u64)),
        ("time to build", milliseconds(bvh.statistics.time.as_secs_f64())),
    ];
    let facts = facts.map(|(name, value)| [name.to_owned(), value]);
    let row = |(number, bounce): (usize, &Bounce)| {
        let each = |visits: u64, rays: u64| format!("{:.1}", visits as f64 / rays.max(1) as f64);
        let (visits, shadow) = (&bounce.visits, &bounce.shadow_visits);
        [
            number.to_string(),
            grouped(bounce.rays()),
            each(visits.nodes, bounce.rays()),
            each(visits.primitives, bounce.rays()),
            grouped(bounce.shadow),
            percent(bounce.blocked as f64 / bounce.shadow.max(1) as f64),
            each(shadow.nodes, bounce.shadow),
            each(shadow.primitives, bounce.shadow),
            grouped(tests(visits) + tests(shadow)),
        ]
    };
    let heads = [
        "bounce", "rays", "nodes a ray", "primitives a ray", "rays to lights", "blocked", "nodes",
        "primitives", "all",
    ];
    section("The tree", "What the tree is, and what a ray visits in it when it is traced by itself.")
        + &table(&["", ""], facts)
        + &table(&heads, report.flows.bounces.iter().enumerate().take(SHOWN).map(row))
}

fn machine() -> String {
    let rows = machine::describe().into_iter().map(|(name, value)| [name.to_owned(), value]);
    "<h2>Machine</h2>\n".to_owned() + &table(&["", ""], rows)
}

/// Measures what [`html`] compares the stages with.
pub fn ceilings(report: &ProfileReport) -> Result<Ceilings, crate::render::ThreadError> {
    super::roofline::ceilings(report.plan, wave_bytes(report.setup, report.plan))
}
