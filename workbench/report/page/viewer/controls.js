// ---- the page: canvases, controls, keys -------------------------------------------------------------------------
root.replaceChildren();
const scenes = make(root, "div", { class: "viewer-scenes" });
const stages = [];
for (let i = 0; i < MOST_CANVASES; i++) {
  const cell = make(scenes, "div", { class: "viewer-scene" }), label = make(cell, "p", { class: "viewer-label" });
  const canvas = make(cell, "canvas", { tabindex: 0, role: "img" }), one = stage(canvas);
  if (!one) {
    root.replaceChildren();
    make(root, "p", { class: "note fair" }, "This browser offers no WebGL2, so the motion cannot be turned here. The stills below show it.");
    window.holdfast = Object.assign(window.holdfast || {}, { viewer: { ready: false } });
    return;
  }
  stages.push({ ...one, cell, label });
  steer(canvas, i);
}
const controls = make(root, "div", { class: "viewer-controls" });
const play = make(controls, "button", { type: "button" }, "Play");
const slider = make(controls, "input", { type: "range", min: 0, max: frames - 1, step: 1, value: 0, "aria-label": "time" });
const clock = make(controls, "output", { class: "viewer-clock" });
const more = make(root, "div", { class: "viewer-controls" });

function choice(text, options, chosen, act) {                // a labelled list; nothing where nothing is to choose
  if (options.length < 2) return null;
  const select = make(make(more, "label", {}, `${text} `), "select");
  for (const [label, value] of options) make(select, "option", { value }, label);
  select.value = chosen;
  select.addEventListener("change", () => { act(select.value); soon(); });
  return select;
}
function tick(text, isOn, act) {
  const box = make(make(more, "label"), "input", { type: "checkbox" });
  box.parentNode.append(` ${text}`);
  box.checked = isOn;
  box.addEventListener("change", () => { act(box.checked); soon(); });
}
const hasOccupant = data.runs[0].bodies.some(isOccupant), hasVehicle = vehicleOf(data.runs[0]) >= 0;
const hasForces = data.runs.some((run) => run.forces), hasMembers = data.runs.some((run) => run.members.length);
const VIEWS = [...Object.keys(DIRECTIONS).map((name) => [name, name]),
  ...(hasVehicle ? [["with the vehicle", "vehicle"]] : []), ...(hasOccupant ? [["close to the occupant", "occupant"]] : [])];
choice("Case", cases.map((name) => [name || "the only one", name]), state.case, (name) => { state.case = name; arrange(); });
const view = choice("View", VIEWS, state.view, (name) => { state.view = name; look(DIRECTIONS[name] || DIRECTIONS.side); });
if (hasMembers) {
  const thin = make(make(more, "label", {}, "Hide members below density "), "input", { type: "range", min: 0, max: 1, step: .01, value: state.threshold });
  thin.addEventListener("input", () => { state.threshold = Number(thin.value); soon(); });
}
if (data.runs.some((run) => run.bodies.some((body) => body.see_through))) tick("see through the vehicle", true, (on) => { state.glass = on; });
if (MOST_CANVASES > 1) tick("the others as ghosts in the first", false, (on) => { state.ghosts = on; arrange(); });
if (hasForces) {
  let scale = null;
  choice("Colour", [["by kind", "kind"], ["by force", "force"]], "kind", (by) => {
    state.colouring = by;
    if (scale) scale.remove();
    scale = by === "force" ? scaleOfForces(more) : null;
  });
  tick("arrows of the forces", false, (on) => { state.arrows = on; });
}
const chosen = make(root, "div", { class: "viewer-member", "aria-live": "polite" });
const plots = make(root, "div");
let charts = [], waiting = 0, resting = 0, started = 0, lastDraws = 0;

function arrange() {                                         // canvases and charts of the case
  const runs = shown();
  stages.forEach((one, i) => {
    const run = runs[i];
    one.cell.hidden = !run || (state.ghosts && i > 0);
    if (!run) return;
    one.label.textContent = run.label;
    one.canvas.setAttribute("aria-label", `Motion, ${run.label}. Drag or arrow keys turn, plus and minus zoom, n and p choose a member, full stop and comma step in time.`);
  });
  plots.replaceChildren();
  charts = data.histories.filter((h) => h.case === state.case).map((history) => chart(plots, history));
  tellMember();
}
function tellMember() {
  chosen.replaceChildren();
  for (const row of document.querySelectorAll("tr.viewer-row")) row.classList.remove("viewer-row", "marked");
  if (state.member === null) {
    if (hasMembers) make(chosen, "p", { class: "viewer-legend" }, "Click a member, or press n with the focus on a canvas, to see what it bears.");
    return;
  }
  const member = shown().flatMap((run) => run.members).find((m) => m.name === state.member);
  if (!member) { state.member = null; tellMember(); return; }
  const history = forcesOf(state.member), row = rowOf(state.member);
  make(chosen, "p", {}, `${member.name}: ${member.kind}, density ${digits(member.density, 3)}, ${digits(member.rest, 3)} m at the start`);
  if (history) charts.push(chart(chosen, history));
  if (row) {
    row.classList.add("viewer-row", "marked");
    const show = make(chosen, "button", { type: "button" }, "Its row in the table");
    show.addEventListener("click", () => {
      for (let part = row.parentNode; part; part = part.parentNode) if (part.tagName === "DETAILS") part.open = true;
      row.scrollIntoView({ block: "center" });
    });
  }
}
function choose(name) { state.member = name; arrange(); soon(); }
function another(run, by) {                                  // the next member that is shown, or the one before
  const names = run.members.filter((m) => m.density >= state.threshold).map((m) => m.name);
  if (!names.length) return;
  const at = names.indexOf(state.member);
  choose(names[at < 0 ? (by > 0 ? 0 : names.length - 1) : (at + by + names.length) % names.length]);
}
function render(moves = false) {
  waiting = 0;
  clearTimeout(resting);
  if (moves && onProcessor) resting = setTimeout(() => { if (!state.playing) soon(); }, RESTS);
  const runs = shown();
  lastDraws = 0;
  stages.forEach((one, i) => { if (!one.cell.hidden) lastDraws += one.draw(runs[i], i === 0 && state.ghosts ? ghostsBeside(runs[0], state.frame) : [], moves); });
  slider.value = state.frame;
  clock.textContent = `${times[state.frame].toFixed(3)} s`;
  slider.setAttribute("aria-valuetext", clock.textContent);
  charts.forEach((move) => move(state.frame));
}
function soon(moves = false) {
  cancelAnimationFrame(waiting);
  waiting = requestAnimationFrame(() => render(moves || state.playing));
}
function seek(frame) { state.frame = Math.max(0, Math.min(frames - 1, frame)); soon(true); }
function pause() { state.playing = false; play.textContent = "Play"; }
function step(now) {
  if (!state.playing) return;
  const t = times[0] + (now - started) / 1000;
  let i = state.frame;
  while (i < frames - 1 && times[i + 1] <= t) i++;
  state.frame = i;
  render(true);
  if (i === frames - 1) pause(); else requestAnimationFrame(step);
}
play.addEventListener("click", () => {
  state.playing = !state.playing;
  play.textContent = state.playing ? "Pause" : "Play";
  if (!state.playing) { soon(); return; }
  if (state.frame === frames - 1) state.frame = 0;
  started = performance.now() - 1000 * (times[state.frame] - times[0]);
  requestAnimationFrame(step);
});
slider.addEventListener("input", () => { pause(); seek(Number(slider.value)); });
function turn(dx, dy) {
  state.azimuth -= dx;
  state.height = Math.max(-.05, Math.min(1.55, state.height + dy));
  soon(true);
}
function zoom(factor) { state.zoom = Math.max(.2, Math.min(12, state.zoom * factor)); soon(true); }
function steer(canvas, i) {
  const fingers = new Map();
  let moved = 0;
  canvas.addEventListener("pointerdown", (e) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    moved = 0;
  });
  canvas.addEventListener("pointerup", (e) => {
    fingers.delete(e.pointerId);
    if (moved > 4 || !hasMembers) return;
    const box = canvas.getBoundingClientRect();
    choose(stages[i].nearest(shown()[i], e.clientX - box.left, e.clientY - box.top));
  });
  canvas.addEventListener("pointercancel", (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("pointermove", (e) => {
    const last = fingers.get(e.pointerId);
    if (!last) return;
    moved += Math.hypot(e.clientX - last[0], e.clientY - last[1]);
    const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    if (fingers.size === 2) zoom(spread() / Math.max(before, 1));
    else turn((e.clientX - last[0]) * .008, (e.clientY - last[1]) * .008);
  });
  canvas.addEventListener("wheel", (e) => {                  // the page scrolls unless the canvas has the focus
    if (document.activeElement !== canvas) return;
    e.preventDefault();
    zoom(Math.exp(-e.deltaY * .0015));
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const act = {
      ArrowLeft: () => turn(-.1, 0), ArrowRight: () => turn(.1, 0), ArrowUp: () => turn(0, .1), ArrowDown: () => turn(0, -.1),
      "+": () => zoom(1.15), "-": () => zoom(1 / 1.15), " ": () => play.click(),
      n: () => another(shown()[i], 1), p: () => another(shown()[i], -1), Escape: () => choose(null),
      ".": () => { pause(); seek(state.frame + 1); }, ",": () => { pause(); seek(state.frame - 1); },
    }[e.key];
    if (act) { e.preventDefault(); act(); }
  });
}
look(DIRECTIONS.side);
arrange();
window.addEventListener("resize", () => soon());
render();
window.holdfast = Object.assign(window.holdfast || {}, {
  viewer: {
    ready: true, frames, bodies: shown().map((run) => run.bodies.length), members: shown().map((run) => run.members.length), cases,
    choose, state, views: VIEWS.map(([, name]) => name),
    // what the frame looks like: draw calls, a hash of the pixels and how many colours there are, per canvas
    probe(frame) {
      state.frame = frame;
      render();
      const drawn = stages.filter((one) => !one.cell.hidden).map((one, i) => {
        one.draw(shown()[i], i === 0 && state.ghosts ? ghostsBeside(shown()[0], frame) : [], false);
        const pixels = new Uint32Array(one.pixels().buffer);
        let hash = 2166136261;
        for (const value of pixels) hash = Math.imul(hash ^ value, 16777619) >>> 0;
        return { hash, colours: new Set(pixels).size };
      });
      return { draws: lastDraws, drawn, cursor: root.querySelector(".viewer-cursor")?.style.transform ?? null };
    },
    // the smallest share of the occupant's points within the picture over all frames, runs and cases of a view
    framed(name) {
      const before = { ...state };
      let least = 1;
      state.view = name;
      look(DIRECTIONS[name] || DIRECTIONS.side);
      for (const one of cases) {
        state.case = one;
        for (state.frame = 0; state.frame < frames; state.frame++) shown().forEach((run, i) => { least = Math.min(least, stages[i].inside(run)); });
      }
      Object.assign(state, before);
      arrange();
      return least;
    },
    choices: { view },
    lose() { stages.forEach((one) => one.losing?.loseContext()); },
    restore() { stages.forEach((one) => one.losing?.restoreContext()); },
    lost: () => stages.some((one) => one.isLost()),
  },
});
