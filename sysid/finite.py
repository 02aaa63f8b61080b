"""What can be a measurement: numbers that are finite, and no larger than any unit makes them."""

import numpy as np

from .errors import LogError
from .outliers import SPIKE, runs

_OFTEN = 0.2  # of the rows: samples that are empty as often are of another rate
_LARGEST = 1e20  # no unit makes a measured signal larger (a clock in ns, logged as a signal, reads 2e18)


def filled(values, name: str, where: str) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Values (n,) with straight lines where nothing was written, and the first and the last row of every such stretch.

    Raises:
        LogError: nothing was written at all, in most of the rows, or in every other row or so.
    """
    empty = np.isnan(values)
    if not empty.any():
        return values, []
    if empty.all():
        raise LogError(f"{name} is empty", where=where, do="leave the file out, or name the joint in data.unused")
    found = runs(empty)
    alone = sum(b - a + 1 for a, b in found if b - a < SPIKE)
    if 2 * empty.sum() > len(values) or alone > _OFTEN * len(values):
        seldom = "leave the rows without it out: what is left is as fast as it was logged"
        do = seldom if alone > _OFTEN * len(values) else "leave the file out, or name the joint in data.unused, and the other joints keep all their rows"
        raise LogError(f"{name} is written in {100 * (1 - empty.mean()):.2g} % of the rows", where=where, allowed="a value in most rows", do=do)
    rows = np.arange(len(values))
    return np.where(empty, np.interp(rows, rows[~empty], values[~empty]), values), found


def check_finite(values, name: str, where: str, *, joints=(), t=None, first: int = 0) -> None:
    """Whether values (n,), or (n, dof) of joints, from row `first` of a log on, can be a measurement.

    Args:
        t: (n,) [s], where it is known by now.

    Raises:
        LogError: one is no number, or larger than any unit makes it.
    """
    if values.max() <= _LARGEST and values.min() >= -_LARGEST:
        return  # only a bad log pays for the search; a NaN fails both comparisons
    row, *column = (int(k) for k in np.argwhere(~(np.abs(values) <= _LARGEST))[0])
    joint = f" of joint {joints[column[0]]!r}" if column else ""
    bad = int(np.sum(~(np.abs(values.reshape(len(values), -1)) <= _LARGEST).all(axis=1)))
    left = "leave the row out" if bad == 1 else f"leave the row, and {bad - 1} more like it, out"
    do = f"{left}; a gap is split there" if bad < len(values) else "no row of it is a number: name another column for it, or leave the file out"
    at = "" if t is None else f", t = {t[row]:.6g} s"
    raise LogError(
        f"{name.removeprefix('signals.')}{joint} is {values[row, *column]:g}", where=f"{where} row {first + row} counted from 0{at}",
        allowed=f"finite numbers, at most {_LARGEST:g} in size", do=do,
    )  # fmt: skip
