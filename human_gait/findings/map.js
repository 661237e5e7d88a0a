// The map over two settings: colour is the middle of an output, hatched is where nobody can walk.

const HATCHES = ["M-2 2L2 -2M0 8L8 0M6 10L10 6", "M-2 6L2 10M0 0L8 8M6 -2L10 2", "M0 4H8", "M4 0V8"];

function patterns() {
  return drawn("defs", {}, ...HATCHES.map((lines, k) =>
    drawn("pattern", {id: `hatch${k}`, width: 8, height: 8, patternUnits: "userSpaceOnUse"},
      drawn("rect", {width: 8, height: 8, class: "hatched"}), drawn("path", {d: lines, class: "hatch"}))));
}
const hatchOf = place => `url(#hatch${Math.min(place, HATCHES.length - 1)})`;

/** How many classes a setting is cut into for a map of all walks. */
const mapClasses = () => Math.round(Math.min(26, Math.max(6, Math.sqrt(data.n / 4))));

/** Cells of the map: rows, those found, and the middle of the output over those that have it. */
function cellsOf(x, y, output) {
  const cells = Array.from({length: x.labels.length * y.labels.length}, () => []);
  for (let row = 0; row < data.n; row++) {
    if (x.of[row] !== NONE && y.of[row] !== NONE) cells[y.of[row] * x.labels.length + x.of[row]].push(row);
  }
  return cells.map((rows, k) => {
    const values = rows.filter(row => counts(output, row)).map(row => output.values[row]);
    return {rows, i: k % x.labels.length, j: Math.floor(k / x.labels.length),
      found: rows.reduce((sum, row) => sum + success[row], 0), counted: values.length,
      middle: output.share ? values.reduce((sum, v) => sum + v, 0) / values.length
        : percentiles(Float64Array.from(values).sort(), [50])[0],
      beyond: rows.reduce((sum, row) => sum + beyond[row], 0)};
  }).filter(cell => cell.rows.length);
}

function drawMap() {
  const [xs, ys, output] = [state.mapX, state.mapY, state.mapOutput].map(name => columns.get(name));
  if (xs === ys) return void element("map").replaceChildren(made("p", {class: "notes"}, "Choose two different settings."));
  const picture = canvasOf(element("map"), `${output.label} over ${xs.label} and ${ys.label}`, width => Math.min(560, Math.max(320, width * 0.72)));
  picture.svg.append(patterns());
  (state.mapAs === "points" ? drawPoints : drawCells)(picture, xs, ys, output);
}

function drawCells(picture, xs, ys, output) {
  const x = classesOf(xs, mapClasses()), y = classesOf(ys, mapClasses());
  const cells = cellsOf(x, y, output), scaleX = banded(x, ...picture.x), scaleY = banded(y, ...picture.y);
  const colour = colours(cells.map(cell => cell.middle).filter(v => !Number.isNaN(v)), output);
  const marks = new Map(), group = drawn("g", {class: "cells"});
  for (const cell of cells) {
    const place = {x: scaleX(cell.i) - scaleX.size / 2, y: scaleY(cell.j) - scaleY.size / 2, width: scaleX.size, height: scaleY.size};
    const [why] = reasonsOf(cell.rows)[0] ?? [0];
    const none = cell.found === 0 && output !== FOUND;
    const fill = none ? hatchOf(why) : cell.counted ? colour.of(cell.middle) : "var(--stripe)";
    const lines = () => cellSaid(cell, xs, ys, x, y, output);
    const mark = telling(drawn("rect", {...place, fill, class: none ? "cell none" : "cell", tabindex: -1, role: "button", "data-cell": `${cell.i} ${cell.j}`}), lines);
    mark.setAttribute("aria-label", lines().join(", "));
    mark.addEventListener("click", () => selectAmong(cell.rows));
    marks.set(`${cell.i} ${cell.j}`, mark);
    group.append(mark);
    const lost = 1 - cell.found / cell.rows.length;
    if (lost > 0 && cell.found && output !== FOUND) {
      const r = Math.min(scaleX.size, scaleY.size) * 0.3 * Math.sqrt(lost);
      group.append(drawn("circle", {cx: scaleX(cell.i), cy: scaleY(cell.j), r: Math.max(r, 1.2), class: "lost"}));
    }
  }
  picture.svg.append(group, limitLine(cells, scaleX, scaleY));
  axes(picture, scaleX, scaleY, titled(xs), titled(ys), false);
  drawHere(picture, () => x.of[state.row] !== NONE && y.of[state.row] !== NONE && drawn("rect", {
    x: scaleX(x.of[state.row]) - scaleX.size / 2, y: scaleY(y.of[state.row]) - scaleY.size / 2,
    width: scaleX.size, height: scaleY.size, class: "here"}));
  walkable(picture.svg, marks);
  drawLegend(colour, output, cells);
}

/** The line between where most walks keep the limits and where most go beyond. */
function limitLine(cells, scaleX, scaleY) {
  const over = new Map(cells.filter(cell => cell.found).map(cell => [`${cell.i} ${cell.j}`, cell.beyond > cell.found / 2]));
  const w = scaleX.size / 2, h = scaleY.size / 2, parts = [];
  for (const cell of cells) {
    if (!over.get(`${cell.i} ${cell.j}`)) continue;
    const [cx, cy] = [scaleX(cell.i), scaleY(cell.j)];
    const sides = [[1, 0, `M${cx + w} ${cy - h}v${2 * h}`], [-1, 0, `M${cx - w} ${cy - h}v${2 * h}`], [0, 1, `M${cx - w} ${cy - h}h${2 * w}`], [0, -1, `M${cx - w} ${cy + h}h${2 * w}`]];
    for (const [i, j, line] of sides) if (over.get(`${cell.i + i} ${cell.j + j}`) === false) parts.push(line);
  }
  return drawn("path", {d: parts.join(""), class: "limit"});
}

function drawPoints(picture, xs, ys, output) {
  const rows = [...success.keys()].filter(row => !Number.isNaN(xs.values[row]) && !Number.isNaN(ys.values[row]));
  const shown = someOf(rows, 2000);
  const ends = column => roomy(...extent(shown, column));
  const axis = (column, place) => column.words.length ? banded(classesOf(column, 40), ...place) : linear(...ends(column), ...place);
  const scaleX = axis(xs, picture.x), scaleY = axis(ys, picture.y);
  const colour = colours(shown.filter(row => counts(output, row)).map(row => output.values[row]), output);
  axes(picture, scaleX, scaleY, titled(xs), titled(ys));
  const group = drawn("g", {class: "points"});
  for (const row of shown) {
    const [px, py] = [scaleX(xs.values[row]) + jitter(row, scaleX), scaleY(ys.values[row]) + jitter(row + 7, scaleY)];
    group.append(pointOf(row, px, py, success[row] && counts(output, row) ? colour.of(output.values[row]) : "none", [quantity(output, output.values[row])]));
  }
  picture.svg.append(group);
  drawHere(picture, () => state.row >= 0 && drawn("circle", {cx: scaleX(xs.values[state.row]) + jitter(state.row, scaleX), cy: scaleY(ys.values[state.row]) + jitter(state.row + 7, scaleY), r: 8, class: "here"}));
  drawLegend(colour, output, [{rows, found: rows.filter(row => success[row]).length}], shown.length < rows.length ? `${whole(shown.length)} of ${plural(rows.length, "walk")} are drawn.` : "");
}

/** Beside one another where words, not numbers, say where. */
const jitter = (row, scale) => scale.size ? ((row * 0.618034) % 1 - 0.5) * scale.size * 0.6 : 0;

/** A walk as a point to click; a cross where there is none. */
function pointOf(row, x, y, fill, more = []) {
  const mark = success[row] ? drawn("circle", {cx: x.toFixed(1), cy: y.toFixed(1), r: 4.5, class: "point", "data-row": row})
    : drawn("path", {d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8`, class: "cross", "data-row": row});
  mark.style.fill = fill;
  mark.addEventListener("click", () => select(row));
  return telling(mark, () => [...more.filter(line => success[row] && line !== DASH), success[row] ? "" : `no walk: ${reasonSaid(reasonOf[row])}`, ...settings.slice(0, 5).map(column => `${column.label}: ${quantity(column, column.values[row])}`)].filter(Boolean));
}

function extent(rows, column) {
  let low = Infinity, high = -Infinity;
  for (const row of rows) {
    const x = column.values[row];
    if (x < low) low = x;
    if (x > high) high = x;
  }
  return [low, high];
}

/** The colour of a value: from the 2nd to the 98th percentile, so that one walk does not take all. */
function colours(values, output) {
  const sorted = Float64Array.from(values).sort();
  const [low, high] = output.share ? [0, 100] : sorted.length ? percentiles(sorted, [2, 98]) : [0, 1];
  const scale = linear(low, high, 0, 1);
  return {of: x => ramp(scale(x)), ends: scale.ends, cut: sorted.length && (sorted[0] < low || sorted[sorted.length - 1] > high)};
}

function drawHere(picture, mark) {
  const group = drawn("g", {class: "heres"});
  picture.svg.append(group);
  picture.svg.here = () => group.replaceChildren(...[state.row >= 0 && mark()].filter(Boolean));
  picture.svg.here();
}

function drawLegend(colour, output, cells, more = "") {
  const steps = Array.from({length: 25}, (_, k) => ramp(k / 24)), [low, high] = colour.ends;
  const items = [made("li", {class: "scale"}, made("span", {}, said(low)), made("i", {style: `background: linear-gradient(90deg, ${steps.join(",")})`}), made("span", {}, `${said(high)} ${output.unit}`))];
  const cellular = state.mapAs !== "points";
  const lost = reasonsOf(cells.flatMap(cell => cell.rows));
  if (cellular && output !== FOUND) {
    const only = reasonsOf(cells.filter(cell => !cell.found).flatMap(cell => cell.rows));
    for (const [place, count] of only) {
      const swatch = drawn("svg", {viewBox: "0 0 32 16"}, drawn("rect", {width: 32, height: 16, fill: hatchOf(place)}));
      items.push(made("li", {}, swatch, `nobody walks: ${reasonSaid(place)} (${plural(count, "walk")})`));
    }
    if (lost.length > only.length || cells.some(cell => cell.found && cell.found < cell.rows.length)) {
      items.push(made("li", {}, drawn("svg", {viewBox: "0 0 32 16"}, drawn("circle", {cx: 16, cy: 8, r: 4, class: "lost"})), "some of the walks here were not found: the larger, the more"));
    }
  } else if (!cellular) {
    for (const [place, count] of lost) items.push(made("li", {}, drawn("svg", {viewBox: "0 0 32 16"}, drawn("path", {d: "M12 4l8 8m0 -8l-8 8", class: "cross"})), `no walk: ${reasonSaid(place)} (${whole(count)})`));
  }
  if (cellular && state.limits.length) items.push(made("li", {}, drawn("svg", {viewBox: "0 0 32 16"}, drawn("path", {d: "M0 8H32", class: "limit"})), "beyond it most walks exceed a limit"));
  element("map-legend").replaceChildren(...items);
  element("map-note").textContent = [cellular ? (output.share ? "Colour is the share of the walks of a cell." : "Colour is the median of the walks found in a cell.") : "Each point is a walk.", colour.cut ? "The scale ends at the 2nd and the 98th percentile." : "", more].filter(Boolean).join(" ");
}

function cellSaid(cell, xs, ys, x, y, output) {
  const at = (column, classes, k) => `${column.label}: ${classes.labels[k]}${column.unit ? SPACE + column.unit : ""}`;
  return [cell.counted ? `${output.label}: ${output.share ? "" : "median "}${(output.share ? `${said(cell.middle)}${SPACE}%` : quantity(output, cell.middle))}` : "No walk was found",
    at(xs, x, cell.i), at(ys, y, cell.j), `${whole(cell.found)} of ${plural(cell.rows.length, "walk")} found`,
    ...(cell.found > cell.counted ? [`${whole(cell.found - cell.counted)} without this number`] : []),
    ...(state.limits.length && cell.found ? [`${whole(cell.beyond)} beyond a limit`] : []),
    ...reasonsOf(cell.rows).slice(0, 3).map(([place, count]) => `${whole(count)}: ${reasonSaid(place)}`)];
}
