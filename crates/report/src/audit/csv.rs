//! An audit as a table.

use super::Audit;
use teachtree_analysis::number::number;
use teachtree_base::error::InputError;

/// A row for each finding, and one for each recording without.
pub fn csv(audit: &Audit) -> Result<String, InputError> {
    let failed = |error: &dyn std::fmt::Display| InputError::new("the table", format!("cannot be written: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut row = |cells: [String; 9]| writer.write_record(cells).map_err(|error| failed(&error));
    row(["log", "good", "kind", "track", "start_s", "end_s", "message", "column", "value"].map(str::to_string))?;
    for (name, facts) in audit.recordings {
        let good = u8::from(audit.is_good(facts)).to_string();
        if facts.findings.is_empty() {
            let none = String::new;
            row([name.clone(), good, none(), none(), none(), none(), none(), none(), none()])?;
            continue;
        }
        for finding in &facts.findings {
            let track = finding.track.map_or(String::new(), |track| track.to_string());
            let [start, end] =
                finding.span_s.map_or_else(|| [String::new(), String::new()], |span_s| span_s.map(number));
            let (kind, message) = (finding.kind.name().into(), finding.message.clone());
            let column = finding.column.clone().unwrap_or_default();
            let value = finding.value.map_or(String::new(), number);
            row([name.clone(), good.clone(), kind, track, start, end, message, column, value])?;
        }
    }
    let bytes = writer.into_inner().map_err(|error| failed(&error))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
