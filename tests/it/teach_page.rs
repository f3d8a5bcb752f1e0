//! The page of `teach --live` in a browser, by pointer, wheel and keys. Skipped with a message where no browser is installed.

use crate::browser::Browser;
use crate::program::{said, teachtree_in};
use crate::teach_live::Teaching;
use std::io::Write as _;
use std::path::Path;

/// The page of a scene, once it draws.
fn visited(folder: &Path, scene: &str) -> Option<(Browser, Teaching)> {
    let mut browser = Browser::start_drawing()?;
    browser.resize(1400, 900);
    let teaching = Teaching::start(folder, &[scene]);
    browser.visit(&teaching.address);
    shown(&mut browser);
    Some((browser, teaching))
}

/// Waits until the scene is drawn, and what there is on the page is at hand.
pub fn shown(browser: &mut Browser) {
    browser.wait("document.querySelector('#servo')?.textContent.includes('kHz')");
    browser.eval("import('./teach.js').then((module) => { window.page = module.page; })");
    browser.wait("Boolean(window.page?.hands?.hand.at)");
}

pub fn no_complaints(browser: &Browser) {
    assert!(browser.complaints.is_empty(), "{:#?}", browser.complaints);
}

pub fn numbers(browser: &mut Browser, expression: &str) -> Vec<f64> {
    browser.eval(expression).as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Waits until the palm is where the pointer has led it.
fn arrived(browser: &mut Browser) {
    browser.wait("Math.hypot(...page.hands.hand.at.map((to, axis) => to - page.state.hands[page.hands.active].palm[axis])) < 0.002");
}

/// Drags the hand over a place of the scene, again where the page was too busy to follow all of the way.
fn drag_over(browser: &mut Browser, x: f64, y: f64) {
    let place = |browser: &mut Browser, point: &str| {
        let spot = format!(
            "(() => {{ const {{ stage, hands }} = page, box = stage.canvas.getBoundingClientRect(), at = hands.hand.at, on = stage.onCanvas({point}); return [on[0] + box.x, on[1] + box.y]; }})()"
        );
        let spot = numbers(browser, &spot);
        (spot[0], spot[1])
    };
    let mut at = Vec::new();
    for _ in 0..4 {
        let (from, to) = (place(browser, "at"), place(browser, &format!("[{x}, {y}, at[2]]")));
        browser.drag(from, to);
        arrived(browser);
        at = numbers(browser, "page.hands.hand.at");
        if (at[0] - x).hypot(at[1] - y) < 0.006 {
            return;
        }
    }
    panic!("{at:?}, not {x} {y}");
}

/// Turns the wheel over the scene until the palm is led to a height.
fn wheel_to(browser: &mut Browser, height: f64) {
    let middle = browser.place("#view");
    for _ in 0..200 {
        let at = numbers(browser, "page.hands.hand.at")[2];
        if (at - height).abs() < 0.006 {
            break;
        }
        browser.wheel(middle, if at > height { 100.0 } else { -100.0 });
    }
}

#[test]
fn a_pick_and_place_is_taught_by_pointer_wheel_and_keys() {
    let folder = tempfile::tempdir().unwrap();
    let Some((mut browser, _teaching)) = visited(folder.path(), "pick_and_place") else { return };
    assert!(browser.text("#coach").starts_with("Press Record"));
    browser.click("#record");
    browser.wait("page.state.recording && page.state.recorded > 0.4");
    let found = numbers(&mut browser, "page.state.bodies[0]");
    drag_over(&mut browser, found[0], found[1]);
    browser.wait("document.querySelector('#coach').textContent.startsWith('Lower the hand')");
    wheel_to(&mut browser, found[2] + 0.112);
    arrived(&mut browser);
    browser.wait("document.querySelector('#coach').textContent.startsWith('Close the hand')");
    browser.key(" ");
    // Each side feels its force.
    browser.wait("Math.hypot(...page.state.hands[0].forces[0]) > 1.3");
    browser.wait("document.querySelector('#now .chip')?.textContent === 'Grasp'");
    browser.wait("document.querySelector('#coach').textContent.startsWith('You hold it')");
    wheel_to(&mut browser, found[2] + 0.18);
    arrived(&mut browser);
    assert!(numbers(&mut browser, "page.state.bodies[0]")[2] > found[2] + 0.05);
    drag_over(&mut browser, 0.12, 0.02);
    // Farther down than the table lets it: the hand gives way.
    wheel_to(&mut browser, found[2] + 0.10);
    browser.wait(&format!("Math.abs(page.state.bodies[0][2] - {}) < 0.001", found[2]));
    browser.wait("document.querySelector('#now .chip')?.textContent === 'Place'");
    browser.key(" ");
    browser.wait("page.state.hands[0].forces.every((force) => Math.hypot(...force) === 0)");
    wheel_to(&mut browser, found[2] + 0.22);
    arrived(&mut browser);
    browser.click("#record");
    browser.wait("document.querySelector('#done').textContent === '✓ right hand: pick and place'");
    browser.wait("document.querySelector('#takes').textContent.includes('✓ right pick_and_place box')");
    let analyzed = said(&teachtree_in(folder.path(), &["analyze", "pick_and_place.csv"]));
    assert!(analyzed.contains("pick_and_place box"), "{analyzed}");
    let placed = numbers(&mut browser, "page.state.bodies[0]");
    assert!((placed[0] - 0.12).hypot(placed[1] - 0.02) < 0.01, "{placed:?}");
    // The robot does it, and is shown.
    browser.click("[data-robot='0']");
    browser.wait("document.querySelector('#robot progress, #watch') !== null");
    // It takes as long as it takes, and goes on.
    const DONE: &str = "document.querySelector('#robot progress')?.value ?? 2";
    let mut part = 0.0;
    while part < 2.0 {
        browser.wait(&format!("({DONE}) > {part}"));
        part = browser.eval(DONE).as_f64().unwrap();
    }
    assert!(browser.text("#robot").contains("✓ The robot did it."), "{}", browser.text("#robot"));
    browser.click("#watch");
    browser.wait("!document.querySelector('#replay').hidden");
    browser.click("#end-replay");
    browser.eval("fetch('robot.html').then((answer) => answer.text()).then((text) => { window.written = text; })");
    browser.wait("window.written?.includes('<svg') && window.written.includes('robot.css')");
    browser.click("#reset");
    browser.wait(&format!("Math.abs(page.state.bodies[0][0] - {}) < 0.002", found[0]));
    for width in [400, 900, 1400] {
        browser.resize(width, 900);
        browser.wait("document.documentElement.scrollWidth <= window.innerWidth");
    }
    no_complaints(&browser);
}

/// A closed hand of which two fingers press, as beside an object that it pushes: only the live label says whether it holds the object.
#[test]
fn the_page_says_that_a_hand_holds_only_while_the_label_does() {
    let folder = tempfile::tempdir().unwrap();
    let Some((mut browser, _teaching)) = visited(folder.path(), "pick_and_place") else { return };
    browser.eval(
        "import('./show.js').then(({ Show }) => { window.coached = (label) => {
            const stage = { scene: { hands: [{ side: 'right' }], bodies: [] }, ground: { z: 0 } };
            const hands = { active: 0, isTracked: false, hand: { closes: true } };
            const tracks = label ? [{ who: 'right', label }] : [];
            const state = { recording: true, bodies: [], hands: [{ tips: [[0, 0, 0], [0, 0, 0]], forces: [[0, 0, 1], [0, 0, -1]] }] };
            Show.prototype.coach.call({ stage, hands, tracks, takes: { takes: [] } }, state);
            return document.querySelector('#coach').textContent;
        }; })",
    );
    browser.wait("Boolean(window.coached)");
    assert_eq!(browser.eval("coached(['Grasp', 0, '#000', true]).slice(0, 11)"), "You hold it");
    assert_eq!(browser.eval("coached(['Push', 0, '#000', false])"), "");
    assert_eq!(browser.eval("coached(null)"), "");
    no_complaints(&browser);
}

#[test]
fn keys_move_turn_and_undo_and_the_other_hand_takes_over() {
    let folder = tempfile::tempdir().unwrap();
    let Some((mut browser, _teaching)) = visited(folder.path(), "hand_over_left_to_right") else { return };
    let at = numbers(&mut browser, "page.hands.hand.at");
    browser.hold("ArrowRight", true);
    browser.wait(&format!("page.hands.hand.at[0] > {}", at[0] + 0.03));
    browser.hold("ArrowRight", false);
    browser.hold("q", true);
    browser.wait("page.hands.hand.q[3] > 0.1");
    browser.hold("q", false);
    arrived(&mut browser);
    browser.wait("page.state.hands[0].palm[6] > 0.09");
    assert_eq!(browser.text("#now .active"), "left");
    browser.key("n");
    browser.wait("document.querySelector('#now .active').textContent === 'right'");
    browser.hold("f", true);
    browser.wait("page.hands.hand.at[2] < 0.2");
    browser.hold("f", false);
    arrived(&mut browser);
    // A gamepad, as the browser would show one: its stick moves the hand, its first button closes the fingers.
    let x = numbers(&mut browser, "page.hands.hand.at")[0];
    browser.eval("window.pad = { connected: true, axes: [-1, 0, 0, 0], buttons: [{ pressed: false }] }; navigator.getGamepads = () => [window.pad];");
    browser.wait(&format!("page.hands.hand.at[0] < {}", x - 0.03));
    browser.eval("window.pad = { connected: true, axes: [0, 0, 0, 0], buttons: [{ pressed: true }] }");
    browser.wait("page.hands.hand.closes && document.querySelector('#close').getAttribute('aria-pressed') === 'true'");
    browser.eval("navigator.getGamepads = () => []");
    let epoch = browser.eval("page.state.epoch").as_u64().unwrap();
    browser.key("Backspace");
    browser.wait(&format!("page.state.epoch > {epoch} && page.hands.epoch === page.state.epoch"));
    // Back to the beginning, since nothing was touched.
    browser.wait(&format!("Math.abs(page.hands.hands[0].at[0] - {}) < 0.005", at[0]));
    no_complaints(&browser);
}

/// The emulated headset of the npm package `iwer`, and a hand whose fingertips are set; skipped with a message where the package is not.
fn with_headset(browser: &mut Browser) -> bool {
    let Some(place) = std::env::var_os("TEACHTREE_IWER") else {
        let _ = writeln!(std::io::stderr(), "skipped: TEACHTREE_IWER names no iwer.min.js of the npm package iwer");
        return false;
    };
    let iwer = std::fs::read_to_string(place).unwrap();
    let hand = include_str!("../fixtures/emulated_hand.js");
    browser.before_pages(&(iwer + "\n" + hand));
    true
}

#[test]
fn the_hands_of_a_headset_pick_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut browser) = Browser::start_drawing() else { return };
    if !with_headset(&mut browser) {
        return;
    }
    browser.resize(900, 600);
    let teaching = Teaching::start(folder.path(), &["pick_and_place"]);
    browser.visit(&teaching.address);
    shown(&mut browser);
    browser.wait("!document.querySelector('#headset').hidden");
    browser.click("#headset");
    browser.wait("page.hands.isTracked && !page.state.hands[0].silent");
    let go = |browser: &mut Browser, seconds: f64, at: [f64; 3], closed: f64| {
        browser.eval(&format!(
            "window.isThere = false; rig.go({seconds}, {at:?}, {closed}).then(() => {{ window.isThere = true; }})"
        ));
        browser.wait("window.isThere");
    };
    let (z, away) = (0.047, [-0.15, -0.12, 0.25]);
    go(&mut browser, 1.5, away, 0.0);
    browser.eval("page.act('record')");
    for (seconds, at, closed) in [
        (0.5, away, 0.0),
        (1.5, [-0.1, 0.0, z + 0.1], 0.0),
        (1.2, [-0.1, 0.0, z], 0.0),
        (0.8, [-0.1, 0.0, z], 1.0),
        (0.5, [-0.1, 0.0, z], 1.0),
        (1.2, [-0.1, 0.0, z + 0.04], 1.0),
        (2.0, [0.1, 0.03, z + 0.04], 1.0),
        (1.5, [0.1, 0.03, z + 0.001], 1.0),
        (0.5, [0.1, 0.03, z + 0.001], 1.0),
        (0.6, [0.1, 0.03, z + 0.001], 0.0),
        (1.0, [0.1, 0.03, z + 0.12], 0.0),
        (0.5, [0.1, 0.03, z + 0.12], 0.0),
    ] {
        go(&mut browser, seconds, at, closed);
    }
    browser.eval("page.act('record')");
    let taken = "document.querySelector(\"[data-take='0']\")";
    browser.wait(&format!("Boolean({taken}?.querySelector('button')) || {taken}?.textContent.includes('no task')"));
    let item = browser.text("[data-take='0']");
    assert!(item.contains("✓ right pick_and_place box"), "{item}");
    let placed = numbers(&mut browser, "page.state.bodies[0]");
    assert!((placed[0] - 0.1).hypot(placed[1] - 0.03) < 0.02, "{placed:?}");
    // The headset is taken off.
    browser.eval("document.querySelector('#headset').click()");
    browser.wait("!page.hands.isTracked");
    no_complaints(&browser);
}
