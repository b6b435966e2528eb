"""The program of a model: its fingerprint."""

from __future__ import annotations

from typing import Any

from known_models import plain_model

from seatruth.simulate import fingerprint


def test_a_fingerprint_is_of_the_equations_not_of_their_text() -> None:
    """A study's identity: helper functions and constants count, names of local variables do not."""

    def with_gain(gain: float) -> Any:
        def helper(x: Any) -> Any:
            return gain * x

        return plain_model(lambda s, i, p: (-helper(s.x),), ("x",))

    def rates(s: Any, i: Any, p: Any) -> Any:
        strange = 2.0
        return (-(strange * s.x),)

    assert fingerprint(with_gain(1.0)) != fingerprint(with_gain(2.0))
    assert fingerprint(with_gain(2.0)) == fingerprint(plain_model(rates, ("x",)))
