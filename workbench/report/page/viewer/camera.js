// ---- one camera for all canvases -----------------------------------------------------------------------------
// Every view keeps in the picture what the motion is about, in every frame: the occupant where there is one, and
// the place in the vehicle where he began; else everything that moves.
const HALF_ANGLE = .25, MARGIN = 1.04, APART = 1.6;
const DIRECTIONS = {                                         // from the target to the eye
  side: [0, -1, .12], front: [1, 0, .15], rear: [-1, 0, .15], top: [0, -.02, 1], corner: [.6, -1, .45],
};
const state = {
  frame: 0, playing: false, threshold: .01, view: "side", glass: true, zoom: 1, azimuth: 0, height: 0,
  case: cases[0], ghosts: false, colouring: "kind", arrows: false, member: null,
};
const isOccupant = (body) => body.role === "occupant" || body.role === "head";
const shown = () => runsOf(state.case);

function outline(body) {                                     // points whose hull holds a shape, in its own axes
  if (body.shape === "mesh") return data.meshes[body.mesh].vertices;
  if (body.shape === "box") {
    const h = body.size.map((x) => x / 2), out = [];
    for (const a of [-1, 1]) for (const b of [-1, 1]) for (const c of [-1, 1]) out.push([a * h[0], b * h[1], c * h[2]]);
    return out;
  }
  const [r, length] = body.size, out = [];
  for (const end of [-1, 1]) for (const [x, y, z] of [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, end]]) {
    out.push([r * x, r * y, end * length / 2 + r * z]);
  }
  return out;
}
function occupantPoints(run, frame) {
  const out = [];
  run.bodies.forEach((body, k) => {
    if (!isOccupant(body)) return;
    const { at, q } = pose(run, frame, k);
    for (const p of outline(body)) out.push(add(at, rotate(q, p)));
  });
  return out;
}
function boxOf(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const p of points) for (let k = 0; k < 3; k++) {
    low[k] = Math.min(low[k], p[k]);
    high[k] = Math.max(high[k], p[k]);
  }
  return { middle: low.map((x, k) => (x + high[k]) / 2), radius: Math.hypot(...high.map((x, k) => x - low[k])) / 2 };
}
const vehicleOf = (run) => run.bodies.findIndex((body) => body.role === "vehicle");
const homes = new Map();                                     // where he begins, as seen from the vehicle
function homeOf(run) {
  if (!homes.has(run)) {
    const points = occupantPoints(run, 0), k = vehicleOf(run);
    if (k < 0) homes.set(run, points);
    else {
      const { at, q } = pose(run, 0, k), back = [q[0], -q[1], -q[2], -q[3]];
      homes.set(run, points.map((p) => rotate(back, add(p, at, -1))));
    }
  }
  const k = vehicleOf(run), points = homes.get(run);
  if (k < 0) return points;
  const { at, q } = pose(run, state.frame, k);
  return points.map((p) => add(at, rotate(q, p)));
}
const whole = boxOf(data.runs.flatMap((run) => {
  const out = [];
  for (let f = 0; f < frames; f += Math.max(1, Math.floor(frames / 40))) run.bodies.forEach((_, k) => out.push(pose(run, f, k).at));
  return out;
}));
const framedNow = new Map();                                 // found once a frame
let framedWhen = "";
function subject(run) {                                      // what is framed now: a sphere
  const when = `${state.frame} ${state.view}`;
  if (when !== framedWhen) { framedNow.clear(); framedWhen = when; }
  if (!framedNow.has(run)) framedNow.set(run, sphereOf(run));
  return framedNow.get(run);
}
function sphereOf(run) {
  const points = occupantPoints(run, state.frame);
  if (!points.length) return { middle: whole.middle, radius: Math.max(.6, whole.radius + .4) };
  const box = boxOf(state.view === "occupant" ? points : points.concat(homeOf(run)));
  const least = state.view === "occupant" ? .5 : .9;
  return { middle: box.middle, radius: Math.max(least, box.radius) };
}
function look(direction) {
  const d = unit(direction);
  state.azimuth = Math.atan2(d[1], d[0]);
  state.height = Math.asin(d[2]);
  state.zoom = 1;
}
function camera(run, aspect) {
  // one scale for all canvases, while nobody leaves the others far behind
  const { middle, radius: mine } = subject(run), largest = Math.max(...shown().map((other) => subject(other).radius));
  const radius = Math.min(largest, APART * mine), c = Math.cos(state.height), t = Math.tan(HALF_ANGLE);
  const narrow = Math.min(HALF_ANGLE, Math.atan(t * aspect));
  const reach = MARGIN * radius / Math.sin(narrow) / state.zoom;
  let away = [c * Math.cos(state.azimuth), c * Math.sin(state.azimuth), Math.sin(state.height)], top = [0, 0, 1];
  const k = vehicleOf(run);
  if (state.view === "vehicle" && k >= 0) {                  // turns as the vehicle turns
    const { q } = pose(run, state.frame, k);
    away = rotate(q, away);
    top = rotate(q, top);
  }
  const eye = add(middle, away, reach);
  if (state.view !== "vehicle") eye[2] = Math.max(eye[2], .05);
  const forward = unit(add(middle, eye, -1)), right = unit(cross(forward, top));
  return { eye, forward, right, up: cross(right, forward), reach, near: reach / 50, far: reach * 6 + 60 };
}
function matrix(cam, aspect) {                               // projection times view, column by column
  const t = 1 / Math.tan(HALF_ANGLE), { near: n, far: f } = cam, m = new Float32Array(16);
  const rows = [
    [cam.right.map((x) => x * t / aspect), 0], [cam.up.map((x) => x * t), 0],
    [cam.forward.map((x) => x * (f + n) / (f - n)), -2 * f * n / (f - n)], [cam.forward, 0],
  ];
  rows.forEach(([r, c], i) => {
    for (let k = 0; k < 3; k++) m[4 * k + i] = r[k];
    m[12 + i] = c - dot(r, cam.eye);
  });
  return m;
}
function project(m, p) {                                     // to -1..1 from left to right and from below
  const row = (i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i], w = row(3);
  return w > 0 ? [row(0) / w, row(1) / w] : null;
}
