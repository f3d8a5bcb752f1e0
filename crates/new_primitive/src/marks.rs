//! What labels say about a new primitive, and its declaration as a person writes it.

use teachtree_analysis::TrackId;
use teachtree_analysis::score::{Span, Truth};
use teachtree_base::hands::Side;
use teachtree_language::is_primitive;
use teachtree_learn::{Declaration, MarkedTrack};

/// Reads a declaration: `Shake`, `Shake is Translate`, `Join(side) does insert while other does hold`.
///
/// # Errors
/// What is expected instead.
pub fn declaration(text: &str) -> Result<Declaration, String> {
    let (name, meaning) = text.trim().split_once(char::is_whitespace).unwrap_or((text.trim(), ""));
    let (name, sided) = name.strip_suffix("(side)").map_or((name, false), |name| (name, true));
    if !is_primitive(name) {
        return Err(
            "expected the name of a primitive, such as `Shake`, or its declaration: `Shake is Translate`".into()
        );
    }
    let meaning = Some(meaning.trim().to_string()).filter(|meaning| !meaning.is_empty());
    Ok(Declaration { name: name.into(), sided, meaning })
}

/// What labels say about a primitive. If they name nothing else, it takes place at no other time; otherwise nothing is known outside of them.
pub fn marks(truth: &Truth, new: &Declaration) -> Vec<MarkedTrack> {
    let name = |side: Option<Side>| side.map_or(new.name.clone(), |side| format!("{}({side})", new.name));
    let sides: Vec<Option<Side>> = if new.sided { Side::BOTH.map(Some).to_vec() } else { vec![None] };
    let is_new = |span: &Span| sides.iter().any(|side| span.names.contains(&name(*side)));
    let is_alone = truth.tracks.iter().flat_map(|track| &track.primitives).all(is_new);
    let mut tracks = Vec::new();
    for track in truth.tracks.iter().filter(|track| !track.primitives.is_empty()) {
        for side in sides.iter().filter(|side| side.is_none() || track.who == TrackId::Both) {
            let times = |spans: &mut dyn Iterator<Item = &Span>| spans.map(|span| [span.start_s, span.end_s]).collect();
            let is_marked = |span: &&Span| span.names.contains(&name(*side));
            let known = (!is_alone).then(|| times(&mut track.primitives.iter()));
            let marked = times(&mut track.primitives.iter().filter(is_marked));
            tracks.push(MarkedTrack { who: track.who, side: *side, marked, known });
        }
    }
    tracks
}
