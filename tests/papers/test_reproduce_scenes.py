"""The scenes of `papilla reproduce`: each belongs to an experiment, and each value is read."""

import pickle
import re
from pathlib import Path

import pytest

from papilla.core import cache
from papilla_papers import claims as reproduce
from papilla_papers.claims import ALL_EXPERIMENTS
from papilla_papers.claims.scenes import SettingsTable, by_factors, even, scenes

ROOM = Path(reproduce.__file__).parent
NAMES = {"yarns_per_inch", "receptors_Hz", "more_grids", "snr_dB", "about", "weaves_mm"}
"""Tables whose keys are names, which the code need not know."""


def test_a_record_is_read_by_attributes_and_keeps_no_list():
    record = SettingsTable({"ends_mm": [1, [2.0]], "slide": {"speed_mm_s": 3.0}})
    assert record.ends_mm == (1, (2.0,)) and record.slide.speed_mm_s == 3.0 and {**record.slide} == {"speed_mm_s": 3.0}
    again = pickle.loads(pickle.dumps(record))
    assert again == record and isinstance(again.slide, SettingsTable)
    assert cache.versioned_key("a", 1, record) != cache.versioned_key("a", 1, SettingsTable({"ends_mm": [1, [2.5]]}))
    with pytest.raises(AttributeError, match="the table has no 'speed'; it has ends_mm, slide"):
        record.speed  # noqa: B018


def test_spaced_values_include_both_ends():
    ends = SettingsTable({"from": 1.0, "to": 4.0, "count": 3})
    assert even(ends).tolist() == [1.0, 2.5, 4.0] and by_factors(ends) == pytest.approx([1.0, 2.0, 4.0])


def test_every_experiment_has_its_scene_and_every_scene_its_experiment():
    assert {experiment.name for experiment in ALL_EXPERIMENTS} == {*scenes()} - {"signals"}


def test_every_value_of_a_scene_is_read():
    sources = {
        name: (ROOM / "experiments" / f"{name}.py").read_text(encoding="utf-8") for name in {*scenes()} - {"signals"}
    }
    shared = "".join(one.read_text(encoding="utf-8") for one in [*ROOM.glob("*.py"), *ROOM.glob("../figures/*.py")])

    def keys(table: SettingsTable):
        for name, value in table.items():
            yield name
            if isinstance(value, SettingsTable) and name not in NAMES:
                yield from keys(value)

    for name, table in scenes().items():
        known = sources.get(name, "".join(sources.values())) + shared
        unread = {key for key in keys(table) if not re.search(rf"\b{re.escape(key)}\b", known)}
        assert not unread, f"{name}: {unread}"
