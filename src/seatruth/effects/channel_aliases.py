"""How an effect sees the channels of a model: under standard names, whatever the model calls them.

An effect on the rudder writes `i.delta`; a model may call it `delta_order`, and a model in other axes may have `v_y`
for minus the standard `w`. A `View` shows a record of the model as the effect expects it, and takes a changed one back.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping, Sequence
from typing import Any

from seatruth.models.base import Model
from seatruth.trials.channel import Channel


class Names:
    """The name by which an effect knows each channel of a model, and its sign."""

    def __init__(self, aliases: Mapping[str, tuple[str, ...]], inputs: Sequence[str], model: Model) -> None:
        """`aliases` and `inputs` are the effect's `aliases` and `needs_inputs`."""
        self._standard = dict(model.standard)
        ordered = {self._first(channel.name) for channel in model.inputs}
        moving = {self._first(channel.name) for channel in (*model.states, *model.outputs)}
        self._renamed: dict[str, str] = {}
        self._chosen: dict[str, str] = {}
        for name, candidates in aliases.items():
            known = ordered if name in inputs else moving
            found = next((candidate for candidate in candidates if candidate in known), None)
            if found is None:
                self._renamed |= {name: f"other_{name}"}  # a stern plane effect must not take the rudder
                continue
            self._chosen |= dict.fromkeys((name, *candidates), found)
            if found != name:
                # The two change places: the other channel stays in the record under the name that is now free.
                self._renamed |= {found: name, name: found}

    def _first(self, name: str) -> str:
        return self._standard.get(name, (name, 1))[0]

    def seen(self, name: str) -> str:
        """The effect's name for a channel of the model."""
        first = self._first(name)
        return self._renamed.get(first, first)

    def own(self, name: str) -> str:
        """The model's name for a channel that the effect names, in its equations or among those it stands for."""
        first = self._chosen.get(name, name)
        return next((ours for ours, (standard, _) in self._standard.items() if standard == first), first)

    def sign(self, name: str) -> int:
        return self._standard.get(name, (name, 1))[1]


class View:
    """One record of a model (states, inputs or outputs) as an effect sees it, followed by the effect's own states."""

    def __init__(self, names: Names, channels: Sequence[Channel], own: Sequence[Channel] = ()) -> None:
        self.signs = tuple(names.sign(channel.name) for channel in channels)
        fields = [names.seen(channel.name) for channel in channels]
        self.kind = _record([*fields, *(channel.name for channel in own)])

    def of(self, values: Any, own: Any = ()) -> Any:
        """The record under the effect's names."""
        return self.kind(*(x if sign > 0 else -x for x, sign in zip(values, self.signs)), *own)

    def back(self, seen: Any, kind: Any) -> Any:
        """A changed record under the model's names."""
        return kind(*(x if sign > 0 else -x for x, sign in zip(seen, self.signs)))


def _record(fields: list[str]) -> Any:
    return namedtuple("Seen", fields)
