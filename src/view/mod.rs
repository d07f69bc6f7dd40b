//! `rayfront view`: renders a scene in a browser page where it can be inspected and edited while it renders.
//!
//! One thread renders: first a small image of one sample per pixel, so that something is visible immediately; then
//! passes over the whole image. A pixel without a sample shows the small image, scaled up. Requests go into a queue and
//! stop the current pass. Another thread checks the scene's files for changes. The server's threads read only shared
//! data of the image ([`viewer::Snapshot`]), so that no request delays the rendering.
//!
//! The protocol between page and server is plain HTTP; each address carries `token=`:
//!
//! | request | response |
//! |---|---|
//! | `GET /`, `/page.js`, `/page.css` | the page |
//! | `GET /events` | server-sent events: the whole status, after every change |
//! | `GET /status` | the current status as JSON |
//! | `GET /image?layer=L&exposure=E&tonemap=T` | red, green, blue, opacity per pixel, top row first; headers `X-…`; nothing before the first image |
//! | `GET /image.exr?layer=L` | an OpenEXR file |
//! | `POST /reference?name=F`, `GET /reference?exposure=E&tonemap=T` | takes the bytes of an image to compare with; shows it as `/image` does |
//! | `GET /command?layer=L&exposure=E&tonemap=T&mix=M` | the command that renders the image; with a mix, also the one that mixes its film |
//! | `GET /values?layer=L&x0=…&y0=…&x1=…&y1=…` | the numbers of a layer's pixels in a region |
//! | `GET /outline?entity=NAME` | a byte per pixel: 1 at the entity's border, 2 just outside it |
//! | `GET /boxes?level=N` | the boxes of the tree at a level, as lines in the image |
//! | `GET /steps?x=X&y=Y` | the stages of a wave of the pixels around a place, with the rays in the image |
//! | `GET /pixel?x=X&y=Y` | the values of a pixel |
//! | `GET /explain?x=X&y=Y&sample=N` | a sample's paths, with their positions in the image |
//! | `GET /photons?sample=N` | the end points of a sample's photons, with their positions in the image |
//! | `POST /do` | carries out a request ([`request::ViewRequest`]) |

mod boxes;
mod camera;
mod costs;
mod edits;
mod explanation;
mod forms;
mod id_colors;
pub mod layer_image;
mod lines;
mod mix;
mod photons;
pub mod picture;
pub mod request;
pub mod scene;
pub mod server;
mod status;
mod steps;
pub mod terminal;
pub mod tev;
pub mod viewer;
mod wanted_image;
pub mod watched;

pub use status::json_of;
