"""Parameters of studies in TOML files: rules of drawing, and no key that nobody reads."""

import math
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

from papilla.core import settings

ROOT = Path(__file__).parents[2]
ROOMS = ("papilla", "papilla_papers", "benchmarks")
FOLDERS = sorted(path.parent for room in ROOMS for path in (ROOT / room).rglob("parameters.toml"))


def drawn(table, vary=True, seed=3):
    return settings.drawn(table, np.random.default_rng(seed), vary=vary)


@pytest.mark.parametrize(
    "rule, low, high",
    [
        ({"about": 6.0}, 4.0, 9.0),
        ({"about": 6.0, "within": 2.0}, 3.0, 12.0),
        ({"uniform": [-1, 3]}, -1, 3),
        ({"log_uniform": [0.1, 10]}, 0.1, 10),
        ({"angle": "any"}, 0, 2 * math.pi),
        ({"one_of": [2.0, 5.0]}, 2.0, 5.0),
    ],
)
def test_a_rule_draws_between_its_ends(rule, low, high):
    values = [drawn({"x": rule}, seed=seed)["x"] for seed in range(400)]
    assert low <= min(values) < low + 0.05 * (high - low) and high - 0.05 * (high - low) < max(values) <= high


def test_values_are_drawn_in_the_order_of_the_keys():
    rules = {"a": 2.0, "b": {"uniform": [0, 1]}, "c": {"normal": 3.0}, "d": {"uniform": [1, 2], "count": 4}}
    rng = np.random.default_rng(3)
    values = drawn(rules)
    assert values["a"] == 2.0 and values["b"] == rng.uniform() and values["c"] == 3 * rng.normal()
    assert values["d"].tolist() == rng.uniform(1, 2, 4).tolist()


def test_tuning_takes_the_value_itself_and_the_first_choice():
    assert drawn({"x": {"about": 6.0}, "y": {"one_of": [50.0, 60.0]}}, vary=False) == {"x": 6.0, "y": 50.0}


def test_noise_has_a_value_for_each_sample_and_column():
    values = drawn({"rate_Hz": 500.0, "seconds": 4.0, "one": {"noise": 0.1}, "two": {"noise": [1.0, 20.0]}})
    assert values["one"].shape == (2000,) and values["one"].std() == pytest.approx(0.1, rel=0.1)
    assert values["two"].std(axis=0) == pytest.approx([1.0, 20.0], rel=0.1)


def test_chance_is_a_share_and_an_unknown_rule_is_an_error():
    assert np.mean([drawn({"x": {"chance": 0.3}}, seed=seed)["x"] for seed in range(400)]) == pytest.approx(
        0.3, abs=0.06
    )
    with pytest.raises(ValueError, match="no rule of drawing: {'abuot': 1}"):
        drawn({"x": {"abuot": 1}})


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_every_parameter_is_read_by_its_module(folder):
    for name, table in settings.tables(".".join(folder.relative_to(ROOT).parts)).items():
        source = (folder / f"{name}.py").read_text(encoding="utf-8")
        unread = [key for key in table if not re.search(rf"(PARAMETERS|SETTINGS|CASES|SIZES|GIVEN)\.{key}\b", source)]
        assert not unread, f"{name}.py does not read {unread}"


def test_a_table_is_a_record_and_goes_to_other_processes():
    table = settings.SettingsTable({"a": {"b": [1, [2, 3]]}, "c": "x"})
    assert table.a.b == (1, (2, 3)) and table["c"] == table.c == "x"
    again = pickle.loads(pickle.dumps(table))
    assert again == table and again.a.b == (1, (2, 3))
    with pytest.raises(AttributeError, match="the table has no 'd'; it has a, c"):
        _ = table.d
