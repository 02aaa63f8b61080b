"""Is the missing effect found? Effects hidden in simulated robots, and what the diagnosis, told nothing, says of them.

    python scripts/blind_benchmark.py --seed 20261 --jobs 2                   # the whole benchmark
    python scripts/blind_benchmark.py --seed 20261 --conditions nuisances     # on logs as labs have them; or sines, one a joint
    python scripts/blind_benchmark.py --cases small --seed 1                  # one case of each kind
    python scripts/blind_benchmark.py --seed 1 --only leg/stribeck            # cases whose key has these parts
    python scripts/blind_benchmark.py --seed 1 --only leg/stribeck/2 --verbose  # one case, told in full, its folder kept
    python scripts/blind_benchmark.py --report runs/blind_benchmark --publish # the page again, from results.json

A case is a robot, what is hidden in it, and the conditions of its logs, all drawn from the base seed and the case's key
(ROBOT/WHAT/NUMBER). It is simulated, written as a folder, and given to `sysid discover` (at most 4 steps), which
knows nothing. The true model is the same experiment with the hidden effects in its list, refitted. The verdict that
counts is that of the first diagnosis.

Runs resume: finished cases stand in a journal in --out, named after the seed and the state of the package's source, so
that one journal never mixes two states of it. Killed and run again, the results are the same, up to seconds.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import argparse
import hashlib
import json
import shutil
import sys
from dataclasses import asdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
# of the processes that --jobs starts
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
)

from scripts.blind_parts import conditions  # noqa: E402
from scripts.blind_parts.cases import cases, conditions_of, matches  # noqa: E402
from scripts.blind_parts.figures import figures  # noqa: E402
from scripts.blind_parts.page import page  # noqa: E402
from scripts.blind_parts.robots import RATE, SECONDS  # noqa: E402
from scripts.blind_parts.summary import summary  # noqa: E402
from scripts.blind_parts.telling import tell  # noqa: E402
from scripts.blind_parts.trial import MOST_STEPS, one  # noqa: E402
from scripts.blind_parts.wording import page_name, percent  # noqa: E402
from sysid import fit_document, whole_files  # noqa: E402
from sysid.studies.journal import Journal, run  # noqa: E402
from sysid.terminal import watched  # noqa: E402


def source() -> str:
    """A short name of the state of the package's source and of this script."""
    digest = hashlib.sha256()
    for file in [
        *sorted((ROOT / "sysid").rglob("*.py")),
        *sorted((ROOT / "scripts" / "blind_parts").glob("*.py")),
        Path(__file__),
    ]:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:10]


def finish(records: list[dict], settings: dict, out: Path, publish: bool) -> dict:
    """Write results.json, the figures and the page; into docs/ too where they are to be published."""
    under = settings.get("conditions", "clean")
    found, name = summary(records, under), page_name(under)
    whole_files.write_json(
        out / "results.json", _plain({"settings": settings, "summary": found, "records": records})
    )
    notes = ROOT / "docs" / f"{name}_notes.md"
    text = page(
        found, records, settings, notes.read_text(encoding="utf-8") if notes.exists() else ""
    )
    for folder in [out, *([ROOT / "docs"] if publish else [])]:
        figures(found, records, folder / "figures", name)
        whole_files.write_atomically(
            folder / f"{name}.md", lambda p: p.write_text(text, encoding="utf-8")
        )
    return found


def _plain(value):
    """A document without NaN and infinity."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return fit_document.number(value) if isinstance(value, float) else value


def main(arguments: list[str] | None = None) -> None:
    """Run the cases that the journal lacks, and write the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", choices=["full", "small"], default="full")
    parser.add_argument(
        "--conditions",
        choices=conditions.CONDITIONS,
        default="clean",
        help="of the logs: clean, with what labs' logs have, or one slow sine a joint",
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="base seed; 1 was used while developing (default)"
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument(
        "--out", type=Path, help="default runs/blind_benchmark, with the conditions' name behind it"
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="ROBOT/WHAT/NUMBER",
        help="cases whose key has these parts; may be repeated; list with --list",
    )
    parser.add_argument("--limit", type=int, default=0, help="at most so many cases")
    parser.add_argument("--list", action="store_true", help="print the cases and leave")
    parser.add_argument(
        "--verbose",
        action="store_true",
        help="run again, tell each case in full and keep its folder; nothing is recorded",
    )
    parser.add_argument(
        "--publish", action="store_true", help="write the page and its figures into docs/ too"
    )
    parser.add_argument(
        "--report", type=Path, metavar="DIR", help="write the page again from DIR/results.json"
    )
    options = parser.parse_args(arguments)
    if options.report:
        read = json.loads((options.report / "results.json").read_text())
        _tell_bars(finish(read["records"], read["settings"], options.report, options.publish))
        return
    options.out = options.out or Path("runs") / page_name(options.conditions)
    chosen = [
        c
        for c in cases(options.seed, options.cases, options.conditions)
        if not options.only or any(matches(c.key, w) for w in options.only)
    ]
    chosen = chosen[: options.limit or None]
    if not chosen:
        parser.error("no case has such a key; see --list")
    if options.list:
        for case in chosen:
            print(
                case.key,
                case.kind,
                " ".join(f"{h['effect']}:{h['joint']}:{h['size']:.2f}" for h in case.hidden),
                conditions_of(case),
            )
        return
    if options.verbose:
        for case in chosen:
            folder = options.out / "cases" / case.key.replace("/", "-")
            shutil.rmtree(folder, ignore_errors=True)
            tell(json.loads(json.dumps(one(asdict(case), str(folder)))), folder)
        return
    out = whole_files.folder(options.out)
    state = source()
    settings = {
        "seed": options.seed,
        "conditions": options.conditions,
        "duration": SECONDS,
        "rate": RATE,
        "most": MOST_STEPS,
        "source": state,
        "versions": fit_document.versions(),
    }
    journal = Journal(
        out / f"journal-{conditions.MARKS[options.conditions]}{options.seed}-{state}.jsonl",
        settings,
    )
    with watched.progress_bar() as progress:
        done = run(
            journal,
            [(case.key, (asdict(case),)) for case in chosen],
            one,
            jobs=options.jobs,
            progress=lambda s: progress(f"{len(chosen)} cases", s),
        )
    records = sorted(done.values(), key=lambda r: r["key"])
    settings |= {"cases": options.cases, "only": options.only, "limit": options.limit}
    _tell_bars(finish(records, settings, out, options.publish))
    print(f"results: {out}/results.json, {out}/{page_name(options.conditions)}.md")


def _tell_bars(found: dict) -> None:
    for bar in found["bars"]:
        reached = bar["reached"] if isinstance(bar["reached"], int) else percent(bar["reached"])
        print(f"{'met    ' if bar['met'] else 'NOT MET'}  {bar['says']}: {reached}")
    print(
        f"controls called unknown: {percent(found['controls']['unknown'])}; crashes: {len(found['errors'])}"
    )


if __name__ == "__main__":
    main()
