//! The page of `teach --live` with a camera: the hand that MediaPipe Hands finds in its pictures leads the hand of the scene. Skipped with a message where there
//! is no browser or MediaPipe.

use crate::browser::Browser;
use crate::program::{complained, teachtree_in};
use crate::teach_live::Teaching;
use crate::teach_page::{no_complaints, numbers, shown};
use std::io::Write as _;
use std::path::Path;
use teachtree_teaching::HandFinder;

/// A right hand that is rendered with an angle of view of 60°: the generic hand of the WebXR input profiles (npm `@webxr-input-profiles/assets`, MIT license).
const PICTURE: &[u8] = include_bytes!("../fixtures/camera/right_hand.jpg");
/// Where its tips of thumb, index and middle finger, and its wrist, are in the frame of the camera: to the right of the picture, down, away, m.
const POINTS: [[f64; 3]; 4] =
    [[0.006, 0.063, 0.477], [-0.08, 0.005, 0.479], [-0.089, -0.022, 0.48], [0.066, -0.015, 0.393]];

fn distance(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_hand_is_found_in_the_picture_of_a_camera() {
    let Some(package) = std::env::var_os("TEACHTREE_MEDIAPIPE") else {
        let _ = writeln!(
            std::io::stderr(),
            "skipped: TEACHTREE_MEDIAPIPE names no folder of the npm package @mediapipe/hands"
        );
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let pictures = folder.path().join("hand.mjpeg");
    std::fs::write(&pictures, PICTURE.repeat(30)).unwrap();
    let Some(mut browser) = Browser::start_with_camera(&pictures) else { return };
    browser.resize(900, 600);
    let teaching = Teaching::start(folder.path(), &["pick_and_place", "--camera", package.to_str().unwrap()]);
    browser.visit(&teaching.address);
    shown(&mut browser);
    browser.click("#camera");
    browser.wait("page.camera.known.get('right')?.points && page.hands.isTracked");
    assert_eq!(browser.text("#camera-status"), "");
    // The camera faces the person: to the right of the picture is to the left in the scene.
    let point = |browser: &mut Browser, landmark: usize| -> Vec<f64> {
        let [x, y, z] = numbers(browser, &format!("page.camera.known.get('right').points[{landmark}]"))[..] else {
            panic!()
        };
        vec![-x, -z, -y]
    };
    let found: Vec<Vec<f64>> = [4, 8, 12, 0].map(|landmark| point(&mut browser, landmark)).to_vec();
    for (found, is) in found.iter().zip(&POINTS) {
        // A picture tells distances badly: 60 mm of 0.45 m; what is across the picture, to 25 mm.
        assert!(distance(&found[..2], &is[..2]) < 0.025 && (found[2] - is[2]).abs() < 0.06, "{found:?}, not {is:?}");
    }
    // The hand of the scene stays where it was when the hand came into view.
    let far = numbers(
        &mut browser,
        "(([palm, ...tips]) => tips.reduce((sum, tip) => sum.map((part, axis) => part + tip.point[axis] / tips.length), [0, 0, 0]).map((part, axis) => part - page.hands.hand.at[axis]))(page.camera.known.get('right').steady)",
    );
    assert!(far[0].hypot(far[1]) < 0.06 && far[2].abs() < 0.2, "{far:?}");
    browser.eval("document.querySelector('#camera').click()");
    browser.wait("!page.hands.isTracked && document.querySelector('#camera-picture').hidden");
    no_complaints(&browser);
}

/// A folder with the names of the package's files, for a page on which what finds hands is emulated.
fn package_in(folder: &Path) -> std::path::PathBuf {
    let package = folder.join("hands");
    std::fs::create_dir(&package).unwrap();
    for (name, _) in HandFinder::FILES {
        std::fs::write(package.join(name), "").unwrap();
    }
    package
}

#[test]
fn a_hand_before_a_camera_picks_and_places() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut browser) = Browser::start_drawing() else { return };
    browser.before_pages(include_str!("../fixtures/emulated_camera.js"));
    browser.resize(900, 600);
    let package = package_in(folder.path());
    let teaching = Teaching::start(folder.path(), &["pick_and_place", "--camera", package.to_str().unwrap()]);
    browser.visit(&teaching.address);
    shown(&mut browser);
    browser.click("#camera");
    browser.wait("page.hands.isTracked && !page.state.hands[0].silent");
    // The hand came into view where that of the scene is.
    let start = numbers(
        &mut browser,
        "page.state.hands[0].tips.reduce((sum, tip) => sum.map((part, axis) => part + tip[axis] / 3), [0, 0, 0])",
    );
    let go = |browser: &mut Browser, pictures: usize, to: [f64; 3], closed: f64| {
        // The middle of the tips in the rig is beside its place.
        let way = [to[0] - start[0], to[1] - start[1] + 0.02, to[2] - start[2] + 0.3];
        browser.eval(&format!("rig.go({pictures}, {way:?}, {closed})"));
        browser.wait("rig.isThere()");
    };
    let z = 0.047;
    browser.eval("page.act('record')");
    for (pictures, at, closed) in [
        (50, [-0.1, 0.0, z + 0.12], 0.0),
        (30, [-0.1, 0.0, z], 0.0),
        (25, [-0.1, 0.0, z], 1.0),
        (30, [-0.1, 0.0, z + 0.04], 1.0),
        (60, [0.1, 0.03, z + 0.04], 1.0),
        (30, [0.1, 0.03, z + 0.001], 1.0),
        (20, [0.1, 0.03, z + 0.001], 0.0),
        (30, [0.1, 0.03, z + 0.12], 0.0),
    ] {
        go(&mut browser, pictures, at, closed);
    }
    browser.eval("page.act('record')");
    browser.wait("document.querySelector('#takes').textContent.includes('✓ right pick_and_place box')");
    let placed = numbers(&mut browser, "page.state.bodies[0]");
    assert!((placed[0] - 0.1).hypot(placed[1] - 0.03) < 0.02, "{placed:?}");
    no_complaints(&browser);
}

#[test]
fn a_folder_that_is_not_the_package_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = teachtree_in(folder.path(), &["teach", "pick_and_place", "--live", "--no-open", "--camera", "."]);
    assert_eq!(refused.status.code(), Some(2));
    let message = "is not the npm package @mediapipe/hands: it has no hands.js";
    assert!(complained(&refused).contains(message), "{}", complained(&refused));
    let refused = teachtree_in(folder.path(), &["teach", "pick_and_place", "--camera", "."]);
    assert!(complained(&refused).contains("--camera"), "{}", complained(&refused));
}
