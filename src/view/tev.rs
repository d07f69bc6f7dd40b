//! Sends the image, while it is rendered, to a viewer of floating-point images: tev or HDRView.
//!
//! The protocol is tev's (<https://github.com/Tom94/tev>, `include/tev/Ipc.h` and `src/Ipc.cpp`), which HDRView
//! supports too. Packets go one way over TCP: the packet's length in bytes, including these four; its kind, a byte; and
//! its fields. Numbers are little-endian, strings end with a zero.

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::film::Film;
use crate::math::Rgb;

/// Timeout for connecting and for each write, after which the viewer counts as gone.
const PATIENCE: Duration = Duration::from_secs(5);
/// Rows that are sent together, and only if one of them has changed; the height of a render tile.
const BAND: usize = 64;
/// The names of the image's channels.
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Packet kinds.
const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE_V3: u8 = 6;

/// A viewer that cannot be reached.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot reach a viewer at {address}: {source}: start tev there, or HDRView and let it listen (both usually do at 127.0.0.1:14158)"
)]
pub struct TevError {
    /// The viewer's address.
    pub address: String,
    /// The system's error.
    pub source: io::Error,
}

/// A connection to a viewer that shows an image while it is rendered.
///
/// A separate thread sends, so that showing an image never waits for the network. An image that a slow viewer has not
/// been sent yet is replaced by the next one.
pub struct Tev {
    shared: Arc<Shared>,
    sender: Option<JoinHandle<()>>,
}

struct Shared {
    state: Mutex<TevState>,
    changed: Condvar,
}

/// An image in the viewer's format, a fifth of the film's size.
struct TevImage {
    size: [u32; 2],
    pixels: Vec<Rgb>,
}

#[derive(Default)]
struct TevState {
    /// The image to send next.
    next: Option<TevImage>,
    is_sending: bool,
    /// True if the viewer has gone away.
    is_gone: bool,
    /// The reason, until it has been taken.
    warning: Option<String>,
    ends: bool,
}

impl Tev {
    /// Connects to the viewer that listens at `HOST:PORT`. The image gets this name, and replaces an image of that
    /// name.
    pub fn connect(address: &str, name: &str) -> Result<Tev, TevError> {
        let fault = |source| TevError { address: address.to_owned(), source };
        let stream = reach(address).map_err(fault)?;
        let shared = Arc::new(Shared { state: Mutex::default(), changed: Condvar::new() });
        let (link, own) = (Link::new(stream, name), shared.clone());
        let sender = std::thread::Builder::new().name("tev".into()).spawn(move || own.send_all(link));
        Ok(Tev { shared, sender: Some(sender.map_err(fault)?) })
    }

    /// Sends an image as soon as possible. Does not block.
    pub fn show(&self, film: &Film) {
        let mut state = self.shared.lock();
        // Frees the unsent image before another one is made.
        state.next = None;
        if state.is_gone {
            return;
        }
        drop(state);
        let region = film.region();
        let image = TevImage { size: [region.width(), region.height()], pixels: film.radiance() };
        self.shared.lock().next = Some(image);
        self.shared.changed.notify_all();
    }

    /// Waits until the last image has been sent, or the viewer has gone away.
    pub fn flush(&self) {
        let mut state = self.shared.lock();
        while !state.is_gone && (state.next.is_some() || state.is_sending) {
            state = self.shared.wait(state);
        }
    }

    /// Returns the warning about a viewer that has gone away, once.
    pub fn warning(&self) -> Option<String> {
        self.shared.lock().warning.take()
    }
}

impl Drop for Tev {
    fn drop(&mut self) {
        self.shared.lock().ends = true;
        self.shared.changed.notify_all();
        if let Some(sender) = self.sender.take() {
            // The thread does not panic; if it did, there would be nothing left to do.
            let _ = sender.join();
        }
    }
}

impl Shared {
    /// Nothing panics while it holds the lock.
    fn lock(&self) -> MutexGuard<'_, TevState> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn wait<'a>(&self, state: MutexGuard<'a, TevState>) -> MutexGuard<'a, TevState> {
        self.changed.wait(state).unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Sends images until the connection is dropped or the viewer goes away.
    fn send_all(&self, mut link: Link) {
        let mut state = self.lock();
        loop {
            if let Some(next) = state.next.take() {
                state.is_sending = true;
                drop(state);
                let sent = link.send(next);
                state = self.lock();
                state.is_sending = false;
                if let Err(error) = sent {
                    (state.is_gone, state.next) = (true, None);
                    state.warning =
                        Some(format!("the viewer has gone away: {error} (the rendering goes on without it)"));
                }
                self.changed.notify_all();
            } else if state.ends {
                return;
            } else {
                state = self.wait(state);
            }
            if state.is_gone {
                return;
            }
        }
    }
}

/// Connects to the first of a host's addresses that accepts a connection.
fn reach(address: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "nothing has that name");
    for socket in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&socket, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// A connection, and the state of the viewer's image.
struct Link {
    stream: TcpStream,
    /// The image's name.
    name: String,
    /// Its width and height; none before it has been created.
    size: Option<[u32; 2]>,
    /// Its pixels; empty before all have been sent.
    sent: Vec<Rgb>,
}

impl Link {
    fn new(stream: TcpStream, name: &str) -> Link {
        // A zero byte would end the name.
        Link { stream, name: name.replace('\0', ""), size: None, sent: Vec::new() }
    }

    /// Sends the bands of rows that have changed.
    fn send(&mut self, TevImage { size, pixels }: TevImage) -> io::Result<()> {
        if self.size != Some(size) {
            self.stream.write_all(&self.creation(size))?;
            (self.size, self.sent) = (Some(size), Vec::new());
        }
        let length = (BAND * size[0] as usize).max(1);
        for (number, band) in pixels.chunks(length).enumerate() {
            let start = number * length;
            if self.sent.get(start..start + band.len()) != Some(band) {
                self.stream.write_all(&self.update(size[0], number * BAND, band))?;
            }
        }
        self.sent = pixels;
        Ok(())
    }

    /// The packet that creates an image; the viewer switches to it.
    fn creation(&self, size: [u32; 2]) -> Vec<u8> {
        let packet = TevPacket::new(CREATE_IMAGE).flag(true).text(&self.name);
        let packet = size.into_iter().fold(packet, TevPacket::number).number(CHANNELS.len() as u32);
        CHANNELS.into_iter().fold(packet, TevPacket::text).finish()
    }

    /// The packet that updates whole rows from row `y` on. The viewer does not switch to the image, so as not to
    /// disturb a user who views another one.
    fn update(&self, width: u32, y: usize, pixels: &[Rgb]) -> Vec<u8> {
        let height = pixels.len() / (width as usize).max(1);
        let packet =
            TevPacket::new(UPDATE_IMAGE_V3).flag(false).text(&self.name).number(CHANNELS.len() as u32);
        let packet = CHANNELS.into_iter().fold(packet, TevPacket::text);
        let packet = [0, y as u32, width, height as u32].into_iter().fold(packet, TevPacket::number);
        // The channels are interleaved: the offset of each, and the stride to the next pixel.
        let offsets = 0..CHANNELS.len() as u64;
        let strides = CHANNELS.map(|_| CHANNELS.len() as u64);
        let mut packet = offsets.chain(strides).fold(packet, TevPacket::long_number);
        packet.0.reserve(size_of_val(pixels));
        for component in pixels.iter().flat_map(|pixel| pixel.to_array()) {
            packet.0.extend(component.to_le_bytes());
        }
        packet.finish()
    }
}

/// A packet under construction. Its numbers are signed in the protocol, but ours are never negative.
struct TevPacket(Vec<u8>);

impl TevPacket {
    fn new(kind: u8) -> TevPacket {
        // The first four bytes are set to its length later.
        TevPacket(vec![0, 0, 0, 0, kind])
    }

    fn flag(mut self, is_set: bool) -> TevPacket {
        self.0.push(u8::from(is_set));
        self
    }

    fn number(mut self, number: u32) -> TevPacket {
        self.0.extend(number.to_le_bytes());
        self
    }

    fn long_number(mut self, number: u64) -> TevPacket {
        self.0.extend(number.to_le_bytes());
        self
    }

    fn text(mut self, text: &str) -> TevPacket {
        self.0.extend(text.as_bytes());
        self.0.push(0);
        self
    }

    fn finish(mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::net::TcpListener;

    use super::*;
    use crate::film::{FilmScale, Region};
    use crate::render::RenderState;

    /// The data that a viewer has received.
    #[derive(Default)]
    struct Received {
        name: String,
        size: [usize; 2],
        pixels: Vec<Rgb>,
        creations: usize,
        /// First row and height of each update.
        bands: Vec<[usize; 2]>,
    }

    /// Reads the fields of a packet in order.
    struct Fields<'a>(&'a [u8]);

    impl Fields<'_> {
        fn take<const N: usize>(&mut self) -> [u8; N] {
            let (first, rest) = self.0.split_at(N);
            self.0 = rest;
            first.try_into().unwrap()
        }

        fn number(&mut self) -> usize {
            i32::from_le_bytes(self.take()).try_into().unwrap()
        }

        fn text(&mut self) -> String {
            let end = self.0.iter().position(|byte| *byte == 0).unwrap();
            let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
            self.0 = &self.0[end + 1..];
            text
        }
    }

    impl Received {
        /// Reads until the other end closes the connection.
        fn all(mut stream: TcpStream) -> Received {
            let mut received = Received::default();
            let mut length = [0; 4];
            while stream.read_exact(&mut length).is_ok() {
                let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
                stream.read_exact(&mut packet).unwrap();
                received.take(&packet);
            }
            received
        }

        fn take(&mut self, packet: &[u8]) {
            let mut fields = Fields(packet);
            let [kind, turns_to_it] = fields.take();
            let name = fields.text();
            match kind {
                4 => {
                    self.size = [fields.number(), fields.number()];
                    assert_eq!(fields.number(), 3);
                    assert_eq!([fields.text(), fields.text(), fields.text()], ["R", "G", "B"]);
                    assert_eq!((turns_to_it, fields.0), (1, &[][..]));
                    self.pixels = vec![Rgb::splat(f32::NAN); self.size[0] * self.size[1]];
                    (self.name, self.creations) = (name, self.creations + 1);
                }
                6 => {
                    assert_eq!((turns_to_it, &name), (0, &self.name));
                    assert_eq!(fields.number(), 3);
                    assert_eq!([fields.text(), fields.text(), fields.text()], ["R", "G", "B"]);
                    let [x, y, width, height] = [(); 4].map(|()| fields.number());
                    assert_eq!((x, width), (0, self.size[0]));
                    let layout = [(); 6].map(|()| i64::from_le_bytes(fields.take()));
                    assert_eq!(layout, [0, 1, 2, 3, 3, 3]);
                    for pixel in &mut self.pixels[y * width..][..width * height] {
                        *pixel = Rgb::from([(); 3].map(|()| f32::from_le_bytes(fields.take())));
                    }
                    assert!(fields.0.is_empty());
                    self.bands.push([y, height]);
                }
                _ => panic!("a packet of kind {kind}"),
            }
        }
    }

    fn gathered([width, height]: [u32; 2]) -> RenderState {
        let mut gathered =
            RenderState::nothing(Film::new(Region::whole([width, height]), FilmScale::default()), false);
        for y in 0..height {
            for x in 0..width {
                for sample in 0..3 {
                    gathered.film.count(x, y, sample);
                    gathered.film.add(x, y, sample, Rgb::new(0.1 * x as f32, 3.7 / (y + 1) as f32, 1e4));
                }
            }
        }
        gathered
    }

    /// A listening viewer and its address.
    fn listener() -> (TcpListener, String) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        (listener, address)
    }

    fn bits(pixels: &[Rgb]) -> Vec<[u32; 3]> {
        pixels.iter().map(|pixel| pixel.to_array().map(f32::to_bits)).collect()
    }

    #[test]
    fn viewer_receives_the_floats_of_the_film() {
        let (listener, address) = listener();
        let viewer = std::thread::spawn(move || Received::all(listener.accept().unwrap().0));
        let tev = Tev::connect(&address, "größer.ron").unwrap();
        let first = gathered([70, 150]);
        let mut second = first.clone();
        second.film.count(5, 70, 3);
        for shown in [&first, &second, &second] {
            tev.show(&shown.film);
            tev.flush();
        }
        assert_eq!(tev.warning(), None);
        drop(tev);
        let received = viewer.join().unwrap();
        assert_eq!((&received.name[..], received.size, received.creations), ("größer.ron", [70, 150], 1));
        assert_eq!(bits(&received.pixels), bits(&second.film.radiance()));
        // The whole image, and then the band that has changed.
        assert_eq!(received.bands, [[0, 64], [64, 64], [128, 22], [64, 64]]);
    }

    #[test]
    fn changed_size_creates_a_new_image() {
        let (listener, address) = listener();
        let viewer = std::thread::spawn(move || Received::all(listener.accept().unwrap().0));
        let tev = Tev::connect(&address, "scene").unwrap();
        for size in [[8, 8], [9, 7]] {
            tev.show(&gathered(size).film);
            tev.flush();
        }
        drop(tev);
        let received = viewer.join().unwrap();
        assert_eq!((received.size, received.creations), ([9, 7], 2));
        assert_eq!(bits(&received.pixels), bits(&gathered([9, 7]).film.radiance()));
    }

    #[test]
    fn lost_viewer_is_reported_once_and_does_no_harm() {
        let (listener, address) = listener();
        let viewer = std::thread::spawn(move || {
            let mut beginning = [0; 100];
            listener.accept().unwrap().0.read_exact(&mut beginning).unwrap();
        });
        let tev = Tev::connect(&address, "scene").unwrap();
        // Larger than the system's socket buffers.
        let image = gathered([1000, 1000]).film;
        tev.show(&image);
        viewer.join().unwrap();
        tev.flush();
        // The first image may still have fitted into a buffer.
        for sample in 3..10 {
            let mut more = image.clone();
            more.count(0, 0, sample);
            tev.show(&more);
            tev.flush();
        }
        let warning = tev.warning().expect("a warning");
        assert!(warning.contains("gone away"), "{warning}");
        tev.show(&image);
        tev.flush();
        assert_eq!(tev.warning(), None);
    }

    #[test]
    fn connecting_without_a_listener_fails_with_advice() {
        // A port that has just been freed.
        let (listener, address) = listener();
        drop(listener);
        for wrong in [&address[..], "127.0.0.1", "nowhere.invalid:14158"] {
            let error = Tev::connect(wrong, "scene").err().expect("nobody listens").to_string();
            assert!(error.contains(wrong) && error.contains("start tev"), "{error}");
        }
    }
}
