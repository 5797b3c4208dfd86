/* <rc-ghosts>: plays a lap and its reference on the map; both cross the start line at the same moment. A point chosen in
   a chart of the page (`rc-choose`, metres along the lap) moves both there. */
import { t } from "racecraft.pages/texts.js";

class Ghosts extends HTMLElement {
  connectedCallback() {
    if (this.told) return;
    this.told = JSON.parse(this.querySelector("script[type='application/json']").textContent);
    const cars = this.querySelectorAll(".car");
    this.other = cars[0]; this.car = cars[1];
    this.slider = this.querySelector("input"); this.output = this.querySelector("output"); this.button = this.querySelector(".play");
    this.querySelector(".player").hidden = false;
    this.car.removeAttribute("hidden"); this.other.removeAttribute("hidden");
    this.slider.addEventListener("input", () => this.stop(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.timer ? this.stop(this.tick) : this.play());
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
    for (const [car, path] of [[this.car, this.told.lap], [this.other, this.told.reference]]) {
      const [x, y, degrees] = path[Math.min(row, path.length - 1)];
      car.setAttribute("transform", `translate(${x} ${y}) rotate(${degrees})`);
    }
    this.slider.value = row;
    this.output.textContent = `${(row * this.told.tick).toFixed(2)} s`;
  }

  stop(tick) {
    cancelAnimationFrame(this.timer);
    this.timer = null;
    this.button.querySelector("span").textContent = t("Play");
    this.show(tick);
  }

  play() {
    const from = this.tick >= this.told.ticks - 1 ? 0 : this.tick, begun = performance.now();
    this.button.querySelector("span").textContent = t("Stop");
    const step = now => {
      const tick = from + (now - begun) / 1000 / this.told.tick;
      if (tick >= this.told.ticks - 1) return this.stop(this.told.ticks - 1);
      this.show(tick);
      this.timer = requestAnimationFrame(step);
    };
    this.timer = requestAnimationFrame(step);
  }
}

customElements.define("rc-ghosts", Ghosts);
export { Ghosts };
