//! `graph`: trees and transitions as diagrams, and what is marked in them.

use crate::program::{all_said, said, teachtree, teachtree_in};
use roxmltree::Document;
use std::path::Path;
use std::process::Output;

/// A lid: open leads only to Close, a leaf that can never be, and characters that every form has a meaning of its own for.
const LID: &str = r#"
stream { lid.angle : scalar rad  lid.speed : scalar rad/s }
param open = 20 deg
primitive Shut, Lift, Close, Never, Open
tree lid for each hand, settle 40 ms {
  rest: not (lid.angle > open) {
    lid.speed > 0.1 rad/s and from(none, Shut, Lift) => Lift
    lid.speed > 3 rad/s and lid.speed < 2 rad/s      => Never   // both cannot hold
    from(Open, Close)                                => Close
    else                                             => Shut
  }
  lid.speed < -0.1 rad/s => Close
  else                   => Open
}
"#;

fn lid(args: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lid.rules"), LID).unwrap();
    let output = teachtree_in(folder.path(), &[&["graph", "lid.rules"], args].concat());
    assert!(output.status.success(), "{}", all_said(&output));
    said(&output)
}

#[test]
fn a_tree_is_drawn_in_every_form() {
    for form in ["text", "dot", "mermaid", "svg"] {
        insta::assert_snapshot!(format!("tree_{form}"), lid(&["--format", form]));
    }
}

#[test]
fn transitions_are_drawn_in_every_form() {
    for form in ["text", "dot", "mermaid", "svg"] {
        insta::assert_snapshot!(format!("transitions_{form}"), lid(&["--transitions", "--format", form]));
    }
}

/// A rectangle of a picture: where it lies, and its text with the x at which that begins.
struct Box {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

fn number(node: roxmltree::Node, name: &str) -> f64 {
    node.attribute(name).map_or(0.0, |text| text.parse().unwrap())
}

/// Checks that no two boxes of a picture overlap, that all lie within it, and that texts stay in their boxes; how many there are.
fn boxes(svg: &str) -> usize {
    let document = Document::parse(svg).unwrap();
    let root = document.root_element();
    let (width, height) = (number(root, "width"), number(root, "height"));
    let mut all: Vec<Box> = Vec::new();
    for rect in root.descendants().filter(|node| node.has_tag_name("rect")) {
        let (left, top) = (number(rect, "x"), number(rect, "y"));
        let one = Box { left, top, right: left + number(rect, "width"), bottom: top + number(rect, "height") };
        assert!(one.left >= 0.0 && one.top >= 0.0 && one.right <= width && one.bottom <= height, "outside: {rect:?}");
        // The texts that follow in the same group up to the next box; hints stand beside lines.
        let texts =
            rect.next_siblings().skip(1).take_while(|node| !node.has_tag_name("rect") && !node.has_tag_name("path"));
        for text in texts.filter(|node| node.has_tag_name("text")) {
            let written: String =
                text.descendants().filter_map(|part| part.text().filter(|_| part.is_text())).collect();
            // The narrowest common letters of code are 0.6 em wide: 7.2.
            let end = number(text, "x") + written.chars().count() as f64 * 7.2;
            assert!(end <= one.right && number(text, "y") <= one.bottom, "`{written}` leaves its box");
        }
        let meets = |other: &Box| {
            one.left < other.right && other.left < one.right && one.top < other.bottom && other.top < one.bottom
        };
        assert!(!all.iter().any(meets), "two boxes overlap at {left}, {top}");
        all.push(one);
    }
    all.len()
}

#[test]
fn no_boxes_of_a_tree_overlap() {
    // 7 choices and 6 leaves.
    assert_eq!(boxes(&lid(&["--format", "svg"])), 13);
    for rules in ["contact.rules", "bimanual.rules", "examples/desk_surgemes.rules"] {
        let svg = said(&teachtree(&["graph", rules, "--format", "svg"]));
        assert!(boxes(&svg) > 5, "{rules}");
    }
}

const LIFT: [&str; 4] =
    ["--log", "demos/robosuite/SawyerLift_demo_1.csv", "--binding", "demos/robosuite/sawyer_lift.binding.yaml"];

fn on_lift(args: &[&str]) -> Output {
    teachtree(&[&["graph", "contact.rules"], &LIFT[..], args].concat())
}

#[test]
fn the_branch_that_was_taken_is_marked() {
    let text = said(&on_lift(&["--at", "10.92s"]));
    insta::assert_snapshot!(text);
    // It is what `explain` says.
    let explained = teachtree(
        &[&["explain", LIFT[1]], &LIFT[2..], &["--rules", "contact.rules", "--at", "10.92s", "--format", "json"]]
            .concat(),
    );
    let document: serde_json::Value = serde_json::from_str(&said(&explained)).unwrap();
    let steps = document["explanations"][0]["path"].as_array().unwrap();
    let folded = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let wanted: Vec<String> = steps
        .iter()
        .map(|step| {
            format!("{} {}", if step["taken"] == true { "yes" } else { "no" }, step["choice"].as_str().unwrap())
        })
        .collect();
    let marked = text.lines().filter(|line| line.starts_with("yes ") || line.starts_with("no "));
    assert_eq!(marked.map(folded).collect::<Vec<_>>(), wanted);
    // In the picture the same choices are thick, and what was not asked is pale.
    let svg = said(&on_lift(&["--at", "10.92s", "--format", "svg"]));
    boxes(&svg);
    let document = Document::parse(&svg).unwrap();
    let thick = |class: &str| {
        let of = |node: &roxmltree::Node| node.has_tag_name("rect") && node.attribute("class") == Some(class);
        document.descendants().filter(of).count()
    };
    let taken = steps.iter().filter(|step| step["taken"] == true).count();
    assert_eq!((thick("box taken"), thick("leaf taken")), (taken, 1));
    for form in ["dot", "mermaid"] {
        let drawn = said(&on_lift(&["--at", "10.92s", "--format", form]));
        assert!(drawn.contains("right at 10.924 s: Turn") && drawn.contains("#1a56db"), "{drawn}");
    }
}

#[test]
fn what_followed_what_is_counted() {
    insta::assert_snapshot!(said(&on_lift(&["--transitions", "--at", "10.92s"])));
    let svg = said(&on_lift(&["--transitions", "--format", "svg"]));
    let document = Document::parse(&svg).unwrap();
    let counts = document.descendants().filter(|node| node.attribute("class") == Some("middle"));
    let seen: usize = counts.map(|node| node.text().unwrap().parse::<usize>().unwrap()).sum();
    let dot = said(&on_lift(&["--transitions", "--format", "dot"]));
    let labels = dot.lines().filter(|line| line.contains("->")).filter_map(|line| line.split("label=\"").nth(1));
    let drawn: usize = labels.map(|rest| rest.split('"').next().unwrap().parse::<usize>().unwrap()).sum();
    assert_eq!(seen, drawn);
    assert!(seen > 5, "{seen}");
}

#[test]
fn what_cannot_be_drawn_is_said() {
    for (args, wanted) in [
        (&["graph", "--log", LIFT[1]][..], "found no time at which the tree is marked"),
        (&["graph", "--at", "2s"], "--log"),
        (&["graph", "--binding", LIFT[3]], "are for a recording, found none"),
        (&["graph", "--log", LIFT[1], "--binding", LIFT[3], "--at", "1s"], "the recording goes from 7.904 s"),
        (
            &["graph", "--log", LIFT[1], "--binding", LIFT[3], "--at", "9s", "--track", "left"],
            "no tree that labels `left`",
        ),
        (&["graph", "--compiled", "--format", "svg"], "cannot be used with"),
        (&["graph", "rules/contact.rules", "-o", "rules/contact.rules"], "is an input of this command"),
    ] {
        let output = teachtree(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        assert!(all_said(&output).contains(wanted), "{args:?}: {}", all_said(&output));
    }
}

#[test]
fn the_readme_of_graphs_shows_what_the_program_says() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/graph.md")).unwrap();
    let of_page = said(&on_lift(&["--at", "10.92s"]));
    let shown = page.split("```text\n").nth(1).and_then(|rest| rest.split("\n```").next()).unwrap();
    assert!(of_page.starts_with(shown), "docs/graph.md shows another text than\n{of_page}");
}
