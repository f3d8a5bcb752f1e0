//! Certificates of programs whose limits are known in closed form.

use teachtree_robot::certificate::binomial::{RATE, lower_bound, round_confidence, runs_without_failure};
use teachtree_robot::certificate::{CellQuantity, Certificate, CertificationFailure, Limits, QUANTITIES, certify};
use teachtree_robot::simulation::{CellVariation, Fault, FaultKind};

/// `scipy.stats.binomtest(successes, runs, alternative="greater").proportion_ci(confidence, method="exact").low`, SciPy 1.16.
#[test]
fn bounds_are_those_of_scipy() {
    for (successes, runs, confidence, expected) in [
        (59, 59, 0.95, 0.950_492_390_111_531_6),
        (58, 58, 0.95, 0.949_660_661_669_523_9),
        (72, 72, 0.975, 0.950_055_916_294_144_1),
        (1, 1, 0.95, 0.05),
        (1, 10, 0.95, 0.005_116_196_892_304_6),
        (92, 93, 0.95, 0.950_006_021_612_011_2),
        (91, 92, 0.95, 0.949_473_639_123_041_1),
        (150, 200, 0.99, 0.671_684_009_322_734_9),
        (500, 1000, 0.95, 0.473_517_731_235_899_1),
    ] {
        let bound = lower_bound(successes, runs, confidence);
        assert!((bound - expected).abs() < 1e-8, "{successes} of {runs} at {confidence}: {bound}, SciPy {expected}");
    }
    assert_eq!(lower_bound(0, 10, 0.95), 0.0);
    assert_eq!((runs_without_failure(0.95), runs_without_failure(0.975)), (59, 72));
    // The error probabilities of all rounds add up to that of the certificate.
    let errors: f64 = (0..50).map(|round| 1.0 - round_confidence(round)).sum();
    assert!((errors - 0.05).abs() < 1e-9, "{errors}");
}

fn quantities(names: &[&str]) -> Vec<&'static CellQuantity> {
    names.iter().map(|name| QUANTITIES.iter().find(|quantity| quantity.name == *name).unwrap()).collect()
}

/// A grip carries a mass up to twice the friction, and its controller is stable with a delay of up to 7.3 ms.
fn holds(cell: &CellVariation) -> Option<Fault> {
    let fault = |kind, text: &str| Some(Fault::new(kind, text.into()));
    match () {
        () if cell.mass > 2.0 * cell.friction => fault(FaultKind::NotDone, "slipped"),
        () if cell.motor_delay.0 > 0.0073 => fault(FaultKind::Collisions, "unstable"),
        () => None,
    }
}

fn certified(names: &[&str], seed: u64, runs: usize) -> Result<Certificate, CertificationFailure> {
    let mut cells_of = |_: &str, cells: &[CellVariation]| Ok::<_, ()>(cells.iter().map(holds).collect());
    certify(&quantities(names), Limits { seed, runs }, &mut cells_of).unwrap()
}

#[test]
fn a_box_ends_at_the_limits_of_the_grip() {
    let names = ["friction", "mass", "motor_delay", "object_turn"];
    for seed in 0..20 {
        let certificate = certified(&names, seed, 5000).unwrap();
        let face = |name: &str, upper: bool| {
            let quantity = names.iter().position(|other| *other == name).unwrap();
            certificate.faces.iter().find(|it| (it.face.quantity, it.face.upper) == (quantity, upper)).unwrap()
        };
        assert!(certificate.bound >= RATE && certificate.runs < 2000, "{certificate:?}");
        // The steps beyond 7 ms contain 7.3 ms, and all of 8 ms fail.
        let delay = face("motor_delay", true);
        assert_eq!((delay.reach, delay.alone), (7, 7), "seed {seed}");
        let stop = delay.stop.as_ref().unwrap();
        assert_eq!((stop.fault.kind, stop.fault.text.as_str()), (FaultKind::Collisions, "unstable"));
        assert_eq!(holds(&stop.cell).as_ref(), Some(&stop.fault));
        // Objects may stand anywhere.
        for upper in [false, true] {
            let turn = face("object_turn", upper);
            assert_eq!((turn.reach, turn.alone, turn.stop.is_none()), (9, 9, true), "seed {seed}");
        }
        // Alone, friction may fall to 0.5 and mass rise to 2; together only with mass <= 2 friction.
        assert_eq!((face("friction", false).alone, face("mass", true).alone), (10, 10));
        let [least, most] = [
            1.0 - 0.05 * f64::from(face("friction", false).reach),
            1.0 + 0.05 * f64::from(face("friction", true).reach),
        ];
        let [light, heavy] =
            [1.0 - 0.1 * f64::from(face("mass", false).reach), 1.0 + 0.1 * f64::from(face("mass", true).reach)];
        // The part of the box in which mass exceeds 2 friction is at most a triangle.
        let (wide, high) = (f64::max(heavy / 2.0 - least, 0.0), f64::max(heavy - 2.0 * least, 0.0));
        let failing = 0.5 * wide * high / ((most - least) * (heavy - light));
        assert!(failing < 0.05, "seed {seed}: {failing} of friction {least} to {most}, mass {light} to {heavy}");
        // No face can move: the step beyond it has failures, or it is the end of the range.
        for report in &certificate.faces {
            let quantity = quantities(&names)[report.face.quantity];
            let end = if report.face.upper { *quantity.range.end() } else { -*quantity.range.start() };
            assert_eq!(report.stop.is_some(), report.reach < end, "seed {seed}: {report:?}");
        }
    }
}

#[test]
fn a_seed_gives_the_same_certificate_again() {
    let names = ["friction", "mass"];
    let printed = |seed| format!("{:?}", certified(&names, seed, 5000).unwrap());
    assert!(printed(3) == printed(3) && printed(3) != printed(4));
}

#[test]
fn a_search_ends_within_its_runs() {
    for runs in [1, 10, 100] {
        let Err(CertificationFailure::Runs(used)) = certified(&["friction", "mass"], 1, runs) else { panic!("{runs}") };
        assert!(used <= runs);
    }
    let mut fails = |_: &str, cells: &[CellVariation]| {
        assert_eq!(cells, [CellVariation::default()]);
        Ok::<_, ()>(vec![Some(Fault::new(FaultKind::NotDone, "dropped".into()))])
    };
    let found = certify(&quantities(&["mass"]), Limits { seed: 1, runs: 100 }, &mut fails).unwrap();
    assert!(matches!(found, Err(CertificationFailure::Nominal(fault)) if fault.text == "dropped"));
}
