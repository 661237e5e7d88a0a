// Limits that the reader gives, and who goes beyond them.

state.limits = data.limits.map(limit => ({...limit}));
const SIGNS = {"<": (x, bound) => x < bound, "<=": (x, bound) => x <= bound, ">": (x, bound) => x > bound, ">=": (x, bound) => x >= bound};
const SAID = {"<": "below", "<=": "at most", ">": "above", ">=": "at least"};
const limitable = () => [...outputs, ...settings.filter(column => !column.words.length)];

/** Tell of each row whether it goes beyond a limit; of each limit how many do, and how many cannot be told. */
function judge() {
  beyond.fill(0);
  for (const limit of state.limits) {
    const column = columns.get(limit.name), keeps = SIGNS[limit.sign];
    Object.assign(limit, {over: 0, unknown: 0});
    for (let row = 0; row < data.n; row++) {
      if (!success[row]) continue;
      const x = column.values[row];
      if (Number.isNaN(x)) limit.unknown++;
      else if (!keeps(x, limit.bound)) { limit.over++; beyond[row] = 1; }
    }
  }
  for (let row = 0; row < data.n; row++) BEYOND.values[row] = 100 * beyond[row];
}

function limitRow(limit, k) {
  const list = made("select", {"aria-label": "what is limited"}, ...limitable().map(column => made("option", {value: column.name, selected: column.name === limit.name}, titled(column))));
  const sign = made("select", {"aria-label": "how"}, ...Object.keys(SIGNS).map(one => made("option", {value: one, selected: one === limit.sign}, SAID[one])));
  const bound = made("input", {type: "text", inputmode: "decimal", value: String(limit.bound), "aria-label": "limit", size: "7"});
  const unit = made("span", {class: "quiet"}, columns.get(limit.name).unit);
  const gone = made("button", {type: "button", "aria-label": "Remove this limit", title: "Remove this limit"}, "\u00d7");
  list.addEventListener("change", () => { limit.name = list.value; limit.bound = usual(columns.get(limit.name)); drawLimitRows(); changed("limits"); });
  sign.addEventListener("change", () => { limit.sign = sign.value; changed("limits"); });
  bound.addEventListener("input", () => {
    const x = Number(bound.value.trim().replace(",", ".").replace(MINUS, "-"));
    const wrong = bound.value.trim() === "" || !Number.isFinite(x);
    bound.setAttribute("aria-invalid", String(wrong));
    if (!wrong) { limit.bound = x; changed("limits"); }
  });
  gone.addEventListener("click", () => { state.limits.splice(k, 1); drawLimitRows(); changed("limits"); element("limit-add").focus(); });
  return made("div", {class: "limit-row"}, list, sign, made("span", {class: "bound"}, bound, " ", unit), gone);
}

/** A limit to begin with: what nine in ten walks keep. */
function usual(column) {
  const values = Float64Array.from([...column.values.keys()].filter(row => counts(column, row)), row => column.values[row]).sort();
  return values.length ? Number(percentiles(values, [90])[0].toPrecision(3)) : 0;
}

const drawLimitRows = () => element("limit-rows").replaceChildren(...state.limits.map(limitRow));

function addLimit() {
  const column = columns.get(state.mapOutput ?? state.bandOutput);
  const first = column && !column.share ? column : outputs[0];
  if (!first) return;
  state.limits.push({name: first.name, sign: "<", bound: usual(first)});
  drawLimitRows();
  changed("limits");
}

/** The 95 % interval of a share by Wilson's score. */
function wilson(part, all) {
  const z = 1.959964, p = part / all, middle = p + z * z / (2 * all);
  const reach = z * Math.sqrt(p * (1 - p) / all + z * z / (4 * all * all)), over = 1 + z * z / all;
  return [Math.max(0, (middle - reach) / over), Math.min(1, (middle + reach) / over)].map(x => Math.abs(x) < 1e-12 ? 0 : x);
}

function drawLimitFindings() {
  judge();
  const over = beyond.reduce((sum, one) => sum + one, 0);
  const lines = state.limits.map(limit => {
    const column = columns.get(limit.name);
    return made("li", {}, made("strong", {}, `${column.label} ${SAID[limit.sign]} ${trimmed(limit.bound)}${column.unit ? ` ${column.unit}` : ""}`),
      `: ${plural(limit.over, "walk")} of ${whole(walked)} (${percent(limit.over, walked)}) do not keep it${limit.unknown ? `; of ${whole(limit.unknown)} it cannot be told, they have no such number` : ""}.`);
  });
  element("limits-said").replaceChildren(...(state.limits.length ? [made("ul", {}, ...lines),
    made("p", {class: "said"}, `${whole(over)} of ${whole(walked)} ${data.people ? "people's walks" : "walks"} (${percent(over, walked)}) go beyond ${state.limits.length > 1 ? "at least one of the limits" : "the limit"}.${walked < data.n ? ` ${whole(data.n - walked)} more were not found at all.` : ""}`)]
    : [made("p", {class: "notes"}, "No limit is given. Add one to see who goes beyond it, here and on the map.")]));
  element("limits-more").hidden = !state.limits.length;
  drawLimitTable();
}

function drawLimitTable() {
  const by = columns.get(state.limitBy);
  if (!state.limits.length || !by) return void element("limits-table").replaceChildren();
  const classes = classesOf(by, 5, true);
  const rows = rowsBy(classes.of, classes.labels.length).map((part, k) => {
    const found = part.filter(row => success[row]), over = found.filter(row => beyond[row]).length;
    const [low, high] = found.length ? wilson(over, found.length) : [NaN, NaN];
    const label = classes.labels[k] + (by.unit && !by.words.length ? SPACE + by.unit : "");
    return [{text: label, value: by.words.length ? label : classes.middles[k]}, part.length, found.length, over,
      {text: percent(over, found.length), value: over / found.length}, ...(data.people ? [{text: found.length ? `${said(100 * low, 2)} to ${said(100 * high, 2)}${SPACE}%` : DASH, value: low}] : [])];
  }).filter(row => row[1] > 0);
  const heads = [by.label, "walks", "found", "beyond a limit", "share of those found", ...(data.people ? ["95 % interval"] : [])];
  element("limits-table").replaceChildren(sortable(`Walks beyond a limit by ${by.label}`, heads, rows));
}
