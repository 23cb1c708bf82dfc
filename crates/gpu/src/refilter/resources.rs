//! Pipelines and buffers of a refilter.

use super::plan::Plan;
use super::program::{JOB_BYTES, Job, Pass, Tile};
use super::surroundings::{Surroundings, fits};
use crate::layout::{compute_of, empty, filled, module, pipeline_layout};
use crate::technique::buffer_type;
use crate::{Gpu, GpuError, layout};
use std::num::NonZero;

/// The shaders of all passes, one module.
pub(super) const SHADERS: &str = concat!(
    include_str!("../shaders/refilter.wgsl"),
    include_str!("../shaders/refilter_light.wgsl"),
    include_str!("../shaders/refilter_gauss.wgsl"),
    include_str!("../shaders/refilter_harmonics.wgsl"),
    include_str!("../shaders/refilter_box.wgsl"),
);

/// Resources that do not depend on the light.
pub(super) struct Resources {
    layout: wgpu::BindGroupLayout,
    pipelines: Vec<wgpu::ComputePipeline>,
    jobs: wgpu::Buffer,
    tables: wgpu::Buffer,
    maps: wgpu::Buffer,
    pub harmonics: wgpu::Buffer,
    /// The chain in the making and the finished one.
    pub chains: [wgpu::Buffer; 2],
}

const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE;
const TAKEN: wgpu::BufferUsages = STORAGE.union(wgpu::BufferUsages::COPY_SRC);

impl Resources {
    pub fn new(gpu: &Gpu, plan: &Plan) -> Result<Self, GpuError> {
        let work = &plan.work;
        let chain = 16 * 6 * u64::from(plan.pitch) * u64::from(plan.extent[1]);
        for texels in [work.maps, work.harmonics] {
            fits(gpu, 16 * u64::from(texels))?;
        }
        fits(gpu, chain)?;
        gpu.scoped("refilter", || {
            let mut jobs = Vec::with_capacity(work.tiles.len() * JOB_BYTES as usize);
            work.tiles.iter().for_each(|t| jobs.extend(work.jobs[t.job].bytes(t.first)));
            let layout = slots(gpu);
            let shared = pipeline_layout(gpu, &[Some(&layout)]);
            let module = module(gpu, SHADERS);
            Self {
                pipelines: Pass::ALL.iter().map(|p| compute_of(gpu, &module, p.entry(), &shared)).collect(),
                jobs: filled(gpu, "refilter jobs", wgpu::BufferUsages::UNIFORM, &jobs),
                tables: filled(
                    gpu,
                    "refilter tables",
                    STORAGE,
                    &crate::packed::bytes(work.tables.as_flattened()),
                ),
                maps: empty(gpu, "refilter maps", STORAGE, 16 * u64::from(work.maps)),
                harmonics: empty(gpu, "refilter sums", TAKEN, 16 * u64::from(work.harmonics)),
                chains: [0; 2].map(|_| empty(gpu, "refiltered chain", TAKEN, chain)),
                layout,
            }
        })
    }

    /// Everything that a light's tiles read and write, with chain `to`.
    pub fn group(
        &self,
        gpu: &Gpu,
        light: &Surroundings,
        extras: &wgpu::Buffer,
        to: usize,
    ) -> wgpu::BindGroup {
        let buffers = [&light.texels, &self.maps, &self.chains[to], &self.tables, &self.harmonics, extras];
        self.bind(gpu, &self.jobs, buffers)
    }

    /// A single job with its own tables and coefficients, for a technique's matrices.
    pub fn lone(
        &self,
        gpu: &Gpu,
        job: &Job,
        tables: &[[f32; 4]],
        extras: &wgpu::Buffer,
        harmonics: &wgpu::Buffer,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let uniform = filled(gpu, "refilter job", wgpu::BufferUsages::UNIFORM, &job.bytes(0));
        let tables = filled(gpu, "refilter tables", STORAGE, &crate::packed::bytes(tables.as_flattened()));
        let unused = filled(gpu, "unused", STORAGE, &[0; 16]);
        let buffers = [&unused, &self.maps, &self.chains[0], &tables, harmonics, extras];
        let group = self.bind(gpu, &uniform, buffers);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        self.dispatch(&mut pass, &group, job.pass, 0, 1);
    }

    fn bind(&self, gpu: &Gpu, jobs: &wgpu::Buffer, buffers: [&wgpu::Buffer; 6]) -> wgpu::BindGroup {
        let job = wgpu::BufferBinding { buffer: jobs, offset: 0, size: NonZero::new(JOB_BYTES) };
        let mut resources = vec![wgpu::BindingResource::Buffer(job)];
        resources.extend(buffers.iter().map(|b| b.as_entire_binding()));
        layout::group(gpu, &self.layout, &resources)
    }

    /// Encodes tiles `range`; neighbours of one job go as one dispatch.
    pub fn encode(
        &self,
        plan: &Plan,
        group: &wgpu::BindGroup,
        range: std::ops::Range<usize>,
        pass: &mut wgpu::ComputePass<'_>,
    ) {
        let tiles = &plan.work.tiles;
        let mut next = range.start;
        while next < range.end {
            let Tile { job, mut groups, .. } = tiles[next];
            let mut end = next + 1;
            while end < range.end && tiles[end].job == job && groups + tiles[end].groups <= MOST_GROUPS {
                groups += tiles[end].groups;
                end += 1;
            }
            self.dispatch(pass, group, plan.work.jobs[job].pass, next as u64 * JOB_BYTES, groups);
            next = end;
        }
    }

    fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        group: &wgpu::BindGroup,
        what: Pass,
        offset: u64,
        groups: u32,
    ) {
        pass.set_pipeline(&self.pipelines[what as usize]);
        pass.set_bind_group(0, group, &[offset as u32]);
        pass.dispatch_workgroups(groups, 1, 1);
    }
}

/// Workgroups of one dispatch that every device takes.
const MOST_GROUPS: u32 = 65_535;

/// Job, light, maps, chain, tables, harmonics, extras.
fn slots(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let storage = |read_only| buffer_type(wgpu::BufferBindingType::Storage { read_only });
    let job = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: None,
    };
    let types =
        [job, storage(true), storage(false), storage(false), storage(true), storage(false), storage(true)];
    let entries: Vec<_> = (0..)
        .zip(types)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}
