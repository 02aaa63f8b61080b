"""The charts of the workspace, as Plotly figures. They compute nothing."""

from __future__ import annotations

import numpy as np

from ..report import charts
from ..report.charts import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, VERMILLION
from ..report.residual_charts import residual_map

_LINES = {
    "measured": (GREY, 1.6, "y", "solid"),
    "predicted beside": (PURPLE, 1.0, "y", "dot"),
    "predicted": (BLUE, 1.2, "y", "solid"),
    "residual beside": (PURPLE, 0.9, "y2", "dot"),
    "residual": (VERMILLION, 1.0, "y2", "solid"),
    "difference": (GREEN, 1.2, "y2", "solid"),
}
_MARKED = 400  # samples in sight below which each is a dot


def time(joint: str, unit: str, t, lines: dict, *, own, breaks, window, shaded) -> dict:
    """Torque over time, and the residual below it.

    Args:
        t (n,); lines: {word of `_LINES`: (n,)}. own: (n, 2) log and its own clock. breaks: places
            before which a log was interrupted. window: what is in sight [s]. shaded: (from, to,
            kind) of events.
    """
    x = charts.rounded(np.insert(np.asarray(t, dtype=float), breaks, np.nan), 7)
    names = {log: charts.plain(log) for log in {log for log, _ in own}}
    named = [[names[log], clock] for log, clock in own]
    left = charts.rounded(np.insert(lines["residual"], breaks, np.nan), 4)
    left = ["–" if value is None else value for value in left]
    told = {
        "measured": np.insert(np.array(named, dtype=object), breaks, None, axis=0).tolist(),
        "predicted": left,
    }
    clock = "%{customdata[0]} at %{customdata[1]} s"
    data = []
    for word, (colour, width, place, dash) in _LINES.items():
        if word not in lines:
            continue
        first = f"{clock}\n" if word == "measured" else ""
        also = f", residual %{{customdata}} {unit}" if word == "predicted" else ""
        data.append({
            "type": "scatter", "mode": "lines+markers" if len(t) < _MARKED else "lines",
            "x": x, "y": charts.rounded(np.insert(lines[word], breaks, np.nan)),
            "name": word, "line": {"color": colour, "width": width, "dash": dash}, "yaxis": place,
            "marker": {"size": 4, "color": colour}, "connectgaps": False,
            **({"customdata": told[word]} if word in told else {}),
            "hovertemplate": f"{first}{word} %{{y:.4g}} {unit}{also}",
        })  # fmt: skip
    shapes = [
        {
            "type": "rect", "xref": "x", "yref": "paper", "x0": low, "x1": high, "y0": 0, "y1": 1,
            "fillcolor": ORANGE, "opacity": 0.3, "line": {"width": 0}, "layer": "below",
        }
        for low, high in charts.joined([s[:2] for s in shaded], 0.002 * (window[1] - window[0]))
    ]  # fmt: skip
    kinds = sorted({kind.replace("_", " ") for *_, kind in shaded})
    notes = [{
        "text": charts.plain("shaded: " + ", ".join(kinds)), "xref": "paper", "yref": "paper",
        "x": 1, "y": 1, "xanchor": "right", "yanchor": "bottom", "showarrow": False,
        "font": {"size": 11},
    }] if kinds else []  # fmt: skip
    quantity = "force" if unit == "N" else "torque"
    layout = {
        "xaxis": charts.axis("time, logs end to end [s]", anchor="y2", range=list(window)),
        "yaxis": charts.axis(f"{quantity} [{unit}]", domain=[0.40, 1.0], fixedrange=True),
        "yaxis2": charts.axis(
            f"residual [{unit}]", domain=[0.0, 0.32], zeroline=True, fixedrange=True
        ),
        "showlegend": True, "legend": charts.LEGEND, "hovermode": "x", "dragmode": "zoom",
        "selectdirection": "h", "shapes": shapes, "annotations": notes,
        "margin": {"l": 66, "r": 14, "t": 34, "b": 46},
    }  # fmt: skip
    label = f"Measured and predicted {quantity} of {joint} over time, and the residual"
    return charts.chart("workspace-time", label, data, layout, height=400)


_CURSOR = {
    "mode": "markers", "x": [None], "y": [None], "hoverinfo": "skip", "showlegend": False,
    "marker": {"size": 13, "color": INK, "symbol": "circle-open", "line": {"width": 2}},
}  # fmt: skip
_PANEL = {"margin": {"l": 62, "r": 10, "t": 30, "b": 46}}


def dots(word: str, joint: str, at, left, direction, t, force: str, unit: str) -> dict:
    """The residual against position or speed, a dot a row, coloured by the direction of motion."""
    colours, hover = {1.0: VERMILLION, -1.0: BLUE, 0.0: GREY}, f"{word} %{{x:.4g}} {unit}\n"
    hover += f"residual %{{y:.4g}} {force}\n%{{customdata}} s"
    data = [{
        "type": "scattergl", "mode": "markers", "x": charts.rounded(at), "showlegend": False,
        "y": charts.rounded(left, 4), "customdata": charts.rounded(t, 6), "hovertemplate": hover,
        "marker": {"size": 4, "opacity": 0.55, "color": [colours[d] for d in direction.tolist()]},
        "selected": {"marker": {"opacity": 0.9}}, "unselected": {"marker": {"opacity": 0.05}},
    }, {"type": "scattergl", **_CURSOR}]  # fmt: skip
    for name, colour in (("forward", VERMILLION), ("backward", BLUE)):
        data.append({
            "type": "scattergl", "mode": "markers", "x": [None], "y": [None], "name": name,
            "marker": {"size": 7, "color": colour}, "hoverinfo": "skip", "showlegend": True,
        })  # fmt: skip
    symbol = "q" if word == "position" else "qd"
    layout = {
        "xaxis": charts.axis(f"{'angle' if unit == 'rad' else word} {symbol} [{unit}]"),
        "yaxis": charts.axis(f"residual [{force}]", zeroline=True), "dragmode": "select",
        "showlegend": True, "legend": charts.LEGEND, "hovermode": "closest", **_PANEL,
    }  # fmt: skip
    label = f"Residual of {joint} against its {word}, coloured by the direction of motion"
    return charts.chart(f"workspace-{word}", label, data, layout, height=300)


def mean_map(joint: str, found: dict, force: str, base: str) -> dict:
    """The mean residual over position and speed, as `residual_charts.residual_map` has it, with a
    place for the cursor."""
    made = residual_map("workspace-map", joint, force, base, found)
    made["figure"]["data"].append({"type": "scatter", **_CURSOR})
    del made["figure"]["layout"]["title"]
    return made


def robot(links, joints, names: list[str]) -> dict:
    """The robot at one moment.

    Args:
        links: (frames, 3, k) [m], NaN between links; joints: (3, dof) of the first.
    """
    every = links.transpose(0, 2, 1).reshape(-1, 3)
    every = np.concatenate([every[np.isfinite(every).all(1)], np.zeros((1, 3))])
    middle, size = (every.max(0) + every.min(0)) / 2, np.ptp(every, 0)
    size = np.maximum(1.15 * size, 0.3 * max(size.max(), 1e-3))

    def spread(values) -> dict:
        return {key: charts.rounded(values[i], 4) for i, key in enumerate("xyz")}

    data = [
        {
            "type": "scatter3d", "mode": "lines", **spread(links[0]), "showlegend": False,
            "line": {"color": INK, "width": 7}, "hoverinfo": "skip",
        },
        {
            "type": "scatter3d", "mode": "markers", **spread(joints), "showlegend": False,
            "text": [charts.plain(name) for name in names],
            "hovertemplate": "%{text}",
            "marker": {
                "size": [8] * len(names), "color": [GREY] * len(names),
                "line": {"width": 1, "color": INK},
            },
        },
    ]  # fmt: skip
    layout = {
        "scene": charts.scene(middle, size, (1.0, 0.9, 0.35), -0.1),
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
    }
    return charts.chart(
        "workspace-robot", "The robot at the moment under the cursor", data, layout, height=300
    )
