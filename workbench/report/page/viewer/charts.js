// ---- time histories under the canvases, with the cursor of the slider -------------------------------------------
const make = (parent, tag, attributes = {}, text) => {
  const made = document.createElementNS(
    ["svg", "path", "line", "text"].includes(tag) ? "http://www.w3.org/2000/svg" : "http://www.w3.org/1999/xhtml", tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return parent.appendChild(made);
};
const LINES = [["#D55E00", "none"], ["#0072B2", "7 3"], ["#009E73", "2 2"], ["#6B4E9B", "9 2 2 2"]];
const labels = [...new Set(data.runs.map((run) => run.label))];
const lineOf = (label) => LINES[Math.max(labels.indexOf(label), 0) % LINES.length];  // the same in every chart
const digits = (value, count) => String(Number(value.toPrecision(count)));
const withUnit = (text, unit) => unit === "1" ? text : `${text} ${unit}`;

function chart(parent, history) {                            // returns what moves its cursor to a frame
  const W = 520, H = 150, L = 56, R = 10, T = 20, B = 24, cell = make(parent, "div", { class: "viewer-chart" });
  const plot = make(cell, "div", { class: "viewer-plot" }), svg = make(plot, "svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${history.name} over time` });
  let low = Infinity, high = -Infinity;
  for (const s of history.series) for (const v of s.values) { low = Math.min(low, v); high = Math.max(high, v); }
  if (history.limit !== null) { low = Math.min(low, history.limit); high = Math.max(high, history.limit); }
  high = history.drawn_to ?? high;                           // a run that leaves the others far behind is cut off
  const span = high - low || 1;
  const X = (t) => L + (t - times[0]) / (times[frames - 1] - times[0] || 1) * (W - L - R);
  const Y = (v) => H - B - (v - low) / span * (H - T - B);
  make(svg, "text", { x: L, y: 12 }, history.unit === "1" ? history.name : `${history.name} [${history.unit}]`);
  for (const v of [low, high]) make(svg, "text", { x: L - 5, y: Y(v) + 4, "text-anchor": "end" }, digits(v, 3));
  for (const t of [times[0], times[frames - 1]]) make(svg, "text", { x: X(t), y: H - 8, "text-anchor": t === times[0] ? "start" : "end" }, `${digits(t, 3)} s`);
  make(svg, "path", { d: `M${L},${T}V${H - B}H${W - R}`, fill: "none", stroke: "#57606a" });
  if (history.limit !== null) make(svg, "line", { x1: L, x2: W - R, y1: Y(history.limit), y2: Y(history.limit), stroke: "#1b1f24", "stroke-dasharray": "2 3" });
  const inside = make(svg, "svg", {                          // hides what lies beyond
    x: L, y: T, width: W - L - R, height: H - T - B, viewBox: `${L} ${T} ${W - L - R} ${H - T - B}`,
  });
  history.series.forEach((s) => make(inside, "path", {
    d: `M${Array.from(s.values, (v, i) => `${X(times[i]).toFixed(1)},${Y(v).toFixed(1)}`).join("L")}`,
    fill: "none", stroke: lineOf(s.label)[0], "stroke-width": 1.8, "stroke-dasharray": lineOf(s.label)[1],
  }));
  const cursor = make(plot, "div", { class: "viewer-cursor" });  // over the drawing, which it must not draw anew
  Object.assign(cursor.style, { top: `${100 * T / H}%`, bottom: `${100 * B / H}%` });
  const legend = make(cell, "p", { class: "viewer-legend" });
  svg.addEventListener("click", (event) => {
    const box = svg.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * W;
    seek(Math.round((x - L) / (W - L - R) * (frames - 1)));
  });
  return (i) => {
    cursor.style.transform = `translateX(${(100 * X(times[i]) / W).toFixed(3)}cqw)`;
    legend.textContent = history.series.map((s) => `${s.label} ${withUnit(digits(s.values[i], 4), history.unit)}`).join(" · ");
  };
}
function scaleOfForces(parent) {                            // the colours from none to the largest force
  const svg = make(parent, "svg", { viewBox: "0 0 240 22", class: "viewer-scale", role: "img", "aria-label": `force from 0 to ${digits(strongest, 3)} N` });
  for (let i = 0; i < 24; i++) {
    const [r, g, b] = byForce(strongest * (i + .5) / 24).map((x) => Math.round(255 * x));
    make(svg, "path", { d: `M${30 + 5 * i},4h5v10h-5z`, fill: `rgb(${r},${g},${b})` });
  }
  make(svg, "text", { x: 24, y: 13, "text-anchor": "end" }, "0");
  make(svg, "text", { x: 156, y: 13 }, `${digits(strongest, 3)} N`);
  return svg;
}
function forcesOf(name) {                                    // of a member in the runs that have it, as a history
  const series = [];
  for (const run of shown()) {
    const k = run.members.findIndex((member) => member.name === name);
    if (k >= 0 && run.forces) series.push({ label: run.label, values: Float32Array.from({ length: frames }, (_, f) => force(run, k, f)) });
  }
  return series.length ? { name: `force of ${name}, tension positive`, unit: "N", limit: null, series } : null;
}
function rowOf(name) {                                       // its row in a table of members of this page
  for (const row of document.querySelectorAll("table tbody tr")) {
    const cells = [...row.cells].slice(0, 3).map((cell) => cell.textContent.trim());
    if (cells.includes(name) && row.cells.length > 4) return row;
  }
  return null;
}
