"""A user's own effects: classes in a Python file that the experiment file names, `my_effects.py:Name`.

The file runs, with all that Python may do: where its content was allowed (`trusted`), and else not. The class is one of the
four kinds of `sysid.effect`; ten lines do:

    from sysid.effect import Linear, TorqueEffect

    class Squeak(TorqueEffect):
        c = Linear("N m", says="size of the squeak")

        def columns(self, motion, joint):
            return motion.qdd[None, :, joint] ** 3

What it does not say of itself is "not stated", and its name is the class's in small letters. It is tried on a few
samples when the model is built, and what it returns is checked whenever it is called.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import re
import sys
import traceback
from dataclasses import replace
from functools import wraps
from pathlib import Path

import numpy as np

from . import bounded, regressor, trusted
from .effect import KINDS, Effect, MotionEffect, NotFinite, SensorEffect, WrenchEffect
from .errors import ConfigError, SysidError
from .motion import Piece
from .specs import Experiment, is_own
from .vocabulary import vocabulary

_STATED = ("equation", "looks_like", "separate_by", "source")
_LOADED: dict[tuple[str, str], dict] = {}  # what a file holds, by its path and its content
_TRIED = 40  # samples


def load(reference: str, folder: Path) -> Effect:
    """The effect that `file.py:Class` names, the file relative to `folder`.

    Raises:
        ConfigError: no such file or class, a file that cannot be run, or a class that is no effect.
        Untrusted: nobody has allowed the file to run.
    """
    file, _, name = reference.rpartition(":")
    path = (folder / file).resolve()
    held = _run(path)
    kind = held.get(name)
    classes = [word for word, value in held.items() if _is_effect(value)]
    if kind is None:
        raise ConfigError(f"the file has no class {name!r}", where=str(path), allowed=", ".join(classes) or "none: it defines no effect", do="correct model.effects")
    where = f"{path}: {name}"
    if not (isinstance(kind, type) and issubclass(kind, KINDS)):
        raise ConfigError("not an effect", where=where, allowed=", ".join(classes) or ", ".join(k.__name__ for k in KINDS), do="derive the class from one of sysid.effect")
    if lacking := sorted(getattr(kind, "__abstractmethods__", ())):
        raise ConfigError(f"the class does not define {', '.join(lacking)}", where=where, do="define it; see `sysid.effect`")
    if not isinstance(getattr(kind, "name", None), str):
        kind.name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()
    if not re.fullmatch(r"[A-Za-z_]\w*", kind.name) or kind.name in (*vocabulary(), "formula"):
        raise ConfigError(f"the name {kind.name[:40]!r} of an effect", where=where, allowed="a word that is no effect of `sysid effects`", do="rename it")
    for word in _STATED:
        if not isinstance(getattr(kind, word, None), str):
            setattr(kind, word, "not stated")
    _guard(kind, path, name)
    try:
        return kind()
    except Exception as error:
        raise _raised(error, path, f"{name} cannot be made") from None


def allow(experiment: Experiment) -> None:
    """Let every Python file that an experiment names run, as it is now."""
    for path in _named(experiment):
        trusted.trust(path)


def demand(experiment: Experiment) -> None:
    """Raises Untrusted: an experiment names a Python file that was not allowed to run."""
    for path in _named(experiment):
        trusted.check(path, bounded.read_bytes(path))


def _named(experiment: Experiment) -> list[Path]:
    entries = [*experiment.model.effects, *experiment.model.candidates]
    files = dict.fromkeys(e.name.rpartition(":")[0] for e in entries if is_own(e.name))
    # one that is not there is said where it is read
    return [path for file in files if (path := (experiment.folder / file).resolve()).is_file()]


def check(effect: Effect, robot, joint: int) -> None:
    """Try an effect on a few samples, at rest and in motion within the joints' limits.

    Raises:
        ConfigError: it fails, or returns an array of another shape, or numbers that are not finite.
    """
    with np.errstate(all="ignore"):
        piece = _sample(robot)
        shapes = {}
        for shape in effect.shapes():
            values = shape.values(shape.low, shape.high)
            shapes[shape.name] = float(values[len(values) // 2])
        if isinstance(effect, SensorEffect):
            effect.sensed(piece.tau.T, piece.step, **shapes)
        elif isinstance(effect, MotionEffect):
            effect.moved(piece, joint, **shapes)
        else:
            effect.columns(piece, robot if isinstance(effect, WrenchEffect) else joint, **shapes)


def instantaneous(effect: Effect, robot, joint: int, shapes: dict[str, float]) -> bool:
    """Whether what an effect does at an instant follows from q, qd and qdd of that instant: the same instants in the opposite
    order, at other times, with other signals and other torque, come out as they were."""
    forth = _sample(robot)
    turned = {name: getattr(forth, name)[::-1] for name in ("q", "qd", "qdd", "load")}
    back = replace(forth, **turned, t=forth.t + 100.0, tau=0.0 * forth.tau, measured=0.0 * forth.tau)
    try:
        done = [_done(effect, piece, robot, joint, shapes) for piece in (forth, back)]
    except SysidError:
        return False
    return all(np.allclose(x, y[..., ::-1], rtol=1e-9, atol=0.0, equal_nan=True) for x, y in zip(*done))


def _done(effect: Effect, piece: Piece, robot, joint: int, shapes: dict[str, float]) -> list[np.ndarray]:
    """What an effect makes of a piece, samples last."""
    if isinstance(effect, SensorEffect):
        return [np.asarray(effect.sensed(piece.load.T, piece.step, **shapes))]
    if isinstance(effect, MotionEffect):
        moved = effect.moved(piece, joint, **shapes)
        down = [] if moved.gravity is None else [np.repeat(np.asarray(moved.gravity)[:, None], len(piece.t), axis=1)]
        behind = [] if moved.deflection is None else [np.swapaxes(moved.deflection, 1, 2)]
        return [moved.q.T, moved.qd.T, moved.qdd.T, *down, *behind]
    return [np.asarray(effect.columns(piece, robot if isinstance(effect, WrenchEffect) else joint, **shapes))]


def _is_effect(value) -> bool:
    return isinstance(value, type) and issubclass(value, KINDS) and value not in KINDS and not inspect.isabstract(value)


def _run(path: Path) -> dict:
    """What a Python file defines; run once for each content."""
    try:
        content = bounded.read_bytes(path)
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or "not a path"
        raise ConfigError(f"the file of own effects cannot be read ({said})", where=str(path), do="correct model.effects; paths are relative to the experiment file") from None
    key = (str(path), hashlib.sha256(content).hexdigest())
    trusted.check(path, content)
    if key not in _LOADED:
        name = f"sysid_own_{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}"
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module  # for the while: dataclasses look here for their own module
        try:
            code = compile(content, str(path), "exec", dont_inherit=True)
            spec.loader.get_code = lambda _name: code  # what was hashed is what runs, and no cache is left beside the file
            spec.loader.exec_module(module)
        except (Exception, SystemExit) as error:
            raise _raised(error, path, "the file cannot be run") from None
        finally:
            # a class of a module that cannot be imported travels to other processes whole
            sys.modules.pop(name, None)
        _LOADED[key] = vars(module)
    return _LOADED[key]


def _raised(error: BaseException, path: Path, what: str) -> ConfigError:
    """An exception of a user's code, with its line in the user's file."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
    said = error.msg if isinstance(error, SyntaxError) else str(error)
    return ConfigError(f"{what} ({type(error).__name__}: {said[:200]})", where=f"{path} line {line}" if line else str(path), do="correct the file")


def _guard(kind: type[Effect], path: Path, name: str) -> None:
    """Let a class's own calculation complain in one line."""
    word = "moved" if issubclass(kind, MotionEffect) else "sensed" if issubclass(kind, SensorEffect) else "columns"
    calculate = getattr(kind, word)
    if hasattr(calculate, "__wrapped__"):
        return

    @wraps(calculate)
    def guarded(self, *given, **shapes):
        try:
            with np.errstate(all="ignore"):
                out = calculate(self, *given, **shapes)
            results = [out.q, out.qd, out.qdd] if word == "moved" else [np.asarray(out, dtype=float)]
        except SysidError:
            raise
        except Exception as error:
            raise _raised(error, path, f"{name}.{word} fails") from None
        wanted = np.shape(given[0]) if word == "sensed" else given[0].q.shape if word == "moved" else (len(self.coefficients()), len(given[0].t))
        if issubclass(kind, WrenchEffect):
            wanted = (given[1].dof, *wanted)
        for result in results:
            if result.shape != wanted:
                raise ConfigError(f"{name}.{word} returns an array of {result.shape}", where=str(path), allowed=str(wanted), do="return one row for each coefficient")
            if not np.isfinite(result).all():
                raise NotFinite(f"{name}.{word} returns numbers that are not finite", where=str(path), do="mind what happens at rest, where qd is 0, and outside a function's domain")
        return out if word == "moved" else results[0]

    setattr(kind, word, guarded)


class _AnySignal(dict):
    """Signals of any name: what is logged is not known yet."""

    def __missing__(self, name):
        return np.linspace(20.0, 25.0, _TRIED)


def _sample(robot) -> Piece:
    """A few samples of a slow swing about the middle of each joint's limits, the first at rest."""
    t = np.arange(_TRIED) * 0.01
    w = 2.0 * np.pi
    low, high = robot.limits.T
    bounded = np.isfinite(low) & np.isfinite(high)
    middle = np.where(bounded, 0.5 * (np.where(bounded, low, 0.0) + np.where(bounded, high, 0.0)), 0.0)
    size = np.where(bounded, np.clip(0.25 * (np.where(bounded, high, 1.0) - np.where(bounded, low, 0.0)), 1e-3, 0.3), 0.3)
    swing, speed, push = 1.0 - np.cos(w * t), w * np.sin(w * t), w**2 * np.cos(w * t)
    rest = t < 0.05
    swing[rest], speed[rest], push[rest] = 0.0, 0.0, 0.0
    q, qd, qdd = (middle * (k == 0) + size * x[:, None] for k, x in enumerate((swing, speed, push)))
    load = regressor.torque(robot, robot.prior, q, qd, qdd)
    zero = np.zeros(robot.dof)
    return Piece(
        log=0, step=0.01, t=t, q=q, qd=qd, qdd=qdd, tau=load, measured=load, signals=_AnySignal(), use=None, smoother=None,
        core=slice(0, _TRIED), rest=zero, noise=zero, load=load,
    )  # fmt: skip
