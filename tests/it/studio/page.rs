//! The page in a browser, by pointer and keyboard. Skipped with a message where no browser is installed.

use super::{OPENED, Studio, folder};
use crate::browser::Browser;
use serde_json::json;
use std::path::Path;

/// A page over recordings, once the list is full.
fn visited(folder: &Path, args: &[&str]) -> Option<(Browser, Studio)> {
    let mut browser = Browser::start()?;
    browser.resize(1440, 900);
    let studio = Studio::start(folder, args);
    studio.list();
    browser.visit(&studio.address);
    browser.wait("document.querySelector('#recordings [data-at]') !== null");
    Some((browser, studio))
}

/// Waits until a recording is drawn.
fn opened(browser: &mut Browser, name: &str) {
    browser.wait(&format!(
        "document.querySelector('#title').textContent === {} && document.querySelectorAll('#lanes .bar').length > 0",
        json!(name)
    ));
}

fn no_complaints(browser: &Browser) {
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
