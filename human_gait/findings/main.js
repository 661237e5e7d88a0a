// What is chosen to begin with, and when things are drawn.

const cause = settings.filter(column => data.causes.includes(column.name));
const inputs = cause.length ? cause : settings;
const over = [...named(outputs), [FOUND.name, titled(FOUND)], [BEYOND.name, titled(BEYOND)]];
const firstOutput = data.limits.find(limit => outputs.some(column => column.name === limit.name))?.name ?? outputs[0]?.name ?? FOUND.name;

if (settings.length > 1) {
  const scattered = mapFirst().slice(0, 2).some(column => !column.words.length && !isGrid(column));
  chooser("map-choices", "mapOutput", "Show", over, firstOutput);
  chooser("map-choices", "mapX", "across", named(settings), mapFirst()[0].name);
  chooser("map-choices", "mapY", "up", named(settings), mapFirst()[1].name);
  chooser("map-choices", "mapAs", "as", [["cells", "cells"], ["points", "points"]], scattered && data.n <= 1500 ? "points" : "cells");
  drawnFrom(["mapX", "mapY", "mapOutput", "mapAs", "limits"], drawMap);
}

/** The two settings of the first map: what is measured ahead of what has a few words. */
function mapFirst() {
  const ordered = [...inputs, ...settings.filter(column => !inputs.includes(column))];
  const numbers = ordered.filter(column => !column.words.length);
  const planned = inputs.filter(column => !column.words.length && !column.name.startsWith("subject_"));
  const body = ["subject_stature", "subject_mass"].map(name => columns.get(name)).filter(Boolean);
  if (data.people && body.length === 2 && planned.length < 2) return body;
  return numbers.filter(column => inputs.includes(column)).length > 1 || inputs.length < 2 ? numbers : [...inputs].sort((a, b) => a.words.length - b.words.length);
}

if (settings.length) {
  chooser("band-choices", "bandOutput", "Show", over, firstOutput);
  const along = inputs.find(column => !column.words.length) ?? inputs[0];
  const apart = few.find(column => column !== along && inputs.includes(column) && (column.words.length || column.levels.length < 5));
  chooser("band-choices", "bandX", "against", named(settings), along.name);
  chooser("band-choices", "bandBy", "split by", [...ungrouped, ...named(few)], apart?.name ?? "");
  drawnFrom(["bandX", "bandOutput", "bandBy", "limits"], drawBands);
  chooser("limit-choices", "limitBy", "By", named(settings), inputs[0].name);
  drawnFrom(["limitBy"], drawLimitTable);
}
drawers.unshift({needs: ["limits"], draw: drawLimitFindings});
if (outputs.length > 1) {
  const ways = [[1, "small is good"], [-1, "large is good"]];
  chooser("front-choices", "frontX", "Across", named(outputs), outputs[0].name);
  chooser("front-choices", "frontXWay", "where", ways, 1);
  chooser("front-choices", "frontY", "up", named(outputs), outputs[1].name);
  chooser("front-choices", "frontYWay", "where", ways, 1);
  drawnFrom(["frontX", "frontY", "frontXWay", "frontYWay"], drawFront);
}
if (inputs.length) {
  chooser("matter-choices", "matterOutput", "Of", [...named(outputs), [FOUND.name, titled(FOUND)]], firstOutput);
  drawnFrom(["matterOutput"], drawMatters);
}
if (cycles.n) {
  chooser("curve-choices", "curveKind", "Show", Object.entries(KINDS).map(([name, [label]]) => [name, label]), "angles");
  chooser("curve-choices", "curveBy", "by", [...ungrouped, ...Object.keys(cycles.groups).map(name => [name, columns.get(name).label])], "");
  drawnFrom(["curveKind", "curveBy", "row"], drawCurves);
}
chooser("table-choices", "tableOf", "Show", [["all", "all walks"], ["found", "walks found"], ["lost", "walks not found"], ["beyond", "walks beyond a limit"]], "all");
drawnFrom(["tableOf"], chooseRows);
drawnFrom(["limits"], () => { if (state.tableOf === "beyond") chooseRows(); });
drawnFrom(["row"], drawChosen);
drawnFrom(["row"], () => document.querySelectorAll("svg").forEach(svg => svg.here?.()));

element("limit-add").addEventListener("click", addLimit);
element("limits-map").addEventListener("click", () => {
  choose(settings.length > 1 ? "mapOutput" : "bandOutput", BEYOND.name);
  element(settings.length > 1 ? "section-map" : "section-bands").scrollIntoView();
});

/** The walk that is shown first: that whose settings are nearest to the middle of all. */
function middlemost() {
  const numbers = settings.filter(column => !column.words.length).map(column => {
    const values = column.values.filter(x => !Number.isNaN(x)).sort(), [low, middle, high] = percentiles(values, [5, 50, 95]);
    return {column, middle, size: high - low || 1};
  });
  const away = row => numbers.reduce((sum, {column, middle, size}) => sum + ((column.values[row] - middle) / size) ** 2, 0);
  return walkers.rows.reduce((best, row) => best < 0 || away(row) < away(best) ? row : best, -1);
}

drawLimitRows();
select(middlemost(), undefined, false);
setPlaying(figure.playing);
judge();
drawAll();
requestAnimationFrame(animate);

let width = innerWidth;
addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; drawAll(); } else drawFigure(); });
dark.addEventListener("change", drawAll);
for (const [kind, paper] of [["beforeprint", true], ["afterprint", false]]) addEventListener(kind, () => { onPaper = paper; drawAll(); printFigure(); });
