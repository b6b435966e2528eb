"""What an estimate survives: saving, reloading, damage, interrupts, a model that raises."""

from __future__ import annotations

import errno
import hashlib
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from known_glide import sailed, same, study

import seatruth.analysis
from seatruth.errors import BadInput, PluginError, SeatruthWarning
from seatruth.estimate import FORMAT, NAME, Estimate
from seatruth.identification import identify
from seatruth.optimizers import Budget
from seatruth.storage.atomic import DiskFull
from seatruth.storage.sealed import sealed, unsealed
from seatruth.trials.trial import Step, Trials


def stopping(after: int) -> Callable[..., Any]:
    """`values` of the cost, with Ctrl-C pressed in its n-th call."""
    from seatruth.costs.trajectory import TrajectoryCost

    plain, calls = TrajectoryCost.values, [0]

    def values(self: Any, X: Any) -> Any:
        calls[0] += 1
        if calls[0] == after:
            raise KeyboardInterrupt
        return plain(self, X)

    return values


def test_an_interrupted_search_goes_on_to_the_same_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from seatruth.costs.trajectory import TrajectoryCost

    plan: dict[str, Any] = {"budget": Budget(evaluations=1_000), "seed": 2, "threads": 1}
    whole = identify(study(), "differential_swarm", **plan)
    with monkeypatch.context() as patch:
        patch.setattr(TrajectoryCost, "values", stopping(6))
        cut = identify(study(), "differential_swarm", checkpoint=tmp_path / "run", **plan)
    assert cut.outcome["code"] == "interrupted"
    assert cut.outcome["evaluations"] < whole.outcome["evaluations"]
    assert np.isfinite(cut.parameters["value"]).all()
    again = identify(study(), "differential_swarm", checkpoint=tmp_path / "run", **plan)
    same(whole, again)


def test_an_interrupt_after_the_search_keeps_the_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = identify(study(), threads=1, cross_validate=True)
    with monkeypatch.context() as patch:
        patch.setattr(seatruth.analysis, "sensitivity", _interrupt)
        cut = identify(study(), threads=1, checkpoint=tmp_path / "run")
    assert cut.outcome["code"] == "interrupted"
    assert cut.values == whole.values
    assert np.isfinite(cut.parameters["stderr"]).all()
    assert len(cut.sensitivity) == 0
    cut.save(tmp_path / "cut")
    assert Estimate.load(tmp_path / "cut").values == whole.values
    with monkeypatch.context() as patch:
        patch.setattr("seatruth.identification.leave_one_out", _interrupt)
        cut = identify(study(), threads=1, checkpoint=tmp_path / "run", cross_validate=True)
    assert cut.outcome["code"] == "interrupted"
    assert cut.cross_validation is None
    again = identify(study(), threads=1, checkpoint=tmp_path / "run", cross_validate=True)
    same(whole, again)


@pytest.mark.parametrize("stage", ["profile", "trials left out"])
def test_an_interrupt_within_a_fit_after_the_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: str
) -> None:
    """Ctrl-C reaches the driver of one of the many small fits: that fit is no finished piece, the others are."""
    from seatruth.costs.trajectory import TrajectoryCost

    plan: dict[str, Any] = {"threads": 1, "workers": 1}
    plan |= {"profile": ["b"]} if stage == "profile" else {"cross_validate": True}
    alone = study(holdout=Trials([]))
    whole = identify(alone, **plan)
    plain, costs = TrajectoryCost.residuals, list[Any]()

    def residuals(self: Any, x: Any) -> Any:
        if not any(self is cost for cost in costs):
            costs.append(self)
        # The search's, those of its input held and joined by lines, the first fit's (with trials left out also that of
        # the prediction's start), then the second's.
        if len(costs) == (5 if stage == "profile" else 6):
            raise KeyboardInterrupt
        return plain(self, x)

    with monkeypatch.context() as patch:
        patch.setattr(TrajectoryCost, "residuals", residuals)
        cut = identify(alone, checkpoint=tmp_path / "run", **plan)
    assert cut.outcome["code"] == "interrupted"
    assert cut.values == whole.values
    assert cut.profile is None
    assert cut.cross_validation is None
    assert len((tmp_path / "run.jobs").read_text().splitlines()) == 2  # whose they are, and the one that was done
    again = identify(alone, checkpoint=tmp_path / "run", **plan)
    same(whole, again)
    if stage == "profile":
        assert whole.profile is not None
        assert again.profile is not None
        pd.testing.assert_frame_equal(whole.profile["b"], again.profile["b"], check_exact=True)
    else:
        pd.testing.assert_frame_equal(whole.cross_validation, again.cross_validation, check_exact=True)


@pytest.mark.parametrize("damage", ["a digit", "another program's file"])
def test_a_damaged_file_of_finished_jobs_changes_no_result(tmp_path: Path, damage: str) -> None:
    plan: dict[str, Any] = {"threads": 1, "profile": ["b"], "checkpoint": tmp_path / "run"}
    whole = identify(study(), **plan)
    jobs = tmp_path / "run.jobs"
    head, first, *rest = jobs.read_text().splitlines(keepends=True)
    if damage == "a digit":
        digit = first.rindex("}") - 1
        changed = first[:digit] + str((int(first[digit]) + 1) % 10) + first[digit + 1 :]
        jobs.write_text("".join([head, changed, *rest]))
        with pytest.warns(SeatruthWarning, match="1 record is damaged"):
            again = identify(study(), **plan)
    else:
        jobs.write_text("my notes\n")
        again = identify(study(), **plan)
        assert jobs.read_text() == "my notes\n"
        assert any("not a seatruth checkpoint" in finding.message for finding in again.findings)
    assert whole.profile is not None
    assert again.profile is not None
    pd.testing.assert_frame_equal(whole.profile["b"], again.profile["b"], check_exact=True)


def _interrupt(*_: Any, **__: Any) -> Any:
    raise KeyboardInterrupt


def test_a_result_that_cannot_be_written_leaves_the_one_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = identify(study(), threads=1, profile=["b"], cross_validate=True)
    folder = first.save(tmp_path / "result")
    stood = sorted(path.name for path in folder.iterdir())
    second = identify(study(seed=2), threads=1)
    plain, calls = os.fsync, [0]

    def full(handle: int) -> None:
        calls[0] += 1
        if calls[0] == 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        plain(handle)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(DiskFull, match="no space left") as problem:
            second.save(folder)
    assert str(folder) in problem.value.where
    assert sorted(path.name for path in folder.iterdir()) == stood
    assert Estimate.load(folder).values == first.values
    second.save(folder)
    assert Estimate.load(folder).values == second.values
    # Nothing of the first one is left to be taken for the second's.
    assert {"cross_validation.parquet", "profile_0.parquet"} & {path.name for path in folder.iterdir()} == set()


def test_a_damaged_result_is_said(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="there is no estimate"):
        Estimate.load(tmp_path)
    folder = identify(study(), threads=1).save(tmp_path / "result")
    table = folder / "parameters.parquet"
    whole = table.read_bytes()
    table.write_bytes(whole[:-20])
    with pytest.raises(BadInput, match="damaged"):
        Estimate.load(folder)
    table.write_bytes(whole)
    text = (folder / NAME).read_text()
    content = unsealed(text, FORMAT)
    changes: dict[str, Any] = {"seed": "one", "channels": 7, "findings": [{"code": "x"}], "steps": [7], "profile": [1]}
    for broken, words in (
        *((text[:100], "cannot be read"), ("[" * 10**5, "cannot be read"), ("[]", "no estimate")),
        ('{"format": 1}', "no estimate"),
        (text.replace('"seed": ', '"seed": 1', 1), "something has changed it"),
        (sealed({}, FORMAT), "damaged"),
        *((sealed({**content, name: value}, FORMAT), "damaged") for name, value in changes.items()),
    ):
        (folder / NAME).write_text(broken)
        with pytest.raises(BadInput, match=words):
            Estimate.load(folder)
    (folder / NAME).write_text(text)
    assert Estimate.load(folder).seed == content["seed"]
    other = pd.read_parquet(table).rename(columns={"value": "worth"})
    other.to_parquet(table)
    content["tables"]["parameters"]["sha256"] = hashlib.sha256(table.read_bytes()).hexdigest()
    (folder / NAME).write_text(sealed(content, FORMAT))
    with pytest.raises(BadInput, match="no numbers in value"):
        Estimate.load(folder)


def test_saved_and_reloaded_exactly(tmp_path: Path) -> None:
    trials = [trial.with_step(Step("cut", {"start": 1.0, "list": (1, 2)}, "cut")) for trial in sailed(1)]
    found = identify(study().replace(trials=Trials(trials)), threads=1, profile=["b"], cross_validate=True)
    found.parameters.loc["a", "stderr"] = math.inf
    again = Estimate.load(found.save(tmp_path / "result"))
    for name in ("parameters", "nuisances", "covariance", "correlation", "sensitivity", "fit", "history", "traces"):
        pd.testing.assert_frame_equal(getattr(found, name), getattr(again, name), check_exact=True)
    pd.testing.assert_frame_equal(found.cross_validation, again.cross_validation, check_exact=True)
    assert found.profile is not None
    assert again.profile is not None
    pd.testing.assert_frame_equal(found.profile["b"], again.profile["b"], check_exact=True)
    for name in ("study", "model", "optimizer", "cost", "seed", "synthetic", "channels", "identifiability", "outcome"):
        assert getattr(found, name) == getattr(again, name), name
    for name in ("discretisation", "steps", "findings", "provenance"):
        assert getattr(found, name) == getattr(again, name), name
    assert str(found) == str(again)
    assert found._repr_html_() == again._repr_html_()
    assert "SYNTHETIC" in str(found)


def test_a_model_that_raises_after_the_search_costs_only_that_part(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any, **__: Any) -> Any:
        raise PluginError("its function raised ValueError: no such water")

    monkeypatch.setattr(seatruth.analysis, "sensitivity", broken)
    for name in ("leave_one_out", "profiles"):
        monkeypatch.setattr(f"seatruth.identification.{name}", broken)
    found = identify(study(), threads=1, profile=["a"], cross_validate=True)
    assert found.outcome["code"] == "converged"
    assert np.isfinite(found.parameters["stderr"]).all()
    assert found.discretisation
    assert (found.profile, found.cross_validation) == (None, None)
    said = [finding.message for finding in found.findings if finding.code == "part-missing"]
    assert len(said) == 3
    assert all("no such water" in sentence for sentence in said)
