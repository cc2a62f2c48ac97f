"""The tables of the page."""

import numpy as np

from common import page


def number(value, digits=3):
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def mean(values):
    values = [value for value in values if value is not None]
    return float(np.mean(values)) if values else None


class Table:
    """Cells by row (a tuple of names) and method; each holds one list of figures, of all seeds."""

    def __init__(self, methods, *names):
        self.names, self.methods, self.cells = names, list(methods), {}

    def add(self, row, method, figures):
        self.cells.setdefault(row, {}).setdefault(method, []).append(figures)

    def markdown(self, show):
        """`show` makes a cell's text of the figures of all seeds."""
        rows = [
            [*row, *(show(cells[method]) if method in cells else None for method in self.methods)]
            for row, cells in self.cells.items()
        ]
        return page.table([*self.names, *self.methods], rows)


def dice_cell(runs):
    """Mean over the objects that were solved, and how many were not, a run."""
    solved = [score for scores in runs for score in scores.values() if score is not None]
    refused = sum(score is None for scores in runs for score in scores.values()) / len(runs)
    return number(mean(solved)) + (f" ({refused:.3g} refused)" if refused else "")


def worst_cell(runs):
    return number(min((score for scores in runs for score in scores.values() if score is not None), default=None))


def seconds_cell(runs):
    return number(mean(runs), 1)


def radial_cell(runs):
    """Root mean square and mean, or a dash where there was no surface."""
    found = [run for run in runs if run]
    return f"{number(mean(r for r, _ in found))} / {mean(m for _, m in found):+.3f}" if found else "-"


def share_cell(runs):
    value = mean(runs)
    return "-" if value is None else f"{100 * value:.1f} %"


def signed_share_cell(runs):
    value = mean(runs)
    return "-" if value is None else f"{100 * value:+.1f} %"
