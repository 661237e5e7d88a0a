"""The page in a real browser: headless Chromium, driven by Selenium, without a network."""

import base64
import html
import io
import threading
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from browser import NEEDED, Tab
from PIL import Image
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait
from walking import guessed_gait

from human_gait.body.skeleton import index
from human_gait.playback.page import (
    TORQUE_COLOURS,
    page_policy,
    play,
    playback_page,
    save_playback,
)
from human_gait.playback.server import page_server
from human_gait.results.names import GAIT_FILE
from human_gait.scenario import Scenario
from human_gait.walk.bspline import Basis
from human_gait.walk.cycle import step_cycle
from human_gait.walk.gait import Gait
from human_gait.walk.gait_file import save_gait

pytestmark = NEEDED

SMALL = (560, 460)
GAIT = guessed_gait()
AT_REST = """
    setPlaying(false);
    judge = () => {};
    quality.level = 0;
    setSmooth(true);
    viewer.renderer.setPixelRatio(0.5)"""  # quickly drawn, always in the same way
FRAME = 1 / 60  # of the stride; between two frames of the tracks the page interpolates


class Page(Tab):
    """A page that plays a walk, at rest."""

    def __init__(self, driver, path):
        super().__init__(driver, path, SMALL)
        self.script(AT_REST)

    def scrub(self, phase):
        """Move the slider, as a hand would."""
        self.script(
            f"element('scrub').value = {100 * phase};"
            "element('scrub').dispatchEvent(new Event('input', {bubbles: true}))"
        )

    def picture(self):
        """What the viewer draws, as (height, width, 3)."""
        self.script("scrollTo(0, 0); viewer.render()")
        png = self.one("canvas").screenshot_as_png
        return np.array(Image.open(io.BytesIO(png)).convert("RGB"), dtype=float)

    def node(self, path, what, walker="first"):
        """Something about an object of three.js below the path of a walker."""
        names = ["human_gait", walker, "path", *path.split("/")]
        return self.script(f"return viewer.scene_tree.find({names}).object.{what}")


def quick_gait():
    """The same joint angles at another pace."""
    walk = {"speed": 1.5, "step_length": 0.66}
    scenario = Scenario.from_dict({**GAIT.scenario.to_dict(), "name": "quick", "walk": walk})
    return Gait(scenario, Basis.uniform(step_cycle(scenario.walk), 9).breaks, GAIT.control_points)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A result with its page, and pages of two walks."""
    folder = tmp_path_factory.mktemp("result")
    save_gait(GAIT, folder)
    save_playback(GAIT, folder / "playback.html")
    save_playback(GAIT, folder / "loaded.html", guessed_gait(18.1))
    save_playback(GAIT, folder / "paces.html", quick_gait(), overlay=True)
    return folder


@pytest.fixture(scope="module")
def one_page(driver, folder):
    return Page(driver, folder / "playback.html")


@pytest.fixture
def page(one_page, folder):
    """The page of one walk, at rest at the start of the stride."""
    if not one_page.driver.current_url.endswith("playback.html"):
        one_page = Page(one_page.driver, folder / "playback.html")
    one_page.resize(*SMALL)
    one_page.script("scrollTo(0, 0); setPlaying(false); setSpeed(1); setView('oblique'); seek(0)")
    return one_page


@pytest.fixture
def undrawn(page):
    """The same, with frames that do everything but draw: of keys, what counts is the camera."""
    page.script(
        "window.drawing = viewer.render;"
        "viewer.render = () => { viewer.controls.update(); viewer.needs_render = false }"
    )
    yield page
    page.script("viewer.render = drawing")


def moved(before, after):
    """Share of the picture that has changed."""
    return (abs(before - after).max(axis=-1) > 8).mean()


def test_the_page_is_drawn_without_a_complaint(page):
    assert page.picture().std() > 10
    assert page.problems() == []


def test_the_walker_moves_until_paused(page):
    start = page.picture()
    page.click("#play")
    page.driver.execute_async_script(
        "const done = arguments[0], from = state.phase; (function wait() {"
        "  if (state.phase > from + 0.1) done(); else requestAnimationFrame(wait) })()"
    )
    page.click("#play")
    stopped = page.picture()
    assert moved(start, stopped) > 0.01
    phase = page.script("return state.phase")
    assert moved(stopped, page.picture()) == 0
    assert page.script("return state.phase") == phase


def test_at_a_phase_the_marker_is_where_the_file_says(page, folder):
    """The file holds a step, from left heel strike; the stride begins at the right one, T later."""
    with np.load(folder / GAIT_FILE) as file:
        t, zmp = file["t"], file["zmp"]
    for share in (0.1, 0.3, 0.5, 0.8):  # of the step: both a sample and a frame
        phase = (1 + share) / 2
        page.scrub(phase)
        expected = zmp[abs(t / t[-1] - share).argmin()] + [0, 0, 2 * GAIT.step_length]
        np.testing.assert_allclose(page.node("zmp", "position.toArray()"), expected, atol=1e-4)
        page.scrub(phase - 0.5)  # a step before, mirrored
        expected = expected * np.array([-1, 1, 1]) - [0, 0, GAIT.step_length]
        np.testing.assert_allclose(page.node("zmp", "position.toArray()"), expected, atol=1e-4)


def test_the_readout_is_time_and_phase_of_the_slider(page):
    page.scrub(0.25)
    assert page.one("#clock").text.split("\n")[0].startswith(f"{GAIT.step_time / 2:.2f} s")
    assert "25 %" in page.one("#clock").text
    assert "25 % of the stride" in page.one("#scrub").get_attribute("aria-valuetext")


def test_the_walk_goes_on_for_ever_and_every_stride_is_like_the_first(page):
    page.script("seek(0.3)")
    before = page.picture()
    page.script("advance(1000 * walkers[0].strideTime)")
    assert page.script("return state.strides") >= 999
    assert moved(before, page.picture()) < 0.001


LAYERS = {"body": "body", "footholds": "footholds", "support": "support", "zmp": "zmp"}
LAYERS["ground_reaction"] = "ground_reaction"


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_can_be_hidden_and_shown_again(page, layer):
    page.script("setView('side'); seek(0.2)")
    shown = page.picture()
    page.click(f"[data-layer={layer}]")
    hidden = page.picture()
    assert moved(shown, hidden) > 0.00005
    page.click(f"[data-layer={layer}]")
    assert moved(shown, page.picture()) == 0


def test_nothing_is_left_without_any_layer(page):
    """No shadow either: at another phase the empty stage is the same."""
    boxes = [f"[data-layer={layer}]" for layer in LAYERS]
    for box in boxes:
        page.click(box)
    page.script("setLayer('ground', false); seek(0)")
    empty = page.picture()
    page.script("seek(0.3)")
    assert moved(empty, page.picture()) == 0
    for box in boxes:
        page.click(box)
    page.script("setLayer('ground', true)")
    assert moved(empty, page.picture()) > 0.5


def test_the_torques_colour_the_segments(page, folder):
    with np.load(folder / GAIT_FILE) as file:
        t, tau = file["t"], file["tau"]
    page.click("[data-layer=torques]")
    assert page.one("#torque-legend").is_displayed()
    page.scrub(0.7)  # 0.4 of the step of the file
    knee = abs(tau[abs(t / t[-1] - 0.4).argmin(), index("knee_flexion_l")])
    ramp = [[int(c[k : k + 2], 16) / 255 for k in (1, 3, 5)] for c in TORQUE_COLOURS]
    largest = page.script("return data.torqueMax")
    place = knee / largest * (len(ramp) - 1)
    expected = [np.interp(place, range(len(ramp)), [c[k] for c in ramp]) for k in range(3)]
    painted = (
        "return walkers[0].painted.filter(part => part.torque ==="
        " walkers[0].torques.j17_knee_flexion_l).map(part => part.mesh.material.color.toArray())"
    )
    for colour in page.script(painted):
        np.testing.assert_allclose(colour, expected, atol=0.01)
    assert f"0 to {largest} N m" in page.one("#torque-legend").text
    page.click("[data-layer=torques]")
    assert not page.one("#torque-legend").is_displayed()
    skin = page.script(painted)[0]
    assert skin[0] > skin[2]


VIEWS = {"side": (0, 1), "front": (1, 0), "top": (0, 0)}  # towards the camera: forward, right


@pytest.mark.parametrize(("key", "view"), [("1", "side"), ("2", "front"), ("3", "top")])
def test_views_by_button_and_key(page, key, view):
    page.click(f"[data-view={view}]")
    by_button = page.script("return viewer.camera.position.toArray()")
    forward, up, right = np.array(by_button) / np.linalg.norm(by_button)
    np.testing.assert_allclose([forward, right], VIEWS[view], atol=0.01)
    assert up > -0.01
    pictured = page.picture()
    page.script("setView('oblique')")
    assert moved(pictured, page.picture()) > 0.05
    page.press(key)
    np.testing.assert_allclose(page.script("return viewer.camera.position.toArray()"), by_button)
    assert page.one("[aria-pressed=true][data-view]").get_attribute("data-view") == view


def test_all_of_the_walker_is_in_the_picture_of_every_view(undrawn):
    page = undrawn
    corner = """
    const box = new THREE.Box3();
    for (const part of walkers[0].layers.body) box.expandByObject(part);
    const corners = [];
    for (const x of [box.min.x, box.max.x]) for (const y of [box.min.y, box.max.y])
      for (const z of [box.min.z, box.max.z])
        corners.push(new THREE.Vector3(x, y, z).project(viewer.camera).toArray());
    return corners"""
    for view in ("side", "front", "top", "oblique"):
        for phase in (0.0, 0.15, 0.4):
            page.script(f"setView('{view}'); seek({phase}); viewer.render()")
            assert np.abs(page.script(corner))[:, :2].max() < 1.0


def test_the_keyboard_plays_steps_and_changes_speed(undrawn):
    page = undrawn
    page.script("document.activeElement.blur()")
    page.press(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_LEFT)
    assert page.script("return state.phase") == pytest.approx(0.01)
    page.press(Keys.ARROW_LEFT, Keys.ARROW_LEFT)  # past the start
    assert page.script("return state.phase") == pytest.approx(0.99)
    page.press(*[Keys.ARROW_DOWN] * 12)
    assert page.script("return state.speed") == pytest.approx(0.1)
    page.press(*[Keys.ARROW_UP] * 22)
    assert page.script("return state.speed") == pytest.approx(2.0)
    assert page.one("#speed-said").text == "2.0\N{MULTIPLICATION SIGN}"
    page.press(" ")
    assert page.script("return state.playing")
    page.press(" ")
    assert not page.script("return state.playing")


def test_space_does_not_press_a_button_that_the_mouse_has_pressed(page):
    page.click("[data-view=top]")
    page.script("setView('side')")
    page.press(" ")
    assert page.script("return [state.playing, state.view]") == [True, "side"]


def test_speed_is_that_of_the_walk(page):
    page.script("setSpeed(0.5); advance(0.2)")
    assert page.script("return state.phase") == pytest.approx(0.5 * 0.2 / (2 * GAIT.step_time))


def test_a_page_of_some_strides_stops_after_them(page):
    played = """
    data.strides = 2; state.strides = 0; setPlaying(true);
    return [1.5, 1].map(strides => (advance(strides * walkers[0].strideTime), state.playing))"""
    assert page.script(played) == [True, False]
    assert page.script("return state.phase") == 0
    page.script("data.strides = null")


def test_every_control_says_what_it_is(page):
    for control in page.all("#transport :is(button, input), #panel :is(button, input)"):
        assert control.accessible_name.strip(), control.get_attribute("outerHTML")
    assert "walk" in page.one("canvas").accessible_name
    assert page.one("html").get_attribute("lang") == "en"


def test_a_frame_is_little_work(page):
    """A laptop's card draws thousands of things 60 times a second; these are some dozens."""
    page.script("viewer.render()")
    drawn = page.script("return viewer.renderer.info.render")
    assert drawn["calls"] < 150  # shadows included
    assert drawn["triangles"] < 100_000
    assert page.script("return viewer.animator.actions.length") < 60


def test_dark_is_dark_and_light_is_light(page):
    brightness = {}
    for scheme in ("dark", "light"):
        page.prefer("color-scheme", scheme)
        page.driver.execute_async_script("requestAnimationFrame(() => arguments[0]())")
        whole = Image.open(io.BytesIO(page.driver.get_screenshot_as_png())).convert("L")
        brightness[scheme] = (page.picture().mean(), np.array(whole).mean())
    assert max(brightness["dark"]) < 110
    assert min(brightness["light"]) > 150


def test_the_controls_of_meshcat_are_out_of_the_way(page):
    assert not any(panel.is_displayed() for panel in page.all(".dg"))


@pytest.fixture(scope="module")
def loaded(driver, folder):
    return Page(driver, folder / "loaded.html")


def test_who_wants_little_motion_starts_the_walk_themselves(driver, page, folder):
    for wish, moves in (("reduce", False), ("no-preference", True)):
        page.prefer("reduced-motion", wish)
        driver.get((folder / "playback.html").as_uri())
        assert page.script("return state.playing") is moves


def test_two_walks_stand_side_by_side_each_with_its_name(loaded):
    loaded.resize(900, 460)
    loaded.script("viewer.set_3d_pane_size(); seek(0.2)")
    names = [label.text for label in loaded.all(".name")]
    assert names == ["guessed walk (1)", "guessed walk (2)"]
    both = loaded.picture()
    left, right = np.array_split(both[:, : both.shape[1] // 2 * 2], 2, axis=1)
    assert 0.003 < moved(left, right) < 0.2  # the second one has a backpack
    loaded.click("[data-layer=backpack]")
    left_then, right_then = np.array_split(loaded.picture()[:, : both.shape[1] // 2 * 2], 2, axis=1)
    assert moved(left, left_then) == 0
    assert moved(right, right_then) > 0.003
    loaded.click("[data-layer=backpack]")
    assert loaded.problems() == []


def test_two_walks_are_laid_over_each_other_and_come_apart_again(loaded):
    loaded.script("seek(0.2)")
    apart = loaded.picture()
    loaded.click("[data-overlay=yes]")
    over = loaded.picture()
    assert moved(apart, over) > 0.05
    assert "translucent" in loaded.all(".name")[1].text
    opacity = "return walkers.map(walker => meshes(walker.layers.body)[0].material.opacity)"
    assert loaded.script(opacity) == [1, 0.5]
    loaded.click("[data-overlay=no]")
    assert moved(apart, loaded.picture()) == 0
    assert loaded.script(opacity) == [1, 1]


def test_walks_of_different_pace_are_at_the_same_phase(driver, folder):
    page = Page(driver, folder / "paces.html")
    assert page.script("return state.overlay")
    phase = 18 * FRAME
    page.scrub(phase)
    for walker, gait in (("first", GAIT), ("second", quick_gait())):
        expected = gait.instants(gait.step_time * (1 + 2 * phase)).zmp[0]
        shown = page.node("zmp", "position.toArray()", walker)
        np.testing.assert_allclose(shown, expected, atol=1e-4)
    seconds = [f"{phase * 2 * gait.step_time:.2f} s" for gait in (GAIT, quick_gait())]
    assert page.one("#clock b").text == " | ".join(seconds)
    assert page.problems() == []


def turn_wheel(page, place, ctrl=False):
    """Turn the wheel towards oneself over the middle of a box of the window."""
    left, top, right, bottom = place
    at = {"x": (left + right) / 2, "y": (top + bottom) / 2, "modifiers": 2 if ctrl else 0}
    turn = {"type": "mouseWheel", "deltaX": 0, "deltaY": 100, **at}
    page.driver.execute_cdp_cmd("Input.dispatchMouseEvent", turn)
    two_frames = "requestAnimationFrame(() => requestAnimationFrame(arguments[0]))"
    page.driver.execute_async_script(two_frames)


DISTANCE = "return viewer.camera.position.length()"


def test_the_wheel_zooms_where_the_page_is_alone(page):
    before = page.script(DISTANCE)
    turn_wheel(page, boxes(page, "canvas")[0])
    assert page.script(DISTANCE) > 1.01 * before
    assert page.one("#zoom").text == "wheel: zoom"


@pytest.fixture
def report_page(driver, folder):
    """A long page with the walk in it, as a report has it; the distance of the camera."""
    page = Page.__new__(Page)
    page.driver = driver
    page.resize(1000, 700)
    walk = html.escape((folder / "playback.html").read_text(encoding="utf-8"))
    seal = f'<meta http-equiv="Content-Security-Policy" content="{page_policy()}">'
    frame = '<iframe sandbox="allow-scripts" style="width: 100%; height: 500px"'
    (folder / "report.html").write_text(
        f'<!DOCTYPE html><meta charset="utf-8">{seal}{frame} srcdoc="{walk}"></iframe>'
        '<div style="height: 3000px"></div>',
        encoding="utf-8",
    )
    driver.get((folder / "report.html").as_uri())
    inside(page, AT_REST)
    return page


def inside(page, code):
    """Run a line of script in the frame."""
    page.driver.switch_to.frame(0)
    found = page.script(code)
    page.driver.switch_to.default_content()
    return found


def test_in_a_report_the_wheel_scrolls_and_zooms_with_ctrl_only(report_page):
    page, place = report_page, (100, 100, 500, 300)
    assert inside(page, "return element('zoom').textContent") == "Ctrl + wheel: zoom"
    before = inside(page, DISTANCE)
    turn_wheel(page, place, ctrl=True)
    zoomed = inside(page, DISTANCE)
    assert zoomed > 1.01 * before
    assert page.script("return scrollY") == 0
    turn_wheel(page, place)
    WebDriverWait(page.driver, 5).until(lambda _: page.script("return scrollY") > 50)
    assert inside(page, DISTANCE) == zoomed
    assert page.problems() == []


SIZES = [(1366, 768), (1920, 1080), (800, 1000), (360, 780)]
AREAS = ("#stage", "#transport", "#panel")


def boxes(page, *selectors):
    """Left, top, right and bottom of what is shown, asked for at once: each question takes time."""
    code = """
        const sight = {checkOpacity: true, checkVisibilityCSS: true};
        return arguments[0].flatMap(selector => [...document.querySelectorAll(selector)])
          .filter(part => part.checkVisibility(sight)).map(part => part.getBoundingClientRect())
          .filter(b => b.width * b.height > 0).map(b => [b.left, b.top, b.right, b.bottom])"""
    return page.driver.execute_script(code, selectors)


def apart(one, other):
    return (
        one[2] <= other[0] + 1.5
        or other[2] <= one[0] + 1.5
        or one[3] <= other[1] + 1.5
        or other[3] <= one[1] + 1.5
    )


@pytest.mark.parametrize("name", ["playback", "paces"])
def test_nothing_overlaps_in_windows_of_any_size(driver, folder, name):
    page = Page(driver, folder / f"{name}.html")
    page.script("setLayer('torques', true); viewer.render = () => {}")
    for size in SIZES:
        page.resize(*size)
        page.script("viewer.set_3d_pane_size()")
        assert_tidy(page, name == "playback")
        if size == (1366, 768):  # all controls without scrolling
            assert page.script("return element('panel').scrollHeight") <= size[1]


def assert_tidy(page, alone):
    for group in (AREAS, ("#transport > *",), ("#panel > *",), (".name",), ("#panel button",)):
        found = boxes(page, *group)
        assert len(found) > 1 or (alone and group == (".name",))
        assert all(apart(*pair) for pair in combinations(found, 2)), group
    assert page.script("return document.documentElement.scrollWidth <= innerWidth")
    canvas, stage = boxes(page, "canvas", "#stage")
    assert canvas == pytest.approx(stage, abs=1.0)
    for name in page.all(".name :is(b, i)"):  # nothing is cut
        size = "const {clientHeight: h, scrollHeight: whole} = arguments[0]; return whole - h"
        assert page.driver.execute_script(size, name) <= 1


def test_in_the_frame_of_a_notebook_it_walks_without_rights(driver, tmp_path, page):
    shown = tmp_path / "cell.html"
    shown.write_text(f"<!doctype html><body>{play(GAIT, inline=True)._repr_html_()}</body>")
    page.problems()
    driver.get(shown.as_uri())
    driver.switch_to.frame(driver.find_element(By.TAG_NAME, "iframe"))
    try:
        driver.execute_async_script(
            "const done = arguments[0], from = state.phase; setPlaying(true); (function wait() {"
            "  if (state.phase > from + 0.05) done(); else requestAnimationFrame(wait) })()"
        )
        assert driver.execute_script("return document.querySelectorAll('canvas').length") == 1
        assert driver.execute_script("return self.origin") == "null"
        assert page.problems() == []
    finally:
        driver.switch_to.default_content()


# What a page may do

INJECTED = """
    const done = arguments[0], refused = [];
    window.ran = [];
    document.addEventListener("securitypolicyviolation", ({ violatedDirective: kind }) =>
      refused.push(kind.replace(/-(src|elem|attr)/g, "")));
    const script = document.createElement("script");
    script.textContent = "window.ran.push('script')";
    document.body.append(script);
    const place = document.createElement("div");
    place.innerHTML = `<img src="x" onerror="window.ran.push('error')">
      <svg onload="window.ran.push('svg')"></svg><a href="javascript:window.ran.push('link')">a</a>
      <img src="http://127.0.0.1:1/leak"><link rel="stylesheet" href="http://127.0.0.1:1/style">
      <iframe src="http://127.0.0.1:1/frame"></iframe><object data="http://127.0.0.1:1/o"></object>
      <form action="http://127.0.0.1:1/form"><button>go</button></form>
      <div style="background: url(http://127.0.0.1:1/paint)">a</div>`;
    document.body.append(place);
    place.querySelector("a").click();
    place.querySelector("button").click();
    const attempts = [
      () => fetch("http://127.0.0.1:1/fetch"), () => new WebSocket("ws://127.0.0.1:1/socket"),
      () => new Worker("data:text/javascript,0"), () => navigator.sendBeacon("http://127.0.0.1:1/"),
    ];
    for (const attempt of attempts) try { Promise.resolve(attempt()).catch(() => {}) } catch {}
    (function wait(tries) {
      if (new Set(refused).size < 8 && tries > 0) return setTimeout(wait, 50, tries - 1);
      place.remove();
      script.remove();
      done([window.ran, refused]);
    })(100)"""


def test_nothing_that_gets_into_the_page_runs_or_loads(page):
    ran, refused = page.driver.execute_async_script(INJECTED)
    assert ran == []
    kinds = ["connect", "form-action", "frame", "img", "object", "script", "style", "worker"]
    assert set(refused) == set(kinds)
    page.problems()


HOSTILE = "</script><script>window.ran = 1</script><img src=x onerror='window.ran = 1'>\"'{{7*7}}"


def test_live_too_words_of_a_file_stay_text_and_a_failed_walk_says_so(driver, page, monkeypatch):
    found = {**GAIT.solution, "solver": "newton", "status": HOSTILE, "success": False}
    monkeypatch.setattr("human_gait.playback.page._names", lambda _: [HOSTILE])
    page.problems()
    with page_server(playback_page(replace(GAIT, solution=found)), policy=page_policy()) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        driver.get(server.url)
        server.shutdown()
    assert page.script("return walkers.length") == 1
    assert page.script("return window.ran") is None
    assert driver.title == page.one("h1").text == HOSTILE
    warning = page.one("#warning")
    assert warning.is_displayed()
    assert "This is no walk" in warning.text
    assert "<script>window.ran" in warning.text
    assert page.problems() == []


# Quality


def judged(page, milliseconds, times=1):
    """Let frames take so long; tell at which level the page then is."""
    code = f"for (let k = 0; k < JUDGED * {times}; k++) real({milliseconds}); return quality.level"
    return page.script(code)


def test_slow_frames_are_drawn_with_less_and_quick_ones_with_more(driver, folder, page):
    page.resize(1366, 768)
    driver.get((folder / "playback.html").as_uri())
    page.script("setPlaying(true)")  # a frame of this size takes long without a graphics card
    WebDriverWait(driver, 30).until(lambda _: page.script("return quality.level") > 0)
    page.resize(*SMALL)
    page.script(
        "window.real = judge; judge = () => {}; setPlaying(false); setSmooth(true);"
        "Object.assign(quality, {level: 0, times: [], rose: false, moved: -Infinity})"
    )
    assert judged(page, 40, 5) == 0
    assert judged(page, 60) == 1
    assert judged(page, 60) == 2
    assert judged(page, 60, 5) == page.script("return LEVELS.length - 1") == 3
    looks = "return [sun.castShadow, quality.smooth, viewer.renderer.domElement.width]"
    page.script("draw(quality.level)")
    assert page.script(looks) == [False, False, page.script("return Math.floor(innerWidth / 2)")]
    assert page.picture().std() > 10  # at rest
    assert page.script(looks) == [True, False, page.script("return innerWidth")]
    page.script("quality.since = performance.now()")
    assert judged(page, 10) == 3  # too early
    page.script("quality.since = -Infinity")
    assert judged(page, 10) == 2
    patience = page.script("return quality.patience")
    assert judged(page, 60) == 3
    assert page.script("return quality.patience") == 2 * patience
    for level in (2, 1, 0):
        page.script("quality.since = -Infinity")
        assert judged(page, 10) == level
    assert page.script("return quality.smooth")
    assert page.one("canvas").accessible_name
    assert page.problems() == []


# Keys


CAMERA = "return viewer.camera.position.toArray()"


def shifted(page, key):
    ActionChains(page.driver).key_down(Keys.SHIFT).send_keys(key).key_up(Keys.SHIFT).perform()


def test_keys_turn_zoom_and_go_back(undrawn):
    page = undrawn
    page.script("document.activeElement.blur()")
    home, distance = page.script(CAMERA), page.script(DISTANCE)
    for key, place, sign in (
        *((Keys.ARROW_RIGHT, 0, 1), (Keys.ARROW_LEFT, 0, -1)),
        *((Keys.ARROW_UP, 1, 1), (Keys.ARROW_DOWN, 1, -1)),
    ):
        page.press("0")
        shifted(page, key)
        assert sign * (page.script(CAMERA)[place] - home[place]) > 0.1, key
        assert page.script(DISTANCE) == pytest.approx(distance)
    assert page.script("return state.phase") == 0
    page.press("+", "+")
    assert page.script(DISTANCE) < 0.9 * distance
    page.press("-", "-", "-")
    assert page.script(DISTANCE) > 1.05 * distance
    page.press(*"-" * 35)
    assert page.script(DISTANCE) < page.script("return DOME")
    page.press("0")
    assert page.script(CAMERA) == pytest.approx(home)


def test_all_can_be_reached_with_the_tab_key_and_arrows_turn_the_picture(undrawn):
    page = undrawn
    page.script("element('play').focus()")
    while page.script("return document.activeElement.id") != "meshcat-pane":
        shifted(page, Keys.TAB)
    ring = "return getComputedStyle(document.activeElement, '::after').borderTopWidth"
    assert page.script(ring) == "3px"  # an outline would be behind the canvas
    before = page.script(CAMERA)
    page.press(Keys.ARROW_LEFT)
    assert page.script(CAMERA) != before
    reached = []
    here = """
        const here = document.activeElement, { id, dataset } = here;
        return [id || dataset.view || dataset.layer, getComputedStyle(here).outlineStyle]"""
    while "ask" not in reached:
        page.press(Keys.TAB)
        name, outline = page.script(here)
        assert outline == "solid", name
        reached.append(name)
    assert {"play", "scrub", "speed", "side", "oblique", "body", "torques"} <= set(reached)


def test_the_list_of_keys_comes_and_goes(undrawn):
    page = undrawn
    page.script("document.activeElement.blur()")
    page.press("?")
    assert page.one("#help").is_displayed()
    page.press(Keys.ARROW_RIGHT)
    assert page.script("return state.phase") == 0
    page.press(Keys.ESCAPE)
    assert not page.one("#help").is_displayed()
    page.click("#ask")
    said = page.one("#help").text
    for key in ("space", "Shift", "Esc"):
        assert key in said
    page.press("?")
    assert not page.one("#help").is_displayed()


def test_paper_gets_a_picture_of_the_walk(page):
    printed = page.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": False})
    pdf = base64.b64decode(printed["data"])
    assert b"/Subtype /Image" in pdf
    assert page.script("return element('still').naturalWidth") > 100
    assert not page.one("#still").is_displayed()


def test_one_finger_turns_and_two_come_nearer(undrawn):
    page = undrawn
    page.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    try:
        before = page.script(CAMERA)
        touch(page, [[(100, 100)], [(160, 100)], [(200, 110)]])
        assert np.linalg.norm(np.subtract(page.script(CAMERA), before)) > 0.5
        distance = page.script(DISTANCE)
        touch(page, [[(150, 100), (200, 100)], [(120, 100), (230, 100)], [(90, 100), (260, 100)]])
        assert page.script(DISTANCE) < 0.9 * distance
    finally:
        page.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})


def touch(page, steps):
    """Put fingers on the page, move them and take them away."""
    for k, places in enumerate([*steps, []]):
        kind = "touchEnd" if not places else "touchMove" if k else "touchStart"
        points = [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(places)]
        event = {"type": kind, "touchPoints": points}
        page.driver.execute_cdp_cmd("Input.dispatchTouchEvent", event)
    page.script("viewer.controls.update()")


def test_what_is_in_sight_is_saved_as_a_picture_and_as_a_film(page):
    """The browser is not let loose on the disk: what it would write is caught."""
    page.script(
        "window.saved = []; window.writing = download;"
        "download = (blob, suffix) => saved.push([suffix, blob.size])"
    )
    page.script("setPlaying(false); seek(0.3)")
    page.click("#save-picture")
    page.click("#save-film")
    wait = WebDriverWait(page.driver, 30)
    wait.until(lambda _: len(page.script("return saved")) == 2)
    sizes = dict(page.script("return saved"))
    assert set(sizes) == {"png", "webm"}
    assert min(sizes.values()) > 5000
    assert not page.script("return state.playing")
    assert page.script("return sheet.width") > 300
    page.script("download = writing")
