//! Film, tone mapping, image metrics, contact sheets, the scene file and the CPU renderer.

pub mod background;
pub mod film;
pub mod maps;
pub mod material;
pub mod metrics;
pub mod normal_map;
pub mod picture;
pub mod scenefile;
pub mod sheet;
pub mod texture;
pub mod tone;

pub use background::{Backdrop, Background};
pub use film::{Display, Film};
pub use maps::{Maps, NormalFiltering};
pub use material::{FileMaterial, MIN_ALPHA};
pub use metrics::{Errors, errors};
pub use normal_map::NormalMap;
pub use picture::{BakeShader, DirectShader, JudgeShader, Settings, Shader, Stage, Surface, render};
pub use scenefile::{SceneError, SceneFile};
pub use sheet::{Cell, Row, Sheet};
pub use texture::Texture;
pub use tone::{Develop, ToneMapper};
