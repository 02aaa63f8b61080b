"""Charts as Plotly figure dictionaries: {id, label, height, link, figure: {data, layout}}. Nothing of physics is computed.

The colours are Okabe and Ito's (2008), as in the printed figures; the page turns them for a dark screen. Plotly reads
markup in its texts: whatever comes from a file goes through `plain`.
"""

from __future__ import annotations

import html
import math

import numpy as np

from .decimate import broken

INK, GREY, BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY = "#000000", "#999999", "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9"
MIDDLE, EMPTY = "#FDFDFD", "#DCDCDC"  # of a map's scale; cells where no row is
_MOST, _BUDGET = 2000, 150_000  # points a trace; points of all torque traces together


def plain(text) -> str:
    """A text as Plotly shows it letter by letter."""
    return html.escape(str(text), quote=False)


def rounded(values, digits: int = 5) -> list:
    """Numbers as JSON can hold them, to so many significant digits; None for NaN and infinity."""
    return [float(f"{v:.{digits}g}") if math.isfinite(v) else None for v in np.asarray(values, dtype=float).ravel().tolist()]


def chart(name: str, label: str, data: list, layout: dict, *, height: int, link: str | None = None) -> dict:
    """A chart as the page embeds it. name: of the element, letters and digits; label: for those who cannot see it."""
    base = {"autosize": True, "height": height, "margin": {"l": 62, "r": 14, "t": 26, "b": 46}, "showlegend": False, "font": {"size": 12}, "uirevision": "kept"}
    return {"id": name, "label": label, "height": height, "link": link, "figure": {"data": data, "layout": base | layout}}


def axis(title: str, **more) -> dict:
    """An axis that says quantity and unit."""
    return {"title": {"text": title, "standoff": 6, "font": {"size": 12}}, "automargin": True, "zeroline": False} | more


LEGEND = {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "xanchor": "left", "itemwidth": 30, "font": {"size": 11}}


# ---- torque over time


def timeline(parts: dict) -> dict:
    """Where each log stands when all are laid end to end.

    Args:
        parts: {"train": (log (n,), t (n,), names), "test": ...}.

    Returns:
        {part: {"t": (n,), "breaks": indices, "spans": [(begin, end, name)], "starts": the logs' own first times [s]}}.
    """
    out, end = {}, 0.0
    for part, (log, t, names) in parts.items():
        log, t = np.asarray(log), np.asarray(t, dtype=float)
        moved, spans, lows = np.zeros(len(t)), [], []
        starts = np.append(0, np.flatnonzero(np.diff(log)) + 1) if len(t) else []
        for number, (a, b) in enumerate(zip(starts, [*starts[1:], len(t)])):
            low, high = float(t[a:b].min()), float(t[a:b].max())
            moved[a:b] = t[a:b] - low + end
            name = names[int(log[a])] if int(log[a]) < len(names) else f"log {number + 1}"
            spans.append((end, end + high - low, name))
            lows.append(low)
            end += (high - low) * 1.02 + 1e-9
        steps = np.diff(moved)
        usual = float(np.median(steps)) if len(steps) else 0.0
        out[part] = {"t": moved, "breaks": np.flatnonzero((steps > 1.5 * usual + 1e-12) | (steps < 0)) + 1, "spans": spans, "starts": lows}
    return out


def torque(name: str, joint: str, unit: str, line: dict, series: dict, joints: int, events=()) -> dict:
    """Measured and predicted torque over the logs laid end to end, the residual below on the same axis.

    Args:
        line: of `timeline`. series: {part: (measured (n,), predicted (n,), residual (n,))}. events: (begin, end) on the
            same axis of what disturbed this joint's log, shaded.
    """
    most = int(np.clip(_BUDGET // (6 * max(joints, 1)), 300, _MOST))
    data = []
    for number, (part, columns) in enumerate(series.items()):
        for what, values, colour, width, place in zip(("measured", "predicted", "residual"), columns, (GREY, BLUE, VERMILLION), (1.6, 1.1, 0.9), ("y", "y", "y2")):
            t, y = broken(line[part]["t"], values, line[part]["breaks"], most)
            data.append({
                "type": "scatter", "mode": "lines", "x": rounded(t, 6), "y": rounded(y, 4), "name": what, "legendgroup": what, "showlegend": number == 0,
                "line": {"color": colour, "width": width}, "yaxis": place, "xaxis": "x", "connectgaps": False,
                "hovertemplate": f"{part}, {what}: %{{y:.4g}} {unit}",
            })  # fmt: skip
    shapes, notes = [], []
    for part, own in line.items():
        for begin, end, _ in own["spans"]:
            if part == "test":
                shapes.append({"type": "rect", "xref": "x", "yref": "paper", "x0": begin, "x1": end, "y0": 0, "y1": 1, "fillcolor": SKY, "opacity": 0.13, "line": {"width": 0}, "layer": "below"})
        if own["spans"]:
            word = "train" if part == "train" else "test (held out)"
            notes.append({"text": word, "xref": "x", "yref": "paper", "x": own["spans"][0][0], "y": 0.995, "xanchor": "left", "yanchor": "top", "showarrow": False, "font": {"size": 11, "weight": "bold"}})
    end = max((span[1] for own in line.values() for span in own["spans"]), default=1.0)
    shapes += [
        {
            "type": "rect", "xref": "x", "yref": "paper", "x0": float(f"{low:.6g}"), "x1": float(f"{high:.6g}"), "y0": 0, "y1": 1,
            "fillcolor": ORANGE, "opacity": 0.35, "line": {"width": 0}, "layer": "below",
        }
        for low, high in joined(events, 0.002 * end)
    ]  # fmt: skip
    layout = {
        "xaxis": axis("time, logs end to end [s]", anchor="y2", range=[0.0, float(f"{end:.6g}")]), "yaxis": axis(f"torque [{unit}]" if unit == "N m" else f"force [{unit}]", domain=[0.38, 1.0]),
        "yaxis2": axis(f"residual [{unit}]", domain=[0.0, 0.30], zeroline=True), "shapes": shapes, "annotations": notes, "showlegend": True,
        "legend": LEGEND, "hovermode": "x", "dragmode": "zoom", "margin": {"l": 66, "r": 14, "t": 34, "b": 46},
    }  # fmt: skip
    return chart(name, f"Measured and predicted {'torque' if unit == 'N m' else 'force'} of {joint} over time, and the residual", data, layout, height=380, link="time")


def joined(spans, least: float) -> list[tuple[float, float]]:
    """Spans of time in order, none shorter than `least`, those that then touch as one."""
    out: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        middle, half = (low + high) / 2, max(high - low, least) / 2
        low, high = middle - half, middle + half
        if out and low <= out[-1][1]:
            out[-1] = out[-1][0], max(out[-1][1], high)
        else:
            out.append((low, high))
    return out


# ---- the staircase


def staircase(name: str, joint: str, unit: str, names: list[str], made: list, expected: list, level: float | None, doubt: float | None) -> dict:
    """The held-out error of a joint over the steps, against its noise floor.

    Args:
        names: of the steps, the first is the start. made, expected: (steps,) RMS or None; expected ones are drawn broken.
    """
    at = list(range(len(names)))
    data = []
    if level is not None:
        ends = [-0.5, len(names) - 0.5]
        if doubt:
            data.append({"type": "scatter", "mode": "lines", "x": ends + ends[::-1], "y": rounded([level + 2 * doubt] * 2 + [max(level - 2 * doubt, 0.0)] * 2), "fill": "toself", "fillcolor": GREEN, "opacity": 0.2, "line": {"width": 0, "color": GREEN}, "hoverinfo": "skip", "showlegend": False})
        data.append({"type": "scatter", "mode": "lines", "x": ends, "y": rounded([level] * 2), "name": "noise floor", "line": {"color": GREEN, "width": 2, "dash": "dot"}, "hovertemplate": f"noise floor %{{y:.4g}} {unit}"})
    for values, word, dash, symbol in ((made, "held-out error", "solid", "circle"), (expected, "expected by the diagnosis", "dash", "circle-open")):
        if any(v is not None for v in values):
            shown = [v if v is not None and math.isfinite(v) else None for v in values]
            data.append({
                "type": "scatter", "mode": "lines+markers", "x": at, "y": shown, "name": word, "line": {"color": BLUE, "width": 2, "shape": "hvh", "dash": dash},
                "marker": {"size": 8, "symbol": symbol}, "text": [plain(n) for n in names], "hovertemplate": f"%{{text}}, {word}: %{{y:.4g}} {unit}",
            })  # fmt: skip
    layout = {
        "title": {"text": plain(joint), "x": 0.01, "y": 0.99, "yanchor": "top", "font": {"size": 14}},
        "xaxis": axis("step", tickvals=at, ticktext=[plain(n) for n in names], range=[-0.5, len(names) - 0.5], showgrid=False),
        "yaxis": axis(f"held-out RMS [{unit}]", rangemode="tozero"), "margin": {"l": 62, "r": 14, "t": 36, "b": 46},
    }  # fmt: skip
    return chart(name, f"Held-out error of {joint} over the steps against its noise floor", data, layout, height=270)


# ---- where it fails


def residual_map(name: str, joint: str, unit: str, base: str, found: dict) -> dict:
    """The mean residual over angle (or position) and speed."""
    quantity = "angle" if base == "rad" else "position"
    mean = np.array([[np.nan if v is None else v for v in row] for row in found["mean"]], dtype=float).reshape(len(found["q"]) - 1, -1)
    rows = np.array(found["rows"], dtype=float)
    known = np.sort(np.abs(mean[np.isfinite(mean) & (rows >= 3)]))
    most = float(known[int(0.95 * (len(known) - 1))]) if len(known) else 1.0
    middle = lambda edges: rounded((np.asarray(edges[1:], float) + np.asarray(edges[:-1], float)) / 2)  # noqa: E731
    data = [{
        "type": "heatmap", "x": middle(found["q"]), "y": middle(found["qd"]), "z": [rounded(row, 3) for row in mean.T], "zmin": -most or -1.0, "zmax": most or 1.0,
        "customdata": [[int(v) for v in row] for row in rows.T.tolist()], "colorscale": [[0, BLUE], [0.5, MIDDLE], [1, VERMILLION]], "hoverongaps": False, "xgap": 1, "ygap": 1,
        "colorbar": {"title": {"text": f"mean residual [{unit}]", "side": "right", "font": {"size": 12}}, "thickness": 10, "len": 1.0, "outlinewidth": 0},
        "hovertemplate": f"{quantity} %{{x:.3g}} {base}\nspeed %{{y:.3g}} {base}/s\nmean residual %{{z:.3g}} {unit}\n%{{customdata}} rows",
    }]  # fmt: skip
    layout = {
        "xaxis": axis(f"{quantity} q [{base}]", showgrid=False), "yaxis": axis(f"speed qd [{base}/s]", showgrid=False), "plot_bgcolor": EMPTY,
        "title": {"text": f"over {quantity} and speed", "x": 0.01, "y": 0.99, "yanchor": "top", "font": {"size": 13}},
        "margin": {"l": 60, "r": 10, "t": 34, "b": 46},
    }  # fmt: skip
    return chart(name, f"Mean residual of {joint} over {quantity} and speed", data, layout, height=300)


def residual_time(name: str, joint: str, unit: str, found: dict) -> dict:
    """The residual's RMS over time, a line for each log."""
    data = []
    numbers = sorted(set(found["log"]))
    for k, number in enumerate(numbers):
        own = [(t, v) for log, t, v in zip(found["log"], found["start"], found["rms"]) if log == number]
        if len(own) > 1:  # the last window is as wide as the others
            own.append((own[-1][0] + float(np.median(np.diff([t for t, _ in own]))), own[-1][1]))
        data.append({
            "type": "scatter", "mode": "lines", "x": rounded([t for t, _ in own]), "y": rounded([np.nan if v is None else v for _, v in own], 4), "name": f"test log {int(number) + 1}",
            "line": {"shape": "hv", "width": 1.6, "color": (VERMILLION, BLUE, GREEN, ORANGE, PURPLE)[k % 5]}, "hovertemplate": f"%{{x:.3g}} s: %{{y:.3g}} {unit}",
        })  # fmt: skip
    layout = {
        "xaxis": axis("time in the test log [s]"), "yaxis": axis(f"residual RMS [{unit}]", rangemode="tozero"), "showlegend": len(numbers) > 1, "legend": LEGEND,
        "title": {"text": "over time", "x": 0.01, "y": 0.99, "yanchor": "top", "font": {"size": 13}}, "margin": {"l": 60, "r": 10, "t": 34 if len(numbers) < 2 else 58, "b": 46},
    }  # fmt: skip
    return chart(name, f"RMS residual of {joint} over time", data, layout, height=300)


def residual_bands(name: str, joint: str, found: dict) -> dict:
    """The share of the squared residual in each band of frequency."""
    edges = found["edges"]
    names = [f"{a:g}–{b:g}" for a, b in zip(edges, edges[1:])]
    data = [{"type": "bar", "x": names, "y": rounded([100.0 * (v or 0.0) for v in found["share"]], 4), "marker": {"color": VERMILLION}, "hovertemplate": "%{x} Hz: %{y:.3g} %"}]
    layout = {
        "xaxis": axis("frequency [Hz]", type="category", tickangle=-45, showgrid=False), "yaxis": axis("squared residual [%]", rangemode="tozero"),
        "title": {"text": "over frequency", "x": 0.01, "y": 0.99, "yanchor": "top", "font": {"size": 13}}, "margin": {"l": 60, "r": 10, "t": 34, "b": 46},
    }  # fmt: skip
    return chart(name, f"Share of the squared residual of {joint} in bands of frequency", data, layout, height=300)


# ---- parameters


def whiskers(name: str, label: str, groups: list[dict]) -> dict:
    """Values with two standard deviations beside their priors, one panel a unit.

    Args:
        groups: [{"unit", "names", "values", "stds", "priors", "shares"}], priors None where there is none.
    """
    # the legend's dot is not pale, whatever the first value is
    data: list[dict] = [{"type": "scatter", "mode": "markers", "x": [None], "y": [None], "name": "identified, ± 2 std", "marker": {"color": BLUE, "size": 8}, "showlegend": True, "hoverinfo": "skip"}]
    layout: dict = {}
    sizes = [len(g["names"]) + 1.6 for g in groups]
    total, gap, top = sum(sizes) + 2.2 * (len(groups) - 1), 2.2, 0.0
    for k, (group, size) in enumerate(zip(groups, sizes)):
        number = "" if k == 0 else str(k + 1)
        names = [plain(n) for n in group["names"]]
        stds = [2 * s if s is not None and math.isfinite(s) else 0.0 for s in group["stds"]]
        data.append({
            "type": "scatter", "mode": "markers", "x": rounded(group["values"]), "y": names, "name": "identified, ± 2 std", "showlegend": False,
            "error_x": {"type": "data", "array": rounded(stds), "thickness": 1.4, "width": 3, "color": BLUE},
            "marker": {"color": BLUE, "size": 8, "opacity": [round(0.25 + 0.75 * float(s or 0.0), 2) for s in group["shares"]]}, "xaxis": f"x{number}", "yaxis": f"y{number}",
            "customdata": rounded([100 * (s or 0.0) for s in group["shares"]], 3), "hovertemplate": f"%{{x:.4g}} {group['unit']}, %{{customdata:.0f}} % from data",
        })  # fmt: skip
        if any(p is not None for p in group["priors"]):
            data.append({
                "type": "scatter", "mode": "markers", "x": rounded([np.nan if p is None else p for p in group["priors"]]), "y": names, "name": "prior", "legendgroup": "prior", "showlegend": k == 0,
                "marker": {"color": ORANGE, "size": 9, "symbol": "diamond-open", "line": {"width": 1.6}}, "xaxis": f"x{number}", "yaxis": f"y{number}", "hovertemplate": f"prior %{{x:.4g}} {group['unit']}",
            })  # fmt: skip
        unit = "" if group["unit"] in ("", "1") else f" [{group['unit']}]"
        layout[f"xaxis{number}"] = axis(f"{group.get('quantity', 'value')}{unit}", anchor=f"y{number}", zeroline=True, nticks=6)
        layout[f"yaxis{number}"] = {"type": "category", "domain": [max(1 - (top + size) / total, 0.0), 1 - top / total], "anchor": f"x{number}", "autorange": "reversed", "automargin": True, "showgrid": True}
        top += size + gap
    layout |= {"showlegend": True, "legend": LEGEND, "margin": {"l": 60, "r": 14, "t": 34, "b": 46}}
    return chart(name, label, data, layout, height=int(80 + 24 * total))


# ---- the bodies in space


def bodies(name: str, found: list[dict], lines: list) -> dict:
    """The bodies as ellipsoids on the robot.

    Args:
        found: [{"name", "kind", "words", "identified": Solid | None, "prior": Solid | None}].
        lines: pairs of ends (3,) [m] of the links.
    """
    data = []
    shown = set()
    for entry in found:
        colour = BLUE if entry["kind"] == "link" else PURPLE
        if entry["identified"] is not None:
            points, faces = entry["identified"].surface()
            first = entry["kind"] not in shown
            shown.add(entry["kind"])
            data.append({
                "type": "mesh3d", **{key: rounded(points[:, k], 4) for k, key in enumerate("xyz")}, **{key: faces[:, k].tolist() for k, key in enumerate("ijk")},
                "color": colour, "opacity": 0.55, "flatshading": False, "name": f"{entry['kind']}, identified", "legendgroup": entry["kind"], "showlegend": first,
                "hovertemplate": f"{plain(entry['name'])}: {plain(entry['words'])}",
            })  # fmt: skip
        if entry["prior"] is not None:
            ring = entry["prior"].rings()
            data.append({
                "type": "scatter3d", "mode": "lines", **{key: rounded(ring[:, k], 4) for k, key in enumerate("xyz")}, "line": {"color": ORANGE, "width": 3}, "name": "prior", "legendgroup": "prior",
                "showlegend": "prior" not in shown, "hovertemplate": f"{plain(entry['name'])}: prior",
            })  # fmt: skip
            shown.add("prior")
    skeleton = np.concatenate([np.array([a, b, [np.nan] * 3], dtype=float) for a, b in lines]) if lines else np.zeros((0, 3))
    data.append({
        "type": "scatter3d", "mode": "lines+markers", **{key: rounded(skeleton[:, k], 4) for k, key in enumerate("xyz")}, "line": {"color": INK, "width": 5}, "marker": {"size": 4, "color": INK},
        "name": "joints and links", "hoverinfo": "skip", "showlegend": True,
    })  # fmt: skip
    middle, size = _box(found, skeleton)
    layout = {
        "scene": scene(middle, size, (1.2, 1.05, 0.4), -0.1),
        "showlegend": True, "legend": {"orientation": "h", "x": 0, "y": 0, "yanchor": "top", "xanchor": "left"}, "margin": {"l": 0, "r": 0, "t": 0, "b": 60},
    }  # fmt: skip
    return chart(name, "The bodies as ellipsoids of equal mass and inertia on the robot, identified and prior", data, layout, height=540)


def scene(middle, size, eye: tuple[float, float, float], below: float) -> dict:
    """A box in space, to scale, with its axes in metres.

    Args:
        middle, size: (3,) [m]. eye: where it is looked at from; below: what height is looked at, both in units of the box.
    """
    power = 10.0 ** np.floor(np.log10(least := size.max() / 8.0))
    step = power * min(nice for nice in (1, 2, 5, 10) if nice * power >= least * (1 - 1e-9))
    axes = {}
    for k, key in enumerate("xyz"):
        # no number near the box's corners, where those of two axes would touch
        first, last = (f((middle[k] + side * 0.42 * size[k]) / step) for f, side in ((np.ceil, -1), (np.floor, 1)))
        at = rounded(step * np.arange(first, last + 1) + 0.0, 6) if first <= last else rounded(middle[k : k + 1], 2)  # + 0.0: no minus before a zero
        axes[f"{key}axis"] = {
            "title": {"text": f"{key} [m]", "font": {"size": 12}}, "range": rounded(middle[k] + np.array([-0.5, 0.5]) * size[k]), "tickvals": at,
            "tickfont": {"size": 11},
        }  # fmt: skip
    ratio = {key: float(f"{size[k] / size.max():.4g}") for k, key in enumerate("xyz")}
    return {"aspectmode": "manual", "aspectratio": ratio, **axes, "camera": {"eye": dict(zip("xyz", eye)), "center": {"x": 0, "y": 0, "z": below}}}


def _box(found: list[dict], skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Middle and edges of a box around the robot: the links, the priors, and of the identified bodies as much as is no
    longer than the longest prior."""
    priors = [entry["prior"] for entry in found if entry["prior"] is not None]
    longest = max((solid.axes.max() for solid in priors), default=0.1)
    points = [skeleton, *(solid.surface(6)[0] for solid in priors)]
    for entry in found:
        if entry["identified"] is not None:
            around = entry["identified"].surface(6)[0]
            points.append(around[np.linalg.norm(around - entry["identified"].centre, axis=1) <= 1.5 * longest])
    every = np.concatenate(points)
    every = every[np.isfinite(every).all(1)]
    if not len(every):
        return np.zeros(3), np.ones(3)
    most = max(np.ptp(every, 0).max(), 1e-3)
    return (every.max(0) + every.min(0)) / 2, np.maximum(1.15 * np.ptp(every, 0), 0.3 * most)
