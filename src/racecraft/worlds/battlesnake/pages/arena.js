/* The board of an arena, asked for every two seconds. */
// What is told stands in worlds/battlesnake/serving/arena_server.py: /api/board and /api/games.
const at = (id) => document.getElementById(id);
const EVERY_MS = 2000;
let told = null, size = 0, chosen = "", shown = [], drawn = "";

const element = (kind, text, name) => {
  const made = document.createElement(kind);
  if (text !== undefined) made.textContent = text;
  if (name) made.className = name;
  return made;
};
const sizeName = (snakes) => ({ 0: "All games", 2: "Duels", 3: "Threes", 4: "Fours" })[snakes] || `${snakes} snakes`;
const table = () => told.tables.find((one) => one.snakes === size);

function drawHead() {
  const terms = told.terms, map = terms.map === "standard" ? "" : `, map ${terms.map}`;
  at("terms").textContent = `${terms.width}×${terms.height}, ${terms.ruleset}${map}, ${terms.timeout_ms} ms a move`;
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
  at("scale").textContent = anchors.length ? `the anchors' mean is 1500` : "the mean is 1500";
  const low = Math.min(...lines.map((one) => one.rating.low)), high = Math.max(...lines.map((one) => one.rating.high));
  const place = (points) => `${100 * (points - low) / Math.max(1, high - low)}%`;
  at("ratings").tBodies[0].replaceChildren(...lines.map((line, n) => {
    const row = element("tr", undefined, `${line.rests ? "rests" : ""} ${line.name === chosen ? "chosen" : ""}`);
    const name = element("td", line.name, "left name");
    name.title = line.source;
    name.tabIndex = 0;
    name.onclick = () => { chosen = chosen === line.name ? "" : line.name; draw(); askGames(); };
    name.onkeydown = (event) => { if (event.key === "Enter") name.onclick(); };
    if (line.is_anchor) name.append(element("span", "anchor", "tag"));
    if (line.rests) name.append(element("span", "removed", "tag"));
    const span = element("div", undefined, "span"), bar = element("i"), dot = element("b"), mean = element("u");
    bar.style.left = place(line.rating.low);
    bar.style.width = `calc(${place(line.rating.high)} - ${place(line.rating.low)})`;
    dot.style.left = place(line.rating.points);
    mean.style.left = place(Math.min(high, Math.max(low, 1500)));
    span.append(mean, bar, dot);
    span.title = `${Math.round(line.rating.low)} to ${Math.round(line.rating.high)}`;
    const cell = element("td", undefined, "left");
    cell.append(span);
    const half = Math.round((line.rating.high - line.rating.low) / 2);
    const won = line.games ? `${Math.round(100 * line.wins / line.games)} %` : "–";
    const share = element("td", won);
    share.title = `95 %: ${Math.round(100 * line.win_rate_low)} to ${Math.round(100 * line.win_rate_high)} %`;
    row.append(element("td", n + 1, "left quiet"), name, element("td", `${Math.round(line.rating.points)} ± ${half}`, "left"),
      cell, element("td", line.games), share, element("td", line.timeouts, line.timeouts ? "fault" : "quiet"),
      element("td", line.crashes, line.crashes ? "fault" : "quiet"));
    return row;
  }));
}

function drawMet() {
  const { lines, met } = table(), head = element("tr");
  head.append(element("th", "player", "left"), ...lines.map((_, n) => element("th", n + 1)));
  at("met").replaceChildren(head, ...met.map((row, n) => {
    const made = element("tr");
    made.append(element("th", `${n + 1} ${lines[n].name}`, "left"), ...row.map(([won, drawn, lost], m) => {
      const games = won + drawn + lost, cell = element("td", games ? `${won}-${drawn}-${lost}` : n === m ? "" : "·");
      if (!games) { cell.className = "quiet"; return cell; }
      const share = (won + drawn / 2) / games, strength = Math.abs(share - 0.5) * Math.min(1, games / 8);
      cell.style.background = `rgba(var(--${share >= 0.5 ? "win" : "loss"}), ${strength.toFixed(3)})`;
      cell.title = `${lines[n].name} against ${lines[m].name}: ${Math.round(100 * share)} % of ${games}`;
      return cell;
    }));
    return made;
  }));
}

function drawGames(more) {
  at("whose").textContent = [chosen && `of ${chosen}`, size && sizeName(size).toLowerCase()].filter(Boolean).join(", ");
  at("more").hidden = !more;
  at("games").replaceChildren(...shown.map((game) => {
    const row = element("li"), who = element("span", undefined, "who"), watch = element("a", "watch");
    const order = game.players.map((name, seat) => [game.places[seat], name, seat]).sort((a, b) => a[0] - b[0]);
    const alone = game.places.filter((place) => place === 0).length === 1;
    order.forEach(([place, name, seat], n) => {
      if (n) who.append(place === order[n - 1][0] ? " = " : " › ");
      who.append(element("span", name, place === 0 && alone ? "first" : ""));
      const faults = game.timeouts[seat] + game.crashes[seat];
      if (faults) who.append(element("span", ` (${faults} missed)`, "fault"));
    });
    watch.href = `/game?number=${game.game}`;
    watch.target = "_blank";
    row.append(element("span", game.game, "number"), who, element("span", `${game.turns} turns`, "quiet"),
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
