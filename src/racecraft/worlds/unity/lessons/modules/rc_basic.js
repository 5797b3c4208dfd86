/* <rc-basic>: Unity's Basic by hand. The row is what an agent is given: twenty numbers, a 1 where it stands. A prize shows
   once it was found. */
import { t } from "racecraft.pages/texts.js";
import { Played, button, element, facts, figure } from "racecraft.lessons/parts.js";
import { LEFT, MOST_STEPS, PLACES, RIGHT, STAY, play, prizeAt } from "racecraft.worlds.unity.lessons/basic.js";

const KEYS = { ArrowLeft: LEFT, ArrowRight: RIGHT, ArrowDown: STAY };

class BasicFigure extends Played {
  begin() {
    this.found = new Set();
    this.classList.add("long");
    this.style.setProperty("--columns", String(PLACES));
    this.lay(KEYS, [[LEFT, `← ${t("left")}`], [STAY, t("stay")], [RIGHT, `→ ${t("right")}`]], t("The line of twenty places; arrow keys move the agent"), t("Move the agent"), button(t("New episode"), () => this.anew(), "plain"));
  }

  move(action) {
    if (play(this.moves).ended || this.moves.length >= MOST_STEPS) return;
    this.moves.push(action);
    const { place, ended } = play(this.moves);
    if (ended) this.found.add(place);
    this.draw();
  }

  draw() {
    const episode = play(this.moves), visited = new Set(episode.places);
    this.facts.replaceChildren(facts([[figure(episode.total), t("return so far")], [episode.steps, t("steps")]]));
    const heads = Array.from({ length: PLACES }, (_, place) => element("th", { scope: "col" }, place));
    const cells = Array.from({ length: PLACES }, (_, place) => this.cell(place, episode.place, visited));
    this.table.replaceChildren(element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, element("tr", {}, ...cells)));
    this.said.textContent = this.sentence(episode);
    const at = cells[episode.place];
    this.place.scrollLeft = at.offsetLeft - (this.place.clientWidth - at.offsetWidth) / 2;
  }

  cell(place, agent, visited) {
    const kinds = [place === agent ? "car" : "", visited.has(place) ? "path" : "", this.found.has(place) ? "goal" : ""];
    const prize = this.found.has(place) ? [element("span", { class: "pays" }, figure(prizeAt(place)))] : [];
    return element("td", { class: kinds.join(" ").trim() }, element("span", { class: "worth" }, place === agent ? "1" : "0"), ...prize);
  }

  sentence({ place, steps, total, ended }) {
    if (ended) return t("The episode ended at place {place}: {steps} steps, a return of {total}.", { place, steps, total: figure(total) });
    return t("The agent is at place {place}.", { place });
  }
}

customElements.define("rc-basic", BasicFigure);
