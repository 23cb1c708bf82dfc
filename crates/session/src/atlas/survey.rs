//! Figure 11 of the survey, as printed.

use steradian_techniques::Capabilities;

/// A column's name, and whether a technique claims it.
pub type Column = (&'static str, fn(&Capabilities) -> bool);

/// The columns.
pub const COLUMNS: [Column; 11] = [
    ("diffuse", |c| c.diffuse),
    ("certain isotropic", |c| c.certain_isotropic),
    ("certain anisotropic", |c| c.certain_anisotropic),
    ("all isotropic", |c| c.all_isotropic),
    ("all anisotropic", |c| c.all_anisotropic),
    ("shift-variant", |c| c.shift_variant),
    ("bump mapping", |c| c.bump_mapping),
    ("self-shadowing", |c| c.self_shadowing),
    ("inter-reflections", |c| c.interreflections),
    ("dynamic lighting", |c| c.dynamic_lighting),
    ("dynamic objects", |c| c.dynamic_objects),
];

/// The printed row of a technique's paper, a character for each of [`COLUMNS`]: x supported, p potentially,
/// but not described in the paper, s shadowing and i interreflections with other methods, n near interactive,
/// d for diffuse surfaces in real time and for others interactively, w only without shadowing and
/// interreflections, · nothing. `None` for techniques that the figure does not list.
pub fn published(slug: &str) -> Option<&'static str> {
    Some(match slug {
        // Heidrich and Seidel 1998, for local light.
        "banks_table" => "x·x······xx",
        // Heidrich and Seidel 1999, for local light.
        "analytic_decomposition" => "xx·······xx",
        // Kautz and McCool 1999.
        "separable_svd" => "x··xx····xx",
        // Kilgard 2000.
        "bump_blinn_phong" => "xx····xsixx",
        // Vertex shader.
        "vertex_analytic" => "xxx······xx",
        // Heidrich et al. 2000.
        "bump_horizon" => "xx····xxxxx",
        // Kautz and Seidel 2000.
        "shift_variant" => "xxx··xxsixx",
        // McCool et al. 2001.
        "homomorphic" => "x··xx····xx",
        // Malzbender et al. 2001.
        "polynomial_texture_map" => "x·····xxxxx",
        // Suykens et al. 2003, Sattler et al. 2003 and Müller et al. 2003.
        "btf_pca" => "x··xxxxxxxx",
        // McAllister et al. 2002, for local light.
        "lafortune_svbrdf" => "x·x··xpsixx",
        // Heidrich and Seidel 1999, for environments.
        "phong_diffuse_maps" => "xx····x···x",
        // Kautz and McCool 2000.
        "lobe_maps" => "···x······x",
        // Cabral et al. 1999.
        "reflection_space_ibr" => "x··x······x",
        // Latta and Kolb 2002.
        "factored_lighting" => "x··x··p···x",
        // McAllister et al. 2002, for environments.
        "lafortune_env" => "··x··xp···x",
        // Ramamoorthi and Hanrahan 2001.
        "sh_irradiance" => "x········xx",
        // Ramamoorthi and Hanrahan 2002.
        "shrm" => "x··x·····nx",
        // Kautz et al. 2000.
        "paraboloid_filter" => "···x··p··xx",
        // Kautz et al. 2002.
        "sh_brdf" => "x··xxx···xx",
        // Sloan et al. 2002.
        "prt_diffuse" | "prt_glossy" => "x··xxxdxxxw",
        // Lehtinen et al. 2003.
        "matrix_radiance_transfer" => "x··xxx·xxxw",
        // Sloan et al. 2003.
        "clustered_pca" => "x··xxx·xxxw",
        // Ng et al. 2003.
        "haar_transport" => "x····xpxxxw",
        _ => return None,
    })
}
