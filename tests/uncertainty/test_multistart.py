"""Searches from many starts: the same whatever runs them, resumed where they stopped, started as the study says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from astray_boat import study

from seatruth import Estimate, identify
from seatruth.errors import BadInput
from seatruth.optimizers import minimise

WRONG = {"K": -1.0, "U": -3.0}


def found(**arguments: Any) -> Estimate:
    return identify(study(values=WRONG), threads=1, **{"starts": 4, "seed": 1, **arguments})


def test_three_starts_and_more_give_the_best_end_and_say_where_all_ended() -> None:
    estimate = found(starts=8)
    assert estimate.values == pytest.approx({"K": 0.489, "T": 3.0, "U": 1.489}, rel=0.01)
    assert estimate.starts is not None
    assert list(estimate.starts["start"]) == list(range(1, 9))
    assert estimate.starts["optimum"].iloc[0] > 1
    assert set(estimate.parameters["verdict"]) == {"identified"}
    assert "the best of 8" in estimate.outcome["reason"]
    assert estimate.provenance["settings"]["starts"]["value"] == 8


def test_workers_do_not_change_the_result(tmp_path: Path) -> None:
    one, two = found(), found(workers=2)
    assert one.starts is not None
    pd.testing.assert_frame_equal(one.starts, two.starts, check_exact=True)
    pd.testing.assert_frame_equal(one.parameters, two.parameters, check_exact=True)
    loaded = Estimate.load(one.save(tmp_path / "result"))
    pd.testing.assert_frame_equal(one.starts, loaded.starts, check_exact=True)
    plain = identify(study(), threads=1)
    assert Estimate.load(plain.save(tmp_path / "result")).starts is None
    assert not (tmp_path / "result" / "starts.parquet").exists()


def test_an_interrupted_multistart_goes_on_to_the_same_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = found()
    calls: list[int] = []

    def stopping(*args: Any, **kwargs: Any) -> Any:
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return minimise(*args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr("seatruth.uncertainty.multistart.minimise", stopping)
        cut = found(checkpoint=tmp_path / "run")
    assert cut.outcome["code"] == "interrupted"
    assert cut.starts is not None
    assert len(cut.starts) == 2
    again = found(checkpoint=tmp_path / "run")
    assert again.starts is not None
    pd.testing.assert_frame_equal(whole.starts, again.starts, check_exact=True)
    assert again.outcome["code"] == "converged"
    calls.clear()
    with monkeypatch.context() as patch:
        patch.setattr("seatruth.uncertainty.multistart.minimise", stopping)
        more = found(checkpoint=tmp_path / "run", starts=5)
    assert len(calls) == 1  # the four that were done serve a run with five
    pd.testing.assert_frame_equal(more.starts.iloc[:4, :2], whole.starts.iloc[:, :2], check_exact=True)


@pytest.mark.parametrize("starts", [0, 10_001, True, 2.0])
def test_a_number_of_starts_that_is_none_is_refused(starts: Any) -> None:
    with pytest.raises(BadInput, match="starts are not possible"):
        found(starts=starts)
    with pytest.raises(BadInput, match="starts are not possible"):
        study(starts=starts)
