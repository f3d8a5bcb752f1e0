//! Meshes of a URDF: names in; convex pieces that are kept clear of other things, and what the links look like, out.
//!
//! The cost of meshes from untrusted files is limited: see the constants here and in the files of the steps.

mod collada;
mod formats;
mod paths;
mod pieces;

use nalgebra::{Point3, Vector3};
pub(super) use paths::Packages;
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;
use teachtree_description::mesh::{Mesh, MeshName, MeshUse};
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::KinematicTree;

/// The largest file of a mesh, bytes.
pub const MAX_BYTES: u64 = 64 << 20;
/// Maximum number of triangles in all files of a robot.
const MAX_TRIANGLES: usize = 4 << 20;
/// Maximum number of meshes of a robot that are decomposed; each takes up to some tenths of a second.
const MAX_TAKEN_APART: usize = 100;
/// Maximum extent of a mesh, m: a larger mesh is in other units.
const MAX_LENGTH_M: f64 = 5.0;
/// Maximum number of triangles in the drawing of a robot, and of a link.
const MAX_DRAWN: usize = 16_000;
const MAX_DRAWN_OF_LINK: usize = 1_500;

/// Reads a whole file of at most [`MAX_BYTES`]; `None` where there is no such file.
pub type BytesOf<'a> = &'a dyn Fn(&Path) -> Result<Option<Vec<u8>>, InputError>;

/// Which meshes of a URDF are read.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum Meshes {
    /// Those of `collision` and of `visual`.
    #[default]
    All,
    /// Those of `collision`.
    Clearance,
    /// None.
    None,
}

/// A file and its scale.
type ScaledFile = (String, Vector3<f64>);

/// A cache of meshes, so that each file is read once.
#[derive(Default)]
struct MeshCache {
    files: Vec<(String, Arc<Mesh>)>,
    pieces: Vec<(ScaledFile, Vec<CollisionShape>)>,
    triangles: usize,
}

/// Reads the meshes of a tree into its links.
pub(super) fn load(
    tree: &mut KinematicTree,
    names: &[MeshName],
    wanted: Meshes,
    packages: &Packages<'_>,
    bytes_of: BytesOf<'_>,
) -> Result<(), InputError> {
    let mut read = MeshCache::default();
    let mut looks: Vec<Mesh> = vec![Mesh::default(); tree.links.len()];
    for name in names {
        match (wanted, name.usage) {
            (Meshes::None, _) | (Meshes::Clearance, MeshUse::Picture) => {}
            (_, MeshUse::Clearance) => {
                let pieces = read.pieces(name, packages, bytes_of)?;
                let link = tree.links.get_mut(name.link);
                if let Some(link) = link {
                    link.solids.extend(pieces.iter().map(|piece| piece.moved(&name.at)));
                }
            }
            (Meshes::All, MeshUse::Picture) => {
                let mesh = read.scaled(name, packages, bytes_of)?;
                if let Some(look) = looks.get_mut(name.link) {
                    look.extend(mesh.map(|point| name.at * point));
                }
            }
        }
    }
    // The drawing has fewer triangles for each link, the more links there are.
    let drawn = looks.iter().filter(|look| !look.triangles.is_empty()).count();
    let most = MAX_DRAWN_OF_LINK.min(MAX_DRAWN / drawn.max(1));
    for (link, look) in tree.links.iter_mut().zip(looks) {
        if !look.triangles.is_empty() {
            link.look = Some(Arc::new(look.simplified(most)));
        }
    }
    Ok(())
}

impl MeshCache {
    /// Returns the scaled mesh of a name.
    fn scaled(&mut self, name: &MeshName, packages: &Packages<'_>, bytes_of: BytesOf<'_>) -> Result<Mesh, InputError> {
        let mesh = self.mesh(name, packages, bytes_of)?;
        let mesh = mesh.map(|point| Point3::from(point.coords.component_mul(&name.scale)));
        let [low, high] = mesh.bounds();
        let length = (high - low).max();
        if length > MAX_LENGTH_M {
            let message =
                format!("`{}` is {} m long, at most {MAX_LENGTH_M} m are read", name.file, ShortNumber(length));
            let error = InputError::new(&name.place, message);
            return Err(if length / 1e3 < MAX_LENGTH_M {
                error.help("a mesh in millimeters needs `scale=\"0.001 0.001 0.001\"`")
            } else {
                error
            });
        }
        Ok(mesh)
    }

    fn mesh(
        &mut self,
        name: &MeshName,
        packages: &Packages<'_>,
        bytes_of: BytesOf<'_>,
    ) -> Result<Arc<Mesh>, InputError> {
        if let Some((_, mesh)) = self.files.iter().find(|(file, _)| *file == name.file) {
            return Ok(mesh.clone());
        }
        let wrong = |error: InputError| InputError { place: name.place.clone(), ..error };
        let (path, bytes) = packages.find(&name.file, bytes_of).map_err(wrong)?;
        let mesh = formats::read(&path, &bytes)
            .map_err(|error| InputError::new(&name.place, format!("`{}` {}", name.file, error.message)))?;
        self.triangles += mesh.triangles.len();
        if self.triangles > MAX_TRIANGLES {
            let message = format!("the meshes have more than {MAX_TRIANGLES} triangles together");
            return Err(InputError::new(&name.place, message));
        }
        let mesh = Arc::new(mesh);
        self.files.push((name.file.clone(), mesh.clone()));
        Ok(mesh)
    }

    /// The convex pieces of the mesh of a name, in its own frame.
    fn pieces(
        &mut self,
        name: &MeshName,
        packages: &Packages<'_>,
        bytes_of: BytesOf<'_>,
    ) -> Result<Vec<CollisionShape>, InputError> {
        let key = (name.file.clone(), name.scale);
        if let Some((_, pieces)) = self.pieces.iter().find(|(known, _)| *known == key) {
            return Ok(pieces.clone());
        }
        if self.pieces.len() == MAX_TAKEN_APART {
            let message = format!("more than {MAX_TAKEN_APART} meshes for collision");
            return Err(InputError::new(&name.place, message).help("`meshes: none` in the robot file leaves them out"));
        }
        let pieces = pieces::of(&self.scaled(name, packages, bytes_of)?);
        self.pieces.push((key, pieces.clone()));
        Ok(pieces)
    }
}
