// The picture, with what it is measured from drawn over it. Image positions are px, (0, 0) the middle of the first pixel.

import { Labels } from "./labels.js";

const STATUS = { ok: "#27c26c", clutter: "#f2b01e", glanced: "#f4f4f4" }, RARE = "#ff5a4f";
const CHI2 = Math.sqrt(5.991); // of 95 % with two degrees of freedom
const NICE = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000];

export class Picture {
  constructor(canvas, caption) {
    Object.assign(this, { canvas, caption, shown: null, overlay: null, limiting: null, image: new Image(), units: "" });
    this.image.onload = () => this.draw();
  }

  show(picture, overlay, limiting) {
    this.shown = picture;
    if (overlay) Object.assign(this, { overlay, limiting });
    this.image.src = `data:image/png;base64,${picture.png}`;
  }

  draw() {
    if (!this.shown || !this.image.complete) return;
    const [left, top, width, height] = this.shown.window, ratio = window.devicePixelRatio || 1;
    const wide = this.canvas.clientWidth, high = Math.min(wide * height / width, 330), scale = Math.min(wide / width, high / height);
    this.canvas.style.height = `${high}px`;
    this.canvas.width = wide * ratio;
    this.canvas.height = high * ratio;
    const pen = this.canvas.getContext("2d"), dx = (wide - scale * width) / 2;
    pen.scale(ratio, ratio);
    pen.imageSmoothingEnabled = scale * width / this.image.width < 2;
    pen.drawImage(this.image, dx, 0, scale * width, scale * height);
    const at = ([x, y]) => [dx + (x + 0.5 - left) * scale, (y + 0.5 - top) * scale];
    this.labels = new Labels(pen, wide, high);
    if (this.overlay) this.over(pen, at, scale, this.labels);
  }

  over(pen, at, scale, labels) {
    // the one that limits is named first, so that it is sure to have its name
    const lines = [...this.overlay.lines].sort((a, b) => (b.name === this.limiting) - (a.name === this.limiting));
    for (const { name, status, points } of lines) {
      pen.strokeStyle = STATUS[status] || RARE;
      pen.lineWidth = name === this.limiting ? 3 : 1.3;
      pen.beginPath();
      points.forEach((point) => pen.lineTo(...at(point)));
      pen.stroke();
    }
    for (const { name, points } of lines) {
      const along = (part) => {
        const k = part * (points.length - 1), low = Math.floor(k), high = Math.ceil(k), [x, y] = at(points[low]), [u, v] = at(points[high]);
        return [x + (k - low) * (u - x), y + (k - low) * (v - y)];
      };
      const middles = [0.5, 0.35, 0.65, 0.2, 0.8].flatMap((part) => labels.beside(name, ...along(part), 4, 11));
      labels.write(name, middles, 11, { ink: "#fff", halo: "#000" });
    }
    const half = this.overlay.corners.map(({ covariance: c }) => axes(c)), most = Math.max(0, ...half.map(([a]) => a * CHI2 * scale));
    const factor = most ? NICE.filter((n) => n * most <= 26).pop() || 1 : 0;
    pen.strokeStyle = "#48b4ff";
    pen.lineWidth = 1.6;
    this.overlay.corners.forEach(({ at: place }, i) => {
      const [a, b, turn] = half[i], [x, y] = at(place), k = factor * CHI2 * scale;
      pen.beginPath();
      pen.ellipse(x, y, Math.max(k * a, 0.5), Math.max(k * b, 0.5), turn, 0, 2 * Math.PI);
      pen.stroke();
    });
    this.tell(factor);
  }

  tell(factor) {
    const kind = this.shown.kind === "preview" ? "Drawn from the model, without cast shadows" : "Rendered by Mitsuba";
    const ellipses = factor ? ` Blue: scatter of the points by noise (95 %), enlarged ${factor} times.` : "";
    const lines = this.overlay?.lines.some(({ status }) => status === "glanced") ? "White: edges not yet looked at closely" : "Edges: green ok, orange biased, red cannot be used";
    this.caption.textContent = `${kind}. ${lines}; thick: adds most to sigma.${ellipses}`;
  }
}

// half axes (1 sigma) and direction of the first, of a covariance
function axes([[xx, xy], [, yy]]) {
  const mean = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
  return [Math.sqrt(mean + half), Math.sqrt(Math.max(mean - half, 0)), 0.5 * Math.atan2(2 * xy, xx - yy)];
}
