/* <rc-cars from="/">: every car of a run on the map, live while it trains, kept iterations and episodes after.

   `from` is where the run's JSON is. */
import { ask, words } from "racecraft.pages/ask.js";
import { t } from "racecraft.pages/texts.js";
import { feedOf } from "racecraft.pages/run_feed.js";
import { CarMap } from "racecraft.worlds.deepracer.pages/car_map.js";
import { TICKS, follows, goOn, pose, standing } from "racecraft.worlds.deepracer.pages/reel.js";

const PICTURES = 30, SLOW_PICTURES = 2;   // a second; slow where somebody wants little motion
const PICTURES_BESIDE_TRAINING = 20, FEW_PROCESSORS = 2;   // where a training has no third processor to go to
const LITTLE_MOTION = matchMedia("(prefers-reduced-motion: reduce)");
const AHEAD = 2;                          // s: with less to play, more is asked for; a training leaves its next ticks then
const ASK_MS = 500;                       // between two asks for ticks
const FIGURES_MS = 250, FIGURES_BESIDE_TRAINING_MS = 500, CARS_MS = 1000;   // between two changes of figures, of bars
const CAMERA_MS = 125, CAMERA_BESIDE_TRAINING_MS = 500;   // pictures take from the training
const ENDINGS = { lap_complete: t("lap complete"), off_track: t("off track"), crashed: t("crashed"), immobilized: t("stood still"),
  reversed: t("drove backwards"), time_up: t("out of time"), in_progress: t("goes on") };

class Cars extends HTMLElement {
  connectedCallback() {
    if (this.map) return;
    this.from = this.getAttribute("from") || "/";
    this.parts = Object.fromEntries([...this.querySelectorAll("[data-part]")].map(part => [part.dataset.part, part]));
    this.reel = /** @type {any} */ (null); this.coming = /** @type {any[]} */ ([]);
    this.tracks = /** @type {any[]} */ ([]); this.track = /** @type {any} */ (null);
    this.mode = ""; this.head = 0; this.playing = true; this.pace = 1; this.car = "0"; this.iteration = 0;
    this.episodes = []; this.kept = []; this.last = 0; this.courses = []; this.course = 0; this.seen = ""; this.times = {};
    this.map = new CarMap(this.parts.map);
    this.eye = this.parts.eye.getContext("2d", { alpha: false, desynchronized: true }); this.view = /** @type {any} */ (null);
    this.feed = feedOf(this.from);
    this.feed.addEventListener("run", () => this.onRun());
    this.listen();
    if (this.feed.run) this.onRun();
  }

  get training() { return !!this.feed.run?.training; }

  async onRun() {
    const { run } = this.feed;
    this.kept = run.kept || [];
    if (this.begun) return this.tellIterations();
    this.begun = true;
    this.courses = (await ask(`${this.from}api/courses`)).courses;
    this.layCourses();
    this.hidden = false;
    await this.go(0);
    this.observe();
    this.play(true);
    this.tellIterations();
    const wanted = new URLSearchParams(location.hash.slice(1)).get("iteration");
    if (wanted && this.kept.length) await this.openIteration(nearest(this.kept, wanted));
    else if (run.training) this.openLive();
    else if (this.kept.length) await this.openIteration(this.kept.at(-1));
    this.turn(performance.now());
  }

  // ---- what is played ---------------------------------------------------------------------------------------------

  begin(reel, mode, head = 0) {
    Object.assign(this, { reel, mode, head });
    const chosen = reel.cars.find(car => car.name === this.car) || this.here()[0] || reel.cars[0];
    if (chosen) { this.car = chosen.name; this.go(this.courseOf(chosen)); }
    reel.top = Math.max(1, ...reel.cars.flatMap(car => car.told.map(Math.abs)));
    this.widest = Math.max(0.5, ...reel.cars.flatMap(car => car.steering.map(Math.abs)));
    this.parts.all.hidden = mode !== "episode";
    this.tellCars(); this.tellIterations(); this.tellEpisodes();
  }

  async openIteration(number, head = 0) {
    const reel = await ask(`${this.from}api/iteration?number=${number}`);
    this.iteration = number; this.episodes = reel.episodes;
    this.begin(reel, "iteration", head);
  }

  async openEpisode(one) {
    const where = `iteration=${this.iteration}&world=${one.world}&agent=${one.agent}&episode=${one.episode}`;
    const reel = await ask(`${this.from}api/episode?${where}`);
    this.car = one.car; this.chosen = one;
    this.begin(reel, "episode"); this.play(true);
  }

  openLive() {
    Object.assign(this, { mode: "live", reel: null, last: 0, coming: [], fetching: false });
    this.play(true); this.tellIterations(); this.tellEpisodes();
  }

  async feedLive() {   // the training is asked for ticks when few are left to play
    if (this.fetching) return;
    this.fetching = true;
    try {
      const told = await ask(`${this.from}api/live?after=${this.last}`);
      if (this.mode === "live" && !told.training) return this.endLive();
      if (this.mode === "live" && told.reel) this.take(told.reel);
    } catch { /* the feed says that the server is gone */ }
    setTimeout(() => { this.fetching = false; }, ASK_MS);
  }

  take(reel) {
    const end = this.coming.at(-1) || this.reel;
    this.last = reel.last;
    if (!follows(reel, end)) this.coming.push(reel);   // of another moment: it begins when this one has been played
    else { const gone = goOn(end, reel, end === this.reel ? this.head : 0); if (end === this.reel) this.head -= gone; }
  }

  endLive() {
    this.fetching = false;
    if (this.kept.length) this.openIteration(this.kept.at(-1)); else this.mode = "";
  }

  left() { return this.coming.reduce((ticks, reel) => ticks + reel.ticks, this.reel ? this.reel.ticks - 1 - this.head : 0); }

  play(yes) { this.playing = yes; this.parts.play.textContent = yes ? "❚❚" : "▶"; }

  seek(head) { this.play(false); this.head = Math.max(0, Math.min(this.reel.ticks - 1, head)); }

  async nextIteration() {
    const next = this.kept.find(number => number > this.iteration);
    if (next === undefined) return this.training ? this.openLive() : this.play(false);
    this.turning = true;
    try { await this.openIteration(next); } finally { this.turning = false; }
  }

  // ---- the clock: nothing happens while the page is hidden or the cars are out of sight ---------------------------

  observe() {
    this.inSight = true;
    new IntersectionObserver(([seen]) => { this.inSight = seen.isIntersecting; this.wake(); }).observe(this.parts.map);
    new ResizeObserver(() => {   // drawn at once: on paper no other picture follows
      if (this.track && this.map.place?.wide !== this.parts.map.parentElement.clientWidth && this.map.lay(this.track) && this.reel) this.draw();
    }).observe(this.parts.map.parentElement);
    document.addEventListener("visibilitychange", () => this.wake());
  }

  get awake() { return !document.hidden && this.inSight; }

  wake() { if (this.awake && this.sleeping) { this.sleeping = false; this.turnedAt = performance.now(); this.turn(this.turnedAt); } }

  get pictures() {   // a second
    if (LITTLE_MOTION.matches) return SLOW_PICTURES;
    return this.training && navigator.hardwareConcurrency <= FEW_PROCESSORS ? PICTURES_BESIDE_TRAINING : PICTURES;
  }

  turn(now) {
    if (!this.awake) { this.sleeping = true; return; }
    const step = 1000 / this.pictures, late = now - (this.due ?? now);
    this.due = late < step ? now - late + step : now + step;   // an even pace; a frame of its own for each picture costs as much as drawing it
    setTimeout(() => this.turn(performance.now()), this.due - now);
    const past = Math.min(LITTLE_MOTION.matches ? 0.6 : 0.1, (now - (this.turnedAt ?? now)) / 1000);
    this.turnedAt = now;
    this.goForward(past);
    if (this.reel && this.map.place) { this.draw(); this.showView(); this.tellMoment(now); this.look(now); }
  }

  goForward(past) {
    if (this.mode === "live" && this.left() < AHEAD * TICKS * this.pace) this.feedLive();
    if (this.mode === "live" && this.coming.length && (!this.reel || (this.playing && this.head >= this.reel.ticks - 1)))
      this.begin(this.coming.shift(), "live");
    if (!this.reel || !this.playing) return;
    const end = this.reel.ticks - 1;
    if (this.head < end) this.head = Math.min(end, this.head + past * TICKS * this.pace);
    else if (this.mode === "iteration" && !this.turning) this.nextIteration();
    else if (this.mode === "episode") this.play(false);
  }

  showView() {   // with a picture of the map, so that both are one change of the page
    const { view, parts: { eye } } = this;
    if (!view) return;
    this.view = null; eye.hidden = false;
    if (eye.width !== view.width) { eye.width = view.width; eye.height = view.height; }
    this.eye.drawImage(view, 0, 0);
    view.close();
  }

  draw() {
    const cars = this.here(), moment = `${this.head} ${this.car} ${this.mode}`;
    if (moment === this.drawn && this.drawnPlace === this.map.place) return;
    this.drawn = moment; this.drawnPlace = this.map.place;
    this.map.draw(this.reel, this.head, cars, cars.find(car => car.name === this.car), this.courses[this.course].objects, this.mode === "episode");
  }

  // ---- courses ----------------------------------------------------------------------------------------------------

  courseOf(car) {
    return Math.max(0, this.courses.findIndex(one => one.worlds == null || (car.world >= one.first && car.world < one.first + one.worlds)));
  }

  here() { return this.reel ? this.reel.cars.filter(car => this.courseOf(car) === this.course) : []; }

  async go(course) {
    this.course = course; this.parts.course.value = course;
    const track = this.tracks[course] ??= await ask(`${this.from}api/track?course=${course}`);
    if (this.course === course && this.track !== track) { this.track = track; this.map.lay(track); }
  }

  layCourses() {
    this.parts.course.hidden = this.courses.length < 2;
    this.parts.course.replaceChildren(...this.courses.map((one, c) => new Option(one.label, c)));
  }

  async chooseCourse(course) {
    await this.go(course);
    const first = this.here()[0];
    this.choose(first ? first.name : "");
  }

  // ---- the chosen car ---------------------------------------------------------------------------------------------

  choose(name) { this.car = name; this.tellCars(); this.times = {}; }

  tellCars() {
    const list = this.parts.cars, cars = this.here();
    if (list.children.length !== cars.length || cars.some((car, c) => list.children[c].name !== car.name)) {
      list.replaceChildren(...cars.map(car => {
        const button = document.createElement("button"), slot = document.createElement("span");
        button.type = "button"; button.name = car.name; slot.className = "slot"; slot.append(document.createElement("i"));
        button.append(car.name, slot); button.onclick = () => this.choose(car.name);
        return button;
      }));
    }
    for (const button of list.children) button.setAttribute("aria-pressed", button.name === this.car);
  }

  tellMoment(now) {
    const due = (what, ms) => now - (this.times[what] ?? -ms) >= ms && ((this.times[what] = now), true);
    const i = Math.floor(this.head);
    if (due("cars", CARS_MS)) {
      const cars = this.here();
      [...this.parts.cars.children].forEach((button, c) => { if (cars[c]) fill(button.querySelector("i"), cars[c].progress[i] / 100); });
    }
    if (!due("figures", this.training ? FIGURES_BESIDE_TRAINING_MS : FIGURES_MS)) return;
    this.tellTime(i);
    const car = this.reel.cars.find(one => one.name === this.car), { parts } = this;
    if (!car || car.x[i] == null) return;
    const degrees = Math.round(car.steering[i] * 180 / Math.PI), share = car.steering[i] / this.widest;
    say(parts.driver, t("Car {name}", { name: car.name }));
    say(parts.speed, words(car.speed[i], 2)); fill(parts["speed-bar"], Math.abs(car.speed[i]) / this.reel.top);
    say(parts.steer, !degrees ? t("straight") : degrees > 0 ? t("{degrees}° left", { degrees }) : t("{degrees}° right", { degrees: -degrees }));
    parts["steer-bar"].style.transform = `translateX(50%) scaleX(${-0.5 * share})`;
    say(parts.progress, `${words(Math.max(0, car.progress[i]), 1)} %`); fill(parts["progress-bar"], car.progress[i] / 100);
    say(parts.lap, words(car.tick[i] / TICKS, 1)); say(parts.paid, words(car.reward[i], 2)); say(parts.number, String(car.episode[i]));
  }

  tellTime(i) {
    const { parts, reel } = this, live = this.mode === "live";
    parts.head.max = reel.ticks - 1;
    if (document.activeElement !== parts.head || this.playing) parts.head.value = i;
    say(parts.time, live ? t("tick {tick}", { tick: words(reel.last - reel.ticks + 1 + i) }) : `${words(i / TICKS, 1)} / ${words((reel.ticks - 1) / TICKS, 1)} s`);
    const waits = live && this.playing && this.head >= reel.ticks - 1;
    const why = this.pace > 1 ? t("live: waits, {pace}× is faster than it drives …", { pace: this.pace }) : t("live: it is learning, judging or at its next tick …");
    parts.badge.classList.toggle("live", live);
    say(parts.badge, live ? (waits ? why : t("live")) : this.mode === "episode" ? t("car {car}, episode {episode}", this.chosen) : t("iteration {number}", { number: this.iteration }));
  }

  async look(now) {   // the chosen car's camera
    if (this.looking || (this.playing && now - (this.looked ?? 0) < (this.training ? CAMERA_BESIDE_TRAINING_MS : CAMERA_MS))) return;
    const car = this.reel.cars.find(one => one.name === this.car), at = car && pose(car, Math.floor(this.head));
    if (!at) return;
    const things = standing(this.reel, car, this.head), objects = things.length ? `&objects=${things.map(one => one.join()).join(";")}` : "";
    const way = `${this.from}${this.raw ? "policy.png" : "camera.jpg"}?course=${this.course}&x=${at[0]}&y=${at[1]}&yaw=${at[2]}${objects}`;
    if (way === this.seen) return;
    this.looking = true; this.seen = way; this.looked = now;
    try {
      const answer = await fetch(way);
      if (answer.ok) this.view = await createImageBitmap(await answer.blob());
    } catch { /* the feed says that the server is gone */ }
    this.looking = false;
  }

  // ---- iterations and episodes ------------------------------------------------------------------------------------

  tellIterations() {
    const { kept, parts, mode } = this, k = kept.indexOf(this.iteration);
    parts.live.disabled = !this.training; parts.live.setAttribute("aria-pressed", mode === "live");
    parts.iteration.max = Math.max(0, kept.length - 1); parts.iteration.disabled = !kept.length;
    if (mode === "live") parts.iteration.value = kept.length - 1; else if (k >= 0) parts.iteration.value = k;
    parts.before.disabled = !kept.length || (mode !== "live" && k <= 0);
    parts.behind.disabled = mode === "live" || k < 0 || k >= kept.length - 1;
    say(parts.which, !kept.length ? t("no iteration is kept yet") : mode === "live" ? t("{count} iterations kept", { count: kept.length })
      : t("iteration {number} of {last}", { number: this.iteration, last: kept.at(-1) }));
  }

  tellEpisodes() {
    const { parts, episodes } = this, going = one => one.status === "in_progress";
    parts.kept.hidden = this.mode === "live" || !episodes.length;
    say(parts["kept-title"], t("Episodes in iteration {number}", { number: this.iteration }));
    const order = [...episodes].sort((a, b) => +going(a) - +going(b) || b.progress - a.progress);
    parts.episodes.replaceChildren(...order.map(one => {
      const row = document.createElement("tr"), button = document.createElement("button");
      button.type = "button"; button.textContent = `▶ ${one.car}`;
      button.setAttribute("aria-label", t("play episode {episode} of car {car}", one));
      button.onclick = () => this.openEpisode(one);
      row.insertCell().append(button);
      for (const text of [`${words(one.progress, 1)} %`, words(one.reward, 1), one.steps]) { const cell = row.insertCell(); cell.className = "right"; cell.textContent = text; }
      row.insertCell().textContent = ENDINGS[one.status] || one.status;
      row.classList.toggle("chosen", this.mode === "episode" && one === this.chosen);
      return row;
    }));
  }

  stepIteration(by) {
    const k = this.mode === "live" ? this.kept.length : this.kept.indexOf(this.iteration), next = this.kept[k + by];
    if (next !== undefined) this.openIteration(next);
  }

  // ---- hands ------------------------------------------------------------------------------------------------------

  listen() {
    const { parts } = this;
    parts.map.onclick = event => {
      const box = parts.map.getBoundingClientRect();
      const car = this.reel && this.map.nearest(event.clientX - box.left, event.clientY - box.top, this.here(), this.head);
      if (car) this.choose(car.name);
    };
    parts.all.onclick = () => this.openIteration(this.iteration);
    parts.play.onclick = () => {
      if (!this.playing && this.mode === "episode" && this.head >= this.reel.ticks - 1) this.head = 0;
      this.play(!this.playing);
    };
    parts.head.oninput = () => this.seek(+parts.head.value);
    parts.pace.onchange = () => { this.pace = +parts.pace.value; };
    parts.live.onclick = () => this.openLive();
    parts.before.onclick = () => this.stepIteration(-1);
    parts.behind.onclick = () => this.stepIteration(1);
    parts.iteration.oninput = () => { const number = this.kept[+parts.iteration.value]; if (number !== undefined) say(parts.which, t("iteration {number}", { number })); };
    parts.iteration.onchange = () => { const number = this.kept[+parts.iteration.value]; if (number !== undefined) this.openIteration(number); };
    parts.course.onchange = () => this.chooseCourse(+parts.course.value);
    parts.eyes.onclick = () => { this.raw = !this.raw; parts.eyes.setAttribute("aria-pressed", this.raw); parts.eye.classList.toggle("raw", this.raw); this.looked = 0; };
    document.addEventListener("rc-choose", event => { if (this.kept.includes(event.detail.x)) this.openIteration(event.detail.x); });
    document.addEventListener("keydown", event => this.press(event));
  }

  press(event) {
    if (!this.reel || event.ctrlKey || event.metaKey || event.altKey || /INPUT|SELECT|TEXTAREA/.test(event.target.tagName)) return;
    if (event.key === " " && event.target.tagName === "BUTTON") return;   // it is pressed, as everywhere
    const names = this.here().map(car => car.name), k = names.indexOf(this.car);
    const acts = { " ": () => this.parts.play.click(), ArrowRight: () => this.seek(Math.floor(this.head) + 1), ArrowLeft: () => this.seek(Math.ceil(this.head) - 1),
      ArrowDown: () => this.choose(names[(k + 1) % names.length]), ArrowUp: () => this.choose(names[(k + names.length - 1) % names.length]),
      ",": () => this.stepIteration(-1), ".": () => this.stepIteration(1), l: () => { if (this.training) this.openLive(); } };
    if (acts[event.key]) { event.preventDefault(); acts[event.key](); }
  }
}

const say = (part, text) => { if (part.textContent !== text) part.textContent = text; };
const fill = (bar, share) => { bar.style.transform = `scaleX(${Math.max(0, Math.min(1, share)).toFixed(3)})`; };
const nearest = (all, wanted) => all.reduce((best, one) => Math.abs(one - wanted) < Math.abs(best - wanted) ? one : best);

customElements.define("rc-cars", Cars);
