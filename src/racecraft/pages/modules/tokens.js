/* Values of tokens.css for what is drawn: looked up once, and again when light turns into dark, or the page goes to paper. */
let known = new Map();
export const token = name => {
  if (!known.has(name)) known.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return known.get(name);
};

const listeners = new Set();
/* Call a function whenever the tokens change; returns what ends that. */
export function onTokens(redraw) { listeners.add(redraw); return () => listeners.delete(redraw); }
const changed = () => { known = new Map(); listeners.forEach(redraw => redraw()); };
for (const media of ["(prefers-color-scheme: dark)", "print"]) matchMedia(media).addEventListener("change", changed);
new MutationObserver(changed).observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
