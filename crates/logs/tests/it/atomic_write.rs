//! Files and folders that are written as a whole.

use std::path::Path;

/// What another program puts at the place of a copy while it is being made stays.
#[test]
fn a_place_that_is_taken_meanwhile_is_not_replaced() {
    use teachtree_logs::atomic_write::Folder;
    let place = tempfile::tempdir().unwrap();
    let target = place.path().join("copy");
    let made = || {
        let folder = Folder::new(&target).unwrap();
        std::fs::write(folder.path().join("file"), "ours").unwrap();
        std::fs::create_dir(&target).unwrap();
        folder
    };
    for error in [made().commit().unwrap_err(), {
        std::fs::remove_dir(&target).unwrap();
        made().commit_file(Path::new("file")).unwrap_err()
    }] {
        assert!(error.message.contains("another program has created this file in the meantime"), "{error}");
        assert!(std::fs::read_dir(&target).unwrap().next().is_none());
    }
    std::fs::remove_dir(&target).unwrap();
    let folder = Folder::new(&target).unwrap();
    std::fs::write(folder.path().join("file"), "ours").unwrap();
    folder.commit_file(Path::new("file")).unwrap();
    assert_eq!(std::fs::read_to_string(&target).unwrap(), "ours");
}
