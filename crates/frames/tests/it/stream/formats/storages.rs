//! Bags in SQLite and messages in protobuf, against the same messages in MCAP and JSON (tools/make_bag_fixtures.py).

use super::{bound, fixture, folder, header, values};
use crate::shared::files::columns;
use rusqlite::Connection;
use std::path::Path;
use teachtree_logs::read::formats;

/// The titles and numbers of a log are those of another one; NaN is NaN.
fn same(log: &Path, other: &Path, is_compared: impl Fn(&str) -> bool) {
    let read = |path: &Path| columns(formats::open(path).unwrap());
    let (found, wanted) = (read(log), read(other));
    let titles = |of: &std::collections::BTreeMap<String, Vec<f64>>| -> Vec<String> {
        of.keys().filter(|title| is_compared(title)).cloned().collect()
    };
    assert_eq!(titles(&found), titles(&wanted), "{}", log.display());
    for title in titles(&found) {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<u64>>();
        assert_eq!(bits(&found[&title]), bits(&wanted[&title]), "{} {title}", log.display());
    }
}

#[test]
fn bags_in_sqlite_are_read_as_mcap_is() {
    let plain = fixture("rosbag2_db3/plain.mcap");
    for bag in ["jazzy", "jazzy/jazzy.db3", "humble", "humble/humble_0.db3"] {
        same(&fixture("rosbag2_db3").join(bag), &plain, |_| true);
    }
    let bag = fixture("rosbag2_db3/humble");
    let (log, _) = bound(&bag, "channels: {right.palm.force: /wrench.wrench.force.<xyz>}\n").unwrap();
    assert_eq!(values(&log, "right.palm.force.x"), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let own = bound(&bag, "channels: {right.gripper.opening: /own.width}\n").unwrap_err();
    assert!(own.contains("`/own` cannot be read: the bag has no definition of its type my_msgs/msg/Own"), "{own}");
}

/// A file of SQLite in a folder, changed by statements.
fn changed(statements: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = folder(&[]);
    let path = folder.path().join("a bag? 100%.db3");
    std::fs::copy(fixture("rosbag2_db3/humble/humble_0.db3"), &path).unwrap();
    Connection::open(&path).unwrap().execute_batch(statements).unwrap();
    (folder, path)
}

#[test]
fn a_file_of_sqlite_that_is_not_a_bag_is_refused() {
    let error = |statements: &str| {
        let (_folder, path) = changed(statements);
        formats::open(&path).map(|_| ()).unwrap_err().to_string()
    };
    assert!(error("DROP TABLE messages").contains("is not a ROS 2 bag: it lacks the table `messages`"));
    // A view may compute rows without end.
    let view = "DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) \
                SELECT id, 1 AS topic_id, 0 AS timestamp, x'00' AS data FROM n";
    assert!(error(view).contains("lacks the table `messages`"));
    let computed = "DROP TABLE messages; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data AS (zeroblob(200000000)));
                    INSERT INTO messages VALUES (1, 1, 0)";
    assert!(error(computed).contains("lacks the table `messages`"));
    assert!(error("UPDATE messages SET data = 'text'").contains("the data of a message is not a blob"));
    assert!(error("DELETE FROM messages").contains("the bag holds no message"));
}

#[test]
fn messages_that_are_compressed_by_themselves_are_read() {
    let (_folder, path) = changed("");
    let connection = Connection::open(&path).unwrap();
    let messages: Vec<(i64, Vec<u8>)> = {
        let mut statement = connection.prepare("SELECT id, data FROM messages").unwrap();
        statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap().map(Result::unwrap).collect()
    };
    for (id, data) in messages {
        let packed = zstd::bulk::compress(&data, 3).unwrap();
        connection.execute("UPDATE messages SET data = ?1 WHERE id = ?2", (packed, id)).unwrap();
    }
    drop(connection);
    same(&path, &fixture("rosbag2_db3/plain.mcap"), |_| true);
}

#[test]
fn messages_in_a_log_beside_the_bag_are_reported() {
    let (_folder, path) = changed("");
    let writer = Connection::open(&path).unwrap();
    writer.pragma_update(None, "journal_mode", "wal").unwrap();
    writer.execute("DELETE FROM messages WHERE id > 8", []).unwrap();
    let cut: Vec<String> = formats::open(&path).unwrap().issues.iter().map(|issue| issue.message.clone()).collect();
    assert!(cut.len() == 1 && cut[0].contains("-wal are not read") && cut[0].contains("wal_checkpoint"), "{cut:?}");
    // The advice works.
    writer.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())).unwrap();
    let source = formats::open(&path).unwrap();
    assert!(source.issues.is_empty());
}

/// Pages that lead to others than they should do not keep the reader from ending.
#[test]
fn damaged_files_of_sqlite_end() {
    let whole = std::fs::read(fixture("rosbag2_db3/jazzy/jazzy.db3")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let mut read = 0;
    for at in (16..whole.len()).step_by(61) {
        for byte in [0, 1, 255] {
            let mut bytes = whole.clone();
            bytes[at] = byte;
            std::fs::write(&path, &bytes).unwrap();
            read += usize::from(formats::open(&path).is_ok());
        }
    }
    for length in [17, 100, 4096, 9000, whole.len() - 1] {
        std::fs::write(&path, &whole[..length]).unwrap();
        let _ = formats::open(&path);
    }
    assert!(read > 100, "{read}");
}

#[test]
fn protobuf_is_read_as_json_is() {
    let log = fixture("foxglove/protobuf.mcap");
    same(&log, &fixture("foxglove/json.mcap"), |title| !title.contains(".timestamp."));
    // Stamps are those of the messages, which were recorded 30 ms and 40 ms later.
    let titles = header(&log);
    assert!(titles.contains(&"/tool.timestamp.seconds".to_string()), "{titles:?}");
    let binding = "resample: 50 Hz\nchannels: {right.palm.position: /tool.pose.position.<xyz>, cube.position: /tf.transforms.cube.translation.<xyz>}\n";
    let (log, _) = bound(&log, binding).unwrap();
    assert_eq!(log.time.len(), 6);
    assert!((values(&log, "right.palm.position.x")[3] - 0.3).abs() < 1e-9);
    assert!((values(&log, "cube.position.y")[3] + 0.15).abs() < 1e-9);
}

#[test]
fn damaged_descriptors_and_messages_refuse_their_topic() {
    let whole = std::fs::read(fixture("foxglove/protobuf.mcap")).unwrap();
    assert!(formats::open(&fixture("foxglove/protobuf.mcap")).is_ok());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for at in (8..whole.len()).step_by(7) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x55;
        std::fs::write(&path, &bytes).unwrap();
        let _ = formats::open(&path);
    }
    let topic = |kind: &str, definition: &[u8]| {
        use std::collections::BTreeMap;
        let file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
        let mut writer = mcap::Writer::new(file).unwrap();
        let schema = writer.add_schema(kind, "protobuf", definition).unwrap();
        let channel = writer.add_channel(schema, "/a", "protobuf", &BTreeMap::new()).unwrap();
        let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, &[255, 255]).unwrap();
        writer.finish().unwrap();
        formats::open(&path).map(|_| ()).unwrap_err().to_string()
    };
    assert!(topic("foxglove.Pose", &[255]).contains("its type foxglove.Pose: its descriptors are damaged"));
    assert!(topic("foxglove.Pose", &[]).contains("its descriptors do not have the type foxglove.Pose"));
}
