//! Pages for browsers: a scene under several lights, shaded by several techniques, with the CPU's pictures of
//! its first view.

#[cfg(feature = "web")]
mod page;

use crate::{Error, Method, Outcome, Scene, Session};
use std::path::Path;
use steradian_light::Lights;

/// Why a build without the feature `web` fails.
const WITHOUT: &str = "this build writes no pages: build with --features web";

/// Contents of a page.
pub struct Request {
    /// Geometry, materials, camera, and the size of the pictures. Its lights are ignored.
    pub scene: Scene,
    /// Lights by name, at least one.
    pub lights: Vec<(String, Lights)>,
    /// Techniques to choose from, each for the materials that it accepts; where empty, those of the scene.
    pub methods: Vec<Method>,
    /// The reference for the heat map and the errors.
    pub truth: Truth,
    /// Heading.
    pub title: String,
}

/// The reference that techniques are compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// Nothing.
    None,
    /// The lighting integral, to a relative error at each point.
    Integral(f64),
    /// The path tracer ([`Session::paths`]).
    Paths,
}

/// A page that was written.
pub struct Written {
    /// Names and bytes of its files.
    pub files: Vec<(String, usize)>,
    /// Techniques and lights of its variants, and their errors.
    pub variants: Vec<(String, String, Option<f64>)>,
}

impl Session {
    /// Bakes the contents of a page and writes it to a folder. Where the scene has a tolerance, the
    /// certificates are compared with it. Without the feature `web` it fails.
    pub fn export_web(&mut self, request: &Request, folder: &Path) -> Result<Outcome<Written>, Error> {
        #[cfg(feature = "web")]
        return self.write_page(request, folder);
        #[cfg(not(feature = "web"))]
        {
            let _ = (request, folder);
            Err(Error::failed(WITHOUT))
        }
    }

    /// Fails where this build cannot write pages. To be called before the work.
    pub fn check_web(&self) -> Result<(), Error> {
        match cfg!(feature = "web") {
            true => Ok(()),
            false => Err(Error::failed(WITHOUT)),
        }
    }
}
