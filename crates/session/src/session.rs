//! The session: limits, progress, provenance, and a listener for messages.

use crate::{Error, Notice, Paths};
use std::path::Path;
use std::sync::Arc;
use steradian_base::{Input, ParamValues, Provenance, Task};
use steradian_formats::Limits;
use steradian_light::load::Negative;
use steradian_scene::shadow::{Blocker, LightAt, MapOptions, ShadowMaps, ShadowVolumes};
use steradian_scene::{Bvh, Mesh};
use steradian_techniques::AnyTechnique;
use steradian_techniques::direct::{Direct, Suns};
use steradian_techniques::local::LocalLights;

/// Where pictures are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Backend {
    /// A GPU where the build has the feature `gpu` and there is one, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// A GPU.
    Gpu,
}

/// Method of shading on a GPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GpuPath {
    /// The faster one on the adapter: compute on software adapters and data-centre accelerators, else raster.
    #[default]
    Auto,
    /// In the fragment shader, multisampled.
    Raster,
    /// In compute shaders, from a visibility buffer.
    Compute,
}

/// Shadowing of the lights that are shaded in addition to a technique's data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shadows {
    /// Rays under techniques with self-shadowing, none under all other ones.
    #[default]
    Auto,
    /// Nothing.
    Off,
    /// Rays through the mesh.
    Ray,
    /// Shadow maps ([`steradian_scene::shadow::ShadowMaps`]).
    Map(MapOptions),
    /// Shadow volumes ([`steradian_scene::shadow::ShadowVolumes`]).
    Volume,
    /// Rays through the mesh, and for the environment rays over the reflectance's lobe
    /// ([`steradian_render::LobeShadowShader`]): with techniques without shadows, whose data may hold suns,
    /// and with the reference.
    Lobe,
}

impl Shadows {
    /// Are shadow rays traced with `technique` under these parameters?
    pub fn under(self, technique: &dyn AnyTechnique, params: &ParamValues) -> bool {
        match self {
            Self::Auto => technique.self_shadowing(params),
            Self::Off => false,
            Self::Ray | Self::Map(_) | Self::Volume | Self::Lobe => true,
        }
    }

    /// Occluders between the points of `mesh` and lights. Fails where maps need more than `max_memory` bytes.
    pub(crate) fn blocker(
        self,
        mesh: &Mesh,
        direct: &Direct,
        local: &LocalLights,
        max_memory: u64,
    ) -> Result<Arc<dyn Blocker>, Error> {
        let lights = || -> Vec<LightAt> {
            let disks = direct.disks.iter().map(|d| d.direction);
            let cells = direct.cells.iter().map(|c| c.inside(0.5, 0.5));
            let directionals = direct.directionals.iter().chain(&local.directionals).map(|d| d.direction);
            let far = disks.chain(cells).chain(directionals).map(|d| LightAt::Far(d.as_vec3()));
            let near = direct.points.iter().chain(&local.points).map(|p| LightAt::Near(p.position));
            far.chain(near).collect()
        };
        Ok(match self {
            Self::Map(options) => {
                let lights = lights();
                let near = lights.iter().filter(|l| matches!(l, LightAt::Near(_))).count();
                let bytes = ShadowMaps::bytes(lights.len() - near, near, options);
                if bytes > max_memory {
                    return Err(Error::failed(format!(
                        "shadow maps of {} lights and {} texels a side need {} MiB, beyond the limit of {} MiB: fewer texels, \
                         or rays",
                        lights.len(),
                        options.size,
                        bytes >> 20,
                        max_memory >> 20
                    )));
                }
                Arc::new(ShadowMaps::new(mesh, &Bvh::build(mesh), &lights, options))
            }
            Self::Volume => Arc::new(ShadowVolumes::new(mesh, &lights())),
            _ => Arc::new(Bvh::build(mesh)),
        })
    }
}

/// Receives messages.
type Listener = Arc<dyn Fn(&Notice) + Send + Sync>;

/// State common to all requests: progress, cancellation and limits ([`Task`]), how lights are read, where
/// pictures are computed, and the provenance of files that are written.
pub struct Session {
    /// Progress, cancellation and the limit of memory.
    pub task: Task,
    /// Treatment of finite negative radiance in inputs.
    pub negative: Negative,
    /// Treatment of disks and directional lights under a technique; by default they are folded into its data.
    pub suns: Suns,
    /// Where pictures are computed.
    pub backend: Backend,
    /// Method of shading on a GPU.
    pub gpu_path: GpuPath,
    /// Settings of the path tracer.
    pub paths: Paths,
    /// Shadowing of the lights that are shaded in addition to a technique's data.
    pub shadows: Shadows,
    /// Under [`Shadows::Lobe`]: shadow data shared by all pictures from now on, which show one scene in one
    /// light. Techniques then have the reference's visibility.
    pub(crate) common_shadows: Option<Arc<crate::material::CommonShadows>>,
    provenance: Provenance,
    notes: Vec<(String, String)>,
    listener: Option<Listener>,
}

impl Default for Session {
    fn default() -> Self {
        Self::new()
    }
}

impl Session {
    /// A session without progress reports and without a listener.
    pub fn new() -> Self {
        Self {
            task: Task::quiet(),
            negative: Negative::Keep,
            suns: Suns::Fold,
            backend: Backend::default(),
            gpu_path: GpuPath::default(),
            paths: Paths::default(),
            shadows: Shadows::default(),
            common_shadows: None,
            provenance: Provenance::new([]),
            notes: Vec::new(),
            listener: None,
        }
    }

    /// This session with another task.
    pub fn with_task(mut self, task: Task) -> Self {
        self.task = task;
        self
    }

    /// This session with `arguments` as the command line in the provenance of its files; paths lose their
    /// folders.
    pub fn with_arguments(mut self, arguments: impl IntoIterator<Item = String>) -> Self {
        self.provenance = Provenance::new(arguments);
        self
    }

    /// This session with `listener` called for every message.
    pub fn with_listener(mut self, listener: impl Fn(&Notice) + Send + Sync + 'static) -> Self {
        self.listener = Some(Arc::new(listener));
        self
    }

    /// Limits for readers.
    pub fn limits(&self) -> Limits {
        Limits { max_memory: self.task.max_memory(), ..Limits::default() }
    }

    /// Tells the listener.
    pub fn tell(&self, notice: Notice) {
        if let Some(listener) = &self.listener {
            listener(&notice);
        }
    }

    /// Tells the listener of something odd in an input.
    pub(crate) fn warn(&self, name: impl std::fmt::Display, what: impl std::fmt::Display) {
        self.tell(Notice::Input { name: name.to_string(), what: what.to_string() });
    }

    /// Tells the listener anything else.
    pub(crate) fn say(&self, line: impl std::fmt::Display) {
        self.tell(Notice::Remark(line.to_string()));
    }

    /// Records an input file for the provenance; a name without a file is ignored.
    pub fn note_input(&mut self, path: &Path) {
        if let Ok(input) = Input::of_file(path)
            && !self.provenance.inputs.contains(&input)
        {
            self.provenance.inputs.push(input);
        }
    }

    /// Notes the reached error for the provenance.
    pub fn note_error(&mut self, error: impl Into<String>) {
        self.provenance.error = Some(error.into());
    }

    /// Clears inputs, error and notes, so that files written from now on have their own provenance.
    pub fn begin_output(&mut self) {
        self.provenance.inputs.clear();
        self.provenance.error = None;
        self.notes.clear();
    }

    /// Records metadata of files written from now on.
    pub fn note(&mut self, pair: (String, String)) {
        self.notes.push(pair);
    }

    /// Where outputs come from.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Provenance and recorded metadata, as pairs for files.
    pub fn provenance_pairs(&self) -> Vec<(String, String)> {
        let mut pairs = self.provenance.pairs();
        pairs.extend(self.notes.iter().cloned());
        pairs
    }

    /// Provenance and recorded metadata, line by line, for the comment above a text.
    pub fn provenance_lines(&self) -> Vec<String> {
        self.provenance_pairs().into_iter().map(|(k, v)| format!("{k}: {v}")).collect()
    }

    /// Fails once the task was cancelled.
    pub fn check(&self) -> Result<(), Error> {
        Ok(self.task.check()?)
    }
}
