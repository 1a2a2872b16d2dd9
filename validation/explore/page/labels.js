// Names beside what they name, none on another: of several places the first that is free is taken.

const HALO = "#fff", INK = "#111";

export class Labels {
  constructor(pen, wide, high) {
    Object.assign(this, { pen, wide, high, taken: [] });
  }

  // Keep a box free: its least x and y, width and height.
  keep(x, y, width, height, name = "") {
    this.taken.push({ name, x, y, width, height });
  }

  free(box) {
    return box.x >= 0 && box.y >= 0 && box.x + box.width <= this.wide && box.y + box.height <= this.high
      && this.taken.every((other) => box.x >= other.x + other.width || other.x >= box.x + box.width
        || box.y >= other.y + other.height || other.y >= box.y + box.height);
  }

  // Write a name at the first free one of some middles; whether there was one.
  write(name, middles, size, { ink = INK, halo = HALO, weight = 400 } = {}) {
    const { pen } = this;
    pen.font = `${weight} ${size}px system-ui`;
    const width = pen.measureText(name).width + 2, height = 1.25 * size;
    for (const [x, y] of middles) {
      const box = { name, x: x - width / 2, y: y - height / 2, width, height };
      if (!this.free(box)) continue;
      this.taken.push(box);
      Object.assign(pen, { lineWidth: 3, strokeStyle: halo, fillStyle: ink, textAlign: "center", textBaseline: "middle" });
      pen.strokeText(name, x, y);
      pen.fillText(name, x, y);
      Object.assign(pen, { textAlign: "start", textBaseline: "alphabetic" });
      return true;
    }
    return false;
  }

  // Middles of a name of that size beside a thing of that radius: right, left, above, below, and farther away.
  beside(name, x, y, radius, size) {
    this.pen.font = `600 ${size}px system-ui`;
    const half = this.pen.measureText(name).width / 2 + 3, tall = 0.7 * size;
    return [0, 12, 26, 44].flatMap((far) => [
      [x + radius + half + far, y], [x - radius - half - far, y], [x, y - radius - tall - far], [x, y + radius + tall + far],
    ]);
  }
}
