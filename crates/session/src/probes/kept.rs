//! Finished parts of an interrupted capture, kept next to its output.

use super::Request;
use crate::{Error, Scene};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use steradian_base::Input;
use steradian_reference::path::{Kept, ProbeEstimate, ProbeImage, instructions};
use steradian_sphere::sh::ShRgb;
use steradian_sphere::{Layout, SphereImage};
use steradian_transfer::{Store, TransferError, mesh_digest};

/// Parts of one round of paths, or of the images.
pub(super) struct Parts<'a> {
    store: Option<&'a Store>,
    /// Before the numbers of probes.
    round: u32,
    /// Coefficients of a channel, or rows.
    size: usize,
    fault: Mutex<Option<TransferError>>,
}

impl<'a> Parts<'a> {
    /// The round of images.
    pub const IMAGES: u32 = u32::MAX;

    pub fn new(store: Option<&'a Store>, round: u32, size: usize) -> Self {
        Self { store, round, size, fault: Mutex::new(None) }
    }

    /// Fails where a part could not be written.
    pub fn check(self) -> Result<(), Error> {
        let fault = self.fault.into_inner().unwrap_or_else(PoisonError::into_inner);
        fault.map_or(Ok(()), |e| Err(e.into()))
    }

    fn number(&self, k: usize) -> u64 {
        u64::from(self.round) << 32 | k as u64
    }

    fn numbers(&self, k: usize) -> Option<Vec<f64>> {
        let (words, rest) = self.store?.read(self.number(k))?.as_chunks::<8>();
        rest.is_empty().then(|| words.iter().map(|w| f64::from_le_bytes(*w)).collect())
    }

    fn keep(&self, k: usize, numbers: impl Iterator<Item = f64>) {
        let Some(store) = self.store else { return };
        let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
        if let Err(e) = store.write(self.number(k), &bytes) {
            self.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e);
        }
    }
}

impl Kept<ProbeEstimate> for Parts<'_> {
    fn read(&self, k: usize) -> Option<ProbeEstimate> {
        let all = self.numbers(k)?;
        let n = self.size;
        if all.len() != 6 * n + 1 {
            return None;
        }
        let sh = |first: usize| ShRgb {
            order: n.isqrt() - 1,
            c: [0, 1, 2].map(|c| all[(first + c) * n..][..n].to_vec()),
        };
        Some(ProbeEstimate { light: sh(0), variance: sh(3), behind: all[6 * n] })
    }

    fn write(&self, k: usize, e: &ProbeEstimate) {
        let all = e.light.c.iter().chain(&e.variance.c).flatten().copied();
        self.keep(k, all.chain([e.behind]));
    }
}

impl Kept<ProbeImage> for Parts<'_> {
    fn read(&self, k: usize) -> Option<ProbeImage> {
        let all = self.numbers(k)?;
        let mut image = SphereImage::new(Layout::LatLong, 2 * self.size, self.size);
        let texels = 2 * self.size * self.size;
        if all.len() != 3 * texels + 1 {
            return None;
        }
        for (plane, from) in image.planes.iter_mut().zip(all.chunks_exact(texels)) {
            plane.iter_mut().zip(from).for_each(|(to, x)| *to = *x as f32);
        }
        Some(ProbeImage { image, noise: all[3 * texels] })
    }

    fn write(&self, k: usize, e: &ProbeImage) {
        self.keep(k, e.image.planes.iter().flatten().map(|x| f64::from(*x)).chain([e.noise]));
    }
}

/// A digest of all that a capture depends on.
fn key(scene: &Scene, r: &Request) -> String {
    let mut bytes = mesh_digest(&scene.mesh).into_bytes();
    let mut put = |x: f32| bytes.extend(x.to_le_bytes());
    scene.mesh.uvs.iter().for_each(|uv| uv.to_array().into_iter().for_each(&mut put));
    scene.mesh.colors.iter().for_each(|c| c.to_array().into_iter().for_each(&mut put));
    if let Some(e) = &scene.lights.environment {
        e.image.planes.iter().flatten().for_each(|x| put(*x));
    }
    for m in &scene.materials {
        m.base_colour.iter().flat_map(|t| t.levels().next()).for_each(|(w, h, texels)| {
            [w as f32, h as f32].into_iter().chain(texels.iter().flatten().copied()).for_each(&mut put);
        });
    }
    for m in &scene.materials {
        bytes.extend(format!("{} {:?}\n", m.brdf.spec(), m.brdf.held()).bytes());
    }
    let (l, isa) = (&scene.lights, instructions());
    let size = l.environment.as_ref().map(|e| (e.image.layout, e.image.width, e.image.height));
    let rest = format!(
        "{size:?} {:?} {:?} {:?} {:?} {:?} {:?} {} {} {} {:?} {isa} {}",
        scene.mesh.materials,
        l.disks,
        l.directionals,
        l.points,
        r.at,
        r.bands,
        r.bounces,
        r.noise,
        r.seed,
        r.image,
        env!("CARGO_PKG_VERSION")
    );
    bytes.extend(rest.bytes());
    Input::of(Path::new(""), &bytes).sha256
}

/// The file next to the output of a capture.
pub(super) fn store(scene: &Scene, r: &Request) -> Result<Option<Store>, Error> {
    Ok(r.output.as_deref().map(|path| Store::open(path, &key(scene, r))).transpose()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probes::Where;
    use crate::{Material, Session};
    use glam::DVec3;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
    use steradian_base::{Progress, Task};

    /// Cancels after a number of probes.
    struct Stop {
        left: AtomicU64,
        flag: Arc<AtomicBool>,
    }

    impl Progress for Stop {
        fn begin(&self, _: &str, _: u64) {}

        fn advance(&self, steps: u64) {
            if self.left.fetch_sub(steps.min(self.left.load(Ordering::SeqCst)), Ordering::SeqCst) <= steps {
                self.flag.store(true, Ordering::SeqCst);
            }
        }

        fn end(&self) {}
    }

    /// A capture that was interrupted, wherever that was, and resumed equals one without an interruption;
    /// another request starts from the beginning.
    #[test]
    fn an_interrupted_capture_goes_on() {
        let folder = tempfile::tempdir().expect("a folder");
        let output = folder.path().join("field.safetensors");
        let part = folder.path().join("field.safetensors.part");
        let brdf = steradian_brdf::parse("lambert:albedo=0.5").expect("a spec");
        let mesh = steradian_scene::shapes::icosphere(1);
        let lights = steradian_techniques::shared::trials::lights::studio();
        let scene = Scene::new(mesh, vec![Material::new(brdf)], lights);
        let request = Request {
            at: Where::Grid([4, 3, 1], Some([DVec3::new(-2.0, -2.0, 1.5), DVec3::new(2.0, 2.0, 1.5)])),
            bands: 3,
            noise: 0.05,
            image: Some((4, 2)),
            ..Request::default()
        };
        let capture = |request: &Request, stop: Option<u64>| {
            let (mut session, flag) = (Session::new(), Arc::new(AtomicBool::new(false)));
            if let Some(n) = stop {
                let progress = Arc::new(Stop { left: n.into(), flag: flag.clone() });
                session.task = Task::quiet().with_cancel(flag).with_progress(progress);
            }
            session.capture(&scene, request).map(|o| (o.even_if_missed().0, session))
        };
        let (whole, _) = capture(&request, None).expect("captured");
        assert_eq!(whole.resumed, 0);
        let request = Request { output: Some(output.clone()), ..request };
        let mut before = 0;
        // In the first round of paths, in a later one, and among the images.
        for stop in [3, 14, 30] {
            let why = capture(&request, Some(stop)).map(|_| ()).expect_err("interrupted").to_string();
            assert_eq!(why, "interrupted");
            let store = store(&scene, &request).expect("a file").expect("one");
            assert!(store.found() > before, "{stop}: {} {before}", store.found());
            before = store.found();
        }
        let (done, session) = capture(&request, None).expect("captured");
        assert_eq!((done.resumed, done.paths), (before, whole.paths));
        assert_eq!(
            (&done.field, done.noise, done.image_noise),
            (&whole.field, whole.noise, whole.image_noise)
        );
        session.write_probes(done, &output).expect("written");
        assert!(!part.exists() && output.exists());
        let _ = capture(&request, Some(3));
        let other = Request { seed: 1, ..request };
        assert_eq!(capture(&other, None).expect("captured").0.resumed, 0);
    }
}
