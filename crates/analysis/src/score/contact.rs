//! Which boundaries are made by a contact (docs/score.md): between primitives that differ in what touches what.

use teachtree_base::meaning::{Meaning, Primitives};

/// The contacts during a primitive (docs/sources.md, C1 to C20).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Contacts {
    /// The hand touches nothing, or is letting go.
    Free,
    /// The object is held and carried by something.
    Supported,
    /// The object is held in the air.
    Carried,
    /// The object is held against something beside it, and moves along it.
    Against,
    /// The object is held against something beside or below it.
    Pressed,
    /// The object is held in a hole or on a peg.
    InSocket,
    /// The object is touched and stands free.
    Touched,
    /// The object is touched and is against something beside it.
    TouchedAgainst,
    /// Both hands hold it.
    BothHands,
}

/// Whether a contact is made or lost between two primitives. Of a primitive that does not say what a hand does nothing is known: no.
pub(super) fn by_contact(primitives: &Primitives, before: &str, after: &str) -> bool {
    use Contacts::{Against, InSocket, Pressed, Supported};
    match (contacts(primitives, before), contacts(primitives, after)) {
        // A press differs from a touch by its force; a motion in a socket, by its motion.
        (Some(Pressed), Some(Supported | Against)) | (Some(Supported | Against), Some(Pressed)) => false,
        (Some(InSocket), Some(Supported)) | (Some(Supported), Some(InSocket)) => false,
        (Some(before), Some(after)) => before != after,
        _ => false,
    }
}

/// The contacts of a class; alternatives must agree.
fn contacts(primitives: &Primitives, class: &str) -> Option<Contacts> {
    let mut all = class.split('|').map(|name| primitives.does(name).and_then(of_meaning));
    let first = all.next()??;
    all.all(|other| other == Some(first)).then_some(first)
}

const fn of_meaning(meaning: Meaning) -> Option<Contacts> {
    Some(match meaning {
        Meaning::Free | Meaning::Approach | Meaning::Open => Contacts::Free,
        Meaning::Close | Meaning::Slide | Meaning::Turn | Meaning::Place => Contacts::Supported,
        Meaning::Carry => Contacts::Carried,
        Meaning::Follow => Contacts::Against,
        Meaning::Press => Contacts::Pressed,
        Meaning::Insert | Meaning::Extract => Contacts::InSocket,
        Meaning::Push => Contacts::Touched,
        Meaning::Trace => Contacts::TouchedAgainst,
        Meaning::Share | Meaning::Pass => Contacts::BothHands,
        Meaning::Hold | Meaning::Fit => return None,
    })
}
