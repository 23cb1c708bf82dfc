//! What techniques share: techniques never import techniques.

pub mod albedo;
pub mod angle;
pub mod apart;
pub mod batch;
pub mod bundle;
pub mod chain;
pub mod clustered;
pub mod distant;
pub mod exact;
pub mod glossy;
pub mod grid;
pub mod harmonics;
pub mod kernels;
pub mod light_rotation;
pub mod lights;
pub mod lobe;
pub mod matrices;
pub mod number;
pub mod once;
pub mod phong_lobe;
pub mod quadric;
pub mod reflectance;
pub mod sh_light;
pub mod shrm;
pub mod site_sum;
pub mod spectral_error;
pub mod spectrum;
pub mod strands;
pub mod sun;
pub mod sunlit_spectrum;
pub mod tables;
pub mod transport;
#[cfg(test)]
pub mod trial;
pub mod view_table;
pub mod views;
