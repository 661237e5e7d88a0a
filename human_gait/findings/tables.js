// Tables that a click on a head sorts, and the table of all walks, a page of it at a time.

const PAGE = 25;

/** A cell: text for people and a value to sort by. */
const celled = cell => typeof cell === "object" ? cell : {text: typeof cell === "number" ? whole(cell) : cell, value: cell};

function compare(a, b, way) {
  const [x, y] = [a.value, b.value], [noX, noY] = [x, y].map(v => v === undefined || Number.isNaN(v));
  if (noX || noY) return noX - noY;  // what has no number is last, either way
  return way * (typeof x === "string" ? x.localeCompare(y) : x - y);
}

/** A table of rows of cells, each column of which can be sorted. */
function sortable(caption, heads, given) {
  const rows = given.map(row => row.map(celled)), body = made("tbody");
  const numeric = heads.map((_, k) => rows.some(row => typeof row[k].value === "number"));
  const fill = () => body.replaceChildren(...rows.map(row => made("tr", {}, ...row.map((cell, k) => made(k ? "td" : "th", {...(k ? {} : {scope: "row"}), class: numeric[k] && k ? "number" : ""}, cell.text)))));
  const head = heads.map((name, k) => sortHead(name, numeric[k] && k > 0, way => { rows.sort((a, b) => compare(a[k], b[k], way)); fill(); }));
  fill();
  return made("div", {class: "table", tabindex: "0", role: "region", "aria-label": caption}, made("table", {}, made("caption", {}, caption), made("thead", {}, made("tr", {}, ...head)), body));
}

function sortHead(name, number, sort) {
  const button = made("button", {type: "button", title: "Sort"}, name), head = made("th", {scope: "col", class: number ? "number" : ""}, button);
  button.addEventListener("click", () => {
    const way = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    for (const other of head.parentElement.children) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
    sort(way);
  });
  return head;
}

const rowButton = row => {
  const button = made("button", {type: "button", class: "link", "aria-label": `Show walk ${row + 1}`}, whole(row + 1));
  button.addEventListener("click", () => select(row));
  return button;
};

function walksTable(caption, rows, first) {
  const asked = settings.filter(column => data.causes.includes(column.name));
  const shown = [...first, ...(asked.length ? asked : settings).slice(0, 8)];
  const table = sortable(caption, ["walk", ...shown.map(titled)], rows.map(row => [{text: rowButton(row), value: row}, ...shown.map(column => ({text: valued(column, column.values[row]), value: column.words.length ? valued(column, column.values[row]) : column.values[row]}))]));
  return table;
}

// All walks

const all = {rows: [], page: 0, by: null, way: 1};

function chooseRows() {
  const keep = {all: () => true, found: row => success[row], lost: row => !success[row], beyond: row => beyond[row]}[state.tableOf];
  all.rows = [...success.keys()].filter(keep);
  if (all.by) all.rows.sort((a, b) => compare({value: all.by(a)}, {value: all.by(b)}, all.way));
  all.page = 0;
  drawTable();
}

function drawTable() {
  const asked = settings.filter(column => data.causes.includes(column.name));
  const shown = [...(asked.length ? asked : settings), ...outputs.slice(0, 12)];
  const value = column => row => column.words.length ? column.words[column.values[row]] : column.values[row];
  const outcome = row => success[row] ? "found" : reasonSaid(reasonOf[row]);
  const heads = [["walk", row => row, true], ["outcome", outcome, false], ...shown.map(column => [titled(column), value(column), !column.words.length])];
  const head = heads.map(([name, by, number], k) => {
    const one = sortHead(name, number && k > 0, way => { Object.assign(all, {by, way, head: k}); chooseRows(); element("walks").querySelectorAll("thead button")[k].focus(); });
    if (all.head === k) one.setAttribute("aria-sort", all.way > 0 ? "ascending" : "descending");
    return one;
  });
  const rows = all.rows.slice(all.page * PAGE, (all.page + 1) * PAGE).map(row => made("tr", {}, made("th", {scope: "row"}, rowButton(row)), made("td", {class: success[row] ? "" : "bad"}, outcome(row)),
    ...shown.map(column => made("td", {class: column.words.length ? "" : "number"}, valued(column, column.values[row])))));
  const pages = Math.max(1, Math.ceil(all.rows.length / PAGE));
  element("walks").replaceChildren(made("div", {class: "table", tabindex: "0", role: "region", "aria-label": "All walks"}, made("table", {}, made("caption", {}, "All walks"), made("thead", {}, made("tr", {}, ...head)), made("tbody", {}, ...rows))));
  element("page-said").textContent = all.rows.length ? `${whole(all.page * PAGE + 1)} to ${whole(Math.min(all.rows.length, (all.page + 1) * PAGE))} of ${plural(all.rows.length, "walk")}` : "no such walk";
  element("page-before").disabled = all.page === 0;
  element("page-after").disabled = all.page >= pages - 1;
}
element("page-before").addEventListener("click", () => { all.page--; drawTable(); });
element("page-after").addEventListener("click", () => { all.page++; drawTable(); });
