"""What a preview of the trials says of parameters of which only a difference counts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior
from seatruth.study import Study
from seatruth.trials import Channel, Trial, Trials
from seatruth.uncertainty import prior_identifiability


class Inertias(Model):
    """Inertia and added inertia: only I_z - N_dr enters."""

    name = "inertias"
    states = outputs = (Channel("r", "rad/s"),)
    inputs = (Channel("delta", "rad"),)
    parameters = (
        Parameter("I_z", 1.6, "kg*m^2", 0.1, 9.0, vary=True, prior=Prior(1.6, 0.32)),
        Parameter("N_dr", -1.0, "kg*m^2", -9.0, -0.1, vary=True, prior=Prior(-1.0, 0.4)),
        Parameter("K", 0.5, "N*m", 0.1, 2.0, vary=True),
    )

    @staticmethod
    def rhs(s, i, p):  # type: ignore[no-untyped-def]  # as a user writes it
        return ((p.K * i.delta - s.r) / (p.I_z - p.N_dr),)


def test_what_cancels_is_said_though_priors_hold_it() -> None:
    """A stranger's ROV: both inertias were "identified", and nothing was said."""
    t = np.arange(0.0, 40.0, 0.2)
    delta = 0.3 * np.sign(np.sin(t / 4.0))
    run = Trial("steps", t, {"delta": delta}, {"r": 0.01 * np.sin(t)}, synthetic=True)
    study = Study("pair", Inertias(), Trials([run]), parameters=Inertias.parameters, noise={"r": 0.001})
    found = prior_identifiability(study, threads=1)
    assert "not identifiable" not in set(found["verdict"])
    assert found.attrs["fault"] == ""
    (said,) = found.attrs["reasons"]
    assert "only I_z - N_dr can be seen" in said
    assert "Priors alone hold them" in said


class AtRest(Inertias):
    """A moment by a power of the rate times the rudder angle: it has no slope amidships."""

    name = "at_rest"

    @staticmethod
    def rhs(s, i, p):  # type: ignore[no-untyped-def]  # as a user writes it
        return ((p.K * i.delta - abs(s.r * i.delta) ** 0.6) / (p.I_z - p.N_dr),)


def test_a_run_without_derivatives_is_told_in_place_of_what_it_moves() -> None:
    """Of a real glider, climbs began at rest, where atan2(w, u) has no slope: nothing was "identifiable"."""
    t = np.arange(0.0, 10.0, 0.5)
    delta = np.where(t > 3.0, 0.2, 0.0)
    run = Trial("climb", t, {"delta": delta}, {"r": 0.01 + 0.0 * t}, synthetic=True)
    study = Study("rest", AtRest(), Trials([run]), parameters=Inertias.parameters, noise={"r": 0.001})
    found = prior_identifiability(study, threads=1)
    assert found.attrs["fault"].startswith("From t = ")
    assert "the model's run of 'climb' has no derivatives" in found.attrs["fault"]
    assert found.attrs["reasons"] == []


class Runaway(Model):
    """A propeller that drives the vehicle the faster, the faster it is."""

    name = "runaway"
    states = outputs = (Channel("u", "m/s"),)
    inputs = (Channel("n", "rev/s"), Channel("delta", "rad"))
    parameters = (Parameter("k", 1.0, "1", 0.0, 2.0, vary=True),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.k * i.n * s.u * s.u,)


def test_of_a_model_that_diverges_the_inputs_are_told_as_they_are_read() -> None:
    t = np.arange(0.0, 20.0)
    run = Trial("run", t, {"n": 400.0 + t, "delta": 0.1 * np.sign(t - 9.5)}, {"u": 1.0 + 0.0 * t})
    with pytest.raises(BadInput) as raised:
        prior_identifiability(Study("fast", Runaway(), Trials([run])))
    assert "n goes from 400 to 419 rev/s and delta goes from -5.73 to 5.73 deg" in raised.value.message
