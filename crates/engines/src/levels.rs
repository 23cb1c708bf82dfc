//! Levels, filtered: each a map of the light convolved with a kernel, with its error.

use crate::companions::{self, Companions};
use crate::method::{self, MethodCost};
use crate::packing::Packed;
use crate::{BeyondRange, EngineError, Filter, Kernel, Plan, Request, Written, range};
use std::path::Path;
use std::time::Instant;
use steradian_base::{Outcome, Task};
use steradian_formats::{WriteOptions, write_image};
use steradian_light::Lights;
use steradian_light::load::Arrangement;
use steradian_prefilter::{Deviation, FilteredImage, Sampled, Zonal, deviation, filter_image, mirror_image};
use steradian_sphere::Layout;

/// One level, filtered.
pub struct Level {
    /// What it is convolved with.
    pub filter: Filter,
    /// The map.
    pub filtered: FilteredImage,
    /// Its error at texels that were compared with the integral over all texels of the light.
    pub measured: Option<Deviation>,
    /// What the format of the file's texels changes, relative RMS.
    pub format_error: f64,
    /// Seconds of wall time.
    pub seconds: f64,
    /// Where a method was asked for by name: that method, and what it took.
    pub method: Option<MethodCost>,
}

impl Level {
    /// Relative RMS error of the file: the filter's, measured where it was, and the texel format's, which are
    /// independent.
    pub fn error(&self) -> f64 {
        self.measured.map_or(self.filtered.predicted, |m| m.rms).hypot(self.format_error)
    }
}

/// The prepared light and what is asked of every level.
pub(crate) struct Job<'a> {
    pub light: &'a Sampled,
    pub request: &'a Request,
    pub check: usize,
    pub task: &'a Task,
}

impl Job<'_> {
    pub fn level(&self, filter: Filter, shape: (Layout, usize, usize)) -> Result<Level, EngineError> {
        let start = Instant::now();
        let (tolerance, mut by) = (self.request.tolerance, None);
        let filtered = match (&filter.lobe, self.request.method.0) {
            (Some(lobe), Some(m)) => {
                let (need, most) =
                    (m.bytes(self.light, lobe.zonal(), shape, tolerance), self.task.max_memory());
                if need > most {
                    return Err(EngineError::Failed(format!(
                        "`method` {}: this lobe needs {} MiB, beyond the limit of {} MiB: leave `method` out, or raise `max-memory`",
                        m.name(),
                        need >> 20,
                        most >> 20
                    )));
                }
                let (made, work) = method::filter(m, self.light, lobe.zonal(), shape, tolerance, self.task)?;
                by = Some(work);
                made
            }
            (Some(lobe), None) => filter_image(self.light, lobe.zonal(), shape, tolerance, self.task)?,
            (None, _) => mirror_image(self.light, shape),
        };
        let seconds = start.elapsed().as_secs_f64();
        self.task.check()?;
        let lobe = filter.lobe.as_ref().filter(|_| self.check > 0);
        let measured = lobe.map(|l| deviation(self.light, l.zonal(), &filtered.image, self.check));
        Ok(Level { filter, filtered, measured, format_error: 0.0, seconds, method: by })
    }
}

/// Everything filtered and encoded, ready to be written.
pub struct Filtered {
    /// What was asked for.
    pub request: Request,
    /// What that means.
    pub plan: Plan,
    /// The prepared light.
    pub light: Sampled,
    /// The levels of the output, or of its specular cube.
    pub levels: Vec<Level>,
    /// What an engine's files hold in addition.
    pub companions: Companions,
    /// Light too bright for the unfiltered maps' texels, where there is any.
    pub beyond: Option<BeyondRange>,
    packed: Packed,
    /// Seconds of wall time by part, in their order.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Parts that follow one another, and so add up to all of the time.
struct Clock(Instant, Vec<(&'static str, f64)>);

impl Clock {
    fn lap(&mut self, part: &'static str) {
        let now = Instant::now();
        self.1.push((part, (now - self.0).as_secs_f64()));
        self.0 = now;
    }
}

impl Request {
    /// What the request means; refuses what cannot be met before any work. `max_memory` in bytes.
    pub fn plan(&self, max_memory: u64) -> Result<Plan, EngineError> {
        self.check_options()?;
        let plan = crate::plan::plan(self, self.given()?)?;
        self.check_memory(&plan, max_memory)?;
        Ok(plan)
    }
}

impl Filtered {
    /// Filters `lights` into every map that `request` asks for; whether all of them meet
    /// [`Request::tolerance`] is part of the outcome.
    pub fn new(mut request: Request, mut lights: Lights, task: &Task) -> Result<Outcome<Self>, EngineError> {
        let mut plan = request.plan(task.max_memory())?;
        let beyond = range::settle(&plan, &mut request, &mut lights, task)?;
        let mut clock = Clock(Instant::now(), Vec::new());
        let others = if request.engine.is_some() { companions::kernels(&plan) } else { Vec::new() };
        let lobes = plan.filters.iter().filter_map(|f| f.lobe.as_ref());
        let lobes: Vec<&dyn Zonal> = lobes.chain(&others).map(Kernel::zonal).collect();
        let light = Sampled::of(lights, &lobes, request.tolerance, task)?;
        drop(lobes);
        if plan.size.0 == 0 {
            plan.size = (light.image.width, light.image.height);
            request.check_memory(&plan, task.max_memory())?;
        }
        clock.lap("analysis");
        let job = Job { light: &light, request: &request, check: request.check, task };
        let mut levels = Vec::new();
        for (m, filter) in plan.filters.iter().enumerate() {
            let size = ((plan.size.0 >> m).max(1), (plan.size.1 >> m).max(1));
            levels.push(job.level(filter.clone(), (plan.layout, size.0, size.1))?);
        }
        let mut companions = match request.engine {
            Some(_) => Companions::new(&plan, &job, &levels)?,
            None => Companions::none(),
        };
        clock.lap("filtering");
        let packed = Packed::new(&request, &plan, &mut levels, &mut companions)?;
        clock.lap("packing");
        let asked = request.tolerance;
        let made = Self { request, plan, light, levels, companions, beyond, packed, seconds: clock.1 };
        let reached = made.error();
        Ok(Outcome::new(made, Some(asked), reached))
    }

    fn all(&self) -> impl Iterator<Item = &Level> {
        self.levels.iter().chain(self.companions.maps().map(|(_, l)| l))
    }

    /// The largest relative RMS error of a map.
    pub fn error(&self) -> f64 {
        self.all().map(Level::error).fold(0.0, f64::max)
    }

    /// The largest relative RMS error that the texels' format adds to a map.
    pub fn format_error(&self) -> f64 {
        self.all().map(|l| l.format_error).fold(0.0, f64::max)
    }

    /// The engine, with the format of texels that was asked for.
    pub fn engine(&self) -> crate::Engine {
        self.plan.with_format(&self.request)
    }

    /// Writes the file, or the engine's files into their folder, whole or not at all; once. `metadata` is put
    /// into every texture and image.
    pub fn write(&mut self, metadata: &[(String, String)]) -> Result<Vec<Written>, EngineError> {
        let packed = std::mem::take(&mut self.packed).signed(metadata);
        crate::files::write(self, packed, metadata)
    }

    /// Every level as a lat-long .exr in `folder`.
    pub fn dump(
        &self,
        folder: &Path,
        metadata: &[(String, String)],
        task: &Task,
    ) -> Result<Vec<Written>, EngineError> {
        std::fs::create_dir_all(folder)
            .map_err(|e| EngineError::Failed(format!("{}: cannot write: {e}", folder.display())))?;
        let (plan, mut written) = (&self.plan, Vec::new());
        let job = Job { light: &self.light, request: &self.request, check: 0, task };
        for (m, filter) in plan.filters.iter().enumerate() {
            let n = (plan.size.0 >> m).max(1);
            let (w, h) = if plan.layout == Layout::LatLong { plan.size } else { (4 * n, 2 * n) };
            let level = job.level(filter.clone(), (Layout::LatLong, w, h))?;
            let raster = Arrangement::LatLong.arranged(level.filtered.image);
            let mut options =
                WriteOptions { metadata: Arrangement::LatLong.metadata(), ..WriteOptions::default() };
            options.metadata.extend(metadata.iter().cloned());
            let file = format!("{}_level{m}.exr", self.request.name);
            written.push(Written::new(file.clone(), write_image(&folder.join(file), &raster, &options)?));
        }
        Ok(written)
    }
}
