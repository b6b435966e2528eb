"""The names under which an effect sees the channels of a model.

An effect on the rudder writes `i.delta`; a model may call it `helm`, and a model in other axes may have `v_y`
for minus the standard `w`. A `View` shows a record of the model under the effect's names, and takes a changed one back.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from seatruth.models.base import Model
from seatruth.trials.channel import Channel


class ChannelAliases:
    """The effect's name and the sign of every channel of a model."""

    def __init__(
        self, aliases: Mapping[str, tuple[str, ...]], inputs: Sequence[str], model: Model, outputs: Sequence[str] = ()
    ) -> None:
        """`aliases`, `inputs` and `outputs` are the effect's `aliases`, `needs_inputs` and `needs_outputs`."""
        self._model = model
        input_names = {self._standard_name(channel.name) for channel in model.inputs}
        output_names = {self._standard_name(channel.name) for channel in model.outputs}
        other_names = output_names | {self._standard_name(channel.name) for channel in model.states}
        self._renamed: dict[str, str] = {}
        self._chosen: dict[str, str] = {}
        for name, candidates in aliases.items():
            available = input_names if name in inputs else output_names if name in outputs else other_names
            chosen = next((candidate for candidate in candidates if candidate in available), None)
            if chosen is None:
                self._renamed |= {name: f"other_{name}"}  # an effect on the stern plane must not take the rudder
                continue
            self._chosen |= dict.fromkeys((name, *candidates), chosen)
            if chosen != name:
                # The two change places: the other channel stays in the record under the name that is now free.
                self._renamed |= {chosen: name, name: chosen}

    def _standard_name(self, name: str) -> str:
        return self._model.standard_of(name)[0]

    def in_effect(self, name: str) -> str:
        """The effect's name for a channel of the model."""
        standard = self._standard_name(name)
        return self._renamed.get(standard, standard)

    def in_model(self, name: str) -> str:
        """The model's name for a channel that the effect names."""
        chosen = self._chosen.get(name, name)
        return next((channel for channel, (standard, _) in self._model.standard.items() if standard == chosen), chosen)

    def sign(self, name: str) -> int:
        """+1 or -1: the standard channel is this times the model's channel `name`."""
        return self._model.standard_of(name)[1]


class View:
    """One record of a model (states, inputs or outputs) as an effect sees it, followed by the effect's own states."""

    def __init__(
        self,
        aliases: ChannelAliases,
        channels: Sequence[Channel],
        own: Sequence[Channel] = (),
        units: Mapping[str, float] = MappingProxyType({}),
        rests: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        """`units` and `rests`: sizes by which the effect measures channels, and from where, by names in the model."""
        self.scales = tuple(aliases.sign(channel.name) * units.get(channel.name, 1.0) for channel in channels)
        self.rests = tuple(rests.get(channel.name, 0.0) for channel in channels)
        fields = [aliases.in_effect(channel.name) for channel in channels]
        self.kind = _record([*fields, *(channel.name for channel in own)])

    def of(self, values: Any, own: Any = ()) -> Any:
        """The record under the effect's names."""
        seen = (_times(_plus(x, -rest), 1.0 / scale) for x, scale, rest in zip(values, self.scales, self.rests))
        return self.kind(*seen, *own)

    def back(self, seen: Any, kind: Any) -> Any:
        """A changed record under the model's names, as a named tuple `kind`."""
        return kind(*(_plus(_times(x, scale), rest) for x, scale, rest in zip(seen, self.scales, self.rests)))


def at_start(aliases: ChannelAliases, model: Model) -> tuple[View, tuple[int, ...]]:
    """What an effect sees of a trial's start: the outputs, then the states that no output shows; their places."""
    shown = {aliases.in_effect(channel.name) for channel in model.outputs}
    hidden = [(k, one) for k, one in enumerate(model.states) if aliases.in_effect(one.name) not in shown]
    return View(aliases, (*model.outputs, *(one for _, one in hidden))), tuple(k for k, _ in hidden)


def _times(x: Any, scale: float) -> Any:
    return x if scale == 1.0 else -x if scale == -1.0 else x * scale


def _plus(x: Any, rest: float) -> Any:
    return x if rest == 0.0 else x + rest


def _record(fields: list[str]) -> Any:
    return namedtuple("Seen", fields)
