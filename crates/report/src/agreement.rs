//! The agreement of two people as tables for terminals.

use std::fmt::Write;
use teachtree_analysis::agreement::Agreement;
use teachtree_analysis::agreement::json::AgreementByKind;
use teachtree_analysis::number::fixed;
use teachtree_logs::read::labels::LabelKind;

/// Writes the agreement of two people over `all` recordings and in each of `rows`, which are named as on the command line.
pub fn text([one, other]: &[String; 2], rows: &[(String, AgreementByKind)], all: &AgreementByKind) -> String {
    let mut text = String::new();
    let plural = if rows.len() == 1 { "" } else { "s" };
    let _ = writeln!(text, "{one} and {other}, {} recording{plural}", rows.len());
    for (kind, agreement) in all {
        let name = if *kind == LabelKind::Task { "tasks" } else { "primitives" };
        let _ = writeln!(
            text,
            "\n{name}: kappa {}, the same label on {} of {} frames that both labeled",
            number(agreement.kappa()),
            percent(agreement.share()),
            agreement.both()
        );
        let [one, other] = agreement.alone;
        if one + other > 0 {
            let _ = writeln!(text, "  labeled by one person only: {one} frames by the first, {other} by the second");
        }
        let mut table = vec![line(["label", "kappa", "frames of both", "boundaries", "alone", "median", "90 %"])];
        for label in agreement.labels() {
            table.push(row(label, &agreement.of_label(label)));
        }
        table.push(row("all", agreement));
        text.push_str(&table.concat());
        if rows.len() > 1 {
            text.push_str("  recording                                            kappa     frames\n");
            for (log, kinds) in rows {
                let Some(own) = kinds.get(kind) else { continue };
                let _ = writeln!(text, "  {log:<48}{:>10}{:>11}", number(own.kappa()), own.both());
            }
        }
    }
    if all.is_empty() {
        text.push_str("\nno labels\n");
    }
    text
}

fn row(label: &str, agreement: &Agreement) -> String {
    let boundaries = agreement.all_boundaries();
    let ms = |q: f64| boundaries.quantile_s(q).map_or("-".into(), |time| format!("{} ms", fixed(time * 1e3, 0)));
    let [one, other] = boundaries.alone;
    line([
        label,
        &number(agreement.kappa()),
        &agreement.same().to_string(),
        &boundaries.distances_s.len().to_string(),
        &format!("{one} + {other}"),
        &ms(0.5),
        &ms(0.9),
    ])
}

fn line([label, kappa, frames, pairs, alone, median, most]: [&str; 7]) -> String {
    format!("  {label:<20}{kappa:>8}{frames:>16}{pairs:>12}{alone:>10}{median:>10}{most:>10}\n")
}

fn number(value: Option<f64>) -> String {
    value.map_or("-".into(), |value| fixed(value, 3))
}

fn percent(share: Option<f64>) -> String {
    share.map_or("-".into(), |share| format!("{} %", fixed(share * 100.0, 1)))
}
