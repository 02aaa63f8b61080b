"""The benchmark's three figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sysid import whole_files

from .hidden import EFFECTS
from .scoring import CATEGORIES, NAMED, WITHIN
from .wording import span

_BLUE, _ORANGE, _GREEN, _RED, _GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#999999"
_COLOURS = {
    "alone": _BLUE,
    "head of family": "#56B4E9",
    "in family, not head": _GREEN,
    "named among also": "#F0E442",
    "wrong": _RED,
    "unknown": _ORANGE,
    "unresolved": "#CC79A7",
    "missed": _GREY,
    "error": "black",
}


def figures(
    found: dict, records: list[dict], out: Path, name: str = "blind_benchmark"
) -> list[Path]:
    """Write the figures into a folder."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    out.mkdir(parents=True, exist_ok=True)
    style = {
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "savefig.dpi": 140,
        "figure.constrained_layout.use": True,
    }
    with matplotlib.rc_context(style):
        drawn = {
            "confusion": _draw_confusion(plt, found["confusion"]),
            "errors": _draw_errors(plt, found["rows"], records),
            "effects": _draw_effects(plt, found),
        }
        paths = []
        for part, figure in drawn.items():
            path = out / f"{name}_{part}.png"
            whole_files.write_atomically(path, lambda p, f=figure: f.savefig(p, format="png"))
            plt.close(figure)
            paths.append(path)
    return paths


def _draw_confusion(plt, table: dict):
    counts = np.array(table["counts"], dtype=float)
    rows = np.flatnonzero(counts.sum(1))
    columns = np.flatnonzero(counts.sum(0))
    counts = counts[np.ix_(rows, columns)] if len(rows) else np.zeros((1, 1))
    total = np.maximum(counts.sum(1, keepdims=True), 1.0)
    figure, axis = plt.subplots(
        figsize=(2.5 + 0.27 * counts.shape[1], 2.2 + 0.22 * counts.shape[0])
    )
    axis.imshow(counts / total, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for y, x in zip(*np.nonzero(counts)):
        axis.text(
            x,
            y,
            f"{counts[y, x]:.0f}",
            ha="center",
            va="center",
            fontsize=7,
            color="white" if counts[y, x] > 0.6 * total[y, 0] else "black",
        )
    axis.set_xticks(
        range(len(columns)),
        [table["named"][k] for k in columns],
        rotation=60,
        ha="right",
        fontsize=7,
    )
    axis.set_yticks(range(len(rows)), [table["hidden"][k] for k in rows], fontsize=7)
    border = sum(table["hidden"][k] in EFFECTS for k in rows)
    for line in (border, sum(table["hidden"][k] != "nothing" for k in rows)):
        axis.axhline(line - 0.5, color="black", linewidth=0.8)
    axis.set_xlabel("named on its joint (colour: share of the row)")
    axis.set_ylabel(
        "hidden and visible; below the lines: outside the catalogue, nothing (by joint)"
    )
    return figure


def _draw_errors(plt, rows: list[dict], records: list[dict]):
    noise = {r["key"]: r.get("noise") for r in records}
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.2))
    whole = [r for r in rows if r["category"] != "error" and r["visible"] and noise[r["key"]]]
    for says, colour, own in (
        ("named", _BLUE, [r for r in whole if r["category"] in (*NAMED, "explained")]),
        ("called unknown", _ORANGE, [r for r in whole if r["category"] == "unknown"]),
        ("else", _RED, [r for r in whole if r["category"] not in (*NAMED, "explained", "unknown")]),
    ):  # fmt: skip
        for axis, key, marker in (
            (left, "before", "x"),
            (left, "after", "o"),
            (right, "after", "o"),
        ):
            if key == "before":
                axis.scatter(
                    [r["true"] / r["scale"] for r in _scaled(own, noise)],
                    [r["before"] / r["scale"] for r in _scaled(own, noise)],
                    s=12,
                    marker=marker,
                    color=colour,
                    alpha=0.35,
                    linewidths=0.8,
                )
            elif axis is left:
                axis.scatter(
                    [r["true"] / r["scale"] for r in _scaled(own, noise)],
                    [r["after"] / r["scale"] for r in _scaled(own, noise)],
                    s=12,
                    color=colour,
                    alpha=0.8,
                    label=f"{says} ({len(own)})",
                )
            else:
                own = [r for r in own if r["true"] > 0.0]
                axis.scatter(
                    [r["lowered"] for r in own],
                    [r["after"] / r["true"] for r in own],
                    s=12,
                    color=colour,
                    alpha=0.8,
                )
    left.scatter([], [], marker="x", color=_GREY, label="before")
    left.scatter([], [], color=_GREY, label="after discover")
    low, high = left.get_xlim()[0], left.get_ylim()[1]
    left.plot([max(low, 0.5), high], [max(low, 0.5), high], color="black", linewidth=0.8)
    left.set_xscale("log")
    left.set_yscale("log")
    left.set_xlabel("held-out RMS of the true model, in units of the torque noise")
    left.set_ylabel("held-out RMS, same units")
    left.legend(frameon=False, fontsize=8)
    right.axhline(1.0 + WITHIN, color="black", linewidth=0.8, linestyle="--")
    right.axhline(1.0, color="black", linewidth=0.8)
    right.set_yscale("log")
    for which in (right.yaxis.set_major_formatter, right.yaxis.set_minor_formatter):
        which(plt.FuncFormatter(lambda value, place: f"{value:g}"))
    right.set_xlabel("share of the held-out RMS that the true model takes away")
    right.set_ylabel("held-out RMS after discover / of the true model")
    return figure


def _scaled(rows: list[dict], noise: dict) -> list[dict]:
    return [r | {"scale": max(noise[r["key"]][r["joint"]], 1e-300)} for r in rows]


def _draw_effects(plt, found: dict):
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 5.6), width_ratios=(1.2, 1.0))
    names = [e for e in EFFECTS if found["effects"][e]["hidden"]][::-1]
    at = np.zeros(len(names))
    for c in CATEGORIES:
        values = np.array([found["effects"][e][c] for e in names], dtype=float)
        if values.any():
            left.barh(range(len(names)), values, left=at, color=_COLOURS[c], label=c, height=0.75)
        at = at + values
    hidden = [found["effects"][e]["hidden"] for e in names]
    left.barh(
        range(len(names)),
        np.array(hidden) - at,
        left=at,
        color="none",
        edgecolor=_GREY,
        linewidth=0.6,
        height=0.75,
        label="not visible",
    )
    left.set_yticks(range(len(names)), names, fontsize=8)
    left.set_xlabel("cases")
    left.xaxis.get_major_locator().set_params(integer=True)
    left.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    bins = [b for b in found["by_lowered"] if b["named"]["of"]]
    for key, colour, shift in (
        ("named", _BLUE, -0.08),
        ("alone", _GREEN, 0.0),
        ("wrong", _RED, 0.08),
    ):
        values = (
            np.array([[b[key]["share"], b[key]["low"], b[key]["high"]] for b in bins])
            if bins
            else np.zeros((0, 3))
        )
        right.errorbar(
            np.arange(len(bins)) + shift,
            values[:, 0],
            [values[:, 0] - values[:, 1], values[:, 2] - values[:, 0]],
            fmt="o-",
            color=colour,
            markersize=4,
            linewidth=1,
            capsize=2,
            label={
                "named": "named (alone or head)",
                "alone": "named alone",
                "wrong": "another effect named",
            }[key],
        )
    right.set_xticks(
        range(len(bins)),
        [f"{span(b).replace(' %', '')}\n({b['named']['of']})" for b in bins],
        fontsize=8,
    )
    right.set_ylim(0.0, 1.02)
    right.grid(alpha=0.25)
    right.set_xlabel("what the true model takes away of the held-out RMS [%] (cases)")
    right.set_ylabel("share of cases, 95 % intervals")
    right.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure
