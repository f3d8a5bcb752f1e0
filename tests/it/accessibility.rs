//! The pages that the program writes and serves, audited by axe (Deque Systems) in a real browser, light and dark, on a desk and on a phone. Skipped with a
//! message where there is no browser or no axe.

use crate::browser::Browser;
use crate::program::{complained, demonstrate, teachtree_in};
use crate::studio::against::add_other_rules;
use crate::studio::fit::with_labels;
use crate::studio::{OPENED, Studio, folder};
use std::path::Path;

/// Nothing serious is found at any width, light or dark.
fn is_clean(browser: &mut Browser, page: &str) {
    for dark in [false, true] {
        browser.prefer_dark(dark);
        for width in [1440, 900, 390] {
            browser.resize(width, 900);
            crate::report::page::drawn(browser);
            let Some(found) = browser.audit() else { return };
            assert!(found.is_empty(), "{page}, {width} wide, dark {dark}: {found:#?}");
        }
    }
}

fn run(folder: &Path, args: &[&str]) {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{args:?}: {}", complained(&output));
}

#[test]
fn the_studio_is_accessible() {
    let folder = folder();
    let Some(mut browser) = Browser::start() else { return };
    let studio = Studio::start(folder.path(), &OPENED);
    studio.list();
    browser.visit(&studio.address);
    browser.wait("document.querySelector('#recordings [aria-current]') !== null");
    is_clean(&mut browser, "the list");
    browser.resize(1440, 900);
    browser.click("[data-at='1']");
    browser.wait("document.querySelectorAll('#lanes .bar').length > 0");
    browser.eval("document.querySelectorAll('details').forEach((one) => { one.open = true; })");
    is_clean(&mut browser, "a recording");
}

#[test]
fn a_fit_and_two_rule_sets_are_accessible() {
    let folder = with_labels(false);
    add_other_rules(folder.path());
    let Some(mut browser) = Browser::start() else { return };
    let args =
        ["logs", "--binding", "lift.yaml", "--each", "--rules", "contact.rules", "--against", "near/contact.rules"];
    let studio = Studio::start(folder.path(), &args);
    studio.list();
    browser.resize(1440, 900);
    browser.visit(&studio.address);
    browser.wait("document.querySelector('#recordings [aria-current]') !== null");
    browser.click("[data-at='0']");
    browser.wait("document.querySelectorAll('#lanes .bar.other').length > 0");
    browser.click("#tune summary");
    browser.click("#begin-fit");
    browser.wait("!document.querySelector('#take-fit').hidden");
    is_clean(&mut browser, "a fit beside two rule sets");
}

#[test]
fn a_report_is_accessible() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut browser) = Browser::start() else { return };
    demonstrate("hold_and_insert", &["--seed", "3"], folder.path().join("log.csv"));
    run(folder.path(), &["analyze", "log.csv", "--report", "report.html"]);
    browser.open(&folder.path().join("report.html"));
    is_clean(&mut browser, "a report");
}

#[test]
fn a_page_of_a_data_set_is_accessible() {
    let folder = folder();
    let Some(mut browser) = Browser::start() else { return };
    run(folder.path(), &["audit", "logs", "--each", "--binding", "lift.yaml", "--page", "audit.html"]);
    browser.open_plain(&folder.path().join("audit.html"));
    is_clean(&mut browser, "an audit");
}
