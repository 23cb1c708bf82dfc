//! Film, tone mapping, image metrics, contact sheets, the scene file and the CPU renderer.

pub mod background;
pub mod film;
pub mod material;
pub mod metrics;
pub mod picture;
pub mod plot;
pub mod scenefile;
pub mod sheet;
pub mod tone;

pub use background::{Backdrop, Background};
pub use film::{Display, Film};
pub use material::{FileMaterial, MIN_ALPHA};
pub use metrics::{Errors, errors};
pub use picture::{
    BakeShader, DirectShader, LobeShadow, LobeShadowShader, PathShader, PathStage, ReferenceShader, Settings,
    Shader, Stage, Surface, render,
};
pub use scenefile::{SceneError, SceneFile};
pub use sheet::{Cell, Row, Sheet};
pub use steradian_scene::surface::{NormalFiltering, NormalMap, SurfaceMaps, Texture};
pub use tone::{Develop, ToneMapper};
