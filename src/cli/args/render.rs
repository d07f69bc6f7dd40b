//! The options of a render.

use std::path::PathBuf;

use clap::Args;

use super::frames::{FrameOptions, Frames};
use super::job::{OutputOptions, RunOptions};
use super::names::{AOVS, Aovs, one_of};
use super::parse::{parse_crop, parse_samples};
use super::picture::{ModelOptions, PictureOptions, SampleOptions};
use super::shard::{ShardOption, parse_shard};
use crate::cli::failure::Failure;
use crate::film::Region;
use crate::formats::film_file::RenderedView;
use crate::world::World;

/// `rayfront render SCENE` and `rayfront SCENE`. The options are present if the scene is.
#[derive(Args, Debug)]
#[group(arg = "scene")]
pub struct Render {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// The options of the image.
    #[command(flatten)]
    pub picture: PictureOptions,
    /// Render only columns X0 to X1 and rows Y0 to Y1 (X1 and Y1 not included)
    #[arg(long, help_heading = "Picture", value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true, value_parser = parse_crop)]
    pub crop: Option<Region>,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
    /// The options of outputs.
    #[command(flatten)]
    pub output: OutputOptions,
    /// Write layers besides light into the .exr file (or into NAME.aov.exr) [default: the scene's]
    #[arg(long, help_heading = "Output", value_name = "NAMES", value_parser = one_of(AOVS), value_delimiter = ',')]
    pub aov: Vec<Aovs>,
    /// The part of the samples to render.
    #[command(flatten)]
    pub part: PartOptions,
    /// The frames to render.
    #[command(flatten)]
    pub frames: FrameOptions,
    /// The options of running the job.
    #[command(flatten)]
    pub run: RunOptions,
    /// The options of watching the scene's files.
    #[command(flatten)]
    pub watch: WatchOptions,
}

/// The part of the samples to render.
#[derive(Args, Debug)]
#[command(next_help_heading = "Parts and frames")]
pub struct PartOptions {
    /// Render one part of the samples: its number, from 0, and the number of parts, such as 3/64; auto/64 and auto take
    /// the number from the scheduler that runs this
    #[arg(long, value_name = "I/N", value_parser = parse_shard, conflicts_with = "samples")]
    pub shard: Option<ShardOption>,
    /// Render only these samples, such as 0..16; a plain number, such as 64, means the same as --spp
    #[arg(long, value_name = "FIRST..END", value_parser = parse_samples)]
    pub samples: Option<[u32; 2]>,
    /// With --adaptive=unbiased: film that stores the pilot's choice of samples; if it does not exist, the pilot is
    /// rendered and saved in it
    #[arg(long, value_name = "FILE")]
    pub pilot: Option<PathBuf>,
    /// Render only the pilot
    #[arg(long, requires = "pilot")]
    pub pilot_only: bool,
}

/// The options of rendering a scene while it is edited.
#[derive(Args, Debug)]
#[command(next_help_heading = "Work")]
pub struct WatchOptions {
    /// Render again whenever the scene or a file that it names changes, until Ctrl-C
    #[arg(long, conflicts_with_all = ["frames", "shard", "samples", "pilot"])]
    pub watch: bool,
    /// After each change, check that everything reused is the same as if it had been computed anew
    #[arg(long, requires = "watch")]
    pub paranoid: bool,
}

impl Render {
    /// Applies these options to the scene's settings.
    pub fn apply(&self, world: &mut World) {
        self.picture.apply(world);
        if !self.aov.is_empty() {
            let mut aovs = Vec::new();
            for aov in self.aov.iter().copied().flatten() {
                if !aovs.contains(aov) {
                    aovs.push(*aov);
                }
            }
            world.settings.aov = aovs;
        }
    }

    /// Returns the frames of the command; those of `all` depend on the scene, which is read for it.
    pub fn frames_of_scene(&self) -> Result<Option<Frames>, Failure> {
        let end = || {
            let options = self.view(Some(0)).options;
            Ok(crate::formats::load_with(&self.scene, &options)?.animation_end_s)
        };
        if self.frames.frames.is_some() && self.frames.turntable.is_none() && self.model.time.is_some() {
            let reason = "the frames say which moments are rendered: leave it out, or add --turntable";
            return Err(Failure::command_line(format!("--time: {reason}")));
        }
        let of_scene = |frames: Frames| match self.frames.turntable {
            Some(count) => frames.around(count),
            None => frames.until(self.frames.fps, end),
        };
        self.frames.given().map(of_scene).transpose()
    }

    /// Returns the view of the scene that is rendered, alone or as a frame.
    pub fn view(&self, frame: Option<u32>) -> RenderedView {
        let FrameOptions { fps, shutter, moments, turntable, .. } = self.frames;
        let (shutter_s, moments) = (shutter.map(|part| part / fps), shutter.and(Some(moments)));
        let SampleOptions { camera, size, .. } = &self.picture.sampling;
        let (camera, size) = (camera.clone(), *size);
        let mut options = self.model.of_size(size);
        match (frame, turntable) {
            (None, _) => {}
            (Some(frame), None) => options.time_s = Some(frame as f32 / fps),
            (Some(frame), Some(count)) => {
                let [right, up] = options.edits.orbit.unwrap_or_default();
                let turn = 360.0 * (f64::from(frame) - 1.0) / f64::from(count);
                options.edits.orbit = Some([right + turn, up]);
            }
        }
        RenderedView { camera, shutter_s, moments, options }
    }
}
