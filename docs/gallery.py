"""Make docs/images/gallery/ and report.png again: pages in headless Chromium.

Usage: gallery.py [RESULTS_DIR], with results called normal, backpack-0, -20 and -40 in it (``make
normal backpack``), else out. Needs Debian's packages chromium and chromium-driver; takes a minute
without a graphics card.
"""

import io
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

from human_gait.playback.film import film
from human_gait.playback.page import save_playback
from human_gait.reporting.page import report_to_file
from human_gait.walk.gait_file import load_gait

IMAGES = Path(__file__).resolve().parent / "images"
GALLERY = IMAGES / "gallery"
PAGE, STAGE = (1366, 768), (640, 720)  # windows
REPORT, REPORT_WINDOW = (853, 1020), (1275, 1525)  # all of the walk is in it
ALONE = (  # the walker without controls
    "document.body.style.gridTemplate = '\"stage\" 100vh / 100vw';"
    "element('panel').hidden = element('transport').hidden = true"
)
PHASE = 0.06  # of the stride: the load goes from foot to foot
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)


@contextmanager
def chromium() -> Iterator[webdriver.Chrome]:
    """Yield a browser without a window."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or "chromium"
    for option in OPTIONS:
        options.add_argument(option)
    with webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver"))) as chrome:
        yield chrome


def show(chrome: webdriver.Chrome, page: Path, size: tuple[int, int], then: str) -> None:
    """Open a page in a window of a size, at rest, and run a line of script."""
    window = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
    chrome.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", window)
    chrome.get(page.as_uri())
    chrome.execute_script(
        f"setPlaying(false); seek({PHASE}); {then}; viewer.set_3d_pane_size(); viewer.render()"
    )


def whole(chrome: webdriver.Chrome) -> Image.Image:
    """Return the picture of the page."""
    return Image.open(io.BytesIO(chrome.get_screenshot_as_png())).convert("RGB")


def stage(chrome: webdriver.Chrome) -> Image.Image:
    """Return the picture of the walker."""
    chrome.execute_script("viewer.render()")
    png = chrome.find_element(By.CSS_SELECTOR, "#stage").screenshot_as_png
    return Image.open(io.BytesIO(png)).convert("RGB")


def save(picture: Image.Image, name: str) -> None:
    """Write a picture."""
    picture.save(GALLERY / f"{name}.png", optimize=True)
    print(f"wrote {GALLERY / name}.png")


def save_report(chrome: webdriver.Chrome, page: Path) -> None:
    """Write the beginning of a report of one result, with the walk in it."""
    width, height = REPORT_WINDOW
    window = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    chrome.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", window)
    chrome.get(page.as_uri())
    chrome.switch_to.frame(0)
    chrome.execute_async_script(
        f"setPlaying(false); seek({PHASE}); viewer.set_dirty();"
        "setTimeout(() => requestAnimationFrame(arguments[0]), 1000)"
    )
    chrome.switch_to.default_content()
    picture = whole(chrome).resize(REPORT, Image.Resampling.LANCZOS)
    fewer = picture.point(lambda level: level & 0xFC | level >> 6)  # colours: a smaller file
    fewer.save(IMAGES / "report.png", optimize=True)
    print(f"wrote {IMAGES / 'report.png'}")


def main(results: Path) -> None:
    """Make all pictures."""
    GALLERY.mkdir(parents=True, exist_ok=True)
    names = ("normal", "backpack-0", "backpack-20", "backpack-40")
    gaits = {name: load_gait(results / name) for name in names}
    with tempfile.TemporaryDirectory() as folder, chromium() as chrome:
        page = Path(folder) / "playback.html"
        for name, gait in gaits.items():
            save_playback(gait, page)
            if name == "normal":
                show(chrome, page, PAGE, "")
                save(whole(chrome), name)
                print(f"wrote {film(gait, GALLERY / 'walk.gif')}")
            else:
                show(chrome, page, STAGE, f"{ALONE}; setView('side')")
                save(stage(chrome), name)
        save_playback(gaits["backpack-0"], page, gaits["backpack-40"])
        show(chrome, page, PAGE, "setView('side')")
        save(whole(chrome), "side-by-side")
        save_report(chrome, report_to_file([results / "normal"], Path(folder) / "report.html"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out"))
