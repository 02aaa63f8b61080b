"""The fitted model where it is used next: MuJoCo, Gazebo, Drake, Isaac Lab.

A format says what it can of a model (`stated`), and the rest is told with the torque that it costs
on the test logs (`cost`). What was written is loaded again by the simulator itself, where it is
installed, and its inverse dynamics compared.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path

import numpy as np

from .. import experiment_logs
from ..callable_module import callable_module
from ..errors import SysidError
from ..estimate import Fit
from ..filters import settled
from ..fit_document import number
from ..groups import levels_of
from ..inertia.consistency import is_consistent
from ..motion import Motion
from ..preprocess import prepare
from ..run import Run, read_run
from ..warned import noticed
from ..whole_files import folder, write_atomically
from .cost import Cost, costs, sampled
from .document import comment, felt, line
from .motors import joint_side, motors
from .stated import stated

FORMATS = ("mjcf", "sdf", "drake", "isaaclab")
AGREES = (
    1e-6  # of a joint's RMS torque: what XML's numbers, and a simulator's own arithmetic, may cost
)
_MOST = 5000  # samples compared; more of a log tell nothing new of a rigid robot


@dataclass(frozen=True)
class Check:
    """What a simulator made of the written files: `by` whom, on how many samples, the largest
    difference {joint: share of the joint's RMS torque}; `why` instead where it could not be asked
    or refused them."""

    by: str | None
    samples: int
    difference: dict[str, float]
    why: str | None

    @property
    def agrees(self) -> bool | None:
        """Whether it says the same as we do; None where nobody was asked."""
        if self.by is None:
            return None
        return bool(self.difference) and all(d <= AGREES for d in self.difference.values())


@dataclass(frozen=True)
class Export:
    """Written files, the check, what the format cannot say, and the RMS {joint: N m or N} of all
    that together."""

    to: str
    files: tuple[Path, ...]
    check: Check
    left_out: tuple[Cost, ...]
    together: dict[str, float] | None
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        names = ", ".join(path.name for path in self.files)
        return f"<Export to {self.to}: {names}; {len(self.left_out)} left out; {told(self.check)}>"


def told(check: Check) -> str:
    """A check in words."""
    if check.why is not None:
        return check.why
    worst = float(np.max(list(check.difference.values())))
    return f"inverse dynamics of {check.by} within {worst:.1e} of ours on {check.samples} samples"


def export(
    run: Run | Fit | str | Path, to: str, out: str | Path, *, levels: Mapping[str, str] | None = None
) -> Export:  # fmt: skip
    """Write an identified model for a simulator, and ask the simulator.

    Args:
        run: a run folder of `sysid fit`, or what `sysid.read_run` read or `sysid.fit` found.
        to: mjcf, sdf, drake or isaaclab.
        out: the folder to write into.
        levels: {group: level} of every group of logs that effects are per: a simulator's robot is
            one of them.

    Raises:
        SysidError: no such format, run or level, or a folder that cannot be written.
    """
    if to not in FORMATS:
        raise SysidError(
            f"there is no format {to!r}",
            allowed=", ".join(FORMATS),
            do="give one of them with --to",
        )
    found = read_run(run) if isinstance(run, (str, Path)) else run
    model, x = found.model.at(levels or {}, found.x)
    where = folder(out)
    form = import_module(f".{to}", __name__)
    drives = motors(found.experiment, model, x)
    model, x = joint_side(model, x)
    said = replace(stated(model, x, form.KNOWS, form.SHOWS), motors=drives)
    motion, why = _test_motion(found, levels or {})
    left, together = costs(model, x, said, motion)
    notes = (
        [] if why is None else [f"no test log is at hand ({why}): what is left out has no price"]
    )
    bodies = zip(found.model.robot.bodies, is_consistent(said.links))
    if names := [body.name for body, possible in bodies if not possible]:
        do = "fit with model.inertia: log-cholesky, which keeps them possible"
        notes.append(f"impossible bodies, which a simulator may refuse: {', '.join(names)}; {do}")
    contents = form.files(said, comment(said, left, together), where)
    for name, content in contents.items():
        write_atomically(where / name, lambda path, content=content: path.write_bytes(content))
    written = {name: where / name for name in contents}
    check = _asked(form, written, said, _samples(found, motion))
    return Export(to, tuple(written.values()), check, left, together, tuple(notes))


def _test_motion(run: Run | Fit, levels: Mapping) -> tuple[Motion | None, str | None]:
    """The test logs of a run at levels, or why there are none."""
    robot, spec = run.model.robot, run.experiment
    filters = settled(spec.preprocess, run.filters) if isinstance(run, Fit) else spec.preprocess
    of = lambda log: levels_of(spec.data.groups, log).items()  # noqa: E731
    tests = [log for log in spec.data.test if levels.items() <= of(log)]
    if not tests:
        said = " and ".join(f"{group} {level}" for group, level in levels.items())
        return None, f"none is at {said}"
    try:
        with noticed():
            logs = experiment_logs.read(spec, robot, tests)
            return prepare(logs, filters, robot.joints), None
    except SysidError as error:
        return None, str(error)


def _samples(run: Run | Fit, motion: Motion | None) -> list[np.ndarray]:
    """q, qd, qdd (n, dof) of the test logs; drawn where there are none."""
    if motion is None:
        return list(np.random.default_rng(0).normal(size=(3, 500, len(run.joints))))
    samples = sampled(motion)
    kept = np.linspace(0, len(samples[0]) - 1, min(_MOST, len(samples[0]))).astype(int)
    return [values[kept] for values in samples]


def _asked(form, written: dict[str, Path], said, samples) -> Check:
    try:
        with noticed():
            torque, by = form.loaded(written, said)
    except ImportError:
        return Check(
            None, 0, {}, f"not checked: {form.PACKAGE} is not installed, pip install {form.PACKAGE}"
        )
    except (ValueError, RuntimeError, SysidError) as error:
        return Check(
            form.PACKAGE, 0, {}, f"{form.PACKAGE} refuses it: {' '.join(str(error).split())}"
        )
    ours = said.torque(*samples)
    size = np.sqrt(np.mean(ours**2, axis=0))
    change = np.abs(torque(*samples) - ours).max(axis=0) / np.where(size > 0, size, 1.0)
    return Check(by, len(ours), dict(zip(said.robot.joints, change.tolist())), None)


def document(found: Export) -> dict:
    """The JSON document of `sysid export`."""
    check = found.check
    return {
        "to": found.to, "files": [str(path) for path in found.files],
        "checked": {
            "by": check.by, "agrees": check.agrees, "samples": check.samples,
            "relative_difference": {j: number(d) for j, d in check.difference.items()} or None,
            "says": told(check),
        },
        "left_out": [
            {"what": c.what, "joint": c.joint, "torque_rms": c.torque} for c in found.left_out
        ],
        "left_out_torque_rms": found.together, "notes": list(found.notes),
    }  # fmt: skip


def exported(found: Export) -> list[str]:
    """What a person is told of an export, in lines."""
    lines = [
        *map(str, found.files),
        ("" if found.check.agrees in (True, None) else "NOT THE SAME: ") + told(found.check),
    ]
    if not found.left_out:
        return [*lines, "nothing of the model is left out"]
    lines.append(
        "left out, with the RMS torque on the test logs that goes with it [N m, N where it slides]:"
    )
    lines += [f"  {line(cost)}" for cost in found.left_out]
    lines += [f"  together: {felt(found.together)}"] if found.together else []
    return [*lines, *(f"note {note}" for note in found.notes)]


callable_module(__name__, "", "export")
