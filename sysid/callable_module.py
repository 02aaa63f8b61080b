"""Packages that are called by their own name: `sysid.diagnose(experiment)`, though `sysid.diagnose` is a folder."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType

from .threads import single_threaded


def callable_module(package: str, module: str, work: str) -> None:
    """Make a package callable, as a function of one of its modules ("" for its own). Its attributes stay what they are."""

    class Callable(ModuleType):
        def __call__(self, *args, **how):
            where = import_module(f"{package}.{module}" if module else package)
            return single_threaded(getattr(where, work))(*args, **how)

    sys.modules[package].__class__ = Callable
