//! Every technique, one line each.

use crate::local::ErasedLocal;
use crate::rooms::{
    ambient, analytic_decomposition, banks_env, banks_table, btf_pca, bump_blinn_phong, bump_horizon,
    clustered_pca, diffuse_map, factored_lighting, gaussian_lobes, haar_transport, homomorphic,
    lafortune_env, lafortune_svbrdf, lobe_maps, matrix_radiance_transfer, mirror_map, paraboloid_filter,
    phong_diffuse_maps, polynomial_texture_map, precomputed_visibility, prt_brdf, prt_diffuse, prt_glossy,
    reflection_space_ibr, separable_svd, sh_brdf, sh_irradiance, shift_variant, shrm, shrm_global,
    shrm_slices, split_sum, vertex_analytic,
};
use crate::{AnyLocal, AnyTechnique, Erased};

// Static, not constant: a constant, and with it all techniques, would be compiled again in each crate that
// reads it.
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

/// The technique called `slug`, in which `-` and `_` are equivalent.
pub fn find(slug: &str) -> Option<&'static dyn AnyTechnique> {
    let slug = slug.replace('-', "_");
    registry().iter().copied().find(|t| t.card().slug == slug)
}

static LOCALS: &[&dyn AnyLocal] = &[
    &ErasedLocal::<vertex_analytic::VertexAnalytic>::new(),
    &ErasedLocal::<banks_table::BanksTable>::new(),
    &ErasedLocal::<analytic_decomposition::AnalyticDecomposition>::new(),
    &ErasedLocal::<separable_svd::SeparableSvd>::new(),
    &ErasedLocal::<homomorphic::Homomorphic>::new(),
    &ErasedLocal::<bump_blinn_phong::BumpBlinnPhong>::new(),
    &ErasedLocal::<bump_horizon::BumpHorizon>::new(),
    &ErasedLocal::<precomputed_visibility::PrecomputedVisibility>::new(),
    &ErasedLocal::<polynomial_texture_map::PolynomialTextureMap>::new(),
    &ErasedLocal::<btf_pca::BtfPca>::new(),
    &ErasedLocal::<lafortune_svbrdf::LafortuneSvbrdf>::new(),
    &ErasedLocal::<shift_variant::ShiftVariant>::new(),
];

/// Every technique for local light, in the order of menus.
pub fn locals() -> &'static [&'static dyn AnyLocal] {
    LOCALS
}

/// The technique for local light called `slug`, in which `-` and `_` are equivalent.
pub fn find_local(slug: &str) -> Option<&'static dyn AnyLocal> {
    let slug = slug.replace('-', "_");
    locals().iter().copied().find(|t| t.card().slug == slug)
}
