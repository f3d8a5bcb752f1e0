#!/usr/bin/env python3
"""Checks a file that `teachtree analyze LOG --mcap FILE` wrote, with the libraries of MCAP; with `--into` also that all of LOG is in it.

    python3 -m venv venv && venv/bin/pip install mcap mcap-ros2-support
    venv/bin/python tools/check_mcap.py FILE [LOG]

Check sums, index and summary are validated, every message is decoded by its definition, the messages by the index are those in the order of
the file, and the texts of each lane are printed.
"""

import sys
from collections import defaultdict

from mcap.reader import NonSeekingReader, SeekingReader
from mcap_ros2.decoder import DecoderFactory


def content(path, seeking, ours=False):
    """All that a file holds apart from what teachtree added, or that alone: messages by topic, attachments, metadata."""
    messages = defaultdict(list)

    def read(query):
        """What one query finds: a reader that does not seek answers one only."""
        with open(path, "rb") as file:
            return list(query((SeekingReader if seeking else NonSeekingReader)(file, validate_crcs=True)))

    for schema, channel, message in read(lambda reader: reader.iter_messages(log_time_order=seeking)):
        if channel.topic.startswith("/teachtree/") == ours:
            kind = schema and (schema.name, schema.encoding, schema.data)
            of = (channel.topic, channel.message_encoding, tuple(channel.metadata.items()), kind)
            messages[of].append((message.log_time, message.publish_time, message.sequence, message.data))
    attachments = [(it.name, it.media_type, it.log_time, it.create_time, it.data) for it in read(lambda reader: reader.iter_attachments())]
    metadata = [(it.name, it.metadata) for it in read(lambda reader: reader.iter_metadata()) if it.name != "teachtree"]
    return {of: sorted(list_) for of, list_ in messages.items()}, attachments, metadata


def compare(path, log):
    """Everything of the log is in the file, found in the order of the file and by its index."""
    expected = content(log, seeking=False)
    for seeking in (False, True):
        found = content(path, seeking)
        for part, of_file, of_log in zip(("messages", "attachments", "metadata"), found, expected):
            assert of_file == of_log, f"{part} differ, {'by the index' if seeking else 'in the order of the file'}"
    assert content(path, True, ours=True)[0] == content(path, False, ours=True)[0]
    print(f"all messages of {log} are in it: {sum(map(len, expected[0].values()))} of {len(expected[0])} topics")


def main(path, log=None):
    if log is not None:
        return compare(path, log)
    lanes, counts = defaultdict(list), defaultdict(int)
    with open(path, "rb") as file:
        reader = SeekingReader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            if schema.name == "std_msgs/msg/String":
                lanes[channel.topic].append((message.log_time, decoded.data))
            elif schema.name == "std_msgs/msg/Float64":
                assert isinstance(decoded.data, float)
            else:
                assert schema.name == "tf2_msgs/msg/TFMessage", schema.name
                for transform in decoded.transforms:
                    rotation = transform.transform.rotation
                    length = rotation.w**2 + rotation.x**2 + rotation.y**2 + rotation.z**2
                    assert abs(length - 1) < 1e-3, (transform.child_frame_id, length)
                    stamp = transform.header.stamp
                    assert stamp.sec * 10**9 + stamp.nanosec == message.log_time
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    assert summary.statistics.message_count == sum(counts.values())
    assert {topic for topic in counts} <= {channel.topic for channel in summary.channels.values()}
    assert metadata["teachtree"]["digest"]
    with open(path, "rb") as file:
        plain = NonSeekingReader(file, validate_crcs=True)
        assert sum(1 for _ in plain.iter_messages(log_time_order=False)) == sum(counts.values())
    for topic, texts in sorted(lanes.items()):
        assert [time for time, _ in texts] == sorted(time for time, _ in texts)
        print(f"{topic}: {', '.join(text or '-' for _, text in texts)}")
    print(f"{path}: {sum(counts.values())} messages of {len(counts)} topics, all as expected")


if __name__ == "__main__":
    main(*sys.argv[1:])
