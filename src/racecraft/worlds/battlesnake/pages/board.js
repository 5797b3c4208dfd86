/* A game on its board: step, play, scrub. */
// What is told: {title, game, events, live, speed}; an event is {Type: "frame" | "game_end", Data}.
import { t } from "racecraft.pages/texts.js";

const told = JSON.parse(document.querySelector("#told script").textContent);
const at = (id) => document.getElementById(id);
const W = told.game.Width, H = told.game.Height;
const SPEEDS = [1, 2, 4, 8, 16, 32];
const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
const frames = [];
let place = 0;          // where we are, in frames; a fraction is the way to the next
let playing = false, over = false, drawn = -1, before = 0;

// The board -----------------------------------------------------------------------------------------------------------

const svg = at("board");
const make = (kind, facts, parent) => {
  const node = document.createElementNS("http://www.w3.org/2000/svg", kind);
  for (const [name, value] of Object.entries(facts)) if (name === "style") node.style.cssText = value; else node.setAttribute(name, value);
  if (parent) parent.append(node);
  return node;
};
svg.setAttribute("viewBox", `-0.1 -0.1 ${W + 0.2} ${H + 0.2}`);
const clip = make("clipPath", { id: "inside" }, make("defs", {}, svg));
make("rect", { x: 0, y: 0, width: W, height: H, rx: 0.18 }, clip);
const ground = make("g", { "clip-path": "url(#inside)" }, svg);
for (let x = 0; x < W; x++) for (let y = 0; y < H; y++)
  make("rect", { x, y, width: 1.01, height: 1.01, style: `fill: var(--${(x + y) % 2 ? "odd" : "even"})` }, ground);
const hazardLayer = make("g", { "clip-path": "url(#inside)" }, svg);
const foodLayer = make("g", {}, svg);
const snakeLayer = make("g", { "clip-path": "url(#inside)" }, svg);
make("rect", { x: 0, y: 0, width: W, height: H, rx: 0.18, fill: "none", "stroke-width": 0.06,
  style: "stroke: var(--line)" }, svg);

const spot = (point) => ({ x: point.X + 0.5, y: H - point.Y - 0.5 });
const far = (a, b) => Math.abs(a.x - b.x) + Math.abs(a.y - b.y) > 1.01;
const between = (a, b, part) => far(a, b) ? (part < 0.5 ? a : b)
  : { x: a.x + (b.x - a.x) * part, y: a.y + (b.y - a.y) * part };

function line(points) {      // a path through the points; where the board's edges are joined it leaves and comes back
  let path = `M${points[0].x} ${points[0].y}`;
  for (let n = 1; n < points.length; n++) {
    const a = points[n - 1], b = points[n];
    if (!far(a, b)) { path += `L${b.x} ${b.y}`; continue; }
    const dx = Math.abs(b.x - a.x) > 1.01 ? Math.sign(a.x - b.x) : 0, dy = dx ? 0 : Math.sign(a.y - b.y);
    path += `L${a.x + dx} ${a.y + dy}M${b.x - dx} ${b.y - dy}L${b.x} ${b.y}`;
  }
  return path + (points.length === 1 ? "h0.001" : "");
}

function pointsOf(now, then, part) {    // where a snake lies on the way from one frame to the next
  const points = now.Body.map(spot);
  if (!then || !part) return points;
  const head = spot(then.Body[0]), tail = spot(then.Body[then.Body.length - 1]), end = points.pop();
  const front = points[0] || end;
  if (head.x === front.x && head.y === front.y) return [...points, end];    // it died, and nobody knows where it went
  return [between(front, head, part), ...points, between(end, tail, part)];
}

function drawSnake(snake, points, fade) {
  const g = make("g", { opacity: fade }, snakeLayer), path = line(points);
  const body = { d: path, fill: "none", "stroke-linecap": "round", "stroke-linejoin": "round" };
  make("path", { ...body, "stroke-width": 0.8, style: "stroke: var(--board-edge)" }, g);
  make("path", { ...body, "stroke-width": 0.72, stroke: snake.Color }, g);
  const head = points[0], neck = points.find((point) => (point.x !== head.x || point.y !== head.y) && !far(point, head))
    || { x: head.x, y: head.y + 1 };
  const length = Math.hypot(head.x - neck.x, head.y - neck.y) || 1;
  const fx = (head.x - neck.x) / length, fy = (head.y - neck.y) / length;
  for (const side of [-1, 1]) {
    const x = head.x + fx * 0.1 - fy * 0.17 * side, y = head.y + fy * 0.1 + fx * 0.17 * side;
    if (snake.Death) {
      make("path", { d: `M${x - .09} ${y - .09}l.18 .18m0 -.18l-.18 .18`, "stroke-width": 0.06, "stroke-linecap": "round",
        style: "stroke: var(--eye)" }, g);
    } else {
      make("circle", { cx: x, cy: y, r: 0.115, style: "fill: var(--eye)" }, g);
      make("circle", { cx: x + fx * 0.035, cy: y + fy * 0.035, r: 0.06, style: "fill: var(--pupil)" }, g);
    }
  }
}

function drawBoard() {
  const here = Math.floor(place), part = still || rate() > 24 ? 0 : place - here;
  const now = frames[here], next = frames[here + 1];
  if (!now) return;
  snakeLayer.replaceChildren();
  const ways = new Map((next && part ? next.Snakes : []).map((snake) => [snake.ID, snake]));
  for (const dead of [true, false]) for (const snake of now.Snakes) {
    if (Boolean(snake.Death) !== dead || dead && snake.Death.Turn !== now.Turn) continue;
    const then = ways.get(snake.ID);
    const fade = dead ? 0.55 * (1 - part) : then && then.Death ? 1 - 0.45 * part : 1;
    drawSnake(snake, dead ? snake.Body.map(spot) : pointsOf(snake, then, part), fade);
  }
  if (drawn === here) return;
  drawn = here;
  drawSquares(now);
  drawTable(now, here);
}

function drawSquares(now) {
  foodLayer.replaceChildren();
  hazardLayer.replaceChildren();
  for (const point of now.Food) {
    const { x, y } = spot(point);
    make("circle", { cx: x, cy: y, r: 0.27, style: "fill: var(--food)" }, foodLayer);
    make("circle", { cx: x - 0.08, cy: y - 0.09, r: 0.07, opacity: 0.6, style: "fill: var(--eye)" }, foodLayer);
  }
  const stacks = new Map();
  for (const { X, Y } of now.Hazards) stacks.set(`${X} ${Y}`, (stacks.get(`${X} ${Y}`) || 0) + 1);
  for (const [key, count] of stacks) {
    const [X, Y] = key.split(" ").map(Number);
    make("rect", { x: X, y: H - 1 - Y, width: 1, height: 1, "shape-rendering": "crispEdges", opacity: Math.min(0.85, 0.28 + 0.14 * count),
      style: "fill: var(--hazard)" }, hazardLayer);
  }
}

// The table -----------------------------------------------------------------------------------------------------------

const rows = new Map();
function rowOf(snake) {
  if (rows.has(snake.ID)) return rows.get(snake.ID);
  const row = document.createElement("li");
  row.innerHTML = '<span class="swatch"></span><span class="name"></span><span class="length"></span>'
    + '<span class="health"><i></i></span><span class="points"></span><span class="fate"></span>';
  row.querySelector(".swatch").style.background = snake.Color;
  row.querySelector(".name").textContent = row.querySelector(".name").title = snake.Name;
  at("snakes").append(row);
  rows.set(snake.ID, row);
  return row;
}

function fateOf(snake, names) {
  const by = names.get(snake.Death.EliminatedBy) || t("another snake"), values = { by, turn: snake.Death.Turn };
  const fates = { "out-of-health": t("starved on turn {turn}", values), "wall-collision": t("hit the wall on turn {turn}", values),
    "hazard": t("died in a hazard on turn {turn}", values), "snake-self-collision": t("ran into itself on turn {turn}", values),
    "snake-collision": t("ran into {by} on turn {turn}", values),
    "head-collision": t("lost head to head against {by} on turn {turn}", values) };
  return fates[snake.Death.Cause] || t("out on turn {turn}", values);
}

function drawTable(now, here) {
  const names = new Map(now.Snakes.map((snake) => [snake.ID, snake.Name]));
  const alive = now.Snakes.filter((snake) => !snake.Death);
  const ended = over && here === frames.length - 1;
  for (const snake of now.Snakes) {
    const row = rowOf(snake), bar = row.querySelector(".health i"), wins = ended && alive.length === 1 && !snake.Death
      && now.Snakes.length > 1;
    row.className = snake.Death ? "dead" : wins ? "wins" : "";
    row.querySelector(".length").textContent = t("length {length}", { length: snake.Body.length });
    row.querySelector(".points").textContent = snake.Health;
    bar.style.width = `${snake.Health}%`;
    bar.style.background = `var(--${snake.Health > 50 ? "good" : snake.Health > 20 ? "warn" : "bad"})`;
    row.querySelector(".fate").textContent = snake.Death ? fateOf(snake, names) : wins ? t("wins") : "";
  }
  at("turn").textContent = t("turn {turn} of {last}", { turn: now.Turn, last: frames[frames.length - 1].Turn });
  at("scrub").value = here;
  svg.dataset.turn = now.Turn;
  svg.setAttribute("aria-label", t("Turn {turn}", { turn: now.Turn }) + ": " + now.Snakes.map((snake) => snake.Death ? `${snake.Name} ${fateOf(snake, names)}`
    : t("{name} has length {length}, health {health}", { name: snake.Name, length: snake.Body.length, health: snake.Health })).join("; "));
}

function drawMarks() {       // when snakes died, above the slider
  at("marks").replaceChildren();
  const end = Math.max(1, frames.length - 1), seen = new Set();
  frames.forEach((frame, n) => frame.Snakes.forEach((snake) => {
    if (!snake.Death || seen.has(snake.ID)) return;
    seen.add(snake.ID);
    const mark = document.createElement("i");
    mark.style.cssText = `left: ${100 * n / end}%; background: ${snake.Color}`;
    at("marks").append(mark);
  }));
}

// Moving through the game ---------------------------------------------------------------------------------------------

const lastPlace = () => Math.max(0, frames.length - 1);
function go(to) {
  place = Math.min(lastPlace(), Math.max(0, to));
  drawBoard();
}
function setPlaying(wanted) {
  if (wanted && over && place >= lastPlace()) place = 0;
  if (!wanted) go(Math.round(place));
  playing = wanted;
  at("play").setAttribute("aria-pressed", String(playing));
  at("play").setAttribute("aria-label", playing ? t("Pause") : t("Play"));
  at("icon").setAttribute("d", playing ? "M6 4h4v16H6zM14 4h4v16h-4z" : "M7 4v16l13-8z");
  before = performance.now();
  if (playing) requestAnimationFrame(tick);
}
function step(by) {
  const from = by > 0 ? Math.floor(place) : Math.ceil(place);
  setPlaying(false);
  go(from + by);
}
function tick(time) {
  if (!playing) return;
  place = Math.min(lastPlace(), place + Math.max(0, time - before) / 1000 * rate());
  before = time;
  drawBoard();
  if (over && place >= lastPlace()) setPlaying(false); else requestAnimationFrame(tick);
}
function rate() {            // turns a second; a live game that got ahead of us is caught up with
  const wanted = Number(at("speed").value);
  return over ? wanted : Math.max(wanted, 2 * (lastPlace() - place));
}
function faster(by) {
  const n = SPEEDS.indexOf(Number(at("speed").value)) + by;
  if (SPEEDS[n]) at("speed").value = SPEEDS[n];
}

SPEEDS.forEach((speed) => at("speed").append(new Option(speed === 1 ? t("1 turn/s") : t("{count} turns/s", { count: speed }), String(speed))));
at("speed").value = SPEEDS.reduce((a, b) => Math.abs(b - told.speed) < Math.abs(a - told.speed) ? b : a);
at("first").onclick = () => { setPlaying(false); go(0); };
at("last").onclick = () => { setPlaying(false); go(lastPlace()); };
at("back").onclick = () => step(-1);
at("next").onclick = () => step(1);
at("play").onclick = svg.onclick = () => setPlaying(!playing);
at("scrub").oninput = (event) => { setPlaying(false); go(Number(event.target.value)); };
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
  const act = { " ": () => setPlaying(!playing), ArrowLeft: () => step(-1), ArrowRight: () => step(1),
    Home: at("first").onclick, End: at("last").onclick, "+": () => faster(1), "-": () => faster(-1) }[event.key];
  if (act) { event.preventDefault(); act(); }
});

// Where the game comes from -------------------------------------------------------------------------------------------

function hear(event) {
  if (event.Type === "game_end") { over = true; at("live").hidden = true; drawMarks(); }
  else if (event.Type === "frame") {
    frames.push(event.Data);
    at("scrub").max = lastPlace();
  }
}
function begin() {
  const asked = /^#turn=(\d+)$/.exec(location.hash);
  drawMarks();
  go(asked ? Number(asked[1]) : 0);
  if (!asked && !still) setPlaying(true);
}
at("rules").textContent = `${W}×${H}, ${told.game.RulesetName}`
  + (told.game.Map && told.game.Map !== told.game.RulesetName ? t(", map {map}", { map: told.game.Map }) : "");
told.events.forEach(hear);
if (!told.live) { over = true; begin(); } else {
  const socket = new WebSocket(location.origin.replace(/^http/, "ws") + told.live);
  let begun = false;
  at("live").hidden = false;
  socket.onmessage = (message) => {
    hear(JSON.parse(message.data));
    if (!begun && frames.length) { begun = true; begin(); }
    else { drawn = -1; drawBoard(); }
  };
  socket.onclose = () => {
    if (over) return;
    at("live").hidden = true;
    at("rules").textContent += ` – ${t("the connection is gone")}`;
    over = true;
  };
}
