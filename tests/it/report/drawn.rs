//! The pixels of a curve compared with the log: at several widths of the window and parts of the recording.

use super::build::{chapter, leaves};
use super::page::{drawn, no_complaints, opened, taught};
use super::pages::{html, measured, meta, noise};
use crate::browser::Browser;
use serde_json::Value;
use teachtree_analysis::analyze;
use teachtree_base::hands::Side;

/// Adds the plot of a signal, and collects the numbers of its axis from now on.
fn choose(browser: &mut Browser, title: &str) {
    browser.eval(&format!(
        "(() => {{ const write = CanvasRenderingContext2D.prototype.fillText;
           CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...rest) {{
             if (x === -8) (this.canvas.levels ||= []).push([Number(text), y - 4]);
             write.call(this, text, x, y, ...rest); }};
           const list = document.querySelector('#more select');
           list.value = [...list.options].find((option) => option.textContent === {title:?}).value;
           list.dispatchEvent(new Event('change')); }})()"
    ));
}

/// What is painted in one column of pixels: the highest and the lowest row of the line, and of anything of the curve.
struct PixelColumn {
    line: Option<[f64; 2]>,
    any: Option<[f64; 2]>,
}

/// The columns of the last plot, the times at its ends, and the row of a value.
fn painted(browser: &mut Browser) -> (Vec<PixelColumn>, [f64; 2], impl Fn(f64) -> f64) {
    drawn(browser);
    let printed = browser.eval(
        "(() => { const canvas = document.querySelector('.panel:last-child canvas');
           const { width, height } = canvas, { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
           const columns = [];
           for (let x = 104; x < width - 10; x++) {
             const column = [null, null, null, null];
             // The marks of the primitives are at the top.
             for (let y = 5; y < height; y++) {
               const at = 4 * (y * width + x), blue = (data[at + 2] - data[at]) * data[at + 3] / 255;
               if (blue > 100) { column[0] ??= y; column[1] = y; }
               if (blue > 40) { column[2] ??= y; column[3] = y; }
             }
             columns.push(column);
           }
           return { columns, levels: canvas.levels.slice(-2), range: document.querySelector('#range').textContent }; })()",
    );
    let rows = |a: &Value, b: &Value| Some([a.as_f64()?, b.as_f64()?]);
    let columns = printed["columns"].as_array().unwrap().iter();
    let columns = columns.map(|of| PixelColumn { line: rows(&of[0], &of[1]), any: rows(&of[2], &of[3]) }).collect();
    let ends = printed["range"].as_str().unwrap().trim_end_matches(" s").split_once(" – ").unwrap();
    let level =
        |at: usize| [&printed["levels"][at][0], &printed["levels"][at][1]].map(|number| number.as_f64().unwrap());
    let ([v0, y0], [v1, y1]) = (level(0), level(1));
    (columns, [ends.0, ends.1].map(|end| end.parse().unwrap()), move |value| y0 + (value - v0) * (y1 - y0) / (v1 - v0))
}

/// The least and the greatest value between two times; between frames the log goes straight.
fn between(values: &[f64], rate_hz: f64, from: f64, to: f64) -> [f64; 2] {
    let at = |time: f64| {
        let frame = (time * rate_hz).clamp(0.0, values.len() as f64 - 1.0);
        let before = values[frame.floor() as usize];
        before + (values[frame.ceil() as usize] - before) * frame.fract()
    };
    let inside =
        (from * rate_hz).ceil().max(0.0) as usize..((to * rate_hz).floor().max(0.0) as usize + 1).min(values.len());
    let inside = values.get(inside).unwrap_or(&[]).iter().copied();
    inside.chain([at(from), at(to)]).fold([f64::MAX, f64::MIN], |[a, b], value| [a.min(value), b.max(value)])
}

/// Compares what is painted with the log: nothing where the log has no value nearby, and all that it has.
fn compare(browser: &mut Browser, values: &[f64], rate_hz: f64, what: &str) {
    let (columns, [from, to], row) = painted(browser);
    assert!(columns.len() > 150, "{} columns of {what}", columns.len());
    let time = |column: f64| from + (to - from) * column / columns.len() as f64;
    // Half of a line, and what smoothing adds; the range in the address is rounded to a millisecond.
    let thick = 2.3;
    let slack = 1.6 + 0.001 / (to - from) * columns.len() as f64;
    for (at, column) in columns.iter().enumerate() {
        let at = at as f64;
        let [least, greatest] = between(values, rate_hz, time(at - slack), time(at + 1.0 + slack));
        if let Some([top, bottom]) = column.line {
            let (high, low) = (row(greatest) - thick, row(least) + thick);
            assert!(
                top >= high - 1.0 && bottom <= low,
                "{what}: rows {top} to {bottom} are painted at {:.3} s, the log is within {high} to {low}",
                time(at)
            );
        }
        if at < 2.0 || at + 3.0 > columns.len() as f64 {
            continue;
        }
        let inner = slack.min(2.0) - 1.6;
        let [least, greatest] = between(values, rate_hz, time(at + inner), time((at + 1.0 - inner).max(at + inner)));
        let [top, bottom] = column.any.unwrap_or_else(|| panic!("{what}: nothing is drawn at {:.3} s", time(at)));
        assert!(
            top <= row(greatest) + thick && bottom >= row(least) - thick,
            "{what}: rows {top} to {bottom} are painted at {:.3} s, the log reaches {} to {}",
            time(at),
            row(greatest),
            row(least)
        );
    }
}

/// The size of the sum of the forces of the fingertips, by row of a log.
fn force(log: &str) -> Vec<f64> {
    let mut rows = log.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let columns = ["x", "y", "z"].map(|axis| {
        let of = format!(".force.{axis} [N]");
        (0..header.len())
            .filter(|at| header[*at].starts_with("right.") && header[*at].ends_with(&of))
            .collect::<Vec<_>>()
    });
    assert_eq!(columns.each_ref().map(Vec::len), [5, 5, 5]);
    let sum = |row: &[&str], of: &[usize]| of.iter().map(|at| row[*at].parse::<f64>().unwrap()).sum::<f64>();
    rows.map(|row| columns.each_ref().map(|of| sum(&row, of)).iter().map(|force| force * force).sum::<f64>().sqrt())
        .collect()
}

#[test]
fn a_curve_is_drawn_as_it_was_measured() {
    let Some((mut browser, page, _folder)) = taught("paper_box", "1") else { return };
    let values = force(&std::fs::read_to_string(page.with_extension("csv")).unwrap());
    choose(&mut browser, "|F| of the hand");
    for width in [390, 420, 800, 1280] {
        browser.resize(width, 900);
        for part in ["from=0&to=1000", "from=4&to=12", "from=8&to=9"] {
            browser.eval(&format!("location.hash = '#t=8&{part}'"));
            compare(&mut browser, &values, 1000.0, &format!("{part} on {width} pixels"));
            assert_eq!(browser.text(".panel:last-child .detail"), "", "all is stored");
        }
    }
    no_complaints(&browser);
}

/// A page of six minutes of noise in all channels, and the size of the force of the right hand, which has a step in the middle.
fn long_page() -> (String, Vec<f64>) {
    let stretch = 0..360_000;
    let mut frames = measured(std::slice::from_ref(&stretch));
    noise(&mut frames);
    let force = frames.channel("fingers.force").unwrap();
    let mut size = Vec::new();
    for (key, column) in frames.columns.iter_mut().filter(|(key, _)| key.channel == force) {
        match (key.slot, key.component) {
            (0, 2) => {
                column.iter_mut().enumerate().for_each(|(at, value)| *value += if at < 180_000 { 3.0 } else { 9.0 })
            }
            _ => column.fill(0.0),
        }
        if (key.side, key.slot, key.component) == (Some(Side::Right), 0, 2) {
            size.clone_from(column);
        }
    }
    let rules = chapter();
    let leaves = [leaves(&rules, 0, &[("left", "Move 360000"), ("right", "Move 360000")])];
    (html(&analyze(&rules, &frames, &leaves), &frames, &leaves, &meta()), size)
}

/// Six minutes of noise on both sides of a step: what the page does not hold is a band, and it says so.
#[test]
fn where_detail_is_missing_there_is_no_line() {
    let mut values: Vec<f64> = Vec::new();
    let page = opened(|folder| {
        let (page, force) = long_page();
        values = force;
        std::fs::write(folder.join("page.html"), page).unwrap();
        folder.join("page.html")
    });
    let Some((mut browser, ..)) = page else { return };
    choose(&mut browser, "right |F| of the hand");
    for width in [390, 1280] {
        browser.resize(width, 900);
        for (part, detail) in [
            ("from=0&to=1000", false),
            ("from=140&to=200", false),
            ("from=175&to=185", true),
            ("from=179.9&to=180.2", true),
        ] {
            browser.eval(&format!("location.hash = '#t=180&{part}'"));
            compare(&mut browser, &values, 1000.0, &format!("{part} on {width} pixels"));
            let printed = browser.text(".panel:last-child .detail");
            assert!(!detail || printed.starts_with("This page holds no more detail here: a band"), "{part}: {printed}");
        }
    }
    // A number within a band is not known: its bounds are.
    browser.eval("location.hash = '#t=180.0005&from=179.9&to=180.2'");
    browser.wait("document.querySelector('.panel:last-child .values').textContent.includes(' … ')");
    no_complaints(&browser);
}
