//! Finding an adapter and opening a device.

use crate::GpuError;
use crate::scene::Path;
use std::sync::{Arc, Mutex};

/// Share of the device's memory from which on it counts as full, in percent: past it drivers may end the
/// process.
const MEMORY_PERCENT: u8 = 90;

/// Data-centre accelerators, which rasterise at a small part of the speed at which they compute.
const ACCELERATORS: [&str; 8] =
    ["A100", "H100", "H200", "H800", "B100", "B200", "Instinct", "Data Center GPU Max"];

/// An open device. `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` choose among several adapters.
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    multisamples_floats: bool,
    lost: Arc<Mutex<Option<String>>>,
    uncaptured: Arc<Mutex<Option<wgpu::Error>>>,
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Gpu({})", self.describe())
    }
}

impl Gpu {
    /// Opens the preferred adapter with all that it offers.
    pub fn open() -> Result<Self, GpuError> {
        pollster::block_on(Self::open_async(false))
    }

    /// Opens the preferred adapter with only the features of every WebGPU implementation: WebGPU's default
    /// limits, no clock, no multisampling of 32-bit floats. A picture that renders on it renders in a
    /// browser.
    pub fn open_portable() -> Result<Self, GpuError> {
        pollster::block_on(Self::open_async(true))
    }

    async fn open_async(portable: bool) -> Result<Self, GpuError> {
        let mut wanted = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        wanted.backends &= wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
        wanted.memory_budget_thresholds.for_resource_creation = Some(MEMORY_PERCENT);
        let instance = wgpu::Instance::new(wanted);
        let adapter = wgpu::util::initialize_adapter_from_env_or_default(&instance, None)
            .await
            .map_err(|e| GpuError::NoAdapter(first_line(&e.to_string())))?;
        check(&adapter)?;
        let optional = if portable {
            wgpu::Features::empty()
        } else {
            wgpu::Features::TIMESTAMP_QUERY
                | wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES
                | wgpu::Features::DEPTH_CLIP_CONTROL
        };
        let floats = adapter.get_texture_format_features(wgpu::TextureFormat::Rgba32Float);
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("steradian"),
                required_features: adapter.features() & optional,
                required_limits: if portable { wgpu::Limits::default() } else { adapter.limits() },
                ..Default::default()
            })
            .await
            .map_err(|e| GpuError::Device(first_line(&e.to_string())))?;
        let gpu = Self {
            info: adapter.get_info(),
            multisamples_floats: device
                .features()
                .contains(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES)
                && floats.flags.contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_X4),
            device,
            queue,
            lost: Arc::default(),
            uncaptured: Arc::default(),
        };
        gpu.listen();
        Ok(gpu)
    }

    /// Losses and errors outside a scope are kept for the next [`Gpu::settled`]; wgpu's default is a panic.
    fn listen(&self) {
        let lost = self.lost.clone();
        self.device.set_device_lost_callback(move |reason, why| {
            if let Ok(mut l) = lost.lock() {
                let why = first_line(&why);
                l.get_or_insert(if why.is_empty() { format!("{reason:?}").to_lowercase() } else { why });
            }
        });
        let uncaptured = self.uncaptured.clone();
        self.device.on_uncaptured_error(Arc::new(move |e| {
            if let Ok(mut u) = uncaptured.lock() {
                u.get_or_insert(e);
            }
        }));
    }

    /// Adapter, driver and back end in one line.
    pub fn describe(&self) -> String {
        let i = &self.info;
        format!("{} ({}, {} {})", i.name, i.backend, i.driver, i.driver_info)
    }

    /// Does the adapter compute on the CPU (Mesa's lavapipe and its like)?
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The path that shades faster here: compute on software adapters, whose rasteriser shades blocks of
    /// pixels for each small triangle, and on accelerators that have almost no graphics units; else raster.
    pub fn preferred_path(&self) -> Path {
        let compute = self.is_software() || ACCELERATORS.iter().any(|name| self.info.name.contains(name));
        if compute { Path::Compute } else { Path::Raster }
    }

    /// Gives the device and all that is on it back; whatever uses it afterwards fails with
    /// [`GpuError::Lost`].
    pub fn destroy(&self) {
        if let Ok(mut l) = self.lost.lock() {
            l.get_or_insert_with(|| "it was given back".into());
        }
        self.device.destroy();
    }

    /// Is the device lost? Its contents are lost too; [`Gpu::open`] opens another.
    pub fn is_lost(&self) -> bool {
        self.lost.lock().is_ok_and(|l| l.is_some())
    }

    /// Can passes be timed on the device?
    pub fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Can Rgba32Float targets have four samples?
    pub(crate) fn multisamples_floats(&self) -> bool {
        self.multisamples_floats
    }

    /// Bytes read and written per second by copies of `bytes` on the device: its bandwidth roof, by the
    /// wall's clock, the best of five.
    pub fn copy_bandwidth(&self, bytes: u64) -> Result<f64, GpuError> {
        if bytes > self.device.limits().max_buffer_size {
            return Err(GpuError::Memory(format!("a copy of {bytes} bytes")));
        }
        let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let buffers =
            self.scoped("copy", || [0; 2].map(|_| crate::layout::empty(self, "copy", usage, bytes)))?;
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            let start = std::time::Instant::now();
            self.scoped("copy", || {
                let mut encoder =
                    self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                encoder.copy_buffer_to_buffer(&buffers[0], 0, &buffers[1], 0, bytes);
                self.queue.submit([encoder.finish()]);
            })?;
            self.wait()?;
            best = best.min(start.elapsed().as_secs_f64());
        }
        Ok(2.0 * bytes as f64 / best)
    }

    /// Runs `make` and turns errors of the GPU into an error about `what`.
    pub(crate) fn scoped<R>(&self, what: &str, make: impl FnOnce() -> R) -> Result<R, GpuError> {
        self.settled()?;
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let valid = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let made = make();
        let errors = pollster::block_on(async { (valid.pop().await, memory.pop().await) });
        match errors {
            (None, None) => self.settled().map(|()| made),
            // On a lost device the loss is reported, since it causes all other errors.
            (_, Some(e)) | (Some(e), None) => self.settled().and(Err(GpuError::of(what, e))),
        }
    }

    /// `Err` once the device is lost, or after an error outside a scope.
    pub(crate) fn settled(&self) -> Result<(), GpuError> {
        if let Ok(l) = self.lost.lock()
            && let Some(why) = l.as_ref()
        {
            return Err(GpuError::Lost(why.clone()));
        }
        if let Ok(mut u) = self.uncaptured.lock()
            && let Some(e) = u.take()
        {
            return Err(GpuError::of("work in flight", e));
        }
        Ok(())
    }

    /// Waits for all submitted work.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| GpuError::Lost(e.to_string()))?;
        self.settled()
    }

    /// The first `bytes` of `from`, which must be mappable.
    pub(crate) fn read(&self, from: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, GpuError> {
        let (tell, told) = std::sync::mpsc::channel();
        from.map_async(wgpu::MapMode::Read, 0..bytes, move |r| {
            let _ = tell.send(r); // the receiver is gone only when this call has failed already
        });
        self.wait()?;
        let mapped = told.recv().map_err(|e| GpuError::Lost(e.to_string()))?;
        mapped.map_err(|e| GpuError::Lost(e.to_string()))?;
        let view = from.get_mapped_range(0..bytes).map_err(|e| GpuError::Lost(e.to_string()))?;
        let data = view.to_vec();
        drop(view);
        from.unmap();
        Ok(data)
    }
}

/// Does the adapter have the features that both paths need?
fn check(adapter: &wgpu::Adapter) -> Result<(), GpuError> {
    use wgpu::DownlevelFlags as Flags;
    let needed = Flags::COMPUTE_SHADERS
        | Flags::INDIRECT_EXECUTION
        | Flags::FRAGMENT_WRITABLE_STORAGE
        | Flags::VERTEX_STORAGE
        | Flags::MULTISAMPLED_SHADING;
    let missing = needed - adapter.get_downlevel_capabilities().flags;
    if missing.is_empty() {
        return Ok(());
    }
    let names: Vec<_> = missing.iter_names().map(|n| n.0.to_lowercase().replace('_', " ")).collect();
    Err(GpuError::Device(format!("{} lacks {}", adapter.get_info().name, names.join(", "))))
}

fn first_line(s: &str) -> String {
    s.lines().next().unwrap_or_default().trim().to_owned()
}
