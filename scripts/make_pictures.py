"""Make the pictures of the README from real runs, with a headless browser.

    python scripts/make_pictures.py [--out docs/figures] [--browser chromium]

The leg of MIT Cheetah 3 is simulated with Stribeck friction hidden in its hip; `sysid report` writes its page, and in
`sysid studio` the suspect is previewed, added and undone by clicks. Needs Playwright and a Chromium (SYSID_BROWSER names one).
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

ROOT = Path(__file__).resolve().parent.parent
DONE = "() => !document.querySelector('main.stale') && document.querySelector('main').getAttribute('aria-busy') === 'false' && document.querySelector('#verdict .card')"
WAIT = 300_000  # ms
WIDE, PHONE = {"width": 1200, "height": 760}, {"width": 390, "height": 760}


def sysid(*words, folder: Path = ROOT) -> None:
    """Run a command of the tool."""
    subprocess.run([sys.executable, "-m", "sysid", *map(str, words)], check=True, cwd=folder)


def simulated(folder: Path) -> Path:
    """The leg with a hidden effect."""
    sysid("simulate", "configs/cheetah3.yaml", "--hide", "stribeck:hip:size=3", "--duration", 12, "--seed", 0, "--out", folder, "--quiet")
    return folder


def shot(page, place: str, path: Path, wait: int = 1500) -> None:
    """A picture of the window with an element at its top."""
    page.evaluate("place => { const found = document.querySelector(place); found ? found.scrollIntoView() : scrollTo(0, 0); }", place)
    page.wait_for_timeout(wait)
    page.screenshot(path=path)
    print(path, f"{path.stat().st_size / 1000:.0f} kB")


def report(browser, folder: Path, out: Path) -> None:
    """Pictures of the report."""
    sysid("report", folder.name, "--out", folder / "run", "--quiet", folder=folder.parent)
    for name, size, scheme, places in (("", WIDE, "light", {"verdict": "body", "torque": "#torque", "where": "#failures", "bodies": "#bodies"}), ("_phone_dark", PHONE, "dark", {"verdict": "body"})):
        page = browser.new_page(viewport=size, color_scheme=scheme)
        page.goto((folder / "run" / "report.html").as_uri())
        for word, place in places.items():
            shot(page, place if place != "body" else "header.top", out / f"report_{word}{name}.png", 3000)
        page.close()


def studio(browser, folder: Path, out: Path) -> None:
    """Pictures of the studio: open, previewed, at work, added, played."""
    words = [sys.executable, "-m", "sysid", "studio", folder.name, "--port", "0", "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=folder.parent) as process:
        try:
            page = browser.new_page(viewport=WIDE)
            page.goto(json.loads(process.stdout.readline())["studio"])
            page.wait_for_function(DONE, timeout=WAIT)
            shot(page, "header.top", out / "studio_open.png")
            page.get_by_role("button", name="preview what stribeck on hip would explain").click()
            page.locator("#look-said", has_text="with stribeck about").wait_for()
            shot(page, "#look", out / "studio_preview.png")
            page.get_by_role("button", name="add stribeck to hip").first.click()
            page.locator("#progress").wait_for()
            page.locator("#status", has_text="asking").wait_for(timeout=WAIT)
            shot(page, "header.top", out / "studio_working.png", 300)
            page.locator("#verdict .card.missing").wait_for(state="detached", timeout=WAIT)
            page.wait_for_function(DONE, timeout=WAIT)
            shot(page, "#steps", out / "studio_added.png", 2500)
            page.locator("#bodies h3").scroll_into_view_if_needed()
            page.get_by_role("button", name="play").and_(page.locator(":enabled")).wait_for(timeout=WAIT)
            page.locator(".moment").fill("37")
            shot(page, "#bodies h3", out / "studio_play.png", 3000)
            page.close()
        finally:
            process.send_signal(signal.SIGINT)


def main() -> None:
    """Makes all of them."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--out", type=Path, default=ROOT / "docs" / "figures")
    words.add_argument("--browser", default=os.environ.get("SYSID_BROWSER") or shutil.which("chromium"))
    given = words.parse_args()
    from playwright.sync_api import sync_playwright

    given.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=given.browser, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        leg = simulated(Path(folder) / "leg")
        report(browser, leg, given.out)
        studio(browser, leg, given.out)
        browser.close()


if __name__ == "__main__":
    main()
