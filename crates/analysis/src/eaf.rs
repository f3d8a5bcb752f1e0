//! The analysis as a file of ELAN (EAF 3.0): for each track a tier of primitives, one of their objects, and one of tasks.
//!
//! Times are milliseconds from the first frame; the property `teachtree.start_s` has its stamp. A boundary is rounded to the
//! next millisecond. The format demands a date: it is a constant, since the same input gives the same bytes.

use super::json::{Meta, VERSION};
use super::number::number;
use super::{Analysis, Track};
use std::fmt::Write as _;

/// The date that the format requires; no program reads it.
const DATE: &str = "1970-01-01T00:00:00+00:00";

/// An annotation: from when to when, ms, and what.
struct Annotation<'a> {
    from: u64,
    to: u64,
    value: &'a str,
    object: Option<&'a str>,
}

/// A tier before it is numbered.
struct Tier<'a> {
    name: String,
    kind: &'static str,
    track: String,
    annotations: Vec<Annotation<'a>>,
}

/// Writes the file.
pub fn eaf(analysis: &Analysis, meta: &Meta) -> String {
    let tiers: Vec<Tier> = analysis.tracks.iter().flat_map(|track| tiers(track, analysis.start_s)).collect();
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(
        text,
        "<ANNOTATION_DOCUMENT AUTHOR=\"teachtree {VERSION}\" DATE=\"{DATE}\" FORMAT=\"3.0\" VERSION=\"3.0\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
         xsi:noNamespaceSchemaLocation=\"http://www.mpi.nl/tools/elan/EAFv3.0.xsd\">"
    );
    let last: usize = tiers
        .iter()
        .map(|tier| tier.annotations.iter().map(|it| 1 + usize::from(it.object.is_some())).sum::<usize>())
        .sum();
    text.push_str("    <HEADER MEDIA_FILE=\"\" TIME_UNITS=\"milliseconds\">\n");
    let start = number(analysis.start_s);
    for (name, value) in [
        ("lastUsedAnnotationId", last.to_string()),
        ("teachtree.log", meta.log.clone()),
        ("teachtree.start_s", start),
        ("teachtree.digest", meta.digest.clone()),
    ] {
        let _ = writeln!(text, "        <PROPERTY NAME=\"{name}\">{}</PROPERTY>", escaped(&value));
    }
    text.push_str("    </HEADER>\n");
    slots(&mut text, &tiers);
    let mut next = (1, 1);
    tiers.iter().for_each(|tier| write_tier(&mut text, tier, &mut next));
    for (kind, more) in [
        ("primitive", "TIME_ALIGNABLE=\"true\""),
        ("object", "CONSTRAINTS=\"Symbolic_Association\" TIME_ALIGNABLE=\"false\""),
        ("task", "TIME_ALIGNABLE=\"true\""),
    ] {
        let _ =
            writeln!(text, "    <LINGUISTIC_TYPE GRAPHIC_REFERENCES=\"false\" LINGUISTIC_TYPE_ID=\"{kind}\" {more}/>");
    }
    text.push_str("    <CONSTRAINT DESCRIPTION=\"1-1 association with a parent annotation\" STEREOTYPE=\"Symbolic_Association\"/>\n");
    text.push_str("</ANNOTATION_DOCUMENT>\n");
    text
}

fn tiers(track: &Track, start_s: f64) -> [Tier<'_>; 2] {
    let ms = |time_s: f64| ((time_s - start_s) * 1000.0).round().max(0.0) as u64;
    let span = |from_s: f64, to_s: f64| (ms(from_s), ms(to_s).max(ms(from_s) + 1));
    let tier = |kind: &'static str, annotations| {
        let who = track.who.to_string();
        Tier { name: format!("{who} {kind}"), kind, track: who, annotations }
    };
    let primitives = track.relabeled.iter().map(|it| {
        let (from, to) = span(it.start_s, it.end_s);
        Annotation { from, to, value: &it.primitive, object: it.subject.object.as_deref() }
    });
    let tasks = track.tasks.iter().map(|it| {
        let (from, to) = span(it.start_s, it.end_s);
        Annotation { from, to, value: &it.task, object: None }
    });
    [tier("primitive", primitives.collect()), tier("task", tasks.collect())]
}

/// The times, in order; each annotation has two of its own, numbered in the order of annotations.
fn slots(text: &mut String, tiers: &[Tier]) {
    let ends = tiers.iter().flat_map(|tier| &tier.annotations).flat_map(|annotation| [annotation.from, annotation.to]);
    let mut slots: Vec<(u64, usize)> = ends.zip(1..).collect();
    slots.sort_unstable();
    text.push_str("    <TIME_ORDER>\n");
    for (ms, id) in slots {
        let _ = writeln!(text, "        <TIME_SLOT TIME_SLOT_ID=\"ts{id}\" TIME_VALUE=\"{ms}\"/>");
    }
    text.push_str("    </TIME_ORDER>\n");
}

/// Writes a tier, and that of its objects; `next` are the numbers of the next annotation and slot.
fn write_tier(text: &mut String, tier: &Tier, next: &mut (usize, usize)) {
    let (name, track) = (escaped(&tier.name), escaped(&tier.track));
    let open = |text: &mut String, kind: &str, name: &str, more: &str| {
        let _ = writeln!(
            text,
            "    <TIER LINGUISTIC_TYPE_REF=\"{kind}\"{more} PARTICIPANT=\"{track}\" TIER_ID=\"{name}\">"
        );
    };
    open(text, tier.kind, &name, "");
    let mut objects: Vec<(usize, &str)> = Vec::new();
    for annotation in &tier.annotations {
        let (id, slot) = *next;
        *next = (id + 1, slot + 2);
        objects.extend(annotation.object.map(|object| (id, object)));
        let (other, value) = (slot + 1, escaped(annotation.value));
        let _ = writeln!(
            text,
            "        <ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID=\"a{id}\" TIME_SLOT_REF1=\"ts{slot}\" TIME_SLOT_REF2=\"ts{other}\">\
             <ANNOTATION_VALUE>{value}</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>"
        );
    }
    text.push_str("    </TIER>\n");
    if objects.is_empty() {
        return;
    }
    open(text, "object", &format!("{name} object"), &format!(" PARENT_REF=\"{name}\""));
    for (of, object) in objects {
        let value = escaped(object);
        let _ = writeln!(
            text,
            "        <ANNOTATION><REF_ANNOTATION ANNOTATION_ID=\"a{}\" ANNOTATION_REF=\"a{of}\">\
             <ANNOTATION_VALUE>{value}</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION>",
            next.0
        );
        next.0 += 1;
    }
    text.push_str("    </TIER>\n");
}

/// Text as XML has it; characters that it cannot have are left out.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\t' | '\n' | '\r' => safe.push(' '),
            letter if letter < ' ' || matches!(letter, '\u{fffe}' | '\u{ffff}') => {}
            letter => safe.push(letter),
        }
    }
    safe
}
