"""Values that an experiment file may hold: finite numbers, columns, labels, dates."""

from __future__ import annotations

import datetime
import re
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

AUTO = "auto"


_LARGEST = 1e12  # nothing of a robot is larger in SI units, and its square is still a number


def _finite(value: float) -> float:
    if not abs(value) <= _LARGEST:
        raise ValueError(f"must be a finite number, at most {_LARGEST:g} in size")
    return value


def checked_column(value: Any) -> Any:
    """A column's name, or its number from 0."""
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise ValueError("must be a column's name or its number, counted from 0")
    return value


def _columns(value: Any) -> Any:
    if isinstance(value, str):
        return value
    if isinstance(value, list) and value:
        return [checked_column(item) for item in value]
    raise ValueError('must be a pattern such as "q_{joint}", a list of names, or a list of numbers counted from 0')


def is_number(value: Any) -> bool:
    """Whether a value is a number, which a truth value is not."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= _LARGEST


def auto_or_positive(value: Any) -> Any:
    """`auto`, or a positive number."""
    if value == "auto":
        return value
    if is_number(value) and value > 0:
        return float(value)
    raise ValueError("must be a positive number or auto")


def checked_weight(value: Any) -> Any:
    """`auto`, or a number from 0."""
    if value == AUTO:
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("must be a number or auto")
    if value < 0:
        raise ValueError("must be greater than or equal to 0, or auto")
    return float(_finite(value))


def checked_standstill(value: Any) -> Any:
    """`auto`, `mask`, `keep`, or a speed."""
    if value in ("auto", "keep", "mask"):
        return value
    if is_number(value) and value >= 0:
        return float(value)
    raise ValueError("must be auto, keep, mask, or a speed [rad/s or m/s]")


def nonzero(value: float) -> float:
    """Any number but 0."""
    if value == 0:
        raise ValueError("must not be 0")
    return value


def _reference(value: str) -> str:
    if not value or "\0" in value:
        raise ValueError("must be the path of a file")
    return value


Text = Annotated[str, AfterValidator(_reference)]


Number = Annotated[float, AfterValidator(_finite)]


Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]


Positive = Annotated[float, AfterValidator(_finite), Field(gt=0)]


Columns = Annotated[Any, BeforeValidator(_columns)]


class Spec(BaseModel):
    """What all parts of an experiment file share: no unknown key, no conversion, nothing changes."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


NonZero = Annotated[float, AfterValidator(_finite), AfterValidator(nonzero)]


def _label(value: Any) -> Any:
    value = str(value) if isinstance(value, int) and not isinstance(value, bool) else value
    if not isinstance(value, str) or not re.fullmatch(r"[\w+-]+", value):
        raise ValueError("a name of a group or of a level must be of letters, digits, _, + and -; quote a date")
    return value


Label = Annotated[str, BeforeValidator(_label)]


def _date(value: Any) -> Any:
    if isinstance(value, datetime.date) and not isinstance(value, datetime.datetime):
        return value.isoformat()
    try:
        return datetime.date.fromisoformat(value).isoformat()
    except (TypeError, ValueError):
        raise ValueError("must be a day, as in 2026-03-31") from None


Day = Annotated[str, BeforeValidator(_date)]
