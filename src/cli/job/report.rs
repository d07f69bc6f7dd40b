//! The report on a render, as text and as JSON.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;

use super::aov;
use super::films::samples;
use super::loading::Phases;
use crate::check;
use crate::cli::args::{SCHEDULES, name_of};
use crate::cli::{command_line::of_whole, output, process_times};
use crate::denoise::Denoised;
use crate::error::Diagnostic;
use crate::formats::film_file::FilmHeader;
use crate::integrator::Stage;
use crate::render::Session;
use crate::view::json_of;
use crate::world::{Adaptive, Settings};

/// Returns the command that renders a film's samples again.
fn again(header: &FilmHeader) -> String {
    match (&header.samples[..], header.settings.samples) {
        ([[0, end]], total)
            if *end < total && header.settings.adaptive == Adaptive::Off && header.begun.is_none() =>
        {
            let mut line = of_whole(header);
            line.push(["--samples", &format!("0..{end}")]);
            line.to_string()
        }
        _ => "rayfront reproduce with the image or film".into(),
    }
}

/// Formats small numbers in full, larger ones in millions.
pub fn rounded_count(n: u64) -> String {
    if n < 100_000 { n.to_string() } else { format!("{:.2} M", n as f64 / 1e6) }
}

/// Formats the noise, relative to the brightness, and the number of samples that halve it; `with_options` adds the words
/// to type.
pub fn noise_line(noise: f64, samples: f64, with_options: bool) -> String {
    if noise < 5e-5 {
        return "0.00 % of the mean brightness (estimate)".into();
    }
    // The error is inversely proportional to the square root of the number of samples.
    let needed = (4.0 * samples).round() as u64;
    let options = match with_options {
        true if needed <= Settings::MOST_SAMPLES.into() => format!(" (--spp {needed}), or --denoise"),
        true => ", or --denoise".to_owned(),
        false => String::new(),
    };
    let (noise, needed) = (100.0 * noise, rounded_count(needed));
    format!("{noise:.2} % of the mean brightness (estimate); halved at {needed} samples per pixel{options}")
}

/// The data of a report.
pub struct RenderReport<'a> {
    /// The probable mistakes, as they were printed.
    pub findings: &'a [Diagnostic],
    /// The header of the film.
    pub header: &'a FilmHeader,
    /// The images that were written.
    pub outputs: &'a [PathBuf],
    /// The film that was written, if any.
    pub film: Option<&'a Path>,
    /// The session of the render.
    pub session: &'a Session,
    /// The exposure of PNG files in stops, from the settings or chosen from the image.
    pub exposure_ev: f32,
    /// The denoised image, and the paths where it was written.
    pub denoised: Option<(&'a Denoised, &'a [PathBuf])>,
    /// The time of each phase.
    pub phases: Phases,
}

impl RenderReport<'_> {
    fn schedule(&self) -> &'static str {
        name_of(SCHEDULES, &self.session.options().schedule)
    }

    fn mrays_per_second(&self) -> f64 {
        self.session.statistics().rays.total() as f64 / self.phases.render.as_secs_f64().max(1e-9) / 1e6
    }

    /// Returns the mean radiance of all pixels: red, green, blue.
    fn mean(&self) -> [f64; 3] {
        let pixels = self.session.film().means();
        let count = pixels.len().max(1) as f64;
        let mut sums = [0.0; 3];
        for pixel in pixels {
            sums.iter_mut().zip(pixel.to_array()).for_each(|(sum, component)| *sum += f64::from(component));
        }
        sums.map(|sum| sum / count)
    }

    fn aov_names(&self) -> Vec<&'static str> {
        self.header.settings.aov.iter().map(|aov| aov.name()).collect()
    }

    /// Returns a human-readable report of a few lines.
    pub fn text(&self) -> String {
        let rays = &self.session.statistics().rays;
        let p = &self.phases;
        let mut out = String::new();
        let line = |out: &mut String, name: &str, value: String| {
            // Writing to a String cannot fail.
            let _ = writeln!(out, "{name:<10}{value}");
        };
        for output in self.outputs {
            line(&mut out, "image", output.display().to_string());
        }
        if let Some(film) = self.film {
            line(&mut out, "saved", film.display().to_string());
        }
        if self.header.settings.auto_exposure {
            line(&mut out, "exposure", chosen_exposure(self.exposure_ev));
        }
        if !self.header.settings.aov.is_empty() {
            let files = self.outputs.iter().filter(|path| aov::holds(path));
            let files: Vec<_> = files.map(|path| path.display().to_string()).collect();
            let names = self.aov_names().join(", ");
            line(&mut out, "aov", format!("{names} as layers of {}", files.join(", ")));
        }
        let seconds = |d: Duration| format!("{:.2} s", d.as_secs_f64());
        line(
            &mut out,
            "time",
            format!(
                "{} load, {} compile, {} render, {} save",
                seconds(p.load),
                seconds(p.compile),
                seconds(p.render),
                seconds(p.save)
            ),
        );
        line(
            &mut out,
            "rays",
            format!(
                "{}: {} camera, {} reflect, {} refract, {} scatter, {} shadow, {} connect, {} photon; {:.2} M a second",
                rounded_count(rays.total()),
                rounded_count(rays.camera),
                rounded_count(rays.reflect),
                rounded_count(rays.refract),
                rounded_count(rays.scatter),
                rounded_count(rays.shadow),
                rounded_count(rays.connect),
                rounded_count(rays.photon),
                self.mrays_per_second()
            ),
        );
        let [w, h] = self.header.settings.size;
        let samples = samples(self.header);
        let limits =
            self.header.settings.depth_limits.given().map(|(name, limit)| format!(", {name} {limit}"));
        let limits: String = limits.collect();
        line(
            &mut out,
            "settings",
            format!(
                "{w}x{h}, {samples} spp, depth {}{limits}, seed {}, {}, {}",
                self.header.settings.max_depth,
                self.header.settings.seed,
                self.schedule(),
                self.session.options().isa.name()
            ),
        );
        if let Some(rule) = &self.header.note.stopped_by {
            let again = again(self.header);
            line(&mut out, "stopped", format!("by {rule}; the same image: {again}"));
        }
        if let Some(noise) = self.session.film().relative_noise() {
            let samples = self.session.film().samples_per_pixel();
            line(&mut out, "noise", noise_line(noise, samples, self.denoised.is_none()));
        }
        if let Some((denoised, paths)) = self.denoised {
            let paths: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
            let time = seconds(p.denoise);
            // Both are root mean squares over the image.
            let before = self.session.film().noise().filter(|before| *before > 0.0);
            let left = before.map_or(String::new(), |before| {
                format!("; about {:.0} % of the noise is left", 100.0 * (denoised.noise / before).min(1.0))
            });
            line(&mut out, "denoised", format!("{} in {time}{left}", paths.join(", ")));
        }
        line(&mut out, "film", self.header.film_hash.clone());
        out
    }

    /// Returns the report as a JSON object.
    pub fn json(&self) -> serde_json::Value {
        let statistics = self.session.statistics();
        let (rays, p) = (&statistics.rays, &self.phases);
        let scene = self.session.scene();
        let memory = scene.memory();
        let stages: serde_json::Map<_, _> = Stage::ALL
            .iter()
            .map(|s| (s.name().into(), json!(statistics.stages[*s as usize].as_secs_f64())))
            .collect();
        let (done, asked) = self.session.samples_done();
        let region = self.session.film().region();
        let denoised = self.denoised.map(|(denoised, paths)| {
            let (seconds, hash) = (p.denoise.as_secs_f64(), format!("{:032x}", denoised.hash()));
            json!({ "outputs": output::paths_json(paths), "noise_rms": denoised.noise, "seconds": seconds, "hash": hash })
        });
        let rays_json = json!({
            "camera": rays.camera, "reflect": rays.reflect, "refract": rays.refract, "scatter": rays.scatter,
            "shadow": rays.shadow, "connect": rays.connect, "photon": rays.photon, "total": rays.total(),
        });
        let seconds = json!({
            "load": p.load.as_secs_f64(), "compile": p.compile.as_secs_f64(),
            "render": p.render.as_secs_f64(), "save": p.save.as_secs_f64(),
        });
        let memory = json!({
            "geometry": memory.geometry, "bvh": memory.bvh, "textures": memory.textures,
            "film": size_of_val(self.session.film().pixels()), "peak": crate::memory::peak(),
        });
        let mut object = json!({
            "program": "rayfront",
            "version": env!("CARGO_PKG_VERSION"),
            "scene": output::path_json(&self.header.scene.path),
            "scene_hash": self.header.scene.hash,
            "outputs": output::paths_json(self.outputs),
            "film": self.film.map(output::path_json),
            "aov": self.aov_names(),
            "exposure_ev": self.exposure_ev,
            "size": self.header.settings.size,
            "region": [region.x0, region.y0, region.x1, region.y1],
            "samples": done,
            "samples_asked": asked,
            "samples_most": self.header.most,
            "sample_ranges": self.header.samples,
            "stopped_by": self.header.note.stopped_by,
            "max_depth": self.header.settings.max_depth,
            "diffuse_depth": self.header.settings.depth_limits.diffuse,
            "glossy_depth": self.header.settings.depth_limits.glossy,
            "transmission_depth": self.header.settings.depth_limits.transmission,
            "seed": self.header.settings.seed,
            "schedule": self.schedule(),
            "wave": self.session.options().wave,
            "simd": self.session.options().isa.name(),
            "threads": rayon::current_num_threads(),
            "triangles": scene.geometry.triangles.len(),
            "spheres": scene.geometry.spheres.len(),
            "instances": scene.geometry.instances.len(),
            "rays": rays_json,
            "spilled_forks": statistics.spilled,
            "mrays_per_s": self.mrays_per_second(),
            "seconds": seconds,
            "render_cpu_seconds": p.render_cpu,
            "process_cpu_seconds": process_times::cpu_seconds(),
            "stage_seconds_of_all_threads": stages,
            "memory_bytes": memory,
            "mean": self.mean(),
            "noise_rms": self.session.film().noise(),
            "noise_relative": self.session.film().relative_noise(),
            "film_hash": self.header.film_hash.clone(),
            "denoised": denoised,
            "warnings": scene.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        });
        object["complete"] = self.session.is_done().into();
        // More entries would be too many for the macro.
        object["findings"] = self.findings.iter().map(ToString::to_string).collect();
        let all = check::not_found(&scene.warnings, self.findings).chain(self.findings);
        object["diagnostics"] = all.map(json_of).collect();
        object["transport"] = format!("{:?}", self.header.settings.transport).to_lowercase().into();
        object
    }
}

/// An exposure that the image has chosen, and the option that keeps it.
pub fn chosen_exposure(ev: f32) -> String {
    // A multiple of a hundredth of a stop, unless the scene adds an exposure of its own.
    format!("{ev} EV, chosen by the image; to keep it: --exposure {ev}")
}
