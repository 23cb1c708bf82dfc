//! Every technique, one line each.

use crate::rooms::{
    ambient, banks_env, clustered_pca, diffuse_map, factored_lighting, gaussian_lobes, haar_transport,
    lafortune_env, lobe_maps, matrix_radiance_transfer, mirror_map, paraboloid_filter, phong_diffuse_maps,
    prt_brdf, prt_diffuse, prt_glossy, reflection_space_ibr, sh_brdf, sh_irradiance, shrm, shrm_global,
    shrm_slices, split_sum,
};
use crate::{AnyTechnique, Erased};

// Static, not constant: a constant, and with it all techniques, would be compiled again in each crate that reads it.
static TECHNIQUES: &[&dyn AnyTechnique] = &[
    &Erased::<mirror_map::MirrorMap>::new(),
    &Erased::<sh_irradiance::ShIrradiance>::new(),
    &Erased::<diffuse_map::DiffuseMap>::new(),
    &Erased::<phong_diffuse_maps::PhongDiffuseMaps>::new(),
    &Erased::<split_sum::SplitSum>::new(),
    &Erased::<reflection_space_ibr::ReflectionSpaceIbr>::new(),
    &Erased::<factored_lighting::FactoredLighting>::new(),
    &Erased::<sh_brdf::ShBrdf>::new(),
    &Erased::<lobe_maps::LobeMaps>::new(),
    &Erased::<gaussian_lobes::GaussianLobes>::new(),
    &Erased::<lafortune_env::LafortuneEnv>::new(),
    &Erased::<paraboloid_filter::ParaboloidFilter>::new(),
    &Erased::<banks_env::BanksEnv>::new(),
    &Erased::<shrm::Shrm>::new(),
    &Erased::<shrm_global::ShrmGlobal>::new(),
    &Erased::<shrm_slices::ShrmSlices>::new(),
    &Erased::<ambient::Ambient>::new(),
    &Erased::<prt_diffuse::PrtDiffuse>::new(),
    &Erased::<prt_glossy::PrtGlossy>::new(),
    &Erased::<prt_brdf::PrtBrdf>::new(),
    &Erased::<clustered_pca::ClusteredPca>::new(),
    &Erased::<matrix_radiance_transfer::MatrixRadianceTransfer>::new(),
    &Erased::<haar_transport::HaarTransport>::new(),
];

/// Every technique, in the order of menus.
pub fn registry() -> &'static [&'static dyn AnyTechnique] {
    TECHNIQUES
}

/// The technique called `slug`; `-` and `_` are the same.
pub fn find(slug: &str) -> Option<&'static dyn AnyTechnique> {
    let slug = slug.replace('-', "_");
    registry().iter().copied().find(|t| t.card().slug == slug)
}
