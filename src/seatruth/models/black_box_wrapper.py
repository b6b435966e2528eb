"""Black boxes built around another black box: in processes of its own, observed, with effects, with missing forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from seatruth.models.black_box import BlackBox, Function
from seatruth.models.parameter import Parameter
from seatruth.models.wrapper import copy_attributes
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


class BlackBoxWrapper(BlackBox):
    """A black box around the black box `base`; it has every public attribute of that one.

    The constructor takes what the wrapper adds: `inputs` and `parameters` come after those of the wrapped black box,
    `outputs` take the place of its outputs. `function` is what runs instead of the wrapped one's; it calls `base.run`.
    A subclass sets the attributes that its `function` reads before it calls this constructor.

    Example:
        >>> from seatruth import BlackBox, Channel, Parameter, Trial
        >>> from seatruth.models.black_box_wrapper import BlackBoxWrapper
        >>> class Shifted(BlackBoxWrapper):
        ...     def __init__(self, base):
        ...         super().__init__(base, self.shifted, parameters=[Parameter("shift", 0.0, "m")])
        ...
        ...     def shifted(self, trial, p, first_state):
        ...         return {"y": self.base.run(trial, p, first_state)[:, 0] + p["shift"]}
        >>> def still(trial, p, first_state):
        ...     return {"y": 0.0 * trial.t}
        >>> box = Shifted(BlackBox("still", still, inputs=[], outputs=[Channel("y", "m")], parameters=[]))
        >>> box.run(Trial("run", [0.0, 1.0], {}, {}), {"shift": 2.0}, None)[:, 0].tolist()
        [2.0, 2.0]
    """

    base: BlackBox

    def __init__(
        self,
        base: BlackBox,
        function: Function,
        *,
        inputs: Sequence[Channel] = (),
        parameters: Sequence[Parameter] = (),
        outputs: Sequence[Channel] | None = None,
        title: str = "",
    ) -> None:
        self.base = base
        copy_attributes(base, self)
        self.hold = base.hold
        super().__init__(
            base.name,
            function,
            inputs=(*base.inputs, *inputs),
            outputs=base.outputs if outputs is None else outputs,
            parameters=(*base.parameters, *parameters),
            states=base.states,
            kind=base.kind,
            title=title or base.title,
            source=base.source,
            ports=base.ports,
        )

    def complete(self, outputs: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
        """See `Model.complete`; what the wrapped black box says."""
        return self.base.complete(outputs, inputs)

    def acting_inputs(self, trial: Trial, parameters: Mapping[str, float]) -> Trial:
        """See `BlackBox.acting_inputs`; what the wrapped black box says."""
        return self.base.acting_inputs(trial, parameters)
