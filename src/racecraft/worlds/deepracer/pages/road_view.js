/* The road from behind the car, drawn from poses: flat ground through a pinhole camera. One path a colour, because a
   browser without a graphics card draws with the processor. Lengths in metres. */
import { token } from "racecraft.pages/tokens.js";

const BEHIND = 0.62, ABOVE = 0.38, PITCH = 0.3, NEAR = 0.06, FAR = 14, WIDE = 1.15;   // of the camera; rad; WIDE: focal length in half widths
const CAR = { long: 0.16, wide: 0.09, high: 0.11 };   // half length, half width, height

export class RoadView {
  constructor(canvas, track) {
    this.canvas = canvas; this.track = track;
    this.pen = canvas.getContext("2d", { alpha: false, desynchronized: true });
    const width = Math.max(0.03, track.line_width);
    this.road = strips(track.inner, track.outer);
    this.lines = [...strips(track.inner, beside(track.inner, track.centre, width)), ...strips(track.outer, beside(track.outer, track.centre, width))];
    this.dashes = dashes(track.centre, 0.02);
    this.start = startLine(track);
    this.fit();
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  fit() {
    const ratio = Math.min(1.5, devicePixelRatio || 1);
    this.canvas.width = Math.max(1, this.canvas.clientWidth * ratio);
    this.canvas.height = Math.max(1, this.canvas.clientHeight * ratio);
  }

  draw([x, y, yaw], steering, ghost) {
    const { pen, canvas: { width, height }, track: { colours } } = this;
    const eye = { x: x - BEHIND * Math.cos(yaw), y: y - BEHIND * Math.sin(yaw), c: Math.cos(yaw), s: Math.sin(yaw) };
    this.eye = eye; this.focal = WIDE * Math.min(width, height * 1.5) / 2;
    const horizon = Math.max(0, height / 2 - this.focal * Math.tan(PITCH));
    pen.fillStyle = token("--blue-soft"); pen.fillRect(0, 0, width, horizon);
    pen.fillStyle = colours.field; pen.fillRect(0, horizon, width, height - horizon);
    this.fill(this.road, colours.road);
    this.fill(this.dashes, colours.dash);
    this.fill(this.lines, colours.line);
    this.fill(this.start, token("--map-ink"));
    if (ghost) this.car(ghost, 0, token("--map-other"), 0.55);
    this.car([x, y, yaw], steering, token("--map-chosen"), 1);
  }

  /** Where a point is seen: pixels; `deep` is its distance along the view. @param {number[]} point */
  see([x, y], high = 0) {
    const { eye, canvas } = this, u = x - eye.x, v = y - eye.y;
    const ahead = u * eye.c + v * eye.s, left = v * eye.c - u * eye.s, down = ABOVE - high;
    const deep = ahead * Math.cos(PITCH) + down * Math.sin(PITCH), low = down * Math.cos(PITCH) - ahead * Math.sin(PITCH);
    return { left, low, deep, x: canvas.width / 2 - this.focal * left / deep, y: canvas.height / 2 + this.focal * low / deep };
  }

  /* Fill convex pieces of ground of one colour; what lies behind the eye is cut off. */
  fill(pieces, colour) {
    const { pen, eye } = this;
    pen.beginPath();
    for (const piece of pieces) {
      if (Math.abs(piece[0][0] - eye.x) > FAR || Math.abs(piece[0][1] - eye.y) > FAR) continue;
      this.trace(cut(piece.map(point => this.see(point)), this));
    }
    pen.fillStyle = colour; pen.fill();
  }

  trace(points) {
    const { pen } = this;
    points.forEach((point, k) => pen[k ? "lineTo" : "moveTo"](point.x, point.y));
    if (points.length) pen.closePath();
  }

  car([x, y, yaw], steering, colour, alpha) {   // a box with a cabin and front wheels that turn
    const { pen } = this, c = Math.cos(yaw), s = Math.sin(yaw);
    const at = (u, v) => [x + u * c - v * s, y + u * s + v * c];
    if (this.see([x, y]).deep < NEAR * 2) return;
    const face = (corners, fill) => {
      pen.beginPath(); this.trace(corners.map(([u, v, high]) => this.see(at(u, v), high)));
      pen.fillStyle = fill; pen.fill(); pen.strokeStyle = token("--map-edge"); pen.lineWidth = 1; pen.stroke();
    };
    const { long, wide, high } = CAR, mid = 0.06, dark = token("--map-edge");
    pen.globalAlpha = alpha;
    for (const [u, v, turn] of [[0.1, wide, steering], [0.1, -wide, steering], [-0.1, wide, 0], [-0.1, -wide, 0]].map(([u, v, turn]) => [u, 1.12 * v, turn])) {
      const a = 0.035 * Math.cos(turn), b = 0.035 * Math.sin(turn);
      face([[u - a, v - b, 0], [u + a, v + b, 0], [u + a, v + b, 0.05], [u - a, v - b, 0.05]], dark);
    }
    face([[-long, -wide, 0.02], [-long, wide, 0.02], [-long, wide, mid], [-long, -wide, mid]], colour);
    face([[-long, -wide, mid], [-long, wide, mid], [long, wide, mid], [long, -wide, mid]], colour);
    face([[-0.1, -wide * 0.8, mid], [-0.1, wide * 0.8, mid], [-0.06, wide * 0.7, high], [-0.06, -wide * 0.7, high]], dark);
    face([[-0.06, -wide * 0.7, high], [-0.06, wide * 0.7, high], [0.03, wide * 0.7, high], [0.03, -wide * 0.7, high]], colour);
    pen.globalAlpha = 1;
  }
}

function cut(points, view) {   // at the near plane (Sutherland and Hodgman)
  if (points.every(point => point.deep >= NEAR)) return points;
  const kept = [];
  points.forEach((here, k) => {
    const next = points[(k + 1) % points.length];
    if (here.deep >= NEAR) kept.push(here);
    if ((here.deep >= NEAR) !== (next.deep >= NEAR)) {
      const t = (NEAR - here.deep) / (next.deep - here.deep), left = here.left + t * (next.left - here.left), low = here.low + t * (next.low - here.low);
      kept.push({ deep: NEAR, x: view.canvas.width / 2 - view.focal * left / NEAR, y: view.canvas.height / 2 + view.focal * low / NEAR });
    }
  });
  return kept;
}

function strips(one, other) {   // between two lines, row by row, all turned the same way round
  const pieces = [];
  for (let k = 0; k + 1 < one.length; k++) pieces.push(turned([one[k], one[k + 1], other[k + 1], other[k]]));
  return pieces;
}

function turned(piece) {
  let area = 0;
  piece.forEach(([x, y], k) => { const [u, v] = piece[(k + 1) % piece.length]; area += x * v - u * y; });
  return area < 0 ? piece.reverse() : piece;
}

const beside = (line, centre, width) => line.map(([x, y], k) => {   // so far towards the centre line
  const [u, v] = centre[k], long = Math.hypot(u - x, v - y) || 1;
  return [x + (u - x) / long * width, y + (v - y) / long * width];
});

function dashes(line, half) {
  const pieces = [];
  let way = 0;
  for (let k = 0; k + 1 < line.length; k++) {
    const [x, y] = line[k], [u, v] = line[k + 1], long = Math.hypot(u - x, v - y);
    if (!long) continue;
    const a = -(v - y) / long * half, b = (u - x) / long * half;
    if (Math.floor(way / 0.15) % 2 === 0) pieces.push(turned([[x - a, y - b], [u - a, v - b], [u + a, v + b], [x + a, y + b]]));
    way += long;
  }
  return pieces;
}

function startLine({ inner, outer, centre }) {
  const [x, y] = centre[0], [u, v] = centre.find(([u, v]) => Math.hypot(u - x, v - y) > 0.01), long = Math.hypot(u - x, v - y);
  const a = (u - x) / long * 0.06, b = (v - y) / long * 0.06, [[p, q], [r, s]] = [inner[0], outer[0]];
  return [turned([[p, q], [r, s], [r + a, s + b], [p + a, q + b]])];
}
