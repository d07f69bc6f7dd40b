//! Values that the page changes: statements after those of the command line, which saving writes into the scene's file.

use serde_json::{Value, json};

use super::forms;
use super::scene::{LiveScene, SceneError};
use crate::error::LoadError;
use crate::files;
use crate::formats::ron::{assignment, portrait, with_statements};
use crate::world::ineffective::{FieldContext, OF_SETTINGS, reason};

impl LiveScene {
    /// The statements by which the page has changed the scene.
    pub fn statements(&self) -> &[String] {
        &self.options.edits.set[self.given.min(self.options.edits.set.len())..]
    }

    /// Changes values by a statement `field = value`, which replaces an earlier one about the same field. On failure,
    /// nothing changes. A value in quotes is refused: it may name a file, and the page opens none.
    pub fn set(&mut self, statement: &str) -> Result<(), SceneError> {
        let Some((_, value)) = assignment(statement) else {
            return Err(SceneError::Refused("a change is a field, = and a value".into()));
        };
        if value.contains('"') {
            return Err(SceneError::Refused(
                "a value in quotes can only be written in the scene's file".into(),
            ));
        }
        let before = (self.options.edits.clone(), self.rig.clone());
        let is_moved = self.rig.is_some() && statement.starts_with("Camera[");
        if let Some(moved) = is_moved.then(|| self.camera_statements(&self.rig())).flatten() {
            // The camera as it was moved by hand is what the statement changes.
            let mut edits = std::mem::take(&mut self.options.edits);
            self.forget_camera_options(&mut edits);
            self.options.edits = edits;
            self.forget_camera_statements();
            self.options.edits.set.extend(moved);
            self.rig = None;
        }
        let same = |earlier: &String| field(earlier) == field(statement);
        let mut own = self.options.edits.set.split_off(self.given);
        match own.iter().position(same) {
            Some(at) => {
                own[at] = statement.to_owned();
                // What came later about parts of the old value has nothing to be about.
                let parts = format!("{}.", field(statement));
                let mut place = 0..;
                own.retain(|later| place.next() <= Some(at) || !field(later).starts_with(&parts));
            }
            None => own.push(statement.to_owned()),
        }
        self.options.edits.set.append(&mut own);
        self.reload_or(before)
    }

    /// Removes the page's statements about the current camera, which something else now places.
    pub(super) fn forget_camera_statements(&mut self) {
        let camera = format!("Camera[name={:?}].", self.camera_name().unwrap_or_default());
        let mut own = self.options.edits.set.split_off(self.given.min(self.options.edits.set.len()));
        own.retain(|statement| !statement.starts_with(&camera));
        self.options.edits.set.extend(own);
    }

    /// Takes back the last statement, or all.
    pub fn undo(&mut self, all: bool) -> Result<(), SceneError> {
        let count = self.statements().len();
        if count == 0 {
            return Err(SceneError::Refused("no value was changed here".into()));
        }
        let before = (self.options.edits.clone(), self.rig.clone());
        self.options.edits.set.truncate(self.given + if all { 0 } else { count - 1 });
        self.reload_or(before)
    }

    /// Reads the scene as it is at a time in seconds.
    pub fn look_at_time(&mut self, time_s: f32) -> Result<(), SceneError> {
        let before = self.options.time_s.replace(time_s.max(0.0));
        let outcome = self.reload();
        if outcome.is_err() {
            self.options.time_s = before;
        }
        outcome
    }

    fn reload_or(
        &mut self,
        (edits, rig): (crate::formats::Edits, Option<crate::world::OrbitCamera>),
    ) -> Result<(), SceneError> {
        let outcome = self.reload();
        if outcome.is_err() {
            (self.options.edits, self.rig) = (edits, rig);
        }
        outcome
    }

    /// Lists the things that have a form.
    pub fn forms(&self) -> Value {
        let targets = forms::targets(&self.world).into_iter();
        targets.map(|it| json!({"statement": it.statement, "kind": it.kind, "name": it.name})).collect()
    }

    /// Returns the form of a thing.
    pub fn form(&self, target: &str) -> Result<Value, SceneError> {
        let gone = || SceneError::Refused(format!("the scene has no {target} by now"));
        forms::form(&self.world, target).ok_or_else(gone)
    }

    /// The reason why a setting does nothing, as it follows "does nothing".
    pub fn reason_of_setting(&self, name: &str) -> Option<&'static str> {
        reason(OF_SETTINGS, &self.world.settings, &FieldContext::of(&self.world), name)
    }

    /// True if changed values can be written into the scene's file.
    pub fn can_save_edits(&self) -> bool {
        self.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron"))
    }

    /// Writes the changed values into the scene's file: where they are written there, or else as statements in its
    /// `edits`. The scene that the file then describes is the same; if it is not, the file stays as it was.
    pub fn save_edits(&mut self) -> Result<String, SceneError> {
        let refused = |reason: &str| Err(SceneError::Refused(reason.into()));
        let statements = self.statements().to_vec();
        if statements.is_empty() {
            return refused("no value was changed here");
        }
        if !self.can_save_edits() {
            return refused("only .ron files can be changed: the command to copy has the changes as --set");
        }
        let path = self.path.clone();
        let bytes = files::read(&path).map_err(LoadError::io(&path))?;
        if !self.lock_files().is_as_read(&path, &bytes) {
            return refused(
                "the file has changed meanwhile, and what it says now is not shown: mend it first",
            );
        }
        let text = String::from_utf8(bytes).map_err(|_| LoadError::invalid(&path, "this is not UTF-8"))?;
        // Writes to the target of a symbolic link instead of replacing the link.
        let target = path.canonicalize().unwrap_or(path.clone());
        let wanted = portrait(&self.world, &path);
        let edits = self.options.edits.clone();
        for in_place in [true, false] {
            let new = with_statements(&text, &path, &self.world, &statements, in_place)?;
            files::replace(&target, new.as_bytes())?;
            self.options.edits.set.truncate(self.given);
            let (rig, outcome) = (self.rig.clone(), self.reload());
            if outcome.is_ok() && portrait(&self.world, &path) == wanted {
                return Ok(format!("saved in {}", path.display()));
            }
            files::replace(&target, text.as_bytes())?;
            (self.options.edits, self.rig) = (edits.clone(), rig);
            self.reload()?;
        }
        refused("options of the command line change the same values, so the file stays as it was")
    }
}

/// The part of a statement before its operator: what it changes.
fn field(statement: &str) -> &str {
    assignment(statement).map_or(statement, |(field, _)| field)
}
