"""A trial with pauses as several trials."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth import Trial
from seatruth.errors import BadInput
from seatruth.trials.split import split_at_gaps


def run(*lengths: int, pause: float = 20.0) -> Trial:
    """Stretches of so many samples a second each, with pauses between them."""
    t = np.concatenate([np.arange(n) + sum(lengths[:k]) + k * pause for k, n in enumerate(lengths)]).astype(float)
    return Trial("run", t, {"delta": np.sin(t)}, {"r": np.cos(t)}, lines=np.arange(2, 2 + t.size))


def test_each_part_has_the_samples_between_two_pauses() -> None:
    whole = run(30, 40, 25)
    parts = split_at_gaps(whole)
    assert [part.name for part in parts] == ["run_1", "run_2", "run_3"]
    for channel in ("delta", "r"):
        joined = np.concatenate([part.channel(channel) for part in parts])
        np.testing.assert_array_equal(joined, whole.channel(channel))
    assert [part.lines[0] for part in parts if part.lines is not None] == [2, 32, 72]
    assert parts[0].steps[-1].effect == "3 parts between pauses"


def test_a_trial_without_pauses_stays_as_it_is() -> None:
    whole = run(50)
    assert split_at_gaps(whole) == [whole]


def test_what_is_too_short_is_left_out_and_said() -> None:
    parts = split_at_gaps(run(30, 5, 40))
    assert [(part.name, len(part)) for part in parts] == [("run_1", 30), ("run_2", 40)]
    assert parts[0].steps[-1].effect == (
        "3 parts between pauses, 1 of them of fewer than 20 samples: left out (5 samples)"
    )
    with pytest.raises(BadInput, match="no part between its pauses has 20 samples"):
        split_at_gaps(run(10, 12, 15))
