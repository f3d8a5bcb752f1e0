//! Bytes of a file in, triangles out: STL and OBJ by a library, and COLLADA.

use super::collada;
use nalgebra::Point3;
use std::collections::HashMap;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;
use teachtree_description::mesh::Mesh;

/// How files of meshes end; others are not opened.
pub(super) const ENDINGS: [&str; 3] = ["stl", "obj", "dae"];

/// The ending of a file in lower case.
pub(super) fn ending(path: &Path) -> String {
    path.extension().map_or_else(String::new, |ending| ending.to_string_lossy().to_lowercase())
}

/// Reads a mesh; its ending says in which format it is. The message of an error has no subject.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, InputError> {
    let name = path.display().to_string();
    let format = ending(path);
    let damaged = |why: String| InputError::new(&name, format!("cannot be read as {}: {why}", format.to_uppercase()));
    let mesh = guarded(&name, || match format.as_str() {
        "dae" => {
            let text = std::str::from_utf8(bytes).map_err(|_| damaged("it is not valid UTF-8".into()))?;
            let mesh = collada::read(text).map_err(damaged)?;
            Ok(joined(mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.points[corner]))))
        }
        "obj" => {
            let scene = mesh_loader::obj::from_slice(bytes, None, |_| Ok(Vec::new()));
            scene.map(of_scene).map_err(|error| damaged(error.to_string()))
        }
        _ => {
            if let Some(why) = cut_off(bytes) {
                return Err(damaged(why));
            }
            mesh_loader::stl::from_slice(bytes).map(of_scene).map_err(|error| damaged(error.to_string()))
        }
    })?;
    if mesh.triangles.is_empty() {
        return Err(damaged("it has no triangles".into()));
    }
    if mesh.points.iter().any(|point| point.iter().any(|part| !part.is_finite())) {
        return Err(damaged("it has a coordinate that is not a number".into()));
    }
    Ok(mesh)
}

/// Why a binary STL is cut off, if it is. The library computes the number of triangles from the length of the file. A file with more triangles than its header
/// says is read.
fn cut_off(bytes: &[u8]) -> Option<String> {
    let count = u32::from_le_bytes(bytes.get(80..84)?.try_into().ok()?) as usize;
    let there = (bytes.len() - 84) / 50;
    let text = bytes.trim_ascii_start().starts_with(b"solid");
    (!text && there < count).then(|| format!("it has {there} of {count} triangles"))
}

fn of_scene(scene: mesh_loader::Scene) -> Mesh {
    let triangles = scene.meshes.iter().flat_map(|mesh| {
        let corner = |at: u32| mesh.vertices.get(at as usize).copied().unwrap_or([f32::NAN; 3]);
        mesh.faces.iter().map(move |face| face.map(|at| Point3::from(corner(at).map(f64::from))))
    });
    joined(triangles)
}

/// A mesh of triangles; corners at the same place become one.
fn joined(triangles: impl Iterator<Item = [Point3<f64>; 3]>) -> Mesh {
    let mut made = Mesh::default();
    let mut places: HashMap<[u64; 3], usize> = HashMap::new();
    for triangle in triangles {
        made.triangles.push(triangle.map(|corner| {
            *places.entry(corner.coords.map(f64::to_bits).into()).or_insert_with(|| {
                made.points.push(corner);
                made.points.len() - 1
            })
        }));
    }
    made
}
