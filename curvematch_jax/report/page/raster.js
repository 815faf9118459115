// Surfaces drawn in software, with a depth buffer: the same in every browser, with and without a graphics card.

const STEPS = 65535;
const LIGHT = [-0.35, 0.5, 0.79];
// Towards the viewer, in radii: curves lie on the surface that decimation has moved a little.
const LIFT = 0.03;
const surfaces = new Map();

// An object's surface, curves and feature points around the origin, or null where there is none.
function surfaceOf(j) {
  if (!surfaces.has(j)) surfaces.set(j, collection.surfaces[j] ? decoded(collection.surfaces[j]) : null);
  return surfaces.get(j);
}

function decoded(stored) {
  const centred = (text) => Float32Array.from(numbers(text, "u2"), (v) => (2 * v) / STEPS - 1);
  const vertices = centred(stored.vertices), curves = centred(stored.curves), points = centred(stored.points);
  const faces = Uint16Array.from(numbers(stored.faces, "u2"));
  let radius = 0.1;
  for (const positions of [vertices, curves, points])
    for (let k = 0; k < positions.length; k += 3)
      radius = Math.max(radius, Math.hypot(positions[k], positions[k + 1], positions[k + 2]));
  return {
    vertices, faces, curves, points, radius, normals: normalsOf(vertices, faces),
    part: bytes(stored.part), curvePart: bytes(stored.curvePart),
  };
}

function normalsOf(v, faces) {
  const normals = new Float32Array(v.length);
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [3 * faces[f], 3 * faces[f + 1], 3 * faces[f + 2]];
    const p = [0, 1, 2].map((k) => v[b + k] - v[a + k]), q = [0, 1, 2].map((k) => v[c + k] - v[a + k]);
    const n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    for (const corner of [a, b, c]) for (let k = 0; k < 3; k++) normals[corner + k] += n[k];
  }
  return normals;
}

// Positions (3n) as seen: right, down and towards the viewer, in pixels of a square of `size`.
function seen(positions, turn, scale, size) {
  const out = new Float32Array(positions.length);
  for (let k = 0; k < positions.length; k += 3) {
    const [x, y, z] = [positions[k], positions[k + 1], positions[k + 2]];
    out[k] = size / 2 + scale * (turn[0] * x + turn[1] * y + turn[2] * z);
    out[k + 1] = size / 2 - scale * (turn[3] * x + turn[4] * y + turn[5] * z);
    out[k + 2] = scale * (turn[6] * x + turn[7] * y + turn[8] * z);
  }
  return out;
}

// A drawing of `size` pixels a side: its image, and where the feature points are.
// tint(part) is [red, green, blue, strength]: of the colour of a part, and how much of it the surface has.
function drawn(surface, turn, zoom, size, tint) {
  const image = new ImageData(size, size), depth = new Float32Array(size * size).fill(-Infinity);
  const scale = (0.49 * size * zoom) / surface.radius;
  const tints = Array.from({ length: 256 }, (_, part) => tint(part === 255 ? -1 : part));
  fillFaces(surface, seen(surface.vertices, turn, scale, size), turn, size, tints, image.data, depth);
  strokeCurves(surface, seen(surface.curves, turn, scale, size), size, scale, tints, image.data, depth);
  const points = seen(surface.points, turn, scale, size), places = [];
  for (let k = 0; k < points.length; k += 3) {
    const [x, y] = [Math.round(points[k]), Math.round(points[k + 1])];
    const inside = x >= 0 && y >= 0 && x < size && y < size;
    const hidden = inside && depth[y * size + x] > points[k + 2] + 2 * LIFT * scale * surface.radius;
    places.push({ x: points[k], y: points[k + 1], z: points[k + 2], hidden });
  }
  return { image, places };
}

function fillFaces(surface, at, turn, size, tints, pixels, depth) {
  const shown = vertexColours(surface, turn, tints), { faces } = surface;
  for (let f = 0; f < faces.length; f += 3) fillTriangle(faces[f], faces[f + 1], faces[f + 2], at, shown, size, pixels, depth);
}

// Light falls from the viewer's side on both sides of a face, so that orientation does not matter.
function vertexColours(surface, turn, tints) {
  const { normals, part } = surface, out = new Float32Array(normals.length);
  for (let k = 0; k < normals.length; k += 3) {
    const [x, y, z] = [normals[k], normals[k + 1], normals[k + 2]], size = Math.hypot(x, y, z) || 1;
    const n = [0, 3, 6].map((r) => (turn[r] * x + turn[r + 1] * y + turn[r + 2] * z) / size);
    const facing = n[2] < 0 ? -1 : 1;
    const lit = 0.42 + 0.62 * Math.max(0, facing * (n[0] * LIGHT[0] + n[1] * LIGHT[1] + n[2] * LIGHT[2]));
    const tint = tints[part[k / 3]];
    for (let c = 0; c < 3; c++) out[k + c] = Math.min(255, lit * (244 + tint[3] * (tint[c] - 244)));
  }
  return out;
}

function fillTriangle(i, j, k, at, shown, size, pixels, depth) {
  const [ax, ay, bx, by, cx, cy] = [at[3 * i], at[3 * i + 1], at[3 * j], at[3 * j + 1], at[3 * k], at[3 * k + 1]];
  const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
  if (!area) return;
  const left = Math.max(0, Math.ceil(Math.min(ax, bx, cx))), right = Math.min(size - 1, Math.floor(Math.max(ax, bx, cx)));
  const top = Math.max(0, Math.ceil(Math.min(ay, by, cy))), bottom = Math.min(size - 1, Math.floor(Math.max(ay, by, cy)));
  const [az, bz, cz] = [at[3 * i + 2], at[3 * j + 2], at[3 * k + 2]];
  // Barycentric coordinates change by the same from pixel to pixel.
  const du = (by - cy) / area, dv = (cy - ay) / area;
  for (let y = top; y <= bottom; y++) {
    let u = ((bx - left) * (cy - y) - (by - y) * (cx - left)) / area, v = ((cx - left) * (ay - y) - (cy - y) * (ax - left)) / area;
    for (let x = left; x <= right; x++, u += du, v += dv) {
      const w = 1 - u - v;
      if (u < 0 || v < 0 || w < 0) continue;
      const z = u * az + v * bz + w * cz, p = y * size + x;
      if (z <= depth[p]) continue;
      depth[p] = z;
      for (let c = 0; c < 3; c++) pixels[4 * p + c] = u * shown[3 * i + c] + v * shown[3 * j + c] + w * shown[3 * k + c];
      pixels[4 * p + 3] = 255;
    }
  }
}

function strokeCurves(surface, at, size, scale, tints, pixels, depth) {
  const lift = LIFT * scale * surface.radius, width = size > 300 ? 2 : 1;
  for (let s = 0; s < surface.curvePart.length; s++) {
    const tint = tints[surface.curvePart[s]], a = 6 * s, b = a + 3;
    if (!tint[3]) continue;
    const steps = Math.max(1, Math.ceil(Math.max(Math.abs(at[b] - at[a]), Math.abs(at[b + 1] - at[a + 1]))));
    for (let t = 0; t <= steps; t++) {
      const [x, y, z] = [0, 1, 2].map((k) => at[a + k] + (t / steps) * (at[b + k] - at[a + k]));
      dot(Math.round(x), Math.round(y), z + lift, width, tint, size, pixels, depth);
    }
  }
}

function dot(x, y, z, width, tint, size, pixels, depth) {
  for (let row = y; row < y + width; row++) {
    for (let column = x; column < x + width; column++) {
      if (row < 0 || column < 0 || row >= size || column >= size || depth[row * size + column] > z) continue;
      for (let c = 0; c < 3; c++) pixels[4 * (row * size + column) + c] = 0.8 * tint[c];
      pixels[4 * (row * size + column) + 3] = 255;
    }
  }
}
