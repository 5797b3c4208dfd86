/* Episodes on the map and on a chart: choose, zoom, drag, hover, play. */
import { t } from "racecraft.pages/texts.js";
import { onTokens, token } from "racecraft.pages/tokens.js";

(() => {
  const data = JSON.parse(document.querySelector("#log-data script").textContent);
  const byId = (name) => document.getElementById(name);
  const unpack = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Int16Array.from({ length: bytes.length / 2 }, (_, k) => view.getInt16(2 * k, true));
  };
  const ticks = Object.fromEntries(Object.entries(data.ticks).map(([name, text]) => [name, unpack(text)]));
  const value = (name, k) => (ticks[name][k] === -32768 ? null : ticks[name][k] * data.steps[name]);
  const E = data.episodes;
  const first = [];
  E.ticks.reduce((sum, count, k) => ((first[k] = sum), sum + count), 0);
  const all = E.unique_episode.map((_, k) => k);

  const SHADES = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 222, 56]];
  const shade = (share) => {
    const at = Math.min(0.9999, Math.max(0, share)) * (SHADES.length - 1), k = Math.floor(at), part = at - k;
    return `rgb(${SHADES[k].map((one, i) => Math.round(one + part * (SHADES[k + 1][i] - one))).join()})`;
  };
  const COLOURS = {
    driven_mps: [t("driven speed"), "m/s", 1], speed_mps: [t("commanded speed"), "m/s", 1], reward: [t("reward of a step"), "", 1],
    steering_rad: [t("steering"), "°", 180 / Math.PI], slide_rad: [t("slide"), "°", 180 / Math.PI],
  };
  const limits = Object.fromEntries(Object.entries(COLOURS).map(([name, [, , factor]]) => {
    const times = Number(factor);
    const sorted = Array.from(ticks[name]).filter((one) => one !== -32768).sort((a, b) => a - b);
    const at = (share) => (sorted.length ? sorted[Math.floor(share * (sorted.length - 1))] * data.steps[name] * times : 0);
    return [name, [at(0.02), Math.max(at(0.98), at(0.02) + 1e-6)]];
  }));

  /* ---- the canvases: sharp on every screen, redrawn when asked ---- */
  const fit = (canvas) => {
    const box = canvas.getBoundingClientRect(), dense = window.devicePixelRatio || 1;
    canvas.width = Math.round(box.width * dense);
    canvas.height = Math.round(box.height * dense);
    const pen = canvas.getContext("2d");
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.clearRect(0, 0, box.width, box.height);
    return [pen, box.width, box.height];
  };
  let chosen = [], colour = "driven_mps", at = null, pointed = null;

  /* ---- the map ---- */
  const map = byId("map"), view = { x: 0, y: 0, scale: 1 };
  const everywhere = data.track.outer.concat(data.track.inner);
  const bounds = [0, 1].map((k) => [Math.min(...everywhere.map((p) => p[k])), Math.max(...everywhere.map((p) => p[k]))]);
  const whole = () => {
    const box = map.getBoundingClientRect(), margin = 0.6;
    const [width, height] = bounds.map(([low, high]) => high - low + 2 * margin);
    view.scale = Math.min(box.width / width, box.height / height);
    view.x = (bounds[0][0] + bounds[0][1]) / 2;
    view.y = (bounds[1][0] + bounds[1][1]) / 2;
    home = view.scale;
  };
  let home = 1, size = [1, 1];
  const onMap = (x, y) => [size[0] / 2 + (x - view.x) * view.scale, size[1] / 2 - (y - view.y) * view.scale];
  const line = (pen, points, close) => {
    points.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](...onMap(x, y)));
    if (close) pen.closePath();
  };
  const drawMap = () => {
    const [pen, width, height] = fit(map);
    size = [width, height];
    pen.fillStyle = token("--card");
    pen.fillRect(0, 0, width, height);
    pen.beginPath();
    line(pen, data.track.outer, true);
    line(pen, data.track.inner.slice().reverse(), true);
    pen.fillStyle = token("--slot");
    pen.fill("evenodd");
    pen.strokeStyle = token("--quiet");
    for (const border of [data.track.inner, data.track.outer]) { pen.beginPath(); line(pen, border); pen.stroke(); }
    pen.setLineDash([5, 6]); pen.beginPath(); line(pen, data.track.centre); pen.stroke(); pen.setLineDash([]);
    pen.beginPath(); line(pen, data.track.start);
    pen.strokeStyle = token("--ink"); pen.lineWidth = 2.5; pen.stroke();
    ahead(pen);
    pen.fillStyle = token("--quiet"); pen.font = "11px system-ui, sans-serif"; pen.textAlign = "center";
    const every = Math.max(1, Math.round(data.track.centre.length / Math.min(24, 8 * view.scale / home)));
    data.track.centre.forEach((point, k) => {
      if (k % every || k > data.track.centre.length - every / 2) return;
      const outer = data.track.outer[k], away = [outer[0] - point[0], outer[1] - point[1]];
      const long = Math.hypot(...away) || 1;
      const [x, y] = onMap(outer[0], outer[1]);
      pen.fillText(String(k), x + 11 * away[0] / long, y - 11 * away[1] / long + 4);
    });
    pen.lineWidth = chosen.length > 6 ? 1.6 : 3;
    pen.lineCap = "round";
    const [low, high] = limits[colour], times = COLOURS[colour][2];
    for (const k of chosen) {
      for (let i = first[k] + 1; i < first[k] + E.ticks[k]; i += 1) {
        if (value("driven_mps", i) === null) continue;  /* set down elsewhere: nobody drove there */
        const told = value(colour, i);
        pen.strokeStyle = told === null ? token("--edge") : shade((told * times - low) / (high - low));
        pen.beginPath(); line(pen, [[value("x_m", i - 1), value("y_m", i - 1)], [value("x_m", i), value("y_m", i)]]);
        pen.stroke();
      }
      const last = first[k] + E.ticks[k] - 1;
      if (E.ticks[k] && !E.complete[k]) cross(pen, ...onMap(value("x_m", last), value("y_m", last)));
    }
    for (const i of [at, pointed]) if (i !== null) ring(pen, ...onMap(value("x_m", i), value("y_m", i)));
    legend();
  };
  const ahead = (pen) => {  /* an arrow from the middle of the start line, the way the lap goes */
    const [[ax, ay], [bx, by]] = data.track.start.map((end) => onMap(...end)), [from, to] = data.track.centre.map((p) => onMap(...p));
    const wide = Math.hypot(bx - ax, by - ay) || 1, [x, y] = [(ax + bx) / 2, (ay + by) / 2];
    let [u, v] = [(by - ay) / wide, (ax - bx) / wide];
    if (u * (to[0] - from[0]) + v * (to[1] - from[1]) < 0) [u, v] = [-u, -v];
    const long = Math.min(0.7 * wide, 34), at = (along, aside) => [x + along * u - aside * v, y + along * v + aside * u];
    pen.lineWidth = 1.6; pen.beginPath(); pen.moveTo(...at(0.2 * long, 0)); pen.lineTo(...at(long - 5, 0)); pen.stroke();
    pen.fillStyle = token("--ink"); pen.beginPath();
    for (const [k, corner] of [[long, 0], [long - 8, 4.5], [long - 8, -4.5]].entries()) pen[k ? "lineTo" : "moveTo"](...at(...corner));
    pen.fill();
  };
  const cross = (pen, x, y) => {
    pen.save(); pen.strokeStyle = token("--series-2"); pen.lineWidth = 2.5; pen.beginPath();
    pen.moveTo(x - 5, y - 5); pen.lineTo(x + 5, y + 5); pen.moveTo(x - 5, y + 5); pen.lineTo(x + 5, y - 5);
    pen.stroke(); pen.restore();
  };
  const ring = (pen, x, y) => {
    pen.save(); pen.beginPath(); pen.arc(x, y, 7, 0, 7); pen.fillStyle = token("--series-2"); pen.fill();
    pen.strokeStyle = token("--card"); pen.lineWidth = 2; pen.stroke(); pen.restore();
  };
  const legend = () => {
    const [words, unit] = COLOURS[colour], [low, high] = limits[colour];
    const stops = [0, 1, 2, 3, 4, 5].map((k) => shade(k / 5)).join();
    byId("legend").innerHTML = `<span>${low.toFixed(2)}</span><i style="background:linear-gradient(90deg,${stops})"></i>` +
      `<span>${high.toFixed(2)} ${unit}</span><span class="quiet">${words}; ${t("a cross: left the road")}</span>`;
  };
  const tell = (i) => {
    const k = chosen.find((one) => i >= first[one] && i < first[one] + E.ticks[one]);
    const degrees = (name) => { const told = value(name, i); return told === null ? "–" : (told * 180 / Math.PI).toFixed(1) + "°"; };
    const number = (name, digits) => { const told = value(name, i); return told === null ? "–" : told.toFixed(digits); };
    byId("told").textContent = t("Episode {episode}, step {step}: {driven} m/s ({commanded} commanded), steering {steering}, slide {slide}, reward {reward}, progress {progress} %, waypoint {waypoint}", {
      episode: E.unique_episode[k], step: number("tick", 0), driven: number("driven_mps", 2), commanded: number("speed_mps", 2),
      steering: degrees("steering_rad"), slide: degrees("slide_rad"), reward: number("reward", 3),
      progress: (100 * value("progress_share", i)).toFixed(1), waypoint: number("waypoint", 0) });
  };
  const nearest = (x, y) => {  /* the step at the nearer end of the piece of path that is pointed at */
    let best = null, gap = 16 * 16;
    for (const k of chosen) for (let i = first[k] + 1; i < first[k] + E.ticks[k]; i += 1) {
      const [ax, ay] = onMap(value("x_m", i - 1), value("y_m", i - 1)), [bx, by] = onMap(value("x_m", i), value("y_m", i));
      const long = (bx - ax) ** 2 + (by - ay) ** 2 || 1;
      const share = Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / long));
      const far = (ax + share * (bx - ax) - x) ** 2 + (ay + share * (by - ay) - y) ** 2;
      if (far < gap) [best, gap] = [share < 0.5 ? i - 1 : i, far];
    }
    return best;
  };
  const zoom = (times, x = size[0] / 2, y = size[1] / 2) => {
    const next = Math.min(40 * home, Math.max(0.6 * home, view.scale * times));
    view.x += (x - size[0] / 2) * (1 / view.scale - 1 / next);
    view.y -= (y - size[1] / 2) * (1 / view.scale - 1 / next);
    view.scale = next;
    drawMap();
  };
  const fingers = new Map();
  const place = (event, canvas) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  map.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-0.0016 * event.deltaY), ...place(event, map));
  }, { passive: false });
  map.addEventListener("pointerdown", (event) => { map.setPointerCapture(event.pointerId); fingers.set(event.pointerId, place(event, map)); });
  for (const kind of ["pointerup", "pointercancel", "pointerleave"]) map.addEventListener(kind, (event) => fingers.delete(event.pointerId));
  map.addEventListener("pointermove", (event) => {
    const now = place(event, map), before = fingers.get(event.pointerId);
    if (!before) {
      const found = nearest(...now);
      if (found !== pointed) { pointed = found; if (found !== null) tell(found); drawMap(); }
      return;
    }
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    if (other) {
      const far = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
      zoom(far(now, other[1]) / far(before, other[1]), (now[0] + other[1][0]) / 2, (now[1] + other[1][1]) / 2);
    } else { view.x -= (now[0] - before[0]) / view.scale; view.y += (now[1] - before[1]) / view.scale; drawMap(); }
    fingers.set(event.pointerId, now);
  });
  map.addEventListener("keydown", (event) => {
    const moves = { "+": () => zoom(1.4), "-": () => zoom(1 / 1.4), "0": () => { whole(); drawMap(); },
      ArrowRight: () => step(1), ArrowLeft: () => step(-1) };
    if (moves[event.key]) { event.preventDefault(); moves[event.key](); }
  });
  byId("closer").onclick = () => zoom(1.6);
  byId("farther").onclick = () => zoom(1 / 1.6);
  byId("whole").onclick = () => { whole(); drawMap(); };
  byId("colour").onchange = (event) => { colour = event.target.value; drawMap(); };

  /* ---- step by step, and playing ---- */
  let playing = null;
  const step = (by) => {
    const k = chosen[0];
    if (k === undefined || !E.ticks[k]) return;
    at = Math.min(first[k] + E.ticks[k] - 1, Math.max(first[k], (at ?? first[k] - 1) + by));
    byId("step").value = String(at - first[k]);
    tell(at); drawMap();
    if (playing && at === first[k] + E.ticks[k] - 1) play();
  };
  const play = () => {
    if (playing) { clearInterval(playing); playing = null; } else {
      const k = chosen[0];
      if (k === undefined) return;
      if (at === null || at >= first[k] + E.ticks[k] - 1) at = first[k] - 1;
      playing = setInterval(() => step(1), 1000 / 15);
    }
    byId("play").textContent = playing ? t("Stop") : t("Play");
  };
  byId("play").onclick = play;
  byId("step").oninput = (event) => { const k = chosen[0]; if (k === undefined) return; at = first[k] + Number(event.target.value); tell(at); drawMap(); };

  /* ---- the chart of all episodes ---- */
  const chart = byId("chart"), span = { low: 0, high: all.length - 1 };
  const MEASURES = { progress_share: ["progress", "%", 100], reward: ["reward", "", 1], seconds: ["time", "s", 1], steps: ["steps", "", 1] };
  let measure = "progress_share";
  const spot = (k, width, height, top) => [44 + (width - 56) * (k - span.low) / Math.max(1, span.high - span.low),
    height - 24 - (height - 36) * Math.max(0, (E[measure][k] ?? 0) * MEASURES[measure][2]) / top];
  let hovered = null, topmost = 1;
  const drawChart = () => {
    const [pen, width, height] = fit(chart), [, unit, times] = MEASURES[measure];
    topmost = measure === "progress_share" ? 100 : Math.max(1e-9, ...all.map((k) => (E[measure][k] ?? 0) * times)) * 1.05;
    pen.font = "11px system-ui, sans-serif"; pen.textAlign = "right";
    for (let k = 0; k <= 4; k += 1) {
      const y = height - 24 - (height - 36) * k / 4;
      pen.fillStyle = token("--quiet"); pen.fillText((topmost * k / 4).toPrecision(3).replace(/\.0+$/, "") + (unit ? " " + unit : ""), 40, y + 4);
      pen.strokeStyle = token("--line"); pen.beginPath(); pen.moveTo(44, y); pen.lineTo(width - 12, y); pen.stroke();
    }
    pen.textAlign = "center"; pen.fillStyle = token("--quiet");
    for (let k = 0; k <= 4; k += 1) {
      const one = Math.round(span.low + (span.high - span.low) * k / 4);
      if (all.length) pen.fillText(String(E.unique_episode[one]), Math.min(width - 18, 44 + (width - 56) * k / 4), height - 8);
    }
    for (let k = Math.ceil(span.low); k <= span.high; k += 1) {
      const [x, y] = spot(k, width, height, topmost), picked = chosen.includes(k);
      pen.beginPath();
      if (E.phase[k] !== "training") pen.rect(x - 4, y - 4, 8, 8); else pen.arc(x, y, picked || k === hovered ? 6 : 2.6, 0, 7);
      pen.fillStyle = picked ? token("--series-2") : E.complete[k] ? token("--series-3") : token("--series-1");
      pen.globalAlpha = picked || k === hovered ? 1 : 0.7; pen.fill(); pen.globalAlpha = 1;
    }
  };
  const dotAt = (x, y) => {
    const box = chart.getBoundingClientRect();
    let best = null, gap = 14 * 14;
    for (let k = Math.ceil(span.low); k <= span.high; k += 1) {
      const [px, py] = spot(k, box.width, box.height, topmost), far = (px - x) ** 2 + (py - y) ** 2;
      if (far < gap) [best, gap] = [k, far];
    }
    return best;
  };
  chart.addEventListener("pointermove", (event) => {
    hovered = dotAt(...place(event, chart));
    byId("dot").textContent = hovered === null ? "" : words(hovered);
    drawChart();
  });
  chart.addEventListener("click", (event) => { const k = dotAt(...place(event, chart)); if (k !== null) choose(k, event.shiftKey || event.ctrlKey || event.metaKey); });
  chart.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = chart.getBoundingClientRect(), share = Math.min(1, Math.max(0, (place(event, chart)[0] - 44) / (box.width - 56)));
    const middle = span.low + share * (span.high - span.low), times = Math.exp(0.0016 * event.deltaY);
    span.low = Math.max(0, middle - (middle - span.low) * times);
    span.high = Math.min(all.length - 1, Math.max(span.low + 4, middle + (span.high - middle) * times));
    drawChart();
  }, { passive: false });
  byId("measure").onchange = (event) => { measure = event.target.value; drawChart(); };
  byId("all-episodes").onclick = () => { span.low = 0; span.high = all.length - 1; drawChart(); };
  const words = (k) => t("Episode {episode} ({phase}, iteration {iteration}): {progress} % in {seconds} s, reward {reward}, {status}", {
    episode: E.unique_episode[k], phase: E.phase[k], iteration: E.iteration[k], progress: (100 * E.progress_share[k]).toFixed(1),
    seconds: E.seconds[k].toFixed(2), reward: E.reward[k].toFixed(1), status: (E.status[k] || "").replace("_", " ") });

  /* ---- the list of episodes ---- */
  const ORDERS = {
    fastest: (a, b) => (E.complete[b] - E.complete[a]) || (E.complete[a] ? E.seconds[a] - E.seconds[b] : E.progress_share[b] - E.progress_share[a]),
    farthest: (a, b) => E.progress_share[b] - E.progress_share[a], reward: (a, b) => E.reward[b] - E.reward[a],
    latest: (a, b) => b - a, earliest: (a, b) => a - b,
  };
  let order = "fastest", kind = "all";
  const list = () => {
    const shown = all.filter((k) => E.ticks[k] && (kind === "all" || (kind === "full" ? E.complete[k] : E.phase[k] === kind))).sort(ORDERS[order]).slice(0, 150);
    byId("rows").innerHTML = shown.map((k) => `<tr data-k="${k}" tabindex="0"${chosen.includes(k) ? ' class="on"' : ""}><td>${E.unique_episode[k]}</td>` +
      `<td class="right">${E.iteration[k]}</td><td class="right">${(100 * E.progress_share[k]).toFixed(1)}</td><td class="right">${E.seconds[k].toFixed(2)}</td>` +
      `<td class="right">${E.reward[k].toFixed(1)}</td><td>${(E.status[k] || "").replace("_", " ")}</td></tr>`).join("");
  };
  const pick = (event) => {
    const row = event.target.closest("tr[data-k]");
    if (row) choose(Number(row.dataset.k), event.shiftKey || event.ctrlKey || event.metaKey || byId("several").checked);
  };
  byId("rows").addEventListener("click", pick);
  byId("rows").addEventListener("keydown", (event) => { if (event.key === "Enter") pick(event); });
  byId("order").onchange = (event) => { order = event.target.value; list(); };
  byId("kind").onchange = (event) => { kind = event.target.value; list(); };
  const choose = (k, too) => {
    if (!E.ticks[k]) { byId("told").textContent = `${words(k)}. ${t("Its steps are not on this page, which holds the fastest and latest only.")}`; return; }
    chosen = too ? (chosen.includes(k) ? chosen.filter((one) => one !== k) : [...chosen, k]) : [k];
    if (playing) play();
    at = pointed = null;
    byId("step").max = String(Math.max(0, (E.ticks[chosen[0]] || 1) - 1)); byId("step").value = "0";
    byId("told").textContent = chosen.length ? chosen.slice(0, 3).map(words).join("; ") : t("Choose an episode.");
    document.querySelectorAll("#rows tr").forEach((row) => row.classList.toggle("on", chosen.includes(Number(row.dataset.k))));
    drawMap(); drawChart();
  };
  byId("clear").onclick = () => { chosen = []; at = pointed = null; byId("told").textContent = t("Choose an episode."); drawMap(); drawChart(); list(); };
  const again = () => { whole(); drawMap(); drawChart(); };
  window.addEventListener("resize", again);
  whole();
  const start = all.filter((k) => E.ticks[k]).sort(ORDERS.fastest)[0];
  list();
  if (start !== undefined) choose(start, false);
  again();
  onTokens(() => { drawMap(); drawChart(); });
})();
