//! Errors of YAML texts: their place, what was found and expected, and the fix.

use indexmap::IndexMap;
use serde::Deserialize;
use teachtree_base::yaml;

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
#[allow(dead_code, reason = "the keys are only parsed")]
struct File {
    #[serde(default)]
    time: String,
    #[serde(default)]
    channels: IndexMap<String, String>,
    #[serde(default)]
    normals: Normals,
    #[serde(default)]
    list: Vec<String>,
}

#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "snake_case")]
enum Normals {
    #[default]
    ByForce,
    ByRole,
}

fn error(text: &str) -> String {
    yaml::read::<File>(text, "b.yaml").unwrap_err().to_string()
}

#[test]
fn errors_of_indentation_name_the_column_that_is_expected() {
    for (text, wanted) in [
        (
            "channels:\n  a: x\n  b: y\n c: z\n",
            "b.yaml:4:2: found `c: z` in column 2, expected column 3 as in line 3\n  help: indent all keys of a mapping by the same number of spaces",
        ),
        (
            "channels:\n  a: x\n\n  # of the thumb\n    b: y  # of the index\n",
            "b.yaml:5:5: found `b: y` in column 5, expected column 3 as in line 2\n  help: indent all keys of a mapping by the same number of spaces",
        ),
        (
            "time: t\n- list: x\n",
            "b.yaml:2:1: found an item of a list, expected a key as in line 1\n  help: indent the items of a list below their key",
        ),
        ("channels:\n\ta: x\n", "b.yaml:2:1: found a tab, expected spaces\n  help: YAML is indented with spaces"),
    ] {
        assert_eq!(error(text), wanted, "{text}");
    }
}

/// In a list that is not closed, the next key is read as an element.
#[test]
fn a_list_without_an_end_is_found_where_it_begins() {
    let expected = "b.yaml:2:7: found a list that is not closed in its line, expected `]` before the next key";
    for text in [
        "time: t\nlist: [a, b\nchannels: {a: x}\n",
        "time: t\nlist: [a, b,\nchannels: {a: x}\n",
        "time: t\nlist: [a, \"]\" # ]\n\n# the channels\nchannels:\n  a: x\n",
    ] {
        assert_eq!(error(text), expected, "{text}");
    }
    for fine in ["list: [a,\n  b]\n", "list: [\n  a:b,\n  \"c: d\"\n]\n"] {
        yaml::read::<File>(fine, "b.yaml").unwrap();
    }
    // Errors after a list that is closed are those of their places.
    assert!(error("list: [a,\n  b]\nnormals: by_roll\n").contains("found `by_roll`"));
}

#[test]
fn errors_of_signs_name_the_sign_that_is_expected() {
    const QUOTES: &str = "\n  help: put the whole value in quotes: `KEY: \"VALUE\"`";
    for (text, wanted, help) in [
        (
            "time: t\nnormals:by_role\nlist: [a]\n",
            "b.yaml:2:1: found `normals:by_role`, expected a key with `:` and a space after it",
            "\n  help: write `KEY: VALUE`",
        ),
        ("time: a: b\n", "b.yaml:1:8: found `:` in a value, expected one key with one value", QUOTES),
        ("time: \"a\" b\n", "b.yaml:1:11: found `b` after a value, expected the end of the line", QUOTES),
        ("time: @a\n", "b.yaml:1:7: found `@`, which cannot begin a value, expected a value in quotes", QUOTES),
        (
            "time: *a\n",
            "b.yaml:1:7: found `*a`, a reference to nothing, expected a value",
            "\n  help: put a value that begins with `*` in quotes",
        ),
        (
            "time: \"t\nlist: [a]\n",
            "b.yaml:1:7: found a quote that is not closed, expected another one at the end of the value",
            "",
        ),
        ("channels: {a: x\nlist: [a]\n", "b.yaml:1:11: found `{` that is not closed, expected `,` or `}`", ""),
        ("list: [a [mm], b]\n", "b.yaml:1:10: found `[mm], b]`, expected `,` or `]`", ""),
    ] {
        assert_eq!(error(text), format!("{wanted}{help}"), "{text}");
    }
}

#[test]
fn a_misspelled_key_or_name_is_answered_with_the_nearest() {
    for (text, place, near) in [
        ("time: t\nchannel: {a: x}\n", "b.yaml:2:1: found the key `channel`, expected one of ", "channels"),
        ("normals: by_rol\n", "b.yaml:1:10: normals: found `by_rol`, expected `by_force` or `by_role`", "by_role"),
    ] {
        let said = error(text);
        assert!(said.starts_with(place) && said.ends_with(&format!("\n  help: did you mean `{near}`?")), "{said}");
    }
    assert!(!error("quite_another: 1\n").contains("did you mean"));
}

/// A message that quotes a long line is short, and one about a line of several bytes a character is whole.
#[test]
fn quoted_lines_are_short() {
    let said = error(&format!("channels:\n  a: x\n {}: y\n", "ä".repeat(500)));
    assert!(said.contains(&format!("found `{}…` in column 2", "ä".repeat(40))), "{said}");
}
