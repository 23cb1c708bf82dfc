//! Shading batches of points by compute: the GPU twin of [`steradian_technique::AnyBake::shade`].

use crate::technique::buffer_type;
use crate::{Gpu, GpuError, TechniqueData};
use steradian_technique::gpu::Entry;
use steradian_technique::{GpuTechnique, PointChart, PointLobe, Points, PointsBuf};
use wgpu::util::DeviceExt;

/// A technique's compute pipeline.
pub struct ComputeTechnique {
    pipeline: wgpu::ComputePipeline,
    io: wgpu::BindGroupLayout,
    data: TechniqueData,
    entry: Entry,
}

/// Threads of a workgroup in the generated module.
const WORKGROUP: u32 = 64;
/// Planes of normal, tangent, direction and position, of a lobe, and of a site.
const MOST_PLANES: usize = 12 + PointLobe::LEN + 7 + PointChart::LEN;

impl ComputeTechnique {
    /// Uploads the technique and compiles its module.
    pub fn new(gpu: &Gpu, technique: &GpuTechnique) -> Result<Self, GpuError> {
        let data = TechniqueData::upload(gpu, technique, wgpu::ShaderStages::COMPUTE)?;
        let source = steradian_technique::gpu::module(technique);
        let (pipeline, io) =
            gpu.scoped(&format!("shader of {}", technique.slug), || pipeline(gpu, &data, &source))?;
        Ok(Self { pipeline, io, data, entry: technique.entry })
    }

    /// The technique's data on the device.
    pub fn data(&self) -> &TechniqueData {
        &self.data
    }

    /// Writes the uniforms of a new frame.
    pub fn update(&self, gpu: &Gpu, technique: &GpuTechnique) {
        self.data.update_uniforms(gpu, technique);
    }

    /// Outgoing radiance of `points`: planes of red, green, blue.
    pub fn shade(&self, gpu: &Gpu, points: &PointsBuf) -> Result<[Vec<f32>; 3], GpuError> {
        self.shade_points(gpu, &points.as_points())
    }

    /// Outgoing radiance of a batch, which may lie among the sites of a bake.
    pub fn shade_points(&self, gpu: &Gpu, points: &Points<'_>) -> Result<[Vec<f32>; 3], GpuError> {
        let count = points.len();
        if !points.is_consistent() {
            return Err(GpuError::Scene("a batch whose planes have different lengths".into()));
        }
        if count == 0 {
            return Ok(Default::default());
        }
        let limits = gpu.device.limits();
        let bytes = (3 * 4 * count) as u64;
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let groups = (count as u32).div_ceil(WORKGROUP);
        if (4 * MOST_PLANES * count) as u64 > most || groups > limits.max_compute_workgroups_per_dimension {
            return Err(GpuError::Memory(format!("a batch of {count} points")));
        }
        let copy = gpu.scoped("shading", || self.submit(gpu, points, bytes, groups))?;
        let read = gpu.read(&copy, bytes)?;
        let values: Vec<f32> = read.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        Ok(std::array::from_fn(|k| values[k * count..(k + 1) * count].to_vec()))
    }

    fn submit(&self, gpu: &Gpu, points: &Points<'_>, bytes: u64, groups: u32) -> wgpu::Buffer {
        let device = &gpu.device;
        let input = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("points"),
            contents: &planes(points, self.entry),
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

fn pipeline(gpu: &Gpu, data: &TechniqueData, source: &str) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
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
        label: Some("technique"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&data.layout), Some(&io)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("technique"),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    (pipeline, io)
}

/// The planes of [`steradian_technique::gpu::Binding::Points`]; those that the points lack are zero, lobes
/// the material's.
fn planes(points: &Points<'_>, entry: Entry) -> Vec<u8> {
    let count = points.len();
    let mut bytes = Vec::with_capacity(MOST_PLANES * 4 * count);
    let mut put = |plane: &[f32], default: f32| {
        bytes.extend(plane.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(std::iter::repeat_n(default.to_le_bytes(), count - plane.len()).flatten());
    };
    [points.n, points.t, points.wo, points.p].iter().flatten().for_each(|plane| put(plane, 0.0));
    if entry.lobe {
        points.lobe.iter().zip(PointLobe::PLAIN.to_array()).for_each(|(plane, x)| put(plane, x));
    }
    if entry.site {
        for plane in points.site.index {
            let bits: Vec<f32> = plane.iter().map(|i| f32::from_bits(*i)).collect();
            put(&bits, 0.0);
        }
        points.site.weight.iter().chain(&points.uv).for_each(|plane| put(plane, 0.0));
        if points.chart[0].is_empty() {
            points.n.iter().chain(&points.t).for_each(|plane| put(plane, 0.0));
            put(&[], 1.0);
            put(&[], 0.0);
        } else {
            points.chart.iter().for_each(|plane| put(plane, 0.0));
        }
    }
    bytes
}
