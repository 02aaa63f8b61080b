"""Model against measurement, and models against each other, on held-out data, with standard errors.

Residuals are correlated over time, so a difference is judged over blocks of time: both models'
squared residuals are summed block by block over the same blocks, and the standard error of the
difference of their RMS is that of leaving one block out (jackknife).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .blocks import Numbering, extents, jackknife, summed
from .errors import SysidError
from .estimate import Fit
from .fit_document import number
from .prediction import Prediction

_ROUNDING = 1e-6  # of an error: two fits of one model, or of one that shows nothing of an effect, are settled to that

@dataclass(frozen=True)
class Difference:
    """RMS of `to` minus RMS of `from_` on a joint, negative where `to` is better; se NaN where
    blocks are too few."""

    from_: str
    to: str
    joint: str
    delta_rms: float
    se: float


class Differences(tuple[Difference, ...]):
    """The differences of two models, joint by joint."""

    def __repr__(self) -> str:
        told = ", ".join(f"{d.joint} {d.delta_rms:+.2g} +- {d.se:.2g}" for d in self)
        return f"<Differences of RMS, {self[0].to} less {self[0].from_}: {told}>"

    def to_dataframe(self):
        """A polars data frame, a row a joint: from, to, joint, delta_rms, se."""
        import polars

        rows = [(d.from_, d.to, d.joint, d.delta_rms, d.se) for d in self]
        return polars.DataFrame(rows, schema=["from", "to", "joint", "delta_rms", "se"], orient="row")

    def plot(self):
        """The difference on every joint with its standard error, as a Matplotlib figure."""
        from .picture import Picture

        figure = Picture(1.5 + 1.2 * len(self), 3.5)
        axes = figure.subplots()
        axes.errorbar([d.joint for d in self], [d.delta_rms for d in self], [d.se for d in self], fmt="o", capsize=4)
        axes.axhline(0.0, color="gray", linewidth=0.8)
        axes.set_ylabel(f"RMS of {self[0].to} less {self[0].from_} [N m or N]")
        return figure


def compare(first: Fit, second: Fit, names: tuple[str, str] | None = None) -> Differences:
    """Compare two fits joint by joint on their test logs.

    Args:
        names: what to call them; by default their experiments' names.

    Raises:
        SysidError: they were tested on different logs, or share no joint.
    """
    names = names or (first.experiment.name, second.experiment.name)
    sums, joints = _sums(first, second, names)
    both = (sums[0][1] > 0) & (sums[1][1] > 0)  # a block counts where both models have rows in it
    return Differences(
        Difference(*names, joint, *_jackknife(*((s[both[:, k], k], n[both[:, k], k]) for s, n in sums)))
        for k, joint in enumerate(joints)
    )


def over(first: Fit, second: Fit, joints: Sequence[str]) -> tuple[float, float, float]:
    """RMS [N m or N] of both fits over joints on their test logs, the root of the mean square, and the
    standard error of its change, as if joints were independent; one that is not known counts as zero."""
    errors = [math.sqrt(np.mean([fit.rms("test")[j] ** 2 for j in joints])) for fit in (first, second)]
    changes = [d.se for d in compare(first, second) if d.joint in joints]
    return *errors, float(np.sqrt(np.nansum(np.square(changes)) / len(joints)))


def of_joint(first: Fit, second: Fit, joint: str) -> Difference:
    """`compare` of one joint that both have."""
    return next(d for d in compare(first, second) if d.joint == joint)


def together(first: Fit, second: Fit, *, weighed: bool = False) -> Difference:
    """Two fits compared over all joints, each joint's residual in units of its RMS under the first:
    `delta_rms` is a share of what the error was. Raises SysidError, as `compare`.

    Args:
        weighed: as the first fit weighs its joints instead, in the unit that comes of that (N m where all count alike).
    """
    sums, joints = _sums(first, second, ("before", "after"))
    (s1, n1), _ = sums
    unit = s1.sum(0) / np.maximum(n1.sum(0), 1)
    known = unit > 0
    if weighed:
        own = np.ones(len(first.joints)) if first.weights is None else first.weights
        unit = own[[first.joints.index(joint) for joint in joints]] ** -2.0
    totals = [((s[:, known] / unit[known]).sum(1), n[:, known].sum(1)) for s, n in sums]
    both = (totals[0][1] > 0) & (totals[1][1] > 0)
    return Difference("before", "after", "*", *_jackknife(*((s[both], n[both]) for s, n in totals)))


def falls(first: Fit, second: Fit, least: float) -> bool:
    """Whether the held-out error over all joints together, in units of their own, falls by more than its standard error and such a share."""
    change = together(first, second)
    return bool(change.delta_rms < -max(change.se, least))


def rises(first: Fit, second: Fit, joints: list[str] | None) -> tuple[Difference, ...]:
    """Where the held-out error of some joints (None: over all together) rises by more than its
    standard error, and by more than rounding."""
    judged = (together(first, second),) if joints is None else compare(first, second, ("before", "after"))
    was = {"*": 1.0, **first.rms("test")}
    return tuple(
        d for d in judged if d.delta_rms > max(d.se, _ROUNDING * was[d.joint]) and (joints is None or d.joint in joints)
    )


def spoiled(first: Fit, others: Sequence[Fit], joints: list[str] | None) -> tuple[Difference, ...]:
    """Joints beside an effect's own whose held-out error rises under each of other fits, by more than twice its standard error and by
    a greater share than any joint's falls; none where the effect has no joint of its own (None)."""
    if joints is None:
        return ()
    found, was = [], first.rms("test")
    for other in others:
        changes = {d.joint: d for d in compare(first, other)}
        shares = {joint: d.delta_rms / was[joint] for joint, d in changes.items() if was[joint] > 0.0}
        fell = max([0.0, *(-share for share in shares.values())])
        found.append({j: d for j, d in changes.items() if j not in joints and shares.get(j, 0.0) > fell and d.delta_rms > 2.0 * d.se})
    return tuple(d for j, d in found[0].items() if all(j in other for other in found))


def _sums(first: Fit, second: Fit, names: tuple[str, str]):
    """Sums of squares and counts of both over the same blocks and joints, and those joints."""
    logs = [[(log["sha256"], log["start"], log["stop"]) for log in fit.logs if log["part"] == "test"] for fit in (first, second)]
    if logs[0] != logs[1]:
        raise SysidError(
            f"{names[0]} and {names[1]} have different test logs", where="compare",
            allowed="experiments with the same data.test", do="give them the same held-out logs",
        )  # fmt: skip
    joints = [joint for joint in first.joints if joint in second.joints]
    if not joints:
        raise SysidError(f"{names[0]} and {names[1]} share no joint", where="compare")
    predictions = [fit.predictions["test"] for fit in (first, second)]
    columns = [[fit.joints.index(joint) for joint in joints] for fit in (first, second)]
    return _block_sums(predictions, columns), joints


def _block_sums(predictions: list[Prediction], columns) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of each prediction, sums of squares and counts (blocks, joints) over the same blocks of each
    log's own clock.

    Blocks are of all rows together: a filter that leaves out more at the ends of a log must not
    shift them.
    """
    ends: dict[int, tuple[float, float]] = {}
    for part in (part for prediction in predictions for part in prediction.parts()):
        for log, (first, last) in extents(part.t, part.log).items():
            before = ends.get(log, (first, last))
            ends[log] = min(first, before[0]), max(last, before[1])
    known, out = Numbering.of(dict(sorted(ends.items())), fewest=1), []
    for prediction, own in zip(predictions, columns):
        squares = counts = np.zeros((known.size, len(own)))
        for part in prediction.parts():
            number, residual = known.numbered(part.t, part.log), part.residual[:, own]
            use = np.ones(residual.shape) if part.use is None else part.use[:, own]
            squares = squares + summed(number, residual**2, known.size)
            counts = counts + summed(number, use, known.size)
        out.append((squares, counts))
    return out


def _jackknife(first, second) -> tuple[float, float]:
    (s1, n1), (s2, n2) = first, second
    rms = lambda s, n: np.sqrt(s / np.maximum(n, 1))  # noqa: E731
    delta = float(rms(s2.sum(), n2.sum()) - rms(s1.sum(), n1.sum()))
    blocks = len(s1)
    if blocks < 3:
        return delta, float("nan")
    without = rms(s2.sum() - s2, n2.sum() - n2) - rms(s1.sum() - s1, n1.sum() - n1)
    return delta, float(jackknife(without))


def document(fits: list[Fit], names: list[str]) -> dict:
    """The JSON document of `sysid compare`: every experiment, then every pair in the order
    given."""
    experiments, notices = [], []
    for fit, name in zip(fits, names):
        errors = fit.predictions["test"].errors()
        by_joint = lambda key: {j: number(v) for j, v in zip(fit.joints, errors[key])}  # noqa: E731, B023
        experiments.append({
            "name": name, "rms_test": dict(zip(fit.joints, fit.predictions["test"].told())), "relative_error": {**by_joint("relative_error"), "*": number(errors["total"][1])},
            "r2": by_joint("r2"), "converged": fit.solution.converged, "globally_optimal": fit.certificate.globally_optimal,
        })  # fmt: skip
        notices += [f"{name}: {notice}" for notice in fit.notices]
    if len({(fit.filters["torque"], fit.filters["standstill"]) for fit in fits}) > 1:
        notices.append("the experiments filter torque or leave out standstill differently: their RMS measure different things")
    if len({tuple((k, fit.filters.get(k)) for k in ("filter", "window", "cutoff")) for fit in fits}) > 1:
        notices.append("the experiments' filters differ: a wider one leaves out more rows at the ends of a log")
    pairs = []
    for k in range(len(fits)):
        for other in range(k + 1, len(fits)):
            for found in compare(fits[k], fits[other], (names[k], names[other])):
                se = number(found.se)
                pairs.append({"from": found.from_, "to": found.to, "joint": found.joint, "delta_rms": found.delta_rms, "se": se})
    return {"experiments": experiments, "differences": pairs, "notices": notices}
