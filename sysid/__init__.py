"""Identify what a robot is made of, and name the physics its model lacks.

    experiment = sysid.load("experiment.yaml")
    sysid.check(experiment)
    fit = sysid.fit(experiment)
    sysid.diagnose(experiment, fit=fit)
    fit.to_dataframe(), fit.plot()
    fit.rms("test"), fit.x, fit.uncertainty.std
    sysid.design(experiment, duration=20.0).plot()
    sysid.predict(fit, "another_log.csv").residual
    sysid.compare(fit, another_fit)
    sysid.write(fit, "runs/mine")
    sysid.read_run("runs/mine").torque(q, qd, qdd)
    sysid.export("runs/mine", "mjcf", "simulation")
    sysid.fleet(["robots/*"]).odd
    sysid.Online("runs/mine", rate=1000.0).add(q, tau)

Names are imported when they are first used, so that `import sysid` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import check, design, diagnose, export, fleet
    from .comparison import Difference, compare
    from .errors import SysidError, SysidWarning
    from .estimate import Fit
    from .online import Online
    from .pipeline import fit, load
    from .pipeline import predict_log as predict
    from .prediction import Prediction
    from .results import write
    from .run import Run, read_run
    from .specs import Experiment
    from .trusted import trust

_WHERE = {
    "load": ("pipeline", "load"), "fit": ("pipeline", "fit"), "predict": ("pipeline", "predict_log"),
    "write": ("results", "write"), "compare": ("comparison", "compare"), "Difference": ("comparison", "Difference"),
    "Experiment": ("config", "Experiment"), "Fit": ("estimate", "Fit"), "Prediction": ("prediction", "Prediction"),
    "read_run": ("run", "read_run"), "Run": ("run", "Run"),
    "trust": ("trusted", "trust"), "check": ("check", None), "design": ("design", None), "diagnose": ("diagnose", None), "export": ("export", None), "fleet": ("fleet", None), "Online": ("online", "Online"), "SysidError": ("errors", "SysidError"), "SysidWarning": ("errors", "SysidWarning"),
}  # fmt: skip


def __getattr__(name: str):
    if name not in _WHERE:
        raise AttributeError(f"module 'sysid' has no attribute {name!r}")
    module, attribute = _WHERE[name]
    found = import_module(f".{module}", __name__)
    if attribute is None:
        return found
    found = getattr(found, attribute)
    return found if isinstance(found, type) else import_module(".callable_module", __name__).no_path(found)


def __dir__():
    return sorted([*(name for name in globals() if name.startswith("__")), *_WHERE])


__all__ = [
    "Difference", "Experiment", "Fit", "Online", "Prediction", "Run", "SysidError", "SysidWarning", "check", "compare", "design", "diagnose", "export",
    "fit", "fleet", "load", "predict", "read_run", "trust", "write",
]
