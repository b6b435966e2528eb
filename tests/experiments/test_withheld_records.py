"""The real set: cases that tell nothing, diagnosing runs that cannot reach the anemometer, measures on hand-made rows.

What needs the real trials is left out where they are not on the machine.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "experiments"))

from withheld.commands import main  # noqa: E402
from withheld.diagnose import diagnose, walls  # noqa: E402
from withheld.programs.kinematics import ERRORS, kinematics, left  # noqa: E402
from withheld.records import measures  # noqa: E402
from withheld.records.anemometer import FOLDER, WIND, of_day, of_run  # noqa: E402
from withheld.records.left_out import in_estimated_wind  # noqa: E402
from withheld.records.make import SET, make  # noqa: E402
from withheld.records.page import write_page  # noqa: E402
from withheld.records.plan import SOURCES  # noqa: E402
from withheld.records.score import score  # noqa: E402
from withheld.records.studies import ship, study_text  # noqa: E402
from withheld.records.tables import read, text  # noqa: E402
from withheld.seal import note, write  # noqa: E402
from withheld.verdicts import verdict  # noqa: E402

import seatruth.sample  # noqa: E402
from seatruth.errors import BadInput  # noqa: E402

DATA = ROOT.parent / "shared" / "data"
real = pytest.mark.skipif(not DATA.is_dir(), reason="the real trials (../shared/data) are not on this machine")
OPENS = """
import sys
sys.path[0] = {experiments!r}
from pathlib import Path
from withheld.records.anemometer import of_run
try:
    of_run({run!r}, Path({data!r}))
except Exception as problem:
    print(type(problem).__name__)
    sys.exit(0)
sys.exit("the wind was read")
"""


def _wind(x: float, y: float) -> dict[str, float]:
    return {"x": x, "y": y, "speed": math.hypot(x, y), "towards": math.atan2(y, x)}


def _said(
    case: str, candidates: list[tuple[list[str], float]], which: dict[str, float], **values: Any
) -> dict[str, Any]:
    """A verdict as the library's program writes it; `values` are fitted parameters by effect."""
    rows = [
        {"name": name, "log_evidence": gain, "parameters": [
            {"name": q, "value": v, "stderr": e} for q, (v, e) in values.get(name, {}).items()]}
        for name, gain in which.items()
    ]  # fmt: skip
    return verdict(case, candidates, which=rows)


# --- the cases ---


def test_without_the_real_trials_it_says_what_to_give(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="--data"):
        make(tmp_path / "set", tmp_path / "nowhere", quick=True)
    assert main(["generate", "--set", SET, "--out", str(tmp_path / "set"), "--data", str(tmp_path)]) == 2


def test_a_record_comes_back_with_its_own_digits(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_text("t,psi,n\n0.0,-0.01250,10.3\n0.1,1.5e-05,10\n")
    table = read(file)
    assert table.decimals == {"t": 1, "psi": 6, "n": 1}
    assert text({**table.columns, "psi": table.columns["psi"] - 0.0}, table.decimals).splitlines()[1:] == [
        "0.0,-0.012500,10.3",
        "0.1,0.000015,10.0",
    ]
    file.write_text("t,psi\n0.0,north\n")
    with pytest.raises(BadInput, match="cannot be read"):
        read(file)


@pytest.mark.parametrize("source", list(SOURCES))
def test_a_study_says_the_ship_and_nothing_of_weather(source: str) -> None:
    own = SOURCES[source]
    written = study_text("c001", own, ship(own.study))
    for word in ("wind", "calm", "basin", "indoor", "pond_", "Jul", "Sep", "Oct", "zz_", "HSVA.csv", "bias", "[noise]"):
        assert word not in written.replace(own.ship, ""), word
    assert written.count("[[trials]]") == len(own.runs)


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("records") / "set"
    make(out, DATA, quick=True)
    return out


@real
def test_public_cases_differ_by_the_error_alone_and_name_none(quick: Path) -> None:
    truths = {file.stem: json.loads(file.read_text()) for file in (quick / "sealed").glob("c*.json")}
    put = next(truth for truth in truths.values() if truth["kind"] == "injected")
    control = truths[put["control"]]
    assert put["effects"] == ["heading_bias"]
    assert control["effects"] == []
    for k, _ in enumerate(put["runs"]):
        with_it, without = (read(quick / "public" / t["case"] / f"trial_{k + 1}.csv") for t in (put, control))
        off = with_it.columns["psi"] - without.columns["psi"]
        assert off == pytest.approx(put["causes"][0]["values"]["b"], abs=1e-5)
        assert with_it.decimals == without.decimals
        for name in ("t", "x", "y", "u", "v", "r", "delta", "n"):
            assert np.array_equal(with_it.columns[name], without.columns[name])
    public = "".join(file.read_text() for file in (quick / "public").rglob("*.toml"))
    assert "heading_bias" not in public
    assert json.loads((quick / "public" / "seal.json").read_text())["denied"] == [str(DATA.resolve())]


# --- who can read the anemometer ---


@pytest.mark.slow
@real
def test_a_diagnosing_run_cannot_read_the_anemometer_though_its_study_names_it(quick: Path, tmp_path: Path) -> None:
    """The whole step, with a study changed to take the anemometer's files for its trials."""
    out = tmp_path / "set"
    subprocess.run(["cp", "-r", str(quick), str(out)], check=True)
    study = out / "public" / "c001" / "study.toml"
    wind = sorted((DATA / FOLDER).glob("*.csv"))[0]
    changed = study.read_text().replace('"trial_1.csv"', f'"{wind.as_posix()}"')
    assert changed != study.read_text()
    study.write_text(changed)
    diagnose(out, "prior", 1)
    said = {name: json.loads((out / "verdicts" / "prior" / f"{name}.json").read_text()) for name in ("c001", "c002")}
    assert said["c001"]["failed"], "its trials are out of reach"
    assert wind.name in said["c001"]["failed"]
    assert "failed" not in said["c002"], "the other case was diagnosed"
    assert wind.exists()


@real
def test_the_score_s_own_reader_of_the_wind_is_shut_off_there() -> None:
    """Not even the code that scores can read it where a diagnosis runs; here it can."""
    run = SOURCES["pond_14-Sep"].runs[0]
    code = OPENS.format(experiments=str(ROOT / "experiments"), run=run, data=str(DATA))
    prefix = walls([DATA])
    if not prefix:
        pytest.skip("this system has no mount namespaces for users; the hook's own test covers it")
    done = subprocess.run([*prefix, sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "BadInput"
    assert of_run(run, DATA)["speed"] > 0.0


@pytest.mark.slow
def test_nothing_that_diagnoses_imports_the_anemometer() -> None:
    folder = ROOT / "experiments" / "withheld"
    blind = [folder / "blind.py", folder / "verdicts.py", folder / "seal.py", *(folder / "programs").glob("*.py")]
    code = "import sys; sys.path[0] = {0!r}\nimport withheld.blind, withheld.programs, withheld.programs.own\n"
    code += "import withheld.seal, withheld.verdicts\n"
    code += "assert not any(name.startswith('withheld.records') for name in sys.modules)"
    subprocess.run([sys.executable, "-c", code.format(str(ROOT / "experiments"))], check=True)
    assert not any("anemometer" in file.read_text() for file in blind)


# --- the program that looks at the sensors alone ---


def test_sensors_that_agree_leave_nothing_and_a_lever_arm_leaves_its_turn() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    psi = 0.1 * t
    circle = {
        "t": t, "x": 10.0 * np.sin(psi), "y": 10.0 * (1.0 - np.cos(psi)), "psi": psi, "u": np.ones_like(t),
        "v": np.zeros_like(t), "r": np.full_like(t, 0.1),
    }  # fmt: skip
    track, heading = left(circle)
    assert np.abs(track).max() < 1e-3
    assert np.abs(heading).max() < 1e-9
    for name, of in ERRORS.items():
        for key, (_, _, change) in of.items():
            moved = [np.abs(part).max() for part in left({**circle, **change(circle, 0.5)})]
            # On a circle at a constant rate, a rate that is late is the same rate.
            assert max(moved) > 0.01 or name == "rate_delay", (name, key)


@real
def test_the_sensors_alone_tell_a_heading_bias_from_its_control(quick: Path) -> None:
    said = {folder.name: kinematics(folder / "study.toml") for folder in (quick / "public").glob("c*")}
    for name, own in said.items():
        truth = json.loads((quick / "sealed" / f"{name}.json").read_text())
        row = next(row for row in own["which"] if row["name"] == "heading_bias")
        assert (row["probability"] > 0.9) == (truth["kind"] == "injected")
        if truth["kind"] == "injected":
            assert row["parameters"][0]["value"] == pytest.approx(0.06, rel=0.05)


# --- measures ---


def test_wind_of_a_run_goes_where_it_does_not_come_from(tmp_path: Path) -> None:
    place = tmp_path / FOLDER
    place.mkdir(parents=True)
    # From +y: it blows towards -y.
    (place / "run.csv").write_text(f"t,wind_speed_true,wind_dir_true\n0,2.0,{math.pi / 2}\n1,2.0,{math.pi / 2}\n2,,\n")
    wind = of_run("run", tmp_path)
    assert wind["speed"] == pytest.approx(2.0)
    assert math.degrees(wind["towards"]) == pytest.approx(-90.0)
    assert wind["gusts"] == pytest.approx(0.0, abs=1e-9)
    day = of_day([_wind(1.0, 0.0), _wind(1.0, 1.0)])
    assert (day["x"], day["y"], day["spread"]) == pytest.approx((1.0, 0.5, 0.5))
    with pytest.raises(BadInput, match="no anemometer record"):
        of_run("another", tmp_path)


def test_a_wind_is_near_in_direction_and_speed() -> None:
    assert measures.difference(_wind(1.0, 0.1), _wind(1.0, -0.1))["near"]
    assert not measures.difference(_wind(0.4, 0.0), _wind(1.0, 0.0))["near"]
    behind = measures.difference(_wind(-1.0, -0.01), _wind(-1.0, 0.01))
    assert behind["near"], "the direction jumps by a full turn there"
    assert abs(behind["towards"]) < 0.03


TRUTH: dict[str, Any] = {
    "case": "c002", "family": "marin", "kind": "injected", "effects": ["heading_bias"], "control": "c001",
    "causes": [{"key": "heading_bias", "values": {"b": 0.06}, "times_typical": 2.0}],
}  # fmt: skip


def test_an_error_that_a_wrong_model_hides_still_shows_against_its_control() -> None:
    """Something outside the library has all the probability in both; among the named, the error comes first."""
    evidence = {"heading_bias": 850.0, "current": 450.0, "wind": 20.0}
    own = _said(
        "c002", [(["unknown"], 1.0 - 1e-9), (["current", "heading_bias"], 8e-10), (["current"], 2e-10)], evidence,
        heading_bias={"b": (0.062, 0.001)},
    )  # fmt: skip
    before = {"heading_bias": 1.0, "current": 150.0, "wind": 25.0}
    control = _said("c001", [(["unknown"], 1.0)], before, heading_bias={"b": (0.004, 0.001)})
    row = measures.of_injected(TRUTH, own, control)
    assert not row["named"]
    assert row["probability"] == pytest.approx(8e-10)
    assert row["share"] == pytest.approx(0.8)
    assert row["rank"] == 2
    assert row["rank_control"] is None
    assert row["rise"] == pytest.approx(849.0)
    assert row["rise_rank"] == 1
    assert row["recovered"] == pytest.approx(0.058 / 0.06)


def test_a_turned_log_is_looked_for_by_its_angle() -> None:
    truth = {**TRUTH, "effects": ["log_misalignment"],
             "causes": [{"key": "log_misalignment", "values": {"angle": 0.07}, "times_typical": 2.0}]}  # fmt: skip
    own = _said(
        "c002", [(["log_misalignment"], 0.9)], {"log_misalignment": 9.0}, log_misalignment={"angle": (0.06, 0.01)}
    )
    row = measures.of_injected(truth, own, None)
    assert row["named"]
    assert row["recovered"] == pytest.approx(0.06 / 0.07)
    said_unknown = measures.of_injected(truth, _said("c002", [(["unknown"], 1.0)], {}), None)
    assert not said_unknown["named"]
    assert said_unknown["recovered"] is None


def test_an_alarm_in_a_calm_basin() -> None:
    truth = {"case": "c003", "family": "hsva", "kind": "basin", "fitted_to": "marin"}
    assert measures.of_calm(truth, verdict("c003", [(["wind"], 0.7), ([], 0.3)]))["alarm"]
    row = measures.of_calm(truth, verdict("c003", [(["unknown"], 0.8), (["current"], 0.15), (["munk"], 0.05)]))
    assert not row["alarm"]
    assert row["share_environment"] == pytest.approx(0.75)


def _row(run: str, x: float, y: float, ratio: float) -> dict[str, Any]:
    wind, mine = _wind(1.0, 0.2), {**_wind(x, y), "dx": 0.1, "dy": 0.1}
    off = measures.difference(mine, wind)
    errors = {variant: {"u": 0.1, "psi": 0.2} for variant in ("ship alone", "wind estimated", "wind measured")}
    return {
        "run": run, "case": "c004", "day": "14-Sep", "measured": {**wind, "gusts": 0.3}, "of_others": mine,
        "off_others": off, "of_itself": mine, "off_itself": off, "of_day": None, "off_day": None, "errors": errors,
        "estimated": ratio, "with_measured": 0.9,
    }  # fmt: skip


def test_the_page_shows_failures_too(tmp_path: Path) -> None:
    runs = [_row("turn_1", 0.9, 0.1, 0.8), _row("turn_2", -0.5, 0.4, 1.3)]
    day = {"case": "c004", "family": "pond_14-Sep", "day": "14-Sep", "wind": {"day": _wind(1.0, 0.2)}}
    fitted = {"north": (0.9, 0.1), "east": (0.1, 0.1)}
    own = _said("c004", [(["wind"], 0.9), ([], 0.1)], {"wind": 12.0}, wind=fitted)
    put = measures.of_injected(TRUTH, _said("c002", [([], 1.0)], {"heading_bias": -1.0}), None)
    calm = measures.of_calm(
        {"case": "c003", "family": "hsva", "kind": "control", "fitted_to": ""}, verdict("c003", [(["wind"], 1.0)])
    )
    rows: dict[str, list[dict[str, Any]]] = {
        "wind": [{**measures.of_wind(day, own), "failed": ""}],
        "put": [{**put, "failed": "BadInput: it diverges"}],
        "calm": [{**calm, "failed": ""}],
    }
    found = measures.summary(rows["wind"], runs, rows["put"], rows["calm"])
    shares = {one.name: one.value for one in found}
    assert shares["wind named on a day with wind"] == 1.0
    assert shares["force fixed to the earth, wind among it, within 30 deg, on days with turns"] == 1.0
    assert shares["its speed is 0.7 to 1.4 of the measured, where it is called wind"] == 1.0
    assert shares["environment named in a basin, whatever was put in"] == 0.5
    assert shares["a run left out is met better with the wind of the others"] == 0.5
    assert shares["error put in is named"] == 0.0
    assert shares["environment blamed in a calm basin"] == 1.0
    content = {
        "programs": {"seatruth": [vars(one) for one in found]}, "rows": {"seatruth": rows}, "runs": runs, "seed": 1,
        "truths": {"c004": {"ship": "Esso Osaka"}}, "log": [],
    }  # fmt: skip
    write_page(tmp_path, content)
    page = (tmp_path / "score.html").read_text()
    for words in ("turn_2", "BadInput: it diverges", "ALARM", "Esso Osaka"):
        assert words in page


@pytest.mark.slow
@real
def test_score_of_the_quick_set_keeps_to_the_order_of_steps(quick: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"
    subprocess.run(["cp", "-r", str(quick), str(out)], check=True)
    with pytest.raises(BadInput, match="nothing was diagnosed"):
        score(out, DATA)
    diagnose(out, "prior", 1)
    assert main(["score", "--out", str(out)]) == 0
    content = json.loads((out / "score.json").read_text())
    assert [row["kind"] for row in content["rows"]["prior"]["calm"]] == ["control"]
    assert [row["error"] for row in content["rows"]["prior"]["put"]] == ["heading_bias"]
    assert (out / "score.html").exists()
    sealed = next((out / "sealed").glob("c*.json"))
    write(sealed, sealed.read_text() + "\n")
    note(out, "score", "again", {})
    with pytest.raises(BadInput, match="is broken"):
        score(out, DATA)


def test_an_estimated_wind_has_all_parameters_of_the_effect() -> None:
    """Its size begins beside nothing, its form where it is expected."""
    study = in_estimated_wind(seatruth.sample.load("study.toml"))
    wind = {p.name.removeprefix("wind_"): p for p in study.parameters if p.name.startswith("wind_")}
    assert set(wind) == {q.name for q in WIND.parameters}
    assert all(p.vary and p.prior is not None for p in wind.values())
    assert (wind["north"].value, wind["lever"].value, wind["yaw_slope"].value) == (0.1, 0.0, pytest.approx(0.18))
