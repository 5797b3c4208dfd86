/* The maker of tracks: the list of points is the drawing; the canvas shows and changes it, the server makes the road. */
import { t } from "racecraft.pages/texts.js";
import { onTokens, token } from "racecraft.pages/tokens.js";

const form = document.getElementById("maker"), floor = document.getElementById("floor"), points = document.getElementById("points");
const facts = document.getElementById("facts"), remarks = document.getElementById("remarks"), pen = floor.getContext("2d");
const MARGIN = 0.8, NEAR_PX = 16;
let line = [], road = null, place = null, held = -1, due = 0, sent = 0;

const parse = () => points.value.split("\n").map(row => row.split(",").map(Number)).filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
const write = () => { points.value = line.map(([x, y]) => `${x.toFixed(2)}, ${y.toFixed(2)}`).join("\n"); changed(); };

function changed() {
  line = parse(); draw();
  clearTimeout(due); due = setTimeout(check, 250);
}

async function check() {
  const number = ++sent, answer = await fetch("/tracks/new/check", { method: "POST", body: new FormData(form) });
  if (number !== sent) return;
  const told = await answer.json();
  road = told.centre ? told : null;
  facts.textContent = road ? t("{length} m a lap, {tape} m of tape.", told) : "";
  const texts = told.wrong ? [told.wrong] : told.remarks.map(text => t("Bend at {place}", { place: text }));
  remarks.replaceChildren(...texts.map(text => Object.assign(document.createElement("li"), { textContent: text, className: told.wrong ? "wrong" : "" })));
  draw();
}

function fit() {
  const ratio = Math.min(2, devicePixelRatio || 1);
  floor.width = floor.clientWidth * ratio; floor.height = floor.clientHeight * ratio;
  if (held < 0 && line.length) {
    const xs = line.map(p => p[0]), ys = line.map(p => p[1]);
    const [x0, x1, y0, y1] = [Math.min(0, ...xs) - MARGIN, Math.max(...xs) + MARGIN, Math.min(0, ...ys) - MARGIN, Math.max(...ys) + MARGIN];
    const scale = Math.min(floor.width / (x1 - x0), floor.height / (y1 - y0));
    place = { scale, ratio, left: (floor.width - (x1 - x0) * scale) / 2 - x0 * scale, base: floor.height - (floor.height - (y1 - y0) * scale) / 2 + y0 * scale };
  }
  place ||= { scale: floor.width / 8, ratio, left: floor.width / 8, base: floor.height * 0.9 };
}

const at = ([x, y]) => [place.left + x * place.scale, place.base - y * place.scale];
const back = (px, py) => [(px * place.ratio - place.left) / place.scale, (place.base - py * place.ratio) / place.scale];

function draw() {
  fit();
  const path = (rows, closed) => { pen.beginPath(); rows.forEach((p, k) => pen[k ? "lineTo" : "moveTo"](...at(p))); if (closed) pen.closePath(); };
  pen.fillStyle = token("--card"); pen.fillRect(0, 0, floor.width, floor.height);
  pen.strokeStyle = token("--line"); pen.lineWidth = place.ratio;
  const [x0, y1] = back(0, 0), [x1, y0] = back(floor.clientWidth, floor.clientHeight);
  for (let x = Math.ceil(x0); x <= x1; x++) { path([[x, y0], [x, y1]]); pen.stroke(); }
  for (let y = Math.ceil(y0); y <= y1; y++) { path([[x0, y], [x1, y]]); pen.stroke(); }
  pen.fillStyle = token("--quiet"); pen.font = `${11 * place.ratio}px ${token("--text")}`;
  pen.fillText(t("1 m squares"), 8 * place.ratio, 16 * place.ratio);
  const closed = form.elements.namedItem("closed").checked;
  if (road) {
    path(road.outer); [...road.inner].reverse().forEach(p => pen.lineTo(...at(p))); pen.closePath();
    pen.fillStyle = token("--map-road"); pen.fill("evenodd");
    pen.strokeStyle = token("--map-kerb"); pen.lineWidth = 2 * place.ratio;
    for (const side of ["inner", "outer"]) { path(road[side]); pen.stroke(); }
  }
  path(line, closed); pen.strokeStyle = token("--map-chosen"); pen.lineWidth = 1.5 * place.ratio; pen.setLineDash([6, 6]); pen.stroke(); pen.setLineDash([]);
  line.forEach((p, k) => {
    const [x, y] = at(p);
    pen.beginPath(); pen.arc(x, y, (k ? 5 : 7) * place.ratio, 0, 7); pen.fillStyle = token(k ? "--map-chosen" : "--map-other"); pen.fill();
    pen.lineWidth = 1.5 * place.ratio; pen.strokeStyle = token("--map-edge"); pen.stroke();
  });
}

function nearest(event) {
  const far = p => { const [x, y] = at(p); return Math.hypot(x / place.ratio - event.offsetX, y / place.ratio - event.offsetY); };
  const k = line.map(far).reduce((best, value, k, all) => value < all[best] ? k : best, 0);
  return line.length && far(line[k]) < NEAR_PX ? k : -1;
}

/** Where a new point belongs: between the two ends of the piece it lies nearest to. @param {number[]} point */
function between([x, y]) {
  const closed = form.elements.namedItem("closed").checked, last = closed ? line.length : line.length - 1;
  let best = line.length, least = Infinity;
  for (let k = 0; k < last; k++) {
    const [a, b] = line[k], [c, d] = line[(k + 1) % line.length], long = (c - a) ** 2 + (d - b) ** 2 || 1;
    const t = Math.max(0, Math.min(1, ((x - a) * (c - a) + (y - b) * (d - b)) / long)), far = Math.hypot(x - a - t * (c - a), y - b - t * (d - b));
    if (far < least) [least, best] = [far, k + 1];
  }
  return least < 1 ? best : line.length;
}

floor.addEventListener("pointerdown", event => {
  held = nearest(event);
  if (held < 0) { const point = back(event.offsetX, event.offsetY); held = between(point); line.splice(held, 0, point); write(); }
  floor.setPointerCapture(event.pointerId);
});
floor.addEventListener("pointermove", event => { if (held >= 0) { line[held] = back(event.offsetX, event.offsetY); write(); } });
floor.addEventListener("pointerup", () => { held = -1; draw(); });
floor.addEventListener("dblclick", event => { const k = nearest(event); if (k >= 0 && line.length > 3) { line.splice(k, 1); write(); } });
form.addEventListener("input", event => { if (event.target.id !== "file") changed(); });
document.getElementById("file").addEventListener("change", async event => {
  const data = new FormData(form);
  data.set("file", event.target.files[0]); data.set("length", document.getElementById("length").value);
  const told = await (await fetch("/tracks/new/read", { method: "POST", body: data })).json();
  if (told.wrong) { remarks.replaceChildren(Object.assign(document.createElement("li"), { textContent: told.wrong, className: "wrong" })); return; }
  form.elements.namedItem("closed").checked = told.closed;
  line = told.points; write();
});
onTokens(draw);
new ResizeObserver(draw).observe(floor);
changed();
