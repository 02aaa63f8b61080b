"""Whether the sizes of effects that are named rightly lie where their stated deviations say."""

from __future__ import annotations

from .claims import steps_on

WITHIN = 2.0  # stated deviations
#: where the simulator says a value otherwise than the model does
_SAID = {"compliance": lambda hidden: 1.0 / hidden["K"]}


def distances(record: dict) -> list[dict]:
    """How many stated deviations each parameter of an effect that was hidden and heads a step of the
    first diagnosis is from the truth; those that the simulator does not have are passed over, and those
    of a sum of fewer terms than what was hidden: its terms stand for the others as well, and are no
    estimates of the same numbers."""
    if record["error"] is not None or record["kind"] not in ("one", "two"):
        return []
    out = []
    for hidden in record["hidden"]:
        joints = [v["joint"] for v in record["verdict"]]
        places = [hidden["joint"]] if hidden["joint"] in joints else joints
        heads = [step for place in places for step in steps_on(record, place)]
        own = [h for h in heads if (h["effect"], h["joint"]) == (hidden["effect"], hidden["joint"])]
        for name, deviation in (own[0].get("deviations") or {}).items() if own else ():
            word, found = name.rpartition(".")[2], own[0]["parameters"][name]
            truth = _truth(hidden.get("values") or {}, word)
            if _shorter(own[0]["parameters"], hidden.get("values") or {}, word):
                continue
            if truth is not None and found is not None and deviation:
                z = (found - truth) / deviation
                out.append(
                    {"key": record["key"], "name": name, "found": found, "truth": truth, "z": z}
                )
    return out


def _truth(values: dict, word: str) -> float | None:
    if word in values:
        return float(values[word])
    return _SAID[word](values) if word in _SAID and "K" in values else None


def _shorter(found: dict, hidden: dict, word: str) -> bool:
    """Whether what was hidden has more of the numbered terms that a word is one of."""
    terms = lambda names: {n for n in names if n[-1:].isdigit() and n.rstrip("0123456789") == word.rstrip("0123456789")}  # noqa: E731
    return word[-1:].isdigit() and bool(terms(hidden) - terms(name.rpartition(".")[2] for name in found))


def covered(records: list[dict]) -> tuple[int, int]:
    """Parameters within two stated deviations, and all."""
    found = [one for record in records for one in distances(record)]
    return sum(abs(one["z"]) <= WITHIN for one in found), len(found)
