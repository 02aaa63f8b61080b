"""One case, told in full to a person."""

from __future__ import annotations

import math
from pathlib import Path

from .claims import family
from .scoring import score


def tell(record: dict, folder: Path) -> None:
    """Print a record for a person."""
    print(f"{record['key']}  ({record['kind']}), {record['conditions']}")
    for entry in record["hidden"]:
        print(
            f"  hidden: {entry['effect']} on {entry['joint']}, size {entry['size']}, {entry.get('values')}"
        )
    if record["error"]:
        print(
            f"  ERROR in {record['error']['stage']}: {record['error']['message']}\n{record['error']['trace']}"
        )
    if "before" in record["rms"]:
        print(
            f"  {'joint':22s} {'noise':>9s} {'floor':>9s} {'before':>9s} {'after':>9s} {'true':>9s}   verdict"
        )
        for v in record["verdict"]:
            j, rms = v["joint"], record["rms"]
            said = (
                v["status"]
                if v["status"] != "missing"
                else " ".join(
                    [
                        v["effect"],
                        f"tied {family(v, v['joint'])}" if family(v, v["joint"]) else "",
                        f"also {v['also']}" if v.get("also") else "",
                    ]
                )
            )
            left = f"  left {v['share_left']:.2f} by {v['depends_on']}" if "share_left" in v else ""
            print(
                f"  {j:22s} {record['noise_seen']['all'][j]:9.4f} {math.nan if record['floors'][j] is None else record['floors'][j]:9.4f} {rms['before'][j]:9.4f} {rms['after'][j]:9.4f} {rms.get('true', {}).get(j, math.nan):9.4f}   {said}{left}"
            )
        for f in record["findings"]:
            step = f"step {f['step']}" if f["step"] is not None else ""
            print(
                f"  finding: {f['effect']}:{f['joint']} removes {f['removed']}, tied {f['tied_with']} {step} { {n: float(f'{v:.3g}') for n, v in f['parameters'].items() if v is not None} }"
            )
        print(
            f"  discover added {record['added']}, refused {record['refused']}, ended {[(v['joint'], v['status']) for v in record['last'] if v['status'] != 'complete']}"
        )
    for row in score(record):
        more = (
            ""
            if row["lowered"] is None
            else f", the true model lowers the RMS by {100 * row['lowered']:.1f} %"
            + (
                f" (without the effect it is {100 * row['hurts']:.1f} % lower)"
                if "hurts" in row
                else ""
            )
        )
        print(f"  -> {row['effect']} on {row['joint']}: {row['category'].upper()} ({row['named']}){more}, {'visible' if row['visible'] else 'not visible'}"
              + (f", after/true {row['after'] / row['true']:.3f}" if "after" in row else "") + (f", misfit removed {row['removed']:.2f}" if row.get("removed") is not None else ""))  # fmt: skip
    print(
        f"  { ({k: round(v, 1) for k, v in record['seconds'].items()}) }; folder {folder}",
        flush=True,
    )
