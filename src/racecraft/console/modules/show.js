/* A race for an audience. A drive that was judged is shown from above first; then the board moves to its result.
   Without news one sees where the cars are that are driven now, or the leader's drive again. */
import { t } from "racecraft.pages/texts.js";
import { showDriving } from "racecraft.console/driving.js";

const SVG = "http://www.w3.org/2000/svg", PAUSE_MS = 4000, FRESH_MS = 8000, TRAIL_TICKS = 30, MOST_WAITING = 3;
const map = /** @type {any} */ (document.getElementById("map")), who = document.getElementById("who");
const clock = document.getElementById("clock"), lost = document.getElementById("lost");
const driving = /** @type {HTMLElement} */ (document.querySelector("[data-driving]"));
const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

const toldIn = page => JSON.parse(page.querySelector("main script[type='application/json']").textContent);
let told = toldIn(document), next = null, now = null, moved = () => {}, isFollowing = false;
const seen = new Set(told.heats.map(one => one.heat)), waiting = [];
let playing = false;

function element(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  map.append(made);
  return made;
}
const together = racers => racers.join(t(" against "));
const line = points => points.map(([x, y], k) => `${k ? "L" : "M"}${x} ${-y}`).join("");

/** Draws a road and returns what moves on it: a trail and a car for each car. */
function draw(road, count) {
  map.replaceChildren();
  const all = [...road.inner, ...road.outer], xs = all.map(p => p[0]), ys = all.map(p => -p[1]);
  const left = Math.min(...xs), top = Math.min(...ys), wide = Math.max(...xs) - left, high = Math.max(...ys) - top;
  const pad = .04 * Math.max(wide, high), unit = Math.max(wide, high) / 100;
  map.setAttribute("viewBox", `${left - pad} ${top - pad} ${wide + 2 * pad} ${high + 2 * pad}`);
  const d = road.closed ? line(road.outer) + "Z" + line(road.inner) + "Z" : line([...road.outer, ...[...road.inner].reverse()]) + "Z";
  element("path", { class: "road", d, "stroke-width": unit * .3 });
  return Array.from({ length: count }, (_, k) => ({
    trail: element("polyline", { class: `trail${k ? " second" : ""}`, "stroke-width": unit }),
    car: element("circle", { class: `car${k ? " second" : ""}`, r: unit * 1.7, "stroke-width": unit * .4 }),
  }));
}

/** Shows one heat; resolves when it is over, or where it yields as soon as there is news. */
async function play(heat, label, yields = false) {
  for (const [number, track] of heat.tracks.entries()) {
    const answer = await fetch(`${told.base}/drives/${heat.heat}/${number}`);
    if (!answer.ok) continue;
    const drive = await answer.json();
    if (!drive.cars.length || !told.roads[number]) continue;  // its files are gone
    const shapes = draw(told.roads[number], drive.cars.length);
    who.textContent = [label + together(heat.racers), heat.tracks.length > 1 && track].filter(Boolean).join(", ");
    await run(drive, shapes, yields);
  }
}

function run(drive, shapes, yields) {
  const ticks = Math.max(...drive.cars.map(car => car.x.length)), began = performance.now();
  return new Promise(done => {
    const frame = now => {
      const at = still ? ticks - 1 : Math.min(ticks - 1, Math.max(0, now - began) / 1000 / drive.tick_seconds);
      drive.cars.forEach((car, k) => place(car, shapes[k], Math.min(at, car.x.length - 1)));
      const first = drive.cars[0], tick = Math.min(Math.floor(at), first.x.length - 1);
      clock.textContent = t("Lap {number}", { number: first.laps[tick] + 1 }) + `  ${first.lap_seconds[tick].toFixed(2)} s`;
      if (yields && (waiting.length || isDriven())) done();
      else if (at < ticks - 1) requestAnimationFrame(frame);
      else setTimeout(done, still ? PAUSE_MS : 800);
    };
    requestAnimationFrame(frame);
  });
}

const isDriven = () => now !== null && now.places.length > 0 && told.roads[now.track] !== null;

/** Shows where the cars are that are driven now; resolves when their drive is over, or a judged one waits. */
async function follow() {
  const { track, racers, places } = now, shapes = draw(told.roads[track], places.length);
  who.textContent = t("Now: {racers}", { racers: together(racers) });
  driving.hidden = isFollowing = true;  // the same is written larger
  while (isDriven() && !waiting.length && now.track === track && `${now.racers}` === `${racers}`) {
    now.places.forEach(([x, y], k) => place({ x: [x], y: [y] }, shapes[k], 0));
    clock.textContent = now.text;
    await new Promise(done => { moved = () => done(null); });
  }
  isFollowing = false;
  driving.hidden = now === null;
}

function place(car, shape, at) {
  const tick = Math.floor(at), part = at - tick, after = Math.min(tick + 1, car.x.length - 1);
  const jumps = Math.hypot(car.x[after] - car.x[tick], car.y[after] - car.y[tick]) > 1; // it was set back
  const x = car.x[tick] + (jumps ? 0 : part * (car.x[after] - car.x[tick]));
  const y = car.y[tick] + (jumps ? 0 : part * (car.y[after] - car.y[tick]));
  shape.car.setAttribute("cx", x); shape.car.setAttribute("cy", -y);
  const points = [];
  for (let k = Math.max(0, tick - TRAIL_TICKS); k <= tick; k++) points.push(`${car.x[k]},${-car.y[k]}`);
  shape.trail.setAttribute("points", [...points, `${x},${-y}`].join(" "));
}

/** Puts the newest board in place and marks the row of a result. */
function showBoard(heat) {
  if (next) { document.getElementById("board").replaceWith(next); next = null; }
  const row = !heat ? null : document.querySelector(`[data-result="${CSS.escape(heat)}"]`);
  row?.classList.add("fresh");
  setTimeout(() => row?.classList.remove("fresh"), FRESH_MS);
}

async function goOn() {
  if (playing) return;
  playing = true;
  for (;;) {
    const heat = waiting.shift();
    if (heat) { await play(heat, ""); showBoard(heat.heat); }
    else if (isDriven()) { await follow(); continue; }
    else if (told.leader) { await play(told.leader, t("Leading: "), true); }
    else break;
    await new Promise(done => setTimeout(done, heat ? PAUSE_MS : 1000));
  }
  playing = false;
}

async function look() {
  const answer = await fetch(location.href, { headers: { Accept: "text/html" } });
  if (answer.status === 404) location.reload();  // the link of this screen holds no more
  if (!answer.ok) return;
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  told = toldIn(page);
  next = page.getElementById("board");
  const fresh = told.heats.filter(one => !seen.has(one.heat));
  for (const one of fresh) { seen.add(one.heat); waiting.push(one); }
  waiting.splice(0, Math.max(0, waiting.length - MOST_WAITING));
  if (!waiting.length && !fresh.length) showBoard("");
  moved();
  goOn();
}

const stream = new EventSource(told.events);
stream.addEventListener("races", event => { if (JSON.parse(event.data).changed.includes(told.race)) look(); });
stream.addEventListener("drives", event => {
  const heats = JSON.parse(event.data);
  showDriving(heats);
  driving.hidden ||= isFollowing;
  now = heats[told.race] ?? null;
  moved();
  goOn();
});
stream.onopen = () => { lost.hidden = true; look(); };
stream.onerror = () => { lost.hidden = false; };
navigator.wakeLock?.request("screen").catch(() => {});
goOn();
