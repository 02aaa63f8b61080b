"""The log doctor: what is wrong with an experiment's logs, before any fit.

look.py       what is looked at: all logs, their motion, a fit
logged.py     every log, as measured and as it is used; of a long one stretches
tally.py      what rows tell by themselves, of all rows of a log; samples.py: at how many, and when
equations.py  what the URDF's robot makes of it, however its columns are read
faults/       what can be wrong; each module has `find(look)`, says AFTER which others it is asked
              (a number), and errors of which it would be SENSELESS
fault.py      what is told
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from importlib import import_module
from pkgutil import iter_modules

from ..callable_module import callable_module
from ..specs import Experiment
from ..warned import noticed
from .fault import ERROR, WARNING, Fault
from .look import Look, looked

#: the user can be told of these
FAULTS = (
    "angle_wrap", "joint_order", "sign_flipped", "wrong_unit", "torque_in_amperes",
    "commanded_torque", "effort_missing", "spikes", "knock", "brake_closed", "values_held",
    "clock_jitter", "clock_gap", "delayed_signal", "saturation", "coarse_values", "standstill",
    "slow_logger", "test_is_train", "not_excited", "limit_exceeded", "mass_implausible",
)  # fmt: skip
# of a joint whose torque is not used, only its motion can be at fault
_OF_ANGLES = (
    "angle_wrap", "wrong_unit", "coarse_values", "standstill", "not_excited", "limit_exceeded",
)  # fmt: skip
# the modules that ask how columns are read
_READINGS = ("among", "angles", "columns", "of_motion", "one_log", "unit_of_log", "unmoved")


def check(experiment: Experiment) -> list[Fault]:
    """The faults of an experiment's logs, the gravest first.

    Raises:
        SysidError: what cannot be read at all.
    """
    with noticed():
        return faults_of(looked(experiment))


def faults_of(look: Look) -> list[Fault]:
    """The faults of logs that were looked at, the gravest first."""
    found = list(_found(look))
    return sorted(found, key=lambda fault: (fault.severity != ERROR, FAULTS.index(fault.fault)))


def misread(experiment: Experiment) -> list[Fault]:
    """The errors of how an experiment's columns are read: their order, signs and units."""
    with noticed():
        found = _found(looked(experiment), _READINGS)
        # a zero that is off, of all logs; not an angle beyond a limit, in one
        zero = lambda f: f.fault == "limit_exceeded" and not f.log  # noqa: E731
        return [f for f in found if f.severity == ERROR or zero(f)]


def _found(look, asked: Collection[str] = ()) -> Iterator[Fault]:
    from . import faults

    names = sorted(module.name for module in iter_modules(faults.__path__))
    names = [name for name in names if name in asked] if asked else names
    modules = [import_module(f"{faults.__name__}.{name}") for name in names]
    grave: set[str] = set()
    signs: dict[str, int] = {}
    # what a later one looks at, an earlier one's errors may have made senseless
    for module in sorted(modules, key=lambda module: module.AFTER):
        if grave.isdisjoint(module.SENSELESS):
            for fault in module.find(look):
                if fault.joint in look.experiment.data.unused and fault.fault not in _OF_ANGLES:
                    continue
                signed = fault.fault == "sign_flipped"
                if signed and module.AFTER > signs.setdefault(fault.joint, module.AFTER):
                    continue  # what has none, or another in some logs, has no wrong one
                grave |= {fault.fault} if fault.severity == ERROR else set()
                yield fault


def document(found: list[Fault]) -> dict:
    """The document of `sysid check`."""
    listed = [
        {
            "fault": f.fault,
            "severity": f.severity,
            "joint": f.joint or None,
            "log": f.log or None,
            "times": list(f.times),
            "rows": f.rows,
            "says": f.says,
            "do": f.do,
        }
        for f in found
    ]
    return {"ok": not any(f.severity == ERROR for f in found), "faults": listed}


callable_module(__name__, "", "check")  # `sysid.check(experiment)`

__all__ = ["ERROR", "FAULTS", "WARNING", "Fault", "check", "document", "faults_of", "misread"]
