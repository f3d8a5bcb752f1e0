//! The codes of diagnostics: E1 syntax, E2 names, E3 dimensions, E4 trees and tasks, E7 limits; W the same for warnings.
//! A code is never reused.

/// The pages, one a code: a heading `## E101`, and what there is to say.
const PAGES: &str = include_str!("../../../docs/reference/codes.md");

/// The page of a code, as Markdown with its heading; `None` for an unknown code.
pub fn page(code: &str) -> Option<&'static str> {
    ALL.iter().find(|(known, _)| *known == code)?;
    let (_, rest) = PAGES.split_once(&format!("\n## {code}\n"))?;
    Some(rest.split("\n## ").next().unwrap_or(rest).trim())
}

macro_rules! codes {
    ($($(#[doc = $doc:literal])+ $name:ident = $code:literal;)+) => {
        $($(#[doc = $doc])+ pub const $name: &str = $code;)+
        /// Every code with what it stands for.
        pub const ALL: &[(&str, &str)] = &[$(($code, concat!($($doc),+))),+];
    };
}

codes! {
    /// something else was expected here
    SYNTAX = "E101";
    /// no declaration begins like this
    NO_DECLARATION = "E102";
    /// a bracket is never closed
    NEVER_CLOSED = "E103";
    /// a bracket was never opened
    NEVER_OPENED = "E104";
    /// a window needs its condition in parentheses
    BARE_WINDOW = "E105";
    /// `or` and `and` are mixed between keys
    MIXED_KEYS = "E106";

    /// nothing has this name
    UNKNOWN_NAME = "E201";
    /// a name is declared twice
    DECLARED_TWICE = "E202";
    /// a name means something else already
    NAME_TAKEN = "E203";
    /// a value of a hand is used without saying whose
    WHOSE_HAND = "E204";
    /// a value that no hand has is asked of a hand
    NO_HAND = "E205";
    /// an abstract signal has no implementation
    NOT_IMPLEMENTED = "E206";
    /// a unit is unknown
    UNKNOWN_UNIT = "E207";
    /// a file cannot be read
    UNREADABLE = "E208";
    /// a file lies outside the folder of the one that uses it
    OUTSIDE_FOLDER = "E209";
    /// files use each other in a circle
    CIRCULAR_USE = "E210";
    /// signals are defined by each other in a circle
    CIRCULAR_SIGNALS = "E211";
    /// something is read before it is declared
    READ_TOO_EARLY = "E212";
    /// a latch or `from` is read where memory of the tree has no place
    READS_MEMORY = "E213";
    /// the side of a primitive is missing or too much
    WRONG_SIDE = "E214";
    /// an override does not fit
    BAD_OVERRIDE = "E215";
    /// a primitive is a kind of another one and declares an action
    KIND_WITH_MEANING = "E216";
    /// primitives are kinds of each other in a circle
    CIRCULAR_KINDS = "E217";
    /// the action of a primitive is unknown
    UNKNOWN_MEANING = "E218";

    /// two quantities of different kinds are compared
    COMPARED_KINDS = "E301";
    /// two quantities of different kinds are added
    ADDED_KINDS = "E302";
    /// another type is wanted here
    WRONG_TYPE = "E303";
    /// a function got the wrong number of arguments
    WRONG_COUNT = "E304";
    /// two arrays do not run over the same slots
    DIFFERENT_ARRAYS = "E305";
    /// a constant is wanted here
    NOT_CONSTANT = "E306";
    /// the thresholds of a hysteresis stand in the wrong order
    THRESHOLD_ORDER = "E307";
    /// a value has no such component or finger
    NO_COMPONENT = "E308";
    /// a param lies outside its range
    OUT_OF_RANGE = "E309";
    /// an implementation does not have the type of its abstract signal
    WRONG_IMPLEMENTATION = "E310";
    /// measured numbers are asked to be equal
    MEASURED_EQUALITY = "E311";

    /// a branch leaves frames without a choice
    NOT_EXHAUSTIVE = "E401";
    /// a choice stands after `else`
    AFTER_ELSE = "E402";
    /// `stay` can be reached from `none`
    STAY_FROM_NONE = "E403";
    /// `separate` is used in the tree of a single hand
    SEPARATE_HAND = "E404";
    /// a second tree labels the same hands
    SECOND_TREE = "E405";
    /// two files extend a branch at the same place
    EXTENSION_CLASH = "E406";
    /// an extension's anchor is not in that branch, or not alone
    NO_ANCHOR = "E407";
    /// an extension brings an `else`
    EXTENDED_ELSE = "E408";
    /// the `before` orders of tasks form a cycle
    CIRCULAR_TASKS = "E409";
    /// a task whose keys are joined by `and` gets another key
    EXTENDED_AND = "E410";
    /// a rule for the segments of one task makes them `separate`
    SEPARATE_TASK = "E411";
    /// rules that are to label something have no tree
    TREE_NEEDED = "E412";
    /// the orders of the files form a cycle
    CIRCULAR_ORDER = "E413";
    /// a task that is made of tasks stands where one of primitives is needed
    COMPOSITE = "E414";
    /// a run of a task has the same task beside it
    SAME_PARTS = "E415";

    /// brackets, signs or operators are nested too deeply
    TOO_DEEP = "E701";
    /// a declaration is too long
    TOO_LONG = "E702";
    /// a file is too large
    TOO_LARGE = "E703";
    /// there are too many files
    TOO_MANY_FILES = "E704";
    /// there are too many mistakes to list
    TOO_MANY_ERRORS = "E705";
    /// a primitive has too many kinds
    TOO_MANY_KINDS = "E706";

    /// a declaration is never used
    UNUSED = "W201";
    /// a comment allows what is not there
    IDLE_ALLOW = "W202";
    /// no action is declared for a primitive
    NO_MEANING = "W203";
    /// a condition never holds
    NEVER_HOLDS = "W301";
    /// a condition always holds
    ALWAYS_HOLDS = "W302";
    /// a duration is shorter than a sample
    SHORT_DURATION = "W303";
    /// a quotient has a divisor that is zero
    ZERO_DIVISOR = "W304";
    /// a latch on `from` does not outlast the settling
    LATCH_RACES_SETTLING = "W401";
    /// a branch does not define the leaf after a new primitive
    FORGOTTEN_FROM = "W402";
    /// there is no tree
    NO_TREE = "W403";
    /// a choice is never taken
    NEVER_TAKEN = "W404";
    /// a condition always holds where it stands, and nothing after it is reached
    ALWAYS_TAKEN = "W405";
    /// an earlier task takes all that a task would name
    HIDDEN_TASK = "W406";
    /// a task asks for a primitive that nothing gives
    MISSING_LABEL = "W407";
    /// a relabeling rule never changes anything
    IDLE_RELABEL = "W408";
    /// two relabeling rules undo each other
    UNDOING_RULES = "W409";
    /// there are too many warnings to list
    TOO_MANY_WARNINGS = "W701";
}
