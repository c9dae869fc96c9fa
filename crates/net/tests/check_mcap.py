"""Reads a recording of the test world with the Python packages mcap and mcap-protobuf-support, and checks every number.

    check_mcap.py FILE.mcap

The formulas are written out here a second time, on purpose. Exit 0 if all agree, 77 if the packages
are missing (pip install mcap mcap-protobuf-support), 1 otherwise.
"""
import math
import struct
import sys

try:
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory
except ImportError as missing:
    print(f"Python package missing: {missing} (pip install mcap mcap-protobuf-support)")
    sys.exit(77)

G = 9.81


def near(got, want, what):
    assert abs(got - want) <= 1e-12, f"{what} is {got}, should be {want}"


def check_scene(message, log_time):
    assert log_time == 0 and not message.deletions
    ball, crate, ground = message.entities
    for entity, name in ((ball, "ball"), (crate, "crate"), (ground, "ground")):
        assert entity.id == name and entity.frame_id == name and entity.frame_locked, entity
    (sphere,), (cube,), (square,) = ball.spheres, crate.cubes, ground.triangles
    assert (sphere.size.x, sphere.size.y, sphere.size.z) == (0.25, 0.25, 0.25)
    assert (cube.size.x, cube.size.y, cube.size.z) == (1.0, 2.0, 3.0)
    assert (cube.color.r, cube.color.g, cube.color.b, cube.color.a) == (0.25, 0.5, 0.75, 1.0)
    assert cube.pose.orientation.w == 1.0
    assert len(square.points) == 4 and len(square.indices) == 6
    for a, b, c in zip(*[iter(square.indices)] * 3):  # both triangles face up
        p, q, r = (square.points[k] for k in (a, b, c))
        area = ((q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x)) / 2
        assert area == 200.0, area


def check_transforms(message, log_time, frame):
    t = frame / 240
    ball, crate, ground = message.transforms
    for transform, name in ((ball, "ball"), (crate, "crate"), (ground, "ground")):
        assert transform.parent_frame_id == "world" and transform.child_frame_id == name
        # the stamp is a google.protobuf.Timestamp
        assert transform.timestamp.seconds * 10**9 + transform.timestamp.nanos == log_time
    near(ball.translation.x, t / 2, "x of the ball")
    near(ball.translation.z, 1 + 2 * t - G * t * t / 2, "z of the ball")
    near(crate.rotation.z, math.sin(t / 2), "rotation of the crate, z")
    near(crate.rotation.w, math.cos(t / 2), "rotation of the crate, w")
    assert ground.rotation.w == 1.0 and ground.translation.z == 0.0


def check_state(message, log_time, frame):
    assert message.version == 4 and message.frame == frame, message
    near(message.time_s, frame / 240, "time")
    assert round(message.time_s * 1e9) == log_time
    assert message.payload == struct.pack("<QQ", frame, frame * frame)


def main(path):
    frames = {"/tf": 0, "/tumble/state": 0}
    scenes = 0
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert channel.message_encoding == schema.encoding == "protobuf"
            if channel.topic == "/scene":
                assert schema.name == "foxglove.SceneUpdate"
                check_scene(decoded, message.log_time)
                scenes += 1
                continue
            frame = frames[channel.topic]
            assert message.log_time == message.publish_time == round(frame * 1e9 / 240)
            if channel.topic == "/tf":
                assert schema.name == "foxglove.FrameTransforms"
                check_transforms(decoded, message.log_time, frame)
            else:
                assert schema.name == "tumble.State" and "message State" in channel.metadata["proto"]
                check_state(decoded, message.log_time, frame)
            frames[channel.topic] += 1
    assert scenes == 1 and frames["/tf"] == frames["/tumble/state"] > 0, (scenes, frames)
    print(f"{frames['/tf']} frames agree")


if __name__ == "__main__":
    main(sys.argv[1])
