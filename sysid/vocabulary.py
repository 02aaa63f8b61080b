"""Every effect by its name: the modules of effects/, and what is said of each."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from .effect import Effect, kind
from .errors import ConfigError


@cache
def vocabulary() -> tuple[str, ...]:
    """The names of all effects: the modules of `effects/`."""
    from . import effects

    return tuple(sorted(module.name for module in iter_modules(effects.__path__)))


@cache
def find(name: str) -> Effect:
    """The effect of that name.

    Raises:
        ConfigError: there is none; the closest names are given.
    """
    import difflib

    names = vocabulary()
    if name not in names:
        close = difflib.get_close_matches(name.lower(), names, n=3, cutoff=0.5) or names
        raise ConfigError(f"there is no effect {name!r}", allowed=", ".join(close), do="`sysid effects` lists all")
    module = import_module(f"sysid.effects.{name}")
    (kind,) = [
        value for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == module.__name__
    ]  # fmt: skip
    return kind()


def describe(effect: Effect) -> dict:
    """What `sysid effects` prints of an effect."""
    return {
        "name": effect.name, "summary": " ".join((type(effect).__doc__ or "").split()), "kind": kind(effect), "scope": effect.scope,
        "equation": effect.equation,
        "parameters": [
            {"name": c.name, "unit": c.unit, "lower": c.lower, "says": c.says} for c in effect.coefficients()
        ] + [
            {"name": s.name, "unit": s.unit, "lower": s.low, "upper": s.high, "share_of": s.of, "start": s.start, "says": s.says} for s in effect.shapes()
        ],
        "options": dict(effect.options), "looks_like": effect.looks_like, "tied_with": list(effect.tied_with),
        "separate_by": effect.separate_by, "maneuvers": list(effect.maneuvers), "source": effect.source,
    }  # fmt: skip


def of_logs(name: str) -> bool:
    """Whether an effect of that name is in the vocabulary, and may be in some logs alone, which its options name."""
    return name in vocabulary() and not {"logs", "stretches"}.isdisjoint(find(name).options)
