//! Refiltering a changing environment on the GPU: an uploaded image, a sky of another hour, or the scene
//! captured into a cube becomes a chain of filtered cubes in the layout of the techniques' own tables, and
//! spherical harmonics.
//!
//! [`Surroundings`] is the light, [`Plan`] the chain and the way to filter it, [`Refilter`] does the work
//! within a budget and hands finished chains to techniques. [`Follower`] does it for all that a technique
//! says of its data ([`steradian_technique::AnyBake::light_tables`]):
//!
//! ```no_run
//! use glam::Mat3;
//! use steradian_gpu::refilter::{Budget, Follower, Surroundings};
//! use steradian_gpu::{Gpu, GpuError, TechniqueData};
//! use steradian_light::Lights;
//! use steradian_technique::AnyBake;
//!
//! fn start(gpu: &Gpu, bake: &dyn AnyBake, lights: &Lights) -> Result<Option<Follower>, GpuError> {
//!     let Some(tables) = bake.light_tables(false) else { return Ok(None) };
//!     let mut follower = Follower::new(gpu, &bake.gpu(), &tables)?;
//!     follower.set_light(&Surroundings::from_lights(gpu, lights)?);
//!     Ok(Some(follower))
//! }
//!
//! fn every_frame(gpu: &Gpu, follower: &mut Follower, data: &TechniqueData) -> Result<bool, GpuError> {
//!     follower.step(gpu, Budget::Milliseconds(0.5), data, Mat3::IDENTITY)
//! }
//! ```
//!
//! # Ways
//!
//! *Convolution.* Mip chains with a handful of importance samples blur by what is at hand; their error is
//! that of the samples. Here every kernel is a sum of Gaussians, K ≈ Σ_j w_j G_j, each √2 as wide as the one
//! before, and what the sum misses of the lowest bands (10, or 16 in small cubes) comes from spherical
//! harmonics: GGX is a continuous mixture of Gaussians, so eight of them and low bands are within a few
//! thousandths ([`Plan::predicted`]; `kernel.rs` fits them in frequency space, where convolution is a
//! product). G_j is made of G_{j−1} by a Gaussian over every other sample in reach, weighted by its solid
//! angle; two of them share a cube, and the next two have one of half the size. These cubes are equiangular
//! (s = tan(πa/4)), so their cells are nearly of one size, and lookup in them is cubic. All weights depend on
//! angles alone: there are neither seams nor preferred axes. Cost: 70 to 260 texels for a sample of a
//! Gaussian, 16 for each Gaussian in a sample of the chain, whatever its roughness.
//!
//! *Box*, *Paraboloid* and *Frequency* are the simpler and older ways, for comparison and for slow devices:
//! see [`Method`].
//!
//! Suns and directional lights are never filtered: each adds its kernel, exactly, to every sample. Mirrors
//! take them as bilinear lookup weighs them.
//!
//! # Determinism
//!
//! A sample is a function of its index alone and sums run in fixed order: steps of any budget end in the same
//! bits as one pass ([`Refilter::run`]).

mod capture;
mod follow;
mod kernel;
mod plan;
mod program;
mod resources;
mod surroundings;
#[cfg(test)]
mod tests;
mod throughput;

use crate::layout::{empty, filled};
use crate::renderer::clock::Clock;
use crate::{Gpu, GpuError, TechniqueData};
use glam::Mat3;
use program::{Job, Pass, QUADRIC};
use resources::Resources;
use std::time::Instant;
use steradian_prefilter::EdgeCube;
use steradian_sphere::sh::ShRgb;
use throughput::Throughput;

pub use follow::Follower;
pub use plan::{Level, Method, Plan, ggx_levels};
pub use surroundings::Surroundings;

/// Limit of the work of a step; a step does at least one tile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// Milliseconds of the device, as measured in earlier steps; the first step is one tile.
    Milliseconds(f64),
    /// Texels read ([`Plan::reads`] has the whole chain's).
    Texels(u64),
    /// Everything that is left.
    All,
}

/// A pass, the level that it serves (`None`: all), and milliseconds.
pub type PassTime = (&'static str, Option<usize>, f64);

/// The light of a chain, with its data on the device.
struct Lit {
    light: Surroundings,
    extras: wgpu::Buffer,
}

/// A chain in the making, and the one that is finished.
pub struct Refilter {
    plan: Plan,
    resources: Resources,
    throughput: Throughput,
    waiting: Option<Surroundings>,
    making: Option<(Lit, wgpu::BindGroup)>,
    next: usize,
    shown: Option<Lit>,
    front: usize,
    /// The finished chain's coefficients.
    settled: wgpu::Buffer,
}

impl Refilter {
    /// Makes buffers and pipelines for `plan`.
    pub fn new(gpu: &Gpu, plan: Plan) -> Result<Self, GpuError> {
        let resources = Resources::new(gpu, &plan)?;
        let usage = wgpu::BufferUsages::STORAGE
            .union(wgpu::BufferUsages::COPY_SRC)
            .union(wgpu::BufferUsages::COPY_DST);
        let bytes = 16 * u64::from(program::PARTIAL);
        let (throughput, settled) =
            gpu.scoped("refilter", || (Throughput::new(gpu), empty(gpu, "coefficients", usage, bytes)))?;
        Ok(Self {
            plan,
            resources,
            throughput,
            waiting: None,
            making: None,
            next: 0,
            shown: None,
            front: 0,
            settled,
        })
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The light of the next chain. One that is being made is finished first, so that light that changes
    /// every frame still arrives; of several that wait the last one counts.
    pub fn set_light(&mut self, light: Surroundings) {
        self.waiting = Some(light);
    }

    /// Is there work left?
    pub fn is_busy(&self) -> bool {
        self.making.is_some() || self.waiting.is_some()
    }

    /// Is there a finished chain?
    pub fn is_ready(&self) -> bool {
        self.shown.is_some()
    }

    /// Finished share of the chain that is being filtered, 0 … 1.
    pub fn progress(&self) -> f64 {
        let share = self.next as f64 / self.plan.work.tiles.len() as f64;
        if self.making.is_some() { share } else { 0.0 }
    }

    /// Submits as much of the work as the budget allows, without waiting for the device; `true` where that
    /// completed a chain, which then takes the place of the one before.
    pub fn step(&mut self, gpu: &Gpu, budget: Budget) -> Result<bool, GpuError> {
        gpu.device.poll(wgpu::PollType::Poll).map_err(|e| GpuError::Lost(e.to_string()))?;
        self.throughput.collect();
        if self.making.is_none() {
            let Some(light) = self.waiting.take() else { return Ok(false) };
            self.begin(gpu, light)?;
        }
        let Some((_, group)) = &self.making else { return Ok(false) };
        let (end, reads) = self.affordable(budget);
        let done = end == self.plan.work.tiles.len();
        gpu.scoped("refilter", || {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some("refilter"),
                    timestamp_writes: self.throughput.writes(),
                });
                self.resources.encode(&self.plan, group, self.next..end, &mut pass);
            }
            self.throughput.resolve(&mut encoder);
            self.settle(&mut encoder, end);
            gpu.queue.submit([encoder.finish()]);
        })?;
        self.throughput.submitted(gpu, reads);
        self.advance(end);
        Ok(done)
    }

    /// Tiles before `end` are submitted; with the last of them the chain takes its place.
    fn advance(&mut self, end: usize) {
        self.next = end;
        if end == self.plan.work.tiles.len()
            && let Some((lit, _)) = self.making.take()
        {
            self.shown = Some(lit);
            self.front = 1 - self.front;
        }
    }

    /// Makes the chain of the light that waits, pass by pass, waiting for each: name, the level that it
    /// serves, and milliseconds by the device's clock (by the wall's where it has none).
    pub fn profile(&mut self, gpu: &Gpu) -> Result<Vec<PassTime>, GpuError> {
        if self.making.is_none()
            && let Some(light) = self.waiting.take()
        {
            self.begin(gpu, light)?;
        }
        let mut clock = gpu.scoped("clock", || Clock::new(gpu))?;
        let mut times = Vec::new();
        while let Some((_, group)) = &self.making {
            let tiles = &self.plan.work.tiles;
            let index = tiles[self.next].job;
            let end = tiles.iter().rposition(|t| t.job == index).map_or(tiles.len(), |k| k + 1);
            let job = &self.plan.work.jobs[index];
            let start = Instant::now();
            gpu.scoped("refilter", || {
                let mut encoder =
                    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                clock.restart();
                {
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                        label: Some(job.pass.entry()),
                        timestamp_writes: clock.compute(job.pass.entry()),
                    });
                    self.resources.encode(&self.plan, group, self.next..end, &mut pass);
                }
                clock.collect(&mut encoder);
                self.settle(&mut encoder, end);
                gpu.queue.submit([encoder.finish()]);
            })?;
            gpu.wait()?;
            let wall = 1e3 * start.elapsed().as_secs_f64();
            let ms = clock.read(gpu)?.passes.first().map_or(wall, |p| p.1);
            times.push((job.pass.entry(), job.level, ms));
            self.advance(end);
        }
        Ok(times)
    }

    /// Keeps the coefficients with the chain's last tile.
    fn settle(&self, encoder: &mut wgpu::CommandEncoder, end: usize) {
        if end == self.plan.work.tiles.len() {
            encoder.copy_buffer_to_buffer(
                &self.resources.harmonics,
                0,
                &self.settled,
                0,
                16 * u64::from(QUADRIC),
            );
        }
    }

    /// Completes the chain in the making, or makes that of the light that waits, and waits for the device.
    pub fn run(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        self.step(gpu, Budget::All)?;
        gpu.wait()
    }

    fn begin(&mut self, gpu: &Gpu, light: Surroundings) -> Result<(), GpuError> {
        let data = light.extras(&self.plan);
        let (extras, group) = gpu.scoped("light", || {
            let extras = filled(gpu, "suns", wgpu::BufferUsages::STORAGE, &data);
            let group = self.resources.group(gpu, &light, &extras, 1 - self.front);
            (extras, group)
        })?;
        self.making = Some((Lit { light, extras }, group));
        self.next = 0;
        Ok(())
    }

    /// Index after the last tile that the budget allows, and the number of texels read.
    fn affordable(&self, budget: Budget) -> (usize, u64) {
        let most = match budget {
            Budget::All => u64::MAX,
            Budget::Texels(n) => n,
            Budget::Milliseconds(ms) => self.throughput.rate().map_or(0, |rate| (rate * ms.max(0.0)) as u64),
        };
        let (mut end, mut reads) = (self.next, 0u64);
        for tile in &self.plan.work.tiles[self.next..] {
            if end > self.next && reads + tile.reads > most {
                break;
            }
            reads += tile.reads;
            end += 1;
        }
        (end, reads)
    }

    fn finished(&self) -> Result<&Lit, GpuError> {
        self.shown.as_ref().ok_or_else(|| GpuError::Scene("no chain has been refiltered yet".into()))
    }

    /// Copies the finished chain's levels into the table `name` of a technique on the device; others stay as
    /// they are.
    pub fn deliver(&self, gpu: &Gpu, technique: &TechniqueData, name: &str) -> Result<(), GpuError> {
        self.finished()?;
        let texture = technique.table(name).ok_or_else(|| GpuError::Scene(format!("no table '{name}'")))?;
        let [width, height] = self.plan.extent;
        if [texture.width(), texture.height(), texture.depth_or_array_layers()] != [width, height, 6] {
            return Err(GpuError::Scene(format!("the table '{name}' has another size than the chain")));
        }
        gpu.scoped("refiltered chain", || {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            for &[x, y, size] in &self.plan.places {
                let layout = wgpu::TexelCopyBufferLayout {
                    offset: 16 * (u64::from(y) * u64::from(self.plan.pitch) + u64::from(x)),
                    bytes_per_row: Some(16 * self.plan.pitch),
                    rows_per_image: Some(height),
                };
                encoder.copy_buffer_to_texture(
                    wgpu::TexelCopyBufferInfo { buffer: &self.resources.chains[self.front], layout },
                    wgpu::TexelCopyTextureInfo {
                        origin: wgpu::Origin3d { x, y, z: 0 },
                        ..texture.as_image_copy()
                    },
                    wgpu::Extent3d { width: size + 1, height: size + 1, depth_or_array_layers: 6 },
                );
            }
            gpu.queue.submit([encoder.finish()]);
        })
    }

    /// Writes nᵀMn of E·gain over normals turned by `rotation` (light from d comes from `rotation · d`) into
    /// the `mat4x4` uniforms `names` of a technique (Ramamoorthi & Hanrahan 2001): E's bands 0 to 2, suns
    /// included. A technique of Lambert's albedo ρ takes the gain ρ/π.
    pub fn deliver_irradiance(
        &self,
        gpu: &Gpu,
        technique: &TechniqueData,
        names: [&str; 3],
        gain: [f32; 3],
        rotation: Mat3,
    ) -> Result<(), GpuError> {
        let lit = self.finished()?;
        if !self.plan.has_harmonics() {
            return Err(GpuError::Scene(format!("{:?} leaves no spherical harmonics", self.plan.method())));
        }
        let place =
            |name| technique.uniform(name).ok_or_else(|| GpuError::Scene(format!("no uniform '{name}'")));
        let places = [place(names[0])?, place(names[1])?, place(names[2])?];
        let columns = [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|c| c.extend(0.0).to_array());
        let cosine = steradian_prefilter::Zonal::coefficients(&steradian_prefilter::Cosine, 2);
        let bands = cosine.iter().map(|a| [*a as f32, 0.0, 0.0, 0.0]);
        let mut tables = columns.to_vec();
        tables.push([gain[0], gain[1], gain[2], 0.0]);
        tables.extend(bands);
        let job = Job {
            pass: Pass::Quadric,
            outputs: 3,
            at: [QUADRIC, 0, 0, 0],
            tables: [0, 0, 4, 0],
            ..Job::default()
        };
        gpu.scoped("irradiance", || {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.resources.lone(gpu, &job, &tables, &lit.extras, &self.settled, &mut encoder);
            for (k, (buffer, offset)) in (0..).zip(places) {
                let from = 16 * u64::from(QUADRIC) + 64 * k;
                encoder.copy_buffer_to_buffer(&self.settled, from, buffer, offset, 64);
            }
            gpu.queue.submit([encoder.finish()]);
        })
    }

    /// Reads the finished chain back.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<EdgeCube>, GpuError> {
        self.finished()?;
        let (pitch, height) = (self.plan.pitch as usize, self.plan.extent[1] as usize);
        let texels = read_back(gpu, &self.resources.chains[self.front], 6 * pitch * height)?;
        let cube = |p: &[u32; 3]| {
            let [x, y, n] = p.map(|v| v as usize);
            let row = |r: usize| (r / (n + 1) * height + y + r % (n + 1)) * pitch + x;
            let texels = (0..6 * (n + 1)).flat_map(|r| texels[row(r)..=row(r) + n].iter().copied());
            EdgeCube::from_texels(n, texels.collect()).unwrap_or_default()
        };
        Ok(self.plan.places.iter().map(cube).collect())
    }

    /// Reads the finished chain's spherical harmonics back: radiance up to order 15, suns included.
    /// Irradiance is band l of them times A_l ([`steradian_prefilter::Cosine`]).
    pub fn harmonics(&self, gpu: &Gpu) -> Result<ShRgb, GpuError> {
        let lit = self.finished()?;
        let Some(bands) = self.plan.bands() else {
            return Err(GpuError::Scene(format!("{:?} leaves no spherical harmonics", self.plan.method())));
        };
        let rows = read_back(gpu, &self.settled, bands * bands)?;
        let suns = lit.light.coefficients(bands - 1);
        let plane = |c: usize| rows.iter().zip(&suns[c]).map(|(r, s)| f64::from(r[c]) + s).collect();
        Ok(ShRgb { order: bands - 1, c: std::array::from_fn(plane) })
    }
}

/// `count` vec4s from the start of `buffer`.
fn read_back(gpu: &Gpu, buffer: &wgpu::Buffer, count: usize) -> Result<Vec<[f32; 4]>, GpuError> {
    let bytes = 16 * count as u64;
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let copy = gpu.scoped("read-back", || {
        let copy = empty(gpu, "read-back", usage, bytes);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
        copy
    })?;
    let data = gpu.read(&copy, bytes)?;
    let floats = data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
    let floats: Vec<f32> = floats.collect();
    Ok(floats.as_chunks::<4>().0.to_vec())
}
