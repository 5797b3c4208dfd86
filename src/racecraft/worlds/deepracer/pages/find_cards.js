/* Cards found by name while one types. */
const field = document.getElementById("find-cards"), cards = [...document.querySelectorAll("[data-words]")];
field.addEventListener("input", () => {
  const words = field.value.toLowerCase().split(/\s+/);
  let left = 0;
  for (const card of cards) { card.hidden = !words.every(word => card.dataset.words.includes(word)); left += +!card.hidden; }
  document.getElementById("cards-left").textContent = `${left} ${left === 1 ? "track" : "tracks"}`;
});
