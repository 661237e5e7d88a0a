// Curves of the gait cycle: mean and percentiles of all walks or of a group, and the walk that is chosen.

const cycles = data.cycles;
const KINDS = {angles: ["Joint angles", curve => curve.unit === "deg"], moments: ["Joint moments", curve => curve.unit === "N m/kg"], forces: ["Ground reaction", curve => curve.unit === "BW"]};
const own = cycles.n ? typed(cycles.own, Uint16Array) : null;
const curvesOf = new Map((cycles.rows ?? []).map((row, k) => [row, k]));
const unpackedBands = new Map();

/** Bands of a group, as numbers by band, curve and point. */
function bandsOfCurves(group) {
  if (!unpackedBands.has(group)) unpackedBands.set(group, typed(group.bands, Uint16Array));
  const codes = unpackedBands.get(group), {curves, points} = cycles;
  return (band, curve) => Array.from({length: points}, (_, k) => {
    const code = codes[(band * curves.length + curve) * points + k];
    return code === NONE ? NaN : curves[curve].low + code * curves[curve].step;
  });
}

function ownCurve(row, curve) {
  const k = curvesOf.get(row);
  if (k === undefined) return null;
  const {curves, points} = cycles, from = (k * curves.length + curve) * points;
  const values = Array.from(own.subarray(from, from + points), code => code === NONE ? NaN : curves[curve].low + code * curves[curve].step);
  return values.some(Number.isNaN) ? null : values;
}

function drawCurves() {
  if (!cycles.n) return;
  const groups = state.curveBy ? cycles.groups[state.curveBy] : [cycles.all], holder = element("curves");
  const wanted = cycles.curves.map((curve, k) => [curve, k]).filter(([curve]) => KINDS[state.curveKind][1](curve));
  holder.replaceChildren(...wanted.map(([curve]) => made("figure", {}, made("figcaption", {}, `${curve.label} [${curve.unit}]`), made("div", {class: "picture"}))));
  [...holder.querySelectorAll(".picture")].forEach((place, k) => drawCurve(place, wanted[k][0], wanted[k][1], groups));
  const swatch = (kind, k, dash = "none") => drawn("svg", {viewBox: "0 0 32 16", class: "band", style: `--colour: ${kind === "chosen" ? "var(--ink)" : GROUPS[k % GROUPS.length]}`}, kind === "outer" || kind === "inner" ? drawn("rect", {width: 32, height: 16, class: kind}) : drawn("path", {d: "M0 8H32", class: kind, "stroke-dasharray": dash}));
  const items = state.curveBy ? groups.map((group, k) => made("li", {}, swatch("middle", k, DASHES[k % DASHES.length]), `${columns.get(state.curveBy).label}: ${group.label} (n = ${whole(group.n)})`))
    : [made("li", {}, swatch("middle", 0), "mean"), made("li", {}, swatch("inner", 0), "25th to 75th percentile"), made("li", {}, swatch("outer", 0), "5th to 95th percentile")];
  if (curvesOf.has(state.row)) items.push(made("li", {}, swatch("chosen", 0), "the walk that is chosen"));
  element("curves-legend").replaceChildren(...items);
  element("curves-note").textContent = `The right leg from heel strike (0 %) to the next (100 %). ${state.curveBy ? "Lines are means, bands the 5th to the 95th percentile, at each instant." : "At each instant of the cycle."} ${cycles.n < cycles.of ? `Of an even sample of ${whole(cycles.n)} of the ${plural(cycles.of, "walk")} found.` : `Of the ${plural(cycles.n, "walk")} found.`}${groups.some(group => group.n < 20) ? " With fewer than 20 walks in a group outer percentiles are the extremes, or nearly so." : ""}`;
}

function drawCurve(holder, curve, k, groups) {
  const edge = {left: 44, right: 8, top: 6, bottom: 40}, picture = canvasOf(holder, `${curve.label} over the gait cycle`, width => Math.min(230, width * 0.66), edge);
  const several = groups.length > 1, found = groups.map(bandsOfCurves), mine = ownCurve(state.row, k);
  const values = [...found.flatMap(band => [...band(1, k), ...band(5, k)]), ...(mine ?? [])].filter(x => !Number.isNaN(x));
  const scaleX = linear(0, 100, ...picture.x), scaleY = linear(...roomy(Math.min(...values), Math.max(...values)), ...picture.y);
  const line = list => list.map((y, at) => [scaleX(100 * at / (cycles.points - 1)), scaleY(y)]);
  axes(picture, scaleX, scaleY, "gait cycle [%]", "");
  const [low, high] = scaleY.ends;
  if (low < 0 && high > 0) picture.svg.append(drawn("path", {d: `M${picture.x[0]} ${scaleY(0)}H${picture.x[1]}`, class: "zero"}));
  found.forEach((band, g) => {
    const group = drawn("g", {class: "band", style: `--colour: ${GROUPS[g % GROUPS.length]}`});
    group.append(drawn("path", {d: area(line(band(5, k)), line(band(1, k))), class: several ? "outer faint" : "outer"}));
    if (!several) group.append(drawn("path", {d: area(line(band(4, k)), line(band(2, k))), class: "inner"}));
    group.append(drawn("path", {d: path(line(band(0, k))), class: "middle", "stroke-dasharray": several ? DASHES[g % DASHES.length] : "none"}));
    picture.svg.append(group);
  });
  if (mine) picture.svg.append(drawn("path", {d: path(line(mine)), class: "chosen"}));
}
