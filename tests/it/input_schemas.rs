//! The schemas of the YAML files that people write, for their editors: made from the types that read those files, so that both say the same.

use crate::program::{complained, said, teachtree_in};
use crate::schemas::validated;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Kind of a file, what its schema is called, and the schema as it is made.
fn made() -> [(&'static str, Value); 6] {
    [
        ("binding", teachtree_frames::bind::schema()),
        ("operator", teachtree_world::operator_schema()),
        ("project", teachtree_session::project_file::schema()),
        ("robot", teachtree_robot::schema()),
        ("scene", teachtree_base::scene::schema()),
        ("variation", teachtree_robot::simulation::cell_variation::schema()),
    ]
    .map(|(kind, schema)| (kind, schema.to_value()))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// `TEACHTREE_UPDATE_SCHEMAS=1 cargo test input_schemas` writes them.
#[test]
fn the_schemas_are_those_of_the_readers() {
    for (kind, schema) in made() {
        let file = root().join(format!("schemas/{kind}.schema.json"));
        let text = format!("{schema:#}\n");
        if std::env::var_os("TEACHTREE_UPDATE_SCHEMAS").is_some() {
            std::fs::write(&file, &text).unwrap();
        }
        assert!(
            std::fs::read_to_string(&file).unwrap_or_default() == text,
            "{kind}: the schema is out of date, see above"
        );
    }
}

/// The YAML files of a folder and of those in it.
fn yaml_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            yaml_files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "yaml") {
            found.push(path);
        }
    }
}

fn kind_of(path: &Path, text: &Value) -> Option<&'static str> {
    let name = path.file_name()?.to_str()?;
    let has = |key: &str| text.get(key).is_some();
    match () {
        () if name.ends_with(".operator.yaml") => Some("operator"),
        () if name.ends_with(".binding.yaml") => Some("binding"),
        () if has("bodies") => Some("scene"),
        () if path.parent()?.ends_with("robots") => Some("robot"),
        () => None,
    }
}

/// All files that come with the program keep to them, and none with a key that is misspelt, with a unit of nothing, or without a key that is needed.
#[test]
fn the_files_of_the_repository_keep_to_the_schemas() {
    let mut files = vec![];
    for folder in ["demos", "examples", "robots", "scenes"] {
        yaml_files(&root().join(folder), &mut files);
    }
    files.sort();
    let schemas = made();
    let schema = |kind: &str| schemas.iter().find(|(name, _)| *name == kind).unwrap().1.clone();
    let mut counts = [("binding", 0), ("operator", 0), ("robot", 0), ("scene", 0)];
    let mut pairs = vec![];
    for file in &files {
        let text = std::fs::read_to_string(file).unwrap();
        let document: Value = serde_yaml::from_str(&text).unwrap();
        let Some(kind) = kind_of(file, &document) else { continue };
        // The first line names the schema to an editor.
        let named = text.lines().next().and_then(|line| line.strip_prefix("# yaml-language-server: $schema="));
        let place = named.and_then(|named| file.parent()?.join(named).canonicalize().ok());
        assert_eq!(place, Some(root().join(format!("schemas/{kind}.schema.json"))), "{}", file.display());
        counts.iter_mut().find(|(name, _)| *name == kind).unwrap().1 += 1;
        pairs.push((schema(kind), document));
    }
    assert!(counts.iter().all(|(_, count)| *count >= 6), "{counts:?}");
    if !validated(&pairs) {
        return;
    }
    // What each reader refuses, its schema refuses.
    let scene = json!({ "bodies": { "cube": { "role": "object", "mass": "50 g" } } });
    let wrong = |change: &dyn Fn(&mut Value)| {
        let mut document = scene.clone();
        change(&mut document);
        assert!(serde_yaml::from_str::<teachtree_base::scene::Scene>(&document.to_string()).is_err(), "{document}");
        let mut scheme = schema("scene");
        let parts = scheme.as_object_mut().unwrap().remove("$defs").unwrap();
        (json!({ "title": "no scene", "$defs": parts, "not": scheme }), document)
    };
    let refused = vec![
        wrong(&|scene| scene["bodies"]["cube"]["mas"] = "50 g".into()),
        wrong(&|scene| scene["bodies"]["cube"]["role"] = "objekt".into()),
        wrong(&|scene| scene["bodies"]["cube"]["mass"] = 50.into()),
        wrong(&|scene| {
            scene["bodies"]["cube"]["parts"] =
                json!([{ "box": ["1 mm", "1 mm", "1 mm"], "ad": ["1 mm", "1 mm", "1 mm"] }])
        }),
        wrong(&|scene| scene["bodies"]["cube"]["parts"] = json!([{ "at": ["1 mm", "1 mm", "1 mm"] }])),
        wrong(&|scene| drop(scene.as_object_mut().unwrap().remove("bodies"))),
    ];
    assert!(validated(&refused));
}

#[test]
fn check_names_what_is_wrong_with_a_file_at_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("cell.scene.yaml", "bodies:\n  cube: {role: object, mass: 50 g}\n");
    write("wrong.scene.yaml", "bodies:\n  cube: {role: objekt, mass: 50 g}\n");
    write("lab.binding.yaml", "channels:\n  right.thumb.force: f<xyz> [Nm]\n");
    write("nothing.yaml", "a: 1\n");
    let check = |args: &[&str]| teachtree_in(folder.path(), &[&["check"], args].concat());
    let fine = check(&["cell.scene.yaml"]);
    assert_eq!((fine.status.code(), said(&fine).as_str()), (Some(0), "cell.scene.yaml: a scene, without errors\n"));
    let wrong = check(&["cell.scene.yaml", "wrong.scene.yaml"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(complained(&wrong).contains("wrong.scene.yaml:2:16: bodies.cube.role: found"), "{}", complained(&wrong));
    assert!(complained(&check(&["nothing.yaml"])).contains("none of the keys of a scene"));
    let listed = check(&["wrong.scene.yaml", "--format", "json"]);
    let found: Value = serde_json::from_str(&said(&listed)).unwrap();
    assert_eq!(found["findings"][0]["labels"][0]["at"]["start"], json!({ "line": 2, "column": 16 }));
    let schema = std::fs::read_to_string(root().join("schemas/check-1.schema.json")).unwrap();
    validated(&[(serde_json::from_str(&schema).unwrap(), found)]);
    assert!(
        said(&check(&["wrong.scene.yaml", "--format", "github"]))
            .starts_with("::error file=wrong.scene.yaml,line=2,col=16,")
    );
    // All shipped ones are fine.
    let mut files = vec![];
    for folder in ["demos", "robots", "scenes"] {
        yaml_files(&root().join(folder), &mut files);
    }
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    let shipped =
        teachtree_in(root(), &[&["check"], &files.iter().map(String::as_str).collect::<Vec<_>>()[..]].concat());
    assert!(shipped.status.success(), "{}", complained(&shipped));
}
