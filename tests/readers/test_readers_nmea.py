"""Sentences of NMEA 0183: values, signs, check sums, void data, and clocks with and without stamps."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pynmea2
import pytest

from seatruth.errors import BadInput
from seatruth.readers import Log, read_log
from seatruth.readers.nmea_clock import seconds_of_day, spread, stamp_of, unwrapped

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from log_formats import sentence

FIX = "GPGGA,120000.00,5406.1234,N,01205.5000,W,1,09,0.9,12.3,M,45.0,M,,"
MINIMUM = "GPRMC,120000.00,A,5406.1234,S,01205.5000,E,10.5,275.0,310725,3.1,W,A"


def read(folder: Path, *texts: str, stamp: str | None = "2025-07-31T12:00:00.{:03d}Z ") -> Log:
    """A log of these sentences 100 ms apart; `stamp` is written before each, None for nothing."""
    lines = [(stamp.format(100 * k) if stamp else "") + sentence(text) for k, text in enumerate(texts)]
    (folder / "a.nmea").write_text("\r\n".join(lines) + "\r\n")
    return read_log(folder / "a.nmea")


def value(log: Log, field: str) -> float:
    table, column = log.find(field)
    return float(table.numbers(column)[0])


def unit(log: Log, field: str) -> str:
    table, column = log.find(field)
    return table.units[column]


@pytest.mark.parametrize(
    ("text", "field", "expected", "expected_unit"),
    [
        (FIX, "GPGGA.latitude", 54 + 6.1234 / 60, "deg"),
        (FIX, "GPGGA.longitude", -(12 + 5.5 / 60), "deg"),
        (FIX, "GPGGA.altitude", 12.3, "m"),
        (MINIMUM, "GPRMC.latitude", -(54 + 6.1234 / 60), "deg"),
        (MINIMUM, "GPRMC.speed_over_ground", 10.5, "kn"),
        (MINIMUM, "GPRMC.course_over_ground", 275.0, "deg"),
        (MINIMUM, "GPRMC.magnetic_variation", -3.1, "deg"),
        ("GPVTG,275.0,T,271.9,M,10.5,N,19.4,K,A", "GPVTG.speed_over_ground", 10.5, "kn"),
        ("HEHDT,123.4,T", "HEHDT.heading", 123.4, "deg"),
        ("TIROT,-12.5,A", "TIROT.rate_of_turn", -12.5, "deg/min"),
        ("VWVHW,123.4,T,120.3,M,9.8,N,18.1,K", "VWVHW.speed_through_water", 9.8, "kn"),
        ("VDVBW,9.8,-0.2,A,10.5,-0.3,A", "VDVBW.transverse_ground_speed", -0.3, "kn"),
        ("AGRSA,-9.5,A,,V", "AGRSA.rudder", -9.5, "deg"),
        ("IIRPM,S,1,104.5,95.0,A", "IIRPM[S1].shaft_speed", 104.5, "rpm"),
        ("WIMWV,214.8,R,10.8,K,A", "WIMWV[R].wind_speed", 3.0, "m/s"),
    ],
)
def test_values_and_units(tmp_path: Path, text: str, field: str, expected: float, expected_unit: str) -> None:
    log = read(tmp_path, text)
    assert value(log, field) == pytest.approx(expected, rel=1e-12)
    assert unit(log, field) == expected_unit


def test_values_are_those_of_another_parser(tmp_path: Path) -> None:
    log = read(tmp_path, FIX, MINIMUM, "VWVHW,123.4,T,120.3,M,9.8,N,18.1,K")
    fix, minimum = pynmea2.parse(sentence(FIX), check=True), pynmea2.parse(sentence(MINIMUM), check=True)
    assert value(log, "GPGGA.latitude") == pytest.approx(fix.latitude, rel=1e-12)
    assert value(log, "GPGGA.longitude") == pytest.approx(fix.longitude, rel=1e-12)
    assert value(log, "GPRMC.latitude") == pytest.approx(minimum.latitude, rel=1e-12)
    assert value(log, "GPRMC.speed_over_ground") == minimum.spd_over_grnd


def test_wrong_check_sums_are_left_out_and_counted(tmp_path: Path) -> None:
    lines = [f"{k} {sentence(f'HEHDT,{k},T')}" for k in range(1_753_963_200, 1_753_963_205)]
    lines[2] = lines[2].replace("HEHDT,1753963202", "HEHDT,1753963209")
    lines.append("1753963205 $HEHDT,7,T")
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    log = read_log(tmp_path / "a.nmea")
    assert log.table().numbers("heading").tolist() == [1753963200, 1753963201, 1753963203, 1753963204, 7]
    assert any("1 sentence(s) with a wrong check sum are left out" in note for note in log.notes)
    assert any("1 sentence(s) have no check sum" in note for note in log.notes)
    (tmp_path / "b.nmea").write_text("\n".join(line.replace("T*", "M*") for line in lines))
    with pytest.raises(BadInput, match="5 of 5 check sums are wrong"):
        read_log(tmp_path / "b.nmea")


def test_void_and_empty_values_are_missing(tmp_path: Path) -> None:
    log = read(tmp_path, "TIROT,3.0,V", "HEHDT,,T", "AGRSA,5.0,V,4.0,A", MINIMUM.replace(",A,5406", ",V,5406"))
    assert np.isnan([value(log, name) for name in ("rate_of_turn", "heading", "rudder", "latitude")]).all()
    assert value(log, "rudder_port") == 4.0
    assert any("2 sentence(s) are declared void" in note for note in log.notes)


def test_what_is_not_read_is_named(tmp_path: Path) -> None:
    log = read(tmp_path, "HEHDT,1,T", "GPGSA,A,3,,,,,,,,,,,,,1,1,1", "HEHDT,abc,T")
    assert any("not read: GSA" in note for note in log.notes)
    assert any("1 sentence(s) hold something else than numbers" in note for note in log.notes)
    with pytest.raises(BadInput, match="no sentence that is known"):
        read(tmp_path, "GPGSA,A,3,,,,,,,,,,,,,1,1,1", "GPGSA,A,3,,,,,,,,,,,,,1,1,1")


@pytest.mark.parametrize(
    ("prefix", "expected"),
    [
        (b"2025-07-31T12:00:00.5Z ", 1753963200.5),
        (b"2025-07-31 14:00:00,5+02:00;", 1753963200.5),
        (b"2025-07-31,12:00:00,", 1753963200.0),
        (b"1753963200.25 ", 1753963200.25),
        (b"[1753963200250] ", 1753963200.25),
        (b"\\s:GP0001,c:1753963200*5A\\", 1753963200.0),
        (b"", np.nan),
        (b"COM3: ", np.nan),
    ],
)
def test_stamps_of_loggers(prefix: bytes, expected: float) -> None:
    np.testing.assert_equal(stamp_of(prefix), expected)


def test_the_clock_without_stamps_is_that_of_the_fixes(tmp_path: Path) -> None:
    """Three rates of turn follow each fix, a second apart over midnight; one heading does."""
    texts = []
    for second, day in (("235958", "310725"), ("235959", "310725"), ("000000", "010825")):
        texts += [f"GPRMC,{second}.00,A,5406.0,N,01205.0,E,10,275,{day},,,A", f"HEHDT,{second[-2:]},T"]
        texts += ["TIROT,1,A"] * 2
    log = read(tmp_path, "TIROT,0,A", *texts, stamp=None)
    clocks = {name: log.clock(table) for name, table in log.tables.items()}
    np.testing.assert_allclose(clocks["GPRMC"], [0, 1, 2])
    np.testing.assert_allclose(clocks["HEHDT"], [0, 1, 2])
    np.testing.assert_allclose(clocks["TIROT"], [0, 0.5, 1, 1.5, 2, 2.5])
    assert log.start() == "2025-07-31T23:59:58+00:00"
    assert any("spread evenly" in note for note in log.notes)


def test_sentences_without_any_clock_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="neither stamps of a logger nor the time of a fix"):
        read(tmp_path, "HEHDT,1,T", "HEHDT,2,T", stamp=None)


def test_times_of_day() -> None:
    assert seconds_of_day("120001.25") == 43201.25
    for wrong in ("12:00:01", "250000", "126000", "1200"):
        with pytest.raises(ValueError, match=wrong):
            seconds_of_day(wrong)
    assert unwrapped(np.array([86399.0, 0.0, 1.0])).tolist() == [86399, 86400, 86401]
    assert spread(np.array([1, 4]), np.array([2, 3]), np.array([10.0, 10.0])).tolist()[1] == 10.0
