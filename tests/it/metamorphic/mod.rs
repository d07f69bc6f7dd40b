//! Metamorphic relations between images: changes to a world that must not change its image, or must change all of it in
//! a known way.

mod alpha;
mod copies;
mod doubled;
mod invariance;
mod layers;
mod lights;
mod sides;
mod stage;
mod textures;

use rayfront::compile::compile;
use rayfront::internals::film::Film;
use rayfront::internals::scene::{CompiledScene, Emitters};
use rayfront::math::Rgb;
use rayfront::render::{Options, Session};
use rayfront::world::World;

/// An image and its uncertainty.
#[derive(Clone)]
pub struct Seen {
    pub pixels: Vec<Rgb>,
    /// Root mean square of the noise in the pixels.
    noise: f64,
}

impl Seen {
    pub fn of(world: &World) -> Seen {
        Seen::changed(world, |_| ())
    }

    /// Renders without light sampling: only surfaces hit by sampled directions give light.
    pub fn found(world: &World) -> Seen {
        Seen::changed(world, |scene| scene.emitters = Emitters::default().into())
    }

    fn changed(world: &World, change: impl FnOnce(&mut CompiledScene)) -> Seen {
        let mut scene = compile(world, None).unwrap_or_else(|error| panic!("{error}"));
        change(&mut scene);
        let mut session = Session::new(scene, &world.settings, Options::default());
        session.advance(u32::MAX);
        Seen::on(session.film())
    }

    pub fn on(film: &Film) -> Seen {
        Seen { pixels: film.radiance(), noise: film.noise().expect("two samples or more") }
    }

    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pixels.iter().flat_map(|p| p.to_array()).map(f64::from).sum();
        sum / (3 * self.pixels.len()) as f64
    }

    /// The standard deviation of the mean: pixels have independent random numbers.
    pub fn sigma(&self) -> f64 {
        self.noise / (self.pixels.len() as f64).sqrt()
    }

    /// Scales the image.
    pub fn times(&self, factor: f32) -> Seen {
        let pixels = self.pixels.iter().map(|p| p.map(|c| c * factor)).collect();
        Seen { pixels, noise: self.noise * factor as f64 }
    }
}

/// An image with more noise than this fraction of it proves nothing, unless both images are practically equal.
const CLEAR: f64 = 0.016;

/// Collects the violated relations of a test, and reports all of them at its end.
#[derive(Default)]
pub struct Relations {
    broken: Vec<String>,
}

impl Drop for Relations {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert!(self.broken.is_empty(), "\n{}", self.broken.join("\n"));
        }
    }
}

impl Relations {
    /// Checks a condition.
    pub fn holds(&mut self, so: bool, what: impl FnOnce() -> String) {
        if !so {
            self.broken.push(what());
        }
    }

    /// Checks that means are equal within four standard deviations, and pixels within noise.
    pub fn same(&mut self, a: &Seen, b: &Seen, what: &str) {
        self.same_mean(a, b, what);
        let square = distance(a, b).powi(2);
        let explained = a.noise.powi(2) + b.noise.powi(2) + (2e-3 * a.mean().max(b.mean())).powi(2);
        let (found, allowed) = (square.sqrt(), explained.sqrt());
        let far = || format!("{what}: pixels {found:.4} apart, {allowed:.4} by noise");
        self.holds(square <= 2.0 * explained, far);
    }

    /// Checks that means are equal within four standard deviations.
    pub fn same_mean(&mut self, a: &Seen, b: &Seen, what: &str) {
        let (x, y) = (a.mean(), b.mean());
        let (sigma, most) = (a.sigma().hypot(b.sigma()), x.max(y));
        self.holds(most > 0.0, || format!("{what}: black"));
        let apart = (x - y).abs();
        self.holds(apart <= 4.0 * sigma + 5e-4 * most, || format!("{what}: {x:.5} and {y:.5}, σ {sigma:.5}"));
        let clear = sigma <= CLEAR * most || apart <= 0.4 * CLEAR * most;
        self.holds(clear, || format!("{what}: {x:.5} and {y:.5} are too noisy, σ {sigma:.5}"));
    }

    /// Checks that the mean has the expected value, within four standard deviations.
    pub fn is(&mut self, seen: &Seen, expected: f64, what: &str) {
        let (found, sigma) = (seen.mean(), seen.sigma());
        let close = (found - expected).abs() <= 4.0 * sigma + 2e-3 * expected;
        self.holds(close, || format!("{what}: {found:.5}, not {expected:.5}, σ {sigma:.5}"));
        let clear = !close || sigma < CLEAR * expected.max(0.1);
        self.holds(clear, || format!("{what}: {found:.5} is too noisy, σ {sigma:.5}"));
    }

    /// Checks that the image is black.
    pub fn dark(&mut self, seen: &Seen, what: &str) {
        self.holds(seen.mean() == 0.0, || format!("{what}: {:.5}, not 0", seen.mean()));
    }

    /// Checks that pixels are equal, except for rounding and rays that graze an edge.
    pub fn equal(&mut self, a: &Seen, b: &Seen, what: &str) {
        let scale = a.pixels.iter().chain(&b.pixels).map(|p| p.max_component()).fold(0.0, f32::max);
        self.holds(scale > 0.0, || format!("{what}: black"));
        let far = |(p, q): (&Rgb, &Rgb)| {
            p.to_array().iter().zip(q.to_array()).any(|(p, q)| (p - q).abs() > 1e-3 * scale)
        };
        let different = a.pixels.iter().zip(&b.pixels).filter(|pair| far(*pair)).count();
        let (x, y, all) = (a.mean(), b.mean(), a.pixels.len());
        let enough = different <= all / 64;
        self.holds(enough, || format!("{what}: {different} of {all} pixels differ, {x:.5} and {y:.5}"));
    }
}

/// The root mean square difference of pixels.
fn distance(a: &Seen, b: &Seen) -> f64 {
    let squares = a.pixels.iter().zip(&b.pixels).flat_map(|(p, q)| {
        let (p, q) = (p.to_array(), q.to_array());
        (0..3).map(move |c| (p[c] as f64 - q[c] as f64).powi(2))
    });
    (squares.sum::<f64>() / (3 * a.pixels.len()) as f64).sqrt()
}
