//! Throughput of the device when it refilters, measured without waiting for it.

use crate::{Gpu, layout};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Texels a millisecond, from the device's own clock where it has one, else from submission to completion.
pub(super) struct Throughput {
    rate: Option<f64>,
    /// Reads of the work whose time is on its way.
    pending: Option<u64>,
    timing: Timing,
}

enum Timing {
    Stamps {
        set: wgpu::QuerySet,
        resolved: wgpu::Buffer,
        copy: wgpu::Buffer,
        ready: Arc<AtomicBool>,
        unit: f64,
    },
    Wall(Arc<Mutex<Option<f64>>>),
}

impl Throughput {
    pub fn new(gpu: &Gpu) -> Self {
        let timing = if gpu.has_timestamps() {
            let buffer = |usage| layout::empty(gpu, "stamps", usage, 16);
            Timing::Stamps {
                set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("refilter"),
                    ty: wgpu::QueryType::Timestamp,
                    count: 2,
                }),
                resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
                copy: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
                ready: Arc::default(),
                unit: f64::from(gpu.queue.get_timestamp_period()) * 1e-6,
            }
        } else {
            Timing::Wall(Arc::default())
        };
        Self { rate: None, pending: None, timing }
    }

    /// Texels a millisecond, once measured.
    pub fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// The stamps of a pass to be measured; `None` while another's are on their way.
    pub fn writes(&self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        match &self.timing {
            Timing::Stamps { set, .. } if self.pending.is_none() => Some(wgpu::ComputePassTimestampWrites {
                query_set: set,
                beginning_of_pass_write_index: Some(0),
                end_of_pass_write_index: Some(1),
            }),
            _ => None,
        }
    }

    /// Ends the encoding of a measured pass.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        if let (Timing::Stamps { set, resolved, copy, .. }, None) = (&self.timing, self.pending) {
            encoder.resolve_query_set(set, 0..2, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, copy, 0, 16);
        }
    }

    /// Work of `reads` texels was submitted.
    pub fn submitted(&mut self, gpu: &Gpu, reads: u64) {
        if self.pending.is_some() {
            return;
        }
        self.pending = Some(reads);
        match &self.timing {
            Timing::Stamps { copy, ready, .. } => {
                let ready = ready.clone();
                copy.map_async(wgpu::MapMode::Read, .., move |r| ready.store(r.is_ok(), Ordering::Release));
            }
            Timing::Wall(ms) => {
                let (ms, start) = (ms.clone(), Instant::now());
                gpu.queue.on_submitted_work_done(move || {
                    if let Ok(mut ms) = ms.lock() {
                        *ms = Some(1e3 * start.elapsed().as_secs_f64());
                    }
                });
            }
        }
    }

    /// Collects finished measurements; the newest counts half.
    pub fn collect(&mut self) {
        let Some(reads) = self.pending else { return };
        let Some(ms) = self.arrived() else { return };
        self.pending = None;
        if ms > 0.0 {
            let now = reads as f64 / ms;
            self.rate = Some(self.rate.map_or(now, |r| 0.5 * (r + now)));
        }
    }

    fn arrived(&self) -> Option<f64> {
        match &self.timing {
            Timing::Stamps { copy, ready, unit, .. } => {
                if !ready.swap(false, Ordering::Acquire) {
                    return None;
                }
                let view = copy.get_mapped_range(..).ok()?;
                let stamps: Vec<u64> =
                    view.as_chunks::<8>().0.iter().map(|b| u64::from_le_bytes(*b)).collect();
                drop(view);
                copy.unmap();
                Some(stamps[1].saturating_sub(stamps[0]) as f64 * unit)
            }
            Timing::Wall(ms) => ms.lock().ok()?.take(),
        }
    }
}
