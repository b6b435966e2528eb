"""Areas above water that are known stand in the model's dimensions; the model itself stays as it was."""

from __future__ import annotations

import math

import cloudpickle
import pytest

from seatruth import BadInput, BlackBox, Channel, IsolatedBlackBox
from seatruth.effects import dimensions_of
from seatruth.models import Dimensions, load_model, with_areas


def box(dimensions: Dimensions | None) -> BlackBox:
    return BlackBox(
        "box",
        lambda trial, p, first: {"u": 0.0 * trial.t},
        inputs=[],
        outputs=[Channel("u", "m/s")],
        parameters=[],
        dimensions=dimensions,
    )


@pytest.mark.parametrize("name", ["mmg", "twin_thruster", "bluerov2"])
def test_they_stand_in_the_dimensions_of_a_copy(name: str) -> None:
    model = load_model(name)
    plain = dimensions_of(model)
    assert plain is not None
    known = with_areas(with_areas(model, frontal_area=0.4), lateral_area=1.5)
    assert dimensions_of(known) == plain._replace(frontal_area=0.4, lateral_area=1.5)
    assert dimensions_of(model) == plain
    assert type(known) is type(model)
    assert dimensions_of(cloudpickle.loads(cloudpickle.dumps(known))) == dimensions_of(known)


def test_effects_inside_a_black_box_see_them() -> None:
    """These ask the innermost black box."""
    alone = IsolatedBlackBox(box(Dimensions(7.0, 1.2, 0.4, 3000.0, 1000.0)))
    known = with_areas(alone, lateral_area=1.5)
    for one in (known, known.innermost):
        size = dimensions_of(one)
        assert size is not None
        assert (size.frontal_area, size.lateral_area) == (None, 1.5)
    assert dimensions_of(alone) == dimensions_of(alone.innermost) == (7.0, 1.2, 0.4, 3000.0, 1000.0, None, None)


@pytest.mark.parametrize("area", [0.0, -1.0, math.nan, math.inf])
def test_an_area_is_positive(area: float) -> None:
    with pytest.raises(BadInput, match=r"lateral_area of .* m2 is not possible"):
        with_areas(load_model("mmg"), lateral_area=area)


def test_areas_belong_to_a_size() -> None:
    with pytest.raises(BadInput, match="declares no dimensions"):
        with_areas(box(None), frontal_area=1.0)
    assert dimensions_of(with_areas(box(None))) is None
