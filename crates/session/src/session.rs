//! The session: limits, progress, provenance, and who is told what happens.

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

/// How a GPU shades pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GpuPath {
    /// What is faster on the adapter: compute on software adapters and data-centre accelerators, else raster.
    #[default]
    Auto,
    /// In the fragment shader, multisampled.
    Raster,
    /// In compute shaders, from a visibility buffer.
    Compute,
}

/// What shadows the lights that are shaded beside a technique's data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shadows {
    /// Rays under techniques that know shadows, nothing under the others.
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
    /// ([`steradian_render::LobeShadowShader`]): under techniques that know no shadows, whose data may hold
    /// suns, and under the reference.
    Lobe,
}

impl Shadows {
    /// Are rays traced beside `technique` with these parameters?
    pub fn under(self, technique: &dyn AnyTechnique, params: &ParamValues) -> bool {
        match self {
            Self::Auto => technique.self_shadowing(params),
            Self::Off => false,
            Self::Ray | Self::Map(_) | Self::Volume | Self::Lobe => true,
        }
    }

    /// What stands between the points of `mesh` and lights. Fails where maps need more than `max_memory`
    /// bytes.
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

/// Who is told what happens.
type Listener = Arc<dyn Fn(&Notice) + Send + Sync>;

/// What every request shares: progress, cancellation and limits ([`Task`]), how lights are read, where
/// pictures are computed, and the provenance of what is written.
pub struct Session {
    /// Progress, cancellation and the limit of memory.
    pub task: Task,
    /// What becomes of finite negative radiance in inputs.
    pub negative: Negative,
    /// What becomes of disks and directional lights under a technique: folded into its data, unless this says
    /// otherwise.
    pub suns: Suns,
    /// Where pictures are computed.
    pub backend: Backend,
    /// How a GPU shades them.
    pub gpu_path: GpuPath,
    /// What is asked of the path tracer.
    pub paths: Paths,
    /// What shadows lights beside a technique's data.
    pub shadows: Shadows,
    /// Under [`Shadows::Lobe`]: what all pictures from now on have in common, of one scene in one light. Then
    /// techniques have the reference's visibility.
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
    /// A session without progress that nobody listens to.
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

    /// The same session with another task.
    pub fn with_task(mut self, task: Task) -> Self {
        self.task = task;
        self
    }

    /// The same session whose files say that it was called with `arguments`; paths lose their folders.
    pub fn with_arguments(mut self, arguments: impl IntoIterator<Item = String>) -> Self {
        self.provenance = Provenance::new(arguments);
        self
    }

    /// The same session that tells `listener` what happens.
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

    /// Notes an input file for the provenance; what is no file is ignored.
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

    /// Forgets inputs, error and notes: what is written from now on has inputs of its own.
    pub fn begin_output(&mut self) {
        self.provenance.inputs.clear();
        self.provenance.error = None;
        self.notes.clear();
    }

    /// Notes what files written from now on say of their content.
    pub fn note(&mut self, pair: (String, String)) {
        self.notes.push(pair);
    }

    /// Where outputs come from.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// The same, and what was noted of their content, as pairs for files.
    pub fn provenance_pairs(&self) -> Vec<(String, String)> {
        let mut pairs = self.provenance.pairs();
        pairs.extend(self.notes.iter().cloned());
        pairs
    }

    /// The same line by line, for the comment above a text.
    pub fn provenance_lines(&self) -> Vec<String> {
        self.provenance_pairs().into_iter().map(|(k, v)| format!("{k}: {v}")).collect()
    }

    /// Fails once the caller has asked to stop.
    pub fn check(&self) -> Result<(), Error> {
        Ok(self.task.check()?)
    }
}
