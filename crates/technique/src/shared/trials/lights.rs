//! Lights by formula, for claims and tests: small, without files.

use glam::{DVec3, Vec3};
use steradian_light::{DirectionalLight, DiskLight, Environment, Lights, PointLight};
use steradian_sphere::{Layout, SphereImage};

fn image(width: usize, f: impl Fn(DVec3) -> [f32; 3] + Sync) -> Lights {
    Lights::from(Environment { image: SphereImage::from_fn(Layout::LatLong, width, width / 2, f) })
}

/// Radiance 1 from everywhere: the white furnace.
pub fn furnace() -> Lights {
    image(64, |_| [1.0; 3])
}

/// Radiance of order 2 in spherical harmonics: a polynomial of degree 2.
pub fn quadratic() -> Lights {
    image(256, |d| {
        let (x, y, z) = (d.x as f32, d.y as f32, d.z as f32);
        [1.0 + 0.5 * y + 0.3 * x * z, 0.8 + 0.2 * x + 0.3 * y * y, 1.2 + 0.4 * z - 0.3 * x * y]
    })
}

/// A smooth sky with a horizon: brighter above, blue, with a broad bright side.
pub fn smooth() -> Lights {
    image(256, sky)
}

fn sky(d: DVec3) -> [f32; 3] {
    let glow = (3.0 * (d.dot(DVec3::new(0.6, 0.5, 0.62)) - 1.0)).exp();
    let up = 0.5 + 0.5 * (2.0 * d.y).tanh();
    [0.15 + 0.35 * up + 2.0 * glow, 0.12 + 0.5 * up + 1.7 * glow, 0.1 + 0.9 * up + 1.2 * glow]
        .map(|x| x as f32)
}

/// A dark room with soft boxes: sharp edges, contrast 1 : 100.
pub fn studio() -> Lights {
    image(256, |d| {
        let on = |a: f64, lo: f64, hi: f64| (lo..hi).contains(&a);
        let key = d.x > 0.0 && on(d.y / d.x, 0.1, 0.8) && on(d.z / d.x, -0.5, 0.4);
        let rim = d.z < 0.0 && on(d.x / d.z, 0.2, 0.5) && on(d.y / -d.z, -0.4, 1.2);
        let top = d.y > 0.0 && on(d.x / d.y, -0.3, 0.3) && on(d.z / d.y, -0.6, 0.6);
        let base = 0.05 + 0.03 * d.y as f32;
        let add = [key, rim, top].map(|on| if on { 1.0f32 } else { 0.0 });
        [
            base + 5.0 * add[0] + 1.0 * add[1] + 2.0 * add[2],
            base + 4.6 * add[0] + 1.5 * add[1] + 2.0 * add[2],
            base + 4.0 * add[0] + 3.0 * add[1] + 2.1 * add[2],
        ]
    })
}

/// The smooth sky with a sun of half a degree across, about as bright (in irradiance) as the sky.
pub fn sunny() -> Lights {
    let direction = DVec3::new(0.6, 0.5, 0.62).normalize();
    let sun = DiskLight { direction, angular_radius: 0.00465, radiance: [32_000.0, 30_000.0, 27_000.0] };
    Lights { disks: vec![sun], ..smooth() }
}

/// A point light near a ball of radius 1 about the origin, 1.6 from its middle.
pub fn near_point() -> Lights {
    let light = PointLight { position: Vec3::new(0.8, 1.2, 0.7), intensity: [4.0, 3.0, 2.0] };
    Lights { points: vec![light], ..Lights::default() }
}

/// Three directional lights of different colours.
pub fn three_directionals() -> Lights {
    let light = |d: [f64; 3], irradiance| DirectionalLight {
        direction: DVec3::from_array(d).normalize(),
        irradiance,
    };
    let directionals = vec![
        light([0.6, 0.7, 0.4], [3.0, 2.6, 2.0]),
        light([-0.8, 0.3, 0.2], [0.4, 0.7, 1.2]),
        light([0.1, -0.2, -0.9], [0.3, 0.9, 0.5]),
    ];
    Lights { directionals, ..Lights::default() }
}
