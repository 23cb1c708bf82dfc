//! The device's own clock around every pass.

use crate::scene::Timings;
use crate::{Gpu, GpuError};

/// Most passes of a frame.
const MOST: u32 = 64;

/// Timestamps of the passes of one frame.
pub struct Clock {
    stamps: Option<Stamps>,
    names: Vec<&'static str>,
}

struct Stamps {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    copy: wgpu::Buffer,
}

impl Clock {
    /// A clock, which stands still where the adapter has none.
    pub fn new(gpu: &Gpu) -> Self {
        let stamps = gpu.has_timestamps().then(|| {
            let buffer = |usage| {
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("timestamps"),
                    size: 16 * u64::from(MOST),
                    usage,
                    mapped_at_creation: false,
                })
            };
            Stamps {
                set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("timestamps"),
                    ty: wgpu::QueryType::Timestamp,
                    count: 2 * MOST,
                }),
                resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
                copy: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            }
        });
        Self { stamps, names: Vec::new() }
    }

    /// Forgets the passes of the frame before.
    pub fn restart(&mut self) {
        self.names.clear();
    }

    fn next(&mut self, name: &'static str) -> Option<(&wgpu::QuerySet, u32)> {
        let stamps = self.stamps.as_ref()?;
        let i = self.names.len() as u32;
        (i < MOST).then(|| {
            self.names.push(name);
            (&stamps.set, 2 * i)
        })
    }

    /// Stamps of the next raster pass.
    pub fn raster(&mut self, name: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.next(name).map(|(query_set, i)| wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(i),
            end_of_pass_write_index: Some(i + 1),
        })
    }

    /// Stamps of the next compute pass.
    pub fn compute(&mut self, name: &'static str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.next(name).map(|(query_set, i)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(i),
            end_of_pass_write_index: Some(i + 1),
        })
    }

    /// Collects the stamps at the frame's end.
    pub fn collect(&self, encoder: &mut wgpu::CommandEncoder) {
        let count = 2 * self.names.len() as u32;
        if let (Some(stamps), true) = (&self.stamps, count > 0) {
            encoder.resolve_query_set(&stamps.set, 0..count, &stamps.resolved, 0);
            encoder.copy_buffer_to_buffer(&stamps.resolved, 0, &stamps.copy, 0, 8 * u64::from(count));
        }
    }

    /// The times of the frame, once its work is done.
    pub fn read(&self, gpu: &Gpu) -> Result<Timings, GpuError> {
        let (Some(stamps), false) = (&self.stamps, self.names.is_empty()) else {
            return Ok(Timings::default());
        };
        let bytes = gpu.read(&stamps.copy, 16 * self.names.len() as u64)?;
        let stamps: Vec<u64> = bytes.as_chunks::<8>().0.iter().map(|b| u64::from_le_bytes(*b)).collect();
        let unit = f64::from(gpu.queue.get_timestamp_period()) * 1e-6;
        let ms = |k: usize| stamps[2 * k + 1].saturating_sub(stamps[2 * k]) as f64 * unit;
        Ok(Timings { passes: self.names.iter().enumerate().map(|(k, name)| (*name, ms(k))).collect() })
    }
}
