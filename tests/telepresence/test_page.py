"""The page, in a real browser without a window: its sliders, its numbers, and its model against the Python one."""

import json
import math
import re
import shutil
import subprocess

import numpy as np
import pytest

from papilla.telepresence import Component, HandMotion, LocalModel
from papilla.telepresence.page import settings, write_page

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no chromium or chrome is installed")
BEGIN = {"wavelength_mm": 1.2, "round_trip_ms": 100.0, "loss": 0.0, "amplitude_um": 12.0}
BYTES = {"bytes_local": 100.0, "bytes_direct": 68.0}


def evaluated(tmp_path, script):
    """What `script` returns in the page, run in the browser."""
    write_page(tmp_path / "page.html", settings(HandMotion(), **BEGIN, **BYTES))
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    probe = f"<script>document.title = JSON.stringify((() => {{ {script} }})());</script></body>"
    (tmp_path / "probe.html").write_text(page.replace("</body>", probe), encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", "--virtual-time-budget=200"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", (tmp_path / "probe.html").as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    title = re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)
    assert title and title[1].startswith(("{", "[")), done.stderr[-2000:]
    return json.loads(title[1])


SLIDE = """
const slide = (id, value) => { $(id).value = value; $(id).dispatchEvent(new Event("input")); };
const names = ["lag-local", "lag-direct", "felt-local", "bytes-local", "bytes-direct"];
const told = () => { loop.advance(4); tellNumbers();
  return Object.fromEntries(names.map(id => [id, $(id).textContent])); };
"""


def test_the_page_is_one_file_that_needs_no_network(tmp_path):
    write_page(tmp_path / "page.html", settings(HandMotion(), **BEGIN, **BYTES))
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "SETTINGS*/{}" not in page and '"round_trip_ms": 100.0' in page
    assert not re.search(r"(src|href)\s*=|https?://|@import|fetch\(|XMLHttpRequest", page)


@needs_browser
@pytest.mark.slow
def test_sliders_move_the_lag_of_direct_feedback_and_not_that_of_the_local_model(tmp_path):
    script = SLIDE + (
        'const rows = []; for (const trip of [0, 200, 400]) { slide("round-trip", trip); rows.push(told()); }'
        'slide("loss", 30); rows.push(told()); slide("wavelength", 2.5); rows.push(told()); return rows;'
    )
    rows = evaluated(tmp_path, script)
    lags = [[int(row[f"lag-{name}"].split()[0]) for row in rows] for name in ("local", "direct")]
    assert max(lags[0]) <= 2
    assert lags[1] == pytest.approx([0, 200, 400, 400, 400], abs=8)
    assert float(rows[0]["felt-local"].split()[0]) == pytest.approx(1.2, abs=0.05)
    assert float(rows[-1]["felt-local"].split()[0]) == pytest.approx(2.5, abs=0.15)
    assert int(rows[0]["bytes-local"]) < 0.2 * int(rows[0]["bytes-direct"])


@needs_browser
@pytest.mark.slow
def test_the_model_of_the_page_is_that_of_the_package(tmp_path):
    time = np.arange(2000) / 1000
    hand = 29.0 * (1 - np.cos(2 * np.pi * 1.07 * time)) + 1.0 * np.sin(2 * np.pi * 3 * time)
    told = {100: (1.2, 12.0), 700: (2.0, 20.0), 1300: (0.5, 12.0)}
    script = f"""
      const model = new LocalModel(SETTINGS.limits), told = {json.dumps(told)}, hand = {json.dumps(hand.tolist())};
      let now = [NaN, NaN];
      return hand.map((x, n) => {{
        if (told[n]) now = told[n];
        if (n % 20 === 0 && n >= 100) model.learn(n / 1000, ...now);
        return model.update(n / 1000, x); }});"""
    page = np.array(evaluated(tmp_path, script))
    model, ours, now = LocalModel(compensate=False), [], (math.nan, math.nan)
    for row, (at, place) in enumerate(zip(time, hand, strict=True)):
        now = told.get(row, now)
        model.move(at, place)
        if row % 20 == 0 and row >= 100:
            model.learn(at, (Component(now[0], now[1] / 0.238),))
        ours.append(model.update(at).displacement_um)
    assert np.abs(page).max() > 15
    assert np.std(page - ours) < 0.1 * np.std(ours)
