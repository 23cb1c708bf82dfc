//! The rooms. Rooms never import rooms: what two share moves down a layer.

pub mod diffuse_map;
pub mod mirror_map;
pub mod phong_diffuse_maps;
pub mod sh_irradiance;
pub mod split_sum;
