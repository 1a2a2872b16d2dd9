// The part, shaded: which triangle is seen at each pixel is found once for each view, so that moving a lamp costs the same
// however many triangles there are.

const FINE = 2, MOST = 1400; // pixels of its image over those of the page, and at most, each way
const dot = (a, at, b) => a[at] * b[0] + a[at + 1] * b[1] + a[at + 2] * b[2];

function unpacked(text, Kind) {
  const read = atob(text), bytes = new Uint8Array(read.length);
  for (let i = 0; i < read.length; i += 1) bytes[i] = read.charCodeAt(i);
  return new Kind(bytes.buffer);
}

export class Solid {
  // corners: three places of three numbers for each triangle, in steps; one normal each
  constructor({ corners, step, normals }) {
    Object.assign(this, { corners: unpacked(corners, Int16Array), step, normals: unpacked(normals, Int8Array), canvas: document.createElement("canvas") });
    this.count = this.normals.length / 3;
    const { corners: c } = this;
    this.reach = 0;
    for (let i = 0; i < c.length; i += 3) this.reach = Math.max(this.reach, step * Math.hypot(c[i], c[i + 1], c[i + 2]));
  }

  // Draw it about a place of the page, its unit so many px long.
  draw(pen, axes, lamp, [x, y], unit) {
    const half = unit * this.reach, ratio = window.devicePixelRatio || 1, side = Math.max(1, Math.min(MOST, Math.round(2 * half * FINE * ratio)));
    const view = `${axes} ${side}`, whole = `${view} ${lamp}`;
    if (this.whole !== whole) {
      if (this.view !== view) this.ids = this.seen(axes, side);
      this.shade(lamp, side);
      Object.assign(this, { view, whole });
    }
    pen.imageSmoothingQuality = "high";
    pen.drawImage(this.canvas, x - half, y - half, 2 * half, 2 * half);
  }

  // Numbers of the nearest triangles, -1 beside the part, of side x side pixels.
  seen(axes, side) {
    const { corners, normals } = this, ids = new Int32Array(side * side).fill(-1), near = new Float32Array(side * side).fill(-Infinity);
    const scale = this.step * side / 2 / this.reach, x = [0, 0, 0], y = [0, 0, 0], z = [0, 0, 0];
    for (let t = 0; t < this.count; t += 1) {
      if (dot(normals, 3 * t, axes[2]) <= 0) continue;
      for (let k = 0; k < 3; k += 1) {
        const at = 9 * t + 3 * k;
        x[k] = side / 2 + scale * dot(corners, at, axes[0]);
        y[k] = side / 2 - scale * dot(corners, at, axes[1]);
        z[k] = scale * dot(corners, at, axes[2]);
      }
      fill(ids, near, side, t, x, y, z);
    }
    return ids;
  }

  shade(lamp, side) {
    const { canvas, ids, normals } = this, greys = new Uint32Array(this.count);
    for (let t = 0; t < this.count; t += 1) {
      greys[t] = 0xff000000 | Math.round(95 + 145 * Math.max(0, dot(normals, 3 * t, lamp) / 127)) * 0x010101;
    }
    Object.assign(canvas, { width: side, height: side });
    const pen = canvas.getContext("2d"), image = pen.createImageData(side, side), pixels = new Uint32Array(image.data.buffer);
    for (let p = 0; p < pixels.length; p += 1) if (ids[p] >= 0) pixels[p] = greys[ids[p]];
    pen.putImageData(image, 0, 0);
  }
}

// The pixels whose middles lie in a triangle, where it is the nearest so far.
function fill(ids, near, side, t, x, y, z) {
  const ax = x[1] - x[0], ay = y[1] - y[0], bx = x[2] - x[0], by = y[2] - y[0], area = ax * by - ay * bx;
  if (!area) return;
  const left = Math.max(0, Math.ceil(Math.min(x[0], x[1], x[2]) - 0.5)), right = Math.min(side - 1, Math.floor(Math.max(x[0], x[1], x[2]) - 0.5));
  const top = Math.max(0, Math.ceil(Math.min(y[0], y[1], y[2]) - 0.5)), bottom = Math.min(side - 1, Math.floor(Math.max(y[0], y[1], y[2]) - 0.5));
  for (let row = top; row <= bottom; row += 1) {
    for (let column = left; column <= right; column += 1) {
      const u = column + 0.5 - x[0], v = row + 0.5 - y[0], one = (u * by - v * bx) / area, two = (v * ax - u * ay) / area;
      if (one < -1e-6 || two < -1e-6 || one + two > 1 + 1e-6) continue;
      const depth = z[0] + one * (z[1] - z[0]) + two * (z[2] - z[0]), at = row * side + column;
      if (depth > near[at]) {
        near[at] = depth;
        ids[at] = t;
      }
    }
  }
}
