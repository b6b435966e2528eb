"""Decisions, and what they are judged by, on probabilities and errors made by hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from decided_by_hand import EFFECTS, decided, hypotheses

from seatruth.diagnosis import judgement
from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.judgement import Judgement
from seatruth.diagnosis.parts import Validation
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.verdict import Hypothesis


def _deciding(
    monkeypatch: pytest.MonkeyPatch,
    said: Decision,
    judged: Callable[[Decision], Decision],
    away: Callable[[str], float] = lambda name: 0.0,
    found: Sequence[Hypothesis] = (),
) -> Decision:
    """The decision of a judgement that begins with `said`, where trials left out leave what `judged` says."""
    one: Any = object.__new__(Judgement)
    fit = SimpleNamespace(prior_deviations=lambda problem, name: away(name))
    one.problem = SimpleNamespace(effects=EFFECTS, trials=(), settings=Settings())
    one.search = SimpleNamespace(null=SimpleNamespace(settled=True), best=lambda key: fit, beside=lambda key, form: fit)
    one.settings, one.weighed, one._leaves_a_gap = Settings(), list(found), True
    one.information = SimpleNamespace(noncentrality_between=None, undetectable=lambda: [])
    monkeypatch.setattr(judgement, "decide", lambda *args, **options: said)
    monkeypatch.setattr(judgement, "narrow_headings", lambda trials: None)
    sizes = SimpleNamespace(
        strays=False, share=lambda name: 1.0, typical_sizes=lambda name: 1.0, steps_late=lambda name: 9.0
    )
    monkeypatch.setattr(Judgement, "gap_of", lambda self, key: sizes)
    monkeypatch.setattr(Judgement, "_judged", lambda self, decision: judged(decision))
    monkeypatch.setattr(Judgement, "_helps", lambda self, name, key: True)
    return cast(Decision, one.decision)


def test_a_cause_stands_by_the_effect_that_predicts_trials_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    cluster = Cluster(("wind", "wave_drift"), "environment.force_fixed_to_earth", 0.9, ("wind", "wave_drift"))
    said = Decision("inseparable", (cluster,), 0.9, True, ("wind",))
    unknown = replace(said, kind="unknown", clusters=(), shown=())

    def judged(decision: Decision) -> Decision:
        return decision if decision.shown == ("wave_drift",) else unknown

    assert _deciding(monkeypatch, said, judged).shown == ("wave_drift",)
    assert _deciding(monkeypatch, said, lambda decision: unknown) == unknown


def test_what_is_left_beside_a_size_that_nobody_believes_is_judged_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a fouled glider: without a weight that leaned on it, a depth sensor 20 % off closed 4 % of the gap."""
    sensor, weight = (Cluster((name,), EFFECTS[name].cause, 0.9, (name,)) for name in ("depth_scale", "net_weight"))
    said = Decision("effects", (sensor, weight), 0.9, True, ("depth_scale", "net_weight"))
    found = hypotheses((("depth_scale", "net_weight"), 0.9, True), ((), 0.1, True))
    unknown = replace(said, kind="unknown", clusters=(), shown=())

    def judged(decision: Decision) -> Decision:
        return decision if len(decision.clusters) > 1 else unknown

    def decided(away: float) -> Decision:
        return _deciding(monkeypatch, said, judged, lambda name: away if name == "depth_scale" else 0.0, found)

    assert decided(2.0) == said
    assert decided(8.0) == unknown


PLAY, OFFSET, FORM = "rudder_backlash", "rudder_offset", "cross_flow"


def _closing(
    found: Sequence[tuple[Key, float, bool]], closes: dict[Key, tuple[float, float]], *, strays: bool = True
) -> tuple[Decision, Decision]:
    """What hypotheses lead to, and what is left of it where sets close these parts of the gap, with lower ends."""

    def validated(key: Key) -> Validation:
        explained, lower = closes.get(key, (0.0, -0.1))
        return Validation((), explained, lower, 1.0, -0.5)

    one: Any = object.__new__(Judgement)
    one.problem, one.weighed = SimpleNamespace(effects=EFFECTS), hypotheses(*found)
    one.search = SimpleNamespace(best=lambda key: key)
    one.gap_of = lambda key: SimpleNamespace(strays=strays)
    one.validated = validated
    one._proposed = lambda left: decided(*((h.effects, h.probability, True) for h in left))
    said = one._proposed(one.weighed)
    return said, one._closing(said)


def test_an_answer_that_closes_nothing_gives_way_to_a_wider_one_that_surely_does() -> None:
    """Of a river vessel whose rudders stayed behind to one side: a play made it worse, an offset beside it did not."""
    entries = [
        ((PLAY,), 0.3, True), ((FORM, PLAY), 0.35, True), ((PLAY, OFFSET), 0.15, True),
        ((FORM, PLAY, OFFSET), 0.15, True), ((OFFSET,), 0.05, True),
    ]  # fmt: skip
    both = (PLAY, OFFSET)
    said, left = _closing(entries, {(PLAY,): (-0.06, -0.2), both: (0.55, 0.12)})
    assert said.shown == (PLAY,)
    assert (left.shown, left.kind) == (both, "effects")
    assert left.probability == pytest.approx(0.3 / 0.35)  # of what is left beside the play alone, and its twin
    # It stays where it surely closes a part itself, where the wider one does not surely, and where no run strays.
    for closes in ({(PLAY,): (0.2, 0.1), both: (0.55, 0.12)}, {(PLAY,): (-0.06, -0.2), both: (0.55, -0.01)}):
        said, left = _closing(entries, closes)
        assert left == said
    said, left = _closing(entries, {both: (0.55, 0.12)}, strays=False)
    assert left == said


def test_what_is_left_must_not_be_too_improbable() -> None:
    both = (PLAY, OFFSET)
    said, left = _closing([((PLAY,), 0.97, True), (both, 0.03, True)], {(PLAY,): (-0.06, -0.2), both: (0.55, 0.12)})
    assert left == said
