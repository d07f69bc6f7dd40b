//! `rayfront view SCENE`: serves a web page that shows a scene as it renders, or writes a layer of it to a file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;

use super::save_plain;
use crate::cli::args::{ModelOptions, PictureOptions};
use crate::cli::{command_line, failure::Failure, interrupt::Interrupt, output};
use crate::film::tonemap::{DisplayTransform, srgb_decode};
use crate::formats::picture::supported;
use crate::math::Rgb;
use crate::render::on_threads;
use crate::view::layer_image::layer_image;
use crate::view::picture::Layer;
use crate::view::scene::LiveScene;
use crate::view::server::{MakeCommands, Server};
use crate::view::tev::Tev;
use crate::view::viewer::{RenderWork, Viewer};
use crate::world::Tonemap;

/// `rayfront view`.
#[derive(Args, Debug)]
pub struct ViewArguments {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj, .stl)
    pub scene: PathBuf,
    /// Threads; 0 means one for each core
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// The page's port on this machine [default: 8421, or any that is free]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    pub port: u16,
    /// Do not open the page in a browser
    #[arg(long)]
    pub no_open: bool,
    /// Also show the image, as floats, in tev or HDRView listening at this address, usually 127.0.0.1:14158
    #[arg(long, value_name = "HOST:PORT")]
    pub tev: Option<String>,
    /// Write a layer with its colour bar to an image file, as the page shows it, and serve no page
    #[arg(long, value_name = "NAME", requires = "output", conflicts_with_all = ["port", "no_open", "tev"],
          value_parser = parse_layer)]
    pub layer: Option<Layer>,
    /// File for the layer, such as nodes.png
    #[arg(short, long, value_name = "FILE", requires = "layer")]
    pub output: Option<PathBuf>,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
    /// The options of the image.
    #[command(flatten)]
    pub picture: PictureOptions,
}

/// Parses the name of a layer that has colours of its own.
fn parse_layer(name: &str) -> Result<Layer, String> {
    let named = &Layer::ALL[2..];
    let found = named.iter().find(|(known, _)| *known == name);
    found.map(|(_, layer)| *layer).ok_or_else(|| {
        let names: Vec<_> = named.iter().map(|(name, _)| *name).collect();
        format!("expected {}; light is what rayfront SCENE renders", names.join(", "))
    })
}

/// Writes a layer to a file.
fn save_layer(scene: &LiveScene, layer: Layer, path: &Path) -> Result<ExitCode, Failure> {
    let (size, bytes) = layer_image(scene, layer).map_err(Failure::output)?;
    let [r, g, b] = [0, 1, 2].map(|channel| bytes[channel..].iter().step_by(3));
    let linear = |byte: &u8| srgb_decode(f32::from(*byte) / 255.0);
    let colors: Vec<Rgb> =
        r.zip(g).zip(b).map(|((r, g), b)| Rgb::new(linear(r), linear(g), linear(b))).collect();
    save_plain(path, size, &colors, DisplayTransform::new(Tonemap::Clamp, 0.0, &colors))?;
    output::print(&format!("{}\n", path.display()))?;
    Ok(ExitCode::SUCCESS)
}

pub fn run(arguments: ViewArguments) -> Result<ExitCode, Failure> {
    let ViewArguments { scene: path, model, picture, threads, port, no_open, tev, layer, output: file } =
        arguments;
    file.iter().try_for_each(|file| supported(file))?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let tev = tev.map(|address| Tev::connect(&address, &name)).transpose()?;
    let camera = picture.sampling.camera.clone();
    let options = model.of_size(picture.sampling.size);
    on_threads(threads, move || {
        let change = Box::new(move |world: &mut _| picture.apply(world));
        let scene = LiveScene::load(&path, options, camera, change)?;
        for warning in scene.findings() {
            output::note(format_args!("warning: {warning}"));
        }
        if let (Some(layer), Some(file)) = (layer, &file) {
            super::check_is_not_read(file, scene.sources(), "-o")?;
            return save_layer(&scene, layer, file);
        }
        let cannot = |error: std::io::Error| {
            Failure::command_line(format!("cannot serve a page: {error}: try another --port"))
        };
        let server = Server::new(port).map_err(cannot)?;
        let address = server.address().map_err(cannot)?;
        output::print(&format!("{address}\n"))?;
        output::note("Ctrl-C ends it");
        if !no_open && is_desktop() {
            // Without a browser, the printed address has to do.
            let _ = open::that_detached(&address);
        }
        let viewer = Arc::new(Viewer::new(&scene, RenderWork::default()).with_tev(tev));
        let served = viewer.clone();
        let serve = move || {
            if let Err(error) = server.serve(
                served.clone(),
                MakeCommands { explain: command_line::of_explain, render: command_line::of_picture },
            ) {
                output::note(format_args!("error: the page is no longer served: {error}"));
            }
            served.end();
        };
        let interrupt = Interrupt::watch();
        let (ends, asked) = (viewer.clone(), interrupt.clone());
        let wait = move || {
            while !asked.is_set() {
                std::thread::sleep(Duration::from_millis(50));
            }
            ends.end();
        };
        let cannot = |error| Failure::limit(format!("cannot start a thread: {error}"));
        std::thread::Builder::new().name("page".into()).spawn(serve).map_err(cannot)?;
        std::thread::Builder::new().name("end".into()).spawn(wait).map_err(cannot)?;
        viewer.run(scene, RenderWork::default());
        Ok(ExitCode::SUCCESS)
    })?
}

/// True if the user probably sits in front of a screen.
fn is_desktop() -> bool {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let has_screen =
        cfg!(any(windows, target_os = "macos")) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
    has_screen && !is_set("SSH_CONNECTION")
}
