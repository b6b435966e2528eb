"""The referee's reading of a suggested trial: the same words, the same inputs by the clock, in code of its own."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from joblib import parallel_config

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld import score
from withheld.next_trial import manoeuvres, suggested
from withheld.reality.families import Family, families
from withheld.reality.manoeuvres import Trial
from withheld.reality.simulate import Record
from withheld.seal import digest_file, note
from withheld.studies import UNITS
from withheld.verdicts import verdict

from seatruth.diagnosis.experiment_design.candidates import Menu
from seatruth.models import Channel, Model
from seatruth.trials.trial import Trial as Log


def recorded(family: Family, neutral: float) -> list[Record]:
    """Two records of a family, the longer one with the larger angles."""
    found = []
    for seconds, full in ((40.0, 0.1), (60.0, 0.25)):
        t = np.arange(0.0, seconds + 0.1, 0.5)
        delta = neutral + full * np.sin(2.0 * np.pi * t / 20.0)
        trial = Trial("it", lambda: pytest.fail("nobody steers"), 0.3, seconds)
        found.append(Record(trial, t, delta, np.full(t.shape, family.revolutions), {}, {}, (0.0,) * 6))
    return found


def menu_of(family: Family, records: list[Record]) -> Menu:
    """The library's menu from the same records."""
    names = [family.input, *(["n"] if family.revolutions else [])]
    trials = []
    for k, record in enumerate(records):
        inputs = {family.input: record.delta, **({"n": record.n} if family.revolutions else {})}
        outputs = {name: np.full(record.t.shape, float(name == "u")) for name in family.outputs}
        trials.append(Log(f"t{k}", record.t, inputs, outputs, synthetic=True))
    channels = tuple(Channel(name, UNITS[name]) for name in names)
    shown = (Channel("u", "m/s"),)

    class Sheet(Model):
        name = "sheet"
        states = outputs = shown
        inputs = channels

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return (-s.u,)

    problem: Any = SimpleNamespace(trials=trials, study=SimpleNamespace(model=Sheet()), outputs=family.outputs)
    return Menu(problem)


@pytest.mark.parametrize("name", ["ship", "mariner", "auv", "torpedo"])
def test_the_same_words_are_the_same_inputs_by_the_clock(name: str) -> None:
    family = families()[name]
    neutral = -0.02 if family.trimmed else 0.0
    records = recorded(family, neutral)
    menu = menu_of(family, records)
    # How fast an input moves is the library's to say by the record, and reality's by its gear.
    menu.rates = dict.fromkeys(menu.rates, math.inf)
    usual = menu.usual[family.input]
    phases = list(menu.phases)
    read = set(manoeuvres(family, 60.0, 0.1))
    assert set(phases) <= read
    assert set(phases) == read or not family.revolutions
    starts = menu.starts()
    for k, first in enumerate(phases):
        option = menu.trial([first, phases[k - 1], "straight run"], starts[k % len(starts)])
        trial = suggested(family, records, option.name)
        assert trial is not None
        assert trial.seconds == pytest.approx(option.trial.duration, abs=0.6)
        if family.vehicle.earth_current:
            assert trial.heading - 0.3 == pytest.approx(option.trial.outputs["psi"][0])
        assert trial.speed == pytest.approx(option.trial.outputs["u"][0])
        orders = trial.manoeuvre()
        # A sample beside a reversal may fall to either side of it.
        off = 0
        for j, t in enumerate(option.trial.t):
            one = orders(float(t), {}, family.craft)
            same = abs(usual + one.delta - option.trial.inputs[family.input][j]) < 0.01
            if family.revolutions:
                same &= abs(one.n * family.revolutions - option.trial.inputs["n"][j]) < 1e-9
            off += not same
        assert off <= 5


@pytest.mark.parametrize("name", ["twin", "frame"])
def test_thrusters_of_one_side_slow_down_alone(name: str) -> None:
    family = families()[name]
    for side in ("port", "starboard", ""):
        group = [thruster for thruster in family.thrusters if thruster.endswith(side)]
        words = " and ".join(group)
        trial = suggested(family, recorded(family, 0.0), f"coast-down ({words} to zero)")
        assert trial is not None
        late = trial.manoeuvre()(trial.seconds, {}, family.craft)
        every = family.recorded(np.array([late.delta]), np.array([late.n * family.revolutions]))
        for thruster, revolutions in every.items():
            assert revolutions[0] == pytest.approx(0.0 if thruster in group else family.revolutions, abs=1e-9)


def test_words_of_no_menu_are_no_trial() -> None:
    family = families()["ship"]
    for words in ("a dance", "turn by +delta, then a dance", "beam course: ", "straight run,then straight run"):
        assert suggested(family, recorded(family, 0.0), words) is None


def test_scores_do_not_depend_on_the_number_of_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    truths = {}
    for name in ("c001", "c002", "c003"):
        truths[name] = {
            "case": name, "family": "auv", "kind": "single", "effects": ["trim"], "lambda": {"trim": 150.0},
            "stratum": "100-400", "set": ["trim"], "places": ["pitch"], "oracle": None, "pairs": {"trim": {"a": 2.0}},
        }  # fmt: skip
    found = {}
    for workers in (1, 2):
        out = tmp_path / str(workers)
        place = out / "verdicts" / "seatruth"
        place.mkdir(parents=True)
        hashes = {}
        for name in truths:
            said = verdict(name, [(["trim"], 0.6), (["a"], 0.4)], next_trial={"manoeuvre": f"zigzag {name}"})
            (place / f"{name}.json").write_text(json.dumps(said))
            hashes[name] = digest_file(place / f"{name}.json")
        (place / "manifest.json").write_text(json.dumps({"verdicts": hashes}))
        note(out, "diagnose", "end", {"manifest": digest_file(place / "manifest.json")})
        monkeypatch.setattr(score, "pairs_after", told)
        with parallel_config(backend="threading"):
            found[workers] = score.pairs_of(out, "seatruth", truths, referee=True, workers=workers)
        assert sorted(file.stem for file in (place / "next").glob("*.json")) == sorted(truths)
    assert found[1] == found[2]


def told(truth: Any, public: Path, words: str, rivals: Any) -> dict[str, float]:
    """What the referee would say."""
    return {"a": float(len(words)) + float(str(truth["case"])[1:])}
