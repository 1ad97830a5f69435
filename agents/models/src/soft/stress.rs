//! The stress in a soft body, in a state that it has published.
//!
//! In: a body of the specification of the one that published it, and the snapshot. Out: a number for every vertex. Never here: steps, damping.
//! Theory: docs/theory/soft.md, eq. 6, 9, 28.

use super::body::SoftBody;
use super::fe_mesh::FeMesh;
use super::material::Law;
use super::spec::SoftMatter;
use glam::DVec3;
use metachron_contact::Agent;
use metachron_core::Snapshot;

impl SoftBody {
    /// The von Mises stress of the elastic forces at every vertex of a state that a body of the same specification published, Pa, ≥ 0: the mean of
    /// the elements around it by volume, of sheets in the middle of their thickness. The body takes that state. `None` where it is no state
    /// of such a body, and once cells were removed.
    pub fn von_mises_pa(&mut self, state: &Snapshot) -> Option<Vec<f64>> {
        if state.removed.cells > 0 {
            return None;
        }
        state.resolution.into_iter().for_each(|resolution| self.set_resolution(resolution));
        self.set_state(&state.body).ok()?;
        let of_nodes = self.mesh.von_mises_pa(&self.positions, &self.spec.matter);
        let Some(skin) = &self.skin else { return Some(of_nodes) };
        // weights of a point beside its cell may be below zero
        let carried =
            skin.carried().iter().map(|point| point.terms().map(|(node, share)| of_nodes[node] * share).sum());
        Some(carried.map(|stress: f64| stress.max(0.0)).collect())
    }
}

impl FeMesh {
    fn von_mises_pa(&self, positions: &[DVec3], matter: &SoftMatter) -> Vec<f64> {
        let mut sums = vec![[0.0; 2]; self.rest.len()];
        let mut add = |vertices: &[u32], volume: f64, stress_pa: f64| {
            for vertex in vertices {
                let [weighted, whole] = &mut sums[*vertex as usize];
                (*weighted, *whole) = (*weighted + volume * stress_pa, *whole + volume);
            }
        };
        for bar in &self.bars {
            add(&bar.ends, bar.rest_m, matter.young_pa * bar.strain(positions).abs());
        }
        for membrane in &self.membranes {
            add(membrane.vertices(), membrane.mass_kg().iter().sum(), membrane.von_mises_pa(positions));
        }
        let law = Law::of(matter);
        for cell in &self.hexahedra {
            let deformation = { *cell }.deformation(&self.kinds[cell.kind], positions);
            add(&cell.vertices, cell.mass_kg.iter().sum(), deformation.von_mises_pa(&law));
        }
        for element in &self.tetrahedra {
            let deformation = { *element }.follow(positions);
            add(&element.vertices, element.volume_m3, deformation.von_mises_pa(&self.laws[element.material]));
        }
        sums.into_iter().map(|[weighted, whole]| if whole > 0.0 { weighted / whole } else { 0.0 }).collect()
    }
}
