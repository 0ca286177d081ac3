"""What a plot of the page tells: values under a cursor, a step to go to, what its
metric is, and its values as a file.
"""

import csv
import io
import math
from collections.abc import Callable

import pytest

from kernels.metrics import METRICS
from sweep.web.live_show import Live
from tests.web.chromium import Opened

Open = Callable[..., Opened]
STEPS = 60
ROOM = 40, 10
"""Pixels on the left and right of a curve, of which the left ones have numbers."""


def run(opened: Open) -> Opened:
    """The common page at step 60, whose plots have all values until then."""
    page = opened()
    page.send(type="step", count=STEPS)
    page.until(f"boidsweep.view.stage.frame.step === {STEPS}")
    series = "boidsweep.view.charts.plots.values().next().value.series"
    page.until(f"{series}.steps.length === {STEPS} + 1")
    return page


def point(page: Opened, selector: str, part: float) -> tuple[float, float]:
    """A place on the screen, so far from left to right in a plot."""
    canvas = page.page.locator(selector).first
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    assert box is not None
    left, right = ROOM
    across = box["width"] - left - right
    return box["x"] + left + part * across, box["y"] + 30


def columns(show: Live) -> dict[str, list[float]]:
    rows = show.history.rows
    return {name: [row.values[name] for row in rows] for name in show.state.plots}


def shown(page: Opened) -> Live:
    show = page.show
    assert isinstance(show, Live)
    return show


def test_a_cursor_reads_all_plots_and_a_click_goes_to_its_step(opened: Open) -> None:
    page = run(opened)
    plots = page.page.locator(".plots").first.locator(".plot")
    page.page.mouse.move(*point(page, ".plot canvas", 0.5))
    page.until("boidsweep.view.charts.plots.values().next().value.cursor === 30")
    for place, name in enumerate(shown(page).state.plots):
        value = columns(shown(page))[name][30]
        reading = float(plots.nth(place).locator(".reading").inner_text())
        assert abs(reading - value) <= 5e-6 * abs(value)  # six digits
        label = plots.nth(place).locator("canvas").get_attribute("aria-label")
        assert label
        assert "at step 30" in label
    page.page.mouse.click(*point(page, ".plot canvas", 0.5))
    page.until("boidsweep.view.stage.frame.step === 30")
    assert shown(page).step == 30
    page.page.mouse.move(5, 5)
    page.until("boidsweep.view.charts.plots.values().next().value.cursor === null")


def test_a_plot_seen_closer_says_what_its_metric_is(opened: Open) -> None:
    page = run(opened)
    name = shown(page).state.plots[0]
    about = METRICS[name]
    page.page.locator(".plot h3 button").first.click()
    box = page.page.locator("dialog[open]")
    said = box.locator("dl").inner_text()
    assert about.text in said
    assert about.source in said
    small, large = (
        page.page.locator(which).first.bounding_box()
        for which in (".plot canvas", "dialog[open] canvas")
    )
    assert small is not None
    assert large is not None
    assert large["width"] > 3 * small["width"]
    page.page.mouse.move(*point(page, "dialog[open] canvas", 0.25))
    reading = box.locator(".reading")
    value = columns(shown(page))[name][15]
    reading.get_by_text(f"{float(f'{value:.6g}'):g}"[:5]).wait_for()
    page.page.mouse.click(*point(page, "dialog[open] canvas", 0.25))
    page.until("boidsweep.view.stage.frame.step === 15")
    page.page.keyboard.press("Escape")
    page.until("boidsweep.view.charts.closer.of === null")


def test_values_of_a_plot_are_saved_with_all_digits(opened: Open) -> None:
    page = run(opened)
    name = shown(page).state.plots[0]
    page.page.locator(".plot h3 button").first.click()
    with page.page.expect_download() as download:
        page.page.get_by_role("button", name="Save as CSV").click()
    job = shown(page).state.job
    file = download.value.suggested_filename
    assert file.endswith(f"-{job.trial_id[:8]}-{name}.csv")
    with download.value.path().open(encoding="utf-8") as saved:
        head, *rows = csv.reader(io.StringIO(saved.read()))
    assert head[0] == "step"
    assert head[1].startswith(name)
    assert [int(step) for step, _ in rows] == list(range(STEPS + 1))
    assert [float(value) for _, value in rows] == columns(shown(page))[name]


DRAWN = """() => {
  const [plot] = boidsweep.view.charts.plots.values();
  const context = plot.canvas.getContext("2d");
  let paths = [];
  context.beginPath = () => paths.push([]);
  context.moveTo = context.lineTo = (x, y) => paths.at(-1).push(y);
  plot.draw(plot.series.steps.at(-1), boidsweep.view.stage.colours);
  for (const name of ["beginPath", "moveTo", "lineTo"]) delete context[name];
  const [curve] = paths.toSorted((a, b) => b.length - a.length);
  return [curve, plot.series.values];
}"""
"""How high the curve of the first plot is drawn, and its values."""


def test_a_plot_on_a_logarithmic_axis_draws_logarithms(opened: Open) -> None:
    page = opened()
    page.send(type="metrics", names=["speed"])
    page.until("[...boidsweep.view.charts.plots.keys()].join() === 'speed'")
    page.send(type="step", count=STEPS)
    page.until(f"boidsweep.view.charts.seriesOf('speed').values.length > {STEPS}")
    for logarithmic in (False, True):
        page.page.locator(".plot h3 button").first.click()
        box = page.page.locator("dialog[open]")
        scale = box.get_by_label("logarithmic axis")
        assert scale.is_checked() is False
        scale.set_checked(logarithmic)
        page.page.keyboard.press("Escape")
        heights, values = page.ask(f"({DRAWN})()")
        places = [math.log(one) if logarithmic else one for one in values]
        least, most = places.index(min(places)), places.index(max(places))
        slope = (heights[most] - heights[least]) / (places[most] - places[least])
        assert slope < 0
        for height, place in zip(heights, places, strict=True):
            # Rounding of some hundred pixels.
            assert height - heights[least] == pytest.approx(
                slope * (place - places[least]), abs=1e-9
            )
    page.page.locator(".plot h3 button").first.click()
    assert page.page.locator("dialog[open]").get_by_label("logarithmic").is_checked()
    page.page.keyboard.press("Escape")


def test_values_that_have_no_logarithm_leave_gaps(opened: Open) -> None:
    page = run(opened)
    plot = "boidsweep.view.charts.plots.values().next().value"
    values = page.ask(
        f"({plot}.logarithmic = true, {plot}.series.values.fill(0), "
        f"{plot}.series.values[7] = 2, {plot}.series.values[8] = 4, {plot}.bounds())"
    )
    assert values["logarithmic"]
    assert 0 < values["low"] < 2
    assert values["high"] > 4
    heights, _ = page.ask(f"({DRAWN})()")
    assert len(heights) == 2
    assert all(math.isfinite(one) for one in heights)
    page.ask(f"{plot}.series.values.fill(0)")
    assert not page.ask(f"{plot}.bounds().logarithmic")  # else nothing were drawn
    page.page.locator(".plot h3 button").first.click()
    box = page.page.locator("dialog[open]")
    assert box.get_by_label("logarithmic axis").is_disabled()
    page.page.keyboard.press("Escape")
