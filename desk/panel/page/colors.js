// The colours of the scheme that the reader likes, as the style sheet has them. To ask it for one is slow.

const scheme = matchMedia("(prefers-color-scheme: dark)");
let known = new Map();

export function color(name) {
  if (!known.has(name)) known.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return known.get(name);
}

// Calls it whenever the scheme changes.
export function onScheme(redraw) {
  scheme.addEventListener("change", () => {
    known = new Map();
    redraw();
  });
}
