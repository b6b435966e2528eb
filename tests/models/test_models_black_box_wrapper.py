"""Black boxes around a black box keep what it declares, add their own behind it, and run it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from seatruth.diagnosis.discrepancy.black_box import DiscrepancyBlackBox
from seatruth.effects import ExtendedBlackBox, available
from seatruth.models import (
    BlackBox,
    Channel,
    IsolatedBlackBox,
    Observation,
    Order,
    Parameter,
    ServoBlackBox,
    Thruster,
)
from seatruth.models.black_box_wrapper import BlackBoxWrapper
from seatruth.models.geometry import Dimensions
from seatruth.models.observed import ObservedBlackBox
from seatruth.models.wrapper import MODEL_ATTRIBUTES
from seatruth.trials import Trial

MOTION = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
TRIAL = Trial("run", np.arange(4.0), {"delta": np.full(4, 0.2), "force_u": np.zeros(4)}, {})


class Boat(BlackBox):
    """A black box that declares something for every attribute that a wrapper could forget."""

    standard = {"psi": ("psi", 1)}  # noqa: RUF012
    longest_step = 0.5

    def __init__(self, run: Callable[..., dict[str, Any]] | None = None) -> None:
        super().__init__(
            "boat",
            run or turning,
            inputs=[Channel("delta", "rad")],
            outputs=MOTION,
            states=MOTION,
            parameters=[Parameter("K", 0.5, "1/s")],
            kind="ship",
            title="a boat",
            source="here",
            ports={"force": ["X"]},
            dimensions=Dimensions(7.0, 2.0, 0.5, 5000.0, 1000.0),
        )

    def complete(self, outputs: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
        return {"u": 1.0, "v": 0.0, "r": 0.0, "psi": 0.0, **outputs}


def turning(trial: Trial, p: dict[str, float], first: dict[str, float], outside: Any) -> dict[str, Any]:
    rate = p["K"] * trial.inputs["delta"]
    return {"u": np.full(len(trial), first["u"]), "v": np.zeros(len(trial)), "r": rate, "psi": rate * trial.t}


def lacking(box: BlackBox) -> DiscrepancyBlackBox:
    scales = {channel.name: 1.0 for channel in (*box.outputs, *box.inputs)}
    return DiscrepancyBlackBox(box, 3, 10.0, scales, {"u": 5000.0})


WRAPPERS: dict[type[BlackBoxWrapper], Callable[[BlackBox], BlackBoxWrapper]] = {
    IsolatedBlackBox: IsolatedBlackBox,
    ExtendedBlackBox: lambda box: ExtendedBlackBox(box, [available()["rudder_offset"]]),
    DiscrepancyBlackBox: lacking,
    ServoBlackBox: lambda box: ServoBlackBox(box, {"delta": Order(delay=0.0)}),
    ObservedBlackBox: lambda box: ObservedBlackBox(box, [Observation("sog")]),
}


def test_every_wrapper_is_in_this_file() -> None:
    found = {kind for kind in BlackBoxWrapper.__subclasses__() if kind.__module__.startswith("seatruth")}
    assert found == set(WRAPPERS)


@pytest.mark.parametrize("kind", WRAPPERS)
def test_every_attribute_is_kept(kind: type[BlackBoxWrapper]) -> None:
    """What the wrapper adds stands behind what the wrapped one has; the rest is the same."""
    box = Boat()
    wrapper = WRAPPERS[kind](box)
    for name in set(MODEL_ATTRIBUTES) - {"title"}:
        theirs, ours = getattr(box, name), getattr(wrapper, name)
        if name in ("inputs", "outputs", "parameters", "servos"):
            assert ours[: len(theirs)] == theirs, name
        elif name in ("standard", "delays"):
            assert theirs.items() <= ours.items()
        else:
            assert ours == theirs, name
    assert wrapper.title.startswith("a boat")
    assert wrapper.ports == box.ports
    assert wrapper.innermost is box


@pytest.mark.parametrize("kind", WRAPPERS)
def test_it_runs_the_wrapped_one(kind: type[BlackBoxWrapper]) -> None:
    box, first = Boat(), {"u": 2.0, "v": 0.0, "r": 0.0, "psi": 0.0}
    wrapper = WRAPPERS[kind](box)
    found = wrapper.run(TRIAL, wrapper.nominal(), first)
    assert found[:, : len(MOTION)] == pytest.approx(box.run(TRIAL, box.nominal(), first))


@pytest.mark.parametrize("kind", [kind for kind in WRAPPERS if kind is not ObservedBlackBox])
def test_a_start_that_was_not_recorded_is_the_wrapped_one_s(kind: type[BlackBoxWrapper]) -> None:
    assert WRAPPERS[kind](Boat()).complete({"r": 0.1}, {})["u"] == 1.0


def test_terms_of_missing_forces_feel_the_input_that_acts() -> None:
    """A rudder that turns half as far does so in what the structure lacks too."""
    pushes = []

    def run(trial: Trial, p: dict[str, float], first: dict[str, float], outside: Any) -> dict[str, Any]:
        pushes.append(outside(0.0, {"u": 1.0, "v": 0.0, "r": 0.0, "psi": 0.0})["X"])
        return turning(trial, p, first, outside)

    wrapper = lacking(ExtendedBlackBox(Boat(run), [available()["rudder_gain"]]))
    term = next(one for one in wrapper.terms if one.text == "delta^2")
    for k in (1.0, 0.5):
        wrapper.run(
            TRIAL, {**wrapper.nominal(), term.name: 1e-3, "rudder_gain_k": k}, dict.fromkeys("uvr", 0.0) | {"psi": 0.0}
        )
    assert pushes == pytest.approx([5000.0 * 1e-3 * 0.2**2, 5000.0 * 1e-3 * 0.1**2])


def test_terms_of_thrusters_push_through_the_ports_what_they_push_in_equations() -> None:
    """The port of yaw: the inertia times the difference of two drives, in the motion that the simulator shows."""
    pushes = []

    def run(trial: Trial, p: dict[str, float], first: dict[str, float], outside: Any) -> dict[str, Any]:
        pushes.append(outside(0.0, {"u": 1.8, "r": 0.0})["N"])
        return dict.fromkeys(("u", "r", "T_port", "T_starboard"), np.zeros(len(trial)))

    twins = [
        Thruster(name, f"n_{name}", at=(-1.0, y, 0.0), towards=(1.0, 0.0, 0.0), full=20.0, force=f"T_{name}")
        for name, y in (("port", -0.4), ("starboard", 0.4))
    ]
    box = BlackBox(
        "twins",
        run,
        inputs=[Channel(one.input, "rev/s") for one in twins],
        outputs=[Channel("u", "m/s"), Channel("r", "rad/s"), *(Channel(f"T_{one.name}", "N") for one in twins)],
        states=(Channel("u", "m/s"), Channel("r", "rad/s")),
        parameters=[],
        ports={"force": ["X", "N"]},
        actuators=twins,
    )
    scales = {"u": 2.0, "r": 0.1, "n_port": 20.0, "n_starboard": 20.0}
    lacks = DiscrepancyBlackBox(box, 3, 10.0, scales, {"u": 5000.0, "r": 300.0})
    inputs = {
        "n_port": np.full(4, 10.0),
        "n_starboard": np.full(4, -5.0),
        "force_u": np.zeros(4),
        "force_r": np.zeros(4),
    }
    sizes = {
        "(n_port - n_starboard)": 0.75,
        "(n_port|n_port| - n_starboard|n_starboard|)": 0.5**2 + 0.25**2,
        "u^2 (n_port - n_starboard)": 0.9**2 * 0.75,
    }
    for text, size in sizes.items():
        term = next(one for one in lacks.terms if one.text == text and one.state == "r")
        lacks.run(Trial("run", np.arange(4.0), inputs, {}), {**lacks.nominal(), term.name: 1e-3}, {"u": 1.8, "r": 0.0})
        assert pushes.pop() == pytest.approx(300.0 * 1e-3 * size)
