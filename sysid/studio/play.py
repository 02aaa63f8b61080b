"""The test logs played on the robot: where its joints are over time, and how large each one's residual is there."""

from __future__ import annotations

import numpy as np

from ..report import charts, solids
from .look import Looks

_FRAMES, _SPEED = 300, 3.0  # at most; the residual that stands at the end of the scale, in units of the joint's own
_SCALE = [[0, charts.EMPTY], [1 / _SPEED, charts.ORANGE], [1, charts.VERMILLION]]


def play(looks: Looks) -> dict:
    """The chart of the first moment, and for each of the moments the values that change in it.

    Returns:
        {"chart", "time": (f,) [s], "links": (f, 3, k) with None between links, "joints": (f, 3, dof), "levels": (f, dof) RMS
        of the residual around the moment over that of the whole log, None where no row counts}.
    """
    first, fit = looks.first, looks.diagnosis.fit
    rows_, robot = first.rows, fit.model.robot
    q = np.concatenate([piece.q[rows_.index[rows_.piece == k]] for k, piece in enumerate(first.test.pieces)])
    edges = np.linspace(0, len(q), min(_FRAMES, len(q)) + 1).astype(int)
    squares, use = first.residual**2, rows_.use
    around = [slice(a, max(b, a + 1)) for a, b in zip(edges, edges[1:])]
    whole = np.sqrt(squares.sum(0) / np.maximum(use.sum(0), 1))
    levels = np.array([np.where(use[s].any(0), np.sqrt(squares[s].sum(0) / np.maximum(use[s].sum(0), 1)), np.nan) for s in around]) / np.maximum(whole, 1e-300)
    rows = [next((body.row for body in robot.bodies if body.kind == "link" and body.joint == name), 0) for name in fit.joints]
    links, joints, times = [], [], []
    for own in around:
        middle = (own.start + own.stop) // 2
        placed = solids.frames(robot, q[middle])
        links.append(np.concatenate([np.array([a, b, [np.nan] * 3]) for a, b in solids.skeleton(robot, placed)]).T)
        joints.append(np.array([placed[row].translation for row in rows]).T)
        times.append(float(looks.line["t"][middle]))
    every = np.concatenate([np.array(links).transpose(0, 2, 1).reshape(-1, 3), np.zeros((1, 3))])
    every = every[np.isfinite(every).all(1)]
    middle, size = (every.max(0) + every.min(0)) / 2, np.ptp(every, 0)
    size = np.maximum(1.15 * size, 0.3 * max(size.max(), 1e-3))
    spread = lambda values: {key: charts.rounded(values[i], 4) for i, key in enumerate("xyz")}  # noqa: E731
    data = [
        {"type": "scatter3d", "mode": "lines", **spread(links[0]), "line": {"color": charts.INK, "width": 7}, "hoverinfo": "skip", "showlegend": False},
        {
            "type": "scatter3d", "mode": "markers", **spread(joints[0]), "text": [charts.plain(j) for j in fit.joints], "hovertemplate": "%{text}: %{marker.color:.2f} times its own", "showlegend": False,
            "marker": {
                "size": 8, "color": charts.rounded(np.nan_to_num(levels[0]), 3), "cmin": 0, "cmax": _SPEED, "colorscale": _SCALE, "line": {"width": 1, "color": charts.INK},
                "colorbar": {"title": {"text": "residual, times its RMS", "side": "top"}, "orientation": "h", "y": 0, "yanchor": "top", "thickness": 10, "len": 0.6, "outlinewidth": 0},
            },
        },
    ]  # fmt: skip
    layout = {
        "scene": charts.scene(middle, size, (1.4, 1.25, 0.5), -0.15),
        "margin": {"l": 0, "r": 0, "t": 0, "b": 64},
    }  # fmt: skip
    chart = charts.chart("play", "The robot over the test logs, its joints coloured by their residual", data, layout, height=440)
    parts = lambda frames: [[charts.rounded(axis, 4) for axis in frame] for frame in frames]  # noqa: E731
    return {"chart": chart, "time": charts.rounded(times), "links": parts(links), "joints": parts(joints), "levels": [charts.rounded(v, 3) for v in levels], "names": list(fit.joints)}
