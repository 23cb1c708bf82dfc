//! Conventions of other tools, by name. Nothing is guessed: a file without a profile is in Steradian's own
//! convention, and only an OpenEXR `envmap` attribute chooses a profile by itself.

use super::warp::{Affine, Kernel, warp};
use steradian_sphere::glam::{DMat3, DVec3};
use steradian_sphere::image::Filter;
use steradian_sphere::{Layout, SphereImage};

/// How a tool's files differ from our convention.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    /// The name that commands take.
    pub name: &'static str,
    /// One line: whose convention, and where it is written down.
    pub doc: &'static str,
    /// Takes a world direction to the direction under which our layout formulas find it in a lat-long file.
    latlong: DMat3,
    /// The same for a cube file.
    cube: DMat3,
    /// Which of the file's faces our face k is, once directions are converted.
    slots: [usize; 6],
    /// The outermost texel centres lie on the border: n texels span n − 1 steps.
    border_centred: bool,
    /// Angular maps: texel (i, j) stands for the lattice point, [`Layout::AngularLattice`].
    lattice: bool,
    /// Paraboloid files: the file's border lies at this distance from the centre, where ours lies at 1.
    overscan: f64,
    /// Paraboloid files: signs of s and t of the front and the back face.
    paraboloid: [[f64; 2]; 2],
}

const fn diagonal(x: f64, y: f64, z: f64) -> DMat3 {
    DMat3::from_cols(DVec3::new(x, 0.0, 0.0), DVec3::new(0.0, y, 0.0), DVec3::new(0.0, 0.0, z))
}

/// world = (−d.z, d.y, d.x) for d in our lat-long formula, so d = (z, y, −x): the centre looks to +Z and its
/// left edge is reached over +X.
const CENTRE_Z: DMat3 =
    DMat3::from_cols(DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 1.0, 0.0), DVec3::new(1.0, 0.0, 0.0));

/// d = (−z, y, x): the centre looks to −Z, and +X is to its right.
const CENTRE_MINUS_Z: DMat3 =
    DMat3::from_cols(DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 0.0), DVec3::new(-1.0, 0.0, 0.0));

const OWN: Profile = Profile {
    name: "steradian",
    doc: "our own convention: lat-long centre +X, Khronos cube, probes look to -Z",
    latlong: DMat3::IDENTITY,
    cube: DMat3::IDENTITY,
    slots: [0, 1, 2, 3, 4, 5],
    border_centred: false,
    lattice: false,
    overscan: 1.0,
    paraboloid: [[1.0, 1.0]; 2],
};

/// Every profile that files can be read with.
pub static PROFILES: &[Profile] = &[
    OWN,
    Profile {
        name: "openexr",
        doc: "OpenEXR environment maps (ImfEnvmap.h): longitude 0 is +Z, pi/2 is +X; outermost pixels on the border",
        latlong: CENTRE_Z,
        cube: diagonal(1.0, 1.0, -1.0),
        slots: [0, 1, 2, 3, 5, 4],
        border_centred: true,
        ..OWN
    },
    Profile {
        name: "usd",
        doc: "USD DomeLight (Y up): lat-long centre +Z, longitude pi/2 is +X",
        latlong: CENTRE_Z,
        ..OWN
    },
    Profile {
        name: "debevec",
        doc: "Debevec's light probes, texels at lattice points as in prefilter.c; the centre looks to -Z, +X right, +Y up",
        lattice: true,
        ..OWN
    },
    Profile {
        name: "debevec-paraboloid",
        doc: "probes resampled to paraboloid pairs with overscan 1.2: front upside down, back mirrored",
        overscan: 1.2,
        paraboloid: [[1.0, -1.0], [-1.0, 1.0]],
        ..OWN
    },
    Profile {
        name: "cmgen",
        doc: "Filament's cmgen: lat-long centre +Z, scaled by (w-1)/(h-1); cubes as ours",
        latlong: CENTRE_Z,
        border_centred: true,
        ..OWN
    },
    Profile { name: "filament", doc: "cubes that Filament looks up by the world direction: as ours", ..OWN },
    Profile {
        name: "cmft",
        doc: "cmft: a left-handed world (D3D); its +Z is our -Z",
        latlong: CENTRE_MINUS_Z,
        cube: diagonal(1.0, 1.0, -1.0),
        ..OWN
    },
    Profile {
        name: "three",
        doc: "three.js: lat-long as ours; cubes are looked up with (-x, y, z)",
        cube: diagonal(-1.0, 1.0, 1.0),
        ..OWN
    },
    Profile {
        name: "bevy",
        doc: "Bevy: cubes are looked up with (x, y, -z)",
        cube: diagonal(1.0, 1.0, -1.0),
        ..OWN
    },
    Profile {
        name: "gltf",
        doc: "glTF EXT_lights_image_based: each face flipped about its vertical axis",
        cube: diagonal(-1.0, 1.0, 1.0),
        slots: [1, 0, 2, 3, 4, 5],
        ..OWN
    },
    Profile { name: "khronos", doc: "glTF-IBL-Sampler: lat-long and cubes as ours", ..OWN },
    Profile {
        name: "blender",
        doc: "Blender Cycles with (x, y, z) = (x, z, -y) of its Z-up world: as ours",
        ..OWN
    },
    Profile {
        name: "godot",
        doc: "Godot 4: lat-long u = atan2(x, -z)/2pi, so that the centre looks to +Z; cubes as ours",
        latlong: CENTRE_Z,
        ..OWN
    },
    Profile {
        name: "unreal",
        doc: "Unreal with (X, Y, Z) = (x, z, y) of our world: lat-long centre -Z; cubes are looked up with (x, z, y)",
        latlong: CENTRE_MINUS_Z,
        cube: DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y),
        ..OWN
    },
    Profile {
        name: "babylon",
        doc: "Babylon.js in a right-handed scene: lat-long as ours; cubes are looked up with (x, y, -z)",
        cube: diagonal(1.0, 1.0, -1.0),
        ..OWN
    },
    Profile {
        name: "playcanvas",
        doc: "PlayCanvas: lat-long u = 0.5 + atan2(-x, z)/2pi, so that the centre looks to +Z; cubes are looked up with (-x, y, z)",
        latlong: CENTRE_Z,
        cube: diagonal(-1.0, 1.0, 1.0),
        ..OWN
    },
    Profile {
        name: "unity",
        doc: "Unity with (X, Y, Z) = (-x, y, z) of our world: lat-long u = 0.5 - atan2(Z, X)/2pi, so that the centre looks to -X; cubes are looked up with (-x, y, z)",
        latlong: diagonal(-1.0, 1.0, -1.0),
        cube: diagonal(-1.0, 1.0, 1.0),
        ..OWN
    },
];

impl Profile {
    /// The profile of a name; `-` and `_` are the same.
    pub fn find(name: &str) -> Option<&'static Self> {
        let name = name.to_ascii_lowercase().replace('_', "-");
        PROFILES.iter().find(|p| p.name == name)
    }

    /// The profile of a name; the error lists the known ones.
    pub fn parse(name: &str) -> Result<&'static Self, String> {
        let known: Vec<&str> = PROFILES.iter().map(|p| p.name).collect();
        Self::find(name).ok_or_else(|| steradian_base::unknown("profile", name, &known))
    }

    /// Takes a world direction to the direction under which our layout formulas find it in a lat-long file.
    pub fn latlong(&self) -> DMat3 {
        self.latlong
    }

    /// Our own convention.
    pub fn own() -> &'static Self {
        &PROFILES[0]
    }

    /// Debevec's probes.
    pub fn debevec() -> &'static Self {
        &PROFILES[3]
    }

    /// OpenEXR's.
    pub fn openexr() -> &'static Self {
        &PROFILES[1]
    }

    /// Turns pixels in the tool's convention into an image over our world. Untouched (moved, not copied)
    /// where the conventions agree; texels that only change places keep their values; where they come to lie
    /// between texels, light that is nowhere negative stays so (bilinear, and in border-centred faces bicubic
    /// where neighbours differ little). Only paraboloids with overscan are bicubic throughout.
    pub fn import(&self, mut image: SphereImage) -> SphereImage {
        if self.lattice && image.layout == Layout::AngularMap {
            image.layout = Layout::AngularLattice;
        }
        let image = self.straighten(image);
        let (axes, slots) = match image.layout {
            Layout::LatLong => (self.latlong, OWN.slots),
            Layout::Cube => (self.cube, self.slots),
            _ => return image,
        };
        let image = reorder(image, slots);
        if axes == DMat3::IDENTITY {
            return image;
        }
        let (layout, w, h) = (image.layout, image.width, image.height);
        turned_cube(&image, axes)
            .unwrap_or_else(|| SphereImage::from_fn(layout, w, h, |d| moved(&image, axes * d)))
    }

    /// The reverse of [`Self::import`] for tools whose texels lie at the centres of cells: an image over our
    /// world as the tool's file holds it. Texels change places only (of a lat-long image where its width is a
    /// multiple of four).
    pub fn export(&self, image: &SphereImage) -> SphereImage {
        let (layout, w, h) = (image.layout, image.width, image.height);
        let (axes, slots) = match layout {
            Layout::LatLong => (self.latlong, OWN.slots),
            Layout::Cube => (self.cube, self.slots),
            _ => return image.clone(),
        };
        let back = axes.transpose();
        let out = if axes == DMat3::IDENTITY {
            image.clone()
        } else if layout == Layout::Cube || w % 4 == 0 {
            turned_cube(image, back)
                .unwrap_or_else(|| SphereImage::from_fn(layout, w, h, |d| image.nearest(back * d)))
        } else {
            image.rotate(axes)
        };
        let mut places = OWN.slots;
        slots.iter().enumerate().for_each(|(k, &slot)| places[slot] = k);
        reorder(out, places)
    }

    /// Does [`Self::import`] make texels from several ones?
    pub(super) fn interpolates(&self, layout: Layout) -> bool {
        match layout {
            Layout::LatLong => self.border_centred || self.latlong != DMat3::IDENTITY,
            Layout::Cube => self.border_centred,
            Layout::DualParaboloid => self.overscan != 1.0,
            _ => false,
        }
    }

    /// Undoes what happens inside each face: border-centred texels, overscan, flips.
    fn straighten(&self, image: SphereImage) -> SphereImage {
        let (w, h) = (image.width as f64, image.height as f64);
        let border = |n: f64, sign: f64| Affine { scale: sign * (n - 1.0) / n, shift: 0.5 * n };
        match image.layout {
            Layout::LatLong | Layout::Cube if self.border_centred => {
                warp(&image, Kernel::Limited, |_| (border(w, 1.0), border(h, 1.0)))
            }
            Layout::DualParaboloid if self.overscan != 1.0 || self.paraboloid != OWN.paraboloid => {
                warp(&image, Kernel::Cubic, |face| {
                    let [s, t] = self.paraboloid[face];
                    let k = 1.0 / self.overscan;
                    (Affine { scale: s * k, shift: 0.5 * w }, Affine { scale: t * k, shift: 0.5 * h })
                })
            }
            _ => image,
        }
    }
}

/// The cube `image` seen through `axes` (target direction → source direction) where these are axes of the
/// cube: texels change places, a face at a time. (At 512² texels a face a lookup for each took 0.1 processor
/// seconds.)
fn turned_cube(image: &SphereImage, axes: DMat3) -> Option<SphereImage> {
    let n = image.width;
    let signed = axes.to_cols_array().iter().all(|v| [-1.0, 0.0, 1.0].contains(v));
    if image.layout != Layout::Cube || image.height != n || n == 0 || !signed {
        return None;
    }
    let mut out = SphereImage::new(Layout::Cube, n, n);
    for face in 0..6 {
        // Where three corners come from tells where all texels do.
        let from = |i: usize, j: usize| {
            let (face, i, j) = image.texel_of(axes * image.layout.texel_direction(n, n, face, i, j)?);
            Some((face, [i as i64, j as i64]))
        };
        let (source, corner) = from(0, 0)?;
        let last = (n - 1).max(1) as i64;
        let step = |to: [i64; 2]| [0, 1].map(|k| (to[k] - corner[k]) / last);
        let (right, down) = (step(from(n - 1, 0)?.1), step(from(0, n - 1)?.1));
        let index = |[i, j]: [i64; 2]| j * n as i64 + i;
        let (first, right, down) = (index(corner), index(right), index(down));
        for (to, plane) in out.planes.iter_mut().zip(&image.planes) {
            let (to, plane) = (&mut to[face * n * n..][..n * n], &plane[source * n * n..][..n * n]);
            for (j, row) in to.chunks_mut(n).enumerate() {
                let start = first + j as i64 * down;
                for (i, to) in row.iter_mut().enumerate() {
                    *to = plane[(start + i as i64 * right) as usize];
                }
            }
        }
    }
    Some(out)
}

/// The texel whose centre `d` is, or bilinear between texels.
fn moved(image: &SphereImage, d: DVec3) -> [f32; 3] {
    let at = image.position(d);
    let centred = |v: f64| (v - v.floor() - 0.5).abs() < 1e-6;
    if centred(at.x) && centred(at.y) {
        return image.nearest(d);
    }
    image.lookup(Filter::Bilinear, d)
}

/// Puts the file's face `slots[k]` at place k.
fn reorder(mut image: SphereImage, slots: [usize; 6]) -> SphereImage {
    if image.layout != Layout::Cube || slots == OWN.slots {
        return image;
    }
    let n = image.width * image.height;
    for plane in &mut image.planes {
        let old = std::mem::take(plane);
        *plane = slots.iter().flat_map(|&s| &old[s * n..(s + 1) * n]).copied().collect();
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels that change places a face at a time are those found one by one, both ways, for every profile.
    #[test]
    fn cubes_are_turned_as_their_texels_are() {
        for n in [1, 2, 5] {
            let mut cube = SphereImage::new(Layout::Cube, n, n);
            cube.planes.iter_mut().flatten().enumerate().for_each(|(k, v)| *v = k as f32);
            for profile in PROFILES {
                for axes in [profile.cube, profile.cube.transpose()] {
                    let turned = turned_cube(&cube, axes).expect("axes of the cube");
                    let one_by_one = SphereImage::from_fn(Layout::Cube, n, n, |d| moved(&cube, axes * d));
                    assert_eq!(turned, one_by_one, "{} {n}", profile.name);
                }
            }
            let quarter = DMat3::from_rotation_y(0.3);
            assert_eq!(turned_cube(&cube, quarter), None);
        }
    }
}
