"use strict";
// The numbers of all walks, as the page carries them, and how they are said.

const element = id => document.getElementById(id);
const data = JSON.parse(element("data").textContent);
const NONE = 65535;  // no class, no code

const bytes = text => Uint8Array.from(atob(text), sign => sign.charCodeAt(0));
const typed = (text, Kind) => new Kind(bytes(text).buffer);

/** Values of a packed column, (n,), NaN where there is none. */
function unpacked(column) {
  if (column.levels) {
    return Float64Array.from(typed(column.u1, Uint8Array), code => column.levels[code] ?? NaN);
  }
  if (column.f4) return Float64Array.from(typed(column.f4, Float32Array));
  return Float64Array.from(typed(column.u2, Uint16Array),
    code => code === NONE ? NaN : column.low + code * column.step);
}

const columns = new Map(data.columns.map(column =>
  [column.name, {...column, values: unpacked(column), u1: null, u2: null, f4: null}]));
const success = typed(data.success, Uint8Array);
const reasonOf = typed(data.reason, Uint8Array);
const beyond = new Uint8Array(data.n);  // 1 where a walk goes beyond a limit
const walked = success.reduce((sum, one) => sum + one, 0);  // how many were found
const walkerOf = new Map(data.walkers.rows.map((row, k) => [row, k]));

const settings = [...columns.values()].filter(column => column.setting);
const outputs = [...columns.values()].filter(column => !column.setting && !column.words.length);
const FOUND = {name: "success", label: "Walks that were found", unit: "%", share: true, words: [],
  values: Float64Array.from(success, one => 100 * one)};
const BEYOND = {name: "beyond", label: "Walks beyond a limit", unit: "%", share: true, words: [],
  values: new Float64Array(data.n)};
columns.set(FOUND.name, FOUND);
columns.set(BEYOND.name, BEYOND);

/** Whether a row counts for a column: of what came out only walks that were found. */
const counts = (column, row) => column === FOUND || (success[row] === 1 && !Number.isNaN(column.values[row]));

// Words

const MINUS = "\u2212", DASH = "\u2013", THIN = "\u202f", SPACE = "\u00a0";

/** A number with so many digits, as people write it. */
function said(x, digits = 3) {
  if (x === undefined || x === null || Number.isNaN(x)) return DASH;
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e7 || size < 1e-4) {
    const [mantissa, power] = x.toExponential(digits - 1).split("e");
    return `${mantissa}\u00b710${[...String(Number(power))].map(sign => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? "⁻").join("")}`
      .replace("-", MINUS);
  }
  const places = Math.min(6, Math.max(0, digits - 1 - Math.floor(Math.log10(size))));
  return grouped(x.toFixed(places));
}

/** Digits in groups of three from ten thousand on. */
function grouped(text) {
  const [whole, part] = text.replace("-", MINUS).split(".");
  const spaced = whole.replace(MINUS, "").length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN) : whole;
  return part === undefined ? spaced : `${spaced}.${part}`;
}

const whole = count => grouped(String(count));
const percent = (part, all) => all ? `${said(100 * part / all, part === all ? 3 : 2)}${SPACE}%` : DASH;
const plural = (count, noun) => `${whole(count)}${SPACE}${noun}${count === 1 ? "" : "s"}`;
const titled = column => column.unit ? `${column.label} [${column.unit}]` : column.label;

/** A value of a column with its unit. */
const quantity = (column, x) => valued(column, x) + (column.unit && !Number.isNaN(x) ? SPACE + column.unit : "");

/** A value of a column: all of a column have as many digits after the point. */
function valued(column, x) {
  if (column.words.length) return column.words[x] ?? DASH;
  column.places ??= placesOf(column);
  return column.places === null ? said(x, 4) : fixed(x, column.places);
}

/** Digits after the point that tell the values of a column apart; null where they are of many sizes. */
function placesOf(column) {
  if (column.levels && isGrid(column)) return decimals(column.levels);
  const [low, high] = extent([...column.values.keys()], column), size = Math.max(Math.abs(low), Math.abs(high));
  if (!(high > low) || size >= 1e7 || size < 1e-3) return null;
  return Math.min(6, Math.max(0, 2 - Math.floor(Math.log10(high - low))));
}

const fixed = (x, places) => Number.isNaN(x) ? DASH : grouped((Math.abs(x) < 0.5 * 10 ** -places ? 0 : x).toFixed(places));

/** Digits after the point that tell numbers in order from one another, and where they are. */
function decimals(numbers) {
  const apart = numbers.slice(1).map((x, k) => x - numbers[k]).filter(gap => gap > 0);
  const room = 0.02 * (apart.length ? Math.min(...apart) : Math.abs(numbers[0]) || 1);
  const enough = places => numbers.every(x => Math.abs(Number(x.toFixed(places)) - x) <= room);
  return [0, 1, 2, 3, 4, 5].find(enough) ?? 6;
}

/** Numbers as they stand beside one another. */
function alike(numbers) {
  const places = decimals(numbers);
  return numbers.map(x => fixed(x, places));
}

/** A number with no more digits than it needs. */
const trimmed = x => said(Number(x.toPrecision(4)), 4).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");

// Classes of walks by the values of a column

const LEVELS = 40;  // values that are classes of their own
const classCache = new Map();

/** Whether a setting has few values, each with several walks; or is the only one. */
const isGrid = column => column.levels && column.levels.length <= (settings.length > 1 ? Math.min(LEVELS, data.n / 2) : LEVELS);

/** Classes of all rows: {of: class by row, labels, middles, edges}; `even` in numbers of walks. */
function classesOf(column, most, even = false) {
  const name = `${column.name} ${most} ${even}`;
  if (!classCache.has(name)) classCache.set(name, classified(column, most, even));
  return classCache.get(name);
}

function classified(column, most, even) {
  const levels = column.words.length ? [...column.words.keys()] : column.levels;
  if (levels && (column.words.length || isGrid(column))) {
    const place = new Map(levels.map((level, k) => [level, k]));
    const labels = column.words.length ? levels.map(level => column.words[level]) : alike(levels);
    return {of: Uint16Array.from(column.values, x => place.get(x) ?? NONE), labels, middles: levels, discrete: true};
  }
  const some = column.values.filter(x => !Number.isNaN(x)).sort();
  const edges = even ? evenEdges(some, most) : wideEdges(some[0], some[some.length - 1], most);
  const of = Uint16Array.from(column.values, x => Number.isNaN(x) ? NONE : within(edges, x));
  const names = alike(edges), labels = names.slice(1).map((name, k) => `${names[k]} to ${name}`);
  const middles = edges.slice(1).map((edge, k) => (edges[k] + edge) / 2);
  return {of, labels, middles, edges, discrete: false};
}

function wideEdges(low, high, most) {
  const step = niceStep((high - low) / most);
  const first = Math.floor(low / step + 1e-9), last = Math.max(first + 1, Math.ceil(high / step - 1e-9));
  return Array.from({length: last - first + 1}, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

function evenEdges(sorted, most) {
  const edges = Array.from({length: most + 1}, (_, k) => sorted[Math.round(k / most * (sorted.length - 1))]);
  return edges.filter((edge, k) => k === 0 || edge > edges[k - 1]);
}

/** The class between edges that x is in: the last includes its upper edge. */
function within(edges, x) {
  let low = 0, high = edges.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (x >= edges[middle]) low = middle; else high = middle;
  }
  return low;
}

const niceStep = rough => {
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 2.5, 5, 10].find(step => step * power >= rough * (1 - 1e-9));
};

/** Percentiles of values that are in order, by linear interpolation. */
const percentiles = (sorted, shares) => shares.map(share => {
  const place = share / 100 * (sorted.length - 1), below = Math.floor(place);
  const above = Math.min(below + 1, sorted.length - 1);
  return sorted[below] + (place - below) * (sorted[above] - sorted[below]);
});

/** Rows by class, as arrays. */
function rowsBy(of, count, keep = () => true) {
  const found = Array.from({length: count}, () => []);
  for (let row = 0; row < of.length; row++) if (of[row] !== NONE && keep(row)) found[of[row]].push(row);
  return found;
}

/** Up to `most` of some rows, evenly spread, those that can move first. */
function someOf(rows, most) {
  if (rows.length <= most) return rows;
  const moving = rows.filter(row => walkerOf.has(row));
  if (moving.length >= most) return moving.filter((_, k) => k % Math.ceil(moving.length / most) === 0);
  const others = rows.filter(row => !walkerOf.has(row)), step = others.length / (most - moving.length);
  return [...moving, ...Array.from({length: most - moving.length}, (_, k) => others[Math.floor(k * step)])];
}

/** Reasons why some rows have no walk, the most frequent first: [place, count]. */
function reasonsOf(rows) {
  const found = new Map();
  for (const row of rows) if (!success[row]) found.set(reasonOf[row], (found.get(reasonOf[row]) ?? 0) + 1);
  return [...found].sort((a, b) => b[1] - a[1]);
}
const reasonSaid = place => data.reasons[place] ?? "another reason";
