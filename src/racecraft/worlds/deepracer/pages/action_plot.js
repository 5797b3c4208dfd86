/* The table of actions as points that are dragged or moved by keys; the lines of the form stay in step.

   Point k is line k of the text that holds an action; other lines stay as they are. */
import { t } from "racecraft.pages/texts.js";

const SVG = "http://www.w3.org/2000/svg", MOST_ANGLE = 30, LEAST_SPEED = 0.1, MOST_SPEED = 4;
const PX_PER_MPS = 50, WIDENED = 2;   // an angle is drawn twice as wide as it is, so that 30° fill the plot
const lines = /** @type {HTMLTextAreaElement} */ (document.getElementById("actions"));
const plot = /** @type {SVGSVGElement} */ (/** @type {unknown} */ (document.getElementById("polar")));
const back = document.createElementNS(SVG, "g"), front = document.createElementNS(SVG, "g");

/** @param {string} line @returns {[number, number] | null} degrees, m/s */
function readLine(line) {
  const [angle, speed] = line.split(/[,;]/).map(word => word.trim() ? Number(word) : NaN);
  return Number.isFinite(angle) && Number.isFinite(speed) ? [angle, speed] : null;
}
const clip = (value, least, most) => Math.min(Math.max(value, least), most);
const at = (angle, speed) => { const turn = angle * WIDENED * Math.PI / 180, far = speed * PX_PER_MPS; return [-far * Math.sin(turn), -far * Math.cos(turn)]; };
const told = (angle, speed) => t("{angle}° at {speed} m/s", { angle, speed });
const make = (name, marks, text = "") => { const made = document.createElementNS(SVG, name); for (const [key, value] of Object.entries(marks)) made.setAttribute(key, String(value)); made.textContent = text; return made; };

/** @param {[number, number][]} demand commands that the fastest lap needs */
function drawBack(demand) {
  const rings = [1, 2, 3, 4].flatMap(speed => {
    const points = []; for (let angle = -MOST_ANGLE; angle <= MOST_ANGLE; angle += 2) points.push(at(angle, speed).map(v => v.toFixed(1)).join(","));
    return [make("polyline", { points: points.join(" "), class: "ring" }), make("text", { x: 4, y: -speed * PX_PER_MPS - 3, class: "axis" }, `${speed} m/s`)];
  });
  const rays = [-30, -15, 0, 15, 30].map(angle => { const [x, y] = at(angle, MOST_SPEED); return make("line", { x1: 0, y1: 0, x2: x.toFixed(1), y2: y.toFixed(1), class: "ring" }); });
  const asked = demand.map(([angle, speed]) => { const [x, y] = at(angle, speed); return make("circle", { cx: x.toFixed(1), cy: y.toFixed(1), r: 2.5, class: "demand" }); });
  back.replaceChildren(...rings, ...rays, ...asked);
}

/** Draw a point for each line; `focused` is the line whose point has the keyboard. */
function drawPoints(focused = -1) {
  const points = lines.value.split("\n").flatMap((line, k) => { const action = readLine(line); return action ? [/** @type {const} */ ([k, ...action])] : []; });
  front.replaceChildren(...points.map(([line, angle, speed], k) => {
    const [x, y] = at(clip(angle, -MOST_ANGLE, MOST_ANGLE), clip(speed, 0, MOST_SPEED));
    const point = make("g", {
      class: "dot", tabindex: 0, role: "slider", "data-line": line, transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})`,
      "aria-label": t("Action {number}", { number: k + 1 }), "aria-valuemin": -MOST_ANGLE, "aria-valuemax": MOST_ANGLE, "aria-valuenow": angle, "aria-valuetext": told(angle, speed),
    });
    point.append(make("circle", { r: 14 }), make("circle", { r: 5 }));
    return point;
  }));
  const all = points.map(([, angle, speed]) => told(angle, speed));
  plot.setAttribute("aria-label", t("{count} actions: {actions}", { count: points.length, actions: all.join(", ") }));
  if (focused >= 0) /** @type {SVGElement} */ (front.querySelector(`[data-line="${focused}"]`))?.focus();
}

/** @param {string[]} all the form's lines from now on @param {number} focused */
function write(all, focused = -1) {
  lines.value = all.join("\n");
  lines.dispatchEvent(new Event("input", { bubbles: true }));
  if (focused >= 0) drawPoints(focused);
}
const asLine = (angle, speed) => `${+clip(angle, -MOST_ANGLE, MOST_ANGLE).toFixed(1)}, ${+clip(speed, LEAST_SPEED, MOST_SPEED).toFixed(2)}`;
function setAction(line, angle, speed) { const all = lines.value.split("\n"); all[line] = asLine(angle, speed); write(all, line); }
function addAction(angle, speed) {
  const all = lines.value.replace(/\s+$/, "").split("\n").filter((line, k, every) => line || every.length > 1);
  write([...all, asLine(angle, speed)], all.length);
}
function removeAction(line) {
  const all = lines.value.split("\n");
  all.splice(line, 1);
  write(all, Math.min(line, all.length - 1));
}

/** @param {MouseEvent} event @returns {[number, number]} the command under the pointer, whole degrees and tenths of m/s */
function under(event) {
  const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
  const angle = Math.atan2(-place.x, -place.y) * 180 / Math.PI / WIDENED;
  return [Math.round(angle), Math.round(Math.hypot(place.x, place.y) / PX_PER_MPS * 10) / 10];
}

let held = -1;
front.addEventListener("pointerdown", event => {
  const point = /** @type {SVGElement} */ (event.target).closest("[data-line]");
  if (!point) return;
  event.preventDefault();
  held = Number(point.dataset.line);
  plot.setPointerCapture(event.pointerId);
  drawPoints(held);
});
plot.addEventListener("pointermove", event => {
  if (held < 0) return;
  setAction(held, ...under(event));
  front.querySelector(`[data-line="${held}"]`)?.classList.add("held");
});
for (const end of ["pointerup", "pointercancel"]) plot.addEventListener(end, () => { held = -1; });
plot.addEventListener("dblclick", event => {
  if (!(/** @type {SVGElement} */ (event.target).closest("[data-line]"))) addAction(...under(event));
});
plot.addEventListener("keydown", event => {
  const point = /** @type {SVGElement} */ (event.target).closest("[data-line]"), line = Number(point?.dataset.line);
  const action = point && readLine(lines.value.split("\n")[line]);
  if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
  const [angle, speed] = action, wide = event.shiftKey ? 5 : 1;
  const act = {   // left on the plot is left on the road
    ArrowLeft: () => setAction(line, angle + wide, speed), ArrowRight: () => setAction(line, angle - wide, speed),
    ArrowUp: () => setAction(line, angle, speed + 0.1 * wide), ArrowDown: () => setAction(line, angle, speed - 0.1 * wide),
    "+": () => addAction(angle, speed), Delete: () => removeAction(line), Backspace: () => removeAction(line),
  }[event.key];
  if (!act) return;
  event.preventDefault();
  event.stopPropagation();
  act();
});

plot.append(back, front);
drawBack([]);
drawPoints();
lines.addEventListener("input", () => drawPoints());
const looked = document.querySelector("[data-look]");
if (looked) new MutationObserver(() => {
  const found = /** @type {HTMLElement} */ (looked.querySelector("[data-demand]"));
  if (found) drawBack(JSON.parse(found.dataset.demand));
}).observe(looked, { childList: true });

document.getElementById("make-actions").addEventListener("click", () => {
  const value = name => Number(/** @type {HTMLInputElement} */ (document.getElementById(name)).value.replace(",", "."));
  const [angle, angles, speed, speeds] = ["most-angle", "angles", "most-speed", "speeds"].map(value);
  if (![angle, angles, speed, speeds].every(Number.isFinite)) return;
  const made = [];
  for (let k = 0; k < angles; k++) for (let s = 1; s <= speeds; s++) made.push(asLine(angles === 1 ? 0 : -angle + 2 * angle * k / (angles - 1), speed * s / speeds));
  write(made);
});
