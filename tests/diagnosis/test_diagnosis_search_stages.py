"""What stays of a search where one of its stages fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_case as small
from searched_by_hand import searched

from seatruth.diagnosis import search as search_module
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.search import _fit_each_trial, _refit_parts, search
from seatruth.trials.trial import Trial


@pytest.mark.parametrize(
    ("name", "what"),
    [
        pytest.param("waves_beside", "waves", marks=pytest.mark.slow),
        ("additions", "effects beside rudder_offset"),
        pytest.param("_refit_parts", "parts of the leading sets", marks=pytest.mark.slow),
        ("nest", "sets within others"),
    ],
)
def test_where_the_algebra_of_a_stage_fails_the_fits_stay(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch, name: str, what: str
) -> None:
    """Of a boat in wind four minutes were lost to one matrix: the model alone was said not to be fitted."""

    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr(search_module, name, fails)
    got = search(small.problem(ship_folder, offset_runs, ["rudder_offset", "gyro_bias"]), small.silent)
    assert got.leader.effects == ("rudder_offset",)
    assert got.failed[what,] == "Matrix is not positive definite"


def test_values_for_each_trial_do_not_stand_twice_in_a_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """A boat's diagnosis was lost where a current and one of its own in each trial led together."""
    fitted: list[Key] = []
    monkeypatch.setattr(search_module, "fit_once", lambda found, key, *_: fitted.append(key))
    monkeypatch.setattr(search_module, "in_each_trial", lambda problem, point, *_: point)
    _fit_each_trial(searched({(): 0.0, ("current", "trial_current"): 90.0, ("current", "rudder_offset"): 80.0}))
    assert fitted == [("rudder_offset", "trial_current")]


@pytest.mark.parametrize(("behind", "again"), [(-50.0, True), (50.0, False)])
def test_a_part_that_is_worse_than_the_model_alone_is_fitted_again_however_far_behind(
    monkeypatch: pytest.MonkeyPatch, behind: float, again: bool
) -> None:
    """It contains the model alone. A wind stood 18 nats behind that, and 111 behind the wind beside a slow nozzle."""
    fitted: list[Key] = []
    monkeypatch.setattr(search_module, "fit_once", lambda found, key, *_, **__: fitted.append(key))
    monkeypatch.setattr(search_module, "forces_instead", lambda problem, point, *_: point)
    monkeypatch.setattr(search_module, "_with_forces", lambda *_: (True,))
    monkeypatch.setattr(search_module, "strays", lambda *_: False)
    monkeypatch.setattr(search_module, "_elsewhere", lambda *_: False)
    evidence: dict[Key, float] = {(): 0.0, ("current",): behind, ("current", "rudder_offset"): 500.0}
    found = searched(evidence)
    for fit in found.fits.values():
        vars(fit)["promised"] = fit.evidence
    _refit_parts(found)
    assert (("current",) in fitted) == again
