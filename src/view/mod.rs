//! `rayfront view`: a scene that is rendered, looked at, asked and edited at the same time.
//!
//! One thread renders: the first picture is small and of one sample, so that it is there at once; then come passes of
//! the whole image. Until a pixel has a sample, it shows the small picture, scaled up. Whoever wants something of it puts a wish into a queue, which stops the pass that is under way.
//! Files are looked at between passes. Other threads answer the page: all that they need of a picture they share
//! ([`viewer::Snapshot`]), so that no answer makes the rendering wait.
//!
//! What the page and the server say to each other, plain HTTP, each address with `token=`:
//!
//! | request | answer |
//! |---|---|
//! | `GET /`, `/page.js`, `/page.css` | the page |
//! | `GET /events` | server-sent events: the whole status, whenever there is news |
//! | `GET /status` | the same once, as JSON |
//! | `GET /image?layer=L&exposure=E&tonemap=T` | red, green, blue and 255 for each pixel, row by row from the top; size, samples and stops in `X-` headers |
//! | `GET /pixel?x=X&y=Y` | what is known of a pixel |
//! | `GET /explain?x=X&y=Y&sample=N` | a sample's paths, with their places in the image |
//! | `GET /photons?sample=N` | where a sample's photons end, with their places in the image |
//! | `POST /do` | a wish ([`request::ViewRequest`]) |

mod explanation;
mod photons;
pub mod picture;
pub mod request;
pub mod scene;
pub mod server;
mod status;
pub mod terminal;
pub mod tev;
pub mod viewer;
pub mod watched;
