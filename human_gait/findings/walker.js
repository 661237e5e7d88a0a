// The walk that is chosen: a figure that moves and can be turned, its numbers, how to see it whole.

const walkers = data.walkers, places = typed(walkers.places, Int16Array);
const at = Object.fromEntries(walkers.points.map((name, k) => [name, k]));
const COUNT = walkers.points.length, FRAMES = walkers.frames;
const OTHER = walkers.points.map(name => at[name.endsWith("_r") ? name.replace(/_r$/, "_l") : name.endsWith("_l") ? name.replace(/_l$/, "_r") : name]);
const VIEWS = {side: [Math.PI / 2, 0], front: [0, 0], quarter: [0.95, 0.16], top: [Math.PI / 2, 1.45]};
const figure = {phase: 0, playing: !matchMedia("(prefers-reduced-motion: reduce)").matches, turn: VIEWS.quarter[0], tilt: VIEWS.quarter[1], last: 0};
const stage = element("figure"), brush = stage.getContext("2d");

/** Points of walker k in frame f of its stride, [m]; the second step mirrors the first. */
function frameOf(k, f) {
  const T = 2 * FRAMES, strides = Math.floor(f / T), step = Math.floor((f - strides * T) / FRAMES), within = f - strides * T - step * FRAMES;
  const length = walkers.walks[k].step_length, ahead = (2 * strides + step) * length;
  return walkers.points.map((_, p) => {
    const from = ((k * FRAMES + within) * COUNT + (step ? OTHER[p] : p)) * 3, q = walkers.quantum;
    return [(step ? -1 : 1) * places[from] * q, places[from + 1] * q, places[from + 2] * q + ahead];
  });
}

/** Points at a share of the stride, between frames by a cubic through four of them (Catmull and Rom). */
function pointsAt(k, phase) {
  const place = phase * 2 * FRAMES, f = Math.floor(place), s = place - f;
  const [a, b, c, d] = [-1, 0, 1, 2].map(more => frameOf(k, f + more));
  const advance = phase * 2 * walkers.walks[k].step_length;
  return b.map((point, p) => point.map((x, j) => {
    const value = x + 0.5 * s * (c[p][j] - a[p][j] + s * (2 * a[p][j] - 5 * x + 4 * c[p][j] - d[p][j] + s * (3 * (x - c[p][j]) + d[p][j] - a[p][j])));
    return value - (j === 2 ? advance : 0);
  }));
}

/** A projection onto the stage: turned about the vertical, then tilted; y up, from the right where the turn is 90 degrees. */
function projection(width, height, stature) {
  const size = height / (stature * 1.24), [ct, st, cp, sp] = [Math.cos(figure.turn), Math.sin(figure.turn), Math.cos(figure.tilt), Math.sin(figure.tilt)];
  return ([x, y, z]) => {
    const across = x * -ct + z * st, deep = -x * st - z * ct, up = y - stature * 0.5;
    return [width / 2 + size * across, height * 0.51 - size * (up * cp - deep * sp), deep * cp + up * sp, size];
  };
}

function limbsOf(stature) {
  const thick = share => share * stature, both = [];
  for (const side of "lr") {
    const part = (from, to, share) => both.push([`${from}_${side}`, `${to}_${side}`, thick(share), side]);
    part("hip", "knee", 0.062); part("knee", "ankle", 0.044); part("ankle", "heel", 0.026); part("ankle", "ball", 0.03); part("heel", "ball", 0.024); part("ball", "toe", 0.024);
    part("shoulder", "elbow", 0.036); part("elbow", "wrist", 0.029); part("wrist", "hand", 0.026);
  }
  return [["hip_l", "hip_r", thick(0.07), ""], ["pelvis", "chest", thick(0.1), ""], ["chest", "neck", thick(0.105), ""], ["shoulder_l", "shoulder_r", thick(0.05), ""], ["neck", "head", thick(0.04), ""], ...both];
}

/** Lines of walker k as they are seen on a stage of a size, the farthest first: [from, to, thickness, paint]. */
function linesOf(k, width, height) {
  const {stature, load_depth: load, step_length: length} = walkers.walks[k], points = pointsAt(k, figure.phase);
  const place = projection(width, height, stature), paints = {r: "--vermilion", l: "--blue", "": "--figure"};
  const line = (from, to, thickness, paint) => {
    const [a, b] = [place(from), place(to)];
    return {deep: (a[2] + b[2]) / 2, from: a, to: b, thick: Math.max(1.5, thickness * a[3]), paint};
  };
  const between = (from, to, share) => from.map((x, j) => x + share * (to[j] - x));
  const parts = limbsOf(stature).map(([from, to, thickness, side]) => line(points[at[from]], points[at[to]], thickness, paints[side]));
  const middle = between(points[at.head], points[at.crown], 0.5);
  parts.push(line(middle, between(middle, points[at.crown], 0.01), 0.116 * stature, "--figure"));
  const [low, high] = [points[at.load_low], points[at.load_high]];
  if (load) parts.push(line(between(low, high, 0.18), between(low, high, 0.82), load, "--load"));
  return [...floorOf(line, figure.phase * 2 * length, length), ...parts.sort((a, b) => b.deep - a.deep)];
}

/** The ground, which goes by with a mark every half step. */
function floorOf(line, advance, length) {
  const marks = [-0.3, 0.3].map(x => line([x, 0, -1.2], [x, 0, 1.6], 0, "--line"));
  for (let z = Math.ceil((advance - 1.2) / (length / 2)) * length / 2; z < advance + 1.6; z += length / 2) marks.push(line([-0.3, 0, z - advance], [0.3, 0, z - advance], 0, "--line"));
  return marks;
}

function drawFigure() {
  const k = walkerOf.get(state.row), ratio = devicePixelRatio || 1, [width, height] = [stage.clientWidth, stage.clientHeight];
  if (!width || !height) return;
  if (stage.width !== Math.round(width * ratio) || stage.height !== Math.round(height * ratio)) Object.assign(stage, {width: Math.round(width * ratio), height: Math.round(height * ratio)});
  brush.setTransform(ratio, 0, 0, ratio, 0, 0);
  brush.clearRect(0, 0, width, height);
  if (k === undefined) return;
  const style = getComputedStyle(stage);
  for (const {from, to, thick, paint} of linesOf(k, width, height)) {
    Object.assign(brush, {lineCap: "round", lineWidth: thick, strokeStyle: style.getPropertyValue(paint)});
    brush.beginPath();
    brush.moveTo(from[0], from[1]);
    brush.lineTo(to[0], to[1]);
    brush.stroke();
  }
}

/** The figure as it stands, for paper: not every printer shows a canvas. */
function printFigure() {
  const k = walkerOf.get(state.row), paper = element("figure-paper");
  paper.replaceChildren(...(k === undefined ? [] : linesOf(k, 320, 280).map(({from, to, thick, paint}) =>
    drawn("path", {d: path([from, to]), "stroke-width": thick, "stroke-linecap": "round", style: `stroke: var(${paint})`}))));
}

function animate(now) {
  const k = walkerOf.get(state.row), since = Math.min(0.1, (now - figure.last) / 1000);
  figure.last = now;
  if (figure.playing && k !== undefined) { figure.phase = (figure.phase + since / (2 * walkers.walks[k].step_time)) % 1; drawFigure(); }
  requestAnimationFrame(animate);
}

function setPlaying(playing) {
  figure.playing = playing;
  element("figure-play").textContent = playing ? "Pause" : "Play";
}

function turnTo(turn, tilt) {
  Object.assign(figure, {turn, tilt: Math.max(-0.4, Math.min(1.5, tilt))});
  drawFigure();
}

for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => turnTo(...VIEWS[button.dataset.view]));
element("figure-play").addEventListener("click", () => setPlaying(!figure.playing));
stage.addEventListener("pointerdown", event => stage.setPointerCapture(event.pointerId));
stage.addEventListener("pointermove", event => { if (event.buttons) turnTo(figure.turn + event.movementX * 0.01, figure.tilt + event.movementY * 0.008); });
stage.addEventListener("keydown", event => {
  const turn = {ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key];
  if (event.key === " ") setPlaying(!figure.playing);
  if (turn) turnTo(figure.turn + turn[0], figure.tilt + turn[1]);
  if (turn || event.key === " ") event.preventDefault();
});

// What is said of it

function drawChosen() {
  const row = state.row, k = walkerOf.get(row);
  element("walk-title").textContent = row < 0 ? "No walk is chosen" : `Walk ${whole(row + 1)} of ${whole(data.n)}`;
  if (row < 0) return;
  stage.hidden = k === undefined;
  element("figure-controls").hidden = k === undefined;
  const still = element("still-note");
  still.hidden = k !== undefined;
  still.textContent = success[row] ? `This walk does not move here: the page has ${whole(walkers.rows.length)} of ${whole(walked)} walks in motion. The command below shows it.` : `No walk was found: ${reasonSaid(reasonOf[row])}.`;
  element("person").textContent = k === undefined ? "" : walkers.walks[k].person;
  const asked = settings.filter(column => data.causes.includes(column.name)).slice(0, 6);
  const shown = [...(asked.length ? asked : settings.slice(0, 8)), ...(success[row] ? outputs.slice(0, 14) : [])];
  element("numbers").replaceChildren(...shown.flatMap(column => [made("dt", {class: column.setting ? "setting" : "", title: column.meaning}, column.label), made("dd", column.setting ? {class: "setting"} : {}, quantity(column, column.values[row]))]));
  element("command").textContent = success[row] ? commandOf(row) : "";
  element("command-box").hidden = !success[row];
  const several = state.from.length > 1;
  element("among").hidden = !several;
  element("among-said").textContent = several ? `${whole(state.from.indexOf(row) + 1)} of ${plural(state.from.length, "walk")} here` : "";
  drawFigure();
}

function commandOf(row) {
  const key = data.keys[row] ?? data.walkerKeys[walkerOf.get(row)];
  const walk = key ? `study.gait("${key}")` : `study.gait(study.to_dataframe().index[${row}])`;
  return `python -c 'import human_gait as hg; study = hg.open_study(${JSON.stringify(data.folder)}); hg.play(${walk})'`;
}

const step = way => select(state.from[(state.from.indexOf(state.row) + way + state.from.length) % state.from.length], state.from);
element("before").addEventListener("click", () => step(-1));
element("after").addEventListener("click", () => step(1));
element("close").addEventListener("click", () => document.body.classList.remove("walk-open"));
