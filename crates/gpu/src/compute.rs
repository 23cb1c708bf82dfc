//! Shading batches of points by compute: the GPU twin of [`steradian_techniques::AnyBake::shade`].

use crate::room::buffer_type;
use crate::{Gpu, GpuError, RoomData};
use steradian_techniques::{GpuRoom, PointsBuf};
use wgpu::util::DeviceExt;

/// A room's compute pipeline.
pub struct ComputeRoom {
    pipeline: wgpu::ComputePipeline,
    io: wgpu::BindGroupLayout,
    data: RoomData,
}

/// Threads of a workgroup in the generated module.
const WORKGROUP: u32 = 64;

impl ComputeRoom {
    /// Uploads the room and compiles its module.
    pub fn new(gpu: &Gpu, room: &GpuRoom) -> Result<Self, GpuError> {
        let data = RoomData::upload(gpu, room, wgpu::ShaderStages::COMPUTE)?;
        let source = steradian_techniques::gpu::module(room);
        let (pipeline, io) =
            gpu.scoped(&format!("shader of {}", room.slug), || pipeline(gpu, &data, &source))?;
        Ok(Self { pipeline, io, data })
    }

    /// Writes the uniforms of a new frame.
    pub fn update(&self, gpu: &Gpu, room: &GpuRoom) {
        self.data.update_uniforms(gpu, room);
    }

    /// Outgoing radiance of `points`: planes of red, green, blue.
    pub fn shade(&self, gpu: &Gpu, points: &PointsBuf) -> Result<[Vec<f32>; 3], GpuError> {
        let count = points.len();
        if count == 0 {
            return Ok(Default::default());
        }
        let bytes = (3 * 4 * count) as u64;
        let groups = (count as u32).div_ceil(WORKGROUP);
        let limits = gpu.device.limits();
        if 4 * bytes > limits.max_storage_buffer_binding_size
            || groups > limits.max_compute_workgroups_per_dimension
        {
            return Err(GpuError::Memory(format!("a batch of {count} points")));
        }
        let copy = gpu.scoped("shading", || self.submit(gpu, points, bytes, groups))?;
        let read = gpu.read(&copy, bytes)?;
        let values: Vec<f32> = read.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        Ok(std::array::from_fn(|k| values[k * count..(k + 1) * count].to_vec()))
    }

    fn submit(&self, gpu: &Gpu, points: &PointsBuf, bytes: u64, groups: u32) -> wgpu::Buffer {
        let device = &gpu.device;
        let input = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("points"),
            contents: &planes(points),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let buffer = |label, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        let output = buffer("radiance", wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let copy = buffer("radiance copy", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("points and radiance"),
            layout: &self.io,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
            ],
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.data.group, &[]);
            pass.set_bind_group(1, &group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&output, 0, &copy, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
        copy
    }
}

fn pipeline(gpu: &Gpu, data: &RoomData, source: &str) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
    let device = &gpu.device;
    let entry = |binding, read_only| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: buffer_type(wgpu::BufferBindingType::Storage { read_only }),
        count: None,
    };
    let io = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("points and radiance"),
        entries: &[entry(0, true), entry(1, false)],
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("room"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&data.layout), Some(&io)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("room"),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    (pipeline, io)
}

/// n, t, wo, p as twelve planes; a plane that the points lack is zero.
fn planes(points: &PointsBuf) -> Vec<u8> {
    let count = points.len();
    let mut bytes = Vec::with_capacity(12 * 4 * count);
    for plane in [&points.n, &points.t, &points.wo, &points.p].into_iter().flatten() {
        bytes.extend(plane.iter().flat_map(|x| x.to_le_bytes()));
        bytes.resize(bytes.len() + 4 * (count - plane.len()), 0);
    }
    bytes
}
