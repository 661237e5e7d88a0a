// What the reader chooses: lists of columns, and who has to be drawn anew.

const state = {row: -1, from: []};
const drawers = [];  // what is drawn anew where its choices change: {needs, draw}

/** Have something drawn anew whenever one of the choices that it needs changes. */
function drawnFrom(needs, draw) {
  drawers.push({needs, draw});
}

function changed(...names) {
  for (const {needs, draw} of drawers) if (needs.some(need => names.includes(need))) draw();
}

const drawAll = () => drawers.forEach(({draw}) => draw());

/** A list to choose a column from; the choice stands in the state under `name`. */
function chooser(holder, name, label, choices, first) {
  if (!choices.some(([value]) => value === first)) first = choices[0]?.[0];
  state[name] = first;
  const list = made("select", {id: `choose-${name}`}, ...choices.map(([value, text, title = ""]) =>
    made("option", {value: String(value), selected: value === first, title}, text)));
  list.addEventListener("change", () => {
    state[name] = choices[list.selectedIndex][0];
    changed(name);
  });
  element(holder).append(made("label", {}, made("span", {}, label), list));
  return list;
}

/** Choose something as a hand would. */
function choose(name, value) {
  const list = element(`choose-${name}`);
  list.value = String(value);
  list.dispatchEvent(new Event("change"));
}

const named = list => list.map(column => [column.name, titled(column), column.meaning ?? ""]);
const few = settings.filter(column => column.words.length || (column.levels && column.levels.length <= 6));
const ungrouped = [["", "nothing"]];

/** Choose a walk; `from` are those that the same place stands for. */
function select(row, from = [row], byHand = true) {
  Object.assign(state, {row, from});
  if (byHand) document.body.classList.add("walk-open");
  changed("row");
}

/** The walk of a place that is shown first: one that moves, else any that was found. */
function firstOf(rows) {
  return rows.find(row => walkerOf.has(row)) ?? rows.find(row => success[row]) ?? rows[0];
}

/** Choose a walk among those of a place; the next one if one of them is shown already. */
function selectAmong(rows) {
  const ordered = [...rows.filter(row => walkerOf.has(row)), ...rows.filter(row => !walkerOf.has(row) && success[row]), ...rows.filter(row => !success[row])];
  select(rows.includes(state.row) ? ordered[(ordered.indexOf(state.row) + 1) % ordered.length] : ordered[0], ordered);
}
