//! Every byte in or out, as plain data: images, meshes, tensors. This crate knows no meaning: it does not
//! know what an environment or a reflectance is.
//!
//! Limits are checked before allocation; errors are typed and name file and fault in one line; files are
//! written beside their destination and renamed, so that a failed write leaves the old file whole.

mod atomic;
mod bc6h;
mod below;
mod bsdf;
pub mod btf;
pub mod cie;
mod color;
mod container;
mod csv;
mod dds;
pub mod error;
mod hdr;
mod image;
mod ktx1;
mod ktx2;
mod ldr;
mod limits;
pub mod lp;
mod measured;
mod merl;
pub mod mesh;
mod openexr;
pub mod packed;
mod pfm;
mod photograph;
pub mod ptm;
pub mod raster;
mod srgb;
mod stored;
mod tensors;
mod texel;
mod tga;

pub use atomic::{WriteSeek, check_writable, write_atomic, write_atomic_seek, write_dir_atomic};
pub use below::{file_below, stays_below};
pub use bsdf::decode_bsdf;
pub use btf::{BtfList, BtfPicture, decode_btf, read_btf, write_btf};
pub use container::{Container, TexelStorage};
pub use csv::{CsvTable, decode_csv, decode_csv_like, read_csv, write_csv};
pub use dds::{decode_dds, read_dds, write_dds};
pub use error::{FormatError, Limits};
pub use image::{
    ExrCompression, ExrSamples, NO_IMAGE, ReadOptions, WriteOptions, WriteReport, decode_image,
    decode_image_with, is_image, read_file, read_image, read_image_with, read_photograph, read_text,
    write_image,
};
pub use ktx1::{decode_ktx1, read_ktx1, write_ktx1};
pub use ktx2::{
    Supercompression, TextureArray, TextureLevels, decode_ktx2, decode_ktx2_array, read_ktx2,
    read_ktx2_array, write_ktx2, write_ktx2_array, write_ktx2_as,
};
pub use lp::{LightPosition, decode_lp, line_of_light, read_lp, write_lp};
pub use measured::{
    AltaTable, AstmTable, BrdfLab, BrdfLabFit, BrdfLabLobe, CornellTable, CuretTable, MerlAnisotropic,
    NBRDF_NUMBERS, NPF_BYTES, NPF_COLUMNS, UTIA_BYTES, UTIA_DIRECTIONS, UTIA_ELEVATIONS, UTIA_TURNS,
    UtiaTable, decode_alta, decode_astm, decode_brdflab, decode_cornell, decode_curet,
    decode_curet_directions, decode_merl_anisotropic, decode_nbrdf, decode_npf, decode_utia,
};
pub use merl::{MERL_BYTES, MERL_CELLS, MERL_DIMENSIONS, MerlTable, decode_merl, write_merl};
pub use mesh::{MeshData, decode_mesh, read_mesh};
pub use photograph::Photograph;
pub use ptm::{
    Ptm, PtmCoefficients, PtmPlanes, PtmTexels, decode_ptm, read_ptm, write_ptm, write_ptm_planes,
};
pub use raster::{Channel, Raster};
pub use srgb::{linear_to_srgb, srgb_to_linear};
pub use stored::StoredTexture;
pub use tensors::{
    Tensor, TensorData, TensorFile, TensorNumbers, TensorParts, decode_tensors, read_tensors, write_tensors,
    write_tensors_as, write_tensors_with,
};
pub use texel::TexelFormat;
