"""Which filter? Compared on held-out stretches of the training logs, never on the test logs.

Robots differ in sampling, encoder and motion, and the filter moves the error more than most effects do. So every
fit states what the chosen filter gives and what its neighbours would have given, against the torque as logged
(a filter that also smooths the torque must not be judged by its own smoothing). Joints count by the logarithm of their error, as the
likelihood of noise has it whose size nobody knows: in a sum of squares a shoulder would choose the filter of a wrist.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from . import too_narrow
from .blocks import within_one_error
from .drives import slowest, with_drives
from .errors import SysidError
from .filter_errors import held_out
from .log import Log
from .lowpass import band
from .model import Model
from .plain_model import plain
from .preprocess import needs
from .spans import Spans
from .specs import Experiment, PreprocessSpec
from .warned import noticed, warn
from .workers import Mapped

_WINDOWS = (0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8)  # s
_CUTOFFS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)  # Hz
_SLOW = (0.3, 0.5, 0.7)  # Hz, of a low-pass on both sides beside these: an arm of 300 kg moves at half a hertz
_SETTLED = ("window", "cutoff", "torque")
_USUAL = {"window": 0.1, "cutoff": 10.0}  # s and Hz
# Windows of an angle, a cycle of the low-pass on both sides. A polynomial of order 4 is -3 dB at 1.56 / window: friction's jump is smeared
# over a short time only, and the noise that comes through stays behind the low-pass.
_ANGLES, _POSES = 12.0, 50
# Enough to rank filters; a long log need not be read whole for it.
_MOST_SAMPLES = 30_000


def compare(
    experiment: Experiment, model: Model, logs: Sequence[Log], prior, *, progress: Callable[[float], None] | None = None, mapped: Mapped | None = None
) -> dict:  # fmt: skip
    """The chosen filter and its neighbours with their held-out errors.

    Args:
        progress, mapped: as of `begun`.

    Returns:
        {"filter", "order", "window" or "cutoff", "torque", "chosen": "given", "usual" or "held-out error", "held_out": [
        {"window" or "cutoff": value, "relative_error": geometric mean over the joints, "rms": {joint: N m}}, ...]}; and "too_narrow": {"key",
        "given", "value", "rms": {joint: [N m, less with that value]}} where angles are noisy for a filter that was given; neighbours are half and
        double the value where it was given, the whole grid where it was `auto`, as a low-pass on both sides is where no cutoff is said.
    """
    return begun(experiment, model, logs, prior, progress=progress, mapped=mapped)()


def is_given(experiment: Experiment) -> bool:
    """Whether an experiment says which filter is taken: its neighbours are compared with it, and change nothing."""
    spec = experiment.preprocess
    return not lowpassed(experiment) and (spec.filter == "none" or _key(spec) in _given(spec))


def begun(
    experiment: Experiment, model: Model, logs: Sequence[Log], prior, *, progress: Callable[[float], None] | None = None, mapped: Mapped | None = None
) -> Callable[[], dict]:  # fmt: skip
    """A comparison that other processes are at, where there are any: what gives its result, as of `compare`.

    Args:
        progress: called with the share of the filters that is done. mapped: what shares work among processes, as of `workers.crew`;
            None: there is this one.
    """
    spec, low = experiment.preprocess, lowpassed(experiment)
    if low and (_servos(experiment) or "cutoff" in _given(spec)):
        return lambda: of_the_motion(experiment, model, logs, prior)
    said = {"filter": spec.filter, "torque": spec.torque, "standstill": spec.standstill}
    if spec.filter == "none":
        return lambda: {**said, "chosen": "given", "held_out": []}
    # not what an effect leaves that only some robots have: when one is added, the filter stays
    model = with_drives(plain(experiment, model.robot), experiment)
    key = "cutoff" if low else _key(spec)
    value = "auto" if low else getattr(spec, key)
    shortened = [_middle(log) for log in logs]
    step = max(segment.step for log in shortened for segment in log.segments)
    cannot = "" if low or value == "auto" or key in _given(spec) else too_narrow.impossible(spec, step)
    automatic = value == "auto" or bool(cannot)
    values = ((*_SLOW, *_CUTOFFS) if low else _WINDOWS if key == "window" else _CUTOFFS) if automatic else (value / 2, value, value * 2)
    candidates = [{"cutoff": value, "window": _window(spec, value, step)} if low else {key: value} for value in values]
    edge = _widest_edge(spec, candidates, shortened)
    # a file that others read, they read themselves
    sent = [log if mapped and isinstance(log.segments, Spans) and not log.segments.held else own for log, own in zip(logs, shortened)]
    share = mapped or (lambda work, arguments: (work(*each) for each in arguments))
    tries = share(_tried, ((experiment, candidate, model, sent, prior, edge) for candidate in candidates))

    def made(wide: float) -> dict | None:
        narrow, other = (spec.model_copy(update={key: each}) for each in (value, wide))
        return too_narrow.noise_makes(experiment, narrow, other, model, shortened, prior, edge)

    def result() -> dict:
        tried: list[dict] = []
        for number, found in enumerate(tries):
            tried += [] if found is None else [found]
            if progress:
                progress((number + 1) / len(candidates))
        chosen = {key: value}
        if automatic:
            if not tried and low:  # too short to hold a part of them out
                return of_the_motion(experiment, model, logs, prior)
            if not tried:
                raise SysidError(f"no {key} suits the logs", where="preprocess", do=f"log faster or longer, or give {key} a number")
            if cannot:
                warn(f"{cannot}; as none is given, it is chosen by the error on stretches of the training logs that were held apart")
            best = _best(tried, key, _USUAL[key])
            chosen = {name: best[name] for name in candidates[0]}
            if len(tried) > 1 and best in (tried[0], tried[-1]):
                warn(f"preprocess.{key}: auto chose {best[key]:g}, the end of what was tried; give a number to go further")
        elif wider := too_narrow.by_noise(tried, key, value, made):
            if key not in _given(spec):
                asks = experiment.model_copy(update={"preprocess": spec.model_copy(update={key: "auto"})})
                other = compare(asks, model, logs, prior, progress=progress, mapped=mapped)
                other = too_narrow.as_far(other, wider, made)
                if other[key] != value:  # which leaves rows that tell fewer coefficients
                    warn(f"preprocess.{key}: {too_narrow.said(wider)}; as none is given, it is chosen by that")
                    return other
            said["too_narrow"] = wider
            warn(f"preprocess.{key}: {too_narrow.said(wider)}; `{key}: auto` chooses by that")
        shown = [{name: entry[name] for name in (key, "relative_error", "rms")} for entry in tried]
        return {
            **said,
            "order": spec.order,
            **chosen,
            "chosen": "held-out error" if automatic else "given" if key in _given(spec) else "usual",
            "held_out": shown,
        }

    return result


def _key(spec: PreprocessSpec) -> str:
    return "window" if spec.filter == "savitzky-golay" else "cutoff"


def _given(spec: PreprocessSpec) -> set[str]:
    """What of a low-pass an experiment says: `window`, `cutoff`."""
    return {key for key in ("window", "cutoff") if key in spec.model_fields_set and getattr(spec, key) != "auto"}


def _servos(experiment: Experiment) -> bool:
    return any(actuator.command is not None for actuator in experiment.actuator.values())


def _window(spec: PreprocessSpec, cutoff: float, step: float) -> float:
    """The window [s] of angles behind a low-pass, on logs whose longest step is `step`: far beyond it, where none is given."""
    return spec.window if "window" in _given(spec) else float(max(1.0 / (_ANGLES * cutoff), 2.0 * (spec.order // 2) * step))


def _tried(experiment: Experiment, candidate: dict, model: Model, logs: Sequence[Log], prior, edge: float) -> dict | None:
    """What a filter leaves of the middles of logs; None where it is none: a window shorter than its order, a cutoff above half the
    sampling rate."""
    spec = experiment.preprocess.model_copy(update=candidate)
    try:
        with noticed():
            return {**candidate, **held_out(experiment, spec, model, [_middle(log) for log in logs], prior, edge)}
    except SysidError:
        return None


def lowpassed(experiment: Experiment) -> bool:
    """Whether both sides of an experiment go under a low-pass: where it says so, and where a joint's torque is made of its own angle, a
    servo's, and it says nothing of filters."""
    spec = experiment.preprocess
    return spec.filter != "none" and (
        spec.torque == "low-pass" or (_servos(experiment) and not spec.model_fields_set & {"filter", "window", "cutoff", "torque"})
    )


def of_the_motion(experiment: Experiment, model: Model, logs: Sequence[Log], prior) -> dict:
    """The filters that a motion asks for: both sides as far as its joints' speeds go, or an octave beyond where its slowest servo swings,
    as from there on noise of the angles, which inertia makes torque of, grows with the square of frequency; the angles far beyond.
    """
    spec = experiment.preprocess
    # of each, its step and angles thinned: a long one does not stand in memory
    thinned = [(len(s.t), s.step, s.q[:: -(-len(s.q) // _POSES)].copy()) for log in logs for s in log.segments]
    cutoff = spec.cutoff
    if "cutoff" not in _given(spec):
        rows, its_step, q = max(thinned, key=lambda one: one[0])
        cutoff = float(max(min(band(logs), 2.0 * slowest(experiment, model.robot, prior, q)), 1.0 / (its_step * rows)))
    window = _window(spec, cutoff, max(step for _, step, _ in thinned))
    return {
        "filter": spec.filter, "torque": "low-pass", "standstill": spec.standstill, "order": spec.order, "window": float(window), "cutoff": float(cutoff),
        "chosen": "given" if "cutoff" in _given(spec) else "the motion's band", "held_out": [],
    }  # fmt: skip


def _widest_edge(spec: PreprocessSpec, candidates: Sequence[dict], logs) -> float:
    """Seconds that every candidate leaves out at both ends of a log, so that all are judged on the same rows.

    A candidate that would take more than a tenth of the shortest log does not set it, and is judged on what it has.
    """
    shortest = min(segment.step * len(segment.t) for log in logs for segment in log.segments)
    edges = []
    for candidate in candidates:
        for log in logs:
            for segment in log.segments:
                try:
                    edges.append(needs(spec.model_copy(update=candidate), segment.step) // 2 * segment.step)
                except SysidError:
                    continue
    return max((edge for edge in edges if edge <= 0.1 * shortest), default=0.0)


def _best(tried: list[dict], key: str, usual: float) -> dict:
    """The candidate of least held-out error; among those within one standard error of it, of those that leave rows which tell
    most coefficients, the one nearest the usual."""
    least = min(tried, key=lambda entry: entry["relative_error"])
    # a candidate that is missing folds cannot be compared
    alike = [entry for entry in tried if len(entry["folds"]) == len(least["folds"])]
    kept = within_one_error([entry["folds"] for entry in alike], alike.index(least))
    tied = [entry for entry, within in zip(alike, kept) if within]
    return min(tied, key=lambda entry: (entry["untold"], abs(np.log(entry[key] / usual))))


def same(one: dict, other: dict) -> bool:
    """Whether two choices are one filter."""
    return all(one.get(key) == other.get(key) for key in _SETTLED)


def settled(spec: PreprocessSpec, chosen: dict) -> PreprocessSpec:
    """The preprocessing with `auto` replaced by what was chosen."""
    return spec.model_copy(update={key: chosen[key] for key in _SETTLED if key in chosen})


def torque_band(spec: PreprocessSpec) -> str:
    """What torque went through, on both sides of the equation: the band that errors are of, in words."""
    if spec.torque == "low-pass" and spec.filter != "none":
        return f"torque under a low-pass of {spec.cutoff:.3g} Hz"
    return "torque through the filter of the angles" if spec.torque == "same" and spec.filter != "none" else "torque as logged"


def _middle(log: Log) -> Log:
    """The longest segment's middle, of at most `_MOST_SAMPLES`."""
    if isinstance(log.segments, Spans):
        return replace(log, segments=(log.segments.middle(_MOST_SAMPLES),))
    segment = max(log.segments, key=lambda s: len(s.t))
    n = len(segment.t)
    if n <= _MOST_SAMPLES:
        return replace(log, segments=(segment,))
    rows = slice((n - _MOST_SAMPLES) // 2, (n + _MOST_SAMPLES) // 2)
    cut = lambda values: None if values is None else values[rows]  # noqa: E731
    part = replace(
        segment, t=segment.t[rows], q=segment.q[rows], tau=segment.tau[rows], qd=cut(segment.qd), qdd=cut(segment.qdd),
        signals={name: values[rows] for name, values in segment.signals.items()},
    )  # fmt: skip
    return replace(log, segments=(part,))
