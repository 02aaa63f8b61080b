"""Where a model fails, as PNG: the residual over angle and speed, over time, over frequency."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np

from . import figures


def failures(document: dict, out: Path, prismatic: Collection[str] = ()) -> list[Path]:
    """A row for each joint, three panels a row; no path where nothing was questioned.

    Args:
        document: of a diagnosis.
        prismatic: names of the joints that slide (N and m, not N m and rad).
    """
    found = document["fails_where"]
    if not found:
        return []
    plt = figures._pyplot()
    from matplotlib.colors import LinearSegmentedColormap

    shades = LinearSegmentedColormap.from_list(
        "residual", ["#0072B2", "#FDFDFD", "#D55E00"]
    ).with_extremes(bad="#DCDCDC")
    figure, axes = plt.subplots(
        len(found),
        3,
        figsize=(9.6, 2.7 * len(found)),
        squeeze=False,
        gridspec_kw={"width_ratios": (1.25, 1, 1)},
    )
    for (over, time, frequency), entry in zip(axes, found):
        joint = entry["joint"]
        force, base = ("N", "m") if joint in prismatic else ("N m", "rad")
        _map(figure, over, entry["map"], shades, force, base)
        # a dollar would begin a formula
        over.set_title(joint.replace("$", r"\$"), loc="left", fontweight="bold", fontsize=10)
        _time(time, entry["time"], force)
        _frequency(frequency, entry["frequency"])
    return figures._save(figure, out, "where_it_fails", ("png",))


def _numbers(values) -> np.ndarray:
    return np.array(
        [
            [np.nan if v is None else v for v in row]
            if isinstance(row, list)
            else np.nan
            if row is None
            else row
            for row in values
        ],
        dtype=float,
    )


def _map(figure, axis, found: dict, shades, force: str, base: str) -> None:
    mean, rows = _numbers(found["mean"]), _numbers(found["rows"])
    known = np.abs(mean[np.isfinite(mean) & (rows >= 3)])
    most = float(np.quantile(known, 0.95)) if known.size and known.max() > 0 else 1.0
    drawn = axis.pcolormesh(
        found["q"],
        found["qd"],
        np.ma.masked_invalid(mean.T),
        cmap=shades,
        vmin=-most,
        vmax=most,
        rasterized=True,
    )
    axis.grid(visible=False)
    axis.set_xlabel(f"{'angle' if base == 'rad' else 'position'} q [{base}]")
    axis.set_ylabel(f"speed qd [{base}/s]")
    figure.colorbar(drawn, ax=axis, label=f"mean residual [{force}]")


def _time(axis, found: dict, force: str) -> None:
    log, start, rms = (_numbers(found[key]) for key in ("log", "start", "rms"))
    for number, colour in zip(
        np.unique(log),
        ("#D55E00", "#0072B2", "#009E73", "#E69F00", "#CC79A7") * (1 + len(log) // 5),
    ):
        own = log == number
        axis.step(
            start[own],
            rms[own],
            where="post",
            color=colour,
            linewidth=1.2,
            label=f"test log {int(number) + 1}",
        )
    axis.set_ylim(bottom=0)
    axis.set_xlabel("time in the test log [s]")
    axis.set_ylabel(f"low-passed RMS [{force}]")
    if len(np.unique(log)) > 1:
        axis.legend(frameon=False, fontsize=7)


def _frequency(axis, found: dict) -> None:
    edges, share = found["edges"], _numbers(found["share"])
    at = np.arange(len(share))
    axis.bar(at, 100 * np.nan_to_num(share), color="#D55E00", width=0.85)
    axis.set_xticks(
        at,
        [f"{a:g}–{b:g}" for a, b in zip(edges, edges[1:])],
        rotation=60,
        ha="right",
        rotation_mode="anchor",
        fontsize=7,
    )
    axis.grid(visible=False, axis="x")
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel("squared residual [%]")
