"""What a model predicts over logs, beside what was measured, and the errors between the two."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .model import Model
from .motion import Motion, Piece
from .robot import Robot


@dataclass(frozen=True)
class States:
    """Where the joints were in some rows of a prediction, spread evenly over it: index (m,) of the row; q, qd (m, dof)."""

    index: np.ndarray
    q: np.ndarray
    qd: np.ndarray


@dataclass(frozen=True)
class Sums:
    """What errors are made of, over the rows that count, each (dof,): squared residuals, squared torques, torques, and how many rows."""

    squares: np.ndarray
    size: np.ndarray
    total: np.ndarray
    counts: np.ndarray

    def __add__(self, other: Sums) -> Sums:
        return Sums(self.squares + other.squares, self.size + other.size, self.total + other.total, self.counts + other.counts)


@dataclass(frozen=True)
class Prediction:
    """Measured and predicted torque over the pieces of one set of logs.

    log (n,) number of the log; t (n,) [s]; measured (n, dof) as logged, filtered where the fit filtered torque;
    predicted (n, dof); use (n, dof) bool, None where every row counts; joints: names, units: N m or N, of each;
    states: of at most `_STATES` rows, None where nobody kept them; still: joints that stand in all of it.
    """

    log: np.ndarray
    t: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    use: np.ndarray | None
    joints: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    states: States | None = None
    still: tuple[str, ...] = ()

    def __repr__(self) -> str:
        errors = ", ".join(f"{joint} {rms:.4g}" for joint, rms in zip(self.joints, self.told()) if rms is not None)
        return f"<Prediction of {len(self.t)} samples: RMS {errors}>"

    def to_dataframe(self):
        """A polars data frame: log, t [s], measured_ and predicted_ torque of each joint, used_ where rows are left out."""
        import polars

        columns = {"log": self.log, "t": self.t}
        for k, joint in enumerate(self.joints):
            columns |= {f"measured_{joint}": self.measured[:, k], f"predicted_{joint}": self.predicted[:, k]}
            columns |= {} if self.use is None else {f"used_{joint}": self.use[:, k]}
        return polars.DataFrame(columns)

    def parts(self) -> Iterator[Prediction]:
        """The prediction in parts that fit in memory, in order."""
        yield self

    def tables(self) -> Iterator:
        """`to_dataframe` in parts that fit in memory, in order."""
        yield self.to_dataframe()

    def thinned(self, most: int) -> Prediction:
        """About so many rows of it, in evenly spaced parts, where it is in files; else itself."""
        return self

    def lazy(self):
        """`to_dataframe` as polars' lazy frame: of what is in files nothing is read."""
        return self.to_dataframe().lazy()

    @property
    def residual(self) -> np.ndarray:
        """measured - predicted (n, dof), zero on rows that do not count."""
        residual = self.measured - self.predicted
        return residual if self.use is None else np.where(self.use, residual, 0.0)

    def of_joint(self, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Measured and predicted torque of a joint and their difference, (n,) each; the difference is NaN where a row
        does not count."""
        measured, predicted, use = self._columns(joint)
        left = measured - predicted
        return measured, predicted, left if use is None else np.where(use, left, np.nan)

    def _columns(self, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        own = (np.ascontiguousarray(v[:, joint]) for v in (self.measured, self.predicted))
        return *own, None if self.use is None else self.use[:, joint]

    @property
    def counts(self) -> np.ndarray:
        """(dof,) rows that count."""
        n, dof = self.measured.shape
        return np.full(dof, n) if self.use is None else self.use.sum(0)

    def sums(self) -> Sums:
        """What errors are made of."""
        return self._sums

    @cached_property
    def _sums(self) -> Sums:
        # joint by joint: copies of all torques of a long log's span would stand beside it
        found = []
        for joint in range(self.measured.shape[1]):
            measured, predicted, use = self._columns(joint)
            kept, left = (v if use is None else np.where(use, v, 0.0) for v in (measured, measured - predicted))
            found.append((left @ left, kept @ kept, kept.sum()))
        return Sums(*np.array(found).T, self.counts)

    def greatest(self, count: int) -> np.ndarray:
        """(count, dof) the greatest sizes of each joint's measured torque, falling; fewer where there are fewer rows."""
        least = len(self.measured) - min(count, len(self.measured))
        falling = lambda size: -np.sort(-np.partition(size, least)[least:])  # noqa: E731
        return np.stack([falling(np.abs(own)) for own in self.measured.T], axis=1)

    def told(self) -> list[float | None]:
        """RMS [N m] of each joint, None where no row of it counts."""
        return [float(rms) if count else None for rms, count in zip(self.errors()["rms"], self.counts)]

    def errors(self) -> dict[str, np.ndarray]:
        """`rms` [N m], `relative_error` (norm of the residual over that of the torque), `r2`, each (dof,), and their
        totals over all joints under `total`; NaN where the torque itself is zero or constant. The RMS of a joint no row
        of which counts is zero: `told` says None."""
        sums = self.sums()
        squares, size, counts = sums.squares, sums.size, np.maximum(sums.counts, 1)
        spread = size - sums.total**2 / counts
        # a spread that is rounding of a constant is none
        spread = np.where(spread > 1e-12 * size, spread, 0.0)
        share = lambda part, whole: np.divide(part, whole, out=np.full(np.shape(whole), np.nan), where=np.asarray(whole) > 0)  # noqa: E731
        return {
            "rms": np.sqrt(squares / counts),
            "relative_error": np.sqrt(share(squares, size)),
            "r2": 1.0 - share(squares, spread),
            "total": np.array([
                np.sqrt(squares.sum() / max(self.counts.sum(), 1)), float(np.sqrt(share(squares.sum(), size.sum()))), 1.0 - float(share(squares.sum(), spread.sum())),
            ]),
        }  # fmt: skip

    def plot(self):
        """Measured and predicted torque of every joint, as a Matplotlib figure."""
        from .picture import Picture

        dof = len(self.joints)
        figure = Picture(10.0, 1.0 + 1.8 * dof)
        for j, axes in enumerate(np.atleast_1d(figure.subplots(dof, 1, sharex=True))):
            for values, label in ((self.measured, "measured"), (self.predicted, "predicted")):
                axes.plot(self.t, values[:, j], linewidth=0.8, label=label)
            axes.set_ylabel(f"{self.joints[j]} [{self.units[j]}]")
        axes.set_xlabel("time [s]")
        figure.axes[0].legend(loc="upper right")
        return figure


def units(robot: Robot) -> tuple[str, ...]:
    """The unit of each joint's torque."""
    return tuple("N" if slides else "N m" for slides in robot.prismatic)


def predict(model: Model, x, motion: Motion) -> Prediction:
    """Torque that a model with parameters x (size,) predicts over a motion."""
    count = 10 * model.bodies
    pi, c = np.asarray(x)[:count].reshape(-1, 10), np.asarray(x)[count:]
    pieces = motion.pieces
    joined = lambda parts: parts[0] if len(parts) == 1 else np.concatenate(parts)  # noqa: E731 - no copy of a long log
    return Prediction(
        log=joined([np.full(piece.samples, piece.log, dtype=np.int16) for piece in pieces]),
        t=joined([piece.t[piece.core] for piece in pieces]),
        measured=joined([piece.tau[piece.core] for piece in pieces]),
        predicted=joined([model.torque(piece, pi, c) for piece in pieces]),
        use=None if pieces[0].use is None else joined([piece.use[piece.core] for piece in pieces]),
        joints=model.robot.joints, units=units(model.robot), states=_states(motion), still=tuple(motion.still),
    )


_STATES = 20_000  # rows: more than a screen has points


def _states(motion: Motion) -> States:
    first, parts = 0, []
    for piece in motion.pieces:
        parts.append(states(piece, first, motion.samples))
        first += piece.samples
    return joined_states(parts)


def states(piece: Piece, first: int, samples: int) -> States:
    """Where the joints were in a piece that stands from row `first` on in a prediction of so many rows."""
    stride = max(1, -(-samples // _STATES))
    own = np.arange(-first % stride, piece.samples, stride)
    rows = piece.core.start + own
    return States(first + own, piece.q[rows], piece.qd[rows])


def joined_states(parts: Sequence[States]) -> States:
    """Those of all pieces, one after the other."""
    return States(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("index", "q", "qd")))
