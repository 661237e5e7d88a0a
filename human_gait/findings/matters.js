// Which setting matters: shares of the variance, and straight lines with their intervals.

function drawMatters() {
  const output = columns.get(state.matterOutput), found = data.matters[output.name] ?? {n: 0, shares: [], line: null};
  drawShares(output, found);
  drawLine(output, found);
}

/** That two settings go together in the walks that were found, if they do. */
function together(tied) {
  if (!tied || Math.abs(tied.r) < 0.2) return "";
  const names = [tied.one, tied.other].map(name => columns.get(name).label).join(" and ");
  return ` In these walks ${names} go together (correlation ${said(tied.r, 2)}): one can hide what the other does, or take its part. The straight lines below hold the others.`;
}

function drawShares(output, {n, shares, tied}) {
  const holder = element("shares");
  if (!shares.length) return void holder.replaceChildren(made("p", {class: "notes"}, `Of ${plural(n, "walk")} no shares can be told: that takes 10 walks or more, and an output that varies.`));
  const edge = {left: Math.min(190, Math.max(110, holder.clientWidth * 0.34)), right: 46, top: 4, bottom: 42}, high = 30 * shares.length + edge.top + edge.bottom;
  const picture = canvasOf(holder, `How much of the variance of ${output.label} goes with each setting`, high, edge), scale = linear(0, 100, ...picture.x);
  axes(picture, scale, {ticks: () => []}, "share of the variance [%]", "");
  shares.forEach((one, k) => {
    const y = edge.top + 30 * k + 15, setting = columns.get(one.setting), end = scale(100 * Math.max(one.share, 0));
    const lines = [setting.label, `${said(100 * Math.max(one.share, 0), 2)} % of the variance`, `95 % interval: ${said(100 * one.low, 2)} to ${said(100 * one.high, 2)} %`];
    picture.svg.append(
      fitted(drawn("text", {x: edge.left - 8, y: y + 4, "text-anchor": "end"}), setting.label, edge.left - 4),
      telling(drawn("rect", {x: edge.left, y: y - 9, width: Math.max(end - edge.left, 0.5), height: 18, class: "bar"}), lines),
      drawn("path", {d: `M${scale(100 * one.low)} ${y}H${scale(100 * one.high)}m0 -4v8M${scale(100 * one.low)} ${y - 4}v8`, class: "whisker"}),
      drawn("text", {x: Math.min(scale(100 * one.high) + 6, picture.width - 40), y: y + 4, class: "small"}, `${said(100 * Math.max(one.share, 0), 2)} %`));
  });
  const sum = shares.reduce((total, one) => total + Math.max(one.share, 0), 0), bound = together(tied);
  const rest = sum > 1.02 ? "each counts what it shares with others" : "what is left goes with settings together, or with the start of a solve";
  element("shares-note").textContent = `From ${plural(n, output === FOUND ? "attempt" : "walk")}${n < 50 ? ", few: read the intervals" : ""}. All bars together: ${said(100 * sum, 2)} %; ${rest}.${bound}`;
}

function drawLine(output, {line}) {
  const holder = element("slopes");
  if (!line) return void holder.replaceChildren(made("p", {class: "notes"}, "There are too few walks for a line, or nothing varies."));
  const unit = output.unit || "1";
  const rows = line.slopes.map(one => {
    const setting = columns.get(one.setting), per = one.word ? `if ${one.word}` : `per ${setting.unit || "1"}`;
    return [{text: setting.label, value: setting.label}, {text: per, value: per}, {text: said(one.slope), value: one.slope},
      {text: `${said(one.low)} to ${said(one.high)}`, value: one.low}, {text: said(one.standard, 2), value: Math.abs(one.standard)},
      {text: `${said(one.standard_low, 2)} to ${said(one.standard_high, 2)}`, value: one.standard_low}];
  });
  const heads = ["setting", "change", `slope [${unit}]`, "95 % interval", "standardised", "95 % interval"];
  holder.replaceChildren(sortable(`Straight line of ${output.label}`, heads, rows));
  element("slopes-note").textContent = `A straight line in all settings at once explains ${said(100 * line.r2, 3)} % of the variance (R\u00b2 = ${said(line.r2, 3)}) of ${plural(line.n, "walk")}.${line.r2 < 0.5 ? " That is little: do not read much from the slopes." : ""}${line.left_out.length ? ` Left out, because the others give it: ${line.left_out.map(name => columns.get(name).label).join(", ")}.` : ""}`;
}
