// Pictures: elements of SVG, scales, axes, colours, what is said where the pointer is.

const SVG = "http://www.w3.org/2000/svg";

function drawn(tag, attributes = {}, ...inside) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...inside);
  return made;
}

function made(tag, attributes = {}, ...inside) {
  const one = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name in one && typeof value !== "string") one[name] = value; else one.setAttribute(name, value);
  }
  one.append(...inside);
  return one;
}

// Colours

const LIGHT = ["#eef3d8", "#b5dc9d", "#4fae86", "#17747a", "#12304f"];
const DARK = ["#1f3b57", "#1f7a82", "#4fae86", "#a9d88f", "#f3f6d0"];
const GROUPS = ["var(--blue)", "var(--vermilion)", "var(--green)", "var(--purple)", "var(--orange)"];
const DASHES = ["none", "7 3", "2 3", "9 3 2 3", "12 4"];
const dark = matchMedia("(prefers-color-scheme: dark)");
let onPaper = false;

/** Colour of a share from 0 to 1. */
function ramp(share) {
  const colours = dark.matches && !onPaper ? DARK : LIGHT;
  const place = Math.min(Math.max(share, 0), 1) * (colours.length - 1), k = Math.min(Math.floor(place), colours.length - 2);
  const [from, to] = [colours[k], colours[k + 1]].map(colour => [1, 3, 5].map(at => parseInt(colour.slice(at, at + 2), 16)));
  return `rgb(${from.map((x, j) => Math.round(x + (place - k) * (to[j] - x))).join(" ")})`;
}

// Scales

function linear(low, high, from, to) {
  if (!(high > low)) [low, high] = [low - (Math.abs(low) || 1) / 2, low + (Math.abs(low) || 1) / 2];
  const scale = x => from + (x - low) / (high - low) * (to - from);
  scale.ends = [low, high];
  scale.ticks = count => {
    const step = niceStep((high - low) / Math.max(count, 1)), first = Math.ceil(low / step - 1e-9);
    const ticks = [];
    for (let k = first; k * step <= high + 1e-9 * step; k++) ticks.push(Number((k * step).toPrecision(12)));
    const names = alike(ticks);
    return ticks.map((x, k) => [scale(x), names[k]]);
  };
  return scale;
}

/** A scale of classes: the middle of each; `edges` where they are ranges of numbers. */
function banded(classes, from, to) {
  const count = classes.labels.length, size = (to - from) / count;
  const scale = k => from + (k + 0.5) * size;
  scale.size = Math.abs(size);
  scale.ticks = most => {
    const every = Math.max(1, Math.ceil(count / Math.max(most, 1)));
    if (classes.discrete) return classes.labels.map((label, k) => [scale(k), label]).filter((_, k) => k % every === 0);
    const names = alike(classes.edges);
    return classes.edges.map((_, k) => [from + k * size, names[k]]).filter((_, k) => k % every === 0);
  };
  return scale;
}

/** Ends of values with a little room. */
function roomy(low, high, share = 0.04) {
  const more = (high - low) * share || Math.abs(low) * 0.05 || 1;
  return [low - more, high + more];
}

// Axes

const EDGE = {left: 58, right: 12, top: 10, bottom: 46};

/** An empty picture in a holder, which says what it shows. */
function canvasOf(holder, label, height, edge = EDGE) {
  const width = Math.max(holder.clientWidth, 240);
  const high = typeof height === "function" ? height(width) : height;
  const svg = drawn("svg", {viewBox: `0 0 ${width} ${high}`, role: "group", "aria-label": label});
  holder.replaceChildren(svg);
  return {svg, width, height: high, x: [edge.left, width - edge.right], y: [high - edge.bottom, edge.top]};
}

function axes(picture, xScale, yScale, xLabel, yLabel, grid = true) {
  const {svg, x: [left, right], y: [bottom, top]} = picture, group = drawn("g", {class: "axes"});
  const middle = (left + right) / 2;
  for (const [at, label] of xScale.ticks(Math.floor((right - left) / 58))) {
    if (grid) group.append(drawn("path", {d: `M${at} ${top}V${bottom}`, class: "grid"}));
    group.append(drawn("path", {d: `M${at} ${bottom}v4`}), drawn("text", {x: at, y: bottom + 17, "text-anchor": "middle"}, label));
  }
  for (const [at, label] of yScale.ticks(Math.floor((bottom - top) / 36))) {
    if (grid) group.append(drawn("path", {d: `M${left} ${at}H${right}`, class: "grid"}));
    group.append(drawn("path", {d: `M${left} ${at}h-4`}), fitted(drawn("text", {x: left - 8, y: at + 4, "text-anchor": "end"}), label, left - 6));
  }
  group.append(
    drawn("path", {d: `M${left} ${top}V${bottom}H${right}`}),
    fitted(drawn("text", {x: middle, y: bottom + 38, "text-anchor": "middle", class: "name"}), xLabel, right - left + 30),
    fitted(drawn("text", {transform: `translate(13 ${(top + bottom) / 2}) rotate(-90)`, "text-anchor": "middle", class: "name"}), yLabel, bottom - top + 10));
  svg.append(group);
}

/** A text that is cut to a length, about; whole where the pointer is. */
function fitted(text, label, length) {
  const room = Math.floor(length / 6.6);
  text.textContent = label.length > room ? `${label.slice(0, room - 1).trimEnd()}…` : label;
  if (label.length > room) text.append(drawn("title", {}, label));
  return text;
}

const path = points => points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
const area = (upper, lower) => `${path(upper)}${path([...lower].reverse()).replace("M", "L")}Z`;

// What is said where the pointer is

const tip = element("tip");
const tips = new WeakMap();

/** Have something say lines where the pointer or the focus is. */
function telling(one, lines) {
  tips.set(one, lines);
  return one;
}

function tell(event) {
  const lines = tips.get(event.target);
  if (!lines) return void (tip.hidden = true);
  tip.replaceChildren(...(typeof lines === "function" ? lines() : lines).map((line, k) => made(k ? "p" : "b", {}, line)));
  tip.hidden = false;
  const at = event.type === "focusin" ? middleOf(event.target) : [event.clientX, event.clientY];
  const {width, height} = tip.getBoundingClientRect();
  const left = Math.max(4, Math.min(at[0] + 14, document.documentElement.clientWidth - width - 6));
  tip.style.translate = `${left}px ${at[1] + 16 + height > innerHeight ? at[1] - height - 10 : at[1] + 16}px`;
}

function middleOf(one) {
  const box = one.getBoundingClientRect();
  return [box.left + box.width / 2, box.top + box.height / 2];
}
for (const kind of ["pointermove", "focusin"]) document.addEventListener(kind, tell);
for (const kind of ["pointerleave", "focusout", "scroll"]) document.addEventListener(kind, () => { tip.hidden = true; }, true);
document.addEventListener("keydown", event => { if (event.key === "Escape") tip.hidden = true; });

/** Let arrow keys walk over marks of a picture, and Enter choose one: `marks` is a Map of "x y". */
function walkable(svg, marks) {
  const [first] = marks.values();
  if (!first) return;
  first.setAttribute("tabindex", "0");
  svg.addEventListener("keydown", event => {
    const step = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
    const here = [...marks].find(([, mark]) => mark === document.activeElement);
    if (!here) return;
    if (event.key === "Enter" || event.key === " ") { here[1].dispatchEvent(new MouseEvent("click", {bubbles: true})); event.preventDefault(); }
    if (!step) return;
    event.preventDefault();
    let [x, y] = here[0].split(" ").map(Number);
    for (let k = 0; k < 200; k++) {
      [x, y] = [x + step[0], y + step[1]];
      const next = marks.get(`${x} ${y}`);
      if (next) { focusOn(marks, next); return; }
    }
  });
}

function focusOn(marks, mark) {
  for (const one of marks.values()) one.setAttribute("tabindex", "-1");
  mark.setAttribute("tabindex", "0");
  mark.focus();
}
