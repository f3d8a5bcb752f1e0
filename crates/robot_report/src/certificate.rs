//! A certificate as text, JSON and page.

use crate::framing::framing;
use crate::json::exact;
use crate::picture::picture;
use serde_json::{Value, json};
use std::fmt::Write;
use teachtree_analysis::number::decimals;
use teachtree_command::Commands;
use teachtree_report::page::STYLE;
use teachtree_report::svg::{escape, length};
use teachtree_robot::certificate::binomial::{CONFIDENCE, RATE};
use teachtree_robot::certificate::{CellQuantity, Certificate, CertificationFailure, FaceReport, Stop};
use teachtree_robot::simulation::trace::TraceSample;
use teachtree_robot::simulation::{Fault, Performance};

/// A certificate with its program.
pub struct CertificateDocument<'c> {
    /// The commands.
    pub commands: &'c Commands,
    /// The varied quantities.
    pub quantities: &'c [&'static CellQuantity],
    /// The seed of the search.
    pub seed: u64,
    /// The certificate, or why there is none.
    pub result: Result<Certificate, CertificationFailure>,
}

impl CertificateDocument<'_> {
    /// Formats the certificate for terminals.
    pub fn text(&self) -> String {
        let mut text = self.headline();
        text.push('\n');
        let Ok(certificate) = &self.result else { return text };
        let width = self.quantities.iter().map(|quantity| quantity.name.len()).max().unwrap_or(0);
        for (quantity, faces) in self.by_quantity(certificate) {
            let _ = writeln!(
                text,
                "{:width$}  {}  (alone {}; step {})",
                quantity.name,
                interval(quantity, &faces, |face| face.reach),
                interval(quantity, &faces, |face| face.alone),
                quantity.format_step()
            );
            for face in faces {
                let side = if face.face.upper { "above" } else { "below" };
                let _ = writeln!(text, "{:width$}    {side}: {}", "", beyond(face));
            }
        }
        text
    }

    /// Returns the result as one sentence.
    fn headline(&self) -> String {
        match &self.result {
            Ok(Certificate { verified, confidence, bound, runs, .. }) => format!(
                "certified: in this box the program succeeds in at least {:.0} % of cells, with a confidence of {:.0} %\n\
                 {verified} of {verified} runs succeed; the one-sided lower Clopper-Pearson bound at {:.3} % is {bound:.4}; {runs} runs in all",
                RATE * 100.0,
                CONFIDENCE * 100.0,
                confidence * 100.0
            ),
            Err(CertificationFailure::Nominal(fault)) => {
                format!("not certified: the program fails in the cell of the scene itself: {}", fault.text)
            }
            Err(CertificationFailure::Runs(runs)) => format!("not certified: no box was verified within {runs} runs"),
        }
    }

    /// Returns the quantities with their faces.
    fn by_quantity<'d>(
        &'d self,
        certificate: &'d Certificate,
    ) -> impl Iterator<Item = (&'d CellQuantity, Vec<&'d FaceReport>)> {
        self.quantities.iter().enumerate().map(|(number, quantity)| {
            (*quantity, certificate.faces.iter().filter(|face| face.face.quantity == number).collect())
        })
    }

    /// Writes `teachtree.certificate/1`.
    pub fn json(&self) -> String {
        let certificate = self.result.as_ref().ok();
        let quantity = |(quantity, faces): (&CellQuantity, Vec<&FaceReport>)| {
            let side =
                |upper: bool| faces.iter().find(|face| face.face.upper == upper).map(|face| side(quantity, face));
            json!({ "name": quantity.name, "unit": quantity.si_unit(), "nominal": exact(quantity.value(0.0)),
                "step": exact(quantity.step()), "lower": side(false), "upper": side(true) })
        };
        let quantities =
            certificate.map(|certificate| self.by_quantity(certificate).map(quantity).collect::<Vec<Value>>());
        let verification = certificate.map(|it| {
            json!({ "runs": it.verified, "successes": it.verified, "confidence": exact(it.confidence), "lower_bound": exact(it.bound) })
        });
        let fault = match &self.result {
            Err(CertificationFailure::Nominal(it)) => Some(fault(it)),
            _ => None,
        };
        let runs = match &self.result {
            Ok(certificate) => certificate.runs,
            Err(CertificationFailure::Runs(runs)) => *runs,
            Err(CertificationFailure::Nominal(_)) => 1,
        };
        let document = json!({
            "schema": "teachtree.certificate/1",
            "log": self.commands.log,
            "robot": self.commands.robot,
            "certified": certificate.is_some(),
            "success_rate": exact(RATE),
            "confidence": exact(CONFIDENCE),
            "bound": "one-sided lower Clopper-Pearson",
            "seed": self.seed,
            "runs": runs,
            "verification": verification,
            "quantities": quantities,
            "nominal_fault": fault,
        });
        format!("{document}\n")
    }

    /// Writes the page; `pictures` are those of the faces with a failure, in their order.
    pub fn page(&self, pictures: &[String]) -> String {
        let title = format!("{} – certificate", escape(&self.commands.log));
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
             <style>\n{STYLE}{}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<div id=\"drawings\">\n<p>{}</p>\n",
            include_str!("page.css"),
            escape(&self.headline()).replace('\n', "<br>\n")
        );
        if let Ok(certificate) = &self.result {
            html.push_str(
                "<p>Light: the searched range. Outline: the interval in which the program succeeds while only this quantity varies. Dark: the box.</p>\n",
            );
            html.push_str("<table class=\"grasps\">\n<tr><th>quantity</th><th></th><th>box</th><th>alone</th><th>step</th></tr>\n");
            for (quantity, faces) in self.by_quantity(certificate) {
                let _ = writeln!(
                    html,
                    "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                    quantity.name,
                    bar(quantity, &faces),
                    interval(quantity, &faces, |face| face.reach),
                    interval(quantity, &faces, |face| face.alone),
                    quantity.format_step()
                );
            }
            html.push_str("</table>\n<h2>What fails first beyond each face</h2>\n<div class=\"pictures\">\n");
            let stopped = certificate.faces.iter().filter(|face| face.stop.is_some());
            for (face, picture) in stopped.zip(pictures) {
                let quantity = self.quantities[face.face.quantity];
                let side = if face.face.upper { "above" } else { "below" };
                let place = quantity.format(f64::from(face.face.sign() * face.reach));
                let _ = writeln!(
                    html,
                    "<figure>{picture}<figcaption>{} {side} {place}: {}</figcaption></figure>",
                    quantity.name,
                    escape(&beyond(face))
                );
            }
            html.push_str("</div>\n");
        }
        html.push_str("</div>\n</body>\n</html>\n");
        html
    }
}

/// Formats the interval between the faces of a quantity; a quantity without a lower face begins at its nominal value.
fn interval(quantity: &CellQuantity, faces: &[&FaceReport], reach: impl Fn(&FaceReport) -> i32) -> String {
    let [from, to] = ends(faces, reach);
    format!("{} to {}", quantity.format(from), quantity.format(to))
}

/// Returns the ends of an interval, steps.
fn ends(faces: &[&FaceReport], reach: impl Fn(&FaceReport) -> i32) -> [f64; 2] {
    [false, true].map(|upper| {
        let face = faces.iter().find(|face| face.face.upper == upper);
        face.map_or(0.0, |face| f64::from(face.face.sign() * reach(face)))
    })
}

/// Formats what fails first beyond a face.
fn beyond(face: &FaceReport) -> String {
    match &face.stop {
        None => "no failure up to the end of the searched range".into(),
        Some(Stop { fault, .. }) => {
            let [failed, of] = face.failed;
            format!(
                "{failed} of {of} runs fail within a step; first {}: {}",
                fault.kind.name().replace('_', " "),
                fault.text
            )
        }
    }
}

fn side(quantity: &CellQuantity, face: &FaceReport) -> Value {
    let value = |reach: i32| exact(quantity.value(f64::from(face.face.sign() * reach)));
    let stop = |stop: &Stop| json!({ "variation": stop.cell, "fault": fault(&stop.fault) });
    let [failed, of] = face.failed;
    json!({ "value": value(face.reach), "alone": value(face.alone), "failed_runs": failed, "runs": of,
        "first_failure": face.stop.as_ref().map(stop), "first_failure_alone": face.alone_stop.as_ref().map(stop) })
}

fn fault(fault: &Fault) -> Value {
    json!({ "kind": fault.kind.name(), "time_s": fault.time_s.map(exact), "link": fault.link, "contact": fault.contact,
        "text": fault.text })
}

/// Width and height of a bar.
const BAR: [f64; 2] = [360.0, 22.0];

/// Draws the searched range of a quantity with the box.
fn bar(quantity: &CellQuantity, faces: &[&FaceReport]) -> String {
    let [low, high] = [*quantity.range.start(), *quantity.range.end()].map(f64::from);
    let [width, height] = BAR;
    let x = |steps: f64| (steps - low) / (high - low) * width;
    let part = |class: &str, [from, to]: [f64; 2], inset: f64| {
        format!(
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            length(x(from)),
            length(inset),
            length((x(to) - x(from)).max(1.0)),
            length(height - 2.0 * inset)
        )
    };
    format!(
        "<svg viewBox=\"0 0 {} {}\" style=\"width:{width}px\">{}{}{}<path class=\"nominal\" d=\"M{} 0V{}\"/></svg>",
        length(width),
        length(height),
        part("range", [low, high], 4.0),
        part("alone", ends(faces, |face| face.alone), 4.0),
        part("box", ends(faces, |face| face.reach), 7.0),
        length(x(0.0)),
        length(height)
    )
}

/// Draws the robot at the time of a fault, or at the end if the fault has no time.
pub fn failure_picture(commands: &Commands, performed: &Performance, fault: &Fault) -> String {
    let trace = &performed.trace;
    let late = |moment: &&TraceSample| (moment.time_s - fault.time_s.unwrap_or(f64::MAX)).abs();
    let moment = trace.moments.iter().min_by(|one, other| late(one).total_cmp(&late(other)));
    let Some(moment) = moment else { return String::new() };
    let object = commands.tasks.get(moment.task).map_or("", |task| task.object.as_str());
    let drawn = picture(trace, moment, object, framing(trace, &[moment]));
    format!("<div title=\"after {} s\">{drawn}</div>", decimals(moment.time_s, 2))
}
