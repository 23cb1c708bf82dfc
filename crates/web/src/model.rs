//! What a page is made of, as plain data.

use steradian_gpu::scene::Scene;

/// A page.
#[derive(Debug, Clone)]
pub struct Page {
    /// Heading.
    pub title: String,
    /// The materials, in a line.
    pub subtitle: String,
    /// Name of the tone mapper ([`crate::TONE_MAPPERS`]).
    pub tone_mapper: String,
    /// Width and height of the pictures, pixels. The first view of the page shows what they show.
    pub size: [usize; 2],
    /// What the viewer turns around.
    pub at: [f32; 3],
    /// Does a ground keep the viewer above it?
    pub ground: bool,
    /// The techniques that can be chosen.
    pub techniques: Vec<Technique>,
    /// The lights that can be chosen, at least one.
    pub lights: Vec<Light>,
    /// Version of the program that makes the page.
    pub version: String,
}

/// A technique that can be chosen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Technique {
    /// Its name in commands.
    pub slug: String,
    /// Its title.
    pub title: String,
    /// Where it was published.
    pub source: String,
}

/// A light, and what each technique makes of it.
#[derive(Debug, Clone)]
pub struct Light {
    /// Its name.
    pub name: String,
    /// Exposure value of the pictures: radiance is multiplied by 2^`ev`.
    pub ev: f32,
    /// One per technique of the page; `None` where it refuses this light.
    pub variants: Vec<Option<Variant>>,
    /// The reference's picture.
    pub reference: Option<Reference>,
}

/// A technique under a light.
#[derive(Debug, Clone)]
pub struct Variant {
    /// Objects, backdrop and camera. All variants of a light have one backdrop, all variants of a page one
    /// camera.
    pub scene: Scene,
    /// The picture that the CPU renderer makes, as PNG.
    pub picture: Vec<u8>,
    /// The largest certified error of its materials, and how it is known.
    pub certificate: Option<(f64, String)>,
    /// How far the CPU's picture is from the reference.
    pub numbers: Option<Numbers>,
}

/// How far a picture is from the reference, over the pixels that surfaces cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    /// Relative RMS error of radiance.
    pub relative_rms: f64,
    /// Mean difference in photographic stops.
    pub stops: f64,
    /// Mean FLIP.
    pub flip: f64,
}

/// The reference's picture at the page's size.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Red, green, blue radiance and coverage, rows from the top.
    pub texels: Vec<[f32; 4]>,
    /// As PNG.
    pub picture: Vec<u8>,
}
