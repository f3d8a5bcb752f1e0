//! COLLADA 1.4: the text of a file in, the triangles of its scene out. Only what says where triangles are is read: geometries, and the nodes that place them.
//!
//! `up_axis` is passed over, as the viewers of ROS do: files of robots say `Y_UP` and mean the frame of the link. A file without a scene gives all its
//! geometries.

use nalgebra::{Matrix4, Point3, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use teachtree_description::mesh::Mesh;

/// Limits of what a file may contain.
const MAX_NODES: u32 = 1_000_000;
const MAX_DEPTH: usize = 64;
const MAX_VISITED: usize = 1 << 16;
const MAX_POINTS: usize = 4 << 20;

type Ids<'a> = HashMap<&'a str, Node<'a, 'a>>;

fn named<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

/// Reads the triangles, m.
pub(super) fn read(text: &str) -> Result<Mesh, String> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, allow_dtd: false, entity_resolver: None };
    let document = Document::parse_with_options(text, options).map_err(|error| error.to_string())?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(format!("found `{}`, expected `COLLADA`", root.tag_name().name()));
    }
    let unit = named(root, "asset").flat_map(|asset| named(asset, "unit")).find_map(|unit| unit.attribute("meter"));
    let unit =
        unit.map_or(Ok(1.0), |unit| unit.trim().parse::<f64>()).map_err(|_| "`unit` has no number in `meter`")?;
    let ids: Ids<'_> = root.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let mut reader = Reader { ids, geometries: HashMap::new(), visited: 0, made: Mesh::default() };
    let whole = Matrix4::new_scaling(unit);
    let scene = named(root, "scene").flat_map(|scene| named(scene, "instance_visual_scene")).next();
    match scene.map(|scene| reader.target(scene, "url")).transpose()? {
        Some(scene) => {
            for node in named(scene, "node") {
                reader.node(node, &whole, 0)?;
            }
        }
        None => {
            for geometry in named(root, "library_geometries").flat_map(|library| named(library, "geometry")) {
                reader.place(geometry, &whole)?;
            }
        }
    }
    Ok(reader.made)
}

struct Reader<'a> {
    ids: Ids<'a>,
    geometries: HashMap<usize, Mesh>,
    visited: usize,
    made: Mesh,
}

impl<'a> Reader<'a> {
    /// The element that an attribute `#id` names.
    fn target(&self, node: Node<'a, 'a>, key: &str) -> Result<Node<'a, 'a>, String> {
        let name = node.attribute(key).unwrap_or_default();
        let found = name.strip_prefix('#').and_then(|id| self.ids.get(id)).copied();
        found.ok_or_else(|| format!("`{}` names `{name}`, which does not exist", node.tag_name().name()))
    }

    /// A node of the scene with all that is below it.
    fn node(&mut self, node: Node<'a, 'a>, above: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err(format!("its nodes are nested more than {MAX_DEPTH} deep"));
        }
        // Instances of instances may be many.
        self.visited += 1;
        if self.visited > MAX_VISITED {
            return Err(format!("its scene has more than {MAX_VISITED} nodes"));
        }
        let mut here = *above;
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "node" => self.node(child, &here, depth + 1)?,
                "instance_node" => {
                    let target = self.target(child, "url")?;
                    self.node(target, &here, depth + 1)?;
                }
                "instance_geometry" => {
                    let geometry = self.target(child, "url")?;
                    self.place(geometry, &here)?;
                }
                _ => here *= transform(child)?,
            }
        }
        Ok(())
    }

    /// Adds a geometry where it is.
    fn place(&mut self, geometry: Node<'a, 'a>, at: &Matrix4<f64>) -> Result<(), String> {
        let key = geometry.range().start;
        if !self.geometries.contains_key(&key) {
            let mut made = Mesh::default();
            for mesh in named(geometry, "mesh") {
                self.mesh(mesh, &mut made)?;
            }
            self.geometries.insert(key, made);
        }
        if let Some(mesh) = self.geometries.get(&key) {
            let size = |mesh: &Mesh| mesh.points.len() + mesh.triangles.len();
            if size(&self.made) + size(mesh) > MAX_POINTS {
                return Err(format!("it has more than {MAX_POINTS} corners and triangles"));
            }
            self.made.extend(mesh.map(|point| at.transform_point(point)));
        }
        Ok(())
    }

    fn mesh(&self, mesh: Node<'a, 'a>, made: &mut Mesh) -> Result<(), String> {
        // The first corner and the number of corners of each source.
        let mut sources: HashMap<usize, (usize, usize)> = HashMap::new();
        for faces in mesh.children().filter(Node::is_element) {
            let kind = faces.tag_name().name();
            if !["triangles", "polylist", "polygons", "tristrips", "trifans"].contains(&kind) {
                continue;
            }
            let mut corner = None;
            let mut stride = 0;
            for input in named(faces, "input") {
                let offset: usize =
                    input.attribute("offset").unwrap_or("0").trim().parse().map_err(|_| "`offset` is not a number")?;
                if offset >= 64 {
                    return Err(format!("`offset` is {offset}, expected less than 64"));
                }
                stride = stride.max(offset + 1);
                if input.attribute("semantic") == Some("VERTEX") {
                    corner = Some((offset, self.target(input, "source")?));
                }
            }
            let Some((offset, vertices)) = corner else { continue };
            let position = named(vertices, "input").find(|input| input.attribute("semantic") == Some("POSITION"));
            let source = self.target(position.ok_or("`vertices` has no `POSITION`")?, "source")?;
            let (first, count) = match sources.entry(source.range().start) {
                Entry::Occupied(known) => *known.get(),
                Entry::Vacant(new) => {
                    let first = made.points.len();
                    self.points(source, made)?;
                    *new.insert((first, made.points.len() - first))
                }
            };
            let counts: Vec<usize> = named(faces, "vcount").next().map_or(Ok(Vec::new()), numbers)?;
            for list in named(faces, "p") {
                let indices: Vec<usize> = numbers(list)?;
                let corners: Vec<usize> = indices.iter().skip(offset).step_by(stride).copied().collect();
                if let Some(index) = corners.iter().find(|index| **index >= count) {
                    return Err(format!("`p` names the corner {index}, and there are {count}"));
                }
                let mut add = |a: usize, b: usize, c: usize| made.triangles.push([a, b, c].map(|at| first + at));
                let mut fan = |face: &[usize]| {
                    for pair in face.windows(2).skip(1) {
                        add(face[0], pair[0], pair[1]);
                    }
                };
                match kind {
                    "triangles" => corners.chunks_exact(3).for_each(&mut fan),
                    "tristrips" => corners.windows(3).for_each(&mut fan),
                    "polylist" => {
                        let mut rest = corners.as_slice();
                        for count in &counts {
                            let Some((face, after)) = rest.split_at_checked(*count) else {
                                return Err("`p` has fewer corners than `vcount` declares".into());
                            };
                            fan(face);
                            rest = after;
                        }
                    }
                    _ => fan(&corners),
                }
            }
        }
        Ok(())
    }

    /// Adds the positions of a source.
    fn points(&self, source: Node<'a, 'a>, made: &mut Mesh) -> Result<(), String> {
        let accessor = named(source, "technique_common").flat_map(|common| named(common, "accessor")).next();
        let array = match accessor {
            Some(accessor) => self.target(accessor, "source")?,
            None => named(source, "float_array").next().ok_or("a `source` has no `float_array`")?,
        };
        let of = |key: &str, or: usize| {
            let text = accessor.and_then(|accessor| accessor.attribute(key));
            text.map_or(Ok(or), |text| text.trim().parse::<usize>()).map_err(|_| format!("`{key}` is not a number"))
        };
        let (stride, offset) = (of("stride", 3)?, of("offset", 0)?);
        if stride < 3 {
            return Err(format!("positions have a `stride` of {stride}, expected 3 or more"));
        }
        let values: Vec<f64> = numbers(array)?;
        let values = values.get(offset..).unwrap_or_default().chunks(stride);
        made.points
            .extend(values.filter(|point| point.len() >= 3).map(|point| Point3::new(point[0], point[1], point[2])));
        Ok(())
    }
}

/// The numbers in an element.
fn numbers<T: std::str::FromStr>(node: Node<'_, '_>) -> Result<Vec<T>, String> {
    let wrong = |text: &str| {
        format!("`{}` has `{}`, expected numbers", node.tag_name().name(), text.chars().take(20).collect::<String>())
    };
    let words = node.text().unwrap_or_default().split_ascii_whitespace();
    words.map(|text| text.parse().map_err(|_| wrong(text))).collect()
}

/// What an element of a node does to what follows; nothing for those that place nothing.
fn transform(node: Node<'_, '_>) -> Result<Matrix4<f64>, String> {
    let name = node.tag_name().name();
    let count = match name {
        "matrix" => 16,
        "rotate" => 4,
        "translate" | "scale" => 3,
        "lookat" | "skew" => return Err(format!("it has a `{name}`, which is not read")),
        _ => return Ok(Matrix4::identity()),
    };
    let values: Vec<f64> = numbers(node)?;
    if values.len() != count || values.iter().any(|value| !value.is_finite()) {
        return Err(format!("`{name}` has {} numbers, expected {count}", values.len()));
    }
    let three = Vector3::from_iterator(values.iter().copied().chain([0.0; 3]).take(3));
    Ok(match name {
        "matrix" => Matrix4::from_row_slice(&values),
        "translate" => Matrix4::new_translation(&three),
        "scale" => Matrix4::new_nonuniform_scaling(&three),
        _ => {
            let angle = values[3].to_radians();
            Unit::try_new(three, 1e-9)
                .map_or_else(Matrix4::identity, |axis| Rotation3::from_axis_angle(&axis, angle).to_homogeneous())
        }
    })
}
