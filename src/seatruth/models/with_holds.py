"""A model some of whose inputs go from sample to sample in another way than the rest."""

from __future__ import annotations

from collections.abc import Mapping

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.wrapper import ModelWrapper
from seatruth.trials.channel import Hold


class WithHolds(ModelWrapper):
    """A model with its own rule between samples for some inputs: "foh" joins them by lines, "zoh" holds them.

    An order is held until the next one; what an actuator did, as measured revolutions, is not. One rule for both makes
    one of them late or early by half a sample.

    Args:
        base: the model.
        holds: the rule of each of these inputs.

    Raises:
        BadInput: the model has no such input, or it is a black box, which integrates by itself.

    Example:
        >>> from seatruth.models import load_model
        >>> from seatruth.models.with_holds import WithHolds
        >>> dict(WithHolds(load_model("mmg"), {"n": "foh"}).holds)
        {'n': 'foh'}
    """

    def __init__(self, base: Model, holds: Mapping[str, Hold]) -> None:
        if isinstance(base, BlackBox):
            what = f"model {base.name!r} integrates by itself: it joins or holds all its inputs alike"
            raise BadInput(what, do="Set `hold` in [cost], or move it by half a sample (step `shift_time`).")
        known = [channel.name for channel in base.inputs]
        for name in holds:
            if name not in known:
                raise BadInput(f"model {base.name!r} has no input {name!r}", do=nearest(name, known))
        super().__init__(base)
        self.holds = {**base.holds, **holds}
