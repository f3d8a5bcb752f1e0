//! Outcomes: tasks in, success or failure with reasons out.

use teachtree_analysis::outcome::{ExpectedTasks, OutcomeKind, ReasonKind, UnmeasuredTask, number_attempts};
use teachtree_analysis::{Analysis, CompositeSpan, Subject, TaskSpan, Track, TrackId};
use teachtree_base::hands::Side;
use teachtree_language as language;
use teachtree_logs::issue::{Issue, IssueKind};

/// An analysis of one hand with these tasks of 1 s: name, object, target. A name with `!` is a failure.
fn analysis(tasks: &[(&str, &str, &str)]) -> Analysis {
    let body = |name: &str| (!name.is_empty()).then(|| name.to_string());
    let span = |(at, (name, object, partner)): (usize, &(&str, &str, &str))| TaskSpan {
        task: name.trim_end_matches('!').into(),
        failure: name.ends_with('!'),
        subject: Subject { object: body(object), partner: body(partner) },
        start_s: at as f64,
        end_s: at as f64 + 1.0,
        rows: 10 * at..10 * at + 10,
        ..TaskSpan::default()
    };
    let mut track = Track::new(TrackId::Hand(Side::Right));
    track.tasks = tasks.iter().enumerate().map(span).collect();
    let mut tracks = vec![track];
    number_attempts(&mut tracks);
    Analysis { tracks, has_failures: true, ..Analysis::default() }
}

fn attempts(analysis: &Analysis) -> Vec<usize> {
    analysis.tracks[0].tasks.iter().map(|task| task.attempt).collect()
}

fn kinds(analysis: &Analysis) -> Vec<ReasonKind> {
    analysis.outcome().reasons.iter().map(|reason| reason.kind).collect()
}

#[test]
fn a_failure_counts_unless_a_later_attempt_mends_it() {
    use OutcomeKind::{Failure, Success, Unknown};
    let (stuck, insert, place) = ("stuck!", "insert", "place");
    for (tasks, wanted, numbers) in [
        (vec![], Unknown, vec![]),
        (vec![("unknown", "peg", "")], Unknown, vec![1]),
        (vec![(place, "peg", "")], Success, vec![1]),
        (vec![(stuck, "peg", "hole")], Failure, vec![1]),
        (vec![(stuck, "peg", "hole"), (insert, "peg", "hole")], Success, vec![1, 2]),
        (vec![(insert, "peg", "hole"), (stuck, "peg", "hole")], Failure, vec![1, 1]),
        (vec![(stuck, "peg", "hole"), (stuck, "peg", "hole"), (insert, "peg", "hole")], Success, vec![1, 2, 3]),
        // After a success, attempts are counted anew.
        (vec![(stuck, "peg", "hole"), (insert, "peg", "hole"), (stuck, "peg", "hole")], Failure, vec![1, 2, 1]),
        // Another object, another target, no target.
        (vec![(stuck, "peg", "hole"), (insert, "nut", "hole")], Failure, vec![1, 1]),
        (vec![(stuck, "peg", "hole"), (insert, "peg", "other")], Failure, vec![1, 1]),
        (vec![(stuck, "peg", "hole"), (place, "peg", "")], Failure, vec![1, 1]),
        (vec![(stuck, "peg", "hole"), (place, "peg", ""), (insert, "peg", "hole")], Success, vec![1, 1, 2]),
        // A jam on the rim has no target.
        (vec![(stuck, "peg", ""), (insert, "peg", "hole")], Success, vec![1, 2]),
        (vec![(stuck, "peg", "hole"), (stuck, "peg", ""), (insert, "peg", "hole")], Success, vec![1, 2, 3]),
        // The log does not say which object it was.
        (vec![("missed!", "", ""), (place, "peg", "")], Success, vec![1, 2]),
        // A touch without a name belongs to the attempt in which it is.
        (vec![(stuck, "peg", "hole"), ("unknown", "peg", ""), (insert, "peg", "hole")], Success, vec![1, 2, 2]),
    ] {
        let analysis = analysis(&tasks);
        let outcome = analysis.outcome();
        assert_eq!((outcome.result, attempts(&analysis)), (wanted, numbers), "{tasks:?}");
        assert_eq!(outcome.attempts, attempts(&analysis).into_iter().max().unwrap_or(0), "{tasks:?}");
        assert!(!outcome.reasons.is_empty(), "{tasks:?}");
    }
    let mended = analysis(&[(stuck, "peg", "hole"), (insert, "peg", "hole")]);
    assert_eq!(kinds(&mended), [ReasonKind::Mended, ReasonKind::Succeeded]);
    assert_eq!(
        mended.outcome().sentence(),
        "success: right stuck peg (hole) 0.000 – 1.000 s failed, and a later attempt succeeded; right insert peg (hole) 1.000 – 2.000 s, attempt 2"
    );
}

#[test]
fn nothing_is_a_success_that_could_not_be_a_failure() {
    let mut analysis = Analysis { has_failures: false, ..analysis(&[("place", "cube", "")]) };
    assert_eq!((analysis.outcome().result, kinds(&analysis)), (OutcomeKind::Unknown, vec![ReasonKind::NoCriterion]));
    analysis.expected = ExpectedTasks::parse("place").unwrap();
    assert_eq!(analysis.outcome().result, OutcomeKind::Success);
}

#[test]
fn a_task_that_is_cut_off_makes_the_outcome_unknown() {
    let cut = |tasks: &[(&str, &str, &str)], frames: &[usize]| {
        let mut analysis = Analysis { frames: 100, ..analysis(tasks) };
        for at in frames {
            let task = &mut analysis.tracks[0].tasks[*at];
            (task.open_end, task.frames) = (true, 0..10 * (at + 1));
        }
        analysis
    };
    let (stuck, insert) = (("stuck!", "peg", "hole"), ("insert", "peg", "hole"));
    let place = ("place", "cube", "");
    let by_gap = cut(&[place, insert], &[0]);
    assert_eq!((by_gap.outcome().result, kinds(&by_gap)), (OutcomeKind::Unknown, vec![ReasonKind::CutOff]));
    assert_eq!(by_gap.outcome().sentence(), "unknown: right place cube 0.000 – 1.000 s is cut off by a gap of the log");
    let mut by_end = cut(&[place, insert], &[1]);
    by_end.frames = 20;
    assert_eq!((by_end.outcome().result, by_end.success_end()), (OutcomeKind::Unknown, None));
    assert!(by_end.outcome().sentence().ends_with("is cut off by the end of the recording"));
    for (tasks, at, wanted) in [
        // A task of the same object that follows the gap completes it.
        (&[insert, insert][..], 0, OutcomeKind::Success),
        (&[stuck, insert], 1, OutcomeKind::Unknown),
        (&[place, stuck], 0, OutcomeKind::Failure),
        (&[insert, stuck], 1, OutcomeKind::Failure),
    ] {
        assert_eq!(cut(tasks, &[at]).outcome().result, wanted, "{tasks:?}");
    }
}

/// The log says that the recording succeeded: its failures did not matter, and a task that it cuts off has reached its goal.
#[test]
fn an_outcome_follows_a_field_that_says_success() {
    let with_field = |analysis: Analysis| Analysis { declared: vec!["rewards".into()], ..analysis };
    let (dropped, place) = (("dropped!", "cube", ""), ("place", "cube", ""));
    let mut failed = with_field(analysis(&[dropped]));
    assert_eq!(kinds(&failed), [ReasonKind::Declared]);
    assert_eq!(
        failed.outcome().sentence(),
        "success: right dropped cube 0.000 – 1.000 s failed, but `rewards` says that the recording succeeded"
    );
    assert_eq!(failed.success_end(), Some(10));
    let after_success = with_field(analysis(&[place, dropped]));
    assert_eq!((after_success.outcome().result, after_success.success_end()), (OutcomeKind::Success, Some(10)));
    // An expectation is of the user.
    failed.expected = ExpectedTasks::parse("place").unwrap();
    assert_eq!(failed.outcome().result, OutcomeKind::Failure);
    let mut cut_off = with_field(Analysis { frames: 10, ..analysis(&[place]) });
    let task = &mut cut_off.tracks[0].tasks[0];
    (task.open_end, task.frames) = (true, 0..10);
    assert_eq!((cut_off.outcome().result, kinds(&cut_off)), (OutcomeKind::Success, vec![ReasonKind::Declared]));
    // Nothing shows what succeeded.
    assert_eq!(with_field(analysis(&[])).outcome().result, OutcomeKind::Unknown);
}

#[test]
fn a_later_task_of_the_other_hand_mends_a_failure() {
    let mut analysis = analysis(&[("dropped!", "cube", ""), ("unknown", "", ""), ("unknown", "", "")]);
    let place = TaskSpan {
        task: "place".into(),
        subject: Subject { object: Some("cube".into()), partner: None },
        start_s: 0.5,
        end_s: 2.0,
        ..TaskSpan::default()
    };
    let mut left = Track::new(TrackId::Hand(Side::Left));
    left.tasks.push(place.clone());
    analysis.tracks.push(left);
    // It began before the failure ended.
    assert_eq!(analysis.outcome().result, OutcomeKind::Failure);
    analysis.tracks[1].tasks[0] = TaskSpan { start_s: 1.5, ..place };
    assert_eq!(analysis.outcome().result, OutcomeKind::Success);
}

#[test]
fn a_task_of_tasks_counts_instead_of_its_parts() {
    let tasks = [("stuck!", "peg", "hole"), ("stuck!", "peg", "hole"), ("place", "cube", "")];
    let whole = |failure: bool| CompositeSpan { task: "tour".into(), failure, tasks: 0..2, ..CompositeSpan::default() };
    let of = |failure: bool| {
        let mut analysis = analysis(&tasks);
        analysis.tracks[0].composites.push(whole(failure));
        analysis
    };
    assert_eq!(of(false).outcome().result, OutcomeKind::Success);
    let failed = of(true);
    assert_eq!(failed.outcome().result, OutcomeKind::Failure);
    let tasks: Vec<Option<String>> = failed.outcome().reasons.into_iter().map(|reason| reason.task).collect();
    assert_eq!(tasks, [Some("tour".to_string())]);
}

fn expecting(tasks: &[(&str, &str, &str)], expected: &str) -> Analysis {
    Analysis { expected: ExpectedTasks::parse(expected).unwrap(), ..analysis(tasks) }
}

#[test]
fn expected_tasks_are_there_in_order() {
    let tasks = [("insert", "a", ""), ("push", "b", ""), ("insert", "c", ""), ("turn", "d", "")];
    for expected in ["insert", "insert x 2, turn", "insert, push, insert, turn", "insert x2", "insert × 2", " turn "] {
        let outcome = expecting(&tasks, expected).outcome();
        assert_eq!((outcome.result, outcome.is_as_expected), (OutcomeKind::Success, Some(true)), "{expected}");
    }
    for (expected, message) in [
        ("insert x 3, turn", "expected insert x 3, found 2"),
        ("slide", "expected slide, found none"),
        ("turn, insert, turn", "expected turn x 2, found 1"),
        ("turn, push", "expected turn in the order `turn, push`, found it in another order"),
    ] {
        let outcome = expecting(&tasks, expected).outcome();
        assert_eq!((outcome.result, outcome.is_as_expected), (OutcomeKind::Failure, Some(false)), "{expected}");
        assert_eq!(outcome.sentence(), format!("failure: {message}"));
        assert_eq!(outcome.expected.as_deref(), Some(expected));
    }
    // A failure is not what was expected.
    assert_eq!(expecting(&[("insert!", "a", "")], "insert").outcome().is_as_expected, Some(false));
    assert_eq!(analysis(&tasks).outcome().is_as_expected, None);
}

#[test]
fn a_missing_task_that_the_log_cannot_show_is_not_a_failure() {
    let mut analysis = expecting(&[("push", "a", "")], "push, insert");
    let unmeasured =
        |task: &str, failure: bool| UnmeasuredTask { task: task.into(), failure, reason: "no depth".into() };
    analysis.unmeasured = vec![unmeasured("insert", false), unmeasured("stuck", true)];
    let outcome = analysis.outcome();
    assert_eq!((outcome.result, outcome.is_as_expected), (OutcomeKind::Unknown, Some(false)));
    assert_eq!(outcome.sentence(), "unknown: expected insert, found none, which the log cannot show (no depth)");
    // A success says which failures it could not see.
    analysis.expected = ExpectedTasks::default();
    assert_eq!(kinds(&analysis), [ReasonKind::Succeeded, ReasonKind::UnseenFailure]);
}

/// No reason is hidden by a number: the first three are written out, failures that the log cannot show are all named, and so is what follows.
#[test]
fn the_sentence_names_what_it_does_not_write_out() {
    let place = |object: &'static str| ("place", object, "");
    let mut found = analysis(&[place("a"), place("b"), place("c"), place("d")]);
    let unmeasured =
        |(task, reason): (&str, &str)| UnmeasuredTask { task: task.into(), failure: true, reason: reason.into() };
    found.unmeasured = [("stuck", "Jam: no socket"), ("hit", "Bump: no force")].map(unmeasured).to_vec();
    let sentence = found.outcome().sentence();
    assert!(
        sentence.ends_with("; the log cannot show stuck (Jam: no socket), hit (Bump: no force); 1 more: place"),
        "{sentence}"
    );
    let issue = |channel: &str| Issue {
        kind: IssueKind::MISSING_BODY,
        start_s: 0.0,
        end_s: 9.0,
        channel: channel.into(),
        message: "it stops".into(),
    };
    found.issues = ["a", "b", "c", "d", "e"].map(issue).to_vec();
    let sentence = found.outcome().sentence();
    assert!(sentence.ends_with("missing_body c: it stops; 2 more: missing_body d, missing_body e"), "{sentence}");
    found.issues = vec![issue("a"); 9];
    let sentence = found.outcome().sentence();
    assert!(sentence.ends_with("; 6 more: `analyze --format json` lists them"), "{sentence}");
}

#[test]
fn the_outcome_of_a_log_that_is_read_wrongly_is_unknown() {
    let (place, insert, dropped) = (("place", "cube", ""), ("insert", "peg", "hole"), ("dropped!", "cube", ""));
    let with = |kind: IssueKind, channel: &str, analysis: Analysis| {
        let issue = Issue { kind, start_s: 0.0, end_s: 9.0, channel: channel.into(), message: "it is constant".into() };
        let left = Track::new(TrackId::Hand(Side::Left));
        let tracks = [analysis.tracks.as_slice(), &[left]].concat();
        Analysis { issues: vec![issue], tracks, ..analysis }.outcome()
    };
    let (unit, flag) = (IssueKind::IMPLAUSIBLE_UNIT, IssueKind::CONSTANT_FLAG);
    for tasks in [vec![place], vec![dropped], vec![]] {
        let outcome = with(unit, "cube.position", analysis(&tasks));
        assert_eq!(outcome.result, OutcomeKind::Unknown, "{tasks:?}");
        assert!(outcome.sentence().ends_with("implausible_unit cube.position: it is constant"), "{outcome:?}");
    }
    let outcome = with(flag, "right.gripper.closed", analysis(&[dropped]));
    let kinds: Vec<(ReasonKind, Option<TrackId>)> =
        outcome.reasons.iter().map(|reason| (reason.kind, reason.track)).collect();
    assert_eq!(kinds, [(ReasonKind::Misread, Some(TrackId::Hand(Side::Right)))]);
    // The flag of the idle hand does not concern what the other hand did, or should have done.
    let of_left = |analysis: Analysis| with(flag, "left.gripper.closed", analysis).result;
    assert_eq!(of_left(analysis(&[place])), OutcomeKind::Success);
    assert_eq!(of_left(expecting(&[place], "insert")), OutcomeKind::Failure);
    assert_eq!(with(unit, "peg.position", expecting(&[place], "insert")).result, OutcomeKind::Unknown);
    // Other issues are treated, or change little.
    assert_eq!(with(IssueKind::GAP, "", analysis(&[insert])).result, OutcomeKind::Success);
}

#[test]
fn a_recording_has_succeeded_behind_its_last_success() {
    let (stuck, insert, touch) = (("stuck!", "peg", "hole"), ("insert", "peg", "hole"), ("unknown", "peg", ""));
    for (tasks, wanted) in [
        (vec![insert], Some(10)),
        (vec![stuck, insert], Some(20)),
        (vec![insert, insert, touch], Some(20)),
        (vec![insert, stuck], None),
        (vec![touch], None),
    ] {
        assert_eq!(analysis(&tasks).success_end(), wanted, "{tasks:?}");
    }
    // A success that nothing could have shown to be a failure is unknown.
    assert_eq!(Analysis { has_failures: false, ..analysis(&[insert]) }.success_end(), None);
    // A task that is made of tasks counts as a whole.
    let whole = |failure: bool| {
        let mut all = analysis(&[insert, insert, insert]);
        let whole =
            CompositeSpan { failure, tasks: 1..3, rows: 10..30, start_s: 1.0, end_s: 3.0, ..CompositeSpan::default() };
        all.tracks[0].composites.push(whole);
        all
    };
    assert_eq!((whole(false).success_end(), whole(true).success_end()), (Some(30), None));
}

#[test]
fn what_is_not_an_expectation_is_refused() {
    for text in ["", "insert x", "insert x 0", "insert 2", "insert x 2 turn", "insert,", "a-b", "insert x -1"] {
        assert!(ExpectedTasks::parse(text).is_err(), "{text}");
    }
    assert!(ExpectedTasks::parse("insert x 101").is_err());
    let text =
        "use \"contact.rules\"\ntask stuck = Move .. Release with Press lasting 1 s is failure before pick_and_press\n";
    let rules = language::load_text("stuck.rules", text).rules.unwrap();
    let check = |text: &str| ExpectedTasks::parse(text).unwrap().check(&rules);
    assert_eq!(check("peg_in_hole x 2, turn_screw"), Ok(()));
    assert_eq!(check("peg_in_hol"), Err("the rules have no task `peg_in_hol`; did you mean `peg_in_hole`?".into()));
    assert_eq!(check("stuck"), Err("`stuck` is a failure, expected tasks that succeed".into()));
    assert!(check("wash_dishes").unwrap_err().starts_with("the rules have no task `wash_dishes`; their tasks are "));
    // The printed form can be read back.
    let printed = ExpectedTasks::parse("peg_in_hole  x2,turn_screw").unwrap().to_string();
    assert_eq!(printed, "peg_in_hole x 2, turn_screw");
}
