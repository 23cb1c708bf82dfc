//! The techniques. Techniques never import techniques: what two share moves down a layer.

pub mod ambient;
pub mod analytic_decomposition;
pub mod banks_env;
pub mod banks_table;
pub mod clustered_pca;
pub mod diffuse_map;
pub mod factored_lighting;
pub mod gaussian_lobes;
pub mod haar_transport;
pub mod lafortune_env;
pub mod lobe_maps;
pub mod matrix_radiance_transfer;
pub mod mirror_map;
pub mod paraboloid_filter;
pub mod phong_diffuse_maps;
pub mod prt_brdf;
pub mod prt_diffuse;
pub mod prt_glossy;
pub mod reflection_space_ibr;
pub mod sh_brdf;
pub mod sh_irradiance;
pub mod shrm;
pub mod shrm_global;
pub mod shrm_slices;
pub mod split_sum;
pub mod vertex_analytic;
