//! The page in a browser, by pointer and keyboard. Skipped with a message where no browser is installed.

use super::{OPENED, Studio, folder};
use crate::browser::Browser;
use crate::sets::with_set;
use serde_json::{Value, json};
use std::path::Path;

/// A page over recordings, once the list is full.
pub fn visited(folder: &Path, args: &[&str]) -> Option<(Browser, Studio)> {
    let mut browser = Browser::start()?;
    browser.resize(1440, 900);
    let studio = Studio::start(folder, args);
    studio.list();
    browser.visit(&studio.address);
    // A recording opens at once; until then rows are drawn anew.
    browser.wait("document.querySelector('#recordings [aria-current]') !== null");
    Some((browser, studio))
}

/// Waits until a recording is drawn.
pub fn opened(browser: &mut Browser, name: &str) {
    browser.wait(&format!(
        "document.querySelector('#title').textContent === {} && document.querySelectorAll('#lanes .bar').length > 0",
        json!(name)
    ));
}

pub fn no_complaints(browser: &Browser) {
    assert!(browser.complaints.is_empty(), "{:#?}", browser.complaints);
}

#[test]
fn a_list_leads_to_each_recording() {
    let folder = folder();
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    assert_eq!(browser.eval("document.querySelectorAll('#recordings [data-at]').length"), 3);
    browser.click("[data-at='1']");
    opened(&mut browser, "b");
    let lanes = &studio.get("api/recording/1")["data"]["tracks"][0];
    for (kind, lane) in [("segment", "raw"), ("segment", "relabeled"), ("task", "tasks")] {
        let count = browser.eval(&format!("document.querySelectorAll('[data-pick^=\"{kind} 0 {lane} \"]').length"));
        assert_eq!(count, lanes[lane].as_array().unwrap().len(), "{lane}");
    }
    // Keys go through the list, and stop at its ends.
    for (key, name) in [("j", "c7"), ("j", "c7"), ("k", "b"), ("k", "a")] {
        browser.key(key);
        opened(&mut browser, name);
        assert_eq!(browser.text("#recordings [aria-current] b"), name);
    }
    // The time cursor goes through lanes and signals.
    browser.key("ArrowRight");
    browser.wait("document.querySelector('#clock').textContent !== '0.000 s'");
    assert!(browser.eval("document.querySelectorAll('.panel').length").as_u64().unwrap() >= 1);
    // Filters by text, and by what no recording has.
    browser.click("#filter-text");
    browser.key("7");
    browser.wait("document.querySelectorAll('#recordings [data-at]').length === 1");
    browser.key("x");
    browser.wait("document.querySelectorAll('#recordings [data-at]').length === 0");
    for width in [390, 900, 1440] {
        browser.resize(width, 900);
        browser.wait("document.documentElement.scrollWidth <= window.innerWidth");
    }
    no_complaints(&browser);
}

/// Where an edge of a label is in the window.
fn edge(browser: &mut Browser, at: usize) -> (f64, f64) {
    browser.place(&format!("[data-edge='0 primitive {at} 0']"))
}

/// The rows of a label file without who and when, once a page has saved it.
fn saved(folder: &Path, name: &str, wanted: impl Fn(&str) -> bool) -> String {
    let mut text = String::new();
    until(|| {
        text = std::fs::read_to_string(folder.join("logs").join(name)).unwrap_or_default();
        wanted(&text)
    });
    text
}

#[test]
fn a_boundary_is_dragged_undone_and_moved_by_keys() {
    let folder = folder();
    let Some((mut browser, _studio)) = visited(folder.path(), &OPENED) else { return };
    browser.click("[data-at='1']");
    opened(&mut browser, "b");
    assert_eq!(browser.text("#label-status"), "0 pinned labels");
    // By pointer: Approach begins two seconds later; what it meets goes along.
    let (x, y) = edge(&mut browser, 1);
    let second = browser.eval("document.querySelector('#lanes svg svg').getBoundingClientRect().width / 12.1");
    browser.drag((x, y), (x + 2.0 * second.as_f64().unwrap(), y));
    let text = saved(folder.path(), "b.labels.csv", |text| text.contains("Approach"));
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 2, "{text}");
    assert_eq!((rows[0][2], rows[1][2], rows[0][4]), ("Move", "Approach", rows[1][3]), "{text}");
    let moved: f64 = rows[1][3].parse().unwrap();
    assert!(
        (moved - 15.25).abs() < 0.11 && (moved * 20.0 - (moved * 20.0).round()).abs() < 1e-6,
        "on a frame: {moved}"
    );
    assert!(rows.iter().all(|row| row[5] == "pinned" && row[7].ends_with('Z')), "{text}");
    browser.wait("document.querySelector('#label-status').textContent === '2 pinned labels, saved'");
    browser.wait("document.querySelector('#agreement').textContent.includes('%')");
    // Undone, there is no file; done again, it is as it was.
    browser.click("#undo");
    saved(folder.path(), "b.labels.csv", str::is_empty);
    browser.click("#redo");
    assert_eq!(saved(folder.path(), "b.labels.csv", |text| !text.is_empty()), text);
    // By keyboard: a frame back.
    browser.wait("document.querySelectorAll('#lanes .pinned').length === 2");
    browser.eval("document.querySelector(\"[data-edge='0 primitive 1 0']\").focus()");
    browser.key("ArrowLeft");
    let before = format!("{:.2}", moved - 0.05);
    saved(folder.path(), "b.labels.csv", |text| {
        text.lines().nth(2).is_some_and(|row| row.contains(before.trim_end_matches('0')))
    });
    no_complaints(&browser);
}

#[test]
fn labels_are_named_split_merged_and_taken_back_by_keys() {
    let folder = folder();
    let Some((mut browser, _studio)) = visited(folder.path(), &OPENED) else { return };
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    let primitives = |text: &str| -> Vec<String> {
        let rows = text.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>());
        rows.filter(|row| row[1] == "primitive").map(|row| row[2].to_string()).collect()
    };
    // The label that is clicked, which is Approach, is named.
    browser.click("[data-label='0 primitive 1']");
    browser.wait("document.querySelector('#label-name').value === 'Approach'");
    browser.eval("(() => { const list = document.querySelector('#label-name'); list.value = 'Push'; list.dispatchEvent(new Event('change')); })()");
    saved(folder.path(), "a.labels.csv", |text| primitives(text) == ["Push"]);
    // Its middle is at the cursor: there it is split, and put together again.
    browser.key("s");
    saved(folder.path(), "a.labels.csv", |text| primitives(text) == ["Push", "Push"]);
    browser.click("[data-label='0 primitive 1']");
    browser.key("m");
    saved(folder.path(), "a.labels.csv", |text| primitives(text) == ["Push"]);
    // An answer of the server that comes late does not disturb what is typed meanwhile.
    browser.eval("window.fetch = ((fetch) => (...one) => new Promise((go) => setTimeout(go, 1000)).then(() => fetch(...one)))(window.fetch)");
    browser.key("Delete");
    // Letters choose in the list, Enter takes what they chose, and then keys are about the label again.
    browser.click("[data-label='0 primitive 1']");
    browser.key("e");
    browser.wait("document.activeElement.id === 'label-name'");
    browser.key("P");
    browser.wait("document.querySelector('#label-name').value.startsWith('P')");
    saved(folder.path(), "a.labels.csv", str::is_empty);
    browser.wait("!document.querySelector('#label-status').textContent.startsWith('saving')");
    assert_eq!(browser.eval("document.querySelector('#label-name').value.startsWith('P')"), true);
    browser.key("Enter");
    let name = browser.eval("document.querySelector('#label-name').value");
    saved(folder.path(), "a.labels.csv", |text| primitives(text) == [name.as_str().unwrap()]);
    browser.wait("document.activeElement.dataset.label === '0 primitive 1'");
    browser.key("e");
    browser.key("M");
    browser.key("Escape");
    browser.key("Delete");
    saved(folder.path(), "a.labels.csv", str::is_empty);
    // A task is wrong.
    browser.key("u");
    let text = saved(folder.path(), "a.labels.csv", |text| text.contains("unknown"));
    assert!(text.lines().nth(1).unwrap().starts_with("right,task,unknown,12,24.1,pinned,"), "{text}");
    // All is right as it is.
    browser.key("a");
    saved(folder.path(), "a.labels.csv", |text| primitives(text) == ["Move", "Approach", "Grasp", "Translate"]);
    browser.wait("document.querySelector('#agreement').textContent.includes('100.0 %')");
    no_complaints(&browser);
}

#[test]
fn a_window_is_told_what_another_one_saved() {
    let folder = folder();
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    let line = |label: &str| json!({ "track": "right", "kind": "primitive", "label": label, "start_s": 12.0, "end_s": 13.0, "pinned": true });
    let other = |base: &serde_json::Value, label: &str| {
        studio.change("PUT", "api/recording/0/labels", &json!({ "base": base, "lines": [line(label)] })).json()["version"].clone()
    };
    // What the other window saved is shown here while nothing was changed here.
    let version = other(&json!(""), "Grasp");
    browser.wait("document.querySelector('#lanes .pinned title')?.textContent.startsWith('Grasp')");
    // Here the labels of before are changed while another window saves: neither is lost without a word.
    browser.eval("window.fetch = ((fetch) => (path, ...more) => String(path).includes('api/list') ? new Promise(() => {}) : fetch(path, ...more))(window.fetch)");
    other(&version, "Press");
    browser.key("a");
    browser.wait("!document.querySelector('#conflict').hidden");
    let file = folder.path().join("logs/a.labels.csv");
    assert!(std::fs::read_to_string(&file).unwrap().contains("Press"));
    browser.click("#keep-mine");
    saved(folder.path(), "a.labels.csv", |text| text.contains("Grasp") && !text.contains("Press"));
    // Undone, what they had can be taken instead.
    assert_eq!(browser.eval("document.querySelector('#conflict').hidden"), true);
    // The browser itself logs the refusal; nothing else went wrong.
    browser.complaints.retain(|complaint| !complaint.contains("409"));
    no_complaints(&browser);
}

/// A plot with the threshold `near_on`, and that threshold, in the scripts of the page.
const LINE: &str = "bench.panels.map((panel) => ({ panel, threshold: (bench.view.data.signals[panel.number].thresholds || []).find((one) => one[2] === 'near_on') })).find(({ panel, threshold }) => panel.y && threshold)";

/// Waits until something is so.
pub fn until(mut is_so: impl FnMut() -> bool) {
    let end = std::time::Instant::now() + std::time::Duration::from_secs(100);
    while !is_so() {
        assert!(std::time::Instant::now() < end, "it never was so");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

#[test]
fn a_param_is_turned_by_its_field_its_slider_and_its_line() {
    let folder = folder();
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    browser.click("#tune summary");
    browser.eval("(() => { const field = document.querySelector(\"[data-param='near_on'] input[type=number]\"); field.value = '30'; field.dispatchEvent(new Event('input', { bubbles: true })); })()");
    browser.wait("document.querySelector('#tune-state').textContent.startsWith('analyzed in')");
    browser.wait(
        "document.querySelector(\"[data-pick='segment 0 relabeled 1'] title\")?.textContent.includes('13.500 s')",
    );
    assert_eq!(studio.list()["params"], json!({ "near_on": "30 mm" }));
    // By its slider.
    browser.eval("(() => { const slider = document.querySelector(\"[data-param='near_on'] input[type=range]\"); slider.value = '185'; slider.dispatchEvent(new Event('input', { bubbles: true })); })()");
    let param = |studio: &Studio| studio.list()["params"]["near_on"].as_str().map(str::to_string);
    until(|| param(&studio).as_deref() == Some("40 mm"));
    // By its line in the plot, which is dragged down a little.
    browser.eval("import('./bench.js').then((bench) => { window.bench = bench; })");
    browser.wait("window.bench !== undefined");
    browser.eval(&format!("{LINE}?.panel.canvas.scrollIntoView({{ block: 'center' }})"));
    browser.wait(&format!("Math.abs(({LINE}?.threshold[0] ?? 0) - 40) < 1e-6"));
    let field = |browser: &mut Browser| {
        let text = browser.eval("document.querySelector(\"[data-param='near_on'] input[type=number]\").value");
        text.as_str().unwrap().parse::<f64>().unwrap()
    };
    // Where explanations came in between, the line is not where it was.
    until(|| {
        let place = browser.eval(&format!(
            "(() => {{ const {{ panel, threshold }} = {LINE}, box = panel.canvas.getBoundingClientRect(); return [box.x + box.width / 2, box.y + panel.y(threshold[0])]; }})()"
        ));
        let (x, y) = (place[0].as_f64().unwrap(), place[1].as_f64().unwrap());
        browser.drag((x, y), (x, y + 4.0));
        field(&mut browser) < 39.5
    });
    // The last of several moves is sent when the answer to those before is there.
    let millimeters = |text: String| text.trim_end_matches(" mm").parse::<f64>().unwrap();
    until(|| param(&studio).map(millimeters) == Some(field(&mut browser)));
    browser.click("#reset-params");
    browser.wait(
        "document.querySelector(\"[data-pick='segment 0 relabeled 1'] title\")?.textContent.includes('13.250 s')",
    );
    assert_eq!(studio.list()["params"], json!({}));
    no_complaints(&browser);
}

#[test]
fn a_value_that_does_not_run_is_not_written() {
    let folder = folder();
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    browser.click("#tune summary");
    let type_in = |browser: &mut Browser, value: &str| {
        browser.eval(&format!("(() => {{ const field = document.querySelector(\"[data-param='near_on'] input[type=number]\"); field.value = '{value}'; field.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()"));
    };
    let state = "document.querySelector('#tune-state').textContent";
    let is_disabled = |browser: &mut Browser| browser.eval("document.querySelector('#write-params').disabled");
    type_in(&mut browser, "40");
    browser.wait(&format!("{state}.startsWith('analyzed in')"));
    assert_eq!(is_disabled(&mut browser), false);
    // Half a number is not taken; one out of the range of the param, or of which the rules make nothing, is refused.
    type_in(&mut browser, "1");
    assert_eq!(is_disabled(&mut browser), true);
    type_in(&mut browser, "1000");
    browser.wait(&format!("{state}.includes('near_on: expected 10 to 200 mm')"));
    assert_eq!(
        (is_disabled(&mut browser), studio.list()["params"].clone()),
        (json!(true), json!({ "near_on": "40 mm" }))
    );
    type_in(&mut browser, "100");
    browser.wait(&format!("{state}.includes('E307')"));
    assert_eq!(
        (is_disabled(&mut browser), studio.list()["params"].clone()),
        (json!(true), json!({ "near_on": "40 mm" }))
    );
    type_in(&mut browser, "45");
    browser.wait(&format!("{state}.startsWith('analyzed in')"));
    assert_eq!(
        (is_disabled(&mut browser), studio.list()["params"].clone()),
        (json!(false), json!({ "near_on": "45 mm" }))
    );
    // The browser itself logs what the server refused.
    browser.complaints.retain(|complaint| !complaint.contains("the server responded with a status of"));
    no_complaints(&browser);
}

/// A LeRobot set whose episodes have a video: three in one file, one after the other.
fn with_video() -> tempfile::TempDir {
    let folder = with_set();
    let set = folder.path().join("set");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/studio");
    std::fs::copy(fixtures.join("episodes_with_videos.parquet"), set.join("meta/episodes/chunk-000/file-000.parquet"))
        .unwrap();
    let place = set.join("videos/observation.images.top/chunk-000");
    std::fs::create_dir_all(&place).unwrap();
    std::fs::copy(fixtures.join("camera.mp4"), place.join("file-000.mp4")).unwrap();
    let path = set.join("meta/info.json");
    let mut info: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    info["video_path"] = json!("videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4");
    info["features"]["observation.images.top"] = json!({ "dtype": "video", "shape": [48, 64, 3], "names": null });
    std::fs::write(path, info.to_string()).unwrap();
    folder
}

#[test]
fn the_video_of_an_episode_follows_the_cursor() {
    let folder = with_video();
    let Some((mut browser, studio)) = visited(folder.path(), &["set", "--binding", "b.yaml"]) else { return };
    let video = studio.get("api/recording/1")["videos"][0].clone();
    assert_eq!(video["camera"], "observation.images.top");
    assert!((video["offset"].as_f64().unwrap() - 17.2).abs() < 0.051, "{video}");
    browser.click("[data-at='1']");
    opened(&mut browser, "set_1");
    browser.wait("document.querySelector('#videos video')?.readyState >= 2");
    let offset = video["offset"].as_f64().unwrap();
    let at_cursor = format!(
        "Math.abs(document.querySelector('#videos video').currentTime - parseFloat(document.querySelector('#clock').textContent) - {offset}) < 0.01"
    );
    browser.wait(&at_cursor);
    for _ in 0..10 {
        browser.key("ArrowRight");
    }
    browser.wait("parseFloat(document.querySelector('#clock').textContent) > 0.4");
    browser.wait(&at_cursor);
    // It plays with the cursor, and stops with it.
    browser.click("#play");
    browser.wait("!document.querySelector('#videos video').paused && parseFloat(document.querySelector('#clock').textContent) > 1.5");
    browser.click("#play");
    browser.wait("document.querySelector('#videos video').paused");
    browser.wait(&at_cursor);
    // The next episode is another part of the same file.
    browser.key("k");
    opened(&mut browser, "set_0");
    browser.wait("document.querySelector('#videos video').currentTime < 1");
    no_complaints(&browser);
}

/// What has the focus: the place of a label or boundary, the number of a recording, else an id.
const FOCUSED: &str = "(() => { const { dataset, id } = document.activeElement; return dataset.edge ?? dataset.label ?? dataset.at ?? id; })()";

#[test]
fn few_keys_lead_from_the_list_to_the_lanes_and_back() {
    let folder = folder();
    let Some((mut browser, _studio)) = visited(folder.path(), &OPENED) else { return };
    // To the list, down to the second recording, and open it.
    for (key, focused) in [("r", "0"), ("ArrowDown", "1"), ("ArrowDown", "2"), ("ArrowUp", "1")] {
        browser.key(key);
        assert_eq!(browser.eval(FOCUSED), focused, "{key}");
    }
    browser.key("Enter");
    opened(&mut browser, "b");
    // To the first boundary, the next one, and back.
    for (key, focused) in [("b", "0 primitive 1 0"), ("b", "0 primitive 2 0"), ("B", "0 primitive 1 0")] {
        browser.key(key);
        browser.wait(&format!("{FOCUSED} === '{focused}'"));
    }
    let before = browser.text("#clock");
    browser.key("ArrowRight");
    saved(folder.path(), "b.labels.csv", |text| text.contains("pinned"));
    assert_ne!(browser.text("#clock"), before);
    browser.wait(&format!("{FOCUSED} === '0 primitive 1 0'"));
    // To the label at the cursor, and back to the list; from its filter too.
    browser.key("l");
    browser.wait(&format!("{FOCUSED} === '0 primitive 1'"));
    browser.key("r");
    assert_eq!(browser.eval(FOCUSED), "1");
    browser.key("/");
    assert_eq!(browser.eval(FOCUSED), "filter-text");
    browser.key("7");
    browser.wait("document.querySelectorAll('#recordings [data-at]').length === 1");
    browser.key("ArrowDown");
    assert_eq!(browser.eval(FOCUSED), "2");
    // A boundary that is not in sight comes into it.
    browser.key("Enter");
    opened(&mut browser, "c7");
    browser.eval("import('./bench.js').then((bench) => { bench.setTime(bench.view.data.start + 0.3); for (let time = 0; time < 6; time++) document.querySelector('#closer').click(); })");
    browser.wait("document.querySelectorAll('#lanes [data-edge]').length === 0");
    browser.key("b");
    browser.wait(&format!("{FOCUSED} === '0 primitive 1 0'"));
    // The page says which keys there are.
    for key in ["r", "l", "b", "/"] {
        assert!(
            browser.eval(&format!(
                "[...document.querySelectorAll('#keys kbd')].some((one) => one.textContent === '{key}')"
            )) == true,
            "{key}"
        );
    }
    no_complaints(&browser);
}

#[test]
fn moves_of_a_boundary_by_keys_are_undone_together() {
    let folder = folder();
    let Some((mut browser, _studio)) = visited(folder.path(), &OPENED) else { return };
    browser.click("[data-at='1']");
    opened(&mut browser, "b");
    // Times are explicit, so that a slow machine has the same pauses.
    let at = |browser: &mut Browser, time: u32| browser.eval(&format!("performance.now = () => {time}; 0"));
    let start = |browser: &mut Browser| {
        browser.eval("document.querySelector(\"[data-edge='0 primitive 1 0']\").getAttribute('aria-valuenow')")
    };
    let begin = start(&mut browser);
    browser.key("b");
    for time in [1_000, 1_500, 2_900] {
        at(&mut browser, time);
        browser.wait(&format!("{FOCUSED} === '0 primitive 1 0'"));
        let was = start(&mut browser);
        browser.key("ArrowRight");
        browser.wait(&format!(
            "document.querySelector(\"[data-edge='0 primitive 1 0']\").getAttribute('aria-valuenow') !== {was}"
        ));
    }
    let three = start(&mut browser);
    // After a pause it is another step.
    at(&mut browser, 9_000);
    browser.key("ArrowRight");
    let is = |time: &Value| {
        format!("document.querySelector(\"[data-edge='0 primitive 1 0']\").getAttribute('aria-valuenow') === {time}")
    };
    browser.wait(&format!("!({})", is(&three)));
    browser.click("#undo");
    browser.wait(&is(&three));
    browser.click("#undo");
    browser.wait(&is(&begin));
    assert_eq!(browser.eval("document.querySelector('#undo').disabled"), true);
    browser.click("#redo");
    browser.wait(&is(&three));
    // What is moved after that is a step of its own.
    browser.eval("document.querySelector(\"[data-edge='0 primitive 1 0']\").focus()");
    browser.key("ArrowRight");
    browser.wait(&format!("!({})", is(&three)));
    browser.click("#undo");
    browser.wait(&is(&three));
    no_complaints(&browser);
}

#[test]
fn the_export_menu_closes() {
    let folder = folder();
    let Some((mut browser, _studio)) = visited(folder.path(), &OPENED) else { return };
    browser.click("[data-at='1']");
    opened(&mut browser, "b");
    const CLOSED: &str = "!document.querySelector('#exports').open";
    let open = |browser: &mut Browser| {
        browser.click("#exports summary");
        browser.wait("document.querySelector('#exports').open");
    };
    open(&mut browser);
    browser.click("#title");
    browser.wait(CLOSED);
    open(&mut browser);
    browser.key("Escape");
    browser.wait(&format!("{CLOSED} && document.activeElement.matches('#exports summary')"));
    open(&mut browser);
    browser.click("#export-elan");
    browser.wait(&format!("{CLOSED} && document.querySelector('#label-status').textContent.endsWith('is written')"));
    no_complaints(&browser);
}

/// Sixty recordings: all are listed, keys go through all of them, and the page stays small.
#[test]
fn a_list_of_sixty_recordings_is_gone_through_by_keys() {
    let folder = folder();
    let logs = folder.path().join("logs");
    let text = std::fs::read_to_string(logs.join("a.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    for at in 0..57 {
        let piece = [&lines[..1], &lines[1 + at..180 + at]].concat();
        std::fs::write(logs.join(format!("piece_{at:02}.csv")), piece.join("\n") + "\n").unwrap();
    }
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    let names: Vec<Value> =
        studio.get("api/list")["recordings"].as_array().unwrap().iter().map(|one| one["name"].clone()).collect();
    assert_eq!(names.len(), 60);
    browser.eval("document.querySelector(\"[data-at='0']\").click()");
    opened(&mut browser, names[0].as_str().unwrap());
    for name in &names[1..] {
        browser.key("j");
        opened(&mut browser, name.as_str().unwrap());
    }
    assert_eq!(browser.text("#recordings [aria-current] b"), names[59].as_str().unwrap());
    let seen = "(() => { const row = document.querySelector('#recordings [aria-current]').getBoundingClientRect(); return row.top >= 0 && row.bottom <= innerHeight; })()";
    assert_eq!(browser.eval(seen), true);
    assert!(browser.eval("document.querySelectorAll('*').length").as_u64().unwrap() < 5000);
    no_complaints(&browser);
}
