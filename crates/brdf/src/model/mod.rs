//! One file per reflectance model.

pub mod abc;
pub mod ashikhmin_shirley;
pub mod blinn_phong;
pub mod charlie;
pub mod cook_torrance;
mod cosine_power;
pub mod dielectric;
pub mod ggx;
pub mod lafortune;
mod lafortune_file;
pub mod lambert;
pub mod lobes;
pub(crate) mod merl_fits;
pub mod microfacet;
pub mod minnaert;
pub mod oren_nayar;
pub mod phong;
pub mod poulin_fournier;
pub(crate) mod published;
pub mod sgd;
pub mod strand;
pub mod ward;

use crate::registry::Entry;

/// Every model, in the order in which it is listed.
pub(crate) static ENTRIES: &[Entry] = &[
    lambert::ENTRY,
    oren_nayar::ENTRY,
    minnaert::ENTRY,
    phong::PHONG,
    phong::PHONG_MAP,
    phong::PHONG_NORMALIZED,
    blinn_phong::ENTRY,
    blinn_phong::GL,
    microfacet::ENTRY,
    cook_torrance::ENTRY,
    ggx::ENTRY,
    dielectric::ENTRY,
    charlie::ENTRY,
    ward::ENTRY,
    ashikhmin_shirley::ENTRY,
    lafortune::ENTRY,
    strand::BANKS,
    strand::BANKS_MAP,
    strand::KAJIYA_KAY,
    poulin_fournier::ENTRY,
    sgd::ENTRY,
    abc::ENTRY,
];
