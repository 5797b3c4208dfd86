/* Texts of modules in the reader's language: t called with "{count} drives" and { count: 3 }. The page holds the catalogue. */
const catalogue = JSON.parse(document.querySelector("#texts script")?.textContent ?? "{}");

export const t = (text, values = {}) => (catalogue[text] ?? text).replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
