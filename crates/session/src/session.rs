//! The session: limits, progress, provenance, and a listener for messages.

use crate::{Error, Notice, Paths};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::{Input, ParamValues, Provenance, Task};
use steradian_formats::{Limits, TensorFile};
use steradian_light::load::Negative;
use steradian_scene::shadow::{Blocker, LightAt, MapOptions, ShadowMaps, ShadowVolumes};
use steradian_scene::{Bvh, Mesh};
use steradian_techniques::direct::{Direct, Suns};
use steradian_techniques::local::LocalLights;
use steradian_techniques::{AnyTechnique, seal};

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
    /// Rays under techniques with self-shadowing, none under all other ones; but the ground of a scene is
    /// shaded as with [`Shadows::Lobe`] in pictures by the CPU, where its technique allows that.
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
    inputs: Option<InputFiles>,
}

/// Files that are read and files that will be written, of a session that serves one request.
#[derive(Default)]
struct InputFiles {
    /// Canonical paths of inputs.
    read: Vec<PathBuf>,
    /// Canonical paths of outputs that exist.
    written: Vec<PathBuf>,
    /// An input that was read although its path was to be written.
    clash: Option<String>,
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
            inputs: None,
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

    /// This session with outputs that replace none of its inputs, of which `known` are known before they are
    /// read: for one request. (A window reads what it saved, and may save it again.)
    pub fn with_kept_inputs(mut self, known: impl IntoIterator<Item = PathBuf>) -> Self {
        self.inputs = Some(InputFiles::default());
        known.into_iter().for_each(|path| self.reads(&path));
        self
    }

    /// Records a file as an input, which no output may replace.
    pub fn reads(&mut self, path: &Path) {
        let Some(inputs) = &mut self.inputs else { return };
        let Ok(place) = path.canonicalize() else { return };
        if inputs.written.contains(&place) {
            inputs.clash = Some(replaces(path));
        }
        if !inputs.read.contains(&place) {
            inputs.read.push(place);
        }
    }

    /// Announces a file that will be written: it must be none of the inputs, and none may be it.
    pub fn writes(&mut self, path: &Path) -> Result<(), Error> {
        self.spares(path)?;
        if let Some(inputs) = &mut self.inputs
            && path.is_file()
            && let Ok(place) = path.canonicalize()
        {
            inputs.written.push(place);
        }
        Ok(())
    }

    /// Refuses an input as the destination of an output.
    pub fn spares(&self, path: &Path) -> Result<(), Error> {
        let Some(inputs) = self.inputs.as_ref().filter(|_| path.is_file()) else { return Ok(()) };
        let kept = path.canonicalize().is_ok_and(|place| inputs.read.contains(&place));
        if kept { Err(Error::Usage(replaces(path))) } else { Ok(()) }
    }

    /// Refuses a folder of outputs in which an input has a name that one of them gets; `named` is asked of
    /// the paths of inputs below the folder.
    pub fn spares_in(&self, folder: &Path, named: impl Fn(&Path) -> bool) -> Result<(), Error> {
        let (Some(inputs), Ok(place)) = (&self.inputs, folder.canonicalize()) else { return Ok(()) };
        let mut below = inputs.read.iter().filter_map(|input| input.strip_prefix(&place).ok());
        below.find(|path| named(path)).map_or(Ok(()), |path| Err(Error::Usage(replaces(&folder.join(path)))))
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
        self.reads(path);
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

    /// The metadata that tensors of a bake are written with: their own, provenance, `more`, and the digest of
    /// all.
    pub(crate) fn sealed(
        &self,
        tensors: &TensorFile,
        more: BTreeMap<String, String>,
    ) -> BTreeMap<String, String> {
        let mut metadata = tensors.metadata.clone();
        metadata.extend(self.provenance_pairs());
        metadata.extend(more);
        seal(tensors, &mut metadata);
        metadata
    }

    /// Provenance and recorded metadata, line by line, for the comment above a text.
    pub fn provenance_lines(&self) -> Vec<String> {
        self.provenance_pairs().into_iter().map(|(k, v)| format!("{k}: {v}")).collect()
    }

    /// Fails once the task was cancelled, and where an input turned out to be what an output would replace.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(clash) = self.inputs.as_ref().and_then(|i| i.clash.as_ref()) {
            return Err(Error::usage(clash));
        }
        Ok(self.task.check()?)
    }
}

/// What is said of an output that would replace an input.
fn replaces(path: &Path) -> String {
    format!("{}: is an input, and would be replaced: give the output another name", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_output_replaces_an_input() {
        let d = tempfile::tempdir().expect("a folder");
        let at = |name: &str| d.path().join(name);
        ["light.hdr", "later.hdr", "out.hdr"]
            .iter()
            .for_each(|n| std::fs::write(at(n), "x").expect("written"));
        let mut kept = Session::new().with_kept_inputs([at("light.hdr")]);
        let why = kept.writes(&at("./light.hdr")).expect_err("an input").to_string();
        assert!(why.contains("is an input"), "{why}");
        assert!(kept.writes(&at("out.hdr")).is_ok() && kept.writes(&at("none.hdr")).is_ok());
        assert!(kept.spares_in(d.path(), |p| p == Path::new("light.hdr")).is_err());
        assert!(kept.spares_in(d.path(), |p| p == Path::new("out.hdr")).is_ok());
        kept.note_input(&at("later.hdr"));
        assert!(kept.spares(&at("later.hdr")).is_err() && kept.check().is_ok());
        kept.note_input(&at("out.hdr"));
        assert!(kept.check().is_err());
        // A session of many requests replaces what it likes.
        let mut free = Session::new();
        free.note_input(&at("light.hdr"));
        assert!(free.writes(&at("light.hdr")).is_ok());
    }
}
