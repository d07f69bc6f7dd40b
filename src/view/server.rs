//! The HTTP server of the page, only for browsers on this machine.
//!
//! Four measures keep others out. The server listens on the loopback interface only. It refuses requests for another
//! host name (such as those of a foreign page whose name resolves to this machine), and requests whose origin is
//! another page, which browsers report. And every address contains a token known only to the user who started the
//! program. No request names a file. A request that is not received completely within seconds is dropped.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::Path;
use std::str::FromStr;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, FromRequest, Query, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::time::{sleep, timeout};
use tokio_stream::wrappers::WatchStream;
use tokio_stream::{Stream, StreamExt};

use super::boxes::boxes;
use super::explanation::explanation;
use super::mix;
use super::photons::photons_of;
use super::picture::{Display, Layer, PageImage, exr, light, outline, picture, pixel, values};
use super::request::ViewRequest;
use super::steps::steps;
use super::viewer::Viewer;
use super::wanted_image::WantedImage;
use crate::film::exposure::LightMeter;
use crate::formats::picture as files;
use crate::math::Rgb;
use crate::simd::give_back_freed;
use crate::study::explain::Recipe;

const PAGE: &str = include_str!("page/index.html");
/// One script in several files; the last one starts the page.
const SCRIPT: &str = concat!(
    include_str!("page/page.js"),
    include_str!("page/explanation.js"),
    include_str!("page/zoom.js"),
    include_str!("page/boxes.js"),
    include_str!("page/steps.js"),
    include_str!("page/compare.js"),
    include_str!("page/forms.js"),
    include_str!("page/time.js"),
    include_str!("page/start.js"),
);
const STYLE: &str = include_str!("page/page.css");

/// The port that is tried first, so that the address usually stays the same.
const USUAL_PORT: u16 = 8421;
/// The shortest interval between two status events.
const NEWS: Duration = Duration::from_millis(15);
/// Timeout for the head of a request, and for its body.
const PATIENCE: Duration = Duration::from_secs(5);
/// Timeout for a file.
const UPLOAD: Duration = Duration::from_secs(60);
/// The largest file of an image to compare with, in bytes.
const MOST_BYTES: usize = 1 << 28;
/// The delay before the next attempt after a connection could not be accepted, for example because of too many open
/// files.
const AGAIN: Duration = Duration::from_millis(500);

/// A page that is ready to be served.
pub struct Server {
    listener: TcpListener,
    token: String,
}

/// The commands that repeat in a terminal what the page shows.
#[derive(Clone, Copy)]
pub struct MakeCommands {
    /// Explains a sample of a pixel.
    pub explain: fn(&Recipe, [u32; 2], u32) -> String,
    /// Renders the finished image, with its light groups mixed by statements; true: without its noise.
    pub render: fn(&Recipe, Display, &[String], bool) -> String,
}

struct Site {
    viewer: Arc<Viewer>,
    /// The image that the page compares with, and its size.
    reference: Mutex<Arc<(Vec<Rgb>, [u32; 2])>>,
    token: String,
    commands: MakeCommands,
}

impl Server {
    /// Listens on a port of the loopback interface; 0 selects the usual port, or any free one if that is taken.
    pub fn new(port: u16) -> std::io::Result<Server> {
        let at = |port: u16| TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
        let listener = if port == 0 { at(USUAL_PORT).or_else(|_| at(0))? } else { at(port)? };
        listener.set_nonblocking(true)?;
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(|error| std::io::Error::other(error.to_string()))?;
        Ok(Server { listener, token: bytes.iter().map(|byte| format!("{byte:02x}")).collect() })
    }

    /// The page's address.
    pub fn address(&self) -> std::io::Result<String> {
        let port = self.listener.local_addr()?.port();
        Ok(format!("http://127.0.0.1:{port}/?token={}", self.token))
    }

    /// Serves until the process ends.
    pub fn serve(self, viewer: Arc<Viewer>, commands: MakeCommands) -> std::io::Result<()> {
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().max_blocking_threads(32).build()?;
        let site = Arc::new(Site { viewer, reference: Mutex::default(), token: self.token, commands });
        let router = Router::new()
            .route("/", get(page))
            .route("/page.js", get(script))
            .route("/page.css", get(style))
            .route("/events", get(events))
            .route("/status", get(status))
            .route("/image", get(image))
            .route("/image.exr", get(exr_file))
            .route("/command", get(command))
            .route("/values", get(some_values))
            .route("/outline", get(outline_of))
            .route("/pixel", get(one_pixel))
            .route("/explain", get(explain))
            .route("/photons", get(photons))
            .route("/boxes", get(boxes_at))
            .route("/steps", get(steps_at))
            .route("/do", post(carry_out))
            .route("/reference", post(take_reference).get(reference).layer(DefaultBodyLimit::max(MOST_BYTES)))
            .layer(from_fn_with_state(site.clone(), guard))
            // Browsers request it for every page.
            .route("/favicon.ico", get(|| async { StatusCode::NO_CONTENT }))
            .with_state(site);
        runtime.block_on(async move {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            loop {
                let Ok((stream, _)) = listener.accept().await else {
                    sleep(AGAIN).await;
                    continue;
                };
                let mut http = http1::Builder::new();
                http.timer(TokioTimer::new()).header_read_timeout(PATIENCE);
                let service = TowerToHyperService::new(router.clone());
                tokio::spawn(http.serve_connection(TokioIo::new(stream), service));
            }
        })
    }
}

#[derive(Deserialize)]
struct AccessToken {
    token: Option<String>,
}

/// Refuses requests without the token, for a host other than this machine, or from another page.
async fn guard(
    State(site): State<Arc<Site>>,
    Query(AccessToken { token }): Query<AccessToken>,
    request: Request,
    next: Next,
) -> Response {
    if !is_loopback(request.headers()) {
        return refuse(StatusCode::FORBIDDEN, "this is for localhost alone");
    }
    if !is_own_page(request.headers()) {
        return refuse(StatusCode::FORBIDDEN, "this is for the page that is served here");
    }
    if token.as_deref() != Some(&site.token) {
        return refuse(StatusCode::FORBIDDEN, "the token in the address is wrong: see the terminal");
    }
    let mut response = next.run(request).await;
    let fixed = [
        (header::CACHE_CONTROL, "no-store"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CONTENT_SECURITY_POLICY, "default-src 'self'; frame-ancestors 'none'"),
    ];
    for (name, value) in fixed {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// True if the request's origin is this page, or is not given.
fn is_own_page(headers: &HeaderMap) -> bool {
    let host = headers.get(header::HOST).map(HeaderValue::as_bytes);
    let page = |origin: &HeaderValue| origin.as_bytes().strip_prefix(b"http://").map(<[u8]>::to_vec);
    headers.get_all(header::ORIGIN).iter().all(|origin| page(origin).as_deref() == host && host.is_some())
}

/// True if the `Host` header names the loopback interface, on any port: a forwarded port differs.
fn is_loopback(headers: &HeaderMap) -> bool {
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    ["localhost", "127.0.0.1", "[::1]"].contains(&name)
}

fn refuse(code: StatusCode, reason: &str) -> Response {
    (code, axum::Json(json!({"error": reason}))).into_response()
}

async fn page(State(site): State<Arc<Site>>) -> Html<String> {
    Html(PAGE.replace("{token}", &site.token))
}

async fn script() -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/javascript; charset=utf-8")], SCRIPT)
}

async fn style() -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/css; charset=utf-8")], STYLE)
}

/// Sends the whole status now and after every change.
async fn events(State(site): State<Arc<Site>>) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let news = WatchStream::new(site.viewer.news()).throttle(NEWS);
    let events = news.map(move |_| Ok(Event::default().data(site.viewer.status().to_string())));
    Sse::new(events).keep_alive(KeepAlive::default())
}

/// Returns the status.
async fn status(State(site): State<Arc<Site>>) -> axum::Json<Value> {
    axum::Json(site.viewer.status())
}

async fn image(State(site): State<Arc<Site>>, Query(wanted): Query<WantedImage>) -> Response {
    let ((layer, display), factors) = match wanted.read().and_then(|read| Ok((read, wanted.factors()?))) {
        Ok(read) => read,
        Err(reason) => return refuse(StatusCode::BAD_REQUEST, &reason),
    };
    if site.viewer.serial() == 0 {
        // Nothing is rendered yet: an image of nothing would be black.
        return StatusCode::NO_CONTENT.into_response();
    }
    let made = aside(move || {
        let (serial, shown) = (site.viewer.serial(), site.viewer.shown());
        let picture = picture(&shown, layer, display, &factors);
        if layer == Layer::Denoised {
            // Denoising takes hundreds of bytes per pixel.
            give_back_freed();
        }
        (serial, shown.gathered.film.samples_per_pixel(), picture)
    });
    let Some((serial, samples, picture)) = made.await else {
        return refuse(StatusCode::INTERNAL_SERVER_ERROR, "the picture could not be made");
    };
    let headers = [("x-samples", format!("{samples:.2}")), ("x-serial", serial.to_string())];
    (headers, in_response(picture)).into_response()
}

/// The pixels of an image, and what is known of it.
fn in_response(image: PageImage) -> Response {
    let PageImage { size: [width, height], pixels, exposure_ev, bar, is_denoised } = image;
    let headers = [
        ("content-type", "application/octet-stream".to_owned()),
        ("x-width", width.to_string()),
        ("x-height", height.to_string()),
        ("x-exposure", exposure_ev.to_string()),
        ("x-bar", json!(bar).to_string()),
        ("x-denoised", is_denoised.to_string()),
    ];
    (headers, pixels).into_response()
}

#[derive(Deserialize)]
struct FileName {
    name: String,
}

/// Takes the bytes of an image to compare with. Its name only tells its format; no file is opened.
async fn take_reference(
    State(site): State<Arc<Site>>,
    Query(FileName { name }): Query<FileName>,
    request: Request,
) -> Response {
    let bytes = match timeout(UPLOAD, Bytes::from_request(request, &())).await {
        Ok(Ok(bytes)) => bytes,
        Ok(Err(error)) => return error.into_response(),
        Err(_) => return refuse(StatusCode::REQUEST_TIMEOUT, "the file did not come whole"),
    };
    let read = aside(move || files::linear(&bytes, Path::new(&name)).map_err(|error| error.to_string()));
    match read.await {
        Some(Ok((width, height, pixels))) => {
            let mut kept = site.reference.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            *kept = Arc::new((pixels, [width, height]));
            axum::Json(json!({"ok": true})).into_response()
        }
        Some(Err(reason)) => refuse(StatusCode::BAD_REQUEST, &reason),
        None => refuse(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be read"),
    }
}

/// Returns the image to compare with, displayed like the rendered one.
async fn reference(State(site): State<Arc<Site>>, Query(wanted): Query<WantedImage>) -> Response {
    let display = match wanted.read() {
        Ok((_, display)) => display,
        Err(reason) => return refuse(StatusCode::BAD_REQUEST, &reason),
    };
    let kept = site.reference.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).clone();
    let (radiance, size) = &*kept;
    if radiance.is_empty() {
        return StatusCode::NO_CONTENT.into_response();
    }
    let image =
        files::ImagePixels { radiance: radiance.into(), alpha: None, transparency: None, behind: None };
    in_response(light(&image, &LightMeter::of_pixels(*size, radiance), *size, display))
}

/// Returns an OpenEXR file.
async fn exr_file(State(site): State<Arc<Site>>, Query(wanted): Query<WantedImage>) -> Response {
    let (layer, factors) = match wanted.read().and_then(|(layer, _)| Ok((layer, wanted.factors()?))) {
        Ok(read) => read,
        Err(reason) => return refuse(StatusCode::BAD_REQUEST, &reason),
    };
    let made = aside(move || {
        let made = exr(&site.viewer.shown(), layer == Layer::Denoised, &factors);
        give_back_freed();
        made
    });
    match made.await {
        Some(Ok(bytes)) => ([("content-type", "image/x-exr")], bytes).into_response(),
        Some(Err(reason)) => refuse(StatusCode::CONFLICT, &reason),
        None => refuse(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made"),
    }
}

/// Returns the command that renders the image, and mixes its light groups.
async fn command(State(site): State<Arc<Site>>, Query(wanted): Query<WantedImage>) -> Response {
    let ((layer, display), factors) = match wanted.read().and_then(|read| Ok((read, wanted.factors()?))) {
        Ok(read) => read,
        Err(reason) => return refuse(StatusCode::BAD_REQUEST, &reason),
    };
    let shown = site.viewer.shown();
    let mix = mix::statements(shown.setup.light_group_names(), &factors);
    let command = (site.commands.render)(&shown.recipe, display, &mix, layer == Layer::Denoised);
    axum::Json(json!({"command": command})).into_response()
}

#[derive(Deserialize)]
struct WantedValues {
    layer: String,
    x0: u32,
    y0: u32,
    x1: u32,
    y1: u32,
}

async fn some_values(State(site): State<Arc<Site>>, Query(wanted): Query<WantedValues>) -> Response {
    let WantedValues { layer, x0, y0, x1, y1 } = wanted;
    let layer = match Layer::from_str(&layer) {
        Ok(layer) => layer,
        Err(reason) => return refuse(StatusCode::BAD_REQUEST, &reason),
    };
    let region = [x0, y0, x1, y1];
    let found = aside(move || values(&site.viewer.shown(), layer, region)).await.flatten();
    found.map_or_else(|| StatusCode::NO_CONTENT.into_response(), |found| axum::Json(found).into_response())
}

#[derive(Deserialize)]
struct WantedOutline {
    entity: String,
}

async fn outline_of(State(site): State<Arc<Site>>, Query(wanted): Query<WantedOutline>) -> Response {
    let WantedOutline { entity } = wanted;
    match aside(move || outline(&site.viewer.shown(), &entity)).await.flatten() {
        Some(([width, height], bytes)) => {
            let headers = [("x-width", width.to_string()), ("x-height", height.to_string())];
            (headers, bytes).into_response()
        }
        None => refuse(StatusCode::NOT_FOUND, "there is no such entity"),
    }
}

#[derive(Deserialize)]
struct Place {
    x: u32,
    y: u32,
    sample: Option<u32>,
}

async fn one_pixel(State(site): State<Arc<Site>>, Query(Place { x, y, .. }): Query<Place>) -> Response {
    answer(aside(move || pixel(&site.viewer.shown(), [x, y])).await.flatten())
}

async fn explain(State(site): State<Arc<Site>>, Query(Place { x, y, sample }): Query<Place>) -> Response {
    let explained = aside(move || {
        let shown = site.viewer.shown();
        let mut explained = explanation(&shown, [x, y], sample.unwrap_or(0))?;
        explained["generation"] = json!(shown.generation);
        let sample = explained["sample"].as_u64().unwrap_or_default() as u32;
        let command = (site.commands.explain)(&shown.recipe, [x, y], sample);
        explained["command"] = json!(command);
        Some(explained)
    });
    answer(explained.await.flatten())
}

#[derive(Deserialize)]
struct Which {
    sample: Option<u32>,
}

async fn photons(State(site): State<Arc<Site>>, Query(Which { sample }): Query<Which>) -> Response {
    overlay(aside(move || photons_of(&site.viewer.shown(), sample.unwrap_or(0))).await)
}

#[derive(Deserialize)]
struct WantedLevel {
    level: usize,
}

async fn boxes_at(State(site): State<Arc<Site>>, Query(wanted): Query<WantedLevel>) -> Response {
    overlay(aside(move || boxes(&site.viewer.shown(), wanted.level)).await)
}

async fn steps_at(State(site): State<Arc<Site>>, Query(Place { x, y, .. }): Query<Place>) -> Response {
    overlay(aside(move || steps(&site.viewer.shown(), [x, y])).await)
}

/// Returns what is drawn over the image.
fn overlay(found: Option<Value>) -> Response {
    let failed =
        || refuse(StatusCode::INTERNAL_SERVER_ERROR, "what is drawn over the image could not be made");
    found.map_or_else(failed, |found| axum::Json(found).into_response())
}

fn answer(found: Option<Value>) -> Response {
    match found {
        Some(found) => axum::Json(found).into_response(),
        None => refuse(StatusCode::NOT_FOUND, "there is no such pixel"),
    }
}

async fn carry_out(State(site): State<Arc<Site>>, request: Request) -> Response {
    let body = match timeout(PATIENCE, String::from_request(request, &())).await {
        Ok(Ok(body)) => body,
        Ok(Err(error)) => return error.into_response(),
        Err(_) => return refuse(StatusCode::REQUEST_TIMEOUT, "the wish did not come whole"),
    };
    let wish: ViewRequest = match serde_json::from_str(&body) {
        Ok(wish) => wish,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error.to_string()),
    };
    match aside(move || site.viewer.command(wish)).await {
        Some(Ok(said)) => axum::Json(json!({"ok": true, "said": said})).into_response(),
        Some(Err(reason)) => refuse(StatusCode::BAD_REQUEST, &reason),
        None => refuse(StatusCode::INTERNAL_SERVER_ERROR, "it could not be done"),
    }
}

/// Runs slow work on a thread of its own; none if it failed.
async fn aside<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    tokio::task::spawn_blocking(work).await.ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_loopback_accepts_only_names_of_this_machine() {
        let is_ours = |host: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_str(host).unwrap());
            is_loopback(&headers)
        };
        for ours in ["localhost", "localhost:8421", "127.0.0.1:9", "[::1]:80", "[::1]"] {
            assert!(is_ours(ours), "{ours}");
        }
        let others =
            ["", "example.org", "127.0.0.1.example.org", "localhost.example.org:80", "10.0.0.1:8421"];
        for other in others {
            assert!(!is_ours(other), "{other}");
        }
        assert!(!is_loopback(&HeaderMap::new()));
    }

    #[test]
    fn is_own_page_rejects_other_origins() {
        let is_own = |origins: &[&str]| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_static("localhost:8421"));
            for origin in origins {
                headers.append(header::ORIGIN, HeaderValue::from_str(origin).unwrap());
            }
            is_own_page(&headers)
        };
        assert!(is_own(&[]) && is_own(&["http://localhost:8421"]));
        let others = ["null", "", "http://localhost", "http://localhost:80", "https://localhost:8421"];
        for other in others.into_iter().chain(["http://evil.example", "http://localhost:8421.evil.example"]) {
            assert!(!is_own(&[other]) && !is_own(&["http://localhost:8421", other]), "{other}");
        }
    }
}
