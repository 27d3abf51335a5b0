"""Measure what ships for the default finger: the prices of the fidelities, and the tables of large strain.

`python benchmarks/shipped_tables.py prices | free | stuck`

`prices` measures the errors of each fidelity on the reference mesh. `free` measures the presses at finite strain over
five ratios of moduli, 36 a table; `stuck` those in which nothing slips, and adds them to the file.
"""

import argparse
from dataclasses import replace
from time import perf_counter

from papilla.core.files import write_text
from papilla.core.units import PER_CENT
from papilla.fem.finite.strain_tables import measure_large_strain
from papilla.fem.pressing.large_strain import SHIPPED_STRAIN_TABLES, known, shipped_text
from papilla.fem.pressing.prices import PRICED_QUANTITIES, SHIPPED_PRICES, Loss
from papilla.fem.pressing.pricing import measure_prices
from papilla.fem.reduction.gauges import gauge_weights
from papilla.mesh import build
from papilla.model.finger import Finger, Layer
from papilla.model.specimen import STICK_WORD

SHIPPED_DECIMALS = 4
"""Of the errors that ship: further digits than a hundredth of a percent differ from machine to machine."""

SHIPPED_LAYER_RATIOS = (4.0, 2.0, 8.0, 1.0, 16.0)
"""E_outer / E_inner of the tables that ship."""


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


def ship_strain_tables(stuck: bool) -> None:
    """Measure the default finger's tables of large strain and write the file that ships with the package."""
    finger = Finger.default()
    tables = [table for table in known(finger.strain_sha256) if (table.friction == 0) == stuck]
    for ratio in SHIPPED_LAYER_RATIOS:
        variant = replace(finger, outer=Layer(ratio * finger.inner.modulus, finger.outer.nu))
        began = perf_counter()
        table = measure_large_strain(variant, build(variant), friction=STICK_WORD if stuck else 0.0)
        error = PER_CENT * table.sd_error(gauge_weights(variant))
        took = perf_counter() - began
        print(f"r = {ratio:g}: {len(table.force)} presses, S_d to {error:.2f} %, {took:.0f} s", flush=True)
        tables = sorted([*tables, table], key=lambda table: (table.friction, table.ratio))
        write_text(SHIPPED_STRAIN_TABLES, shipped_text(finger.strain_sha256, tables))


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("prices", "free", "stuck"))
    what = parser.parse_args().what
    if what == "prices":
        ship_prices()
    else:
        ship_strain_tables(what == "stuck")


if __name__ == "__main__":
    main()
