"""What a model with servos declares: parameters of what is known, states that stand at the first order."""

from __future__ import annotations

from seatruth.models import Order, WithServos, load_model


def test_what_is_known_becomes_a_parameter() -> None:
    ship = WithServos(load_model("mmg"), {"delta": Order(lag=0.5, rate_limit=0.28), "n": Order()})
    assert [state.name for state in ship.states[-2:]] == ["delta_acting", "n_acting"]
    assert [(q.name, q.value, q.unit) for q in ship.parameters[-2:]] == [
        ("delta_lag", 0.5, "s"),
        ("delta_rate_limit", 0.28, "rad/s"),
    ]
    first = ship.first_state({channel.name: 0.0 for channel in ship.outputs}, {"delta": 0.2, "n": 9.0}, ship.nominal())
    assert first == (*[0.0] * 6, 0.2, 9.0)
    assert not ship.hidden


def test_settings_come_from_the_parameters() -> None:
    ship = WithServos(load_model("mmg"), {"delta": Order(lag=0.5, rate_limit=0.25), "n": Order()})

    class P:
        delta_lag, delta_rate_limit = 0.7, 0.5

    assert ship.servos[0].settings(P) == (0.7, 2.0)
    assert ship.servos[1].settings(P) == (0.0, 0.0)
