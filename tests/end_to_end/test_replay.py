"""The replay in a real browser: it opens from disk, draws, plays, jumps, and follows a run that goes on."""

import shutil
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from clo_fleet.planning.pool import PlannerPool
from clo_fleet.study.replay.live import serving
from clo_fleet.study.replay.page import view
from clo_fleet.study.run import Run
from clo_fleet.study.shipped import shipped
from clo_fleet.world.world_file import read_world

selenium = pytest.importorskip("selenium.webdriver", reason="needs selenium (extra dev)")
BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(not (BROWSER and DRIVER), reason="needs chromium and chromedriver on the system")
ARGUMENTS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--window-size=1400,850"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"),
)
COLOURS = """
const canvas = document.getElementById("plan");
const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
const seen = new Set();
for (let i = 0; i < data.length; i += 4) seen.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
return seen.size;
"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A Chromium without a window."""
    options = selenium.ChromeOptions()
    options.binary_location = BROWSER
    for argument in ARGUMENTS:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    with selenium.Chrome(options, selenium.ChromeService(DRIVER)) as driver:
        yield driver


@pytest.fixture(scope="module")
def replay(tmp_path_factory: pytest.TempPathFactory, fleet_planners: PlannerPool) -> Path:
    """The page of the paper's worked example."""
    out = tmp_path_factory.mktemp("replay")
    with Run(read_world(shipped("worlds") / "three_rooms.yaml"), out=out, planners=fleet_planners) as run:
        run.finish()
    return view(out)


def until(holds: Callable[[], object], seconds: float = 20.0) -> None:
    """Return as soon as it holds."""
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def opened(browser: Any, address: str) -> Any:
    """The page, ready."""
    browser.get(address)
    until(lambda: browser.execute_script("return Boolean(window.replay && window.replay.state.frames)"))
    return browser


def at(browser: Any) -> float:
    """The time that is shown [s]."""
    return float(browser.execute_script("return window.replay.state.time"))


def texts(browser: Any, selector: str) -> list[str]:
    """The texts of all elements."""
    found = "return [...document.querySelectorAll(arguments[0])].map((element) => element.textContent)"
    return list(browser.execute_script(found, selector))


def test_a_replay_opens_from_disk_and_draws(browser: Any, replay: Path) -> None:
    """Rooms, robots and objects in many colours; no error on the console; what happened, in order."""
    opened(browser, replay.as_uri())
    assert browser.execute_script(COLOURS) > 20
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    assert texts(browser, "#world") == ["three_rooms"]
    assert "goals reached" in texts(browser, "#run")[0]
    times = [float(text.removesuffix(" s")) for text in texts(browser, "#marks time")]
    assert times == sorted(times)
    assert any("r1 drops move(r1, l1, l2)" in text for text in texts(browser, "#marks li"))


def test_it_plays_and_stops_at_the_end(browser: Any, replay: Path) -> None:
    """With the key that everybody tries first, and another for more speed."""
    opened(browser, replay.as_uri())
    keys = selenium.ActionChains(browser)
    keys.send_keys("---- ").perform()
    until(lambda: at(browser) > 0.1)
    assert texts(browser, "#play") == ["pause"]
    selenium.ActionChains(browser).send_keys("+++++++").perform()
    end = float(browser.execute_script("return window.replay.run.until"))
    until(lambda: at(browser) == end)
    assert texts(browser, "#play") == ["play"]


def test_one_jumps_to_an_event_and_sees_what_became_of_the_plan(browser: Any, replay: Path) -> None:
    """Dropped steps are struck out with time and reason; links and the watch set are those of that moment."""
    opened(browser, replay.as_uri())
    assert len(texts(browser, "#steps .step.pending")) == 5
    assert len(texts(browser, "#steps path")) == 9
    assert "(prepared o2)" in texts(browser, "#facts .fact")
    clicked = (
        "[...document.querySelectorAll('#marks li')].find((item) => item.textContent.includes('r1 drops')).click()"
    )
    browser.execute_script(clicked)
    until(lambda: len(texts(browser, "#steps .step.dropped")) == 3)
    assert at(browser) > 20
    assert all("r2 made (holding r1 o2) true" in text for text in texts(browser, "#steps .step.dropped .why"))
    struck = "return getComputedStyle(document.querySelector('.step.dropped .name')).textDecorationLine"
    assert browser.execute_script(struck) == "line-through"
    assert len(texts(browser, "#steps path")) == 2
    assert "(prepared o2)" not in texts(browser, "#facts .fact")


def test_scrubbing_choosing_zooming_and_the_theme_change_what_is_seen(browser: Any, replay: Path) -> None:
    """Each by its control."""
    opened(browser, replay.as_uri())
    slide = "const line = document.getElementById('time'); line.value = 12.5; line.dispatchEvent(new Event('input'))"
    browser.execute_script(slide)
    assert at(browser) == 12.5
    keys = selenium.ActionChains(browser)
    keys.send_keys("n").perform()
    until(lambda: any("r2" in text for text in texts(browser, "#steps .name")))
    scale = "return window.replay.drawing.view.scale"
    before = browser.execute_script(scale)
    canvas = browser.find_element("id", "plan")
    origin = selenium.common.actions.wheel_input.ScrollOrigin.from_element(canvas)
    selenium.ActionChains(browser).scroll_from_origin(origin, 0, -300).perform()
    until(lambda: browser.execute_script(scale) > 1.5 * before)
    selenium.ActionChains(browser).send_keys("0").perform()
    until(lambda: abs(browser.execute_script(scale) - before) < 1e-6)
    ground = "return getComputedStyle(document.body).backgroundColor"
    light = browser.execute_script(ground)
    selenium.ActionChains(browser).send_keys("t").perform()
    until(lambda: browser.execute_script(ground) != light)


def test_one_points_at_an_object_and_sees_what_is_true_of_it(
    browser: Any, tmp_path: Path, fleet_planners: PlannerPool
) -> None:
    """In a world with words of its own: here an object is a person who has been asked, and helps who has not."""
    with Run(read_world(shipped("worlds") / "dialog.yaml"), out=tmp_path, planners=fleet_planners) as run:
        run.finish()
    opened(browser, view(tmp_path).as_uri())
    browser.execute_script("window.replay.jump(window.replay.run.helps[0][0])")
    x, y = browser.execute_script(
        "const {drawing, run} = window.replay, {x, y} = run.pose('ann', 0); return drawing.at(x, y)"
    )
    canvas = browser.find_element("id", "plan")
    middle = [canvas.size["width"] / 2, canvas.size["height"] / 2]
    selenium.ActionChains(browser).move_to_element_with_offset(
        canvas, round(x - middle[0]), round(y - middle[1])
    ).perform()
    told = "const pointed = window.replay.drawing.pointed; return pointed && [pointed.item.id, ...pointed.state.facts]"
    until(lambda: browser.execute_script(told))
    name, *facts = browser.execute_script(told)
    assert name == "ann"
    assert browser.execute_script("return window.replay.run.helps[0][3]") in facts
    selenium.ActionChains(browser).move_to_element_with_offset(canvas, 0, round(-middle[1]) + 5).perform()
    until(lambda: not browser.execute_script(told))


def test_a_run_can_be_watched_while_it_goes_on(browser: Any, fleet_planners: PlannerPool) -> None:
    """The page follows; another host's name, another path and nonsense get nothing."""
    world = read_world(shipped("worlds") / "three_rooms.yaml")
    with Run(world, planners=fleet_planners) as run, serving(run) as server:
        run.step(25)
        opened(browser, server.url)
        until(lambda: browser.execute_script("return window.replay.run.until") >= 4)
        run.finish()
        until(lambda: "goals reached" in texts(browser, "#run")[0])
        assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
        for path, host, code in (("", "evil.example", 403), ("etc/passwd", None, 404)):
            request = urllib.request.Request(server.url + path, headers={"Host": host} if host else {})
            with pytest.raises(urllib.error.HTTPError, match=str(code)):
                urllib.request.urlopen(request, timeout=10)
        with urllib.request.urlopen(server.url + "events?from=-1", timeout=10) as answer:
            assert answer.status == 200
