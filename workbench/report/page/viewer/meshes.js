// ---- the forms that are drawn ---------------------------------------------------------------------------------
// A corner is (normal, corner) in the axes of its shape: points of a capsule are normal * radius + corner *
// (0, 0, half length), all others corner * size.
const PIECES = 7;                                            // of a retractor
function capsule(rings = 6, sides = 16, pieces = [[-1, 1]]) {  // pieces: where they begin and end, from -1 to 1
  const corners = [], triangles = [];
  for (const ends of pieces) {
    const first = corners.length / 6, rows = 2 * rings + 2;
    for (let i = 0; i < rows; i++) {
      const angle = (i > rings ? i - rings - 1 : i - rings) * Math.PI / 2 / rings, c = Math.cos(angle);
      for (let j = 0; j < sides; j++) {
        const a = 2 * Math.PI * j / sides;
        corners.push(c * Math.cos(a), c * Math.sin(a), Math.sin(angle), 0, 0, ends[i > rings ? 1 : 0]);
      }
    }
    for (let i = 0; i < rows - 1; i++) for (let j = 0; j < sides; j++) {
      const [a, b, c, d] = [[i, j], [i, j + 1], [i + 1, j + 1], [i + 1, j]].map(([r, k]) => first + r * sides + k % sides);
      if (i > 0) triangles.push(a, b, c);                    // at a pole the other half of a square is nothing
      if (i < rows - 2) triangles.push(a, c, d);
    }
  }
  return { corners: new Float32Array(corners), triangles };
}
function faceted(vertices, faces) {                          // flat faces, cut into triangles from their first corner
  const corners = [], triangles = [];
  for (const face of faces) {
    const [a, b, c] = face.map((i) => vertices[i]), n = unit(cross(add(b, a, -1), add(c, a, -1))), first = corners.length / 6;
    for (const i of face) corners.push(...n, ...vertices[i]);
    for (let k = 2; k < face.length; k++) triangles.push(first, first + k - 1, first + k);
  }
  return { corners: new Float32Array(corners), triangles };
}
function box() {
  const vertices = Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((k) => i >> k & 1 ? 1 : -1));
  return faceted(vertices, [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]);
}
function cone(sides = 12) {
  const rim = Array.from({ length: sides }, (_, j) => [Math.cos(2 * Math.PI * j / sides), Math.sin(2 * Math.PI * j / sides), 0]);
  const faces = rim.flatMap((_, j) => [[j, (j + 1) % sides, sides], [(j + 1) % sides, j, sides + 1]]);
  return faceted([...rim, [0, 0, 1], [0, 0, 0]], faces);
}
const dashes = (reach) => capsule(1, 6, Array.from({ length: PIECES }, (_, i) => [2 * i / PIECES - 1, 2 * (i + reach) / PIECES - 1]));
// a rod is thin, and there are hundreds of them: it has a tenth of the corners of a capsule
const MESHES = {
  capsule: capsule(), rod: capsule(1, 6), bag: capsule(3, 12), box: box(), cone: cone(), slack: dashes(.55), firing: dashes(.8),
  medium: capsule(3, 10), small: capsule(2, 8),
};
// of a capsule or bag by its radius in pixels: its outline errs by no more than 0.6 of one
const fewer = (mesh, r) => mesh !== "capsule" && mesh !== "bag" || r > 12 ? mesh : r < 8 ? "small" : mesh === "bag" ? mesh : "medium";
(data.meshes || []).forEach((mesh, k) => { MESHES[k] = faceted(mesh.vertices, mesh.triangles); });

// ---- the corners of all shapes of a picture, where they stand ---------------------------------------------------
// Few shapes have many corners, and many shapes few: moved here and drawn at once they cost less than apart.
const FLOATS = 7;                                            // of a corner: place, normal, colour in four bytes
function put(shape, out, paint, k) {                         // from the k-th corner on; returns how many
  const { corners } = MESHES[shape.mesh], [w, x, y, z] = shape.q, [ax, ay, az] = shape.at, { size } = shape;
  const xx = 1 - 2 * (y * y + z * z), xy = 2 * (x * y - w * z), xz = 2 * (x * z + w * y);
  const yx = 2 * (x * y + w * z), yy = 1 - 2 * (x * x + z * z), yz = 2 * (y * z - w * x);
  const zx = 2 * (x * z - w * y), zy = 2 * (y * z + w * x), zz = 1 - 2 * (x * x + y * y);
  const [r, sx, sy, sz] = size[2] < 0 ? [size[0], 0, 0, size[1]] : [0, ...size];
  const [red, green, blue, alpha] = shape.colour.map((c) => Math.round(255 * c));
  const colour = red | green << 8 | blue << 16 | alpha << 24;
  let o = FLOATS * k;
  for (let i = 0; i < corners.length; i += 6, o += FLOATS) {
    const a = corners[i], b = corners[i + 1], c = corners[i + 2];
    const px = r * a + sx * corners[i + 3], py = r * b + sy * corners[i + 4], pz = r * c + sz * corners[i + 5];
    out[o] = ax + xx * px + xy * py + xz * pz;
    out[o + 1] = ay + yx * px + yy * py + yz * pz;
    out[o + 2] = az + zx * px + zy * py + zz * pz;
    out[o + 3] = xx * a + xy * b + xz * c;
    out[o + 4] = yx * a + yy * b + yz * c;
    out[o + 5] = zx * a + zy * b + zz * c;
    paint[o + 6] = colour;
  }
  return corners.length / 6;
}
function gatherer() {                                        // keeps its memory, and triangles while the forms stay
  let out = new Float32Array(0), paint = null, triangles = null, forms = [];
  return (shapes) => {
    const total = shapes.reduce((sum, shape) => sum + MESHES[shape.mesh].corners.length / 6, 0);
    if (out.length < FLOATS * total) {
      out = new Float32Array(2 * FLOATS * total);
      paint = new Uint32Array(out.buffer);
    }
    let k = 0;
    for (const shape of shapes) k += put(shape, out, paint, k);
    const same = shapes.length === forms.length && shapes.every((shape, i) => shape.mesh === forms[i]);
    if (!same) {
      forms = shapes.map((shape) => shape.mesh);
      triangles = new Uint32Array(forms.reduce((sum, mesh) => sum + MESHES[mesh].triangles.length, 0));
      let at = 0, first = 0;
      for (const mesh of forms) {
        for (const i of MESHES[mesh].triangles) triangles[at++] = first + i;
        first += MESHES[mesh].corners.length / 6;
      }
    }
    return { corners: out.subarray(0, FLOATS * total), triangles, same };
  };
}
