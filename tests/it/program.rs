//! The program, run in folders of its own.

use std::ffi::{OsStr, OsString};
use std::ops::Deref;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use rayfront::internals::formats::picture;
use rayfront::math::Rgb;
use serde_json::Value;
use tempfile::TempDir;

/// The longest time that a run may take.
const PATIENCE: Duration = Duration::from_secs(300);

/// A temporary folder, used as a path.
pub struct Folder(TempDir);

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.0.path()
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        self
    }
}

/// Makes a folder without files.
pub fn empty_folder() -> Folder {
    Folder(tempfile::tempdir().expect("a folder"))
}

/// Makes a folder with this `scene.ron`.
pub fn folder(scene: &str) -> Folder {
    let folder = empty_folder();
    folder.write("scene.ron", scene);
    folder
}

/// The arguments of a run: a line, split as by a shell, or words.
pub trait Words {
    fn words(self) -> Vec<OsString>;
}

impl Words for &str {
    fn words(self) -> Vec<OsString> {
        shlex::split(self).expect("closed quotes").into_iter().map(OsString::from).collect()
    }
}

impl Words for &String {
    fn words(self) -> Vec<OsString> {
        self.as_str().words()
    }
}

impl<S: AsRef<OsStr>> Words for &[S] {
    fn words(self) -> Vec<OsString> {
        self.iter().map(|word| word.as_ref().to_owned()).collect()
    }
}

impl<S: AsRef<OsStr>, const N: usize> Words for &[S; N] {
    fn words(self) -> Vec<OsString> {
        self[..].words()
    }
}

impl<S: AsRef<OsStr>> Words for &Vec<S> {
    fn words(self) -> Vec<OsString> {
        self[..].words()
    }
}

/// The end of a run.
pub struct Run {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
    command: String,
}

impl Run {
    /// Checks the exit code and that parts of messages were printed on standard error, which it returns.
    #[track_caller]
    pub fn ends(self, code: i32, parts: &[&str]) -> String {
        let Run { err, command, .. } = self;
        assert_eq!(self.code, Some(code), "{command}: {err}");
        for part in parts {
            assert!(err.contains(part), "{command}: no {part:?} in {err}");
        }
        err
    }

    /// Returns the standard output of a successful run.
    #[track_caller]
    pub fn printed(mut self) -> String {
        let out = std::mem::take(&mut self.out);
        self.ends(0, &[]);
        out
    }
}

/// Runs a command without input, which must end in time.
pub fn ended(command: &mut Command) -> Run {
    let shown = format!("{command:?}");
    let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("the program runs");
    let (id, (sender, receiver)) = (child.id(), std::sync::mpsc::channel());
    std::thread::spawn(move || sender.send(child.wait_with_output()));
    let Ok(output) = receiver.recv_timeout(PATIENCE) else {
        kill(id, "-KILL");
        panic!("it does not end: {shown}");
    };
    let output = output.expect("its output");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Run { code: output.status.code(), out: text(output.stdout), err: text(output.stderr), command: shown }
}

/// Sends a signal to a process; returns false if it has ended.
pub fn kill(id: u32, signal: &str) -> bool {
    Command::new("kill").args([signal, &id.to_string()]).status().expect("kill").success()
}

/// Folders, with the files in them and the program.
pub trait Place: AsRef<Path> {
    /// The program with its arguments, in this folder.
    fn command(&self, words: impl Words) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
        command.current_dir(self).args(words.words()).stdin(Stdio::null());
        command
    }

    fn run(&self, words: impl Words) -> Run {
        ended(&mut self.command(words))
    }

    /// Runs a line of a shell, in which `rayfront` is the program.
    fn shell(&self, line: &str) -> Run {
        let program = format!("rayfront() {{ '{}' \"$@\"; }}\n{line}", env!("CARGO_BIN_EXE_rayfront"));
        ended(Command::new("sh").current_dir(self).args(["-c", &program]))
    }

    /// Returns the standard output of a successful run.
    #[track_caller]
    fn out(&self, words: impl Words) -> String {
        self.run(words).printed()
    }

    /// Returns the messages of a successful run.
    #[track_caller]
    fn messages(&self, words: impl Words) -> String {
        self.run(words).ends(0, &[])
    }

    /// Returns the report of a successful run with `--json`.
    #[track_caller]
    fn json(&self, words: impl Words) -> Value {
        let words = words.words().into_iter().chain(["--json".into()]).collect::<Vec<_>>();
        let out = self.out(&words);
        serde_json::from_str(&out).unwrap_or_else(|error| panic!("{words:?}: {error}: {out}"))
    }

    /// Returns the hash of the film of a successful run.
    #[track_caller]
    fn hash(&self, words: impl Words) -> String {
        self.json(words)["film_hash"].as_str().expect("a hash").to_owned()
    }

    /// Checks that a run ends with this code, an error, and parts of messages; returns the messages.
    #[track_caller]
    fn fails(&self, code: i32, words: impl Words, parts: &[&str]) -> String {
        let error = self.run(words).ends(code, parts);
        assert!(error.lines().any(|line| line.starts_with("error: ")), "{error}");
        error
    }

    fn has(&self, file: &str) -> bool {
        self.as_ref().join(file).exists()
    }

    #[track_caller]
    fn write(&self, file: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.as_ref().join(file), content).expect(file);
    }

    #[track_caller]
    fn bytes(&self, file: &str) -> Vec<u8> {
        std::fs::read(self.as_ref().join(file)).expect(file)
    }

    #[track_caller]
    fn text(&self, file: &str) -> String {
        String::from_utf8(self.bytes(file)).expect("UTF-8")
    }

    /// Returns the width, the height and the linear pixels that an image has; of a crop, those within it.
    #[track_caller]
    fn image(&self, file: &str) -> (u32, u32, Vec<Rgb>) {
        let image = picture::load_linear_crop(&self.as_ref().join(file)).expect(file);
        (image.size[0], image.size[1], image.pixels)
    }

    #[track_caller]
    fn pixels(&self, file: &str) -> Vec<Rgb> {
        self.image(file).2
    }
}

impl Place for Path {}
