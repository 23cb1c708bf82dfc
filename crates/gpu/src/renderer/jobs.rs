//! Lists of the samples to shade, for the compute path: the threads of a workgroup then all shade, whereas
//! with a thread a pixel they would wait for their neighbours or, on devices that execute both sides of a
//! branch, shade samples that are not visible. One list serves all objects and the backdrop in turn.

use super::passes;
use super::target::Target;
use crate::layout::{self, Slot, empty, filled};
use crate::{Gpu, GpuError};

/// Bytes from one head to the next: an offset that every adapter allows.
const STRIDE: u64 = 256;

/// The list and its heads.
pub struct Jobs {
    list: wgpu::ComputePipeline,
    heads: wgpu::Buffer,
    /// Heads of empty lists.
    blank: wgpu::Buffer,
    parts: Vec<[wgpu::BindGroup; 2]>,
    groups: [u32; 2],
}

impl Jobs {
    /// Lists for objects of these numbers of triangles, with the backdrop as the last part.
    pub fn new(
        gpu: &Gpu,
        io: &wgpu::BindGroupLayout,
        target: &Target,
        ids: &wgpu::TextureView,
        triangles: &[u32],
    ) -> Result<Self, GpuError> {
        let limits = gpu.device.limits();
        let s = &target.settings;
        let quads = [s.width, s.height].map(|n| (n * s.scale) as u64);
        // At most one job a sample, each a u32; their numbers leave 28 bits for a quad.
        let bytes = 16 * quads[0] * quads[1];
        if bytes > limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).min(16 << 28) {
            return Err(GpuError::Memory(format!("a picture of {} x {} pixels", s.width, s.height)));
        }
        gpu.scoped("jobs", || Self::make(gpu, io, target, ids, triangles, bytes))
    }

    fn make(
        gpu: &Gpu,
        io: &wgpu::BindGroupLayout,
        target: &Target,
        ids: &wgpu::TextureView,
        triangles: &[u32],
        bytes: u64,
    ) -> Self {
        let blank = blank(triangles);
        let size = blank.len() as u64;
        let blank = filled(gpu, "blank heads", wgpu::BufferUsages::COPY_SRC, &blank);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST;
        let heads = empty(gpu, "heads", usage, size);
        let jobs = empty(gpu, "jobs", wgpu::BufferUsages::STORAGE, bytes);
        let write = layout::layout(gpu, wgpu::ShaderStages::COMPUTE, &[Slot::Ids, Slot::Write, Slot::Write]);
        let view = wgpu::BindingResource::TextureView;
        let groups = |k: u64| {
            let head = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &heads,
                offset: STRIDE * k,
                size: std::num::NonZeroU64::new(STRIDE),
            });
            let jobs = jobs.as_entire_binding();
            let to_write = [view(ids), jobs.clone(), head.clone()];
            let to_read = [view(ids), jobs, head, view(&target.colour)];
            [layout::group(gpu, &write, &to_write), layout::group(gpu, io, &to_read)]
        };
        let parts = (0..size / STRIDE).map(groups).collect();
        let source = passes::list_source(target.settings.rate);
        let list = layout::compute(gpu, &source, "gpu_list", &[Some(&write)]);
        let s = &target.settings;
        let groups = [s.width, s.height].map(|n| ((n * s.scale) as u32).div_ceil(8));
        Self { list, heads, blank, parts, groups }
    }

    /// Empties the lists of a frame.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_buffer_to_buffer(&self.blank, 0, &self.heads, 0, self.blank.size());
    }

    /// Lists part `k` and shades it by `pipeline`, whose groups 0 to 2 are set.
    pub fn shade<'a>(
        &'a self,
        pass: &mut wgpu::ComputePass<'_>,
        k: usize,
        pipeline: &wgpu::ComputePipeline,
        groups: impl IntoIterator<Item = (u32, &'a wgpu::BindGroup)>,
    ) {
        let Some([write, read]) = self.parts.get(k) else { return };
        pass.set_pipeline(&self.list);
        pass.set_bind_group(0, write, &[]);
        pass.dispatch_workgroups(self.groups[0], self.groups[1], 1);
        pass.set_pipeline(pipeline);
        for (i, group) in groups {
            pass.set_bind_group(i, group, &[]);
        }
        pass.set_bind_group(3, read, &[]);
        pass.dispatch_workgroups_indirect(&self.heads, STRIDE * k as u64);
    }
}

/// Heads of empty lists: `struct GpuHead` each.
fn blank(triangles: &[u32]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut put = |first: u32, number: u32| {
        bytes.extend([16, 0, 1, 0, first, number].into_iter().flat_map(u32::to_le_bytes));
        bytes.resize(bytes.len().next_multiple_of(STRIDE as usize), 0);
    };
    let mut first = 1;
    for n in triangles {
        put(first, *n);
        first += n;
    }
    put(0, 1);
    bytes
}
