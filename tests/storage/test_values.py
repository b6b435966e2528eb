"""Stored values come back to the last bit."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatruth.storage.values import from_text, to_text

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=20,
)


@given(JSON)
def test_values_come_back_equal(value: Any) -> None:
    text = to_text(value)
    assert "\n" not in text
    assert from_text(text) == value


@pytest.mark.parametrize(
    "array",
    [
        np.array([[0.1, -0.0, math.nan], [math.inf, -math.inf, 5e-324]]),
        np.arange(6, dtype=np.int16).reshape(1, 2, 3),
        np.array([True, False]),
        np.array(1.5),
        np.zeros((0, 4), dtype=np.float32),
        np.array([1 + 2j]),
        np.array(["steady", "heave"]),
        np.arange(12.0).reshape(3, 4).T,
        np.array([1.0, 2.0], dtype=">f8"),
    ],
)
def test_arrays_come_back_to_the_last_bit(array: np.ndarray[Any, Any]) -> None:
    again = from_text(to_text({"inner": [array]}))["inner"][0]
    assert again.dtype == array.dtype
    assert again.shape == array.shape
    assert again.tobytes() == np.ascontiguousarray(array).tobytes()
    again.flags.writeable = True
    again[...] = again  # it can be changed


def test_scalars_become_python_numbers_and_tuples_lists() -> None:
    value = from_text(to_text((np.float64(0.1), np.int32(7), np.bool_(True), math.nan, math.inf)))
    assert [type(entry) for entry in value] == [float, int, bool, float, float]
    assert value[:3] == [0.1, 7, True]
    assert math.isnan(value[3])
    assert json.loads(to_text(math.nan))  # strict JSON


@pytest.mark.parametrize("value", [{"$number": "inf"}, {"$array": 1}, {"$": {"$mapping": []}}])
def test_keys_that_look_like_ours_come_back_as_they_are(value: Any) -> None:
    assert from_text(to_text(value)) == value


@pytest.mark.parametrize("value", [object(), {1: 2}, np.array([object()]), b"bytes", {1, 2}])
def test_what_cannot_be_stored_without_loss_is_refused(value: Any) -> None:
    with pytest.raises(TypeError):
        to_text(value)


@pytest.mark.parametrize(
    "text", ["", "{", '{"$array": 1}', '{"$array": {"dtype": "O", "shape": [1], "data": ""}}', '{"$number": "one"}']
)
def test_other_text_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r".*"):
        from_text(text)
