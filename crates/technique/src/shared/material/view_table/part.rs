//! The reflectance's factor of techniques that shade by a table of views.

use super::{Places, ViewTable, energy};
use crate::shared::material::reflectance;
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Material, Part};
use steradian_base::Task;
use steradian_brdf::views::Energies;
use steradian_brdf::{Brdf, SharedBrdf};

/// The reflectance and its table.
pub struct Views {
    /// c_i(wo).
    pub table: ViewTable,
    /// Energies of the reflectance, and the errors of its table.
    pub energies: Energies,
    /// The reflectance itself.
    pub brdf: SharedBrdf,
    /// Selects the tables of a point, where the reflectance varies.
    pub places: Option<Places>,
}

impl Views {
    /// The table of a material, of `size`² texels, stored as 16-bit floats where `halves`.
    pub fn bake(
        slug: &'static str,
        m: &Material,
        [bands, size]: [usize; 2],
        halves: bool,
        task: &Task,
    ) -> Result<Self, BakeError> {
        let need = 2 * ViewTable::need(bands, size);
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        let mut table = ViewTable::bake(&*m.brdf, bands, size, task)?;
        if halves {
            table.halve();
        }
        let energies = Energies::new(&*m.brdf, bands, |wo| table.lookup(wo), task)?;
        Ok(Self { table, energies, brdf: m.brdf.clone(), places: None })
    }

    /// [`Views::bake`] of a material whose widths vary over the surface.
    pub fn vary(
        slug: &'static str,
        m: &Material,
        [bands, size]: [usize; 2],
        halves: bool,
        places: Places,
        task: &Task,
    ) -> Result<Self, BakeError> {
        let all = places.reflectances(slug, &*m.brdf)?;
        let need = 2 * all.len() as u64 * ViewTable::need(bands, size);
        if need > task.max_memory() {
            return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
        }
        let brdfs: Vec<&dyn Brdf> = all.iter().map(|b| &**b).collect();
        let mut table = ViewTable::of_all(&brdfs, bands, size, task)?;
        if halves {
            table.halve();
        }
        let energies = Energies::of_all(&all, bands, |k, wo| table.lookup_of(k, wo), task)?;
        Ok(Self { table, energies, brdf: m.brdf.clone(), places: Some(places) })
    }
}

impl Part for Views {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.table.save(to, prefix);
        energy::save(&self.energies, to, prefix);
        reflectance::put(to, &format!("steradian.{prefix}.brdf"), &*self.brdf);
        if let Some(places) = &self.places {
            places.save(to, prefix);
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let (table, places) = (ViewTable::load(from, prefix)?, Places::load(from, prefix)?);
        if table.tables() != places.as_ref().map_or(1, |p| p.nodes().iter().product()) {
            return Err(PartError::Unexpected(format!("{prefix}.views")));
        }
        Ok(Self {
            table,
            places,
            energies: energy::load(from, prefix)?,
            brdf: reflectance::kept(from, &format!("steradian.{prefix}.brdf"))?,
        })
    }

    fn bytes(&self) -> usize {
        self.table.bytes() + self.places.as_ref().map_or(0, Places::bytes)
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        Some(&*self.brdf)
    }
}
