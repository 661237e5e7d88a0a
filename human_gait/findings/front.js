// Two outputs against each other, and the walks that no other one betters in both.

/** Rows of the front: no other walk is better in one and as good in the other. */
function frontOf(rows, x, y, signX, signY) {
  const ordered = [...rows].sort((a, b) => signX * (x.values[a] - x.values[b]) || signY * (y.values[a] - y.values[b]));
  const front = [];
  let best = Infinity;
  for (const row of ordered) {
    const value = signY * y.values[row];
    if (value < best) { best = value; front.push(row); }
  }
  return front;
}

function drawFront() {
  const [x, y] = [state.frontX, state.frontY].map(name => columns.get(name));
  const rows = [...success.keys()].filter(row => counts(x, row) && counts(y, row));
  if (x === y || !rows.length) return void element("front").replaceChildren(made("p", {class: "notes"}, x === y ? "Choose two different numbers." : "No walk has both numbers."));
  const front = frontOf(rows, x, y, state.frontXWay, state.frontYWay), shown = someOf(rows, 1500);
  const picture = canvasOf(element("front"), `${y.label} against ${x.label}`, width => Math.min(460, Math.max(300, width * 0.62)));
  const all = [...shown, ...front], scaleX = linear(...roomy(...extent(all, x)), ...picture.x), scaleY = linear(...roomy(...extent(all, y)), ...picture.y);
  axes(picture, scaleX, scaleY, titled(x), titled(y));
  const group = drawn("g", {class: "points faint"}), marks = new Map(), best = drawn("g", {class: "points best"});
  const place = row => [scaleX(x.values[row]), scaleY(y.values[row])];
  const lines = row => [`${x.label}: ${quantity(x, x.values[row])}`, `${y.label}: ${quantity(y, y.values[row])}`];
  for (const row of shown) group.append(pointOf(row, ...place(row), "var(--quiet)", lines(row)));
  front.forEach((row, k) => {
    const mark = pointOf(row, ...place(row), "var(--vermilion)", lines(row));
    mark.setAttribute("tabindex", "-1");
    mark.setAttribute("role", "button");
    mark.setAttribute("aria-label", lines(row).join(", "));
    marks.set(`${k} 0`, mark);
    best.append(mark);
  });
  picture.svg.append(group, drawn("path", {d: path(front.map(place)), class: "front"}), best);
  drawHere(picture, () => counts(x, state.row) && counts(y, state.row) && drawn("circle", {cx: place(state.row)[0], cy: place(state.row)[1], r: 8, class: "here"}));
  walkable(picture.svg, marks);
  element("front-note").textContent = `${plural(front.length, "walk")} of ${whole(rows.length)} ${front.length === 1 ? "is" : "are"} on the front: no other walk is better in one of the two numbers and no worse in the other.${shown.length < rows.length ? ` ${whole(shown.length)} walks are drawn.` : ""}`;
  element("front-table").replaceChildren(walksTable("Walks of the front", someOf(front, 40), [x, y]));
}
