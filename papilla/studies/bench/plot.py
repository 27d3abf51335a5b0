"""The bench as a plot: error against seconds."""

from papilla.studies.bench.runner import Bench
from papilla.view.price_plot import Price, price_figure
from papilla.view.style import write_png


def write_plot(bench: Bench, path) -> None:
    """Write the plot of all rows as PNG, atomically; raises `FileAccessError`."""
    prices = [
        Price(row.fidelity, row.element, row.size_mm, row.seconds_thousand, row.error_sd, row.pareto)
        for row in bench.rows
    ]
    write_png(price_figure(prices, bench.default.reference_size_mm), path)
