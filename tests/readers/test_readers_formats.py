"""Every format that seatruth reads, in a file that the format's own library wrote: the same study comes back."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import ClassVar

import h5py
import numpy as np
import pandas as pd
import pytest

from seatruth import BadInput, identify, load_study
from seatruth.readers import read_log
from seatruth.sample import copy_to
from seatruth.testing.readers import FOREIGN, ReaderConformance, Sample
from seatruth.trials import read_trial

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from log_formats import WRITERS, manoeuvre, ulog_file

RUN = manoeuvre(np.arange(0.0, 4.0, 0.1))
RTOL = {"nmea": 1e-7}
"""NMEA's text has nine decimals, and its stamps are seconds since 1970."""


@pytest.mark.parametrize("name", WRITERS)
def test_the_same_run_comes_back_from_every_format(tmp_path: Path, name: str) -> None:
    written = WRITERS[name](tmp_path, RUN)
    trial = read_trial(written.path, **written.reading)
    tolerance = RTOL.get(name, 1e-14)
    np.testing.assert_allclose(trial.t, RUN["t"], rtol=tolerance, atol=max(tolerance, 1e-14))
    for channel in written.channels:
        factor = np.pi / 180 if channel in ("delta", "psi", "r") else 1.0
        np.testing.assert_allclose(
            trial.channel(channel), RUN[channel] * factor, rtol=tolerance, atol=tolerance, err_msg=channel
        )


@pytest.mark.parametrize(
    ("name", "extra"),
    [(name, "ros") for name in ("ros1", "ros2", "mcap")]
    + [("hdf5", "hdf5"), ("excel", "excel"), ("ulog", "px4"), ("dataflash", "ardupilot")],
)
def test_an_extra_that_is_not_installed_is_named_with_its_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, extra: str
) -> None:
    path = WRITERS[name](tmp_path, RUN[:5]).path
    for module in ("h5py", "python_calamine", "rosbags", "mcap", "pyulog", "pymavlink"):
        monkeypatch.setitem(sys.modules, module, None)  # as if it were not there, to imports as well
    with pytest.raises(BadInput, match=rf'not installed. Run: pip install "seatruth\[{extra}\]"') as caught:
        read_log(path)
    assert str(path) in str(caught.value)


def test_fixes_of_older_px4_logs_are_whole_numbers(tmp_path: Path) -> None:
    stamps = np.arange(1, 41, dtype=np.uint64) * np.uint64(100_000)
    fix = {"lat": np.full(40, 541_800_000, dtype="<i4"), "lon": np.arange(40, dtype="<i4") + 78_800_000}
    ulog_file(tmp_path / "run.ulg", {"vehicle_gps_position": (stamps, fix)})
    where = {"latitude": "vehicle_gps_position.lat", "longitude": "vehicle_gps_position.lon"}
    trial = read_trial(tmp_path / "run.ulg", inputs={}, outputs=where)
    east = 1e-7 * np.pi / 180 * 6.392e6 * np.cos(np.radians(54.18))  # m a step; 6392 km: the prime vertical's radius
    np.testing.assert_allclose(trial.outputs["y"], np.arange(40) * east, rtol=1e-3, atol=1e-6)


@pytest.mark.slow
def test_the_same_manoeuvre_gives_the_same_parameters_from_every_format(tmp_path: Path) -> None:
    """Two coefficients of the sample's ship from a synthetic zigzag; NMEA lacks positions, so all go without."""
    copy_to(tmp_path)
    run = pd.read_csv(tmp_path / "zigzag_20_20.csv", comment="#")
    run = run.rename(columns=lambda title: title.partition(" ")[0])[:300]
    found = {}
    for name, write in WRITERS.items():
        (tmp_path / name).mkdir()
        written = write(tmp_path / name, run)
        lines = [
            '[model]\nuse = "mmg"\nset = "KVLCC2"\nvary = ["N_v", "N_r"]',
            "[channels]",
            *(
                f'{c} = {{ column = "{spec.column}", sign = {int(spec.sign)}'
                + (f', unit = "{spec.unit}"' if spec.unit else "")
                + " }"
                for c, spec in written.channels.items()
                if c not in ("x", "y")
            ),
            f'[[trials]]\nfile = "{written.path.name}"\nwithout = ["x", "y"]',
            '[[prepare]]\nstep = "unwrap"\nchannels = ["psi"]',
            '[noise]\npsi = "0.1 deg"\nu = "0.01 m/s"\nv = "0.01 m/s"\nr = "0.05 deg/s"',
            '[cost]\nkind = "trajectory"\ninitial = "fixed"',
            '[optimizer]\nuse = "least_squares"',
        ]
        (tmp_path / name / "study.toml").write_text("\n".join(lines))
        estimate = identify(load_study(tmp_path / name / "study.toml"))
        found[name] = estimate.parameters.loc[["N_v", "N_r"], "value"].to_numpy(dtype=float)
    for name, values in found.items():
        np.testing.assert_allclose(values, found["csv"], rtol=1e-5 if name == "nmea" else 1e-7, err_msg=name)


class Conformance(ReaderConformance):
    """The sample is the run above, as the writer of the format gives it.

    Damaged files of formats that are read in a process of their own are tried by experiments/reader_fuzz.py.
    """

    writer: ClassVar[str] = ""
    damages = 0

    @pytest.fixture
    def sample(self, tmp_path: Path) -> Sample:
        written = WRITERS[self.writer or self.reader](tmp_path, RUN)
        fields = {}
        for channel, spec in written.channels.items():
            if spec.unit is not None and spec.unit != "rad/s":
                fields[spec.column] = RUN[channel] * spec.sign
        return Sample(written.path, fields)


class TestCSV(Conformance):
    reader = "csv"
    foreign = tuple(head for head in FOREIGN if b"\n0,1\n" not in head and b"#!" not in head)
    damages = 20


class TestParquet(Conformance):
    reader = "parquet"


class TestMatlab(Conformance):
    reader = "matlab"


class TestHDF5(Conformance):
    reader = "hdf5"


class TestExcel(Conformance):
    reader = "excel"


class TestRos1(Conformance):
    reader, writer = "rosbag", "ros1"


class TestRos2(Conformance):
    reader, writer = "rosbag", "ros2"


class TestMCAP(Conformance):
    reader = "mcap"


class TestULog(Conformance):
    reader = "ulog"


class TestDataFlash(Conformance):
    reader = "dataflash"


class TestNMEA(Conformance):
    reader = "nmea"
    damages = 20


def test_a_file_of_endlessly_nested_groups_is_refused(tmp_path: Path) -> None:
    """Its library walks to each group from the top: 3000 of them took 30 s."""
    path = tmp_path / "deep.h5"
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(150):
            group = group.create_group("g")
        group["t"] = np.arange(5.0)
    with pytest.raises(BadInput, match="groups are nested more than 100 deep") as refused:
        read_log(path)
    assert str(path) in str(refused.value)
