/* The form of a new model: kept one second after each change, checked while one types, tracks found by name, actions
   drawn. */
import { look } from "racecraft.console/console.js";

const form = /** @type {HTMLFormElement} */ (document.getElementById("step"));
const kept = document.getElementById("kept");
let due = 0, sent = 0;

async function keep() {
  const number = ++sent, answer = await fetch(form.dataset.keep, { method: "POST", body: new FormData(form) });
  if (number !== sent) return;
  const told = await answer.json();
  if (!answer.ok) { kept.textContent = told.message; return; }
  form.elements.namedItem("edits").value = told.edits;
  kept.textContent = "Draft kept.";
  for (const field of form.querySelectorAll("[name]")) {
    const wrong = told.wrong[field.name] || "";
    if (field.name === "edits" || field.type === "hidden") continue;
    field.toggleAttribute("aria-invalid", Boolean(wrong));
    const place = document.getElementById(`${field.name}-wrong`);
    if (place) place.textContent = wrong;
  }
  const remarks = document.getElementById("remarks");
  remarks?.replaceChildren(...told.remarks.map(text => Object.assign(document.createElement("p"), { textContent: text })));
  remarks?.classList.toggle("bad", told.remarks.length > 0);
  for (const place of document.querySelectorAll("[data-look]")) look(place);
}
form.addEventListener("input", () => { clearTimeout(due); kept.textContent = "…"; due = setTimeout(keep, 700); });
form.addEventListener("submit", () => clearTimeout(due));

const search = /** @type {HTMLInputElement} */ (document.getElementById("find-track"));
search?.addEventListener("input", event => {
  event.stopPropagation();
  const words = search.value.toLowerCase().split(/\s+/);
  let left = 0;
  for (const card of document.querySelectorAll(".cards label")) {
    const fits = words.every(word => card.dataset.words.includes(word));
    card.hidden = !fits; left += Number(fits);
  }
  document.getElementById("left").textContent = `${left} tracks`;
});

const actions = /** @type {HTMLTextAreaElement} */ (document.getElementById("actions"));
function readActions() {
  return actions.value.split("\n").map(line => line.split(/[,;]/).map(Number)).filter(([angle, speed]) => Number.isFinite(angle) && Number.isFinite(speed));
}
const SVG = "http://www.w3.org/2000/svg";
function drawActions() {   // wheel angle left and right of up, speed outwards: 4 m/s is the outer ring
  const plot = document.getElementById("polar");
  if (!plot || !actions) return;
  const make = (name, marks, text = "") => { const made = document.createElementNS(SVG, name); for (const [key, value] of Object.entries(marks)) made.setAttribute(key, String(value)); made.textContent = text; return made; };
  const at = (angle, speed) => { const turn = angle * Math.PI / 180 * 2, far = speed * 50; return [-far * Math.sin(turn), -far * Math.cos(turn)]; };
  const rings = [1, 2, 3, 4].flatMap(speed => {
    const points = []; for (let angle = -30; angle <= 30; angle += 2) points.push(at(angle, speed).map(v => v.toFixed(1)).join(","));
    return [make("polyline", { points: points.join(" "), class: "ring" }), make("text", { x: 4, y: -speed * 50 - 3, class: "axis" }, `${speed} m/s`)];
  });
  const rays = [-30, -15, 0, 15, 30].map(angle => { const [x, y] = at(angle, 4); return make("line", { x1: 0, y1: 0, x2: x.toFixed(1), y2: y.toFixed(1), class: "ring" }); });
  const dots = readActions().map(([angle, speed]) => { const [x, y] = at(angle, speed); return make("circle", { cx: x.toFixed(1), cy: y.toFixed(1), r: 5, class: "dot" }); });
  plot.replaceChildren(...rings, ...rays, ...dots);
  plot.setAttribute("aria-label", `${dots.length} actions: ${readActions().map(([a, s]) => `${a}° at ${s} m/s`).join(", ")}`);
}
actions?.addEventListener("input", drawActions);
drawActions();
document.getElementById("make-actions")?.addEventListener("click", () => {
  const value = name => Number(/** @type {HTMLInputElement} */ (document.getElementById(name)).value.replace(",", "."));
  const [angle, angles, speed, speeds] = ["most-angle", "angles", "most-speed", "speeds"].map(value);
  if (![angle, angles, speed, speeds].every(Number.isFinite)) return;
  const lines = [];
  for (let k = 0; k < angles; k++) for (let s = 1; s <= speeds; s++)
    lines.push(`${+(angles === 1 ? 0 : -angle + 2 * angle * k / (angles - 1)).toFixed(1)}, ${+(speed * s / speeds).toFixed(2)}`);
  actions.value = lines.join("\n");
  actions.dispatchEvent(new Event("input", { bubbles: true }));
});
