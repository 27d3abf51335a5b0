"""The second design that ships: the one-gauge finger of 2011."""

from papilla.model.finger import Finger, Slab


def test_it_loads_and_is_what_its_paper_says():
    finger = Finger.load("one-gauge")
    assert isinstance(finger.shape, Slab) and finger.shape.depth == 10.0
    assert len(finger.gauges) == 1 and finger.gauges[0].angle_deg == 0.0
    assert finger.ridges.width == 0.6
    assert finger.outer == Finger.default().outer and finger.inner == Finger.default().inner
