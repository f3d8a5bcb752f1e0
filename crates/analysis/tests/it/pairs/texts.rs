//! Generates random pairs of rule sets as texts: a base with all kinds of declarations, and the same rule set with additional or changed declarations.
//! A base is generated or uses a shipped file.

use crate::numbers::Random;
use std::fmt;

/// Two rule sets as lists of declarations.
#[derive(Clone, Debug)]
pub struct Pair {
    pub base: Vec<String>,
    pub extended: Vec<String>,
}

impl Pair {
    /// Returns all pairs with one declaration less, in the extension or in both rule sets.
    pub fn shorter(&self) -> impl Iterator<Item = Self> + '_ {
        let without = |items: &[String], at: usize| {
            items.iter().enumerate().filter(|(other, _)| *other != at).map(|(_, item)| item.clone()).collect::<Vec<_>>()
        };
        let of_both = (0..self.base.len()).filter_map(move |at| {
            let known = self.extended.iter().position(|item| *item == self.base[at])?;
            Some(Self { base: without(&self.base, at), extended: without(&self.extended, known) })
        });
        let of_one = (0..self.extended.len())
            .map(move |at| Self { base: self.base.clone(), extended: without(&self.extended, at) })
            .filter(|pair| pair.extended != pair.base);
        of_one.chain(of_both)
    }
}

impl fmt::Display for Pair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "--- base\n{}\n--- extended\n{}\n---", self.base.join("\n"), self.extended.join("\n"))
    }
}

/// Known faults as base and addition: other ends of tasks, and a rule that another one only seems to cover.
pub const FOUND: &[(&str, &str)] = &[
    (
        "use \"stream.rules\"\nprimitive A, B, C, D, E\nfor each hand { signal s1 = fingers.contact[thumb]  signal s2 = fingers.contact[index] }\n\
         tree hand for each hand { from(none) => A  s1 and s2 => C  s1 => B  s2 => D  else => A }\ntask t = A .. D with C",
        "primitive N is C\nextend hand first { s1 and s2 and load > 900 N and not from(none) => N }\ntask u = A .. B with N",
    ),
    (
        "use \"stream.rules\"\nprimitive A, B, C, D\nfor each hand { signal s1 = fingers.contact[thumb]  signal s2 = fingers.contact[index] }\n\
         tree hand for each hand { from(none) => A  s1 and s2 => C  s1 => B  s2 => D  else => A }\n\
         relabel { (B or C)+ shorter than 150 ms between A and (C or D) becomes D }",
        "relabel { B shorter than 150 ms between A and C becomes D }",
    ),
];

/// The names that an extension may use.
struct Vocabulary {
    primitives: Vec<String>,
    signals: Vec<String>,
    /// Places where the tree of a hand can be extended.
    branches: Vec<String>,
    tasks: Vec<String>,
    rules: Vec<BetweenRule>,
    /// Whether the rules have a tree over both hands.
    both: bool,
    /// Number of generated names.
    made: usize,
}

/// A relabeling rule for segments between two neighbors.
#[derive(Clone)]
struct BetweenRule {
    what: Vec<String>,
    run: bool,
    shorter_ms: Option<usize>,
    before: Vec<String>,
    after: Vec<String>,
    becomes: String,
}

impl fmt::Display for BetweenRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let any = |labels: &[String]| match labels {
            [one] => one.clone(),
            several => format!("({})", several.join(" or ")),
        };
        let run = if self.run && self.what.len() > 1 { "+" } else { "" };
        let shorter = self.shorter_ms.map_or(String::new(), |time| format!(" shorter than {time} ms"));
        let (what, before, after, becomes) = (any(&self.what), any(&self.before), any(&self.after), &self.becomes);
        write!(f, "{what}{run}{shorter} between {before} and {after} becomes {becomes}")
    }
}

/// Returns a random pair. (Some have an error: an undeclared name, or a task before itself.)
pub fn pair(random: &mut Random) -> Pair {
    let (base, mut known) = if random.chance(5) { shipped(random) } else { generated(random) };
    let mut extended = base.clone();
    if random.chance(20) {
        changed(random, &mut extended);
        return Pair { base, extended };
    }
    if random.chance(70) {
        extended.extend(new_primitive(random, &mut known));
    }
    for _ in 0..1 + random.below(3) {
        extended.extend(addition(random, &mut known));
    }
    Pair { base, extended }
}

fn one<'t>(random: &mut Random, all: &'t [String]) -> &'t str {
    &all[random.below(all.len())]
}

fn some(random: &mut Random, all: &[String], most: usize) -> Vec<String> {
    let mut found: Vec<String> = (0..1 + random.below(most)).map(|_| one(random, all).to_string()).collect();
    found.sort();
    found.dedup();
    found
}

fn owned(words: &str) -> Vec<String> {
    words.split_whitespace().map(str::to_string).collect()
}

/// Returns a base that uses a shipped file.
fn shipped(random: &mut Random) -> (Vec<String>, Vocabulary) {
    let (file, primitives, tasks) = match random.below(3) {
        0 => ("single_hand.rules", "", ""),
        1 => ("contact.rules", "Press Follow Push Trace", "pick_and_press push"),
        _ => ("bimanual.rules", "Press Push EqualGrasp Pass Fit", "pick_and_press push fit"),
    };
    let known = Vocabulary {
        primitives: owned(&format!("Move Approach Grasp Translate Slide Release Place Turn {primitives}")),
        signals: owned("touching grasped moving supported near lifted leaving"),
        branches: owned("single_hand single_hand.apart single_hand.inside"),
        tasks: owned(&format!("turn_screw pick_and_place slide {tasks}")),
        rules: vec![BetweenRule {
            what: owned("Grasp Translate"),
            run: true,
            shorter_ms: Some(500),
            before: owned("Approach"),
            after: owned("Translate Place"),
            becomes: "Slide".into(),
        }],
        both: file == "bimanual.rules",
        made: 0,
    };
    let mut base = vec![format!("use \"{file}\"")];
    if random.chance(50) {
        base.push(format!("relabel {{ {} }}", known.rules[0]));
    }
    (base, known)
}

/// Returns a generated base.
fn generated(random: &mut Random) -> (Vec<String>, Vocabulary) {
    let mut base = vec![
        "use \"stream.rules\"".into(),
        "param p0 = 60 ms in 10 ms .. 1 s".into(),
        "stream { for each hand { optional gripper.closed : bool = false } }".into(),
        "primitive A does free, B does approach, C does close, D does carry, E does open".into(),
        "for each hand { signal s0 = any(fingers.contact)  signal s1 = fingers.contact[thumb]  signal s2 = fingers.contact[index] }".into(),
        "for each hand { signal s3 = gripper.closed  signal s4 = norm(target.velocity) above 20 mm/s until below 10 mm/s }".into(),
        "for each hand { signal s5 = (s1) within last p0  signal s6 = load > 0.5 N }".into(),
        "for each hand { signal s7 = (s2) bridging p0  signal s8 = (s4) lasting p0 }".into(),
    ];
    let mut known = Vocabulary {
        primitives: owned("A B C D E"),
        signals: owned("s0 s1 s2 s3 s4 s5 s6 s7 s8"),
        branches: owned("hand hand.inner"),
        tasks: Vec::new(),
        rules: Vec::new(),
        both: random.chance(30),
        made: 0,
    };
    if random.chance(30) {
        base.push("primitive K is D".into());
        known.primitives.push("K".into());
    }
    if random.chance(50) {
        let (set, clear) = (condition(random, &known), condition(random, &known));
        base.push(format!("for each hand {{ latch l0 set {set} clear {clear} }}"));
        known.signals.push("l0".into());
    }
    if random.chance(15) {
        base.push(format!("latch l1 set left.s1 and from({}) clear right.s2", one(random, &known.primitives)));
        known.signals.push("l1".into());
    }
    base.push(tree(random, &known));
    if known.both {
        let leaf = one(random, &known.primitives);
        base.push(format!(
            "tree both_hands for left, right, settle 20 ms {{ left.s1 and right.s1 => {leaf}  left.s3 and right.s3 and not from(none) => stay  else => separate }}"
        ));
    }
    for _ in 0..1 + random.below(3) {
        base.push(task(random, &mut known));
    }
    if random.chance(30) {
        base.push(composite(random, &mut known));
    }
    for _ in 0..random.below(5) {
        base.push(relabel(random, &mut known, None));
    }
    (base, known)
}

fn tree(random: &mut Random, known: &Vocabulary) -> String {
    let settle = [0, 20, 50][random.below(3)];
    let leaf = |random: &mut Random| {
        if random.chance(10) { "stay".to_string() } else { one(random, &known.primitives).to_string() }
    };
    // In a tree over two contacts each leaf occurs in most recordings, in many orders.
    if random.chance(40) {
        let leaves: Vec<String> = (0..5).map(|_| leaf(random)).collect();
        return format!(
            "tree hand for each hand, settle {settle} ms {{ from(none) => A  s1 and s2 => {}  s1 => {}  inner: s2 {{ s3 => {}  else => {} }}  else => {} }}",
            leaves[0], leaves[1], leaves[2], leaves[3], leaves[4]
        );
    }
    let mut choices = vec!["from(none) => A".to_string()];
    for _ in 0..1 + random.below(4) {
        choices.push(format!("{} => {}", condition(random, known), leaf(random)));
    }
    let inner = format!(
        "inner: {} {{ {} => {}  else => {} }}",
        condition(random, known),
        condition(random, known),
        leaf(random),
        leaf(random)
    );
    choices.push(inner);
    choices.push(format!("else => {}", leaf(random)));
    format!("tree hand for each hand, settle {settle} ms {{ {} }}", choices.join("  "))
}

/// Returns a condition of a hand.
fn condition(random: &mut Random, known: &Vocabulary) -> String {
    let atom = |random: &mut Random| {
        let signal = one(random, &known.signals).to_string();
        match random.below(8) {
            0 | 1 => format!("not {signal}"),
            2 => format!("from({})", some(random, &known.primitives, 2).join(", ")),
            3 => format!("({signal} or {})", one(random, &known.signals)),
            _ => signal,
        }
    };
    let first = atom(random);
    if random.chance(40) { format!("{first} and {}", atom(random)) } else { first }
}

fn new_name(known: &mut Vocabulary, prefix: &str) -> String {
    known.made += 1;
    format!("{prefix}{}", known.made)
}

/// Returns a new primitive and its case in a tree.
fn new_primitive(random: &mut Random, known: &mut Vocabulary) -> Vec<String> {
    let name = new_name(known, "N");
    let kind = match random.below(3) {
        0 => String::new(),
        1 => " does carry".to_string(),
        _ => format!(" is {}", one(random, &known.primitives)),
    };
    let branch = one(random, &known.branches).to_string();
    // Most of these conditions never hold in a recording, but a proof cannot use that.
    let rare = if random.chance(60) { "load > 900 N".to_string() } else { condition(random, known) };
    known.primitives.push(name.clone());
    vec![
        format!("primitive {name}{kind}"),
        format!("extend {branch} first {{ {rare} and {} and not from(none) => {name} }}", condition(random, known)),
    ]
}

/// Returns a label, preferably the new primitive.
fn label(random: &mut Random, known: &Vocabulary) -> String {
    let newest = &known.primitives[known.primitives.len() - 1];
    if newest.starts_with('N') && random.chance(30) { newest.clone() } else { one(random, &known.primitives).into() }
}

fn labels(random: &mut Random, known: &Vocabulary) -> Vec<String> {
    let mut labels: Vec<String> = (0..1 + random.below(2)).map(|_| label(random, known)).collect();
    labels.sort();
    labels.dedup();
    labels
}

fn task(random: &mut Random, known: &mut Vocabulary) -> String {
    let name = new_name(known, "t");
    let (first, last) = match random.below(10) {
        0..=5 if known.primitives[0] == "A" => ("A".into(), "E".into()),
        0..=5 => ("Move".into(), "Release".into()),
        _ => (label(random, known), label(random, known)),
    };
    let keys: Vec<String> = labels(random, known).into_iter().map(|label| key(random, label)).collect();
    let word = if random.chance(70) { " or " } else { " and " };
    let without = if random.chance(20) { format!(" without {}", label(random, known)) } else { String::new() };
    let joined = if random.chance(15) { ", joined" } else { "" };
    let failure = outcome(random);
    let before = match known.tasks.len() {
        many if many > 0 && random.chance(50) => format!(" before {}", known.tasks[random.below(many)]),
        _ => String::new(),
    };
    known.tasks.push(name.clone());
    format!("task {name} = {first} .. {last} with {}{without}{joined}{failure}{before}", keys.join(word))
}

fn outcome(random: &mut Random) -> &'static str {
    if random.chance(20) { " is failure" } else { "" }
}

fn key(random: &mut Random, label: String) -> String {
    match random.below(4) {
        0 => format!("{label} lasting {} ms", 20 + 10 * random.below(20)),
        1 => format!("{label} travelling {} mm", 1 + random.below(40)),
        _ => label,
    }
}

fn composite(random: &mut Random, known: &mut Vocabulary) -> String {
    let name = new_name(known, "c");
    let (first, second) = (one(random, &known.tasks).to_string(), one(random, &known.tasks));
    match random.below(3) {
        0 => format!("task {name} = {first}+{}", outcome(random)),
        1 => format!("task {name} = {first}, {second}{}", outcome(random)),
        _ => format!("task {name} = {first}+, {second}{}", outcome(random)),
    }
}

/// Returns a relabeling rule for all tasks or for one.
fn relabel(random: &mut Random, known: &mut Vocabulary, task: Option<&str>) -> String {
    let head = task.map_or("relabel".to_string(), |task| format!("relabel {task}"));
    let rule = match random.below(12) {
        0 => format!("{}, {} become {}", label(random, known), label(random, known), label(random, known)),
        1 => {
            let [a, b, c, d] = [0; 4].map(|_| label(random, known));
            format!("sequence {a}, ({b} or {c})*, {d} becomes {}", label(random, known))
        }
        2 if known.both && task.is_none() => {
            format!("{} in both without {} becomes separate", label(random, known), label(random, known))
        }
        3 => {
            let [a, b, c, d, e] = [0; 5].map(|_| label(random, known));
            let becomes = if known.both && task.is_none() && random.chance(30) {
                "separate".into()
            } else {
                label(random, known)
            };
            format!("{a} between {b} and {c} in one hand and between {d} and {e} in the other becomes {becomes}")
        }
        4..=7 if !known.rules.is_empty() => {
            let rule = known.rules[random.below(known.rules.len())].clone();
            narrower(random, rule, known).to_string()
        }
        _ => {
            // Bounded runs of several labels matter most: a part of one is shorter than all of it.
            let run = random.chance(60);
            let mut what = labels(random, known);
            if run {
                what.push(label(random, known));
                what.sort();
                what.dedup();
            }
            let rule = BetweenRule {
                what,
                run,
                shorter_ms: if random.chance(60) { Some(30 + 10 * random.below(40)) } else { None },
                before: labels(random, known),
                after: labels(random, known),
                becomes: label(random, known),
            };
            known.rules.push(rule.clone());
            rule.to_string()
        }
    };
    format!("{head} {{ {rule} }}")
}

/// Returns a rule that seems to match less than another one.
fn narrower(random: &mut Random, rule: BetweenRule, known: &Vocabulary) -> BetweenRule {
    let fewer = |random: &mut Random, mut labels: Vec<String>| {
        if labels.len() > 1 && random.chance(50) {
            labels.remove(random.below(labels.len()));
        }
        if random.chance(20) {
            labels.push(label(random, known));
            labels.dedup();
        }
        labels
    };
    let shorter_ms = match rule.shorter_ms {
        Some(time) if random.chance(50) => Some(time / 2 + 10),
        None if random.chance(30) => Some(30 + 10 * random.below(30)),
        same => same,
    };
    BetweenRule {
        what: fewer(random, rule.what),
        run: rule.run && random.chance(70),
        shorter_ms,
        before: fewer(random, rule.before),
        after: fewer(random, rule.after),
        becomes: if random.chance(85) { rule.becomes } else { label(random, known) },
    }
}

/// Returns an additional declaration of an extension other than a new primitive.
fn addition(random: &mut Random, known: &mut Vocabulary) -> Vec<String> {
    let tree = known.branches[0].clone();
    let text = match random.below(24) {
        0..=6 => task(random, known),
        7..=8 if !known.tasks.is_empty() => {
            let keys = labels(random, known);
            format!("extend task {} with {}", one(random, &known.tasks), keys.join(" or "))
        }
        9..=13 => relabel(random, known, None),
        14..=16 if !known.tasks.is_empty() => {
            let task = one(random, &known.tasks).to_string();
            relabel(random, known, Some(&task))
        }
        17..=18 if !known.tasks.is_empty() => composite(random, known),
        19 => {
            let (name, set) = (new_name(known, "m"), condition(random, known));
            let latch = format!("for each hand {{ latch {name} set {set} clear {} }}", condition(random, known));
            known.signals.push(name);
            latch
        }
        20 => {
            let name = new_name(known, "w");
            let channel = ["lamp.on", "thumb.contact.ghost"][known.made % 2];
            let text = format!(
                "stream {{ for each hand {{ optional {channel} : bool = false }} }}\nfor each hand {{ signal {name} = {channel} }}"
            );
            known.signals.push(name);
            text
        }
        21 if !known.both => {
            known.both = true;
            let [leaf, other] = [0; 2].map(|_| label(random, known));
            let signal = one(random, &known.signals);
            format!(
                "tree both_hands for left, right {{ left.{signal} and right.{signal} => {leaf}  from({leaf}) => {other}  else => separate }}"
            )
        }
        22 => "use \"hand_flags.rules\"".into(),
        _ => format!(
            "extend {tree} first {{ {} and not from(none) => {} }}",
            condition(random, known),
            label(random, known)
        ),
    };
    vec![text]
}

/// Changes a declaration's number, name or position, or removes it.
fn changed(random: &mut Random, items: &mut Vec<String>) {
    let at = random.below(items.len());
    match random.below(6) {
        0 => drop(items.remove(at)),
        1 => {
            let other = random.below(items.len());
            items.swap(at, other);
        }
        2 => items.push(items[at].clone()),
        3 => items[at] = items[at].replacen("0 m", "5 m", 1 + random.below(2)),
        4 => {
            let failure = items.iter().position(|item| item.contains(" is failure"));
            let at = failure.unwrap_or(at);
            items[at] = items[at].replace(" is failure", "");
        }
        _ => {
            let names = ["A", "B", "C", "D", "E", "s1", "s2", "true", "false", "or", "and"];
            let (one, other) = (names[random.below(names.len())], names[random.below(names.len())]);
            let words = items[at].split(' ').map(|word| if word == one { other } else { word });
            items[at] = words.collect::<Vec<_>>().join(" ");
        }
    }
}
