//! Small images of all scenes, and a page that shows them.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use rayfront::compile::compile;
use rayfront::formats;
use rayfront::render::{Options, Session};

/// Width of an image, in pixels.
const WIDTH: u32 = 400;

/// Renders every scene of a folder into `gallery/` in it, and writes `GALLERY.md`.
pub fn make(scenes: &Path) -> Result<(), Box<dyn Error>> {
    let pictures = scenes.join("gallery");
    std::fs::create_dir_all(&pictures)?;
    let mut page = String::from(
        "# Gallery\n\nAll scenes that come with rayfront, with what they say about themselves. The pictures are made by\n\
         `cargo run --release --example generate-assets gallery`.\n\n\
         Figures 1 to 11 of the coursework report are here. Figures 12 and 13 are plots, made by studies:\n\
         [area_light.ron](studies/area_light.ron) and [thin_lens.ron](studies/thin_lens.ron).\n\n\
         ```sh\nrayfront study scenes/studies/area_light.ron\nrayfront study scenes/studies/thin_lens.ron\n```\n\nTheir plots after `--short`, a sixteenth of the work:\n\n\
         ![Figure 12: the error by shadow rays](gallery/figure_12.png)\n\n\
         ![Figure 13: the error by points on the lens](gallery/figure_13.png)\n",
    );
    let entries = std::fs::read_dir(scenes)?.collect::<Result<Vec<_>, _>>()?;
    let mut paths: Vec<PathBuf> = entries.iter().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "ron"));
    paths.sort();
    for path in paths {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut world = formats::load(&path)?;
        let [width, height] = world.settings.size;
        world.settings.size = [WIDTH, (WIDTH * height).div_ceil(width)];
        let mut session = Session::new(compile(&world, None)?, &world.settings, Options::default());
        session.finish(|_| ());
        formats::save_image(pictures.join(format!("{name}.png")), session.film(), &world.settings)?;
        println!("{name}");
        let text = std::fs::read_to_string(&path)?;
        write!(
            page,
            "\n## {name}\n\n[![{name}](gallery/{name}.png)]({name}.ron)\n\n{}\n\n```sh\nrayfront scenes/{name}.ron\n```\n",
            caption(&text)
        )?;
    }
    std::fs::write(scenes.join("GALLERY.md"), page)?;
    Ok(())
}

/// The caption of a scene: the comment that it begins with.
fn caption(scene: &str) -> String {
    let lines = scene.lines().map(|line| line.trim_start_matches('(').trim_start());
    let comment: Vec<&str> = lines.map_while(|line| line.strip_prefix("//")).map(str::trim).collect();
    // Escapes characters with a meaning in Markdown.
    comment.join("\n").replace('<', "\\<").replace('*', "\\*")
}
