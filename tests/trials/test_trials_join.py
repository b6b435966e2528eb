"""Topics with clocks of their own become one trial: outputs at their own times, inputs between their samples."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from seatruth.errors import BadInput
from seatruth.readers import Content, Topic
from seatruth.readers.csv_file import CSV
from seatruth.trials import Clock, ColumnSpec, Trial, read_trial

FAST, SLOW = np.arange(0.0, 2.01, 0.25), np.arange(0.5, 1.8, 0.5)


def read(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    topics: Sequence[Topic],
    inputs: Mapping[str, Any],
    outputs: Mapping[str, Any],
    **options: Any,
) -> Trial:
    """A trial of these topics, as if a file held them."""
    (folder / "run.csv").write_text("t,u\n0,1\n")
    monkeypatch.setattr(CSV, "read", lambda self, path, progress: Content(topics, ["A note of the reader."]))
    return read_trial(folder / "run.csv", inputs=inputs, outputs=outputs, **options)


def topic(name: str, t: np.ndarray, **fields: Any) -> Topic:
    return Topic(name, {"time": 100.0 + t, **fields}, {"time": "s"}, "time")


def test_each_output_keeps_its_own_times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    topics = [
        topic("gps", SLOW, x=10 * SLOW, fix=np.array([1, 0, 1])),
        topic("imu", FAST + 0.1, r=FAST),
        topic("rudder", FAST, angle=2 * FAST),
    ]
    trial = read(
        tmp_path,
        monkeypatch,
        topics,
        {"delta": ColumnSpec("rudder.angle", "rad")},
        {"x": ColumnSpec("gps.x", invalid_where="fix == 0"), "r": ColumnSpec("r", "rad/s")},
    )
    assert trial.t.size == np.unique([*SLOW, *(FAST[FAST <= 1.9] + 0.1)]).size
    np.testing.assert_allclose(trial.inputs["delta"], 2 * trial.t, atol=1e-12)
    there = np.isfinite(trial.outputs["x"])
    np.testing.assert_allclose(trial.t[there], [0.5, 1.5])
    np.testing.assert_allclose(trial.outputs["x"][there], [5, 15])
    rates = np.isfinite(trial.outputs["r"])
    np.testing.assert_allclose(trial.outputs["r"][rates], trial.t[rates] - 0.1, atol=1e-12)
    record = trial.steps[0].effect
    assert "A note of the reader." in record
    assert "rudder.angle: linear between its samples, which are at most 0.25 s apart" in record
    assert "1 of 12 times left out, at which an input was not recorded" in record


def test_one_topic_with_a_clock_is_not_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trial = read(tmp_path, monkeypatch, [topic("a", FAST, d=FAST, r=FAST)], {"delta": "a.d"}, {"r": "a.r"})
    np.testing.assert_allclose(trial.t, FAST)
    np.testing.assert_array_equal(trial.outputs["r"], FAST)


def test_another_clock_is_taken_where_topics_have_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    late = Topic("a", {"time": FAST, "stamp": 1000 * FAST + 50, "r": FAST}, {"time": "s", "stamp": "ms"}, "time")
    other = Topic("b", {"time": FAST, "stamp": 1000 * FAST, "d": FAST}, {"time": "s"}, "time")
    clock = Clock("stamp", "ms")
    trial = read(tmp_path, monkeypatch, [late, other], {"delta": "d"}, {"r": "r"}, time=clock)
    np.testing.assert_allclose(trial.inputs["delta"], trial.t)
    np.testing.assert_allclose(trial.outputs["r"], trial.t - 0.05, atol=1e-12)


def test_times_that_a_topic_repeats_are_for_the_study_to_settle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    twice = topic("a", np.array([0.0, 1.0, 1.0, 2.0]), r=np.array([0.0, 1.0, 9.0, 2.0]))
    topics = [twice, topic("b", FAST, d=FAST)]
    with pytest.raises(BadInput, match="repeat the time"):
        read(tmp_path, monkeypatch, topics, {"delta": "d"}, {"r": "r"})
    trial = read(tmp_path, monkeypatch, topics, {"delta": "d"}, {"r": "r"}, repeated_time="last")
    assert trial.outputs["r"].tolist() == [0, 9, 2]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"time": np.array([0.0, 2.0, 1.0])}, "run.csv, b, row 3: time runs back, from 2 s to 1 s"),
        ({"time": np.array([0.0, np.nan, 1.0])}, "run.csv, b, row 2: 1 sample"),
        ({"time": np.array([50.0, 51.0, 52.0])}, "hardly recorded at the same time"),
        ({}, "it has no clock and no column 't'"),
    ],
)
def test_clocks_that_cannot_be_joined(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], says: str
) -> None:
    broken = Topic("b", {**change, "d": np.zeros(3)}, {}, "time" if change else None)
    whole = Topic("a", {"time": FAST, "r": FAST}, {}, "time")
    with pytest.raises(BadInput, match=says):
        read(tmp_path, monkeypatch, [whole, broken], {"delta": "d"}, {"r": "r"})


def test_structs_of_a_matlab_file_have_their_own_clocks(tmp_path: Path) -> None:
    fast, slow = {"t": FAST, "delta": FAST}, {"t": SLOW, "psi": SLOW}
    scipy.io.savemat(tmp_path / "run.mat", {"fast": fast, "slow": slow})
    trial = read_trial(tmp_path / "run.mat", inputs={"delta": "delta"}, outputs={"psi": "slow.psi"})
    np.testing.assert_allclose(trial.t, SLOW)
    np.testing.assert_allclose(trial.inputs["delta"], SLOW)


def test_json_messages_of_an_mcap(tmp_path: Path) -> None:
    from mcap.writer import Writer

    with open(tmp_path / "run.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("Pose", "jsonschema", b"{}")
        pose, text = (
            writer.register_channel("/pose", "json", schema),
            writer.register_channel("/note", "protobuf", schema),
        )
        for k in range(5):
            message = {"speed": {"u": k / 2}, "rudder": k, "covariance": [1, 2], "frame": "map"}
            writer.add_message(pose, k * 10**8, json.dumps(message).encode(), k * 10**8)
            writer.add_message(text, k * 10**8, b"\0", k * 10**8)
        writer.finish()
    trial = read_trial(tmp_path / "run.mcap", inputs={"delta": "rudder"}, outputs={"u": "/pose.speed.u"})
    np.testing.assert_allclose(trial.t, np.arange(5) / 10)
    np.testing.assert_allclose(trial.outputs["u"], np.arange(5) / 2)
    assert "/note is left out: its messages are protobuf" in trial.steps[0].effect
