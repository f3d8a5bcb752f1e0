//! Robot files that the program refuses.

#[cfg(target_os = "linux")]
#[test]
fn a_file_that_never_ends_is_refused() {
    use crate::program::{complained, teachtree};
    let link = tempfile::tempdir().unwrap();
    for (name, args) in [
        ("zero.yaml", ["command", "demos/none.csv", "--out", "x.json", "--robot"]),
        ("zero.json", ["simulate", "--scene", "paper_box", "--out", "x.csv"]),
    ] {
        let path = link.path().join(name);
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        let output = teachtree(&[&args[..], &[path.to_str().unwrap()]].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(complained(&output).contains(": found a device, expected a file"), "{}", complained(&output));
    }
}
