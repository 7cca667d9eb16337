// ---- the document of workbench/motion/frames.py, unpacked ---------------------------------------------------
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const floats = (text) => new Float32Array(bytes(text));
function table(packed) {                                     // workbench.motion.packing
  if (packed === null || packed === undefined) return null;
  if (typeof packed === "string") return floats(packed);
  if (packed.steps) {                                        // as it was written before
    const steps = new Uint16Array(bytes(packed.steps)), n = packed.low.length;
    return Float32Array.from(steps, (s, i) => packed.low[i % n] + packed.step[i % n] * s);
  }
  const low = floats(packed.low), step = floats(packed.step), n = low.length, count = frames * n;
  const planes = inflate(new Uint8Array(bytes(packed.differences)), 2 * count), out = new Float32Array(count);
  const steps = Uint16Array.from({ length: count }, (_, i) => planes[i] | (planes[count + i] << 8));
  for (let j = 0; j < n; j++) {
    const column = steps.subarray(j * frames, (j + 1) * frames);  // sums of 16 bits: modulo 65536
    for (let k = 0; k < packed.order; k++) for (let i = 1; i < frames; i++) column[i] += column[i - 1];
    for (let i = 0; i < frames; i++) out[i * n + j] = low[j] + step[j] * column[i];
  }
  return out;
}
const data = JSON.parse(source.textContent);
const times = floats(data.times), frames = times.length;
function quaternions(six) {                                  // in_six of workbench.motion.packing, back in seven
  const out = new Float32Array(six.length / 6 * 7);
  for (let i = 0, k = 0; i < six.length; i += 6, k += 7) {
    const [x, y, z, a, b, c] = six.subarray(i, i + 6), s = a * a + b * b + c * c;
    out.set([x, y, z, (1 - s) / (1 + s), 2 * a / (1 + s), 2 * b / (1 + s), 2 * c / (1 + s)], k);
  }
  return out;
}
for (const run of data.runs) {                               // bodies and members stand once, runs say which
  if (!Array.isArray(run.bodies)) run.bodies = data.bodies[run.bodies];
  if (!Array.isArray(run.members)) run.members = data.members[run.members].map((member) => ({ ...member }));
  run.poses = table(run.poses);
  if (run.poses.length === 6 * frames * run.bodies.length) run.poses = quaternions(run.poses);
  run.forces = table(run.forces);
  run.case = run.case || "";
  for (const member of run.members) member.rest = 0;         // filled below: the length in the first frame
}
for (const h of data.histories) {
  h.case = h.case || "";
  for (const s of h.series) s.values = floats(s.values);
}
const cases = [...new Set(data.runs.map((run) => run.case))];
const runsOf = (name) => data.runs.filter((run) => run.case === name);
const MOST_CANVASES = Math.max(...cases.map((name) => runsOf(name).length));
const strongest = data.runs.reduce((top, run) => run.forces ? run.forces.reduce((a, b) => Math.max(a, Math.abs(b)), top) : top, 0);
const force = (run, k, frame) => run.forces ? run.forces[frame * run.members.length + k] : 0;

// ---- vectors and quaternions ---------------------------------------------------------------------------------
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
function unit(v) { const n = Math.hypot(...v) || 1; return v.map((x) => x / n); }
function rotate(q, p) {
  const v = [q[1], q[2], q[3]], t = cross(v, p).map((x) => 2 * x);
  return add(add(p, t, q[0]), cross(v, t));
}
function ofAxes(x, y, z) {                                   // the quaternion whose axes these are
  const trace = x[0] + y[1] + z[2];
  let q;
  if (trace > 0) q = [1 + trace, y[2] - z[1], z[0] - x[2], x[1] - y[0]];
  else if (x[0] > y[1] && x[0] > z[2]) q = [y[2] - z[1], 1 + x[0] - y[1] - z[2], y[0] + x[1], z[0] + x[2]];
  else if (y[1] > z[2]) q = [z[0] - x[2], y[0] + x[1], 1 + y[1] - x[0] - z[2], z[1] + y[2]];
  else q = [x[1] - y[0], z[0] + x[2], z[1] + y[2], 1 + z[2] - x[0] - y[1]];
  return unit(q);
}
function pose(run, frame, body) {                            // position and quaternion
  const i = 7 * (frame * run.bodies.length + body), p = run.poses;
  return { at: [p[i], p[i + 1], p[i + 2]], q: unit([p[i + 3], p[i + 4], p[i + 5], p[i + 6]]) };
}
function ends(run, member, frame) {                          // of a member
  return [["body_a", "point_a"], ["body_b", "point_b"]].map(([body, point]) => {
    if (member[body] < 0) return member[point];
    const p = pose(run, frame, member[body]);
    return add(p.at, rotate(p.q, member[point]));
  });
}
for (const run of data.runs) for (const member of run.members) {
  const [a, b] = ends(run, member, 0);
  member.rest = Math.max(Math.hypot(...add(b, a, -1)), 1e-3);
}
