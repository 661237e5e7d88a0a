// An output against one setting: percentiles, the walks themselves, and how many were not found.

const SHARES = [5, 25, 50, 75, 95];
const LOST = walked < data.n ? 30 : 0;  // height of the strip of those not found, [px]

/** Percentiles of an output in classes of a setting: [{k, at, values, lost, rows}]. */
function bandsOf(setting, output, keep) {
  const most = Math.round(Math.min(16, Math.max(3, Math.sqrt(data.n) / 2)));
  const classes = classesOf(setting, most, true);
  const parts = rowsBy(classes.of, classes.labels.length, keep).map((rows, k) => {
    const values = Float64Array.from(rows.filter(row => counts(output, row)), row => output.values[row]).sort();
    const at = classes.discrete ? classes.middles[k] : percentiles(Float64Array.from(rows, row => setting.values[row]).sort(), [50])[0];
    return {k, at, rows, n: values.length, lost: rows.filter(row => !success[row]).length,
      marks: output.share ? [NaN, NaN, values.reduce((sum, v) => sum + v, 0) / values.length, NaN, NaN] : percentiles(values, SHARES)};
  }).filter(part => part.rows.length);
  return {classes, parts};
}

function drawBands() {
  const [setting, output] = [state.bandX, state.bandOutput].map(name => columns.get(name));
  const by = columns.get(state.bandBy), split = by && by !== setting ? classesOf(by, 6) : null;
  const groups = split ? split.labels.map((label, k) => ({label: `${by.label}: ${label}${by.words.length || !by.unit ? "" : ` ${by.unit}`}`, ...bandsOf(setting, output, row => split.of[row] === k)}))
    : [{label: "all walks", ...bandsOf(setting, output)}];
  const picture = canvasOf(element("bands"), `${output.label} against ${setting.label}`, width => Math.min(460, Math.max(300, width * 0.6)), {...EDGE, bottom: EDGE.bottom + LOST});
  const rows = someOf([...success.keys()].filter(row => counts(output, row) && !Number.isNaN(setting.values[row])), picture.width < 500 ? 150 : 500);
  const {scaleX, scaleY} = bandScales(picture, setting, output, groups, output.share ? [] : rows);
  axes({...picture, y: picture.y}, {ticks: () => []}, scaleY, "", titled(output));
  axesBelow(picture, scaleX, setting);
  if (!output.share) drawDots(picture, rows, setting, output, scaleX, scaleY);
  groups.forEach((group, k) => drawBand(picture, group, scaleX, scaleY, k, groups.length));
  drawLimits(picture, output, scaleY);
  drawLost(picture, groups[0].classes, setting, scaleX, bandsOf(setting, output));
  drawHere(picture, () => counts(output, state.row) && !output.share && drawn("circle", {cx: scaleX(setting.values[state.row]), cy: scaleY(output.values[state.row]), r: 8, class: "here"}));
  bandLegend(groups, output, rows.length);
}

function bandScales(picture, setting, output, groups, rows) {
  const marks = groups.flatMap(group => group.parts.flatMap(part => part.marks)).filter(x => !Number.isNaN(x));
  const values = [...marks, ...rows.map(row => output.values[row]), ...state.limits.filter(limit => limit.name === output.name).map(limit => limit.bound)];
  const [low, high] = output.share ? [0, 100] : roomy(Math.min(...values), Math.max(...values));
  const classes = groups[0].classes;
  const scaleX = setting.words.length ? banded(classes, ...picture.x) : linear(...roomy(...extent([...success.keys()], setting), 0.02), ...picture.x);
  return {scaleX, scaleY: linear(low, high, ...picture.y)};
}

/** The axis of the setting stands below the strip of those not found. */
function axesBelow(picture, scaleX, setting) {
  const bottom = picture.height - EDGE.bottom, [left, right] = picture.x, group = drawn("g", {class: "axes"});
  for (const [at, label] of scaleX.ticks(Math.floor((right - left) / 58))) {
    group.append(drawn("path", {d: `M${at} ${bottom}v4`}), drawn("text", {x: at, y: bottom + 17, "text-anchor": "middle"}, label));
  }
  group.append(drawn("path", {d: `M${left} ${bottom}H${right}`}), fitted(drawn("text", {x: (left + right) / 2, y: bottom + 38, "text-anchor": "middle", class: "name"}), titled(setting), right - left));
  picture.svg.append(group);
}

function drawDots(picture, rows, setting, output, scaleX, scaleY) {
  const group = drawn("g", {class: "points faint"});
  for (const row of rows) group.append(pointOf(row, scaleX(setting.values[row]) + jitter(row, scaleX), scaleY(output.values[row]), "var(--quiet)", [quantity(output, output.values[row])]));
  picture.svg.append(group);
}

function drawBand(picture, {parts}, scaleX, scaleY, k, several) {
  const colour = GROUPS[k % GROUPS.length], group = drawn("g", {class: "band", style: `--colour: ${colour}`});
  const line = (list, share) => list.map(part => [scaleX.size ? scaleX(part.k) : scaleX(part.at), scaleY(part.marks[share])]);
  const enough = least => parts.filter(part => part.n >= least && !Number.isNaN(part.marks[0]));
  if (scaleX.size) {
    const w = Math.min(60, scaleX.size * 0.5) / several;
    for (const part of parts.filter(one => one.n)) {
      const x = scaleX(part.k) + (k - (several - 1) / 2) * w * 1.15, at = part.marks.map(scaleY);
      if (part.n >= 20) group.append(drawn("path", {d: `M${x} ${at[0]}V${at[4]}`, class: "middle thin"}));
      if (part.n >= 4 && !Number.isNaN(at[1])) group.append(drawn("rect", {x: x - w / 2, width: w, y: at[3], height: Math.max(at[1] - at[3], 0.5), class: "inner"}));
      group.append(telling(drawn("path", {d: `M${x - w / 2} ${at[2]}h${w}`, class: "middle"}), [`n = ${whole(part.n)}`]));
    }
  } else {
    if (enough(20).length > 1) group.append(drawn("path", {d: area(line(enough(20), 4), line(enough(20), 0)), class: several > 1 ? "outer faint" : "outer"}));
    if (enough(4).length > 1 && several < 3) group.append(drawn("path", {d: area(line(enough(4), 3), line(enough(4), 1)), class: "inner"}));
    group.append(drawn("path", {d: path(line(parts.filter(part => part.n), 2)), class: "middle", "stroke-dasharray": DASHES[k % DASHES.length]}));
  }
  picture.svg.append(group);
}

function drawLimits(picture, output, scaleY) {
  for (const limit of state.limits.filter(one => one.name === output.name)) {
    const y = scaleY(limit.bound);
    picture.svg.append(drawn("path", {d: `M${picture.x[0]} ${y}H${picture.x[1]}`, class: "limit"}), drawn("text", {x: picture.x[1] - 4, y: y - 5, "text-anchor": "end", class: "limit-name"}, `limit ${trimmed(limit.bound)} ${output.unit}`));
  }
}

/** The strip below: what share of the walks of each class was not found. */
function drawLost(picture, classes, setting, scaleX, {parts}) {
  const bottom = picture.height - EDGE.bottom, group = drawn("g", {class: "losts"});
  const size = scaleX.size ?? (picture.x[1] - picture.x[0]) / Math.max(parts.length, 2);
  for (const part of parts) {
    const w = Math.min(size * 0.5, 26), x = (scaleX.size ? scaleX(part.k) : scaleX(part.at)) - w / 2, share = part.lost / part.rows.length;
    const label = `${setting.label}: ${classes.labels[part.k]}${setting.unit ? SPACE + setting.unit : ""}`;
    const lines = [label, `${whole(part.n)} walks with this number`, `${whole(part.lost)} of ${whole(part.rows.length)} not found`,
      ...(part.n >= 4 && !Number.isNaN(part.marks[0]) ? [`percentiles 5/25/50/75/95: ${part.marks.map((x, k) => part.n < 20 && (k === 0 || k === 4) ? DASH : said(x)).join(", ")}`] : [])];
    group.append(drawn("rect", {x, y: bottom - share * Math.max(LOST - 10, 0), width: w, height: Math.max(share * Math.max(LOST - 10, 0), 0.01), fill: hatchOf(0), class: "bar"}),
      telling(drawn("rect", {x: x - (size - w) / 2, y: picture.y[1], width: Math.max(size, 1), height: bottom - picture.y[1], class: "catcher"}), lines));
  }
  if (LOST) group.append(drawn("text", {x: picture.x[0] + 4, y: bottom - LOST + 12, class: "small"}, "not found"));
  picture.svg.insertBefore(group, picture.svg.querySelector(".points"));
}

function bandLegend(groups, output, dots) {
  const swatch = (kind, k) => drawn("svg", {viewBox: "0 0 32 16", class: "band", style: `--colour: ${GROUPS[k % GROUPS.length]}`}, kind === "middle" ? drawn("path", {d: "M0 8H32", class: kind, "stroke-dasharray": DASHES[k % DASHES.length]}) : drawn("rect", {width: 32, height: 16, class: kind}));
  const most = Math.max(...groups.flatMap(group => group.parts.map(part => part.n)));
  const items = groups.length > 1 ? groups.map((group, k) => made("li", {}, swatch("middle", k), `${output.share ? "share" : "median"}, ${group.label} (n = ${whole(group.parts.reduce((sum, part) => sum + part.n, 0))})`))
    : [made("li", {}, swatch("middle", 0), output.share ? "share" : most > 1 ? "median" : "each walk"), ...(output.share ? [] : [[4, "inner", "25th to 75th percentile"], [20, "outer", "5th to 95th percentile"]].filter(([least]) => most >= least).map(([, kind, said]) => made("li", {}, swatch(kind, 0), said)))];
  element("bands-legend").replaceChildren(...items);
  const n = groups.reduce((sum, group) => sum + group.parts.reduce((more, part) => more + part.n, 0), 0);
  element("bands-note").textContent = [
    output === FOUND ? `Of ${plural(data.n, "walk")}.` : `Of ${plural(n, "walk")}${walked > n ? ` with this number; ${whole(walked - n)} were found without it` : ""}${walked < data.n ? `; ${whole(data.n - walked)} were not found and are in no percentile` : ""}.`,
    output.share || most < 2 ? "" : "Percentiles are drawn where there are 4 walks or more, the outer ones from 20 on.",
    !output.share && dots < n ? `${whole(dots)} walks are drawn as points.` : ""].filter(Boolean).join(" ");
}
