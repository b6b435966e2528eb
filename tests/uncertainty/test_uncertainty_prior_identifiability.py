"""What a preview of the trials says of parameters of which only a difference counts."""

from __future__ import annotations

import numpy as np

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
    (said,) = found.attrs["reasons"]
    assert "only I_z - N_dr can be seen" in said
    assert "Priors alone hold them" in said
