"""Shape values in words: a certificate takes them as given, so what was done to find them is said."""

from .units import behind


def given_shapes(fit) -> str:
    """What a certificate takes as given, in words: it proves the rest of the model at the shape values that stand there, of which
    the objective is no convex function. Empty where the model has none."""
    count = len(fit.model.shape_values)
    return f"given the shape value{'s' * (count > 1)}" if count else ""


def said_of_shapes(fit) -> list[str]:
    """What was done about the shape values that a certificate takes as given, in sentences."""
    out, alike = [], {}
    for one in fit.searched:
        alike.setdefault((one.starts, one.lower), []).append(one)
    for (starts, lower), group in alike.items():
        counts = sorted({one.profile for one in group})
        each = "its profile" if len(group) == 1 else "the profile over each"
        at = " to ".join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))
        begun = f"started from {starts} places" if starts > 1 else "started where the effect does nothing"
        checked = f"{each} was checked at {at} values, {'which led to a lower place, and the search went on there' if lower else 'and none lay lower'}"
        out.append(f"{', '.join(one.name for one in group)}: {begun}; {checked if counts[-1] else 'no profile was checked'}")
    if held := [v.name for v in fit.model.shape_values if v.held]:
        out.append(f"{', '.join(held)}: held as the experiment says")
    return out + at_edges(fit)


def at_edges(fit) -> list[str]:
    """The shape values that ended at an end of their range, in sentences."""
    shapes = zip(fit.model.shape_values, fit.model.shapes)
    return [
        f"{value.name} = {at:.4g}{behind(value.unit)} is at the edge of its range, {value.low:.4g} to {value.high:.4g}: what it is may lie beyond, or it is another effect"
        for value, at in shapes
        if at_edge(value, at)
    ]


def at_edge(value, at: float) -> bool:
    """Whether a shape value ended at an end of its range, where the objective may fall further beyond."""
    near = 1e-6 * (value.high - value.low)
    ends = [end for end in (value.low, value.high) if end != value.shape.start]
    return not value.held and any(abs(at - end) <= min(near, 1e-3 * abs(end) or near) for end in ends)
