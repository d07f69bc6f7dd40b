//! The results of jobs: a CSV file that grows by a line per job, so that an interrupted study can resume.

use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::StudyError;
use crate::error::SaveError;
use crate::files::links;
use crate::formats::study::Measurement;

/// The last columns, which hold the measured values.
const MEASURES: [(&str, Measurement); 11] = [
    ("mse", Measurement::Mse),
    ("relmse", Measurement::RelativeMse),
    ("squared_bias", Measurement::SquaredBias),
    ("variance", Measurement::Variance),
    ("flip", Measurement::Flip),
    ("render_s", Measurement::RenderSeconds),
    ("cpu_s", Measurement::CpuSeconds),
    ("build_s", Measurement::BuildSeconds),
    ("ns_per_ray", Measurement::NanosecondsPerRay),
    ("mrays_per_s", Measurement::Mrays),
    ("tree_bytes", Measurement::TreeBytes),
];

/// The results of a job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResultRow {
    /// The values in the order of `MEASURES`; none if not applicable.
    values: [Option<f64>; MEASURES.len()],
    /// The hash of the film, if one was rendered.
    pub film: Option<u128>,
}

impl ResultRow {
    /// Returns a measured value.
    pub fn get(&self, measure: Measurement) -> Option<f64> {
        MEASURES.iter().position(|(_, m)| *m == measure).and_then(|at| self.values[at])
    }

    /// Sets a measured value.
    pub fn set(&mut self, measure: Measurement, value: f64) {
        if let Some(at) = MEASURES.iter().position(|(_, m)| *m == measure) {
            self.values[at] = Some(value);
        }
    }
}

/// The identification of a job.
#[derive(Clone, Debug)]
pub struct Label {
    /// A hash of everything that determines the result.
    pub key: u128,
    /// The name of the experiment.
    pub experiment: String,
    /// The name of the scene.
    pub scene: String,
    /// The name of the series.
    pub series: String,
    /// The value on the axis.
    pub x: u32,
    /// The number of the repetition.
    pub seed: u32,
}

/// The file of results.
pub struct Results {
    path: PathBuf,
    rows: HashMap<u128, ResultRow>,
}

impl Results {
    /// Reads existing results. Drops an incomplete last line.
    pub fn open(path: &Path) -> Result<Results, StudyError> {
        let text = match crate::files::read(path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(format!("{}: cannot read: {error}", path.display()).into()),
        };
        let results = Results { path: path.to_owned(), rows: HashMap::new() };
        // The next line would be appended to an incomplete one.
        let whole = text.rfind('\n').map_or(0, |newline| newline + 1);
        if whole < text.len() {
            let file = links::open_to_append(path)?;
            file.set_len(whole as u64).map_err(|error| SaveError::new(path, error))?;
        }
        let text = &text[..whole];
        if text.is_empty() {
            results.append(&header())?;
        } else if text.lines().next() != Some(&header()) {
            let path = path.display();
            return Err(format!("{path}: these are not results of this version: move the file away").into());
        }
        let rows = text.lines().skip(1).filter_map(parse).collect();
        Ok(Results { rows, ..results })
    }

    /// Returns the results of a job if it is finished.
    pub fn get(&self, key: u128) -> Option<&ResultRow> {
        self.rows.get(&key)
    }

    /// Appends the results of a finished job.
    pub fn add(&mut self, label: &Label, row: ResultRow) -> Result<(), SaveError> {
        let values = row.values.iter().map(|value| value.map_or(String::new(), |v| v.to_string()));
        let mut fields = vec![
            format!("{:032x}", label.key),
            label.experiment.clone(),
            quoted(&label.scene),
            quoted(&label.series),
            label.x.to_string(),
            label.seed.to_string(),
            row.film.map_or(String::new(), |hash| format!("{hash:032x}")),
        ];
        fields.extend(values);
        self.append(&fields.join(","))?;
        self.rows.insert(label.key, row);
        Ok(())
    }

    fn append(&self, line: &str) -> Result<(), SaveError> {
        let mut file = links::open_to_append(&self.path)?;
        writeln!(file, "{line}").map_err(|error| SaveError::new(&self.path, error))
    }
}

fn header() -> String {
    let names = MEASURES.map(|(name, _)| name).join(",");
    format!("job,experiment,scene,series,x,seed,film_hash,{names}")
}

/// Quotes a field of CSV if necessary.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

/// Parses a line into the job's key and its values; none if it is malformed. Names may contain commas, numbers cannot,
/// so the values are counted from the end.
fn parse(line: &str) -> Option<(u128, ResultRow)> {
    let fields: Vec<&str> = line.trim_end().split(',').collect();
    let key = u128::from_str_radix(fields.first()?, 16).ok()?;
    let first = fields.len().checked_sub(MEASURES.len())?;
    let film = fields.get(first.checked_sub(1)?)?;
    let film = if film.is_empty() { None } else { Some(u128::from_str_radix(film, 16).ok()?) };
    let mut row = ResultRow { film, ..ResultRow::default() };
    for (value, field) in row.values.iter_mut().zip(&fields[first..]) {
        *value = if field.is_empty() { None } else { Some(field.parse().ok()?) };
    }
    Some((key, row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_resume_after_a_truncated_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        let label = |key| Label {
            key,
            experiment: "a".into(),
            scene: "ball, \"big\"".into(),
            series: "tree".into(),
            x: 100,
            seed: 3,
        };
        let mut row = ResultRow { film: Some(5), ..ResultRow::default() };
        row.set(Measurement::Mse, 1.25e-9);
        row.set(Measurement::TreeBytes, 12.0);
        let mut results = Results::open(&path).unwrap();
        assert_eq!(results.get(7), None);
        results.add(&label(7), row.clone()).unwrap();
        results.add(&label(8), ResultRow::default()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        // As if the program had been killed while writing the second line.
        std::fs::write(&path, &text[..text.len() - 4]).unwrap();
        let mut again = Results::open(&path).unwrap();
        assert_eq!((again.get(7), again.get(8)), (Some(&row), None));
        assert_eq!(again.get(7).unwrap().get(Measurement::Mse), Some(1.25e-9));
        again.add(&label(8), ResultRow::default()).unwrap();
        assert!(Results::open(&path).unwrap().get(8).is_some());
        std::fs::write(&path, "something else\n").unwrap();
        assert!(Results::open(&path).err().unwrap().to_string().contains("move the file away"));
    }
}
