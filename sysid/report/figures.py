"""The figures of the studies, as PNG and SVG.

Colours hold in print and for colour-blind eyes (Okabe & Ito 2008).
"""

from pathlib import Path

import numpy as np

COLOURS = {
    "eigenvalue": "#E69F00",
    "exponential": "#009E73",
    "log-cholesky": "#0072B2",
    "linear": "#999999",
}
_FADED, _STRONG = "#0072B2", "#D55E00"


def _pyplot():
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    pyplot.rcParams.update({
        "font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
        "grid.alpha": 0.25, "svg.hashsalt": "sysid", "savefig.dpi": 160,
        "figure.constrained_layout.use": True,
    })  # fmt: skip
    return pyplot


def _save(figure, out: Path, name: str, kinds: tuple[str, ...] = ("png", "svg")) -> list[Path]:
    from ..whole_files import write_atomically

    paths = []
    for kind in kinds:
        path = out / f"{name}.{kind}"
        # the date would make every run another file
        write_atomically(
            path,
            lambda p, k=kind: figure.savefig(
                p, format=k, metadata={"Date": None} if k == "svg" else None
            ),
        )
        paths.append(path)
    _pyplot().close(figure)
    return paths


def bodies(document: dict, out: Path) -> list[Path]:
    """Figure 1 of the paper: histograms of iterations, one panel a parameterization."""
    plt = _pyplot()
    names = list(document["parameterizations"])
    figure, axes = plt.subplots(len(names), 1, figsize=(5.2, 5.4), sharex=True)
    most = max(max(entry["iterations"]) for entry in document["parameterizations"].values())
    for axis, name in zip(axes, names):
        entry = document["parameterizations"][name]
        axis.hist(entry["iterations"], bins=np.arange(0.5, most + 1.5), color=COLOURS[name])
        axis.axvline(entry["median_iterations"], color="black", linewidth=1, linestyle="--")
        axis.set_title(
            f"{name}: median {entry['median_iterations']:g}, "
            f"{entry['failures']} of {document['bodies']} not converged",
            fontsize=9,
        )
        axis.set_ylabel("bodies")
    axes[-1].set_xlabel("iterations until convergence")
    return _save(figure, out, "figure1_iterations")


def sweep(entries: list[dict], out: Path) -> list[Path]:
    """Condition of the Jacobian and iterations as two second moments meet."""
    plt = _pyplot()
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 2.9))
    entries = [entry for entry in entries if entry["gap"] > 0]
    gaps = [entry["gap"] for entry in entries]
    for (name, colour), marker in zip(
        ((n, COLOURS[n]) for n in ("eigenvalue", "exponential", "log-cholesky")), "os^"
    ):
        known = [
            (g, e["condition"][name])
            for g, e in zip(gaps, entries)
            if e["condition"][name] is not None
        ]
        left.plot(*zip(*known), marker=marker, markersize=4, color=colour, label=name)
        right.plot(
            gaps,
            [entry["median_iterations"][name] for entry in entries],
            marker=marker,
            markersize=4,
            color=colour,
            label=name,
        )
    for axis in (left, right):
        axis.set_xscale("log")
        axis.invert_xaxis()
        axis.set_xlabel("relative gap between two second moments")
    left.set_yscale("log")
    left.set_ylabel("median condition of the Jacobian")
    right.set_ylabel("median iterations")
    right.set_ylim(bottom=0)
    left.legend(frameon=False)
    return _save(figure, out, "symmetric_bodies")


def restarts(runs: list[dict], out: Path) -> list[Path]:
    """Figure 3 of the paper: objective and RMS errors against iteration, every start a line."""
    plt = _pyplot()
    figure, axes = plt.subplots(1, 3, figsize=(9.0, 2.9))
    for axis, key, label in zip(
        axes,
        ("objective", "rms_train", "rms_test"),
        ("objective [N² m²]", "RMS on training logs [N m]", "RMS on test logs [N m]"),
    ):
        for run in runs:
            axis.plot(run[key], color=_FADED, linewidth=0.9, alpha=0.5)
            axis.plot(
                len(run[key]) - 1, run[key][-1], marker="o", markersize=3, color=_STRONG, zorder=3
            )
        axis.set_yscale("log")
        axis.set_xlabel("iteration")
        axis.set_ylabel(label)
    axes[0].plot([], [], color=_FADED, label=f"{len(runs)} random starts")
    axes[0].plot([], [], color=_STRONG, marker="o", markersize=3, linestyle="", label="end of each")
    axes[0].legend(frameon=False)
    return _save(figure, out, "figure3_restarts")


def prior(document: dict, out: Path) -> list[Path]:
    """Held-out error against the prior's weight."""
    plt = _pyplot()
    figure, axis = plt.subplots(figsize=(4.8, 3.2))
    axis.plot(document["weights"], document["rms_held_out"], marker="o", markersize=4, color=_FADED)
    axis.axvline(
        document["chosen"], color=_STRONG, linewidth=1, label=f"least error: {document['chosen']:g}"
    )
    axis.axvline(
        document["experiment_weight"],
        color="black",
        linewidth=1,
        linestyle="--",
        label=f"experiment: {document['experiment_weight']:g}",
    )
    axis.set_xscale("log")
    axis.set_xlabel("prior weight γ [N² m²]")
    axis.set_ylabel("held-out RMS [N m]")
    axis.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return _save(figure, out, "prior_weight")
