// ---- a canvas and what it draws on ----------------------------------------------------------------------------
const LIGHT = unit([-.35, -.45, .82]);

const VERTEX = `#version 300 es
  in vec3 corner, normal; in vec4 colour;
  uniform mat4 scene; uniform bool flat_; uniform vec3 light;
  out vec3 n; out vec3 at; out vec4 paint;
  void main() {
    at = flat_ ? vec3(corner.xy - light.xy * corner.z / light.z, 0.002) : corner;
    n = normal;
    paint = colour;
    gl_Position = scene * vec4(at, 1.0);
  }`;
const FRAGMENT = `#version 300 es
  precision highp float;
  in vec3 n; in vec3 at; in vec4 paint;
  uniform vec3 light, eye; uniform int kind;
  out vec4 result;
  void main() {
    if (kind == 1) { result = vec4(0.2, 0.22, 0.25, 0.28); return; }  // a shadow
    if (kind == 2) {                                         // the ground: a grid of 0.5 m that fades
      vec2 d = abs(mod(at.xy + 0.25, 0.5) - 0.25);
      float reach = length(at - eye), width = 0.006 + 0.0012 * reach;
      vec3 c = min(d.x, d.y) < width ? vec3(0.80, 0.82, 0.84) : vec3(0.90, 0.91, 0.92);
      result = vec4(mix(vec3(0.955, 0.965, 0.975), c, exp(-max(reach - 8.0, 0.0) / 8.0)), 1.0);
      return;
    }
    float s = dot(normalize(n), light);
    result = vec4(paint.rgb * (0.45 + 0.55 * (0.35 * abs(s) + 0.65 * max(s, 0.0))), kind == 3 ? 0.45 : paint.a);
  }`;

// Without a graphics card every sample is the processor's work: then pictures that move have one a pixel, and those
// that rest four, by twice the width and height.
const RESTS = 250;                                           // ms after the last change
const onProcessor = (() => {
  const gl = document.createElement("canvas").getContext("webgl2"), named = gl?.getExtension("WEBGL_debug_renderer_info");
  const found = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(gl?.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return found;
})();

function stage(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: !onProcessor, stencil: true, alpha: false });
  if (!gl) return null;
  const losing = gl.getExtension("WEBGL_lose_context");      // asked for now: a lost context gives none
  const gather = gatherer();
  let U = null, draws = 0, lost = false, scene = null, made = null;

  function prepare() {                                       // all that a lost context takes with it
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    const layout = [["corner", 3, gl.FLOAT], ["normal", 3, gl.FLOAT], ["colour", 4, gl.UNSIGNED_BYTE]];
    layout.forEach(([name], i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return false;
    gl.useProgram(program);
    U = Object.fromEntries(
      ["scene", "flat_", "light", "eye", "kind"].map((name) => [name, gl.getUniformLocation(program, name)]));
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    layout.forEach(([, n, type], i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, n, type, type !== gl.FLOAT, 4 * FLOATS, 12 * i);
    });
    made = null;
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    return true;
  }
  function bring(lists) {                                    // what is drawn in this frame, list by list
    const { corners, triangles, same } = gather(lists.flat());
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STREAM_DRAW);
    if (!same || !made) gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    let first = 0;
    made = lists.map((shapes) => {
      const count = shapes.reduce((sum, shape) => sum + MESHES[shape.mesh].triangles.length, 0), list = { first, count, shapes: shapes.length };
      first += count;
      return list;
    });
  }
  function all(from, to = from, kind = 0) {                  // the lists from one to another
    const lists = made.slice(from, to + 1), count = lists.reduce((sum, list) => sum + list.count, 0);
    gl.uniform1i(U.kind, kind);
    if (count) gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * lists[0].first);
    draws += lists.reduce((sum, list) => sum + list.shapes, 0);
  }
  function shadows(from, to) {                               // every pixel darkened once
    gl.uniform1i(U.flat_, 1);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    through(from, to, 1);
    gl.clear(gl.STENCIL_BUFFER_BIT);
    gl.disable(gl.STENCIL_TEST);
    gl.uniform1i(U.flat_, 0);
  }
  function through(from, to = from, kind = 0) {              // blended over what stands there
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    all(from, to, kind);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
  function occupant(list) {                                  // where something hides him he shines through
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    all(list);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.INCR, gl.INCR);
    gl.depthFunc(gl.GREATER);
    through(list, list, 3);
    gl.depthFunc(gl.LESS);
    gl.disable(gl.STENCIL_TEST);
  }
  function draw(run, ghosts, moves) {
    draws = 0;
    if (lost || gl.isContextLost()) return 0;
    const fine = Math.min(window.devicePixelRatio || 1, 2), ratio = !onProcessor ? fine : moves ? 1 : 2 * fine;
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const cam = camera(run, w / h), pixel = 2 * cam.reach * Math.tan(HALF_ANGLE) / h, [x, y] = subject(run).middle;
    const shapes = shapesOf(run, state.frame, onProcessor && moves ? .5 * pixel : 0);
    const ground = { mesh: "box", at: [x, y, -.01], q: [1, 0, 0, 0], size: [60, 60, .01], colour: [1, 1, 1, 1] };
    scene = matrix(cam, w / h);
    gl.viewport(0, 0, w, h);
    gl.clearColor(.955, .965, .975, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.uniformMatrix4fv(U.scene, false, scene);
    gl.uniform3fv(U.light, LIGHT);
    gl.uniform3fv(U.eye, cam.eye);
    const lists = [[ground], shapes.solid, shapes.occupant, [...ghosts, ...shapes.glass], shapes.chosen];
    if (onProcessor) for (const shape of lists.flat()) shape.mesh = fewer(shape.mesh, shape.size[0] / pixel);
    bring(lists);
    all(0, 0, 2);
    shadows(1, 2);
    all(1);
    occupant(2);
    through(3);
    gl.disable(gl.DEPTH_TEST);
    through(4);
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
