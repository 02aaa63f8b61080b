"""What a first verdict claims, and how often it is not there.

Documents of the old diagnosis and of the new one are read: `tied_with` and `also`, or `set`.
"""

from __future__ import annotations

from sysid.statement.words import named

FLOOR = 0.25  # of the true noise, within which a noise floor is right


def family(entry: dict, joint: str) -> list[str]:
    """The effects that a verdict on a joint, or a finding, holds as likely beside its own."""
    members = [m["effect"] for m in entry.get("set") or [] if m["joint"] in (joint, "*")]
    words = dict.fromkeys([*entry.get("tied_with", []), *members])
    return [word for word in words if word != entry.get("effect")]


def steps_on(record: dict, joint: str) -> list[dict]:
    """The effects that the first diagnosis says are missing on a joint, with their families, in
    its order."""
    (verdict,) = [v for v in record["verdict"] if v["joint"] == joint]
    if verdict["status"] != "missing":
        return []
    also = [w if isinstance(w, str) else w["effect"] for w in verdict.get("also") or []]
    words = (verdict["effect"], *also)
    steps = [f for f in record["findings"] if f.get("step") is not None]
    own = [
        f
        for f in sorted(steps, key=lambda f: f["step"])
        if f["joint"] == joint or (f["joint"] == "*" and f["effect"] in words)
    ]
    own = own or [{"effect": w, "joint": joint, "step": k + 1} for k, w in enumerate(words)]
    return [f | {"tied_with": _tied(f, verdict, joint)} for f in own]


def _tied(step: dict, verdict: dict, joint: str) -> list[str]:
    words = family(step, joint)
    if step["effect"] == verdict["effect"]:
        words = dict.fromkeys([*words, *family(verdict, joint)])
    return list(words)


def claims(record: dict) -> list[dict]:
    """The (effect, joint) pairs that the first verdict names: whether they were hidden, and whether
    at least their families hold what was. Beside a law that the catalogue does not have, a name
    on its own joint is no claim here: the bars of the laws judge it."""
    if record["error"] is not None:
        return []
    hidden = {(h["effect"], h["joint"]) for h in record["hidden"]}
    own = {h["joint"] for h in record["hidden"]} if record["kind"] == "outside" else set()
    found: dict[tuple[str, str], dict] = {}
    for verdict in record["verdict"]:
        joint = verdict["joint"]
        for step in steps_on(record, joint):
            pair = step["effect"], step["joint"]
            true = _is_hidden(step["effect"], joint, hidden)
            held = true or any(_is_hidden(*_split(w, joint), hidden) for w in step["tied_with"])
            said = true or any(pair in hidden for pair in _said(step, verdict, joint))
            if joint not in own:
                before = found.get(pair, {"true": False, "held": False, "said": False})
                found[pair] = {
                    "key": record["key"], "effect": pair[0], "joint": pair[1],
                    "true": true or before["true"], "held": held or before["held"],
                    "said": said or before["said"],
                }  # fmt: skip
    return list(found.values())


def _said(step: dict, verdict: dict, joint: str) -> list[tuple[str, str]]:
    """The (effect, joint) pairs that the verdict's first line says of a step: its head, and where
    this is no likelier right than wrong those beside it."""
    if "named" in step:  # of a journal that has what the document says
        return [(m["effect"], m["joint"]) for m in step["named"]]
    own = step["effect"], step["joint"]
    if step["effect"] == verdict["effect"] and verdict.get("set"):
        return named(own, [(m["effect"], m["joint"], m["probability"]) for m in verdict["set"]])
    # of another than the first the others' probabilities are not in older journals
    alone = round(step.get("probability", 1.0), 2) > 0.5 or len(step["tied_with"]) != 1
    return [own, *([] if alone else [_split(w, joint) for w in step["tied_with"]])]


def _split(word: str, joint: str) -> tuple[str, str]:
    """The effect and the joint of a word of a family, which says its joint where it is another."""
    effect, _, other = word.partition(" on ")
    return effect, other or joint


def _is_hidden(effect: str, joint: str, hidden: set) -> bool:
    return (effect, joint) in hidden or (effect, "*") in hidden


def floors(record: dict) -> list[dict]:
    """Each joint's noise floor against its true noise: of torque, encoder and clock."""
    noise = (record.get("noise_seen") or {}).get("all") or record.get("noise") or {}
    out = []
    for joint, floor in (record.get("floors") or {}).items():
        ratio = None if floor is None or not noise.get(joint) else floor / noise[joint]
        out.append({"key": record["key"], "joint": joint, "ratio": ratio, "null": floor is None})
    return out


def counts(records: list[dict]) -> dict:
    """Claims, floors and sets, counted: {name: (successes, count)}, and what was false."""
    made = [claim for record in records for claim in claims(record)]
    said = [floor for record in records if record["error"] is None for floor in floors(record)]
    near = [f for f in said if f["ratio"] is not None and abs(f["ratio"] - 1.0) <= FLOOR]
    null = [f for f in said if f["null"]]
    false = [claim for claim in made if not claim["true"]]
    return {
        "false claims": (len(false), len(made)),
        "false claims, as said": (sum(not claim["said"] for claim in made), len(made)),
        "false claims, families too": (sum(not claim["held"] for claim in made), len(made)),
        "floors": (len(near) + len(null), len(said)),
        "floors null": (len(null), len(said)),
        "false": false,
        "ratios": sorted(f["ratio"] for f in said if f["ratio"] is not None),
    }
