/* <rc-drive wheel="/wheel">: driving by hand. The server ticks 15 times a second; between ticks the picture moves on from
   what is shown to what was told, so that it is smooth and each input is under way at the next tick. */
import { words } from "racecraft.pages/ask.js";
import { t } from "racecraft.pages/texts.js";
import { onTokens, token } from "racecraft.pages/tokens.js";
import { RoadView } from "racecraft.worlds.deepracer.pages/road_view.js";

const TICK_MS = 1000 / 15, FIRST = 0.4, RAMP = 5, BACK = 9;   // of the wheel by keys: at once, then so much a second
const FIGURES_MS = 100, TILT_DEG = 25, DEAD = 0.08;
const LEFT = ["ArrowLeft", "a"], RIGHT = ["ArrowRight", "d"], GAS = ["ArrowUp", "w"];
const CALLS = { off_track: t("Off the road."), reversed: t("Wrong way round."), immobilized: t("The car stood still."), time_up: t("Out of time."), crashed: t("Crashed.") };
const AGAIN = matchMedia("(pointer: coarse)").matches ? t("Press Gas to drive.") : t("Press ↑ to drive.");

class Drive extends HTMLElement {
  connectedCallback() {
    if (this.parts) return;
    this.parts = Object.fromEntries([...this.querySelectorAll("[data-part]")].map(part => [part.dataset.part, part]));
    this.down = new Set(); this.delays = /** @type {number[]} */ ([]); this.laps = [];
    this.from = this.to = this.shown = this.waiting = this.ghost = this.told = /** @type {any} */ (null);
    this.steer = this.gas = this.number = this.arrived = this.told_n = this.last = this.figures = this.pictures = 0;
    this.running = false;
    this.parts.secure.hidden = isSecureContext;
    this.parts.tilt.hidden = !isSecureContext || !("DeviceOrientationEvent" in window) || !matchMedia("(pointer: coarse)").matches;
    this.listen();
    this.connect();
  }

  connect() {
    const way = new URL(this.getAttribute("wheel"), location.href);
    way.protocol = way.protocol.replace("http", "ws");
    this.socket = new WebSocket(way);
    this.socket.onmessage = event => this.hear(JSON.parse(event.data));
    this.socket.onclose = () => { this.running = false; this.call(t("No connection to racecraft. Load the page again.")); };
  }

  say(told) { if (this.socket.readyState === 1) this.socket.send(JSON.stringify(told)); }

  call(text) { if (this.parts.call.textContent !== text) this.parts.call.textContent = text; }

  hear(told) {
    if (told.track) this.lay(told.track);
    if (told.message != null) this.call(told.message || (this.running ? "" : AGAIN));
    if ("laps" in told) this.showLaps(told.laps, told.command);
    if ("ghost" in told) this.ghost = told.ghost;
    if (told.at) this.move(told);
  }

  lay(track) {
    this.view = new RoadView(this.parts.view, track);
    this.track = track; this.layMap();
    onTokens(() => this.layMap());
    this.call(AGAIN);
    requestAnimationFrame(now => this.turn(now));
  }

  move({ at, n = 0, ended = "", jump = false, lap }) {
    const far = this.to && Math.hypot(at[0] - this.to[0], at[1] - this.to[1]) > 0.6;
    this.from = this.shown && !far && !jump ? this.shown : at;
    this.to = at; this.arrived = performance.now(); this.told_n = n;
    if (jump) { this.running = false; this.call(AGAIN); }
    if (lap) { this.call(t("{seconds} s. Kept.", { seconds: words(lap, 2) })); this.quietAt = this.arrived + 2500; if (this.parts.ghost.value === "best") this.say({ ghost: "best" }); }
    else if (ended && ended !== "lap_complete") { this.running = false; this.call(`${CALLS[ended] || ended} ${AGAIN}`); }
  }

  // ---- input ------------------------------------------------------------------------------------------------------

  listen() {
    addEventListener("keydown", event => this.key(event, true));
    addEventListener("keyup", event => this.key(event, false));
    addEventListener("blur", () => this.down.clear());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.pause(); });
    for (const pad of this.querySelectorAll("[data-pad]")) {
      const name = { left: LEFT[0], right: RIGHT[0], gas: GAS[0] }[pad.dataset.pad];
      pad.addEventListener("pointerdown", event => { event.preventDefault(); pad.setPointerCapture(event.pointerId); this.press(name, true); });
      for (const end of ["pointerup", "pointercancel"]) pad.addEventListener(end, () => this.press(name, false));
      pad.addEventListener("contextmenu", event => event.preventDefault());
    }
    this.parts.pause.onclick = () => (this.running ? this.pause() : this.go());
    this.parts.restart.onclick = () => this.say({ restart: true });
    this.parts.ghost.onchange = () => { this.say({ ghost: this.parts.ghost.value }); this.parts.view.focus(); };
    this.parts.tilt.onclick = async () => {
      const asks = /** @type {any} */ (DeviceOrientationEvent).requestPermission;
      if (asks && await asks.call(DeviceOrientationEvent) !== "granted") return this.call(t("The phone gave no leave to tilt."));
      addEventListener("deviceorientation", event => { this.tilt = tiltOf(event); });
    };
  }

  key(event, is_down) {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|TEXTAREA|SELECT)$/.test(event.target.tagName)) return;
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if ([...LEFT, ...RIGHT, ...GAS, "ArrowDown"].includes(name)) { event.preventDefault(); if (!event.repeat) this.press(name, is_down); }
    else if (is_down && name === "p") this.running ? this.pause() : this.go();
    else if (is_down && name === "r") this.say({ restart: true });
  }

  press(name, is_down) {
    this.down[is_down ? "add" : "delete"](name);
    if (is_down) { if (GAS.includes(name) && !this.running) this.go(); this.waiting ||= { at: performance.now(), n: this.number + 1 }; }
    this.send(0);
  }

  go() { this.running = true; this.call(""); this.say({ go: true }); this.parts.pause.textContent = t("Pause"); }

  pause() { this.running = false; this.say({ pause: true }); this.call(`${t("Paused.")} ${AGAIN}`); this.parts.pause.textContent = t("Go on"); }

  /* Turn the wheel by what is pressed for so many seconds, and tell the server what changed. */
  send(seconds) {
    const held = keys => keys.some(key => this.down.has(key));
    let want = held(LEFT) - held(RIGHT), gas = +held(GAS);
    const pad = isSecureContext && navigator.getGamepads?.().find(Boolean);
    if (pad) {
      if (Math.abs(pad.axes[0]) > DEAD) { this.steer = -pad.axes[0]; want = null; }
      gas = Math.max(gas, pad.buttons[7]?.value || 0, pad.buttons[0]?.value || 0);
      if (gas > 0.2 && !this.running && !this.paddled) this.go();
      this.paddled = gas > 0.2;
    }
    if (this.tilt != null && !want) { this.steer = this.tilt; want = null; }
    if (want != null) {
      if (want && Math.abs(this.steer) < FIRST) this.steer = want * FIRST;
      const pace = want ? RAMP : BACK, way = want - this.steer;
      this.steer += Math.sign(way) * Math.min(Math.abs(way), pace * seconds);
    }
    const told = `${this.steer.toFixed(3)} ${gas.toFixed(2)}`;
    if (told === this.told) return;
    this.told = told; this.gas = gas;
    this.say({ steer: this.steer, gas, n: ++this.number });
  }

  // ---- pictures ---------------------------------------------------------------------------------------------------

  turn(now) {
    requestAnimationFrame(next => this.turn(next));
    const seconds = Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    this.send(seconds);
    if (!this.to) return;
    const moving = this.running || now - this.arrived < 3 * TICK_MS || this.pictures < 3;
    if (!moving) return;
    const t = Math.max(0, Math.min(1.2, (performance.now() - this.arrived) / TICK_MS)), { from, to } = this;
    this.shown = to.map((value, k) => from[k] + t * (k === 2 ? Math.atan2(Math.sin(value - from[2]), Math.cos(value - from[2])) : value - from[k]));
    const ghost = this.ghostAt(this.shown[6]);
    this.view.draw(this.shown, this.shown[4], ghost);
    this.drawMap(ghost);
    this.pictures++;
    if (this.waiting && this.told_n >= this.waiting.n && t > 0) {
      this.delays.push(performance.now() - this.waiting.at); this.waiting = null;
    }
    if (this.quietAt && now > this.quietAt) { this.quietAt = 0; if (this.running) this.call(""); }
    if (now - this.figures > FIGURES_MS) { this.figures = now; this.tell(); }
  }

  ghostAt(seconds) {
    const path = this.ghost?.path;
    if (!path?.length) return null;
    const head = Math.max(0, Math.min(path.length - 1.001, seconds * 15)), i = Math.floor(head), f = head - i, [a, b] = [path[i], path[Math.min(i + 1, path.length - 1)]];
    return [a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), a[2] + f * Math.atan2(Math.sin(b[2] - a[2]), Math.cos(b[2] - a[2]))];
  }

  tell() {
    const [, , , speed, steering, progress, lap] = this.shown, { parts } = this, median = this.delays.slice(-20).sort((a, b) => a - b)[Math.floor(Math.min(20, this.delays.length) / 2)];
    const write = (part, text) => { if (parts[part].textContent !== text) parts[part].textContent = text; };
    write("speed", words(speed, 1)); write("steer", `${words(steering * 180 / Math.PI)}°`); write("lap", words(Math.max(0, lap), 1));
    write("delay", words(median));
    const left = this.ghost && progress > 3 ? lap - this.ghost.seconds * this.shareAt() : null;
    write("gap", left == null ? "–" : `${left > 0 ? "+" : ""}${words(left, 1)}`);
  }

  /* The share of the ghost's time in which it came as far round: by the nearest of its places to ours. */
  shareAt() {
    const [x, y] = this.shown, path = this.ghost.path;
    let best = 0, least = Infinity;
    path.forEach(([u, v], k) => { const far = (u - x) ** 2 + (v - y) ** 2; if (far < least) [best, least] = [k, far]; });
    return best / path.length;
  }

  layMap() {
    const { map } = this.parts, { bounds: [x0, y0, x1, y1], centre, inner, outer } = this.track, ratio = Math.min(2, devicePixelRatio || 1);
    map.width = map.clientWidth * ratio; map.height = map.clientHeight * ratio;
    const scale = Math.min(map.width / (x1 - x0), map.height / (y1 - y0)) * 0.92;
    const left = (map.width - (x1 - x0) * scale) / 2, top = (map.height - (y1 - y0) * scale) / 2;
    this.onMap = ([x, y]) => [left + (x - x0) * scale, top + (y1 - y) * scale];
    this.way = new Path2D();
    centre.forEach((point, k) => { const [x, y] = this.onMap(point); this.way[k ? "lineTo" : "moveTo"](x, y); });
    if (this.track.closed) this.way.closePath();
    this.wayWidth = Math.max(3, Math.hypot(inner[0][0] - outer[0][0], inner[0][1] - outer[0][1]) * scale);
  }

  drawMap(ghost) {
    const { map } = this.parts, pen = map.getContext("2d");
    pen.clearRect(0, 0, map.width, map.height);
    pen.lineJoin = "round";
    for (const [width, colour] of [[this.wayWidth + 3, token("--map-kerb")], [this.wayWidth, this.track.colours.road]]) {
      pen.lineWidth = width; pen.strokeStyle = colour; pen.stroke(this.way);
    }
    for (const [pose, colour, size] of [[ghost, "--map-other", 4], [this.shown, "--map-chosen", 5.5]]) {
      if (!pose) continue;
      const [x, y] = this.onMap(pose);
      pen.beginPath(); pen.arc(x, y, size, 0, 7); pen.fillStyle = token(colour); pen.fill(); pen.lineWidth = 1.5; pen.strokeStyle = token("--map-edge"); pen.stroke();
    }
  }

  showLaps(laps, command) {
    const { parts } = this, body = parts.laps.tBodies[0], best = Math.min(...laps.map(lap => lap.seconds));
    this.laps = laps;
    parts.laps.hidden = parts.teach.hidden = !laps.length; parts.none.hidden = !!laps.length;
    parts.command.textContent = command || "";
    parts.best.textContent = laps.length ? words(best, 2) : "–";
    body.replaceChildren(...laps.map((lap, k) => {
      const row = document.createElement("tr"), drop = Object.assign(document.createElement("button"), { type: "button", textContent: t("Drop"), ariaLabel: t("Drop lap {number}", { number: k + 1 }) });
      drop.onclick = () => this.say({ drop: k });
      row.append(cell([k + 1, lap.seconds === best && t("the best"), !lap.flying && t("from rest")].filter(Boolean).join(", ")), cell(`${words(lap.seconds, 2)} s`, "right"), cell("", "right"));
      row.lastElementChild.append(drop);
      return row;
    }));
    for (const count of this.querySelectorAll("[data-count]")) count.textContent = laps.length === 1 ? t("1 lap") : t("{count} laps", { count: laps.length });
  }
}

const cell = (text, kind = "") => Object.assign(document.createElement("td"), { textContent: text, className: kind });

function tiltOf({ beta, gamma }) {   // a phone held across: its long side turns like a wheel
  const turn = screen.orientation?.angle || 0, degrees = turn === 90 ? -beta : turn === 270 ? beta : -gamma;
  return Math.max(-1, Math.min(1, degrees / TILT_DEG));
}

customElements.define("rc-drive", Drive);
