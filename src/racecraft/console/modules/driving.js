/* The heat that is driven now, in a part with `data-driving="RACE"`. */

/** @param {Record<string, {racers: string[], share: number, text: string}>} told heats by race */
export function showDriving(told) {
  const place = /** @type {HTMLElement | null} */ (document.querySelector("[data-driving]"));
  if (!place) return;
  const now = told[place.dataset.driving || ""];
  place.hidden = !now;
  if (!now) return;
  place.querySelector("b").textContent = now.racers.join(" against ");
  place.querySelector("span").textContent = now.text;
  place.querySelector("progress").value = now.share;
}
