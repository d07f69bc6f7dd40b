//! The native part of the Python module, `rayfront._native`: worlds, renderings and ray queries. The part for users is
//! in Python, in `rayfront/`.

#![allow(missing_docs, reason = "documented in rayfront/__init__.pyi")]

mod messages;
mod rays;
mod rendering;
mod world;

use pyo3::exceptions::{PyMemoryError, PyOSError, PyValueError};
use pyo3::prelude::*;

use self::messages::as_arguments;
use crate::error::{CompileError, LoadError, SaveError};

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::rays::{Builder, PyScene};
    #[pymodule_export]
    use super::rendering::PyRendering;
    #[pymodule_export]
    use super::world::PyWorld;
    use pyo3::prelude::*;

    /// Lets scenes of this process refer to files outside their folders from now on: for scenes that you trust.
    #[pyfunction]
    fn allow_outside() {
        crate::formats::allow_outside();
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

fn of_file(error: LoadError) -> PyErr {
    match error {
        LoadError::Io { source, file, .. } if source.kind() == std::io::ErrorKind::NotFound => {
            PyErr::new::<pyo3::exceptions::PyFileNotFoundError, _>(format!(
                "{}: no such file",
                file.display()
            ))
        }
        // The name of the argument in Python.
        LoadError::Option { option, reason } => {
            wrong(format!("{}: {}", option.trim_end_matches("_s"), as_arguments(&reason)))
        }
        LoadError::TooLarge { .. } => PyMemoryError::new_err(as_arguments(&error.to_string())),
        error => wrong(as_arguments(&error.to_string())),
    }
}

fn of_scene(error: CompileError) -> PyErr {
    match error {
        CompileError::TooLarge(_) => PyMemoryError::new_err(as_arguments(&error.to_string())),
        error => wrong(as_arguments(&error.to_string())),
    }
}

fn of_output(error: SaveError) -> PyErr {
    PyOSError::new_err(error.to_string())
}

/// An error for any other mistake of the caller.
fn wrong(reason: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(reason.to_string())
}
