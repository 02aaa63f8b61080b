"""Options of effects that cannot be are refused."""

from __future__ import annotations

from .errors import ConfigError


def whole(effect, option: str, most: int) -> None:
    """Refuse an option that is no whole number from 1 to `most`."""
    value = getattr(effect, option)
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed=f"a whole number, 1 to {most}")


def one_of(effect, option: str, allowed, do: str | None = None) -> None:
    """Refuse an option that is not one of the allowed words."""
    value = getattr(effect, option)
    if value not in allowed:
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed=", ".join(allowed), do=do)


def texts(effect, option: str) -> None:
    """Refuse an option that is neither left out nor a list of texts."""
    value = getattr(effect, option)
    if value is not None and not (isinstance(value, list) and value and all(isinstance(item, str) for item in value)):
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed="a list of names")
