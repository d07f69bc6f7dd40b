//! The image in a viewer with tev's protocol, during rendering.

use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use super::program::{Place, folder};

const SCENE: &str = r#"(
    settings: (size: (100, 80), samples: 20, transport: Path),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (shape: Sphere, material: (diffuse: (0.8, 0.4, 0.2))),
        (shape: Plane(corners: ((-3, -1, -3), (-3, -1, 3), (3, -1, 3), (3, -1, -3)))),
        (light: Area(power_w: 300, size_m: 1), transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

/// A listener, and its address.
fn listener() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    (listener, address)
}

/// An image in a viewer.
#[derive(Default)]
struct Image {
    name: String,
    size: [usize; 2],
    /// Bits of red, green and blue, row by row.
    pixels: Vec<[u32; 3]>,
    updates: usize,
}

fn take<'a>(packet: &mut &'a [u8], length: usize) -> &'a [u8] {
    let (taken, rest) = packet.split_at(length);
    *packet = rest;
    taken
}

fn number(packet: &mut &[u8]) -> usize {
    u32::from_le_bytes(take(packet, 4).try_into().expect("four bytes")) as usize
}

fn text(packet: &mut &[u8]) -> String {
    let end = packet.iter().position(|byte| *byte == 0).expect("an end");
    let text = take(packet, end + 1);
    String::from_utf8_lossy(&text[..end]).into_owned()
}

impl Image {
    /// Applies one packet; returns false at the end of the stream.
    fn follow(&mut self, stream: &mut TcpStream) -> bool {
        let mut length = [0; 4];
        if stream.read_exact(&mut length).is_err() {
            return false;
        }
        let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
        if stream.read_exact(&mut packet).is_err() {
            return false;
        }
        let rest = &mut &packet[..];
        let (kind, name) = (take(rest, 2)[0], text(rest));
        if kind == 4 {
            let size = [number(rest), number(rest)];
            *self = Image { name, size, pixels: vec![[0; 3]; size[0] * size[1]], updates: 0 };
            return true;
        }
        assert_eq!((kind, &name), (6, &self.name));
        let channels: Vec<String> = (0..number(rest)).map(|_| text(rest)).collect();
        let [x0, y0, width, height] = [(); 4].map(|()| number(rest));
        let mut longs = || u64::from_le_bytes(take(rest, 8).try_into().expect("eight bytes")) as usize;
        let offsets: Vec<usize> = channels.iter().map(|_| longs()).collect();
        let strides: Vec<usize> = channels.iter().map(|_| longs()).collect();
        let values: Vec<u32> = rest
            .chunks_exact(4)
            .map(|bytes| u32::from_le_bytes(bytes.try_into().expect("four bytes")))
            .collect();
        for (channel, (offset, stride)) in channels.iter().zip(offsets.into_iter().zip(strides)) {
            let place = ["R", "G", "B"].iter().position(|name| name == channel).expect("a channel");
            for i in 0..width * height {
                let [x, y] = [x0 + i % width, y0 + i / width];
                self.pixels[y * self.size[0] + x][place] = values[offset + i * stride];
            }
        }
        self.updates += 1;
        true
    }

    /// Accepts a connection and returns the final image.
    fn last(listener: &TcpListener) -> Image {
        let mut stream = listener.accept().expect("a caller").0;
        let mut image = Image::default();
        while image.follow(&mut stream) {}
        image
    }
}

fn floats(folder: &Path, file: &str) -> Vec<[u32; 3]> {
    folder.pixels(file).iter().map(|pixel| pixel.to_array().map(f32::to_bits)).collect()
}

#[test]
fn viewer_receives_the_exact_floats_of_the_image() {
    let here = folder(SCENE);
    here.messages("scene.ron -q -o alone.exr");
    let (listener, address) = listener();
    let viewer = std::thread::spawn(move || [(); 4].map(|()| Image::last(&listener)));
    here.messages(&format!("scene.ron -q -o shown.exr --tev {address}"));
    here.messages(&format!("scene.ron -q --crop 10,5,90,75 -o crop.exr --tev {address}"));
    here.messages(&format!("scene.ron -q --spp 4 -o part.film --tev {address}"));
    here.messages(&format!("resume part.film -q --spp 20 -o more.exr --tev {address}"));
    let [whole, crop, _, resumed] = viewer.join().expect("a viewer");
    assert_eq!((&whole.name[..], whole.size), ("scene.ron", [100, 80]));
    assert!(whole.pixels == floats(&here, "shown.exr"));
    assert_eq!(crop.size, [80, 70]);
    assert!(crop.pixels == floats(&here, "crop.exr"));
    assert!(resumed.pixels == floats(&here, "more.exr"));
    // Viewers do not affect the file.
    assert!(here.bytes("alone.exr") == here.bytes("shown.exr"));
}

#[test]
fn view_command_sends_the_image_to_the_viewer() {
    let folder = folder(SCENE);
    folder.messages("scene.ron -q -o alone.exr");
    let expected = floats(&folder, "alone.exr");
    let (listener, address) = listener();
    let mut program = folder
        .command(&format!("view scene.ron --no-open --tev {address}"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program runs");
    let mut stream = listener.accept().expect("a caller").0;
    stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a limit");
    let mut image = Image::default();
    while image.pixels != expected {
        assert!(image.follow(&mut stream), "the image does not come: {} updates", image.updates);
        assert_eq!(image.size, [100, 80], "small pictures are not sent");
    }
    program.kill().expect("it runs still");
    program.wait().expect("its end");
}

#[test]
fn lost_viewers_are_warnings_and_missing_ones_errors() {
    let here = folder(SCENE);
    let (listener, address) = listener();
    let gone = std::thread::spawn(move || drop(listener.accept()));
    // Several packets have to be sent before the lost connection is detected.
    let error = here.messages(&format!("scene.ron --size 600x480 -o gone.exr --tev {address}"));
    gone.join().expect("a viewer");
    assert_eq!(error.matches("warning: the viewer has gone away").count(), 1, "{error}");
    // The listener is closed.
    let line = format!("scene.ron -o none.exr --tev {address}");
    here.fails(3, &line, &["error: cannot reach a viewer", "start tev"]);
    assert!(!here.has("none.exr"));
}

#[test]
fn preview_without_a_terminal_is_reported() {
    let folder = folder(SCENE);
    let error = folder.messages("scene.ron --spp 1 --preview");
    assert!(error.contains("--preview shows nothing: standard error is not a terminal"), "{error}");
    assert!(!error.contains('\x1b'), "{error}");
}
