//! Tests of `report`: the page, seen as text.

mod pages;

use crate::analysis::build::{self, chapter, leaves};
use pages::{experiment, html, knocked_page, measured, meta, noise, touch_channel, without_poses};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_analysis::json::Meta;
use teachtree_analysis::{Analysis, analyze, explain};
use teachtree_base::channels::{ChannelSpec, HANDLING};
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_language::rules::Rules;
use teachtree_report::{CHANNELS, channels};

/// The page without what its scripts read, and the scripts themselves.
fn written(page: &str) -> (String, String) {
    let (head, rest) = page.split_once("<script").unwrap();
    let (scripts, tail) = rest.rsplit_once("</script>").unwrap();
    (format!("{head}{tail}"), scripts.to_string())
}

/// What the scripts of the page read.
fn data(page: &str) -> Value {
    let (_, data) = page.split_once("id=\"data\">").unwrap();
    serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn the_channels_of_the_rules_come_first() {
    let mut rules = chapter();
    rules.channels = vec![touch_channel()];
    let names = |channels: &[ChannelSpec]| channels.iter().map(|channel| channel.name.clone()).collect::<Vec<_>>();
    let judged = names(&teachtree_analysis::channels(&rules));
    let asked = ["fingers.contact", "target", "target.position", "target.spin", "target.rotation", "target.radius"];
    assert_eq!(judged, [&asked[..], &HANDLING].concat());
    let drawn = names(&channels(&rules));
    assert_eq!(drawn[..judged.len()], judged);
    assert!(CHANNELS.iter().all(|name| drawn.iter().filter(|channel| channel == name).count() == 1));
}

#[test]
fn the_page_stands_alone_and_is_small() {
    let (analysis, frames, leaves) = experiment();
    let page = html(&analysis, &frames, &leaves, &meta());
    for outside in ["http:", "https:", "src=", "@import", "url(", "fetch(", "XMLHttpRequest", "WebSocket", "import("] {
        assert!(!page.contains(outside), "the page reaches for {outside}");
    }
    assert!(page.contains("demos/&lt;pick&gt; &amp; follow.csv") && !page.contains("<pick>"));
    assert!(page.contains("Grasp\n2.040 – 2.700 s, 660 ms\nwas Slide, Grasp\nby Slide Turn + between"));
    assert!(page.contains("Approach → Slide at 2.040 s"));
    assert!(page.contains("cut off at the end"));
    assert!(page.contains("no rows for 200 ms"));
    assert!(page.len() < 700_000, "{} bytes", page.len());
    assert_eq!(page, html(&analysis, &frames, &leaves, &meta()), "same input, same bytes");
}

#[test]
fn elements_are_closed_in_order() {
    let (analysis, frames, leaves) = experiment();
    let (page, _) = written(&html(&analysis, &frames, &leaves, &meta()));
    let mut open: Vec<&str> = Vec::new();
    for tag in page.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').unwrap();
        let name = tag.split([' ', '/']).find(|part| !part.is_empty()).unwrap_or("");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !["!DOCTYPE", "meta"].contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn noise_of_any_length_stays_small() {
    let size = |seconds: usize| {
        let stretch = 0..seconds * 1000;
        let mut frames = measured(std::slice::from_ref(&stretch));
        noise(&mut frames);
        let rules = chapter();
        let own = "Move 300 Approach 300 Grasp 400 Translate 500 Place 300 Release 200 ".repeat(seconds / 2);
        let leaves = [leaves(&rules, 0, &[("left", &own), ("right", &own)])];
        let page = html(&analyze(&rules, &frames, &leaves), &frames, &leaves, &meta());
        assert!(page.len() < 20_000 * seconds + 12_000_000, "{} bytes for two hands and {seconds} s", page.len());
        let data = data(&page);
        data["signals"].to_string().len() + data["replay"].to_string().len()
    };
    let (shorter, longer) = (size(165), size(230));
    assert!(longer < shorter + shorter / 10, "curves of {shorter} bytes in 165 s, of {longer} in 230 s");
}

/// The numbers of a text of the page: base64 of seven bits a byte.
fn numbers(text: &str) -> Vec<i64> {
    let letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let bits: Vec<u32> = text.trim_end_matches('=').chars().map(|c| letters.find(c).unwrap() as u32).collect();
    let bytes = bits.chunks(4).flat_map(|four| {
        let word = four.iter().fold(0, |word, six| word << 6 | six) << (6 * (4 - four.len()));
        [word >> 16, word >> 8, word].map(|byte| byte & 0xff).into_iter().take(four.len() * 6 / 8).collect::<Vec<_>>()
    });
    let mut numbers = Vec::new();
    let (mut number, mut weight) = (0, 0);
    for byte in bytes {
        number |= i64::from(byte & 0x7f) << weight;
        weight += 7;
        if byte & 0x80 == 0 {
            numbers.push(number);
            (number, weight) = (0, 0);
        }
    }
    numbers
}

/// An item of a curve of the page: a frame and its value, or the first and the last one of a band, with the least and the greatest value between.
#[derive(Clone, Copy, Debug)]
enum Item {
    Knot(i64, f64),
    Band([(i64, f64); 2], [f64; 2]),
}

/// A curve of the page: its gap-free pieces.
fn items(curve: &Value) -> Vec<Vec<Item>> {
    let (base, step) = (curve["a"].as_f64().unwrap(), curve["s"].as_f64().unwrap());
    let mut numbers = numbers(curve["k"].as_str().unwrap()).into_iter();
    let (mut pieces, mut frame, mut level) = (Vec::new(), 0, 0);
    let zigzag = |change: i64| (change >> 1) ^ -(change & 1);
    let value = |level: i64| base + level as f64 * step;
    while let Some(count) = numbers.next() {
        let mut item = |_| {
            let head = numbers.next().unwrap();
            frame += head >> 1;
            level += zigzag(numbers.next().unwrap());
            if head & 1 == 0 {
                return Item::Knot(frame, value(level));
            }
            let first = (frame, level);
            frame += numbers.next().unwrap();
            level += zigzag(numbers.next().unwrap());
            let least = first.1.min(level) - numbers.next().unwrap();
            let greatest = first.1.max(level) + numbers.next().unwrap();
            Item::Band([(first.0, value(first.1)), (frame, value(level))], [value(least), value(greatest)])
        };
        pieces.push((0..count).map(&mut item).collect());
    }
    pieces
}

/// The line of a curve that has no bands: its pieces, of frames and values.
fn line(curve: &Value) -> Vec<Vec<(i64, f64)>> {
    let knot = |item: Item| match item {
        Item::Knot(frame, value) => (frame, value),
        Item::Band(..) => panic!("a band: {item:?}"),
    };
    items(curve).into_iter().map(|piece| piece.into_iter().map(knot).collect()).collect()
}

#[test]
fn a_thinned_curve_passes_every_sample_and_stops_at_gaps() {
    let (analysis, frames, leaves) = experiment();
    let data = data(&html(&analysis, &frames, &leaves, &meta()));
    let entry = |title: &str| {
        let entries = data["signals"].as_array().unwrap();
        entries
            .iter()
            .find(|entry| entry["title"] == title && entry["side"] == "left")
            .unwrap_or_else(|| panic!("{title}"))
    };
    // In the units that operators read.
    for (title, unit, slot, component, per_unit) in [
        ("target.velocity", "mm/s", 0, 0, 1e3),
        ("fingers.position", "mm", 1, 0, 1e3),
        ("fingers.force", "N", 0, 1, 1.0),
    ] {
        let entry = entry(title);
        assert_eq!(entry["unit"], unit);
        let curves = entry["curves"].as_array().unwrap();
        let pieces = line(&curves[3 * slot as usize + component as usize][1]);
        let ends: Vec<(i64, i64)> = pieces.iter().map(|piece| (piece[0].0, piece[piece.len() - 1].0)).collect();
        assert_eq!(ends, [(0, 4999), (5200, 7999)], "{title}");
        let knots: usize = pieces.iter().map(Vec::len).sum();
        assert!(knots < 1000, "{knots} knots of {title}");
        let channel = frames.channel(title).unwrap();
        let column = frames.column(ColumnKey { channel, side: Some(Side::Left), slot, component }).unwrap();
        let values: Vec<f64> = column.iter().map(|value| value * per_unit).collect();
        let range = values.iter().copied().fold(f64::MIN, f64::max) - values.iter().copied().fold(f64::MAX, f64::min);
        for pair in pieces.iter().flat_map(|piece| piece.windows(2)) {
            let [(from, a), (to, b)] = *pair else { unreachable!("windows of two") };
            for frame in from..=to {
                let drawn = a + (b - a) * (frame - from) as f64 / (to - from) as f64;
                let off = (drawn - values[usize::try_from(frame).unwrap()]).abs();
                assert!(off < 0.001 * range, "{title} is {off} off at frame {frame}, of {range}");
            }
        }
    }
    // What is true or false is exact.
    let touches = &entry("fingers.contact")["truths"][2];
    assert_eq!(touches[0], "middle");
    let channel = frames.channel("fingers.contact").unwrap();
    let column = frames.column(ColumnKey { channel, side: Some(Side::Left), slot: 2, component: 0 }).unwrap();
    let changes: Vec<i64> =
        (1..column.len()).filter(|at| column.get(*at) != column.get(*at - 1)).map(|at| at as i64).collect();
    let mut at = 0;
    let printed: Vec<i64> = numbers(touches[1].as_str().unwrap())
        .into_iter()
        .map(|step| {
            at += step;
            at
        })
        .collect();
    assert_eq!(printed, changes);
}

/// What is known of every frame, where a curve is a line and where it is a band, is what the log holds.
#[test]
fn noise_is_drawn_as_bands_that_hold_what_the_log_holds() {
    let stretch = 0..120_000;
    let mut frames = measured(std::slice::from_ref(&stretch));
    noise(&mut frames);
    let force = frames.channel("fingers.force").unwrap();
    let key = ColumnKey { channel: force, side: Some(Side::Right), slot: 0, component: 2 };
    let Some(values) = frames.columns.get_mut(&key) else { unreachable!("made above") };
    values[31_234] = 25.0;
    // A part is not noisy: there is a line, also beside the noise.
    values[50_000..80_000].fill(0.5);
    values[65_000..].iter_mut().take(100).for_each(|value| *value = 1.5);
    let values = values.clone();
    let data = data(&html(&Analysis::default(), &frames, &[], &meta()));
    let entries = data["signals"].as_array().unwrap();
    let entry = entries.iter().find(|entry| entry["title"] == "fingers.force" && entry["side"] == "right").unwrap();
    let pieces = items(&entry["curves"][2][1]);
    let [items] = &pieces[..] else { panic!("{} pieces", pieces.len()) };
    let exact = |(frame, value): (i64, f64)| {
        let measured = values[usize::try_from(frame).unwrap()];
        assert!((measured - value).abs() < 0.002, "{value} on frame {frame}, {measured} in the log");
    };
    let (mut bands, mut longest, mut next) = (0, 0, 0);
    let mut before: Option<(i64, f64)> = None;
    for item in items {
        let (first, last) = match *item {
            Item::Knot(frame, value) => ((frame, value), (frame, value)),
            Item::Band([first, last], [least, greatest]) => {
                let held = &values[usize::try_from(first.0).unwrap()..=usize::try_from(last.0).unwrap()];
                let (low, high) = held.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
                assert!((low - least).abs() < 0.002 && (high - greatest).abs() < 0.002, "{item:?}: {low} {high}");
                (bands, longest) = (bands + 1, longest.max(last.0 - first.0));
                (first, last)
            }
        };
        [first, last].into_iter().for_each(exact);
        if let Some(before) = before {
            for frame in before.0..first.0 {
                let share = (frame - before.0) as f64 / (first.0 - before.0) as f64;
                exact((frame, before.1 + share * (first.1 - before.1)));
            }
        }
        (before, next) = (Some(last), last.0 + 1);
    }
    assert_eq!(next, 120_000, "all frames are held");
    assert!(bands > 500 && longest < 300, "{bands} bands, of {longest} frames at most");
    assert!(items.iter().any(|item| matches!(item, Item::Knot(65_000, value) if (value - 1.5).abs() < 0.01)));
}

/// The entry of the forces on that target, and the drawing of the hand.
fn knocked(knocks: &[(Range<usize>, f64)]) -> (Value, String) {
    let page = knocked_page(knocks);
    let data = data(&page);
    let entries = data["signals"].as_array().unwrap();
    let entry = entries.iter().find(|entry| entry["title"] == "contacts of the target" && entry["side"] == "right");
    let (_, drawing) = page.split_once("aria-label=\"Right hand").unwrap();
    (entry.unwrap().clone(), drawing.split_once("</svg>").unwrap().0.to_string())
}

#[test]
fn a_knock_does_not_set_the_scale_and_is_reported() {
    let beyond = |drawing: &str| drawing.matches("<text class=\"beyond\"").count();
    let (entry, drawing) = knocked(&[]);
    assert!(entry["scale"].is_null() && beyond(&drawing) == 0);
    let calm = entry;
    // A knock of two frames, and a blow of a fifteenth of a second, which lasts.
    let (entry, drawing) = knocked(&[(3000..3002, 61.5), (6500..6567, 3.0)]);
    let scale: Vec<f64> = entry["scale"].as_array().unwrap().iter().map(|end| end.as_f64().unwrap()).collect();
    assert!(scale[0] >= -0.5 && (3.0..4.0).contains(&scale[1]), "{scale:?}");
    // Elsewhere it is drawn as without the knock, as finely as this scale shows it: a thousandth of it for the two, and what writing rounds.
    let drawn = |entry: &Value| {
        let pieces = line(&entry["curves"][0][1]);
        let between = |pair: &[(i64, f64)]| {
            let ((from, a), (to, b)) = (pair[0], pair[1]);
            (from..to).map(|at| (at, a + (b - a) * (at - from) as f64 / (to - from) as f64)).collect::<Vec<_>>()
        };
        pieces.iter().flat_map(|piece| piece.windows(2).flat_map(between)).collect::<BTreeMap<i64, f64>>()
    };
    let far = |at: &i64| !(2500..7100).contains(at);
    let (without, with) = (drawn(&calm), drawn(&entry));
    let off = without.iter().filter(|(at, _)| far(at)).map(|(at, value)| (value - with[at]).abs()).fold(0.0, f64::max);
    assert!(off < (scale[1] - scale[0]) / 900.0, "{off} N");
    // The curve itself goes as high as it did, and the drawing says how high.
    let highest = line(&entry["curves"][0][1]).into_iter().flatten().map(|knot| knot.1).fold(f64::MIN, f64::max);
    assert!((highest - 61.5).abs() < 0.01, "{highest}");
    assert_eq!(beyond(&drawing), 1);
    assert!(drawing.contains(">61.5</text>"), "{drawing}");
    // A repeated or small peak is not a knock.
    let often: Vec<(Range<usize>, f64)> = (0..40).map(|at| (100 * at..100 * at + 2, 61.5)).collect();
    assert!(knocked(&often).0["scale"].is_null());
    assert!(knocked(&[(3000..3002, 1.5)]).0["scale"].is_null());
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let page = without_poses();
    let (printed, scripts) = written(&page);
    assert!(printed.contains("No |P̄| hand to target: the recording has no fingers.position and target.position."));
    assert!(printed.contains("No contacts of the target: the recording has no contacts.force and contacts.normal."));
    assert!(!printed.contains("NaN") && !printed.contains("null"));
    assert!(scripts.contains("There is no replay: the recording has no positions of fingertips and no scene."));
}

#[test]
fn a_recording_of_nothing_has_a_page() {
    let analyzed = explain::AnalyzedRecording {
        rules: &Rules::default(),
        frames: &Frames::default(),
        leaves: &[],
        analysis: &Analysis::default(),
    };
    let page = teachtree_report::html(&analyzed, &Recording::default(), &Meta::default()).unwrap();
    assert!(page.contains("No task was found."));
    assert_eq!(data(&page)["signals"], serde_json::json!([]));
}
