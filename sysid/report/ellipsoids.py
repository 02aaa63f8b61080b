"""The chart of the bodies in space."""

from __future__ import annotations

import numpy as np

from .charts import BLUE, GREY, INK, ORANGE, PURPLE, chart, plain, rounded, scene


def bodies(name: str, found: list[dict], lines: list) -> dict:
    """The bodies as ellipsoids on the robot.

    Args:
        found: [{"name", "kind", "words", "told", "identified": Solid | None, "prior": Solid |
            None}], told: the share of it that the data say; 0 draws a ghost.
        lines: pairs of ends (3,) [m] of the links.
    """
    data = []
    shown = set()
    for entry in found:
        ghost = entry["told"] <= 0.0
        colour = GREY if ghost else BLUE if entry["kind"] == "link" else PURPLE
        group = f"{entry['kind']}, prior alone" if ghost else f"{entry['kind']}, identified"
        if entry["identified"] is not None:
            points, faces = entry["identified"].surface()
            first = group not in shown
            shown.add(group)
            data.append(
                {
                    "type": "mesh3d",
                    **{key: rounded(points[:, k], 4) for k, key in enumerate("xyz")},
                    **{key: faces[:, k].tolist() for k, key in enumerate("ijk")},
                    "color": colour,
                    "opacity": 0.12 if ghost else round(0.3 + 0.3 * entry["told"], 2),
                    "flatshading": False,
                    "name": group,
                    "legendgroup": group,
                    "showlegend": first,
                    "hovertemplate": f"{plain(entry['name'])}: {plain(entry['words'])}",
                }
            )
        if entry["prior"] is not None:
            ring = entry["prior"].rings()
            data.append(
                {
                    "type": "scatter3d",
                    "mode": "lines",
                    **{key: rounded(ring[:, k], 4) for k, key in enumerate("xyz")},
                    "line": {"color": ORANGE, "width": 3},
                    "name": "prior",
                    "legendgroup": "prior",
                    "showlegend": "prior" not in shown,
                    "hovertemplate": f"{plain(entry['name'])}: prior",
                }
            )
            shown.add("prior")
    skeleton = (
        np.concatenate([np.array([a, b, [np.nan] * 3], dtype=float) for a, b in lines])
        if lines
        else np.zeros((0, 3))
    )
    data.append(
        {
            "type": "scatter3d",
            "mode": "lines+markers",
            **{key: rounded(skeleton[:, k], 4) for k, key in enumerate("xyz")},
            "line": {"color": INK, "width": 5},
            "marker": {"size": 4, "color": INK},
            "name": "joints and links",
            "hoverinfo": "skip",
            "showlegend": True,
        }
    )
    middle, size = _box(found, skeleton)
    layout = {
        "scene": scene(middle, size, (1.2, 1.05, 0.4), -0.1),
        "showlegend": True,
        "legend": {"orientation": "h", "x": 0, "y": 0, "yanchor": "top", "xanchor": "left"},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 60},
    }
    return chart(
        name,
        "The bodies as ellipsoids of equal mass and inertia on the robot, identified and prior",
        data,
        layout,
        height=540,
    )


def _box(found: list[dict], skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Middle and edges of a box around the robot: the links, the priors, and of the identified
    bodies as much as is no longer than the longest prior."""
    priors = [entry["prior"] for entry in found if entry["prior"] is not None]
    longest = max((solid.axes.max() for solid in priors), default=0.1)
    points = [skeleton, *(solid.surface(6)[0] for solid in priors)]
    for entry in found:
        if entry["identified"] is not None:
            around = entry["identified"].surface(6)[0]
            points.append(
                around[np.linalg.norm(around - entry["identified"].centre, axis=1) <= 1.5 * longest]
            )
    every = np.concatenate(points)
    every = every[np.isfinite(every).all(1)]
    if not len(every):
        return np.zeros(3), np.ones(3)
    most = max(np.ptp(every, 0).max(), 1e-3)
    return (every.max(0) + every.min(0)) / 2, np.maximum(1.15 * np.ptp(every, 0), 0.3 * most)
