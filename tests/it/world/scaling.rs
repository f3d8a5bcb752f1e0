//! The size of the hand of an operator.

use crate::program::teachtree;

#[test]
fn teach_takes_the_size_from_the_robot() {
    let folder = tempfile::tempdir().unwrap();
    let taught = |robot: &[&str]| {
        let out = folder.path().join("log.csv");
        let output =
            teachtree(&[&["teach", "push", "push", "--noise", "0", "-o", out.to_str().unwrap()], robot].concat());
        assert!(output.status.success());
        std::fs::read(out).unwrap()
    };
    let own = taught(&[]);
    assert_eq!(own, taught(&["--robot", "parallel_jaw"]));
    assert_ne!(own, taught(&["--robot", "gifu_hand_iii_right"]));
}
