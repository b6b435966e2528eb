"""What `init` proposes for positions in UTM, accelerometers, times and what is left: the study then reads them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from seatruth import BlackBox, Parameter, load_model, load_study
from seatruth.readers import read_log
from seatruth.study.template import template
from seatruth.trials import STANDARD_CHANNELS, Trial

T = np.arange(0.0, 20.0, 0.5)
LOG = {
    "t": T,
    "rudder": 10 * np.sin(T / 3),
    "rpm": 600 + 5 * np.sin(T),
    "Heading [deg]": 40 + np.sin(T),
    "u": 1.2 + 0 * T,
}


def proposed(folder: Path, **columns: object) -> tuple[str, list[str]]:
    pd.DataFrame({**LOG, **columns}).to_csv(folder / "run.csv", index=False)
    return template("run.csv", read_log(folder / "run.csv"), load_model("mmg"), "mmg")


@pytest.mark.parametrize(
    ("zone", "stated"),
    [("32U", "32 north"), ("32 N", "32 north"), ("7 south", "7 south"), ("56H", "56 south"), ("32S", None), (32, None)],
)
def test_utm_positions_and_their_zone(tmp_path: Path, zone: object, stated: str | None) -> None:
    text, notes = proposed(tmp_path, Easting=5e5 + T, Northing=5.9e6 + 2 * T, **{"UTM zone": zone})
    assert ("state it in [frames]" in " ".join(notes)) == (stated is None)
    if stated is None:
        assert '# utm = "32 north"' in text
        return
    assert f'utm = "{stated}"' in text
    (tmp_path / "study.toml").write_text(text)
    trial = load_study(tmp_path / "study.toml").trials[0]
    assert trial.outputs["x"][-1] == pytest.approx(2 * T[-1], rel=1e-2)
    assert trial.outputs["y"][-1] == pytest.approx(T[-1], rel=1e-2)


def test_local_coordinates_stay_x_and_y(tmp_path: Path) -> None:
    text, notes = proposed(tmp_path, Easting=100 + T, Northing=250 + 2 * T)
    assert 'x = { column = "Northing", unit = "m" }' in text
    assert "utm" not in text
    assert [note.partition(",")[0] for note in notes] == ["No column was recognised for the output 'v'"]


def test_accelerometers_are_proposed_and_can_be_taken(tmp_path: Path) -> None:
    text, _ = proposed(tmp_path, x=1.2 * T, y=0 * T, **{"AccX [m/s^2]": 0.1 * np.sin(T), "acc_y [m/s^2]": np.cos(T)})
    lines = [line for line in text.splitlines() if line.startswith(("# f_x", "# f_y", "# f_z"))]
    assert [line.split(" =")[0] for line in lines] == ["# f_x", "# f_y"]
    for line in lines:
        text = text.replace(line, line.removeprefix("# "))
    (tmp_path / "study.toml").write_text(text)
    study = load_study(tmp_path / "study.toml")
    assert {"f_x", "f_y"} <= {channel.name for channel in study.model.outputs}


def test_the_unit_in_the_name_of_the_time_is_taken(tmp_path: Path) -> None:
    """0.5 s in ms are 500, which could be seconds as well: the name decides, and nothing is left to do about it."""
    pd.DataFrame({"time_ms": 1000 * T, **{k: v for k, v in LOG.items() if k != "t"}}).to_csv(tmp_path / "run.csv")
    text, notes = template("run.csv", read_log(tmp_path / "run.csv"), load_model("mmg"), "mmg")
    assert 'unit = "ms"   # unit from the header' in text
    assert not any(note.startswith("Time") for note in notes)
    (tmp_path / "study.toml").write_text(text)
    assert load_study(tmp_path / "study.toml").trials[0].duration == pytest.approx(T[-1])


def test_columns_without_a_channel_are_named(tmp_path: Path) -> None:
    """A box without a current has no speed through the water of its own: it may be what the box calls u."""

    def sail(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, np.ndarray]:
        return {"u": p["k"] * trial.inputs["n"]}

    u = STANDARD_CHANNELS["u"]
    inputs, k = [STANDARD_CHANNELS["n"]], Parameter("k", 0.1, "m", 0.0, 1.0)
    box = BlackBox("box", sail, inputs=inputs, outputs=[u], states=[u], parameters=[k])
    columns = {"t": T, "rpm": 600 + T, "stw_kn": 2.0 + 0 * T, "battery": 12.0 + 0 * T}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    text, _ = template("run.csv", read_log(tmp_path / "run.csv"), box, "box.py:box")
    assert '# u = { column = "stw_kn", unit = "kn" }   # speed through the water' in text
    assert "# No channel takes these columns: stw_kn, battery." in text
    assert tomllib.loads(text)["channels"].keys() == {"n"}
