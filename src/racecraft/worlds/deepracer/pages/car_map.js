/* The map: one opaque canvas, which covers what lies behind it, because a browser without a graphics card draws and
   blends with the processor that trains. The ground is drawn when it is laid out, what stands still on it with every
   tick, cars with every picture. */
import { token } from "racecraft.pages/tokens.js";
import { drove, pose, standing } from "racecraft.worlds.deepracer.pages/reel.js";

const TRAIL = 18, LONG_TRAIL = 75, FADES = 3, MARK = 22;   // ticks
const SHADES = 10;
const BODY = [[0.45, -0.12], [0.05, -0.33], [-0.6, -0.33], [-0.6, 0.33], [0.05, 0.33], [0.45, 0.12]];   // lengths, to the front and right
const WINDSCREEN = [[-0.12, -0.2], [0.04, -0.2], [0.04, 0.2], [-0.12, 0.2]];

export class CarMap {
  constructor(canvas) {
    this.canvas = canvas; this.pen = canvas.getContext("2d", { alpha: false, desynchronized: true });
    const beside = () => document.createElement("canvas").getContext("2d", { alpha: false });
    this.ground = beside(); this.still = beside();
    this.place = /** @type {any} */ (null); this.tick = /** @type {any[]} */ ([]);
  }

  /* Draw a circuit's ground into the width there is; false while there is none. */
  lay(track) {
    const { bounds: [x0, y0, x1, y1], colours, line_width } = track;
    const wide = this.canvas.parentElement.clientWidth, ratio = Math.min(2, devicePixelRatio || 1);
    this.place = null;
    if (!wide) return false;   // a page that is being laid out anew has no width for a moment
    const high = Math.round(Math.max(220, Math.min(wide * (y1 - y0) / (x1 - x0), innerHeight * 0.66, 720)));
    this.canvas.style.height = `${high}px`;
    for (const { canvas } of [this.ground, this.still, this.pen]) { canvas.width = wide * ratio; canvas.height = high * ratio; }
    const scale = Math.min(wide / (x1 - x0), high / (y1 - y0)) * ratio;
    const left = (this.canvas.width - (x1 - x0) * scale) / 2, top = (this.canvas.height - (y1 - y0) * scale) / 2;
    this.place = { scale, ratio, wide, x: x => left + (x - x0) * scale, y: y => top + (y1 - y) * scale };
    this.shades = plasma(SHADES);
    this.drawGround(track, colours, line_width);
    return true;
  }

  drawGround(track, colours, lineWidth) {
    const { scale, ratio } = this.place, ink = this.ground;
    const ring = (rows, path = new Path2D()) => {
      rows.forEach(([x, y], k) => path[k ? "lineTo" : "moveTo"](this.place.x(x), this.place.y(y)));
      return path;
    };
    ink.fillStyle = colours.field; ink.fillRect(0, 0, this.canvas.width, this.canvas.height);
    const road = track.closed ? ring(track.inner, ring(track.outer)) : ring([...track.outer, ...[...track.inner].reverse()]);
    ink.fillStyle = colours.road; ink.fill(road, "evenodd");
    ink.lineJoin = "round"; ink.lineWidth = Math.max(1.5 * ratio, lineWidth * scale * 0.8); ink.strokeStyle = colours.line;
    ink.stroke(ring(track.outer)); ink.stroke(ring(track.inner));
    ink.lineWidth = Math.max(1, 0.02 * scale); ink.strokeStyle = colours.dash;
    ink.setLineDash([0.1 * scale, 0.1 * scale]); ink.stroke(ring(track.centre)); ink.setLineDash([]);
    ink.strokeStyle = token("--map-ink"); ink.lineWidth = Math.max(2 * ratio, 0.06 * scale); ink.stroke(ring(startLine(track)));
  }

  /* Draw a moment: `cars` of the reel that are on this circuit, `chosen` among them, `whole` to keep its whole way. */
  draw(reel, head, cars, chosen, kinds, whole) {
    const others = cars.filter(car => car !== chosen), now = Math.floor(head);
    const tick = [reel, now, chosen, whole, this.place, others.length];
    if (tick.some((one, k) => one !== this.tick[k])) { this.drawTick(reel, now, others, chosen, kinds, whole); this.tick = tick; }
    this.pen.drawImage(this.still.canvas, 0, 0);
    for (const car of others) this.body(pose(car, head), 9, 0.2, "--map-other", "--map-edge", 1.2);
    const at = chosen && pose(chosen, head);
    if (at) { this.body(at, 13, 0.28, "--map-chosen", "--map-ink", 2.2); this.label(chosen.name, at); }
  }

  drawTick(reel, now, others, chosen, kinds, whole) {   // what stands still until the next: ways, marks and objects
    const { place } = this, thick = Math.max(2 * place.ratio, 0.035 * place.scale);
    this.still.drawImage(this.ground.canvas, 0, 0);
    this.trails(others, now, thick);
    if (chosen) this.shadedTrail(chosen, whole ? 0 : now - LONG_TRAIL, now, 1.6 * thick, reel.top);
    for (const end of reel.endings) {
      const car = reel.cars[end.car];
      if (end.tick <= now && now - end.tick < MARK && (car === chosen || others.includes(car))) this.mark(reel, end, now);
    }
    standing(reel, chosen, now).forEach((where, k) => this.object(where, kinds[k]));
  }

  trails(cars, now, width) {   // three steps of fading, a path each
    const pen = this.still, step = TRAIL / FADES;
    pen.lineWidth = width; pen.lineCap = "butt"; pen.strokeStyle = token("--map-other");
    for (let fade = 0; fade < FADES; fade++) {
      pen.beginPath();
      for (const car of cars) this.way(car, now - (fade + 1) * step, now - fade * step);
      pen.globalAlpha = 0.5 * (1 - fade / FADES);
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  shadedTrail(car, from, to, width, top) {   // slow is violet, fast is yellow, as on our other pictures
    const { still: pen, place } = this, paths = [];
    for (let i = Math.max(0, from); i < to; i++) {
      if (!drove(car, i)) continue;
      const shade = Math.min(SHADES - 1, Math.floor(SHADES * Math.min(1, Math.max(0, car.speed[i] / top))));
      const path = paths[shade] ??= new Path2D();
      path.moveTo(place.x(car.x[i]), place.y(car.y[i])); path.lineTo(place.x(car.x[i + 1]), place.y(car.y[i + 1]));
    }
    pen.lineWidth = width;
    paths.forEach((path, shade) => { pen.strokeStyle = this.shades[shade]; pen.stroke(path); });
  }

  way(car, from, to) {   // of every second tick: half the work, and no eye sees it
    const { still: pen, place } = this;
    let down = false;
    for (let i = Math.max(0, from); i < to; i++) {
      const goesOn = drove(car, i);
      if (goesOn && !down) pen.moveTo(place.x(car.x[i]), place.y(car.y[i]));
      if (goesOn && (car.tick[i + 1] % 2 === 0 || i + 1 === to || !drove(car, i + 1)))
        pen.lineTo(place.x(car.x[i + 1]), place.y(car.y[i + 1]));
      down = goesOn;
    }
  }

  body(at, least, metres, fill, edge, width) {   // with a nose, so that one sees where it goes; small paths are cheap to fill
    if (!at) return;
    const { pen, place } = this, long = Math.max(least * place.ratio, metres * place.scale);
    const [x, y, yaw] = at, c = Math.cos(yaw) * long, s = Math.sin(yaw) * long, px = place.x(x), py = place.y(y);
    const shape = points => {
      pen.beginPath();
      points.forEach(([u, v], k) => pen[k ? "lineTo" : "moveTo"](px + u * c + v * s, py - u * s + v * c));
      pen.closePath();
    };
    shape(BODY);
    pen.fillStyle = token(fill); pen.fill();
    pen.lineWidth = width * place.ratio; pen.strokeStyle = token(edge); pen.stroke();
    shape(WINDSCREEN);
    pen.fillStyle = token("--map-edge"); pen.fill();
  }

  object([x, y, yaw], kind) {   // a box is square-edged, a bot has a nose; both in their own size
    if (!kind) return;
    const { still: pen, place } = this;
    const long = Math.max(7 * place.ratio, kind.length * place.scale), wide = Math.max(5 * place.ratio, kind.width * place.scale);
    pen.save(); pen.translate(place.x(x), place.y(y)); pen.rotate(-yaw);
    pen.beginPath(); pen.moveTo(-long / 2, -wide / 2);
    if (kind.kind === "bot_car") { pen.lineTo(long / 5, -wide / 2); pen.lineTo(long / 2, 0); pen.lineTo(long / 5, wide / 2); }
    else { pen.lineTo(long / 2, -wide / 2); pen.lineTo(long / 2, wide / 2); }
    pen.lineTo(-long / 2, wide / 2); pen.closePath();
    pen.fillStyle = kind.colour; pen.fill(); pen.lineWidth = 1.4 * place.ratio; pen.strokeStyle = token("--map-ink"); pen.stroke();
    pen.restore();
  }

  /** @param {string} text @param {number[]} pose */
  label(text, [x, y]) {
    const { pen, place } = this, long = Math.max(13 * place.ratio, 0.28 * place.scale);
    const px = place.x(x), py = place.y(y) - 0.9 * long - 7 * place.ratio;
    pen.font = `600 ${12.5 * place.ratio}px ${token("--text")}`; pen.textAlign = "center"; pen.textBaseline = "middle";
    pen.lineWidth = 3.5 * place.ratio; pen.strokeStyle = token("--map-edge"); pen.strokeText(text, px, py);
    pen.fillStyle = token("--map-ink"); pen.fillText(text, px, py);
  }

  mark(reel, end, now) {   // a tick for a lap, a cross for what went wrong: told by shape, not by colour alone
    const { still: pen, place } = this, car = reel.cars[end.car], good = end.status === "lap_complete";
    const r = 8 * place.ratio, x = place.x(car.x[end.tick]), y = place.y(car.y[end.tick]);
    pen.globalAlpha = 1 - (now - end.tick) / MARK;
    pen.beginPath(); pen.arc(x, y, r, 0, 7); pen.fillStyle = token(good ? "--map-good" : "--map-bad"); pen.fill();
    pen.lineWidth = 2.4 * place.ratio; pen.strokeStyle = token("--map-ink"); pen.beginPath();
    if (good) { pen.moveTo(x - .45 * r, y); pen.lineTo(x - .1 * r, y + .4 * r); pen.lineTo(x + .5 * r, y - .4 * r); }
    else { pen.moveTo(x - .4 * r, y - .4 * r); pen.lineTo(x + .4 * r, y + .4 * r); pen.moveTo(x + .4 * r, y - .4 * r); pen.lineTo(x - .4 * r, y + .4 * r); }
    pen.stroke(); pen.globalAlpha = 1;
  }

  /* The car nearest to a place on the canvas in CSS pixels, within 40 of them; undefined where there is none. */
  nearest(x, y, cars, head) {
    const { place } = this, far = at => Math.hypot(place.x(at[0]) - x * place.ratio, place.y(at[1]) - y * place.ratio);
    const found = cars.map(car => [pose(car, head), car]).filter(([at]) => at && far(at) < 40 * place.ratio);
    return found.sort((a, b) => far(a[0]) - far(b[0]))[0]?.[1];
  }
}

function startLine({ centre, inner, outer }) {   // across the road: first rows of some of AWS's files pair their borders askew
  const [x, y] = centre[0], [u, v] = centre.find(([u, v]) => Math.hypot(u - x, v - y) > 0.01), long = Math.hypot(u - x, v - y);
  const reach = border => Math.min(...border.map(([u, v]) => Math.hypot(u - x, v - y)));
  const half = (reach(inner) + reach(outer)) / 2, across = [(y - v) / long * half, (u - x) / long * half];
  return [[x + across[0], y + across[1]], [x - across[0], y - across[1]]];
}

function plasma(count) {   // between the five tokens; the darkest is left out, it would not be seen on a road
  const stops = [1, 2, 3, 4, 5].map(k => token(`--value-${k}`).slice(1).match(/../g).map(pair => parseInt(pair, 16)));
  return Array.from({ length: count }, (_, n) => {
    const s = 0.7 + 3.3 * n / (count - 1), k = Math.min(3, Math.floor(s));
    return `rgb(${stops[k].map((level, c) => Math.round(level + (s - k) * (stops[k + 1][c] - level))).join()})`;
  });
}
