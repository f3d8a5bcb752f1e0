//! The page to work in, opened in a real browser and used by mouse and keyboard. Skipped with a message where no browser is installed.

use crate::browser::Browser;
use crate::program::{complained, demonstrate, said, teachtree};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A page in a folder of its own, opened.
pub(super) fn opened(write: impl FnOnce(&Path) -> PathBuf) -> Option<(Browser, PathBuf, tempfile::TempDir)> {
    let mut browser = Browser::start()?;
    let folder = tempfile::tempdir().unwrap();
    let page = write(folder.path());
    browser.open(&page);
    Some((browser, page, folder))
}

/// What an operator does in a scene of the same name, as `demo` shows it: `log.csv`, `log.json` and `log.html`.
pub(super) fn taught(scene: &str, seed: &str) -> Option<(Browser, PathBuf, tempfile::TempDir)> {
    opened(|folder| {
        let [log, json, page] = ["log.csv", "log.json", "log.html"].map(|name| folder.join(name));
        let [log, json, shown] = [&log, &json, &page].map(|path| path.to_str().unwrap());
        demonstrate(scene, &["--seed", seed], log);
        let output = teachtree(&["analyze", log, "--format", "json", "--out", json, "--report", shown]);
        assert!(output.status.success(), "{}", complained(&output));
        page
    })
}

pub fn no_complaints(browser: &Browser) {
    assert!(browser.complaints.is_empty(), "{:#?}", browser.complaints);
}

/// The time that is shown, s: from and to.
fn shown(browser: &mut Browser) -> (f64, f64) {
    let range = browser.text("#range");
    let (from, to) = range.trim_end_matches(" s").split_once(" – ").unwrap();
    (from.parse().unwrap(), to.parse().unwrap())
}

/// Waits until a drawing that was asked for is there.
pub fn drawn(browser: &mut Browser) {
    browser.eval(
        "window.drawn = false; requestAnimationFrame(() => requestAnimationFrame(() => { window.drawn = true; }))",
    );
    browser.wait("window.drawn");
}

/// How many colors the replay has, and a number that tells pictures apart.
pub fn picture(browser: &mut Browser) -> (u64, i64) {
    let printed = browser.eval(
        "(() => { const canvas = document.querySelector('#replay canvas');
           const pixels = new Uint32Array(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.buffer);
           let sum = 0; const colors = new Set();
           for (const pixel of pixels) { sum = (Math.imul(sum, 31) + pixel) | 0; colors.add(pixel); }
           return [colors.size, sum]; })()",
    );
    (printed[0].as_u64().unwrap(), printed[1].as_i64().unwrap())
}

#[test]
fn lanes_hold_what_was_found() {
    let Some((mut browser, page, _folder)) = taught("paper_box", "1") else { return };
    no_complaints(&browser);
    let analysis: Value = serde_json::from_str(&std::fs::read_to_string(page.with_extension("json")).unwrap()).unwrap();
    let track = &analysis["tracks"][0];
    for (lane, found) in [("raw", "segments"), ("relabeled", "relabeled"), ("tasks", "tasks")] {
        let kind = if lane == "tasks" { "task" } else { "segment" };
        let count = browser.eval(&format!("document.querySelectorAll('[data-pick^=\"{kind} 0 {lane} \"]').length"));
        assert_eq!(count, track[found].as_array().unwrap().len(), "{lane}");
    }
    assert!(page.metadata().unwrap().len() < 1_500_000, "the page is large");
    // Signals with thresholds are there from the beginning, and any other can be chosen.
    let listed = browser.text("#more select");
    for signal in [
        "near: ",
        "moving: ",
        "squeeze",
        "touches",
        "leaving",
        "target.velocity",
        "fingers.force",
        "contacts of the target",
    ] {
        assert!(listed.contains(signal), "{signal}");
    }
    assert!(browser.eval("document.querySelectorAll('.panel').length").as_u64().unwrap() >= 3);
    browser.eval(
        "(() => { const list = document.querySelector('#more select');
           list.value = [...list.options].find((option) => option.textContent.startsWith('touches')).value;
           list.dispatchEvent(new Event('change')); })()",
    );
    assert!(browser.text(".panel:last-child .values").starts_with("thumb no"));
    // Without a window the drawings are what is printed; with scripts they are folded away.
    assert_eq!(
        browser
            .eval("document.querySelector('#drawings').open || document.querySelectorAll('#drawings svg').length > 0"),
        false
    );
    browser.eval("document.querySelector('#drawings > summary').click()");
    browser.wait("document.querySelectorAll('#drawings svg').length > 0");
    browser.eval("document.querySelector('#drawings > summary').click()");
    for width in [700, 1200] {
        browser.resize(width, 900);
        drawn(&mut browser);
        assert_eq!(browser.eval("document.documentElement.scrollWidth <= window.innerWidth"), true, "{width}");
    }
    no_complaints(&browser);
}

/// A gripper that closes and opens 300 times: bars too narrow to click are one drawing, and a table has the filtered rows.
#[test]
fn a_long_recording_has_few_elements() {
    let write = |folder: &Path| {
        let [log, scene, page] = ["log.csv", "log.scene.yaml", "log.html"].map(|name| folder.join(name));
        let fingers = "right.thumb.contact,right.index.contact";
        let places = "right.thumb.position.x [m],right.thumb.position.y [m],right.thumb.position.z [m],\
                      right.index.position.x [m],right.index.position.y [m],right.index.position.z [m]";
        let mut text = format!("time [s],{fingers},{places},a.position.x [m],a.position.y [m],a.position.z [m]\n");
        for row in 0..12_000 {
            let touches = u8::from(row / 20 % 2 == 1);
            text += &format!("{},{touches},{touches},0.02,0,0,-0.02,0,0,0,0,0\n", f64::from(row) * 0.05);
        }
        std::fs::write(&log, text).unwrap();
        let bodies = "bodies:\n  a: {role: object, radius: 20 mm}\nhands:\n  right: {fingers: [thumb, index]}\n";
        std::fs::write(scene, bodies).unwrap();
        let [log, shown] = [&log, &page].map(|path| path.to_str().unwrap());
        let output = teachtree(&["analyze", log, "--hand", "hand_flags.rules", "--report", shown]);
        assert!(output.status.success(), "{}", complained(&output));
        page
    };
    let Some((mut browser, ..)) = opened(write) else { return };
    drawn(&mut browser);
    let mut count =
        |what: &str| browser.eval(&format!("document.querySelectorAll(\"{what}\").length")).as_u64().unwrap();
    assert!(count("*") < 2000 && count("#lanes .crowd") > 1, "{} elements", count("*"));
    assert!(count("#lanes .bar, #lanes .limit") < 10, "what is wide is still a bar of its own");
    // Closer, each bar can be picked.
    (0..6).for_each(|_| browser.click("#closer"));
    drawn(&mut browser);
    let mut count =
        |what: &str| browser.eval(&format!("document.querySelectorAll(\"{what}\").length")).as_u64().unwrap();
    assert!(count("#lanes .crowd") == 0 && count("#lanes .bar") > 10);
    browser.eval("document.querySelector('#drawings > summary').click()");
    browser.wait("document.querySelector('#drawings .filter') !== null");
    let rows = "document.querySelectorAll('#drawings tr').length";
    assert_eq!(browser.eval(rows), 61);
    browser.eval("document.querySelector('#drawings .filter button').click()");
    let more = browser.eval(rows).as_u64().unwrap();
    assert!(more > 300, "{more}");
    browser.eval(
        "(() => { const field = document.querySelector('#drawings .filter input');
           field.value = 'no such row'; field.dispatchEvent(new Event('input')); })()",
    );
    assert_eq!(browser.eval(rows), 1);
    // A printed page has all of them.
    browser.eval("dispatchEvent(new Event('beforeprint'))");
    assert!(browser.eval(rows).as_u64().unwrap() >= more);
    browser.eval("dispatchEvent(new Event('afterprint'))");
    assert_eq!(browser.eval(rows), 1);
    no_complaints(&browser);
}

#[test]
fn labels_are_apart_from_each_other_and_from_curves() {
    let Some((mut browser, ..)) = taught("paper_box", "1") else { return };
    for (width, part) in [(1280, "from=7&to=21"), (800, "from=7&to=12.5"), (800, "from=0&to=21")] {
        browser.resize(width, 900);
        browser.eval(&format!("location.hash = '#t=8&{part}'"));
        drawn(&mut browser);
        // The numbers of the axis, its unit, and the edge of the drawing.
        let odd = browser.eval(
            "(() => { const box = (one) => one.getBoundingClientRect(), edge = box(document.querySelector('#lanes svg')).right;
               const texts = [...document.querySelectorAll('#lanes svg > .tick'), document.querySelector('#lanes svg > .name')];
               const bad = texts.filter((one) => box(one).right > edge + 0.5).map((one) => `${one.textContent} is cut off`);
               for (const one of texts) for (const other of texts)
                 if (one !== other && box(one).left < box(other).right + 2 && box(other).left < box(one).right + 2) bad.push(`${one.textContent} on ${other.textContent}`);
               return texts.length < 4 ? ['no numbers'] : bad; })()",
        );
        assert_eq!(odd, serde_json::json!([]), "{width} {part}");
    }
    // Names of thresholds: nothing of a curve is within the room that they take.
    browser.eval(
        "(() => { const write = CanvasRenderingContext2D.prototype.fillText, colors = getComputedStyle(document.documentElement);
           window.names = [];
           CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...rest) {
             if (this.fillStyle === colors.getPropertyValue('--threshold').trim()) {
               const at = this.getTransform().transformPoint({ x, y });
               window.names.push({ context: this, text, right: at.x, foot: at.y, wide: this.measureText(text).width });
             }
             write.call(this, text, x, y, ...rest); }; })()",
    );
    browser.resize(1280, 900);
    drawn(&mut browser);
    let printed = browser.eval(
        "(() => { const curve = [1, 3, 5].map((at) => parseInt(getComputedStyle(document.documentElement).getPropertyValue('--curve0').trim().slice(at, at + 2), 16));
           return window.names.map(({ context, text, right, foot, wide }) => {
             const { data } = context.getImageData(Math.round(right - wide), Math.round(foot - 9), Math.round(wide), 10);
             let blue = 0;
             for (let at = 0; at < data.length; at += 4) if (curve.every((part, color) => Math.abs(part - data[at + color]) < 60)) blue++;
             return [text, blue]; }); })()",
    );
    let printed = printed.as_array().unwrap();
    assert!(printed.len() >= 6, "{printed:?}");
    assert!(printed.iter().all(|name| name[1] == 0), "{printed:?}");
    no_complaints(&browser);
}

#[test]
fn the_whole_scene_is_in_the_first_view() {
    let Some((mut browser, ..)) = taught("paper_box", "1") else { return };
    for width in [1280, 800] {
        browser.resize(width, 900);
        drawn(&mut browser);
        // Nothing but the stage along the edges, apart from the bar of forces in the corner at the left.
        let off = browser.eval(
            "(() => { const canvas = document.querySelector('#replay canvas'), context = canvas.getContext('2d'), { width, height } = canvas;
               const stage = context.getImageData(0, 0, 1, 1).data.join();
               const lines = [[0, 0, width, 1], [0, 0, 1, height], [width - 1, 0, 1, height], [0, height - 1, width, 1]];
               let off = 0;
               for (const line of lines) { const { data } = context.getImageData(...line); for (let at = 0; at < data.length; at += 4) if (data.slice(at, at + 4).join() !== stage) off++; }
               return off; })()",
        );
        assert_eq!(off, 0, "{width}");
    }
    no_complaints(&browser);
}

#[test]
fn what_lies_beyond_a_scale_is_reported_and_shown_when_asked() {
    let page = opened(|folder| {
        let page = folder.join("page.html");
        std::fs::write(&page, super::pages::knocked_page(&[(3000..3002, 61.5)])).unwrap();
        page
    });
    let Some((mut browser, ..)) = page else { return };
    browser.eval(
        "(() => { const list = document.querySelector('#more select');
           list.value = [...list.options].find((option) => option.textContent === 'right contacts of the target').value;
           list.dispatchEvent(new Event('change')); })()",
    );
    assert_eq!(browser.text(".panel:last-child .unit"), "N");
    assert_eq!(browser.text(".panel:last-child .scale"), "▲ up to 61.5 N");
    let canvas = |browser: &mut Browser| browser.eval("document.querySelector('.panel:last-child canvas').toDataURL()");
    let usual = canvas(&mut browser);
    browser.click(".panel:last-child .scale");
    assert_eq!(browser.text(".panel:last-child .scale"), "usual scale");
    assert_ne!(canvas(&mut browser), usual);
    browser.click(".panel:last-child .scale");
    assert_eq!(canvas(&mut browser), usual);
    no_complaints(&browser);
}

#[test]
fn a_boundary_is_explained_as_explain_does() {
    let Some((mut browser, page, _folder)) = taught("paper_box", "1") else { return };
    let log = page.with_extension("csv");
    browser.click("[data-pick='cut 0 raw 4']");
    let heading = browser.text("#why h3");
    assert!(heading.starts_with("Grasp → Translate right raw, "), "{heading}");
    let begins: f64 = heading.rsplit_once(", ").unwrap().1.trim_end_matches(" s").parse().unwrap();
    assert_eq!(browser.text("#clock"), format!("{begins:.3} s"));
    let why = browser.text("#why");
    // The force of the base on the cube: on the last frame of the Grasp and on the first one of the Translate.
    for frame in [begins - 0.001, begins] {
        let printed = said(&teachtree(&[
            "explain",
            log.to_str().unwrap(),
            "--at",
            &format!("{frame:.3}s"),
            "--track",
            "right",
            "--full",
        ]));
        let line = printed.lines().find(|line| line.contains("norm(contacts.force) above loads_on")).unwrap();
        let fact = line.split_once("loads_off: ").unwrap().1;
        // `18.4 mN, wanted above 50 mN, 31.6 mN short`, or `20.0 mN, held since 0.001 s, lost below 20 mN: 0.1 mN to spare`.
        let value = fact.split_once(',').unwrap().0;
        let margin = fact.rsplit([',', ':']).next().unwrap().trim();
        assert!(why.contains(value) && why.contains(margin), "{frame}: {fact}\n{why}");
    }
    for piece in [
        "carried: not supported and not walled => Translate is taken now",
        "rules/single_hand.rules:",
        "above 50 mN",
        "leaving not set so far",
    ] {
        assert!(why.contains(piece), "{piece}\n{why}");
    }
    // A relabeled segment says what it was, a task how it came to its name.
    browser.click("[data-pick='segment 0 relabeled 2']");
    let why = browser.text("#why");
    assert!(why.contains("was Slide Grasp") && why.contains("becomes Grasp"), "{why}");
    browser.click("[data-pick='task 0 tasks 0']");
    let why = browser.text("#why");
    assert!(
        why.starts_with("×pick_and_follow") && why.contains("yes Follow travelling follow_way one segment"),
        "{why}"
    );
    // By keyboard, from boundary to boundary.
    browser.key("n");
    assert!(browser.text("#why h3").contains(" → "));
    browser.key("Escape");
    assert!(browser.text("#why").starts_with("Click a boundary"));
    no_complaints(&browser);
}

#[test]
fn time_is_zoomed_and_moved() {
    let Some((mut browser, ..)) = taught("hand_over_left_to_right", "2") else { return };
    let (start, end) = shown(&mut browser);
    let place = browser.place("#lanes");
    browser.wheel(place, -600.0);
    browser.wait("!document.querySelector('#range').textContent.startsWith('0.000')");
    let (from, to) = shown(&mut browser);
    assert!(start < from && to < end && to - from < 0.6 * (end - start), "{from} {to}");
    browser.drag(place, (place.0 + 150.0, place.1));
    drawn(&mut browser);
    let (earlier, later) = shown(&mut browser);
    assert!(earlier < from - 0.1 && ((later - earlier) - (to - from)).abs() < 0.01, "{earlier} {later}");
    browser.key("+");
    drawn(&mut browser);
    let (near, far) = shown(&mut browser);
    assert!(((far - near) - (later - earlier) / 2.0).abs() < 0.01, "{near} {far}");
    browser.click("#whole");
    drawn(&mut browser);
    assert_eq!(shown(&mut browser), (start, end));
    // A click sets the time; a key moves it by a hundredth of what is shown.
    browser.click(".panel canvas");
    let clock = |browser: &mut Browser| browser.text("#clock").trim_end_matches(" s").parse::<f64>().unwrap();
    let before = clock(&mut browser);
    assert!(before > start && before < end, "{before}");
    browser.key("ArrowRight");
    assert!((clock(&mut browser) - before - (end - start) / 100.0).abs() < 0.002);
    // Both hands have three lanes each, and so has what they do together; the tree over both hands says what it decided.
    for who in ["left", "right", "both"] {
        assert!(browser.text("#lanes svg").contains(who));
    }
    let grasp = browser.eval(
        "[...document.querySelectorAll('#lanes .limit')].find((one) => one.ariaLabel.startsWith('left raw: Translate → MainGrasp')).dataset.pick",
    );
    browser.click(&format!("[data-pick='{}']", grasp.as_str().unwrap()));
    let why = browser.text("#why");
    assert!(why.contains("Both hands") && why.contains("joint") && why.contains("The left hand by itself"), "{why}");
    no_complaints(&browser);
}

#[test]
fn the_replay_moves_with_the_time() {
    let Some((mut browser, ..)) = taught("paper_box", "1") else { return };
    let (colors, begin) = picture(&mut browser);
    // Shaded faces and balls on a stage.
    assert!(colors > 50, "{colors} colors");
    browser.click("[data-pick='cut 0 raw 4']");
    let (_, grasped) = picture(&mut browser);
    assert_ne!(begin, grasped, "another time, another picture");
    let canvas = browser.place("#replay canvas");
    browser.drag(canvas, (canvas.0 + 60.0, canvas.1 + 20.0));
    let (_, orbited) = picture(&mut browser);
    assert_ne!(grasped, orbited, "the eye has moved");
    browser.wheel(canvas, -300.0);
    drawn(&mut browser);
    assert_ne!(orbited, picture(&mut browser).1, "it is nearer");
    // It plays, and it stops.
    let before = browser.text("#clock");
    browser.click("#play");
    browser.wait(&format!("document.querySelector('#clock').textContent > '{before}'"));
    browser.click("#play");
    let stopped = browser.text("#clock");
    drawn(&mut browser);
    assert_eq!(browser.text("#clock"), stopped);
    no_complaints(&browser);
}

#[test]
fn names_are_only_names_and_gaps_are_gaps() {
    let name = r#"<b>&"x'</script>"#;
    let page = opened(|folder| {
        demonstrate("pick_and_place", &[], folder.join("log.csv"));
        let scene = std::fs::read_to_string(folder.join("log.scene.yaml")).unwrap();
        let (object, _) = scene.split_once(":\n    role: object").unwrap();
        let object = object.rsplit('\n').next().unwrap().trim();
        let quoted = format!("'{}'", name.replace('\'', "''"));
        let scene = scene.replace(&format!("  {object}:"), &format!("  {quoted}:"));
        std::fs::write(folder.join("odd.scene.yaml"), scene).unwrap();
        let log = std::fs::read_to_string(folder.join("log.csv")).unwrap();
        // Half a second is missing from the third second on, and a finger is not measured for a while.
        let mut lines: Vec<String> = Vec::new();
        for (row, line) in log.lines().enumerate() {
            match row {
                0 => {
                    let quote = |column: &str| format!("\"{}\"", column.replace(object, name).replace('"', "\"\""));
                    lines.push(line.split(',').map(quote).collect::<Vec<_>>().join(","));
                }
                3001..3500 => {}
                4001..4200 => {
                    let mut cells: Vec<&str> = line.split(',').collect();
                    cells[1..4].fill("nan");
                    lines.push(cells.join(","));
                }
                _ => lines.push(line.to_string()),
            }
        }
        std::fs::write(folder.join("odd.csv"), lines.join("\n")).unwrap();
        let (log, page) = (folder.join("odd.csv"), folder.join("odd.html"));
        let output = teachtree(&["analyze", log.to_str().unwrap(), "--report", page.to_str().unwrap()]);
        assert!(output.status.success(), "{}", complained(&output));
        page
    });
    let Some((mut browser, ..)) = page else { return };
    no_complaints(&browser);
    // The data and the scripts, and nothing that a name brought in.
    assert_eq!(browser.eval("document.querySelectorAll('script, body > b').length"), 2);
    browser.eval(
        "(() => { const list = document.querySelector('#more select');
           list.value = [...list.options].find((option) => option.textContent.startsWith('loads')).value;
           list.dispatchEvent(new Event('change')); })()",
    );
    // Nothing is known within the gap, and something before and after it.
    let at = |browser: &mut Browser, time: f64| {
        browser.eval(&format!("location.hash = '#t={time}'"));
        browser.wait(&format!("document.querySelector('#clock').textContent === '{time:.3} s'"));
        browser.text(".panel .values")
    };
    assert!(!at(&mut browser, 2.9).contains('–'));
    assert!(at(&mut browser, 3.25).contains('–'));
    assert!(!at(&mut browser, 3.6).contains('–'));
    assert!(at(&mut browser, 4.1).contains('–'));
    no_complaints(&browser);
}

#[test]
fn a_log_without_poses_has_no_replay_and_says_so() {
    let page = opened(|folder| {
        let page = folder.join("page.html");
        std::fs::write(&page, super::pages::without_poses()).unwrap();
        page
    });
    let Some((mut browser, ..)) = page else { return };
    let said = browser.text("#replay");
    assert_eq!(said, "There is no replay: the recording has no positions of fingertips and no scene.");
    assert_eq!(browser.eval("document.querySelector('#replay canvas')"), Value::Null);
    assert!(browser.eval("document.querySelectorAll('#lanes .bar').length").as_u64().unwrap() > 10);
    // Made by hand, these rules have no tree: the page says who can tell.
    browser.click("[data-pick='cut 0 raw 1']");
    assert!(browser.text("#why").contains("teachtree explain LOG --at"));
    no_complaints(&browser);
}
