"""Which logs train and which are held out: whole files where there are several, else a piece in
time."""

from __future__ import annotations

import re
from pathlib import Path

from .guess import Guess

SHARE = 0.2  # held out, of the seconds or of the episodes
_TEST = re.compile(r"(^|[^a-z])(test|val|valid|validation|eval|held|holdout)([^a-z]|$)")


def split(
    entries: list[dict], seconds: list[float], episodes: list[tuple[int, ...]]
) -> dict[str, Guess]:
    """The entries of data.train and of data.test.

    Args:
        entries: {"file": name} of each log, with what else an entry needs. seconds: how long each
        is. episodes: the
            episodes of each, () where it has none.
    """
    if len(entries) > 1:
        return _files(entries, seconds)
    (entry,), (length,), (numbers,) = entries, seconds, episodes
    if len(numbers) > 1:
        held = max(1, round(SHARE * len(numbers)))
        parts = {"train": numbers[:-held], "test": numbers[-held:]}
        why = f"{{}} {len(numbers)} episodes"
        named = {part: [{**entry, "episode": list(own)}] for part, own in parts.items()}
        return _guesses(named, why.format("all but the last of"), why.format(f"the last {held} of"))
    stop = float(f"{(1.0 - SHARE) * length:.4g}")
    named = {"train": [{**entry, "start": 0, "stop": stop}], "test": [{**entry, "start": stop}]}
    why = f"one recording of {length:.4g} s"
    return _guesses(
        named, f"{why}: its first {100 * (1 - SHARE):.0f} %", f"its last {100 * SHARE:.0f} %"
    )


def _files(entries: list[dict], seconds: list[float]) -> dict[str, Guess]:
    said = [bool(_TEST.search(Path(entry["file"]).name.lower())) for entry in entries]
    if any(said) and not all(said):
        parts = {
            "train": [e for e, test in zip(entries, said) if not test],
            "test": [e for e, test in zip(entries, said) if test],
        }
        said = "held out, as the files' names say"
        return _guesses(parts, "all whose names do not say that they are held out", said)
    first = len(entries) - 1
    while first > 1 and sum(seconds[first:]) < (1.0 - 1e-9) * SHARE * sum(seconds):
        first -= 1
    parts = {"train": entries[:first], "test": entries[first:]}
    last = (
        "the last file is"
        if first == len(entries) - 1
        else f"the last {len(entries) - first} files are"
    )
    return _guesses(parts, f"the first {first} of {len(entries)} files", f"{last} held out")


def _guesses(parts: dict[str, list[dict]], train: str, test: str) -> dict[str, Guess]:
    why = {"train": train, "test": test}
    said = {part: [e["file"] if len(e) == 1 else e for e in own] for part, own in parts.items()}
    return {part: Guess(f"data.{part}", own, why[part]) for part, own in said.items()}
