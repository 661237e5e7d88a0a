"""The page of a study in a real browser: what it shows and what is done with it."""

import io
from itertools import pairwise

import numpy as np
import pytest
from browser import NEEDED, Tab
from PIL import Image
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select
from synthetic_study import SLIDES, TOO_STRONG, write_study

import human_gait as hg
from human_gait.body.skeleton import index
from human_gait.findings import page as pages
from human_gait.findings.walkers import POINTS, figure

pytestmark = NEEDED

WIDE, PHONE = (1400, 900), (360, 740)
LIMIT = "knee_extension_peak < 0.8"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Studies with their pages: a grid of all its walks, people, one setting, sixteen bits."""
    folder = tmp_path_factory.mktemp("studies")
    for kind, n in (("grid", 49), ("people", 30), ("line", 12)):
        write_study(folder / kind, kind, n, walks=kind != "line")
        hg.study_report(folder / kind, [LIMIT] if kind == "grid" else ())
    with pytest.MonkeyPatch.context() as patch:  # as studies of very many walks are written
        patch.setattr(pages, "_EXACT", 10)
        hg.study_report(folder / "people", [LIMIT], folder / "coarse.html")
    return folder


@pytest.fixture(scope="module")
def frame(folder):
    return hg.open_study(folder / "grid").to_dataframe()


@pytest.fixture
def tab(driver, folder):
    """The page of the grid as it is when it is opened, at rest."""
    return opened(driver, folder / "grid" / "report.html")


def opened(driver, path, size=WIDE):
    tab = Tab(driver, path, size)
    tab.script("setPlaying(false)")
    return tab


def choose(tab, name, value):
    Select(tab.one(f"#choose-{name}")).select_by_value(value)


def picture(tab, selector="#figure"):
    tab.script("drawFigure()")
    return np.array(Image.open(io.BytesIO(tab.one(selector).screenshot_as_png)).convert("RGB"), int)


def click_cell(tab, i, j):
    tab.click(f'[data-cell="{i} {j}"]')


ALL = ("grid/report.html", "people/report.html", "line/report.html", "coarse.html")


@pytest.mark.parametrize("path", ALL)
def test_a_page_is_drawn_without_a_complaint_and_fits_a_phone(driver, folder, path):
    tab = opened(driver, folder / path, PHONE)
    assert tab.script("return document.documentElement.scrollWidth") <= PHONE[0]
    for place in ("bands", "front", "shares", "curves"):
        assert tab.script(f"return document.querySelectorAll('#{place} svg').length"), place
    assert not tab.one("#walk").is_displayed()
    assert tab.problems() == []


def test_on_a_phone_the_walk_comes_where_a_place_is_touched(driver, folder):
    tab = opened(driver, folder / "grid/report.html", PHONE)
    click_cell(tab, 1, 1)
    assert tab.one("#walk").is_displayed()
    assert tab.script("return document.documentElement.scrollWidth") <= PHONE[0]
    tab.one("#close").click()
    assert not tab.one("#walk").is_displayed()


def test_dark_is_dark_and_light_is_light(tab):
    brightness = {}
    for scheme in ("dark", "light"):
        tab.prefer("color-scheme", scheme)
        whole = Image.open(io.BytesIO(tab.driver.get_screenshot_as_png())).convert("L")
        brightness[scheme] = np.array(whole).mean()
    assert brightness["dark"] < 80
    assert brightness["light"] > 200


def test_the_walk_of_a_place_that_is_clicked_moves(tab, frame):
    click_cell(tab, 2, 1)
    row = int(np.flatnonzero(_cell(frame, 2, 1))[0])
    assert tab.one("#walk-title").text == f"Walk {row + 1} of 49"
    assert f"{frame.walk_speed.iloc[row]:.4g} m/s" in tab.one("#person").text
    assert frame.index[row] in tab.one("#command").text
    assert tab.script("return getComputedStyle(document.body).stroke") == "none"  # of no other look
    tab.script("figure.phase = 0")
    start = picture(tab)
    tab.click("#figure-play")
    tab.driver.execute_async_script(
        "const done = arguments[0]; (function wait() {"
        "  if (figure.phase > 0.1) done(); else requestAnimationFrame(wait) })()"
    )
    tab.click("#figure-play")
    stopped = tab.script("return [figure.phase, stage.toDataURL()]")
    assert (abs(picture(tab) - start).max(axis=-1) > 20).mean() > 0.005
    assert tab.script("return [figure.phase, stage.toDataURL()]") == stopped


def _cell(frame, i, j):
    speeds, loads = np.unique(frame.walk_speed), np.unique(frame.load_mass)
    return (frame.walk_speed == speeds[i]) & (frame.load_mass == loads[j])


def test_the_figure_is_where_the_gait_is_in_the_mirrored_step_too(tab, folder, frame):
    row = int(np.flatnonzero(_cell(frame, 0, 2))[0])
    gait = hg.open_study(folder / "grid").gait(frame.index[row])
    tab.script(f"select({row})")
    for phase in (0.25, 0.75):  # in each step, at an instant of the page
        found = np.array(tab.script(f"return pointsAt(walkerOf.get({row}), {phase})"))
        step, within = divmod(2 * phase, 1.0)
        expected = figure(gait)[round(within * 12)]
        if step:
            other = [
                name[:-1] + {"r": "l", "l": "r"}[name[-1]] if name[-2:] in ("_r", "_l") else name
                for name in POINTS
            ]
            expected = expected[[POINTS.index(name) for name in other]] * [-1, 1, 1]
        expected[..., 2] += (step - 2 * phase) * gait.step_length
        np.testing.assert_allclose(found, expected, atol=2e-4)


def test_between_its_instants_the_figure_is_within_millimetres(tab, folder, frame):
    row = int(np.flatnonzero(_cell(frame, 0, 2))[0])
    gait = hg.open_study(folder / "grid").gait(frame.index[row])
    tab.script(f"select({row})")
    share = 5.5 / 12
    found = np.array(tab.script(f"return pointsAt(walkerOf.get({row}), {share / 2})"))
    height = gait.q(share * gait.step_time)[index("pelvis_ty")]
    assert found[POINTS.index("pelvis")][1] == pytest.approx(height, abs=0.003)


def test_the_figure_can_be_turned_by_hand_and_by_key(tab):
    seen = [picture(tab)]
    for view in ("side", "front", "top"):
        tab.click(f"[data-view={view}]")
        seen.append(picture(tab))
    tab.one("#figure").send_keys(Keys.ARROW_LEFT)
    seen.append(picture(tab))
    for one, other in pairwise(seen):
        assert (one != other).any()


def test_cells_are_hatched_where_nobody_walks_and_say_why(tab, frame):
    hatched = tab.script(
        "return [...document.querySelectorAll('#map .none')].map(cell => cell.dataset.cell)"
    )
    expected = [
        f"{i} {j}"
        for j in range(7)
        for i in range(7)
        if not frame.success[_cell(frame, i, j)].any()
    ]
    assert sorted(hatched) == sorted(expected)
    assert hatched
    said = tab.one(f'[data-cell="{hatched[0]}"]').get_attribute("aria-label")
    assert TOO_STRONG in said or SLIDES in said
    assert "nobody walks" in tab.one("#map-legend").text
    click_cell(tab, *hatched[0].split())
    assert "No walk was found" in tab.one("#still-note").text
    assert not tab.one("#figure").is_displayed()


def test_the_colour_of_a_cell_is_the_median_of_those_found(tab, frame):
    choose(tab, "mapX", "load_mass")
    choose(tab, "mapY", "walk_speed")
    choose(tab, "mapOutput", "cost")
    middles = tab.script(
        "const of = name => classesOf(columns.get(name), 7);"
        "return cellsOf(of('load_mass'), of('walk_speed'), columns.get('cost'))"
        ".map(cell => [cell.i, cell.j, cell.found, cell.middle ?? null])"
    )
    for i, j, found, middle in middles:
        rows = frame[_cell(frame, j, i) & frame.success]
        assert found == len(rows)
        if found:
            assert middle == pytest.approx(rows.cost.median(), rel=1e-6)


def test_arrows_walk_over_the_map_and_enter_chooses(tab):
    tab.script("document.querySelector('[data-cell=\"0 0\"]').focus()")
    tab.press(Keys.ARROW_RIGHT, Keys.ARROW_UP)
    focused = tab.script("return document.activeElement.dataset.cell")
    assert focused == "1 1"
    assert tab.one("#tip").is_displayed()
    tab.press(Keys.ENTER)
    assert tab.script(
        "return [classesOf(columns.get('walk_speed'), 7).of[state.row],"
        " classesOf(columns.get('load_mass'), 7).of[state.row]]"
    ) == [1, 1]


def test_who_goes_beyond_a_limit_is_counted_and_counted_again(tab, frame):
    found = frame[frame.success]
    over = int((found.knee_extension_peak >= 0.8).sum())
    assert f"{over} walks of {len(found)}" in tab.one("#limits-said").text
    field = tab.one("#limit-rows input")
    field.clear()
    field.send_keys("0.5")
    over = int((found.knee_extension_peak >= 0.5).sum())
    assert f"{over} of {len(found)} walks" in tab.one("#limits-said .said").text
    counted = tab.script(
        "return [...document.querySelectorAll('#limits-table tbody tr')]"
        ".map(row => Number(row.children[3].textContent))"
    )
    by_speed = found.groupby("walk_speed").knee_extension_peak.apply(
        lambda x: int((x >= 0.5).sum())
    )
    assert counted == by_speed.tolist()
    field.send_keys("x")
    assert field.get_attribute("aria-invalid") == "true"
    assert f"{over} of {len(found)} walks" in tab.one("#limits-said .said").text
    tab.click("#limits-map")
    assert tab.script("return state.mapOutput") == "beyond"


def test_a_walk_without_the_number_is_neither_inside_nor_beyond(tab):
    tab.script(
        "outputs[0].values[state.row] = NaN; state.limits = [{name: outputs[0].name,"
        " sign: '<', bound: -1e9}]; changed('limits')"
    )
    n = tab.script("return walked")
    assert f"{n - 1} walks of {n}" in tab.one("#limits-said").text
    assert "of 1 it cannot be told" in tab.one("#limits-said").text


def test_a_coarse_page_counts_as_a_fine_one(driver, folder):
    """But for walks that lie within 1/65,534 of the range of the limit."""
    frame = hg.open_study(folder / "people").to_dataframe()
    tab = opened(driver, folder / "coarse.html")
    over = int((frame.knee_extension_peak >= 0.8).sum())
    assert f"{over} walk" in tab.one("#limits-said").text
    assert "95 % interval" in tab.one("#limits-table").text
    assert "study.gait(" in tab.one("#command").text


def test_the_front_has_those_that_nobody_betters(tab, frame):
    choose(tab, "frontX", "cost_of_transport")
    choose(tab, "frontY", "hip_extension_peak")
    choose(tab, "frontYWay", "-1")
    found = tab.script(
        "return frontOf([...success.keys()].filter(row => success[row]),"
        " columns.get('cost_of_transport'), columns.get('hip_extension_peak'), 1, -1)"
    )
    x, y = frame.cost_of_transport.to_numpy(), -frame.hip_extension_peak.to_numpy()
    better = (x[:, None] <= x) & (y[:, None] <= y) & ((x[:, None] < x) | (y[:, None] < y))
    expected = np.flatnonzero(frame.success & ~better.any(axis=0))
    assert sorted(found) == expected.tolist()
    assert len(tab.all("#front .best .point")) == len(expected)


def test_percentiles_against_a_setting_are_those_of_numpy(driver, folder):
    tab = opened(driver, folder / "people/report.html")
    assert tab.script("return [state.mapX, state.mapY]") == ["subject_stature", "subject_mass"]
    frame = hg.open_study(folder / "people").to_dataframe()
    parts = tab.script(
        "return bandsOf(columns.get('load_mass'), columns.get('cost')).parts"
        ".map(part => [part.at, part.n, part.marks])"
    )
    for load, n, marks in parts:
        costs = frame.cost[frame.load_mass == load]
        assert n == len(costs)
        assert marks == pytest.approx(np.percentile(costs, [5, 25, 50, 75, 95]), rel=1e-6)


def test_curves_by_group_and_of_the_walk_that_is_chosen(tab, folder, frame):
    row = int(np.flatnonzero(frame.success)[5])
    tab.script(f"select({row})")
    curves = hg.open_study(folder / "grid").cycles([frame.index[row]])
    found = tab.script(f"return ownCurve({row}, 6)")
    name = tab.script("return cycles.curves[6].name")
    np.testing.assert_allclose(found, curves[name][0, ::2], atol=1e-4 * np.ptp(curves[name]) + 1e-6)
    choose(tab, "curveBy", "load_mass")
    assert len(tab.all("#curves-legend li")) >= 3
    choose(tab, "curveKind", "moments")
    assert "moment [N m/kg]" in tab.one("#curves figcaption").text


def test_the_tables_sort_by_their_heads(tab, frame):
    choose(tab, "tableOf", "lost")
    lost = int((~frame.success).sum())
    assert f"of {lost} walks" in tab.one("#page-said").text
    choose(tab, "tableOf", "found")
    heads = [head.text for head in tab.all("#walks thead button")]
    k = next(k for k, head in enumerate(heads) if head.startswith("Cost"))
    for turn, way in enumerate(("ascending", "descending")):
        tab.script(f"document.querySelectorAll('#walks thead button')[{k}].click()")
        assert tab.all("#walks thead th")[k].get_attribute("aria-sort") == way
        costs = [float(cell.text) for cell in tab.all(f"#walks tbody td:nth-child({k + 1})")]
        expected = frame.cost[frame.success].sort_values(ascending=not turn)[: len(costs)]
        assert costs == pytest.approx(expected.tolist(), abs=1)
    tab.one("#walks tbody button").click()
    best = int(np.argmax(np.nan_to_num(frame.cost.to_numpy())))
    assert tab.script("return state.row") == best


def test_what_the_setting_does_is_drawn_with_its_interval(tab):
    choose(tab, "matterOutput", "froude")
    assert tab.one("#shares-note").text.startswith("From ")
    first = tab.script("return data.matters.froude.shares[0].setting")
    assert first == "walk_speed"
    assert "R² =" in tab.one("#slopes-note").text
    assert len(tab.all("#slopes tbody tr")) == 2


@pytest.mark.parametrize("path", ALL)
def test_every_control_says_what_it_is(driver, folder, path):
    tab = opened(driver, folder / path)
    controls = tab.all("button, select, input, [role=button]")
    names = tab.script(
        "return [...document.querySelectorAll('button, select, input')]"
        ".filter(one => one.checkVisibility()).map(one => one.getAttribute('aria-label')"
        " || one.labels?.[0]?.textContent || one.textContent)"
    )
    assert len(controls) >= len(names) > 10
    assert all(name.strip() for name in names)


def test_on_paper_it_is_light_and_has_no_buttons(tab):
    tab.prefer("color-scheme", "dark")
    tab.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert not tab.one("#limit-add").is_displayed()
    assert (
        tab.script("return getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    )
    tab.script("dispatchEvent(new Event('beforeprint'))")
    assert len(tab.all("#figure-paper path")) > 20
    bright, dim = (sum(map(int, tab.script(f"return ramp({x})")[4:-1].split())) for x in (0, 1))
    assert bright > dim  # pale is low, as where the screen is light
    tab.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    tab.prefer("color-scheme", "light")
