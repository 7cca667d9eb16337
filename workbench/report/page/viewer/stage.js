// ---- a canvas and what it draws on ----------------------------------------------------------------------------
// A vertex is (normal, corner): capsule points are normal * radius + corner * (0, 0, half length), all others
// corner * size.
function capsule(rings = 6, sides = 16) {
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
function faceted(vertices, triangles) {
  const out = [];
  for (const t of triangles) {
    const [a, b, c] = t.map((i) => vertices[i]), n = unit(cross(add(b, a, -1), add(c, a, -1)));
    for (const p of [a, b, c]) out.push(...n, ...p);
  }
  return new Float32Array(out);
}
function cone(sides = 12) {
  const rim = Array.from({ length: sides }, (_, j) => [Math.cos(2 * Math.PI * j / sides), Math.sin(2 * Math.PI * j / sides), 0]);
  const triangles = rim.flatMap((_, j) => [[j, (j + 1) % sides, sides], [(j + 1) % sides, j, sides + 1]]);
  return faceted([...rim, [0, 0, 1], [0, 0, 0]], triangles);
}
// a rod is thin, and there are hundreds of them: a twelfth of the corners of a capsule
const MESHES = { capsule: capsule(), rod: capsule(1, 6), bag: capsule(3, 12), box: box(), cone: cone() };
(data.meshes || []).forEach((mesh, k) => { MESHES[k] = faceted(mesh.vertices, mesh.triangles); });
const LIGHT = unit([-.35, -.45, .82]);

const OF_A_SHAPE = [["turn", 4], ["place", 3], ["size", 3], ["colour", 4]];
const FLOATS = OF_A_SHAPE.reduce((sum, [, n]) => sum + n, 0);
const VERTEX = `#version 300 es
  in vec3 normal; in vec3 corner;
  in vec4 turn; in vec3 place, size; in vec4 colour;          // of a shape
  uniform mat4 scene; uniform bool flat_; uniform vec3 light;
  out vec3 n; out vec3 at; out vec4 paint;
  vec3 rotated(vec3 p) { vec3 t = 2.0 * cross(turn.yzw, p); return p + turn.x * t + cross(turn.yzw, t); }
  void main() {
    vec3 p = size.z < 0.0 ? normal * size.x + corner * size.y : corner * size;
    at = rotated(p) + place;
    if (flat_) at = vec3(at.xy - light.xy * at.z / light.z, 0.002);
    n = rotated(normal);
    paint = colour;
    gl_Position = scene * vec4(at, 1.0);
  }`;
const FRAGMENT = `#version 300 es
  precision highp float;
  in vec3 n; in vec3 at; in vec4 paint;
  uniform vec3 light, eye; uniform int kind;
  out vec4 result;
  void main() {
    if (kind == 1) { result = paint; return; }              // a shadow
    if (kind == 2) {                                         // the ground: a grid of 0.5 m that fades
      vec2 d = abs(mod(at.xy + 0.25, 0.5) - 0.25);
      float reach = length(at - eye), width = 0.006 + 0.0012 * reach;
      vec3 c = min(d.x, d.y) < width ? vec3(0.80, 0.82, 0.84) : vec3(0.90, 0.91, 0.92);
      result = vec4(mix(vec3(0.955, 0.965, 0.975), c, exp(-max(reach - 8.0, 0.0) / 8.0)), 1.0);
      return;
    }
    float s = dot(normalize(n), light);
    result = vec4(paint.rgb * (0.45 + 0.55 * (0.35 * abs(s) + 0.65 * max(s, 0.0))), paint.a);
  }`;

function stage(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: false });
  if (!gl) return null;
  const losing = gl.getExtension("WEBGL_lose_context");      // asked for now: a lost context gives none
  let U = null, arrays = {}, shapesNow = null, draws = 0, lost = false, scene = null;

  function prepare() {                                       // all that a lost context takes with it
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    ["normal", "corner", ...OF_A_SHAPE.map(([name]) => name)].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return false;
    gl.useProgram(program);
    U = Object.fromEntries(
      ["scene", "flat_", "light", "eye", "kind"].map((name) => [name, gl.getUniformLocation(program, name)]));
    arrays = {};
    shapesNow = gl.createBuffer();
    for (const [name, mesh] of Object.entries(MESHES)) {
      arrays[name] = gl.createVertexArray();
      gl.bindVertexArray(arrays[name]);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, mesh, gl.STATIC_DRAW);
      for (const i of [0, 1]) {
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 24, 12 * i);
      }
      gl.bindBuffer(gl.ARRAY_BUFFER, shapesNow);
      let at = 0;
      OF_A_SHAPE.forEach(([, n], k) => {
        gl.enableVertexAttribArray(2 + k);
        gl.vertexAttribPointer(2 + k, n, gl.FLOAT, false, 4 * FLOATS, 4 * at);
        gl.vertexAttribDivisor(2 + k, 1);
        at += n;
      });
    }
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    return true;
  }
  function all(shapes) {                                     // in their order, neighbours of one form at once
    for (let i = 0, next; i < shapes.length; i = next) {
      const { mesh } = shapes[i];
      for (next = i; next < shapes.length && shapes[next].mesh === mesh; next++);
      const given = new Float32Array(FLOATS * (next - i));
      for (let k = i; k < next; k++) {
        const { q, at, size, colour } = shapes[k];
        given.set(q, FLOATS * (k - i));
        given.set(at, FLOATS * (k - i) + 4);
        given.set(size, FLOATS * (k - i) + 7);
        given.set(colour, FLOATS * (k - i) + 10);
      }
      gl.bindVertexArray(arrays[mesh]);
      gl.bindBuffer(gl.ARRAY_BUFFER, shapesNow);
      gl.bufferData(gl.ARRAY_BUFFER, given, gl.STREAM_DRAW);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, MESHES[mesh].length / 6, next - i);
      draws += next - i;
    }
  }
  function ground(run, shapes) {
    const at = subject(run).middle;
    gl.uniform1i(U.flat_, 0);
    gl.uniform1i(U.kind, 2);
    all([{ mesh: "box", at: [at[0], at[1], -.01], q: [1, 0, 0, 0], size: [60, 60, .01], colour: [1, 1, 1, 1] }]);
    gl.uniform1i(U.kind, 1);                                 // shadows: every pixel darkened once
    gl.uniform1i(U.flat_, 1);
    gl.enable(gl.BLEND);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    all(shapes.map((shape) => ({ ...shape, colour: [.2, .22, .25, .28] })));
    gl.clear(gl.STENCIL_BUFFER_BIT);
    gl.disable(gl.STENCIL_TEST);
    gl.depthMask(true);
    gl.uniform1i(U.flat_, 0);
    gl.uniform1i(U.kind, 0);
    gl.disable(gl.BLEND);
  }
  function through(shapes) {                                 // blended over what stands there
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    all(shapes);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
  function occupant(shapes) {                                // where something hides him he shines through
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    all(shapes);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.INCR, gl.INCR);
    gl.depthFunc(gl.GREATER);
    through(shapes.map((shape) => ({ ...shape, colour: [...shape.colour.slice(0, 3), .45] })));
    gl.depthFunc(gl.LESS);
    gl.disable(gl.STENCIL_TEST);
  }
  function draw(run, ghosts = []) {
    draws = 0;
    if (lost || gl.isContextLost()) return 0;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const cam = camera(run, w / h), shapes = shapesOf(run, state.frame);
    scene = matrix(cam, w / h);
    gl.viewport(0, 0, w, h);
    gl.clearColor(.955, .965, .975, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.uniformMatrix4fv(U.scene, false, scene);
    gl.uniform3fv(U.light, LIGHT);
    gl.uniform3fv(U.eye, cam.eye);
    ground(run, [...shapes.solid, ...shapes.occupant]);
    all(shapes.solid);
    occupant(shapes.occupant);
    through([...ghosts, ...shapes.glass]);
    gl.disable(gl.DEPTH_TEST);
    through(shapes.chosen);
    gl.enable(gl.DEPTH_TEST);
    return draws;
  }
  function pixels() {                                        // right after draw(), before the buffer is given up
    const out = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
    return out;
  }
  function nearest(run, x, y) {                              // the member under a point of the canvas, within 12 px
    let best = 12, found = null;
    const w = canvas.clientWidth, h = canvas.clientHeight;
    run.members.forEach((member, k) => {
      if (member.density < state.threshold) return;
      const [a, b] = ends(run, member, state.frame).map((p) => scene && project(scene, p));
      if (!a || !b) return;
      const [ax, ay, bx, by] = [(a[0] + 1) / 2 * w, (1 - a[1]) / 2 * h, (b[0] + 1) / 2 * w, (1 - b[1]) / 2 * h];
      const l2 = (bx - ax) ** 2 + (by - ay) ** 2 || 1, t = Math.max(0, Math.min(1, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / l2));
      const d = Math.hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay));
      if (d < best) { best = d; found = member.name; }
    });
    return found;
  }
  canvas.addEventListener("webglcontextlost", (e) => { e.preventDefault(); lost = true; });
  canvas.addEventListener("webglcontextrestored", () => { lost = !prepare(); soon(); });
  if (!prepare()) return null;
  return { canvas, draw, pixels, nearest, isLost: () => lost, losing, inside: (run) => inside(run, canvas) };
}
function inside(run, canvas) {                               // share of the occupant's points within the picture
  const aspect = canvas.clientWidth / Math.max(canvas.clientHeight, 1), m = matrix(camera(run, aspect), aspect);
  const points = occupantPoints(run, state.frame);
  const seen = points.filter((p) => { const q = project(m, p); return q && Math.abs(q[0]) <= 1 && Math.abs(q[1]) <= 1; });
  return points.length ? seen.length / points.length : 1;
}
