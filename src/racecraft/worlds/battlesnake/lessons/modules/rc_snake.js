/* <rc-snake>: a board of seven by seven. Arrow keys or buttons move the snake; a list of moves is what exercises take. */
import { t } from "racecraft.pages/texts.js";
import { Played, button, element, facts } from "racecraft.lessons/parts.js";
import { MOST_TURNS, MOVES, SIDE, play, same } from "racecraft.worlds.battlesnake.lessons/game.js";

const ARROWS = { up: "↑", down: "↓", left: "←", right: "→" };
const NAMES = { up: t("up"), down: t("down"), left: t("left"), right: t("right") };
const ENDS = {
  "out-of-health": t("it has starved"), "wall-collision": t("it has left the board"),
  "snake-self-collision": t("it has run into itself"), "snake-collision": t("it has run into the other snake's body"),
  "head-collision": t("two heads have met"),
};

class SnakeFigure extends Played {
  begin() {
    const keys = Object.fromEntries(MOVES.map(move => [`Arrow${move[0].toUpperCase()}${move.slice(1)}`, move]));
    this.lay(keys, MOVES.map(move => [move, `${ARROWS[move]} ${NAMES[move]}`]), t("The board; arrow keys move the snake"), t("Move the snake"),
      button(t("Take back"), () => { this.moves.pop(); this.draw(); }, "plain"), button(t("New game"), () => this.anew(), "plain"));
    this.table.style.maxWidth = "460px";   // so that its squares are square
  }

  move(move) {
    const board = play(this.moves);
    if (!board.snakes[0].cause && board.turn < MOST_TURNS) this.moves.push(move);
    this.draw();
  }

  draw() {
    const board = play(this.moves), [you, other] = board.snakes;
    this.facts.replaceChildren(facts([[board.turn, t("turn")], [you.health, t("health")], [you.body.length, t("your length")], [other.cause ? "–" : other.body.length, t("the other's length")]]));
    const rows = Array.from({ length: SIDE }, (_, k) => element("tr", {}, ...Array.from({ length: SIDE }, (_, x) => this.square(board, [x, SIDE - 1 - k]))));
    this.table.replaceChildren(element("tbody", {}, ...rows));
    this.said.textContent = this.sentence(you, other);
  }

  sentence(you, other) {
    if (you.cause) return t("Your snake is out: {reason}.", { reason: ENDS[you.cause] });
    if (other.cause) return t("The other snake is out: {reason}.", { reason: ENDS[other.cause] });
    return t("Your head is in column {x}, row {y} from below.", { x: you.body[0][0] + 1, y: you.body[0][1] + 1 });
  }

  square(board, point) {
    const [text, kind, name] = this.content(board, point);
    return element("td", { class: kind, "aria-label": name }, text);
  }

  content(board, point) {
    const living = board.snakes.filter(one => !one.cause), names = { you: t("your"), other: t("the other's") };
    for (const one of living) if (same(one.body[0], point)) return one.id === "you" ? ["●", "car", t("your head")] : ["○", "stop path", t("the other's head")];
    for (const one of living) if (one.body.some(part => same(part, point))) return one.id === "you" ? ["▪", "path", names.you] : ["▫", "stop", names.other];
    return board.food.some(one => same(one, point)) ? ["◆", "goal", t("food")] : ["", "", t("free")];
  }
}

customElements.define("rc-snake", SnakeFigure);
