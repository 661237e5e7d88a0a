"""Draw the wings of the package and what imports what -> docs/images/wings.svg.

The rows are the layers of the contract in pyproject.toml, the arrows come from the import
statements (grimp, which import-linter uses, too; a type that is named is no dependency), the words
from the docstrings of the wings. An arrow that follows from others is left out. Layout: Sugiyama et
al. (1981), with an arrow over several rows as a chain of points, one for each row; the order in a
row by the mean of the neighbours, the places by least squares.

    python docs/architecture.py
"""

import ast
import textwrap
import tomllib
from collections import defaultdict
from html import escape
from itertools import pairwise
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "images" / "wings.svg"
BOX = (186, 66)  # width and height of a box, [px]
GAP = 26  # between boxes of a row
ROW = 112  # from row to row
POINT = 14  # room for an arrow that passes a row
COLOURS = ("#0b5fa5", "#eaf2fa", "#5b6b7b")  # edges and names, boxes, arrows
Arrow = tuple[str, str]


def layers() -> list[list[str]]:
    """Return the rows of wings from top to bottom, as the contract has them."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    whole = next(one for one in contracts if one.get("containers") == ["human_gait"])
    rows = [[name.strip(" ()") for name in row.split("|")] for row in whole["layers"]]
    return [row for row in rows if row != ["__main__"]]  # it only calls `cli`


def arrows() -> set[Arrow]:
    """Return every pair of wings of which the first imports something of the second."""
    graph = grimp.build_graph("human_gait", exclude_type_checking_imports=True, cache_dir=None)
    pairs = (
        (importer.split(".")[1], imported.split(".")[1])
        for importer in graph.modules - {"human_gait", "human_gait.__main__"}
        for imported in graph.find_modules_directly_imported_by(importer)
        if imported != "human_gait"
    )
    return {(upper, lower) for upper, lower in pairs if upper != lower}


def reduced(all_arrows: set[Arrow]) -> list[Arrow]:
    """Return the arrows that do not follow from others, in a fixed order."""
    below: dict[str, set[str]] = defaultdict(set)
    for upper, lower in all_arrows:
        below[upper].add(lower)

    def reached(name: str) -> set[str]:
        found, ahead = set(), [name]
        while ahead:
            new = below[ahead.pop()] - found
            found |= new
            ahead += new
        return found

    def follows(upper: str, lower: str) -> bool:
        return any(lower in reached(other) for other in below[upper] - {lower})

    return sorted(arrow for arrow in all_arrows if not follows(*arrow))


def summary(wing: str) -> str:
    """Return the first sentence of a wing's docstring, without its full stop."""
    path = ROOT / "human_gait" / wing
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return text.split("\n")[0].rstrip(".").replace("`", "")


class Layout:
    """Where boxes and arrows are.

    Parameters
    ----------
    rows : list of list of str
        Wings from top to bottom.
    drawn : list of Arrow
        What is drawn between them; each leads downwards.

    Raises
    ------
    ValueError
        If an arrow leads upwards or within its row.
    """

    def __init__(self, rows: list[list[str]], drawn: list[Arrow]) -> None:
        self.rows = [list(row) for row in rows]
        self.row_of = {name: k for k, row in enumerate(rows) for name in row}
        self.chains = {arrow: self._chain(arrow) for arrow in drawn}
        self.neighbours: dict[str, list[str]] = defaultdict(list)
        for chain in self.chains.values():
            for upper, lower in pairwise(chain):
                self.neighbours[upper].append(lower)
                self.neighbours[lower].append(upper)
        self.x = {name: float(i) for row in self.rows for i, name in enumerate(row)}
        self._order()
        self._place()

    def _chain(self, arrow: Arrow) -> list[str]:
        """Put a point into each row that an arrow passes; return them with both ends."""
        first, last = (self.row_of[name] for name in arrow)
        if first >= last:
            message = f"{arrow[0]} imports {arrow[1]}, which is not below it"
            raise ValueError(message)
        points = []
        for k in range(first + 1, last):
            points.append(f"{arrow[0]} > {arrow[1]} / {k}")
            self.rows[k].append(points[-1])
            self.row_of[points[-1]] = k
        return [arrow[0], *points, arrow[1]]

    def _order(self) -> None:
        """Sort each row by the mean place of its neighbours, down and up; keep the best order."""
        best, fewest = [list(row) for row in self.rows], self._crossings()
        for sweep in range(40):
            for row in self.rows if sweep % 2 else reversed(self.rows):
                k = self.row_of[row[0]]
                side = k - 1 if sweep % 2 else k + 1
                row.sort(key=lambda name: self._mean(name, side))
                self._number(row)
            if self._crossings() < fewest:
                best, fewest = [list(row) for row in self.rows], self._crossings()
        self.rows = best
        for row in self.rows:
            self._number(row)

    def _number(self, row: list[str]) -> None:
        for i, name in enumerate(row):
            self.x[name] = (i + 0.5) / len(row)

    def _mean(self, name: str, side: int) -> float:
        places = [self.x[one] for one in self.neighbours[name] if self.row_of[one] == side]
        return sum(places) / len(places) if places else self.x[name]

    def _crossings(self) -> int:
        parts = [pair for chain in self.chains.values() for pair in pairwise(chain)]
        return sum(
            self.row_of[a] == self.row_of[c]
            and (self.x[a] - self.x[c]) * (self.x[b] - self.x[d]) < 0
            for i, (a, b) in enumerate(parts)
            for c, d in parts[:i]
        )

    def _place(self) -> None:
        """Move every name towards its neighbours with room for all; points keep in line."""
        for row in self.rows:
            for i, name in enumerate(row):
                self.x[name] = i * (BOX[0] + GAP)
        for _ in range(400):
            for row in self.rows:
                wanted = [self._wanted(name) for name in row]
                self.x.update(zip(row, spread(wanted, [self._room(n) for n in row]), strict=True))
        left = min(self.x[name] - self._room(name) / 2 for name in self.x)
        self.x = {name: x - left for name, x in self.x.items()}

    def _wanted(self, name: str) -> float:
        weights = {one: 4 if ">" in name and ">" in one else 1 for one in self.neighbours[name]}
        if not weights:
            return self.x[name]
        return sum(w * self.x[one] for one, w in weights.items()) / sum(weights.values())

    @staticmethod
    def _room(name: str) -> float:
        return POINT + GAP if ">" in name else BOX[0] + GAP


def spread(wanted: list[float], rooms: list[float]) -> list[float]:
    """Return the places nearest to those wanted in order and with room: pool adjacent violators."""
    offsets = [0.0]
    for left, right in pairwise(rooms):
        offsets.append(offsets[-1] + (left + right) / 2)
    pools: list[tuple[float, int]] = []  # mean and size of neighbours that touch
    for place, offset in zip(wanted, offsets, strict=True):
        mean, size = place - offset, 1
        while pools and pools[-1][0] > mean:
            other, count = pools.pop()
            mean, size = (mean * size + other * count) / (size + count), size + count
        pools.append((mean, size))
    means = [mean for mean, size in pools for _ in range(size)]
    return [mean + offset for mean, offset in zip(means, offsets, strict=True)]


def picture() -> str:
    """Return the drawing as SVG."""
    layout = Layout(layers(), reduced(arrows()))
    width = max(x + BOX[0] / 2 for x in layout.x.values()) + GAP
    height = ROW * len(layout.rows)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height}" '
        f'font-family="system-ui, Helvetica, DejaVu Sans, sans-serif" text-anchor="middle">\n'
        f'<marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        f'orient="auto"><path d="M0 0.5 8 4 0 7.5z" fill="{COLOURS[2]}"/></marker>\n'
        f'<rect width="{width:.0f}" height="{height}" fill="#fff"/>\n'
    )
    lines = [_path(layout, chain) for chain in layout.chains.values()]
    boxes = [_box(layout, name) for row in layout.rows for name in row if ">" not in name]
    return head + "\n".join(lines + boxes) + "\n</svg>\n"


def _top(layout: Layout, name: str) -> float:
    return ROW * layout.row_of[name] + (ROW - BOX[1]) / 2


def _path(layout: Layout, chain: list[str]) -> str:
    """Return the arrow of one chain, with vertical tangents at every point."""
    path = ""
    for upper, lower in pairwise(chain):
        x0, y0 = layout.x[upper], _top(layout, upper) + BOX[1]
        x1, y1 = layout.x[lower], _top(layout, lower)
        bend = (y1 - y0) / 2
        path += f" L{x0:.0f} {y0:.0f}" if path else f"M{x0:.0f} {y0:.0f}"
        path += f" C{x0:.0f} {y0 + bend:.0f} {x1:.0f} {y1 - bend:.0f} {x1:.0f} {y1:.0f}"
    return (
        f'<path d="{path}" fill="none" stroke="{COLOURS[2]}" stroke-width="1.2" '
        f'marker-end="url(#tip)"/>'
    )


def _box(layout: Layout, name: str) -> str:
    """Return the box of one wing: its name and what it is."""
    x, y = layout.x[name], _top(layout, name)
    words = textwrap.wrap(summary(name), 33)[:3]
    text = "".join(
        f'<text x="{x:.0f}" y="{y + 34 + 12 * i:.0f}" font-size="10" fill="#333">'
        f"{escape(line)}</text>"
        for i, line in enumerate(words)
    )
    return (
        f'<rect x="{x - BOX[0] / 2:.0f}" y="{y:.0f}" width="{BOX[0]}" height="{BOX[1]}" rx="6" '
        f'fill="{COLOURS[1]}" stroke="{COLOURS[0]}"/>'
        f'<text x="{x:.0f}" y="{y + 18:.0f}" font-size="13" font-weight="600" '
        f'fill="{COLOURS[0]}">{name}</text>{text}'
    )


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
    print(PICTURE.relative_to(ROOT))
