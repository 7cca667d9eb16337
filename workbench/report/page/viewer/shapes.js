// ---- what is drawn: bodies and members of a run in a frame -----------------------------------------------------
const COLOURS = {
  vehicle: [.62, .66, .70], occupant: [.86, .72, .55], head: [.86, .72, .55], seat: [.45, .50, .55],
  wheel: [.25, .27, .30], other: [.70, .70, .66],
  belt: [.835, .369, 0], airbag: [0, .447, .698], retractor: [.45, .34, .02],
};
const FIRING = [.95, .65, .05], CHOSEN = [1, .87, .1], GHOST = [.45, .48, .52];
const SCALE = [[.27, .00, .33], [.23, .32, .55], [.13, .57, .55], [.37, .79, .38], [.99, .91, .14]];  // viridis
const THINNEST = .004, THICKEST = .016, ACTS = .02;               // ACTS: of the largest force of all members

function byForce(value) {
  const s = Math.min(1, Math.abs(value) / (strongest || 1)) * (SCALE.length - 1), i = Math.min(Math.floor(s), SCALE.length - 2);
  return SCALE[i].map((x, k) => x + (s - i) * (SCALE[i + 1][k] - x));
}
function turnOnto(axis, across) {                            // z onto a unit axis, x as near to `across` as may be
  let x = add(across, axis, -dot(across, axis));
  if (Math.hypot(...x) < 1e-6) x = Math.abs(axis[2]) < .9 ? cross(axis, [0, 0, 1]) : cross(axis, [1, 0, 0]);
  x = unit(x);
  return ofAxes(x, cross(axis, x), axis);
}
function rod(a, b, radius, colour, mesh = "rod") {           // a capsule of as many corners as one sees
  const d = add(b, a, -1), length = Math.hypot(...d);
  return { mesh, at: add(a, d, .5), q: length > 1e-9 ? turnOnto(unit(d), [1, 0, 0]) : [1, 0, 0, 0], size: [radius, length / 2, -1], colour };
}
function band(a, b, across, radius, colour, thinnest) {      // a belt: flat, its face towards what it holds
  const d = add(b, a, -1), length = Math.hypot(...d);
  if (length < 1e-9) return rod(a, b, radius, colour);
  return { mesh: "box", at: add(a, d, .5), q: turnOnto(unit(d), across), size: [...[1.6, .25].map((s) => Math.max(s * radius, thinnest)), length / 2], colour };
}
function arrow(from, direction, length, colour) {
  const tip = add(from, direction, length), neck = add(from, direction, Math.max(length - .05, .5 * length));
  return [rod(from, neck, .006, colour), { mesh: "cone", at: neck, q: turnOnto(direction, [1, 0, 0]), size: [.02, .02, Math.hypot(...add(tip, neck, -1))], colour }];
}
function memberShapes(run, k, frame, out, thinnest) {
  const member = run.members[k];
  if (member.density < state.threshold) return;
  const [a, b] = ends(run, member, frame), d = add(b, a, -1), pull = force(run, k, frame);
  const isChosen = state.member === member.name, acts = run.forces && Math.abs(pull) > ACTS * strongest;
  const r = (THINNEST + member.density * (THICKEST - THINNEST)) * (isChosen ? 1.6 : 1);
  let colour = state.colouring === "force" && run.forces ? byForce(pull) : COLOURS[member.kind];
  if (member.kind === "retractor" && acts && state.colouring === "kind") colour = FIRING;
  colour = [...(isChosen ? CHOSEN : colour), 1];
  const on = (s) => add(a, d, s);
  if (isChosen) out.chosen.push(rod(a, b, Math.max(r, thinnest), [...CHOSEN, .8]));  // over all that hides it
  if (member.kind === "belt") {
    const middle = member.body_a < 0 ? a : pose(run, frame, member.body_a).at;
    out.solid.push(band(a, b, cross(d, add(a, middle, -1)), r, colour, thinnest));
  } else if (member.kind === "airbag") {                     // keeps its volume: thicker where it is pressed together
    const length = Math.max(Math.hypot(...d), .02), full = .03 + .07 * member.density;
    const filled = run.forces ? .35 + .65 * Math.min(1, Math.abs(pull) / (.2 * strongest || 1)) : 1;
    const radius = Math.min(full * filled * Math.sqrt(member.rest / length), .45 * length + .02, .25);
    out.solid.push(rod(a, b, Math.max(r / 3, thinnest), colour));
    out.glass.push(rod(on(Math.min(.45, radius / length)), on(1 - Math.min(.45, radius / length)), radius, [...colour.slice(0, 3), .5], "bag"));
  } else {
    out.solid.push(rod(a, b, Math.max(acts ? 1.5 * r : r, thinnest), colour, acts ? "firing" : "slack"));
  }
  if (state.arrows && acts && Math.hypot(...d) > 1e-9) {     // the force on the end that is held
    out.solid.push(...arrow(a, unit(pull > 0 ? d : d.map((x) => -x)), .08 + .45 * Math.abs(pull) / strongest, [...byForce(pull), 1]));
  }
}
function shapesOf(run, frame, thinnest) {                    // thinnest: radius below which a line would have gaps
  const out = { solid: [], glass: [], occupant: [], chosen: [] };
  run.bodies.forEach((body, k) => {
    const { at, q } = pose(run, frame, k), through = body.see_through && state.glass;
    const size = body.shape === "box" ? body.size.map((x) => x / 2) : body.shape === "mesh" ? [1, 1, 1] : [body.size[0], body.size[1] / 2, -1];
    const shape = { mesh: body.shape === "mesh" ? body.mesh : body.shape, at, q, size, colour: [...COLOURS[body.role], through ? .3 : 1] };
    (isOccupant(body) ? out.occupant : through ? out.glass : out.solid).push(shape);
  });
  run.members.forEach((_, k) => memberShapes(run, k, frame, out, thinnest));
  return out;
}
function ghostsBeside(run, frame) {                          // the occupants of the other runs, as seen from this vehicle
  const out = [], here = vehicleOf(run);
  for (const other of shown()) {
    if (other === run) continue;
    const there = vehicleOf(other);
    other.bodies.forEach((body, k) => {
      if (!isOccupant(body)) return;
      let { at, q } = pose(other, frame, k);
      if (here >= 0 && there >= 0) {
        const a = pose(other, frame, there), b = pose(run, frame, here), back = [a.q[0], -a.q[1], -a.q[2], -a.q[3]];
        at = add(b.at, rotate(b.q, rotate(back, add(at, a.at, -1))));
        q = times3(b.q, times3(back, q));
      }
      out.push({ mesh: body.shape === "mesh" ? body.mesh : body.shape, at, q, size: body.shape === "box" ? body.size.map((x) => x / 2) : body.shape === "mesh" ? [1, 1, 1] : [body.size[0], body.size[1] / 2, -1], colour: [...GHOST, .35] });
    });
  }
  return out;
}
function times3(a, b) {                                      // the product of two quaternions
  const [w, ...u] = a, [s, ...v] = b;
  return [w * s - dot(u, v), ...add(add(v.map((x) => w * x), u, s), cross(u, v))];
}
