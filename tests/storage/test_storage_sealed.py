"""A stored object whose content has changed in any way is refused."""

from __future__ import annotations

import json

import pytest

from seatruth.storage.sealed import sealed, unsealed

CONTENT = {"a": [1, 2.5, {"b": None}], "ä": "text", "c": True}


def test_what_was_sealed_comes_back() -> None:
    text = sealed(CONTENT, 3)
    assert unsealed(text, 3) == unsealed(text.encode(), 3) == CONTENT
    assert unsealed(json.dumps(json.loads(text)), 3) == CONTENT  # spaces mean nothing


def test_every_changed_character_that_matters_is_noticed() -> None:
    text = sealed(CONTENT, 3)
    for place, character in enumerate(text):
        if character.isalnum():
            changed = text[:place] + ("1" if character != "1" else "2") + text[place + 1 :]
            with pytest.raises(ValueError, match=r"checksum|layout|Expecting|JSON|decode"):
                unsealed(changed, 3)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        *((text, "another layout") for text in ("[]", "{}", "7", '{"a": 1}', '{"format": 2}', '{"format": "3"}')),
        *((text, "checksum") for text in ('{"format": 3}', '{"format": 3, "checksum": [7]}')),
        *((text, r"\w") for text in ("", '{"a": NaN', "9" * 5000)),
        ("[" * 10**5, "nested"),
    ],
)
def test_anything_else_is_refused(text: str, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        unsealed(text, 3)
