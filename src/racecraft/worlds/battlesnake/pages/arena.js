/* The board of an arena, asked for every two seconds. */
// What is told stands in worlds/battlesnake/serving/arena_server.py: /api/board and /api/games.
import { t } from "racecraft.pages/texts.js";

const at = (id) => document.getElementById(id);
const EVERY_MS = 2000;
let told = null, size = 0, chosen = "", shown = [], drawn = "";

const element = (kind, text, name) => {
  const made = document.createElement(kind);
  if (text !== undefined) made.textContent = text;
  if (name) made.className = name;
  return made;
};
const sizeName = (snakes) => ({ 0: t("All games"), 2: t("Duels"), 3: t("Threes"), 4: t("Fours") })[snakes] || t("{count} snakes", { count: snakes });
const table = () => told.tables.find((one) => one.snakes === size);

function drawHead() {
  const { terms } = told, values = { ...terms, timeout: terms.timeout_ms };
  at("terms").textContent = terms.map === "standard" ? t("{width}×{height}, {ruleset}, {timeout} ms a move", values)
    : t("{width}×{height}, {ruleset}, map {map}, {timeout} ms a move", values);
  at("playing").hidden = !told.playing;
  at("sizes").replaceChildren(...told.tables.map((one) => {
    const button = element("button", `${sizeName(one.snakes)} (${one.games})`);
    button.setAttribute("aria-pressed", String(one.snakes === size));
    button.id = `size-${one.snakes}`;
    button.onclick = () => { size = one.snakes; draw(); askGames(); };
    return button;
  }));
}

function drawRatings() {
  const lines = table().lines, anchors = lines.filter((one) => one.is_anchor);
  at("empty").hidden = told.last_game > 0;
  at("scale").textContent = anchors.length ? t("the anchors' mean is 1500") : t("the mean is 1500");
  const low = Math.min(...lines.map((one) => one.rating.low)), high = Math.max(...lines.map((one) => one.rating.high));
  const place = (points) => `${100 * (points - low) / Math.max(1, high - low)}%`;
  at("ratings").tBodies[0].replaceChildren(...lines.map((line, n) => {
    const row = element("tr", undefined, `${line.rests ? "rests" : ""} ${line.name === chosen ? "chosen" : ""}`);
    const name = element("td", line.name, "left name");
    name.title = line.source;
    name.tabIndex = 0;
    name.onclick = () => { chosen = chosen === line.name ? "" : line.name; draw(); askGames(); };
    name.onkeydown = (event) => { if (event.key === "Enter") name.onclick(); };
    if (line.is_anchor) name.append(element("span", t("anchor"), "tag"));
    if (line.rests) name.append(element("span", t("removed"), "tag"));
    const span = element("div", undefined, "span"), bar = element("i"), dot = element("b"), mean = element("u");
    bar.style.left = place(line.rating.low);
    bar.style.width = `calc(${place(line.rating.high)} - ${place(line.rating.low)})`;
    dot.style.left = place(line.rating.points);
    mean.style.left = place(Math.min(high, Math.max(low, 1500)));
    span.append(mean, bar, dot);
    span.title = t("{low} to {high}", { low: Math.round(line.rating.low), high: Math.round(line.rating.high) });
    const cell = element("td", undefined, "left");
    cell.append(span);
    const half = Math.round((line.rating.high - line.rating.low) / 2);
    const won = line.games ? `${Math.round(100 * line.wins / line.games)} %` : "–";
    const share = element("td", won);
    share.title = t("95 %: {low} to {high} %", { low: Math.round(100 * line.win_rate_low), high: Math.round(100 * line.win_rate_high) });
    row.append(element("td", n + 1, "left quiet"), name, element("td", `${Math.round(line.rating.points)} ± ${half}`, "left"),
      cell, element("td", line.games), share, element("td", line.timeouts, line.timeouts ? "fault" : "quiet"),
      element("td", line.crashes, line.crashes ? "fault" : "quiet"));
    return row;
  }));
}

function drawMet() {
  const { lines, met } = table(), head = element("tr");
  head.append(element("th", t("player"), "left"), ...lines.map((_, n) => element("th", n + 1)));
  at("met").replaceChildren(head, ...met.map((row, n) => {
    const made = element("tr");
    made.append(element("th", `${n + 1} ${lines[n].name}`, "left"), ...row.map(([won, drawn, lost], m) => {
      const games = won + drawn + lost, cell = element("td", games ? `${won}-${drawn}-${lost}` : n === m ? "" : "·");
      if (!games) { cell.className = "quiet"; return cell; }
      const share = (won + drawn / 2) / games, strength = Math.abs(share - 0.5) * Math.min(1, games / 8);
      cell.style.background = `rgba(var(--${share >= 0.5 ? "win" : "loss"}), ${strength.toFixed(3)})`;
      cell.title = t("{name} against {other}: {share} % of {games}", { name: lines[n].name, other: lines[m].name, share: Math.round(100 * share), games });
      return cell;
    }));
    return made;
  }));
}

function drawGames(more) {
  at("whose").textContent = [chosen && t("of {name}", { name: chosen }), size && sizeName(size).toLowerCase()].filter(Boolean).join(", ");
  at("more").hidden = !more;
  at("games").replaceChildren(...shown.map((game) => {
    const row = element("li"), who = element("span", undefined, "who"), watch = element("a", t("watch"));
    const order = game.players.map((name, seat) => [game.places[seat], name, seat]).sort((a, b) => a[0] - b[0]);
    const alone = game.places.filter((place) => place === 0).length === 1;
    order.forEach(([place, name, seat], n) => {
      if (n) who.append(place === order[n - 1][0] ? " = " : " › ");
      who.append(element("span", name, place === 0 && alone ? "first" : ""));
      const faults = game.timeouts[seat] + game.crashes[seat];
      if (faults) who.append(element("span", " " + t("({count} missed)", { count: faults }), "fault"));
    });
    watch.href = `/game?number=${game.game}`;
    watch.target = "_blank";
    row.append(element("span", game.game, "number"), who, element("span", t("{count} turns", { count: game.turns }), "quiet"),
      element("span", new Date(game.ended * 1000).toLocaleString(), "quiet"), watch);
    return row;
  }));
}

function draw() {
  drawHead();
  drawRatings();
  drawMet();
}

async function ask(way) {
  const answer = await fetch(way);
  if (!answer.ok) throw new Error(way);
  return answer.json();
}

async function askGames(before) {
  const asked = new URLSearchParams({ snakes: String(size), player: chosen, ...(before ? { before } : {}) });
  const wanted = `${size} ${chosen}`;
  const { games, more } = await ask(`/api/games?${asked}`);
  if (wanted !== `${size} ${chosen}`) return;
  shown = before ? [...shown, ...games] : games;
  drawGames(more);
}

async function look() {
  try {
    const now = await ask("/api/board"), text = JSON.stringify(now);
    at("gone").hidden = true;
    if (text !== drawn) {
      const newer = !told || told.last_game !== now.last_game;
      told = now, drawn = text;
      draw();
      if (newer && shown.length <= 30) await askGames();
    }
  } catch { at("gone").hidden = false; }
  setTimeout(look, EVERY_MS);
}
at("more").onclick = () => askGames(shown[shown.length - 1].game);
look();
