"""What is called from Python: packages by their own name, `sysid.diagnose(experiment)` though `sysid.diagnose` is a
folder; and a path where an experiment or a fit is asked for, which is said in one line."""

from __future__ import annotations

import functools
import inspect
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

from .errors import SysidError
from .threads import single_threaded

_MADE = {"Experiment": "sysid.load({path!r})", "Fit": "sysid.fit(sysid.load({path!r}))"}  # from a path


@functools.cache
def no_path(work):
    """A function that says what to call where it is handed a path in the place of an experiment or a fit.

    Its parameters that are annotated `Experiment` or `Fit` are asked; others may be paths.
    """
    asked = {name: one.annotation for name, one in inspect.signature(work).parameters.items()}

    @functools.wraps(work)
    def told(*args, **how):
        for name, given in (*zip(asked, args), *how.items()):
            wanted = asked.get(name)
            wanted = getattr(wanted, "__name__", str(wanted)).removesuffix(" | None")
            if wanted in _MADE and isinstance(given, (str, Path)):
                made = _MADE[wanted].format(path=str(given))
                kind = "an experiment" if wanted == "Experiment" else "a fit"
                raise SysidError(
                    f"sysid.{work.__name__.removesuffix('_log')} is handed a path, {str(given)!r}, in the place of {kind}",
                    do=f"hand it {made}",
                )
        return work(*args, **how)

    return told


def callable_module(package: str, module: str, work: str) -> None:
    """Make a package callable, as a function of one of its modules ("" for its own). Its attributes stay what they are."""

    class Callable(ModuleType):
        def __call__(self, *args, **how):
            where = import_module(f"{package}.{module}" if module else package)
            return single_threaded(no_path(getattr(where, work)))(*args, **how)

    sys.modules[package].__class__ = Callable
