/* <rc-ghosts>: plays laps on the map of their track. All cross the start line at the same moment; where there is a choice,
   they can end at the same moment instead. They are played as fast as they were driven, or by another pace. A point
   chosen in a chart of the page (`rc-choose`, metres along the lap) moves all there. */
import { t } from "racecraft.pages/texts.js";

const LITTLE_MOTION = matchMedia("(prefers-reduced-motion: reduce)"), LONG_STEP = 0.5;   // s between two moments then

class Ghosts extends HTMLElement {
  connectedCallback() {
    if (this.told) return;
    this.told = JSON.parse(this.querySelector("script[type='application/json']").textContent);
    this.cars = [...this.querySelectorAll(".car")]; this.order = this.querySelector(".order"); this.pace = this.querySelector(".pace");
    this.slider = this.querySelector("input"); this.output = this.querySelector("output"); this.button = this.querySelector(".play");
    this.querySelector(".player").hidden = false;
    for (const car of this.cars) car.removeAttribute("hidden");
    this.slider.addEventListener("input", () => this.stop(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.timer ? this.stop(this.tick) : this.play());
    this.order?.addEventListener("change", () => this.show(this.tick));
    document.addEventListener("rc-choose", this.choose = event => this.stop(this.tickAt(event.detail.x)));
    this.show(0);
  }

  disconnectedCallback() {
    document.removeEventListener("rc-choose", this.choose);
    cancelAnimationFrame(this.timer);
  }

  tickAt(metres) {
    const row = this.told.metres.findIndex(one => one >= metres);
    return row < 0 ? this.told.ticks - 1 : row;
  }

  show(tick) {
    this.tick = tick;
    const row = Math.floor(tick);
    this.told.cars.forEach((path, k) => {
      const late = this.order?.value === "end" ? this.told.ticks - path.length : 0;
      const [x, y, degrees] = path[Math.max(0, Math.min(row - late, path.length - 1))];
      this.cars[k].setAttribute("transform", `translate(${x} ${y})`);   // a number beside the car stands upright
      this.cars[k].querySelector("path").setAttribute("transform", `rotate(${degrees})`);
    });
    this.slider.value = row;
    this.output.textContent = `${(row * this.told.tick).toFixed(2)} s`;
    this.slider.setAttribute("aria-valuetext", this.output.textContent);
  }

  stop(tick) {
    cancelAnimationFrame(this.timer);
    this.timer = null;
    this.button.querySelector("span").textContent = t("Play");
    this.show(tick);
  }

  play() {
    let tick = this.tick >= this.told.ticks - 1 ? 0 : this.tick, before = performance.now();
    this.button.querySelector("span").textContent = t("Stop");
    const step = now => {
      tick += Number(this.pace.value) * (now - before) / 1000 / this.told.tick;
      before = now;
      if (tick >= this.told.ticks - 1) return this.stop(this.told.ticks - 1);
      if (!LITTLE_MOTION.matches || (tick - this.tick) * this.told.tick >= LONG_STEP) this.show(tick);
      this.timer = requestAnimationFrame(step);
    };
    this.timer = requestAnimationFrame(step);
  }
}

customElements.define("rc-ghosts", Ghosts);
export { Ghosts };
