"""What all tables of a study file share: strictness, and the short forms of a table."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat


class Table(BaseModel):
    """Base of every table: unknown keys and wrong types are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class OpenTable(Table):
    """A table whose further keys are the options of a plug-in or a preparation step."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)

    @property
    def options(self) -> dict[str, Any]:
        """The keys that the schema does not name: options of what the table selects."""
        return dict(self.__pydantic_extra__ or {})


def as_list(value: Any) -> Any:
    """Lets one name or one table stand for a list of tables."""
    if isinstance(value, str):
        return [{"use": value}]
    return [value] if isinstance(value, dict) else value


def as_table(key: str) -> BeforeValidator:
    """Lets a bare number or text stand for a table with one key."""

    def widen(value: Any) -> Any:
        return value if isinstance(value, (dict, bool)) else {key: value}

    return BeforeValidator(widen)


def _pair(value: Any) -> Any:
    numbers = isinstance(value, list) and len(value) == 2 and all(isinstance(item, (int, float)) for item in value)
    if numbers and value[0] > value[1]:
        raise ValueError(f"{value} is not in order, it must be [low, high]")
    return value


Pair = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2), BeforeValidator(_pair)]
