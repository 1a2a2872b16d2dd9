// The sphere of places around the object, by parallel projection; angles in degrees, polar from +z, azimuth from +x.

import { Labels } from "./labels.js";

const OBJECT = 0.5, GRAB = 26;
// matplotlib's cividis at twelve even places
const MAP = ["00224e", "013271", "2f426d", "48526c", "5e636f", "727374", "878478", "9d9576", "b6a96f", "cebc63", "e7d150", "fee838"]
  .map((hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));

export function colour(part) {
  const x = Math.min(Math.max(part, 0), 1) * (MAP.length - 1), i = Math.min(Math.floor(x), MAP.length - 2);
  return `rgb(${MAP[i].map((from, k) => Math.round(from + (x - i) * (MAP[i + 1][k] - from))).join(",")})`;
}

export function direction([polar, azimuth]) {
  const p = polar * Math.PI / 180, a = azimuth * Math.PI / 180;
  return [Math.sin(p) * Math.cos(a), Math.sin(p) * Math.sin(a), Math.cos(p)];
}

export function pose([x, y, z]) {
  const azimuth = Math.atan2(y, x) * 180 / Math.PI;
  return [Math.atan2(Math.hypot(x, y), z) * 180 / Math.PI, (azimuth + 360) % 360];
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// From light to dark: the best value is yellow, one ten times as large (or the worst, if that is less) dark blue.
export function range(values) {
  const known = values.filter((v) => v !== null && v > 0);
  if (!known.length) return null;
  const low = Math.min(...known);
  return { low, high: Math.max(Math.min(10 * low, Math.max(...known)), 1.001 * low) };
}

export class View {
  constructor(canvas, moved, chosen) {
    Object.assign(this, { canvas, moved, chosen, turn: -60, tilt: 32, scene: null, state: null, map: null, drag: null });
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.up(event));
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
  }

  // right, up and towards the viewer
  axes() {
    const t = this.turn * Math.PI / 180, e = this.tilt * Math.PI / 180;
    return [
      [-Math.sin(t), Math.cos(t), 0],
      [-Math.sin(e) * Math.cos(t), -Math.sin(e) * Math.sin(t), Math.cos(e)],
      [Math.cos(e) * Math.cos(t), Math.cos(e) * Math.sin(t), Math.sin(e)],
    ];
  }

  place(point, axes = this.axes()) {
    return [this.cx + this.scale * dot(point, axes[0]), this.cy - this.scale * dot(point, axes[1]), dot(point, axes[2])];
  }

  things() {
    return [{ which: -1, name: "camera", pose: this.state.sensor },
      ...this.state.lights.map((p, i) => ({ which: i, name: this.state.lights.length > 1 ? `lamp ${i + 1}` : "lamp", pose: p }))];
  }

  // whether something stands below the horizon: then all of the sphere has to be seen
  low() { return this.things().some(({ pose: [polar] }) => polar > 90); }

  // where a thing is drawn, in px of the page
  spot(which) {
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = this.place(direction(this.things().find((each) => each.which === which).pose));
    return [box.left + x, box.top + y];
  }

  down(event) {
    if (!this.state) return;
    const axes = this.axes(), [x, y] = [event.offsetX, event.offsetY];
    const near = this.things().map((each) => ({ each, at: this.place(direction(each.pose), axes) }))
      .map(({ each, at }) => ({ each, at, away: Math.hypot(at[0] - x, at[1] - y) }))
      .filter(({ away }) => away < GRAB).sort((a, b) => (b.at[2] > 0) - (a.at[2] > 0) || a.away - b.away)[0];
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.style.cursor = "grabbing";
    this.drag = near ? { which: near.each.which, front: near.at[2] >= 0, dx: near.at[0] - x, dy: near.at[1] - y, low: near.each.pose[0] > 90 } : { x, y };
    if (near) this.chosen(near.each.which);
  }

  move(event) {
    if (!this.drag) return;
    const [x, y] = [event.offsetX, event.offsetY];
    if (this.drag.which === undefined) {
      this.turn -= 0.5 * (x - this.drag.x);
      this.tilt = Math.min(Math.max(this.tilt + 0.5 * (y - this.drag.y), this.low() ? -90 : -10), 90);
      Object.assign(this.drag, { x, y });
      this.draw();
      return;
    }
    const axes = this.axes();
    let u = (x + this.drag.dx - this.cx) / this.scale, v = -(y + this.drag.dy - this.cy) / this.scale;
    const long = Math.hypot(u, v);
    if (long > 1) { u /= long; v /= long; }
    const w = Math.sqrt(Math.max(0, 1 - u * u - v * v)) * (this.drag.front ? 1 : -1);
    const to = pose([0, 1, 2].map((k) => u * axes[0][k] + v * axes[1][k] + w * axes[2][k]));
    this.moved(this.drag.which, [Math.min(to[0], this.drag.low ? 180 : 90), to[1]], false);
  }

  up() {
    if (this.drag && this.drag.which !== undefined) this.moved(this.drag.which, null, true);
    this.drag = null;
    this.canvas.style.cursor = "grab";
  }

  // Once a frame, however often it is asked for.
  draw() {
    if (!this.frame) this.frame = requestAnimationFrame(() => { this.frame = 0; this.paint(); });
  }

  paint() {
    const wide = this.canvas.parentElement.clientWidth - 26, ratio = window.devicePixelRatio || 1;
    if (!this.state || wide < 50) return;
    const high = Math.min(0.8 * wide, Math.max(280, window.innerHeight - 280));
    this.canvas.style.height = `${high}px`;
    this.canvas.width = wide * ratio;
    this.canvas.height = high * ratio;
    const low = this.low();
    Object.assign(this, { cx: wide / 2, cy: (low ? 0.5 : 0.6) * high, scale: Math.min(0.43 * wide, (low ? 0.44 : 0.54) * high) });
    const pen = this.canvas.getContext("2d"), axes = this.axes();
    pen.scale(ratio, ratio);
    this.labels = new Labels(pen, wide, high);
    this.patches(pen, axes, false);
    this.rings(pen, axes);
    this.object(pen, axes);
    this.patches(pen, axes, true);
    this.markers(pen, axes);
  }

  patches(pen, axes, front) {
    if (!this.map) return;
    const { borders, values } = this.map, limits = range(values);
    borders.forEach(([p0, p1, a0, a1], i) => {
      const middle = this.place(direction([(p0 + p1) / 2, (a0 + a1) / 2]), axes);
      if ((middle[2] > 0) !== front) return;
      const value = values[i];
      if (value === undefined) return;
      if (value === null && !front) return;
      if (value !== null) pen.fillStyle = colour(1 - Math.log(value / limits.low) / Math.log(limits.high / limits.low));
      pen.globalAlpha = front ? 1 : 0.4;
      pen.beginPath();
      if (front) {
        const squeeze = Math.max(middle[2], 0.25), size = 0.026 * this.scale;
        const [dx, dy] = [middle[0] - this.cx, middle[1] - this.cy];
        pen.ellipse(middle[0], middle[1], size, size * squeeze, Math.atan2(dy, dx) + Math.PI / 2, 0, 2 * Math.PI);
      } else {
        [[p0, a0], [p0, a1], [p1, a1], [p1, a0]].forEach((corner) => pen.lineTo(...this.place(direction(corner), axes).slice(0, 2)));
      }
      if (value !== null) pen.fill();
      else {
        pen.strokeStyle = "#9aa2ad";
        pen.lineWidth = 1;
        pen.stroke();
      }
    });
    pen.globalAlpha = 1;
  }

  rings(pen, axes) {
    pen.strokeStyle = "#c3cad3";
    pen.lineWidth = 1;
    pen.beginPath();
    for (let a = 0; a <= 360; a += 5) pen.lineTo(...this.place(direction([90, a]), axes).slice(0, 2));
    pen.stroke();
    for (let a = 0; a < 360; a += 90) {
      const [x, y] = this.place(direction([90, a]).map((v) => 1.07 * v), axes);
      this.labels.write(`${a}°`, [[x, y], [x, y - 6], [x, y + 6]], 11, { ink: "#5b6575" });
    }
  }

  object(pen, axes) {
    const { edges } = this.scene, lamp = direction(this.state.lights[0] || this.state.sensor);
    this.scene.solid.draw(pen, axes, lamp, [this.cx, this.cy], OBJECT * this.scale);
    for (const { name, ends } of edges) {
      pen.strokeStyle = name === this.limiting ? "#d1342b" : "#0b5cad";
      pen.lineWidth = name === this.limiting ? 3 : 2;
      pen.beginPath();
      ends.forEach((c) => pen.lineTo(...this.place(c.map((v) => OBJECT * v), axes).slice(0, 2)));
      pen.stroke();
    }
  }

  markers(pen, axes) {
    const middle = this.place([0, 0, 0], axes);
    for (const { which, name, pose: at } of this.things()) {
      const [x, y, z] = this.place(direction(at), axes), chosen = which === this.state.moving;
      pen.globalAlpha = z < 0 ? 0.55 : 1;
      pen.strokeStyle = which < 0 ? "#0b5cad" : "#c98a00";
      pen.lineWidth = chosen ? 2 : 1;
      pen.setLineDash([4, 4]);
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(middle[0], middle[1]);
      pen.stroke();
      pen.setLineDash([]);
      pen.lineWidth = chosen ? 4 : 2;
      pen.fillStyle = z < 0 ? "#fff" : which < 0 ? "#4d94db" : "#ffc83d";
      pen.strokeStyle = chosen ? "#111" : "#555";
      pen.beginPath();
      if (which < 0) pen.rect(x - 10, y - 8, 20, 16);
      else pen.arc(x, y, 10, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
      pen.globalAlpha = 1;
    }
    const spots = this.things().map((each) => ({ ...each, at: this.place(direction(each.pose), axes) }));
    spots.forEach(({ at: [x, y] }) => this.labels.keep(x - 11, y - 11, 22, 22));
    spots.forEach(({ which, name, at: [x, y, z] }) => {
      const text = `${name}${z < 0 ? " (behind)" : ""}`;
      this.labels.write(text, this.labels.beside(text, x, y, 11, 13), 13, { weight: which === this.state.moving ? 600 : 400 });
    });
  }
}
