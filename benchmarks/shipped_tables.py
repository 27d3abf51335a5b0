"""Measure what ships for the default finger: the prices of the fidelities, and the tables of large strain.

`python benchmarks/shipped_tables.py prices | free | stuck [--published]`

`prices` measures the errors of each fidelity on the reference mesh. `free` measures the presses at finite strain, 36 a
table, over the ratios of moduli of the file that ships; `stuck` those in which nothing slips. `--published` does it for
the published finger.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from papilla.core.files import write_text
from papilla.core.outside import read_json
from papilla.core.units import PER_CENT
from papilla.fem.finite.strain_tables import PressedFinger, measure_large_strain
from papilla.fem.pressing.large_strain import ALL_SHIPPED, LargeStrain, shipped_text
from papilla.fem.pressing.prices import PRICED_QUANTITIES, SHIPPED_PRICES, Loss
from papilla.fem.pressing.pricing import measure_prices
from papilla.fem.reduction.gauges import gauge_weights
from papilla.mesh import build
from papilla.model.finger import Finger, Layer
from papilla.model.specimen import STICK_WORD, Friction

FINE_GROWTH = 1.2
"""Growth of the load of presses that stick: these tables are made once, so they may be accurate."""

SHIPPED_DECIMALS = 4
"""Of the errors that ship: further digits than a hundredth of a percent differ from machine to machine."""


def ship_prices() -> None:
    """Measure the default finger's prices and write the file that ships with the package."""
    prices = measure_prices(Finger.default(), progress=print)
    assert prices.hertz is not None
    losses = {name: _rounded(getattr(prices, name)) for name in ("hertz", "mesh", "small_strain")}
    write_text(SHIPPED_PRICES, replace(prices, **losses).to_json())
    print(f"{SHIPPED_PRICES.name} written")


def _rounded(loss: Loss) -> Loss:
    errors = {name: getattr(loss, name) for name in PRICED_QUANTITIES}
    return replace(loss, **{name: tuple(round(error, SHIPPED_DECIMALS) for error in of) for name, of in errors.items()})


def ship_strain_tables(finger: Finger, path: Path, stuck: bool) -> None:
    """Measure anew the tables of large strain in a file that ships, without friction or stuck."""
    tables = [LargeStrain.from_json(table) for table in read_json(path)["tables"]]
    for number, shipped in enumerate(tables):
        if (shipped.friction > 0) != stuck:
            continue
        variant = replace(finger, outer=Layer(shipped.ratio * finger.inner.modulus, finger.outer.nu))
        began = perf_counter()
        friction: Friction = STICK_WORD if stuck else 0.0
        tables[number] = measure_large_strain(
            PressedFinger(variant, build(variant)), friction=friction, growth=FINE_GROWTH
        )
        error = PER_CENT * tables[number].sd_error(gauge_weights(variant))
        took = perf_counter() - began
        print(
            f"r = {shipped.ratio:g}: {len(tables[number].force)} presses, S_d to {error:.2f} %, {took:.0f} s",
            flush=True,
        )
        write_text(path, shipped_text(finger.strain_sha256, tables))


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("prices", "free", "stuck"))
    parser.add_argument("--published", action="store_true")
    given = parser.parse_args()
    if given.what == "prices":
        ship_prices()
    else:
        finger = Finger.published() if given.published else Finger.default()
        ship_strain_tables(finger, ALL_SHIPPED[given.published], given.what == "stuck")


if __name__ == "__main__":
    main()
