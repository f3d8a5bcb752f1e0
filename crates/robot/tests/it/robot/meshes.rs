//! Meshes of a URDF: the three formats, pieces that hold the whole mesh, and what is refused.

use nalgebra::{Isometry3, Point3, Vector3};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_robot::{self as robot, CollisionShape, Robot};

type Corners = Vec<[f32; 3]>;

/// The corners and triangles of boxes in one mesh: low and high corner each.
fn boxes(all: &[[[f32; 3]; 2]]) -> (Corners, Vec<[usize; 3]>) {
    let (mut corners, mut triangles) = (Vec::new(), Vec::new());
    for [low, high] in all {
        let first = corners.len();
        corners.extend(
            (0..8).map(|at: usize| [0, 1, 2].map(|axis| if at >> axis & 1 == 1 { high[axis] } else { low[axis] })),
        );
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        triangles.extend(
            sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|it| it.map(|at: usize| first + at)),
        );
    }
    (corners, triangles)
}

fn cube() -> (Corners, Vec<[usize; 3]>) {
    boxes(&[[[-0.05; 3], [0.05; 3]]])
}

/// Two bars of 200 mm that meet at a right angle; they are 40 mm thick.
fn ell() -> (Corners, Vec<[usize; 3]>) {
    boxes(&[[[0.0; 3], [0.2, 0.04, 0.04]], [[0.0, 0.04, 0.0], [0.04, 0.2, 0.04]]])
}

fn binary_stl((corners, triangles): &(Corners, Vec<[usize; 3]>)) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flat_map(|at| corners[*at]).flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

fn text_stl((corners, triangles): &(Corners, Vec<[usize; 3]>)) -> Vec<u8> {
    let corner = |at: usize| format!("vertex {} {} {}\n", corners[at][0], corners[at][1], corners[at][2]);
    let facet =
        |it: &[usize; 3]| format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", it.map(corner).concat());
    format!("solid made\n{}endsolid made\n", triangles.iter().map(facet).collect::<String>()).into_bytes()
}

fn obj((corners, triangles): &(Corners, Vec<[usize; 3]>)) -> Vec<u8> {
    let corners = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect::<String>();
    let faces = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).collect::<String>();
    (corners + &faces).into_bytes()
}

/// In millimeters, and moved and moved back by its nodes.
fn dae((corners, triangles): &(Corners, Vec<[usize; 3]>)) -> Vec<u8> {
    let numbers = corners.iter().flatten().map(|at| (at * 1000.0).to_string()).collect::<Vec<_>>();
    let indices = triangles.concat().iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
    format!(
        r##"<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><unit meter="0.001"/><up_axis>Y_UP</up_axis></asset>
        <library_geometries><geometry id="g"><mesh><source id="s"><float_array id="a" count="{}">{}</float_array><technique_common>
        <accessor source="#a" count="{}" stride="3"/></technique_common></source><vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
        <triangles count="{}"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles></mesh></geometry></library_geometries>
        <library_visual_scenes><visual_scene id="w"><node><matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix><node><translate>-5 0 0</translate>
        <instance_geometry url="#g"/></node></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>"##,
        numbers.len(),
        numbers.join(" "),
        corners.len(),
        triangles.len()
    )
    .into_bytes()
}

/// A robot of one link with this element in its `geometry`, and these files beside `lab/robots/arm.urdf`.
fn read(keys: &str, mesh: &str, files: &[(&str, &[u8])]) -> Result<Robot, InputError> {
    let part = |name: &str| format!("<{name}><origin xyz='0 0 1'/><geometry>{mesh}</geometry></{name}>");
    let urdf = format!("<robot>\n<link name='base'>\n{}\n{}</link></robot>", part("collision"), part("visual"));
    let text_of = |file: &str| {
        Ok(if file.ends_with(".urdf") { urdf.clone() } else { format!("name: one\nurdf: arm.urdf\n{keys}") })
    };
    let root = std::path::absolute("lab").unwrap();
    let bytes_of = |path: &Path| {
        let path = std::path::absolute(path).unwrap();
        let named = |name: &str| path == root.join(name);
        Ok(files.iter().find(|(name, _)| named(name)).map(|(_, bytes)| bytes.to_vec()))
    };
    robot::open_with_meshes("lab/robots/one.yaml", &text_of, &bytes_of)
}

fn refused(mesh: &str, files: &[(&str, &[u8])]) -> String {
    read("", mesh, files).unwrap_err().to_string()
}

/// The gap between a shape and those of the first link.
fn gap(robot: &Robot, other: &CollisionShape) -> f64 {
    robot.tree.links[0].solids.iter().map(|solid| solid.gap(other)).fold(f64::INFINITY, f64::min)
}

fn ball(at: [f64; 3], radius: f64) -> CollisionShape {
    CollisionShape::Capsule(Point3::from(at), Point3::from(at), radius)
}

#[test]
fn a_cube_is_kept_clear_in_each_format() {
    let cube = cube();
    for (name, bytes) in
        [("c.stl", binary_stl(&cube)), ("c.STL", text_stl(&cube)), ("c.obj", obj(&cube)), ("c.dae", dae(&cube))]
    {
        let path = format!("robots/{name}");
        let robot = read("", &format!("<mesh filename='{name}'/>"), &[(&path, &bytes)]).unwrap();
        assert_eq!(robot.tree.links[0].solids.len(), 1, "{name}");
        // It stands 1 m up, with faces at 0.05 m; the last ball looks at a corner.
        let corner = 0.05 + 0.1 / 3.0_f64.sqrt();
        for (at, wanted) in [([0.2, 0.0, 1.0], 0.14), ([0.0, 0.0, 1.1], 0.04), ([corner, corner, 1.0 + corner], 0.09)] {
            let found = gap(&robot, &ball(at, 0.01));
            assert!((found - wanted).abs() < 1e-4, "{name}: {found} is not {wanted}");
        }
        let bounds = robot.tree.links[0].look.as_ref().unwrap().bounds();
        assert!((bounds[0] - Vector3::new(-0.05, -0.05, 0.95)).norm() < 1e-6, "{name}: {bounds:?}");
    }
}

#[test]
fn a_piece_is_as_far_from_boxes_and_pieces_as_a_box_is() {
    let robot = read("", "<mesh filename='c.obj' scale='2 1 1'/>", &[("robots/c.obj", &obj(&cube()))]).unwrap();
    let piece = robot.tree.links[0].solids[0].moved(&Isometry3::translation(0.0, 0.0, -1.0));
    let same = CollisionShape::Box(Isometry3::identity(), Vector3::new(0.1, 0.05, 0.05));
    for (shift, turn) in
        [([0.4, 0.1, 0.2], [0.3, 0.2, 0.1]), ([0.0, 0.0, 0.3], [0.0, 0.0, 0.0]), ([-0.3, 0.2, 0.1], [1.0, 0.5, 0.2])]
    {
        let at = Isometry3::new(shift.into(), turn.into());
        let wanted = same.gap(&same.moved(&at));
        for found in [piece.gap(&same.moved(&at)), same.gap(&piece.moved(&at)), piece.gap(&piece.moved(&at))] {
            assert!((found - wanted).abs() < 2e-5, "{found} is not {wanted}");
        }
    }
    let (volume, center, inertia) = piece.mass_properties();
    let (wanted, _, of_box) = same.mass_properties();
    assert!((volume - wanted).abs() < 1e-6 * wanted && center.coords.norm() < 1e-7 && (inertia - of_box).norm() < 1e-9);
}

/// Its hull would fill the corner.
#[test]
fn an_l_shape_becomes_pieces_that_hold_it_and_leave_its_corner_free() {
    let ell = ell();
    let mesh = "<mesh filename='l.stl'/>";
    let robot = read("", mesh, &[("robots/l.stl", &binary_stl(&ell))]).unwrap();
    let solids = &robot.tree.links[0].solids;
    assert!((2..=8).contains(&solids.len()), "{}", solids.len());
    let free = gap(&robot, &ball([0.09, 0.09, 1.02], 0.01));
    assert!(free > 0.03, "{free} of 0.04");
    // Points all over its faces are in a piece.
    for triangle in &ell.1 {
        let [a, b, c] = triangle.map(|at| Vector3::from(ell.0[at].map(f64::from)));
        for (i, j) in (0..=20).flat_map(|i| (0..=20 - i).map(move |j| (f64::from(i) / 20.0, f64::from(j) / 20.0))) {
            let point = Point3::from(a + (b - a) * i + (c - a) * j + Vector3::z());
            let outside = solids.iter().map(|solid| solid.distance(&point)).fold(f64::INFINITY, f64::min);
            assert!(outside < 1e-6, "{point} is {outside} m outside");
        }
    }
    let again = read("", mesh, &[("robots/l.stl", &binary_stl(&ell))]).unwrap();
    assert_eq!(*solids, again.tree.links[0].solids);
}

#[test]
fn packages_are_found_above_the_urdf_by_their_manifest_and_by_name() {
    let cube = obj(&cube());
    let mesh = "<mesh filename='package://arm/meshes/c.obj'/>";
    let manifest = b"<package><name>arm</name></package>".as_slice();
    let found =
        |keys: &str, files: &[(&str, &[u8])]| read(keys, mesh, files).map(|robot| robot.tree.links[0].solids.len());
    assert_eq!(found("", &[("robots/arm/meshes/c.obj", &cube)]), Ok(1), "beside the URDF");
    assert_eq!(found("", &[("arm/meshes/c.obj", &cube)]), Ok(1), "beside a folder above it");
    assert_eq!(found("", &[("package.xml", manifest), ("meshes/c.obj", &cube)]), Ok(1), "by `package.xml`");
    let elsewhere = [("robots/../data/meshes/c.obj", cube.as_slice())];
    assert!(found("", &elsewhere).is_err());
    assert_eq!(found("packages: {arm: ../data}", &elsewhere), Ok(1), "where the robot file says");
    assert_eq!(found("meshes: none", &[]), Ok(0));
    let error = read("", mesh, &[]).unwrap_err().to_string();
    assert!(error.contains("lab/robots/arm.urdf:3:") && error.contains("packages: {arm: FOLDER}"), "{error}");
}

#[test]
fn what_is_wrong_with_a_mesh_is_said_at_the_line_of_the_urdf() {
    let large = boxes(&[[[0.0; 3], [80.0, 50.0, 50.0]]]);
    let cut = &binary_stl(&cube())[..300];
    let cyclic = r##"<COLLADA version="1.4.1"><library_visual_scenes><visual_scene id="w"><node id="n"><instance_node url="#n"/></node></visual_scene>
        </library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>"##;
    let cases: [(&str, &[u8], &[&str]); 9] = [
        ("m.stl", b"solid x\nfacet normal 0 0", &["`m.stl` cannot be read as STL"]),
        ("m.stl", cut, &["it has 4 of 12 triangles"]),
        ("m.obj", b"v 0 0 0\nf 1 2 3\n", &["`m.obj` cannot be read as OBJ"]),
        ("m.obj", b"v 0 0 0\n", &["it has no triangles"]),
        ("m.dae", b"<COLLADA", &["`m.dae` cannot be read as DAE"]),
        ("m.dae", cyclic.as_bytes(), &["nodes are nested more than 64 deep"]),
        ("m.glb", b"", &["expected a file that ends in one of `.stl`, `.obj`, `.dae`"]),
        ("m.stl", &binary_stl(&large), &["`m.stl` is 80 m long", "scale=\"0.001 0.001 0.001\""]),
        ("gone.stl", b"", &["`gone.stl` is missing"]),
    ];
    for (file, bytes, wanted) in cases {
        let path = format!("robots/{}", file.replace("gone", "other"));
        let error = refused(&format!("<mesh filename='{file}'/>"), &[(&path, bytes)]);
        assert!(error.starts_with("lab/robots/arm.urdf:3:"), "{error}");
        wanted.iter().for_each(|words| assert!(error.contains(words), "{words} is not in: {error}"));
    }
    let error = refused("<mesh filename='package://a/../../etc/m.stl'/>", &[]);
    assert!(error.contains("leaves its package"), "{error}");
}

/// Damage at any place of a file is an error or another mesh, never a panic.
#[test]
fn a_damaged_mesh_does_not_end_the_program() {
    let cube = cube();
    for (name, bytes) in
        [("c.stl", binary_stl(&cube)), ("c.stl", text_stl(&cube)), ("c.obj", obj(&cube)), ("c.dae", dae(&cube))]
    {
        let path = format!("robots/{name}");
        for at in (0..bytes.len()).step_by(bytes.len() / 8 + 1) {
            let mut damaged = bytes.clone();
            damaged[at] = if at % 2 == 0 { 0xff } else { b'9' };
            let _ = read("", &format!("<mesh filename='{name}'/>"), &[(&path, &damaged)]);
            let _ = read("", &format!("<mesh filename='{name}'/>"), &[(&path, &bytes[..at])]);
        }
    }
}
