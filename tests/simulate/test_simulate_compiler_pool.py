"""The pool of threads: many callers at once, and a forked child."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from known_models import Lag, record_of

from seatruth.simulate import simulator


def test_many_callers_at_once() -> None:
    """As under a joblib thread backend: every caller gets its own numbers."""
    trial = record_of(np.arange(200) * 0.05, np.ones_like, x=np.zeros(200))

    def costs(seed: int) -> bytes:
        sim = simulator(Lag(), [trial], free=("k", "T"), threads=4)
        theta = np.random.default_rng(seed).uniform(1.0, 2.0, (100, 2))
        return sim.squared_errors(theta, sim.initial_states, np.ones((200, 2))).sums.tobytes()

    expected = [costs(seed) for seed in range(8)]
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(costs, range(8))) == expected


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_in_a_forked_child() -> None:
    trial = record_of(np.arange(200) * 0.05, np.ones_like, x=np.zeros(200))
    sim = simulator(Lag(), [trial], free=("k",), threads=4)
    theta = np.linspace(1.0, 2.0, 100)[:, None]
    before = sim.squared_errors(theta, sim.initial_states, np.ones((200, 2))).sums
    child = os.fork()
    if child == 0:
        again = sim.squared_errors(theta, sim.initial_states, np.ones((200, 2))).sums
        os._exit(0 if np.array_equal(before, again) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
