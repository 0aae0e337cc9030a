"""Take the pictures of docs/curation.md from a running service: `python docs/images/curation/take.py --home HOME`.

HOME is a service's home with assets of the starter library and their previews (`fullwell --help`: `assets starter`); what the
pictures need beside is done here, in the browser: two imports, another paint, decisions. Takes a few minutes, most of them the
worker's.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2] / "tests"))

from browser import chromium, opened  # noqa: E402
from fullwell.client import FullwellClient  # noqa: E402

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CAR = "sedan-02"
PENDING = 5
SETTLE_MS = 2500
"""For a software renderer to draw the model."""


def main() -> None:
    """Take all pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--home", type=Path, required=True)
    home = parser.parse_args().home
    with serving(home) as url, chromium() as browser, FullwellClient(url) as client:
        known = [asset.id for asset in client.assets.all(order="newest")]
        if CAR not in known:
            raise SystemExit(f"{home} holds no asset {CAR}. Run: fullwell assets starter")
        client.assets.review("pending", ids=[asset for asset in known if asset != CAR][:PENDING], reason="for the pictures")
        while client.assets.ingestions(state="running") or client.assets.ingestions(state="queued"):
            time.sleep(2)
        repaint(browser, url)
        grid(browser, url)
        detail(browser, url)
        compare(browser, url)
        upload(browser, url, client)
        phone(browser, url)


@contextmanager
def serving(home: Path) -> Iterator[str]:
    """Run the service on a free port; give its address."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("FULLWELL_")}
    kept["FULLWELL_HOME"] = str(home)
    program = "from fullwell.cli.main import main; main()"
    command = [sys.executable, "-c", program, "serve", "--port", "0"]
    process = subprocess.Popen(command, env=kept, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield process.stdout.readline().split(" is ready at ")[1].split()[0]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)


def save(page: Page, name: str, *, settle_ms: int = SETTLE_MS) -> Path:
    """Take one picture."""
    page.wait_for_timeout(settle_ms)
    target = HERE / f"{name}.png"
    page.screenshot(path=target)
    with Image.open(target) as taken:
        small = taken.convert("RGB")
    small.save(target, optimize=True)
    print(f"{target.name}: {target.stat().st_size / 1024:.0f} KiB", flush=True)
    return target


def grid(browser: Browser, url: str) -> None:
    """The grid, light, with two cards selected."""
    with opened(browser, f"{url}/assets/?state=all&sort=title", size=(1440, 900)) as (page, _):
        page.locator(".fw-card img").first.wait_for()
        page.locator(".fw-card input").nth(1).click()
        page.locator(".fw-card input").nth(2).click()
        page.locator(".fw-bulk").wait_for()
        save(page, "grid")


def detail(browser: Browser, url: str) -> None:
    """An asset, light and dark, and the choice of a material."""
    for name, scheme, height in (("detail", "light", 1640), ("dark", "dark", 900)):
        address = f"{url}/assets/?state=all&asset=sedan-01"
        with opened(browser, address, size=(1440, height), color_scheme=scheme) as (page, _):
            page.locator(".fw-spectrum svg").wait_for()
            page.locator(".fw-viewer-note").wait_for(state="detached")
            page.get_by_role("button", name="Show the spectrum of body").click()
            save(page, name)
            if scheme == "light":
                page.set_viewport_size({"width": 1180, "height": 760})
                page.get_by_role("button", name="Change").click()
                page.get_by_label("Find a material").fill("paint")
                save(page, "material")


def repaint(browser: Browser, url: str) -> None:
    """Another paint for a car: the version to compare with."""
    with opened(browser, f"{url}/assets/?state=all&asset={CAR}") as (page, _):
        page.locator(".fw-versions").wait_for()
        if page.locator(".fw-versions li").count() > 1:
            return
        page.get_by_role("button", name="Show the spectrum of body").click()
        page.get_by_role("button", name="Change").click()
        page.get_by_label("Find a material").fill("car paint, red")
        page.locator(".fw-materials button").first.click()
        page.get_by_text("version 2", exact=True).wait_for()


def compare(browser: Browser, url: str) -> None:
    """Two versions side by side, once the worker has rendered the new one."""
    with opened(browser, f"{url}/assets/?state=all&asset={CAR}&compare=1", size=(1440, 860)) as (page, _):
        for _ in range(60):
            page.locator(".fw-compare").wait_for()
            if page.locator(".fw-compare .fw-turn img").count() == 16:
                break
            page.wait_for_timeout(10_000)
            page.reload()
        save(page, "compare")


def upload(browser: Browser, url: str, client: FullwellClient) -> None:
    """The question that an import begins with, and the list of what is under way."""
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for name, asset in (("saloon from the archive", CAR), ("city bicycle", "bicycle-01")):
            files.append(Path(folder) / f"{name}.glb")
            files[-1].write_bytes(client.assets.level(asset, 0))
        broken = Path(folder) / "half a bus.glb"
        broken.write_bytes(files[0].read_bytes()[:5000])
        with opened(browser, f"{url}/assets/?state=all&sort=title", size=(1180, 760)) as (page, _):
            page.locator(".fw-card img").first.wait_for()
            page.set_input_files("input[type=file]", [*files, broken])
            for label, text in (("Class", "car"), ("Licence", "CC-BY-4.0")):
                page.get_by_role("combobox", name=label).fill(text)
                page.get_by_role("option", name=text, exact=True).click()
            page.get_by_label("Attribution").fill("City museum of transport")
            tags = page.get_by_role("combobox", name="Tags")
            tags.fill("museum")
            tags.press("Enter")
            page.locator(".fw-dialog h2").click()
            save(page, "import")
            page.locator(".fw-dialog").get_by_role("button", name="Import").click()
            page.locator("[data-upload].failed").wait_for(timeout=180_000)
            page.locator("[data-upload].done").first.wait_for(timeout=600_000)
            save(page, "progress")


def phone(browser: Browser, url: str) -> None:
    """Grid, filters and an asset on a phone, beside each other."""
    options = {"is_mobile": True, "has_touch": True}
    with opened(browser, f"{url}/assets/?state=pending", size=(390, 844), **options) as (page, _):
        page.locator(".fw-card img").first.wait_for()
        taken = [save(page, "phone-1")]
        page.locator(".fw-bar").get_by_role("button", name="Filters").click()
        taken.append(save(page, "phone-2"))
        page.get_by_role("button", name="Close filters").first.click()
        page.locator(".fw-side").wait_for(state="hidden")
        page.locator(".fw-card-open").first.click()
        page.locator(".fw-viewer-note").wait_for(state="detached")
        taken.append(save(page, "phone-3"))
    images = [Image.open(file).convert("RGB") for file in taken]
    joined = Image.new("RGB", (sum(image.width + 16 for image in images) - 16, images[0].height), "white")
    for place, image in enumerate(images):
        joined.paste(image, (place * (image.width + 16), 0))
    joined.save(HERE / "phone.png", optimize=True)
    for file in taken:
        file.unlink()


if __name__ == "__main__":
    main()
