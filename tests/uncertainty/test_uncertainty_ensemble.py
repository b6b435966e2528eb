"""Bands: what the parameters leave open, from draws of a posterior or from the ends of a multi-start."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from known_glide import TRUE, Glide, sailed, study

from seatruth import identify
from seatruth.costs.registry import cost_of
from seatruth.progress import silent
from seatruth.trials.trial import Trials
from seatruth.uncertainty.ensemble import near_optimal, with_bands


def test_bands_are_the_quantiles_of_the_members() -> None:
    """In batches, with a member that diverges, as NumPy computes them of all at once."""
    made = study()
    cost = cost_of(made, threads=1)
    rng = np.random.default_rng(2)
    members = np.tile([0.5, 2.0, 0.0, 0.0, 0.0, 0.0], (50, 1)) + 0.02 * rng.normal(size=(50, 6))
    members[7, 0] = np.nan
    traces = identify(made, threads=1).traces
    found, ensemble = with_bands(traces, cost, members, "posterior", list(made.holdout), progress=silent)
    assert (ensemble.source, ensemble.members, ensemble.diverged) == ("posterior", 50, 1)
    good = np.delete(members, 7, axis=0)
    for number, name in enumerate(("run 0", "run 1", "run 2")):
        runs = [
            cost.predict(member)[number] if number < 2 else cost.predict(member, list(made.holdout))[0]
            for member in good
        ]
        wanted = np.quantile(runs, [0.025, 0.975], axis=0)
        for column, channel in enumerate(("v", "s")):
            rows = found[(found["trial"] == name) & (found["channel"] == channel)]
            np.testing.assert_allclose(rows["band_lower"], wanted[0][:, column], rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(rows["band_upper"], wanted[1][:, column], rtol=1e-12, atol=1e-12)
    pd.testing.assert_frame_equal(found[list(traces)], traces, check_exact=True)


def test_ends_of_starts_that_cannot_be_told_from_the_best_make_a_band() -> None:
    starts = pd.DataFrame(
        {"cost": [12.0, 10.0, 11.5, np.inf, 10.5], "optimum": [2, 1, 1, 0, 1], "end a": [9.0, 1.0, 3.0, 4.0, 2.0]}
    )
    assert near_optimal(starts, ["a"], 1.0)[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert near_optimal(starts, ["a"], 2.0)[:, 0].tolist() == [1.0, 2.0, 3.0, 9.0]
    found = identify(study(), starts=4, threads=1)
    assert found.ensemble is not None
    assert found.ensemble.source == "starts"
    assert (found.traces["band_lower"] <= found.traces["band_upper"]).all()


def test_one_start_has_no_band() -> None:
    found = identify(study(), threads=1)
    assert found.ensemble is None
    assert "band_lower" not in found.traces


@pytest.mark.slow
def test_bands_hold_the_true_motion_as_often_as_they_say() -> None:
    """20 studies with noise of their own: the noiseless motion lies within at 95 % of the samples on average."""
    pytest.importorskip("emcee")
    from seatruth.simulate import simulator

    trials = sailed(0)[:2]
    values = {**Glide().nominal(), **TRUE}
    true = simulator(Glide(), trials, values=values).outputs(np.zeros((1, 0)), np.zeros((2, 2))).y[0]
    parts = []
    for seed in range(20):
        made = study(100 + seed, holdout=Trials([]))
        found = identify(made, threads=1, posterior=True, posterior_steps=800, seed=seed)
        rows = found.traces
        for number, name in enumerate(("run 0", "run 1")):
            for column, channel in enumerate(("v", "s")):
                band = rows[(rows["trial"] == name) & (rows["channel"] == channel)]
                motion = true[150 * number : 150 * (number + 1), column]
                parts.append(np.mean((band["band_lower"] <= motion) & (motion <= band["band_upper"])))
    # Samples of a trial hang together: 20 studies with about 5 free directions each are some 100 independent checks.
    assert np.mean(parts) == pytest.approx(0.95, abs=3.0 * np.sqrt(0.95 * 0.05 / 60))
