"use strict";
// The motion of one or two runs in WebGL2, from <script type="application/json" id="viewer-data">
// (the document of workbench/motion.py). Nothing is loaded; without WebGL2 a sentence points to the stills.
(() => {
  const source = document.getElementById("viewer-data"), root = document.getElementById("viewer-panel");
  if (!source || !root) return;

  // ---- data ----------------------------------------------------------------------------------------------
  const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const data = JSON.parse(source.textContent);
  const times = floats(data.times), frames = times.length;
  for (const run of data.runs) run.poses = floats(run.poses);
  for (const h of data.histories) for (const s of h.series) s.values = floats(s.values);

  const COLOURS = {
    vehicle: [.62, .66, .70], occupant: [.86, .72, .55], head: [.86, .72, .55], seat: [.45, .50, .55],
    wheel: [.25, .27, .30], other: [.70, .70, .66],
    belt: [.835, .369, 0], airbag: [0, .447, .698], retractor: [.45, .34, .02],
  };
  const DIRECTIONS = {                                       // from the target to the eye
    side: [0, -1, .12], front: [1, 0, .15], rear: [-1, 0, .15], top: [0, -.02, 1], corner: [.6, -1, .45],
  };
  const LIGHT = unit([-.35, -.45, .82]);
  const THINNEST = .004, THICKEST = .016, PIECES = 7, HALF_ANGLE = .25;

  // ---- vectors -------------------------------------------------------------------------------------------
  function unit(v) { const n = Math.hypot(...v) || 1; return v.map((x) => x / n); }
  const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  function rotate(q, p) {
    const v = [q[1], q[2], q[3]], t = cross(v, p).map((x) => 2 * x);
    return add(add(p, t, q[0]), cross(v, t));
  }
  function pose(run, frame, body) {                          // position and quaternion
    const i = 7 * (frame * run.bodies.length + body), p = run.poses;
    return { at: [p[i], p[i + 1], p[i + 2]], q: [p[i + 3], p[i + 4], p[i + 5], p[i + 6]] };
  }
  function turnOnto(axis) {                                  // the quaternion that turns z onto a unit axis
    const w = 1 + axis[2];
    if (w < 1e-6) return [0, 1, 0, 0];
    const q = [w, -axis[1], axis[0], 0], n = Math.hypot(...q);
    return q.map((x) => x / n);
  }

  // ---- camera, one for all canvases ----------------------------------------------------------------------
  const bounds = { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] };
  for (const run of data.runs) for (let i = 0; i < run.poses.length; i += 7) for (let k = 0; k < 3; k++) {
    bounds.low[k] = Math.min(bounds.low[k], run.poses[i + k]);
    bounds.high[k] = Math.max(bounds.high[k], run.poses[i + k]);
  }
  const middle = bounds.low.map((x, k) => (x + bounds.high[k]) / 2);
  const size = Math.max(.6, Math.hypot(...bounds.high.map((x, k) => x - bounds.low[k])) / 2 + .4);
  const state = { frame: 0, playing: false, threshold: .01, follow: -1, glass: true, zoom: 1, azimuth: 0, height: 0 };

  function look(direction) {
    const d = unit(direction);
    state.azimuth = Math.atan2(d[1], d[0]);
    state.height = Math.asin(d[2]);
    state.zoom = 1;
  }
  function camera(run) {
    const reach = size / Math.tan(HALF_ANGLE) / state.zoom, c = Math.cos(state.height);
    const target = state.follow < 0 ? middle : pose(run, state.frame, Math.min(state.follow, run.bodies.length - 1)).at;
    const away = [c * Math.cos(state.azimuth), c * Math.sin(state.azimuth), Math.sin(state.height)];
    const eye = add(target, away, reach);
    eye[2] = Math.max(eye[2], .2);
    const forward = unit(add(target, eye, -1)), right = unit(cross(forward, [0, 0, 1]));
    return { eye, forward, right, up: cross(right, forward), near: reach / 50, far: reach * 6 + 20 };
  }
  function matrix(cam, aspect) {                             // projection times view, column by column
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

  // ---- meshes --------------------------------------------------------------------------------------------
  // A vertex is (normal, corner): capsule points are normal * radius + corner * (0, 0, half length),
  // box points corner * half edges.
  function capsule(rings = 6, sides = 18) {
    const out = [], rows = [];
    for (let i = 0; i <= 2 * rings + 1; i++) {
      const upper = i > rings, angle = (upper ? i - rings - 1 : i - rings) * Math.PI / 2 / rings;
      rows.push([Math.cos(angle), Math.sin(angle), upper ? 1 : -1]);
    }
    const vertex = ([c, s, end], j) => {
      const a = 2 * Math.PI * j / sides;
      out.push(c * Math.cos(a), c * Math.sin(a), s, 0, 0, end);
    };
    for (let i = 0; i < rows.length - 1; i++) for (let j = 0; j < sides; j++) {
      for (const [r, k] of [[i, j], [i, j + 1], [i + 1, j + 1], [i, j], [i + 1, j + 1], [i + 1, j]]) vertex(rows[r], k);
    }
    return new Float32Array(out);
  }
  function box() {
    const out = [];
    for (let k = 0; k < 3; k++) for (const s of [-1, 1]) {
      const n = [0, 0, 0], u = [0, 0, 0], v = [0, 0, 0];
      n[k] = s; u[(k + 1) % 3] = 1; v[(k + 2) % 3] = s;
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
        out.push(...n, ...add(add(n, u, a), v, b));
      }
    }
    return new Float32Array(out);
  }
  const MESHES = { capsule: capsule(), box: box() };

  const VERTEX = `#version 300 es
    in vec3 normal; in vec3 corner;
    uniform mat4 scene; uniform vec4 turn; uniform vec3 place, size; uniform bool flat_; uniform vec3 light;
    out vec3 n; out vec3 at;
    vec3 rotated(vec3 p) { vec3 t = 2.0 * cross(turn.yzw, p); return p + turn.x * t + cross(turn.yzw, t); }
    void main() {
      vec3 p = size.z < 0.0 ? normal * size.x + corner * size.y : corner * size;
      at = rotated(p) + place;
      if (flat_) at = vec3(at.xy - light.xy * at.z / light.z, 0.002);
      n = rotated(normal);
      gl_Position = scene * vec4(at, 1.0);
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    in vec3 n; in vec3 at;
    uniform vec4 colour; uniform vec3 light, eye; uniform int kind;
    out vec4 result;
    void main() {
      if (kind == 1) { result = colour; return; }              // a shadow
      if (kind == 2) {                                         // the ground: a grid of 0.5 m that fades
        vec2 d = abs(mod(at.xy + 0.25, 0.5) - 0.25);
        float reach = length(at - eye), width = 0.006 + 0.0012 * reach;
        vec3 c = min(d.x, d.y) < width ? vec3(0.80, 0.82, 0.84) : vec3(0.90, 0.91, 0.92);
        result = vec4(mix(vec3(0.955, 0.965, 0.975), c, exp(-max(reach - 8.0, 0.0) / 8.0)), 1.0);
        return;
      }
      float s = dot(normalize(n), light);
      result = vec4(colour.rgb * (0.45 + 0.55 * (0.35 * abs(s) + 0.65 * max(s, 0.0))), colour.a);
    }`;

  function stage(canvas, run) {
    const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false });
    if (!gl) return null;
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "normal");
    gl.bindAttribLocation(program, 1, "corner");
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    gl.useProgram(program);
    const at = (name) => gl.getUniformLocation(program, name);
    const U = Object.fromEntries(
      ["scene", "turn", "place", "size", "flat_", "light", "eye", "colour", "kind"].map((name) => [name, at(name)]));
    const arrays = {};
    for (const [name, mesh] of Object.entries(MESHES)) {
      arrays[name] = gl.createVertexArray();
      gl.bindVertexArray(arrays[name]);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, mesh, gl.STATIC_DRAW);
      for (const i of [0, 1]) {
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 24, 12 * i);
      }
    }
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    let draws = 0;

    function one(shape) {
      gl.uniform4fv(U.turn, shape.q);
      gl.uniform3fv(U.place, shape.at);
      gl.uniform3fv(U.size, shape.size);
      gl.uniform4fv(U.colour, shape.colour);
      gl.bindVertexArray(arrays[shape.mesh]);
      gl.drawArrays(gl.TRIANGLES, 0, MESHES[shape.mesh].length / 6);
      draws++;
    }
    function rod(a, b, radius, colour) {
      const d = add(b, a, -1), length = Math.hypot(...d);
      const q = length > 1e-9 ? turnOnto(unit(d)) : [1, 0, 0, 0];
      return { mesh: "capsule", at: add(a, d, .5), q, size: [radius, length / 2, -1], colour };
    }
    function shapes() {
      const solid = [], glass = [];
      run.bodies.forEach((body, k) => {
        const { at, q } = pose(run, state.frame, k), through = body.see_through && state.glass;
        const size = body.shape === "box" ? body.size.map((x) => x / 2) : [body.size[0], body.size[1] / 2, -1];
        (through ? glass : solid).push({ mesh: body.shape, at, q, size, colour: [...COLOURS[body.role], through ? .3 : 1] });
      });
      for (const member of run.members) {
        if (member.density < state.threshold) continue;
        const [a, b] = [["body_a", "point_a"], ["body_b", "point_b"]].map(([body, point]) => {
          if (member[body] < 0) return member[point];
          const p = pose(run, state.frame, member[body]);
          return add(p.at, rotate(p.q, member[point]));
        });
        const r = THINNEST + member.density * (THICKEST - THINNEST), colour = [...COLOURS[member.kind], 1];
        const on = (s) => add(a, add(b, a, -1), s);
        if (member.kind === "belt") solid.push(rod(a, b, r, colour));
        if (member.kind === "airbag") solid.push(rod(a, b, r / 3, colour));
        for (let k = 0; k < PIECES; k++) {
          if (member.kind === "airbag") solid.push(rod(on((k + .5) / PIECES), on((k + .5) / PIECES), 2 * r, colour));
          if (member.kind === "retractor") solid.push(rod(on(k / PIECES), on((k + .55) / PIECES), r, colour));
        }
      }
      return { solid, glass };
    }
    function draw() {
      const ratio = Math.min(window.devicePixelRatio || 1, 2);
      const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(canvas.clientHeight * ratio));
      if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
      const cam = camera(run), { solid, glass } = shapes();
      draws = 0;
      gl.viewport(0, 0, w, h);
      gl.clearColor(.955, .965, .975, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      gl.uniformMatrix4fv(U.scene, false, matrix(cam, w / h));
      gl.uniform3fv(U.light, LIGHT);
      gl.uniform3fv(U.eye, cam.eye);
      gl.uniform1i(U.flat_, 0);
      gl.uniform1i(U.kind, 2);
      one({ mesh: "box", at: [middle[0], middle[1], -.01], q: [1, 0, 0, 0], size: [60, 60, .01], colour: [1, 1, 1, 1] });
      gl.uniform1i(U.kind, 1);                                 // shadows: every pixel darkened once
      gl.uniform1i(U.flat_, 1);
      gl.enable(gl.BLEND);
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      gl.depthMask(false);
      for (const shape of solid) one({ ...shape, colour: [.2, .22, .25, .28] });
      gl.disable(gl.STENCIL_TEST);
      gl.depthMask(true);
      gl.uniform1i(U.flat_, 0);
      gl.uniform1i(U.kind, 0);
      gl.disable(gl.BLEND);
      solid.forEach(one);
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      glass.forEach(one);
      gl.depthMask(true);
      gl.disable(gl.BLEND);
      return draws;
    }
    function pixels() {                                        // right after draw(), before the buffer is given up
      const out = new Uint8Array(4 * canvas.width * canvas.height);
      gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
      return out;
    }
    return { draw, pixels };
  }

  // ---- the page ------------------------------------------------------------------------------------------
  const make = (parent, tag, attributes = {}, text) => {
    const made = document.createElementNS(
      ["svg", "path", "line", "text"].includes(tag) ? "http://www.w3.org/2000/svg" : "http://www.w3.org/1999/xhtml", tag);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return parent.appendChild(made);
  };
  root.replaceChildren();
  const scenes = make(root, "div", { class: "viewer-scenes" });
  const stages = [];
  for (const run of data.runs) {
    const cell = make(scenes, "div", { class: "viewer-scene" });
    make(cell, "p", { class: "viewer-label" }, run.label);
    const canvas = make(cell, "canvas", { tabindex: 0, role: "img", "aria-label": `Motion, ${run.label}. Drag to turn, wheel or plus and minus to zoom.` });
    const one = stage(canvas, run);
    if (!one) {
      root.replaceChildren();
      make(root, "p", { class: "note fair" }, "This browser offers no WebGL2, so the motion cannot be turned here. The stills below show it.");
      window.holdfast = Object.assign(window.holdfast || {}, { viewer: { ready: false } });
      return;
    }
    stages.push(one);
    steer(canvas);
  }
  const controls = make(root, "div", { class: "viewer-controls" });
  const play = make(controls, "button", { type: "button" }, "Play");
  const slider = make(controls, "input", { type: "range", min: 0, max: frames - 1, step: 1, value: 0, "aria-label": "time" });
  const clock = make(controls, "output", { class: "viewer-clock" });
  const more = make(root, "div", { class: "viewer-controls" });
  const select = make(make(more, "label", {}, "View "), "select");
  const followed = data.runs[0].bodies.map((b, k) => [b.role, k]);
  const views = [...Object.keys(DIRECTIONS).map((name) => [name, name]),
    ...["vehicle", "occupant"].filter((role) => followed.some(([r]) => r === role)).map((role) => [`with the ${role}`, role])];
  for (const [label, value] of views) make(select, "option", { value }, label);
  const thin = make(make(more, "label", {}, "Hide members below density "), "input", { type: "range", min: 0, max: 1, step: .01, value: state.threshold });
  const glass = make(make(more, "label"), "input", { type: "checkbox" });
  glass.parentNode.append(" see through the vehicle");
  glass.checked = true;
  const charts = data.histories.map(chart);
  let waiting = 0, started = 0, lastDraws = 0;

  function chart(history) {
    const W = 520, H = 150, L = 56, R = 10, T = 20, B = 24, cell = make(root, "div", { class: "viewer-chart" });
    const svg = make(cell, "svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${history.name} over time` });
    const all = history.series.flatMap((s) => [...s.values]).concat(history.limit ?? []);
    const low = Math.min(...all), high = Math.max(...all), span = high - low || 1;
    const X = (t) => L + (t - times[0]) / (times[frames - 1] - times[0] || 1) * (W - L - R);
    const Y = (v) => H - B - (v - low) / span * (H - T - B);
    make(svg, "text", { x: L, y: 12 }, history.unit === "1" ? history.name : `${history.name} [${history.unit}]`);
    for (const v of [low, high]) make(svg, "text", { x: L - 5, y: Y(v) + 4, "text-anchor": "end" }, String(Number(v.toPrecision(3))));
    for (const t of [times[0], times[frames - 1]]) make(svg, "text", { x: X(t), y: H - 8, "text-anchor": t === times[0] ? "start" : "end" }, `${Number(t.toPrecision(3))} s`);
    make(svg, "path", { d: `M${L},${T}V${H - B}H${W - R}`, fill: "none", stroke: "#57606a" });
    if (history.limit !== null) make(svg, "line", { x1: L, x2: W - R, y1: Y(history.limit), y2: Y(history.limit), stroke: "#1b1f24", "stroke-dasharray": "2 3" });
    history.series.forEach((s, k) => make(svg, "path", {
      d: `M${Array.from(s.values, (v, i) => `${X(times[i]).toFixed(1)},${Y(v).toFixed(1)}`).join("L")}`,
      fill: "none", stroke: ["#D55E00", "#0072B2", "#009E73"][k % 3], "stroke-width": 1.8, "stroke-dasharray": ["none", "7 3", "2 2"][k % 3],
    }));
    const cursor = make(svg, "line", { y1: T, y2: H - B, stroke: "#1b1f24", class: "viewer-cursor" });
    const legend = make(cell, "p", { class: "viewer-legend" });
    svg.addEventListener("click", (event) => {
      const box = svg.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * W;
      seek(Math.round((x - L) / (W - L - R) * (frames - 1)));
    });
    return (i) => {
      cursor.setAttribute("x1", X(times[i]));
      cursor.setAttribute("x2", X(times[i]));
      legend.textContent = history.series.map((s) => `${s.label} ${Number(s.values[i].toPrecision(4))}${history.unit === "1" ? "" : ` ${history.unit}`}`).join(" · ");
    };
  }
  function render() {
    waiting = 0;
    lastDraws = stages.reduce((sum, one) => sum + one.draw(), 0);
    slider.value = state.frame;
    clock.textContent = `${times[state.frame].toFixed(3)} s`;
    slider.setAttribute("aria-valuetext", clock.textContent);
    charts.forEach((move) => move(state.frame));
  }
  function soon() { if (!waiting) waiting = requestAnimationFrame(render); }
  function seek(frame) { state.frame = Math.max(0, Math.min(frames - 1, frame)); soon(); }
  function step(now) {
    if (!state.playing) return;
    const t = times[0] + (now - started) / 1000;
    let i = state.frame;
    while (i < frames - 1 && times[i + 1] <= t) i++;
    state.frame = i;
    render();
    if (i === frames - 1) { state.playing = false; play.textContent = "Play"; } else requestAnimationFrame(step);
  }
  play.addEventListener("click", () => {
    state.playing = !state.playing;
    play.textContent = state.playing ? "Pause" : "Play";
    if (!state.playing) return;
    if (state.frame === frames - 1) state.frame = 0;
    started = performance.now() - 1000 * (times[state.frame] - times[0]);
    requestAnimationFrame(step);
  });
  slider.addEventListener("input", () => { state.playing = false; play.textContent = "Play"; seek(Number(slider.value)); });
  thin.addEventListener("input", () => { state.threshold = Number(thin.value); soon(); });
  glass.addEventListener("change", () => { state.glass = glass.checked; soon(); });
  select.addEventListener("change", () => {
    const direction = DIRECTIONS[select.value];
    state.follow = direction ? -1 : followed.find(([role]) => role === select.value)[1];
    look(direction || DIRECTIONS.side);
    if (!direction) state.zoom = 1.6;
    soon();
  });
  function turn(dx, dy) {
    state.azimuth -= dx;
    state.height = Math.max(-.05, Math.min(1.55, state.height + dy));
    soon();
  }
  function zoom(factor) { state.zoom = Math.max(.2, Math.min(12, state.zoom * factor)); soon(); }
  function steer(canvas) {
    const fingers = new Map();
    canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
    canvas.addEventListener("pointermove", (e) => {
      const last = fingers.get(e.pointerId);
      if (!last) return;
      const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
      const before = fingers.size === 2 ? spread() : 0;
      fingers.set(e.pointerId, [e.clientX, e.clientY]);
      if (fingers.size === 2) zoom(spread() / Math.max(before, 1));
      else turn((e.clientX - last[0]) * .008, (e.clientY - last[1]) * .008);
    });
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(-e.deltaY * .0015)); }, { passive: false });
    canvas.addEventListener("keydown", (e) => {
      const act = {
        ArrowLeft: () => turn(-.1, 0), ArrowRight: () => turn(.1, 0), ArrowUp: () => turn(0, .1), ArrowDown: () => turn(0, -.1),
        "+": () => zoom(1.15), "-": () => zoom(1 / 1.15), " ": () => play.click(),
      }[e.key];
      if (act) { e.preventDefault(); act(); }
    });
  }
  look(DIRECTIONS.side);
  window.addEventListener("resize", soon);
  render();
  window.holdfast = Object.assign(window.holdfast || {}, {
    viewer: {
      ready: true, frames, bodies: data.runs.map((run) => run.bodies.length), members: data.runs.map((run) => run.members.length),
      // what the frame looks like: draw calls, a hash of the pixels and how many colours there are, per canvas
      probe(frame) {
        state.frame = frame;
        render();
        const drawn = stages.map((one) => {
          one.draw();
          const pixels = new Uint32Array(one.pixels().buffer);
          let hash = 2166136261;
          for (const value of pixels) hash = Math.imul(hash ^ value, 16777619) >>> 0;
          return { hash, colours: new Set(pixels).size };
        });
        return { draws: lastDraws, drawn, cursor: root.querySelector(".viewer-cursor")?.getAttribute("x1") ?? null };
      },
    },
  });
})();
