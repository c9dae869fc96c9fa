"""Recordings: written, read back as arrays, replayed."""

import subprocess

import numpy as np
import pytest

import tumble


def thrown():
    world = tumble.World(dt=0.01)
    world.add_rigid("ball", tumble.Sphere(0.1), mass=1.0, velocity=(1, 0, 5), angular_velocity=(0, 0, 2))
    world.add_rigid("box", tumble.Box(0.2), mass=1.0, position=(0, 3, 0))
    return world


def test_what_is_read_is_what_was_recorded(tmp_path):
    world, path = thrown(), tmp_path / "run.mcap"
    rows = []
    with tumble.Recorder(path) as recorder:
        for _ in range(30):
            recorder.frame(world)
            rows.append((world.time, world["ball"].position, world["ball"].orientation, world.save()))
            world.step(2)
        assert recorder.frames == 30 and recorder.path == path
    run = tumble.read(path)
    times, positions, orientations, states = zip(*rows)
    assert len(run) == 30 and run.names == ["ball", "box"] and run.note is None
    assert (run.times == times).all() and run.frames.tolist() == list(range(0, 60, 2))
    assert (run.position("ball") == positions).all() and (run.orientation("ball") == orientations).all()
    assert tuple(run.states) == states
    # a parabola, and a turn at 2 rad/s
    assert run.position("ball")[:, 2] == pytest.approx(5 * run.times - 9.81 / 2 * run.times**2)
    assert run.orientation("ball")[:, 2] == pytest.approx(np.sin(run.times))
    with pytest.raises(KeyError, match="it has ball, box"):
        run.position("bat")


def test_the_file_is_the_command_s(command, tmp_path):
    words = ["run", "billiards", "--duration", "0.1", "--quiet", "--record", tmp_path / "theirs.mcap"]
    subprocess.run([command, *words], check=True, timeout=60)
    world = tumble.World.load("billiards")
    with tumble.Recorder(tmp_path / "ours.mcap") as recorder:
        recorder.run(world, round(0.1 / world.dt))
    assert (tmp_path / "ours.mcap").read_bytes() == (tmp_path / "theirs.mcap").read_bytes()


def test_a_replay_visits_every_frame(tmp_path):
    world = tumble.World.load("stack")
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.run(world, 12, every=4)
    visited = [(each.frame, each.save()) for each in tumble.replay(tmp_path / "run.mcap")]
    assert [frame for frame, _ in visited] == [0, 4, 8, 12] and visited[-1][1] == world.save()
    # from any frame the future is the same
    again = tumble.replay(tmp_path / "run.mcap")
    next(again)
    middle = next(again).fork()
    middle.step(8)
    assert middle.save() == world.save()


def test_contacts_are_recorded_and_replayed(tmp_path):
    def resting():
        world = tumble.World()
        world.add_static("ground", tumble.HalfSpace())
        world.add_rigid("ball", tumble.Sphere(0.1), mass=2.0, position=(0, 0, 0.1))
        return world

    world = resting()
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.run(world, 60)
    run = tumble.read(tmp_path / "run.mcap")
    assert len(run.contacts) == len(run) and len(run.contacts[0]) == 0
    (contact,) = run.contacts[-1]
    assert sorted(run.names[k] for k in contact["bodies"]) == ["ball", "ground"]
    assert abs(contact["force"][2]) == pytest.approx(2 * 9.81) and contact["point"] == pytest.approx([0, 0, 0], abs=1e-6)
    *_, last = tumble.replay(tmp_path / "run.mcap", resting())
    for field in ("bodies", "parts", "shapes", "point", "normal", "depth", "force"):
        assert (last.contacts[field] == world.contacts[field]).all()


def test_a_world_made_in_a_program_replays_into_one_like_it(tmp_path):
    world = thrown()
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.run(world, 5)
    with pytest.raises(ValueError, match="pass a world with the same bodies"):
        tumble.replay(tmp_path / "run.mcap")
    assert [each.frame for each in tumble.replay(tmp_path / "run.mcap", thrown())] == [0, 1, 2, 3, 4, 5]
    with pytest.raises(tumble.SnapshotError):
        list(tumble.replay(tmp_path / "run.mcap", tumble.World()))


def test_bodies_that_come_and_go_are_nan_where_they_are_not(tmp_path):
    world = thrown()
    with tumble.Recorder(tmp_path / "run.mcap") as recorder:
        recorder.frame(world)
        world.step()
        world.remove("box")
        world.add_rigid("late", tumble.Sphere(0.1), mass=1.0, position=(7, 0, 0))
        recorder.frame(world)
    run = tumble.read(tmp_path / "run.mcap")
    assert run.names == ["ball", "box", "late"]
    assert np.isnan(run.position("box")).tolist() == [[False] * 3, [True] * 3]
    assert np.isnan(run.position("late"))[0].all() and run.position("late")[1] == pytest.approx([7, 0, 0])


def test_a_block_that_raises_leaves_a_whole_file(tmp_path):
    world = thrown()
    with pytest.raises(RuntimeError, match="mine"):
        with tumble.Recorder(tmp_path / "run.mcap") as recorder:
            recorder.run(world, 3)
            raise RuntimeError("mine")
    run = tumble.read(tmp_path / "run.mcap")
    assert len(run) == 4 and run.note is None
    with pytest.raises(ValueError, match="closed"):
        recorder.frame(world)


def test_a_cut_file_gives_what_it_holds_and_a_damaged_one_says_where(tmp_path):
    world, path = thrown(), tmp_path / "run.mcap"
    with tumble.Recorder(path) as recorder:
        recorder.run(world, 100)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    cut = tumble.read(path)
    assert 0 < len(cut) < 101 and "cut at byte" in cut.note
    assert cut.position("ball")[:, 0] == pytest.approx(cut.times)
    path.write_bytes(whole[:2000] + bytes(50) + whole[2050:])
    with pytest.raises(tumble.RecordingError, match="damaged at byte"):
        tumble.read(path)
    path.write_bytes(b"no recording")
    with pytest.raises(ValueError, match="not an MCAP file"):
        tumble.read(path)


def test_files_that_are_not_there_are_file_errors(tmp_path):
    with pytest.raises(FileNotFoundError, match="none.mcap"):
        tumble.read(tmp_path / "none.mcap")
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        tumble.Recorder(tmp_path / "none" / "run.mcap")
    with pytest.raises(ValueError, match="already recorded"):
        with tumble.Recorder(tmp_path / "run.mcap") as recorder:
            world = thrown()
            recorder.frame(world)
            recorder.frame(world)


def test_images_of_cameras_are_recorded_if_asked_for(tmp_path):
    def made():
        world = tumble.World()
        world.add_static("ground", tumble.HalfSpace())
        world.add_rigid("ball", tumble.Sphere(0.2), mass=1, position=(0, 0, 1)).color = (1, 0, 0)
        eye = {"position": (0, 0, 2), "orientation": (1, 0, 0, 0), "resolution": (7, 5)}
        for kind in ("depth", "color", "segmentation"):
            world.add_sensor(kind, name=kind, **eye)
        world.add_sensor("depth", name="late", delay=3, deviation=0.01, cutoff=1.3, **eye)
        return world

    path, world, images = tmp_path / "seen.mcap", made(), []
    with tumble.Recorder(path, cameras=True) as recorder:
        for _ in range(30):
            recorder.frame(world)
            images.append({name: world.sensors[name] for name in world.sensors})
            world.step()
    recording = tumble.read(path)
    assert list(recording.images) == ["color", "depth", "late", "segmentation"] and recording.sensors == {}
    for name in ("depth", "late"):
        assert recording.images[name].dtype == np.float32
        assert (recording.images[name] == np.array([image[name] for image in images], np.float32)).all()
    assert (recording.images["color"] == np.array([image["color"] for image in images])).all()
    parts = recording.images["segmentation"]
    assert parts.shape == (30, 5, 7) and parts.dtype == np.int32
    bodies = np.array([image["segmentation"][..., 0] for image in images])
    names = [body.name for body in world.bodies]
    assert all(recording.names[part] == names[body] for part, body in zip(parts[parts >= 0], bodies[parts >= 0], strict=True))
    assert ((parts < 0) == (bodies < 0)).all() and (parts[0] >= 0).all()
    with tumble.Recorder(path) as recorder:
        recorder.run(made(), 3)
    assert tumble.read(path).images == {}
