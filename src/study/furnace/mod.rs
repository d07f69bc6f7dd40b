//! One material of a scene in a white furnace: the light that it returns under light of radiance 1 from everywhere, by
//! angle and roughness, whether its directions are sampled with the density that it reports, and whether it is
//! reciprocal.

pub mod page;
pub mod patch;
pub mod select;

use self::patch::Patch;
use crate::math::Vector;
use crate::scene::CompiledScene;
use crate::scene::material::{ColorParam, MaterialRecord, ScalarParam};
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::measure::{
    self, DensityCheck, MeasuredAlbedo, Reciprocity, density, reciprocity, towards,
};
use crate::shading::principled::sample::BsdfSample;

/// Angles between the normal and the direction to the viewer, in degrees.
pub const ANGLES_DEGREES: [f64; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0];
/// The values of `roughness` in a sweep.
pub const ROUGHNESS: [f32; 6] = [0.0, 0.1, 0.25, 0.5, 0.75, 1.0];
/// The direction to the viewer around the normal, in turns from the direction of anisotropy.
const TURNS: f32 = 0.1;
/// Gains and losses below this fraction are not reported: tables of albedos are approximations.
const NOTABLE: f64 = 0.005;
/// A larger mean difference of exchanged directions is more than rounding.
const RECIPROCAL: f64 = 2e-3;

/// The parameters of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct FurnacePlan {
    /// Sampled directions for each angle and roughness.
    pub samples: u32,
    /// True to look from within the body.
    pub inside: bool,
    /// Texture coordinates; none for the means of textures.
    pub uv: Option<[f32; 2]>,
}

/// The measurements at one angle.
#[derive(Clone, Debug)]
pub struct FurnaceRow {
    /// The angle between the normal and the direction to the viewer, in degrees.
    pub degrees: f64,
    /// The albedo of the material as it is.
    pub own: MeasuredAlbedo,
    /// The albedo of the material in white; none for Blinn-Phong, whose reflectances are numbers of their own.
    pub white: Option<MeasuredAlbedo>,
    /// The check of sampled directions; none if all are mirror directions.
    pub density: Option<DensityCheck>,
}

/// The measurements at one roughness.
#[derive(Clone, Debug)]
pub struct FurnaceRun {
    /// The roughness.
    pub roughness: f32,
    /// True if this is the material's own roughness.
    pub is_own: bool,
    /// The angles, in order.
    pub rows: Vec<FurnaceRow>,
    /// The comparison of exchanged directions; none if the surface is a perfect mirror.
    pub reciprocity: Option<Reciprocity>,
}

impl FurnaceRun {
    /// Returns the sentences about what is wrong with the material at this roughness. A material that is not meant to be
    /// reciprocal, which is directed, need not be.
    pub fn faults(&self, is_directed: bool) -> Vec<String> {
        let mut lines = Vec::new();
        let largest = |amount: &dyn Fn(&FurnaceRow) -> Option<f64>| {
            let rows = self.rows.iter().filter_map(|row| amount(row).map(|amount| (row.degrees, amount)));
            rows.max_by(|a, b| a.1.total_cmp(&b.1))
        };
        let percent = |(degrees, amount): (f64, f64)| format!("{:.1} % at {degrees}°", 100.0 * amount);
        if let Some(most) = largest(&|row| gain(&row.own)) {
            lines.push(format!("gains {}", percent(most)));
        }
        if let Some(most) = largest(&|row| row.white.as_ref().and_then(gain)) {
            lines.push(format!("in white, gains {}", percent(most)));
        }
        if let Some(most) = largest(&|row| row.white.as_ref().and_then(loss)) {
            lines.push(format!("in white, loses {}", percent(most)));
        }
        let differs = |row: &&FurnaceRow| row.density.is_some_and(|check| !check.agrees());
        let differing: Vec<String> =
            self.rows.iter().filter(differs).map(|row| format!("{}°", row.degrees)).collect();
        if !differing.is_empty() {
            lines.push(format!("directions do not follow the reported density at {}", differing.join(", ")));
        }
        if let Some(Reciprocity { largest, mean }) =
            self.reciprocity.filter(|found| !is_directed && found.mean > RECIPROCAL)
        {
            let (largest, mean) = (100.0 * largest, 100.0 * mean);
            lines.push(format!(
                "not reciprocal: exchanged directions differ by {mean:.1} % in the mean, at most {largest:.0} %"
            ));
        }
        lines
    }
}

/// Returns the fraction by which a channel returns more light than arrives, if it is notable and no chance.
fn gain(albedo: &MeasuredAlbedo) -> Option<f64> {
    excess(albedo, |mean| mean - 1.0)
}

/// Returns the fraction of light that a channel loses, if it is notable and no chance.
fn loss(albedo: &MeasuredAlbedo) -> Option<f64> {
    excess(albedo, |mean| 1.0 - mean)
}

fn excess(albedo: &MeasuredAlbedo, amount: impl Fn(f64) -> f64) -> Option<f64> {
    let channels = albedo.mean.iter().zip(albedo.error);
    let beyond = channels.map(|(mean, error)| (amount(*mean), NOTABLE + 3.0 * error));
    beyond.filter(|(amount, limit)| amount > limit).map(|(amount, _)| amount).max_by(f64::total_cmp)
}

/// All measurements of a material.
#[derive(Clone, Debug)]
pub struct FurnaceReport {
    /// The material's name.
    pub material: String,
    /// The names of its lobes.
    pub lobes: Vec<&'static str>,
    /// True if it is not meant to be reciprocal: refracting bodies, clear coats and sheen divide light by the direction
    /// to the viewer only.
    pub is_directed: bool,
    /// The material's own roughness, then the others of the sweep.
    pub runs: Vec<FurnaceRun>,
}

/// Measures a material of a scene that was compiled for the path transport. Returns the reason if it has no BSDF.
pub fn measure(scene: &CompiledScene, material: u32, plan: &FurnacePlan) -> Result<FurnaceReport, String> {
    let name = &scene.material_names[material as usize];
    let record = scene.materials[material as usize];
    if record.unlit {
        return Err(format!(
            "\"{name}\" is unlit: it shows its colour and reflects nothing; name another material"
        ));
    }
    if plan.inside && !record.lets_through() {
        return Err(format!("no light enters \"{name}\": leave out --inside"));
    }
    let own = patch::at_rest(&record);
    let white = in_white(&own);
    let has = patch::lobes(scene, &own);
    // A Blinn-Phong material has a shininess instead.
    let sweeps = own.has_mirror() && !own.constant_fresnel;
    let rough = |record: &MaterialRecord, roughness: f32| MaterialRecord {
        roughness: ScalarParam::constant(roughness),
        ..*record
    };
    let run = |own: &MaterialRecord, white: &MaterialRecord, is_own: bool| {
        let [own, white] = [own, white].map(|record| Patch::new(scene, record, plan));
        run(&own, (!record.constant_fresnel).then_some(&white), is_own, plan)
    };
    let mut runs = vec![run(&own, &white, true)];
    if sweeps {
        let others: Vec<f32> = ROUGHNESS.into_iter().filter(|value| *value != runs[0].roughness).collect();
        runs.extend(others.into_iter().map(|value| run(&rough(&own, value), &rough(&white, value), false)));
    }
    Ok(FurnaceReport {
        material: name.clone(),
        lobes: patch::lobe_names(&has),
        is_directed: has.solid || has.coat || has.sheen,
        runs,
    })
}

/// The material in white: nothing absorbs light but a loss of the model.
fn in_white(record: &MaterialRecord) -> MaterialRecord {
    let white = ColorParam::constant([1.0; 3]);
    MaterialRecord {
        base_color: white,
        diffuse_transmission_color: white,
        edge_tint: [1.0; 3],
        sheet_depth: [0.0; 3],
        ..*record
    }
}

fn run(own: &Patch, white: Option<&Patch>, is_own: bool, plan: &FurnacePlan) -> FurnaceRun {
    let rows = ANGLES_DEGREES.map(|degrees| {
        let viewer = towards(libm::cos(degrees.to_radians()) as f32, TURNS);
        let (own, white) = (own.bsdf(viewer), white.map(|white| white.bsdf(viewer)));
        FurnaceRow {
            degrees,
            own: measure::albedo(plan.samples, |which, u| drawn(&own, which, u)),
            white: white.map(|white| measure::albedo(plan.samples, |which, u| drawn(&white, which, u))),
            density: density(
                plan.samples,
                |which, u| drawn(&own, which, u),
                |direction| own.evaluate(direction, true).1,
            ),
        }
    });
    let scatters = rows.iter().any(|row| row.density.is_some());
    let value = |wo: Vector<f32>, wi: Vector<f32>| own.bsdf(wo).evaluate(wi, true).0;
    let sample = |wo: Vector<f32>, which, u| drawn(&own.bsdf(wo), which, u);
    let pairs = (plan.samples / 8).max(64);
    FurnaceRun {
        roughness: own.roughness(),
        is_own,
        rows: rows.into(),
        reciprocity: scatters.then(|| reciprocity(pairs, value, sample)),
    }
}

/// Returns what a reader must know about the measurements.
pub fn notes(report: &FurnaceReport) -> Vec<&'static str> {
    let all = [
        (true, "the patch is flat: normal and bump maps, emission and the inside of bodies are left out"),
        (
            report.is_directed,
            "bodies that refract, clear coats and sheen are not meant to be reciprocal: they divide light by the direction to the viewer",
        ),
    ];
    all.into_iter().filter(|(is_true, _)| *is_true).map(|(_, note)| note).collect()
}

fn drawn(bsdf: &Bsdf<f32>, which: f32, u: (f32, f32)) -> BsdfSample<f32> {
    bsdf.sample(which, 1.0, u, true)
}

#[cfg(test)]
mod tests;
